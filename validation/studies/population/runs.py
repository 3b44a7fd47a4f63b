"""Runs of an assessment: what one is, what it gives, and how it is played."""

from __future__ import annotations

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
from rockcheck.validation.execute.models import build
from rockcheck.validation.study import Task
from rockcheck.validation.uncertainty.numerical import Numerical, numerical_uncertainty
from rockcheck.validation.uncertainty.population import Inputs, propagate

Side = Literal["left", "right"]
Numbers = tuple[tuple[str, float], ...]
#: Rows of a history that is kept, at the most.
MOST_ROWS = 2000


class Ran(Stored):
    """One run: its motion, how far it slid and reached to the left and to the right (m, also of a
    block that falls), or why it has none.
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


class Played(Stored):
    """The runs of a task, in the order of its variants; of the first perhaps the history as CSV,
    and what hand methods say of it: by method, whether it happens, and how far.
    """

    runs: tuple[Ran, ...]
    history: str = ""
    said: tuple[tuple[bool, float | None], ...] = ()


class Sure(Stored):
    """How sure a run is: its numerical uncertainty, the time (s) from which it depends on the law
    of impacts, and what its uncertain numbers make of it.
    """

    numerical: Numerical | None
    depends_on_law_from_s: float | None
    inputs: Inputs | None


@dataclass(frozen=True)
class Run(Task):
    """Runs of one scene: as it is, or with numbers changed; a gap that is infinite takes the wall
    away. `shown` asks for the history and for hand methods.
    """

    of: tuple[str, ...]
    scene: Scene = field(repr=False)
    model: str
    settings: tuple[tuple[str, Any], ...] = ()
    variants: tuple[Numbers, ...] = field(default=((),), repr=False)
    shown: bool = False

    @property
    def label(self) -> str:
        """Which runs."""
        return ", ".join(self.of)

    def depends(self) -> Any:
        """The scene with its motion, the model, the variants, and the code that plays them."""
        cell = provenance.cell_key(self.scene, self.model, dict(self.settings))
        return cell, self.variants, self.shown, provenance.code_digest(__name__)

    def play(self) -> Played:
        """All variants, one after the other."""
        model = build(self.model, dict(self.settings))
        ran = [_ran(changed(self.scene, numbers), model) for numbers in self.variants]
        if not self.shown:
            return Played(runs=tuple(one for one, _ in ran))
        base, first = base_of(self.scene), ran[0][1]
        return Played(
            runs=tuple(one for one, _ in ran),
            history="" if first is None else _rows(first),
            said=tuple(criterion.says(self.scene, base) for criterion in CRITERIA),
        )


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
    reach: dict[Side, float] = {
        side: largest_reach(history, scene, side) for side in get_args(Side)
    }
    found = Ran(
        outcome=history.outcome,
        motion=motion_of(history, scene),
        slid=largest_slip(history),
        reach=reach,
    )
    return found, history


def _rows(history: History) -> str:
    """The history as CSV, of at most `MOST_ROWS` rows."""
    every = -(-len(history.channels["t"]) // MOST_ROWS)
    columns: dict[str, Any] = {n: v[::every] for n, v in history.channels.items()}
    return columns_text(columns)


@dataclass(frozen=True)
class Certainty(Task):
    """How sure a run is; `samples` (0: none) draws of its uncertain numbers."""

    of: tuple[str, ...]
    given: UncertainScene = field(repr=False, compare=False)
    scene: Scene = field(repr=False)
    model: str
    settings: tuple[tuple[str, Any], ...] = ()
    samples: int = 0

    @property
    def label(self) -> str:
        """Which run."""
        return ", ".join(self.of)

    def depends(self) -> Any:
        """The scene, what is not known of it, the model, and the code."""
        cell = provenance.cell_key(self.scene, self.model, dict(self.settings))
        spreads = {name: spread.model_dump() for name, spread in self.given.spreads.items()}
        drawn = [self.samples, spreads, self.given.correlation.tolist()] if self.samples else []
        return cell, drawn, provenance.code_digest(__name__)

    def play(self) -> Sure:
        """The run at coarser steps or a finer tolerance, under other laws of impacts, and its
        draws.
        """
        landing = parting_landing(self.scene)
        return Sure(
            numerical=numerical_uncertainty(build(self.model, dict(self.settings)), self.scene),
            depends_on_law_from_s=None if landing is None else landing.t,
            inputs=propagate(self.given, samples=self.samples).inputs if self.samples else None,
        )
