"""The state of a run: one named record, made once and passed as one argument.

Compiled code reads a field of a record at the cost of an array's element. Natural units: lengths in
R, accelerations in g, time in sqrt(R/g), unit mass.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.core import names
from rockcheck.ebm.core.block import SETTING
from rockcheck.ebm.core.contact_impacts import IMPACT
from rockcheck.ebm.core.ground import FORM, Ground
from rockcheck.ebm.core.names import Ending, Event, Family, Guard, HistoryMode, Pivot, Row
from rockcheck.ebm.core.series import WIDTH
from rockcheck.ebm.core.settle import SETTLE
from rockcheck.scenes import Floats
from rockcheck.scenes.compiled import inner_kernel, kernel
from rockcheck.scenes.named_record import MOTION, filled, record

#: How many modes there are.
MODES = 128


MODE = record(
    # A Family.
    family="i8",
    # The sign of theta; at phi = 0, the sign that it is about to take. Where flat: 1.
    sense="i8",
    # A Pivot, and the direction in which it slips (frame; world where flat).
    pivot="i8",
    slip="i8",
    # The sign assumed for the normal force P, which gives friction its sense; -1 only with the
    # bilateral pivot.
    pull="i8",
    # Whether the corner rests on the wall it tips to, or on the other one. Where flat: whether the
    # side rests on the left wall, on the right wall; on the floor a block at rest is then held on
    # that side, whatever the base does.
    tip="i8",
    far="i8",
)
#: What a run is asked for.
CONTROL = record(
    # Of a Taylor step, in alpha.
    tolerance="f8",
    most_steps="i8",
    most_events="i8",
    # Stop as soon as the outcome and the peak are decided.
    until_decided="?",
    # Spacing of the rows of the history; with no rows nothing is sampled.
    output_step="f8",
    # What is kept, a Keep; a run until it is decided then goes on until none of it can change.
    keeps="i8",
)
#: The extremes of a run, in pairs of the left and the right side (see ebm.core.extremes).
EXTREMES = record(
    # Largest rotation to each side, and when.
    turned=("f8", (2,)),
    turned_at=("f8", (2,)),
    # Largest |slip|, and the slip at the end; the largest height of the lower corner.
    slip="f8",
    last_slip="f8",
    hop="f8",
    # How far outward the top corners are at first; how far outward, and inward, they get, and how
    # far outward the bottom ones.
    start=("f8", (2,)),
    tops=("f8", (2, 2)),
    bottoms=("f8", (2,)),
    # Of each wall: strikes, when the first one was, largest speed of approach and impulse; the
    # speed of the impact that is resolved.
    strikes=("i8", (2,)),
    first=("f8", (2,)),
    speed=("f8", (2,)),
    impulse=("f8", (2,)),
    approach=("f8", (2,)),
    # When it first uplifts and first slips; whether the last step left it upright.
    uplift="f8",
    slips="f8",
    upright="?",
)
STATE = record(
    control=CONTROL,
    # Of the mass's centre, which stands at x = 0 at first; world frame.
    motion=MOTION,
    mode=MODE,
    # Why the run has ended, an Ending.
    ending="i8",
    # Clock: now, and when the run ends; from when the base is quiet; how long the last steps were.
    t="f8",
    t_end="f8",
    quiet_from="f8",
    stride="f8",
    # What the series are asked for, in rad: the tolerance, and how large the last term may be so
    # that the terms left out stay below it.
    tolerance_rad="f8",
    last_term_rad="f8",
    # The step: the order of its series, the place of a sticking pivot, how far the series are good;
    # where it ends, and the Guard that ends it; whether that is where the base motion has a kink,
    # or the run its end, and when that is.
    order="i8",
    place="f8",
    length="f8",
    tau="f8",
    guard="i8",
    whole="?",
    smooth_until="f8",
    # Largest |theta|, and largest |omega| since the last event.
    peak="f8",
    swing="f8",
    # The last swing on a quiet base: its energy and pivot, and whether it was as the one before.
    swing_energy="f8",
    swing_place="f8",
    repeats="?",
    # Whether an event has ended the mode: which one, the mode's code, and whether `mode` is already
    # the one that follows.
    changing="?",
    event="i8",
    before="i8",
    known="?",
    # Selections at one instant: the mode's slack (in units of noise), the least slack of the next
    # mode that does not fit; when the instant began, when the mode was selected; which mode a force
    # has just ended (its code, or -1); which modes were tried.
    slack="f8",
    least_slack="f8",
    since="f8",
    began="f8",
    ended="i8",
    tried=("i1", (MODES,)),
    # Impacts that accumulate (see ebm.core.settle): the settling speed, when the count began, the
    # last impact; the count, how often it was full, how many at one instant.
    settling_speed="f8",
    counted_since="f8",
    last_impact="f8",
    counted="i8",
    full="i8",
    at_once="i8",
    # Normal impulse of an impact, of all contacts together, until its event is noted.
    impulse="f8",
    # Of the last impact, that of the left and of the right wall.
    wall_impulse=("f8", (2,)),
    # Bouc-Wen friction: its variable z, and whether that winds, the pivot not having yielded.
    zeta="f8",
    winds="?",
    # Counts: steps, events, rows written; impacts that added energy, and the largest
    # gain; the modelling choices, a Rule each.
    steps="i8",
    events="i8",
    rows="i8",
    gains="i8",
    largest_gain="f8",
    rules=("i8", (names.RULES,)),
    # Scratch: a motion between the ends of a step, and the impact that is resolved.
    sampled=MOTION,
    impact=IMPACT,
    extremes=EXTREMES,
)

#: The state before a run: of what is not named there is none.
NEW_STATE = np.array(
    [
        filled(
            STATE,
            ending=Ending.GOING,
            stride=np.inf,
            guard=Guard.NONE,
            changing=True,
            event=Event.UNTOLD,
            swing_energy=np.nan,
            swing_place=np.nan,
            slack=1.0,
            least_slack=1.0,
            ended=-1,
            settling_speed=SETTLE,
            counted_since=-1.0,
            last_impact=-1.0,
            zeta=np.nan,
        )
    ]
)

#: What each of many runs begins with: block, floor and walls, the base motion, the motion; and how
#: long it lasts, if not until it is decided, and how far apart its output rows are.
GIVEN = record(
    setting=SETTING,
    horizontal=FORM,
    vertical=FORM,
    motion=MOTION,
    duration="f8",
    output_step="f8",
)
#: What is kept of each of many runs: where and when it ended, its largest |theta|, why it ended (an
#: Ending), what becomes of the block (a Fate), counts of its steps and of the rows written, and
#: whether it then stood at rest.
FOUND = record(
    motion=MOTION,
    t="f8",
    peak="f8",
    ending="i8",
    fate="i8",
    steps="i8",
    rows="i8",
    at_rest="?",
)


class Base(NamedTuple):
    """The motion of the base, sideways and upward."""

    horizontal: Ground
    vertical: Ground


class Rows(NamedTuple):
    """The input of runs: a GIVEN each, and the samples of all base motions."""

    given: NDArray[np.void]
    samples: Floats


class Records(NamedTuple):
    """Where a run writes: rows of states, their modes, the log of events.

    Arrays of these where there are several runs. `extremes` has an EXTREMES for each of them where
    they are kept.
    """

    out: Floats
    out_mode: NDArray[np.int8]
    log: Floats
    extremes: NDArray[np.void]


class Run(NamedTuple):
    """A run: its state, the series `a` of its step, the root search's `stack`, and its records."""

    state: np.record
    a: Floats
    stack: Floats
    records: Records


