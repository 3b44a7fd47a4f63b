"""Impacts where the floor can only push: Newton's restitution with Coulomb friction at every
contact that is touched.

In the pivot's frame (see ebm.core.motion), natural units. Six contacts: the pivot F and the other
bottom corner E on the floor, the top and bottom corner on the tip wall, the bottom and top corner
on the far wall; E and the second corner of a wall touch only at theta = 0.

Contacts that touch at one instant strike in *stages*, until none approaches. A law of impacts says
which contacts take part in a stage, the set A. In it the impulses p_j and the velocities u_j across
the contacts obey

    0 <= p_j  complementary to  u_j+ - e_j max(-u_j-, 0) >= 0,    |T| <= mu sum P on the floor.

- "moreau": whatever touches takes part; at an elastic wall (e = 1), where nothing rests, only the
  corners that approach. The first of
  these is the branch "closed", the second "open", whatever e.
- "floor-first": one contact after another, in the order of neighbouring trajectories: first the
  floor, then each wall corner when
  it would arrive had the wall stood a little farther off.
- "leading-first", "trailing-first": as "moreau", but of two bottom corners that approach the floor
  together only one takes part, that on the side to which the block slides or the other one. On a
  floor that does not bounce they are the limits of trajectories with a tilt to either side.

The first two differ where a block lands flush against a bouncing wall, the last two from these
where it lands flat while it slides. No law that is right there follows from rigid-body mechanics.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from rockcheck.ebm.core.contacts import CLOSED, SLOW
from rockcheck.ebm.core.motion import (
    CLOSED_BRANCH,
    FLOOR_FIRST,
    LEADING_FIRST,
    MOREAU,
    OPEN_BRANCH,
    TRAILING_FIRST,
    side_of,
)
from rockcheck.ebm.core.series import NOISE, POSITION
from rockcheck.scenes.compiled import called_kernel, inner_kernel

F, E, TIP_TOP, TIP_BOTTOM, FAR_BOTTOM, FAR_TOP = range(6)
CONTACTS = 6
#: Rows of scratch that an impact needs.
WORK = 20
_TANGENT = 6
_NONE, _STICK, _PLUS, _MINUS = range(4)
# Every set of at most three contacts: their number, the contacts, and these as bits.
_CHOSEN = [some for n in range(4) for some in itertools.combinations(range(CONTACTS), n)]
_SETS = np.array(
    [[len(some), *some, *[0] * (3 - len(some)), sum(1 << j for j in some)] for some in _CHOSEN]
)
# By the contacts that take part, as bits: the sets of no others, by their numbers, and then -1.
_WITHIN = np.full((1 << CONTACTS, len(_SETS) + 1), -1, dtype=np.int8)
for _bits in range(1 << CONTACTS):
    _inside = np.flatnonzero(_SETS[:, 4] & ~_bits == 0)
    _WITHIN[_bits, : len(_inside)] = _inside
_ON_FLOOR = 1 << F | 1 << E
# Rounding of a velocity, of the velocities at play; rows of contacts that are nearer to parallel
# than this give no solution.
_ROUNDING, _PARALLEL = NOISE[POSITION], CLOSED
_MOST_STAGES = 40
#: What came of an impact: all stages obey the law; a stage only violates it by least; or the stages
#: do not end.
ENDLESS, FITS, LEAST_WRONG = range(3)
_HALVINGS = 45


@inner_kernel
def contact_rows(b, sense, phi, rows):
    """Writes rows (xi, y, phi) of the six normal contacts and, last, of the floor's tangent, for a
    block that tips by phi to `sense`."""
    pivot, other = side_of(b, sense), side_of(b, -sense)
    s, c = pivot.radius * math.sin(pivot.alpha - phi), pivot.radius * math.cos(pivot.alpha - phi)
    rows[:] = 0.0
    rows[F, 1], rows[F, 2] = 1.0, -s
    rows[E, 1], rows[E, 2] = 1.0, other.radius * math.sin(other.alpha + phi)
    rows[TIP_TOP, 0], rows[TIP_TOP, 2] = 1.0, -pivot.top_radius * math.cos(pivot.top_alpha + phi)
    rows[TIP_BOTTOM, 0], rows[TIP_BOTTOM, 2] = 1.0, c
    rows[FAR_BOTTOM, 0], rows[FAR_BOTTOM, 2] = -1.0, -other.radius * math.cos(other.alpha + phi)
    rows[FAR_TOP, 0], rows[FAR_TOP, 2] = -1.0, other.top_radius * math.cos(other.top_alpha - phi)
    rows[_TANGENT, 0], rows[_TANGENT, 2] = 1.0, c


@inner_kernel
def _dot(row, v):
    return row[0] * v[0] + row[1] * v[1] + row[2] * v[2]


@inner_kernel
def _mass_dot(spin, row, column):
    """Row times inverse mass times column: unit mass, moment of inertia 1/spin."""
    return row[0] * column[0] + row[1] * column[1] + spin * row[2] * column[2]


@inner_kernel
def kinetic_energy(spin, v):
    """Kinetic energy of velocities (xi, y, phi), per unit mass; `spin` is one over the moment of
    inertia."""
    return 0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2] / spin)


@inner_kernel
def _size(v):
    return abs(v[0]) + abs(v[1]) + abs(v[2])


@inner_kernel
def solve(system, n):
    """Solves the n x n system whose right-hand side is column n, in place, by elimination; False
    where it is singular.

    The residual is rounding even where the solution is ill-conditioned, which an inverse does not
    give.
    """
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(system[i, k]) > abs(system[best, k]):
                best = i
        if not abs(system[best, k]) > _PARALLEL:
            return False
        for j in range(k, n + 1):
            system[k, j], system[best, j] = system[best, j], system[k, j]
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
def _fits(number, friction, slippery):
    """Whether a set is to be tried with this friction: at most three unknowns, friction where the
    floor is in it."""
    on_floor = _SETS[number, 4] & _ON_FLOOR != 0
    if friction == _STICK:
        return on_floor and _SETS[number, 0] <= 2
    return on_floor != (friction == _NONE) or (slippery and friction == _NONE)


@inner_kernel
def _push(rows, index, kappa, k):
    """What a contact's impulse does to velocity k, times the mass: its row, and of a slipping
    floor's the friction."""
    return rows[index, k] - (kappa * rows[_TANGENT, k] if index <= E else 0.0)


