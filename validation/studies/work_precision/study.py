"""`rockcheck benchmark`: run time against error, batches, savings, convergence, as one study."""

import itertools
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from rockcheck.validation.execute import models, pool
from rockcheck.validation.finding import Block, Finding, Table
from rockcheck.validation.studies.work_precision import benchmark_scenes, savings, timings
from rockcheck.validation.studies.work_precision.convergence_blocks import convergence_blocks
from rockcheck.validation.studies.work_precision.lines import LINES, DiagramLine
from rockcheck.validation.studies.work_precision.run_blocks import run_blocks
from rockcheck.validation.studies.work_precision.runs import BenchmarkRun, Play
from rockcheck.validation.studies.work_precision.sentences import answer
from rockcheck.validation.studies.work_precision.timing_blocks import (
    batch_blocks,
    cold_start_table,
    saving_table,
    size_table,
)
from rockcheck.validation.study import Study, Task

What = Literal["all", "ebm", "models", "skipping", "convergence"]
#: Usual CPU time of an engine's step, and of any other run, s: for the estimate.
A_STEP, A_RUN = 4e-5, 0.02
#: Fresh processes whose start is timed, of which the median counts.
COLD_STARTS = 3
#: An engine's step (s) below which its runs are played side by side in worker processes, after all
#: others; and the longest one (s) that in a quick run only one member plays.
SIDE_BY_SIDE = QUICK_STEP = 1e-4


@dataclass(frozen=True)
class Measure(Task):
    """A timing other than a model's run: a batch, its size, a cold start, a saving."""

    kind: Literal["batch", "size", "cold start", "saving"]
    name: str
    size: int = 0

    def play(self) -> Sequence[Any]:
        """The rows of the timing."""
        return [*TIMED[self.kind](self.name, self.size)]


#: Timings by kind: a name and a size give rows.
TIMED: Mapping[str, Callable[[str, int], Iterable[Any]]] = {
    "batch": timings.batch_times,
    "size": lambda name, size: [timings.batch_size(size, int(name))],
    "cold start": lambda name, size: [timings.cold_start(cached=name == "filled", times=size)],
    "saving": savings.measured,
}
RowKind = TypeVar("RowKind")
Row = BenchmarkRun | timings.BatchTime | timings.BatchSize | timings.ColdStart | savings.Saving


