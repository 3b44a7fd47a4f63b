"""What the runs of the models tell, as tables and diagrams.

In: `BenchmarkRun`s. Out: blocks of a finding. Called by the study.
"""

from collections.abc import Iterator, Mapping, Sequence
from statistics import median
from typing import Any

import numpy as np
import pandas as pd

from rockcheck.validation.finding import Block, Column, Table, Text, text
from rockcheck.validation.studies.work_precision.benchmark_scenes import (
    FAMILIES,
    MEMBERS,
    prepared,
)
from rockcheck.validation.studies.work_precision.curves import LEVEL
from rockcheck.validation.studies.work_precision.drawing import diagrams, median_form
from rockcheck.validation.studies.work_precision.lines import LEFT_OUT
from rockcheck.validation.studies.work_precision.points import (
    at_the_cost,
    frame_of,
    points_of,
    pooled,
    trends_of,
)
from rockcheck.validation.studies.work_precision.runs import BenchmarkRun
from rockcheck.validation.studies.work_precision.standings import (
    EQUAL_COST,
    FirstSteps,
    Standing,
    first_steps,
    league,
)

#: Columns of the settings of engines over whole kinds of scenes.
OF_ENGINES = ("family", "line", "value", "runs", "failed", "cpu", "rms", "rms_worst")


def run_blocks(samples: Sequence[BenchmarkRun]) -> Iterator[Block]:
    """The league of engines, first steps, diagrams, ratios, orders, scenes, and all settings."""
    frame = frame_of(samples)
    points, of_kinds = points_of(frame), pooled(frame)
    trends = trends_of(points)
    families, labels = list(dict.fromkeys(points.family)), list(dict.fromkeys(points.line))
    if standings := league(of_kinds):
        yield _league_table(standings)
    if steps := first_steps(frame):
        yield _steps_table(steps)
    yield from diagrams(points)
    yield _ratio_table(trends, families, labels)
    yield _order_table(trends, labels)
    yield _scene_table(families)
    yield table_of(
        "engines",
        of_kinds[[*OF_ENGINES]]
        .assign(at_the_cost=at_the_cost(of_kinds))
        .rename(columns={"family": "kind"}),
        title="Engines over whole kinds of scenes",
        on="page",
        folded=True,
    )
    # The worst error is shown for engines only.
    without_worst = points.drop(columns="rms_worst")
    yield table_of("work-precision", without_worst, title="All settings", on="page", folded=True)
    yield table_of("orders-and-ratios", trends)
    yield table_of("runs", pd.DataFrame(samples))
    yield Text(title="Left out", items=LEFT_OUT, on="page")


def table_of(name: str, frame: pd.DataFrame, **how: Any) -> Table:
    """A frame as a table, which by default is a file only."""
    rows = list(frame.itertuples(index=False, name=None))
    return Table(name, [*map(Column, frame)], rows, **{"on": "file", **how})


def _league_table(standings: Sequence[Standing]) -> Table:
    return Table(
        "league",
        [
            Column("line", "engine", kind="text"),
            Column("cost", f"cost at {LEVEL:g} alpha", "ms", digits=2),
            Column("error", f"error at {1e3 * EQUAL_COST:g} ms", "alpha", digits=2),
            Column("best", "least error", "alpha", digits=2),
            Column("best_cost", "at a cost of", "ms", digits=2),
        ],
        [[row.line, 1e3 * row.cost, row.error, row.best, 1e3 * row.best_cost] for row in standings],
        "League of engines",
        "Free rocking and pulses. Error: RMS of theta. Cost: CPU a simulated second. Empty:"
        " not reached.",
    )


def _steps_table(steps: Sequence[FirstSteps]) -> Table:
    """The step at which each engine's line first meets the level."""
    kinds = {"free": "free rocking", "pulse": "pulse", "wall": "wall", "all": "all three"}
    reached = [Column(kind, label, "s", empty="–") for kind, label in kinds.items()]
    return Table(
        "first-steps",
        [text("line", "engine"), *reached, Column("smallest", "smallest step played", "s")],
        [[row.line, *(row.by_kind[kind] for kind in kinds), row.smallest] for row in steps],
        f"The step at which an engine first meets {LEVEL:g} alpha",
        "Median RMS error of theta over the scenes of a kind. Adaptive: the largest step. –: not"
        " with the smallest step that was played.",
    )


def _ratio_table(trends: pd.DataFrame, families: Sequence[str], labels: Sequence[str]) -> Table:
    ratios: Mapping[tuple[str, str], float] = {
        (trend.line, trend.family): trend.ratio for trend in trends.itertuples()
    }
    return Table(
        "ratios",
        [text("line", "model"), *(Column(family, digits=2) for family in families)],
        [[label, *(ratios.get((label, family)) for family in families)] for label in labels],
        f"Run time at an error of {LEVEL:g} alpha, over the EBM's",
        on="page",
        folded=True,
    )


def _order_table(trends: pd.DataFrame, labels: Sequence[str]) -> Table:
    return Table(
        "order-spread",
        [
            text("line", "model"),
            Column("order"),
            text("ratio", f"run time / ebm's at {LEVEL:g} alpha"),
            text("reached"),
        ],
        [_spread(label, trends[trends.line == label]) for label in labels],
        "Order and run time",
        "Order: median slope of the error in the swept setting.",
        folded=True,
    )


def _spread(label: str, trends: pd.DataFrame) -> list[Any]:
    """A line's median order, the range of its cost over the EBM's, and where it has one."""
    orders = sorted(trends.order[np.isfinite(trends.order)])
    ratios = sorted(trends.ratio[np.isfinite(trends.ratio)])
    return [
        label,
        median(orders) if orders else None,
        f"{ratios[0]:.3g} to {ratios[-1]:.3g}" if ratios else "-",
        f"{len(ratios)} of {len(trends)} scenes",
    ]


def _scene_table(families: Sequence[str]) -> Table:
    rows = []
    for family in families:
        horizon = median(prepared(family, k).scene.duration for k in range(MEMBERS))
        rows.append([family, FAMILIES[family].words, horizon, median_form(family)])
    return Table(
        "scenes",
        [
            text("scene"),
            text("what"),
            Column("horizon", "compared up to", "s"),
            Column("model_form", "model form", "alpha", digits=2),
        ],
        rows,
        "Scenes",
        on="page",
        folded=True,
    )
