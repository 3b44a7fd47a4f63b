"""The compiled step of `engines.steps`: plans the engine's next step and applies its result.

Lengths are in R. A contact is a row of `corners`, first the floor's two, then the walls': the
corner (2), the surface's normal (2) and its distance, see `engines.contacts`. A base motion is its
pieces, their interval and the last velocity.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rockcheck.engines import base_motion, contacts
from rockcheck.scenes import Floats, Scene, kinematics
from rockcheck.scenes.compiled import inner_kernel, kernel

Base = tuple[Floats, float, float]
Velocity = tuple[float, float, float]  # along x, y and theta

# Lengths in units of the block's radius R, times in units of 1/p.
CLOSED = 5e-9  # a corner nearer than this touches
# Per longest step: how far a resting corner may drift from its surface in one step; it sets the
# contact distance where it exceeds CLOSED.
DRIFT = 3e-6
EMBEDDED = 5e-10  # how deep the engine sees a corner that touches
PROBE_STEP = 6e-5  # the longest step where the acceleration is not known, that is, after an event
# an impact takes one: its time is wrong by so much, its place by what the block moves in it
SHORTEST_STEP = 2e-8
LONG_APPROACH = 6e-4  # from farther away the prediction of an event is only trusted to 95 %
RESTING = (
    0.001  # of g times the longest step: slower approaches and departures are not told from rest
)
# Largest ratio of the speeds of corners that strike at the same time: the slenderness of a slender
# block.
TOGETHER = 20.0
SETTLING_GAP = 2e-6
# A corner that leaves and is back within twice this share of a step is taken to stay: of the
# longest step, after an event of a probe.
SETTLING_TIME = 0.2

#: Contacts with the floor, the first rows of `corners`; all others are with walls.
FLOOR = 2
#: Results of a step: the run has ended, continues, or has blown up.
OVER, GOES_ON, LOST = 0, 1, 2
#: Columns of a row of the march: time, state (6), felt acceleration (2).
COLUMNS = 9
# The state: pose, velocity; mean acceleration and length of the step before, and whether they are
# known; time, velocity of the base then; whether the step ends where slip stops, the velocity at
# which a contact is carried along its arc, and whether the acceleration goes on: it is known, and
# the closed contacts are those of the step before.
X, Y, THETA, VX, VY, W, AX, AY, SPIN, PAST_DT, KNOWN, T = range(12)
BASE_X, BASE_Y, STOPS, CARRY_X, CARRY_Y, SMOOTH = range(12, 18)
# The request to the engine: mean pose, velocity, length of the step, felt acceleration, and whether
# the step is an impact.
DT, FELT, IMPACT = 6, 7, 9


class Course(NamedTuple):
    """The input of a run: what it meets, and how long and slow is long and slow; in R, s and R/s.

    Contacts, times at which the base may set a resting block in motion, the base motion to the
    right and up, the end of the run, and gravity; thresholds for near, short, long and slow.
    `standing` is the height of the centre of mass at rest.
    """

    corners: Floats
    starts: Floats
    across: Base
    up: Base
    end: float
    gravity: float
    standing: float
    longest: float
    closed: float
    probe: float
    shortest: float
    long_approach: float
    resting: float


class March(NamedTuple):
    """The state of a run between steps.

    It holds the contacts closed in this step (`closed`) and in the step before (`before`), and the
    request to the engine (`asked`).
    """

    state: Floats
    closed: NDArray[np.bool_]
    before: NDArray[np.bool_]
    asked: Floats


def begun(scene: Scene, longest: float, short: float) -> tuple[Course, March]:
    """A run at its start: steps of at most `longest` s, and near events `short` times the usual."""
    base = base_motion.velocity_of(scene.excitation), base_motion.velocity_of(scene.vertical)
    moment = short / scene.frequency_parameter
    across, up = (
        (np.array(one.pieces or np.empty((0, 1))), one.interval, one.last) for one in base
    )
    course = Course(
        corners=np.array(
            [(*one.corner, *one.normal, one.distance) for one in contacts.contacts_of(scene)]
        ),
        starts=np.array([*base_motion.starts_of_motion(scene, *base), math.inf]),
        across=across,
        up=up,
        end=float(scene.run_times[-1]),
        gravity=scene.gravity,
        standing=scene.block.weaker_pivot.height,
        longest=longest,
        closed=max(CLOSED, DRIFT * longest * scene.frequency_parameter),
        probe=min(PROBE_STEP * moment, longest),
        shortest=min(SHORTEST_STEP * moment, longest),
        long_approach=LONG_APPROACH * moment,
        resting=RESTING * longest * scene.gravity,
    )
    state = np.zeros(SMOOTH + 1)
    state[:6] = kinematics.of_mass(scene.block, scene.initial_state)
    closed, before = np.zeros((2, len(course.corners)), dtype=bool)
    return course, March(state, closed, before, np.zeros(IMPACT + 1))


_velocity_at, _rate_of = inner_kernel(base_motion.velocity_at), inner_kernel(contacts.rate_of)
_arm_of, _gap_of = inner_kernel(contacts.arm_of), inner_kernel(contacts.gap_of)


@inner_kernel
def seen(corner: Floats, z: Floats, cos: float, sin: float) -> tuple[Any, float, float]:
    """Arm, gap and rate of a contact."""
    bx, bz, nx, nz, distance = corner
    arm = _arm_of(bx, bz, cos, sin)
    gap = _gap_of(nx, nz, distance, z[X], z[Y], arm)
    return arm, gap, _rate_of(nx, nz, z[VX], z[VY], z[W], arm)


@inner_kernel
def pulled(corner: Floats, z: Floats, arm: Any) -> float:
    """The acceleration of a contact's gap."""
    turning = z[W] * z[W]
    return corner[2] * (z[AX] - z[SPIN] * arm[1] - turning * arm[0]) + corner[3] * (
        z[AY] + z[SPIN] * arm[0] - turning * arm[1]
    )


