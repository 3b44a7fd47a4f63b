"""Which law of impacts a model followed where a block landed flush against a wall or flat.

Rigid-body mechanics leaves several answers there (docs/theory.md, "Several impacts at one
instant"). This names the one that a history took, without judging it.
"""

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.horizon import LANDS_FLAT, may_fly
from rockcheck.ebm.model import ImpactLaw
from rockcheck.scenes import Floats, History, Scene
from rockcheck.validation.discrepancy import figures

#: The laws that part where a block lands flush against a wall, and where it lands flat; "moreau":
#: both bottom corners at once.
FLUSH_LAWS: tuple[ImpactLaw, ...] = ("closed", "open", "floor-first")
FLAT_LAWS: tuple[ImpactLaw, ...] = ("moreau", "leading-first", "trailing-first")
#: Time (s) before and after such a landing in which a history is compared with the laws.
WINDOW = 0.1
#: Rotations (alpha) closer than SAME are one motion; laws whose motions stay within TELLS are
#: not distinguished.
SAME, TELLS = 1e-6, 1e-3
#: A history follows a law if it is nearer to it than this part of the distance to the next one.
NEAR = 0.25


class LawFollowed(figures.Stored):
    """The law that a history followed after the first landing at which the laws part, at `t` s.

    `law` is the nearest one; "closed or open" where those two cannot be told apart there; "none"
    where the history is farther from it than a quarter of the `spread`, the nearest law's distance
    to the next law. `errors` are the history's distances from all laws, in alpha: RMS of the
    rotation until WINDOW after the laws have parted.
    """

    t: float
    law: str
    errors: dict[ImpactLaw, float]
    spread: float


class Landing(figures.Stored):
    """The first landing of a scene at which the laws of impacts part.

    `branches` are the rotations (alpha) under each law in the output rows from `start` on. They are
    one motion before row `parts`; `t` (s) is the time of the row before it.
    """

    t: float
    start: int
    parts: int
    branches: dict[ImpactLaw, tuple[float, ...]]

    def followed_by(self, history: History, scene: Scene) -> LawFollowed | None:
        """The law that a history of the scene followed.

        None where the history does not reach over the landing, or had already left their common
        motion. Its rows may have times of their own.
        """
        first, t = self.parts - self.start, history.channels["t"]
        times = scene.output_times[self.start :][: min(map(len, self.branches.values()))]
        rows = int(np.searchsorted(times, t[-1] + 1e-9))
        if rows < first + 2 or t[0] > times[0] + 1e-9:
            return None
        own = np.interp(times[:rows], t, history.channels["theta"]) / scene.block.alpha
        motions = {law: np.array(motion[:rows]) for law, motion in self.branches.items()}
        errors = {law: _rms((own - motion)[first:]) for law, motion in motions.items()}
        nearest: ImpactLaw = min(errors, key=lambda law: errors[law])
        apart = {law: motions[law] - motions[nearest] for law in motions}
        others = [
            _rms(distance[first:])
            for distance in apart.values()
            if np.max(np.abs(distance)) > TELLS
        ]
        if not others or _rms((own - motions[nearest])[:first]) > NEAR * min(others):
            return None
        alike = [  # in this order: a store does not keep it
            law
            for law in (*FLUSH_LAWS, *FLAT_LAWS)
            if law in apart and np.max(np.abs(apart[law])) <= TELLS
        ]
        law = " or ".join(alike) if errors[nearest] < NEAR * min(others) else "none"
        return LawFollowed(t=self.t, law=law, errors=errors, spread=min(others))


def parting_landing(scene: Scene) -> Landing | None:
    """The first landing of a scene at which the laws part; None if there is none.

    Played by the unilateral event-based model at tolerance 1e-13: under the flush laws beside a
    wall, under the flat laws where the block lands flat. Raises what `simulate` raises.
    """
    groups = [FLUSH_LAWS] if scene.walls else []
    if may_fly(scene) and LANDS_FLAT in _played(scene, "moreau").cost.rules:
        groups.append(FLAT_LAWS)
    window = max(2, round(WINDOW / scene.output_step))
    found = []
    for laws in groups:
        motions = {
            law: np.asarray(_played(scene, law).channels["theta"]) / scene.block.alpha
            for law in laws
        }
        rows = min(map(len, motions.values()))
        apart = np.ptp([motion[:rows] for motion in motions.values()], axis=0)
        told = int(np.argmax(apart > TELLS))  # 0 where the laws do not part: all start alike
        if told:
            parts = int(np.flatnonzero(apart[:told] <= SAME)[-1]) + 1
            start = max(0, parts - window)
            branches = {
                law: tuple(motion[start : told + window].tolist())
                for law, motion in motions.items()
            }
            t = float(scene.output_times[parts - 1])
            found.append(Landing(t=t, start=start, parts=parts, branches=branches))
    return min(found, key=lambda landing: landing.t, default=None)


def _played(scene: Scene, law: ImpactLaw) -> History:
    return EventBasedModel(pivot="unilateral", tolerance=1e-13, impacts=law).simulate(scene)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
