"""Motion of the block for a given set of contacts, as Taylor series: one formulation for every
mode.

Natural units: lengths in R, accelerations in g, hence time in sqrt(R/g), unit mass; the moment of
inertia of a homogeneous block is then 1/3. x, y are those of the mass's centre, x = 0 where the
block stands first.

A mode says which contacts carry force. While the block is *tilted* everything is written in the
frame of its pivot: with S the sign of theta, phi = S theta >= 0, xi = S x, u = S u_g, so that the
pivot is always the lower-left corner and the block always tips to the left; the mirror image of a
motion then passes through exactly the same arithmetic. With s = R sin(alpha - phi), c = R cos(alpha
- phi) of the pivot, s' = R' sin(alpha' + phi), c' = R' cos(alpha' + phi) of the corner on a wall, R
and alpha being a corner's distance from the mass's centre and its angle from the upright (for a
homogeneous block 1 and its slenderness, whichever the corner), the contacts are

    pivot on the floor, normal     gap  y - c                 force P along (0, 1, -s)
    pivot on the floor, tangent    slip xi - s                force Q along (1, 0, c)
    tip wall: top corner           gap  xi + delta_a - s'     force N_a along (1, 0, -c')  (case I)
    far wall: lifted bottom corner gap  delta_b - xi - s'     force N_b along (-1, 0, -c') (case II)

where a triple gives the force on xi, y and the moment about the centroid (relative to unit force),
and also the row of the constraint. A slipping pivot adds Q = -mu_k d |P|. Newton-Euler with these
forces and constraints *is* the paper's (3) in ROCK, (7) and (8) in SLIDE-ROCK and the equations of
LEAN and LADDER; tests hold the closed forms against it. ROCK and SLIDE-ROCK are written out, for
speed. While the block is *flat* (theta = 0, both corners down or both walls' corners touching) it
only translates.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rockcheck.ebm.core.ground import STILL, fill_series
from rockcheck.ebm.core.lanes import LANES, first, load, put, ramp, shifted, store, zeros
from rockcheck.ebm.core.series import WIDTH, slope, value
from rockcheck.scenes.compiled import inner_kernel, kernel

#: The laws of impacts at several contacts (see ebm.core.laws.contact_impacts).
LAWS = ("moreau", "closed", "open", "floor-first", "leading-first", "trailing-first")
MOREAU, CLOSED_BRANCH, OPEN_BRANCH, FLOOR_FIRST, LEADING_FIRST, TRAILING_FIRST = range(6)


class Side(NamedTuple):
    """One side of the block as it stands: its lower corner, which is the pivot where the block tips
    to that side, and its top corner.

    alpha and radius are a corner's angle from the upright and its distance, seen from the mass's
    centre. The arms of corners on a wall, s' and c', are linear in those of the pivot, s' = S c - C
    s and c' = S s + C c, with (S, C) = (tip_sin, tip_cos) for the top corner of this side and
    (far_sin, far_cos) for the lower corner of the other one.
    """

    alpha: float
    radius: float
    #: Horizontal distance of the corners from the mass's centre.
    arm: float
    top_alpha: float
    top_radius: float
    tip_sin: float
    tip_cos: float
    far_sin: float
    far_cos: float
    #: 1/(I + R^2): 3/4 for a homogeneous block.
    share: float


class Setting(NamedTuple):
    """Block, floor and walls in natural units; a gap is infinite where there is no wall."""

    left: Side
    right: Side
    #: Height of the mass's centre where the block stands, and 1/I.
    height: float
    spin: float
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
    #: An impact that would add energy uses the largest restitution that does not, instead of e.
    energy_cap: bool
    #: The law of impacts at several contacts, an index into LAWS. None with the bilateral pivot,
    #: which needs none: the event loop is then compiled without it.
    law: int | None


#: Static friction of a frictionless floor. With less, rounding in the tail of a base acceleration
#: would move a resting block.
LEAST_FRICTION = 1e-9

# A mode is a small integer vector.
FAMILY, S, FLOOR, SLIP, PULL, TIP, FAR = range(7)
MODE_SIZE = 7
# m[FAMILY]: FLAT has theta = 0. m[S] is the sign of theta; at phi = 0, the sign that it is about to
# take.
FLAT, TILT = 0, 1
# m[FLOOR]: what the pivot (or, flat, the base) does; m[SLIP] is the direction of slip (frame; world
# where flat).
OFF, STICK, SLIPPING = 0, 1, 2
# m[PULL]: sign assumed for the normal force P, which gives friction its sense; -1 only with the
# bilateral pivot. m[TIP], m[FAR]: the corner rests on the wall it tips to, or on the other one.
# Where flat: the side rests on the left wall, on the right wall; on the floor a block at rest is
# then held on that side, whatever the base does.

# Rows of the workspace that hold series.
(
    PHI,
    OMEGA,
    SIN,
    COS,
    U,
    G,
    XI,
    Y,
    P,
    Q,
    NA,
    NB,
    GUARD,
    KNOWN,
    FORCE,
    FLOOR_ARM,
    WALL_ARM,
    WALL_PUSH,
) = range(18)
# Rows in which the small linear system of the contacts is put together, three each.
ROW, COLUMN, MATRIX, INVERSE = range(18, 30, 3)
# The last angle whose sine and cosine were taken, and these: the end of a step is the start of the
# next one.
ANGLE = 30
# The guards of the mode, a row each: the weights of the series in it (see ebm.core.guards).
TABLE = 31
ROWS = TABLE + 14

RECIPROCAL = np.array([np.inf] + [1.0 / k for k in range(1, WIDTH + 2)])

# The state vector: world frame.
X, HEIGHT, THETA, VX, VY, W = range(6)


@kernel
def workspace(rows=ROWS):
    """Scratch for one trajectory: the series (G = 1: no vertical motion), and the stack of the root
    search."""
    series = np.zeros((rows, WIDTH))
    series[G, 0] = series[ANGLE, 2] = 1.0
    return series, np.zeros((48, WIDTH))


@inner_kernel
def sine_cosine(angle, a):
    """Sine and cosine of the angle. The workspace keeps the last ones."""
    if a[ANGLE, 0] != angle:
        a[ANGLE, 0], a[ANGLE, 1], a[ANGLE, 2] = angle, np.sin(angle), np.cos(angle)
    return a[ANGLE, 1], a[ANGLE, 2]


@inner_kernel
def side_of(b, sense):
    """The side to which a block tips whose rotation has this sign."""
    return b.left if sense > 0 else b.right


@inner_kernel
def delta(b, m, tip):
    """Distance from the mass's initial centre to the wall on the tip side (or the far side), R."""
    left = (m[S] > 0) == tip
    return b.left.arm + b.gap_left if left else b.right.arm + b.gap_right


