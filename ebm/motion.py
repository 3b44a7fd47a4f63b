"""Motion of the block for a given set of contacts, as Taylor series: one formulation for every mode.

Natural units: lengths in R, accelerations in g, hence time in sqrt(R/g), unit mass, moment of inertia 1/3.

A mode says which contacts carry force. While the block is *tilted* everything is written in the frame of its pivot: with
S the sign of theta, phi = S theta >= 0, xi = S x, u = S u_g, so that the pivot is always the lower-left corner and the
block always tips to the left; the mirror image of a motion then passes through exactly the same arithmetic. With
s = sin(alpha - phi), c = cos(alpha - phi), s' = sin(alpha + phi), c' = cos(alpha + phi) the contacts are

    pivot on the floor, normal     gap  y - c                 force P along (0, 1, -s)
    pivot on the floor, tangent    slip xi - s                force Q along (1, 0, c)
    tip wall: top corner           gap  xi + delta_a - s'     force N_a along (1, 0, -c')     (case I)
    far wall: lifted bottom corner gap  delta_b - xi - s'     force N_b along (-1, 0, -c')    (case II)

where a triple gives the force on xi, y and the moment about the centroid (relative to unit force), and also the row of the
constraint. A slipping pivot adds Q = -mu_k d |P|. Newton-Euler with these forces and constraints *is* the paper's (3) in
ROCK, (7) and (8) in SLIDE-ROCK and the equations of LEAN and LADDER; tests hold the closed forms against it. Only ROCK is
written out, for speed. While the block is *flat* (theta = 0, both corners down or both walls' corners touching) it
only translates.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ebm.ground import fill_series
from ebm.series import MOST_TERMS, slope, value
from scenes.compiled import kernel


class Setting(NamedTuple):
    """Block, floor and walls in natural units; a gap is infinite where there is no wall."""

    alpha: float
    sin_alpha: float
    cos_alpha: float
    sin_2alpha: float
    cos_2alpha: float
    mu_s: float
    mu_k: float
    e_floor: float
    gap_left: float
    gap_right: float
    e_left: float
    e_right: float
    walls: bool
    #: The pivot sticks whatever the friction force (Housner's block): no slip guard.
    no_slip: bool
    #: The floor can only push (otherwise it can also hold the pivot down: the paper's model).
    unilateral: bool
    #: Largest impact restitution that adds no energy is used instead of e.
    energy_cap: bool


# A mode is a small integer vector.
FAMILY, S, FLOOR, SLIP, PULL, TIP, FAR = range(7)
MODE_SIZE = 7
# m[FAMILY]: FLAT has theta = 0; m[S] is the sign of theta, also what phi = 0 is about to become.
FLAT, TILT = 0, 1
# m[FLOOR]: what the pivot (or, flat, the base) does; m[SLIP] is the direction of slip (frame; world where flat).
OFF, STICK, SLIPPING = 0, 1, 2
# m[PULL]: sign assumed for the normal force P, which gives friction its sense; -1 only with the bilateral pivot.
# m[TIP], m[FAR]: the corner rests on the wall it tips to, or on the other one. Where flat: the side rests on the left wall, on
# the right wall; on the floor a block at rest is then held on that side, whatever the base does.

# Rows of the workspace that hold series.
PHI, OMEGA, SIN, COS, U, G, XI, Y, P, Q, NA, NB, GUARD = range(13)
ROWS = 13

# The state vector: world frame.
X, HEIGHT, THETA, VX, VY, W = range(6)


@kernel
def workspace():
    """Scratch for one trajectory: the series, and the stack of the root search."""
    return np.zeros((ROWS, MOST_TERMS)), np.zeros((48, MOST_TERMS))


@kernel
def delta(b, m, tip):
    """Distance from the initial centroid to the wall on the tip side (or the far side), R."""
    left = (m[S] > 0) == tip
    return b.sin_alpha + (b.gap_left if left else b.gap_right)


@kernel
def tilt_series(b, m, z, gh, gv, t, order, enough, reach, need_forces, a):
    """Fills the workspace with the series of a tilted block's motion about time t; returns their order.

    The order is `order`, or less where the terms fall below `enough` within `reach` (the longest step there can be).
    `need_forces` asks for P and Q also in ROCK, where motion does not depend on them.
    """
    sign = float(m[S])
    phi, omega, sn, cs, u, g = a[PHI], a[OMEGA], a[SIN], a[COS], a[U], a[G]
    fill_series(gh, t, sign, order, u)
    fill_series(gv, t, 1.0, order, g)
    g[0] += 1.0
    phi[0] = sign * z[THETA]
    omega[0] = sign * z[W]
    sn[0] = np.sin(b.alpha - phi[0])
    cs[0] = np.cos(b.alpha - phi[0])
    if m[FLOOR] == STICK and m[TIP] == 0 and m[FAR] == 0:
        return _rock_series(gv.kind == 0, order, enough, reach, need_forces, a)
    xi, y = a[XI], a[Y]
    xi[0] = sign * z[X]
    xi[1] = sign * z[VX]
    y[0] = z[HEIGHT]
    y[1] = z[VY]
    return _contact_series(b, m, order, enough, reach, a)


@kernel
def _rock_series(still_vertical, order, enough, reach, need_forces, a):
    """ROCK, (3): theta'' = (3/4)(u c - S s G0), the pivot sticking; xi and y are s and c up to a constant."""
    phi, omega, sn, cs, u, g = a[PHI], a[OMEGA], a[SIN], a[COS], a[U], a[G]
    scale = 1.0
    small = 0
    for k in range(order):
        ds = 0.0
        dc = 0.0
        push = 0.0
        for j in range(k + 1):
            ds += omega[j] * cs[k - j]
            dc += omega[j] * sn[k - j]
            push += u[j] * cs[k - j]
        weight = sn[k]
        if not still_vertical:
            weight = 0.0
            for j in range(k + 1):
                weight += g[j] * sn[k - j]
        phi[k + 1] = omega[k] / (k + 1)
        sn[k + 1] = -ds / (k + 1)
        cs[k + 1] = dc / (k + 1)
        omega[k + 1] = 0.75 * (push - weight) / (k + 1)
        scale *= reach
        small = small + 1 if abs(omega[k + 1]) * scale < enough else 0
        if small == 3:
            order = k + 1
            break
    if need_forces:
        p, q = a[P], a[Q]
        for k in range(order - 1):
            p[k] = (k + 2) * (k + 1) * cs[k + 2] + g[k]
            q[k] = (k + 2) * (k + 1) * sn[k + 2] + u[k]
        p[order - 1] = p[order] = q[order - 1] = q[order] = 0.0
    return order


@kernel
def _contact_series(b, m, order, enough, reach, a):
    """Newton-Euler with the mode's constraints, solved term by term: the matrix of the unknown forces is the same each time."""
    phi, omega, sn, cs, u, g, xi, y = a[PHI], a[OMEGA], a[SIN], a[COS], a[U], a[G], a[XI], a[Y]
    p, q, na, nb = a[P], a[Q], a[NA], a[NB]
    floor, stick, tip, far = m[FLOOR] != OFF, m[FLOOR] == STICK, m[TIP] != 0, m[FAR] != 0
    kappa = b.mu_k * m[SLIP] * m[PULL] if m[FLOOR] == SLIPPING else 0.0  # Q = -kappa P
    s0, c0 = sn[0], cs[0]
    cp0 = b.sin_2alpha * s0 + b.cos_2alpha * c0
    static = (stick and (tip or far)) or (tip and far)
    matrix = np.zeros((3, 3))
    rows = np.zeros((3, 3))
    columns = np.zeros((3, 3))
    known = np.zeros(3)
    n = 0
    if floor:
        rows[n, 1], rows[n, 2] = 1.0, -s0
        columns[n, 0], columns[n, 1], columns[n, 2] = -kappa, 1.0, -s0 - kappa * c0
        n += 1
    if stick and not (tip and far):  # wedged between two walls the block needs no friction
        rows[n, 0], rows[n, 2] = 1.0, c0
        columns[n, 0], columns[n, 2] = 1.0, c0
        n += 1
    if tip:
        rows[n, 0], rows[n, 2] = 1.0, -cp0
        columns[n, 0], columns[n, 2] = 1.0, -cp0
        n += 1
    if far:
        rows[n, 0], rows[n, 2] = -1.0, -cp0
        columns[n, 0], columns[n, 2] = -1.0, -cp0
        n += 1
    for i in range(n):
        for j in range(n):
            matrix[i, j] = rows[i, 0] * columns[j, 0] + rows[i, 1] * columns[j, 1] + 3.0 * rows[i, 2] * columns[j, 2]
    inverse = inverse_of(matrix, n)
    scale = 1.0
    small = 0
    for k in range(order + 1):
        p[k] = q[k] = na[k] = nb[k] = 0.0
    forces = np.zeros(3)
    for k in range(order - 1):
        i = k + 2
        per = float(i * (i - 1))
        # sin and cos of alpha - phi at order k + 1 are complete; at order i they lack the term of phi[i], still unknown.
        ks = 0.0
        kc = 0.0
        phi[k + 1] = omega[k] / (k + 1)
        for j in range(k + 1):
            ks -= omega[j] * cs[k - j]
            kc += omega[j] * sn[k - j]
        sn[k + 1] = ks / (k + 1)
        cs[k + 1] = kc / (k + 1)
        ks = 0.0
        kc = 0.0
        moment = 0.0
        for j in range(1, k + 2):
            if j <= k:
                moment -= (sn[j] + kappa * cs[j]) * p[k - j]
                moment += cs[j] * q[k - j] if stick else 0.0
                moment -= (b.sin_2alpha * sn[j] + b.cos_2alpha * cs[j]) * (na[k - j] + nb[k - j])
            ks -= omega[j - 1] * cs[i - j]
            kc += omega[j - 1] * sn[i - j]
        ks *= i - 1.0
        kc *= i - 1.0
        kp = b.sin_2alpha * kc - b.cos_2alpha * ks  # of s' = sin(alpha + phi)
        free_x, free_y, free_phi = -u[k], -g[k], 3.0 * moment
        r = 0
        if floor:
            known[r] = kc - free_y + s0 * free_phi
            r += 1
        if stick and not (tip and far):
            known[r] = ks - free_x - c0 * free_phi
            r += 1
        if tip:
            known[r] = kp - free_x + cp0 * free_phi
            r += 1
        if far:
            known[r] = kp + free_x + cp0 * free_phi
            r += 1
        for r in range(n):
            forces[r] = 0.0
            for j in range(n):
                forces[r] += inverse[r, j] * known[j]
        ax, ay, aphi = free_x, free_y, free_phi
        for r in range(n):
            ax += columns[r, 0] * forces[r]
            ay += columns[r, 1] * forces[r]
            aphi += 3.0 * columns[r, 2] * forces[r]
        r = 0
        if floor:
            p[k] = forces[r]
            q[k] = -kappa * p[k]
            r += 1
        if stick and not (tip and far):
            q[k] = forces[r]
            r += 1
        if tip:
            na[k] = forces[r]
            r += 1
        if far:
            nb[k] = forces[r]
        if static:
            ax = aphi = 0.0
            ay = 0.0 if floor else ay
        xi[i] = ax / per
        y[i] = ay / per
        omega[k + 1] = aphi / (k + 1)
        scale *= reach
        size = abs(aphi) + abs(ax) + abs(ay) + abs(sn[k + 1]) + abs(cs[k + 1]) + abs(p[k]) + abs(q[k]) + abs(na[k]) + abs(nb[k])
        small = small + 1 if size * scale < enough else 0
        if small == 3:
            order = i
            break
    i = order
    phi[i] = omega[i - 1] / i
    ks = 0.0
    kc = 0.0
    for j in range(i):
        ks -= omega[j] * cs[i - 1 - j]
        kc += omega[j] * sn[i - 1 - j]
    sn[i] = ks / i
    cs[i] = kc / i
    omega[i] = 0.0
    p[i] = p[i - 1] = q[i] = q[i - 1] = na[i] = na[i - 1] = nb[i] = nb[i - 1] = 0.0
    return order


