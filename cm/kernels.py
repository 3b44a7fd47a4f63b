"""The contacts and the compiled time loop of the Continuous Model. Imported only by a run: numba.

Three surfaces (left wall, right wall, floor) face two corners of the block each. A contact is known
by the unit normal n of its surface (into the free space) and by the offset r of its corner from the
mass's centre c: its gap is n.(c + r) + distance, its lever the third entry of J = (n_x, n_y, r x
n), its rate J.(vx, vy, w), its mobility K = J M^-1 J^T. All per unit mass: stiffness in 1/s^2,
damping in 1/s, force in m/s^2. A contact's effective mass is the share of the block's mass that its
corner feels, 1/m_eff = K, without unit.

**The integrator.** Position Verlet (half a step of motion, a kick at the middle, half a step of
motion) with implicit dampers and friction, in steps that know events: long ones (3/sqrt(k/m)) while
contacts are open or settled, cut so as to end where a contact closes, and fine ones (1/50 of the
contact time, or the time in which the damper stops the corner) while one is young. Springs are
explicit (they conserve energy) while a contact is young, implicit once it has settled. Why: impacts
and the stability of the stiff contacts ask for short steps, the motion between them does not, and
friction that lags behind the normal force makes the pivot slip in every impact, however stiff the
contact (Housner's ratio 0.9082 becomes 0.9029 at mu = 0.3).

Error of theta (RMS in 8 s, in alpha) against the event-based unilateral model for El Centro x 1.6,
mu 0.3, and CPU seconds for these 8 s on one core of a shared machine; the fixed-step schemes with
explicit dampers (xi = 7, friction damper 30 sqrt(k/m)):

| scheme | step sqrt(k/m) | k/m = 9.81e6 | k/m = 9.81e8 |
|---|---|---|---|
| semi-implicit Euler | 0.008 | 2.4e-4, 0.08 s | 8.4e-6, 0.81 s |
| semi-implicit Euler | 0.002 | 1.9e-4, 0.33 s | 2.3e-6, 3.2 s |
| velocity Verlet | 0.008 | 2.3e-4, 0.09 s | 8.1e-6, 0.84 s |
| velocity Verlet | 0.002 | 1.9e-4, 0.35 s | 2.3e-6, 3.3 s |
| position Verlet | 0.008 | 2.2e-4, 0.08 s | 8.1e-6, 0.78 s |
| position Verlet | 0.002 | 1.9e-4, 0.34 s | 2.8e-6, 3.2 s |
| Runge-Kutta 4 | 0.008 | 1.9e-4, 0.21 s | 2.7e-6, 2.1 s |
| Runge-Kutta 4 | 0.002 | 1.8e-4, 0.93 s | 1.5e-6, 7.9 s |
| this one | 10 | 1.0e-4, 0.002 s | 1.3e-6, 0.005 s |
| this one | 3 | 1.1e-4, 0.002 s | 1.6e-6, 0.010 s |
| this one | 1 | 1.1e-4, 0.004 s | 1.5e-6, 0.026 s |

(25 ns a step for the fixed ones, 65 for Runge-Kutta, about 100 here, in a hundredth of the steps.
Kinks of the forces bring all fixed ones down to first order, so a higher order buys nothing.)
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rockcheck.cm.extremes import FLAT_SHARE, Corners, note_mode, note_place
from rockcheck.cm.grid import GRID
from rockcheck.scenes import Floats, Scene, interpolation, kinematics
from rockcheck.scenes.compiled import inner_kernel, kernel

Integers = NDArray[np.int64]
#: Velocity of the block: vx, vy, w.
Velocity = tuple[float, float, float]
#: Across the plane, right and up.
Vector = tuple[float, float]
#: Samples of the base acceleration along one axis, the sums of their means (of two neighbours each)
#: up to every one, and how many there are a second.
Samples = tuple[Floats, Floats, float]

SURFACES = LEFT_WALL, RIGHT_WALL, FLOOR = 0, 1, 2
#: Columns of a contact's memory; contact 2 i + j is corner j (on walls the lower, on the floor the
#: left one is 0) at surface i.
COLUMNS = CLOSED, DAMPING, FORCE, LAST_CLOSED, STRUCK, IMPULSE, STIFFNESS, SPEED = range(8)
#: Columns of the floor's friction: force, the spring's stretch, whether it slips, whether it
#: slipped a step ago.
SHEAR, STRETCH, SLIPS, SLIPPED = 0, 1, 2, 3
#: A contact that was open for longer than this (s), and than a contact is young, strikes when it
#: closes, and its impulse is gathered for as long.
STRIKE = 2e-3
#: A new contact is young for this many contact times 1/sqrt(k/m), longer than an undamped one lasts
#: (pi).
YOUNG = 4.0
#: Steps while a contact is young: this share of the contact time, or of the time in which its
#: damper stops the corner.
FINE, FINE_DAMPER = 0.02, 1.0
#: Shortest step, as a share of the contact time; it bounds the number of steps.
SHORTEST = 1e-3
#: Sweeps over surfaces and friction end when the forces change by less than this share, or after
#: MOST_SWEEPS.
SWEPT, MOST_SWEEPS = 1e-5, 50
#: No step is cut for a contact that would close by less than this share of the depth under the
#: block's weight; a contact that closes more slowly than this share of g/sqrt(k/m) is no impact; a
#: corner that strikes does not slip if it arrives with less than this share of its normal speed.
SHALLOW, GENTLE, STUCK = 0.1, 0.01, 1e-3
#: A run whose energy exceeds the work done on it by this share has blown up.
ENERGY = 0.02
#: Damping of the floor's friction spring in units of sqrt(k/m): so stiff, also beside the damper of
#: an impact without restitution, that friction follows the normal force without lag.
FRICTION_DAMPING = 1e5
#: A surface within this distance (m) of the block at the start is touched, unless it is struck.
TOUCHING = 1e-9
#: How a stretch of motion ended.
DONE, OVERTURNED, BLOWN_UP = 0, 1, 2


#: The state of a run: the motion of the mass's centre at the end of the last step, and at its
#: start; SI units, the velocities those of the centre and the rotation.
STATE = np.dtype(
    [
        *((name, "f8") for name in ("t", "x", "y", "theta", "vx", "vy", "w")),
        *((f"past_{name}", "f8") for name in ("t", "x", "y", "theta", "vx", "vy", "w")),
        # The time until which a contact is young, the step that it needs; the time until an open
        # contact closes; when the first strike began that is not written yet, s.
        ("calm", "f8"),
        ("fine", "f8"),
        ("closing", "f8"),
        ("first_strike", "f8"),
        # The energy allowed by the work done on the block; that work, every part of it positive.
        ("allowed", "f8"),
        ("gross", "f8"),
        # The number of the next multiple of `GRID`; counts of the steps, and of the sweeps over the
        # surfaces.
        ("grid", "i8"),
        ("steps", "i8"),
        ("sweeps", "i8"),
    ]
)


class Parameters(NamedTuple):
    """Constants of a run; SI units, per unit mass. Tuples hold one value a surface."""

    #: Of the corners from the mass's centre, where the block stands: left, right, bottom and top.
    reach: tuple[float, float, float, float]
    #: Of the moment of inertia about the mass's centre, 1/m^2.
    inverse_inertia: float
    gravity: float
    stiffness: float
    friction_damping: float
    mu_s: float
    mu_k: float
    restitution: tuple[float, ...]
    damping_ratio: tuple[float, ...]
    distance: tuple[float, ...]
    calibrated: bool
    time_step: float
    #: `STRIKE`, or for as long as a contact is young, s.
    strike: float
    #: Below this |theta| the block is flat, rad.
    flat: float


class Contacts(NamedTuple):
    """The contacts of a run.

    `memory` holds one row a contact, `friction` the floor's columns; `surfaces` lists the surfaces
    of the scene, the floor last.
    """

    memory: Floats
    friction: Floats
    parameters: Parameters
    surfaces: Integers


class Step(NamedTuple):
    """A step, seen from its middle.

    `x`, `y` and `corners` place the mass's centre and the corners at the middle; `v0` is the
    velocity before the step.
    """

    x: float
    y: float
    corners: Corners
    v0: Velocity
    length: float
    t: float


class Corner(NamedTuple):
    """A corner in a step, and how it meets a surface: gap, rate before and after the step, slip.

    The rates are those at the step's middle, as they would be without the surface's forces.
    """

    rx: float
    ry: float
    lever: float
    mobility: float
    gap: float
    before: float
    rate: float
    slip: float


def damping_ratio_of_paper(restitution: float) -> float:
    """Damping ratio xi for a restitution by (33): -ln e/sqrt(pi^2 + ln^2 e), 1 at e = 0.

    It holds for a contact that pulls until its penetration is gone; a clamped one rebounds faster
    than e says.
    """
    if restitution == 0.0:
        return 1.0
    loss = abs(math.log(restitution))
    return loss / math.hypot(math.pi, loss)


def restitution_of(damping_ratio: float) -> float:
    """Restitution of a clamped Kelvin-Voigt contact with damping ratio xi.

    The contact ends where its force vanishes (Schwager & Poschel 2007):
    e = exp(-2 xi arccos(xi)/sqrt(1 - xi^2)), with arccosh and xi^2 - 1 beyond 1.
    """
    xi = damping_ratio
    if abs(xi - 1.0) < 1e-6:
        return math.exp(-2.0 * xi * (1.0 + (1.0 - xi) / 3.0))
    angle = math.acos(xi) if xi < 1.0 else math.acosh(xi)
    return math.exp(-2.0 * xi * angle / math.sqrt(abs(1.0 - xi * xi)))


def least_restitution(stiffness: float, frequency_parameter: float) -> float:
    """Restitution that stands for zero: p/sqrt(k/m), with p in 1/s and k/m in 1/s^2.

    A clamped contact reaches zero only at infinite damping. This value vanishes with the duration
    of a contact, so that runs with softer contacts show its effect.
    """
    return min(frequency_parameter / math.sqrt(stiffness), 1.0)


def damping_ratio(restitution: float, least: float) -> float:
    """Damping ratio of a clamped Kelvin-Voigt contact: the inverse of `restitution_of`.

    Restitutions below `least` (> 0) get its damping ratio.
    """
    aim = max(restitution, least)
    if aim >= 1.0:
        return 0.0
    low, high = 0.0, 1.0 / math.sqrt(aim)
    while high - low > 1e-12 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if restitution_of(middle) > aim else (low, middle)
    return 0.5 * (low + high)


def begun(
    scene: Scene, stiffness: float, time_step: float, calibrated: bool
) -> tuple[np.record, Contacts]:
    """State and contacts at t = 0; the latter `calibrated`, or the paper's.

    A block on the floor starts sunk in by its weight, so that it does not bounce.
    """
    least = least_restitution(stiffness, scene.frequency_parameter)
    walls = scene.wall("left"), scene.wall("right")
    b, h, (dx, dz) = scene.block.half_width, scene.block.half_height, scene.block.offset
    restitution = (*(wall.restitution if wall else 0.0 for wall in walls), scene.floor.restitution)
    parameters = Parameters(
        reach=(b + dx, b - dx, h + dz, h - dz),
        inverse_inertia=3.0 / (b * b + h * h)
        if scene.block.homogeneous
        else 1.0 / scene.block.gyration_squared,
        gravity=scene.gravity,
        stiffness=stiffness,
        friction_damping=FRICTION_DAMPING * math.sqrt(stiffness),
        mu_s=scene.floor.mu_s,
        mu_k=scene.floor.friction,
        restitution=restitution,
        damping_ratio=tuple(
            damping_ratio(one, least) if calibrated else damping_ratio_of_paper(one)
            for one in restitution
        ),
        distance=(*(b + wall.gap if wall else math.inf for wall in walls), 0.0),
        calibrated=calibrated,
        time_step=time_step,
        strike=max(STRIKE, YOUNG / math.sqrt(stiffness)),
        flat=FLAT_SHARE * scene.block.alpha,
    )
    x, y, tilt, *rates = scene.initial_state
    memory = np.zeros((2 * len(SURFACES), len(COLUMNS)))
    memory[:, [STRUCK, LAST_CLOSED, STIFFNESS]] = math.inf, -math.inf, stiffness
    memory[:, DAMPING] = np.repeat(
        2.0 * math.sqrt(stiffness) * np.array(parameters.damping_ratio), 2
    )
    for wall in scene.walls:
        one = 2 * LEFT_WALL if wall.side == "left" else 2 * RIGHT_WALL
        away, toward = kinematics.side_corners(
            scene.block, wall.side, wall.gap, x, tilt, rates[0], rates[2]
        ).T
        memory[one : one + 2, LAST_CLOSED][(away < TOUCHING) & (toward <= 0.0)] = 0.0
    placed = np.array(kinematics.of_mass(scene.block, scene.initial_state))
    if scene.initial_height < TOUCHING:
        standing = [2 * FLOOR] * (tilt >= 0.0) + [2 * FLOOR + 1] * (tilt <= 0.0)
        memory[standing, CLOSED] = 1.0
        sunk = scene.gravity / (stiffness * len(standing))
        # The corner nearer to the mass's centre carries more.
        if tilt == 0.0 and scene.block.offset[0] != 0.0:
            left, right = scene.block.pivot("left").arm, scene.block.pivot("right").arm
            placed[2] += 2.0 * sunk * (right - left) / (left + right) ** 2
            sunk *= 2.0 * (left * left + right * right) / (left + right) ** 2
        placed[1] -= sunk
    energy = kinematics.energy(scene.block, scene.gravity, y, tilt, *rates)
    gross = abs(energy) + 0.01 * scene.gravity * scene.block.half_width
    x, y, theta, vx, vy, w = placed.tolist()
    state = np.rec.array(
        [
            (
                *(0.0, x, y, theta, vx, vy, w),
                *(0.0, x, y, theta, vx, vy, w),
                *(0.0, math.inf, 0.0, math.inf, energy, gross, 1, 0, 0),
            )
        ],
        dtype=STATE,
    )[0]
    surfaces = np.flatnonzero(np.isfinite(parameters.distance))
    return state, Contacts(memory, np.zeros(4), parameters, surfaces)


@inner_kernel
def felt_share(x: float) -> float:
    """Share of a step's change of speed that a damper feels within that step.

    The argument is x = c K step (damping, mobility, step).

    The Kelvin-Voigt force is k depth - c (rate + share change), change = K step force: the speed
    then decays by 1/(1 + x + x^2/2), of second order and without overshoot however large x is, and
    at rest the spring alone carries the load.
    """
    return (1.0 + x) / (2.0 + x)


@inner_kernel
def normal_forces(
    f1: float, f2: float, d1: float, d2: float, k11: float, k12: float, k21: float, k22: float
) -> tuple[float, float]:
    """Forces of two Kelvin-Voigt contacts that can only push, coupled within the step.

    Here f is the force k depth - c rate that a contact would have if neither force acted, and d the
    loss of force for a unit of velocity gained within the step. K_ij is the velocity (over the
    step's length) that a unit of force j gives to corner i. So F_i + d_i (K F)_i = f_i, but F_i >=
    0. An open contact has f = d = 0.
    """
    a11, a12, a21, a22 = 1.0 + d1 * k11, d1 * k12, d2 * k21, 1.0 + d2 * k22
    determinant = a11 * a22 - a12 * a21
    force1, force2 = (a22 * f1 - a12 * f2) / determinant, (a11 * f2 - a21 * f1) / determinant
    if force1 <= 0.0:
        return 0.0, max(0.0, f2 / a22)
    if force2 <= 0.0:
        return max(0.0, f1 / a11), 0.0
    return force1, force2


@inner_kernel
def friction_force(
    stiffness: float,
    damping: float,
    mobility: float,
    holds: float,
    mu_k: float,
    normal: float,
    stretch: float,
    rate: float,
) -> tuple[float, bool]:
    """Stick-slip friction: a spring-damper whose force stays within Coulomb's cone.

    Returns force and whether it slips.

    `stretch` (m) is the spring's memory, `rate` (m/s) the corner's tangential velocity as it would
    be without this force, and `mobility` how much of that velocity a unit of force takes away: the
    damper acts on the velocity that is left (implicit, so that it may be stiff; then friction
    follows the normal force without lag). A corner sticks up to `holds` `normal`: mu_s where it
    stuck before, mu_k where it slipped. Else it is held at mu_k `normal`.
    """
    force = -(stiffness * stretch + damping * rate) / (1.0 + damping * mobility)
    if abs(force) <= holds * normal:
        return force, False
    return math.copysign(mu_k * normal, force), True


@inner_kernel
def effective_mass(
    k_n: float,
    k_t: float,
    k_c: float,
    normal: float,
    tangential: float,
    mu_s: float,
    mu_k: float,
    restitution: float,
) -> float:
    """Share of the block's mass that a corner brings to an impact with friction.

    It arrives at `normal` (< 0) and `tangential` speed.

    A unit impulse along the normal changes the corner's velocity by k_n = 1 + 3 r_t^2/R^2 along the
    normal and by k_c = -3 r_n r_t/R^2 along the surface, a tangential one by k_c and k_t = 1 + 3
    r_n^2/R^2 (r_n, r_t: offset of the corner from the centroid). Friction that holds the corner
    makes it heavier, 1/m = k_n - k_c^2/k_t; friction mu N that it slips against gives 1/m = k_n +
    mu k_c, signed as it acts. The rigid impact decides which of the two holds, with static friction
    where the corner does not slip as it arrives. Slip that stops or reverses within the impact is
    left out.
    """
    held = k_n - k_c * k_c / k_t
    push = (-(1.0 + restitution) * normal + k_c * tangential / k_t) / held
    shear, sticks = -(tangential + k_c * push) / k_t, abs(tangential) <= STUCK * abs(normal)
    if push > 0.0 and abs(shear) <= (mu_s if sticks else mu_k) * push:
        return 1.0 / held
    return 1.0 / (k_n + math.copysign(mu_k, shear) * k_c)


@inner_kernel
def gained(samples: Floats, sums: Floats, rate: float, t: float) -> float:
    """Velocity of the base at `t`, m/s: its acceleration is linear between samples, zero after."""
    left = int(t * rate)
    if left + 1 >= len(samples):
        return sums[len(samples) - 1] / rate
    part = t * rate - left
    return (
        sums[left] + part * (samples[left] + 0.5 * part * (samples[left + 1] - samples[left]))
    ) / rate


@inner_kernel
def facing(surface: int, corners: Corners) -> tuple[Vector, Vector, Vector]:
    """Normal of a surface and offsets of the two corners that face it."""
    if surface == FLOOR:
        return (0.0, 1.0), corners[0:2], corners[2:4]
    if surface == LEFT_WALL:
        return (1.0, 0.0), corners[0:2], corners[4:6]
    return (-1.0, 0.0), corners[2:4], corners[6:8]


@inner_kernel
def kicked(v: Velocity, inverse: float, n: Vector, lever: float, impulse: float) -> Velocity:
    """Velocity after an impulse along n with that lever; `inverse` is 1/I."""
    return v[0] + n[0] * impulse, v[1] + n[1] * impulse, v[2] + inverse * lever * impulse


@inner_kernel
def with_forces(
    contacts: Contacts, surface: int, corners: Corners, v: Velocity, step: float
) -> Velocity:
    """Velocity after the remembered forces of a surface have acted for `step`."""
    memory, inverse = contacts.memory, contacts.parameters.inverse_inertia
    n, (ax, ay), (bx, by) = facing(surface, corners)
    v = kicked(v, inverse, n, ax * n[1] - ay * n[0], step * memory[2 * surface, FORCE])
    v = kicked(v, inverse, n, bx * n[1] - by * n[0], step * memory[2 * surface + 1, FORCE])
    if surface == FLOOR:
        v = kicked(v, inverse, (1.0, 0.0), -min(ay, by), step * contacts.friction[SHEAR])
    return v


@inner_kernel
def seen(now: Step, v: Velocity, n: Vector, away: float, r: Vector, inverse: float) -> Corner:
    """The corner at `r` over a surface with the normal `n`, `away` from the mass's centre."""
    (nx, ny), (rx, ry), v0 = n, r, now.v0
    lever = rx * ny - ry * nx
    # J belongs to the middle of the step, v to its end and v0 to its start: J changes by -w^2 (n.r)
    # a unit of time.
    turn = 0.5 * now.length * v0[2] ** 2 * (nx * rx + ny * ry)
    return Corner(
        rx,
        ry,
        lever,
        1.0 + inverse * lever * lever,
        away + nx * rx + ny * ry,
        nx * v0[0] + ny * v0[1] + lever * v0[2] + turn,
        nx * v[0] + ny * v[1] + lever * v[2] - turn,
        v[0] - v[2] * ry,
    )


@inner_kernel
def lower_corner(now: Step, v: Velocity) -> Vector:
    """Height of the floor's lower corner from the mass's centre, and its slip (m/s)."""
    ax, ay, bx, by = now.corners[0:4]
    arm, place = (ay, ax) if ay < by else (by, bx)
    return arm, v[0] - v[2] * arm - 0.5 * now.length * now.v0[2] ** 2 * place


@inner_kernel
def closes(
    contacts: Contacts, one: int, comes: Corner, other: Corner, coupling: float, t: float
) -> float:
    """Contact `one` closes at `t`: choose spring and damper, begin a strike if it was open long.

    Returns the step that it asks for. `other` is the surface's other corner, and `coupling` their
    mobility.

    When the other corner arrives within the contact's own time, the two share the block's mass as
    their speeds say. Where the mass lies nearer to one of them, equal springs would turn the block,
    and neither corner would leave with the scene's restitution: there each spring is as stiff as
    its share is large.
    """
    memory, parameters, surface = contacts.memory, contacts.parameters, one // 2
    inverse = parameters.inverse_inertia
    contact_time = 1.0 / math.sqrt(parameters.stiffness)
    memory[one, CLOSED] = 1.0
    if comes.rate > -GENTLE * parameters.gravity * contact_time:
        return math.inf
    if t - memory[one, LAST_CLOSED] > parameters.strike:
        memory[one, STRUCK] = t
        memory[one, IMPULSE] = 0.0
        memory[one, SPEED] = -comes.rate
    if parameters.calibrated:
        left, right, bottom, top = parameters.reach
        spring = 1.0
        ratio = other.rate / comes.rate
        both = other.rate < 0.1 * comes.rate and other.gap < -other.rate * contact_time
        # Its share of the block's mass in a frictionless impact of both, of which the other comes
        # `ratio` times as fast. Negative where the other's impact throws this one off.
        mass = (other.mobility - coupling * ratio) / (
            comes.mobility * other.mobility - coupling * coupling
        )
        if both and (left != right if surface == FLOOR else bottom != top) and mass > 0.0:
            spring = 2.0 * mass
        elif both:
            mass = 1.0 / (comes.mobility + coupling * min(1.0, ratio))
        elif surface == FLOOR:
            mass = effective_mass(
                comes.mobility,
                1.0 + inverse * comes.ry * comes.ry,
                -inverse * comes.rx * comes.ry,
                comes.rate,
                comes.slip,
                parameters.mu_s,
                parameters.mu_k,
                parameters.restitution[surface],
            )
        else:
            mass = 1.0 / comes.mobility
        memory[one, STIFFNESS] = spring * parameters.stiffness
        memory[one, DAMPING] = (
            2.0 * parameters.damping_ratio[surface] * math.sqrt(spring * mass) / contact_time
        )
    return min(FINE * contact_time, FINE_DAMPER / (memory[one, DAMPING] * comes.mobility + 1e-300))


@inner_kernel
def closes_in(parameters: Parameters, gap: float, before: float, rate: float, step: float) -> float:
    """Time from the end of a step until an open contact closes.

    Infinite if that is not soon or too gentle to matter. `gap` is the gap at the middle of the
    step, over which its rate went from `before` to `rate`.
    """
    reach = 0.5 * step + parameters.time_step
    pull = min(0.0, (rate - before) / step)
    if (
        gap + reach * (rate + 0.5 * pull * reach)
        > -SHALLOW * parameters.gravity / parameters.stiffness
    ):
        return math.inf
    arrival = math.sqrt(rate * rate - 2.0 * pull * gap)
    return (2.0 * gap / (arrival - rate) if rate < 0.0 else (arrival + rate) / -pull) - 0.5 * step


@inner_kernel
def pushed(
    contacts: Contacts,
    one: int,
    touches: Corner,
    other: Corner,
    coupling: float,
    now: Step,
    ahead: float,
) -> tuple[float, float, float]:
    """Force of a contact as if its own forces did not move it, and the loss of force.

    The loss is for a unit of velocity gained. Third is the step that the contact needs, infinite
    unless it has just closed. A settled contact stays closed while it would close again within the
    step (`ahead`, s). `memory` holds whether it is closed, and of an open one when it was last, or
    as near as the block's weight sinks it, and too slow for an impact.
    """
    memory, parameters, before = contacts.memory, contacts.parameters, touches.before
    closed, fine, gravity = memory[one, CLOSED] != 0.0, math.inf, parameters.gravity
    if not (touches.gap < 0.0 or (closed and touches.gap + ahead * touches.rate < 0.0)):
        if closed or (
            touches.gap * parameters.stiffness < gravity
            and abs(touches.rate) * math.sqrt(parameters.stiffness) < GENTLE * gravity
        ):
            memory[one, CLOSED], memory[one, LAST_CLOSED] = 0.0, now.t
        return 0.0, 0.0, fine
    if not closed:
        fine = closes(contacts, one, touches, other, coupling, now.t)
    k, damping = memory[one, STIFFNESS], memory[one, DAMPING]
    share = felt_share(damping * touches.mobility * now.length)
    felt = before + share * (touches.rate - before)
    force = -k * (touches.gap + ahead * touches.rate) - damping * felt
    return force, now.length * (share * damping + k * ahead), fine


@inner_kernel
def floor_forces(
    contacts: Contacts,
    now: Step,
    v: Velocity,
    first: Corner,
    second: Corner,
    coupling: float,
    pushes: tuple[float, float, float, float],
) -> tuple[float, float, Velocity, float, float]:
    """The normal forces of the floor, and what its friction does, which `friction` remembers.

    That is the velocity with the friction, and what it adds to the rates of the two corners.
    `coupling` is the mobility of the two corners, `pushes` the forces as if they did not move the
    corners, and the loss of each. Friction acts at the lower corner, within the cone of
    both: they slip together or not at all. It is first solved as if it stuck.
    """
    k11, k22, k12 = first.mobility, second.mobility, coupling
    f1, f2, d1, d2 = pushes
    friction, parameters, step = contacts.friction, contacts.parameters, now.length
    k, inverse = parameters.stiffness, parameters.inverse_inertia
    arm, slip = lower_corner(now, v)
    kt1, kt2 = -inverse * arm * first.lever, -inverse * arm * second.lever
    ktt = 1.0 + inverse * arm * arm
    stop = parameters.friction_damping * step / (1.0 + parameters.friction_damping * step * ktt)
    free, _ = friction_force(
        k, parameters.friction_damping, step * ktt, 1e300, 1e300, 1.0, friction[STRETCH], slip
    )
    force1, force2 = normal_forces(
        f1 - d1 * kt1 * free,
        f2 - d2 * kt2 * free,
        d1,
        d2,
        k11 - stop * kt1 * kt1,
        k12 - stop * kt1 * kt2,
        k12 - stop * kt2 * kt1,
        k22 - stop * kt2 * kt2,
    )
    shear, slips = friction_force(
        k,
        parameters.friction_damping,
        step * ktt,
        parameters.mu_k if friction[SLIPPED] != 0.0 else parameters.mu_s,
        parameters.mu_k,
        force1 + force2,
        friction[STRETCH],
        slip + step * (kt1 * force1 + kt2 * force2),
    )
    if slips:
        mu = math.copysign(parameters.mu_k, shear)
        force1, force2 = normal_forces(
            f1, f2, d1, d2, k11 + mu * kt1, k12 + mu * kt1, k12 + mu * kt2, k22 + mu * kt2
        )
        shear = mu * (force1 + force2)
    friction[SHEAR], friction[SLIPS] = shear, 1.0 if slips else 0.0
    v = kicked(v, inverse, (1.0, 0.0), -arm, step * shear)
    return force1, force2, v, step * kt1 * shear, step * kt2 * shear


@inner_kernel
def press(
    contacts: Contacts, surface: int, now: Step, v: Velocity, ahead: float
) -> tuple[Velocity, float, float]:
    """Applies the forces of one surface over a step.

    `v` is the velocity that the block would have without them, `now.v0` the velocity before the
    step. `ahead` is how far (s) the springs look ahead: the step for contacts that have settled
    (implicit, so that the step need not resolve them), zero while one is young. Returns the
    velocity with the forces; the time until an open contact closes; the step that a closing contact
    needs, else infinity.
    """
    memory, friction, parameters = contacts.memory, contacts.friction, contacts.parameters
    inverse, step, one, two = parameters.inverse_inertia, now.length, 2 * surface, 2 * surface + 1
    n, r1, r2 = facing(surface, now.corners)
    away = n[0] * now.x + n[1] * now.y + parameters.distance[surface]
    first, second = seen(now, v, n, away, r1, inverse), seen(now, v, n, away, r2, inverse)
    rate1, rate2 = first.rate, second.rate
    coupling = 1.0 + inverse * first.lever * second.lever
    f1, d1, fine = pushed(contacts, one, first, second, coupling, now, ahead)
    f2, d2, asked = pushed(contacts, two, second, first, coupling, now, ahead)
    force1 = force2 = 0.0
    closing = math.inf
    if memory[one, CLOSED] + memory[two, CLOSED] > 0.0:
        k11, k22 = first.mobility, second.mobility
        if surface != FLOOR:
            force1, force2 = normal_forces(f1, f2, d1, d2, k11, coupling, coupling, k22)
        else:
            force1, force2, v, more1, more2 = floor_forces(
                contacts, now, v, first, second, coupling, (f1, f2, d1, d2)
            )
            rate1, rate2 = rate1 + more1, rate2 + more2
        v = kicked(v, inverse, n, first.lever, step * force1)
        v = kicked(v, inverse, n, second.lever, step * force2)
        rate1 += step * (k11 * force1 + coupling * force2)
        rate2 += step * (coupling * force1 + k22 * force2)
    elif surface == FLOOR:
        friction[SHEAR] = friction[SLIPS] = 0.0
    memory[one, FORCE], memory[two, FORCE] = force1, force2
    if memory[one, CLOSED] == 0.0:
        closing = closes_in(parameters, first.gap, first.before, rate1, step)
    if memory[two, CLOSED] == 0.0:
        closing = min(closing, closes_in(parameters, second.gap, second.before, rate2, step))
    return v, closing, min(fine, asked)


@inner_kernel
def gather(
    memory: Floats, step: float, until: float, events: Floats, n_events: int
) -> tuple[int, float]:
    """Adds a step's forces to the impulses, and writes the strikes that began by `until`.

    They go into `events`, behind the first `n_events`. Returns how many there are then, and when
    the first of the other strikes began.
    """
    first = math.inf
    for i in range(len(memory)):
        memory[i, IMPULSE] += step * memory[i, FORCE]
        if memory[i, STRUCK] <= until:
            events[n_events, 0], events[n_events, 1] = memory[i, STRUCK], float(i)
            events[n_events, 2], events[n_events, 3] = memory[i, IMPULSE], memory[i, SPEED]
            n_events += 1
            memory[i, STRUCK] = math.inf
        first = min(first, memory[i, STRUCK])
    return n_events, first


@inner_kernel
def kick(
    contacts: Contacts, now: Step, v: Velocity, settled: bool
) -> tuple[Velocity, float, float, int]:
    """Applies the forces of all surfaces over a step.

    `v` is the velocity that the block would have without them, `now.v0` the velocity before the
    step. One surface alone is solved at once. Where a wall touches too, each surface in turn takes
    back its force (first the one of the last step) and replaces it, until they agree. Returns the
    velocity; the time until an open contact closes; the step that a closing contact needs, else
    infinity; the sweeps over the surfaces.
    """
    memory, surfaces, corners, step = contacts.memory, contacts.surfaces, now.corners, now.length
    wall_forces = memory[: 2 * FLOOR, FORCE]
    touching = bool(wall_forces.any())
    if touching:
        for surface in surfaces:
            v = with_forces(contacts, surface, corners, v, step)
    young, ahead = math.inf, step if settled else 0.0
    sweeps = 0
    for _ in range(MOST_SWEEPS):
        sweeps += 1
        closing = math.inf
        change = whole = 0.0
        for surface in surfaces:
            if touching:
                v = with_forces(contacts, surface, corners, v, -step)
            force1, force2 = memory[2 * surface, FORCE], memory[2 * surface + 1, FORCE]
            v, closes_next, fine = press(contacts, surface, now, v, ahead)
            closing, young = min(closing, closes_next), min(young, fine)
            new1, new2 = memory[2 * surface, FORCE], memory[2 * surface + 1, FORCE]
            change += abs(new1 - force1) + abs(new2 - force2)
            whole += new1 + new2
        if not (touching or wall_forces.any()) or change <= SWEPT * whole:
            break
        touching = True
    return v, closing, young, sweeps


@inner_kernel
def stretch(contacts: Contacts, now: Step, v: Velocity) -> None:
    """Moves the friction spring with the lower corner over a step.

    A spring that slips keeps the length of its largest force.
    """
    memory, friction, parameters = contacts.memory, contacts.friction, contacts.parameters
    friction[SLIPPED] = friction[SLIPS]
    load = memory[2 * FLOOR, FORCE] + memory[2 * FLOOR + 1, FORCE]
    if load > 0.0:
        friction[STRETCH] += now.length * lower_corner(now, v)[1]
        if friction[SLIPS] != 0.0:  # the spring slips along, so that slip leaves no other memory
            longest = parameters.mu_k * load / parameters.stiffness
            friction[STRETCH] = min(max(friction[STRETCH], -longest), longest)
    else:
        friction[:] = 0.0


@inner_kernel
def corners_at(parameters: Parameters, theta: float) -> Corners:
    """Offsets of the corners from the mass's centre."""
    left, right, bottom, top = parameters.reach
    s, c = math.sin(theta), math.cos(theta)
    return (
        -left * c + bottom * s,
        -left * s - bottom * c,
        right * c + bottom * s,
        right * s - bottom * c,
        -left * c - top * s,
        -left * s + top * c,
        right * c - top * s,
        right * s + top * c,
    )


@inner_kernel
def take_step(
    contacts: Contacts,
    base: tuple[Samples, Samples],
    end: float,
    state: np.record,
    noted: Floats,
    events: Floats,
    n_events: int,
) -> int:
    """Moves `state` on by one step, to `end` (s) at most. Returns the events written."""
    parameters, memory = contacts.parameters, contacts.memory
    contact_time = 1.0 / math.sqrt(parameters.stiffness)
    t = state.t
    settled = t >= state.calm
    longest = parameters.time_step if settled else state.fine
    step = max(min(longest, state.closing), SHORTEST * contact_time)
    stop = min(state.grid * GRID, end)
    if t + step > stop - SHORTEST * contact_time:
        step = stop - t
    half = 0.5 * step
    middle = t + half
    # Means over the step.
    u = (gained(*base[0], t + step) - gained(*base[0], t)) / step
    vg = (gained(*base[1], t + step) - gained(*base[1], t)) / step
    v0 = state.vx, state.vy, state.w
    state.past_t, state.past_x, state.past_y, state.past_theta = t, state.x, state.y, state.theta
    state.past_vx, state.past_vy, state.past_w = v0
    # Half a step of motion, then the kick.
    x, y, theta = state.x + half * v0[0], state.y + half * v0[1], state.theta + half * v0[2]
    corners = corners_at(parameters, theta)
    note_place(noted, x, y, theta, middle, corners)
    now = Step(x, y, corners, v0, step, middle)
    v = v0[0] - step * u, v0[1] - step * (parameters.gravity + vg), v0[2]
    v, state.closing, young, swept = kick(contacts, now, v, settled)
    stretch(contacts, now, v)
    load = memory[2 * FLOOR, FORCE] + memory[2 * FLOOR + 1, FORCE]
    slip_rate = lower_corner(now, v)[1] if load > 0.0 else 0.0
    note_mode(noted, theta, v[2], slip_rate, middle, parameters.flat)
    if step == stop - t:
        t = stop
        state.grid += 1
    else:
        t += step
    if young < math.inf:
        state.fine = young if settled else min(young, state.fine)
        state.calm = middle + YOUNG * contact_time
    if min(state.first_strike, young) < math.inf:
        n_events, state.first_strike = gather(memory, step, t - parameters.strike, events, n_events)
    work = -half * (u * (v0[0] + v[0]) + vg * (v0[1] + v[1]))
    state.allowed += work
    state.gross += abs(work)
    state.t, state.x, state.y = t, x + half * v[0], y + half * v[1]
    state.theta = theta + half * v[2]
    state.vx, state.vy, state.w = v
    state.steps += 1
    state.sweeps += swept
    return n_events


@inner_kernel
def write_row(state: np.record, t: float, row: Floats) -> None:
    """The motion at a time within the last step: places by the cubic, rates in between."""
    if t == state.t:
        row[0], row[1], row[2] = state.x, state.y, state.theta
        row[3], row[4], row[5] = state.vx, state.vy, state.w
        return
    length = state.t - state.past_t
    share = (t - state.past_t) / length
    first = state.past_x, state.past_y, state.past_theta
    last = state.x, state.y, state.theta
    before, after = (state.past_vx, state.past_vy, state.past_w), (state.vx, state.vy, state.w)
    for i in range(3):
        row[i] = hermite(share, first[i], last[i], length * before[i], length * after[i])
        row[3 + i] = before[i] + share * (after[i] - before[i])


hermite = inner_kernel(interpolation.hermite)


@kernel
def advance(
    contacts: Contacts,
    base: tuple[Samples, Samples],
    state: np.record,
    noted: Floats,
    events: Floats,
    end: float,
    times: Floats,
    output: Floats,
) -> tuple[int, int, int]:
    """Fills the rows of `output`, at `times`, with the motion that follows `state`.

    That is moved along, in steps that know nothing of the rows: they end at multiples of `GRID`
    and at the run's `end`. A row is
    x, y, theta and their rates. `noted` holds the extremes (see `cm.extremes`). `events` gets rows
    (onset time, contact, impulse, speed of approach). Returns the ending (DONE, OVERTURNED or
    BLOWN_UP), the rows and events written.
    """
    parameters = contacts.parameters
    n_events = row = 0
    ending = DONE
    while row < len(output) and ending == DONE:
        if times[row] > state.t:
            n_events = take_step(contacts, base, end, state, noted, events, n_events)
            if abs(state.theta) >= 0.5 * math.pi:
                ending = OVERTURNED
            continue
        kinetic = state.vx**2 + state.vy**2 + state.w**2 / parameters.inverse_inertia
        energy = 0.5 * kinetic + parameters.gravity * (state.y - parameters.reach[2])
        if not (energy <= state.allowed + ENERGY * state.gross and energy < 1e300):
            ending = BLOWN_UP
            continue
        write_row(state, times[row], output[row])
        row += 1
    corners = corners_at(parameters, state.theta)
    note_place(noted, state.x, state.y, state.theta, state.t, corners)
    return ending, row, n_events