@inner_kernel
def tilt_series(b, m, z, gh, gv, t, order, enough, reach, a):
    """Fills the workspace with the series of a tilted block's motion about time t; returns their
    order.

    The order is `order`, or less where the terms fall below `enough` within `reach` (the longest
    step there can be). ROCK, whose motion does not depend on P and Q, has them where the setting
    asks for a guard on them.
    """
    sign = float(m[S])
    fill_series(gh, t, sign, order, a, U)
    if gv.kind != STILL:  # otherwise G is 1 throughout, as the run has set it
        fill_series(gv, t, 1.0, order, a, G)
        a[G, 0] += 1.0
    a[PHI, 0] = sign * z[THETA]
    a[OMEGA, 0] = sign * z[W]
    side = side_of(b, m[S])
    sine, cosine = sine_cosine(side.alpha - a[PHI, 0], a)
    a[SIN, 0], a[COS, 0] = side.radius * sine, side.radius * cosine
    if m[FLOOR] == STICK and m[TIP] == 0 and m[FAR] == 0:
        return _rock_series(
            side.share, gv.kind == STILL, order, enough, reach, b.unilateral or not b.no_slip, a
        )
    a[XI, 0] = sign * z[X]
    a[XI, 1] = sign * z[VX]
    a[Y, 0] = z[HEIGHT]
    a[Y, 1] = z[VY]
    if m[FLOOR] == STICK and m[TIP] != m[FAR]:
        return _lean_series(b, side, m[TIP] != 0, order, a)
    if m[FLOOR] == SLIPPING and m[TIP] == 0 and m[FAR] == 0:
        return _slide_series(b.spin, b.mu_k * m[SLIP] * m[PULL], order, enough, reach, a)
    return _contact_series(b, side, m, order, enough, reach, a)


