"""Shares of runs, and intervals that hold their confidence."""

import numpy as np
import pytest

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
    assert share.of == 0
    assert np.isnan(share.probability)


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
