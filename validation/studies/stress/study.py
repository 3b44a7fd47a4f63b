"""`rockcheck stress`: random runs of every model, what they break, and minimal failing scenes.

In: a seed, numbers of runs, models. Out: tasks, and the finding. Called by the command.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from rockcheck.validation.execute import pool
from rockcheck.validation.execute.models import not_installed
from rockcheck.validation.finding import Finding, Verdict
from rockcheck.validation.studies.stress.invariants import CheckedRun
from rockcheck.validation.studies.stress.maps import MapResult, map_points
from rockcheck.validation.studies.stress.players import PLAYERS, EventBased
from rockcheck.validation.studies.stress.runs import Chunk, RunTotals, Shrinking, limits, parts
from rockcheck.validation.studies.stress.shrinking import MOST_TRIALS
from rockcheck.validation.studies.stress.tables import map_blocks, run_tables
from rockcheck.validation.study import Study, Task

What = Literal["all", "runs", "maps"]
#: Runs in one task, and those of slow players.
CHUNK, SLOW_CHUNK = 250, 20
#: Trials by which all failures may be shrunk, in a whole run and in a quick one.
SHRINKING, SHRINKING_QUICK = 8000, 1600


@dataclass(frozen=True)
class Stress(Study):
    """The parts that are played: all, runs or maps.

    `runs` of each of the `models`; by default those of `PLAYERS`, of all that are installed.
    """

    what: What = "all"
    seed: int = 1
    quick: bool = False
    runs: int | None = None
    models: Sequence[str] = ()
    name = "stress"
    record = RunTotals | MapResult | str
    memory_mb = 4096.0

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Task]:
        """Runs and points of maps; smaller tasks for those that are lost; then failures shrink."""
        lost = [task for task, result in done.items() if isinstance(result, pool.Failure)]
        work: list[Task] = [*self._chunks()]
        if self.what != "runs":
            work += map_points(self.quick, self.models)
        for task in lost:
            work += parts(task)
        if any(task not in done for task in work):
            return work
        lost_runs = {
            (task.model, task.first) for task in lost if isinstance(task, Chunk) and task.count == 1
        }
        failures = [
            failure
            for totals in self._totals(done)
            for failure in totals.shown
            if (failure.model, failure.number) not in lost_runs
        ]
        all_trials = SHRINKING_QUICK if self.quick else SHRINKING
        trials = min(MOST_TRIALS, all_trials // max(1, len(failures)))
        work += [
            Shrinking(failure, trials, **limits(failure.model, trials)) for failure in failures
        ]
        return work

    def _chunks(self) -> Iterator[Chunk]:
        """The runs, the slowest models first, so that all cores end together."""
        if self.what == "maps":
            return
        labels = self.models or [label for label in PLAYERS if not not_installed(label.split()[0])]
        for label in sorted(labels, key=lambda label: not PLAYERS[label].slow):
            player = PLAYERS[label]
            count = self.runs or (player.quick if self.quick else player.runs)
            most = SLOW_CHUNK if player.slow else CHUNK
            most = max(10, min(most, count // 4)) if self.quick else most
            for first in range(0, count, most):
                runs = min(most, count - first)
                yield Chunk(label, self.seed, first, runs, **limits(label, runs))

    def _totals(self, done: Mapping[Any, Any]) -> list[RunTotals]:
        """Totals of the models; a run whose process was lost counts as one that does not end."""
        totals = {label: RunTotals(model=label) for label in PLAYERS}
        for task, result in done.items():
            if isinstance(result, RunTotals):
                totals[task.model].add(result)
            elif isinstance(task, Chunk) and task.count == 1:
                failed = CheckedRun(figures={"ends": math.inf}, failure=result.reason)
                totals[task.model].see(failed, task.seed, task.first)
        return [total for total in totals.values() if total.counts]

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The tables, the maps, and the scenes of failures."""
        totals = self._totals(done)
        judged = [total for total in totals if isinstance(PLAYERS[total.model], EventBased)]
        failures = sum(len(total.failures) for total in judged)
        runs = sum(total.counts["runs"] for total in totals)
        points = map_points(self.quick, self.models)
        results = {point: done[point] for point in points if isinstance(done.get(point), MapResult)}
        verdict: Verdict = ""
        words = "none of an event-based model"
        if failures:
            verdict = "fail"
            words = f"failures of event-based models: {failures}"
        elif judged:
            verdict = "pass"
            words = "no failure of an event-based model"
        return Finding(
            self.name,
            "Stress: random scenes against what must always hold",
            f"seed {self.seed}: {runs:,} runs, {words}",
            [*(run_tables(totals) if totals else ()), *map_blocks(results, self.quick)],
            data={
                "seed": self.seed,
                "quick": self.quick,
                "batches": {
                    total.model: vars(total) | {"failures": len(total.failures)} for total in totals
                },
            },
            verdict=verdict,
            exit_code=1 if failures else 0,
            files=self._scene_files(totals, done),
        )

    def _scene_files(self, totals: Sequence[RunTotals], done: Mapping[Any, Any]) -> dict[str, str]:
        """By path: the smallest scene of each failure that is shown."""
        smallest = {task.broken: result for task, result in done.items() if isinstance(result, str)}
        texts = {}
        for total in totals:
            for failure in total.shown:
                scene_text = smallest.get(failure)
                if not scene_text:
                    scene_text = failure.text(failure.scene, "as it was found: not shrunk in time")
                texts[f"failures/{failure.name}"] = scene_text
        return texts
