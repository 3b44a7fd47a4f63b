"""The model `ebm-bouc-wen`: the bilateral pivot with the paper's regularised friction (9) in place
of stick and slip.

The floor's friction force on the pivot is Q = -mu_k |P| z. The hysteretic variable z replaces the
sign of the slip velocity V and follows it over the yield displacement u_y:

    z' = (-gamma |V| z |z|^(n-1) - beta V |z|^n + V) / u_y,    beta = gamma = 1/2, n = 2,

that is z' = V (1 - z^2)/u_y while the pivot *loads* (V z > 0) and z' = V/u_y while it unloads. A
pivot that sticks is thus a stiff undamped spring, and after some u_y of slip z = +-1, which is an
invariant state: the pivot has *yielded* and slips as in (7), (8) until V = 0. So the equation,
stiff as it looks (eigenvalue -2 |V|/u_y), is smooth between the instants at which V or z changes
sign, and needs no stiff integrator: Taylor steps stop there, and hold z once it has come within the
tolerance of +-1. Everything else (guards, impacts, natural units, state and mode vectors) is the
exact model's.

What (9) leaves open: a block at rest on its base does not move at all, z being -u/(mu_k G0), so
that it uplifts or slides exactly when it should. Impacts are the paper's, with their own stick and
slip; they change velocities only, so that z goes on through them. "slip" and "stick" events, and
the modes, tell a yielded pivot (SLIDE-ROCK, LADDER) from one that has not (ROCK, LEAN).
"""

from __future__ import annotations

import math

from rockcheck.ebm.core.contacts import SLOW, closed_wall, slip_velocity, stop, upright
from rockcheck.ebm.core.ground import acceleration, acceleration_after, fill_series, weightless_at
from rockcheck.ebm.core.guards import (
    G_CONE_MINUS,
    G_CONE_PLUS,
    G_FAR_GAP,
    G_FAR_PUSH,
    G_LOADS,
    G_PUSH,
    G_SLIP,
    G_TIP_GAP,
    G_TIP_PUSH,
    G_UPLIFT_PLUS,
    drop,
    fill_guards,
    first_event,
    guard,
)
from rockcheck.ebm.core.modes import SLACK, code_of, hangs_flat, slacken, tips_first
from rockcheck.ebm.core.motion import (
    COS,
    FAMILY,
    FAR,
    FLAT,
    FLOOR,
    GUARD,
    LEAST_FRICTION,
    NA,
    NB,
    OMEGA,
    PHI,
    PULL,
    ROWS,
    SIN,
    SLIP,
    SLIPPING,
    STICK,
    THETA,
    TILT,
    TIP,
    VX,
    XI,
    G,
    P,
    Q,
    S,
    U,
    W,
    X,
    flat_series,
    side_of,
    sine_cosine,
    tilt_series,
    workspace,
)
from rockcheck.ebm.core.rules import HANGS, LEAST_CONTRADICTION, MODE_AGAIN, PULLS
from rockcheck.ebm.core.running import (
    GOING,
    HOLDS,
    RELEASE,
    SLIPS,
    STICKS,
    UPLIFT,
    ZETA,
    T,
    mode_code,
    note,
)
from rockcheck.ebm.core.series import (
    AHEAD,
    FORCE,
    INSTANT,
    NO_ROOT,
    NOISE,
    ORDER,
    POSITION,
    first_root,
    force_step,
    leading,
    step_size,
    value,
)
from rockcheck.scenes.compiled import inner_kernel, kernel

# Rows of the workspace after those of ebm.core.motion: z, V and what the recurrences need.
Z, V, Z2, SPIN2, WEIGHT, ARM, TURN, REACH, INERTIA, LOAD, PUSH, ZA, LEVER, DEN, TORQUE = range(
    ROWS, ROWS + 15
)
_ROWS = ROWS + 15

_LOOK = 6
# z tends to 1 and never reaches it. Within this distance the difference is noise (a block may tip
# just as it slips): it has yielded.
_YIELDS = 1e-6
# It has also yielded within this multiple of the tolerance, and within rounding.
_NEARLY = 10.0


@kernel
def friction_workspace():
    """Scratch for one run with Bouc-Wen friction."""
    return workspace(_ROWS)


