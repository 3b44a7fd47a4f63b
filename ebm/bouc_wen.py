"""The model `ebm-bouc-wen`: the bilateral pivot with the paper's regularised friction (9) in place of stick and slip.

The floor's friction force on the pivot is Q = -mu_k |P| z. The hysteretic variable z replaces the sign of the slip
velocity V and follows it over the yield displacement u_y:

    z' = (-gamma |V| z |z|^(n-1) - beta V |z|^n + V) / u_y,    beta = gamma = 1/2, n = 2,

that is z' = V (1 - z^2)/u_y while the pivot *loads* (V z > 0) and z' = V/u_y while it unloads. A pivot that sticks is
thus a stiff undamped spring, and after some u_y of slip z = +-1, which is an invariant state: the pivot has *yielded* and
slips as in (7), (8) until V = 0. So the equation, stiff as it looks (eigenvalue -2 |V|/u_y), is smooth between the instants
at which V or z changes sign, and needs no stiff integrator: Taylor steps stop there, and hold z once it has come within
the tolerance of +-1. Everything else (guards, impacts, natural units, state and mode vectors) is the exact model's.

What (9) leaves open: a block at rest on its base does not move at all, z being -u/(mu_k G0), so that it uplifts or slides
exactly when it should. Impacts are the paper's, with their own stick and slip; they change velocities only, so that z goes
on through them. "slip" and "stick" events, and the modes, tell a yielded pivot (SLIDE-ROCK, LADDER) from one that has not
(ROCK, LEAN).
"""

from __future__ import annotations

import math

import numpy as np

from rockcheck.ebm.ground import acceleration, fill_series, next_kink
from rockcheck.ebm.motion import (
    COS,
    FAMILY,
    FAR,
    FLAT,
    FLOOR,
    GUARD,
    LEAST_FRICTION,
    MODE_SIZE,
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
    VY,
    XI,
    G,
    P,
    Q,
    S,
    U,
    W,
    X,
    flat_series,
    flat_state,
    sine_cosine,
    tilt_series,
    tilt_state,
    workspace,
)
from rockcheck.ebm.series import FORCE_NOISE, INSTANT, NO_ROOT, POSITION_NOISE, first_root, leading, value
from rockcheck.ebm.trajectory import (
    _HANDED_OVER,
    _MOST_ZERO_STEPS,
    _OPEN_CONTACTS,
    _PASSED,
    _REST_BILATERAL,
    DONE,
    FLOOR_IMPACT,
    LEFT,
    NO_MODE,
    NOT_FINITE,
    OVERTURNED,
    RELEASE,
    RIGHT,
    SETTLED,
    SLIPS,
    STICKS,
    TOO_MANY_EVENTS,
    TOO_MANY_STEPS,
    UPLIFT,
    WALL_IMPACT,
    Tally,
    _first_event,
    _impact,
    _note,
    _step_size,
    resting_speed,
)
from rockcheck.ebm.transitions import (
    CREEP,
    G_CONE_MINUS,
    G_CONE_PLUS,
    G_FAR_GAP,
    G_FAR_PUSH,
    G_PUSH,
    G_SLIP,
    G_TIP_GAP,
    G_TIP_PUSH,
    G_TOPPLE,
    G_UPLIFT_PLUS,
    GUARDS,
    SOON,
    closed_wall,
    guard,
    guards_of,
    slip_velocity,
    tips_first,
)
from rockcheck.scenes.compiled import inner_kernel, kernel

# Rows of the workspace after those of ebm.motion: z, V and what the recurrences need.
Z, V, Z2, SPIN2, WEIGHT, ARM, TURN, REACH, INERTIA, LOAD, PUSH, ZA, LEVER, DEN, TORQUE = range(ROWS, ROWS + 15)
_ROWS = ROWS + 15

# A guard besides those of ebm.transitions: z comes to the sign of V, from where the pivot loads.
_G_LOADS = GUARDS
# The friction of a wedged block, which does not slip, is what z makes it: it has no cone to leave.
_CONE = 1 << G_CONE_PLUS | 1 << G_CONE_MINUS
_LOOK = 6
# z nears 1 for ever. So near to it what hangs on the difference (a block that tips just as it slips) is noise: it has yielded.
_YIELDS = 1e-6


