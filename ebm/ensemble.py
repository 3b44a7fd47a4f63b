"""Histories of many scenes of one duration at once: rotations, peaks, outcomes, last slips.

The rotations are on a common grid of times.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import natural
from rockcheck.ebm.batch import refuse_bouc_wen
from rockcheck.ebm.core.names import FAILURES, Ending
from rockcheck.ebm.core.state import Records
from rockcheck.ebm.model import EventBasedModel
from rockcheck.ebm.packed import pack, play, starts_of
from rockcheck.scenes import kinematics
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
    refuse_bouc_wen(model)
    packed = pack(scenes, model)
    first, count = scenes[0], len(scenes)
    step = max(first.output_step, first.duration / rows) if rows else first.duration
    t = first.replace(output_step=step).output_times if rows else np.empty(0)
    steps = np.array([step / natural.time_unit(scene) for scene in scenes])

    def chunk(begin: int) -> tuple[NDArray[np.void], Floats]:
        part = slice(begin, begin + _CHUNK)
        some = packed.part(part)
        states = starts_of(some, model, steps[part], model.most_steps)
        shape = len(some), len(t)
        records = Records(
            np.empty((*shape, 6)), np.empty(shape, dtype=np.int8), np.empty((len(some), 0, 5))
        )
        play(model, some.rows, states, records)
        lasts = np.arange(len(t)) >= states["rows"][:, None]
        return states, np.where(lasts, states["motion"]["theta"][:, None], records.out[:, :, 2])

    with threads(jobs or os.cpu_count() or 1) as pool:
        played = list(pool.map(chunk, range(0, count, _CHUNK)))
    states, theta = (np.concatenate(parts) for parts in zip(*played, strict=True))
    motion, ending = np.array(states["motion"].tolist()), states["ending"]
    failed = np.isin(ending, tuple(FAILURES))
    if failed.any():
        i = int(np.argmax(failed))
        raise ModelFailure(f"{model.name}: scene {i} of the ensemble: {FAILURES[int(ending[i])]}")
    side = np.where(ending == Ending.OVERTURNED, -np.sign(motion[:, 2]), 0.0).astype(np.int8)
    placed = [natural.to_si(scene, z[None, :])[0] for scene, z in zip(scenes, motion, strict=True)]
    slip = [
        float(kinematics.slip(scene.block, z[0], z[2]))
        for scene, z in zip(scenes, placed, strict=True)
    ]
    alpha = np.array([scene.block.alpha for scene in scenes])
    return Ensemble(
        t=t, theta=theta, side=side, peak=states["peak"], last_slip=np.array(slip), alpha=alpha
    )
