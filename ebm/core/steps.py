"""A step of a moving block: whether there is one, its rows, its end, and what ends no mode.

Rest is not stepped through: `rest` goes straight to its end.
"""

import math

import numpy as np

from rockcheck.ebm.core import extremes
from rockcheck.ebm.core.contacts import CLOSED
from rockcheck.ebm.core.decide import (
    all_is_met,
    decided,
    energy_of,
    slides_for_good,
    swing_error,
    swings_again,
)
from rockcheck.ebm.core.ground import next_exceedance
from rockcheck.ebm.core.modes import mark_mode_ended
from rockcheck.ebm.core.motion import motion_at
from rockcheck.ebm.core.names import (
    Ending,
    Event,
    Family,
    Guard,
    Keep,
    Kind,
    Pivot,
    Row,
    Rule,
    Shape,
)
from rockcheck.ebm.core.series import AHEAD, INSTANT, NOISE, highest, may_top, slope, value
from rockcheck.ebm.core.state import mode_code, note, on_wall, rests, stands_still
from rockcheck.scenes.compiled import inner_kernel

#: Of a longer step before, this share counts after each further one.
_FADES = 0.25


@inner_kernel
def may_go_on(block, base, run):
    """Whether the run goes on; else writes why it ends here.

    Its time is up, its outcome is certain, or it has taken too many steps.
    """
    state, decides = run.state, run.state.control.until_decided
    if decides:
        _decide(block, base, state)
    elif state.t >= state.t_end:
        state.ending = Ending.DONE
    if state.ending != Ending.GOING:
        return False
    if state.steps >= run.state.control.most_steps:
        state.ending = Ending.TOO_MANY_STEPS
    else:
        state.steps += 1
    return state.ending == Ending.GOING


@inner_kernel
def _decide(block, base, state):
    """Ends a run whose outcome, peak, and all that it keeps beside them are certain.

    One that nothing decides is given up in time.
    """
    watches, late = state.control.keeps != Keep.NOTHING, state.t >= state.t_end
    # What the base has held against a wall until now may be released.
    held = INSTANT if on_wall(state.mode) else 0.0
    quiet = state.t >= state.quiet_from + held
    settled = quiet and (stands_still(state.mode) or slides_for_good(block, state))
    if state.repeats or settled or (watches and all_is_met(block, state)):
        state.ending = Ending.DONE
        return
    verdict = decided(block, base, state) if late or not watches else -1.0
    if verdict > 0.0:
        state.peak = verdict
        state.ending = Ending.DONE
        if verdict >= 0.5 * math.pi:
            state.motion.theta = math.copysign(verdict, float(state.mode.sense))
            state.ending = Ending.OVERTURNED
    elif late:
        state.ending = Ending.GIVEN_UP


@inner_kernel
def sample(block, run):
    """Writes the rows of this step."""
    state, t, step = run.state, run.state.t, run.state.control.output_step
    state.whole = state.guard == Guard.NONE and state.tau >= state.smooth_until - t
    until = state.smooth_until if state.whole else t + state.tau
    while state.rows < run.records.out.shape[0] and state.rows * step < until:
        motion_at(block, state, run.a, state.rows * step - t, state.sampled)
        write(run, state.sampled)


@inner_kernel
def advance(block, base, run):
    """Moves the state to the end of the step; keeps the largest rotation on the way."""
    state, mode, motion, a = run.state, run.state.mode, run.state.motion, run.a
    order, tau, t = state.order, state.tau, state.t
    motion_at(block, state, run.a, tau, motion)
    tilts = mode.family == Family.TILT
    # One that rises at the end may have turned twice.
    if tilts and may_top(a, Row.PHI, Row.OMEGA, order, tau, state.peak):
        top, _ = highest(a, Row.PHI, Row.OMEGA, Row.GUARD, order, tau, run.stack)
        state.peak = max(state.peak, top)
    falls = tilts and mode.sense * motion.w < 0.0
    if falls and a[Row.OMEGA, 0] >= 0.0 and run.state.control.until_decided:
        state.repeats = swings_again(state, energy_of(block, motion))
    state.peak = max(state.peak, abs(motion.theta))
    state.swing = max(state.swing, abs(motion.w))
    state.stride = max(tau, INSTANT, _FADES * min(state.stride, state.length))
    state.t = state.smooth_until if state.whole else t + tau
    if state.control.keeps == Keep.EXTREMES:
        extremes.follow(block, run, t)


