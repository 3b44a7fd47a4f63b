"""The lognormal curve of the least intensities at which something happens.

In: the least intensity a motion, or how far a motion was scaled in vain. Out: median and
dispersion of the greatest likelihood, with a band. Called by the assessment of a scene.
"""

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
    with np.errstate(divide="ignore", invalid="ignore"):  # of a dispersion of 0 it is a step
        return np.asarray(scipy.special.ndtr(np.log(intensity / median) / dispersion))


def fit_least(least: Sequence[float], beyond: Sequence[float]) -> Lognormal | None:
    """The curve of the `least` intensities of motions, and of others that need more than `beyond`.

    None of fewer than two motions with a least intensity.
    """
    if len(least) < 2:
        return None
    known = np.array([*least, *beyond], dtype=float)
    happened = np.arange(len(known)) < len(least)
    median, dispersion = _fit(known, happened)
    sets = np.random.default_rng(_SEED).integers(len(known), size=(DRAWS, len(known)))
    draws = tuple(_fit(known[rows], happened[rows]) for rows in sets if happened[rows].sum() > 1)
    half = 0.5 * ensemble.CONFIDENCE
    low, high = np.quantile([one for one, _ in draws], (0.5 - half, 0.5 + half)).tolist()
    return Lognormal(median, dispersion, low, high, draws)


def _fit(known: Floats, happened: NDArray[np.bool_]) -> tuple[float, float]:
    """Median and dispersion of the greatest likelihood."""
    logarithms = np.log(known)
    if happened.all():
        return float(np.exp(np.mean(logarithms))), float(np.std(logarithms))
    seen, censored = logarithms[happened], logarithms[~happened]
    spread = max(float(np.std(seen)), 1e-3)

    def unlikelihood(at: Floats) -> float:
        mean, sigma = at[0], np.exp(at[1])
        density = -0.5 * ((seen - mean) / sigma) ** 2 - np.log(sigma)
        survival = scipy.special.log_ndtr((mean - censored) / sigma)
        return -float(density.sum() + survival.sum())

    start = [float(np.mean(logarithms)), float(np.log(spread))]
    mean, log_sigma = scipy.optimize.minimize(
        unlikelihood, start, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-9}
    ).x
    return float(np.exp(mean)), float(np.exp(log_sigma))
