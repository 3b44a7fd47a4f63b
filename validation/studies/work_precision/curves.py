"""What a line tells: its order, the cost of an error, the error at a cost.

In: settings of one line, coarse to fine, with `rms` (alpha) and `cpu` (s a simulated second). Out:
numbers, NaN where the line does not tell.
"""

import itertools
import math
from collections.abc import Iterable

import numpy as np
import pandas as pd

#: Error at which each model's cost is given, alpha; and the result where it is not reached.
LEVEL, NOTHING = 1e-3, (math.nan, False)
#: An order is fitted to median errors between these, alpha: below is rounding, above nothing
#: converges yet.
FITTED = 3e-13, 0.2


def slope(
    steps: Iterable[float], errors: Iterable[float], fitted: tuple[float, float] = (0.0, math.inf)
) -> float:
    """Slope of log error over log step by least squares; NaN with fewer than two usable steps.

    Usable are those whose error lies between the two of `fitted`.
    """
    usable = [
        (math.log(step), math.log(error))
        for step, error in zip(steps, errors, strict=True)
        if math.isfinite(step) and fitted[0] < error < fitted[1]
    ]
    if len({step for step, _ in usable}) < 2:
        return math.nan
    x, y = np.array(usable).T
    return float(np.polyfit(x, y, 1)[0])


def cost_at(line: pd.DataFrame) -> tuple[float, bool]:
    """CPU s a simulated second at a median error of `LEVEL`.

    The second value is true where the coarsest setting already reaches the level. Between settings
    both logarithms are interpolated linearly; NaN where no setting reaches the level. The cheapest
    counts.
    """
    points = list(zip(line.rms, line.cpu, strict=True))
    costs = [(cpu, n == 0) for n, (rms, cpu) in enumerate(points) if rms <= LEVEL]
    for (error, cost), (finer_error, finer_cost) in itertools.pairwise(points):
        if error > LEVEL >= finer_error > 0.0 and math.isfinite(error):
            share = math.log(error / LEVEL) / math.log(error / finer_error)
            costs.append((cost * (finer_cost / cost) ** share, False))
    return min(costs, default=NOTHING)


def error_at(line: pd.DataFrame, cpu: float) -> float:
    """Median error of a line, coarse to fine, at a CPU time; NaN outside its range.

    Both are interpolated on logarithmic axes.
    """
    points = zip(line.rms, line.cpu, strict=True)
    for (error, cost), (finer_error, finer_cost) in itertools.pairwise(points):
        between = cost <= cpu <= finer_cost and cost < finer_cost
        if between and finer_error > 0.0 and math.isfinite(error):
            share = math.log(cpu / cost) / math.log(finer_cost / cost)
            return float(error * (finer_error / error) ** share)
    return math.nan
