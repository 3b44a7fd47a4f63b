"""The intensities at which capacities are exceeded.

In: the searches of all motions (`factor_task`). Out: for each capacity the least intensity of each
motion, their lognormal curve, and whether they are lognormal at all. The study asks for it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rockcheck.validation.studies.population.capacities import Capacity
from rockcheck.validation.studies.population.gathered import Gathered
from rockcheck.validation.studies.population.statistics import IntensityAnswer, least_intensities

#: Fewest motions of which a test can tell whether their intensities are lognormal; the probability
#: of values as far from it below which they are said not to be; sets drawn for it.
FEWEST_TESTED, UNLIKELY, DRAWS = 5, 0.05, 999
_SEED = 3


@dataclass(frozen=True)
class DamageAnswer:
    """The intensities that exceed a capacity.

    `likely` is the probability that intensities of a lognormal distribution are as far from the
    fitted one as these are (Lilliefors' test); None where some motion does not exceed the capacity,
    or there are too few.
    """

    capacity: Capacity
    intensity: IntensityAnswer
    likely: float | None

    @property
    def exceeded_by(self) -> int:
        """How many motions exceed it at some intensity."""
        return sum(record.least is not None for record in self.intensity.records)

    @property
    def islands(self) -> int:
        """How many motions exceed it, and at some larger intensity do not."""
        return sum(bool(record.islands) for record in self.intensity.records)


def damage_answers(gathered: Gathered) -> list[DamageAnswer]:
    """An answer a capacity; none where no motion was scaled."""
    searches, tasks = gathered.factors, gathered.plan.factors
    most = {case: tasks[case].factors[-1] for case in searches}
    undecided = sum(search.undecided for search in searches.values())
    answers = []
    for capacity in gathered.plan.capacities:
        intervals = {case: search.exceeded[capacity.name] for case, search in searches.items()}
        intensity = least_intensities(gathered, intervals, most, undecided)
        if intensity is not None:
            least = [record.least for record in intensity.records]
            answers.append(DamageAnswer(capacity, intensity, likely_lognormal(least)))
    return answers


def likely_lognormal(values: Sequence[float | None]) -> float | None:
    """Lilliefors' test of the logarithms, its distribution by drawing; seeded.

    None where a value is missing, or there are fewer than `FEWEST_TESTED`, or all are equal.
    """
    from scipy import stats

    known = [value for value in values if value is not None]
    if len(known) < len(values) or len(known) < FEWEST_TESTED or min(known) == max(known):
        return None
    test = stats.goodness_of_fit(
        stats.norm, np.log(known), statistic="ks", n_mc_samples=DRAWS, rng=_SEED
    )
    return float(test.pvalue)
