"""Fragility: the share of motions in which something happens, over their intensity.

In: whether it happened in each run. Out: shares with their intervals, and the lognormal curve of
the greatest likelihood. The study of populations calls it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # it loads its parts as they are used
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Floats, Scene
from rockcheck.validation.uncertainty.input_spread import ends_of
from rockcheck.validation.uncertainty.proportions import exact_interval

#: Median and dispersion where no lognormal curve fits.
NO_FIT = math.nan, math.nan


def play(scenes: Sequence[Scene], model: EventBasedModel) -> tuple[float, ...]:
    """The peak rotation of each scene, alpha, played until it is certain, whatever its duration.

    Infinite of a block that overturned, NaN where the run failed, also once more at a hundredth of
    the tolerance. Raises `InputError` where the model cannot play one of them.
    """
    from rockcheck.ebm.batch import pack, run_decided

    found = run_decided(pack(scenes, model), model, jobs=1)
    rotations = found.runs["peak"] / np.array([scene.block.alpha for scene in scenes])
    return tuple(np.where(found.failed, np.nan, np.where(found.side, np.inf, rotations)).tolist())


@dataclass(frozen=True)
class Curve:
    """One curve. A point is intensity, share, lower and upper end of its band, fitted probability.

    The fit is a lognormal curve: at the intensity `median`, known to lie between `low` and `high`,
    its probability is one half; `dispersion` is the standard deviation of its logarithm. They are
    NaN, and so are the probabilities, where nothing fits. `motions` were each played in both
    directions; `undecided` runs failed: shares, bands and the fit are those of the others (NaN at
    an intensity where all failed).
    """

    label: str
    motions: int
    undecided: int
    median: float
    dispersion: float
    low: float
    high: float
    points: Sequence[Sequence[float]]


def curve_of(
    label: str,
    hit: NDArray[np.bool_],
    failed: NDArray[np.bool_],
    intensities: Floats,
    draws: int = 0,
) -> Curve:
    """The curve of runs (motion, direction, intensity): in which it happened, which failed.

    With `draws` of the motions the fitted median has an interval, `NO_FIT` if under 90 % of the
    draws fit.
    """
    hits, decided = (hit & ~failed).sum(axis=1), (~failed).sum(axis=1)  # (motion, intensity)
    median, dispersion = fit_lognormal(intensities, hits.sum(axis=0), decided.sum(axis=0))
    fitted = probabilities(intensities, median, dispersion)
    points = np.column_stack([intensities, *share_of(hits, decided), fitted]).tolist()
    sets = np.random.default_rng(2).integers(len(hits), size=(draws, len(hits)))
    medians = [
        fit_lognormal(intensities, hits[rows].sum(axis=0), decided[rows].sum(axis=0))[0]
        for rows in sets
    ]
    known = [one for one in medians if not math.isnan(one)]
    low, high = ends_of(known).tolist() if known and len(known) >= 0.9 * draws else NO_FIT
    return Curve(label, len(hit), int(failed.sum()), median, dispersion, low, high, points)


def probabilities(intensities: Floats, median: float, dispersion: float) -> Floats:
    """The lognormal curve at some intensities: of a dispersion of 0 a step, one half at its median.

    NaN where nothing fits.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        fitted = scipy.special.ndtr(np.log(intensities / median) / dispersion)
    return np.where(intensities == median, 0.5, fitted)


def share_of(hits: NDArray[np.int64], decided: NDArray[np.int64]) -> tuple[Floats, Floats, Floats]:
    """Share and the ends of its `CONFIDENCE` interval at each intensity.

    The counts of runs are (motion, intensity). The runs in the two directions of a motion are not
    independent, so the interval is the exact one of the motions (see `proportions`). NaN where no
    run was decided.
    """
    runs, motions = decided.sum(axis=0), (decided > 0).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = hits.sum(axis=0) / runs
    low, high = exact_interval(share, motions)
    unknown = runs == 0
    return share, np.where(unknown, np.nan, low), np.where(unknown, np.nan, high)


def fit_lognormal(
    intensities: Floats, hits: NDArray[np.int64], runs: NDArray[np.int64]
) -> tuple[float, float]:
    """Median and dispersion of the lognormal curve of the greatest likelihood (Baker 2015).

    `hits` counts the decided runs (`runs`) in which the event happened at each intensity. `NO_FIT`
    where that is all or none of them, or where the curve does not rise with the intensity. Where
    all happen above and none below a level, any median between is as likely and a dispersion of 0
    the likeliest: the middle one, in ln x, is taken. Where some happen at one intensity alone, the
    likelihood has no maximum: it rises towards a step there. That step is taken where it has none
    below it and all above it, else there is no fit.
    """
    if not 0 < hits.sum() < runs.sum():
        return NO_FIT
    least, most = intensities[hits > 0].min(), intensities[hits < runs].max()
    if most < least:
        return math.sqrt(least * most), 0.0
    if most == least:
        played = intensities[runs > 0]
        is_between = played.min() < least < played.max()
        return (float(least), 0.0) if is_between else NO_FIT
    logarithm = np.log(intensities)
    centre = float(np.mean(logarithm))

    def unlikelihood(line: Floats) -> float:
        # convex, as a straight line in ln x; not so in median and dispersion
        linear = line[0] + line[1] * (logarithm - centre)
        likelihood = hits * scipy.special.log_ndtr(linear) + (runs - hits) * scipy.special.log_ndtr(
            -linear
        )
        return -float(np.sum(likelihood))

    # as wide as high: in the usual one, a sliver, the search may stand still
    simplex = [[0.0, 1.0], [1.0, 1.0], [0.0, 2.0]]
    level, slope = scipy.optimize.minimize(
        unlikelihood,
        simplex[0],
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "xatol": 1e-9, "fatol": 1e-9, "maxiter": 2000},
    ).x
    # below is the search's rounding, of shares that are all the same
    return (float(np.exp(centre - level / slope)), float(1.0 / slope)) if slope > 1e-3 else NO_FIT
