"""Histories of many scenes of one duration at once: rotations on a common grid, peaks, outcomes and last slips."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import natural
from rockcheck.ebm.batch import pack, play_row
from rockcheck.ebm.core.march import FAILURES, OVERTURNED, Control, kept_arrays
from rockcheck.ebm.core.motion import THETA, X, workspace
from rockcheck.ebm.model import EventBasedModel
from rockcheck.scenes import kinematics
from rockcheck.scenes.compiled import kernel
from rockcheck.scenes.errors import ModelFailure
from rockcheck.scenes.scene import Scene
from rockcheck.scenes.threads import threads

Floats = NDArray[np.float64]
_CHUNK = 32


@dataclass(frozen=True, kw_only=True)
class Ensemble:
    """What a model makes of some scenes, one row a scene.

    `theta` (rad, n x rows) at times `t` (s), after a fall pi/2 to its side; empty where no rows were asked for. `side` is -1
    overturned left, +1 right, 0 not; `peak` the largest |theta| (rad, pi/2 of a fall); `last_slip` in m; `alpha`
    the blocks' own (rad).
    """

    t: Floats
    theta: Floats
    side: NDArray[np.int8]
    peak: Floats
    last_slip: Floats
    alpha: Floats


def play_ensemble(scenes: Sequence[Scene], model: EventBasedModel, *, rows: int = 0, jobs: int | None = None) -> Ensemble:
    """Play scenes of one duration to their end, on `jobs` threads (default: all cores).

    Raises `InputError` where the model cannot play one of them, or has Bouc-Wen friction, and `ModelFailure`.
    """
    packed = pack(scenes, model)
    first, count = scenes[0], len(scenes)
    step = max(first.output_step, first.duration / rows) if rows else first.duration
    t = first.replace(output_step=step).output_times if rows else np.empty(0)
    steps = np.array([step / natural.time_unit(scene) for scene in scenes])
    theta, states = np.empty((count, len(t))), packed.states.copy()
    peak, ending = np.empty(count), np.zeros(count, dtype=np.int64)
    control = Control(model.tolerance, model.order, model.most_steps, model.most_events, False, 1.0)

    def chunk(begin: int) -> None:
        part = slice(begin, begin + _CHUNK)
        grounds = packed.horizontal[part], packed.vertical[part]
        _sample_rows(
            packed.settings[part], packed.law, *grounds, states[part], packed.durations[part], packed.samples, control, steps[part],
            theta[part], peak[part], ending[part],
        )  # fmt: skip

    with threads(jobs or os.cpu_count() or 1) as pool:
        list(pool.map(chunk, range(0, count, _CHUNK)))
    failed = np.isin(ending, tuple(FAILURES))
    if failed.any():
        i = int(np.argmax(failed))
        raise ModelFailure(f"{model.name}: scene {i} of the ensemble: {FAILURES[int(ending[i])]}")
    side = np.where(ending == OVERTURNED, -np.sign(states[:, THETA]), 0.0).astype(np.int8)
    placed = [natural.to_si(scene, z[None, :])[0] for scene, z in zip(scenes, states, strict=True)]
    slip = [float(kinematics.slip(scene.block, z[X], z[THETA])) for scene, z in zip(scenes, placed, strict=True)]
    alpha = np.array([scene.block.alpha for scene in scenes])
    return Ensemble(t=t, theta=theta, side=side, peak=peak, last_slip=np.array(slip), alpha=alpha)


@kernel
def _sample_rows(settings, law, horizontal, vertical, states, durations, samples, control, steps, theta, peak, ending):
    """Plays each row to its end: its rotations on the grid, its last state (in place of the first), its peak and how it ended."""
    a, stack = workspace()
    rows = theta.shape[1]
    out, out_mode, log = np.empty((rows, 6)), np.empty(rows, dtype=np.int8), np.empty((0, 5))
    kept, z = kept_arrays(), np.empty(6)
    for i in range(len(durations)):
        found = play_row(
            settings, law, horizontal, vertical, samples, states, durations, i, steps[i], control, out, out_mode, log, z, a, stack, kept
        )
        states[i] = z
        ending[i], peak[i], written = found[0], found[2], found[9]
        for k in range(rows):
            theta[i, k] = out[k, THETA] if k < written else z[THETA]
