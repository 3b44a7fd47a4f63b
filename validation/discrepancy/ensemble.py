"""Statistics of an ensemble of scenes: distributions of the peaks, agreement on overturning.

In: `Samples`, two models' results for the same scenes. Out: a number and a remark for each of
`STATISTICS`; `Unavailable` is raised where too few scenes are left. Called by `suite.ensembles`.
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy  # it loads its parts as they are used
from numpy.typing import NDArray

from rockcheck.scenes import Floats
from rockcheck.validation.discrepancy.figures import NOT_DEFINED, Measure, Unavailable, by_name

#: Peaks below this (alpha) have no ratio worth a logarithm.
SMALLEST_PEAK = 1e-3
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Sample:
    """One model's results for an ensemble: peak rotation (alpha) and outcome of each scene.

    NaN and "" where it failed.
    """

    peaks: Floats
    outcomes: Sequence[str]

    @property
    def fallen(self) -> NDArray[np.bool_]:
        """Which scenes end overturned."""
        return np.array([outcome.startswith("overturned") for outcome in self.outcomes])

    @property
    def rocks_and_stays(self) -> NDArray[np.bool_]:
        """In which scenes the block rocks by more than `SMALLEST_PEAK` and does not fall."""
        return np.asarray(~self.fallen & (self.peaks > SMALLEST_PEAK))

    @property
    def failures(self) -> int:
        """Scenes without a result."""
        return int(np.sum(~np.isfinite(self.peaks)))

    def limited_peaks(self, limit: float) -> Floats:
        """The peaks (alpha), at most `limit`, which is also the value of fallen blocks."""
        return np.asarray(np.where(self.fallen, limit, np.minimum(self.peaks, limit)))


@dataclass(frozen=True)
class Samples:
    """Reference and candidate of one ensemble."""

    reference: Sample
    candidate: Sample

    def log_ratios(self) -> Floats:
        """ln(c/r) of the peaks where neither falls and both rock; at least two."""
        reference_rocks = self.reference.rocks_and_stays
        if np.sum(reference_rocks) < 2:
            raise Unavailable(
                f"{NOT_DEFINED}: fewer than two scenes in which the reference rocks and"
                " does not fall"
            )
        both_rock = reference_rocks & self.candidate.rocks_and_stays
        if np.sum(both_rock) < 2:
            raise Unavailable("fewer than two scenes in which both rock and neither falls")
        return np.log(self.candidate.peaks[both_rock] / self.reference.peaks[both_rock])

    def limited_peaks(self, limit: float) -> tuple[Floats, Floats]:
        """The peaks of both as in `Sample`; raises `Unavailable` where a model failed."""
        reference = self.reference.limited_peaks(limit)
        candidate = self.candidate.limited_peaks(limit)
        if np.any(np.isnan(reference)) or np.any(np.isnan(candidate)):
            raise Unavailable("a model failed in some of the scenes")
        return reference, candidate


def _ks_distance(samples: Samples) -> tuple[float, str]:
    reference, candidate = samples.limited_peaks(math.inf)
    peaks = np.concatenate([reference, candidate])
    peaks[peaks < SMALLEST_PEAK] = 0.0
    # The test takes no infinities, but only order counts.
    ranks = np.unique(peaks, return_inverse=True)[1]
    with warnings.catch_warnings(action="ignore"):  # where the exact test fails it takes the usual
        test = scipy.stats.ks_2samp(ranks[: len(reference)], ranks[len(reference) :])
    return float(test.statistic), f"p = {test.pvalue:.2g}"


def _area(samples: Samples) -> tuple[float, str]:
    reference, candidate = samples.limited_peaks(1.0)
    return float(scipy.stats.wasserstein_distance(reference, candidate)), ""


def _accuracy(samples: Samples) -> tuple[float, str]:
    agree = samples.reference.fallen == samples.candidate.fallen
    return _share(int(np.sum(agree)), len(agree))


def _precision(samples: Samples) -> tuple[float, str]:
    both_fall = samples.reference.fallen & samples.candidate.fallen
    return _share(int(np.sum(both_fall)), int(np.sum(samples.candidate.fallen)))


def _recall(samples: Samples) -> tuple[float, str]:
    both_fall = samples.reference.fallen & samples.candidate.fallen
    return _share(int(np.sum(both_fall)), int(np.sum(samples.reference.fallen)))


def _share(count: int, scenes: int) -> tuple[float, str]:
    """The share `count` of `scenes`, and its confidence interval in words; 1 of no scenes."""
    if scenes == 0:
        return 1.0, "none fall"
    interval = scipy.stats.binomtest(count, scenes).proportion_ci(CONFIDENCE, method="wilson")
    return count / scenes, f"[{interval.low:.3f}, {interval.high:.3f}], {count} of {scenes}"


def _peak_bias(samples: Samples) -> tuple[float, str]:
    ratios = samples.log_ratios()
    mean = float(np.mean(ratios))
    student = scipy.stats.t.ppf(0.5 + 0.5 * CONFIDENCE, len(ratios) - 1)
    half_width = float(student * np.std(ratios, ddof=1) / math.sqrt(len(ratios)))
    return mean, f"[{mean - half_width:.2g}, {mean + half_width:.2g}], {len(ratios)} scenes"


def _peak_scatter(samples: Samples) -> tuple[float, str]:
    ratios = samples.log_ratios()
    scatter = float(np.std(ratios, ddof=1))
    freedom = len(ratios) - 1
    upper_quantile = scipy.stats.chi2.ppf(0.5 + 0.5 * CONFIDENCE, freedom)
    lower_quantile = scipy.stats.chi2.ppf(0.5 - 0.5 * CONFIDENCE, freedom)
    low = scatter * math.sqrt(freedom / upper_quantile)
    high = scatter * math.sqrt(freedom / lower_quantile)
    return scatter, f"[{low:.2g}, {high:.2g}]"


_agreement = partial(Measure, ideal=1.0, resolution=1e-3)
#: The measures of ensembles: functions of `Samples`.
STATISTICS = by_name(
    Measure(
        "ks_distance",
        "Kolmogorov-Smirnov distance",
        "1",
        "max |F_c - F_r| of the distributions of peak |theta|/alpha, the fallen beyond all others,"
        " peaks below 1e-3 alike; the remark gives its p-value.\n\n"
        "Two-sample Kolmogorov-Smirnov test: the probability of such a distance between two"
        " samples of one distribution.",
        _ks_distance,
        resolution=1e-3,
    ),
    Measure(
        "area_metric",
        "area between the distributions",
        "1",
        "Area between the distribution functions of peak |theta|/alpha (ASME V&V 10-2006; Ferson"
        " 2008), the fallen at 1, the balance point.",
        _area,
        resolution=1e-4,
    ),
    _agreement(
        "overturning_accuracy",
        "agreement on overturning",
        "1",
        "Share of scenes in which both fall or both stay; the remark gives its 95 % confidence"
        " interval (Wilson 1927).",
        _accuracy,
    ),
    _agreement(
        "overturning_precision",
        "precision of overturning",
        "1",
        "Share of the scenes in which the candidate falls that the reference falls in too; 1 if it"
        " falls in none.",
        _precision,
    ),
    _agreement(
        "overturning_recall",
        "recall of overturning",
        "1",
        "Share of the scenes in which the reference falls that the candidate falls in too; 1 if it"
        " falls in none.",
        _recall,
    ),
    Measure(
        "peak_bias",
        "bias of peak rotation",
        "1",
        "Mean of ln(c/r) of the peaks where neither falls; the remark gives its 95 % confidence"
        " interval (Student).",
        _peak_bias,
        resolution=1e-4,
    ),
    Measure(
        "peak_scatter",
        "scatter of peak rotation",
        "1",
        "Standard deviation of ln(c/r) of the peaks where neither falls; the remark gives its 95 %"
        " interval (chi-squared).",
        _peak_scatter,
        resolution=1e-4,
    ),
)
