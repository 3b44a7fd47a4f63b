"""Impacts where the floor can only push: Newton's restitution with Coulomb friction.

They hold at every contact that is touched. In the pivot's frame (see ebm.core.motion), natural
units. Six contacts: the pivot F and the other bottom corner E on the floor, the top and bottom
corner on the tip wall, the bottom and top corner on the far wall; E and the second corner of a wall
touch only at theta = 0.

Contacts that touch at one instant strike in *stages*, until none approaches. A law of impacts says
which contacts take part in a stage, the set A. In it the impulses p_j and the velocities u_j across
the contacts obey

    0 <= p_j  complementary to  u_j+ - e_j max(-u_j-, 0) >= 0,    |T| <= mu sum P on the floor.

- "moreau": every touching contact takes part; at an elastic wall (e = 1), where nothing rests, only
  the corners that approach. The branch "closed" follows the first of these whatever e, the branch
  "open" the second.
- "floor-first": one contact after another, in the order of neighbouring trajectories: first the
  floor, then each wall corner when it would arrive had the wall stood a little farther off.
- "leading-first", "trailing-first": as "moreau", but of two bottom corners that approach the floor
  together only one takes part, the one on the side to which the block slides or the other one. On a
  floor that does not bounce they are the limits of trajectories with a tilt to either side.

The first two differ where a block lands flush against a wall, the last two from these
where it lands flat while it slides. Rigid-body mechanics does not say which law is right there.
"""

import math

import numpy as np

from rockcheck.ebm.core.block import arm_of, height_of, side_of
from rockcheck.ebm.core.contact_sets import (
    PARALLEL,
    ROUNDING,
    close_slow,
    dot,
    kinetic_energy,
    size,
    strike_once,
)
from rockcheck.ebm.core.contacts import SLOW
from rockcheck.ebm.core.names import CONTACTS, Contact, Law, Rule
from rockcheck.scenes.compiled import called_kernel, inner_kernel
from rockcheck.scenes.named_record import record

# The horizontal part of each contact's row (see `contact_rows`).
_ALONG = np.array([0.0, 0.0, 1.0, 1.0, -1.0, -1.0, 1.0])
_MOST_STAGES = 40
_HALVINGS = 45


#: Contacts that touch at one instant, and what their stages work on.
IMPACT = record(
    # The block tips by phi to `sense`; which gaps are closed; the restitution at the tip wall and
    # the far one; the approach speed below which a contact closes for good; the velocities (xi, y,
    # phi rates), which become those after the impact.
    sense="f8",
    phi="f8",
    touching=("i1", (CONTACTS,)),
    e_tip="f8",
    e_far="f8",
    resting="f8",
    v=("f8", (3,)),
    # The contacts' rows (see `contact_rows`), and a linear system; of a trial the impulses and the
    # velocities.
    rows=("f8", (CONTACTS + 1, 3)),
    system=("f8", (3, 4)),
    lam=("f8", (3,)),
    trial=("f8", (3,)),
    # Of each contact, in this stage: its approach and its restitution, how far its next impact is,
    # whether it takes part, the velocity that it is to leave with, that of a full rebound, and its
    # impulse.
    approach=("f8", (CONTACTS,)),
    restitution=("f8", (CONTACTS,)),
    ahead=("f8", (CONTACTS,)),
    taking=("i1", (CONTACTS,)),
    target=("f8", (CONTACTS,)),
    full=("f8", (CONTACTS,)),
    part=("f8", (CONTACTS,)),
    # The velocities after the stage, and each contact's impulses in all stages so far.
    after=("f8", (3,)),
    given=("f8", (CONTACTS,)),
)


@inner_kernel
def contact_rows(b, sense, phi, walls, rows):
    """Writes rows (xi, y, phi) of the six normal contacts and, last, of the floor's tangent.

    The block tips by phi to `sense`. Without `walls` only those of the floor.
    """
    pivot, other = side_of(b, sense), side_of(b, -sense)
    c = height_of(pivot, phi)
    _write_row(rows, Contact.FOOT, -arm_of(pivot, phi))
    _write_row(rows, Contact.OTHER, arm_of(other, -phi))
    _write_row(rows, Contact.TANGENT, c)
    if walls:
        _write_row(rows, Contact.TIP_TOP, -pivot.top_radius * math.cos(pivot.top_alpha + phi))
        _write_row(rows, Contact.TIP_BOTTOM, c)
        _write_row(rows, Contact.FAR_BOTTOM, -height_of(other, -phi))
        _write_row(rows, Contact.FAR_TOP, other.top_radius * math.cos(other.top_alpha - phi))


@inner_kernel
def _touches_wall(impact):
    return impact.touching[Contact.TIP_TOP] or impact.touching[Contact.FAR_BOTTOM]


@inner_kernel
def _write_row(rows, j, turn):
    rows[j, 0], rows[j, 1], rows[j, 2] = _ALONG[j], j <= Contact.OTHER, turn


