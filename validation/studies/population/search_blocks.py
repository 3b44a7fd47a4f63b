"""Tables and plots of the searches of an assessment: gaps and intensities.

In: typed answers (`statistics`). Out: blocks of a finding, a function a question. Called by the
study.
"""

from typing import Any

import numpy as np

from rockcheck.scenes import Scene
from rockcheck.validation.finding import (
    Axis,
    Block,
    Column,
    Mark,
    Panel,
    Plot,
    Series,
    Table,
    text,
)
from rockcheck.validation.studies.population.factor_task import FACTOR_RESOLUTION
from rockcheck.validation.studies.population.plan import FACTOR_STEP
from rockcheck.validation.studies.population.results import FallInterval
from rockcheck.validation.studies.population.sentences import looked_words
from rockcheck.validation.studies.population.statistics import (
    GapAnswer,
    IntensityAnswer,
    overturned_steps,
)
from rockcheck.validation.studies.population.tasks import GAP_RESOLUTION


def gap_blocks(answer: GapAnswer, scene: Scene) -> list[Block]:
    """Which gaps on one side are safe: a plot, the intervals, and the runs at some gaps.

    The scene's own gap is marked.
    """
    return [_gap_plot(answer, scene), *_interval_tables(answer), _gap_table(answer)]


def _gap_plot(answer: GapAnswer, scene: Scene) -> Plot:
    gaps = [row.gap for row in answer.rows]
    scene_gaps = [wall.gap for wall in scene.walls if wall.side == answer.side]
    marks = [
        Series("gap of the scene", [gap, gap], [0.0, 1.0], style="dotted") for gap in scene_gaps
    ]
    shares = Panel(
        "share of the runs",
        [
            Series("struck", gaps, [row.struck / row.runs for row in answer.rows]),
            Series("overturned", *overturned_steps(answer), style="step"),
            *marks,
        ],
    )
    speeds = Panel(
        "speed at the wall, m/s",
        [
            Series("median", gaps, [row.median_speed for row in answer.rows]),
            Series("largest", gaps, [row.largest_speed for row in answer.rows]),
        ],
    )
    return Plot(
        f"gaps-{answer.side}",
        f"Which gap on the {answer.side} is safe",
        panels=[shares, speeds],
        x=Axis("clear gap, m"),
        shared=False,
    )


def _interval_tables(answer: GapAnswer) -> list[Block]:
    """The intervals of the scene as it is, and in a file those of its draws."""
    as_it_is = [case for case in answer.falls if case.draw == 0]
    rows = [_interval_row(case.case, interval) for case in as_it_is for interval in case.intervals]
    columns = [
        text("record"),
        Column("low", "falls from", "m", digits=4),
        Column("high", "to", "m", digits=4),
        Column("stands_below", "stands at", "m", digits=4, brief=False),
        Column("stands_above", "and again at", "m", digits=4, brief=False),
    ]
    tables: list[Block] = [
        Table(
            f"gap_intervals_{answer.side}",
            columns,
            rows,
            "At which gaps it falls",
            note=f"{looked_words(answer).capitalize()}, each change narrowed to"
            f" {1e3 * GAP_RESOLUTION:g} mm. Narrower intervals may be missed.",
            on="page" if rows else "file",
            folded=len(rows) > 12,
        )
    ]
    if answer.draws_every is not None:
        draws = [
            [case.draw, *_interval_row(case.case, interval)]
            for case in answer.falls
            if case.draw
            for interval in case.intervals
        ]
        name = f"gap_intervals_{answer.side}_draws"
        tables.append(Table(name, [Column("draw"), *columns], draws, on="file"))
    return tables


def _interval_row(case: str, interval: FallInterval) -> list[Any]:
    ends = [interval.low, interval.high, interval.stands_below, interval.stands_above]
    return [case, *ends]


def _gap_table(answer: GapAnswer) -> Table:
    columns = [
        Column("gap", "clear gap", "m", digits=4),
        Column("runs"),
        Column("overturned"),
        Column("struck"),
        Column("median", "speed, median", "m/s"),
        Column("largest", "largest", "m/s"),
    ]
    rows = [
        [
            row.gap,
            row.runs,
            Mark(row.overturned, "fail" if row.overturned else "pass"),
            row.struck,
            row.median_speed,
            row.largest_speed,
        ]
        for row in answer.rows
    ]
    return Table(
        f"gaps_{answer.side}",
        columns,
        rows,
        "Runs by gap",
        note="Struck: also by runs that then overturn.",
        on="page",
        folded=True,
    )


def intensity_blocks(answer: IntensityAnswer | None) -> list[Block]:
    """The least intensities, and the curve through them."""
    if answer is None:
        return []
    columns = [
        text("record"),
        Column("as_it_is", f"{answer.label} as it is", answer.unit),
        Column("least", "falls from", answer.unit, digits=4),
        Column("looked_up_to", "looked at up to", answer.unit, brief=False),
        text("islands", "falls in, then stands", brief=False),
        Column("for_good", "falls for good from", answer.unit, digits=4, brief=False),
    ]
    rows = [
        [
            record.case,
            record.as_it_is,
            record.least,
            record.beyond,
            ", ".join(f"{low:.4g} to {high:.4g}" for low, high in record.islands),
            record.for_good,
        ]
        for record in answer.records
    ]
    table = Table(
        "intensities",
        columns,
        rows,
        "At which intensity it falls",
        note=f"Each motion was scaled in steps of {100.0 * FACTOR_STEP:g} %, each change narrowed"
        f" to {100.0 * FACTOR_RESOLUTION:g} %. Narrower intervals of falls may be missed, also"
        " below the least one. The curve is lognormal, of"
        " the greatest likelihood; its interval is from drawing the motions anew.",
        on="page" if len(rows) > 1 else "file",
        folded=len(rows) > 12,
    )
    return [*_curve_plot(answer), table]


def _curve_plot(answer: IntensityAnswer) -> list[Block]:
    least = sorted(record.least for record in answer.records if record.least is not None)
    if answer.fit is None or not answer.fit.dispersion > 0.0:
        return []
    # Just below each step, too: the chart joins the points by lines.
    steps_at = np.array([least, [(1.0 - 1e-6) * value for value in least]])
    x = np.union1d(np.geomspace(0.5 * least[0], 2.0 * least[-1], 100), steps_at)
    low, high = answer.fit.band(x)
    steps = [(rank + 1) / len(answer.records) for rank in range(len(least))]
    series = [
        Series(
            "lognormal",
            x.tolist(),
            answer.fit.probability(x).tolist(),
            low.tolist(),
            high.tolist(),
            style="smooth",
        ),
        Series("records", [float(x[0]), *least], [0.0, *steps], style="step"),
    ]
    return [
        Plot(
            "intensity",
            "Probability of overturning",
            panels=[Panel("", series)],
            x=Axis(answer.head, log=True),
            y=Axis("probability", limits=(0.0, 1.0)),
            note="Share of the records that have overturned it, and the lognormal curve with its"
            " 95 % band.",
            live=True,
        )
    ]
