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

The first two differ where a block lands flush against a bouncing wall, the last two from these
where it lands flat while it slides. Rigid-body mechanics does not say which law is right there.
"""

import math
from typing import NamedTuple

import numpy as np

from rockcheck.ebm.core.block import side_of
from rockcheck.ebm.core.contacts import CLOSED, SLOW
from rockcheck.ebm.core.names import CONTACT_SETS, CONTACTS, Contact, Found, Friction, Kind, Law
from rockcheck.ebm.core.series import NOISE
from rockcheck.scenes import Floats
from rockcheck.scenes.compiled import called_kernel, inner_kernel

#: Rows of scratch that an impact needs.
WORK = 20
# Every set of at most three contacts: their number, the contacts, and these as bits.
_SETS = np.array(
    [[len(some), *some, *[0] * (3 - len(some)), sum(1 << j for j in some)] for some in CONTACT_SETS]
)
_LARGEST_FIRST = np.argsort(-_SETS[:, 0], kind="stable")
# By the contacts that take part, as bits: the sets of no others, by their numbers, and then -1.
_WITHIN = np.full((1 << CONTACTS, len(_SETS) + 1), -1, dtype=np.int8)
for _bits in range(1 << CONTACTS):
    _inside = np.flatnonzero(_SETS[:, 4] & ~_bits == 0)
    _WITHIN[_bits, : len(_inside)] = _inside
_ON_FLOOR = 1 << Contact.FOOT | 1 << Contact.OTHER
# Rounding of a velocity, of the velocities at play; rows of contacts that are nearer to parallel
# than this give no solution.
ROUNDING, _PARALLEL = NOISE[Kind.POSITION], CLOSED
_MOST_STAGES = 40
_HALVINGS, _FRICTIONS = 45, len(Friction)


class Impact(NamedTuple):
    """Contacts that touch at one instant.

    The block tips by phi to `sense`; `touching[6]` says which gaps are closed (not 0), `resting` is
    the approach speed below which a contact closes for good, and v (xi, y, phi rates) becomes the
    velocities after the impact.
    """

    sense: float
    phi: float
    touching: Floats
    e_tip: float
    e_far: float
    resting: float
    v: Floats


class Stage(NamedTuple):
    """What a stage of an impact works on.

    `rows` of the contacts, a linear `system`; of a trial the impulses `lam` and the velocities
    `trial`. Of each contact its restitution, the velocity that it is to leave with (`target`), its
    impulse (`part`), its approach, how far its next impact is `ahead`, whether it takes part
    (`taking`), and its `full` rebound. `after` has the velocities after the stage.
    """

    rows: Floats
    system: Floats
    lam: Floats
    trial: Floats
    restitution: Floats
    target: Floats
    part: Floats
    approach: Floats
    ahead: Floats
    after: Floats
    taking: Floats
    full: Floats


@inner_kernel
def contact_rows(b, sense, phi, rows):
    """Writes rows (xi, y, phi) of the six normal contacts and, last, of the floor's tangent.

    The block tips by phi to `sense`.
    """
    pivot, other = side_of(b, sense), side_of(b, -sense)
    s, c = pivot.radius * math.sin(pivot.alpha - phi), pivot.radius * math.cos(pivot.alpha - phi)
    rows[:] = 0.0
    rows[Contact.FOOT, 1], rows[Contact.FOOT, 2] = 1.0, -s
    rows[Contact.OTHER, 1], rows[Contact.OTHER, 2] = 1.0, other.radius * math.sin(other.alpha + phi)
    rows[Contact.TIP_TOP, 0], rows[Contact.TIP_TOP, 2] = (
        1.0,
        -pivot.top_radius * math.cos(pivot.top_alpha + phi),
    )
    rows[Contact.TIP_BOTTOM, 0], rows[Contact.TIP_BOTTOM, 2] = 1.0, c
    rows[Contact.FAR_BOTTOM, 0], rows[Contact.FAR_BOTTOM, 2] = (
        -1.0,
        -other.radius * math.cos(other.alpha + phi),
    )
    rows[Contact.FAR_TOP, 0], rows[Contact.FAR_TOP, 2] = (
        -1.0,
        other.top_radius * math.cos(other.top_alpha - phi),
    )
    rows[Contact.TANGENT, 0], rows[Contact.TANGENT, 2] = 1.0, c


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
def _fits(number, friction, slippery):
    """Whether a set is to be tried with this friction.

    It has at most three unknowns, and friction where a floor contact is in it. Where the floor is
    slippery (mu_s = 0), it is tried without friction, too.
    """
    on_floor = _SETS[number, 4] & _ON_FLOOR != 0
    if friction == Friction.HELD:
        return on_floor and _SETS[number, 0] <= 2
    return on_floor != (friction == Friction.FREE) or (slippery and friction == Friction.FREE)


@inner_kernel
def _push(rows, index, kappa, k):
    """The effect of a contact's unit impulse on velocity k, times the mass.

    It is the contact's row; a slipping floor's has friction, too.
    """
    return rows[index, k] - (kappa * rows[Contact.TANGENT, k] if index <= Contact.OTHER else 0.0)


@inner_kernel
def _unknown(number, i):
    """The contact of unknown i of a set; behind its contacts, the floor's tangent."""
    return _SETS[number, 1 + i] if i < _SETS[number, 0] else Contact.TANGENT


