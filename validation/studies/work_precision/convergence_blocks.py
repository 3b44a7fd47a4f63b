"""What models converge to beside a wall, as tables and a diagram.

In: `BenchmarkRun`s of the wall scenes. Out: blocks of a finding. Called by the study.
"""

import itertools
from collections.abc import Iterator, Sequence
from statistics import median

import pandas as pd

from rockcheck.validation.finding import Block, Column, Table, Text, text
from rockcheck.validation.studies.work_precision.benchmark_scenes import prepared
from rockcheck.validation.studies.work_precision.convergence import (
    exceptions_of,
    levels_of,
    orders_of,
)
from rockcheck.validation.studies.work_precision.curves import LEVEL
from rockcheck.validation.studies.work_precision.drawing import error_over_step
from rockcheck.validation.studies.work_precision.points import REFERENCES, frame_of, grouped
from rockcheck.validation.studies.work_precision.run_blocks import table_of
from rockcheck.validation.studies.work_precision.runs import BenchmarkRun


def convergence_blocks(samples: Sequence[BenchmarkRun]) -> Iterator[Block]:
    """Errors by setting with their orders, the diagram, and what does not converge."""
    frame = frame_of(samples)
    levels = levels_of(frame)
    orders = orders_of(frame, levels)
    scenes = dict.fromkeys(sample.family for sample in samples)
    form = median(prepared(scene, 0).model_form for scene in scenes)
    yield _level_table(levels, orders, form)
    yield error_over_step(frame, levels, form)
    exceptions = list(exceptions_of(frame, orders))
    yield Text(title="What does not converge", items=exceptions or ["Nothing."])
    yield table_of("orders", orders)
    yield table_of("wall-runs", pd.DataFrame(samples))


def _level_table(levels: pd.DataFrame, orders: pd.DataFrame, form: float) -> Table:
    of_medians = orders[orders.scene == ""]
    slopes = {(row.model, row.reference): row.order for row in of_medians.itertuples()}
    rows = []
    for (model, value), settings in grouped(levels, "model", "value"):
        row = [model, value, settings.step.iloc[0]]
        for level in settings.itertuples():
            within = f"{level.within} of {level.runs}"
            row += [level.median, level.largest, within, slopes[model, level.reference]]
        rows.append(row)
    return Table(
        "levels",
        [
            Column("model", kind="model"),
            Column("value", "setting", brief=False),
            Column("step", "step", "s", digits=2),
            *itertools.chain.from_iterable(_columns_of(reference) for reference in REFERENCES),
        ],
        rows,
        "What engines and CM converge to beside a wall",
        "As the step falls they tend to the model whose floor can only push. Against the paper's"
        f" model the error ends at the difference in form, {form:.1e} alpha.",
    )


def _columns_of(reference: str) -> list[Column]:
    return [
        Column(f"median_{reference}", f"against {reference}", "alpha", digits=2),
        Column(f"largest_{reference}", "largest", "alpha", digits=2, brief=False),
        text(f"within_{reference}", f"within {LEVEL:g}", brief=False),
        Column(f"order_{reference}", "order", digits=3),
    ]
