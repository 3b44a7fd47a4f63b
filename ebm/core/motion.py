"""Motion of the block as Taylor series: one formulation for every set of contacts.

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

from collections import namedtuple

import numpy as np

from rockcheck.ebm.core.block import side_of, wall_corner, wall_turn
from rockcheck.ebm.core.ground import fill_series
from rockcheck.ebm.core.lanes import LANES, first, load, put, ramp, shifted, store, zeros
from rockcheck.ebm.core.names import Family, Kind, Pivot, Row, Shape
from rockcheck.ebm.core.series import NOISE, RECIPROCAL, product, slope, value
from rockcheck.ebm.core.state import on_wall, rocks
from rockcheck.scenes.compiled import called_kernel, inner_kernel


@inner_kernel
def arm_and_height(side, phi, a):
    """`arm_of` and `height_of` a block that tips by phi. The workspace keeps the last angle's."""
    if phi == 0.0:
        return side.arm, side.height
    angle = side.alpha - phi
    if a[Row.ANGLE, 0] != angle:
        a[Row.ANGLE, 0], a[Row.ANGLE, 1], a[Row.ANGLE, 2] = angle, np.sin(angle), np.cos(angle)
    return side.radius * a[Row.ANGLE, 1], side.radius * a[Row.ANGLE, 2]


@inner_kernel
def mode_series(block, base, run, order, enough, reach):
    """Fills the workspace with the series of the mode's motion; returns their order.

    In the state it notes the place of a pivot that sticks.
    The series begin now. The order is `order`, or less where the terms of a tilted block fall below
    `enough` within `reach` (the longest step there can be). ROCK, whose motion does not depend on P
    and Q, has them where the setting needs a guard on them. A force has two terms fewer than the
    order, a rate one.
    """
    mode, motion, a, sign = run.state.mode, run.state.motion, run.a, float(run.state.mode.sense)
    still = base.vertical.form.kind == Shape.STILL
    fill_series(base.horizontal, run.state.t, sign, order, a, Row.U)
    if not still:  # otherwise G is 1 throughout, as the run has set it
        fill_series(base.vertical, run.state.t, 1.0, order, a, Row.G)
        a[Row.G, 0] += 1.0
    a[Row.XI, 0], a[Row.XI, 1] = sign * motion.x, sign * motion.vx
    a[Row.Y, 0], a[Row.Y, 1] = motion.y, motion.vy
    a[Row.Z, 0], a[Row.LATE, 0] = sign * run.state.zeta, 0.0
    if mode.family == Family.FLAT:
        return _flat_series(block, run.state, order, a)
    a[Row.PHI, 0], a[Row.OMEGA, 0] = sign * motion.theta, sign * motion.w
    side = side_of(block, mode.sense)
    a[Row.SIN, 0], a[Row.COS, 0] = arm_and_height(side, a[Row.PHI, 0], a)
    run.state.place = sign * motion.x - a[Row.SIN, 0]
    if rocks(mode):
        forces = block.unilateral or not block.no_slip
        return _rock_series(side.share, still, order, enough, reach, forces, a)
    if mode.pivot == Pivot.STICK and mode.tip != mode.far:
        return _lean_series(block, side, mode.tip != 0, order, a)
    w0, s0, c0 = a[Row.OMEGA, 0], a[Row.SIN, 0], a[Row.COS, 0]
    a[Row.PHI, 1], a[Row.SIN, 1], a[Row.COS, 1] = w0, -w0 * c0, w0 * s0
    if mode.pivot == Pivot.SLIPPING and not on_wall(mode) and not run.state.winds:
        kappa = friction(block, run.state)
        return _slide_series(block.spin, kappa, order, enough, reach, a)
    return _contact_series(block, run.state, order, enough, reach, a)


@inner_kernel
def friction(block, state):
    """The friction Q = -kappa P of a pivot that slips, as kappa; with z, as it is now.

    That of a pivot that has not yielded is Bouc-Wen's, whose z is known in the world's frame.
    """
    mode = state.mode
    if state.winds:
        return block.mu_k * mode.sense * state.zeta * mode.pull
    return block.mu_k * mode.slip * mode.pull if mode.pivot == Pivot.SLIPPING else 0.0