@kernel
def inverse_of(matrix, n):
    """Inverse of the leading n x n part (n <= 3), by cofactors; infinite entries where it is singular."""
    out = np.zeros((3, 3))
    m = matrix
    if n == 1:
        out[0, 0] = 1.0 / m[0, 0] if m[0, 0] != 0.0 else np.inf
    elif n == 2:
        d = m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
        r = 1.0 / d if d != 0.0 else np.inf
        out[0, 0], out[0, 1], out[1, 0], out[1, 1] = m[1, 1] * r, -m[0, 1] * r, -m[1, 0] * r, m[0, 0] * r
    elif n == 3:
        for i in range(3):
            i1, i2 = (i + 1) % 3, (i + 2) % 3
            for j in range(3):
                j1, j2 = (j + 1) % 3, (j + 2) % 3
                out[j, i] = m[i1, j1] * m[i2, j2] - m[i1, j2] * m[i2, j1]
        d = m[0, 0] * out[0, 0] + m[0, 1] * out[1, 0] + m[0, 2] * out[2, 0]
        r = 1.0 / d if d != 0.0 else np.inf
        for i in range(3):
            for j in range(3):
                out[i, j] *= r
    return out


@kernel
def flat_series(b, m, z, gh, gv, t, order, a):
    """Fills the workspace with the series of a block that only translates (world frame); returns their order.

    Q is the floor's friction, P its normal force on both corners together, N_a the force of a wall that presses.
    """
    u, g, xi, y, p, q, na = a[U], a[G], a[XI], a[Y], a[P], a[Q], a[NA]
    fill_series(gh, t, 1.0, order, u)
    fill_series(gv, t, 1.0, order, g)
    g[0] += 1.0
    xi[0], xi[1], y[0], y[1] = z[X], z[VX], z[HEIGHT], z[VY]
    press = m[TIP] - m[FAR]
    for k in range(order - 1):
        p[k] = g[k] if m[FLOOR] != OFF else 0.0
        q[k] = na[k] = 0.0
        if m[FLOOR] == SLIPPING:
            q[k] = -b.mu_k * m[SLIP] * m[PULL] * p[k]
        if m[FLOOR] == STICK:
            q[k] = u[k]
        elif press != 0:
            na[k] = press * u[k]
        xi[k + 2] = (press * na[k] + q[k] - u[k]) / ((k + 2) * (k + 1))
        y[k + 2] = (p[k] - g[k]) / ((k + 2) * (k + 1))
    for k in range(order - 1, order + 1):
        p[k] = q[k] = na[k] = 0.0
    return order


