"""What a run is asked for, what it keeps from step to step, what it reports; the codes of modes and
events."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.core.motion import FAMILY, FAR, FLAT, FLOOR, OFF, STICK, TIP
from rockcheck.scenes.compiled import inner_kernel

#: Names of the mode codes that `mode_code` gives, and of the event codes.
MODE_NAMES = ("rest", "slide", "rock", "slide-rock", "lean", "ladder", "flight")
EVENT_NAMES = (
    "uplift",
    "slip",
    "stick",
    "floor impact",
    "wall impact",
    "lift-off",
    "landing",
    "release",
    "settled",
    "overturned left",
    "overturned right",
)
(
    UPLIFT,
    SLIPS,
    STICKS,
    FLOOR_IMPACT,
    WALL_IMPACT,
    LIFT_OFF,
    LANDS,
    RELEASE,
    SETTLED,
    LEFT,
    RIGHT,
) = range(11)
#: Not in the log; the end of rest, whose event depends on the next mode.
NO_EVENT, LEAVES_REST = -1, -2

# How a run ended; while it has not: GOING in its mode, or CHANGING it.
(
    DONE,
    OVERTURNED,
    TOO_MANY_STEPS,
    TOO_MANY_EVENTS,
    NO_MODE,
    NO_IMPACT,
    NOT_FINITE,
    GOING,
    CHANGING,
) = range(9)
FAILURES = {
    TOO_MANY_STEPS: "the cap on steps was reached",
    TOO_MANY_EVENTS: "the cap on events was reached",
    NO_MODE: "no mode of motion is consistent",
    NO_IMPACT: "no impact is consistent",
    NOT_FINITE: "the motion is not finite",
}


class Control(NamedTuple):
    """What a run is asked for."""

    #: Of a Taylor step, in alpha; inside the loop in rad.
    tolerance: float
    most_steps: int
    most_events: int
    #: Stop as soon as the outcome and the peak are decided.
    until_decided: bool
    #: Spacing of the rows of `out`; with no rows nothing is sampled.
    output_step: float
    #: Inside the loop: how large the last term of a step's series may be, in rad, so that the terms
    #: left out stay below the tolerance.
    last_term: float = 0.0


class Tally(NamedTuple):
    """What a run reports besides its samples and the modelling choices that it made."""

    ending: int
    t: float
    peak: float
    at_rest: bool
    steps: int
    events: int
    wall_impacts: int
    gains: int
    largest_gain: float
    rows: int
    t_rest: float


class Run(NamedTuple):
    """What a run keeps from step to step: state, mode, clock and counts, and what its parts
    remember."""

    z: NDArray[np.float64]
    m: NDArray[np.int64]
    now: NDArray[np.float64]
    counts: NDArray[np.int64]
    rules: NDArray[np.int64]
    tried: NDArray[np.bool_]
    memory: NDArray[np.float64]
    rattle: NDArray[np.float64]
    gains: NDArray[np.float64]
    impulse: NDArray[np.float64]
    row: NDArray[np.float64]


class Records(NamedTuple):
    """Where a run writes: rows of states, their modes, the log of events."""

    out: NDArray[np.float64]
    out_mode: NDArray[np.int8]
    log: NDArray[np.float64]


class Scratch(NamedTuple):
    """What a run works in, and the next one again: series, roots, and what it keeps besides its
    state (numbers, integers, modes tried)."""

    a: NDArray[np.float64]
    stack: NDArray[np.float64]
    reals: NDArray[np.float64]
    whole: NDArray[np.int64]
    tried: NDArray[np.bool_]


# The clock: time, largest |theta|, largest |omega| since the last event, since when it rests, from
# when the base is quiet; the variable z of Bouc-Wen friction; energy and pivot of the last swing on
# a quiet base, and whether it was as the one before it; how long the last steps were.
T, PEAK, SWING, T_REST, QUIET, ZETA, SWUNG, PIVOT, REPEATS, STRIDE = range(10)
# The counts; with Bouc-Wen friction, whether the pivot has not yielded; the event
# that has ended a mode, and that mode's code.
STEPS, EVENTS, WALL_IMPACTS, ROWS, HOLDS, KIND, BEFORE = range(7)


@inner_kernel
def mode_code(r):
    """The mode's index in MODE_NAMES."""
    m = r.m
    if m[FLOOR] == OFF:
        return 6
    if m[FAMILY] == FLAT:
        return 0 if m[FLOOR] == STICK else 1
    wall = m[TIP] != 0 or m[FAR] != 0
    if m[FLOOR] == STICK or r.counts[HOLDS] != 0:
        return 4 if wall else 2
    return 5 if wall else 3


@inner_kernel
def note(r, log, kind, before):
    """One row of the log; a change at rest has no impulse."""
    count = r.counts[EVENTS]
    r.counts[EVENTS] = count + 1
    if count < log.shape[0]:
        strikes = kind == FLOOR_IMPACT or kind == WALL_IMPACT or kind == LANDS
        log[count, 0], log[count, 1], log[count, 2] = r.now[T], kind, before
        log[count, 3] = 0 if kind == SETTLED else mode_code(r)
        log[count, 4] = r.impulse[0] + r.impulse[1] if strikes else 0.0