@inner_kernel
def _wind(block, state, k, a):
    """Coefficient k + 1 of z by (9) with beta = gamma = 1/2 and n = 2, and k of its friction.

    What comes before them is given. The pivot loads where V z > 0. LATE is what the later terms of
    z add to the friction -kappa P.
    """
    if not state.winds:
        return
    mode = state.mode
    a[Row.Q, k] += a[Row.LATE, k]
    turned_by = a[Row.SIN, k + 1] if mode.family == Family.TILT else 0.0
    rate = a[Row.V, k] = (k + 1) * (a[Row.XI, k + 1] - turned_by)
    if mode.slip * a[Row.Z, 0] > -NOISE[Kind.POSITION]:
        a[Row.Z2, k] = product(a, Row.Z, Row.Z, k)
        rate -= product(a, Row.V, Row.Z2, k)
    a[Row.Z, k + 1] = rate / (block.yields * (k + 1))
    late = _products(a, Row.Z, Row.P, 1, k + 1, k + 1)
    a[Row.LATE, k + 1] = -block.mu_k * mode.pull * late


@inner_kernel
def _products(a, x, y, first, last, n):
    """The sum of x_j y_(n-j) for j from `first` to `last`.

    The ends, which are the newest coefficients, are added last, so that the processor can begin the
    sum without them.
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
    """ROCK, (3): theta'' = (u c - S s G0)/(I + R^2), the pivot sticking.

    xi and y are s and c up to a constant.
    """
    w0, s0, c0, u0 = a[Row.OMEGA, 0], a[Row.SIN, 0], a[Row.COS, 0], a[Row.U, 0]
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
        weight = s if still_vertical else product(a, Row.G, Row.SIN, k)
        r = RECIPROCAL[k + 1]
        a[Row.PHI, k + 1] = w * r
        w, s, c, u = share * r * (push - weight), -ds * r, dc * r, a[Row.U, k + 1]
        a[Row.OMEGA, k + 1], a[Row.SIN, k + 1], a[Row.COS, k + 1] = w, s, c
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
        # At its balance point only P feels the vertical motion.
        if not still_vertical and abs(a[Row.G, k]) * scale >= enough:
            small = 0
        if small == 3:
            order = k + 1
            break
    if need_forces:
        for half in (0, LANES):
            bend = (ramp() + (half + 1.0)) * (ramp() + (half + 2.0))
            store(a, Row.P, half, load(a, Row.COS, half + 2) * bend + load(a, Row.G, half))
            store(a, Row.Q, half, load(a, Row.SIN, half + 2) * bend + load(a, Row.U, half))
    return order


@inner_kernel
def _slide_series(spin, kappa, order, enough, reach, a):
    """SLIDE-ROCK, (7): of the contacts only the pivot's acts, with P and Q = -kappa P.

    The general solution, written out for speed.
    """
    sine, cosine = a[Row.SIN, 0], a[Row.COS, 0]
    arm = sine + kappa * cosine
    share = 1.0 / (1.0 + spin * sine * arm)
    w0, s, c = a[Row.OMEGA, 0], a[Row.SIN, 1], a[Row.COS, 1]
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
        push = share * (dc * (k + 1.0) + a[Row.G, k] + sine * spin * moment)
        turn, slide, rise = (
            spin * (moment - arm * push),
            -a[Row.U, k] - kappa * push,
            push - a[Row.G, k],
        )
        size = abs(turn) + abs(slide) + abs(rise) + abs(s) + abs(c) + abs(push) + abs(kappa * push)
        a[Row.P, k], a[Row.Q, k] = push, -kappa * push
        once, twice = RECIPROCAL[k + 1], RECIPROCAL[k + 1] * RECIPROCAL[k + 2]
        a[Row.XI, k + 2], a[Row.Y, k + 2] = slide * twice, rise * twice
        w = turn * once
        a[Row.OMEGA, k + 1], a[Row.PHI, k + 2] = w, turn * twice
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
        a[Row.SIN, k + 2], a[Row.COS, k + 2] = s, c
        ds, dc = -first(more_ds) - w0 * c, first(more_dc) + w0 * s
        scale *= reach
        small = small + 1 if size * scale < enough else 0
        if small == 3:
            order = k + 2
            break
    return order


@called_kernel
def _lean_series(block, side, tip, order, a):
    """LEAN: nothing moves, and the wall takes the moment about the pivot.

    Written out: the arm of a far wall can be so short that the general solution loses all its
    digits.
    """
    s, c = a[Row.SIN, 0], a[Row.COS, 0]
    wall = 1.0 if tip else -1.0
    # The wall's arm about the pivot, c - c'.
    arm = (
        c + side.tip_sin * s + side.tip_cos * c
        if tip
        else (block.left.arm + block.right.arm) * np.sin(a[Row.PHI, 0])
    )
    push = Row.NA if tip else Row.NB
    a[Row.OMEGA, 0] = 0.0
    for k in range(1, order + 1):
        a[Row.PHI, k] = a[Row.OMEGA, k] = a[Row.SIN, k] = a[Row.COS, k] = 0.0
        a[Row.XI, k] = a[Row.Y, k] = 0.0
    for k in range(order - 1):
        a[Row.P, k] = a[Row.G, k]
        a[push, k] = wall * (a[Row.U, k] * c - a[Row.G, k] * s) / arm
        a[Row.Q, k] = a[Row.U, k] - wall * a[push, k]
    return order


#: The contacts of a mode: the side that the block tips to, `spin` = 1/I, the friction `kappa` of a
#: slipping pivot (Q = -kappa P), which contacts act (floor, tip wall, far wall), and the place of
#: each among those that act. What is written there for one that does not act is overwritten by the
#: next one, or stands behind the last one.
_Acting = namedtuple("_Acting", "side spin kappa acts places")


@inner_kernel
def _wall_arms(side, s, c):
    """C' of the corners on the tip wall and on the far wall."""
    return side.tip_sin * s + side.tip_cos * c, side.far_sin * s + side.far_cos * c