@inner_kernel
def _product(a, x, y, k):
    """Coefficient k of the product of two rows."""
    total = 0.0
    for j in range(k + 1):
        total += a[x, j] * a[y, k - j]
    return total


@inner_kernel
def _fill_z(a, k, loads, yielded, yield_displacement):
    """Coefficient k + 1 of z by (9) with beta = gamma = 1/2 and n = 2, given those of V and z up to k."""
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
    """Fills the workspace with the series of a block whose pivot, or base, carries the friction force -mu_k |P| z.

    Tilted, in the pivot's frame (see ebm.motion): with Sw = +-1 where a corner rests on the tip or far wall, else 0,
    C = Sw c', J = 1/3 + C^2, f = u - Sw s' w^2, g = G0 - c w^2 and k = mu_k z sgn P,

        P = (g J - s C f) / (J + s^2 + k s (c + C)),   Q = -k P,   J theta'' = -s P + (c + C) Q - C f,

    which is (7), (8) with z for d where Sw = 0, and LADDER with z for d otherwise. Flat: P = G0, x'' = Q - u.
    """
    sign = float(m[S])
    fill_series(gh, t, sign, order, a, U)
    fill_series(gv, t, 1.0, order, a, G)
    a[G, 0] += 1.0
    a[XI, 0], a[XI, 1] = sign * z[X], sign * z[VX]
    a[Z, 0] = sign * zeta
    loads = m[SLIP] * a[Z, 0] > -1e-13
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
    a[SIN, 0], a[COS, 0] = sine_cosine(b.alpha - a[PHI, 0], a)
    for k in range(order):
        a[PHI, k + 1] = a[OMEGA, k] / (k + 1)
        a[SIN, k + 1] = -_product(a, OMEGA, COS, k) / (k + 1)
        a[COS, k + 1] = _product(a, OMEGA, SIN, k) / (k + 1)
        a[V, k] = (k + 1) * (a[XI, k + 1] - a[SIN, k + 1])
        if k == order - 1:
            break
        a[SPIN2, k] = _product(a, OMEGA, OMEGA, k)
        a[WEIGHT, k] = a[G, k] - _product(a, COS, SPIN2, k)  # g
        a[TURN, k] = wall * (b.sin_2alpha * a[SIN, k] + b.cos_2alpha * a[COS, k])  # C
        a[ARM, k] = a[COS, k] + a[TURN, k]
        a[INERTIA, k] = 1.0 / 3.0 if k == 0 else 0.0
        a[LOAD, k] = 0.0  # f
        normal = a[WEIGHT, k] / 3.0
        if wall != 0.0:
            a[REACH, k] = b.sin_2alpha * a[COS, k] - b.cos_2alpha * a[SIN, k]  # s'
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
        if wall != 0.0:  # the corner slides on the wall: x'' = Sw (c' theta'' - s' w^2), which takes the force N
            held = _product(a, TURN, TORQUE, k) - wall * _product(a, REACH, SPIN2, k)
            a[push, k] = wall * (held - along)
            along = held
        a[XI, k + 2] = along / ((k + 2) * (k + 1))
        _fill_z(a, k, loads, yielded, yield_displacement)


@inner_kernel
def _held(b, z, gh, gv, t):
    """Whether a flat block without speed stays at rest: the base neither lifts nor slides it, or presses it on a wall."""
    slope, g, u = b.sin_alpha / b.cos_alpha, 1.0 + acceleration(gv, t), acceleration(gh, t)
    least = min(slope, b.mu_s)
    if abs(abs(u) - (least if g >= 0.0 else slope) * abs(g)) < FORCE_NOISE:  # at its limit: where it goes decides
        g, u = 1.0 + acceleration(gv, t + SOON), acceleration(gh, t + SOON)
    left, right = closed_wall(b, z, 1, False), closed_wall(b, z, -1, False)
    if g < 0.0:  # hanging: only a wall on which it is pressed holds it flat
        return (left and u >= -slope * g) or (right and u <= slope * g)
    limit = least if b.mu_s == LEAST_FRICTION else least * g
    return (u <= limit or left) and (u >= -limit or right)


