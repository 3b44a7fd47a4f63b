"""`rockcheck benchmark`: run time against error, batches, savings, convergence, as one study."""

import itertools
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import Any, Literal, get_args

import numpy as np
import pandas as pd

from rockcheck.engines import registry
from rockcheck.engines.engine import Engine
from rockcheck.validation.execute import models, pool
from rockcheck.validation.finding import (
    Axis,
    Block,
    Column,
    Finding,
    Panel,
    Plot,
    Series,
    Style,
    Table,
    Text,
    text,
)
from rockcheck.validation.studies.work_precision import runs, savings, timings
from rockcheck.validation.study import Study, Task

What = Literal["all", "ebm", "models", "skipping", "convergence"]
#: Usual CPU time of an engine's step, and of any other run, s: for the estimate.
A_STEP, A_RUN = 4e-5, 0.02
#: The diagrams: a title, and how the names of their scenes begin.
SHEETS = {
    "Without a wall": ("free", "pulse", "slip"),
    "Beside a wall": ("wall",),
    "El Centro": ("fig",),
}
#: Fresh processes whose start is timed, of which the median counts.
COLD_STARTS = 3
#: How a line of the diagrams is drawn, by the end of its name.
LOOKS: Mapping[str, Style] = {"default": "dots", "adaptive": "marked"}
#: Below are rounding errors.
FLOOR = 1e-13
#: The level that no error against the other reference can fall below.
FORM = Series("model form: EBM against unilateral", style="level")


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
Row = runs.BenchmarkRun | timings.BatchTime | timings.BatchSize | timings.ColdStart | savings.Saving


@dataclass(frozen=True)
class WorkPrecision(Study):
    """The measurements: all, or a part; `quick` with fewer scenes and settings."""

    what: What = "all"
    quick: bool = False
    name = "benchmark"
    record = list[Row]

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Task]:
        """All at once; what is timed first."""
        rounds = savings.QUICK_ROUNDS if self.quick else savings.SAVING_ROUNDS
        parts: dict[What, Iterable[Task]] = {
            "ebm": self._batches(),
            "skipping": (
                Measure("saving", name, rounds, where="timed", expected=0.6 * rounds)
                for name in savings.KINDS
                if not name.startswith("batches") or name.endswith("quick") == self.quick
            ),
            "models": self._models(),
            "convergence": self._convergence(),
        }
        return [task for name, part in parts.items() if self.what in ("all", name) for task in part]

    def _batches(self) -> Iterator[Task]:
        nodes = 20 if self.quick else timings.NODES
        yield from (
            Measure("batch", name, nodes, where="timed", expected=nodes**2 / 1000.0)
            for name in timings.CASES
        )
        yield from (
            Measure("size", f"{threads}", size, where="timed", expected=6e-5 * size)
            for size in (timings.QUICK_SIZES if self.quick else timings.SIZES)
            for threads in sorted({1, os.cpu_count() or 1})
        )
        if not self.quick:
            yield Measure("cold start", "none", 1, where="timed", expected=15.0)
        times = 1 if self.quick else COLD_STARTS
        yield Measure("cold start", "filled", times, where="timed", expected=1.5 * times)

    def _models(self) -> Iterator[Task]:
        """Interleaved, so that other load of the machine affects all models equally.

        An engine's smallest steps go to the workers; in a quick run one member plays those of 1e-4
        s, and adaptive ones that cost as much.
        """
        lines = [
            (line, value)
            for line in runs.LINES.values()
            if not models.not_installed(line.family)
            for value in (line.quick if self.quick else line.values)
        ]
        for member, family, (line, value) in itertools.product(
            range(runs.QUICK_MEMBERS if self.quick else runs.MEMBERS),
            runs.QUICK if self.quick else runs.FAMILIES,
            lines,
        ):
            step = value if line.knob == "time_step" else math.inf
            dear = step <= 1e-4 or (line.knob == "largest_step" and _steps_are_dear(line.family))
            if not (self.quick and member and dear):
                yield runs.Play(
                    family,
                    member,
                    line.label,
                    value,
                    where="worker" if step < runs.SIDE_BY_SIDE else "timed",
                    clocked=True,
                    expected=_usual(line, value, 3.0),
                )

    def _convergence(self) -> Iterator[Task]:
        lines = [
            line
            for line in runs.LINES.values()
            if line.converge and not models.not_installed(line.family)
        ]
        for place, line, name in itertools.product(
            (1, 0) if self.quick else (2, 1, 0),
            lines,
            runs.QUICK_WALLS if self.quick else runs.WALLS,
        ):
            bounces = runs.WALLS[name].walls[0].restitution > 0.0
            if place < len(line.converge) and not (bounces and _lacks_restitution(line)):
                value = line.converge[place]
                yield runs.Play(name, 0, line.label, value, 1, expected=_usual(line, value, 4.0))

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The tables and diagrams of what was measured."""
        rows = [
            *itertools.chain.from_iterable(
                one for one in done.values() if not isinstance(one, pool.Failure)
            ),
            *(
                task.record(failure=one.reason)
                for task, one in done.items()
                if isinstance(task, runs.Play) and isinstance(one, pool.Failure)
            ),
        ]
        samples, times, sizes, starts, saved = (
            [row for row in rows if isinstance(row, kind)] for kind in get_args(Row)
        )
        plain, walls = (
            [one for one in samples if (one.family in runs.WALLS) == beside]
            for beside in (False, True)
        )
        parts: Sequence[tuple[Callable[[Any], Iterator[Block]], Sequence[Any]]] = (
            (_models, plain),
            (_converged, walls),
            (_batches, times),
        )
        blocks = [
            *itertools.chain.from_iterable(part(some) for part, some in parts if some),
            *(table for table in _timings(starts, sizes, saved) if table.rows),
        ]
        return Finding(
            self.name,
            f"Benchmark{'' if self.what == 'all' else f': {self.what}'}"
            f"{', quick' if self.quick else ''}",
            _answer({block.name: block.records() for block in blocks if isinstance(block, Table)}),
            blocks,
        )


def _steps_are_dear(engine: str) -> bool:
    """Whether the engine's adaptive steps cost as much as a fixed one of 1e-4 s."""
    return registry.facts_of(engine).dear_adaptive_steps


