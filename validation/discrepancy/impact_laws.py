"""Which law of impacts a model followed where a block landed flush against a bouncing wall.

Rigid-body mechanics leaves several answers there (docs/theory.md, "Several impacts at one instant"). This names the one that a
history took, without judging it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import History, Scene

Law = Literal["closed", "open", "floor-first"]
#: How long (s) a history is looked at after such a landing; branches nearer to each other than SAME (alpha) do not differ there.
WINDOW, SAME = 0.1, 1e-6
#: The part of the branches' spread within which a history follows the nearest of them.
NEAR = 0.25


@dataclass(frozen=True, kw_only=True)
class LawFollowed:
    """What a history did after the first landing at which the laws part.

    `law` is the nearest branch, "none" where the history is farther from it than a quarter of the `spread`, the largest distance
    between two branches. `errors` are its distances from all of them: RMS of the rotation over the window, alpha.
    """

    t: float
    law: Law | Literal["none"]
    errors: dict[Law, float]
    spread: float


def law_followed(scene: Scene, history: History, *, window: float = WINDOW) -> LawFollowed | None:
    """The law that a history of this scene followed; None where no landing tells laws apart, or the history ends before."""
    branches = {law: _rotation(scene, law) for law in get_args(Law)}
    rows = min([len(history.channels["theta"]), *(len(theta) for theta in branches.values())])
    stacked = np.array([theta[:rows] for theta in branches.values()])
    apart = np.ptp(stacked, axis=0) > SAME
    first = int(np.argmax(apart))
    if not apart.any():
        return None
    last = min(rows, first + max(2, round(window / scene.output_step)))
    own = history.channels["theta"][first:last] / scene.block.alpha
    errors = {law: _rms(own - theta[first:last]) for law, theta in branches.items()}
    spread = max(_rms(one[first:last] - other[first:last]) for one in branches.values() for other in branches.values())
    nearest: Law = min(errors, key=lambda law: errors[law])
    followed: Law | Literal["none"] = nearest if errors[nearest] < NEAR * spread else "none"
    return LawFollowed(t=float(scene.output_times[max(first - 1, 0)]), law=followed, errors=errors, spread=spread)


def _rotation(scene: Scene, law: Law) -> NDArray[np.float64]:
    """theta/alpha under one law."""
    model = EventBasedModel(pivot="unilateral", tolerance=1e-13, impacts=law)
    return np.asarray(model.simulate(scene).channels["theta"]) / scene.block.alpha


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))