@inner_kernel
def _products(a, x, y, first, last, n):
    """The sum of x_j y_(n-j) for j from `first` to `last`. The ends, which are the newest
    coefficients, are added last:

    so the processor need not wait for them to begin with the sum.
    """
    total = 0.0
    for j in range(first + 1, last):
        total += a[x, j] * a[y, n - j]
    if first < last:
        total += a[x, first] * a[y, n - first]
    if first <= last:
        total += a[x, last] * a[y, n - last]
    return total


@inner_kernel
def _rock_series(share, still_vertical, order, enough, reach, need_forces, a):
    """ROCK, (3): theta'' = (u c - S s G0)/(I + R^2), the pivot sticking; xi and y are s and c up to
    a constant."""
    w0, s0, c0, u0 = a[OMEGA, 0], a[SIN, 0], a[COS, 0], a[U, 0]
    w, s, c = w0, s0, c0
    ds, dc, push = w0 * c0, w0 * s0, u0 * c0
    # Lane i of `of_w` is w's coefficient i + 1. Lane i of `more_ds` is what is known of the sum
    # that is needed i + 1 orders later: the products of all coefficients so far but the first ones.
    # These are added where they are needed, so that no order waits for its lanes.
    of_w = of_s = of_c = of_u = zeros()
    more_ds = more_dc = more_push = zeros()
    scale = 1.0
    small = 0
    for k in range(order):
        weight = s
        if not still_vertical:
            weight = 0.0
            for j in range(k + 1):
                weight += a[G, j] * a[SIN, k - j]
        r = RECIPROCAL[k + 1]
        a[PHI, k + 1] = w * r
        w, s, c, u = share * r * (push - weight), -ds * r, dc * r, a[U, k + 1]
        a[OMEGA, k + 1], a[SIN, k + 1], a[COS, k + 1] = w, s, c
        ds = first(more_ds) + w0 * c + w * c0
        dc = first(more_dc) + w0 * s + w * s0
        push = first(more_push) + u0 * c + u * c0
        of_w, of_u = put(of_w, k, w), put(of_u, k, u)
        more_ds = shifted(more_ds) + of_w * c + of_c * w
        more_dc = shifted(more_dc) + of_w * s + of_s * w
        more_push = shifted(more_push) + of_u * c + of_c * u
        of_s, of_c = put(of_s, k, s), put(of_c, k, c)
        scale *= reach
        # A uniform rotation has no higher rates, but its sine and cosine do.
        small = small + 1 if (abs(w) + abs(s) + abs(c)) * scale < enough else 0
        if (
            not still_vertical and abs(a[G, k]) * scale >= enough
        ):  # at its balance point only P feels the vertical motion
            small = 0
        if small == 3:
            order = k + 1
            break
    if need_forces:
        for half in (0, LANES):
            bend = (ramp() + (half + 1.0)) * (ramp() + (half + 2.0))
            store(a, P, half, load(a, COS, half + 2) * bend + load(a, G, half))
            store(a, Q, half, load(a, SIN, half + 2) * bend + load(a, U, half))
        a[P, order - 1] = a[P, order] = a[Q, order - 1] = a[Q, order] = 0.0
    return order