def _lacks_restitution(line: runs.DiagramLine) -> bool:
    """Whether the line is of an engine that cannot bounce, with the settings of the line."""
    model = models.build(line.family, line.settings)
    return isinstance(model, Engine) and "restitution" in model.lacks()


def _usual(line: runs.DiagramLine, value: float, seconds: float) -> float:
    """The usual CPU time (s) of a run that simulates some `seconds`."""
    return A_STEP * seconds / value if line.knob == "time_step" else A_RUN


def _answer(tables: Mapping[str, list[dict[str, Any]]]) -> str:
    """What the tables say first: the cheapest engine, the batches, the finest steps."""
    said = [
        f"The cheapest engine at an error of {runs.LEVEL:g} alpha is {row['line']}:"
        f" {row['cost']:.2g} ms of CPU a simulated second."
        for row in tables.get("league", [])[:1]
        if math.isfinite(row["cost"])
    ]
    if best := tables.get("batches-at-level"):
        costs = ", ".join(f"{row['case']} {row['evaluations']:.0f}" for row in best)
        said.append(f"A run of the event-based model costs, in right-hand sides: {costs}.")
    if levels := tables.get("levels"):
        # of each model the last row, the finest
        finest = {row["model"]: row[f"median_{runs.REFERENCES[0]}"] for row in levels}
        errors = ", ".join(f"{model} {error:.1e}" for model, error in finest.items())
        said.append(
            f"Beside a wall, median errors against {runs.REFERENCES[0]} at the finest setting,"
            f" alpha: {errors}."
        )
    return " ".join(said) or "Nothing was measured." * (not tables)