@inner_kernel
def _contact_rows(acting, a):
    """Writes constraint rows, force columns (xi, y, moment) and the inverse of their matrix.

    They are those at the start of the step. Returns their number. Beyond Painleve's limit, where
    the floor answers an approach with less push, the inverse is NaN, and with it the motion: it
    does not begin.
    """
    s, c, kappa = a[Row.SIN, 0], a[Row.COS, 0], acting.kappa
    tip_arm, far_arm = _wall_arms(acting.side, s, c)
    along, upward = (0.0, 1.0, -1.0), (1.0, 0.0, 0.0)
    turns, slips = (-s, -tip_arm, -far_arm), (kappa, 0.0, 0.0)
    n = acting.places[2] + acting.acts[2]
    for which in range(3):
        row, column = Row.CONSTRAINT + acting.places[which], Row.COLUMN + acting.places[which]
        a[row, 0], a[row, 1], a[row, 2] = along[which], upward[which], turns[which]
        a[column, 0], a[column, 1] = -kappa if which == 0 else along[which], upward[which]
        a[column, 2] = turns[which] - slips[which] * c
    for i in range(Row.CONSTRAINT, Row.CONSTRAINT + n):
        row = i - Row.CONSTRAINT + Row.MATRIX
        for j in range(n):
            column = Row.COLUMN + j
            a[row, j] = a[i, 0] * a[column, 0] + a[i, 1] * a[column, 1]
            a[row, j] += acting.spin * a[i, 2] * a[column, 2]
    inverse_of(a, Row.MATRIX, Row.INVERSE, n)
    if acting.acts[0] and not a[Row.INVERSE, 0] > 0.0:
        a[Row.INVERSE, 0] = np.nan
    return n