@inner_kernel
def _try_set(rows, spin, number, friction, target, mu_k, v, system, trial, lam):
    """The impulses of the contacts in the set, and the velocities after them; False where there are
    none."""
    count = _SETS[number, 0]
    n = count + (1 if friction == _STICK else 0)
    kappa = mu_k if friction == _PLUS else (-mu_k if friction == _MINUS else 0.0)
    for i in range(n):
        row = _SETS[number, 1 + i] if i < count else _TANGENT
        system[i, n] = target[row] if i < count else 0.0
        for k in range(3):
            system[i, n] -= rows[row, k] * v[k]
        for j in range(n):
            column = _SETS[number, 1 + j] if j < count else _TANGENT
            system[i, j] = rows[row, 0] * _push(rows, column, kappa, 0) + rows[row, 1] * _push(
                rows, column, kappa, 1
            )
            system[i, j] += spin * rows[row, 2] * _push(rows, column, kappa, 2)
    if not solve(system, n):
        return False
    for k in range(3):
        trial[k], lam[k] = v[k], 0.0
    for j in range(n):
        lam[j] = system[j, n]
        index = _SETS[number, 1 + j] if j < count else _TANGENT
        for k in range(3):
            trial[k] += (spin if k == 2 else 1.0) * _push(rows, index, kappa, k) * lam[j]
    return True


@inner_kernel
def _violation(rows, number, friction, taking, target, mu_s, trial, lam):
    """By how much a solution violates the law: a pull, a contact that still closes, friction beyond
    its cone or in the wrong sense."""
    count = _SETS[number, 0]
    worst = 0.0
    floor_normal = 0.0
    for i in range(count):
        worst = max(worst, -lam[i])
        if _SETS[number, 1 + i] <= E:
            floor_normal += lam[i]
    slip = _dot(rows[_TANGENT], trial)
    if friction == _STICK:
        worst = max(worst, abs(lam[count]) - mu_s * floor_normal)
    elif friction != _NONE:
        worst = max(worst, -slip if friction == _PLUS else slip)
    for j in range(CONTACTS):
        if taking[j] != 0.0:
            worst = max(worst, target[j] - _dot(rows[j], trial))
    return worst