def _models(samples: Sequence[runs.BenchmarkRun]) -> Iterator[Block]:
    frame = runs.frame_of(samples)
    points, pooled = runs.points_of(frame), runs.pooled(frame)
    trends, families = runs.trends_of(points), list(dict.fromkeys(points.family))
    if standings := runs.league(pooled):
        yield Table(
            "league",
            [
                Column("line", "engine", kind="text"),
                Column("cost", f"cost at {runs.LEVEL:g} alpha", "ms", digits=2),
                Column("error", f"error at {1e3 * runs.EQUAL_COST:g} ms", "alpha", digits=2),
                Column("best", "least error", "alpha", digits=2),
                Column("best_cost", "at a cost of", "ms", digits=2),
            ],
            [
                [line, 1e3 * cost, error, best, 1e3 * best_cost]
                for line, cost, error, best, best_cost in standings
            ],
            "League of engines",
            "Free rocking and pulses. Error: RMS of theta. Cost: CPU a simulated second. Empty:"
            " not reached.",
        )
    steps = runs.first_steps(frame)
    if steps:
        yield _steps_table(steps)
    for title, starts in SHEETS.items():
        shown = [family for family in families if family.startswith(starts)]
        if shown:
            yield _diagram(title, shown, points)
    of = {(trend.line, trend.family): trend.ratio for trend in trends.itertuples()}
    labels = list(dict.fromkeys(points.line))
    yield Table(
        "ratios",
        [text("line", "model"), *(Column(family, digits=2) for family in families)],
        [[label, *(of.get((label, family)) for family in families)] for label in labels],
        f"Run time at an error of {runs.LEVEL:g} alpha, over the EBM's",
        on="page",
        folded=True,
    )
    yield Table(
        "order-spread",
        [
            text("line", "model"),
            Column("order"),
            text("ratio", f"run time / ebm's at {runs.LEVEL:g} alpha"),
            text("reached"),
        ],
        [_spread(label, trends[trends.line == label]) for label in labels],
        "Order and run time",
        "Order: median slope of the error in the swept setting.",
        folded=True,
    )
    yield Table(
        "scenes",
        [
            text("scene"),
            text("what"),
            Column("horizon", "compared up to", "s"),
            Column("model_form", "model form", "alpha", digits=2),
        ],
        [[family, runs.FAMILIES[family].words, *_about(family)] for family in families],
        "Scenes",
        on="page",
        folded=True,
    )
    kept = ["family", "line", "value", "runs", "failed", "cpu", "rms", "rms_worst"]
    engines = pooled[kept].assign(at_the_cost=runs.at_the_cost(pooled))
    how: Any = {"on": "page", "folded": True}
    yield _table(
        "engines",
        engines.rename(columns={"family": "kind"}),
        title="Engines over whole kinds of scenes",
        **how,
    )
    # The worst error is shown for engines only.
    yield _table("work-precision", points.drop(columns="rms_worst"), title="All settings", **how)
    yield _table("orders-and-ratios", trends)
    yield _table("runs", pd.DataFrame(samples))
    yield Text(title="Left out", items=runs.LEFT_OUT, on="page")


def _steps_table(steps: Sequence[tuple[str, Mapping[str, float], float]]) -> Table:
    """The step at which each engine's line first meets the level (`runs.first_steps`)."""
    kinds = {"free": "free rocking", "pulse": "pulse", "wall": "wall", "all": "all three"}
    reached = [Column(kind, label, "s", empty="–") for kind, label in kinds.items()]
    return Table(
        "first-steps",
        [text("line", "engine"), *reached, Column("smallest", "smallest step played", "s")],
        [[line, *(met[kind] for kind in kinds), smallest] for line, met, smallest in steps],
        f"The step at which an engine first meets {runs.LEVEL:g} alpha",
        "Median RMS error of theta over the scenes of a kind. Adaptive: the largest step. –: not"
        " with the smallest step that was played.",
    )


def _about(family: str) -> tuple[float, float]:
    members = [runs.prepared(family, k) for k in range(runs.MEMBERS)]
    return median(one.scene.duration for one in members), median(one.model_form for one in members)


