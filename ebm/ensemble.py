"""Histories of many scenes of one duration at once: rotations on a common grid, peaks, outcomes and
last slips."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import natural
from rockcheck.ebm.batch import pack, play_row
from rockcheck.ebm.core.names import FAILURES, Ending
from rockcheck.ebm.core.state import STATE, Control, Records, workspace
from rockcheck.ebm.model import EventBasedModel
from rockcheck.scenes import kinematics
from rockcheck.scenes.compiled import kernel
from rockcheck.scenes.errors import ModelFailure
from rockcheck.scenes.progress import threads
from rockcheck.scenes.scene import Scene

Floats = NDArray[np.float64]
_CHUNK = 32


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
    packed = pack(scenes, model)
    first, count = scenes[0], len(scenes)
    step = max(first.output_step, first.duration / rows) if rows else first.duration
    t = first.replace(output_step=step).output_times if rows else np.empty(0)
    steps = np.array([step / natural.time_unit(scene) for scene in scenes])
    theta, states = np.empty((count, len(t))), np.empty((count, 6))
    peak, ending = np.empty(count), np.zeros(count, dtype=np.int64)
    control = Control(model.tolerance, model.most_steps, model.most_events, False, 1.0)

    def chunk(begin: int) -> None:
        part = slice(begin, begin + _CHUNK)
        _sample_rows(
            packed.rows(part, packed.durations),
            control,
            steps[part],
            states[part],
            theta[part],
            peak[part],
            ending[part],
        )

    with threads(jobs or os.cpu_count() or 1) as pool:
        list(pool.map(chunk, range(0, count, _CHUNK)))
    failed = np.isin(ending, tuple(FAILURES))
    if failed.any():
        i = int(np.argmax(failed))
        raise ModelFailure(f"{model.name}: scene {i} of the ensemble: {FAILURES[int(ending[i])]}")
    side = np.where(ending == Ending.OVERTURNED, -np.sign(states[:, 2]), 0.0).astype(np.int8)
    placed = [natural.to_si(scene, z[None, :])[0] for scene, z in zip(scenes, states, strict=True)]
    slip = [
        float(kinematics.slip(scene.block, z[0], z[2]))
        for scene, z in zip(scenes, placed, strict=True)
    ]
    alpha = np.array([scene.block.alpha for scene in scenes])
    return Ensemble(t=t, theta=theta, side=side, peak=peak, last_slip=np.array(slip), alpha=alpha)


@kernel
def _sample_rows(rows, control, steps, states, theta, peak, ending):
    """Plays each row to its end: its rotations on the grid, its last state, its peak and how it
    ended."""
    count = theta.shape[1]
    records = Records(np.empty((count, 6)), np.empty(count, dtype=np.int8), np.empty((0, 5)))
    state, work = np.zeros(1, STATE), workspace()
    for i in range(len(rows.durations)):
        found = play_row(rows, i, steps[i], control, records, state, work)
        motion = found.motion
        states[i, 0], states[i, 1], states[i, 2] = motion.x, motion.y, motion.theta
        states[i, 3], states[i, 4], states[i, 5] = motion.vx, motion.vy, motion.w
        ending[i], peak[i] = found.ending, found.peak
        for k in range(count):
            theta[i, k] = records.out[k, 2] if k < found.rows else motion.theta