@inner_kernel
def trusted(predicted: float, course: Course) -> float:
    """How much of the predicted time to an event one step may take, s."""
    return 0.95 * predicted if predicted > course.long_approach else predicted


@inner_kernel
def time_to_close(corner: Floats, z: Floats, arm: Any, gap: float, rate: float) -> float:
    """When the gap of a contact is zero, s, by its acceleration if known; infinity if never.

    A gap that opens closes on its way back.
    """
    curvature = pulled(corner, z, arm) if z[KNOWN] != 0.0 else 0.0
    discriminant = rate * rate - 2.0 * curvature * gap
    if discriminant < 0.0:
        return math.inf
    if rate < 0.0:
        return 2.0 * gap / (math.sqrt(discriminant) - rate)
    return (rate + math.sqrt(discriminant)) / -curvature if curvature < 0.0 else math.inf


@inner_kernel
def stopping_time(z: Floats, arm: Any, dt: float, course: Course) -> float:
    """When the slip of a corner on the floor stops within `dt`, s; infinity if never or unknown."""
    slip = z[VX] - z[W] * arm[1]
    slowing = z[AX] - z[SPIN] * arm[1] - z[W] * z[W] * arm[0]
    if (
        z[KNOWN] != 0.0
        and slip * slowing < 0.0
        and 0.2 * course.resting < abs(slip) < abs(slowing) * dt
    ):
        return abs(slip / slowing)
    return math.inf


@inner_kernel
def length(run: March, course: Course, dt: float) -> tuple[float, bool]:
    """The next step, at most `dt` s long, and whether it is an impact.

    It ends before a gap closes or a slip stops that the present acceleration brings.
    """
    z, known, resting = run.state, run.state[KNOWN] != 0.0, course.resting
    corners = course.corners
    dt = min(dt, course.longest if known else course.probe)
    staying = SETTLING_TIME * course.probe * course.gravity
    leaving = resting if known else max(resting, staying)
    stops, slowest = False, math.inf
    cos, sin = math.cos(z[THETA]), math.sin(z[THETA])
    for i in range(len(corners)):
        arm, gap, rate = seen(corners[i], z, cos, sin)
        run.closed[i] = not (gap > course.closed or rate > leaving)
        if not run.closed[i]:
            closing = time_to_close(corners[i], z, arm, gap, rate)
            if closing < dt:
                dt, stops = max(trusted(closing, course), course.shortest), False
        elif rate < -resting:
            slowest = min(slowest, -rate)
        elif i < FLOOR:
            stopping = stopping_time(z, arm, dt, course)
            if stopping < math.inf:
                dt = trusted(stopping, course)
                stops = dt == stopping
    z[STOPS] = stops
    if slowest == math.inf:
        return dt, False
    join(run, course, slowest)
    return course.shortest, True


