"""The model `ebm-bouc-wen`: the bilateral pivot with the paper's regularised friction (9).

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

import math

from rockcheck.ebm.core import contacts, coulomb, ground, guards, modes, series
from rockcheck.ebm.core.block import LEAST_FRICTION, side_of, wall_turn
from rockcheck.ebm.core.motion import flat_series, tilt_series, turned
from rockcheck.ebm.core.names import Event, Family, Guard, Kind, Pivot, Row, Rule
from rockcheck.ebm.core.state import code_of, mode_code, note, on_wall, place
from rockcheck.scenes.compiled import called_kernel, inner_kernel

#: Rest is stepped through.
LOOKS_AHEAD = False
_LOOK = 6
# z tends to 1 and never reaches it. Within this distance z counts as yielded: the difference is
# noise (a block may tip just as it slips).
_YIELDS = 1e-6
# z also counts as yielded where 1 - abs(z) < this multiple of max(tolerance, rounding).
_NEARLY = 10.0


@inner_kernel
def _fill_z(block, a, k, loads, yielded):
    """Coefficient k + 1 of z by (9) with beta = gamma = 1/2 and n = 2.

    Those of V and z up to k are given.
    """
    if yielded:
        a[Row.Z, k + 1] = 0.0
        return
    rate = a[Row.V, k]
    if loads:
        a[Row.Z2, k] = series.product(a, Row.Z, Row.Z, k)
        rate -= series.product(a, Row.V, Row.Z2, k)
    a[Row.Z, k + 1] = rate / (block.yields * (k + 1))


@inner_kernel
def _less_later(known, a, x, y, k):
    """A value minus the sum of x_j y_(k-j) over j = 1..k: y_k is this, divided by x_0."""
    for j in range(1, k + 1):
        known -= a[x, j] * a[y, k - j]
    return known


@inner_kernel
def _loads(mode, a):
    """Whether the pivot loads: V z > 0."""
    return mode.slip * a[Row.Z, 0] > -series.NOISE[Kind.POSITION]


@inner_kernel
def _flat_friction_series(block, mode, a, friction, yielded, order):
    loads = _loads(mode, a)
    for k in range(order - 1):
        a[Row.P, k] = a[Row.G, k]
        a[Row.Q, k] = -friction * series.product(a, Row.Z, Row.P, k)
        a[Row.XI, k + 2] = (a[Row.Q, k] - a[Row.U, k]) / ((k + 2) * (k + 1))
        a[Row.V, k] = (k + 1) * a[Row.XI, k + 1]
        _fill_z(block, a, k, loads, yielded)


@inner_kernel
def friction_series(block, base, run, zeta, yielded, order):
    """Fills the workspace with the series of a block whose pivot carries the force -mu_k |P| z.

    Of a flat block its base carries it. Tilted, in the pivot's frame (see ebm.core.motion): with Sw
    = +-1 where a corner rests on the tip or far wall, else 0, C = Sw c', J = I + C^2, f = u - Sw s'
    w^2, g = G0 - c w^2 and k = mu_k z sgn P,

        P = (g J - s C f) / (J + s^2 + k s (c + C)),   Q = -k P,
        J theta'' = -s P + (c + C) Q - C f,

    which is (7), (8) with z for d where Sw = 0, and LADDER with z for d otherwise. Flat: P = G0,
    x'' = Q - u.
    """
    state, a = run.state, run.a
    ground.fill_series(base.horizontal, state.t, float(state.mode.sense), order, a, Row.U)
    ground.fill_series(base.vertical, state.t, 1.0, order, a, Row.G)
    a[Row.G, 0] += 1.0
    _fill_friction_series(block, state, a, zeta, yielded, order)


@called_kernel
def _fill_friction_series(block, state, a, zeta, yielded, order):
    mode, motion = state.mode, state.motion
    sign = float(mode.sense)
    a[Row.XI, 0], a[Row.XI, 1] = sign * motion.x, sign * motion.vx
    a[Row.Z, 0] = sign * zeta
    loads = _loads(mode, a)
    friction = block.mu_k * mode.pull
    for k in range(order + 1):
        a[Row.P, k] = a[Row.Q, k] = a[Row.NA, k] = a[Row.NB, k] = 0.0
    if mode.family == Family.FLAT:
        _flat_friction_series(block, mode, a, friction, yielded, order)
        return
    wall = float(mode.tip - mode.far)
    push = Row.NA if mode.tip != 0 else Row.NB
    wall_sin, wall_cos = wall_turn(turned(block, state, a), mode.tip != 0)
    for k in range(order):
        a[Row.PHI, k + 1] = a[Row.OMEGA, k] / (k + 1)
        a[Row.SIN, k + 1] = -series.product(a, Row.OMEGA, Row.COS, k) / (k + 1)
        a[Row.COS, k + 1] = series.product(a, Row.OMEGA, Row.SIN, k) / (k + 1)
        a[Row.V, k] = (k + 1) * (a[Row.XI, k + 1] - a[Row.SIN, k + 1])
        if k == order - 1:
            break
        a[Row.SPIN2, k] = series.product(a, Row.OMEGA, Row.OMEGA, k)
        a[Row.WEIGHT, k] = a[Row.G, k] - series.product(a, Row.COS, Row.SPIN2, k)  # g
        a[Row.TURN, k] = wall * (wall_sin * a[Row.SIN, k] + wall_cos * a[Row.COS, k])  # C
        a[Row.ARM, k] = a[Row.COS, k] + a[Row.TURN, k]
        a[Row.INERTIA, k] = 1.0 / block.spin if k == 0 else 0.0
        a[Row.LOAD, k] = 0.0  # f
        normal = a[Row.WEIGHT, k] / block.spin
        if wall != 0.0:
            a[Row.REACH, k] = wall_sin * a[Row.COS, k] - wall_cos * a[Row.SIN, k]  # s'
            a[Row.INERTIA, k] += series.product(a, Row.TURN, Row.TURN, k)
            a[Row.LOAD, k] = a[Row.U, k] - wall * series.product(a, Row.REACH, Row.SPIN2, k)
            a[Row.PUSH, k] = series.product(a, Row.TURN, Row.LOAD, k)  # C f
            normal = series.product(a, Row.WEIGHT, Row.INERTIA, k) - series.product(
                a, Row.SIN, Row.PUSH, k
            )
        a[Row.ZA, k] = series.product(a, Row.Z, Row.ARM, k)
        a[Row.LEVER, k] = a[Row.SIN, k] + friction * a[Row.ZA, k]  # s + k (c + C)
        a[Row.DEN, k] = a[Row.INERTIA, k] + series.product(a, Row.SIN, Row.LEVER, k)
        a[Row.P, k] = _less_later(normal, a, Row.DEN, Row.P, k) / a[Row.DEN, 0]
        a[Row.Q, k] = -friction * series.product(a, Row.Z, Row.P, k)
        moment = -series.product(a, Row.LEVER, Row.P, k)
        if wall != 0.0:
            moment = _less_later(moment - a[Row.PUSH, k], a, Row.INERTIA, Row.TORQUE, k)
        a[Row.TORQUE, k] = moment / a[Row.INERTIA, 0]  # theta''
        a[Row.OMEGA, k + 1] = a[Row.TORQUE, k] / (k + 1)
        along = a[Row.Q, k] - a[Row.U, k]
        # The corner slides on the wall: x'' = Sw (c' theta'' - s' w^2), which takes the force N.
        if wall != 0.0:
            held = series.product(a, Row.TURN, Row.TORQUE, k) - wall * series.product(
                a, Row.REACH, Row.SPIN2, k
            )
            a[push, k] = wall * (held - along)
            along = held
        a[Row.XI, k + 2] = along / ((k + 2) * (k + 1))
        _fill_z(block, a, k, loads, yielded)


@called_kernel
def _held(block, base, state):
    """Whether a flat block without speed stays at rest.

    The base then neither lifts nor slides it, or presses it on a wall. One that stays at its limit,
    but for rounding, is at rest; its guards say when it leaves.
    """
    motion, t = state.motion, state.t
    g, u = 1.0 + ground.acceleration(base.vertical, t), ground.acceleration(base.horizontal, t)
    to_left, to_right = block.left.arm / block.height, block.right.arm / block.height
    slope = to_left if (u > 0.0) == (g >= 0.0) else to_right
    # At its limit where it goes decides.
    limit = (min(slope, block.mu_s) if g >= 0.0 else slope) * abs(g)
    if abs(abs(u) - limit) < series.NOISE[Kind.FORCE]:
        g = 1.0 + ground.acceleration_after(base.vertical, t)
        u = ground.acceleration_after(base.horizontal, t)
    left = contacts.closed_wall(block, motion, 1, False)
    right = contacts.closed_wall(block, motion, -1, False)
    # Hanging: by both corners, as long as nothing at all tells to which side it tips.
    if g < 0.0 and not left and not right:
        return u == 0.0
    if g < 0.0:  # a wall on which it is pressed holds it flat
        return (left and u >= -to_right * g - series.NOISE[Kind.FORCE]) or (
            right and u <= to_left * g + series.NOISE[Kind.FORCE]
        )
    share = 1.0 if block.mu_s == LEAST_FRICTION else g
    low, high = (
        -min(to_right, block.mu_s) * share - series.NOISE[Kind.FORCE],
        min(to_left, block.mu_s) * share + series.NOISE[Kind.FORCE],
    )
    return (u <= high or left) and (u >= low or right)


@inner_kernel
def _hangs_on(base, state):
    """Whether the floor begins to fall away faster than g under a block at rest, u being zero.

    Nothing then tells to which side the block would tip.
    """
    mode, t = state.mode, state.t
    stands = mode.pivot == Pivot.STICK and mode.pull > 0 and not on_wall(mode)
    still = (
        ground.acceleration(base.horizontal, t) == 0.0
        and ground.acceleration_after(base.horizontal, t) == 0.0
    )
    return stands and still and ground.acceleration_after(base.vertical, t) < -1.0


@called_kernel
def _rest(block, base, state):
    """The mode of a block at rest on its base."""
    mode, motion = state.mode, state.motion
    place(mode, Family.FLAT, 1, Pivot.STICK, 0)
    mode.pull = 1 if ground.acceleration(base.vertical, state.t) > -1.0 else -1
    mode.tip = contacts.closed_wall(block, motion, 1, False)
    mode.far = contacts.closed_wall(block, motion, -1, False)


@inner_kernel
def _waits(base, state):
    """Waits until a block at rest may move.

    Friction fails as the push of the floor ends: what moves in between is rounding.
    """
    motion = state.motion
    if motion.theta == 0.0 and motion.w == 0.0 and motion.vx == 0.0:
        state.t = ground.weightless_at(base.vertical, state.t)


@called_kernel
def _leave_rest(block, base, run):
    """The block at rest starts to slide or to tilt, to the side to which it tips first as u grows.

    Returns z = -u/(mu_k G0), +-1 if it slides.
    """
    state, t = run.state, run.state.t
    sense = modes.tips_first(block, base, state)
    u, g = ground.acceleration(base.horizontal, t), 1.0 + ground.acceleration(base.vertical, t)
    # Friction falls with P: nothing tips until the floor pulls, which it never does
    # at a block that stays weightless.
    soon = 1.0 + ground.acceleration_after(base.vertical, t) < 0.0
    hangs = g <= 0.0 if abs(g) > series.NOISE[Kind.FORCE] else soon
    arm = side_of(block, sense).arm
    held = hangs or soon or contacts.closed_wall(block, state.motion, sense, False)
    tips = block.mu_k * block.height > (1.0 + _YIELDS) * arm
    if hangs or tips:
        zeta = min(max(-u / max(block.mu_k * abs(g), contacts.SLOW), -1.0), 1.0)
        uplift = g * min(arm / block.height, block.mu_k)
        if u != 0.0 and abs(abs(u) - uplift) < series.NOISE[Kind.FORCE]:
            # Just where it tips or slips. Near g = 0 the quotient is no better known, and its
            # rounding would act as a moment.
            limit = min(arm / (block.height * block.mu_k), 1.0) if block.mu_k > 0.0 else 1.0
            zeta = -math.copysign(limit, u if abs(u) > series.NOISE[Kind.FORCE] else float(sense))
        if _tip(block, base, run, sense, zeta, not held):
            return zeta
    if held or (tips and abs(u) < g * block.mu_k):
        state.rules[Rule.MODE_AGAIN] += 1
        _rest(block, base, state)
        return 0.0
    place(state.mode, Family.FLAT, 1, Pivot.SLIPPING, -sense)
    return -float(sense)


@called_kernel
def _tip(block, base, run, first, zeta, free):
    """Lets a flat block tilt to the side on which its rotation grows, `first` if it can.

    Returns whether there is such a side. With `free`, nothing holds the block, and it tilts though
    its rotation grows so slowly that rounding hides it: friction has yet to wind up. A tilt that
    has ended at this instant does not begin again.
    """
    state = run.state
    v = contacts.slip_velocity(block, state.motion)
    for sense in (first, -first):
        _tilts(block, base, run, sense, v, zeta)
        grows = series.leading(run.a, Row.PHI, _LOOK, series.NOISE[Kind.POSITION], series.AHEAD)
        if state.tried[code_of(state.mode)] == 0 and (grows > 0 or (grows == 0 and free)):
            return True
    return False


@inner_kernel
def _tilts(block, base, run, sense, v, zeta):
    """The mode of a block that tilts to this side while its pivot slips with v."""
    place(run.state.mode, Family.TILT, sense, Pivot.OFF, 1 if sense * v > 0.0 else -1)
    run.state.mode.pull = 0
    _close_walls(block, base, run, zeta, Guard.NONE)


@called_kernel
def _starts(block, base, run, zeta):
    """The contacts of a block that starts, or goes on after an impact.

    Returns z, changed only where the block was at rest.
    """
    state, motion = run.state, run.state.motion
    v = contacts.slip_velocity(block, motion)
    if motion.theta == 0.0 and motion.w == 0.0:
        if v == 0.0:
            if not _held(block, base, state):
                return _leave_rest(block, base, run)
            _rest(block, base, state)
            return 0.0
        place(state.mode, Family.FLAT, 1, Pivot.SLIPPING, 1 if v > 0.0 else -1)
        return zeta
    sense = 1 if (motion.theta if motion.theta != 0.0 else motion.w) > 0.0 else -1
    _tilts(block, base, run, sense, v, zeta)
    return zeta


@called_kernel
def _wedged_series(block, base, run, zeta, order, reach):
    """The series of a block that both walls hold (see ebm.core.motion); returns their order.

    They include the share of its friction in the forces of the walls.
    """
    mode, a = run.state.mode, run.a
    order = tilt_series(block, base, run, order, 0.0, reach)
    side = side_of(block, mode.sense)
    tip, far = (
        side.tip_sin * a[Row.SIN, 0] + side.tip_cos * a[Row.COS, 0],
        side.far_sin * a[Row.SIN, 0] + side.far_cos * a[Row.COS, 0],
    )
    mean = 0.5 * (tip + far)  # of the levers of the walls' forces
    friction = block.mu_k * mode.sense * zeta * math.copysign(1.0, a[Row.P, 0])
    for k in range(order + 1):
        a[Row.Q, k] = -friction * a[Row.P, k]
        a[Row.NA, k] += 0.5 * (a[Row.COS, 0] / mean - far / mean) * a[Row.Q, k]
        a[Row.NB, k] += 0.5 * (a[Row.COS, 0] / mean + tip / mean) * a[Row.Q, k]
    return order


@called_kernel
def _close_walls(block, base, run, zeta, which):
    """Lets the corners of a tilting block rest on the touched walls that would push them.

    Sets with more walls are tried first.

    A push that `which` has just ended (or Guard.NONE) does not go on where anything else fits,
    however near to zero it still is. The slack multiplies what counts as noise: at one instant it
    doubles with each further event.
    """
    state, mode, motion = run.state, run.state.mode, run.state.motion
    ended = mode.pull if which == Guard.FLOOR_PUSH else 0
    lets_go = 1 if which == Guard.TIP_PUSH else (2 if which == Guard.FAR_PUSH else 0)
    touched, fits = modes.touched_walls(block, motion, mode.sense, False), False
    for walls in range(3, -1, -1):
        if walls & touched == walls and not walls & lets_go:
            fits = _fits_walls(block, base, run, zeta, (walls, touched), ended)
        if fits:
            break
    if not fits:  # but for rounding it rests on all that it touches
        _try_walls(block, base, run, zeta, touched, ended)
        state.rules[Rule.LEAST_CONTRADICTION] += 1
        if ended != 0:
            mode.pull = -ended  # in turn, until the slack allows one
    if mode.tip != 0 and mode.far != 0:
        contacts.stop(motion)


@inner_kernel
def _try_walls(block, base, run, zeta, walls, ended):
    """Writes the mode with these walls; False where no sign of P fits."""
    mode, a = run.state.mode, run.a
    mode.tip, mode.far = walls & 1, walls >> 1
    if walls != 3:
        mode.pivot = Pivot.SLIPPING
        return _aim(block, base, run, zeta, ended)
    mode.pivot, mode.pull = Pivot.STICK, 1
    _wedged_series(block, base, run, zeta, _LOOK, 0.0)
    mode.pull = 1 if a[Row.P, 0] >= 0.0 else -1
    return True


@inner_kernel
def _fits_walls(block, base, run, zeta, walls, ended):
    """Whether the mode with these walls, of those that are touched, fits.

    It is left in the state.
    """
    leans, touched = walls
    if not _try_walls(block, base, run, zeta, leans, ended):
        return False
    return _wall_holds(block, run, True, touched) and _wall_holds(block, run, False, touched)


@called_kernel
def _wall_holds(block, run, tip, touched):
    """Whether a wall of the mode pushes, or the block leaves it where it only touches it."""
    mode, slack, a = run.state.mode, run.state.slack, run.a
    if (mode.tip if tip else mode.far) != 0:
        push = Row.NA if tip else Row.NB
        return (
            series.leading(a, push, _LOOK - 2, slack * series.NOISE[Kind.FORCE], series.AHEAD) >= 0
        )
    if touched & (1 if tip else 2) == 0:
        return True
    guards.fill_guards(block, run.state, run.a)
    guards.guard(Guard.TIP_GAP if tip else Guard.FAR_GAP, _LOOK, a)
    a[Row.GUARD, 0] = a[Row.GUARD, 1] = 0.0  # it is closed: its acceleration decides
    return (
        series.leading(a, Row.GUARD, _LOOK, slack * series.NOISE[Kind.POSITION], series.AHEAD) >= 0
    )


@inner_kernel
def _aim(block, base, run, zeta, ended):
    """Assumes a sign of P, fills the workspace with its series, and returns whether P has it.

    The sign that has just `ended` (+-1, else 0) is not tried. Below Painleve's limit P does not
    depend on the sign that is assumed. Beyond it the denominator is negative for a push, and pull
    and push both solve the equations or neither does. Where both do, the motion goes on with the
    pull.
    """
    mode, a = run.state.mode, run.a
    mode.pull = 1
    if ended <= 0:
        friction_series(block, base, run, zeta, False, _LOOK)
        run.state.rules[Rule.PULLS] += a[Row.DEN, 0] <= 0.0
        if _has_sign(a, 1, ended) and a[Row.DEN, 0] > 0.0:
            return True
    if ended >= 0:
        mode.pull = -1
        friction_series(block, base, run, zeta, False, _LOOK)
    return ended >= 0 and _has_sign(a, -1, ended)


@inner_kernel
def _has_sign(a, sign, ended):
    """Whether P begins with this sign.

    Where the other one has just ended, it may do so an instant later.
    """
    if ended != 0 and abs(a[Row.P, 0]) <= abs(a[Row.P, 1]) * series.INSTANT:
        return True
    return sign * series.leading(a, Row.P, _LOOK - 2, series.NOISE[Kind.FORCE], series.AHEAD) >= 0


@called_kernel
def _initial_friction(block, base, run):
    """Z at the start: sgn V for a pivot that slips, else the value that holds it (|z| <= 1)."""
    mode, motion, a = run.state.mode, run.state.motion, run.a
    v = contacts.slip_velocity(block, motion)
    if abs(v) > contacts.SLOW:
        return 1.0 if v > 0.0 else -1.0
    if motion.theta == 0.0 and motion.w == 0.0:
        return 0.0
    sense = 1 if (motion.theta if motion.theta != 0.0 else motion.w) > 0.0 else -1
    place(mode, Family.TILT, sense, Pivot.STICK, 0)
    mode.tip = contacts.closed_wall(block, motion, sense, False)
    tilt_series(block, base, run, _LOOK, 0.0, 0.0)
    if mode.tip != 0 and a[Row.NA, 0] < 0.0:
        mode.tip = 0
        tilt_series(block, base, run, _LOOK, 0.0, 0.0)
    most = block.mu_k * abs(a[Row.P, 0])
    if a[Row.Q, 0] == 0.0:
        return 0.0
    return (
        -sense * a[Row.Q, 0] / most
        if abs(a[Row.Q, 0]) < most
        else -math.copysign(1.0, sense * a[Row.Q, 0])
    )


@inner_kernel
def expand(block, base, run, reach):
    """Series of the motion: their order, the place of the pivot, and the step they are good for."""
    state, mode, a, last = run.state, run.state.mode, run.a, run.state.last_term_rad
    order = series.ORDER
    if mode.pivot == Pivot.SLIPPING:
        friction_series(block, base, run, state.zeta, not state.holds, order)
    elif mode.family == Family.FLAT:
        order = flat_series(block, base, run, order)
    else:
        order = _wedged_series(block, base, run, state.zeta, order, reach)
    h = series.step_size(a, Row.U, Row.G, order - 1, last, reach)
    if mode.pivot == Pivot.SLIPPING:
        h = series.force_step(a, Row.Z, order - 1, state.tolerance_rad, h)
        h = series.step_size(a, Row.XI, Row.XI, order - 1, last, h)
        if mode.family == Family.TILT:
            h = series.step_size(a, Row.PHI, Row.COS, order, last, h)
    state.order, state.place, state.length = order, mode.sense * state.motion.x - a[Row.SIN, 0], h


@inner_kernel
def locate(block, run):
    """The first event of the step, as with Coulomb's friction, or z reaching zero.

    Where the pivot unloads, z comes to the sign of V there: from then on the pivot loads.
    """
    state, mode, a = run.state, run.state.mode, run.a
    guards.fill_guards(block, run.state, run.a)
    # The friction of a wedged block, which does not slip, is what z makes it: it has no cone to
    # leave.
    if mode.family == Family.TILT:
        guards.drop(a, Guard.CONE_PLUS)
        guards.drop(a, Guard.CONE_MINUS)
    guards.first_event(run)
    if mode.pivot == Pivot.SLIPPING and mode.slip * a[Row.Z, 0] <= -series.NOISE[Kind.POSITION]:
        tau, degree = state.tau, state.order - 1
        for k in range(degree + 1):
            a[Row.GUARD, k] = -mode.slip * a[Row.Z, k]
        noise = series.NOISE[Kind.POSITION]
        root = series.first_root(a, Row.GUARD, degree, tau, tau, noise, series.AHEAD, run.stack)
        if root != series.NO_ROOT:
            state.tau, state.guard = root, Guard.LOADS


@inner_kernel
def advance(run):
    """Moves z to the end of a step. Where it has come to +-1 the pivot has yielded."""
    state, mode = run.state, run.state.mode
    if mode.pivot != Pivot.SLIPPING or not state.holds:
        return
    zeta = mode.sense * series.value(run.a, Row.Z, state.order - 1, state.tau)
    towards = mode.sense * mode.slip * zeta
    near = _NEARLY * max(state.tolerance_rad, series.NOISE[Kind.POSITION])
    if towards > 0.0 and 1.0 - towards < near:
        before = mode_code(state)
        zeta = math.copysign(1.0, zeta)
        state.holds = False
        note(run, Event.SLIPS, before)
    state.zeta = zeta


@called_kernel
def after_event(block, base, run):
    """The contacts that follow an event, or the start; notes the event."""
    state = run.state
    if state.guard > Guard.FAR_GAP:
        event = _follow(block, base, run)
        if event != Event.UNTOLD:
            note(run, event, state.before)
        return
    if state.guard != Guard.NONE and state.floor_impulse + state.wall_impulse == 0.0:
        modes.slacken(state)
    contacts.upright(block, state.motion)
    _waits(base, state)
    starts = math.isnan(state.zeta)
    zeta = _initial_friction(block, base, run) if starts else state.zeta
    zeta = state.zeta = _starts(block, base, run, zeta)
    # It has yielded where the pivot slips with z = +-1.
    slips = state.mode.pivot == Pivot.SLIPPING and abs(zeta) == 1.0
    state.holds = not (slips and zeta * contacts.slip_velocity(block, state.motion) > contacts.SLOW)
    coulomb.tell(run, state.event)


@called_kernel
def _follow(block, base, run):
    """Changes the contacts after an event that is no impact; returns the Event, or UNTOLD."""
    state, mode, which = run.state, run.state.mode, run.state.guard
    _waits(base, state)
    # At one instant each further event doubles the slack, as in a selection (ebm.core.modes).
    modes.slacken(state)
    if which == Guard.LOADS:
        state.zeta = 0.0
        return Event.UNTOLD
    if which == Guard.SLIP:
        return _turn(block, base, state)
    if mode.family == Family.FLAT and (which == Guard.FLOOR_PUSH or _hangs_on(base, state)):
        mode.pull = -mode.pull
        state.rules[Rule.HANGS] += modes.hangs_flat(mode)
        return Event.UNTOLD
    if mode.family == Family.TILT:  # the push of the floor or of a wall ends
        _close_walls(block, base, run, state.zeta, which)
        return Event.UNTOLD if which == Guard.FLOOR_PUSH else Event.RELEASE
    if which >= Guard.UPLIFT_PLUS and mode.pivot == Pivot.SLIPPING:
        return _tip_sliding(block, base, run)
    # The cone, uplift from rest, or a wall that lets go of a standing block.
    state.zeta = _leave_rest(block, base, run)
    state.holds = abs(state.zeta) != 1.0
    if which == Guard.TIP_PUSH or which == Guard.FAR_PUSH:
        return Event.RELEASE
    return Event.UPLIFT if mode.family == Family.TILT else Event.SLIPS


@inner_kernel
def _turn(block, base, state):
    """The slip has come to its end: the pivot slips back, or a flat block rests.

    Returns the Event.
    """
    event = Event.UNTOLD if state.holds else Event.STICKS
    state.holds = True
    state.mode.slip = -state.mode.slip
    return Event.STICKS if _comes_to_rest(block, base, state) else event


@inner_kernel
def _comes_to_rest(block, base, state):
    """Whether a flat block whose slip has ended is held: then it rests."""
    if state.mode.family != Family.FLAT or not _held(block, base, state):
        return False
    state.motion.vx = 0.0
    state.holds = True
    _rest(block, base, state)
    return True


@inner_kernel
def _tip_sliding(block, base, run):
    """A block tilts while it slides; returns the event.

    It is Event.UNTOLD where rounding keeps the block flat for a while.
    """
    state, slip = run.state, run.state.mode.slip
    # It slid by rounding, whose sign would choose the side.
    if abs(state.motion.vx) < contacts.SLOW and _comes_to_rest(block, base, state):
        return Event.STICKS
    if state.holds and 1.0 - slip * state.zeta < _YIELDS:
        state.zeta = float(slip)
        state.holds = False
        return Event.SLIPS
    if _tip(block, base, run, -slip, state.zeta, False):
        return Event.UPLIFT
    state.rules[Rule.LEAST_CONTRADICTION] += 1
    place(state.mode, Family.FLAT, 1, Pivot.SLIPPING, slip)
    return Event.UNTOLD