@inner_kernel
def _try_set(block, stage, v, number, friction):
    """The impulses of the contacts in the set and the velocities after them; False if singular."""
    rows, system, lam, trial, spin = stage.rows, stage.system, stage.lam, stage.trial, block.spin
    n = _SETS[number, 0] + (1 if friction == Friction.HELD else 0)
    mu_k = block.mu_k
    kappa = mu_k if friction == Friction.PLUS else (-mu_k if friction == Friction.MINUS else 0.0)
    for i in range(n):
        row = _unknown(number, i)
        system[i, n] = 0.0 if row == Contact.TANGENT else stage.target[row]
        for k in range(3):
            system[i, n] -= rows[row, k] * v[k]
        for j in range(n):
            column = _unknown(number, j)
            x, y = _push(rows, column, kappa, 0), _push(rows, column, kappa, 1)
            system[i, j] = rows[row, 0] * x + rows[row, 1] * y
            system[i, j] += spin * rows[row, 2] * _push(rows, column, kappa, 2)
    if not solve(system, n):
        return False
    for k in range(3):
        trial[k], lam[k] = v[k], 0.0
    for j in range(n):
        lam[j] = system[j, n]
        index = _unknown(number, j)
        for k in range(3):
            trial[k] += (spin if k == 2 else 1.0) * _push(rows, index, kappa, k) * lam[j]
    return True


@inner_kernel
def _violation(block, stage, number, friction, rounding):
    """By how much a solution violates the law, 0 within the rounding.

    Violations are a pull, a contact that still closes, friction beyond its cone or in the wrong
    sense.
    """
    rows, lam, trial = stage.rows, stage.lam, stage.trial
    count = _SETS[number, 0]
    worst = 0.0
    floor_normal = 0.0
    for i in range(count):
        worst = max(worst, -lam[i])
        if _SETS[number, 1 + i] <= Contact.OTHER:
            floor_normal += lam[i]
    slip = _dot(rows[Contact.TANGENT], trial)
    if friction == Friction.HELD:
        worst = max(worst, abs(lam[count]) - block.mu_s * floor_normal)
    elif friction != Friction.FREE:
        worst = max(worst, -slip if friction == Friction.PLUS else slip)
    for j in range(CONTACTS):
        if stage.taking[j] != 0.0:
            worst = max(worst, stage.target[j] - _dot(rows[j], trial))
    return 0.0 if worst <= rounding else worst


@called_kernel
def _strike(block, stage, v):
    """One stage over the contacts that take part: writes the velocities and impulses after it.

    Every set of contacts is tried with every friction. Of those that obey the law the one that
    leaves the least energy is taken. Where none does, by rounding or by friction that jams
    (Painleve), the one that contradicts it least is taken, and the result is False.
    """
    least, lowest = np.inf, np.inf
    bits = _bits_of(stage.taking)
    for place in range(_WITHIN.shape[1]):
        number = _WITHIN[bits, place]
        if number < 0:
            break
        for friction in range(_FRICTIONS):
            fits = _fits(number, friction, block.mu_s == 0.0)
            if not fits or not _try_set(block, stage, v, number, friction):
                continue
            scale = _size(v) + _size(stage.trial) + _size(stage.lam)
            wrong = _violation(block, stage, number, friction, ROUNDING * scale)
            energy = kinetic_energy(block.spin, stage.trial)
            lower = wrong == least and energy < lowest - ROUNDING * scale * scale
            if wrong < least or lower:
                least, lowest = wrong, energy
                _keep(stage, number, friction)
    return least == 0.0