@called_kernel
def _strike(rows, spin, taking, target, mu_s, mu_k, v, after, impulse, system):
    """One stage over the contacts in `taking`: writes the velocities after it and the impulses;
    False where only the least wrong fits.

    Every set of contacts is tried with every friction. Of those that obey the law the one that
    leaves the least energy is taken; where none does, but for rounding or for friction that jams
    (Painleve), the one that contradicts it least.
    """
    least, lowest = np.inf, np.inf
    lam, trial = system[3], system[4]
    bits = 0
    for j in range(CONTACTS):
        bits |= (1 if taking[j] != 0.0 else 0) << j
    for place in range(_WITHIN.shape[1]):
        number = _WITHIN[bits, place]
        if number < 0:
            break
        for friction in range(4):
            if not _fits(number, friction, mu_s == 0.0) or not _try_set(
                rows, spin, number, friction, target, mu_k, v, system, trial, lam
            ):
                continue
            scale = _size(v) + _size(trial) + _size(lam)
            wrong = _violation(rows, number, friction, taking, target, mu_s, trial, lam)
            wrong = 0.0 if wrong <= _ROUNDING * scale else wrong
            energy = kinetic_energy(spin, trial)
            if not wrong < least and not (
                wrong == least and energy < lowest - _ROUNDING * scale * scale
            ):
                continue
            least, lowest = wrong, energy
            impulse[:] = 0.0
            for i in range(_SETS[number, 0]):
                impulse[_SETS[number, 1 + i]] = max(lam[i], 0.0)
            for k in range(3):
                after[k] = trial[k]
            if friction == _STICK:
                after[0] -= _dot(rows[_TANGENT], after)  # rounding only: the pivot stands
    return least == 0.0


@inner_kernel
def _moreau(law, touching, approach, restitution, rounding, taking):
    """Whatever touches takes part; at an elastic wall only the corners that approach."""
    for j in range(CONTACTS):
        rests = law != OPEN_BRANCH and (law == CLOSED_BRANCH or restitution[j] < 1.0)
        taking[j] = (
            1.0 if touching[j] != 0.0 and (j <= E or approach[j] < -rounding or rests) else 0.0
        )


@inner_kernel
def _one_corner(law, approach, slip, taking):
    """Of two bottom corners that approach the floor only the one that the law puts first takes
    part.

    F stands on the side of negative slip. Without slip neither leads, and both take part.
    """
    if law != LEADING_FIRST and law != TRAILING_FIRST:
        return
    if max(approach[F], approach[E]) < -SLOW and abs(slip) >= SLOW:
        taking[E if (slip < 0.0) == (law == LEADING_FIRST) else F] = 0.0


@inner_kernel
def _floor_first(touching, approach, stage, rounding, ahead, taking):
    """The contacts that are struck next, in the order of a neighbouring trajectory, and those that
    rest meanwhile.

    `ahead` keeps how far each contact is from its next impact there: where the floor is struck
    first, a wall is one unit away.
    """
    floor = approach[F] < -rounding or approach[E] < -rounding
    if stage == 0:
        for j in range(CONTACTS):
            ahead[j] = 1.0 if floor and j > E else 0.0
    soonest = np.inf
    for j in range(CONTACTS):
        if approach[j] < -rounding:
            soonest = min(soonest, ahead[j] / -approach[j])
    for j in range(CONTACTS):
        taking[j] = 0.0
        if approach[j] < -rounding and ahead[j] <= -approach[j] * soonest * (1.0 + _PARALLEL):
            ahead[j] = 0.0
            taking[j] = 1.0
        elif touching[j] != 0.0:
            ahead[j] = max(0.0, ahead[j] + approach[j] * soonest)
            taking[j] = 1.0 if abs(approach[j]) <= rounding and ahead[j] <= _PARALLEL else 0.0


