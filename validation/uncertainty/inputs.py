"""u_input: how far a figure may lie from the scene's because the scene itself is not known exactly.

The numbers of a scene that have a spread (`scenes.trust.inputs`) are drawn together, quasi-randomly, and the event-based
model plays every draw. What comes out is the distribution of the peak, of the outcome and of the last slip, bands on the
history, and Sobol indices: which number matters most. ASME V&V 20-2009, section 4, by sampling.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import InputError
from rockcheck.scenes.trust.inputs import UncertainScene
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.discrepancy.statistics import CONFIDENCE

Floats = NDArray[np.float64]
#: Draws unless more are asked for; Sobol's sequence is balanced for powers of two.
SAMPLES = 1024
#: Rows of a band's history at the most: a picture has no more columns.
MOST_ROWS = 2000
#: Shares of the draws between which the bands lie.
BANDS = (0.025, 0.16, 0.5, 0.84, 0.975)
_SEED = 1


class Interval(Stored):
    """A figure's value with its interval of `CONFIDENCE`."""

    name: str
    unit: str
    value: float
    low: float
    high: float

    @property
    def half_width(self) -> float:
        """Distance from the value to the farther end: the figure's u_input."""
        return max(self.high - self.value, self.value - self.low)


class Sensitivity(Stored):
    """Sobol indices of one uncertain number: shares of a figure's variance, by itself and with all others."""

    name: str
    first: float
    total: float


class Inputs(Stored):
    """What the spread of the inputs makes of a scene's figures.

    `figures`: peak rotation (alpha; a block that falls counts as 1, the balance point) and last slip (m; of the blocks that
    stand) at the scene's own numbers, between the 2.5 and 97.5 % quantiles of the draws. `overturns`: the share of the draws
    that fall, with its interval (Wilson 1927). `sensitivities` of the peak, largest total index first; empty where inputs are
    correlated (the indices are for independent ones) or the peak does not vary.
    """

    samples: int
    model: str
    names: tuple[str, ...]
    figures: tuple[Interval, ...]
    overturns: Interval
    sensitivities: tuple[Sensitivity, ...]
    theta_band: float = 0.0
    note: str = ""

    def u_input(self, name: str) -> float | None:
        """Half the 95 % interval of a figure, on its longer side; None for a figure that is not among them.

        Of theta_rms the RMS over time of half the band's width, alpha.
        """
        if name == "theta_rms":
            return self.theta_band
        return next((figure.half_width for figure in self.figures if figure.name == name), None)


@dataclass(frozen=True)
class Propagated:
    """Draws of a scene, played: what they say, and the bands on theta (alpha) at times `t` (s), a row a quantile of `BANDS`."""

    inputs: Inputs
    t: Floats
    bands: Floats
    values: Floats
    peaks: Floats
    fallen: NDArray[np.bool_]


def propagate(
    given: UncertainScene, *, model: EventBasedModel | None = None, samples: int = SAMPLES, seed: int = _SEED, indices: bool = True
) -> Propagated:
    """Play `samples` draws of an uncertain scene with an event-based model (default: the unilateral one).

    Deterministic in `seed`. Raises `InputError` where nothing of the scene is uncertain, or a draw is not a scene.
    """
    from scipy.stats import binomtest, qmc

    from rockcheck.ebm.ensemble import play_ensemble

    if not given.spreads:
        raise InputError("no number of this scene is uncertain: write one as { value = 0.3, sd = 0.03 }")
    model = model or EventBasedModel(pivot="unilateral", tolerance=1e-8)
    count = 1 << max(1, (samples - 1).bit_length())
    values = given.values(qmc.Sobol(len(given.spreads), seed=np.random.default_rng(seed)).random(count))
    played = play_ensemble([given.at(row) for row in values], model, rows=MOST_ROWS)
    own = play_ensemble([given.scene], model)
    capacity, fallen = _capacity(played.peak, played.alpha), played.side != 0
    figures = [_interval("peak_rotation", "alpha", float(_capacity(own.peak, own.alpha)[0]), capacity)]
    if np.any(~fallen):
        figures.append(_interval("last_slip", "m", float(own.last_slip[0]), played.last_slip[~fallen]))
    bands = np.quantile(played.theta / given.scene.block.alpha, BANDS, axis=0)
    share = binomtest(int(np.sum(fallen)), count).proportion_ci(CONFIDENCE, method="wilson")
    note = "" if given.independent else "inputs are correlated: Sobol indices, which are for independent ones, are left out"
    found = Inputs(
        samples=count,
        model=model.name,
        names=given.names,
        figures=tuple(figures),
        overturns=Interval(name="overturns", unit="1", value=float(np.mean(fallen)), low=share.low, high=share.high),
        sensitivities=sensitivities(given, model, seed=seed) if indices and given.independent else (),
        theta_band=float(np.sqrt(np.mean((0.5 * (bands[-1] - bands[0])) ** 2))),
        note=note,
    )
    return Propagated(found, played.t, bands, values, capacity, fallen)


def sensitivities(given: UncertainScene, model: EventBasedModel, *, samples: int = SAMPLES, seed: int = _SEED) -> tuple[Sensitivity, ...]:
    """First and total Sobol indices of the peak rotation (Saltelli et al. 2010, by scipy), largest total first.

    `samples` (a power of two) times the number of inputs and two more runs. Empty where the peak does not vary.
    """
    from scipy.stats import sobol_indices

    from rockcheck.ebm.batch import pack, run_batch

    def peak_and_fall(points: Floats) -> Floats:
        scenes = [given.at(row) for row in points.T]
        found = run_batch(pack(scenes, model), model, until_decided=False)
        return np.array([_capacity(found.peak, np.array([scene.block.alpha for scene in scenes])), found.side != 0], dtype=float)

    laws: list[Any] = [spread.law for spread in given.spreads.values()]
    try:
        found = sobol_indices(func=peak_and_fall, n=samples, dists=laws, rng=np.random.default_rng(seed))
    except TypeError:  # scipy before 1.15 calls it random_state
        found = sobol_indices(func=peak_and_fall, n=samples, dists=laws, random_state=np.random.default_rng(seed))
    first, total = found.first_order[0], found.total_order[0]
    if not np.any(total):
        return ()
    rows = (Sensitivity(name=name, first=float(a), total=float(b)) for name, a, b in zip(given.names, first, total, strict=True))
    return tuple(sorted(rows, key=lambda row: -row.total))


def _capacity(peak: Floats, alpha: Floats) -> Floats:
    """Peak rotation in units of alpha of the drawn blocks, at most 1: what is beyond the balance point says no more."""
    return np.minimum(peak / alpha, 1.0)


def _interval(name: str, unit: str, value: float, draws: Floats) -> Interval:
    low, high = np.quantile(draws, (0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE))
    return Interval(name=name, unit=unit, value=value, low=float(low), high=float(high))