@inner_kernel
def _product(a, x, y, k):
    """Coefficient k of the product of two rows."""
    total = 0.0
    for j in range(k + 1):
        total += a[x, j] * a[y, k - j]
    return total


@inner_kernel
def _fill_z(a, k, loads, yielded, yield_displacement):
    """Coefficient k + 1 of z by (9) with beta = gamma = 1/2 and n = 2, given those of V and z up to
    k."""
    if yielded:
        a[Z, k + 1] = 0.0
        return
    rate = a[V, k]
    if loads:
        a[Z2, k] = _product(a, Z, Z, k)
        rate -= _product(a, V, Z2, k)
    a[Z, k + 1] = rate / (yield_displacement * (k + 1))


@inner_kernel
def friction_series(b, m, z, zeta, yielded, yield_displacement, gh, gv, t, order, a):
    """Fills the workspace with the series of a block whose pivot, or base, carries the friction
    force -mu_k |P| z.

    Tilted, in the pivot's frame (see ebm.core.motion): with Sw = +-1 where a corner rests on the
    tip or far wall, else 0, C = Sw c', J = I + C^2, f = u - Sw s' w^2, g = G0 - c w^2 and k = mu_k
    z sgn P,

        P = (g J - s C f) / (J + s^2 + k s (c + C)),   Q = -k P,
        J theta'' = -s P + (c + C) Q - C f,

    which is (7), (8) with z for d where Sw = 0, and LADDER with z for d otherwise. Flat: P = G0,
    x'' = Q - u.
    """
    sign = float(m[S])
    fill_series(gh, t, sign, order, a, U)
    fill_series(gv, t, 1.0, order, a, G)
    a[G, 0] += 1.0
    a[XI, 0], a[XI, 1] = sign * z[X], sign * z[VX]
    a[Z, 0] = sign * zeta
    loads = m[SLIP] * a[Z, 0] > -NOISE[POSITION]
    friction = b.mu_k * m[PULL]
    for k in range(order + 1):
        a[P, k] = a[Q, k] = a[NA, k] = a[NB, k] = 0.0
    if m[FAMILY] == FLAT:
        for k in range(order - 1):
            a[P, k] = a[G, k]
            a[Q, k] = -friction * _product(a, Z, P, k)
            a[XI, k + 2] = (a[Q, k] - a[U, k]) / ((k + 2) * (k + 1))
            a[V, k] = (k + 1) * a[XI, k + 1]
            _fill_z(a, k, loads, yielded, yield_displacement)
        return
    wall = float(m[TIP] - m[FAR])
    push = NA if m[TIP] != 0 else NB
    a[PHI, 0], a[OMEGA, 0] = sign * z[THETA], sign * z[W]
    side = side_of(b, m[S])
    wall_sin, wall_cos = (
        (side.tip_sin, side.tip_cos) if m[TIP] != 0 else (side.far_sin, side.far_cos)
    )
    sine, cosine = sine_cosine(side.alpha - a[PHI, 0], a)
    a[SIN, 0], a[COS, 0] = side.radius * sine, side.radius * cosine
    for k in range(order):
        a[PHI, k + 1] = a[OMEGA, k] / (k + 1)
        a[SIN, k + 1] = -_product(a, OMEGA, COS, k) / (k + 1)
        a[COS, k + 1] = _product(a, OMEGA, SIN, k) / (k + 1)
        a[V, k] = (k + 1) * (a[XI, k + 1] - a[SIN, k + 1])
        if k == order - 1:
            break
        a[SPIN2, k] = _product(a, OMEGA, OMEGA, k)
        a[WEIGHT, k] = a[G, k] - _product(a, COS, SPIN2, k)  # g
        a[TURN, k] = wall * (wall_sin * a[SIN, k] + wall_cos * a[COS, k])  # C
        a[ARM, k] = a[COS, k] + a[TURN, k]
        a[INERTIA, k] = 1.0 / b.spin if k == 0 else 0.0
        a[LOAD, k] = 0.0  # f
        normal = a[WEIGHT, k] / b.spin
        if wall != 0.0:
            a[REACH, k] = wall_sin * a[COS, k] - wall_cos * a[SIN, k]  # s'
            a[INERTIA, k] += _product(a, TURN, TURN, k)
            a[LOAD, k] = a[U, k] - wall * _product(a, REACH, SPIN2, k)
            a[PUSH, k] = _product(a, TURN, LOAD, k)  # C f
            normal = _product(a, WEIGHT, INERTIA, k) - _product(a, SIN, PUSH, k)
        a[ZA, k] = _product(a, Z, ARM, k)
        a[LEVER, k] = a[SIN, k] + friction * a[ZA, k]  # s + k (c + C)
        a[DEN, k] = a[INERTIA, k] + _product(a, SIN, LEVER, k)
        for j in range(1, k + 1):
            normal -= a[DEN, j] * a[P, k - j]
        a[P, k] = normal / a[DEN, 0]
        a[Q, k] = -friction * _product(a, Z, P, k)
        moment = -_product(a, LEVER, P, k)
        if wall != 0.0:
            moment -= a[PUSH, k]
            for j in range(1, k + 1):
                moment -= a[INERTIA, j] * a[TORQUE, k - j]
        a[TORQUE, k] = moment / a[INERTIA, 0]  # theta''
        a[OMEGA, k + 1] = a[TORQUE, k] / (k + 1)
        along = a[Q, k] - a[U, k]
        if (
            wall != 0.0
        ):  # the corner slides on the wall: x'' = Sw (c' theta'' - s' w^2), which takes the force N
            held = _product(a, TURN, TORQUE, k) - wall * _product(a, REACH, SPIN2, k)
            a[push, k] = wall * (held - along)
            along = held
        a[XI, k + 2] = along / ((k + 2) * (k + 1))
        _fill_z(a, k, loads, yielded, yield_displacement)


