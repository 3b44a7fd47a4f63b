"""The search of a case over a factor on its motion: what overturns it, what exceeds capacities.

In: a case, factors, capacities. Out: a `results.FactorSearch`. The plan makes the task.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import fates
from rockcheck.scenes import Floats
from rockcheck.validation.studies.population import results, search
from rockcheck.validation.studies.population.capacities import OVERTURNS, Capacity
from rockcheck.validation.studies.population.tasks import Counter, DrawTask, fall_intervals

#: A factor is known to this part of it.
FACTOR_RESOLUTION = 2.5e-3


@dataclass(frozen=True)
class FactorTask(DrawTask):
    """The search over a factor on the base motion, looked at in `factors` (increasing).

    Where the block does not stand and where it exceeds each of the `capacities` is found in the
    same runs. With `both` the vertical motion is scaled, too.
    """

    factors: tuple[float, ...] = field(default=(), repr=False)
    both: bool = False
    capacities: tuple[Capacity, ...] = ()

    def play(self) -> results.FactorSearch:
        """One look, then a bisection of all changes at once."""
        counter = Counter()
        overturns = Capacity(OVERTURNS)
        capacities = tuple(dict.fromkeys((overturns, *self.capacities)))

        def borne(factor: Floats) -> NDArray[np.bool_]:
            """Which capacities (rows) are not exceeded at which factors."""
            played = self._at(factor, counter)
            alpha = self.scene.block.alpha
            return np.array([~capacity.exceeded(played, alpha) for capacity in capacities])

        def bears(which: NDArray[np.int64], factor: Floats) -> NDArray[np.bool_]:
            once, back = np.unique(factor, return_inverse=True)
            return borne(once)[which, back]

        grid = np.array(self.factors)
        look = search.Look.at(grid, borne(grid))
        found = search.falls_within(bears, look, FACTOR_RESOLUTION * grid[:-1])
        intervals = {
            capacity: tuple(fall_intervals(0, falls))
            for capacity, falls in zip(capacities, found, strict=True)
        }
        return results.FactorSearch(
            intervals=intervals[overturns],
            exceeded={capacity.name: intervals[capacity] for capacity in self.capacities},
            undecided=counter.undecided,
            runs=counter.runs,
        )

    def _at(self, factor: Floats, counter: Counter) -> fates.Fates:
        """The fates of the scene as it is at factors on its motion; extremes where they count."""
        counts = any(capacity.quantity != OVERTURNS for capacity in self.capacities)
        played = self.batch(
            np.zeros(len(factor), np.int64),
            factor=factor,
            vertical_factor=factor if self.both else 1.0,
            keeps=fates.Keep.EXTREMES if counts else fates.Keep.NOTHING,
        )
        counter.standing(played)
        return played
