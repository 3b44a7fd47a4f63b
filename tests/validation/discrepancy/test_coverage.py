"""Printed intervals cover as often as they say: samples of known distributions, seeded."""

import re

import numpy as np
import pytest

from rockcheck.validation.discrepancy.statistics import STATISTICS, Sample, Samples

TIMES, SCENES = 600, 60
BIAS, SCATTER, AGREE = 0.05, 0.2, 0.9


def made(chance) -> Samples:
    """Peaks whose ratios are lognormal, and outcomes of which nine in ten agree; who falls has no
    ratio."""
    peaks = chance.uniform(0.2, 0.8, SCENES)
    outcomes = np.where(chance.random(SCENES) < 0.3, "overturned left", "at rest")
    other = np.where(outcomes == "at rest", "overturned left", "at rest")
    theirs = np.where(chance.random(SCENES) < AGREE, outcomes, other)
    ratios = np.exp(BIAS + SCATTER * chance.standard_normal(SCENES))
    return Samples(Sample(peaks, list(outcomes)), Sample(peaks * ratios, list(theirs)))


@pytest.mark.parametrize(
    ("name", "truth"),
    [("peak_bias", BIAS), ("peak_scatter", SCATTER), ("overturning_accuracy", AGREE)],
)
def test_the_interval_in_the_remark_covers(name, truth):
    chance, inside = np.random.default_rng(11), 0
    for _ in range(TIMES):
        _, remark = STATISTICS[name].evaluate(made(chance))
        low, high = map(float, re.match(r"\[(-?[\d.e-]+), (-?[\d.e-]+)\]", remark).groups())
        inside += low <= truth <= high
    assert 0.92 <= inside / TIMES <= 0.98