@inner_kernel
def _held(b, z, gh, gv, t):
    """Whether a flat block without speed stays at rest: the base neither lifts nor slides it, or
    presses it on a wall.

    One that stays at its limit, but for rounding, is at rest; its guards say when it leaves.
    """
    g, u = 1.0 + acceleration(gv, t), acceleration(gh, t)
    to_left, to_right = b.left.arm / b.height, b.right.arm / b.height
    slope = to_left if (u > 0.0) == (g >= 0.0) else to_right
    if (
        abs(abs(u) - (min(slope, b.mu_s) if g >= 0.0 else slope) * abs(g)) < NOISE[FORCE]
    ):  # at its limit: where it goes decides
        g, u = 1.0 + acceleration_after(gv, t), acceleration_after(gh, t)
    left, right = closed_wall(b, z, 1, False), closed_wall(b, z, -1, False)
    if (
        g < 0.0 and not left and not right
    ):  # hanging: by both corners, as long as nothing at all tells to which side it tips
        return u == 0.0
    if g < 0.0:  # a wall on which it is pressed holds it flat
        return (left and u >= -to_right * g - NOISE[FORCE]) or (
            right and u <= to_left * g + NOISE[FORCE]
        )
    share = 1.0 if b.mu_s == LEAST_FRICTION else g
    low, high = (
        -min(to_right, b.mu_s) * share - NOISE[FORCE],
        min(to_left, b.mu_s) * share + NOISE[FORCE],
    )
    return (u <= high or left) and (u >= low or right)


@inner_kernel
def _hangs_on(m, gh, gv, t):
    """Whether the floor begins to fall away faster than g under a block at rest, and nothing tells
    to which side it would tip."""
    stands = m[FLOOR] == STICK and m[PULL] > 0 and m[TIP] == 0 and m[FAR] == 0
    still = acceleration(gh, t) == 0.0 and acceleration_after(gh, t) == 0.0
    return stands and still and acceleration_after(gv, t) < -1.0


@inner_kernel
def _rest(b, m, z, gv, t):
    """The mode of a block at rest on its base."""
    m[:] = 0
    m[FAMILY], m[S], m[PULL], m[FLOOR] = FLAT, 1, 1 if acceleration(gv, t) > -1.0 else -1, STICK
    m[TIP], m[FAR] = closed_wall(b, z, 1, False), closed_wall(b, z, -1, False)


@inner_kernel
def _waits(z, gv, r):
    """The time at which a block at rest may move. Friction fails as the push of the floor ends:
    what moves in between is rounding."""
    if z[THETA] == 0.0 and z[W] == 0.0 and z[VX] == 0.0:
        r.now[T] = weightless_at(gv, r.now[T])
    return r.now[T]


