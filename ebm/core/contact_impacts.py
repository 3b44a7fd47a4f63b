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

from rockcheck.ebm.core.block import side_of
from rockcheck.ebm.core.contacts import CLOSED, SLOW
from rockcheck.ebm.core.names import CONTACT_SETS, CONTACTS, Contact, Friction, Kind, Law, Rule
from rockcheck.ebm.core.series import NOISE
from rockcheck.scenes.compiled import called_kernel, inner_kernel
from rockcheck.scenes.named_record import record

# A solution to try: the contacts that push, as bits and by their number; the unknowns, which are
# these and, where the pivot sticks, the floor's tangent; a Friction, and the direction of slip.
_TRIAL = record(bits="i8", count="i8", n="i8", rows=("i8", (3,)), friction="i8", slip="f8")
_SLIPS = {Friction.PLUS: 1.0, Friction.MINUS: -1.0}
# Every set of contacts with every friction, of at most three unknowns.
_TRIALS = np.array(
    [
        (
            sum(1 << j for j in some),
            len(some),
            len(some) + (friction == Friction.HELD),
            [*some, *[Contact.TANGENT] * 3][:3],
            friction,
            _SLIPS.get(friction, 0.0),
        )
        for some in CONTACT_SETS
        for friction in Friction
        if len(some) + (friction == Friction.HELD) <= 3
    ],
    _TRIAL,
)
_BITS, _FREE = _TRIALS["bits"], _TRIALS["friction"] == Friction.FREE
_ON_FLOOR = _BITS & (1 << Contact.FOOT | 1 << Contact.OTHER) != 0
_LARGEST_FIRST = np.flatnonzero(_FREE)[np.argsort(-_TRIALS["count"][_FREE], kind="stable")]
# What a stage tries: with friction where the floor is among the contacts.
_STRIKING = np.flatnonzero(_ON_FLOOR != _FREE)
# The horizontal part of each contact's row (see `contact_rows`).
_ALONG = np.array([0.0, 0.0, 1.0, 1.0, -1.0, -1.0, 1.0])
# Rounding of a velocity, of the velocities at play; rows of contacts that are nearer to parallel
# than this give no solution.
ROUNDING, _PARALLEL = NOISE[Kind.POSITION], CLOSED
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
def contact_rows(b, sense, phi, rows):
    """Writes rows (xi, y, phi) of the six normal contacts and, last, of the floor's tangent.

    The block tips by phi to `sense`.
    """
    pivot, other = side_of(b, sense), side_of(b, -sense)
    s, c = pivot.radius * math.sin(pivot.alpha - phi), pivot.radius * math.cos(pivot.alpha - phi)
    turns = (
        -s,
        other.radius * math.sin(other.alpha + phi),
        -pivot.top_radius * math.cos(pivot.top_alpha + phi),
        c,
        -other.radius * math.cos(other.alpha + phi),
        other.top_radius * math.cos(other.top_alpha - phi),
        c,
    )
    for j in range(len(turns)):
        rows[j, 0], rows[j, 1], rows[j, 2] = _ALONG[j], j <= Contact.OTHER, turns[j]


@inner_kernel
def _dot(row, v):
    return row[0] * v[0] + row[1] * v[1] + row[2] * v[2]


@inner_kernel
def kinetic_energy(spin, v):
    """Kinetic energy of velocities (xi, y, phi), per unit mass.

    `spin` is one over the moment of inertia.
    """
    return 0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2] / spin)


@inner_kernel
def _size(v):
    return abs(v[0]) + abs(v[1]) + abs(v[2])


