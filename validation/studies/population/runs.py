"""Runs of an assessment: what one is, what it gives, and which runs are made."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
from pydantic import Field

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import History, InputError, ModelFailure, Scene, Wall, files, writing
from rockcheck.validation.criteria import CRITERIA, base_of
from rockcheck.validation.discrepancy import figures, impact_laws
from rockcheck.validation.discrepancy.compare import Motion, largest_reach, largest_slip, motion_of
from rockcheck.validation.execute import models
from rockcheck.validation.studies.population.study import (
    A_RUN,
    SOON,
    SWIFT,
    OneScene,
    Population,
    effort,
)
from rockcheck.validation.study import Study, Task
from rockcheck.validation.uncertainty import population
from rockcheck.validation.uncertainty.numerical import Numerical, numerical_uncertainty

Side = Literal["left", "right"]
Numbers = tuple[tuple[str, float], ...]
#: Rows of a history that is kept, at the most.
MOST_ROWS = 2000
#: Runs of one task, at the most.
MOST_RUNS = 256
_SEED = 1
#: Name of the runs by the other law of impacts, among the models; and the law that is compared.
LAW, OTHER_LAW = "impact law", {"impacts": "floor-first"}


class Ran(figures.Stored):
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


class Played(figures.Stored):
    """The runs of a task, in the order of its variants.

    Of the first variant, where they were asked for: `history` as CSV, and `said`, by hand method
    whether its event happens, and how far it goes.
    """

    runs: tuple[Ran, ...]
    history: str = ""
    said: tuple[tuple[bool, float | None], ...] = ()


class Sure(figures.Stored):
    """How sure a run is: its numerical uncertainty, its law of impacts, its inputs.

    `depends_on_law_from_s` is the time (s) from which the run depends on the law of impacts;
    `inputs` is the effect of its uncertain numbers.
    """

    numerical: Numerical | None = None
    depends_on_law_from_s: float | None = None
    inputs: population.Inputs | None = None


@dataclass(frozen=True)
class Run(OneScene):
    """Runs of one scene: as it is, or with numbers changed.

    A gap that is infinite takes the wall away. `shown` asks for the history and for hand methods.
    """

    variants: tuple[Numbers, ...] = field(default=((),), repr=False)
    shown: bool = False

    def play(self) -> Played:
        """All variants, one after the other."""
        model = models.build(self.model, dict(self.settings))
        ran = [_ran(self.scene, numbers, model) for numbers in self.variants]
        runs, history = tuple(one for one, _ in ran), ran[0][1]
        if not self.shown:
            return Played(runs=runs)
        base, rows = base_of(self.scene), ""
        if history is not None:
            every = -(-len(history.channels["t"]) // MOST_ROWS)
            columns: dict[str, Any] = {n: v[::every] for n, v in history.channels.items()}
            rows = writing.columns_text(columns)
        return Played(
            runs=runs,
            history=rows,
            said=tuple(criterion.says(self.scene, base) for criterion in CRITERIA),
        )


def _ran(scene: Scene, numbers: Numbers, model: Any) -> tuple[Ran, History | None]:
    """A run of the scene with these numbers; a wall whose gap is infinite is taken away."""
    gone = [place.split(".")[1] for place, value in numbers if value == np.inf]
    scene = files.with_numbers(scene, {place: v for place, v in numbers if v != np.inf})
    if gone:
        scene = scene.replace(walls=[w for w in scene.walls if w.side not in gone])
    try:
        history = model.simulate(scene)
    except ModelFailure as failure:
        return Ran(outcome="", reason=str(failure)), None
    return Ran(
        outcome=history.outcome,
        motion=motion_of(history, scene),
        slid=largest_slip(history),
        reach={side: largest_reach(history, scene, side) for side in get_args(Side)},
    ), history


@dataclass(frozen=True)
class Certainty(OneScene):
    """How sure a run is; with `samples` draws of the uncertain numbers of `given`, if any."""

    samples: int = 0
    given: files.UncertainScene | None = field(default=None, repr=False, compare=False)

    def depends(self) -> Any:
        """Also what is not known of the scene, where it is drawn."""
        return super().depends(), self.given and (
            {name: spread.model_dump() for name, spread in self.given.spreads.items()},
            self.given.correlation.tolist(),
        )

    def play(self) -> Sure:
        """Plays coarser steps or a finer tolerance, other laws of impacts, and the draws."""
        landing = impact_laws.parting_landing(self.scene)
        return Sure(
            numerical=numerical_uncertainty(
                models.build(self.model, dict(self.settings)), self.scene
            ),
            depends_on_law_from_s=None if landing is None else landing.t,
            inputs=population.propagate(self.given, samples=self.samples) if self.given else None,
        )


@dataclass(frozen=True, kw_only=True)
class Asked(Study):
    """What an assessment is asked for, and its tasks.

    `cases` are the scene under each of its motions, by their names. `own` is the
    scene with its own excitation. The first of `models` plays each case; the others are compared
    with it; `settings` are theirs, by model. `gaps` (m) are those of the walls on `sides`.
    `samples` numbers are drawn for each case and gap, or, without records, for the single run.
    `levels` is the population over intensities.
    """

    own: files.UncertainScene
    cases: Mapping[str, files.UncertainScene]
    models: Sequence[str] = (SWIFT,)
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    gaps: Sequence[float] = ()
    sides: Sequence[Side] = ()
    samples: int = 0
    recorded: bool = False
    levels: Population | None = None
    left_out: Sequence[str] = ()
    record = population.Runs | Played | Sure
    name = "assess"

    @property
    def model(self) -> str:
        """The model that plays each case."""
        return self.models[0]

    @property
    def swift(self) -> str:
        """The event-based model that plays draws and gaps."""
        return self.model if isinstance(models.build(self.model, {}), EventBasedModel) else SWIFT

    @cached_property
    def draws(self) -> tuple[Numbers, ...]:
        """The numbers of each draw, the same for every case.

        Empty without records: the numbers are then drawn about the single run.
        """
        first = next(iter(self.cases.values()))
        if not (self.samples and self.recorded):
            return ()
        from scipy.stats import qmc

        sobol = qmc.Sobol(len(first.spreads), seed=np.random.default_rng(_SEED))
        for row in (values := first.values(sobol.random(self.samples))):
            first.at(row)  # names a draw that is no scene
        return tuple(tuple(zip(first.names, row, strict=True)) for row in values.tolist())

    def _runs(
        self,
        what: str,
        model: str,
        variants: Sequence[Numbers] = ((),),
        settings: Mapping[str, Any] | None = None,
    ) -> dict[str, list[Task]]:
        """By case, runs as tasks of at most `MOST_RUNS`; those of the case as it is are `shown`."""
        given = self.settings.get(model, {}) if settings is None else settings
        return {
            case: [
                Run(
                    (what, case, "" if model == self.model else model),
                    one.scene,
                    model,
                    tuple(given.items()),
                    part,
                    shown=not what and model == self.model,
                    where=self._where,
                    **effort(model, given, len(part)),
                )
                for part in [
                    tuple(variants[first : first + MOST_RUNS])
                    for first in range(0, len(variants), MOST_RUNS)
                ]
            ]
            for case, one in self.cases.items()
        }

    @cached_property
    def _where(self) -> Literal["worker", "here"]:
        """In this process where all of it takes less than a worker needs to start."""
        runs = len(self.cases) * (6 + len(self.draws)) * (1 + len(self.gaps))
        return (
            "here"
            if all(models.family(model).compiled for model in self.models) and runs * A_RUN < SOON
            else "worker"
        )

    @cached_property
    def at_gaps(self) -> dict[float, dict[str, list[Task]]]:
        """The runs at each gap, without the walls at an infinite one."""
        found = {}
        for gap in (*self.gaps, np.inf) if self.sides else ():
            walls = {f"walls.{side}.gap": gap for side in self.sides}
            variants = [tuple({**dict(one), **walls}.items()) for one in self.draws or ((),)]
            found[gap] = self._runs(
                "without the wall" if gap == np.inf else f"gap {gap:g} m", self.swift, variants
            )
        return found

    @cached_property
    def parts(self) -> dict[Any, dict[str, list[Task]]]:
        """Tasks by what they are for and by case.

        "shown" each case as it is; "drawn" its draws; `gaps`; the names of other models, `LAW`
        among them; "sure" how sure each is, and, by the name "", the scene under its own motion.
        """
        law = (
            {LAW: self._runs("other law of impacts", SWIFT, settings=OTHER_LAW)}
            if self.model == SWIFT and self.own.scene.walls
            else {}
        )
        settings = self.settings.get(self.model, {})
        drawn = bool(self.samples) and not self.recorded
        return {
            "shown": self._runs("", self.model),
            "drawn": self._runs("draws", self.swift, self.draws),
            **self.at_gaps,
            **{model: self._runs("", model) for model in self.models[1:]},
            **law,
            "sure": {
                case: [
                    Certainty(
                        ("certainty", case or given.scene.name),
                        given.scene,
                        self.model,
                        tuple(settings.items()),
                        self.samples if drawn else 0,
                        given if drawn else None,
                        where=self._where,
                        **effort(self.model, settings, 4),
                    )
                ]
                for case, given in {"": self.own, **(self.cases if self.recorded else {})}.items()
            },
        }

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Task]:
        """All of them at once."""
        return [
            *(task for part in self.parts.values() for some in part.values() for task in some),
            *(self.levels.batches if self.levels else ()),
        ]


def gaps_of(text: str, scene: Scene) -> tuple[tuple[float, ...], tuple[Side, ...], Scene]:
    """Gaps (m), their sides, and the scene with the walls that `--gaps` asks for.

    `0.05,0.1` are gaps of the scene's walls, `left:0.05,0.1` of that side, where a wall without
    rebound is put if there is none. Raises `InputError`.
    """
    side, colon, numbers = text.rpartition(":")
    known = [wall.side for wall in scene.walls]
    sides: tuple[Any, ...] = (side,) if colon else tuple(known)
    if colon and side not in get_args(Side):
        raise InputError(f"{side!r} is not allowed: left or right", "--gaps")
    try:
        gaps = sorted({float(word) for word in numbers.split(",")})
    except ValueError:
        gaps = [-1.0]
    if not all(0.0 <= gap < np.inf for gap in gaps):
        raise InputError(
            f"{text!r} is not allowed: clear gaps in m, 0 or more, with commas between", "--gaps"
        )
    if not sides:
        raise InputError(
            f"the scene has no wall: say on which side, as in left:{numbers}", "--gaps"
        )
    new = [Wall(side=one, gap=gaps[-1]) for one in sides if one not in known]
    return tuple(gaps), sides, scene.replace(walls=[*scene.walls, *new])
