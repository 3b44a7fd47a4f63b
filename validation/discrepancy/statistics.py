"""Differences between two samples of an ensemble.

Distributions of the peaks, agreement on overturning, bias and scatter.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rockcheck.validation.discrepancy.figures import Array, Measure, Unavailable, Undefined, by_name

#: Peaks below this (alpha) have no ratio worth a logarithm.
SMALLEST_PEAK = 1e-3
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Sample:
    """One model's results for an ensemble: peak rotation (alpha) and outcome of each scene.

    NaN and "" where it failed.
    """

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
        """ln(c/r) of the peaks where neither falls and both rock; at least two."""
        r, c = self.reference, self.candidate
        rocks, too = (~sample.fallen & (sample.peaks > SMALLEST_PEAK) for sample in (r, c))
        if np.sum(rocks) < 2:
            raise Undefined("fewer than two scenes in which the reference rocks and does not fall")
        usable = rocks & too
        if np.sum(usable) < 2:
            raise Unavailable("fewer than two scenes in which both rock and neither falls")
        return np.log(c.peaks[usable] / r.peaks[usable])


def _distributions(samples: Samples, fallen: float) -> tuple[Array, Array]:
    """The peaks of both (alpha), limited to `fallen`, which is also the value of fallen blocks."""
    both = samples.reference, samples.candidate
    r, c = (np.where(one.fallen, fallen, np.minimum(one.peaks, fallen)) for one in both)
    if np.any(np.isnan(r)) or np.any(np.isnan(c)):
        raise Unavailable("a model failed in some of the scenes")
    return r, c


def _ks_distance(samples: Samples) -> tuple[float, str]:
    from scipy.stats import ks_2samp

    r, c = _distributions(samples, math.inf)
    # The test takes no infinities, but only order counts.
    ranks = np.unique(np.concatenate([r, c]), return_inverse=True)[1]
    found = ks_2samp(ranks[: len(r)], ranks[len(r) :])
    return float(found.statistic), f"p = {found.pvalue:.2g}"


def _area_metric(samples: Samples) -> tuple[float, str]:
    from scipy.stats import wasserstein_distance

    return float(wasserstein_distance(*_distributions(samples, 1.0))), ""


def _share(hits: NDArray[np.bool_], of: int) -> tuple[float, str]:
    from scipy.stats import binomtest

    if of == 0:
        return 1.0, "none fall"
    count = int(np.sum(hits))
    interval = binomtest(count, of).proportion_ci(CONFIDENCE, method="wilson")
    return count / of, f"[{interval.low:.3f}, {interval.high:.3f}], {count} of {of}"


def _peak_bias(samples: Samples) -> tuple[float, str]:
    from scipy.stats import t

    ratios = samples.log_ratios()
    most = t.ppf(0.5 + 0.5 * CONFIDENCE, len(ratios) - 1)
    half = float(most * np.std(ratios, ddof=1) / math.sqrt(len(ratios)))
    mean = float(np.mean(ratios))
    return mean, f"[{mean - half:.2g}, {mean + half:.2g}], {len(ratios)} scenes"


def _peak_scatter(samples: Samples) -> tuple[float, str]:
    from scipy.stats import chi2

    ratios = samples.log_ratios()
    scatter, free = float(np.std(ratios, ddof=1)), len(ratios) - 1
    low, high = (
        scatter * math.sqrt(free / chi2.ppf(0.5 + sign * 0.5 * CONFIDENCE, free))
        for sign in (1.0, -1.0)
    )
    return scatter, f"[{low:.2g}, {high:.2g}]"


_agreement = partial(Measure, ideal=1.0, resolution=1e-3)
#: The measures of ensembles: functions of `Samples`.
STATISTICS = by_name(
    Measure(
        "ks_distance",
        "Kolmogorov-Smirnov distance",
        "1",
        "max |F_c - F_r| of the distributions of peak |theta|/alpha, the fallen beyond all others;"
        " the remark gives its p-value.\n\nTwo-sample Kolmogorov-Smirnov test: the probability of"
        " such a distance between two samples of one distribution.",
        _ks_distance,
        resolution=1e-3,
    ),
    Measure(
        "area_metric",
        "area between the distributions",
        "1",
        "Area between the distribution functions of peak |theta|/alpha (ASME V&V 10-2006; Ferson"
        " 2008), the fallen at 1, the balance point.",
        _area_metric,
        resolution=1e-4,
    ),
    _agreement(
        "overturning_accuracy",
        "agreement on overturning",
        "1",
        "Share of scenes in which both fall or both stay; the remark gives its 95 % confidence"
        " interval (Wilson 1927).",
        lambda two: _share(two.reference.fallen == two.candidate.fallen, len(two.reference.fallen)),
    ),
    _agreement(
        "overturning_precision",
        "precision of overturning",
        "1",
        "Share of the scenes in which the candidate falls that the reference falls in too; 1 if it"
        " falls in none.",
        lambda two: _share(
            two.reference.fallen & two.candidate.fallen, int(np.sum(two.candidate.fallen))
        ),
    ),
    _agreement(
        "overturning_recall",
        "recall of overturning",
        "1",
        "Share of the scenes in which the reference falls that the candidate falls in too; 1 if it"
        " falls in none.",
        lambda two: _share(
            two.reference.fallen & two.candidate.fallen, int(np.sum(two.reference.fallen))
        ),
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
