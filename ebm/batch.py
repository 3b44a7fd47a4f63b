"""Many runs of the event-based model at once, compiled and on all cores: outcomes and peaks, and
their motion where it is asked for.

Scenes are packed into plain arrays, one row a run, so that the loop over them never comes back to
Python. Threads take chunks of rows; the result of a row does not depend on the others, nor on the
number of threads.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import natural
from rockcheck.ebm.core.ground import Ground
from rockcheck.ebm.core.march import march
from rockcheck.ebm.core.motion import Setting, Side
from rockcheck.ebm.core.names import FAILURES, Ending, Shape
from rockcheck.ebm.core.state import STATE, Base, Control, Records, Run, rests, workspace
from rockcheck.ebm.model import EventBasedModel
from rockcheck.scenes.compiled import inner_kernel, kernel
from rockcheck.scenes.errors import InputError, ModelFailure
from rockcheck.scenes.progress import OnProgress, threads, unheard
from rockcheck.scenes.scene import Scene

Floats = NDArray[np.float64]
_CHUNK = 256
#: Rows of settings and grounds, by the names of their fields.
SIDE = np.dtype([(name, np.float64) for name in Side._fields])
SETTING = np.dtype(
    [
        (name, SIDE if kind is Side else np.int64 if kind is int else np.float64)
        for name, kind in get_type_hints(Setting).items()
    ]
)
GROUND = np.dtype(
    [
        (name, np.int64 if kind == "int" else np.float64)
        for name, kind in Ground.__annotations__.items()
        if name != "samples"
    ]
    + [("first", np.int64), ("count", np.int64)]
)


@dataclass(frozen=True, kw_only=True)
class Packed:
    """Runs as arrays, one row each, natural units: settings (`SETTING`) and grounds (`GROUND`),
    initial states, lengths.

    Recorded samples of all rows stand in one `samples` array, where a row's ground has `count` of
    them from `first` on.
    """

    settings: NDArray[np.void]
    horizontal: NDArray[np.void]
    vertical: NDArray[np.void]
    states: Floats
    durations: Floats
    samples: Floats

    def __len__(self) -> int:
        return len(self.durations)

    def rows(self, part: slice, durations: Floats) -> Rows:
        """Some of the rows, for compiled code, with these durations of all rows."""
        some = (
            self.settings[part],
            self.horizontal[part],
            self.vertical[part],
            self.states[part],
            durations[part],
        )
        return Rows(*some, self.samples)


class Rows(NamedTuple):
    """Rows of a `Packed` as compiled code takes them."""

    settings: NDArray[np.void]
    horizontal: NDArray[np.void]
    vertical: NDArray[np.void]
    states: Floats
    durations: Floats
    samples: Floats


class Found(NamedTuple):
    """What compiled code writes, a row a run (see `Outcomes`)."""

    side: NDArray[np.int8]
    peak: Floats
    t_end: Floats
    series: NDArray[np.int64]
    ending: NDArray[np.int64]
    at_rest: NDArray[np.bool_]
    motion: Floats
    modes: NDArray[np.int8]
    written: NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class Outcomes:
    """What a batch found, one value a run.

    `side` is -1 overturned left, +1 overturned right, 0 not overturned; `peak` the largest |theta|
    in rad (pi/2 when overturned; rotations after the outcome is certain are counted too), `t_end`
    the time in sqrt(R/g) at which the run was decided; `series` the number of Taylor expansions.
    """

    side: NDArray[np.int8]
    peak: Floats
    t_end: Floats
    series: NDArray[np.int64]
    #: How each run ended, a key of `ebm.core.names.FAILURES` where it failed; and whether it then
    #: was at rest.
    ending: NDArray[np.int64]
    at_rest: NDArray[np.bool_]
    #: Of each run `written` rows, equally spaced from its start on: x, y, theta and their rates, as
    #: in `Packed.states`.
    motion: Floats
    written: NDArray[np.int64]

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Which runs reached a cap or had no consistent motion."""
        return (self.ending != Ending.DONE) & (self.ending != Ending.OVERTURNED)


