"""Search of the values of a number at which runs begin or cease to stand.

In: a function that plays runs at values of the number. Out: for each run the intervals of values at
which it does not stand. Called by the searches over gaps and over intensities.

A look at a grid finds every change between neighbours; bisection then narrows each change. An
interval narrower than the grid may be missed, so whoever tells a result tells the grid as well. A
run's own value is always among those looked at: no search contradicts the run as it is.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import Floats

#: Plays runs (1-D indices) at values of the number (1-D, of the same length): whether each stands.
Stands = Callable[[NDArray[np.int64], Floats], NDArray[np.bool_]]


@dataclass(frozen=True)
class Fall:
    """An interval of values at which a run does not stand.

    It falls from `low` to `high`, the outermost values at which it was seen to fall. It was seen to
    stand at `stands_below` and at `stands_above`; None where the interval reaches an end of what
    was searched.
    """

    low: float
    high: float
    stands_below: float | None
    stands_above: float | None

    @property
    def is_island(self) -> bool:
        """Whether the run stands again above."""
        return self.stands_above is not None


@dataclass(frozen=True)
class Look:
    """What was seen of some runs (runs x values): the `values`, not decreasing, and which stand."""

    values: Floats
    stands: NDArray[np.bool_]

    @staticmethod
    def at(grid: Floats, stands: NDArray[np.bool_]) -> "Look":
        """All runs at the same values."""
        return Look(np.broadcast_to(grid, stands.shape), stands)

    def with_own(self, own: Floats, stands: Stands) -> "Look":
        """Each run at its own value, too, where that lies within and was not looked at."""
        first, last = self.values[:, 0], self.values[:, -1]
        known = np.any(self.values == own[:, None], axis=1)
        new = np.flatnonzero((own > first) & (own < last) & ~known)
        value, seen = first.copy(), self.stands[:, 0].copy()  # of the others the first, once more
        value[new], seen[new] = own[new], stands(new, own[new])
        values, seen = np.column_stack([value, self.values]), np.column_stack([seen, self.stands])
        order = np.argsort(values, axis=1, kind="stable")
        return Look(
            np.take_along_axis(values, order, axis=1), np.take_along_axis(seen, order, axis=1)
        )


def falls_within(stands: Stands, look: Look, resolution: Floats | float) -> list[list[Fall]]:
    """The intervals in which each run does not stand, lowest first.

    Each change between neighbours of the `look` is halved until it is narrower than the
    `resolution` (of one change, or of those that begin at each value but the last).
    """
    seen = look.stands
    run, left = np.nonzero(seen[:, 1:] != seen[:, :-1])
    low, high = look.values[run, left], look.values[run, left + 1]
    low_stands = seen[run, left]
    narrow = np.broadcast_to(np.asarray(resolution, dtype=float), (seen.shape[1] - 1,))[left]
    while (wide := np.flatnonzero(high - low > narrow)).size:
        middle = 0.5 * (low[wide] + high[wide])
        same_as_low = stands(run[wide], middle) == low_stands[wide]
        low[wide] = np.where(same_as_low, middle, low[wide])
        high[wide] = np.where(same_as_low, high[wide], middle)
    return [
        _intervals(seen[k], look.values[k], low[run == k], high[run == k], low_stands[run == k])
        for k in range(len(seen))
    ]


def _intervals(
    seen: NDArray[np.bool_],
    grid: Floats,
    low: Floats,
    high: Floats,
    low_stands: NDArray[np.bool_],
) -> list[Fall]:
    """The intervals of one run from its changes, in order."""
    falls: list[Fall] = []
    begin, stands_below = float(grid[0]), None
    for below, above, stood in zip(low.tolist(), high.tolist(), low_stands.tolist(), strict=True):
        if stood:
            begin, stands_below = above, below
        else:
            falls.append(Fall(begin, below, stands_below, above))
    if not seen[-1]:
        falls.append(Fall(begin, float(grid[-1]), stands_below, None))
    return falls
