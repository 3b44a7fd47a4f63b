"""The guards of a mode: what must not turn negative as long as it lasts.

Contact forces that push, friction inside the cone, slip that keeps its direction, open contacts
that stay open. A guard is a linear combination of the series of a step (positions and forces) or of
their rates; GUARDS lists them, and a table in the workspace holds the weights that a mode gives
them. The first root of a guard is an event; the signs with which they leave zero select the mode
(see ebm.core.modes).
"""

from __future__ import annotations

import math

import numpy as np

from rockcheck.ebm.core.contacts import CLOSED, SLOW, closed_gap
from rockcheck.ebm.core.lanes import (
    LANES,
    above,
    falls,
    load,
    powers,
    ramp,
    store,
    total,
    upto,
    zeros,
)
from rockcheck.ebm.core.motion import LEAST_FRICTION, delta, side_of, wall_turn
from rockcheck.ebm.core.names import GUARDS, Family, Guard, Kind, Pivot, Row
from rockcheck.ebm.core.series import (
    AHEAD,
    INSTANT,
    NO_ROOT,
    NOISE,
    eighth,
    first_root,
    halves,
    leads_up,
    least_change,
    slope,
    value,
)
from rockcheck.ebm.core.state import on_wall, rocks
from rockcheck.scenes.compiled import inner_kernel

# What a guard is; a rate is the rate of its combination.
KIND = np.array(
    (Kind.POSITION,) * 5 + (Kind.FORCE,) * 5 + (Kind.RATE,) + (Kind.FORCE,) * 2 + (Kind.POSITION,)
)
# The series that a guard can combine. The guard itself fills the empty places: it has no weight.
_COMBINES = np.array(
    [(Row.PHI, Row.GUARD, Row.GUARD)] * 2
    + [(Row.COS, Row.Y, Row.GUARD)]
    + [(Row.SIN, Row.COS, Row.XI)] * 2
    + [(Row.P, Row.GUARD, Row.GUARD), (Row.Q, Row.NA, Row.GUARD), (Row.NB, Row.GUARD, Row.GUARD)]
    + [(Row.P, Row.Q, Row.GUARD)] * 2
    + [(Row.PHI, Row.SIN, Row.XI)]
    + [(Row.P, Row.Q, Row.GUARD)] * 2
    + [(Row.GUARD, Row.GUARD, Row.GUARD)]
)
_MOST = 3
# The columns of the table: the weight of each series, a constant, and how many terms fewer than the
# order the guard has (-1: no guard).
_CONSTANT, _SHORTER = 30, 31
#: A force is the second derivative of a truncated series: its zero is found to rounding from nearby
#: only, within this share of a step.
_NEARBY = 0.25
#: The weight with which the noise of forces hides no base acceleration: nothing is rounded in it.
#: Its square is a number, too.
_ANY = 2.0**400


@inner_kernel
def _has(a, which, shorter):
    """Enters a guard into the table: so many terms shorter than the series, its weights and its
    constant still zero."""
    row = Row.TABLE + which
    for k in range(_MOST):
        a[row, _COMBINES[which, k]] = 0.0
    a[row, _CONSTANT], a[row, _SHORTER] = 0.0, shorter


@inner_kernel
def drop(a, which):
    """Removes a guard from the table."""
    a[Row.TABLE + which, _SHORTER] = -1.0


@inner_kernel
def fill_guards(block, run):
    """Writes the guards of the mode into the table."""
    mode, a = run.state.mode, run.a
    for which in range(GUARDS):
        drop(a, which)
    if mode.family == Family.FLAT:
        _fill_flat(block, mode, a)
        return
    _has(a, Guard.PHI, 0)
    a[Row.TABLE + Guard.PHI, Row.PHI] = 1.0
    if (
        a[Row.PHI, 0] >= 0.5 or mode.pivot == Pivot.OFF
    ):  # else no step on the floor is long enough to turn the block over
        _has(a, Guard.TOPPLE, 0)
        a[Row.TABLE + Guard.TOPPLE, Row.PHI], a[Row.TABLE + Guard.TOPPLE, _CONSTANT] = (
            -1.0,
            0.5 * math.pi,
        )
    if mode.pivot == Pivot.OFF:
        _has(a, Guard.LANDING, 0)
        a[Row.TABLE + Guard.LANDING, Row.Y], a[Row.TABLE + Guard.LANDING, Row.COS] = 1.0, -1.0
    else:
        _fill_friction(block, mode, block.mu_s * mode.pull, a)
    if mode.pivot == Pivot.SLIPPING:
        _has(a, Guard.SLIP, 1)
        along_wall = on_wall(mode)
        # Along a wall V = (c + C) dtheta/dt, and C = -c at theta = 0: the rotation tells the sense
        # of slip everywhere.
        a[Row.TABLE + Guard.SLIP, Row.PHI if along_wall else Row.XI] = mode.slip
        a[Row.TABLE + Guard.SLIP, Row.SIN] = 0.0 if along_wall else -mode.slip
    if block.walls:
        _fill_gap(block, run, True)
        _fill_gap(block, run, False)
        if mode.tip != 0:
            _has(a, Guard.TIP_PUSH, 2)
            a[Row.TABLE + Guard.TIP_PUSH, Row.NA] = 1.0
        if mode.far != 0:
            _has(a, Guard.FAR_PUSH, 2)
            a[Row.TABLE + Guard.FAR_PUSH, Row.NB] = 1.0


