"""The time loop: position Verlet in steps that know events.

In: the constants and the state of a run, the base's motion, and output times (s).
Out: rows of motion at these times (m, rad, s), strikes, how the stretch ended; the state moves on.
Called by `cm.model`, a stretch of the run at a time.

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

import numpy as np

from rockcheck.cm.base_motion import Base, mean_acceleration
from rockcheck.cm.extremes import note_mode, note_place
from rockcheck.cm.friction import move_spring
from rockcheck.cm.geometry import Step, corners_at
from rockcheck.cm.grid import GRID
from rockcheck.cm.impacts import YOUNG, record_strikes
from rockcheck.cm.state import Parameters, Strikes
from rockcheck.cm.surface_forces import apply_surfaces
from rockcheck.scenes import Floats, interpolation
from rockcheck.scenes.compiled import inner_kernel, kernel

#: Shortest step, as a share of the contact time; it bounds the number of steps.
SHORTEST = 1e-3
#: A run whose energy exceeds the work done on it by this share has blown up.
ENERGY = 0.02
#: How a stretch of motion ended.
DONE, OVERTURNED, BLOWN_UP = 0, 1, 2

hermite = inner_kernel(interpolation.hermite)


@inner_kernel
def step_length(state: np.record, parameters: Parameters, stop: float, settled: bool) -> float:
    """How long the next step is, s; it does not pass `stop`, nor end just before it."""
    shortest = SHORTEST * (1.0 / math.sqrt(parameters.stiffness))
    longest = parameters.time_step if settled else state.contact_step
    length = max(min(longest, state.closing_time), shortest)
    if state.t + length > stop - shortest:
        return stop - state.t
    return length


@inner_kernel
def remember_start(state: np.record) -> None:
    """Keeps the motion at the start of a step."""
    motion = state.motion
    past = state.past_motion
    state.past_t = state.t
    past.x = motion.x
    past.y = motion.y
    past.theta = motion.theta
    past.vx = motion.vx
    past.vy = motion.vy
    past.w = motion.w


@inner_kernel
def take_step(
    parameters: Parameters, base: Base, end: float, state: np.record, strikes: Strikes, count: int
) -> int:
    """Moves the state on by one step, to `end` (s) at most; returns the count of strikes."""
    motion = state.motion
    t = state.t
    settled = t >= state.settle_time
    stop = min(state.grid * GRID, end)
    length = step_length(state, parameters, stop, settled)
    half = 0.5 * length
    middle = t + half
    u = mean_acceleration(base.horizontal, t, length)
    vg = mean_acceleration(base.vertical, t, length)
    remember_start(state)
    # Half a step of motion, then the forces.
    v0 = motion.vx, motion.vy, motion.w
    x = motion.x + half * v0[0]
    y = motion.y + half * v0[1]
    theta = motion.theta + half * v0[2]
    corners = corners_at(parameters.reach, theta)
    note_place(state.extremes, x, y, theta, middle, corners)
    step = Step(x, y, corners, v0, length, middle)
    v = v0[0] - length * u, v0[1] - length * (parameters.gravity + vg), v0[2]
    v, state.closing_time, contact_step = apply_surfaces(state, parameters, step, v, settled)
    slip_rate = move_spring(state, parameters, step, v)
    note_mode(state.extremes, theta, v[2], slip_rate, middle, parameters.flat_angle)
    if length == stop - t:
        t = stop
        state.grid += 1
    else:
        t += length
    if contact_step < math.inf:
        state.contact_step = contact_step if settled else min(contact_step, state.contact_step)
        state.settle_time = middle + YOUNG * (1.0 / math.sqrt(parameters.stiffness))
    if min(state.first_strike, contact_step) < math.inf:
        count = record_strikes(state, length, t - parameters.strike, strikes, count)
    work = -half * (u * (v0[0] + v[0]) + vg * (v0[1] + v[1]))
    state.allowed_energy += work
    state.absolute_work += abs(work)
    # The other half of the motion.
    state.t = t
    motion.x = x + half * v[0]
    motion.y = y + half * v[1]
    motion.theta = theta + half * v[2]
    motion.vx, motion.vy, motion.w = v
    state.steps += 1
    return count


@inner_kernel
def is_blown_up(state: np.record, parameters: Parameters) -> bool:
    """Whether the block has more energy than the work done on it allows."""
    motion = state.motion
    kinetic = motion.vx**2 + motion.vy**2 + motion.w**2 / parameters.inverse_inertia
    energy = 0.5 * kinetic + parameters.gravity * (motion.y - parameters.reach[2])
    limit = state.allowed_energy + ENERGY * state.absolute_work
    return not (energy <= limit and energy < 1e300)


@inner_kernel
def write_row(state: np.record, t: float, row: Floats) -> None:
    """The motion at a time within the last step: places by the cubic, rates in between."""
    motion = state.motion
    past = state.past_motion
    if t == state.t:
        row[0], row[1], row[2] = motion.x, motion.y, motion.theta
        row[3], row[4], row[5] = motion.vx, motion.vy, motion.w
        return
    length = state.t - state.past_t
    share = (t - state.past_t) / length
    row[0] = hermite(share, past.x, motion.x, length * past.vx, length * motion.vx)
    row[1] = hermite(share, past.y, motion.y, length * past.vy, length * motion.vy)
    row[2] = hermite(share, past.theta, motion.theta, length * past.w, length * motion.w)
    row[3] = past.vx + share * (motion.vx - past.vx)
    row[4] = past.vy + share * (motion.vy - past.vy)
    row[5] = past.w + share * (motion.w - past.w)


@kernel
def advance(
    parameters: Parameters,
    base: Base,
    state: np.record,
    strikes: Strikes,
    end: float,
    times: Floats,
    output: Floats,
) -> tuple[int, int, int]:
    """Fills the rows of `output`, at `times`, with the motion that follows the state.

    That is moved along, in steps that know nothing of the rows: they end at multiples of `GRID` and
    at the run's `end`. A row is x, y, theta and their rates. Returns the ending (DONE, OVERTURNED
    or BLOWN_UP), the rows and the strikes written.
    """
    count = row = 0
    ending = DONE
    motion = state.motion
    while row < len(output) and ending == DONE:
        if times[row] > state.t:
            count = take_step(parameters, base, end, state, strikes, count)
            if abs(motion.theta) >= 0.5 * math.pi:
                ending = OVERTURNED
            continue
        if is_blown_up(state, parameters):
            ending = BLOWN_UP
            continue
        write_row(state, times[row], output[row])
        row += 1
    corners = corners_at(parameters.reach, motion.theta)
    note_place(state.extremes, motion.x, motion.y, motion.theta, state.t, corners)
    return ending, row, count
