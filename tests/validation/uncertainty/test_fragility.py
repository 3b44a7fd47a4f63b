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


def test_between_all_that_stand_and_all_that_fall_the_middle_is_taken():
    found = fragility.fit_lognormal(INTENSITIES, np.array([0, 0, 10, 10]), RUNS)
    assert found == (pytest.approx(np.sqrt(6.0)), 0.0)
    assert fragility.probabilities(INTENSITIES, *found).tolist() == [0.0, 0.0, 1.0, 1.0]


# Curves of motions in both directions

#: Of three motions, by direction and intensity: which fall, and of which a run failed.
HIT = np.array([[[0, 0, 1, 1], [0, 1, 1, 1]], [[0, 0, 0, 1], [0, 0, 1, 1]], [[0, 0, 0, 1]] * 2]) > 0
FAILED = np.zeros_like(HIT)
FAILED[0, 1, 1] = FAILED[2, :, 3] = True


def test_shares_are_of_the_runs_that_did_not_fail():
    curve = fragility.curve_of("falls", HIT, FAILED, INTENSITIES)
    assert [point[1] for point in curve.points] == pytest.approx([0.0, 0.0, 0.5, 1.0])
    assert curve.undecided == 3
    assert curve.motions == 3


def test_bands_are_of_the_motions_with_a_run():
    """None of three falls, or all of two: Clopper and Pearson's."""
    curve = fragility.curve_of("falls", HIT, FAILED, INTENSITIES)
    low, high = zip(*(point[2:4] for point in curve.points), strict=True)
    assert low[0] == 0.0
    assert high[0] == pytest.approx(1.0 - 0.025 ** (1.0 / 3.0))
    assert low[3] == pytest.approx(0.025**0.5)
    assert high[3] == 1.0


def test_where_all_runs_failed_nothing_is_known():
    failed = FAILED.copy()
    failed[:, :, 0] = True
    first, *_ = fragility.curve_of("falls", HIT, failed, INTENSITIES).points
    assert np.isnan(first[1:4]).all()


@pytest.mark.parametrize(("never", "known"), [(0, True), (1, False)])
def test_an_interval_needs_nine_fits_of_ten(never, known):
    """Where one motion of two never falls, a quarter of the draws has no curve."""
    falls = np.tile(INTENSITIES > 2.0, (2, 2, 1))
    falls[:never] = False
    curve = fragility.curve_of("falls", falls, np.zeros_like(falls), INTENSITIES, draws=100)
    assert np.isfinite([curve.low, curve.high]).all() == known
