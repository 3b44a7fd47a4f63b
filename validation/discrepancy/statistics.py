"""How far two samples of an ensemble are apart: distributions of the peaks, agreement on
overturning, bias and scatter."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.validation.discrepancy.measures import Measure, Undefined, register

Array = NDArray[np.float64]
#: Peaks below this (alpha) have no ratio worth a logarithm.
SMALLEST_PEAK = 1e-3
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Sample:
    """What one model made of an ensemble: peak rotation (alpha) and outcome of each scene; NaN and
    "" where it failed."""

    peaks: Array
    outcomes: Sequence[str]

    @property
    def fallen(self) -> NDArray[np.bool_]:
        """Which scenes end overturned."""
        return np.array([outcome.startswith("overturned") for outcome in self.outcomes])

    @property
    def failures(self) -> int:
        """Scenes without a result."""
        return int(np.sum(~np.isfinite(self.peaks)))


@dataclass(frozen=True)
class Samples:
    """Reference and candidate of one ensemble."""

    reference: Sample
    candidate: Sample

    def log_ratios(self) -> Array:
        """ln(c/r) of the peaks where neither falls and both rock."""
        r, c = self.reference, self.candidate
        rocks, too = (~sample.fallen & (sample.peaks > SMALLEST_PEAK) for sample in (r, c))
        if np.sum(rocks) < 2:
            raise Undefined("fewer than two scenes in which the reference rocks and does not fall")
        usable = rocks & too
        return np.log(c.peaks[usable] / r.peaks[usable])


STATISTICS: dict[str, Measure] = {}


def statistic(label: str, unit: str, **settings: Any) -> Callable[..., Any]:
    """Register a function of `Samples` as a measure of ensembles."""
    return register(STATISTICS, label, unit, **settings)


@statistic("Kolmogorov-Smirnov distance", "1", resolution=1e-3)
def ks_distance(samples: Samples) -> tuple[float, str]:
    """max |F_c - F_r| of the distributions of peak |theta|/alpha, the fallen beyond all others; the
    remark gives its p-value.

    Two-sample Kolmogorov-Smirnov test: the probability of such a distance between two samples of
    one distribution.
    """
    from scipy.stats import ks_2samp

    r, c = (
        np.where(sample.fallen, np.inf, sample.peaks)
        for sample in (samples.reference, samples.candidate)
    )
    if np.any(np.isnan(r)) or np.any(np.isnan(c)):
        return math.nan, "a model failed in some of the scenes"
    ranks = np.unique(np.concatenate([r, c]), return_inverse=True)[
        1
    ]  # the test takes no infinities, but only order counts
    found = ks_2samp(ranks[: len(r)], ranks[len(r) :])
    return float(found.statistic), f"p = {found.pvalue:.2g}"


@statistic("area between the distributions", "1", resolution=1e-4)
def area_metric(samples: Samples) -> tuple[float, str]:
    """Area between the distribution functions of peak |theta|/alpha (ASME V&V 10-2006; Ferson
    2008), the fallen at 1, the balance point."""
    from scipy.stats import wasserstein_distance

    r, c = (
        np.where(sample.fallen, 1.0, np.minimum(sample.peaks, 1.0))
        for sample in (samples.reference, samples.candidate)
    )
    if np.any(np.isnan(r)) or np.any(np.isnan(c)):
        return math.nan, "a model failed in some of the scenes"
    return float(wasserstein_distance(r, c)), ""


@statistic("agreement on overturning", "1", ideal=1.0, resolution=1e-3)
def overturning_accuracy(samples: Samples) -> tuple[float, str]:
    """Share of scenes in which both fall or both stay; the remark gives its 95 % confidence
    interval (Wilson 1927)."""
    agree = samples.reference.fallen == samples.candidate.fallen
    return _share(int(np.sum(agree)), len(agree))


@statistic("precision of overturning", "1", ideal=1.0, resolution=1e-3)
def overturning_precision(samples: Samples) -> tuple[float, str]:
    """Share of the scenes in which the candidate falls that the reference falls in too; 1 if it
    falls in none."""
    both = int(np.sum(samples.reference.fallen & samples.candidate.fallen))
    return _share(both, int(np.sum(samples.candidate.fallen)))


@statistic("recall of overturning", "1", ideal=1.0, resolution=1e-3)
def overturning_recall(samples: Samples) -> tuple[float, str]:
    """Share of the scenes in which the reference falls that the candidate falls in too; 1 if it
    falls in none."""
    both = int(np.sum(samples.reference.fallen & samples.candidate.fallen))
    return _share(both, int(np.sum(samples.reference.fallen)))


@statistic("bias of peak rotation", "1", resolution=1e-4)
def peak_bias(samples: Samples) -> tuple[float, str]:
    """Mean of ln(c/r) of the peaks where neither falls; the remark gives its 95 % confidence
    interval (Student)."""
    from scipy.stats import t

    ratios = samples.log_ratios()
    if len(ratios) < 2:
        return math.nan, "fewer than two scenes in which both rock and neither falls"
    half = float(
        t.ppf(0.5 + 0.5 * CONFIDENCE, len(ratios) - 1)
        * np.std(ratios, ddof=1)
        / math.sqrt(len(ratios))
    )
    mean = float(np.mean(ratios))
    return mean, f"[{mean - half:.2g}, {mean + half:.2g}], {len(ratios)} scenes"


@statistic("scatter of peak rotation", "1", resolution=1e-4)
def peak_scatter(samples: Samples) -> tuple[float, str]:
    """Standard deviation of ln(c/r) of the peaks where neither falls; the remark gives its 95 %
    interval (chi-squared)."""
    from scipy.stats import chi2

    ratios = samples.log_ratios()
    if len(ratios) < 2:
        return math.nan, "fewer than two scenes in which both rock and neither falls"
    scatter, free = float(np.std(ratios, ddof=1)), len(ratios) - 1
    low, high = (
        scatter * math.sqrt(free / chi2.ppf(0.5 + sign * 0.5 * CONFIDENCE, free))
        for sign in (1.0, -1.0)
    )
    return scatter, f"[{low:.2g}, {high:.2g}]"


def _share(hits: int, of: int) -> tuple[float, str]:
    from scipy.stats import binomtest

    if of == 0:
        return 1.0, "none fall"
    interval = binomtest(hits, of).proportion_ci(CONFIDENCE, method="wilson")
    return hits / of, f"[{interval.low:.3f}, {interval.high:.3f}], {hits} of {of}"