@inner_kernel
def _leave_rest(b, gh, gv, r, sense, yield_displacement, a):
    """The block at rest starts to slide, or to tilt, as u of sign `sense` grows; returns z =
    -u/(mu_k G0), +-1 if it slides."""
    m, z, t = r.m, r.z, r.now[T]
    u, g = acceleration(gh, t), 1.0 + acceleration(gv, t)
    soon = (
        1.0 + acceleration_after(gv, t) <= 0.0
    )  # friction falls with P: nothing tips until the floor pulls
    hangs = g <= 0.0 if abs(g) > NOISE[FORCE] else soon
    arm = side_of(b, sense).arm
    held = hangs or soon or closed_wall(b, z, sense, False)
    tips = b.mu_k * b.height > (1.0 + _YIELDS) * arm
    if hangs or tips:
        zeta = min(max(-u / max(b.mu_k * abs(g), SLOW), -1.0), 1.0)
        if u != 0.0 and abs(abs(u) - g * min(arm / b.height, b.mu_k)) < NOISE[FORCE]:
            # Just where it tips or slips. Near g = 0 the quotient is no better known, and its
            # rounding would act as a moment.
            limit = min(arm / (b.height * b.mu_k), 1.0) if b.mu_k > 0.0 else 1.0
            zeta = -math.copysign(limit, u if abs(u) > NOISE[FORCE] else float(sense))
        if _tip(b, gh, gv, r, sense, zeta, not held, yield_displacement, a):
            return zeta
    if held or (tips and abs(u) < g * b.mu_k):
        r.rules[MODE_AGAIN] += 1
        _rest(b, m, z, gv, t)
        return 0.0
    m[:] = 0
    m[FAMILY], m[S], m[PULL], m[FLOOR], m[SLIP] = FLAT, 1, 1, SLIPPING, -sense
    return -float(sense)


@inner_kernel
def _tip(b, gh, gv, r, first, zeta, free, yield_displacement, a):
    """Lets a flat block tilt to the side on which its rotation grows, `first` if it can; returns
    whether there is one.

    One that nothing holds is `free` to tilt though its rotation grows so slowly that rounding hides
    it: friction has yet to wind up. A tilt that has ended at this instant does not begin again.
    """
    m, z, t = r.m, r.z, r.now[T]
    v = slip_velocity(b, z)
    for sense in (first, -first):
        m[:] = 0
        m[FAMILY], m[S], m[SLIP] = TILT, sense, 1 if sense * v > 0.0 else -1
        _close_walls(b, m, z, zeta, yield_displacement, gh, gv, t, -1, r.memory[SLACK], r.rules, a)
        grows = leading(a, PHI, _LOOK, NOISE[POSITION], AHEAD)
        if not r.tried[code_of(m)] and (grows > 0 or (grows == 0 and free)):
            return True
    return False


@inner_kernel
def _begin(b, gh, gv, r, zeta, yield_displacement, a):
    """The contacts of a block that starts, or goes on after an impact, into m; returns z, changed
    only where it was at rest."""
    m, z, t = r.m, r.z, r.now[T]
    v = slip_velocity(b, z)
    if z[THETA] == 0.0 and z[W] == 0.0:
        if v == 0.0:
            if not _held(b, z, gh, gv, t):
                return _leave_rest(b, gh, gv, r, tips_first(b, z, gh, t), yield_displacement, a)
            _rest(b, m, z, gv, t)
            return 0.0
        m[:] = 0
        m[FAMILY], m[S], m[PULL], m[FLOOR], m[SLIP] = FLAT, 1, 1, SLIPPING, 1 if v > 0.0 else -1
        return zeta
    sense = 1 if (z[THETA] if z[THETA] != 0.0 else z[W]) > 0.0 else -1
    m[:] = 0
    m[FAMILY], m[S], m[SLIP] = TILT, sense, 1 if sense * v > 0.0 else -1
    _close_walls(b, m, z, zeta, yield_displacement, gh, gv, t, -1, r.memory[SLACK], r.rules, a)
    return zeta


