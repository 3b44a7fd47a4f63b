"""Lognormal curves of least intensities."""

import numpy as np
import pytest
import scipy

from rockcheck.validation.uncertainty.lognormal import fit_least


def test_without_censoring_the_fit_is_the_mean_and_deviation_of_the_logarithms():
    least = [0.2, 0.4, 0.5, 0.9]
    fit = fit_least(least, [])
    assert fit.median == pytest.approx(np.exp(np.mean(np.log(least))))
    assert fit.dispersion == pytest.approx(np.std(np.log(least)))


def test_motions_that_never_overturn_it_move_the_median_up():
    least = [0.2, 0.4, 0.5, 0.9]
    assert fit_least(least, [1.0, 1.0]).median > 1.1 * fit_least(least, []).median


def test_a_known_curve_is_found_from_censored_motions():
    random = np.random.default_rng(3)
    drawn = 0.5 * np.exp(0.4 * random.standard_normal(4000))
    fit = fit_least(drawn[drawn < 0.6].tolist(), [0.6] * int(np.sum(drawn >= 0.6)))
    assert fit.median == pytest.approx(0.5, rel=0.02)
    assert fit.dispersion == pytest.approx(0.4, rel=0.05)


def test_the_interval_of_the_median_holds_the_median():
    fit = fit_least([0.2, 0.4, 0.5, 0.9], [])
    assert fit.low < fit.median < fit.high


def test_the_band_holds_the_curve():
    fit = fit_least([0.2, 0.4, 0.5, 0.9], [1.0])
    at = np.array([0.3, 0.6])
    low, high = fit.band(at)
    assert np.all(low <= fit.probability(at))
    assert np.all(high >= fit.probability(at))


def test_one_motion_has_no_curve():
    assert fit_least([0.4], [1.0]) is None


def test_the_band_has_no_hole_where_draws_have_no_dispersion():
    least = [0.2, 0.4, 0.5]
    low, high = fit_least(least, []).band(np.array(least))
    assert np.isfinite(low).all()
    assert np.isfinite(high).all()


def test_a_censored_fit_has_the_greatest_likelihood():
    least, beyond = np.array([0.2, 0.4, 0.5, 0.9]), np.array([0.6, 1.0])
    fit = fit_least(least.tolist(), beyond.tolist())

    def likelihood(median, dispersion):
        curve = scipy.stats.lognorm(dispersion, scale=median)
        return curve.logpdf(least).sum() + curve.logsf(beyond).sum()

    best = likelihood(fit.median, fit.dispersion)
    for median, dispersion in ((1.001, 1.0), (0.999, 1.0), (1.0, 1.001), (1.0, 0.999)):
        assert likelihood(fit.median * median, fit.dispersion * dispersion) < best