@inner_kernel
def _fill_friction(block, mode, mu, a):
    """The floor's push, and the two sides of the friction cone |Q| <= mu P."""
    if block.unilateral or mode.pivot == Pivot.SLIPPING:
        _has(a, Guard.FLOOR_PUSH, 2)
        a[Row.TABLE + Guard.FLOOR_PUSH, Row.P] = mode.pull
    if mode.pivot == Pivot.STICK and not block.no_slip:
        _has(a, Guard.CONE_PLUS, 2)
        _has(a, Guard.CONE_MINUS, 2)
        a[Row.TABLE + Guard.CONE_PLUS, Row.P] = a[Row.TABLE + Guard.CONE_MINUS, Row.P] = mu
        a[Row.TABLE + Guard.CONE_PLUS, Row.Q], a[Row.TABLE + Guard.CONE_MINUS, Row.Q] = -1.0, 1.0


@inner_kernel
def _fill_gap(block, run, tip):
    """The clear gap of the corner that faces the tip wall, +-xi + delta - s', or the far wall."""
    mode, pivot, a = run.state.mode, run.state.place, run.a
    which = Guard.TIP_GAP if tip else Guard.FAR_GAP
    distance = delta(block, mode, tip)
    if (mode.tip if tip else mode.far) != 0 or distance == np.inf:
        return
    sense = 1.0 if tip else -1.0
    rock = rocks(mode)
    if rock and not tip and distance - pivot - (block.left.arm + block.right.arm) > -CLOSED:
        # About a fixed pivot the far gap shrinks with phi, down to this value as the block lands:
        # it cannot close before.
        return
    _has(a, which, 0)
    row, side = Row.TABLE + which, side_of(block, mode.sense)
    along, across = wall_turn(side, tip)
    a[row, Row.COS], a[row, Row.SIN], a[row, _CONSTANT] = -along, across, distance
    if rock:  # xi is s and a constant
        a[row, Row.SIN] += sense
        a[row, _CONSTANT] += sense * pivot
    else:
        a[row, Row.XI] = sense


@inner_kernel
def _fill_flat(block, mode, a):
    """The guards of a translating block; the tip wall is the left one, the far wall the right
    one."""
    walls = on_wall(mode)
    hangs = mode.pivot != Pivot.OFF and mode.pull < 0  # a floor that pulls at what a wall holds
    for wall in (Guard.TIP_GAP, Guard.FAR_GAP):
        gap = block.gap_left if wall == Guard.TIP_GAP else block.gap_right
        if gap < np.inf and (mode.tip if wall == Guard.TIP_GAP else mode.far) == 0:
            _has(a, wall, 0)
            a[Row.TABLE + wall, Row.XI] = 1.0 if wall == Guard.TIP_GAP else -1.0
            a[Row.TABLE + wall, _CONSTANT] = gap
    if mode.tip != mode.far and (
        mode.pivot == Pivot.OFF or hangs
    ):  # on the floor, Q is the base acceleration that the wall takes
        _has(a, Guard.TIP_PUSH, 2)
        a[Row.TABLE + Guard.TIP_PUSH, Row.NA if mode.pivot == Pivot.OFF else Row.Q] = (
            1.0 if mode.pivot == Pivot.OFF else mode.tip - mode.far
        )
    if mode.pivot == Pivot.OFF:
        _has(a, Guard.LANDING, 0)
        a[Row.TABLE + Guard.LANDING, Row.Y], a[Row.TABLE + Guard.LANDING, _CONSTANT] = (
            1.0,
            -block.height,
        )
        return
    if mode.pivot == Pivot.SLIPPING:
        _has(a, Guard.SLIP, 1)
        a[Row.TABLE + Guard.SLIP, Row.XI] = mode.slip
    if (
        block.mu_s == LEAST_FRICTION
    ):  # a force below rounding, which is to stay what it is where P vanishes
        _fill_friction(block, mode, 0.0, a)
        a[Row.TABLE + Guard.CONE_PLUS, _CONSTANT] = a[Row.TABLE + Guard.CONE_MINUS, _CONSTANT] = (
            block.mu_s
        )
    else:
        _fill_friction(block, mode, block.mu_s, a)
    drop(a, Guard.FLOOR_PUSH)
    if block.unilateral or walls or hangs:  # otherwise the paper's floor holds what no wall does
        _has(a, Guard.FLOOR_PUSH, 2)
        a[Row.TABLE + Guard.FLOOR_PUSH, Row.P] = mode.pull
    for plus in (True, False):
        held = (mode.tip if plus else mode.far) != 0
        uplift = Guard.UPLIFT_PLUS if plus else Guard.UPLIFT_MINUS
        if mode.pivot != Pivot.STICK or not held:
            # A block that hangs by both corners tips as soon as anything favours one side, however
            # little.
            hangs_flat = hangs and not walls
            _has(a, uplift, 2)
            a[Row.TABLE + uplift, Row.P] = (
                0.0 if hangs_flat else (block.left.arm if plus else block.right.arm)
            )
            a[Row.TABLE + uplift, Row.Q] = (-block.height if plus else block.height) * (
                _ANY if hangs_flat else 1.0
            )
        if held or hangs:
            drop(a, Guard.CONE_PLUS if plus else Guard.CONE_MINUS)


