"""What an assessment asks for, and the tasks that answer it.

In: a scene with its cases (the scene under each of its motions), models, and what is varied. Out:
tasks, in waves: what is played next depends on how far the block reached. Called by the command
`assess`, through the study.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, cast

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import (
    Excitation,
    InputError,
    Record,
    Scene,
    Side,
    Wall,
    files,
    kinematics,
)
from rockcheck.validation.criteria import sampled
from rockcheck.validation.execute import models
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.studies.population import results
from rockcheck.validation.studies.population.capacities import Capacity
from rockcheck.validation.studies.population.factor_task import FactorTask
from rockcheck.validation.studies.population.intensity_measures import Measure, size_of
from rockcheck.validation.studies.population.levels import Levels
from rockcheck.validation.studies.population.tasks import (
    CertaintyTask,
    Draws,
    GapTask,
    Numbers,
    SensitivityTask,
    Settings,
    ShownRun,
    draws_of,
    effort,
)
from rockcheck.validation.study import Task

#: The event-based model that plays what is varied where the first model is none.
BATCH_MODEL = "ebm-unilateral"
#: Up to `FINE_UP_TO` (m) the scene as it is is looked at every `FINE_GAP` (m): islands of 1 mm are
#: real. Beyond it, where only a block that falls reaches, `FAR_GAPS` values are looked at.
FINE_GAP, FINE_UP_TO, FAR_GAPS = 1e-3, 0.4, 40
#: Parts of the range of gaps at which draws are looked at, and runs are counted; where the range
#: goes beyond `FINE_UP_TO`, how many of them are up to there.
COARSE_GAPS, COARSE_NEAR = 32, 24
#: Factors on a motion are looked at from where the block may move, over this range, a share apart.
FACTOR_RANGE, FACTOR_STEP = 32.0, 0.01


@dataclass(frozen=True)
class GapRange:
    """The gaps of the wall on one side that are asked for.

    `values` (m) are those that are tabulated, and bound the search; empty: from 0 to the free
    reach. `restitution` is that of a wall that the scene has not.
    """

    side: Side
    values: tuple[float, ...] = ()
    restitution: float = 0.0


@dataclass(frozen=True)
class Threshold:
    """A run by the first model at a gap, or a factor, where the batch finds a change; in words."""

    case: str
    what: str
    task: ShownRun


def _first_fall(
    tasks: Mapping[str, Task], done: Mapping[Any, Any]
) -> tuple[str, results.FallInterval] | None:
    """The lowest interval at which a case as it is does not stand, of searches that have ended."""
    falls = [
        (case, interval)
        for case, task in tasks.items()
        if isinstance(done.get(task), results.GapSearch | results.FactorSearch)
        for interval in done[task].intervals
        if interval.draw == 0
    ]
    return min(falls, key=lambda item: item[1].low, default=None)


def _both_sides(fall: results.FallInterval) -> list[float]:
    """The last value at which it stands, if there is one, and the first at which it does not."""
    return [value for value in (fall.stands_below, fall.low) if value is not None]


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What is assessed.

    `own` is the scene with its own excitation, `cases` the scene under each of its motions, by
    their names; `recorded` where these are records. The first of `models`, with their settings,
    plays each case; the others are compared with it. `draws` numbers are drawn for each case. The
    walls of `gaps` are varied; `measure` sizes the motions, `levels` is a population over given
    intensities, and of `capacities` the intensities are found that exceed them. `left_out` says
    what of the records was not played.
    """

    own: files.UncertainScene
    cases: Mapping[str, files.UncertainScene]
    models: Mapping[str, Mapping[str, Any]] = field(default_factory=lambda: {BATCH_MODEL: {}})
    gaps: Sequence[GapRange] = ()
    draws: int = 0
    recorded: bool = False
    measure: Measure | None = None
    levels: Levels | None = None
    capacities: Sequence[Capacity] = ()
    left_out: Sequence[str] = ()

    @property
    def model(self) -> str:
        """The model that plays each case."""
        return next(iter(self.models))

    @cached_property
    def batch_model(self) -> str:
        """The event-based model that plays draws, gaps and factors."""
        model = models.build(self.model, self.models[self.model])
        return self.model if getattr(model, "decides", False) else BATCH_MODEL

    @property
    def plays_itself(self) -> bool:
        """Whether the first model plays what is varied, too."""
        return self.batch_model == self.model

    @cached_property
    def batch_plays(self) -> bool:
        """Whether an event-based model can play the scene at all."""
        model = cast(EventBasedModel, models.build(self.batch_model, dict(self.batch_settings)))
        try:
            model.check(self.own.scene)
        except InputError:
            return False
        return True

    @cached_property
    def batch_settings(self) -> Settings:
        """The settings of the model that plays what is varied."""
        return tuple(self.models.get(self.batch_model, {}).items())

    @cached_property
    def numbers(self) -> dict[str, tuple[Numbers, ...]]:
        """By case, its draws. Raises `InputError` where one is no scene."""
        if not self.draws:
            return dict.fromkeys(self.cases, ())
        return {
            case: draws_of(given, self.draws) if given.spreads else ()
            for case, given in self.cases.items()
        }

    @cached_property
    def copies(self) -> int:
        """How many of the cases are under the motion of another, by another name."""
        if not self.recorded:
            return 0
        scenes = [given.scene for given in self.cases.values()]
        return len(scenes) - len(
            {(_unnamed(one.excitation), _unnamed(one.vertical)) for one in scenes}
        )

    @property
    def other_law(self) -> Mapping[str, Any] | None:
        """The first model's settings under another law of impacts; None where there is no other."""
        settings = self.models[self.model]
        if self.model != BATCH_MODEL or not self.own.scene.walls:
            return None
        other = "moreau" if settings.get("impacts") == "floor-first" else "floor-first"
        return {**settings, "impacts": other}

    @cached_property
    def shown(self) -> dict[str, ShownRun]:
        """By case, the run as it is."""
        return {
            case: self._as_it_is(case, self.model, self.models[self.model], drawn=True)
            for case in self.cases
        }

    @cached_property
    def others(self) -> dict[str, dict[str, ShownRun]]:
        """By other model and case, the run as it is."""
        return {
            model: {case: self._as_it_is(case, model, settings) for case in self.cases}
            for model, settings in self.models.items()
            if model != self.model
        }

    @cached_property
    def by_other_law(self) -> dict[str, ShownRun]:
        """By case, the run as it is under another law of impacts."""
        if self.other_law is None:
            return {}
        return {
            case: self._as_it_is(case, self.model, self.other_law, "other law of impacts")
            for case in self.cases
        }

    def _as_it_is(
        self, case: str, model: str, settings: Mapping[str, Any], law: str = "", drawn: bool = False
    ) -> ShownRun:
        return ShownRun(
            (law, case, "" if model == self.model else model),
            self.cases[case].scene,
            model,
            tuple(settings.items()),
            drawn,
            **effort(model, settings, 1, self._all_runs),
        )

    @cached_property
    def drawn(self) -> dict[str, Draws]:
        """By case with draws, all of them as they are."""
        return {case: self._draws(case) for case, numbers in self.numbers.items() if numbers}

    @cached_property
    def undrawn(self) -> dict[str, Draws]:
        """By case the run as it is, by the batch, without a history."""
        return {
            case: Draws(
                ("as it is", case),
                given.scene,
                self.batch_model,
                self.batch_settings,
                **self._batch_effort(1),
            )
            for case, given in self.cases.items()
        }

    @cached_property
    def free(self) -> dict[Side, dict[str, Draws]]:
        """By side whose gap is varied, and by case, the runs without the wall there."""
        if not self.batch_plays:
            return {}
        return {
            asked.side: {case: self._draws(case, asked.side) for case in self.cases}
            for asked in self.gaps
        }

    def _draws(self, case: str, without: Side | None = None) -> Draws:
        words = "draws" if without is None else f"without the wall on the {without}"
        return Draws(
            (words, case),
            self.cases[case].scene,
            self.batch_model,
            self.batch_settings,
            self.numbers[case],
            without,
            **self._batch_effort(1 + len(self.numbers[case])),
        )

    @cached_property
    def factors(self) -> dict[str, FactorTask]:
        """By case whose base moves, the search over the factor, for falls and capacities."""
        if not self.batch_plays:
            return {}
        return {
            case: FactorTask(
                ("intensities", case),
                given.scene,
                self.batch_model,
                self.batch_settings,
                factors=factors_of(given.scene, slides=bool(self.capacities)),
                both=given.scene.vertical != self.own.scene.vertical,
                capacities=tuple(self.capacities),
                **self._batch_effort(math.log(FACTOR_RANGE) / FACTOR_STEP),
            )
            for case, given in self.cases.items()
            if self.measure is not None and size_of(self.measure, given) > 0.0
        }

    @cached_property
    def sensitivity(self) -> SensitivityTask | None:
        """Which uncertain number matters most, of a scene under its own motion."""
        if self.recorded or not self.draws or not self.own.independent:
            return None
        return SensitivityTask(
            ("sensitivities", self.own.scene.name),
            self.own.scene,
            self.batch_model,
            self.batch_settings,
            self.own,
            **self._batch_effort(1024 * (2 + len(self.own.spreads))),
        )

    def tasks(self, done: Mapping[Any, Any]) -> list[Task]:
        """All tasks known so far, given the results of those that are `done`."""
        tasks: list[Task] = [
            *self.shown.values(),
            *(task for runs in self.others.values() for task in runs.values()),
            *self.by_other_law.values(),
            *self.drawn.values(),
            *(task for runs in self.free.values() for task in runs.values()),
            *self.factors.values(),
        ]
        if self.sensitivity is not None:
            tasks.append(self.sensitivity)
        if self.levels is not None:
            tasks += self.levels.tasks
        if any(task not in done for task in tasks):
            return tasks
        tasks += self.certainty(done).values()
        if self.recorded:  # else it is that of the first case
            tasks.append(self.own_certainty(done))
        tasks += [task for runs in self.gap_tasks(done).values() for task in runs.values()]
        if any(task not in done for task in tasks):
            return tasks
        return [*tasks, *(threshold.task for threshold in self.thresholds(done))]

    def certainty(self, done: Mapping[Any, Any]) -> dict[str, CertaintyTask]:
        """By case how sure it is, up to where its fate is known."""
        tasks = {}
        for case, given in self.cases.items():
            until = getattr(done.get(self.shown[case]), "until_s", 0.0)
            tasks[case] = self._certainty_task(case, lasting(given.scene, until))
        return tasks

    def own_certainty(self, done: Mapping[Any, Any]) -> CertaintyTask:
        """How sure the scene under its own motion is, which is no case where there are records."""
        if self.recorded:
            return self._certainty_task(self.own.scene.name, self.own.scene)
        return next(iter(self.certainty(done).values()))

    def _certainty_task(self, name: str, scene: Scene) -> CertaintyTask:
        settings = self.models[self.model]
        return CertaintyTask(
            about=("certainty", name),
            scene=scene,
            model=self.model,
            settings=tuple(settings.items()),
            **effort(self.model, settings, 4, self._all_runs),
        )

    def gap_tasks(self, done: Mapping[Any, Any]) -> dict[Side, dict[str, GapTask]]:
        """By side and case, the search over the gap, from how far the block reaches without it.

        Empty before all runs without the wall have ended, and of those that failed.
        """
        searches: dict[Side, dict[str, GapTask]] = {}
        for wanted in self.gaps:
            free = self._without_wall(wanted.side, done)
            reach = clearance_of(free, wanted.side)
            if reach is None:
                continue
            smallest = least_gap(self.own.scene, wanted.side)
            fine, coarse = gaps_looked_at(reach, wanted.values, smallest)
            searches[wanted.side] = {
                case: self._gap_task(case, wanted, runs, fine, coarse)
                for case, runs in free.items()
            }
        return searches

    def _gap_task(
        self,
        case: str,
        wanted: GapRange,
        without_wall: results.Drawn,
        fine: tuple[float, ...],
        coarse: tuple[float, ...],
    ) -> GapTask:
        """The search over the gap of one case, looked at where `GapTask` says."""
        free_runs = without_wall.results
        return GapTask(
            about=(f"gaps on the {wanted.side}", case),
            scene=self.cases[case].scene,
            model=self.batch_model,
            settings=self.batch_settings,
            draws=self.numbers[case],
            side=wanted.side,
            restitution=wanted.restitution,
            fine=fine,
            coarse=coarse,
            tabulated=wanted.values or coarse,
            reach=tuple(_reach_of(run, wanted.side) for run in free_runs),
            free_stands=tuple(run.stands for run in free_runs),
            **self._batch_effort(len(fine) + len(coarse) * len(free_runs)),
        )

    def _without_wall(self, side: Side, done: Mapping[Any, Any]) -> dict[str, results.Drawn]:
        """By case, the runs without the wall on a side that have ended and did not fail."""
        return {
            case: cast(results.Drawn, done[task])
            for case, task in self.free.get(side, {}).items()
            if task in done and not isinstance(done[task], Failure)
        }

    def thresholds(self, done: Mapping[Any, Any]) -> list[Threshold]:
        """Runs by the first model on both sides of what the batch found, where that is another.

        Of each side the gap at which a case falls first, and of the first case that a factor
        overturns that factor.
        """
        if self.plays_itself:
            return []
        found: list[Threshold] = []
        for side, tasks in self.gap_tasks(done).items():
            first = _first_fall(tasks, done)
            if first is not None:
                case, fall = first
                found += [self._at_gap(case, side, gap) for gap in _both_sides(fall)]
        first = _first_fall(self.factors, done)
        if first is not None:
            case, fall = first
            found += [self._at_factor(case, factor) for factor in _both_sides(fall)]
        return found

    def _at_gap(self, case: str, side: Side, gap: float) -> Threshold:
        scene = self.cases[case].scene
        restitution = next(asked.restitution for asked in self.gaps if asked.side == side)
        wall = scene.wall(side) or Wall(side=side, gap=gap, restitution=restitution)
        others = [other for other in scene.walls if other.side != side]
        moved = scene.replace(walls=[wall.replace(gap=gap), *others])
        return self._threshold(case, f"gap {1e3 * gap:.4g} mm", moved)

    def _at_factor(self, case: str, factor: float) -> Threshold:
        scene = self.cases[case].scene
        scaled = {"excitation": scene.excitation.scaled(factor)}
        if self.factors[case].both:
            scaled["vertical"] = scene.vertical.scaled(factor)
        return self._threshold(case, f"{factor:.4g} times its motion", scene.replace(**scaled))

    def _threshold(self, case: str, what: str, scene: Scene) -> Threshold:
        settings = self.models[self.model]
        task = ShownRun(
            (what, case, self.model),
            scene,
            self.model,
            tuple(settings.items()),
            False,
            **effort(self.model, settings, 1, self._all_runs),
        )
        return Threshold(case, what, task)

    def _batch_effort(self, runs: float) -> dict[str, Any]:
        return effort(self.batch_model, dict(self.batch_settings), runs, self._all_runs)

    @cached_property
    def _all_runs(self) -> float:
        """About how many runs there are, but for those of `levels`."""
        rows = 1.0 + max(map(len, self.numbers.values()), default=0)
        gaps = len(self.gaps) * (300.0 + COARSE_GAPS * rows)
        factors = (self.measure is not None) * math.log(FACTOR_RANGE) / FACTOR_STEP
        return len(self.cases) * (6.0 + rows + gaps + factors)


