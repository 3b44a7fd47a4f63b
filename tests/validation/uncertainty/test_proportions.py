"""Shares of runs, and intervals that hold their confidence."""

import numpy as np
import pytest
from scipy.stats import beta

from rockcheck.validation.uncertainty.proportions import share_of_runs

SETS = 500
DRAWS = 64


def test_single_runs_of_many_records_have_wilsons_interval():
    share = share_of_runs(np.array([1] * 3 + [0] * 9), np.ones(12, dtype=int))
    assert share.low == pytest.approx(0.0889, abs=1e-4)
    assert share.high == pytest.approx(0.5323, abs=1e-4)


def test_draws_of_one_motion_are_independent():
    share = share_of_runs(np.array([72]), np.array([256]))
    assert share.probability == pytest.approx(0.28125)
    assert share.low == pytest.approx(0.2297, abs=1e-4)
    assert share.high == pytest.approx(0.3392, abs=1e-4)


def test_draws_under_records_count_no_more_than_the_records():
    few = share_of_runs(np.array([0, 0]), np.array([DRAWS, DRAWS]))
    assert few.high == pytest.approx(0.8419, abs=1e-4)  # 1 - sqrt(0.025): none of two
    assert few.low == 0.0


def test_without_runs_there_is_no_share():
    share = share_of_runs(np.array([0]), np.array([0]))
    assert share.count == 0
    assert share.of == 0
    assert np.isnan(share.probability)


def test_the_share_under_records_is_the_mean_of_their_shares():
    share = share_of_runs(np.array([1, 0]), np.array([1, 3]))
    assert share.probability == 0.5
    assert share.count == 1
    assert share.of == 4


def test_a_record_without_runs_does_not_count():
    share = share_of_runs(np.array([1, 0, 0]), np.array([4, 4, 0]))
    assert share.probability == 0.125
    # of two records, hits of 0.25: beta quantiles
    assert share.high == pytest.approx(beta.ppf(0.975, 1.25, 1.75))


def test_what_always_happens_under_few_records_may_always_happen():
    share = share_of_runs(np.array([DRAWS, DRAWS]), np.array([DRAWS, DRAWS]))
    assert share.low == pytest.approx(0.1581, abs=1e-4)  # sqrt(0.025): both of two
    assert share.high == 1.0


def test_parts_of_a_run_have_an_interval():
    share = share_of_runs(np.array([30, 6]), np.array([60, 60]))
    assert share.low == pytest.approx(beta.ppf(0.025, 0.6, 2.4))
    assert share.high == pytest.approx(beta.ppf(0.975, 1.6, 1.4))


def test_parts_of_a_miss_have_an_interval():
    share = share_of_runs(np.array([54, 36]), np.array([60, 60]))
    assert share.low == pytest.approx(beta.ppf(0.025, 1.5, 1.5))
    assert share.high == pytest.approx(beta.ppf(0.975, 2.5, 0.5))


@pytest.mark.parametrize(("records", "method"), [(6, "Clopper-Pearson"), (7, "Wilson")])
def test_the_exact_interval_is_for_few_records(records, method):
    hits = np.array([1] + [0] * (records - 1))
    assert share_of_runs(hits, np.ones(records, dtype=int)).method == method


def test_several_runs_under_many_records_have_the_exact_interval():
    share = share_of_runs(np.full(12, 1), np.full(12, 2))
    assert share.method == "Clopper-Pearson"
    assert share.low == pytest.approx(beta.ppf(0.025, 6, 7))


def test_a_single_run_is_the_least_that_has_a_share():
    share = share_of_runs(np.array([1]), np.array([1]))
    assert share.probability == 1.0
    # Wilson's of 1 of 1: 1 / (1 + z^2)
    assert share.low == pytest.approx(1.0 / (1.0 + 1.959964**2))
    assert share.high == 1.0


@pytest.mark.parametrize("records", [2, 3, 5, 12])
@pytest.mark.parametrize("alike", [0.02, 0.3, 0.6, 0.95])
@pytest.mark.parametrize("probability", [0.05, 0.2, 0.5])
def test_the_interval_holds_95_percent_for_draws_under_records(records, alike, probability):
    """Records whose probabilities differ (beta), draws under each; `alike`: their correlation."""
    random = np.random.default_rng(records)
    shape = (1.0 - alike) / alike
    each = random.beta(probability * shape, (1.0 - probability) * shape, size=(SETS, records))
    hits = random.binomial(DRAWS, each)
    runs = np.full(records, DRAWS)
    shares = [share_of_runs(row, runs) for row in hits]
    held = np.mean([share.low <= probability <= share.high for share in shares])
    assert held >= 0.95


@pytest.mark.parametrize("records", [2, 3, 5])
@pytest.mark.parametrize("probability", [0.05, 0.2, 0.5])
def test_the_interval_holds_95_percent_for_single_runs_of_few_records(records, probability):
    random = np.random.default_rng(records)
    hits = random.binomial(1, probability, size=(SETS, records))
    runs = np.ones(records, dtype=int)
    shares = [share_of_runs(row, runs) for row in hits]
    held = np.mean([share.low <= probability <= share.high for share in shares])
    assert held >= 0.95
