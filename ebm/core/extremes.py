"""The extremes of a run, or its strikes alone, kept while it is played where its control asks.

A corner's place, the slip and the height of a hop are linear in the series of a step, as a guard
is. Within a step they are largest at its ends or where their rate turns; a bound comes first, a
root is looked for only where the bound does not exclude one. While the block rocks, every corner's
place is monotone in the rotation, so that only this is looked at, and a step in which it does not
turn need not be met at its end. Natural units.

The place of a corner is told *outward*: how far it is, toward its own side, from the mass's centre
as it first stood. That of the corner at height z over the mass's centre on the side `sign` (+1
left) is arm cos(theta) - sign x + sign z sin(theta).
"""

import math

import numpy as np

from rockcheck.ebm.core import lanes, series
from rockcheck.ebm.core.block import arm_of, height_of, side_of
from rockcheck.ebm.core.contacts import CLOSED, SLOW
from rockcheck.ebm.core.motion import motion_at
from rockcheck.ebm.core.names import Family, Guard, Kind, Pivot, Row
from rockcheck.ebm.core.state import mode_code, rocks, stands_still
from rockcheck.scenes.compiled import called_kernel, inner_kernel

#: Positions that differ by less are the same.
_ROUNDING = series.NOISE[Kind.POSITION]


@inner_kernel
def begin(block, state):
    """Begins a record with the motion at the start."""
    extremes = state.extremes
    extremes.tops[:], extremes.bottoms[:] = -np.inf, -np.inf
    extremes.first[:] = np.nan
    extremes.uplift = extremes.slips = np.nan
    extremes.upright = state.motion.theta == 0.0
    meet(block, state, state.motion, 0.0)
    for i in range(2):
        extremes.start[i] = extremes.tops[i, 0]


@inner_kernel
def _sign(i):
    """The sign of the rotation to a side: 1 to the left (0), -1 to the right (1)."""
    return 1.0 - 2.0 * i


@inner_kernel
def _outward(block, i, x, sine, cosine):
    """How far outward the top and the bottom corner of a side are."""
    sign = _sign(i)
    middle = side_of(block, sign).arm * cosine - sign * x
    return middle + sign * block.top * sine, middle - sign * block.height * sine


@called_kernel
def meet(block, state, motion, t):
    """Takes a motion at time t into the record."""
    extremes, theta = state.extremes, motion.theta
    sine, cosine = math.sin(theta), math.cos(theta)
    for i in range(2):
        top, bottom = _outward(block, i, motion.x, sine, cosine)
        extremes.tops[i, 0] = max(extremes.tops[i, 0], top)
        extremes.tops[i, 1] = max(extremes.tops[i, 1], -top)
        extremes.bottoms[i] = max(extremes.bottoms[i], bottom)
        if _sign(i) * theta > extremes.turned[i]:
            extremes.turned[i], extremes.turned_at[i] = _sign(i) * theta, t
    slip, lift = _slip_and_lift(block, motion)
    extremes.last_slip = slip
    extremes.slip = max(extremes.slip, abs(slip))
    extremes.hop = max(extremes.hop, lift)


@inner_kernel
def _slip_and_lift(block, motion):
    """How far the lower corner is from its first place along the floor, and how high over it."""
    if motion.theta == 0.0:
        return motion.x, motion.y - block.height
    sign = math.copysign(1.0, motion.theta)
    side = side_of(block, sign)
    phi = abs(motion.theta)
    slip = motion.x + sign * (side.arm - arm_of(side, phi))
    return slip, motion.y - height_of(side, phi)


@called_kernel
def follow(block, run, began):
    """Takes the step that began then, and has been played to its end, into the record."""
    state, mode = run.state, run.state.mode
    _note_first(state, began)
    if rocks(mode):
        if _may_turn(run):
            for sign in (1.0, -1.0):
                _combine(run.a, constant=0.0, of_phi=sign, of_s=0.0, of_c=0.0, of_xi=0.0, of_y=0.0)
                _look(block, run, began, -np.inf)
        elif state.guard == Guard.NONE and state.t < state.quiet_from:
            return  # An arc is met at its ends; on a quiet base what is known decides when it ends.
    elif mode.family == Family.TILT and not stands_still(mode):
        _follow_tilted(block, run, began)
    elif mode.family == Family.FLAT and mode.pivot == Pivot.OFF:
        for sign in (1.0, -1.0):
            _combine(run.a, 0.0, 0.0, 0.0, 0.0, sign, 0.0)
            _look(block, run, began, -np.inf)
        _combine(run.a, -block.height, 0.0, 0.0, 0.0, 0.0, 1.0)
        _look(block, run, began, state.extremes.hop)
    meet(block, state, state.motion, state.t)


@inner_kernel
def _may_turn(run):
    """Whether the rate of rotation may change its sign in the step."""
    state, a = run.state, run.a
    sign = math.copysign(1.0, a[Row.OMEGA, 0])
    low, high = series.halves(a, Row.OMEGA, state.order - 1)
    return (
        not sign * a[Row.OMEGA, 0] + series.least_change(low * sign, high * sign, state.tau) > 0.0
    )


@inner_kernel
def _note_first(state, began):
    """Notes the first uplift and the first slip."""
    mode, extremes = state.mode, state.extremes
    tilts = mode.family == Family.TILT
    if tilts and extremes.upright and math.isnan(extremes.uplift):
        extremes.uplift = began
    extremes.upright = not tilts
    slips = mode_code(state) % 2 == 1
    if slips and math.isnan(extremes.slips):
        extremes.slips = began


