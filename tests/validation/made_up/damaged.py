"""Intensities that exceed capacities, made up: their answers, and the files of their curves."""

from assessed import CERTAIN, RUNS, gathered, interval

from rockcheck.validation.studies.population import damage, damage_files, results
from rockcheck.validation.studies.population.capacities import Capacity
from rockcheck.validation.studies.population.intensity_measures import measure_of, size_of

SLIP, FALL = Capacity("slip", 0.05), Capacity("overturns")
PGA = measure_of("pga")
SIZE = size_of(PGA, CERTAIN)


def answers_of(capacities=(SLIP,), **searches):
    """Answers for the intervals of a capacity, by case; of one that is not named: none."""
    found = {
        case: results.FactorSearch(
            intervals=(),
            exceeded={
                capacity.name: tuple(intervals if capacity == capacities[0] else ())
                for capacity in capacities
            },
            undecided=0,
            runs=9,
        )
        for case, intervals in searches.items()
    }
    runs = dict.fromkeys(searches, RUNS["a"])
    everything = gathered(runs, measure=PGA, capacities=capacities, factors=found)
    return damage.damage_answers(everything)


def from_factor(factor):
    return [interval(0, factor, 40.0, 0.99 * factor, None)]


def library(measure="pga"):
    """Pelicun's files of two curves."""
    found = {
        case: results.FactorSearch(
            intervals=(),
            exceeded={SLIP.name: from_factor(factor), FALL.name: from_factor(3.0 * factor)},
            undecided=0,
            runs=9,
        )
        for case, factor in {"a": 1.0, "b": 4.0}.items()
    }
    runs = dict.fromkeys(found, RUNS["a"])
    everything = gathered(runs, measure=measure_of(measure), capacities=(SLIP, FALL), factors=found)
    answers = damage.damage_answers(everything)
    return damage_files.pelicun_files(answers, CERTAIN.scene, "ebm-unilateral", "1.2.3"), answers
