"""Many runs of the event-based model at once, compiled and on all cores.

A batch gives outcomes and peaks, and the motion on request; an ensemble, scenes of one duration,
histories of the rotation on a common grid of times, peaks and last slips. Threads take chunks of
rows; the result of a row depends neither on the other rows nor on the number of threads.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import natural
from rockcheck.ebm.core.names import FAILURES, Ending
from rockcheck.ebm.core.state import FOUND, Records, Rows
from rockcheck.ebm.model import EventBasedModel
from rockcheck.ebm.packed import pack, pack_pulses, play, sides_of, state_for
from rockcheck.scenes import Floats, InputError, ModelFailure, Scene, kinematics, progress

__all__ = [
    "Ensemble",
    "Outcomes",
    "pack",
    "pack_pulses",
    "play_ensemble",
    "run_batch",
    "run_decided",
]
#: Runs of a batch, and scenes of an ensemble, that a thread takes at once.
_CHUNK, _SCENES = 256, 32
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


def run_batch(
    packed: Rows,
    model: EventBasedModel,
    *,
    until_decided: bool = True,
    parts: int = 0,
    strict: bool = True,
    jobs: int | None = None,
    on_progress: progress.OnProgress = progress.unheard,
) -> Outcomes:
    """Runs every row; with `until_decided` until outcome and peak are certain.

    The durations of the rows then do not count. With `parts` the motion is kept at the start and at
    the ends of this number of equal parts of each row's duration; not together with
    `until_decided`. `jobs` threads (default: all cores). `on_progress` gets the number of rows
    done. Where a row reaches a cap or has no consistent motion: `ModelFailure` if `strict`, else
    only its `ending` says so.
    """
    refuse_undecided(model)
    count, kept = len(packed.durations), parts + 1 if parts and not until_decided else 0
    motion, modes = np.zeros((count, kept, 6)), np.zeros((count, kept), dtype=np.int8)
    log, found = np.empty((count, 0, 5)), np.empty(count, FOUND)
    durations = np.full(count, 1e6) if until_decided else packed.durations
    steps = durations / max(kept - 1, 1)
    packed = packed._replace(durations=durations, output_steps=steps)

    def chunk(first: int) -> int:
        part = slice(first, min(first + _CHUNK, count))
        records = Records(motion[part], modes[part], log[part])
        state = state_for(model, min(model.most_steps, 2_000_000), until_decided)
        play(model, packed.part(part), state, records, found[part])
        return part.stop - part.start

    with progress.threads(jobs) as pool:
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


def run_decided(
    packed: Rows,
    model: EventBasedModel,
    *,
    jobs: int | None = None,
    on_progress: progress.OnProgress = progress.unheard,
) -> Outcomes:
    """`run_batch` until all is decided; a run that fails is made once more by `model.finer()`."""
    found = run_batch(packed, model, strict=False, jobs=jobs, on_progress=on_progress)
    if (again := found.failed).any():
        finer = run_batch(packed.part(again), model.finer(), strict=False, jobs=jobs)
        for mine, better in zip(vars(found).values(), vars(finer).values(), strict=True):
            mine[again] = better
    return found


@dataclass(frozen=True, kw_only=True)
class Ensemble:
    """What a model makes of some scenes, one row a scene.

    `theta` (rad, n x rows) at times `t` (s), after a fall pi/2 to its side; empty where no rows
    were asked for. `side` is -1 overturned left, +1 right, 0 not; `peak` the largest |theta| (rad,
    pi/2 of a fall); `last_slip` in m; `alpha` the blocks' own (rad).
    """

    t: Floats
    theta: Floats
    side: NDArray[np.int8]
    peak: Floats
    last_slip: Floats
    alpha: Floats


def play_ensemble(
    scenes: Sequence[Scene], model: EventBasedModel, *, rows: int = 0, jobs: int | None = None
) -> Ensemble:
    """Play scenes of one duration to their end, on `jobs` threads (default: all cores).

    Raises `InputError` where the model cannot play one of them, or has Bouc-Wen friction, and
    `ModelFailure`.
    """
    refuse_undecided(model)
    first, count = scenes[0], len(scenes)
    step = max(first.output_step, first.duration / rows) if rows else first.duration
    t = first.replace(output_step=step).output_times if rows else np.empty(0)
    steps = np.array([step / natural.time_unit(scene) for scene in scenes])
    packed = pack(scenes, model)._replace(output_steps=steps)
    found = np.empty(count, FOUND)

    def chunk(begin: int) -> Floats:
        part = slice(begin, begin + _SCENES)
        some = found[part]
        shape = len(some), len(t)
        records = Records(
            np.empty((*shape, 6)), np.empty(shape, dtype=np.int8), np.empty((len(some), 0, 5))
        )
        play(model, packed.part(part), state_for(model, model.most_steps), records, some)
        lasts = np.arange(len(t)) >= some["rows"][:, None]
        return np.where(lasts, some["motion"]["theta"][:, None], records.out[:, :, 2])

    with progress.threads(jobs) as pool:
        theta = np.concatenate(list(pool.map(chunk, range(0, count, _SCENES))))
    motion, ending = np.array(found["motion"].tolist()), found["ending"]
    failed = np.isin(ending, tuple(FAILURES))
    if failed.any():
        i = int(np.argmax(failed))
        raise ModelFailure(f"{model.name}: scene {i} of the ensemble: {FAILURES[int(ending[i])]}")
    slip = np.empty(count)
    for i, (scene, z) in enumerate(zip(scenes, motion, strict=True)):
        ((x, _, tilt, *_),) = natural.to_si(scene, z[None, :])
        slip[i] = kinematics.slip(scene.block, x, tilt)
    return Ensemble(
        t=t,
        theta=theta,
        side=sides_of(found),
        peak=found["peak"].copy(),
        last_slip=slip,
        alpha=np.array([scene.block.alpha for scene in scenes]),
    )


def refuse_undecided(model: EventBasedModel) -> None:
    """Raises `InputError` where the model's runs do not know when they are decided."""
    if not model.decides:
        raise InputError("a batch has Coulomb's friction or none", "friction")
