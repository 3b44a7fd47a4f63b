"""Which law of impacts a model followed where a block landed flush against a bouncing wall.

Rigid-body mechanics leaves several answers there (docs/theory.md, "Several impacts at one instant"). This names the one that a
history took, without judging it.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import History, Scene
from rockcheck.validation.discrepancy.figures import Stored

Law = Literal["closed", "open", "floor-first"]
#: How long (s) a history is looked at before and after such a landing.
WINDOW = 0.1
#: Rotations (alpha) nearer than this are one motion; laws whose motions stay nearer than TELLS are not distinguished.
SAME, TELLS = 1e-6, 1e-3
#: A history follows a law if it is nearer to it than this part of the distance to the next one.
NEAR = 0.25


class LawFollowed(Stored):
    """What a history did after the first landing at which the laws part, at `t` s.

    `law` is the nearest one, or "closed or open" where these two cannot be told apart there, or "none" where the history is
    farther from it than a quarter of the `spread`, its distance to the next law. `errors` are the history's distances from all
    of them: RMS of the rotation up to WINDOW after the laws have parted, alpha.
    """

    t: float
    law: str
    errors: dict[Law, float]
    spread: float

    @property
    def error(self) -> float:
        """The distance from the law that is nearest, alpha."""
        return min(self.errors.values())


class FlushLanding(Stored):
    """The first landing of a scene at which the laws of impacts part.

    `branches` are the rotations (alpha) under each law in the output rows from `start` on. Up to the row `parts`, the one
    before which is at `t` s, they are one motion.
    """

    t: float
    start: int
    parts: int
    branches: dict[Law, tuple[float, ...]]

    def followed_by(self, history: History, scene: Scene) -> LawFollowed | None:
        """The law that a history of the scene followed; None where it ends before, or was on its own way before."""
        first = self.parts - self.start
        rows = min(len(history.channels["theta"]) - self.start, *(len(motion) for motion in self.branches.values()))
        if rows < first + 2:
            return None
        own = np.asarray(history.channels["theta"][self.start : self.start + rows], dtype=float) / scene.block.alpha
        motions = {law: np.array(motion[:rows]) for law, motion in self.branches.items()}
        errors = {law: _rms((own - motion)[first:]) for law, motion in motions.items()}
        nearest: Law = min(errors, key=lambda law: errors[law])
        apart = {law: motions[law] - motions[nearest] for law in motions}
        others = [_rms(distance[first:]) for distance in apart.values() if np.max(np.abs(distance)) > TELLS]
        if not others or _rms((own - motions[nearest])[:first]) > NEAR * min(others):
            return None
        alike = [law for law, distance in apart.items() if np.max(np.abs(distance)) <= TELLS]
        law = " or ".join(alike) if errors[nearest] < NEAR * min(others) else "none"
        return LawFollowed(t=self.t, law=law, errors=errors, spread=min(others))


def flush_landing(scene: Scene) -> FlushLanding | None:
    """The first landing of a scene at which the laws part; None where there is no such landing.

    Played by the unilateral event-based model at tolerance 1e-13 under each law, only where a wall bounces. Raises what
    `simulate` raises.
    """
    if not any(wall.restitution > 0.0 for wall in scene.walls):
        return None
    motions = {law: _rotation(scene, law) for law in get_args(Law)}
    rows = min(len(motion) for motion in motions.values())
    apart = np.ptp([motion[:rows] for motion in motions.values()], axis=0)
    if not (apart > TELLS).any():
        return None
    told = int(np.argmax(apart > TELLS))
    parts = int(np.flatnonzero(apart[:told] <= SAME)[-1]) + 1  # all start alike
    window = max(2, round(WINDOW / scene.output_step))
    start = max(0, parts - window)
    branches = {law: tuple(motion[start : told + window].tolist()) for law, motion in motions.items()}
    return FlushLanding(t=float(scene.output_times[parts - 1]), start=start, parts=parts, branches=branches)


def law_followed(scene: Scene, history: History) -> LawFollowed | None:
    """The law that a history of this scene followed; None where no landing tells laws apart, or the history parted or ended before."""
    landing = flush_landing(scene)
    return None if landing is None else landing.followed_by(history, scene)


def _rotation(scene: Scene, law: Law) -> NDArray[np.float64]:
    """theta/alpha under one law."""
    from rockcheck.ebm import EventBasedModel

    model = EventBasedModel(pivot="unilateral", tolerance=1e-13, impacts=law)
    return np.asarray(model.simulate(scene).channels["theta"]) / scene.block.alpha


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))