def pack(scenes: Sequence[Scene], model: EventBasedModel) -> Packed:
    """Packs a list of scenes; raises `InputError` where the model cannot play one of them."""
    bank: list[Floats] = []
    offset = 0
    horizontal: list[tuple[float, ...]] = []
    vertical: list[tuple[float, ...]] = []
    if model.friction == "bouc-wen":
        raise InputError("a batch has Coulomb's friction or none", "friction")
    for scene in scenes:
        model.check(scene)
        for ground, rows in zip(natural.base_of(scene), (horizontal, vertical), strict=True):
            rows.append((*ground[:-1], offset, len(ground.samples)))
            bank.append(ground.samples)
            offset += len(ground.samples)
    settings = [_setting(scene, model) for scene in scenes]
    return Packed(
        settings=np.array(settings, dtype=SETTING),
        horizontal=np.array(horizontal, dtype=GROUND),
        vertical=np.array(vertical, dtype=GROUND),
        states=np.array([natural.state_of(scene) for scene in scenes]).reshape(len(scenes), 6),
        durations=np.array([scene.duration / natural.time_unit(scene) for scene in scenes]),
        samples=np.concatenate(bank) if bank else np.zeros(1),
    )


def pack_pulses(
    scene: Scene, model: EventBasedModel, amplitudes: Floats, periods: Floats
) -> Packed:
    """Packs one scene under many pulses of its own kind: amplitudes in m/s^2, periods in s, 1-D
    arrays of one length."""
    model.check(scene)
    unit, count = natural.time_unit(scene), len(amplitudes)
    template = type(scene.excitation)
    pulse = scene.excitation.model_copy(update={"amplitude": 1.0, "period": 1.0})
    one = natural.base_of(scene.replace(excitation=template(**pulse.model_dump()))).horizontal
    # A pulse of amplitude a and period T is a times the unit pulse at time t/T.
    ratio = 1.0 / periods
    horizontal = np.repeat(np.array([(*one[:-1], 0, 1)], dtype=GROUND), count)
    for power in range(4):
        horizontal[f"c{power}"] *= amplitudes * (
            ratio**power if one.kind == Shape.GAUSSIAN else 1.0
        )
    horizontal["rate"] *= ratio**2 if one.kind == Shape.GAUSSIAN else ratio
    horizontal["centre"] *= periods
    horizontal["quiet"] *= periods
    still = natural.base_of(scene).vertical
    return Packed(
        settings=np.repeat(np.array([_setting(scene, model)], dtype=SETTING), count),
        horizontal=horizontal,
        vertical=np.repeat(np.array([(*still[:-1], 1, len(still.samples))], dtype=GROUND), count),
        states=np.tile(natural.state_of(scene), (count, 1)),
        durations=np.full(count, scene.duration / unit),
        samples=np.concatenate([np.zeros(1), still.samples]),
    )


def _setting(scene: Scene, model: EventBasedModel) -> Setting:
    return natural.setting_of(
        scene,
        unilateral=model.pivot == "unilateral",
        no_slip=model.friction == "no-slip",
        energy_cap=model.energy_cap,
        impacts=model.impacts,
    )


def run_batch(
    packed: Packed,
    model: EventBasedModel,
    *,
    until_decided: bool = True,
    parts: int = 0,
    strict: bool = True,
    jobs: int | None = None,
    on_progress: OnProgress = unheard,
) -> Outcomes:
    """Runs every row; with `until_decided` to the moment when outcome and peak are certain,
    whatever its duration.

    With `parts` the motion is kept at the ends of so many equal parts of each row's duration, its
    start included; not together with `until_decided`. `jobs` threads (default: all cores).
    `on_progress` is told the rows done. Where a row reaches a cap or has no consistent motion:
    `ModelFailure` if `strict`, else only its `ending` says so.
    """
    count, kept = len(packed), parts + 1 if parts and not until_decided else 0
    side, peak, t_end = np.zeros(count, dtype=np.int8), np.zeros(count), np.zeros(count)
    series, ending, written = (np.zeros(count, dtype=np.int64) for _ in range(3))
    at_rest, motion, modes = (
        np.zeros(count, dtype=bool),
        np.zeros((count, kept, 6)),
        np.zeros((count, kept), dtype=np.int8),
    )
    control = Control(
        model.tolerance, min(model.most_steps, 2_000_000), model.most_events, until_decided, 1.0
    )
    durations = np.full(count, 1e6) if until_decided else packed.durations

    def chunk(first: int) -> int:
        rows = slice(first, min(first + _CHUNK, count))
        found = Found(
            side[rows],
            peak[rows],
            t_end[rows],
            series[rows],
            ending[rows],
            at_rest[rows],
            motion[rows],
            modes[rows],
            written[rows],
        )
        _run_rows(packed.rows(rows, durations), control, found)
        return rows.stop - rows.start

    with threads(jobs or os.cpu_count() or 1) as pool:
        done = 0
        for rows in pool.map(chunk, range(0, count, _CHUNK)):
            done += rows
            on_progress(done, count)
    found = Outcomes(
        side=side,
        peak=peak,
        t_end=t_end,
        series=series,
        ending=ending,
        at_rest=at_rest,
        motion=motion,
        written=written,
    )
    if strict and found.failed.any():
        first = int(np.argmax(found.failed))
        raise ModelFailure(
            f"{model.name}: run {first} of the batch: {FAILURES[int(ending[first])]}"
        )
    return found


