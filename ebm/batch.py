"""Many runs of the event-based model at once, compiled and on all cores: outcomes and peaks, no histories.

Scenes are packed into plain arrays, one row a run, so that the loop over them never comes back to Python. Threads take
chunks of rows; the result of a row does not depend on the others, nor on the number of threads.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import natural
from rockcheck.ebm.ground import Ground
from rockcheck.ebm.model import EventBasedModel
from rockcheck.ebm.motion import Setting, workspace
from rockcheck.ebm.trajectory import DONE, FAILURES, OVERTURNED, Control, run
from rockcheck.scenes.compiled import kernel
from rockcheck.scenes.errors import ModelFailure
from rockcheck.scenes.scene import Scene

Floats = NDArray[np.float64]
_CHUNK = 256


@dataclass(frozen=True, kw_only=True)
class Packed:
    """Runs as arrays, one row each, natural units: settings and grounds in the order of their fields, initial states, lengths.

    Recorded samples of all rows stand in one `samples` array; a row's first sample and their number are the last two
    columns of its ground.
    """

    settings: Floats
    horizontal: Floats
    vertical: Floats
    states: Floats
    durations: Floats
    samples: Floats

    def __len__(self) -> int:
        return len(self.durations)


@dataclass(frozen=True, kw_only=True)
class Outcomes:
    """What a batch found, one value a run.

    `side` is -1 overturned left, +1 overturned right, 0 not overturned; `peak` the largest |theta| in rad (pi/2 when
    overturned; rotations after the outcome is certain are counted too), `t_end` the time in sqrt(R/g) at which the run
    was decided; `series` the number of Taylor expansions.
    """

    side: NDArray[np.int8]
    peak: Floats
    t_end: Floats
    series: NDArray[np.int64]
    #: How each run ended, a key of `ebm.trajectory.FAILURES` where it failed.
    ending: NDArray[np.int64]

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Which runs reached a cap or had no consistent motion."""
        return (self.ending != DONE) & (self.ending != OVERTURNED)


def pack(scenes: Sequence[Scene], model: EventBasedModel) -> Packed:
    """Packs a list of scenes; raises `InputError` where the model cannot play one of them."""
    bank: list[Floats] = []
    offset = 0
    horizontal: list[list[float]] = []
    vertical: list[list[float]] = []
    for scene in scenes:
        model.check(scene)
        for ground, rows in zip(natural.grounds_of(scene), (horizontal, vertical), strict=True):
            rows.append([*ground[:-1], offset, len(ground.samples)])
            bank.append(ground.samples)
            offset += len(ground.samples)
    settings = [_setting(scene, model) for scene in scenes]
    return Packed(
        settings=np.array(settings, dtype=np.float64).reshape(len(scenes), len(Setting._fields)),
        horizontal=np.array(horizontal, dtype=np.float64),
        vertical=np.array(vertical, dtype=np.float64),
        states=np.array([natural.state_of(scene) for scene in scenes]).reshape(len(scenes), 6),
        durations=np.array([scene.duration / natural.time_unit(scene) for scene in scenes]),
        samples=np.concatenate(bank) if bank else np.zeros(1),
    )


def pack_pulses(scene: Scene, model: EventBasedModel, amplitudes: Floats, periods: Floats) -> Packed:
    """Packs one scene under many pulses of its own kind: amplitudes in m/s^2, periods in s, 1-D arrays of one length."""
    model.check(scene)
    unit, count = natural.time_unit(scene), len(amplitudes)
    template = type(scene.excitation)
    pulse = scene.excitation.model_copy(update={"amplitude": 1.0, "period": 1.0})
    one, _ = natural.grounds_of(scene.replace(excitation=template(**pulse.model_dump())))
    # A pulse of amplitude a and period T is a times the unit pulse at time t/T.
    ratio = 1.0 / periods
    horizontal = np.tile(np.array([*one[:-1], 0, 1], dtype=np.float64), (count, 1))
    for power in range(4):
        horizontal[:, 1 + power] *= amplitudes * (ratio**power if one.kind == natural.GAUSSIAN else 1.0)
    horizontal[:, 5] *= ratio**2 if one.kind == natural.GAUSSIAN else ratio
    horizontal[:, 6] *= periods
    horizontal[:, 7] *= periods
    _, still = natural.grounds_of(scene)
    return Packed(
        settings=np.tile(np.array(_setting(scene, model), dtype=np.float64), (count, 1)),
        horizontal=horizontal,
        vertical=np.tile(np.array([*still[:-1], 1, len(still.samples)], dtype=np.float64), (count, 1)),
        states=np.tile(natural.state_of(scene), (count, 1)),
        durations=np.full(count, scene.duration / unit),
        samples=np.concatenate([np.zeros(1), still.samples]),
    )


