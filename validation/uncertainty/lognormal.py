"""The lognormal curve of the least intensities at which something happens.

In: the least intensity a motion, or how far a motion was scaled in vain. Out: median and
dispersion of the greatest likelihood, with a band. Called by the assessment of a scene.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from rockcheck.scenes import Floats
from rockcheck.validation.discrepancy import ensemble

#: Sets of motions drawn anew for the band.
DRAWS = 400
_SEED = 2
#: Least dispersion that a fit begins with, and below which values are equal but for rounding.
_LEAST_SPREAD, _ROUNDING = 1e-3, 1e-12
#: Most steps of Newton's method.
_STEPS = 100


@dataclass(frozen=True)
class Lognormal:
    """A lognormal curve: at `median` its probability is one half, `dispersion` is that of ln(x).

    `low` and `high` bound the median with `CONFIDENCE`; `draws` are (median, dispersion) of sets of
    motions drawn anew, for the band of the curve.
    """

    median: float
    dispersion: float
    low: float
    high: float
    draws: tuple[tuple[float, float], ...]

    def probability(self, intensity: Floats) -> Floats:
        """The curve."""
        return _curve(intensity, self.median, self.dispersion)

    def band(self, intensity: Floats) -> tuple[Floats, Floats]:
        """The band of `CONFIDENCE` around the curve."""
        curves = [_curve(intensity, median, dispersion) for median, dispersion in self.draws]
        half = 0.5 * ensemble.CONFIDENCE
        low, high = np.quantile(curves, (0.5 - half, 0.5 + half), axis=0)
        return low, high


def _curve(intensity: Floats, median: float, dispersion: float) -> Floats:
    if dispersion == 0.0:
        return np.where(intensity < median, 0.0, 1.0)
    with np.errstate(divide="ignore"):
        return np.asarray(scipy.special.ndtr(np.log(intensity / median) / dispersion))


def fit_least(least: Sequence[float], beyond: Sequence[float]) -> Lognormal | None:
    """The curve of the `least` intensities of motions, and of others that need more than `beyond`.

    None of fewer than two motions with a least intensity.
    """
    if len(least) < 2:
        return None
    known = np.array([*least, *beyond], dtype=float)
    happened = np.arange(len(known)) < len(least)
    rows = np.random.default_rng(_SEED).integers(len(known), size=(DRAWS, len(known)))
    counts = np.array([np.bincount(row, minlength=len(known)) for row in rows])
    counts = counts[counts[:, happened].sum(axis=1) > 1]
    medians, dispersions = _fit(known, happened, np.vstack([np.ones(len(known)), counts]))
    half = 0.5 * ensemble.CONFIDENCE
    low, high = np.quantile(medians[1:], (0.5 - half, 0.5 + half)).tolist()
    draws = tuple(zip(medians[1:].tolist(), dispersions[1:].tolist(), strict=True))
    return Lognormal(float(medians[0]), float(dispersions[0]), low, high, draws)


def _fit(
    known: Floats, happened: NDArray[np.bool_], counts: NDArray[np.float64]
) -> tuple[Floats, Floats]:
    """Medians and dispersions of the greatest likelihood, of each set of motions at once.

    `counts` (sets x motions) says how often a set holds a motion. A set whose motions do not
    differ has no dispersion.
    """
    logarithms = np.log(known)
    seen, censored = counts * happened, counts * ~happened
    number = seen.sum(axis=1)
    mean = seen @ logarithms / number
    distances = logarithms - mean[:, None]
    spread = np.sqrt((seen * distances**2).sum(axis=1) / number)
    differs = (spread > _ROUNDING) | (censored * (distances > _ROUNDING)).any(axis=1)
    spread[~differs] = 0.0
    to_solve = np.flatnonzero(differs & censored.any(axis=1))
    if to_solve.size:
        mean[to_solve], spread[to_solve] = _most_likely(
            logarithms, seen[to_solve], censored[to_solve], mean[to_solve], spread[to_solve]
        )
    return np.exp(mean), spread


def _most_likely(
    logarithms: Floats, seen: Floats, censored: Floats, mean: Floats, spread: Floats
) -> tuple[Floats, Floats]:
    """Mean and deviation of the logarithms where some motions are `censored`, a pair a set.

    In 1/deviation and mean/deviation the likelihood has a single maximum (Olsen 1978, Econometrica
    46), which Newton's method finds in some eight steps, of all sets together. A minimiser of a
    library, one set after the other, takes 300 times as long.
    """
    number = seen.sum(axis=1)
    inverse = 1.0 / np.maximum(spread, _LEAST_SPREAD)
    offset = mean * inverse
    for _ in range(_STEPS):
        z = inverse[:, None] * logarithms - offset[:, None]
        hazard = np.exp(-0.5 * z**2 - 0.5 * math.log(2.0 * math.pi) - scipy.special.log_ndtr(-z))
        pull = seen * z + censored * hazard
        curvature = seen + censored * hazard * (hazard - z)
        slope = number / inverse - pull @ logarithms
        slope_offset = pull.sum(axis=1)
        aa = number / inverse**2 + curvature @ logarithms**2
        ab = curvature @ logarithms
        bb = curvature.sum(axis=1)
        determinant = aa * bb - ab**2
        step = (bb * slope + ab * slope_offset) / determinant
        step_offset = (ab * slope + aa * slope_offset) / determinant
        # Shortened where 1/deviation would change by more than half.
        share = 1.0 / np.maximum(1.0, 2.0 * np.abs(step) / inverse)
        inverse = inverse + share * step
        offset = offset + share * step_offset
        if np.all(np.abs(step) <= 1e-12 * inverse):
            break
    return offset / inverse, 1.0 / inverse