@called_kernel
def _contact_series(block, state, order, enough, reach, a):
    """Newton-Euler with the mode's constraints, solved term by term; returns the order.

    The matrix of the unknown forces is the same for each term.
    """
    mode = state.mode
    floor, tip, far = int(mode.pivot != Pivot.OFF), mode.tip, mode.far
    side, kappa = side_of(block, mode.sense), friction(block, state)
    acting = _Acting(side, block.spin, kappa, (floor, tip, far), (0, floor, floor + tip))
    n = _contact_rows(acting, a)
    s0, c0 = a[Row.SIN, 0], a[Row.COS, 0]
    scale = 1.0
    small = 0
    for k in range(order - 1):
        i = k + 2
        # The rates of sine and cosine at order k + 1 lack only the term of phi's acceleration at
        # order k, the unknown.
        ds = -_products(a, Row.OMEGA, Row.COS, 0, k, k + 1)
        dc = _products(a, Row.OMEGA, Row.SIN, 0, k, k + 1)
        along, moment = -a[Row.U, k], _moment_of_lower_orders(acting, k, a)
        if state.winds:
            along += a[Row.LATE, k]
            moment += product(a, Row.COS, Row.LATE, k)
        free = ds * (i - 1.0), dc * (i - 1.0), along, moment
        ax, ay, aphi = _accelerations(acting, n, free, k, a)
        _wind(block, state, k, a)
        if tip and far:
            ax = aphi = 0.0
            ay = 0.0 if floor else ay
        twice = RECIPROCAL[i] * RECIPROCAL[k + 1]
        a[Row.XI, i], a[Row.Y, i] = ax * twice, ay * twice
        a[Row.OMEGA, k + 1] = aphi * RECIPROCAL[k + 1]
        a[Row.PHI, i] = a[Row.OMEGA, k + 1] * RECIPROCAL[i]
        a[Row.SIN, i] = (ds - a[Row.OMEGA, k + 1] * c0) * RECIPROCAL[i]
        a[Row.COS, i] = (dc + a[Row.OMEGA, k + 1] * s0) * RECIPROCAL[i]
        scale *= reach
        size = abs(aphi) + abs(ax) + abs(ay) + abs(a[Row.SIN, k + 1]) + abs(a[Row.COS, k + 1])
        size += abs(a[Row.P, k]) + abs(a[Row.Q, k]) + abs(a[Row.NA, k]) + abs(a[Row.NB, k])
        small = small + 1 if size * scale < enough else 0
        if small == 3:
            order = i
            break
    return order


@inner_kernel
def _moment_of_lower_orders(acting, k, a):
    """Coefficient k of the moment of the forces' coefficients below k, by their arms' later terms.

    None where both walls hold it.
    """
    moment, (floor, tip, far) = 0.0, acting.acts
    if floor:
        a[Row.FLOOR_ARM, k] = a[Row.SIN, k] + acting.kappa * a[Row.COS, k]
        moment -= _products(a, Row.FLOOR_ARM, Row.P, 1, k, k)
    if tip or far:
        along, across = wall_turn(acting.side, tip)
        a[Row.WALL_ARM, k] = along * a[Row.SIN, k] + across * a[Row.COS, k]
        moment -= _products(a, Row.WALL_ARM, Row.WALL_PUSH, 1, k, k)
    return moment


@inner_kernel
def _accelerations(acting, n, free, k, a):
    """Coefficient k of the accelerations (xi, y, phi), the constraints being kept.

    The n contact forces for that are written into the workspace. `free` are the accelerations of
    sine and cosine but for phi's own, and what moves xi and phi but for the unknown forces.
    """
    side, (ks, kc, along, moment) = acting.side, free
    tip_reach, far_reach = _wall_arms(side, kc, -ks)  # the rates of s'
    s, c = a[Row.SIN, 0], a[Row.COS, 0]
    tip_arm, far_arm = _wall_arms(side, s, c)
    ax, ay, aphi = along, -a[Row.G, k], acting.spin * moment
    for which in range(3):
        a[Row.KNOWN, acting.places[which]] = (
            kc - ay + s * aphi,
            tip_reach - ax + tip_arm * aphi,
            far_reach + ax + far_arm * aphi,
        )[which]
    for r in range(n):
        force = 0.0
        for j in range(n):
            force += a[Row.INVERSE + r, j] * a[Row.KNOWN, j]
        a[Row.FOUND, r] = force
        ax += a[Row.COLUMN + r, 0] * force
        ay += a[Row.COLUMN + r, 1] * force
        aphi += acting.spin * a[Row.COLUMN + r, 2] * force
    for which in range(3):
        force = a[Row.FOUND, acting.places[which]] if acting.acts[which] else 0.0
        a[(Row.P, Row.NA, Row.NB)[which], k] = force
    a[Row.Q, k] = -acting.kappa * a[Row.P, k]
    a[Row.WALL_PUSH, k] = a[Row.NA, k] + a[Row.NB, k]
    return ax, ay, aphi


