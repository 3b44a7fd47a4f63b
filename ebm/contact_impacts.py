"""Impacts where the floor can only push: Newton's restitution with Coulomb friction at every contact that is touched.

In the pivot's frame (see ebm.motion), natural units. Six contacts: the pivot F and the other bottom corner E on the floor, the
top and bottom corner on the tip wall, the bottom and top corner on the far wall; E and the second corner of a wall touch
only at theta = 0. Candidate sets of contacts that receive an impulse are enumerated, with the floor sticking, slipping
either way or frictionless; those are feasible in which impulses push, the other touched contacts do not close, and friction
obeys Coulomb; of several the one that leaves the least kinetic energy is taken.

Contacts struck at one instant form a cascade, floor before walls, until none approaches. A wall stage with e > 0 takes along
only the floor; contacts that rest already take part in every other stage. A block that slides flat into a wall is one group.
"""

from __future__ import annotations

import math

import numpy as np

from rockcheck.ebm.motion import inverse_of
from rockcheck.scenes.compiled import inner_kernel, kernel

F, E, TIP_TOP, TIP_BOTTOM, FAR_BOTTOM, FAR_TOP = range(6)
CONTACTS = 6
_NONE, _STICK, _PLUS, _MINUS = range(4)
_TINY = 1e-13
_MOST_STAGES = 40
_HALVINGS = 45


@kernel
def contact_rows(alpha, phi):
    """Rows (xi, y, phi) of the six normal contacts and, last, of the floor's tangent."""
    s, c = math.sin(alpha - phi), math.cos(alpha - phi)
    sp, cp = math.sin(alpha + phi), math.cos(alpha + phi)
    rows = np.zeros((7, 3))
    rows[F, 1], rows[F, 2] = 1.0, -s
    rows[E, 1], rows[E, 2] = 1.0, sp
    rows[TIP_TOP, 0], rows[TIP_TOP, 2] = 1.0, -cp
    rows[TIP_BOTTOM, 0], rows[TIP_BOTTOM, 2] = 1.0, c
    rows[FAR_BOTTOM, 0], rows[FAR_BOTTOM, 2] = -1.0, -cp
    rows[FAR_TOP, 0], rows[FAR_TOP, 2] = -1.0, c
    rows[6, 0], rows[6, 2] = 1.0, c
    return rows


@inner_kernel
def _dot(row, v):
    return row[0] * v[0] + row[1] * v[1] + row[2] * v[2]


@inner_kernel
def kinetic_energy(v):
    """Kinetic energy of velocities (xi, y, phi), per unit mass."""
    return 0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2] / 3.0)


@kernel
def _strike(rows, taking, target, mu_s, mu_k, v, after, impulse):
    """One simultaneous impact over the contacts in `taking`: writes the velocities after it and the impulses; True if feasible."""
    best = np.inf
    lam = np.zeros(4)
    members = np.zeros(3, dtype=np.int64)
    matrix = np.zeros((6, 3))  # and its inverse
    column = np.zeros((3, 3))
    trial = np.zeros(3)
    for mask in range(1 << CONTACTS):
        count = 0
        inside = True
        for j in range(CONTACTS):
            if mask >> j & 1:
                if not taking[j] or count == 3:
                    inside = False
                    break
                members[count] = j
                count += 1
        if not inside:
            continue
        on_floor = (mask & 3) != 0
        for friction in range(4):
            if (friction != _NONE and not on_floor) or (friction == _NONE and on_floor and mu_s > 0.0):
                continue
            unknowns = count + (1 if friction == _STICK else 0)
            if unknowns > 3:
                continue
            kappa = mu_k if friction == _PLUS else (-mu_k if friction == _MINUS else 0.0)
            for i in range(unknowns):
                index = members[i] if i < count else 6
                for k in range(3):
                    column[i, k] = rows[index, k] - (kappa * rows[6, k] if index <= E else 0.0)
            for i in range(unknowns):
                row = rows[members[i]] if i < count else rows[6]
                for j in range(unknowns):
                    matrix[i, j] = row[0] * column[j, 0] + row[1] * column[j, 1] + 3.0 * row[2] * column[j, 2]
            inverse_of(matrix, 0, 3, unknowns)
            if unknowns > 0 and not _well_posed(matrix, unknowns):
                continue
            feasible = True
            for k in range(3):
                trial[k] = v[k]
            floor_normal = 0.0
            for i in range(unknowns):
                lam[i] = 0.0
                for j in range(unknowns):
                    want = target[members[j]] - _dot(rows[members[j]], v) if j < count else -_dot(rows[6], v)
                    lam[i] += matrix[3 + i, j] * want
                if i < count and lam[i] < -_TINY:
                    feasible = False
                if i < count and members[i] <= E:
                    floor_normal += lam[i]
                trial[0] += column[i, 0] * lam[i]
                trial[1] += column[i, 1] * lam[i]
                trial[2] += 3.0 * column[i, 2] * lam[i]
            if not feasible:
                continue
            slip = _dot(rows[6], trial)
            if friction == _STICK and abs(lam[count]) > mu_s * floor_normal + _TINY:
                continue
            if (friction == _PLUS and slip < -_TINY) or (friction == _MINUS and slip > _TINY):
                continue
            for j in range(CONTACTS):
                if taking[j] and not mask >> j & 1 and _dot(rows[j], trial) < target[j] - _TINY:
                    feasible = False
            if not feasible:
                continue
            energy = kinetic_energy(trial)
            if energy < best - 1e-15:
                best = energy
                for k in range(3):
                    after[k] = trial[k]
                for j in range(CONTACTS):
                    impulse[j] = 0.0
                for i in range(count):
                    impulse[members[i]] = max(lam[i], 0.0)
                if friction == _STICK:
                    after[0] -= _dot(rows[6], after)  # rounding only: the pivot stands
    return best < np.inf