def _setting(scene: Scene, model: EventBasedModel) -> Setting:
    return natural.setting_of(
        scene, unilateral=model.pivot == "unilateral", no_slip=model.friction == "no-slip", energy_cap=model.energy_cap
    )


def run_batch(
    packed: Packed,
    model: EventBasedModel,
    *,
    until_decided: bool = True,
    strict: bool = True,
    jobs: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Outcomes:
    """Runs every row; with `until_decided` to the moment when outcome and peak are certain, whatever its duration.

    `jobs` threads (default: all cores). `progress` is called with the number of rows just done. Where a row
    reaches a cap or has no consistent motion: `ModelFailure` if `strict`, else only its `ending` says so.
    """
    count = len(packed)
    side, peak, t_end = np.zeros(count, dtype=np.int8), np.zeros(count), np.zeros(count)
    series, ending = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    control = Control(model.tolerance, model.order, min(model.most_steps, 2_000_000), model.most_events, until_decided, 1.0)
    durations = np.full(count, 1e6) if until_decided else packed.durations

    def chunk(first: int) -> int:
        rows = slice(first, min(first + _CHUNK, count))
        _run_rows(
            packed.settings[rows],
            packed.horizontal[rows],
            packed.vertical[rows],
            packed.states[rows],
            durations[rows],
            packed.samples,
            control,
            side[rows],
            peak[rows],
            t_end[rows],
            series[rows],
            ending[rows],
        )
        return rows.stop - rows.start

    with ThreadPoolExecutor(max_workers=jobs or os.cpu_count()) as pool:
        for done in pool.map(chunk, range(0, count, _CHUNK)):
            if progress is not None:
                progress(done)
    found = Outcomes(side=side, peak=peak, t_end=t_end, series=series, ending=ending)
    if strict and found.failed.any():
        first = int(np.argmax(found.failed))
        raise ModelFailure(f"{model.name}: run {first} of the batch: {FAILURES[int(ending[first])]}")
    return found


@kernel
def _ground(row, samples):
    first, count = int(row[9]), int(row[10])
    return Ground(int(row[0]), row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8], samples[first : first + count])


@kernel
def _run_rows(settings, horizontal, vertical, states, durations, samples, control, side, peak, t_end, series, ending):
    a, stack = workspace()
    out, out_mode, log = np.empty((0, 6)), np.empty(0, dtype=np.int8), np.empty((0, 5))
    z = np.empty(6)
    for i in range(len(durations)):
        r = settings[i]
        b = Setting(
            r[0],
            r[1],
            r[2],
            r[3],
            r[4],
            r[5],
            r[6],
            r[7],
            r[8],
            r[9],
            r[10],
            r[11],
            r[12] != 0.0,
            r[13] != 0.0,
            r[14] != 0.0,
            r[15] != 0.0,
        )
        z[:] = states[i]
        tally = run(
            b, _ground(horizontal[i], samples), _ground(vertical[i], samples), z, durations[i], control, out, out_mode, log, a, stack
        )
        ending[i] = tally.ending
        if tally.ending == OVERTURNED:
            side[i] = -1 if z[2] > 0.0 else 1
        peak[i] = tally.peak
        t_end[i] = tally.t
        series[i] = tally.steps