@inner_kernel
def _together(law, impact, rounding):
    """Whatever touches takes part; at an elastic wall only the corners that approach.

    Of two bottom corners that approach the floor only the law's first one does. F stands on the
    side of negative slip. Without slip neither leads, and both take part.
    """
    for j in range(CONTACTS):
        elastic = law != Law.CLOSED_BRANCH and not impact.restitution[j] < 1.0
        rests = j <= Contact.OTHER or (law != Law.OPEN_BRANCH and not elastic)
        takes = rests or impact.approach[j] < -rounding
        impact.taking[j] = impact.touching[j] and takes
    one_first = law == Law.LEADING_FIRST or law == Law.TRAILING_FIRST
    slip = dot(impact.rows[Contact.TANGENT], impact.v)
    lands_flat = max(impact.approach[Contact.FOOT], impact.approach[Contact.OTHER]) < -SLOW
    if one_first and lands_flat and abs(slip) >= SLOW:
        trails = (slip < 0.0) == (law == Law.LEADING_FIRST)
        impact.taking[Contact.OTHER if trails else Contact.FOOT] = False


@inner_kernel
def _floor_first(impact, number, rounding):
    """The contacts that are struck next in a neighbouring trajectory, and those that rest.

    `ahead` keeps how far each contact is from its next impact there: where the floor is struck
    first, a wall is one unit away.
    """
    approach, ahead, taking = impact.approach, impact.ahead, impact.taking
    if number == 0:
        floor = min(approach[Contact.FOOT], approach[Contact.OTHER]) < -rounding
        ahead[: Contact.TIP_TOP], ahead[Contact.TIP_TOP :] = 0.0, floor
    soonest = np.inf
    for j in range(CONTACTS):
        if approach[j] < -rounding:
            soonest = min(soonest, ahead[j] / -approach[j])
    for j in range(CONTACTS):
        strikes = ahead[j] <= -approach[j] * soonest * (1.0 + PARALLEL)
        taking[j] = approach[j] < -rounding and strikes
        if taking[j]:
            ahead[j] = 0.0
        elif impact.touching[j]:
            ahead[j] = max(0.0, ahead[j] + approach[j] * soonest)
            taking[j] = abs(approach[j]) <= rounding and ahead[j] <= PARALLEL


@inner_kernel
def _approaches(block, impact, plastic, rounding):
    """Writes how each contact approaches and rebounds; whether any approaches."""
    closes = False
    for j in range(CONTACTS):
        impact.approach[j] = dot(impact.rows[j], impact.v) if impact.touching[j] else 0.0
        closes = closes or impact.approach[j] < -rounding
        e = (block.e_floor, impact.e_tip, impact.e_far)[j // 2]
        impact.restitution[j] = 0.0 if plastic else e
    return closes


@inner_kernel
def _choose(law, impact, number, rounding):
    """Writes which contacts take part in stage `number` by this law, and their targets.

    A target is the velocity with which a contact is to leave.
    """
    if law == Law.FLOOR_FIRST:
        _floor_first(impact, number, rounding)
    else:
        _together(law, impact, rounding)
    for j in range(CONTACTS):
        rebounds = impact.taking[j] and impact.approach[j] < -impact.resting
        impact.target[j] = -impact.restitution[j] * impact.approach[j] if rebounds else 0.0


@called_kernel
def contact_impact(block, state):
    """All stages of the state's IMPACT.

    The state gathers the normal impulses, counts the stages that added energy and keeps the largest
    relative gain. It counts an impact in which no set of contacts fits, or whose stages do not end.
    """
    impact, v = state.impact, state.impact.v
    contact_rows(block, impact.sense, impact.phi, _touches_wall(impact), impact.rows)
    impact.part[:], impact.after[:], impact.given[:] = 0.0, 0.0, 0.0
    rounding = ROUNDING * size(v)
    fits = True
    for number in range(_MOST_STAGES):
        # Impacts that alternate between floor and wall without end become plastic.
        plastic = 2 * number >= _MOST_STAGES
        if not _approaches(block, impact, plastic, rounding):
            close_slow(block, impact)
            state.rules[Rule.LEAST_CONTRADICTION] += not fits
            return
        _choose(Law.MOREAU if plastic else block.law, impact, number, rounding)
        before = kinetic_energy(block.spin, v)
        fits = strike_once(block, impact) and fits
        noise = 2.0 * ROUNDING * before
        gains = kinetic_energy(block.spin, impact.after) - before > noise
        if block.energy_cap and not plastic and gains:
            _strike_without_gain(block, impact, before)
        gain = kinetic_energy(block.spin, impact.after) - before
        if gain > noise:
            state.gains += 1
            state.largest_gain = max(state.largest_gain, gain / before)
        impact.v = impact.after
        for j in range(CONTACTS):
            state.impulse += impact.part[j]
            impact.given[j] += impact.part[j]
    if impact.touching[Contact.TIP_TOP] and impact.touching[Contact.FAR_BOTTOM]:
        # Its diagonal just fits between two walls, with a lever so short that no impulse can be
        # solved for: it jams.
        v[0] = v[2] = 0.0
    state.rules[Rule.ENDLESS_STAGES] += 1


@called_kernel
def _strike_without_gain(block, impact, before):
    """Strikes with the largest share of the rebound at which no energy is gained."""
    impact.full = impact.target
    low, high = 0.0, 1.0
    for trial in range(_HALVINGS + 1):
        scale = low if trial == _HALVINGS else 0.5 * (low + high)
        for j in range(CONTACTS):
            impact.target[j] = scale * impact.full[j]
        strike_once(block, impact)
        if kinetic_energy(block.spin, impact.after) > before:
            high = scale
        else:
            low = scale