@inner_kernel
def _bits_of(taking):
    bits = 0
    for j in range(CONTACTS):
        bits |= (1 if taking[j] != 0.0 else 0) << j
    return bits


@inner_kernel
def _keep(stage, number, friction):
    """Keeps what was tried."""
    stage.part[:] = 0.0
    for i in range(_SETS[number, 0]):
        stage.part[_SETS[number, 1 + i]] = max(stage.lam[i], 0.0)
    for k in range(3):
        stage.after[k] = stage.trial[k]
    if friction == Friction.HELD:
        # Rounding only: the pivot stands.
        stage.after[0] -= _dot(stage.rows[Contact.TANGENT], stage.after)


@inner_kernel
def _moreau(law, stage, touching, rounding):
    """Whatever touches takes part; at an elastic wall only the corners that approach."""
    for j in range(CONTACTS):
        elastic = law != Law.CLOSED_BRANCH and not stage.restitution[j] < 1.0
        rests = j <= Contact.OTHER or (law != Law.OPEN_BRANCH and not elastic)
        takes = touching[j] != 0.0 and (rests or stage.approach[j] < -rounding)
        stage.taking[j] = 1.0 if takes else 0.0


@inner_kernel
def _one_corner(law, stage, slip):
    """Of two bottom corners that approach the floor only the law's first one takes part.

    F stands on the side of negative slip. Without slip neither leads, and both take part.
    """
    if law != Law.LEADING_FIRST and law != Law.TRAILING_FIRST:
        return
    approach = stage.approach
    if max(approach[Contact.FOOT], approach[Contact.OTHER]) < -SLOW and abs(slip) >= SLOW:
        trails = (slip < 0.0) == (law == Law.LEADING_FIRST)
        stage.taking[Contact.OTHER if trails else Contact.FOOT] = 0.0


@inner_kernel
def _soonest(approach, ahead, rounding):
    """When the next of the contacts that approach is struck."""
    soonest = np.inf
    for j in range(CONTACTS):
        if approach[j] < -rounding:
            soonest = min(soonest, ahead[j] / -approach[j])
    return soonest


@inner_kernel
def _floor_first(stage, touching, number, rounding):
    """The contacts that are struck next in a neighbouring trajectory, and those that rest.

    `ahead` keeps how far each contact is from its next impact there: where the floor is struck
    first, a wall is one unit away.
    """
    approach, ahead, taking = stage.approach, stage.ahead, stage.taking
    if number == 0:
        floor = min(approach[Contact.FOOT], approach[Contact.OTHER]) < -rounding
        for j in range(CONTACTS):
            ahead[j] = floor * (j > Contact.OTHER)
    soonest = _soonest(approach, ahead, rounding)
    for j in range(CONTACTS):
        taking[j] = 0.0
        if approach[j] < -rounding and ahead[j] <= -approach[j] * soonest * (1.0 + _PARALLEL):
            ahead[j] = 0.0
            taking[j] = 1.0
        elif touching[j] != 0.0:
            ahead[j] = max(0.0, ahead[j] + approach[j] * soonest)
            rests = abs(approach[j]) <= rounding and ahead[j] <= _PARALLEL
            taking[j] = 1.0 if rests else 0.0


@inner_kernel
def _approaches(block, impact, stage, plastic, rounding):
    """Writes how each contact approaches and rebounds; whether any approaches."""
    closes = False
    for j in range(CONTACTS):
        touches = impact.touching[j] != 0.0
        stage.approach[j] = _dot(stage.rows[j], impact.v) if touches else 0.0
        closes = closes or stage.approach[j] < -rounding
        e_wall = impact.e_tip if j <= Contact.TIP_BOTTOM else impact.e_far
        stage.restitution[j] = block.e_floor if j <= Contact.OTHER else e_wall
        if plastic:
            stage.restitution[j] = 0.0
    return closes