@inner_kernel
def _wedged_series(b, m, z, zeta, gh, gv, t, order, reach, a):
    """The series of a block that both walls hold (see ebm.core.motion), and the share of its
    friction in what they carry."""
    order = tilt_series(b, m, z, gh, gv, t, order, 0.0, reach, a)
    side = side_of(b, m[S])
    tip, far = (
        side.tip_sin * a[SIN, 0] + side.tip_cos * a[COS, 0],
        side.far_sin * a[SIN, 0] + side.far_cos * a[COS, 0],
    )
    mean = 0.5 * (tip + far)  # of the levers of the walls' forces
    friction = b.mu_k * m[S] * zeta * math.copysign(1.0, a[P, 0])
    for k in range(order + 1):
        a[Q, k] = -friction * a[P, k]
        a[NA, k] += 0.5 * (a[COS, 0] / mean - far / mean) * a[Q, k]
        a[NB, k] += 0.5 * (a[COS, 0] / mean + tip / mean) * a[Q, k]
    return order


@inner_kernel
def _close_walls(b, m, z, zeta, yield_displacement, gh, gv, t, which, slack, rules, a):
    """Lets the corners of a tilting block rest on the touched walls that would push them. Sets with
    more walls are tried first.

    A push that `which` has just ended (-1: none) does not go on where anything else fits, however
    near to zero it still is. `slack` multiplies what counts as noise: at one instant it doubles
    with each further event.
    """
    ended = m[PULL] if which == G_PUSH else 0
    lets_go = 1 if which == G_TIP_PUSH else (2 if which == G_FAR_PUSH else 0)
    touched = (1 if closed_wall(b, z, m[S], False) else 0) + (
        2 if closed_wall(b, z, -m[S], True) else 0
    )
    for attempt in range(5):  # where none fits, but for rounding, it rests on all that it touches
        walls = 3 - attempt if attempt < 4 else touched
        if walls & touched != walls or (attempt < 4 and walls & lets_go):
            continue
        m[TIP], m[FAR] = walls & 1, walls >> 1
        if walls == 3:  # wedged
            m[FLOOR], m[PULL] = STICK, 1
            _wedged_series(b, m, z, zeta, gh, gv, t, _LOOK, 0.0, a)
            m[PULL] = 1 if a[P, 0] >= 0.0 else -1
            aimed = True
        else:
            m[FLOOR] = SLIPPING
            aimed = _aim(b, m, z, zeta, yield_displacement, gh, gv, t, ended, rules, a)
        if attempt == 4:
            rules[LEAST_CONTRADICTION] += 1
            if ended != 0:
                m[PULL] = -ended  # in turn, until the slack allows one
        if attempt == 4 or (aimed and _walls_hold(b, m, touched, slack, a)):
            if walls == 3:
                stop(z)
            return


@inner_kernel
def _walls_hold(b, m, touched, slack, a):
    """Whether the mode's walls push, and the block leaves all other walls that it touches."""
    for which in range(2):
        if m[TIP if which == 0 else FAR] != 0:
            if leading(a, NA if which == 0 else NB, _LOOK - 2, slack * NOISE[FORCE], AHEAD) < 0:
                return False
        elif touched >> which & 1:
            fill_guards(b, m, 0.0, a)
            guard(G_TIP_GAP if which == 0 else G_FAR_GAP, _LOOK, a)
            a[GUARD, 0] = a[GUARD, 1] = 0.0  # it is closed: its acceleration decides
            if leading(a, GUARD, _LOOK, slack * NOISE[POSITION], AHEAD) < 0:
                return False
    return True


@inner_kernel
def _aim(b, m, z, zeta, yield_displacement, gh, gv, t, ended, rules, a):
    """Assumes a sign of P and fills the workspace with the series for it; returns whether P has
    that sign.

    The sign that has just `ended` (+-1, else 0) is not tried. Below Painleve's limit P does not
    depend on the sign that is assumed. Beyond it the denominator is negative for a push, and pull
    and push both solve the equations or neither does. Where both do, the motion goes on with the
    pull.
    """
    m[PULL] = 1
    if ended <= 0:
        friction_series(b, m, z, zeta, False, yield_displacement, gh, gv, t, _LOOK, a)
        rules[PULLS] += a[DEN, 0] <= 0.0
        if _has_sign(a, 1, ended) and a[DEN, 0] > 0.0:
            return True
    if ended >= 0:
        m[PULL] = -1
        friction_series(b, m, z, zeta, False, yield_displacement, gh, gv, t, _LOOK, a)
    return ended >= 0 and _has_sign(a, -1, ended)