@inner_kernel
def join(run: March, course: Course, speed: float) -> None:
    """Lets corners share an impact that would strike at the same moment, not a hair later.

    The corner that strikes touches from `closed` away, at `speed`, so the impact is early by the
    time in which it would arrive. What comes down k times as fast is then still k times as far.
    """
    z, corners = run.state, course.corners
    cos, sin = math.cos(z[THETA]), math.sin(z[THETA])
    for i in range(len(corners)):
        _, gap, rate = seen(corners[i], z, cos, sin)
        run.closed[i] = run.closed[i] or (
            rate < -speed and gap < course.closed * min(-rate / speed, TOGETHER)
        )


@inner_kernel
def drift(run: March, corners: Floats, dt: float) -> None:
    """The mean pose of the step and the velocity that the engine sees, into `asked`.

    The engine sees the block in its mean pose, with the corners that touch just below the surface.
    What rests on a surface at the step's end still moves along its arc in the mean pose; the state
    remembers that velocity. The engine's contacts know nothing of arcs, but in a frame that moves
    with it they are right.
    """
    z = run.state
    ax, ay, spin = (z[AX], z[AY], z[SPIN]) if z[SMOOTH] != 0.0 else (0.0, 0.0, 0.0)
    half, sixth, later = 0.5 * dt, dt * dt / 6.0, z[W] + dt * spin
    px, py, mean = (
        z[X] + half * z[VX] + sixth * ax,
        z[Y] + half * z[VY] + sixth * ay,
        z[THETA] + half * z[W] + sixth * spin,
    )
    z[CARRY_X] = z[CARRY_Y] = 0.0
    cos, sin = math.cos(mean), math.sin(mean)
    for first, end in ((0, FLOOR), (FLOOR, len(corners))):
        highest, last = -math.inf, -1
        for i in range(first, end):
            if run.closed[i]:
                bx, bz, nx, nz, distance = corners[i]
                gap = _gap_of(nx, nz, distance, px, py, _arm_of(bx, bz, cos, sin))
                highest, last = max(highest, gap), i
        if last >= 0:
            bx, bz, nx, nz, _ = corners[last]
            px, py = px - nx * (highest + EMBEDDED), py - nz * (highest + EMBEDDED)
            final = z[THETA] + half * (z[W] + later)
            arm, ends = _arm_of(bx, bz, cos, sin), _arm_of(bx, bz, math.cos(final), math.sin(final))
            z[CARRY_X] = -later * (ends[1] - arm[1])
            if nz != 0.0:
                z[CARRY_Y] = later * (ends[0] - arm[0])
    run.asked[:DT] = px, py, mean, z[VX] + z[CARRY_X], z[VY] + z[CARRY_Y], z[W]


@kernel
def plan(run: March, course: Course) -> int:
    """Asks for the next step; returns OVER at the end or where the block lies, else GOES_ON."""
    z, starts = run.state, course.starts
    if not (z[T] < course.end - 1e-12 and abs(z[THETA]) < math.pi / 2):
        return OVER
    start = starts[np.searchsorted(starts, z[T] + 1e-9, side="right")]
    dt, impact = length(run, course, min(course.end - z[T], start - z[T]))
    going_on = z[KNOWN] != 0.0
    for i in range(len(run.closed)):
        going_on = going_on and run.closed[i] == run.before[i]
    z[SMOOTH] = going_on
    z[T] += dt
    base_x = _velocity_at(z[T], *course.across)
    base_y = _velocity_at(z[T], *course.up)
    felt = (z[BASE_X] - base_x) / dt, (z[BASE_Y] - base_y) / dt - course.gravity
    run.asked[DT:] = dt, felt[0], felt[1], 1.0 if impact else 0.0
    z[BASE_X], z[BASE_Y] = base_x, base_y
    drift(run, course.corners, dt)
    return GOES_ON


