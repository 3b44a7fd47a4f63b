"""Engines beside each other: the cost of the same error, and the step that first meets it."""

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from rockcheck.validation.studies.work_precision.curves import LEVEL, cost_at, error_at
from rockcheck.validation.studies.work_precision.points import KINDS, grouped, pooled

#: The cost at which engines are compared in their league, CPU s a simulated second.
EQUAL_COST = 0.02
#: Kinds of scenes in each of which an engine has to meet `LEVEL`.
LEAGUE = {"free": ("free",), "pulse": ("pulse",), "wall": ("wall",)}


@dataclass(frozen=True)
class Standing:
    """An engine's line in the league.

    CPU time (s a simulated second) of an error of `LEVEL`, RMS error (alpha) at `EQUAL_COST`, least
    error at any setting that was played, and its cost; NaN where the line does not reach it.
    """

    line: str
    cost: float
    error: float
    best: float
    best_cost: float


def league(points: pd.DataFrame) -> list[Standing]:
    """The engines' lines over pulses and free rocking, the cheapest at an error of `LEVEL` first.

    Lines that never reach it come last, by their best error. `points` are those of `pooled`.
    """
    standings = []
    for (label,), line in grouped(points[points.family == next(iter(KINDS))], "line"):
        finished = line[np.isfinite(line.rms)]
        if not finished.size:
            continue
        best = finished.loc[finished.rms.idxmin()]
        cost, _ = cost_at(line)
        error = error_at(line, EQUAL_COST)
        standings.append(Standing(label, cost, error, float(best.rms), float(best.cpu)))
    return sorted(standings, key=_rank)


def _rank(standing: Standing) -> tuple[bool, float]:
    missed = math.isnan(standing.cost)
    return missed, standing.best if missed else standing.cost


@dataclass(frozen=True)
class FirstSteps:
    """The largest step (s) at which an engine's line has a median error of at most `LEVEL`.

    By kind of `LEAGUE`, and in all of them ("all"); NaN where there is none. `smallest` is the
    smallest step that was played.
    """

    line: str
    by_kind: dict[str, float]
    smallest: float


def first_steps(frame: pd.DataFrame) -> list[FirstSteps]:
    """The first steps of each engine's line."""
    found = []
    for (label,), line in grouped(pooled(frame, LEAGUE), "line"):
        good = line[line.rms <= LEVEL]
        met = {kind: set(good.value[good.family == kind]) for kind in LEAGUE}
        met["all"] = set.intersection(*met.values())
        largest = {kind: max(values, default=math.nan) for kind, values in met.items()}
        found.append(FirstSteps(label, largest, line.value.min()))
    return found