@inner_kernel
def _has_sign(a, sign, ended):
    """Whether P begins with this sign. Where the other one has just ended, it may do so an instant
    later."""
    if ended != 0 and abs(a[P, 0]) <= abs(a[P, 1]) * INSTANT:
        return True
    return sign * leading(a, P, _LOOK - 2, NOISE[FORCE], AHEAD) >= 0


@inner_kernel
def _initial_friction(b, m, z, gh, gv, t, a):
    """z at the start: sgn V for a pivot that slips, else the value that lets it stand still (at
    most 1 in size)."""
    v = slip_velocity(b, z)
    if abs(v) > SLOW:
        return 1.0 if v > 0.0 else -1.0
    if z[THETA] == 0.0 and z[W] == 0.0:
        return 0.0
    sense = 1 if (z[THETA] if z[THETA] != 0.0 else z[W]) > 0.0 else -1
    m[:] = 0
    m[FAMILY], m[S], m[PULL], m[FLOOR] = TILT, sense, 1, STICK
    m[TIP] = closed_wall(b, z, sense, False)
    tilt_series(b, m, z, gh, gv, t, _LOOK, 0.0, 0.0, a)
    if m[TIP] != 0 and a[NA, 0] < 0.0:
        m[TIP] = 0
        tilt_series(b, m, z, gh, gv, t, _LOOK, 0.0, 0.0, a)
    most = b.mu_k * abs(a[P, 0])
    if a[Q, 0] == 0.0:
        return 0.0
    return -sense * a[Q, 0] / most if abs(a[Q, 0]) < most else -math.copysign(1.0, sense * a[Q, 0])


@inner_kernel
def begin(b, gh, gv, r, yields, a):
    """The contacts of a block that starts, or goes on after an impact, and its z."""
    z, m = r.z, r.m
    upright(b, z)
    t = _waits(z, gv, r)
    zeta = _initial_friction(b, m, z, gh, gv, t, a) if math.isnan(r.now[ZETA]) else r.now[ZETA]
    r.now[ZETA] = _begin(b, gh, gv, r, zeta, yields, a)
    # It has yielded where the pivot slips with z = +-1.
    _holds(
        r,
        m[FLOOR] != SLIPPING
        or abs(r.now[ZETA]) != 1.0
        or r.now[ZETA] * slip_velocity(b, z) <= SLOW,
    )


@inner_kernel
def _holds(r, whether):
    """Notes whether the pivot holds or has yielded."""
    r.counts[HOLDS] = 1 if whether else 0


@inner_kernel
def expand(b, gh, gv, r, reach, control, yields, a):
    """Series of the motion: their order, the place of the pivot, and the step they are good for."""
    z, m, t, zeta = r.z, r.m, r.now[T], r.now[ZETA]
    order = ORDER
    if m[FLOOR] == SLIPPING:
        friction_series(b, m, z, zeta, r.counts[HOLDS] == 0, yields, gh, gv, t, order, a)
    elif m[FAMILY] == FLAT:
        order = flat_series(b, m, z, gh, gv, t, order, a)
    else:
        order = _wedged_series(b, m, z, zeta, gh, gv, t, order, reach, a)
    h = step_size(a, U, G, order - 1, control.last_term, reach)
    if m[FLOOR] == SLIPPING:
        h = step_size(
            a,
            XI,
            XI,
            order - 1,
            control.last_term,
            force_step(a, Z, order - 1, control.tolerance, h),
        )
        if m[FAMILY] == TILT:
            h = step_size(a, PHI, COS, order, control.last_term, h)
    return order, m[S] * z[X] - a[SIN, 0], h


@inner_kernel
def locate(b, m, order, h, slack, a, stack):
    """The first event of the step, as with Coulomb's friction; one more is that z comes to the sign
    of V, from where the pivot loads."""
    fill_guards(b, m, 0.0, a)
    # The friction of a wedged block, which does not slip, is what z makes it: it has no cone to
    # leave.
    if m[FAMILY] == TILT:
        drop(a, G_CONE_PLUS)
        drop(a, G_CONE_MINUS)
    tau, which = first_event(order, h, slack, a, stack)
    if m[FLOOR] == SLIPPING and m[SLIP] * a[Z, 0] <= -NOISE[POSITION]:
        for k in range(order):
            a[GUARD, k] = -m[SLIP] * a[Z, k]
        root = first_root(a, GUARD, order - 1, tau, tau, NOISE[POSITION], AHEAD, stack)
        if root != NO_ROOT:
            return root, G_LOADS
    return tau, which


