"""The lognormal curve of the greatest likelihood, against its definition."""

import numpy as np
import pytest
from scipy.stats import binom, norm

from rockcheck.validation.uncertainty import fragility

INTENSITIES, RUNS = np.array([1.0, 2.0, 3.0, 4.0]), np.full(4, 10)


def likelihood(hits, median, dispersion):
    shares = norm.cdf(np.log(INTENSITIES / median) / dispersion)
    return float(np.sum(binom.logpmf(hits, RUNS, shares)))


@pytest.mark.parametrize("hits", [[0, 0, 1, 0], [0, 1, 3, 6], [2, 5, 4, 8], [5, 10, 9, 10]])
def test_no_curve_nearby_is_likelier(hits):
    """Also where a single run falls, or a single one stands."""
    median, dispersion = fragility.fit_lognormal(INTENSITIES, np.array(hits), RUNS)
    nearby = [
        likelihood(hits, median * (1.0 + change), dispersion * (1.0 + other))
        for change in (-0.02, 0.0, 0.02)
        for other in (-0.02, 0.0, 0.02)
    ]
    assert max(nearby) == pytest.approx(likelihood(hits, median, dispersion), abs=1e-9)


def test_where_some_fall_at_one_intensity_alone_it_is_a_step_there():
    found = fragility.fit_lognormal(INTENSITIES, np.array([0, 0, 3, 10]), RUNS)
    assert found == (3.0, 0.0)
    assert fragility.probabilities(INTENSITIES, *found).tolist() == [0.0, 0.0, 0.5, 1.0]


@pytest.mark.parametrize("hits", [[0, 0, 0, 1], [0, 0, 0, 9], [4, 10, 10, 10]])
def test_where_some_fall_at_the_first_or_last_intensity_alone_there_is_no_curve(hits):
    """The intensity of one half is not between those that were played."""
    assert np.isnan(fragility.fit_lognormal(INTENSITIES, np.array(hits), RUNS)).all()


def test_an_intensity_at_which_all_runs_failed_bounds_nothing():
    runs = np.array([10, 10, 10, 0])
    assert np.isnan(fragility.fit_lognormal(INTENSITIES, np.array([0, 0, 3, 0]), runs)).all()


@pytest.mark.parametrize("hits", [[0, 0, 0, 0], [10, 10, 10, 10], [6, 3, 1, 0]])
def test_where_nothing_rises_there_is_no_curve(hits):
    assert np.isnan(fragility.fit_lognormal(INTENSITIES, np.array(hits), RUNS)).all()
