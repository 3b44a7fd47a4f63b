"""The search of a case for the factors on its motion that exceed capacities.

In: a case, factors, capacities. Out: a `results.DamageSearch`. The plan makes the task.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import fates
from rockcheck.scenes import Floats
from rockcheck.validation.studies.population import results
from rockcheck.validation.studies.population.capacities import Capacity
from rockcheck.validation.studies.population.tasks import (
    FACTOR_RESOLUTION,
    Counter,
    DrawTask,
    narrowed,
)


@dataclass(frozen=True)
class DamageTask(DrawTask):
    """The search over a factor on the base motion for what exceeds each of the `capacities`.

    All are looked at in the same runs, at `factors` (increasing). With `both` the vertical motion
    is scaled, too.
    """

    factors: tuple[float, ...] = ()
    both: bool = False
    capacities: tuple[Capacity, ...] = ()

    def play(self) -> results.DamageSearch:
        """The look, and a bisection for each capacity."""
        counter = Counter()
        grid, case = np.array(self.factors), np.array([0])
        looked = self._at(grid, counter)
        intervals = {}
        for capacity in self.capacities:

            def bears(
                which: NDArray[np.int64], factor: Floats, capacity: Capacity = capacity
            ) -> NDArray[np.bool_]:
                return ~capacity.exceeded(self._at(factor, counter), self.scene.block.alpha)

            seen = ~capacity.exceeded(looked, self.scene.block.alpha)[None, :]
            found = narrowed(bears, case, seen, grid, FACTOR_RESOLUTION * grid[:-1])
            intervals[capacity.name] = tuple(found)
        return results.DamageSearch(
            intervals=intervals, undecided=counter.undecided, runs=counter.runs
        )

    def _at(self, factor: Floats, counter: Counter) -> fates.Fates:
        """The fates of the scene as it is, with extremes, at factors on its motion."""
        played = self.batch(
            np.zeros(len(factor), np.int64),
            factor=factor,
            vertical_factor=factor if self.both else 1.0,
            keeps=fates.Keep.EXTREMES,
        )
        counter.standing(played)
        return played