def _table(name: str, frame: pd.DataFrame, **more: Any) -> Table:
    return Table(
        name,
        [*map(Column, frame)],
        list(frame.itertuples(index=False, name=None)),
        **{"on": "file", **more},
    )


def _spread(label: str, trends: pd.DataFrame) -> list[Any]:
    orders, ratios = (
        sorted(trends[name][np.isfinite(trends[name])]) for name in ("order", "ratio")
    )
    return [
        label,
        median(orders) if orders else None,
        f"{ratios[0]:.3g} to {ratios[-1]:.3g}" if ratios else "-",
        f"{len(ratios)} of {len(trends)} scenes",
    ]


def _diagram(title: str, families: Sequence[str], points: pd.DataFrame) -> Plot:
    """Median error with its 10-90 % band over CPU time: a panel a family, a line a model."""
    panels = []
    for family in families:
        shown = points[(points.family == family) & (points.rms > 0.0)]
        shown = shown[np.isfinite(shown.rms) & np.isfinite(shown.cpu)]
        series = [
            Series(
                label,
                mine.cpu.tolist(),
                mine.rms.tolist(),
                mine.rms_10.clip(lower=FLOOR).tolist(),
                mine.rms_90.clip(upper=3.0).tolist(),
                runs.LINES[label].family,
                LOOKS.get(label.split()[-1], "line"),
            )
            for (label,), mine in runs.grouped(shown, "line")
        ]
        panels.append(Panel(family, [*series, replace(FORM, y=[max(_about(family)[1], FLOOR)])]))
    return Plot(
        title.lower().replace(" ", "-"),
        f"Work and precision: {title.lower()}",
        panels=panels,
        x=Axis("CPU s a simulated s", log=True),
        y=Axis("RMS error of θ / α", log=True, limits=(FLOOR, 3.0)),
    )


def _converged(samples: Sequence[runs.BenchmarkRun]) -> Iterator[Block]:
    frame = runs.frame_of(samples)
    levels = runs.levels_of(frame)
    orders = runs.orders_of(frame, levels)
    form = median(
        runs.prepared(name, 0).model_form for name in dict.fromkeys(one.family for one in samples)
    )
    slopes = {(o.model, o.reference): o.order for o in orders.itertuples() if not o.scene}
    rows = []
    for (model, value), both in runs.grouped(levels, "model", "value"):
        cells = [
            (one.median, one.largest, f"{one.within} of {one.runs}", slopes[model, one.reference])
            for one in both.itertuples()
        ]
        rows.append([model, value, both.step.iloc[0], *itertools.chain(*cells)])
    yield Table(
        "levels",
        [
            Column("model", kind="model"),
            Column("value", "setting", brief=False),
            Column("step", "step", "s", digits=2),
            *itertools.chain.from_iterable(
                (
                    Column(f"median_{reference}", f"against {reference}", "alpha", digits=2),
                    Column(f"largest_{reference}", "largest", "alpha", digits=2, brief=False),
                    text(f"within_{reference}", f"within {runs.LEVEL:g}", brief=False),
                    Column(f"order_{reference}", "order", digits=3),
                )
                for reference in runs.REFERENCES
            ),
        ],
        rows,
        "What engines and CM converge to beside a wall",
        "As the step falls they tend to the model whose floor can only push. Against the paper's"
        f" model the error ends at the difference in form, {form:.1e} alpha.",
    )
    yield _over_step(frame, levels, form)
    yield Text(
        title="What does not converge",
        items=[*runs.exceptions_of(frame, orders)] or ["Nothing."],
    )
    yield _table("orders", orders)
    yield _table("wall-runs", pd.DataFrame(samples))


