"""Runs of the event-based model, one or many, compiled: many on all cores, with their outcomes and
peaks, and their motion where it is asked for.

Scenes are packed into arrays of records, one row a run, so that the loop over them never comes back
to Python. Threads take chunks of rows; the result of a row does not depend on the others, nor on
the number of threads.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import natural
from rockcheck.ebm.core import march
from rockcheck.ebm.core.block import SETTING, filled
from rockcheck.ebm.core.ground import FORM
from rockcheck.ebm.core.names import FAILURES, Ending, Family, Pivot, Shape
from rockcheck.ebm.core.state import CONTROL, MOTION, STATE, Records, Rows, workspace
from rockcheck.ebm.model import EventBasedModel
from rockcheck.scenes.compiled import for_types_of
from rockcheck.scenes.errors import InputError, ModelFailure
from rockcheck.scenes.progress import OnProgress, threads, unheard
from rockcheck.scenes.scene import Scene

Floats = NDArray[np.float64]
_CHUNK = 256
#: The event loops that are compiled, by whether friction is Bouc-Wen's.
_READY: dict[bool, Callable[..., None]] = {}
#: What a batch keeps of a run's state, by its field there.
_KEPT = {"peak": "peak", "t_end": "t", "series": "steps", "ending": "ending", "written": "rows"}


@dataclass(frozen=True, kw_only=True)
class Packed:
    """Runs as arrays, one row each, natural units: what compiled code is given, the motion at the
    start, and the duration."""

    rows: Rows
    starts: NDArray[np.void]
    durations: Floats

    def __len__(self) -> int:
        return len(self.durations)

    def part(self, part: slice) -> Packed:
        """Some of the runs. The samples stay those of all."""
        rows = self.rows
        return Packed(
            rows=Rows(
                rows.settings[part], rows.horizontal[part], rows.vertical[part], rows.samples
            ),
            starts=self.starts[part],
            durations=self.durations[part],
        )


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


def pack(scenes: Sequence[Scene], model: EventBasedModel) -> Packed:
    """Packs a list of scenes; raises `InputError` where the model cannot play one of them."""
    for scene in scenes:
        model.check(scene)
    bases = [natural.base_of(scene) for scene in scenes]
    grounds = [ground for base in bases for ground in base]
    forms = np.array([ground.form for ground in grounds], dtype=FORM)
    forms["first"] = np.cumsum(forms["count"]) - forms["count"]
    return Packed(
        rows=Rows(
            np.array([_setting(scene, model) for scene in scenes], dtype=SETTING),
            forms[::2].copy(),
            forms[1::2].copy(),
            np.concatenate([np.empty(0), *(ground.samples for ground in grounds)]),
        ),
        starts=np.array([tuple(natural.state_of(scene)) for scene in scenes], dtype=MOTION),
        durations=np.array([scene.duration / natural.time_unit(scene) for scene in scenes]),
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
            np.full(count, _setting(scene, model), dtype=SETTING),
            horizontal,
            np.full(count, still.form, dtype=FORM),
            still.samples,
        ),
        starts=np.full(count, np.array(tuple(natural.state_of(scene)), dtype=MOTION)),
        durations=np.full(count, scene.duration / unit),
    )


def _setting(scene: Scene, model: EventBasedModel) -> np.record:
    return natural.setting_of(
        scene,
        unilateral=model.pivot == "unilateral",
        no_slip=model.friction == "no-slip",
        energy_cap=model.energy_cap,
        impacts=model.impacts,
        yields=model.yield_displacement / scene.block.radius,
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


def starts_of(
    packed: Packed,
    model: EventBasedModel,
    steps: Floats | float,
    most_steps: int,
    until_decided: bool = False,
) -> NDArray[np.void]:
    """The states of runs at their start, with rows of the motion `steps` apart."""
    states = np.zeros(len(packed), STATE)
    states["motion"], states["t_end"] = packed.starts, packed.durations
    states["control"] = filled(
        CONTROL,
        tolerance=model.tolerance,
        most_steps=most_steps,
        most_events=model.most_events,
        until_decided=until_decided,
    )
    states["control"]["output_step"] = steps
    return states


def play(model: EventBasedModel, rows: Rows, states: NDArray[np.void], records: Records) -> None:
    """Plays runs with the model's friction, in `states`."""
    given = rows, states, workspace(), records
    loop_of(model, *given)(*given)


def loop_of(model: EventBasedModel, *given: Any) -> Callable[..., None]:
    """The machine code of the event loop with the model's friction, loaded or compiled, for what it
    is given: always of the same types."""
    bouc_wen = model.friction == "bouc-wen"
    if bouc_wen not in _READY:
        _READY[bouc_wen] = for_types_of(march.play_bouc_wen if bouc_wen else march.play, *given)
    return _READY[bouc_wen]