@inner_kernel
def _follow_tilted(block, run, began):
    """Looks within a step of a tilted block that does not only rock.

    sin(phi) and cos(phi) are combined of the sine and cosine that the series have, s = a cos(phi) -
    h sin(phi) and c = h cos(phi) + a sin(phi) with the pivot's arm a and height h.
    """
    mode, extremes, a = run.state.mode, run.state.extremes, run.a
    pivot, height, top = side_of(block, mode.sense), block.height, block.top
    square = pivot.radius * pivot.radius
    tip = 0 if mode.sense > 0 else 1
    _combine(a, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    _look(block, run, began, extremes.turned[tip])
    for other in range(2):
        sigma, i = _sign(other), tip if other == 0 else 1 - tip
        arm = side_of(block, sigma * mode.sense).arm
        of_s = (arm * pivot.arm - sigma * top * height) / square
        of_c = (arm * height + sigma * top * pivot.arm) / square
        for inward in range(2):
            sign = _sign(inward)
            _combine(a, 0.0, 0.0, sign * of_s, sign * of_c, -sigma * sign, 0.0)
            _look(block, run, began, extremes.tops[i, inward])
    arm = side_of(block, -mode.sense).arm
    of_s = (arm * pivot.arm - height * height) / square
    of_c = (arm * height + height * pivot.arm) / square
    _combine(a, 0.0, 0.0, of_s, of_c, 1.0, 0.0)
    _look(block, run, began, extremes.bottoms[1 - tip])
    if mode.pivot != Pivot.STICK:
        for sign in (1.0, -1.0):
            _combine(a, sign * pivot.arm, 0.0, -sign, 0.0, sign, 0.0)
            _look(block, run, began, extremes.slip)
    if mode.pivot == Pivot.OFF:
        _combine(a, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0)
        _look(block, run, began, extremes.hop)


@inner_kernel
def _combine(a, constant, of_phi, of_s, of_c, of_xi, of_y):
    """Writes a combination of series into the workspace. One without weight need not be there."""
    for half in (0, lanes.LANES):
        total = lanes.zeros()
        if of_phi != 0.0:
            total = total + of_phi * lanes.load(a, Row.PHI, half)
        if of_s != 0.0:
            total = total + of_s * lanes.load(a, Row.SIN, half)
        if of_c != 0.0:
            total = total + of_c * lanes.load(a, Row.COS, half)
        if of_xi != 0.0:
            total = total + of_xi * lanes.load(a, Row.XI, half)
        if of_y != 0.0:
            total = total + of_y * lanes.load(a, Row.Y, half)
        lanes.store(a, Row.WATCHED, half, total)
    a[Row.WATCHED, 0] += constant


@called_kernel
def _look(block, run, began, level):
    """Meets the motion where the combination in the workspace is largest, if above this level.

    The ends of the step are met anyway.
    """
    state, a = run.state, run.a
    order, tau = state.order, state.tau
    series.differentiate(a, Row.WATCHED, Row.SLOPE, order)
    if not series.may_top(a, Row.WATCHED, Row.SLOPE, order, tau, level):
        return
    _, at = series.highest(a, Row.WATCHED, Row.SLOPE, Row.GUARD, order, tau, run.stack)
    motion_at(block, state, a, at, state.sampled)
    meet(block, state, state.sampled, began + at)


@inner_kernel
def approach(block, state):
    """Notes how fast a corner that touches a wall comes toward it; the impact is yet to come."""
    motion = state.motion
    sine, cosine = math.sin(motion.theta), math.cos(motion.theta)
    for i in range(2):
        sign = _sign(i)
        side = side_of(block, sign)
        top, bottom = _outward(block, i, motion.x, sine, cosine)
        away = -sign * motion.vx - side.arm * sine * motion.w
        fastest = 0.0
        for place, height in ((top, block.top), (bottom, -block.height)):
            if abs(side.arm + side.gap - place) < CLOSED:
                fastest = max(fastest, away + sign * height * cosine * motion.w)
        state.extremes.approach[i] = fastest


@inner_kernel
def struck(state):
    """Notes the impact that has been resolved at each wall that a corner came toward."""
    extremes = state.extremes
    for i in range(2):
        if extremes.approach[i] > SLOW:
            if extremes.strikes[i] == 0:
                extremes.first[i] = state.t
            extremes.strikes[i] += 1
            extremes.speed[i] = max(extremes.speed[i], extremes.approach[i])
            extremes.impulse[i] = max(extremes.impulse[i], state.wall_impulse[i])


@inner_kernel
def has_met(block, extremes, x, theta):
    """Whether the record would not change by an upright or rocking block that gets there."""
    sine, cosine = math.sin(theta), math.cos(theta)
    for i in range(2):
        top, bottom = _outward(block, i, x, sine, cosine)
        known = (
            top <= extremes.tops[i, 0] + _ROUNDING
            and -top <= extremes.tops[i, 1] + _ROUNDING
            and bottom <= extremes.bottoms[i] + _ROUNDING
            and _sign(i) * theta <= extremes.turned[i]
        )
        if not known:
            return False
    return True


@inner_kernel
def reaches_wall(block, x, theta):
    """Whether a block that gets there touches a wall."""
    sine, cosine = math.sin(theta), math.cos(theta)
    for i in range(2):
        side = side_of(block, _sign(i))
        top, bottom = _outward(block, i, x, sine, cosine)
        if max(top, bottom) > side.arm + side.gap - CLOSED:
            return True
    return False
