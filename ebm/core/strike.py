"""Resolves an impact: on the floor, on a wall, or at all contacts that touch at one instant.

The bilateral pivot follows the paper's laws (`impacts`), one impact at a time. With the unilateral
one every contact that touches takes part (`contact_impacts`). Either way slow rebounds end by the
Zeno rule (ebm.core.settle). Natural units.
"""

import math

import numpy as np

from rockcheck.ebm.core import contacts, extremes, impacts, modes
from rockcheck.ebm.core.block import arm_of, height_of, side_of, wall_corner
from rockcheck.ebm.core.contact_impacts import contact_impact
from rockcheck.ebm.core.contact_sets import ROUNDING
from rockcheck.ebm.core.names import CONTACTS, Contact, Event, Family, Guard, Keep, Pivot, Rule
from rockcheck.ebm.core.settle import SETTLE
from rockcheck.ebm.core.state import on_wall, rock_on
from rockcheck.scenes.compiled import called_kernel, inner_kernel

# The event of the impact at each gap that may close, a Guard.
_EVENTS = np.full(Guard.FAR_GAP + 1, Event.WALL_IMPACT, dtype=np.int64)
_EVENTS[Guard.PHI], _EVENTS[Guard.LANDING] = Event.FLOOR_IMPACT, Event.LANDS


@inner_kernel
def strike(block, base, run, resting):
    """Resolves the impact at the gap that has closed: its event, and whether the mode is known.

    A known mode is already the one that follows. Rebounds slower than `resting` end in rest.
    """
    state, mode, motion = run.state, run.state.mode, run.state.motion
    which = state.guard
    touch(block, mode, motion, which)
    if which == Guard.FAR_GAP and _lands_along(block, state):
        state.rules[Rule.LANDS_ALONG] += 1
        which = Guard.PHI
    if which == Guard.PHI:
        floor = mode.pivot != Pivot.OFF or contacts.closed_floor(block, motion)
        contacts.land_upright(block, motion, float(mode.sense), floor)
    state.event = _EVENTS[which]
    state.wall_impulse[:] = 0.0
    if state.control.keeps != Keep.NOTHING:
        extremes.approach(block, state)
    if block.unilateral:
        _strike_all(block, base, run, resting)
    elif state.event == Event.WALL_IMPACT:
        _wall_impact(block, state, which == Guard.TIP_GAP, resting)
    else:
        _floor_impact(block, state, resting)
    if state.control.keeps != Keep.NOTHING:
        extremes.struck(state)
    if not state.known and not block.unilateral:
        contacts.stand_if_slow(block, motion)
    if motion.theta == 0.0 and abs(motion.w) < SETTLE:
        _settle_flat(block, state, resting)
        state.known = False


@inner_kernel
def _lands_along(block, state):
    """Whether a block that closes its far gap lands there.

    Near phi = 0 the far gap goes with phi^2, so that its root says phi to the square root of
    rounding only. Not where the pivot slips by more than rounding until it has landed.
    """
    mode, motion = state.mode, state.motion
    upright = mode.family == Family.TILT and motion.theta * motion.theta < contacts.CLOSED
    return (
        upright
        and mode.sense * motion.w < 0.0
        and abs(contacts.slip_velocity(block, motion) * motion.theta)
        < contacts.CLOSED * abs(motion.w)
        and contacts.closed_floor(block, motion)
    )


@inner_kernel
def touch(block, mode, motion, which):
    """Puts the block onto the contact whose gap has just closed.

    The series knows the gap to the tolerance only. A standing pivot keeps its place if the rotation
    can take up the correction. Otherwise the pivot would creep, impact by impact. It stands after
    it, too: else it would approach the floor, or leave it, by as much as the correction.
    """
    phi = abs(motion.theta)
    if which == Guard.LANDING:
        motion.y = contacts.height(block, motion)
    elif which == Guard.TIP_GAP and mode.family == Family.TILT and mode.pivot == Pivot.STICK:
        sign, side = float(mode.sense), side_of(block, mode.sense)
        pivot = sign * motion.x - arm_of(side, phi)
        arms = height_of(side, phi) + side.top_radius * math.cos(side.top_alpha + phi)
        turned = phi + contacts.wall_gap(block, motion, mode.sense) / arms
        if turned > 0.0:
            s, c = arm_of(side, turned), height_of(side, turned)
            motion.x, motion.y, motion.theta = sign * (pivot + s), c, sign * turned
            motion.vx, motion.vy = -c * motion.w, s * sign * motion.w
        else:  # past upright it would stand on its other corner, without an impact
            motion.x -= sign * contacts.wall_gap(block, motion, mode.sense)
    elif which == Guard.TIP_GAP or which == Guard.FAR_GAP:
        side = mode.sense if which == Guard.TIP_GAP else -mode.sense
        motion.x -= side * contacts.wall_gap(block, motion, side)


