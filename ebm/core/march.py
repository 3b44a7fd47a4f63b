"""The event loop: expand, locate, sample, advance, resolve, select, until the end. Natural units.

docs/theory.md, "How an event is handled", goes with this file. What depends on friction stands
behind four doors of the module `friction`, ebm.core.coulomb or ebm.core.bouc_wen: `expand`,
`locate`, `advance` and `after_event`.
"""

import math

import numpy as np

from rockcheck.ebm.core import bouc_wen, coulomb, extremes, ground, modes, series, settle, steps
from rockcheck.ebm.core.contacts import closed_floor, lean
from rockcheck.ebm.core.decide import fate_of, given_up_at, quiet_from
from rockcheck.ebm.core.guards import KIND
from rockcheck.ebm.core.names import Ending, Event, Guard, Keep, Row
from rockcheck.ebm.core.state import NEW_STATE, Base, Records, Run, mode_code, rests
from rockcheck.ebm.core.strike import strike
from rockcheck.scenes.compiled import inner_kernel, kernel


@inner_kernel
def march(friction, block, base, run):
    """Simulates from the state's motion at t = 0 to its t_end, in the state."""
    state = run.state
    begin(block, base, run)
    while state.ending == Ending.GOING:
        if state.changing:
            state.changing = False
            friction.after_event(block, base, run)
        elif steps.waits(base, state):
            steps.rest(block, base, run)
        elif steps.may_go_on(block, base, run):
            step(friction, block, base, run)
    end(block, run)


@inner_kernel
def step(friction, block, base, run):
    """One Taylor step, and the event that ends it."""
    state = run.state
    smooth = min(ground.smooth_until(base, state.t), state.t_end)
    friction.expand(block, base, run, smooth - state.t)
    state.smooth_until = smooth  # not before: what is known of the base would be read again
    state.tau = math.nan
    if state.length > 0.0:  # no step is good for a series that is not finite
        friction.locate(block, run)
    if not math.isfinite(state.tau):
        state.ending = Ending.NOT_FINITE
        return
    steps.sample(block, run)
    steps.advance(block, base, run)
    friction.advance(run)
    if not steps.passes_on(block, base, run):
        resolve(block, base, run)


@inner_kernel
def play_rows(friction, rows, states, begins, work, records, found):
    """Plays the rows of `play` one after the other in the state, and notes what is kept of each.

    `friction` is the module with its doors, `begins` a copy of NEW_STATE.
    """
    state = states[0]
    begins[0].control = state.control
    for i in range(len(rows.given)):
        given, samples = rows.given[i], rows.samples
        states[0] = begins[0]
        state.motion, state.control.output_step = given.motion, given.output_step
        state.t_end, sideways, upward = given.duration, given.horizontal, given.vertical
        base = Base(
            ground.Ground(sideways, samples[sideways.first : sideways.first + sideways.count]),
            ground.Ground(upward, samples[upward.first : upward.first + upward.count]),
        )
        written = Records(records.out[i], records.out_mode[i], records.log[i], records.extremes)
        march(friction, given.setting, base, Run(state, work[0], work[1], written))
        kept = found[i]
        kept.motion, kept.t, kept.peak = state.motion, state.t, state.peak
        kept.ending, kept.steps, kept.rows = state.ending, state.steps, state.rows
        kept.fate = fate_of(given.setting, state)
        if state.control.keeps != Keep.NOTHING:
            records.extremes[i] = state.extremes
        kept.at_rest = rests(state.mode)


@inner_kernel
def begin(block, base, run):
    """Prepares the first mode at t = 0, in a state that is new but for its motion and control."""
    state, motion, control = run.state, run.state.motion, run.state.control
    state.peak = abs(motion.theta)
    # All that a block does before it topples happens within alpha. Terms fall like the powers of a
    # ratio. If the last one is the tolerance, and the first one is 1, that ratio is known, and what
    # is left out is a geometric series. It may be half of the tolerance.
    ratio = control.tolerance ** (1.0 / series.ORDER)
    state.tolerance_rad = control.tolerance * min(block.left.alpha, block.right.alpha)
    state.last_term_rad = 0.5 * state.tolerance_rad * (1.0 - ratio) / ratio
    state.quiet_from = quiet_from(base, state.tolerance_rad)
    if control.until_decided:
        state.t_end = given_up_at(block, state.quiet_from)
    run.a[Row.G, :] = 0.0  # the series of 1 + vertical acceleration: of a still base it stays so
    run.a[Row.G, 0] = 1.0
    if control.keeps == Keep.EXTREMES:
        extremes.begin(block, state)
    stands = lean(motion) == 0.0 and motion.vx == 0.0 and motion.vy == 0.0
    if stands and closed_floor(block, motion):
        state.event = Event.RELEASE


@inner_kernel
def resolve(block, base, run):
    """An event: the impact at a gap that has closed. The mode then changes."""
    state = run.state
    state.before, state.known, state.changing = mode_code(state), False, True
    state.event = Event.UNTOLD
    modes.mark_mode_ended(state, KIND[state.guard])
    if state.guard <= Guard.FAR_GAP:
        strike(block, base, run, settle.settling_speed(state))
        if state.impulse > 0.0:
            modes.reset_tried_modes(state)  # a new motion: all modes may be tried again
        elif block.unilateral:
            state.event = Event.UNTOLD  # a block in flight passes theta = 0


@inner_kernel
def end(block, run):
    """Checks that the motion is finite, and writes the rows after the last step."""
    state = run.state
    if state.ending == Ending.DONE and not math.isfinite(state.motion.theta):
        state.ending = Ending.NOT_FINITE
    if state.ending == Ending.DONE and not run.state.control.until_decided:
        steps.sample_rest(run, np.inf)
    if state.control.keeps == Keep.EXTREMES:
        extremes.meet(block, state, state.motion, state.t)


@kernel
def play(rows, states, work, records, found):
    """Plays runs one after the other, with Coulomb's friction.

    `states` is an array of one STATE with its control, `work` a `workspace()`; `found[i]`, a FOUND,
    is what is kept of row i. Of row i `records.out[i]` (n x 6) has the motion at k * output_step,
    `out_mode[i]` its modes; `log[i]` (m x 5) takes one row an event: time, kind, mode before, mode
    after, impulse. `records.extremes[i]` are its extremes, where the control asks for any.
    """
    play_rows(coulomb, rows, states, NEW_STATE.copy(), work, records, found)


@kernel
def play_bouc_wen(rows, states, work, records, found):
    """As `play`, with Bouc-Wen friction."""
    play_rows(bouc_wen, rows, states, NEW_STATE.copy(), work, records, found)


#: The event loop with each friction of a model's settings.
LOOPS = {"coulomb": play, "no-slip": play, "bouc-wen": play_bouc_wen}