@inner_kernel
def row_ground(row, samples):
    """The base motion of a packed row, of the types that a single history has: the loop is then
    compiled once for both."""
    return Ground(
        kind=int(row["kind"]),
        c0=row["c0"],
        c1=row["c1"],
        c2=row["c2"],
        c3=row["c3"],
        rate=row["rate"],
        centre=row["centre"],
        quiet=row["quiet"],
        step=row["step"],
        samples=samples[row["first"] : row["first"] + row["count"]],
    )


@inner_kernel
def row_side(r):
    """One side of the block of a packed row."""
    return Side(
        alpha=r["alpha"],
        radius=r["radius"],
        arm=r["arm"],
        top_alpha=r["top_alpha"],
        top_radius=r["top_radius"],
        tip_sin=r["tip_sin"],
        tip_cos=r["tip_cos"],
        far_sin=r["far_sin"],
        far_cos=r["far_cos"],
        share=r["share"],
    )


@inner_kernel
def row_setting(r):
    """Block, floor and walls of a packed row, of the types that a single history has."""
    return Setting(
        left=row_side(r["left"]),
        right=row_side(r["right"]),
        height=r["height"],
        spin=r["spin"],
        mu_s=r["mu_s"],
        mu_k=r["mu_k"],
        e_floor=r["e_floor"],
        gap_left=r["gap_left"],
        gap_right=r["gap_right"],
        e_left=r["e_left"],
        e_right=r["e_right"],
        walls=r["walls"] != 0.0,
        no_slip=r["no_slip"] != 0.0,
        unilateral=r["unilateral"] != 0.0,
        energy_cap=r["energy_cap"] != 0.0,
        law=r["law"],
        yields=r["yields"],
    )


@inner_kernel
def play_row(rows, i, step, control, records, states, work):
    """Plays row i in `states`, an array of one state, with rows of the motion a `step` apart (see
    `ebm.core.march.march`); returns the state."""
    state = states[0]
    motion, begin = state.motion, rows.states[i]
    motion.x, motion.y, motion.theta = begin[0], begin[1], begin[2]
    motion.vx, motion.vy, motion.w = begin[3], begin[4], begin[5]
    state.t_end = rows.durations[i]
    block = row_setting(rows.settings[i])
    base = Base(
        row_ground(rows.horizontal[i], rows.samples), row_ground(rows.vertical[i], rows.samples)
    )
    control = Control(
        control.tolerance, control.most_steps, control.most_events, control.until_decided, step
    )
    march(block, base, Run(state, work[0], work[1], control, records))
    return state


@inner_kernel
def _play_into(rows, i, control, found, log, states, work):
    """Plays row i and writes what is found."""
    step = rows.durations[i] / max(found.motion.shape[1] - 1, 1)
    records = Records(found.motion[i], found.modes[i], log)
    state = play_row(rows, i, step, control, records, states, work)
    found.ending[i], found.t_end[i], found.peak[i] = state.ending, state.t, state.peak
    found.at_rest[i] = rests(state.mode)
    found.series[i], found.written[i] = state.steps, state.rows
    if state.ending == Ending.OVERTURNED:
        found.side[i] = -1 if state.motion.theta > 0.0 else 1


@kernel
def _run_rows(rows, control, found):
    states, work, log = np.zeros(1, STATE), workspace(), np.empty((0, 5))
    for i in range(len(rows.durations)):
        _play_into(rows, i, control, found, log, states, work)