@inner_kernel
def _settle_flat(block, state, resting):
    """An upright block with a spin below the settling speed lies flat.

    Along a wall such a spin is a slip, too, and is dropped with it.
    """
    motion = state.motion
    state.rules[Rule.SETTLES] += 1
    v = contacts.slip_velocity(block, motion)
    motion.vx = v if abs(v) > max(resting, 4.0 * SETTLE) else 0.0
    motion.w = 0.0
    if abs(contacts.floor_gap(block, motion)) < contacts.CLOSED and motion.vy < resting:
        motion.vy = 0.0


@inner_kernel
def _push_by_wall(state, side, impulse):
    """Notes the normal impulse of the wall on this side."""
    state.wall_impulse[0 if side > 0 else 1] = impulse


@inner_kernel
def _floor_impact(block, state, resting):
    """Bilateral pivot: the block lands at theta = 0."""
    mode, motion = state.mode, state.motion
    w1, v1 = motion.w, contacts.slip_velocity(block, motion)
    S1, c = mode.sense, block.height
    s1, s2 = side_of(block, S1).arm, side_of(block, -S1).arm
    if on_wall(mode):  # from LADDER: every contact plastic, flush rest
        state.impulse = abs(motion.vy)
        contacts.stop(motion)
        return
    if contacts.wall_gap(block, motion, -S1) < contacts.CLOSED:
        # Flush with the wall toward which it would rock: the closed branch of "moreau" (the paper
        # is silent).
        state.rules[Rule.FLUSH_LANDING] += 1
        e = side_of(block, -S1).e
        state.impulse = (1.0 + e) * s1 * abs(w1)
        before = motion.vx
        motion.w = -e * w1 if e * abs(w1) > resting else 0.0
        motion.vx = (-e * v1 if S1 * v1 > 0.0 else v1) - c * motion.w
        # The closed branch leaves to the wall all that turns the block back.
        _push_by_wall(state, -S1, abs(motion.vx - before))
        motion.vy = S1 * s1 * motion.w
        return
    mu_s = block.mu_s if not block.no_slip else np.inf
    form, w2, v2, p = impacts.floor_impact(block, S1, w1, v1, mu_s, block.mu_k)
    state.impulse = p
    motion.w, motion.vx, motion.vy = w2, v2 - c * w2, -S1 * s2 * w2
    if form == impacts.Landing.HELD_FAST and abs(w2) > SETTLE:
        rock_on(state, -S1)


@inner_kernel
def _wall_impact(block, state, tip, resting):
    """Bilateral pivot: a corner (case I, II) or the side (case III) strikes a wall."""
    mode, motion = state.mode, state.motion
    side = mode.sense if tip else -mode.sense
    # Wedged: between both walls at once nothing rebounds.
    gaps = contacts.wall_gap(block, motion, 1) + contacts.wall_gap(block, motion, -1)
    if gaps < contacts.CLOSED or on_wall(mode):
        state.rules[Rule.WEDGED] += 1
        state.impulse = abs(motion.vx)
        _push_by_wall(state, side, state.impulse)
        contacts.stop(motion)
        return
    e = side_of(block, side).e
    if mode.family == Family.FLAT:
        state.impulse = (1.0 + e) * abs(motion.vx)
        _push_by_wall(state, side, state.impulse)
        motion.vx = -e * motion.vx if e * abs(motion.vx) > resting else 0.0
    else:
        _corner_impact(block, state, 1.0 if tip else -1.0, e, resting)