def _over_step(frame: pd.DataFrame, levels: pd.DataFrame, form: float) -> Plot:
    panels, levels = [], levels[np.isfinite(levels.step)]  # without those of no run
    for reference in runs.REFERENCES:
        good = dict(runs.grouped(frame[np.isfinite(frame[reference])], "line", "family"))
        series = []
        for (model,), mine in runs.grouped(levels[levels.reference == reference], "model"):
            series += [
                Series(model, one.step.tolist(), one[reference].tolist(), look=model, style="thin")
                for one in (good.get((model, name), frame[:0]) for name in runs.WALLS)
            ] + [
                Series(
                    model, mine.step.tolist(), mine["median"].clip(upper=3.0).tolist(), look=model
                )
            ]
        if reference == "ebm":
            series.append(replace(FORM, y=[form]))
        panels.append(Panel(f"against {reference}", series))
    return Plot(
        "error-over-step",
        panels=panels,
        x=Axis("step, s", log=True),
        y=Axis("RMS error of θ / α", log=True),
    )


def _batches(times: Sequence[timings.BatchTime]) -> Iterator[Block]:
    best = [row for name in timings.CASES if (row := timings.at_level(times, name))]
    yield Table(
        "batches-at-level",
        [
            text("case", "batch, one core"),
            Column("tolerance"),
            Column("cpu", "CPU", "μs a run"),
            Column("evaluations", "right-hand sides"),
            Column("error_95", "p95 error", "rad", digits=2),
            text("wrong"),
        ],
        [
            [
                row.case,
                row.tolerance,
                1e6 * row.cpu,
                row.evaluations,
                row.error_95,
                f"{row.wrong} of {row.runs}",
            ]
            for row in best
        ],
        "Compiled batches of the event-based model",
        f"The cheapest tolerance with a p95 error of the peak of at most {timings.LEVEL:g} rad."
        f" One right-hand side: {1e9 * median(row.right_hand_side for row in times):.1f} ns.",
    )
    shown = [row for row in times if row.error_95 > 0.0]
    yield Plot(
        "batches",
        panels=[
            Panel(
                "",
                [
                    Series(
                        f"{name}: {words}",
                        [row.error_95 for row in shown if row.case == name],
                        [1e6 * row.cpu for row in shown if row.case == name],
                    )
                    for name, (words, *_) in timings.CASES.items()
                ],
            )
        ],
        x=Axis("p95 error of the peak, rad", log=True),
        y=Axis("CPU μs a run, one core", log=True),
    )
    yield _table("batch-times", pd.DataFrame(times), title="All tolerances", on="page", folded=True)


def _timings(
    starts: Sequence[timings.ColdStart],
    sizes: Sequence[timings.BatchSize],
    saved: Sequence[savings.Saving],
) -> Iterator[Table]:
    yield Table(
        "cold-starts",
        [
            text("cache", "compile cache"),
            Column("importing", "import", "s"),
            Column("first_simulation", "first run", "s"),
        ],
        [[start.cache, start.importing, start.first_simulation] for start in starts],
        "Cold starts",
    )
    threads = sorted({one.threads for one in sizes})
    wall = {(one.runs, one.threads): 1e6 * one.wall for one in sizes}
    yield Table(
        "batch-sizes",
        [
            Column("runs"),
            *(Column(f"threads_{n}", f"{n} thread{'s' * (n > 1)}", "μs a run") for n in threads),
        ],
        [
            [count, *(wall.get((count, n)) for n in threads)]
            for count in dict.fromkeys(one.runs for one in sizes)
        ],
        "Cost of a batch against its size",
        "Random pulses, packing included.",
        on="page",
    )
    yield Table(
        "savings",
        [
            text("model"),
            text("thing", "not needed"),
            Column("cost_with", "with"),
            Column("cost_without", "without"),
            text("unit"),
            Column("ratio", "times"),
            Column("change", "change", "alpha", digits=2),
            text("remark", "what was compared"),
        ],
        [
            [
                one.model,
                one.thing,
                one.cost_with,
                one.cost_without,
                one.unit,
                one.cost_with / one.cost_without,
                one.change,
                one.remark,
            ]
            for one in saved
        ],
        "What a scene does not need",
        f"Not measured: {'; '.join(savings.NOT_MEASURED)}.",
        folded=True,
    )
