"""A population: scenes, drawn or listed, that one model plays; what each run did, and how sure a
share of the runs is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.batch import pack, run_batch
from rockcheck.ebm.spectrum import LEFT, RIGHT, SAFE
from rockcheck.scenes import History, ModelFailure, Scene, kinematics
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.discrepancy.statistics import CONFIDENCE

Floats = NDArray[np.float64]
#: Time (s) that a run goes on after the base's motion while its outcome is open; and the share of
#: the energy of tipping over below which the outcome is decided: a hundredth is left to the model's
#: own error.
SETTLE, ENOUGH = 6.0, 0.99


class Runs(Stored):
    """What a model makes of scenes, one value a run.

    `side` is -1 overturned left, +1 right, 0 neither. `failed` runs say nothing, whatever the other
    fields hold of them. `figures` by name: peak_rotation (alpha).
    """

    side: tuple[int, ...]
    failed: tuple[bool, ...]
    figures: Mapping[str, tuple[float, ...]]

    @property
    def peaks(self) -> Floats:
        """Peak rotations, alpha: infinite of a block that overturned, NaN where the run failed."""
        peaks = np.where(self.side, np.inf, self.figures["peak_rotation"])
        return np.where(self.failed, np.nan, peaks)


def play(scenes: Sequence[Scene], player: Any) -> Runs:
    """Play scenes with a model until outcome and peak are certain, whatever their durations.

    A run of the event-based model that fails is made once more at a hundredth of the tolerance.
    Raises `InputError` where the model cannot play one of them.
    """
    if compiled(player):
        side, peak, failed = _batch(scenes, player)
        if failed.any():
            again = [scene for scene, fault in zip(scenes, failed, strict=True) if fault]
            side[failed], peak[failed], failed[failed] = _batch(again, player.finer())
    else:
        rows = [_one(scene, player) for scene in scenes]
        side, peak, failed = (np.array(column) for column in zip(*rows, strict=True))
    rotations = (peak / np.array([scene.block.alpha for scene in scenes])).tolist()
    return Runs(side=side.tolist(), failed=failed.tolist(), figures={"peak_rotation": rotations})


def _batch(
    scenes: Sequence[Scene], model: EventBasedModel
) -> tuple[NDArray[np.int8], Floats, NDArray[np.bool_]]:
    found = run_batch(pack(scenes, model), model, strict=False, jobs=1)
    return found.side, found.peak, found.failed


def _one(scene: Scene, player: Any) -> tuple[int, float, bool]:
    try:
        history = decided(scene, player)
    except ModelFailure:
        return SAFE, 0.0, True
    return side_of(history.outcome), history.peak_rotation, False


def decided(scene: Scene, player: Any) -> History:
    """The history of a scene until its outcome is certain, whatever its duration.

    A block that has not tipped past its balance when the base comes to rest, and has too little
    energy left to do so, is safe. Any other run is made again and goes on for `SETTLE` s; what then
    stands is safe.
    """
    quiet = max(scene.excitation.quiet_after, scene.vertical.quiet_after)
    needed = scene.gravity * (scene.block.radius - scene.block.weaker_pivot.height)
    for settle in (0.0, SETTLE):  # few rows: only the outcome is asked
        history = player.simulate(scene.replace(duration=quiet + settle, output_step=0.02))
        names = ("theta", "y", "x_dot", "y_dot", "theta_dot")
        theta, y, *rates = (history.channels[name][-1] for name in names)
        energy = kinematics.energy(scene.block, scene.gravity, y, theta, *rates)
        weak = energy < ENOUGH * needed and abs(theta) < scene.block.alpha
        if weak or side_of(history.outcome) != SAFE:
            break
    return history


def compiled(player: object) -> TypeGuard[EventBasedModel]:
    """Whether the model plays whole batches compiled."""
    return isinstance(player, EventBasedModel) and player.friction != "bouc-wen"


def side_of(outcome: str) -> int:
    """-1 overturned left, +1 overturned right, 0 otherwise."""
    return {"overturned left": LEFT, "overturned right": RIGHT}.get(outcome, SAFE)


def wilson(share: Floats, count: Floats) -> tuple[Floats, Floats]:
    """The ends of the `CONFIDENCE` interval of shares of so many independent runs (Wilson 1927).

    It holds near 0 and 1, too, where runs drawn anew all say the same.
    """
    from scipy.special import ndtri

    z2 = float(ndtri(0.5 + 0.5 * CONFIDENCE)) ** 2 / count
    middle = (share + 0.5 * z2) / (1.0 + z2)
    half = np.sqrt(z2 * share * (1.0 - share) + 0.25 * z2 * z2) / (1.0 + z2)
    return middle - half, middle + half
