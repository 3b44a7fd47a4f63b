"""The results of an assessment by what they are of.

In: the plan and the results of its tasks. Out: named groups of results. Made by the study; read by
all that computes, words, tabulates or draws.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

from rockcheck.scenes import Side
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.studies.population import results
from rockcheck.validation.studies.population.plan import Plan
from rockcheck.validation.uncertainty.numerical import Numerical

R = TypeVar("R")


@dataclass(frozen=True)
class Gathered:
    """The results of a plan. A task that failed, or did not end, is missing."""

    plan: Plan
    done: Mapping[Any, Any]

    def _ended(self, tasks: Mapping[str, Any], kind: type[R]) -> dict[str, R]:
        return {
            case: self.done[task]
            for case, task in tasks.items()
            if isinstance(self.done.get(task), kind)
        }

    @cached_property
    def failed(self) -> bool:
        """Whether a task failed."""
        return any(isinstance(result, Failure) for result in self.done.values())

    @cached_property
    def shown(self) -> dict[str, results.Shown]:
        """By case, the run as it is."""
        return self._ended(self.plan.shown, results.Shown)

    @cached_property
    def as_it_is(self) -> dict[str, results.RunResult]:
        """By case, the result of the run as it is."""
        return {case: shown.result for case, shown in self.shown.items()}

    @cached_property
    def runs(self) -> dict[str, list[results.RunResult]]:
        """By case, the runs that count: its draws, or, where nothing is drawn, itself.

        A run that failed is not among them.
        """
        drawn = self._ended(self.plan.drawn, results.Drawn)
        by_case = {
            case: [*drawn[case].draws] if case in drawn else [result]
            for case, result in self.as_it_is.items()
        }
        return {
            case: [run for run in runs if run.fate != results.FAILED]
            for case, runs in by_case.items()
        }

    @cached_property
    def all_runs(self) -> list[tuple[str, results.RunResult]]:
        """All runs that count, with their case."""
        return [(case, run) for case, runs in self.runs.items() for run in runs]

    @cached_property
    def drawn(self) -> dict[str, Sequence[results.RunResult]]:
        """By case, the results of all its draws, in their order."""
        drawn = self._ended(self.plan.drawn, results.Drawn)
        return {case: result.draws for case, result in drawn.items()}

    @cached_property
    def others(self) -> dict[str, dict[str, results.RunResult]]:
        """By other model and case, the run as it is."""
        return {
            model: {case: shown.result for case, shown in self._ended(tasks, results.Shown).items()}
            for model, tasks in self.plan.others.items()
        }

    @cached_property
    def by_other_law(self) -> dict[str, results.RunResult]:
        """By case, the run as it is under another law of impacts."""
        ended = self._ended(self.plan.by_other_law, results.Shown)
        return {case: shown.result for case, shown in ended.items()}

    @cached_property
    def free(self) -> dict[Side, dict[str, results.Drawn]]:
        """By side whose gap is varied and by case, the runs without the wall there."""
        return {side: self._ended(tasks, results.Drawn) for side, tasks in self.plan.free.items()}

    @cached_property
    def gaps(self) -> dict[Side, dict[str, results.GapSearch]]:
        """By side and case, the search over the gap."""
        return {
            side: self._ended(tasks, results.GapSearch)
            for side, tasks in self.plan.gap_tasks(self.done).items()
        }

    @cached_property
    def factors(self) -> dict[str, results.FactorSearch]:
        """By case, the search over the factor on its motion, also for capacities."""
        return self._ended(self.plan.factors, results.FactorSearch)

    @cached_property
    def certainty(self) -> dict[str, results.Certainty]:
        """By case, how sure it is."""
        return self._ended(self.plan.certainty(self.done), results.Certainty)

    @property
    def own_certainty(self) -> results.Certainty | None:
        """How sure the scene under its own motion is; None where that run has no result."""
        result = self.done.get(self.plan.own_certainty(self.done))
        return result if isinstance(result, results.Certainty) else None

    @cached_property
    def judged(self) -> dict[str, Numerical]:
        """By case, the numerical uncertainty of the run as it is."""
        return {
            case: result.numerical
            for case, result in self.certainty.items()
            if result.numerical is not None
        }

    @cached_property
    def sensitivities(self) -> results.Sensitivities | None:
        """Which uncertain number matters most."""
        task = self.plan.sensitivity
        result = None if task is None else self.done.get(task)
        return result if isinstance(result, results.Sensitivities) else None