@inner_kernel
def passes_on(block, base, run):
    """Whether no event has ended the mode: the block only grazes the floor, or the run is over."""
    state, motion = run.state, run.state.motion
    lands = state.guard == Guard.PHI and not block.unilateral
    if state.guard == Guard.NONE or (lands and _grazes(block, base, run)):
        return True
    state.swing = 0.0
    if state.events + 1 >= run.state.control.most_events:
        state.ending = Ending.TOO_MANY_EVENTS
    elif state.guard == Guard.TOPPLE or lies_along_wall(state):
        motion.theta = math.copysign(0.5 * math.pi, motion.theta)
        state.peak = 0.5 * math.pi
        side = Event.FELL_LEFT if state.mode.sense > 0 else Event.FELL_RIGHT
        note(run, side, mode_code(state))
        state.ending = Ending.OVERTURNED
    return state.ending != Ending.GOING


@inner_kernel
def _grazes(block, base, run):
    """Whether a hanging block that comes down with less energy than a swing errs by does not land.

    It is then put where it turns back.

    A block at rest whose floor falls away swings back to just where it started. That cannot be told
    from a touch.
    """
    state, mode, motion, a = run.state, run.state.mode, run.state.motion, run.a
    order, tau = state.order, state.tau
    if (
        base.vertical.form.kind == Shape.STILL
        or on_wall(mode)
        or value(a, Row.G, order, tau) >= 0.0
    ):
        return False
    back = slope(a, Row.OMEGA, order - 1, tau)
    past = 2.0 * abs(motion.w) / back
    # A wall's strike moves the block onto the wall: its time is known to an instant.
    struck = INSTANT * back if block.walls else 0.0
    energy = (swing_error(state.tolerance_rad) + struck) * state.swing
    little = 0.5 * motion.w * motion.w < energy * min(1.0, 10.0 * back)
    if not (little and 0.0 < past <= state.length - tau):
        return False
    state.rules[Rule.GRAZES] += 1
    state.t += past
    motion_at(block, state, run.a, tau + past, motion)
    lifted = max(abs(motion.theta), 2.0 * NOISE[Kind.POSITION])
    motion.theta = math.copysign(lifted, float(mode.sense))
    return True


@inner_kernel
def lies_along_wall(state):
    """Whether a block that turns over about a standing pivot meets the wall as it comes to lie.

    Its gap goes with the square of the angle that is left.
    """
    mode, motion = state.mode, state.motion
    left = math.cos(motion.theta)
    stands = mode.family == Family.TILT and mode.pivot == Pivot.STICK
    down = left * left < CLOSED and mode.sense * motion.w > 0.0
    lies = state.guard == Guard.TIP_GAP and stands and down
    state.rules[Rule.LANDS_ALONG] += lies
    return lies


@inner_kernel
def waits(base, state):
    """Whether the block rests on a base that only moves sideways."""
    return rests(state.mode) and base.vertical.form.kind == Shape.STILL


@inner_kernel
def rest(block, base, run):
    """Moves the run straight to the next uplift or slip."""
    state, mode, control = run.state, run.state.mode, run.state.control
    to_left, to_right = block.left.arm / block.height, block.right.arm / block.height
    if not block.no_slip:
        to_left, to_right = min(to_left, block.mu_s), min(to_right, block.mu_s)
    # Of an acceleration, for all guards of rest to see it.
    noise = 2.0 * state.slack * NOISE[Kind.FORCE] / block.height
    low, high = -np.inf if mode.far != 0 else -to_right, np.inf if mode.tip != 0 else to_left
    until = next_exceedance(base.horizontal, state.t, low, high, noise, 0.5 * AHEAD)
    sample_rest(run, min(until, state.t_end))
    if until >= state.t_end:
        state.t = state.t_end if not control.until_decided else state.t
        state.ending = Ending.DONE
        return
    state.t, state.stride, state.extremes.upright = until, np.inf, True
    mark_mode_ended(state, Kind.FORCE)
    state.guard, state.event = Guard.NONE, Event.RELEASE
    state.before, state.changing = 0, True


@inner_kernel
def sample_rest(run, until):
    """Writes the rows of a block at rest, up to a time."""
    state, step = run.state, run.state.control.output_step
    while state.rows < run.records.out.shape[0] and state.rows * step <= until:
        write(run, state.motion)


@inner_kernel
def write(run, motion):
    """Writes the next row of the history."""
    row, out = run.state.rows, run.records.out
    out[row, 0], out[row, 1], out[row, 2] = motion.x, motion.y, motion.theta
    out[row, 3], out[row, 4], out[row, 5] = motion.vx, motion.vy, motion.w
    run.records.out_mode[row] = mode_code(run.state)
    run.state.rows = row + 1
