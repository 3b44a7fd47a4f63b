"""One stage of an impact: which of the contacts that take part push, and which way the floor rubs.

Every set of these contacts is tried with every friction, unless one is known to be the only answer.
What the contacts are, what a stage is and what is asked of it, see `contact_impacts`.
"""

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.core.contacts import CLOSED
from rockcheck.ebm.core.names import CONTACT_SETS, CONTACTS, Contact, Friction, Kind
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
_FLOOR = 1 << Contact.FOOT | 1 << Contact.OTHER
_ON_FLOOR = _BITS & _FLOOR != 0
_LARGEST_FIRST = np.flatnonzero(_FREE)[np.argsort(-_TRIALS["count"][_FREE], kind="stable")]
# What a stage tries: with friction where the floor is among the contacts.
_STRIKING = np.flatnonzero(_ON_FLOOR != _FREE)


def _by_contacts(trials: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Of each set of contacts, as bits, the trials of no other ones, in the same order.

    They are numbers, one set's after the other's, and where each set's begin.
    """
    own = [trials[_BITS[trials] & ~bits == 0] for bits in range(1 << CONTACTS)]
    return np.concatenate(own), np.cumsum([0, *map(len, own)])


_STRIKES, _STRIKES_FROM = _by_contacts(_STRIKING)
_CLOSES, _CLOSES_FROM = _by_contacts(_LARGEST_FIRST)
_OTHER_HELD = int(
    np.flatnonzero((_BITS == 1 << Contact.OTHER) & (_TRIALS["friction"] == Friction.HELD))[0]
)
# Rounding of a velocity, of the velocities at play; rows of contacts that are nearer to parallel
# than this give no solution.
ROUNDING, PARALLEL = NOISE[Kind.POSITION], CLOSED


@inner_kernel
def dot(row, v):
    """The scalar product: the velocity along a contact's row."""
    return row[0] * v[0] + row[1] * v[1] + row[2] * v[2]


@inner_kernel
def size(v):
    """The size of a velocity or of impulses."""
    return abs(v[0]) + abs(v[1]) + abs(v[2])


@inner_kernel
def kinetic_energy(spin, v):
    """Kinetic energy of velocities (xi, y, phi), per unit mass.

    `spin` is one over the moment of inertia.
    """
    return 0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2] / spin)


@called_kernel
def strike_once(block, impact):
    """One stage over the contacts that take part: writes the velocities and impulses after it.

    Every set of these contacts is tried with every friction, unless `_turns_on` knows the only
    answer. Of those that obey the law the one that leaves the least energy is taken. Where none
    does, by rounding or by friction that jams (Painleve), the one that contradicts it least is
    taken, and the result is False.
    """
    bits = _bits_of(impact.taking)
    if bits == _FLOOR and _turns_on(block, impact):
        return True
    least, lowest = np.inf, np.inf
    for place in range(_STRIKES_FROM[bits], _STRIKES_FROM[bits + 1]):
        number = _STRIKES[place]
        if not _try(block, impact, number):
            continue
        scale = size(impact.v) + size(impact.trial) + size(impact.lam)
        wrong = _violation(block, impact, number, ROUNDING * scale)
        energy = kinetic_energy(block.spin, impact.trial)
        lower = wrong == least and energy < lowest - ROUNDING * scale * scale
        if wrong < least or lower:
            least, lowest = wrong, energy
            _keep(impact, number)
    return least == 0.0


@inner_kernel
def _turns_on(block, impact):
    """Whether a block that lands on both bottom corners turns on about the other one, which sticks.

    If so, this stage is written, and nothing else is tried: no other motion obeys the law. The
    floor's push at the corners tells its friction, T = clamp(-(b + w p)/W_tt, mu sum(p)), and the
    two the corners' velocities, b_n + W_nn p + w T. Whatever the friction, the determinant of their
    derivative by p is positive: w is the effect of a mere moment, the sum of p that of a mere push.
    If W_ii > mu |w_i|, all its minors are, so that no two p can solve the same problem. A friction
    below the kinetic cone is one that the static cone allows, too.
    """
    rows, lam, trial = impact.rows, impact.lam, impact.trial
    turns = block.spin * rows[Contact.TANGENT, 2]
    for j in range(Contact.TIP_TOP):
        arm = rows[j, 2]
        if not 1.0 + block.spin * arm * arm > block.mu_k * abs(turns * arm):
            return False
    if not _try(block, impact, _OTHER_HELD):
        return False
    rounding = ROUNDING * (size(impact.v) + size(trial) + size(lam))
    parts = dot(rows[Contact.FOOT], trial) - impact.target[Contact.FOOT]
    if not (parts > rounding and abs(lam[1]) < block.mu_k * lam[0] - rounding):
        return False
    _keep(impact, _OTHER_HELD)
    return True


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
    return abs(system[k, k]) > PARALLEL


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
    worst = max(0.0, -_TRIALS[number].slip * dot(rows[Contact.TANGENT], trial))
    floor_normal = 0.0
    for i in range(count):
        worst = max(worst, -lam[i])
        if _TRIALS[number].rows[i] <= Contact.OTHER:
            floor_normal += lam[i]
    if _TRIALS[number].friction == Friction.HELD:
        worst = max(worst, abs(lam[count]) - block.mu_s * floor_normal)
    for j in range(CONTACTS):
        if impact.taking[j]:
            worst = max(worst, impact.target[j] - dot(rows[j], trial))
    return 0.0 if worst <= rounding else worst


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
        impact.after[0] -= dot(impact.rows[Contact.TANGENT], impact.after)


@called_kernel
def close_slow(block, impact):
    """Closes the contacts that part more slowly than `resting`.

    They strike without rebound and without friction: as many as have a solution, the floor's first.
    """
    impact.target[:] = 0.0
    for j in range(CONTACTS):
        slow = abs(dot(impact.rows[j], impact.v)) < impact.resting
        impact.taking[j] = impact.touching[j] and slow
    bits = _bits_of(impact.taking)
    for place in range(_CLOSES_FROM[bits], _CLOSES_FROM[bits + 1]):
        if _try(block, impact, _CLOSES[place]):
            impact.v = impact.trial
            return