@inner_kernel
def _choose(law, impact, stage, number, rounding):
    """Writes which contacts take part in stage `number` by this law, and their targets.

    A target is the velocity with which a contact is to leave.
    """
    if law == Law.FLOOR_FIRST:
        _floor_first(stage, impact.touching, number, rounding)
    else:
        _moreau(law, stage, impact.touching, rounding)
        _one_corner(law, stage, _dot(stage.rows[Contact.TANGENT], impact.v))
    for j in range(CONTACTS):
        rebounds = stage.taking[j] != 0.0 and stage.approach[j] < -impact.resting
        stage.target[j] = -stage.restitution[j] * stage.approach[j] if rebounds else 0.0


@called_kernel
def contact_impact(block, impact, state, work):
    """All stages of an `Impact`; returns what came of it, a Found.

    `work` is scratch, such as that of the root search: `WORK` rows. The state gathers the normal
    impulses, counts the stages that added energy and keeps the largest relative gain.
    """
    v, touching, rows = impact.v, impact.touching, work[:7]
    # The impulses and velocities of a trial stand below the system.
    stage = Stage(
        rows,
        work[7:12],
        work[10],
        work[11],
        work[12],
        work[13],
        work[14],
        work[15],
        work[16],
        work[17],
        work[18],
        work[19],
    )
    contact_rows(block, impact.sense, impact.phi, rows)
    stage.part[:] = 0.0
    stage.after[:] = 0.0
    rounding = ROUNDING * _size(v)
    found = Found.FITS
    for number in range(_MOST_STAGES):
        # Impacts that alternate between floor and wall without end become plastic.
        plastic = 2 * number >= _MOST_STAGES
        if not _approaches(block, impact, stage, plastic, rounding):
            _close(block, stage, impact)
            return found
        _choose(Law.MOREAU if plastic else block.law, impact, stage, number, rounding)
        before = kinetic_energy(block.spin, v)
        if not _strike(block, stage, v):
            found = Found.LEAST_WRONG
        noise = 2.0 * ROUNDING * before
        gains = kinetic_energy(block.spin, stage.after) - before > noise
        if block.energy_cap and not plastic and gains:
            _strike_without_gain(block, stage, v, before)
        gain = kinetic_energy(block.spin, stage.after) - before
        if gain > noise:
            state.gains += 1
            state.largest_gain = max(state.largest_gain, gain / before)
        _end_stage(stage, v, state)
    if touching[Contact.TIP_TOP] != 0.0 and touching[Contact.FAR_BOTTOM] != 0.0:
        # Its diagonal just fits between two walls, with a lever so short that no impulse can be
        # solved for: it jams.
        v[0] = v[2] = 0.0
    return Found.ENDLESS


@inner_kernel
def _end_stage(stage, v, state):
    """Gathers the impulses of a stage, and makes its velocities those of the block."""
    for j in range(CONTACTS):
        state.impulse += stage.part[j]
    for k in range(3):
        v[k] = stage.after[k]


@called_kernel
def _strike_without_gain(block, stage, v, before):
    """Strikes with the largest share of the rebound at which no energy is gained."""
    for j in range(CONTACTS):
        stage.full[j] = stage.target[j]
    low, high = 0.0, 1.0
    for trial in range(_HALVINGS + 1):
        scale = low if trial == _HALVINGS else 0.5 * (low + high)
        for j in range(CONTACTS):
            stage.target[j] = scale * stage.full[j]
        _strike(block, stage, v)
        if kinetic_energy(block.spin, stage.after) > before:
            high = scale
        else:
            low = scale


@called_kernel
def _close(block, stage, impact):
    """Closes the contacts that part more slowly than `resting`.

    They strike without rebound and without friction: as many as have a solution, the floor's first.
    """
    v = impact.v
    for j in range(CONTACTS):
        slow = abs(_dot(stage.rows[j], v)) < impact.resting
        stage.taking[j] = 1.0 if impact.touching[j] != 0.0 and slow else 0.0
        stage.target[j] = 0.0
    others = ~_bits_of(stage.taking)
    for number in _LARGEST_FIRST:
        inside = _SETS[number, 4] & others == 0
        if inside and _try_set(block, stage, v, number, Friction.FREE):
            for k in range(3):
                v[k] = stage.trial[k]
            return