@inner_kernel
def wind_up(r, order, tau, tolerance, log, a):
    """Moves z to the end of a step of tau. Where it has come to +-1 the pivot has yielded."""
    m = r.m
    if m[FLOOR] != SLIPPING or r.counts[HOLDS] == 0:
        return
    zeta = m[S] * value(a, Z, order - 1, tau)
    towards = m[S] * m[SLIP] * zeta
    if towards > 0.0 and 1.0 - towards < _NEARLY * max(tolerance, NOISE[POSITION]):
        before = mode_code(r)
        zeta = math.copysign(1.0, zeta)
        _holds(r, False)
        note(r, log, SLIPS, before)
    r.now[ZETA] = zeta


@inner_kernel
def follow(b, gh, gv, r, which, before, yields, log, a):
    """What follows an event that is no impact."""
    z, m = r.z, r.m
    t = _waits(z, gv, r)
    kind = -1
    # At one instant each further event doubles the slack, as in a selection (ebm.core.modes).
    slacken(r.memory)
    if which == G_LOADS:
        r.now[ZETA] = 0.0
    elif which == G_SLIP:
        kind = _turn(b, gh, gv, r, t)
    elif m[FAMILY] == FLAT and (which == G_PUSH or _hangs_on(m, gh, gv, t)):
        m[PULL] = -m[PULL]
        r.rules[HANGS] += hangs_flat(m)
    elif m[FAMILY] == TILT:  # the push of the floor or of a wall ends
        kind = -1 if which == G_PUSH else RELEASE
        _close_walls(b, m, z, r.now[ZETA], yields, gh, gv, t, which, r.memory[SLACK], r.rules, a)
    elif which >= G_UPLIFT_PLUS and m[FLOOR] == SLIPPING:
        kind = _tip_sliding(b, gh, gv, r, yields, a)
    else:  # the cone, uplift from rest, or a wall that lets go of a standing block
        r.now[ZETA] = _leave_rest(b, gh, gv, r, tips_first(b, z, gh, t), yields, a)
        _holds(r, abs(r.now[ZETA]) != 1.0)
        kind = (
            RELEASE
            if which == G_TIP_PUSH or which == G_FAR_PUSH
            else (UPLIFT if m[FAMILY] == TILT else SLIPS)
        )
    if kind >= 0:
        note(r, log, kind, before)
    return GOING


@inner_kernel
def _turn(b, gh, gv, r, t):
    """The slip has come to its end: the pivot slips back, or a flat block rests. The event's kind,
    -1 for none."""
    kind = -1 if r.counts[HOLDS] != 0 else STICKS
    _holds(r, True)
    r.m[SLIP] = -r.m[SLIP]
    return STICKS if _comes_to_rest(b, gh, gv, r, t) else kind


@inner_kernel
def _comes_to_rest(b, gh, gv, r, t):
    """Whether a flat block whose slip has ended is held: then it rests."""
    z, m = r.z, r.m
    if m[FAMILY] != FLAT or not _held(b, z, gh, gv, t):
        return False
    z[VX] = 0.0
    _holds(r, True)
    _rest(b, m, z, gv, t)
    return True


@inner_kernel
def _tip_sliding(b, gh, gv, r, yields, a):
    """A block tilts while it slides; the event's kind, -1 where rounding keeps it flat for a
    while."""
    z, m = r.z, r.m
    slip = m[SLIP]
    if abs(z[VX]) < SLOW and _comes_to_rest(
        b, gh, gv, r, r.now[T]
    ):  # it slid by rounding, whose sign would choose the side
        return STICKS
    if r.counts[HOLDS] != 0 and 1.0 - slip * r.now[ZETA] < _YIELDS:
        r.now[ZETA] = float(slip)
        _holds(r, False)
        return SLIPS
    if _tip(b, gh, gv, r, -slip, r.now[ZETA], False, yields, a):
        return UPLIFT
    r.rules[LEAST_CONTRADICTION] += 1
    m[:] = 0
    m[FAMILY], m[S], m[PULL], m[FLOOR], m[SLIP] = FLAT, 1, 1, SLIPPING, slip
    return -1
