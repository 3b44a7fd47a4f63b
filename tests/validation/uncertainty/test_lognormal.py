"""Lognormal curves of least intensities."""

import numpy as np
import pytest
import scipy

from rockcheck.validation.uncertainty.lognormal import Lognormal, fit_least


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


@pytest.mark.parametrize(
    ("least", "beyond"),
    [
        ([0.2, 0.4, 0.5, 0.9], [0.6, 1.0]),
        ([0.2, 0.4], [1.0] * 8),
        ([0.1, 10.0], [0.2, 20.0]),
        # nearly equal: the search begins far too steep
        ([0.5, 0.50001], [5.0] * 3),
        ([0.3, 0.3], [0.31]),
    ],
)
def test_a_censored_fit_has_the_greatest_likelihood(least, beyond):
    fit = fit_least(least, beyond)

    def likelihood(median, dispersion):
        curve = scipy.stats.lognorm(dispersion, scale=median)
        return curve.logpdf(least).sum() + curve.logsf(beyond).sum()

    best = likelihood(fit.median, fit.dispersion)
    for median, dispersion in ((1.0001, 1.0), (0.9999, 1.0), (1.0, 1.0001), (1.0, 0.9999)):
        assert likelihood(fit.median * median, fit.dispersion * dispersion) < best


def test_two_motions_have_a_curve():
    assert fit_least([0.2, 0.8], []).median == pytest.approx(0.4)


def test_equal_motions_have_no_dispersion():
    fit = fit_least([0.4, 0.4], [])
    assert fit.median == pytest.approx(0.4)
    assert fit.dispersion == 0.0


def test_a_motion_that_was_scaled_less_far_tells_nothing_of_equal_ones():
    fit = fit_least([0.4, 0.4], [0.2])
    assert fit.median == pytest.approx(0.4)
    assert fit.dispersion == 0.0


def test_without_dispersion_the_curve_is_a_step_at_the_median():
    fit = Lognormal(0.4, 0.0, 0.4, 0.4, ())
    assert fit.probability(np.array([0.39, 0.4, 0.41])).tolist() == [0.0, 1.0, 1.0]


def test_the_curve_is_normal_in_the_logarithm():
    fit = Lognormal(0.5, 0.3, 0.4, 0.6, ())
    at = 0.5 * np.exp([0.0, 0.3, -0.6])
    assert fit.probability(at).tolist() == pytest.approx([0.5, 0.8413447461, 0.0227501319])


def test_without_motion_nothing_overturns():
    assert Lognormal(0.5, 0.3, 0.4, 0.6, ()).probability(np.array([0.0])).tolist() == [0.0]


def test_the_band_holds_95_percent_of_the_curves():
    """Of 101 curves the third lowest and the third highest are 2 and 98 % quantiles."""
    medians = np.linspace(0.3, 0.8, 101)
    fit = Lognormal(0.5, 0.3, 0.3, 0.8, tuple((median, 0.3) for median in medians.tolist()))
    low, high = fit.band(np.array([0.5]))
    curves = scipy.stats.norm.cdf(np.log(0.5 / medians) / 0.3)
    assert curves[98] < low[0] < curves[97]
    assert curves[3] < high[0] < curves[2]


def test_the_interval_of_the_median_is_that_of_motions_drawn_anew():
    logarithms = np.random.default_rng(5).normal(-0.7, 0.4, 30)
    fit = fit_least(np.exp(logarithms).tolist(), [])
    random = np.random.default_rng(6)
    means = [np.mean(random.choice(logarithms, 30)) for _ in range(4000)]
    low, high = np.exp(np.quantile(means, [0.025, 0.975]))
    assert fit.low == pytest.approx(low, rel=0.03)
    assert fit.high == pytest.approx(high, rel=0.03)


def test_sets_with_fewer_than_two_motions_that_overturn_it_have_no_curve():
    """Of four drawn from two that do and two that do not, 11 of 16 sets have two or more."""
    draws = fit_least([0.2, 0.4], [1.0, 1.0]).draws
    assert len(draws) / 400 == pytest.approx(11 / 16, abs=0.07)