@inner_kernel
def _rest(b, m, z, gv, t):
    """The mode of a block at rest on its base."""
    m[:] = 0
    m[FAMILY], m[S], m[PULL], m[FLOOR] = FLAT, 1, 1 if acceleration(gv, t) > -1.0 else -1, STICK
    m[TIP], m[FAR] = closed_wall(b, z, 1, False), closed_wall(b, z, -1, False)


@inner_kernel
def _leave_rest(b, m, z, sense, yield_displacement, gh, gv, t, a):
    """The block at rest starts to slide, or to tilt, as u of sign `sense` grows; returns z = -u/(mu_k G0), +-1 if it slides."""
    u, g = acceleration(gh, t), 1.0 + acceleration(gv, t)
    soon = 1.0 + acceleration(gv, t + SOON) <= 0.0  # friction falls with P: nothing tips until the floor pulls
    hangs = g <= 0.0 if abs(g) > FORCE_NOISE else soon
    tips = b.mu_k * b.cos_alpha > b.sin_alpha or hangs
    if tips:
        zeta = min(max(-u / max(b.mu_k * abs(g), 1e-300), -1.0), 1.0)
        if u != 0.0 and abs(abs(u) - g * min(b.sin_alpha / b.cos_alpha, b.mu_k)) < FORCE_NOISE:
            # Just where it tips or slips: near g = 0 the quotient says no more, and its rounding would be a moment.
            zeta = -math.copysign(min(b.sin_alpha / (b.cos_alpha * b.mu_k), 1.0) if b.mu_k > 0.0 else 1.0, u)
        if _tip(b, m, z, sense, zeta, yield_displacement, gh, gv, t, a):
            return zeta
    if hangs or soon or closed_wall(b, z, sense, False) or (tips and abs(u) < g * max((1.0 + _YIELDS) * b.sin_alpha / b.cos_alpha, b.mu_k)):
        _rest(b, m, z, gv, t)
        return 0.0
    m[:] = 0
    m[FAMILY], m[S], m[PULL], m[FLOOR], m[SLIP] = FLAT, 1, 1, SLIPPING, -sense
    return -float(sense)


@inner_kernel
def _tip(b, m, z, first, zeta, yield_displacement, gh, gv, t, a):
    """Lets a flat block tilt to the side on which its rotation grows, `first` if it can; returns whether there is one."""
    v = slip_velocity(b, z)
    for sense in (first, -first):
        m[:] = 0
        m[FAMILY], m[S], m[SLIP] = TILT, sense, 1 if sense * v > 0.0 else -1
        _close_walls(b, m, z, zeta, yield_displacement, gh, gv, t, a)
        if leading(a, PHI, _LOOK, POSITION_NOISE) > 0:
            return True
    return False


@inner_kernel
def _begin(b, m, z, zeta, yield_displacement, gh, gv, t, a):
    """The contacts of a block that starts, or goes on after an impact, into m; returns z, changed only where it was at rest."""
    v = slip_velocity(b, z)
    if z[THETA] == 0.0 and z[W] == 0.0:
        if v == 0.0:
            if not _held(b, z, gh, gv, t):
                return _leave_rest(b, m, z, tips_first(b, m, z, gh, t), yield_displacement, gh, gv, t, a)
            _rest(b, m, z, gv, t)
            return 0.0
        m[:] = 0
        m[FAMILY], m[S], m[PULL], m[FLOOR], m[SLIP] = FLAT, 1, 1, SLIPPING, 1 if v > 0.0 else -1
        return zeta
    sense = 1 if (z[THETA] if z[THETA] != 0.0 else z[W]) > 0.0 else -1
    m[:] = 0
    m[FAMILY], m[S], m[SLIP] = TILT, sense, 1 if sense * v > 0.0 else -1
    _close_walls(b, m, z, zeta, yield_displacement, gh, gv, t, a)
    return zeta