def with_levels(plan: Plan, levels: Levels) -> Plan:
    """The plan with a population over given intensities."""
    return replace(plan, levels=levels)


def _unnamed(motion: Excitation) -> Excitation:
    """A motion without the name of its file, and what was noted as that was read."""
    if isinstance(motion, Record):
        return motion.model_copy(update={"source": "", "notes": ()})
    return motion


def lasting(scene: Scene, until: float) -> Scene:
    """The scene, lasting at least until after then (s), so that its fate shows at its end."""
    enough = until + 1.0 / scene.frequency_parameter
    return scene.replace(duration=enough) if until > scene.duration else scene


def clearance_of(free: Mapping[str, results.Drawn], side: Side) -> float | None:
    """How far (m) the block reaches without the wall on that side, of all runs; None of none."""
    reaches = [
        run.reach[side] for runs in free.values() for run in runs.results if side in run.reach
    ]
    return max(reaches, default=None)


def _reach_of(run: results.RunResult, side: Side) -> float:
    """How far (m) a run reaches; a run that was not decided may reach any wall."""
    return run.reach.get(side, math.inf) if run.decided else math.inf


def least_gap(scene: Scene, side: Side) -> float:
    """The least gap (m) at which the block does not start inside the wall: 0 but for a tilt."""
    x, _, tilt, *_ = scene.initial_state
    return max(0.0, -float(kinematics.clearance(scene.block, side, 0.0, x, tilt)))


