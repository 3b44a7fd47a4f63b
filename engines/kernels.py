"""The compiled step of adaptive steps: plans the engine's next one and applies its result.

In: the run's state, a named record, and its course; the velocity that the engine gave.
Out: the request for the next step; the state at the end of this one, and its row.
Called by `engines.steps`, once a step.

Lengths are in R, times in s.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.engines import base_motion, contacts
from rockcheck.engines.adaptive_march import SETTLING_TIME, Course, March
from rockcheck.scenes import Floats
from rockcheck.scenes.compiled import inner_kernel, kernel

Velocity = tuple[float, float, float]  # along x, y and theta

# Lengths in R.
#: How deep the engine sees a corner that touches.
EMBEDDED = 5e-10
#: Largest ratio of the speeds of corners that strike at the same time: the slenderness of a slender
#: block.
TOGETHER = 20.0
SETTLING_GAP = 2e-6
#: Of the speed that gravity gives in a step: what an engine leaves of it where a block lies still.
STILL = 1e-5

# The next step by the error of the last, which grows with its third power.
#: What is aimed at, of the step whose error is the tolerance.
CAUTION = 0.9
#: The next step is at most and at least so many times the last.
GROWTH, SHRINKING = 8.0, 0.2
#: A step whose error is so many times the tolerance is taken again.
TOO_WRONG = 2.0

#: Contacts with the floor, the first rows of `corners`; all others are with walls.
FLOOR = 2
#: Results of a step: the run has ended, continues, has blown up; the step is to be taken again.
OVER, GOES_ON, LOST, AGAIN = 0, 1, 2, 3
#: Columns of a row of the march: time, state (6), felt acceleration (2).
COLUMNS = 9

_velocity_at = inner_kernel(base_motion.velocity_at)
_rate_of = inner_kernel(contacts.rate_of)
_arm_of = inner_kernel(contacts.arm_of)
_gap_of = inner_kernel(contacts.gap_of)


@inner_kernel
def contact_state(
    corner: np.record, motion: np.record, cos: float, sin: float
) -> tuple[Any, float, float]:
    """Arm, gap and rate of a contact."""
    arm = _arm_of(corner.bx, corner.bz, cos, sin)
    gap = _gap_of(corner.nx, corner.nz, corner.distance, motion.x, motion.y, arm)
    rate = _rate_of(corner.nx, corner.nz, motion.vx, motion.vy, motion.w, arm)
    return arm, gap, rate


@inner_kernel
def gap_acceleration(corner: np.record, state: np.record, arm: Any) -> float:
    """The acceleration of a contact's gap."""
    turning = state.motion.w * state.motion.w
    across = state.ax - state.spin * arm[1] - turning * arm[0]
    up = state.ay + state.spin * arm[0] - turning * arm[1]
    return corner.nx * across + corner.nz * up


@inner_kernel
def trusted(predicted: float, long: float) -> float:
    """How much of the predicted time to an event one step may take, s; `long` is a long time."""
    return 0.95 * predicted if predicted > long else predicted


@inner_kernel
def time_to_close(corner: np.record, state: np.record, arm: Any, gap: float, rate: float) -> float:
    """When the gap of a contact is zero, s, by its acceleration if known; infinity if never.

    A gap that opens closes on its way back.
    """
    curvature = gap_acceleration(corner, state, arm) if state.known else 0.0
    discriminant = rate * rate - 2.0 * curvature * gap
    if discriminant < 0.0:
        return math.inf
    if rate < 0.0:
        return 2.0 * gap / (math.sqrt(discriminant) - rate)
    return (rate + math.sqrt(discriminant)) / -curvature if curvature < 0.0 else math.inf


