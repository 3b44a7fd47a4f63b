"""Tables and figures of a stress run.

In: totals of runs, and results of the maps. Out: blocks of a page. Called by the study.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rockcheck.validation.finding import Column, Mark, Plot, Table, text
from rockcheck.validation.studies.stress.horizon import DISTURBANCE, SEEN
from rockcheck.validation.studies.stress.invariants import INVARIANTS
from rockcheck.validation.studies.stress.maps import (
    ADAPTIVE_FINEST,
    AXES,
    CASES,
    QUICK_STEPS,
    STEPS,
    MapPoint,
    MapResult,
)
from rockcheck.validation.studies.stress.players import PLAYERS
from rockcheck.validation.studies.stress.runs import MOST_FILES, Broken, RunTotals

#: Listed movements of a block that should stand still, and their units.
MOVES = {"creep": "R", "sinking": "R", "rotation": "α", "uplift": "R", "jitter": "√(gR)"}


def run_tables(totals: Sequence[RunTotals]) -> list[Table]:
    """Tables of the runs: models, choices, invariants and failures."""
    return [
        _models(totals),
        _choices(totals),
        _invariants(totals),
        _failures(totals),
        _scenes(totals),
    ]


def _models(totals: Sequence[RunTotals]) -> Table:
    return Table(
        "models",
        [
            text("model"),
            text("plays", brief=False),
            Column("runs"),
            Column("broken", "broken runs"),
            Column("events"),
            Column("gaining", "gain energy"),
            Column("largest_gain", "most", kind="percent"),
            Column("horizons", "cut at horizon", brief=False),
            Column("cpu_seconds", "CPU", "s"),
        ],
        [
            [
                total.model,
                PLAYERS[total.model].words,
                total.counts["runs"],
                len({failure.number for failure in total.failures}),
                total.counts["events"],
                total.counts["gaining"],
                total.largest_gain,
                total.counts["horizons"],
                total.cpu_seconds,
            ]
            for total in totals
        ],
        "Models",
        "Newton's restitution with friction, and the paper's cascade of impacts, can add energy:"
        " such runs, and what an impact added at most, are listed. Without restitution, or with the"
        " energy cap, an impact of the unilateral model may not add any: that is an invariant.",
    )


def _choices(totals: Sequence[RunTotals]) -> Table:
    rows = []
    for total in totals:
        if total.rules:
            words = [f"{name} {count:,}" for name, count in total.rules.most_common()]
            rows.append([total.model, ", ".join(words)])
    return Table("choices", [text("model"), text("choices")], rows, "Modelling choices made")


def _invariants(totals: Sequence[RunTotals]) -> Table:
    return Table(
        "invariants",
        [
            text("invariant"),
            text("words", "what its figure is", brief=False),
            Column("bound"),
            Column("worst", digits=2),
            text("run"),
            Column("failures"),
            Column("unjudged", "not judged"),
            *(Column(total.model, digits=2, brief=False) for total in totals),
        ],
        [_invariant(name, totals) for name in INVARIANTS],
        "Invariants: worst figures",
        "Two histories of one scene are compared up to its horizon: where a relative disturbance of"
        f" its data by {DISTURBANCE:g} turns the block by {SEEN:g} rad. Energy is integrated in"
        " every ninth run.",
    )


def _invariant(name: str, totals: Sequence[RunTotals]) -> list[Any]:
    worst, run, model = max(
        ((*total.worst[name], total.model) for total in totals if name in total.worst),
        default=(None, "", ""),
    )
    failures = [_failures_of(name, total) for total in totals]
    return [
        name,
        INVARIANTS[name].words,
        INVARIANTS[name].bound,
        worst,
        f"{model} {run}".strip(),
        sum(failures),
        sum(total.unjudged[name] for total in totals),
        *(_worst_of_model(name, total) for total in totals),
    ]


def _failures_of(name: str, total: RunTotals) -> int:
    return sum(failure.invariant == name for failure in total.failures)


def _worst_of_model(name: str, total: RunTotals) -> Mark:
    figure = total.worst[name][0] if name in total.worst else None
    failures = _failures_of(name, total)
    if not failures:
        return Mark(figure, "", "")
    return Mark(figure, "fail", f"{failures} of {total.looked_at[name]} fail")


def _failures(totals: Sequence[RunTotals]) -> Table:
    return Table(
        "failures",
        [*map(Column, Broken.__dataclass_fields__)],
        [[*vars(failure).values()] for total in totals for failure in total.failures],
        on="file",
    )


def _scenes(totals: Sequence[RunTotals]) -> Table:
    return Table(
        "scenes",
        [
            text("model"),
            text("invariant"),
            Column("run"),
            Column("figure", digits=2),
            text("scene"),
            text("words", "reason"),
        ],
        [
            [
                failure.model,
                failure.invariant,
                failure.number,
                failure.figure,
                Mark(failure.name, link=f"failures/{failure.name}"),
                failure.words,
            ]
            for total in totals
            for failure in total.shown
        ],
        f"Failures: {sum(len(total.failures) for total in totals)}",
        f"At most {MOST_FILES} of a model and an invariant, each with its smallest scene.",
    )


Results = Mapping[MapPoint, MapResult]


def map_blocks(results: Results, quick: bool) -> Iterator[Plot | Table]:
    """The largest stable steps as a figure and tables, and what should stand still."""
    steps, stands = {}, {}
    for point, result in results.items():
        if point.map_name in CASES:
            stands[point] = result
        else:
            steps[point] = result
    if steps:
        lines = list(dict.fromkeys(point.line for point in steps))
        yield _stable_steps(steps, lines, quick)
        for axis in AXES:
            yield _steps_by_axis(axis, lines, steps)
        yield Table(
            "stable-steps",
            list(map(Column, ("line", "axis", "value", "step", "fault"))),
            [
                [point.line, point.map_name, point.value, result.step, result.fault]
                for point, result in steps.items()
            ],
            on="file",
        )
    if stands:
        yield _stand_still(stands)


def _stable_steps(results: Results, lines: Sequence[str], quick: bool) -> Plot:
    steps = QUICK_STEPS if quick else STEPS
    panels = []
    for axis, (words, _, _) in AXES.items():
        values, rows = _on_axis(axis, lines, results)
        panels.append([words, values, [[cell and cell.step for cell in row] for row in rows]])
    return Plot(
        "stable-steps",
        "Where engines and the continuous model break: largest stable step, √(R/g)",
        "stable-steps",
        data={"tried": STEPS, "models": lines, "panels": panels},
        note="All finer steps that were tried are stable, too. The paper's shape of block"
        " beside a wall, R 1.6 m, friction 0.3, restitution of the wall 0.5, pulse of"
        " 3 g tan α, one thing changed. A run is stable if it does not blow up, no corner sinks"
        " deeper than 0.02 R and the distance of a step, and the energy gained without a source"
        " is below a tenth of all work. “none”: not even the finest step is stable"
        f" ({steps[-1]:g}, with adaptive steps"
        f" {min(step for step in steps if step >= ADAPTIVE_FINEST):g}).",
    )


def _on_axis(
    axis: str, lines: Sequence[str], results: Results
) -> tuple[list[float], list[list[MapResult | None]]]:
    """The values of an axis, and the results of each line at them; None where there is none."""
    cells = {
        (point.line, point.value): result
        for point, result in results.items()
        if point.map_name == axis
    }
    values = list(dict.fromkeys(value for _, value in cells))
    return values, [[cells.get((line, value)) for value in values] for line in lines]


def _steps_by_axis(axis: str, lines: Sequence[str], results: Results) -> Table:
    values, rows = _on_axis(axis, lines, results)
    words, _, _ = AXES[axis]
    return Table(
        f"steps-{axis}",
        [text("line", "model"), *(text(f"{value:g}") for value in values)],
        [
            [line, *(cell and f"{cell.step:g} {cell.fault}".strip() for cell in row)]
            for line, row in zip(lines, rows, strict=True)
        ],
        f"Largest stable step, √(R/g), by {words}",
        folded=True,
    )


def _stand_still(results: Results) -> Table:
    return Table(
        "stand-still",
        [
            text("case", "block"),
            text("line", "model"),
            Column("simulated", "for", "s", digits=4),
            Column("step", unit="s", digits=2, brief=False),
            *(Column(name, unit=unit, digits=1) for name, unit in MOVES.items()),
            text("fault", " ", brief=False),
        ],
        [
            [
                point.map_name,
                point.line,
                result.value,
                result.step,
                *map(result.moves.get, MOVES),
                result.fault,
            ]
            for point, result in results.items()
        ],
        "What should stand still",
        "The paper's block on friction 0.3: left alone, pushed by half of what would move it,"
        " or shaken at 1 Hz by 0.8 of it; the largest of each in the run, jitter the RMS speed"
        " of its second half. A perfect model has zero everywhere.",
    )