@inner_kernel
def _wedged_series(b, m, z, zeta, gh, gv, t, order, reach, a):
    """The series of a block that both walls hold (see ebm.motion), and the share of its friction in what they carry."""
    order = tilt_series(b, m, z, gh, gv, t, order, 0.0, reach, a)
    lever = a[COS, 0] / (b.sin_2alpha * a[SIN, 0] + b.cos_2alpha * a[COS, 0])  # of friction over that of the walls' forces
    friction = b.mu_k * m[S] * zeta * math.copysign(1.0, a[P, 0])
    for k in range(order + 1):
        a[Q, k] = -friction * a[P, k]
        a[NA, k] += 0.5 * (lever - 1.0) * a[Q, k]
        a[NB, k] += 0.5 * (lever + 1.0) * a[Q, k]
    return order


@inner_kernel
def _close_walls(b, m, z, zeta, yield_displacement, gh, gv, t, a):
    """Lets the corners of a tilting block rest on the walls that they touch and that would push them; more of them come first."""
    touched = (1 if closed_wall(b, z, m[S], False) else 0) + (2 if closed_wall(b, z, -m[S], True) else 0)
    for attempt in range(5):  # where none fits, but for rounding, it rests on all that it touches
        walls = 3 - attempt if attempt < 4 else touched
        if walls & touched != walls:
            continue
        m[TIP], m[FAR] = walls & 1, walls >> 1
        if walls == 3:  # wedged
            m[FLOOR], m[PULL] = STICK, 1
            _wedged_series(b, m, z, zeta, gh, gv, t, _LOOK, 0.0, a)
            m[PULL] = 1 if a[P, 0] >= 0.0 else -1
            aimed = True
        else:
            m[FLOOR] = SLIPPING
            aimed = _aim(b, m, z, zeta, yield_displacement, gh, gv, t, a)
        if attempt == 4 or (aimed and _walls_hold(b, m, touched, a)):
            if walls == 3:
                z[W] = z[VX] = z[VY] = 0.0
            return


@inner_kernel
def _walls_hold(b, m, touched, a):
    """Whether the walls of the mode push and those that are touched besides are left."""
    for which in range(2):
        if m[TIP if which == 0 else FAR] != 0:
            if leading(a, NA if which == 0 else NB, _LOOK - 2, FORCE_NOISE) < 0:
                return False
        elif touched >> which & 1:
            guard(b, m, G_TIP_GAP if which == 0 else G_FAR_GAP, _LOOK, 0.0, a)
            if leading(a, GUARD, _LOOK, POSITION_NOISE) < 0:
                return False
    return True


@inner_kernel
def _aim(b, m, z, zeta, yield_displacement, gh, gv, t, a):
    """Sets the sign of P, whose series the workspace then holds; returns whether P has it.

    Below Painleve's limit it does not depend on the sign that is assumed for it. Beyond, where a push would pull itself along (its
    denominator is negative), pull and push both solve the equations or neither does: the motion goes on with the pull.
    """
    m[PULL] = 1
    friction_series(b, m, z, zeta, False, yield_displacement, gh, gv, t, _LOOK, a)
    if leading(a, P, _LOOK - 2, FORCE_NOISE) >= 0 and a[DEN, 0] > 0.0:
        return True
    m[PULL] = -1
    friction_series(b, m, z, zeta, False, yield_displacement, gh, gv, t, _LOOK, a)
    return leading(a, P, _LOOK - 2, FORCE_NOISE) <= 0


@inner_kernel
def _initial_friction(b, m, z, gh, gv, t, a):
    """z at the start: sgn V for a pivot that slips, else the value that lets it stand still (at most 1 in size)."""
    v = slip_velocity(b, z)
    if abs(v) > CREEP:
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
def _has_yielded(b, m, z, zeta):
    """Whether the pivot slips with z = +-1."""
    return m[FLOOR] == SLIPPING and abs(zeta) == 1.0 and zeta * slip_velocity(b, z) > CREEP


@inner_kernel
def _label(m, yielded):
    """Index into trajectory.MODE_NAMES: rest, slide, rock, slide-rock, lean, ladder."""
    if m[FAMILY] == FLAT:
        return 0 if m[FLOOR] == STICK else 1
    return (4 if m[TIP] != 0 or m[FAR] != 0 else 2) + (1 if yielded else 0)