@inner_kernel
def stopping_time(state: np.record, arm: Any, dt: float, course: Course) -> float:
    """When the slip of a corner on the floor stops within `dt`, s; infinity if never or unknown."""
    motion = state.motion
    slip = motion.vx - motion.w * arm[1]
    slowing = state.ax - state.spin * arm[1] - motion.w * motion.w * arm[0]
    if (
        state.known
        and slip * slowing < 0.0
        and 0.2 * course.resting < abs(slip) < abs(slowing) * dt
    ):
        return abs(slip / slowing)
    return math.inf


@inner_kernel
def slipping_time(state: np.record) -> float:
    """When a contact that sticks begins to slip, as its margin goes on, s; infinity if never."""
    if not state.known or not state.margin_rate < 0.0:
        return math.inf
    return max(state.margin / -state.margin_rate - 0.5 * state.past_dt, 0.0)


@inner_kernel
def step_length(run: March, course: Course, dt: float) -> tuple[float, bool]:
    """The next step, at most `dt` s long, and whether it is an impact.

    It ends before a gap closes or a slip stops that the present acceleration brings.
    """
    state = run.states[0]
    motion = state.motion
    resting = course.resting
    corners = course.corners
    dt = longest_step(state, course, dt)
    staying = SETTLING_TIME * course.probe * course.gravity
    leaving = resting if state.known else max(resting, staying)
    stops, slowest = False, math.inf
    cos, sin = math.cos(motion.theta), math.sin(motion.theta)
    for i in range(len(corners)):
        arm, gap, rate = contact_state(corners[i], motion, cos, sin)
        run.closed[i] = not (gap > course.closed or rate > leaving)
        if not run.closed[i]:
            closing = time_to_close(corners[i], state, arm, gap, rate)
            if closing < dt:
                dt, stops = max(trusted(closing, course.long_approach), course.shortest), False
        elif rate < -resting:
            slowest = min(slowest, -rate)
        elif i < FLOOR:
            stopping = stopping_time(state, arm, dt, course)
            if stopping < math.inf:
                dt = trusted(stopping, course.long_slowing)
                stops = dt == stopping
    state.stops = stops
    if slowest < math.inf:
        join(run, course, slowest)
        return course.shortest, True
    if course.tolerance < math.inf:
        dt = until_contacts_change(run, course, dt)
    return dt, False


@inner_kernel
def longest_step(state: np.record, course: Course, dt: float) -> float:
    """The longest next step where `dt` s remain; with a tolerance no sliver is left of them."""
    allowed = state.allowed if state.known else course.probe
    if course.tolerance < math.inf and allowed < dt < 2.0 * allowed:
        return 0.5 * dt
    return min(dt, allowed)


@inner_kernel
def leans(run: March) -> bool:
    """Whether a block that does not stand flat touches a wall."""
    if run.closed[0] and run.closed[1]:
        return False
    for i in range(FLOOR, len(run.closed)):  # noqa: SIM110 - compiled, where there are no generators
        if run.closed[i]:
            return True
    return False


@inner_kernel
def until_contacts_change(run: March, course: Course, dt: float) -> float:
    """The step of at most `dt` s that ends where slip begins.

    It is a probe after a contact opened: the acceleration is another. Nothing tells when a block
    that leans on a wall leaves it, so that it takes fine steps.
    """
    state = run.states[0]
    if leans(run) and dt > course.fine:
        dt, state.stops = course.fine, False
    slipping = max(slipping_time(state), course.long_slowing)
    if slipping < dt:
        dt, state.stops = trusted(slipping, course.long_slowing), False
    if dt > course.probe and contacts_changed(run):
        dt, state.stops = course.probe, False
    return dt


@inner_kernel
def contacts_changed(run: March) -> bool:
    """Whether the closed contacts are others than in the step before."""
    for i in range(len(run.closed)):  # noqa: SIM110 - compiled, where there are no generators
        if run.closed[i] != run.before[i]:
            return True
    return False