@inner_kernel
def _coefficients(which, half, a):
    """Eight coefficients, from `half` on, of a guard of the table, without its constant. A series
    without weight need not be there."""
    row, sum, rate = Row.TABLE + which, zeros(), KIND[which] == Kind.RATE
    for part in range(_MOST):
        series = _COMBINES[which, part]
        if a[row, series] != 0.0:
            sum = sum + a[row, series] * load(a, series, half + rate)
    return sum * (ramp() + (half + 1.0)) if rate else sum


@inner_kernel
def guard(which, order, a):
    """Writes a guard of the table into the workspace and returns its degree, or -1 where the mode
    has no such guard."""
    row = Row.TABLE + which
    if a[row, _SHORTER] < 0.0:
        return -1
    for half in (0, LANES):
        store(a, Row.GUARD, half, _coefficients(which, half, a))
    a[Row.GUARD, 0] += a[row, _CONSTANT]
    if Guard.LANDING <= which <= Guard.FAR_GAP:
        a[Row.GUARD, 0], a[Row.GUARD, 1] = closed_gap(a[Row.GUARD, 0], a[Row.GUARD, 1])
    return order - int(a[row, _SHORTER])


@inner_kernel
def _with_slack(which, slack, a):
    """The noise allowed to the guard in the workspace, in a mode with this slack. An open contact
    is not noise.

    A gap that touches without speed may close by the noise. That takes time, so that the events of
    one instant come to an end.
    """
    if KIND[which] != Kind.POSITION:
        return slack * NOISE[KIND[which]]
    if (
        slack == 1.0
        or which == Guard.PHI
        or abs(a[Row.GUARD, 0]) > CLOSED
        or a[Row.GUARD, 1] < -SLOW
    ):
        return min(slack * NOISE[Kind.POSITION], CLOSED)
    a[Row.GUARD, 0] += CLOSED
    return NOISE[Kind.POSITION]


@inner_kernel
def seen(kind, smooth):
    """How far ahead a guard of this kind is judged where the base motion is smooth for the time
    `smooth`.

    Forces follow the base acceleration at once, and the series does not know it beyond its next
    kink. Positions change little at one.
    """
    return min(AHEAD, smooth) if kind == Kind.FORCE else AHEAD


@inner_kernel
def _coefficient(which, k, a):
    """Coefficient k of a guard of the table that is no rate, without its constant."""
    row, one, two, three = (
        Row.TABLE + which,
        _COMBINES[which, 0],
        _COMBINES[which, 1],
        _COMBINES[which, 2],
    )
    return a[row, one] * a[one, k] + a[row, two] * a[two, k] + a[row, three] * a[three, k]


@inner_kernel
def starts_positive(which, ahead, a):
    """A cheap proof, without writing the guard, that it leaves zero upward, seen so far ahead; a
    mode without it has nothing to prove."""
    row = Row.TABLE + which
    if a[row, _SHORTER] < 0.0:
        return True
    if KIND[which] == Kind.RATE:
        return False
    begin = _coefficient(which, 0, a) + a[row, _CONSTANT]
    floor = (
        max(NOISE[KIND[which]], CLOSED)
        if Guard.LANDING <= which <= Guard.FAR_GAP
        else NOISE[KIND[which]]
    )
    return leads_up(begin, _coefficient(which, 1, a), _coefficient(which, 2, a), floor, ahead)