@kernel
def run(b, gh, gv, z, yield_displacement, t_end, control, out, out_mode, log):
    """Simulates from state z (changed in place) at t = 0 to t_end; returns a Tally. Arguments as of trajectory.run."""
    a, stack = workspace(_ROWS)
    m, left = np.zeros(MODE_SIZE, dtype=np.int64), np.zeros(MODE_SIZE, dtype=np.int64)
    impulse, gains = np.zeros(2), np.zeros(2)
    rattle = np.array([_REST_BILATERAL, -1.0, -1.0, 0.0, 0.0])
    t = 0.0
    steps = events = wall_impacts = zero_steps = 0
    rows = min(1, out.shape[0])
    peak = abs(z[THETA])
    ending = DONE
    flipped = waits = False
    corner = 0  # the one that it last stood on
    zeta = _begin(b, m, z, _initial_friction(b, m, z, gh, gv, t, a), yield_displacement, gh, gv, t, a)
    yielded = _has_yielded(b, m, z, zeta)
    if rows > 0:
        out[0] = z
        out_mode[0] = _label(m, yielded)
    while t < t_end:
        if steps >= control.most_steps:
            ending = TOO_MANY_STEPS
            break
        steps += 1
        kink = min(next_kink(gh, t), next_kink(gv, t))
        reach = min(kink, t_end) - t
        order = control.order
        moving = m[FLOOR] == SLIPPING
        if moving:
            friction_series(b, m, z, zeta, yielded, yield_displacement, gh, gv, t, order, a)
        elif m[FAMILY] == FLAT:
            order = flat_series(b, m, z, gh, gv, t, order, a)
        else:
            order = _wedged_series(b, m, z, zeta, gh, gv, t, order, reach, a)
        h = _step_size(a, U, G, order - 1, control.tolerance, reach)
        if moving:
            h = _step_size(a, XI, Z, order - 1, control.tolerance, h)
            if m[FAMILY] == TILT:
                h = _step_size(a, PHI, COS, order, control.tolerance, h)
        mask = guards_of(b, m)
        if m[FAMILY] == TILT:
            mask &= ~_CONE
        tau, which = _first_event(b, m, order, 0.0, h, mask, a, stack)
        waits = zero_steps >= _HANDED_OVER and tau <= 0.0 and which > G_FAR_GAP and not waits
        if waits:  # as in trajectory.run
            zero_steps += 1
            h = min(h, INSTANT * 2.0 ** (0.5 * (zero_steps - _HANDED_OVER)))
            tau, which = _first_event(b, m, order, 0.0, h, mask & _OPEN_CONTACTS, a, stack)
        if moving and m[SLIP] * a[Z, 0] <= -1e-13:
            for k in range(order):
                a[GUARD, k] = -m[SLIP] * a[Z, k]
            root = first_root(a, GUARD, order - 1, tau, POSITION_NOISE, stack)
            if root != NO_ROOT:
                tau, which = root, _G_LOADS
        if which == G_SLIP and tau <= 0.0 and flipped and m[FAMILY] == TILT:
            # Whichever sign is assumed, V leaves zero with the other: it is rounding, so any will do for a little while.
            tau, which, zero_steps = min(h, 1e-2 * math.sqrt(yield_displacement)), -1, 0
        flipped = which == G_SLIP and tau <= 0.0
        if not math.isfinite(tau) or zero_steps > _MOST_ZERO_STEPS:
            ending = NO_MODE if math.isfinite(tau) else NOT_FINITE
            break
        whole = which < 0 and tau >= reach
        end = min(kink, t_end) if whole else t + tau
        while rows < out.shape[0] and rows * control.output_step < end:
            out[rows] = z
            _state(b, m, order, rows * control.output_step - t, a, out[rows])
            out_mode[rows] = _label(m, yielded)
            rows += 1
        _state(b, m, order, tau, a, z)
        t = end
        peak = max(peak, abs(z[THETA]))
        if m[FAMILY] == TILT:
            corner = m[S]
        before = _label(m, yielded)
        kind = -1
        if moving and not yielded:
            zeta = m[S] * value(a, Z, order - 1, tau)
            towards = m[S] * m[SLIP] * zeta
            if towards > 0.0 and 1.0 - towards < max(10.0 * control.tolerance, 1e-12):
                zeta, yielded = math.copysign(1.0, zeta), True
                kind = SLIPS
        if which >= 0:
            zero_steps = zero_steps + 1 if tau <= 0.0 else 0
        elif not waits and tau > _PASSED:
            zero_steps = 0
        # --- what follows it
        impulse[:] = 0.0
        if which == G_TOPPLE:
            ending = OVERTURNED
            kind = LEFT if m[S] > 0 else RIGHT
            z[THETA] = math.copysign(0.5 * math.pi, z[THETA])
            peak = 0.5 * math.pi
        elif which == _G_LOADS:
            zeta = 0.0
        elif which == G_PUSH:
            if m[FAMILY] == TILT:
                _close_walls(b, m, z, zeta, yield_displacement, gh, gv, t, a)
            else:
                m[PULL] = -m[PULL]
        elif which == G_SLIP:
            if yielded:
                kind = STICKS
            yielded = False
            m[SLIP] = -m[SLIP]
            if m[FAMILY] == FLAT and _held(b, z, gh, gv, t):
                z[VX] = 0.0
                kind = STICKS
                _rest(b, m, z, gv, t)
        elif which == G_TIP_PUSH or which == G_FAR_PUSH:
            kind = RELEASE
            if m[FAMILY] == FLAT:
                m[S] = corner
                zeta = _leave_rest(b, m, z, tips_first(b, m, z, gh, t), yield_displacement, gh, gv, t, a)
                yielded = abs(zeta) == 1.0
            else:
                _close_walls(b, m, z, zeta, yield_displacement, gh, gv, t, a)
        elif which >= G_UPLIFT_PLUS and moving:  # tilts while it slides
            left[:] = m
            if not yielded and 1.0 - m[SLIP] * zeta < _YIELDS:
                zeta, yielded, kind = float(m[SLIP]), True, SLIPS
            elif _tip(b, m, z, -m[SLIP], zeta, yield_displacement, gh, gv, t, a):
                kind = UPLIFT
            else:
                m[:] = left
                zero_steps = max(zero_steps, _HANDED_OVER)
        elif which > G_FAR_PUSH:  # the cone, or uplift from rest
            m[S] = corner
            zeta = _leave_rest(b, m, z, tips_first(b, m, z, gh, t), yield_displacement, gh, gv, t, a)
            yielded = abs(zeta) == 1.0
            kind = UPLIFT if m[FAMILY] == TILT else SLIPS
        elif which >= 0:
            kind, _, _ = _impact(b, m, z, which, gh, t, resting_speed(rattle, t, _REST_BILATERAL, zero_steps), impulse, gains)
            wall_impacts += kind == WALL_IMPACT
            zeta = _begin(b, m, z, zeta, yield_displacement, gh, gv, t, a)
            yielded = _has_yielded(b, m, z, zeta)
        if kind >= 0:
            events += 1
            if events >= control.most_events:
                ending = TOO_MANY_EVENTS
                break
            if log.shape[0] >= events:
                _note(log, events, t, kind, before, _label(m, yielded), impulse[0] + impulse[1])
            if (kind == FLOOR_IMPACT or kind == WALL_IMPACT) and _label(m, yielded) == 0 and log.shape[0] > events:
                events += 1
                _note(log, events, t, SETTLED, before, 0, 0.0)
        if ending == OVERTURNED:
            break
    at_rest = m[FAMILY] == FLAT and m[FLOOR] == STICK
    if ending == DONE and not math.isfinite(z[THETA]):
        ending = NOT_FINITE
    while ending == DONE and rows < out.shape[0]:
        out[rows] = z
        out_mode[rows] = _label(m, yielded)
        rows += 1
    return Tally(ending, t, peak, at_rest, steps, events, wall_impacts, int(gains[0]), gains[1], rows, np.nan)


@inner_kernel
def _state(b, m, order, tau, a, z):
    """The state at tau after the start of the step."""
    if m[FAMILY] == FLAT:
        flat_state(b, m, order, tau, a, z)
    else:
        tilt_state(b, m, order, tau, m[S] * z[X] - a[SIN, 0], a, z)