@inner_kernel
def join(run: March, course: Course, speed: float) -> None:
    """Lets corners share an impact that would strike at the same moment, not a hair later.

    The corner that strikes touches from `closed` away, at `speed`, so the impact is early by the
    time in which it would arrive. What comes down k times as fast is then still k times as far.
    """
    motion = run.states[0].motion
    corners = course.corners
    cos, sin = math.cos(motion.theta), math.sin(motion.theta)
    for i in range(len(corners)):
        _, gap, rate = contact_state(corners[i], motion, cos, sin)
        run.closed[i] = run.closed[i] or (
            rate < -speed and gap < course.closed * min(-rate / speed, TOGETHER)
        )


@inner_kernel
def ask_for_pose(run: March, corners: NDArray[np.void], dt: float) -> None:
    """The mean pose of the step and the velocity that the engine sees, into the request.

    The engine sees the block in its mean pose, with the corners that touch just below the surface.
    What rests on a surface at the step's end still moves along its arc in the mean pose; the state
    remembers that velocity. The engine's contacts know nothing of arcs, but in a frame that moves
    with it they are right.
    """
    state = run.states[0]
    motion = state.motion
    request = run.requests[0]
    ax, ay, spin = (state.ax, state.ay, state.spin) if state.smooth else (0.0, 0.0, 0.0)
    half = 0.5 * dt
    sixth = dt * dt / 6.0
    later = motion.w + dt * spin
    px = motion.x + half * motion.vx + sixth * ax
    py = motion.y + half * motion.vy + sixth * ay
    mean = motion.theta + half * motion.w + sixth * spin
    state.carry_x = state.carry_y = 0.0
    cos, sin = math.cos(mean), math.sin(mean)
    for first, end in ((0, FLOOR), (FLOOR, len(corners))):
        highest, last = -math.inf, -1
        for i in range(first, end):
            if run.closed[i]:
                corner = corners[i]
                arm = _arm_of(corner.bx, corner.bz, cos, sin)
                gap = _gap_of(corner.nx, corner.nz, corner.distance, px, py, arm)
                highest, last = max(highest, gap), i
        if last >= 0:
            corner = corners[last]
            px = px - corner.nx * (highest + EMBEDDED)
            py = py - corner.nz * (highest + EMBEDDED)
            final = motion.theta + half * (motion.w + later)
            arm = _arm_of(corner.bx, corner.bz, cos, sin)
            ends = _arm_of(corner.bx, corner.bz, math.cos(final), math.sin(final))
            state.carry_x = -later * (ends[1] - arm[1])
            if corner.nz != 0.0:
                state.carry_y = later * (ends[0] - arm[0])
    request.x = px
    request.y = py
    request.theta = mean
    request.vx = motion.vx + state.carry_x
    request.vy = motion.vy + state.carry_y
    request.w = motion.w


@kernel
def plan(run: March, course: Course) -> int:
    """Asks for the next step; returns OVER at the end or where the block lies, else GOES_ON."""
    state = run.states[0]
    request = run.requests[0]
    stops = course.stops
    if not (state.t < course.end - 1e-12 and abs(state.motion.theta) < math.pi / 2):
        return OVER
    stop = stops[np.searchsorted(stops, state.t + 1e-9, side="right")]
    dt, impact = step_length(run, course, min(course.end - state.t, stop - state.t))
    state.smooth = state.known and not contacts_changed(run)
    run.states[1] = state
    state.t += dt
    base_x = _velocity_at(state.t, *course.across)
    base_y = _velocity_at(state.t, *course.up)
    request.dt = dt
    request.felt_x = (state.base_x - base_x) / dt
    request.felt_y = (state.base_y - base_y) / dt - course.gravity
    request.impact = 1.0 if impact else 0.0
    state.base_x = base_x
    state.base_y = base_y
    ask_for_pose(run, course.corners, dt)
    return GOES_ON


