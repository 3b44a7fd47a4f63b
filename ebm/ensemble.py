"""Histories of many scenes of one duration at once: rotations on a common grid, peaks, outcomes and last slips."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.model import EventBasedModel
from rockcheck.scenes.scene import Scene

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Ensemble:
    """What a model makes of some scenes, one row a scene.

    `theta` (rad, n x rows) at times `t` (s), after a fall pi/2 to its side; empty where no rows were asked for. `side` is -1
    overturned left, +1 right, 0 not; `peak` the largest |theta| on the grid (rad, pi/2 of a fall); `last_slip` in m; `alpha`
    the blocks' own (rad).
    """

    t: Floats
    theta: Floats
    side: NDArray[np.int8]
    peak: Floats
    last_slip: Floats
    alpha: Floats


def play_ensemble(scenes: Sequence[Scene], model: EventBasedModel, *, rows: int = 0) -> Ensemble:
    """Play scenes of one duration to their end. Raises what `simulate` raises."""
    first = scenes[0]
    step = max(first.output_step, first.duration / rows) if rows else first.output_step
    t = first.replace(output_step=step).output_times
    theta = np.empty((len(scenes), len(t) if rows else 0))
    side, peak, slip = np.zeros(len(scenes), dtype=np.int8), np.empty(len(scenes)), np.empty(len(scenes))
    for i, scene in enumerate(scenes):
        history = model.simulate(scene.replace(output_step=step))
        rotation = history.channels["theta"]
        if history.outcome.startswith("overturned"):
            side[i] = -1 if history.outcome.endswith("left") else 1
        peak[i] = 0.5 * math.pi if side[i] else history.peak_rotation
        slip[i] = history.channels["slip"][-1]
        if rows:
            theta[i, : len(rotation)] = rotation
            theta[i, len(rotation) :] = -0.5 * math.pi * side[i]
    alpha = np.array([scene.block.alpha for scene in scenes])
    return Ensemble(t=t, theta=theta, side=side, peak=peak, last_slip=slip, alpha=alpha)
