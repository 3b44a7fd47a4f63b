"""Convergence: beside a wall engines and CM tend to the model whose floor can only push.

In: runs of the wall scenes. Out: errors by setting, orders, and where there is no convergence.
"""

import itertools
import math
from collections.abc import Iterable

import pandas as pd

from rockcheck.validation.studies.work_precision.benchmark_scenes import WALLS
from rockcheck.validation.studies.work_precision.curves import LEVEL, slope
from rockcheck.validation.studies.work_precision.points import REFERENCES, grouped, ordered

#: A run counts as converged if its order in the step is at least this, where the finest error is
#: not already below `ROUNDED` (alpha).
LEAST_ORDER, ROUNDED = 0.5, 1e-6


def levels_of(frame: pd.DataFrame) -> pd.DataFrame:
    """The wall scenes' errors (alpha) by reference, model and setting, coarse to fine.

    `within` is the number of runs whose error is at most `LEVEL`.
    """
    settings = grouped(ordered(frame, "line"), "line", "value")
    return pd.DataFrame(
        {
            "model": model,
            "reference": reference,
            "value": value,
            "step": runs.step[runs.failure == ""].median(),
            "median": runs[reference].median(),
            "largest": runs[reference].max(),
            "runs": len(runs),
            "within": int((runs[reference] <= LEVEL).sum()),
        }
        for reference, ((model, value), runs) in itertools.product(REFERENCES, settings)
    )


def orders_of(frame: pd.DataFrame, levels: pd.DataFrame) -> pd.DataFrame:
    """Slopes of log error over log step by model and reference.

    They are given for the median error (`scene` is empty), and scene by scene.
    """
    lines = dict(grouped(frame.sort_index(), "line", "family"))
    settings = dict(grouped(levels, "model", "reference"))
    rows = []
    for model, reference in itertools.product(dict.fromkeys(levels.model), REFERENCES):
        medians = settings[model, reference]
        rows.append((model, reference, slope(medians.step, medians["median"]), ""))
        for scene in WALLS:
            runs = lines.get((model, scene))
            if runs is not None:
                rows.append((model, reference, slope(runs.step, runs[reference]), scene))
    return pd.DataFrame(rows, columns=["model", "reference", "order", "scene"])


def exceptions_of(frame: pd.DataFrame, orders: pd.DataFrame) -> Iterable[str]:
    """The wall scenes in which a model does not converge to the unilateral one, a line each."""
    lines = dict(grouped(frame, "line", "family"))
    of_scenes = orders[(orders.reference == REFERENCES[0]) & (orders.scene != "")]
    for row in of_scenes.itertuples():
        errors = lines[row.model, row.scene][REFERENCES[0]].tolist()
        finest = errors[-1]
        slow = finest > ROUNDED and not row.order >= LEAST_ORDER
        if math.isfinite(finest) and (finest > LEVEL or slow):
            series = " → ".join(f"{error:.1e}" for error in errors)
            yield f"{row.scene}, {row.model}: {series} α, order {row.order:.2f}"
