"""The statistics of an ensemble against closed forms."""

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from rockcheck.validation.discrepancy.statistics import STATISTICS, Sample, Samples


def samples(
    reference: list[float], candidate: list[float], fallen: tuple[int, ...] = ()
) -> Samples:
    """Peaks of both; in the scenes `fallen` the candidate falls."""
    safe = ("at rest",) * len(reference)
    ends = tuple("overturned left" if n in fallen else "at rest" for n in range(len(candidate)))
    return Samples(Sample(np.array(reference), safe), Sample(np.array(candidate), ends))


def test_the_fallen_are_beyond_all_others():
    """Two of four rock less than any of the reference and two fall: the distributions part by a
    half; as peaks of 0 by the whole."""
    value, remark = STATISTICS["ks_distance"].evaluate(
        samples([0.1, 0.2, 0.3, 0.4], [0.05, 0.06, 0.1, 0.2], fallen=(2, 3))
    )
    assert value == pytest.approx(0.5)
    assert remark.startswith("p = ")


def test_bias_and_scatter_by_student_and_chi_squared():
    """Four ratios: mean and its interval as scipy's t-test has it; the scatter is that of a sample,
    not of a population."""
    reference, candidate = [0.1, 0.2, 0.3, 0.4], [0.11, 0.19, 0.36, 0.41]
    ratios = np.log(np.array(candidate) / reference)
    bias, remark = STATISTICS["peak_bias"].evaluate(samples(reference, candidate))
    interval = ttest_1samp(ratios, 0.0).confidence_interval(0.95)
    assert bias == pytest.approx(np.mean(ratios))
    assert remark == f"[{interval.low:.2g}, {interval.high:.2g}], 4 scenes"
    scatter, remark = STATISTICS["peak_scatter"].evaluate(samples(reference, candidate))
    assert scatter == pytest.approx(np.sqrt(np.sum((ratios - bias) ** 2) / 3.0))
    # chi-squared with 3 degrees of freedom has its 2.5 % and 97.5 % points at 0.2158 and 9.3484
    assert (
        remark == f"[{scatter * np.sqrt(3.0 / 9.3484):.2g}, {scatter * np.sqrt(3.0 / 0.2158):.2g}]"
    )


def test_only_scenes_in_which_both_rock_have_a_ratio():
    """A peak of a thousandth and less, and a fall, have none; with fewer than two there is no bias
    and no scatter."""
    both = samples([0.1, 0.2, 1e-3, 0.4, 0.3], [0.2, 0.4, 0.4, 1e-3, 0.6], fallen=(4,))
    assert both.log_ratios() == pytest.approx(np.log([2.0, 2.0]))
    for name in ("peak_bias", "peak_scatter"):
        value, remark = STATISTICS[name].evaluate(samples([0.1, 0.2], [0.1, 1e-4]))
        assert np.isnan(value)
        assert remark == "fewer than two scenes in which both rock and neither falls"


def test_shares_have_wilsons_interval():
    """Three of four: Wilson (1927) by his formula; where none falls, precision and recall are 1."""
    value, remark = STATISTICS["overturning_accuracy"].evaluate(
        samples([0.1] * 4, [0.1] * 4, fallen=(0,))
    )
    z, p, n = 1.959963984540054, 0.75, 4
    middle, half = (
        (p + z * z / (2 * n)) / (1 + z * z / n),
        z / (1 + z * z / n) * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n)),
    )
    assert (value, remark) == (0.75, f"[{middle - half:.3f}, {middle + half:.3f}], 3 of 4")
    assert STATISTICS["overturning_recall"].evaluate(
        samples([0.1] * 4, [0.1] * 4, fallen=(0,))
    ) == (1.0, "none fall")
    assert (
        STATISTICS["overturning_precision"].evaluate(samples([0.1] * 4, [0.1] * 4, fallen=(0,)))[0]
        == 0.0
    )


def test_a_failed_scene_is_counted():
    sample = Sample(np.array([0.1, np.nan, np.inf]), ("at rest", "", "overturned left"))
    assert (sample.failures, list(sample.fallen)) == (2, [False, False, True])


def test_what_a_statistic_tells_apart():
    """One of a thousand scenes is a thousandth of a share; areas and logarithms are told to a
    ten-thousandth."""
    shares = {"ks_distance", "overturning_accuracy", "overturning_precision", "overturning_recall"}
    assert {name: one.resolution for name, one in STATISTICS.items()} == {
        name: 1e-3 if name in shares else 1e-4 for name in STATISTICS
    }