@kernel
def step(run: March, course: Course, kicked: Velocity, row: Floats) -> int:
    """End the step with the engine's velocity `kicked`, write its `row` and plan the next step.

    Returns LOST where the motion has blown up; AGAIN where the step's error is too large: no row is
    written, and the step is planned anew, shorter.
    """
    state = run.states[0]
    motion = state.motion
    request = run.requests[0]
    was_known = state.known
    dt = request.dt
    vx, vy, w = kicked[0] - state.carry_x, kicked[1] - state.carry_y, kicked[2]
    if course.tolerance < math.inf:
        error = step_error(state, vx, vy, w, dt)
        state.allowed = allowed_step(dt, error, course)
        if error > TOO_WRONG * course.tolerance and dt > course.probe:
            return again(run, course, state.allowed)
    move(state, vx, vy, w, dt)
    watch_friction(run, course, dt)
    put_back(run, course)
    if course.tolerance < math.inf:
        if dt > course.fine and gives_way(run, course):
            return again(run, course, max(SHRINKING * dt, course.fine))
        # Steps are long at rest, and an engine's noise would add up.
        if lies_still(run, course, dt):
            motion.y, motion.theta = course.standing, 0.0
            motion.vx, motion.vy, motion.w = 0.0, 0.0, 0.0
    if not was_known and (run.closed[0] or run.closed[1]) and settles(state, course):
        motion.y, motion.theta, motion.vy, motion.w = course.standing, 0.0, 0.0, 0.0
        # What stopped it in this step does not go on in the next.
        state.ay = state.spin = 0.0
    state.known = request.impact == 0.0 and not state.stops
    state.past_dt = dt
    run.before[:] = run.closed
    row[0] = state.t
    row[1], row[2], row[3] = motion.x, motion.y, motion.theta
    row[4], row[5], row[6] = motion.vx, motion.vy, motion.w
    row[7], row[8] = request.felt_x, request.felt_y
    speed = math.sqrt(motion.vx * motion.vx + motion.vy * motion.vy + motion.w * motion.w)
    if not speed < 1e6:  # nan, too
        return LOST
    return plan(run, course)


@inner_kernel
def again(run: March, course: Course, allowed: float) -> int:
    """Goes back to the step's start, and plans it anew, at most `allowed` s long."""
    run.states[0] = run.states[1]
    run.states[0].allowed = allowed
    plan(run, course)
    return AGAIN


@inner_kernel
def gives_way(run: March, course: Course) -> bool:
    """Whether a contact that was closed in this step opens."""
    motion = run.states[0].motion
    cos, sin = math.cos(motion.theta), math.sin(motion.theta)
    for i in range(len(run.closed)):
        if run.closed[i]:
            _, _, rate = contact_state(course.corners[i], motion, cos, sin)
            if rate > course.resting:
                return True
    return False


@inner_kernel
def watch_friction(run: March, course: Course, dt: float) -> None:
    """The margin of a contact that sticks to the floor, in the step that has just been made.

    Without a wall the floor gives all of the acceleration that is not felt.
    """
    state = run.states[0]
    request = run.requests[0]
    motion = state.motion
    sticks = False
    for i in range(len(run.closed)):
        if run.closed[i]:
            corner = course.corners[i]
            arm = _arm_of(corner.bx, corner.bz, math.cos(motion.theta), math.sin(motion.theta))
            sticks = i < FLOOR and abs(motion.vx - motion.w * arm[1]) <= course.resting
            if not sticks:
                break
    margin = math.inf
    if sticks:
        pulling = abs(state.ax - request.felt_x)
        margin = course.friction * (state.ay - request.felt_y) - pulling
    goes_on = state.smooth and margin < math.inf and state.margin < math.inf
    between = 0.5 * (dt + state.past_dt)
    state.margin_rate = (margin - state.margin) / between if goes_on else 0.0
    state.margin = margin