@inner_kernel
def _corner_impact(block, state, sw, e, resting):
    """The paper's cascade for the corner at the tip wall (sw = 1) or the far wall (-1).

    It works in the pivot's frame.
    """
    mode, motion = state.mode, state.motion
    phi, sign = abs(motion.theta), float(mode.sense)
    side, other = side_of(block, mode.sense), side_of(block, -mode.sense)
    s, c = arm_of(side, phi), height_of(side, phi)
    radius, alpha = wall_corner(side if sw > 0.0 else other, sw > 0.0)
    cp = radius * math.cos(alpha + phi)
    w1, xdot1 = sign * motion.w, sign * motion.vx
    before = xdot1 * xdot1 + (s * w1) ** 2 + w1 * w1 / block.spin
    corner = impacts.Corner(1.0, sw, s, c, sw * cp, side.share, block.spin)
    branch, w2, xdot2, n, p, v2 = impacts.wall_impact(block, corner, e, w1, xdot1)
    state.impulse = abs(p) + n
    _push_by_wall(state, sw * sign, n)
    after = xdot2 * xdot2 + (s * w2) ** 2 + w2 * w2 / block.spin
    if after > before * (1.0 + 10.0 * ROUNDING):
        state.gains += 1
        state.largest_gain = max(state.largest_gain, after / before - 1.0)
    C = corner.C
    stays = e == 0.0 and branch != impacts.Branch.B_STICK and branch != impacts.Branch.E_SLIP
    stays = stays or sw * (xdot2 - C * w2) < resting
    if stays:
        xdot2 = C * w2
    if abs(xdot2 + c * w2) < contacts.slowest(w2):
        xdot2 = -c * w2
    motion.w, motion.vx, motion.vy = sign * w2, sign * xdot2, s * w2
    # Its side: the other corner follows.
    flush = phi == 0.0 and stays and -resting < sw * xdot2 + c * w2 < 0.0
    if (block.no_slip and stays) or flush:
        contacts.stop(motion)
    if not stays and v2 == 0.0:
        rock_on(state, mode.sense)


@called_kernel
def _strike_all(block, base, run, resting):
    """Unilateral pivot: resolves all contacts touched at this instant."""
    state, mode, motion, impact = run.state, run.state.mode, run.state.motion, run.state.impact
    # That of a flat block is the one in which a selection calculates.
    flat_block = mode.family == Family.FLAT
    sense = (modes.favoured(block, base, state) or 1) if flat_block else mode.sense
    sign = float(sense)
    flat = motion.theta == 0.0
    floor = abs(contacts.floor_gap(block, motion)) < contacts.CLOSED
    tip = abs(contacts.wall_gap(block, motion, sign)) < contacts.CLOSED
    far = abs(contacts.wall_gap(block, motion, -sign)) < contacts.CLOSED
    touching, v = impact.touching, impact.v
    for j in range(CONTACTS):
        touching[j] = (floor, tip, far)[j // 2] and (flat or j % 2 == 0)
    v[0], v[1], v[2] = sign * motion.vx, motion.vy, sign * motion.w
    slower = v[1] + max(side_of(block, -sign).arm * v[2], -side_of(block, sign).arm * v[2])
    state.rules[Rule.FLAT_LANDING] += flat and floor and slower < -contacts.SLOW
    impact.sense, impact.phi, impact.resting = sign, abs(motion.theta), resting
    impact.e_tip, impact.e_far = side_of(block, sign).e, side_of(block, -sign).e
    if tip and far:
        state.rules[Rule.WEDGED] += 1
        impact.e_tip = impact.e_far = 0.0
    contact_impact(block, state)
    if state.event == Event.FLOOR_IMPACT and not floor:
        state.event = Event.WALL_IMPACT  # in flight along a wall it turns flush against it
    given = impact.given
    _push_by_wall(state, sign, given[Contact.TIP_TOP] + given[Contact.TIP_BOTTOM])
    _push_by_wall(state, -sign, given[Contact.FAR_BOTTOM] + given[Contact.FAR_TOP])
    motion.vx, motion.vy, motion.w = sign * v[0], v[1], sign * v[2]
    if floor:
        contacts.stand_if_slow(block, motion)