@inner_kernel
def _slide_series(spin, kappa, order, enough, reach, a):
    """SLIDE-ROCK, (7): of the contacts only the pivot's acts, with P and Q = -kappa P. The general
    solution, written out for speed."""
    sine, cosine = a[SIN, 0], a[COS, 0]
    arm = sine + kappa * cosine
    share = 1.0 / (1.0 + spin * sine * arm)
    a[PHI, 1], a[SIN, 1], a[COS, 1] = a[OMEGA, 0], -a[OMEGA, 0] * cosine, a[OMEGA, 0] * sine
    w0, s, c = a[OMEGA, 0], a[SIN, 1], a[COS, 1]
    ds, dc, moment = -w0 * c, w0 * s, 0.0
    first_push = last_arm = 0.0
    # As for ROCK. The products with P, which is known one order later than the others, are one
    # order behind.
    of_w = of_s = of_c = of_arm = of_push = zeros()
    more_ds = more_dc = more_moment = zeros()
    scale = 1.0
    small = 0
    for k in range(order - 1):
        # s, c: of order k + 1; ds, dc: their rates of that order, but for the term of phi's
        # acceleration of order k, the unknown.
        push = share * (dc * (k + 1.0) + a[G, k] + sine * spin * moment)
        turn, slide, rise = spin * (moment - arm * push), -a[U, k] - kappa * push, push - a[G, k]
        size = abs(turn) + abs(slide) + abs(rise) + abs(s) + abs(c) + abs(push) + abs(kappa * push)
        a[P, k], a[Q, k] = push, -kappa * push
        once, twice = RECIPROCAL[k + 1], RECIPROCAL[k + 1] * RECIPROCAL[k + 2]
        a[XI, k + 2], a[Y, k + 2] = slide * twice, rise * twice
        w = turn * once
        a[OMEGA, k + 1], a[PHI, k + 2] = w, turn * twice
        of_w = put(of_w, k, w)
        more_ds = shifted(more_ds) + of_w * c + of_c * w
        more_dc = shifted(more_dc) + of_w * s + of_s * w
        of_s, of_c = put(of_s, k, s), put(of_c, k, c)
        if k == 0:
            first_push = push
        else:
            of_arm = put(of_arm, k - 1, last_arm)
            more_moment = shifted(more_moment) + of_arm * push + of_push * last_arm
            of_push = put(of_push, k - 1, push)
        last_arm = s + kappa * c
        moment = -first(more_moment) - last_arm * first_push
        s, c = (ds - w * cosine) * RECIPROCAL[k + 2], (dc + w * sine) * RECIPROCAL[k + 2]
        a[SIN, k + 2], a[COS, k + 2] = s, c
        ds, dc = -first(more_ds) - w0 * c, first(more_dc) + w0 * s
        scale *= reach
        small = small + 1 if size * scale < enough else 0
        if small == 3:
            order = k + 2
            break
    a[OMEGA, order] = a[P, order - 1] = a[P, order] = a[Q, order - 1] = a[Q, order] = 0.0
    return order


@inner_kernel
def _lean_series(b, side, tip, order, a):
    """LEAN: nothing moves, and the wall takes the moment about the pivot.

    Written out: the arm of a far wall can be so short that the general solution loses all its
    digits.
    """
    s, c = a[SIN, 0], a[COS, 0]
    wall = 1.0 if tip else -1.0
    arm = (
        c + side.tip_sin * s + side.tip_cos * c
        if tip
        else (b.left.arm + b.right.arm) * np.sin(a[PHI, 0])
    )  # c - c'
    push = NA if tip else NB
    for k in range(order + 1):
        a[P, k] = a[Q, k] = a[NA, k] = a[NB, k] = 0.0
        if k > 0:
            a[PHI, k] = a[OMEGA, k] = a[SIN, k] = a[COS, k] = a[XI, k] = a[Y, k] = 0.0
    a[OMEGA, 0] = 0.0
    for k in range(order - 1):
        a[P, k] = a[G, k]
        a[push, k] = wall * (a[U, k] * c - a[G, k] * s) / arm
        a[Q, k] = a[U, k] - wall * a[push, k]
    return order


