"""Many runs of the event-based model at once, compiled and on all cores.

They give outcomes and peaks, and the motion on request. Threads take chunks of rows; the result of
a row depends neither on the other rows nor on the number of threads.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import natural
from rockcheck.ebm.core.block import SETTING
from rockcheck.ebm.core.ground import FORM
from rockcheck.ebm.core.names import FAILURES, Ending, Family, Pivot, Shape
from rockcheck.ebm.core.state import MOTION, Records, Rows
from rockcheck.ebm.model import EventBasedModel
from rockcheck.ebm.packed import Packed, pack, play, setting_for, starts_of
from rockcheck.scenes.errors import InputError, ModelFailure
from rockcheck.scenes.progress import OnProgress, threads, unheard
from rockcheck.scenes.scene import Scene

__all__ = ["Outcomes", "Packed", "pack", "pack_pulses", "refuse_bouc_wen", "run_batch"]
Floats = NDArray[np.float64]
_CHUNK = 256
#: What a batch keeps of a run's state, by its field there.
_KEPT = {"peak": "peak", "t_end": "t", "series": "steps", "ending": "ending", "written": "rows"}


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
    #: in `Packed.starts`.
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
            np.full(count, setting_for(scene, model), dtype=SETTING),
            horizontal,
            np.full(count, still.form, dtype=FORM),
            still.samples,
        ),
        starts=np.full(count, np.array(tuple(natural.state_of(scene)), dtype=MOTION)),
        durations=np.full(count, scene.duration / unit),
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
    most = min(model.most_steps, 2_000_000)
    if until_decided:
        packed = replace(packed, durations=np.full(count, 1e6))

    def chunk(first: int) -> dict[str, NDArray[Any]]:
        rows = slice(first, min(first + _CHUNK, count))
        some = packed.part(rows)
        states = starts_of(some, model, some.durations / max(kept - 1, 1), most, until_decided)
        records = Records(motion[rows], modes[rows], np.empty((len(some), 0, 5)))
        play(model, some.rows, states, records)
        return _told(states)

    found: list[dict[str, NDArray[Any]]] = []
    with threads(jobs or os.cpu_count() or 1) as pool:
        done = 0
        for told in pool.map(chunk, range(0, max(count, 1), _CHUNK)):
            found.append(told)
            done += len(told["side"])
            on_progress(done, count)
    columns = {name: np.concatenate([told[name] for told in found]) for name in found[0]}
    outcomes = Outcomes(**columns, motion=motion)
    if strict and outcomes.failed.any():
        first = int(np.argmax(outcomes.failed))
        why = FAILURES[int(outcomes.ending[first])]
        raise ModelFailure(f"{model.name}: run {first} of the batch: {why}")
    return outcomes


def refuse_bouc_wen(model: EventBasedModel) -> None:
    """Raises `InputError`: a batch knows when a run is decided by Coulomb's friction or none."""
    if model.friction == "bouc-wen":
        raise InputError("a batch has Coulomb's friction or none", "friction")


def _told(states: NDArray[np.void]) -> dict[str, NDArray[Any]]:
    """What a batch keeps of runs that have ended."""
    found = {name: states[field].copy() for name, field in _KEPT.items()}
    falls = np.where(states["ending"] == Ending.OVERTURNED, states["motion"]["theta"], 0.0)
    mode = states["mode"]
    at_rest = (mode["family"] == Family.FLAT) & (mode["pivot"] == Pivot.STICK)
    return found | {"side": -np.sign(falls).astype(np.int8), "at_rest": at_rest}