@inner_kernel
def step_error(state: np.record, vx: float, vy: float, w: float, dt: float) -> float:
    """What the change of the acceleration moves in a step to velocity (vx, vy, w), in R and rad.

    It is the error of a step that takes the acceleration to be that of the step before. `move`
    corrects the pose by it, so that what remains is smaller. Zero after an event, where no
    acceleration is known.
    """
    if not state.smooth:
        return 0.0
    motion = state.motion
    ax = (vx - motion.vx) / dt - state.ax
    ay = (vy - motion.vy) / dt - state.ay
    spin = (w - motion.w) / dt - state.spin
    return bend_of(state, dt) * max(abs(ax), abs(ay), abs(spin))


@inner_kernel
def allowed_step(dt: float, error: float, course: Course) -> float:
    """How long a step may be after one of `dt` s with this error, s."""
    reached = error / course.tolerance
    factor = GROWTH
    if reached > (CAUTION / GROWTH) ** 3:
        factor = max(CAUTION / reached ** (1.0 / 3.0), SHRINKING)
    return min(factor * max(dt, course.probe), course.longest)


@inner_kernel
def bend_of(state: np.record, dt: float) -> float:
    """What a change of the mean acceleration by 1 from the step before moves in this one, s^2."""
    return dt**3 / (6.0 * (dt + state.past_dt))


@inner_kernel
def move(state: np.record, vx: float, vy: float, w: float, dt: float) -> None:
    """Update pose, velocity and mean acceleration to the step's end, with velocity (vx, vy, w).

    Where the same contacts were closed in the step before, the acceleration is taken to be linear
    over both steps. The drift is then dt/2 (v + v_new) - dt^2/12 (change of the acceleration over
    the step); for the mean pose the last acceleration suffices.
    """
    motion = state.motion
    half = 0.5 * dt
    bend = bend_of(state, dt) if state.smooth else 0.0
    ax = (vx - motion.vx) / dt
    ay = (vy - motion.vy) / dt
    spin = (w - motion.w) / dt
    motion.x = motion.x + half * (motion.vx + vx) - bend * (ax - state.ax)
    motion.y = motion.y + half * (motion.vy + vy) - bend * (ay - state.ay)
    motion.theta = motion.theta + half * (motion.w + w) - bend * (spin - state.spin)
    motion.vx, motion.vy, motion.w = vx, vy, w
    state.ax, state.ay, state.spin = ax, ay, spin


@inner_kernel
def put_back(run: March, course: Course) -> None:
    """The pose with the one corner that stays on a surface put back onto it."""
    motion = run.states[0].motion
    corners = course.corners
    cos, sin = math.cos(motion.theta), math.sin(motion.theta)
    for first, end in ((0, FLOOR), (FLOOR, len(corners))):
        count, last = 0, -1
        for i in range(first, end):
            if run.closed[i]:
                count, last = count + 1, i
        if count == 1:
            corner = corners[last]
            _, gap, rate = contact_state(corner, motion, cos, sin)
            if abs(rate) < course.resting:
                motion.x = motion.x - corner.nx * gap
                motion.y = motion.y - corner.nz * gap


@inner_kernel
def lies_still(run: March, course: Course, dt: float) -> bool:
    """Whether nothing but an engine's noise moves a block on both its lower corners."""
    if not (run.closed[0] and run.closed[1]):
        return False
    motion = run.states[0].motion
    noise = STILL * course.gravity * dt
    return abs(motion.vx) < noise and abs(motion.vy) < noise and abs(motion.w) < noise


@inner_kernel
def settles(state: np.record, course: Course) -> bool:
    """Whether both lower corners are on the floor, or so near and slow that they return at once."""
    motion = state.motion
    cos, sin = math.cos(motion.theta), math.sin(motion.theta)
    for i in range(FLOOR):
        corner = course.corners[i]
        arm, gap, rate = contact_state(corner, motion, cos, sin)
        back = -course.settling * gap_acceleration(corner, state, arm)
        if gap > SETTLING_GAP or not abs(rate) <= max(SETTLING_GAP, back):
            return False
    return True