@inner_kernel
def inverse_of(a, matrix, inverse, n):
    """Inverse of an n x n matrix (n <= 3), by cofactors.

    The matrix stands in the rows from `matrix` on, its inverse is written into those from `inverse`
    on. The entries are infinite or NaN where the matrix is singular.
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
def _flat_series(block, state, order, a):
    """FLAT: the block only translates.

    Q is the floor's friction, P its normal force on both corners together, N_a the force of a wall
    that presses.
    """
    mode = state.mode
    press, kappa = mode.tip - mode.far, friction(block, state)
    for k in range(order - 1):
        a[Row.P, k] = a[Row.G, k] if mode.pivot != Pivot.OFF else 0.0
        a[Row.Q, k] = a[Row.NA, k] = 0.0
        if mode.pivot == Pivot.SLIPPING:
            a[Row.Q, k] = -kappa * a[Row.P, k]
            _wind(block, state, k, a)
        if mode.pivot == Pivot.STICK:
            a[Row.Q, k] = a[Row.U, k]
        elif press != 0:
            a[Row.NA, k] = press * a[Row.U, k]
        a[Row.XI, k + 2] = (press * a[Row.NA, k] + a[Row.Q, k] - a[Row.U, k]) / ((k + 2) * (k + 1))
        a[Row.Y, k + 2] = (a[Row.P, k] - a[Row.G, k]) / ((k + 2) * (k + 1))
    return order


@inner_kernel
def motion_at(block, state, a, tau, motion):
    """Writes the motion at tau after the start of the series into `motion`.

    That of a tilted block is on its contacts to rounding.
    """
    mode, order, pivot = state.mode, state.order, state.place
    if mode.family == Family.FLAT:
        _flat_at(block, state, a, tau, motion)
        return
    sign = float(mode.sense)
    phi = value(a, Row.PHI, order, tau)
    w = value(a, Row.OMEGA, order - 1, tau)
    if (mode.pivot == Pivot.STICK and on_wall(mode)) or (mode.tip != 0 and mode.far != 0):
        phi, w = a[Row.PHI, 0], 0.0
    side = side_of(block, mode.sense)
    s, c = arm_and_height(side, phi, a)
    if mode.pivot == Pivot.STICK:
        xi, v = pivot + s, -c * w
    elif on_wall(mode):
        wall, faces = (1.0, side) if mode.tip != 0 else (-1.0, side_of(block, -mode.sense))
        radius, alpha = wall_corner(faces, mode.tip != 0)
        reach, reach_rate = radius * np.sin(alpha + phi), radius * np.cos(alpha + phi)
        xi, v = wall * (reach - (faces.arm + faces.gap)), wall * reach_rate * w
    else:
        xi, v = _place_at(a, Row.XI, order, tau)
    y, vy = (c, s * w) if mode.pivot != Pivot.OFF else _place_at(a, Row.Y, order, tau)
    motion.x, motion.y, motion.theta = sign * xi, y, sign * phi
    motion.vx, motion.vy, motion.w = sign * v, vy, sign * w


@inner_kernel
def _flat_at(block, state, a, tau, motion):
    """Writes the motion of a translating block."""
    mode, order = state.mode, state.order
    stays, lies = on_wall(mode) or mode.pivot == Pivot.STICK, mode.pivot != Pivot.OFF
    motion.x, motion.vx = (a[Row.XI, 0], 0.0) if stays else _place_at(a, Row.XI, order, tau)
    motion.y, motion.vy = (block.height, 0.0) if lies else _place_at(a, Row.Y, order, tau)
    motion.theta = motion.w = 0.0


@inner_kernel
def _place_at(a, row, order, tau):
    """A coordinate and its rate."""
    return value(a, row, order, tau), slope(a, row, order, tau)