def gaps_looked_at(
    reach: float, values: Sequence[float], least: float = 0.0
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The gaps (m) at which the scene as it is is looked at, and those for its draws.

    From the `least` to the free `reach`. Where `values` are given, these are the gaps for its
    draws, and bound the others.
    """
    low, high = (min(values), max(values)) if values else (least, max(reach, least))
    fine_end = min(high, low + FINE_UP_TO)
    fine = np.arange(low, fine_end, FINE_GAP)
    far = np.linspace(fine_end, high, FAR_GAPS + 1)
    if values:
        coarse = np.array(values)
    elif high > fine_end:
        near = np.linspace(low, fine_end, COARSE_NEAR + 1)
        beyond = np.linspace(fine_end, high, COARSE_GAPS - COARSE_NEAR + 1)
        coarse = np.append(near, beyond)
    else:
        coarse = np.linspace(low, high, COARSE_GAPS + 1)
    looked = np.unique(np.round(np.concatenate([fine, far, coarse]), 12))
    return tuple(looked.tolist()), tuple(np.unique(np.round(coarse, 12)).tolist())


def factors_of(scene: Scene, *, slides: bool = False) -> tuple[float, ...]:
    """Factors on the base motion at which the scene as it is is looked at.

    The first is where a block at rest begins to rock, with `slides` to rock or slide; or a part of
    the motion as it is where it moves without the base's horizontal acceleration. Those at which it
    may rock are the same in both cases. The motion as it is is among them, unless it is too weak to
    move the block.
    """
    slopes = [pivot.arm / pivot.height for pivot in map(scene.block.pivot, results.SIDES)]
    motion = sampled(scene.excitation, scene.excitation.quiet_after)
    largest = float(np.max(np.abs(motion.samples)))
    begins_at_rest = not any(scene.initial_state[2:]) and scene.initial_height == 0.0

    def first_at(moving: float) -> float:
        moves = moving / largest
        is_still = begins_at_rest and scene.vertical.kind == "rest"
        return moves if is_still else 0.1 * min(moves, 1.0)

    rocks = first_at(min(slopes) * scene.gravity)
    below = 0
    if slides:
        slide = first_at(scene.moving_acceleration)
        below = math.ceil(math.log(rocks / slide) / FACTOR_STEP) if slide < rocks else 0
    count = math.ceil(math.log(max(FACTOR_RANGE, 1.0 / rocks)) / FACTOR_STEP)
    factors = rocks * np.exp(FACTOR_STEP * np.arange(-below, count + 1))
    return tuple(np.union1d(factors, max(1.0, factors[0])).tolist())
