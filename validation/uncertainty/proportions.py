"""How often something happens, with an interval that holds its confidence.

In: counts of runs by record. Out: a share with its interval. Called by the assessment of a scene
and by curves of fragility.

Runs under one record are alike: draws of a block's friction do not make a second earthquake. A
design effect estimated from the scatter between a few records holds 70 to 95 % of the time in
place of 95 (simulated: a binomial share that differs between records). So runs under several
records count as no more than the records. Then the exact interval (Clopper and Pearson 1934) never
holds less often than it says, however alike the runs under a record are.
"""

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
import scipy
from numpy.typing import NDArray

from rockcheck.scenes import Floats
from rockcheck.validation.discrepancy import ensemble

#: Fewer records than this are called few: with six an interval of 95 % is half of the axis long.
FEW_RECORDS = 7


@dataclass(frozen=True)
class Share:
    """How many of the runs it happened in; the interval is of `CONFIDENCE`; NaN without runs.

    `method` names the interval.
    """

    count: int
    of: int
    probability: float
    low: float
    high: float
    method: str


def share_of_runs(hits: NDArray[np.int64], runs: NDArray[np.int64]) -> Share:
    """The share of runs in which it happened, from counts by record (1-D, of one length).

    A single record, as a scene under its own motion, leaves the draws: they are independent. So are
    records with a run each. Wilson's interval (1927) holds for many of these; the exact one is for
    few, and for several runs under each of several records.
    """
    has_runs = runs > 0
    records, total, count = int(has_runs.sum()), int(runs.sum()), int(hits.sum())
    if total == 0:
        return Share(0, 0, np.nan, np.nan, np.nan, "none")
    if records == 1:
        low, high = wilson_interval(count / total, total)
        return Share(count, total, count / total, float(low), float(high), "Wilson")
    share = float(np.mean(hits[has_runs] / runs[has_runs]))
    if total > records or records < FEW_RECORDS:
        low, high = exact_interval(share, records)
        return Share(count, total, share, float(low), float(high), "Clopper-Pearson")
    low, high = wilson_interval(share, records)
    return Share(count, total, share, float(low), float(high), "Wilson")


def wilson_interval(
    share: float | Floats, count: float | NDArray[np.int64]
) -> tuple[Floats, Floats]:
    """The ends of Wilson's interval (1927) of a share of `count` independent runs."""
    z = NormalDist().inv_cdf(0.5 + 0.5 * ensemble.CONFIDENCE)
    z2 = z * z / count
    middle = (share + 0.5 * z2) / (1.0 + z2)
    half = np.sqrt(z2 * share * (1.0 - share) + 0.25 * z2 * z2) / (1.0 + z2)
    return np.maximum(middle - half, 0.0), np.minimum(middle + half, 1.0)


def exact_interval(
    share: float | Floats, count: float | NDArray[np.int64]
) -> tuple[Floats, Floats]:
    """The ends of the interval of Clopper and Pearson (1934), also for parts of a run."""
    tail = 0.5 - 0.5 * ensemble.CONFIDENCE
    hits, misses = np.multiply(share, count), np.multiply(1.0 - np.asarray(share), count)
    with np.errstate(invalid="ignore"):
        low = scipy.special.betaincinv(hits, misses + 1.0, tail)
        high = scipy.special.betaincinv(hits + 1.0, misses, 1.0 - tail)
    return np.where(hits > 0.0, low, 0.0), np.where(misses > 0.0, high, 1.0)