@kernel
def tilt_state(b, m, order, tau, pivot, a, z):
    """Writes the state at tau after the start of the series into z, on the contacts to rounding.

    `pivot` is the place of a sticking pivot, xi - s.
    """
    sign = float(m[S])
    phi = value(a[PHI], order, tau)
    w = value(a[OMEGA], order - 1, tau)
    if (m[FLOOR] == STICK and (m[TIP] != 0 or m[FAR] != 0)) or (m[TIP] != 0 and m[FAR] != 0):
        phi, w = a[PHI, 0], 0.0
    s, c = np.sin(b.alpha - phi), np.cos(b.alpha - phi)
    if m[FLOOR] == STICK:
        xi, v = pivot + s, -c * w
    elif m[TIP] != 0 or m[FAR] != 0:
        wall = 1.0 if m[TIP] != 0 else -1.0
        reach, reach_rate = np.sin(b.alpha + phi), np.cos(b.alpha + phi)
        xi, v = wall * (reach - delta(b, m, m[TIP] != 0)), wall * reach_rate * w
    else:
        xi, v = value(a[XI], order, tau), slope(a[XI], order, tau)
    if m[FLOOR] != OFF:
        y, vy = c, s * w
    else:
        y, vy = value(a[Y], order, tau), slope(a[Y], order, tau)
    z[X], z[HEIGHT], z[THETA], z[VX], z[VY], z[W] = sign * xi, y, sign * phi, sign * v, vy, sign * w


@kernel
def flat_state(b, m, order, tau, a, z):
    """Writes the state of a translating block at tau after the start of the series into z."""
    if m[TIP] == 0 and m[FAR] == 0 and m[FLOOR] != STICK:
        z[X] = value(a[XI], order, tau)
        z[VX] = slope(a[XI], order, tau)
    else:
        z[VX] = 0.0
    if m[FLOOR] == OFF:
        z[HEIGHT] = value(a[Y], order, tau)
        z[VY] = slope(a[Y], order, tau)
    else:
        z[HEIGHT] = b.cos_alpha
        z[VY] = 0.0
    z[THETA] = z[W] = 0.0
