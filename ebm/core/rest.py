"""Rest is not stepped through."""

import math

import numpy as np

from rockcheck.ebm.core.ground import next_exceedance
from rockcheck.ebm.core.modes import leave
from rockcheck.ebm.core.names import Ending, Event, Guard, Kind, Shape
from rockcheck.ebm.core.series import AHEAD, NOISE
from rockcheck.ebm.core.state import mode_code, rests
from rockcheck.scenes.compiled import inner_kernel


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
    if math.isnan(state.t_rest):
        state.t_rest = state.t
    # Of an acceleration, for all guards of rest to see it.
    noise = 2.0 * state.slack * NOISE[Kind.FORCE] / block.height
    low, high = -np.inf if mode.far != 0 else -to_right, np.inf if mode.tip != 0 else to_left
    until = next_exceedance(base.horizontal, state.t, low, high, noise, 0.5 * AHEAD)
    sample_rest(run, min(until, state.t_end))
    if until >= state.t_end:
        state.t = state.t_end if not control.until_decided else state.t
        state.ending = Ending.DONE
        return
    state.t, state.stride = until, np.inf
    leave(state, Kind.FORCE)
    state.guard, state.event = Guard.NONE, Event.LEAVES_REST
    state.before, state.changing = 0, True


@inner_kernel
def sample_rest(run, until):
    """Writes the rows of a block at rest, up to a time."""
    state, records = run.state, run.records
    code = mode_code(state)
    while state.rows < records.out.shape[0] and state.rows * run.state.control.output_step <= until:
        write(records, state.rows, state.motion, code)
        state.rows += 1


@inner_kernel
def write(records, row, motion, code):
    """Writes one row of the history."""
    out = records.out
    out[row, 0], out[row, 1], out[row, 2] = motion.x, motion.y, motion.theta
    out[row, 3], out[row, 4], out[row, 5] = motion.vx, motion.vy, motion.w
    records.out_mode[row] = code