@called_kernel
def contact_impact(b, sense, phi, touching, e_tip, e_far, resting, v, impulse, tally, work):
    """All stages at one instant; v (xi, y, phi rates) becomes the velocities after them. Returns
    FITS, LEAST_WRONG or ENDLESS.

    The block tips by phi to `sense`. `touching[6]` says which gaps are closed (not 0), `resting` is
    the approach speed below which a contact closes for good. `work` is scratch, such as that of the
    root search: `WORK` rows. `impulse[2]` gathers the normal impulses of floor and walls;
    `tally[0]` counts stages that added energy and `tally[1]` keeps the largest relative gain.
    """
    rows, system = (
        work[:7],
        work[7:12],
    )  # the impulses and velocities of a trial stand below the system
    restitution, target, part, approach, ahead, after, taking, full = (
        work[12],
        work[13],
        work[14],
        work[15],
        work[16],
        work[17],
        work[18],
        work[19],
    )
    contact_rows(b, sense, phi, rows)
    part[:] = 0.0
    after[:] = 0.0
    rounding = _ROUNDING * _size(v)
    found = FITS
    for stage in range(_MOST_STAGES):
        plastic = (
            2 * stage >= _MOST_STAGES
        )  # impacts that alternate between floor and wall without end become plastic
        closes = False
        for j in range(CONTACTS):
            approach[j] = _dot(rows[j], v) if touching[j] != 0.0 else 0.0
            closes = closes or approach[j] < -rounding
            restitution[j] = (
                0.0 if plastic else (b.e_floor if j <= E else (e_tip if j <= TIP_BOTTOM else e_far))
            )
        if not closes:
            _close(rows, b.spin, touching, resting, v, system)
            return found
        law = MOREAU if plastic else b.law
        if law == FLOOR_FIRST:
            _floor_first(touching, approach, stage, rounding, ahead, taking)
        else:
            _moreau(law, touching, approach, restitution, rounding, taking)
            _one_corner(law, approach, _dot(rows[_TANGENT], v), taking)
        for j in range(CONTACTS):
            target[j] = (
                -restitution[j] * approach[j]
                if taking[j] != 0.0 and approach[j] < -resting
                else 0.0
            )
        before = kinetic_energy(b.spin, v)
        if not _strike(rows, b.spin, taking, target, b.mu_s, b.mu_k, v, after, part, system):
            found = LEAST_WRONG
        noise = 2.0 * _ROUNDING * before
        if b.energy_cap and not plastic and kinetic_energy(b.spin, after) - before > noise:
            _strike_without_gain(b, rows, taking, target, v, after, part, system, before, full)
        gain = kinetic_energy(b.spin, after) - before
        if gain > noise:
            tally[0] += 1.0
            tally[1] = max(tally[1], gain / before)
        for j in range(CONTACTS):
            impulse[0 if j <= E else 1] += part[j]
        for k in range(3):
            v[k] = after[k]
    if touching[TIP_TOP] != 0.0 and touching[FAR_BOTTOM] != 0.0:
        # Its diagonal just fits between two walls, with a lever so short that no impulse can be
        # solved for: it jams.
        v[0] = v[2] = 0.0
    return ENDLESS


@called_kernel
def _strike_without_gain(b, rows, taking, target, v, after, part, system, before, full):
    """Strikes with the largest share of the rebound at which no energy is gained."""
    for j in range(CONTACTS):
        full[j] = target[j]
    low, high = 0.0, 1.0
    for trial in range(_HALVINGS + 1):
        scale = low if trial == _HALVINGS else 0.5 * (low + high)
        for j in range(CONTACTS):
            target[j] = scale * full[j]
        _strike(rows, b.spin, taking, target, b.mu_s, b.mu_k, v, after, part, system)
        if kinetic_energy(b.spin, after) > before:
            high = scale
        else:
            low = scale


@called_kernel
def _close(rows, spin, touching, resting, v, system):
    """Contacts that part more slowly than `resting` are closed: the velocity is projected onto
    them, mass-orthogonally."""
    members, count = system[3], 0
    for j in range(CONTACTS):
        if touching[j] != 0.0 and count < 3 and abs(_dot(rows[j], v)) < resting:
            members[count] = j
            count += 1
    while count > 0:
        for i in range(count):
            row = rows[int(members[i])]
            for j in range(count):
                system[i, j] = _mass_dot(spin, row, rows[int(members[j])])
            system[i, count] = -_dot(row, v)
        if solve(system, count):
            for i in range(count):
                for k in range(3):
                    v[k] += (spin if k == 2 else 1.0) * rows[int(members[i]), k] * system[i, count]
            return
        count -= 1
