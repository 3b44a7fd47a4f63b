"""The engineer's question: does the block fall, how far does it move, how sure is that, which gap
is safe, at which intensity does it fall, and what would hand methods have said.

One scene under its own base motion or under records; each run again with its numbers drawn, with
other gaps, by other models.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import InputError, Scene, Wall
from rockcheck.scenes.files import UncertainScene
from rockcheck.validation.execute.models import build, family
from rockcheck.validation.finding import Finding
from rockcheck.validation.studies.population.answers import LAW, Found, finding_of
from rockcheck.validation.studies.population.runs import (
    Certainty,
    Numbers,
    Played,
    Ran,
    Run,
    Side,
    Sure,
)
from rockcheck.validation.studies.population.study import A_RUN, A_SLOW_RUN, SOON, Population
from rockcheck.validation.study import Study, Task
from rockcheck.validation.uncertainty.population import Runs

#: The model of runs that are drawn or have another gap, and its law of impacts that is compared.
SWIFT, OTHER_LAW = "ebm-unilateral", {"impacts": "floor-first"}
#: Runs of one task, at the most.
MOST_RUNS = 256
_SEED = 1


@dataclass(frozen=True, kw_only=True)
class Assessment(Study):
    """An assessment of a scene: `cases` are the scene under each of its motions, by their names.

    `own` is the scene with its own excitation. The first of `models` plays each case; the others
    are compared with it; `settings` are theirs, by model. `gaps` (m) are those of the walls on
    `sides`. `samples` numbers are drawn for each case and gap, or, without records, for the single
    run. `levels` is the population over intensities.
    """

    own: UncertainScene
    cases: Mapping[str, UncertainScene]
    models: Sequence[str] = (SWIFT,)
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    gaps: Sequence[float] = ()
    sides: Sequence[Side] = ()
    samples: int = 0
    recorded: bool = False
    levels: Population | None = None
    left_out: Sequence[str] = ()
    record = Runs | Played | Sure
    name = "assess"

    @property
    def model(self) -> str:
        """The model that plays each case."""
        return self.models[0]

    @property
    def swift(self) -> str:
        """The event-based model that plays draws and gaps."""
        return self.model if isinstance(build(self.model, {}), EventBasedModel) else SWIFT

    @cached_property
    def draws(self) -> tuple[Numbers, ...]:
        """The numbers of each draw, the same for every case; none without records, since they are
        then drawn about the single run.
        """
        first = next(iter(self.cases.values()))
        if not (self.samples and self.recorded):
            return ()
        from scipy.stats import qmc

        chance = np.random.default_rng(_SEED)
        points = qmc.Sobol(len(first.spreads), seed=chance).random(self.samples)
        for row in (values := first.values(points)):
            first.at(row)  # names a draw that is no scene
        return tuple(tuple(zip(first.names, row, strict=True)) for row in values.tolist())

    def at_gap(self, gap: float) -> Numbers:
        """The numbers that put the walls of `sides` at that gap."""
        return tuple((f"walls.{side}.gap", gap) for side in self.sides)

    def _run(
        self, what: str, case: str, model: str, variants: Iterable[Numbers], **more: Any
    ) -> Run:
        settings = more.pop("settings", self.settings.get(model, {}))
        numbers = tuple(variants)
        fast = family(model).compiled
        expected = len(numbers) * (A_RUN if fast else A_SLOW_RUN)
        return Run(
            tuple(filter(None, (what, case, "" if model == self.model else model))),
            self.cases[case].scene,
            model,
            tuple(settings.items()),
            numbers,
            expected=expected,
            compiles=model if fast else "",
            where=self._where,
            **more,
        )

    @cached_property
    def _where(self) -> Literal["worker", "here"]:
        """In this process where all of it takes less than a worker needs to start."""
        runs = len(self.cases) * (6 + len(self.draws)) * (1 + len(self.gaps))
        fast = all(family(model).compiled for model in self.models)
        return "here" if fast and runs * A_RUN < SOON else "worker"

    @cached_property
    def shown(self) -> dict[str, Run]:
        """The run of each case as it is."""
        return {case: self._run("", case, self.model, [()], shown=True) for case in self.cases}

    @cached_property
    def drawn(self) -> dict[str, list[Run]]:
        """The draws of each case."""
        return {case: self._parts("draws", case, self.draws) for case in self.cases}

    @cached_property
    def at_gaps(self) -> dict[tuple[str, float], list[Run]]:
        """The runs of each case at each gap, without the walls at an infinite one."""
        gaps = [*self.gaps, np.inf] if self.sides else []
        return {
            (case, gap): self._parts(
                "without the wall" if gap == np.inf else f"gap {gap:g} m",
                case,
                [
                    tuple({**dict(draw), **dict(self.at_gap(gap))}.items())
                    for draw in (self.draws or ((),))
                ],
            )
            for case in self.cases
            for gap in gaps
        }

    def _parts(self, what: str, case: str, variants: Sequence[Numbers]) -> list[Run]:
        return [
            self._run(what, case, self.swift, variants[first : first + MOST_RUNS])
            for first in range(0, len(variants), MOST_RUNS)
        ]

    @cached_property
    def others(self) -> dict[tuple[str, str], Run]:
        """The run of each case by each other model, and under the other law of impacts."""
        found = {
            (model, case): self._run("", case, model, [()])
            for model in self.models[1:]
            for case in self.cases
        }
        if self.model == SWIFT and self.own.scene.walls:
            found |= {
                (LAW, case): self._run(
                    "other law of impacts", case, SWIFT, [()], settings=OTHER_LAW
                )
                for case in self.cases
            }
        return found

    @cached_property
    def certainties(self) -> dict[str, Certainty]:
        """How sure each case is, and, by the name "", the scene under its own excitation."""
        settings = tuple(self.settings.get(self.model, {}).items())
        fast = family(self.model).compiled
        own = {"": self.own, **(self.cases if self.recorded else {})}
        return {
            case: Certainty(
                ("certainty", case or given.scene.name),
                given,
                given.scene,
                self.model,
                settings,
                0 if case or self.recorded else self.samples,
                expected=4.0 * (A_RUN if fast else A_SLOW_RUN),
                compiles=self.model if fast else "",
                where=self._where,
            )
            for case, given in own.items()
        }

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Task]:
        """All of them at once."""
        return [
            *self.shown.values(),
            *(run for runs in self.drawn.values() for run in runs),
            *(run for runs in self.at_gaps.values() for run in runs),
            *self.others.values(),
            *self.certainties.values(),
            *(self.levels.tasks(done) if self.levels else ()),
        ]

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The answers to the engineer's questions."""

        def runs(tasks: Iterable[Run]) -> list[Ran]:
            found = [done.get(task) for task in tasks]
            return [run for one in found if isinstance(one, Played) for run in one.runs]

        def known(tasks: Mapping[Any, Task], kind: type) -> dict[Any, Any]:
            return {
                key: done[task] for key, task in tasks.items() if isinstance(done.get(task), kind)
            }

        first: dict[str, dict[str, Ran]] = {}
        for (model, case), played in known(self.others, Played).items():
            first.setdefault(model, {})[case] = played.runs[0]
        gaps = {
            gap: [run for (_, g), some in self.at_gaps.items() if g == gap for run in runs(some)]
            for gap in dict.fromkeys(gap for _, gap in self.at_gaps)
        }
        return finding_of(
            Found(
                own=self.own,
                model=self.model,
                swift=self.swift,
                recorded=self.recorded,
                shown=known(self.shown, Played),
                drawn={case: runs(some) for case, some in self.drawn.items()},
                inputs={
                    name: [dict(draw)[name] for draw in self.draws]
                    for name, _ in next(iter(self.draws), ())
                },
                free=gaps.pop(np.inf, []),
                at_gaps=gaps,
                sides=self.sides,
                others=first,
                sure=known(self.certainties, Sure),
                levels=self.levels.gather(done) if self.levels else None,
                left_out=self.left_out,
            )
        )


def gaps_of(text: str, scene: Scene) -> tuple[tuple[float, ...], tuple[Side, ...], Scene]:
    """What --gaps says: `0.05,0.1` of the scene's walls, or `left:0.05,0.1` of that side, where a
    wall without rebound is put if there is none. Raises `InputError`.
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
