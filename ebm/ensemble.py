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
from rockcheck.ebm.core.names import FAILURES
from rockcheck.ebm.core.state import FOUND, Records
from rockcheck.ebm.model import EventBasedModel
from rockcheck.ebm.packed import pack, play, sides_of, state_for
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
    first, count = scenes[0], len(scenes)
    step = max(first.output_step, first.duration / rows) if rows else first.duration
    t = first.replace(output_step=step).output_times if rows else np.empty(0)
    steps = np.array([step / natural.time_unit(scene) for scene in scenes])
    packed = pack(scenes, model).changed(output_steps=steps)
    found = np.empty(count, FOUND)

    def chunk(begin: int) -> Floats:
        part = slice(begin, begin + _CHUNK)
        some = found[part]
        shape = len(some), len(t)
        records = Records(
            np.empty((*shape, 6)), np.empty(shape, dtype=np.int8), np.empty((len(some), 0, 5))
        )
        play(model, packed.part(part), state_for(model, model.most_steps), records, some)
        lasts = np.arange(len(t)) >= some["rows"][:, None]
        return np.where(lasts, some["motion"]["theta"][:, None], records.out[:, :, 2])

    with threads(jobs or os.cpu_count() or 1) as pool:
        theta = np.concatenate(list(pool.map(chunk, range(0, count, _CHUNK))))
    motion, ending = np.array(found["motion"].tolist()), found["ending"]
    failed = np.isin(ending, tuple(FAILURES))
    if failed.any():
        i = int(np.argmax(failed))
        raise ModelFailure(f"{model.name}: scene {i} of the ensemble: {FAILURES[int(ending[i])]}")
    placed = [natural.to_si(scene, z[None, :])[0] for scene, z in zip(scenes, motion, strict=True)]
    slip = [
        float(kinematics.slip(scene.block, z[0], z[2]))
        for scene, z in zip(scenes, placed, strict=True)
    ]
    alpha = np.array([scene.block.alpha for scene in scenes])
    return Ensemble(
        t=t,
        theta=theta,
        side=sides_of(found),
        peak=found["peak"].copy(),
        last_slip=np.array(slip),
        alpha=alpha,
    )