@kernel
def step(run: March, course: Course, kicked: Velocity, row: Floats) -> int:
    """End the step with the engine's velocity `kicked`, write its `row` and plan the next step.

    Returns LOST where the motion has blown up.
    """
    z, dt = run.state, run.asked[DT]
    known = z[KNOWN] != 0.0
    move(run, kicked[0] - z[CARRY_X], kicked[1] - z[CARRY_Y], kicked[2], dt)
    put_back(run, course)
    if not known and (run.closed[0] or run.closed[1]) and settles(z, course):
        z[Y], z[THETA], z[VY], z[W] = course.standing, 0.0, 0.0, 0.0
        z[AY] = z[SPIN] = 0.0  # what stopped it in this step does not go on in the next
    z[KNOWN] = run.asked[IMPACT] == 0.0 and z[STOPS] == 0.0
    z[PAST_DT] = dt
    run.before[:] = run.closed
    row[0], row[1:7], row[7:] = z[T], z[:6], run.asked[FELT:IMPACT]
    if not math.sqrt(z[VX] * z[VX] + z[VY] * z[VY] + z[W] * z[W]) < 1e6:  # nan, too
        return LOST
    return plan(run, course)


@inner_kernel
def move(run: March, vx: float, vy: float, w: float, dt: float) -> None:
    """Update pose, velocity and mean acceleration to the step's end, with velocity (vx, vy, w).

    Where the same contacts were closed in the step before, the acceleration is taken to be linear
    over both steps. The drift is then dt/2 (v + v_new) - dt^2/12 (change of the acceleration over
    the step); for the mean pose the last acceleration suffices.
    """
    z, half = run.state, 0.5 * dt
    bend = dt**3 / (6.0 * (dt + z[PAST_DT])) if z[SMOOTH] != 0.0 else 0.0
    new_ax, new_ay, new_spin = (vx - z[VX]) / dt, (vy - z[VY]) / dt, (w - z[W]) / dt
    z[X] = z[X] + half * (z[VX] + vx) - bend * (new_ax - z[AX])
    z[Y] = z[Y] + half * (z[VY] + vy) - bend * (new_ay - z[AY])
    z[THETA] = z[THETA] + half * (z[W] + w) - bend * (new_spin - z[SPIN])
    z[VX], z[VY], z[W], z[AX], z[AY], z[SPIN] = vx, vy, w, new_ax, new_ay, new_spin


@inner_kernel
def put_back(run: March, course: Course) -> None:
    """The pose with the one corner that stays on a surface put back onto it."""
    z, corners = run.state, course.corners
    cos, sin = math.cos(z[THETA]), math.sin(z[THETA])
    for first, end in ((0, FLOOR), (FLOOR, len(corners))):
        count, last = 0, -1
        for i in range(first, end):
            if run.closed[i]:
                count, last = count + 1, i
        if count == 1:
            _, gap, rate = seen(corners[last], z, cos, sin)
            if abs(rate) < course.resting:
                z[X], z[Y] = z[X] - corners[last, 2] * gap, z[Y] - corners[last, 3] * gap


@inner_kernel
def settles(z: Floats, course: Course) -> bool:
    """Whether both lower corners are on the floor, or so near and slow that they return at once."""
    cos, sin = math.cos(z[THETA]), math.sin(z[THETA])
    for i in range(FLOOR):
        arm, gap, rate = seen(course.corners[i], z, cos, sin)
        back = -SETTLING_TIME * course.longest * pulled(course.corners[i], z, arm)
        if gap > SETTLING_GAP or not abs(rate) <= max(SETTLING_GAP, back):
            return False
    return True