@kernel
def workspace():
    """Scratch for one trajectory: the series and the stack of the root search.

    The series of G is 1: no vertical motion.
    """
    series = np.zeros((names.ROWS, WIDTH))
    series[Row.G, 0] = series[Row.ANGLE, 2] = 1.0
    return series, np.zeros((48, WIDTH))


@inner_kernel
def rock_on(state, sense):
    """After an impact the block is known to rock, free of walls, about the pivot on this side."""
    mode, state.known = state.mode, True
    mode.family, mode.sense, mode.pivot, mode.slip = Family.TILT, sense, Pivot.STICK, 0
    mode.pull, mode.tip, mode.far = 1, 0, 0


@inner_kernel
def on_wall(mode):
    """Whether a wall takes part."""
    return mode.tip != 0 or mode.far != 0


@inner_kernel
def rocks(mode):
    """Whether the block rocks, free of walls: ROCK."""
    return mode.family == Family.TILT and mode.pivot == Pivot.STICK and not on_wall(mode)


@inner_kernel
def rests(mode):
    """Whether the block stands at rest on its base."""
    return mode.family == Family.FLAT and mode.pivot == Pivot.STICK


@inner_kernel
def stands_still(mode):
    """Whether nothing moves while this mode lasts: the block rests, or leans on a wall."""
    return mode.pivot == Pivot.STICK and (mode.family == Family.FLAT or on_wall(mode))


@inner_kernel
def code_of(mode):
    """A number for the mode, below MODES."""
    floor = 3 if mode.pivot == Pivot.OFF else mode.slip + 1
    tilts = mode.family * 2 + (mode.sense > 0)
    return ((tilts * 4 + floor) * 2 + (mode.pull > 0)) * 4 + mode.tip + 2 * mode.far


@inner_kernel
def mode_code(state):
    """The mode as a history shows it, a HistoryMode."""
    mode = state.mode
    if mode.pivot == Pivot.OFF:
        return HistoryMode.FLIGHT
    if mode.family == Family.FLAT:
        return HistoryMode.REST if mode.pivot == Pivot.STICK else HistoryMode.SLIDE
    first = HistoryMode.LEAN if on_wall(mode) else HistoryMode.ROCK
    return first + (mode.pivot != Pivot.STICK and not state.winds)


@inner_kernel
def note(run, event, before):
    """One row of the log."""
    state, log = run.state, run.records.log
    count = state.events
    state.events = count + 1
    if count < log.shape[0]:
        log[count, 0], log[count, 1], log[count, 2] = state.t, event, before
        log[count, 3] = 0 if event == Event.SETTLED else mode_code(state)
        log[count, 4] = state.impulse