@inner_kernel
def _stays_positive(which, order, until, slack, a):
    """A cheap proof, without writing the guard, that it is positive up to a time: more so than the
    sum of all its terms that fall."""
    row = Row.TABLE + which
    if a[row, _SHORTER] < 0.0:
        return True
    if KIND[which] == Kind.RATE:
        return False
    begin, degree = a[row, _CONSTANT] + _coefficient(which, 0, a), order - int(a[row, _SHORTER])
    low, high = (
        upto(_coefficients(which, 0, a), degree),
        upto(_coefficients(which, LANES, a), degree - LANES),
    )
    fallen = total((above(falls(low), 0) + falls(high) * eighth(until)) * powers(until))
    return begin > max(slack * NOISE[KIND[which]], CLOSED) and -fallen < 0.999999 * begin


@inner_kernel
def _past_a_touch(degree, root, noise, a):
    """Where the guard in the workspace is positive again if it falls below zero by less than the
    noise, by its parabola; else the root.

    The two roots of a touch are known less well than an INSTANT apart.
    """
    begin, fall, half_bend, power = (
        value(a, Row.GUARD, degree, root),
        slope(a, Row.GUARD, degree, root),
        0.0,
        1.0,
    )
    for k in range(2, degree + 1):
        half_bend += 0.5 * k * (k - 1) * a[Row.GUARD, k] * power
        power *= root
    touches = fall < 0.0 and fall * fall < 4.0 * half_bend * (begin + noise)
    return root + max(-fall / half_bend, INSTANT) if touches else root


@inner_kernel
def first_event(run):
    """The first time within the step at which a guard ends the mode, and which; the step's length
    and Guard.NONE where none does.

    A gap that closes within an INSTANT of it is the event: contacts before forces.
    """
    state, a = run.state, run.a
    order, h, slack = state.order, state.length, state.slack
    tau, which = h, Guard.NONE
    for k in range(GUARDS):
        if _stays_positive(k, order, tau, slack, a):
            continue
        degree = guard(k, order, a)
        if degree < 0:
            continue
        noise = _with_slack(k, slack, a)
        # Compared in h, not tau: a mirror image has its guards in another order.
        root = first_root(a, Row.GUARD, degree, h, tau, noise, seen(KIND[k], h), run.stack)
        if math.isnan(root):
            tau, which = root, k
            break
        closes = 0 <= which <= Guard.FAR_GAP < k
        if root == NO_ROOT or root >= tau - (INSTANT if closes else 0.0):
            continue
        past = root
        if KIND[k] == Kind.FORCE and 0.0 < root <= _NEARBY * h:
            past = _past_a_touch(degree, root, noise, a)
        if past == root:
            tau, which = root, k
        elif past < tau:
            tau, which = past, Guard.NONE
    if which >= 0 and KIND[which] == Kind.FORCE and tau > _NEARBY * h:
        tau, which = 0.9 * tau, Guard.NONE
    state.tau, state.guard = tau, which


@inner_kernel
def rock_guards_hold(block, run):
    """A cheap proof that a rocking block keeps every guard of ROCK but Guard.PHI through a step h.
    False where it proves nothing.

    Each guard is bounded from below as in `first_root`, without being written. Inside the cone the
    floor pushes.
    """
    order, h, a = run.state.order, run.state.length, run.a
    if a[Row.PHI, 0] > 0.5:
        return False
    if block.walls:
        for which in (Guard.TIP_GAP, Guard.FAR_GAP):
            drop(a, which)
            _fill_gap(block, run, which == Guard.TIP_GAP)
            if a[Row.TABLE + which, _SHORTER] == 0.0 and not _rock_gap_holds(
                Row.TABLE + which, order, h, a
            ):
                return False
    if block.no_slip and not block.unilateral:
        return True
    mu, share = (1.0, 0.0) if block.no_slip else (block.mu_s, 1.0)
    p_low, p_high = halves(a, Row.P, order - 2)
    q_low, q_high = halves(a, Row.Q, order - 2)
    plus = least_change(mu * p_low + -share * q_low, mu * p_high + -share * q_high, h)
    minus = least_change(mu * p_low + share * q_low, mu * p_high + share * q_high, h)
    push, pull = mu * a[Row.P, 0], share * a[Row.Q, 0]
    return min(push - pull + plus, push + pull + minus) > NOISE[Kind.FORCE]


@inner_kernel
def _rock_gap_holds(row, order, h, a):
    """Whether a bound on the gap that this row of the table gives to ROCK shows it open through a
    step h."""
    along, across = a[row, Row.COS], a[row, Row.SIN]
    cos_low, cos_high = halves(a, Row.COS, order)
    sin_low, sin_high = halves(a, Row.SIN, order)
    low = least_change(along * cos_low + across * sin_low, along * cos_high + across * sin_high, h)
    return along * a[Row.COS, 0] + across * a[Row.SIN, 0] + a[row, _CONSTANT] + low > CLOSED
