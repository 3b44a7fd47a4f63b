"""Runs as tables: a row a run, a row a setting, a row a line.

In: `BenchmarkRun`s. Out: frames of medians over the members of a family, and over whole kinds of
scenes for engines.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from rockcheck.validation.execute import models
from rockcheck.validation.studies.work_precision.benchmark_scenes import FAMILIES, WALLS
from rockcheck.validation.studies.work_precision.curves import (
    FITTED,
    NOTHING,
    cost_at,
    error_at,
    slope,
)
from rockcheck.validation.studies.work_precision.lines import LINES
from rockcheck.validation.studies.work_precision.runs import BenchmarkRun

REFERENCES = ("ebm-unilateral", "ebm")
#: Kinds of scenes over which the engines' settings are summed up: how the families' names begin.
KINDS = {
    "free, pulses": ("free", "pulse"),
    "slip, walls": ("slip", "wall"),
    "records": ("fig",),
    "all": ("",),
}
#: Errors of a setting by their share of the sample, and medians, some of them a simulated second.
SHARES = {"rms": 0.5, "rms_10": 0.1, "rms_90": 0.9}
MEDIANS = ("largest", "peak", "first_impact", "cpu", "wall", "set_up", "steps")
RATES = ("cpu", "wall", "steps")
TINY = 1e-9


def frame_of(samples: Sequence[BenchmarkRun]) -> pd.DataFrame:
    """Runs, a row each with its number: family by family, line by line, coarse to fine.

    Besides their fields the errors against each of `REFERENCES`, infinite where a run failed.
    """
    frame = pd.DataFrame([*samples])
    finished = frame.failure == ""
    unilateral, bilateral = REFERENCES
    frame[unilateral] = frame.rms.where(finished).fillna(math.inf)
    frame[bilateral] = frame.against_ebm.where(finished).fillna(math.inf)
    frame["family"] = pd.Categorical(frame.family, [*FAMILIES, *WALLS])
    frame["line"] = pd.Categorical(frame.line, [*LINES])
    return ordered(frame, "family", "line")


def ordered(frame: pd.DataFrame, *names: str) -> pd.DataFrame:
    """The rows in the order of these columns, then by the swept value, coarse to fine."""
    coarse_first = [*(True for _ in names), False]
    return frame.sort_values([*names, "value"], ascending=coarse_first, kind="stable")


def grouped(frame: pd.DataFrame, *names: str) -> list[tuple[Any, pd.DataFrame]]:
    """The rows by the values of these columns, in the order in which they come."""
    return [*frame.groupby([*names], sort=False, observed=True)]


def points_of(frame: pd.DataFrame) -> pd.DataFrame:
    """Median error and median cost of the settings of all lines in all families.

    The errors come with their 10-90 % band and the worst; the cost is that of a simulated second. A
    run that failed counts as infinitely wrong.
    """
    names, rows = ("family", "line", "value"), []
    for setting, samples in grouped(frame, *names):
        finished = samples[samples.failure == ""]
        failed = len(samples) - len(finished)
        row = dict(zip(names, setting, strict=True))
        row |= {"runs": len(samples), "failed": failed}
        row |= _shares_of(samples[REFERENCES[0]].tolist())
        row |= _medians_of(finished)
        row["rms_worst"] = math.inf if failed else finished.rms.max()
        rows.append(row)
    return pd.DataFrame(rows, columns=[*names, "runs", "failed", *SHARES, *MEDIANS, "rms_worst"])


def _shares_of(errors: Sequence[float]) -> dict[str, float]:
    """The errors at the shares of `SHARES`.

    Halfway between two values where a share lies between them; infinite ones are not averaged.
    """
    sides = np.add.outer([-TINY, TINY], [*SHARES.values()])
    values = np.quantile(errors, sides, method="inverted_cdf").mean(axis=0)
    return dict(zip(SHARES, values.tolist(), strict=True))


def _medians_of(runs: pd.DataFrame) -> dict[str, float]:
    """The medians of `MEDIANS` over runs; those of `RATES` of a simulated second."""
    rates = runs[[*RATES]].div(runs.horizon, axis=0)
    medians: dict[str, float] = (
        runs.drop(columns=[*RATES]).join(rates)[[*MEDIANS]].median().to_dict()
    )
    return medians


def trends_of(points: pd.DataFrame) -> pd.DataFrame:
    """Order of convergence, and cost of an error of `LEVEL`, of each line in each family.

    `order` in the swept setting is NaN where fewer than two settings can be fitted. `cpu` is in s a
    simulated second, NaN where the level is not reached; `at_coarsest` where already the coarsest
    setting reaches it. `ratio` is to the `ebm` line's cost.
    """
    lines = dict(grouped(points, "family", "line"))
    costs = {at: cost_at(line) for at, line in lines.items()}
    rows = []
    for (family, label), line in lines.items():
        order = slope(line.value, line.rms, FITTED)
        cost, at_coarsest = costs[family, label]
        cost_of_ebm, _ = costs.get((family, "ebm"), NOTHING)
        rows.append((family, label, order, cost, at_coarsest, cost / cost_of_ebm))
    return pd.DataFrame(rows, columns=["family", "line", "order", "cpu", "at_coarsest", "ratio"])


def pooled(frame: pd.DataFrame, kinds: Mapping[str, tuple[str, ...]] = KINDS) -> pd.DataFrame:
    """Every setting of the engines' lines over all scenes of each kind; `family` is the kind."""
    of_engines = [LINES[line].family in models.ENGINE_NAMES for line in frame.line]
    engines = ordered(frame[of_engines], "line")
    parts = [
        engines[engines.family.str.startswith(starts)].assign(family=kind)
        for kind, starts in kinds.items()
    ]
    return points_of(pd.concat(parts))


def at_the_cost(points: pd.DataFrame) -> list[float]:
    """By point, the error of the engine's adaptive line at that CPU time; NaN outside its range.

    Interpolated as by `error_at`.
    """
    lines = dict(grouped(points, "family", "line"))
    no_line = points[:0]
    errors = []
    for point in points.itertuples():
        adaptive = f"{LINES[point.line].family} adaptive"
        errors.append(error_at(lines.get((point.family, adaptive), no_line), point.cpu))
    return errors