@inner_kernel
def _well_posed(matrix, n):
    """Whether the inverse (rows 3 to 5) of the small matrix is finite and not mere rounding (parallel contacts give none)."""
    size = 0.0
    for i in range(n):
        for j in range(n):
            if not math.isfinite(matrix[3 + i, j]):
                return False
            size = max(size, abs(matrix[3 + i, j]) * abs(matrix[j, i]))
    return size < 1e10


@kernel
def contact_impact(b, phi, touching, e_tip, e_far, resting, v, impulse, tally):
    """The whole cascade at one instant; v (xi, y, phi rates) becomes the velocities after it. Returns False where none was found.

    `touching[6]` says which gaps are closed, `resting` is the approach speed below which a contact closes for good.
    `impulse[2]` gathers the normal impulses of floor and walls; `tally[0]` counts stages that added energy and `tally[1]` keeps the
    largest relative gain.
    """
    rows = contact_rows(b.alpha, phi)
    taking = np.zeros(CONTACTS, dtype=np.bool_)
    target = np.zeros(CONTACTS)
    after = np.zeros(3)
    part = np.zeros(CONTACTS)
    approach = np.zeros(CONTACTS)
    for stage in range(_MOST_STAGES):
        group = -1
        for j in range(CONTACTS):
            approach[j] = _dot(rows[j], v) if touching[j] else 0.0
            if group < 0 and approach[j] < -_TINY:
                group = j // 2
        if group < 0:
            _close(rows, touching, resting, v)
            return True
        e = b.e_floor if group == 0 else (e_tip if group == 1 else e_far)
        if 2 * stage >= _MOST_STAGES:
            e = 0.0  # what goes to and fro between floor and wall ends plastic
        scale, low, high = 1.0, 0.0, 1.0
        before = kinetic_energy(v)
        for trial in range(_HALVINGS + 1):
            for j in range(CONTACTS):
                mine = j // 2 == group
                alone = group > 0 and e > 0.0
                taking[j] = touching[j] and (mine or j <= E or (not alone and approach[j] >= -_TINY))
                target[j] = 0.0
                if mine and approach[j] < -resting:
                    target[j] = -scale * e * approach[j]
            if not _strike(rows, taking, target, b.mu_s, b.mu_k, v, after, part):
                return False
            gain = kinetic_energy(after) - before
            if not b.energy_cap or e == 0.0 or (trial == 0 and gain <= 0.0) or trial == _HALVINGS:
                break
            low, high = (low, scale) if gain > 0.0 else (scale, high)
            scale = low if trial == _HALVINGS - 1 else 0.5 * (low + high)  # the largest restitution that adds no energy
        if gain > 1e-12 * before + 1e-18:
            tally[0] += 1.0
            tally[1] = max(tally[1], gain / before)
        for j in range(CONTACTS):
            impulse[0 if j <= E else 1] += part[j]
        for k in range(3):
            v[k] = after[k]
    return False


@kernel
def _close(rows, touching, resting, v):
    """Contacts that part more slowly than `resting` are closed: the velocity is projected onto them, mass-orthogonally."""
    members = np.zeros(3, dtype=np.int64)
    count = 0
    for j in range(CONTACTS):
        if touching[j] and count < 3 and abs(_dot(rows[j], v)) < resting:
            members[count] = j
            count += 1
    while count > 0:
        matrix = np.zeros((6, 3))
        for i in range(count):
            for j in range(count):
                r, q = rows[members[i]], rows[members[j]]
                matrix[i, j] = r[0] * q[0] + r[1] * q[1] + 3.0 * r[2] * q[2]
        inverse_of(matrix, 0, 3, count)
        if _well_posed(matrix, count):
            change = np.zeros(3)
            for i in range(count):
                for j in range(count):
                    share = -matrix[3 + i, j] * _dot(rows[members[j]], v)
                    change[0] += rows[members[i], 0] * share
                    change[1] += rows[members[i], 1] * share
                    change[2] += 3.0 * rows[members[i], 2] * share
            for k in range(3):
                v[k] += change[k]
            return
        count -= 1
