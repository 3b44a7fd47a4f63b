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


@pytest.mark.parametrize("hits", [[0, 0, 0, 0], [10, 10, 10, 10], [6, 3, 1, 0]])
def test_where_nothing_rises_there_is_no_curve(hits):
    assert np.isnan(fragility.fit_lognormal(INTENSITIES, np.array(hits), RUNS)).all()
