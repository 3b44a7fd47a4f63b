"""Fragility: the probability that a block overturns, against the intensity of the base motion, with and without its wall."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.spectrum import Floats
from rockcheck.validation.discrepancy.figures import Stored

#: Frequencies of the set of pulses.
PULSES = 50
CONFIDENCE = 0.95
FEWEST = 2


class FragilityCurve(Stored):
    """One curve. A point is intensity, share overturned, lower and upper end of its confidence band, fitted probability.

    The fit is a lognormal curve: `median` is the intensity at which its probability is one half, `dispersion` the standard
    deviation of its logarithm; both None (and the probabilities NaN) where all or none overturn. `motions` are the records or
    pulses, each in both directions; `undecided` runs failed, and count neither as overturned nor as safe: shares, bands and the
    fit are those of the others (NaN at an intensity where all failed).
    """

    label: str
    motions: int
    undecided: int
    median: float | None
    dispersion: float | None
    points: tuple[tuple[float, float, float, float, float], ...]


def curve_of(label: str, overturned: NDArray[np.bool_], failed: NDArray[np.bool_], intensities: Floats) -> FragilityCurve:
    """The curve of one case from its runs (motion, direction, intensity): which overturned, and which failed."""
    motions = len(overturned)
    fallen, decided = (overturned & ~failed).sum(axis=1), (~failed).sum(axis=1)  # (motion, intensity)
    share, low, high = _band(fallen, decided)
    fit = fit_lognormal(intensities, fallen.sum(axis=0), decided.sum(axis=0))
    fitted = lognormal(intensities, *fit) if fit else np.full(len(intensities), np.nan)
    columns = (intensities, share, low, high, fitted)
    points = tuple((float(x), float(y), float(lo), float(hi), float(p)) for x, y, lo, hi, p in zip(*columns, strict=True))
    median, dispersion = fit or (None, None)
    undecided = int(failed.sum())
    return FragilityCurve(label=label, motions=motions, undecided=undecided, median=median, dispersion=dispersion, points=points)


def _band(fallen: NDArray[np.int64], decided: NDArray[np.int64]) -> tuple[Floats, Floats, Floats]:
    """Share that overturns and the ends of its interval at each intensity, from counts of runs (motion, intensity).

    Wilson's interval, which holds near 0 and 1, too, where motions drawn anew all say the same. The directions of a motion
    tell of the same motion, so the number in it is the effective one: share (1 - share) over the variance of the share
    between motions, at least that of the motions and at most that of the runs (Korn and Graubard 1998). NaN where no run
    was decided.
    """
    from scipy.special import ndtri

    runs, motions = decided.sum(axis=0), (decided > 0).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = fallen.sum(axis=0) / runs
        variance = motions / (motions - 1) * ((fallen - share * decided) ** 2).sum(axis=0) / runs**2
        count = np.where(variance > 0.0, np.clip(share * (1.0 - share) / variance, motions, runs), motions)
        z2 = float(ndtri(0.5 + 0.5 * CONFIDENCE)) ** 2 / count
        middle = (share + 0.5 * z2) / (1.0 + z2)
        half = np.sqrt(z2 * share * (1.0 - share) + 0.25 * z2 * z2) / (1.0 + z2)
    return share, middle - half, middle + half


def lognormal(intensities: Floats, median: float, dispersion: float) -> Floats:
    """Probability of overturning Phi(ln(x/median)/dispersion)."""
    from scipy.special import ndtr

    p: Floats = ndtr(np.log(intensities / median) / dispersion)
    return p


def fit_lognormal(intensities: Floats, overturned: NDArray[np.int64], runs: NDArray[np.int64]) -> tuple[float, float] | None:
    """Median and dispersion of the lognormal curve of the greatest likelihood (Baker 2015).

    None where all or none overturn, or where it does not rise with the intensity.

    `overturned` counts the runs, of those that were decided, that overturn the block at each intensity.
    """
    from scipy.optimize import minimize
    from scipy.special import log_ndtr

    if not 0 < overturned.sum() < runs.sum():
        return None
    logarithm = np.log(intensities)
    centre = float(np.mean(logarithm))

    def unlikelihood(line: Floats) -> float:  # convex, as a straight line in ln x; not so in median and dispersion
        linear = line[0] + line[1] * (logarithm - centre)
        return -float(np.sum(overturned * log_ndtr(linear) + (runs - overturned) * log_ndtr(-linear)))

    level, slope = minimize(unlikelihood, [0.0, 1.0], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-9, "maxiter": 2000}).x
    if slope <= 0.0:
        return None
    return float(np.exp(centre - level / slope)), float(1.0 / slope)