@inner_kernel
def solve(system, n):
    """Solves an n x n system in place, by elimination; False where it is singular.

    The right-hand side is column n, which gets the solution. The residual is rounding even where
    the solution is ill-conditioned, which an inverse does not give.
    """
    for k in range(n):
        if not _pivots(system, n, k):
            return False
        for i in range(k + 1, n):
            factor = system[i, k] / system[k, k]
            for j in range(k, n + 1):
                system[i, j] -= factor * system[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            system[k, n] -= system[k, j] * system[j, n]
        system[k, n] /= system[k, k]
    return True


@inner_kernel
def _pivots(system, n, k):
    """Puts the row with the largest entry of column k in place k; False where all are too small."""
    best = k
    for i in range(k + 1, n):
        if abs(system[i, k]) > abs(system[best, k]):
            best = i
    for j in range(k, n + 1):
        system[k, j], system[best, j] = system[best, j], system[k, j]
    return abs(system[k, k]) > _PARALLEL


@inner_kernel
def _push(rows, index, kappa, k):
    """The effect of a contact's unit impulse on velocity k, times the mass.

    It is the contact's row; a slipping floor's has friction, too.
    """
    return rows[index, k] - (kappa * rows[Contact.TANGENT, k] if index <= Contact.OTHER else 0.0)


@inner_kernel
def _try(block, impact, number):
    """The impulses of a trial's contacts and the velocities after them; False if singular."""
    rows, system, v, spin = impact.rows, impact.system, impact.v, block.spin
    lam, trial = impact.lam, impact.trial
    n, kappa = _TRIALS[number].n, block.mu_k * _TRIALS[number].slip
    for i in range(n):
        row = _TRIALS[number].rows[i]
        system[i, n] = 0.0 if row == Contact.TANGENT else impact.target[row]
        for k in range(3):
            system[i, n] -= rows[row, k] * v[k]
        for j in range(n):
            column = _TRIALS[number].rows[j]
            x, y = _push(rows, column, kappa, 0), _push(rows, column, kappa, 1)
            system[i, j] = rows[row, 0] * x + rows[row, 1] * y
            system[i, j] += spin * rows[row, 2] * _push(rows, column, kappa, 2)
    if not solve(system, n):
        return False
    for k in range(3):
        trial[k], lam[k] = v[k], 0.0
    for j in range(n):
        lam[j] = system[j, n]
        index = _TRIALS[number].rows[j]
        for k in range(3):
            trial[k] += (spin if k == 2 else 1.0) * _push(rows, index, kappa, k) * lam[j]
    return True


@inner_kernel
def _violation(block, impact, number, rounding):
    """By how much a solution violates the law, 0 within the rounding.

    Violations are a pull, a contact that still closes, friction beyond its cone or in the wrong
    sense.
    """
    rows, lam, trial = impact.rows, impact.lam, impact.trial
    count = _TRIALS[number].count
    worst = max(0.0, -_TRIALS[number].slip * _dot(rows[Contact.TANGENT], trial))
    floor_normal = 0.0
    for i in range(count):
        worst = max(worst, -lam[i])
        if _TRIALS[number].rows[i] <= Contact.OTHER:
            floor_normal += lam[i]
    if _TRIALS[number].friction == Friction.HELD:
        worst = max(worst, abs(lam[count]) - block.mu_s * floor_normal)
    for j in range(CONTACTS):
        if impact.taking[j]:
            worst = max(worst, impact.target[j] - _dot(rows[j], trial))
    return 0.0 if worst <= rounding else worst


@called_kernel
def _strike(block, impact):
    """One stage over the contacts that take part: writes the velocities and impulses after it.

    Every set of these contacts is tried with every friction. Of those that obey the law the one
    that leaves the least energy is taken. Where none does, by rounding or by friction that jams
    (Painleve), the one that contradicts it least is taken, and the result is False.
    """
    least, lowest = np.inf, np.inf
    others = ~_bits_of(impact.taking)
    for number in _STRIKING:
        if _TRIALS[number].bits & others != 0 or not _try(block, impact, number):
            continue
        scale = _size(impact.v) + _size(impact.trial) + _size(impact.lam)
        wrong = _violation(block, impact, number, ROUNDING * scale)
        energy = kinetic_energy(block.spin, impact.trial)
        lower = wrong == least and energy < lowest - ROUNDING * scale * scale
        if wrong < least or lower:
            least, lowest = wrong, energy
            _keep(impact, number)
    return least == 0.0


@inner_kernel
def _bits_of(taking):
    bits = 0
    for j in range(CONTACTS):
        bits |= (1 if taking[j] else 0) << j
    return bits


@inner_kernel
def _keep(impact, number):
    """Keeps what was tried."""
    impact.part[:] = 0.0
    for i in range(_TRIALS[number].count):
        impact.part[_TRIALS[number].rows[i]] = max(impact.lam[i], 0.0)
    impact.after = impact.trial
    if _TRIALS[number].friction == Friction.HELD:
        # Rounding only: the pivot stands.
        impact.after[0] -= _dot(impact.rows[Contact.TANGENT], impact.after)


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
    slip = _dot(impact.rows[Contact.TANGENT], impact.v)
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
        strikes = ahead[j] <= -approach[j] * soonest * (1.0 + _PARALLEL)
        taking[j] = approach[j] < -rounding and strikes
        if taking[j]:
            ahead[j] = 0.0
        elif impact.touching[j]:
            ahead[j] = max(0.0, ahead[j] + approach[j] * soonest)
            taking[j] = abs(approach[j]) <= rounding and ahead[j] <= _PARALLEL


@inner_kernel
def _approaches(block, impact, plastic, rounding):
    """Writes how each contact approaches and rebounds; whether any approaches."""
    closes = False
    for j in range(CONTACTS):
        impact.approach[j] = _dot(impact.rows[j], impact.v) if impact.touching[j] else 0.0
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
    contact_rows(block, impact.sense, impact.phi, impact.rows)
    impact.part[:], impact.after[:], impact.given[:] = 0.0, 0.0, 0.0
    rounding = ROUNDING * _size(v)
    fits = True
    for number in range(_MOST_STAGES):
        # Impacts that alternate between floor and wall without end become plastic.
        plastic = 2 * number >= _MOST_STAGES
        if not _approaches(block, impact, plastic, rounding):
            _close(block, impact)
            state.rules[Rule.LEAST_CONTRADICTION] += not fits
            return
        _choose(Law.MOREAU if plastic else block.law, impact, number, rounding)
        before = kinetic_energy(block.spin, v)
        fits = _strike(block, impact) and fits
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
        _strike(block, impact)
        if kinetic_energy(block.spin, impact.after) > before:
            high = scale
        else:
            low = scale


@called_kernel
def _close(block, impact):
    """Closes the contacts that part more slowly than `resting`.

    They strike without rebound and without friction: as many as have a solution, the floor's first.
    """
    impact.target[:] = 0.0
    for j in range(CONTACTS):
        slow = abs(_dot(impact.rows[j], impact.v)) < impact.resting
        impact.taking[j] = impact.touching[j] and slow
    others = ~_bits_of(impact.taking)
    for number in _LARGEST_FIRST:
        if _TRIALS[number].bits & others == 0 and _try(block, impact, number):
            impact.v = impact.trial
            return