@inner_kernel
def _contact_rows(b, side, kappa, floor, stick, tip, far, a):
    """Constraint rows, force columns (xi, y, moment) and the inverse of their matrix at the start;
    returns their number."""
    s, c = a[SIN, 0], a[COS, 0]
    tip_arm, far_arm = side.tip_sin * s + side.tip_cos * c, side.far_sin * s + side.far_cos * c
    n = 0
    for which in range(4):
        if not (floor, stick, tip, far)[which]:
            continue
        for k in range(3):
            a[ROW + n, k] = a[COLUMN + n, k] = 0.0
        if which == 0:
            a[ROW + n, 1], a[ROW + n, 2] = 1.0, -s
            a[COLUMN + n, 0], a[COLUMN + n, 1], a[COLUMN + n, 2] = -kappa, 1.0, -s - kappa * c
        else:
            along = 1.0 if which < 3 else -1.0
            a[ROW + n, 0] = a[COLUMN + n, 0] = along
            a[ROW + n, 2] = a[COLUMN + n, 2] = (
                c if which == 1 else (-tip_arm if which == 2 else -far_arm)
            )
        n += 1
    for i in range(n):
        for j in range(n):
            a[MATRIX + i, j] = a[ROW + i, 0] * a[COLUMN + j, 0] + a[ROW + i, 1] * a[COLUMN + j, 1]
            a[MATRIX + i, j] += b.spin * a[ROW + i, 2] * a[COLUMN + j, 2]
    inverse_of(a, MATRIX, INVERSE, n)
    return n


@inner_kernel
def _contact_series(b, side, m, order, enough, reach, a):
    """Newton-Euler with the mode's constraints, solved term by term: the matrix of the unknown
    forces is the same each time."""
    floor, tip, far = m[FLOOR] != OFF, m[TIP] != 0, m[FAR] != 0
    static = tip and far
    stick = m[FLOOR] == STICK and not static  # wedged between two walls the block needs no friction
    kappa = b.mu_k * m[SLIP] * m[PULL] if m[FLOOR] == SLIPPING else 0.0  # Q = -kappa P
    n = _contact_rows(b, side, kappa, floor, stick, tip, far, a)
    s0, c0 = a[SIN, 0], a[COS, 0]
    scale = 1.0
    small = 0
    for k in range(order + 1):
        a[P, k] = a[Q, k] = a[NA, k] = a[NB, k] = 0.0
    a[PHI, 1], a[SIN, 1], a[COS, 1] = a[OMEGA, 0], -a[OMEGA, 0] * c0, a[OMEGA, 0] * s0
    for k in range(order - 1):
        i = k + 2
        # The rates of sine and cosine at order k + 1 lack only the term of phi's acceleration at
        # order k, the unknown.
        ds = -_products(a, OMEGA, COS, 0, k, k + 1)
        dc = _products(a, OMEGA, SIN, 0, k, k + 1)
        moment = _moment_of_lower_orders(side, kappa, floor, stick, tip, far, k, a)
        ax, ay, aphi = _accelerations(
            b, side, n, kappa, floor, stick, tip, far, ds * (i - 1.0), dc * (i - 1.0), moment, k, a
        )
        if static:
            ax = aphi = 0.0
            ay = 0.0 if floor else ay
        twice = RECIPROCAL[i] * RECIPROCAL[k + 1]
        a[XI, i], a[Y, i] = ax * twice, ay * twice
        a[OMEGA, k + 1] = aphi * RECIPROCAL[k + 1]
        a[PHI, i] = a[OMEGA, k + 1] * RECIPROCAL[i]
        a[SIN, i] = (ds - a[OMEGA, k + 1] * c0) * RECIPROCAL[i]
        a[COS, i] = (dc + a[OMEGA, k + 1] * s0) * RECIPROCAL[i]
        scale *= reach
        size = abs(aphi) + abs(ax) + abs(ay) + abs(a[SIN, k + 1]) + abs(a[COS, k + 1])
        size += abs(a[P, k]) + abs(a[Q, k]) + abs(a[NA, k]) + abs(a[NB, k])
        small = small + 1 if size * scale < enough else 0
        if small == 3:
            order = i
            break
    i = order
    a[OMEGA, i] = 0.0
    a[P, i] = a[P, i - 1] = a[Q, i] = a[Q, i - 1] = a[NA, i] = a[NA, i - 1] = a[NB, i] = a[
        NB, i - 1
    ] = 0.0
    return order


