"""Which rows of a history a drawing needs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes.compiled import kernel

Floats = NDArray[np.float64]


@kernel
def enough(t: Floats, values: Floats, coarse: float) -> NDArray[np.bool_]:
    """Which rows to keep, so that straight lines between them are within `coarse` of all `values`
    (n, k) at the times `t` (n).

    From the first and last row on, each part is split at the row farthest from its straight line.
    """
    kept = np.zeros(len(t), dtype=np.bool_)
    kept[0] = kept[-1] = True
    waiting = np.empty((len(t), 2), dtype=np.int64)
    waiting[0, 0], waiting[0, 1] = 0, len(t) - 1
    count = 1
    while count > 0:
        count -= 1
        first, last = waiting[count, 0], waiting[count, 1]
        worst, farthest = first, coarse
        for row in range(first + 1, last):
            share = (t[row] - t[first]) / (t[last] - t[first])
            for k in range(values.shape[1]):
                apart = abs(
                    values[row, k] - ((1.0 - share) * values[first, k] + share * values[last, k])
                )
                if apart > farthest:
                    worst, farthest = row, apart
        if worst > first:
            kept[worst] = True
            waiting[count, 0], waiting[count, 1] = first, worst
            waiting[count + 1, 0], waiting[count + 1, 1] = worst, last
            count += 2
    return kept
