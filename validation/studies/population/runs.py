"""Runs of an assessment: what one is, what it gives, and how it is played."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np
from pydantic import Field

from rockcheck.scenes import History, ModelFailure, Scene
from rockcheck.scenes.files import UncertainScene, with_numbers
from rockcheck.scenes.writing import columns_text
from rockcheck.validation.criteria import CRITERIA, base_of
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.discrepancy.impact_laws import parting_landing
from rockcheck.validation.discrepancy.motion import Motion, largest_reach, largest_slip, motion_of
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import build, compiles, family
from rockcheck.validation.study import Task
from rockcheck.validation.uncertainty.numerical import Numerical, numerical_uncertainty
from rockcheck.validation.uncertainty.population import Inputs, Runs, play, propagate

Side = Literal["left", "right"]
Numbers = tuple[tuple[str, float], ...]
#: Rows of a history that is kept, at the most.
MOST_ROWS = 2000
#: Usual time of a run, s, of compiled models and of others; total time up to which separate
#: processes are not worth while.
A_RUN, A_SLOW_RUN, SOON = 1e-3, 1.0, 5.0


class Ran(Stored):
    """One run: its motion, or the reason why it has none.

    How far the block slid and how far it reached to the left and to the right are in m, also of a
    block that falls.
    """

    outcome: str
    motion: Motion | None = None
    slid: float = 0.0
    reach: Mapping[Side, float] = Field(default_factory=dict)
    reason: str = ""

    @property
    def fell(self) -> bool:
        """Whether the block overturned."""
        return self.outcome.startswith("overturned")

    @property
    def peak(self) -> float:
        """Peak rotation, alpha; 1, the balance point, where the block fell."""
        turned = self.motion.peak_rotation if self.motion else None
        return 1.0 if turned is None else min(turned, 1.0)

    @property
    def turned(self) -> float:
        """Peak rotation, alpha; infinite where the block fell."""
        return math.inf if self.fell else self.peak


class Played(Stored):
    """The runs of a task, in the order of its variants.

    Of the first variant, where they were asked for: `history` as CSV, and `said`, by hand method
    whether its event happens, and how far it goes.
    """

    runs: tuple[Ran, ...]
    history: str = ""
    said: tuple[tuple[bool, float | None], ...] = ()


class Sure(Stored):
    """How sure a run is: its numerical uncertainty, its law of impacts, its inputs.

    `depends_on_law_from_s` is the time (s) from which the run depends on the law of impacts;
    `inputs` is the effect of its uncertain numbers.
    """

    numerical: Numerical | None
    depends_on_law_from_s: float | None
    inputs: Inputs | None


@dataclass(frozen=True)
class OneScene(Task):
    """Runs of one scene by one model; `of` names them."""

    of: tuple[str, ...]
    scene: Scene = field(repr=False)
    model: str
    settings: tuple[tuple[str, Any], ...] = ()

    @property
    def label(self) -> str:
        """Which runs."""
        return ", ".join(filter(None, self.of))

    def depends(self) -> Any:
        """The scene with its motion, the model, what else is asked for, and the code."""
        cell = provenance.cell_key(self.scene, self.model, dict(self.settings))
        asked = [one for one in self.fields() if one not in OneScene.__dataclass_fields__]
        return cell, [getattr(self, one) for one in asked], provenance.code_digest(__name__)


def effort(model: str, settings: Mapping[str, Any], runs: int) -> dict[str, Any]:
    """For a `Task`: the usual time of these runs, s, and the code that they may have to compile."""
    a_run = A_RUN if family(model).compiled else A_SLOW_RUN
    return {"expected": runs * a_run, "compiles": compiles(model, settings)}


@dataclass(frozen=True)
class Batch(OneScene):
    """Runs of a population that are played together: a scene at factors of its base motion.

    `both`: the vertical motion is scaled too, and not mirrored.
    """

    factors: tuple[float, ...] = field(default=(), repr=False)
    both: bool = False

    def play(self) -> Runs:
        """The runs."""
        across, upward = self.scene.excitation, self.scene.vertical
        scenes = [
            self.scene.replace(
                excitation=across.scaled(factor),
                vertical=upward.scaled(abs(factor)) if self.both else upward,
            )
            for factor in self.factors
        ]
        return play(scenes, build(self.model, dict(self.settings)))


@dataclass(frozen=True)
class Run(OneScene):
    """Runs of one scene: as it is, or with numbers changed.

    A gap that is infinite takes the wall away. `shown` asks for the history and for hand methods.
    """

    variants: tuple[Numbers, ...] = field(default=((),), repr=False)
    shown: bool = False

    def play(self) -> Played:
        """All variants, one after the other."""
        model = build(self.model, dict(self.settings))
        ran = [_ran(changed(self.scene, numbers), model) for numbers in self.variants]
        runs, history = tuple(one for one, _ in ran), ran[0][1]
        if not self.shown:
            return Played(runs=runs)
        base, rows = base_of(self.scene), ""
        if history is not None:
            every = -(-len(history.channels["t"]) // MOST_ROWS)
            columns: dict[str, Any] = {n: v[::every] for n, v in history.channels.items()}
            rows = columns_text(columns)
        said = tuple(criterion.says(self.scene, base) for criterion in CRITERIA)
        return Played(runs=runs, history=rows, said=said)


def changed(scene: Scene, numbers: Numbers) -> Scene:
    """The scene with these numbers; a wall whose gap is infinite is taken away."""
    gone = [place.split(".")[1] for place, value in numbers if value == np.inf]
    scene = with_numbers(scene, {place: v for place, v in numbers if v != np.inf})
    return scene.replace(walls=[w for w in scene.walls if w.side not in gone]) if gone else scene


def _ran(scene: Scene, model: Any) -> tuple[Ran, History | None]:
    try:
        history = model.simulate(scene)
    except ModelFailure as failure:
        return Ran(outcome="", reason=str(failure)), None
    ran = Ran(
        outcome=history.outcome,
        motion=motion_of(history, scene),
        slid=largest_slip(history),
        reach={side: largest_reach(history, scene, side) for side in get_args(Side)},
    )
    return ran, history


@dataclass(frozen=True)
class Certainty(OneScene):
    """How sure a run is; `samples` (0: none) draws of its uncertain numbers."""

    samples: int = 0
    given: UncertainScene | None = field(default=None, repr=False, compare=False)

    def depends(self) -> Any:
        """Also what is not known of the scene."""
        if self.given is None or not self.samples:
            return super().depends()
        spreads = {name: spread.model_dump() for name, spread in self.given.spreads.items()}
        return super().depends(), spreads, self.given.correlation.tolist()

    def play(self) -> Sure:
        """Plays coarser steps or a finer tolerance, other laws of impacts, and the draws."""
        landing = parting_landing(self.scene)
        return Sure(
            numerical=numerical_uncertainty(build(self.model, dict(self.settings)), self.scene),
            depends_on_law_from_s=None if landing is None else landing.t,
            inputs=propagate(self.given, samples=self.samples).inputs
            if self.given and self.samples
            else None,
        )