@inner_kernel
def _moment_of_lower_orders(side, kappa, floor, stick, tip, far, k, a):
    """Coefficient k of the moment that the forces' coefficients below k give, by their arms' later
    terms; none where both walls hold it."""
    moment = 0.0
    if floor:
        a[FLOOR_ARM, k] = a[SIN, k] + kappa * a[COS, k]
        moment -= _products(a, FLOOR_ARM, P, 1, k, k)
    if stick:
        moment += _products(a, COS, Q, 1, k, k)
    if tip or far:
        along, across = (side.tip_sin, side.tip_cos) if tip else (side.far_sin, side.far_cos)
        a[WALL_ARM, k] = along * a[SIN, k] + across * a[COS, k]
        moment -= _products(a, WALL_ARM, WALL_PUSH, 1, k, k)
    return moment


@inner_kernel
def _accelerations(b, side, n, kappa, floor, stick, tip, far, ks, kc, moment, k, a):
    """Coefficient k of the accelerations (xi, y, phi) and of the n contact forces, so that the
    constraints hold.

    `ks`, `kc` are the accelerations of sine and cosine but for phi's own, `moment` that of the
    forces' lower coefficients.
    """
    tip_reach, far_reach = (
        side.tip_sin * kc - side.tip_cos * ks,
        side.far_sin * kc - side.far_cos * ks,
    )  # of s'
    s, c = a[SIN, 0], a[COS, 0]
    tip_arm, far_arm = side.tip_sin * s + side.tip_cos * c, side.far_sin * s + side.far_cos * c
    ax, ay, aphi = -a[U, k], -a[G, k], b.spin * moment
    r = 0
    for which in range(4):
        if (floor, stick, tip, far)[which]:
            a[KNOWN, r] = (
                kc - ay + s * aphi,
                ks - ax - c * aphi,
                tip_reach - ax + tip_arm * aphi,
                far_reach + ax + far_arm * aphi,
            )[which]
            r += 1
    for r in range(n):
        force = 0.0
        for j in range(n):
            force += a[INVERSE + r, j] * a[KNOWN, j]
        a[FORCE, r] = force
        ax += a[COLUMN + r, 0] * force
        ay += a[COLUMN + r, 1] * force
        aphi += b.spin * a[COLUMN + r, 2] * force
    r = 0
    for which in range(4):
        if (floor, stick, tip, far)[which]:
            a[(P, Q, NA, NB)[which], k] = a[FORCE, r]
            r += 1
    if not stick:
        a[Q, k] = -kappa * a[P, k]
    a[WALL_PUSH, k] = a[NA, k] + a[NB, k]
    return ax, ay, aphi


@inner_kernel
def inverse_of(a, matrix, inverse, n):
    """Inverse of the n x n matrix (n <= 3) in the rows from `matrix` on, by cofactors, into the
    rows from `inverse` on.

    Its entries are infinite or NaN where the matrix is singular.
    """
    if n == 1:
        a[inverse, 0] = 1.0 / a[matrix, 0]
    elif n == 2:
        r = 1.0 / (a[matrix, 0] * a[matrix + 1, 1] - a[matrix, 1] * a[matrix + 1, 0])
        a[inverse, 0], a[inverse, 1] = a[matrix + 1, 1] * r, -a[matrix, 1] * r
        a[inverse + 1, 0], a[inverse + 1, 1] = -a[matrix + 1, 0] * r, a[matrix, 0] * r
    elif n == 3:
        for i in range(3):
            i1, i2 = matrix + (i + 1) % 3, matrix + (i + 2) % 3
            for j in range(3):
                j1, j2 = (j + 1) % 3, (j + 2) % 3
                a[inverse + j, i] = a[i1, j1] * a[i2, j2] - a[i1, j2] * a[i2, j1]
        d = (
            a[matrix, 0] * a[inverse, 0]
            + a[matrix, 1] * a[inverse + 1, 0]
            + a[matrix, 2] * a[inverse + 2, 0]
        )
        for i in range(3):
            for j in range(3):
                a[inverse + i, j] /= d