@dataclass(frozen=True)
class WorkPrecision(Study):
    """The measurements: all, or a part; `quick` with fewer scenes and settings."""

    what: What = "all"
    quick: bool = False
    name = "benchmark"
    record = list[Row]

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Task]:
        """All at once; what is timed first."""
        parts: dict[What, Iterable[Task]] = {
            "ebm": self._timings(),
            "skipping": self._savings(),
            "models": self._runs(),
            "convergence": self._wall_runs(),
        }
        return [task for name, part in parts.items() if self.what in ("all", name) for task in part]

    def _timings(self) -> Iterator[Task]:
        """Batches, their sizes, cold starts."""
        nodes = 20 if self.quick else timings.NODES
        for name in timings.CASES:
            yield Measure("batch", name, nodes, where="timed", expected=nodes**2 / 1000.0)
        sizes = timings.QUICK_SIZES if self.quick else timings.SIZES
        for size, threads in itertools.product(sizes, sorted({1, os.cpu_count() or 1})):
            yield Measure("size", f"{threads}", size, where="timed", expected=6e-5 * size)
        if not self.quick:
            yield Measure("cold start", "none", 1, where="timed", expected=15.0)
        times = 1 if self.quick else COLD_STARTS
        yield Measure("cold start", "filled", times, where="timed", expected=1.5 * times)

    def _savings(self) -> Iterator[Task]:
        rounds = savings.QUICK_ROUNDS if self.quick else savings.SAVING_ROUNDS
        for name in savings.KINDS:
            # Of batches there is a quick kind.
            if not name.startswith("batches") or name.endswith("quick") == self.quick:
                yield Measure("saving", name, rounds, where="timed", expected=0.6 * rounds)

    def _runs(self) -> Iterator[Task]:
        """Interleaved, so that other load of the machine affects all models equally.

        An engine's smallest steps go to the workers, in a quick run all steps. There one member
        plays those of `QUICK_STEP`, and adaptive ones that cost as much.
        """
        members = benchmark_scenes.QUICK_MEMBERS if self.quick else benchmark_scenes.MEMBERS
        families = benchmark_scenes.QUICK if self.quick else benchmark_scenes.FAMILIES
        settings = [
            (line, value)
            for line in installed_lines()
            for value in (line.quick if self.quick else line.values)
        ]
        for member, family, (line, value) in itertools.product(range(members), families, settings):
            step = value if line.knob == "time_step" else math.inf
            if self.quick and member and (step <= QUICK_STEP or line.steps_are_dear):
                continue
            yield Play(
                family,
                member,
                line.label,
                value,
                where="worker" if self.quick or step < SIDE_BY_SIDE else "timed",
                clocked=True,
                expected=usual_time(line, value, 3.0),
            )

    def _wall_runs(self) -> Iterator[Task]:
        """The finest setting first; an engine that cannot bounce plays walls that do not."""
        finest_first = (1, 0) if self.quick else (2, 1, 0)
        scenes = benchmark_scenes.QUICK_WALLS if self.quick else benchmark_scenes.WALLS
        for place, line, name in itertools.product(finest_first, installed_lines(), scenes):
            if place >= len(line.converge):
                continue
            bounces = benchmark_scenes.WALLS[name].walls[0].restitution > 0.0
            if bounces and line.lacks_restitution:
                continue
            value = line.converge[place]
            yield Play(name, 0, line.label, value, 1, expected=usual_time(line, value, 4.0))

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The tables and diagrams of what was measured."""
        blocks = blocks_of(rows_of(done))
        part = "" if self.what == "all" else f": {self.what}"
        return Finding(
            self.name,
            f"Benchmark{part}{', quick' if self.quick else ''}",
            answer({block.name: block.records() for block in blocks if isinstance(block, Table)}),
            blocks,
        )


def installed_lines() -> list[DiagramLine]:
    """The lines of the diagrams whose model can be played here."""
    return [line for line in LINES.values() if not models.not_installed(line.family)]


def usual_time(line: DiagramLine, value: float, seconds: float) -> float:
    """The usual CPU time (s) of a run that simulates some `seconds`."""
    return A_STEP * seconds / value if line.knob == "time_step" else A_RUN


def rows_of(done: Mapping[Any, Any]) -> list[Row]:
    """All rows that were measured, then those of runs that failed."""
    rows: list[Row] = []
    failed: list[Row] = []
    for task, result in done.items():
        if not isinstance(result, pool.Failure):
            rows += result
        elif isinstance(task, Play):
            failed.append(task.record(failure=result.reason))
    return rows + failed


def blocks_of(rows: Sequence[Row]) -> list[Block]:
    """The blocks of each kind of row, where there are rows."""
    runs = rows_of_kind(rows, BenchmarkRun)
    beside_walls = [run for run in runs if run.family in benchmark_scenes.WALLS]
    plain = [run for run in runs if run.family not in benchmark_scenes.WALLS]
    times = rows_of_kind(rows, timings.BatchTime)
    tables = (
        cold_start_table(rows_of_kind(rows, timings.ColdStart)),
        size_table(rows_of_kind(rows, timings.BatchSize)),
        saving_table(rows_of_kind(rows, savings.Saving)),
    )
    return [
        *(run_blocks(plain) if plain else ()),
        *(convergence_blocks(beside_walls) if beside_walls else ()),
        *(batch_blocks(times) if times else ()),
        *(table for table in tables if table.rows),
    ]


def rows_of_kind(rows: Sequence[Row], kind: type[RowKind]) -> list[RowKind]:
    """The rows of one kind, in their order."""
    return [row for row in rows if isinstance(row, kind)]
