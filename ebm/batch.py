"""Many runs of the event-based model at once, compiled and on all cores.

A batch gives outcomes and peaks, and the motion on request. Threads take chunks of rows; the result
of a row depends neither on the other rows nor on the number of threads.
"""

import math
import os
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.core.names import FAILURES, Ending, Keep
from rockcheck.ebm.core.state import EXTREMES, FOUND, Records, Rows, workspace
from rockcheck.ebm.model import EventBasedModel
from rockcheck.ebm.natural import loop_of, pack, pack_pulses, state_for
from rockcheck.scenes import Floats, InputError, ModelFailure, progress

__all__ = ["Outcomes", "pack", "pack_pulses", "run_batch", "run_decided"]
#: Runs of a batch that a thread takes at once, at the most; and into how many chunks a thread's
#: share is parted, since runs last differently.
_CHUNK, _PARTS = 256, 4


@dataclass(frozen=True, kw_only=True)
class Outcomes:
    """What a batch found.

    `runs` has a FOUND a run: `t`, in sqrt(R/g), and `motion` are those at which it was decided;
    `peak` is pi/2 when it overturned, and counts rotations after the outcome is certain, too. `out`
    has, as asked for, columns (x, y, theta and their rates) of the first `rows` output rows;
    `extremes` an EXTREMES a run, or nothing.
    """

    runs: NDArray[np.void]
    out: Floats
    extremes: NDArray[np.void]

    @property
    def side(self) -> NDArray[np.int8]:
        """-1 overturned left, 1 overturned right, 0 not overturned."""
        overturned = self.runs["ending"] == Ending.OVERTURNED
        return np.where(overturned, -np.sign(self.runs["motion"]["theta"]), 0.0).astype(np.int8)

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Which runs reached a cap or had no consistent motion."""
        return np.isin(self.runs["ending"], list(FAILURES))

    @property
    def undecided(self) -> NDArray[np.bool_]:
        """Which runs were given up before they were decided (`ebm.core.decide.PATIENCE`)."""
        return np.asarray(self.runs["ending"] == Ending.GIVEN_UP)


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What a batch is asked for: see `run_batch`; and what of each run is kept."""

    until_decided: bool = True
    rows: int = 0
    columns: slice | int = field(default_factory=lambda: slice(None))
    keeps: Keep = Keep.NOTHING


def run_batch(
    packed: Rows,
    model: EventBasedModel,
    *,
    until_decided: bool = True,
    rows: int = 0,
    columns: slice | int = slice(None),
    strict: bool = True,
    jobs: int | None = None,
    on_progress: progress.OnProgress = progress.unheard,
) -> Outcomes:
    """Runs every row; with `until_decided` until outcome and peak are certain.

    The durations of the runs then do not count. Else `columns` of the motion may be kept, up to
    `rows` times a run, its output step apart. `jobs` threads (default: all cores). `on_progress`
    gets the number of runs done. Where a run reaches a cap or has no consistent motion:
    `ModelFailure` if `strict`, else only its `ending` says so. Raises `InputError` where the
    model's runs do not know when they are decided.
    """
    asked = Asked(until_decided=until_decided, rows=rows, columns=columns)
    outcomes = play_batch(packed, model, asked, jobs=jobs, on_progress=on_progress)
    if strict and outcomes.failed.any():
        first = int(np.argmax(outcomes.failed))
        why = FAILURES[int(outcomes.runs["ending"][first])]
        raise ModelFailure(f"{model.name}: run {first} of the batch: {why}")
    return outcomes


def play_batch(
    packed: Rows,
    model: EventBasedModel,
    asked: Asked,
    *,
    jobs: int | None = None,
    on_progress: progress.OnProgress = progress.unheard,
) -> Outcomes:
    """Runs every row, whether it fails or not.

    A run until it is decided goes on until nothing that `asked.keeps` can change.
    """
    if not model.decides:
        raise InputError("a batch has Coulomb's friction or none", "friction")
    count, rows = len(packed.given), asked.rows
    found = np.empty(count, FOUND)
    extremes = np.zeros(count if asked.keeps else 0, EXTREMES)
    most_steps = min(model.most_steps, 2_000_000)
    parts = _PARTS * (jobs or os.cpu_count() or 1)
    at_once = min(_CHUNK, max(1, math.ceil(count / parts)))

    def chunk(first: int) -> Floats:
        some, kept = found[first : first + at_once], extremes[first : first + at_once]
        size = len(some)
        out, modes = np.zeros((size, rows, 6)), np.zeros((size, rows), dtype=np.int8)
        states = state_for(model, most_steps, asked.until_decided, asked.keeps)
        records = Records(out, modes, np.empty((size, 0, 5)), kept)
        part = packed._replace(given=packed.given[first : first + size])
        work = part, states, workspace(), records, some
        loop_of(model, *work)(*work)
        return out[:, :, asked.columns].copy()

    outs = [np.empty((0, rows, 6))[:, :, asked.columns]]
    with progress.threads(jobs) as pool:
        for n, out in enumerate(pool.map(chunk, range(0, count, at_once)), 1):
            outs.append(out)
            on_progress(min(at_once * n, count), count)
    return Outcomes(runs=found, out=np.concatenate(outs), extremes=extremes)


def run_decided(
    packed: Rows,
    model: EventBasedModel,
    *,
    keeps: Keep = Keep.NOTHING,
    jobs: int | None = None,
    on_progress: progress.OnProgress = progress.unheard,
) -> Outcomes:
    """Runs every row until all is decided; one that fails is made once more by `model.finer()`.

    A run that keeps more goes on until none of it can change.
    """
    asked = Asked(keeps=keeps)
    found = play_batch(packed, model, asked, jobs=jobs, on_progress=on_progress)
    again = found.failed
    if again.any():
        failed = packed._replace(given=packed.given[again])
        finer = play_batch(failed, model.finer(), asked, jobs=jobs)
        found.runs[again] = finer.runs
        if keeps:
            found.extremes[again] = finer.extremes
    return found