@inner_kernel
def flat_series(b, m, z, gh, gv, t, order, a):
    """Fills the workspace with the series of a block that only translates (world frame); returns
    their order.

    Q is the floor's friction, P its normal force on both corners together, N_a the force of a wall
    that presses.
    """
    fill_series(gh, t, 1.0, order, a, U)
    if gv.kind != STILL:  # otherwise G is 1 throughout, as the run has set it
        fill_series(gv, t, 1.0, order, a, G)
        a[G, 0] += 1.0
    a[XI, 0], a[XI, 1], a[Y, 0], a[Y, 1] = z[X], z[VX], z[HEIGHT], z[VY]
    press = m[TIP] - m[FAR]
    for k in range(order - 1):
        a[P, k] = a[G, k] if m[FLOOR] != OFF else 0.0
        a[Q, k] = a[NA, k] = 0.0
        if m[FLOOR] == SLIPPING:
            a[Q, k] = -b.mu_k * m[SLIP] * m[PULL] * a[P, k]
        if m[FLOOR] == STICK:
            a[Q, k] = a[U, k]
        elif press != 0:
            a[NA, k] = press * a[U, k]
        a[XI, k + 2] = (press * a[NA, k] + a[Q, k] - a[U, k]) / ((k + 2) * (k + 1))
        a[Y, k + 2] = (a[P, k] - a[G, k]) / ((k + 2) * (k + 1))
    for k in range(order - 1, order + 1):
        a[P, k] = a[Q, k] = a[NA, k] = 0.0
    return order


@inner_kernel
def tilt_state(b, m, order, tau, pivot, a, z):
    """Writes the state at tau after the start of the series into z, on the contacts to rounding.

    `pivot` is the place of a sticking pivot, xi - s.
    """
    sign = float(m[S])
    phi = value(a, PHI, order, tau)
    w = value(a, OMEGA, order - 1, tau)
    if (m[FLOOR] == STICK and (m[TIP] != 0 or m[FAR] != 0)) or (m[TIP] != 0 and m[FAR] != 0):
        phi, w = a[PHI, 0], 0.0
    side = side_of(b, m[S])
    sine, cosine = sine_cosine(side.alpha - phi, a)
    s, c = side.radius * sine, side.radius * cosine
    if m[FLOOR] == STICK:
        xi, v = pivot + s, -c * w
    elif m[TIP] != 0 or m[FAR] != 0:
        wall = 1.0 if m[TIP] != 0 else -1.0
        other = side_of(b, -m[S])
        radius, angle = (
            (side.top_radius, side.top_alpha + phi)
            if m[TIP] != 0
            else (other.radius, other.alpha + phi)
        )
        reach, reach_rate = radius * np.sin(angle), radius * np.cos(angle)
        xi, v = wall * (reach - delta(b, m, m[TIP] != 0)), wall * reach_rate * w
    else:
        xi, v = value(a, XI, order, tau), slope(a, XI, order, tau)
    if m[FLOOR] != OFF:
        y, vy = c, s * w
    else:
        y, vy = value(a, Y, order, tau), slope(a, Y, order, tau)
    z[X], z[HEIGHT], z[THETA], z[VX], z[VY], z[W] = sign * xi, y, sign * phi, sign * v, vy, sign * w


@inner_kernel
def flat_state(b, m, order, tau, a, z):
    """Writes the state of a translating block at tau after the start of the series into z."""
    if m[TIP] == 0 and m[FAR] == 0 and m[FLOOR] != STICK:
        z[X] = value(a, XI, order, tau)
        z[VX] = slope(a, XI, order, tau)
    else:
        z[X] = a[XI, 0]
        z[VX] = 0.0
    if m[FLOOR] == OFF:
        z[HEIGHT] = value(a, Y, order, tau)
        z[VY] = slope(a, Y, order, tau)
    else:
        z[HEIGHT] = b.height
        z[VY] = 0.0
    z[THETA] = z[W] = 0.0
