"""Many runs of the event-based model at once, compiled and on all cores.

They give outcomes and peaks, and the motion on request. Threads take chunks of rows; the result of
a row depends neither on the other rows nor on the number of threads.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import natural
from rockcheck.ebm.core.block import SETTING
from rockcheck.ebm.core.ground import FORM
from rockcheck.ebm.core.names import FAILURES, Ending, Shape
from rockcheck.ebm.core.state import FOUND, MOTION, Records, Rows
from rockcheck.ebm.model import EventBasedModel
from rockcheck.ebm.packed import Packed, pack, play, setting_for, sides_of, state_for
from rockcheck.scenes.errors import InputError, ModelFailure
from rockcheck.scenes.progress import OnProgress, threads, unheard
from rockcheck.scenes.scene import Scene

__all__ = ["Outcomes", "Packed", "pack", "pack_pulses", "refuse_bouc_wen", "run_batch"]
Floats = NDArray[np.float64]
_CHUNK = 256
#: The fields of a FOUND, by their names in `Outcomes`.
_KEPT = {
    "peak": "peak",
    "t_end": "t",
    "series": "steps",
    "ending": "ending",
    "at_rest": "at_rest",
    "written": "rows",
}


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
    #: in `Rows.starts`.
    motion: Floats
    written: NDArray[np.int64]

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Which runs reached a cap or had no consistent motion."""
        return (self.ending != Ending.DONE) & (self.ending != Ending.OVERTURNED)


def pack_pulses(
    scene: Scene, model: EventBasedModel, amplitudes: Floats, periods: Floats
) -> Packed:
    """Packs one scene under many pulses of its own kind.

    `amplitudes` (m/s^2) and `periods` (s) are 1-D arrays of one length.
    """
    model.check(scene)
    unit, count = natural.time_unit(scene), len(amplitudes)
    template = type(scene.excitation)
    pulse = scene.excitation.model_copy(update={"amplitude": 1.0, "period": 1.0})
    one = natural.base_of(scene.replace(excitation=template(**pulse.model_dump()))).horizontal
    # A pulse of amplitude a and period T is a times the unit pulse at time t/T.
    ratio = 1.0 / periods
    horizontal = np.full(count, one.form, dtype=FORM)
    for power in range(4):
        horizontal[f"c{power}"] *= amplitudes * (
            ratio**power if one.form.kind == Shape.GAUSSIAN else 1.0
        )
    horizontal["rate"] *= ratio**2 if one.form.kind == Shape.GAUSSIAN else ratio
    horizontal["centre"] *= periods
    horizontal["quiet"] *= periods
    still = natural.base_of(scene).vertical
    return Packed(
        rows=Rows(
            settings=np.full(count, setting_for(scene, model), dtype=SETTING),
            horizontal=horizontal,
            vertical=np.full(count, still.form, dtype=FORM),
            starts=np.full(count, np.array(tuple(natural.state_of(scene)), dtype=MOTION)),
            durations=np.full(count, scene.duration / unit),
            output_steps=np.full(count, scene.output_step / unit),
            samples=still.samples,
        )
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
    """Runs every row; with `until_decided` until outcome and peak are certain.

    The durations of the rows then do not count. With `parts` the motion is kept at the start and at
    the ends of this number of equal parts of each row's duration; not together with
    `until_decided`. `jobs` threads (default: all cores). `on_progress` gets the number of rows
    done. Where a row reaches a cap or has no consistent motion: `ModelFailure` if `strict`, else
    only its `ending` says so.
    """
    refuse_bouc_wen(model)
    count, kept = len(packed), parts + 1 if parts and not until_decided else 0
    motion, modes = np.zeros((count, kept, 6)), np.zeros((count, kept), dtype=np.int8)
    log, found = np.empty((count, 0, 5)), np.empty(count, FOUND)
    durations = np.full(count, 1e6) if until_decided else packed.rows.durations
    steps = durations / max(kept - 1, 1)
    packed = packed.changed(durations=durations, output_steps=steps)

    def chunk(first: int) -> int:
        part = slice(first, min(first + _CHUNK, count))
        records = Records(motion[part], modes[part], log[part])
        state = state_for(model, min(model.most_steps, 2_000_000), until_decided)
        play(model, packed.part(part), state, records, found[part])
        return part.stop - part.start

    with threads(jobs or os.cpu_count() or 1) as pool:
        done = 0
        for rows in pool.map(chunk, range(0, count, _CHUNK)):
            done += rows
            on_progress(done, count)
    outcomes = Outcomes(
        side=sides_of(found),
        motion=motion,
        **{name: found[field].copy() for name, field in _KEPT.items()},
    )
    if strict and outcomes.failed.any():
        first = int(np.argmax(outcomes.failed))
        why = FAILURES[int(outcomes.ending[first])]
        raise ModelFailure(f"{model.name}: run {first} of the batch: {why}")
    return outcomes


def refuse_bouc_wen(model: EventBasedModel) -> None:
    """Raises `InputError`: a batch knows when a run is decided by Coulomb's friction or none."""
    if model.friction == "bouc-wen":
        raise InputError("a batch has Coulomb's friction or none", "friction")
