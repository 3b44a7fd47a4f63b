"""The engineer's questions: does the block fall, how far does it move, and how sure is that.

Also: which gap is safe, at which intensity does it fall, and what would hand methods have said. One
scene under its own base motion or under records; each run again with its numbers drawn, with other
gaps, by other models.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from rockcheck.scenes import InputError, Scene, Wall
from rockcheck.validation.execute.models import family
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.finding import Finding
from rockcheck.validation.studies.population.answers import LAW, SWIFT, Asked, Found, finding_of
from rockcheck.validation.studies.population.runs import (
    A_RUN,
    SOON,
    Certainty,
    Numbers,
    Played,
    Ran,
    Run,
    Side,
    Sure,
    effort,
)
from rockcheck.validation.study import Study, Task
from rockcheck.validation.uncertainty.population import Runs

#: The law of impacts that is compared.
OTHER_LAW = {"impacts": "floor-first"}
#: Runs of one task, at the most.
MOST_RUNS = 256


@dataclass(frozen=True, kw_only=True)
class Assessment(Asked, Study):
    """An assessment of a scene."""

    record = Runs | Played | Sure
    name = "assess"

    def _runs(
        self,
        what: str,
        case: str,
        model: str,
        variants: Sequence[Numbers] = ((),),
        settings: Mapping[str, Any] | None = None,
    ) -> list[Run]:
        """Runs as tasks of at most `MOST_RUNS`; those of the case as it is are `shown`."""
        given = self.settings.get(model, {}) if settings is None else settings
        parts = [
            tuple(variants[first : first + MOST_RUNS])
            for first in range(0, len(variants), MOST_RUNS)
        ]
        return [
            Run(
                (what, case, "" if model == self.model else model),
                self.cases[case].scene,
                model,
                tuple(given.items()),
                part,
                shown=not what and model == self.model,
                where=self._where,
                **effort(model, given, len(part)),
            )
            for part in parts
        ]

    @cached_property
    def _where(self) -> Literal["worker", "here"]:
        """In this process where all of it takes less than a worker needs to start."""
        runs = len(self.cases) * (6 + len(self.draws)) * (1 + len(self.gaps))
        fast = all(family(model).compiled for model in self.models)
        return "here" if fast and runs * A_RUN < SOON else "worker"

    @cached_property
    def shown(self) -> dict[str, list[Run]]:
        """The run of each case as it is."""
        return {case: self._runs("", case, self.model) for case in self.cases}

    @cached_property
    def drawn(self) -> dict[str, list[Run]]:
        """The draws of each case."""
        return {case: self._runs("draws", case, self.swift, self.draws) for case in self.cases}

    @cached_property
    def at_gaps(self) -> dict[tuple[str, float], list[Run]]:
        """The runs of each case at each gap, without the walls at an infinite one."""
        gaps = [*self.gaps, np.inf] if self.sides else []
        found = {}
        for case, gap in itertools.product(self.cases, gaps):
            walls = {f"walls.{side}.gap": gap for side in self.sides}
            variants = [tuple({**dict(one), **walls}.items()) for one in self.draws or ((),)]
            what = "without the wall" if gap == np.inf else f"gap {gap:g} m"
            found[case, gap] = self._runs(what, case, self.swift, variants)
        return found

    @cached_property
    def others(self) -> dict[tuple[str, str], list[Run]]:
        """The run of each case by each other model, and under the other law of impacts."""
        by: dict[str, Any] = {model: ("", model, None) for model in self.models[1:]}
        if self.model == SWIFT and self.own.scene.walls:
            by[LAW] = "other law of impacts", SWIFT, OTHER_LAW
        return {
            (name, case): self._runs(what, case, model, settings=settings)
            for name, (what, model, settings) in by.items()
            for case in self.cases
        }

    @cached_property
    def certainties(self) -> dict[str, list[Certainty]]:
        """How sure each case is, and, by the name "", the scene under its own excitation."""
        settings = self.settings.get(self.model, {})
        own = {"": self.own, **(self.cases if self.recorded else {})}
        return {
            case: [
                Certainty(
                    ("certainty", case or given.scene.name),
                    given.scene,
                    self.model,
                    tuple(settings.items()),
                    0 if case or self.recorded else self.samples,
                    given,
                    where=self._where,
                    **effort(self.model, settings, 4),
                )
            ]
            for case, given in own.items()
        }

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Task]:
        """All of them at once."""
        parts = (self.shown, self.drawn, self.at_gaps, self.others, self.certainties)
        own = [task for part in parts for some in part.values() for task in some]
        return [*own, *(self.levels.tasks(done) if self.levels else ())]

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The answers to the engineer's questions."""
        ended: dict[Any, Any] = {
            task: one for task, one in done.items() if isinstance(one, Played | Sure)
        }

        def first(tasks: Mapping[Any, Sequence[Task]]) -> dict[Any, Any]:
            return {key: ended[some[0]] for key, some in tasks.items() if some[0] in ended}

        def runs(tasks: Sequence[Run]) -> list[Ran]:
            return [run for task in tasks if task in ended for run in ended[task].runs]

        at_gaps: dict[float, list[Ran]] = {gap: [] for _, gap in self.at_gaps}
        for (_, gap), tasks in self.at_gaps.items():
            at_gaps[gap] += [run for run in runs(tasks) if not run.reason]
        found = finding_of(
            Found(
                study=self,
                shown=first(self.shown),
                drawn={
                    case: some
                    for case, tasks in self.drawn.items()
                    if len(some := runs(tasks)) == len(self.draws) > 0
                },
                free=at_gaps.pop(np.inf, []),
                at_gaps=at_gaps,
                others={
                    model: {case: one.runs[0] for (_, case), one in some}
                    for model, some in itertools.groupby(
                        first(self.others).items(), lambda item: item[0][0]
                    )
                },
                sure=first(self.certainties),
                levels=self.levels.gather(done) if self.levels else None,
            )
        )
        return _failed(found, done)


def _failed(found: Finding, done: Mapping[Any, Any]) -> Finding:
    """The finding, with the exit code of a model that failed where a task did."""
    failed = any(isinstance(one, Failure) for one in done.values())
    return replace(found, exit_code=3) if failed else found


def gaps_of(text: str, scene: Scene) -> tuple[tuple[float, ...], tuple[Side, ...], Scene]:
    """Gaps (m), their sides, and the scene with the walls that `--gaps` asks for.

    `0.05,0.1` are gaps of the scene's walls, `left:0.05,0.1` of that side, where a wall without
    rebound is put if there is none. Raises `InputError`.
    """
    side, colon, numbers = text.rpartition(":")
    known_sides: tuple[Side, ...] = tuple(wall.side for wall in scene.walls)
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
    if not colon and not known_sides:
        raise InputError(
            f"the scene has no wall: say on which side, as in left:{numbers}", "--gaps"
        )
    if not colon:
        return tuple(gaps), known_sides, scene
    chosen: Side = "left" if side == "left" else "right"
    if chosen not in known_sides:
        scene = scene.replace(walls=[*scene.walls, Wall(side=chosen, gap=gaps[-1])])
    return tuple(gaps), (chosen,), scene
