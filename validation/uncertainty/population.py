"""Populations: scenes that one model plays, the outcome of each run, and their statistics.

Scenes are drawn or listed. Shares have an interval, and over the intensity of the base motion a
lognormal curve. The numbers of a scene that have a spread (`scenes.files`) are drawn together,
quasi-randomly. They give u_input, how far a figure may lie from the scene's because the scene
itself is not known exactly (ASME V&V 20-2009, section 4, by sampling), and Sobol indices: which
number matters most.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy  # it loads its parts as they are used
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Floats, InputError, Scene, files, kinematics
from rockcheck.validation.discrepancy import ensemble
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.uncertainty.proportions import exact_interval

if TYPE_CHECKING:
    from rockcheck.ebm.batch import Outcomes

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
    with np.errstate(divide="ignore"):  # of a dispersion of 0 it is a step
        fitted = scipy.special.ndtr(np.log(intensities / median) / dispersion)
    points = np.column_stack([intensities, *share_of(hits, decided), fitted]).tolist()
    sets = np.random.default_rng(2).integers(len(hits), size=(draws, len(hits)))
    medians = [
        fit_lognormal(intensities, hits[rows].sum(axis=0), decided[rows].sum(axis=0))[0]
        for rows in sets
    ]
    known = [one for one in medians if not math.isnan(one)]
    low, high = _ends(known).tolist() if known and len(known) >= 0.9 * draws else NO_FIT
    return Curve(label, len(hit), int(failed.sum()), median, dispersion, low, high, points)


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
    the likeliest: the middle one, in ln x, is taken.
    """
    if not 0 < hits.sum() < runs.sum():
        return NO_FIT
    least, most = intensities[hits > 0].min(), intensities[hits < runs].max()
    if most < least:
        return math.sqrt(least * most), 0.0
    logarithm = np.log(intensities)
    centre = float(np.mean(logarithm))

    def unlikelihood(line: Floats) -> float:
        # convex, as a straight line in ln x; not so in median and dispersion
        linear = line[0] + line[1] * (logarithm - centre)
        likelihood = hits * scipy.special.log_ndtr(linear) + (runs - hits) * scipy.special.log_ndtr(
            -linear
        )
        return -float(np.sum(likelihood))

    level, slope = scipy.optimize.minimize(
        unlikelihood,
        [0.0, 1.0],
        method="Nelder-Mead",
        options={
            # as wide as high: in the usual one, a sliver, the search may stand still
            "initial_simplex": [[0.0, 1.0], [1.0, 1.0], [0.0, 2.0]],
            "xatol": 1e-9,
            "fatol": 1e-9,
            "maxiter": 2000,
        },
    ).x
    # below is the search's rounding, of shares that are all the same
    return (float(np.exp(centre - level / slope)), float(1.0 / slope)) if slope > 1e-3 else NO_FIT


#: Default number of draws; Sobol's sequence is balanced for powers of two.
SAMPLES = 1024
#: Times at which draws are compared, at the most.
MOST_ROWS = 2000
_SEED = 1


class Interval(Stored):
    """A figure's value with its interval of `CONFIDENCE`."""

    name: str
    unit: str
    value: float
    low: float
    high: float


class Sensitivity(Stored):
    """Sobol indices of one uncertain number.

    Shares of a figure's variance: `first` by the number alone, `total` with all others.
    """

    name: str
    first: float
    total: float


class Inputs(Stored):
    """A scene's figures with their intervals from the spread of its inputs.

    `figures`: peak rotation (alpha; a block that falls counts as 1, the balance point) and last
    slip (m; of the blocks that stand, if the scene's own does) at the scene's own numbers, between
    the 2.5 and 97.5 % quantiles of the draws. `overturns`: the share of the draws that fall, with
    its interval (Wilson 1927). `sensitivities` of the peak, largest total index first; empty where
    inputs are correlated (the indices are for independent ones) or the peak does not vary.
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
        """Distance from a figure to the farther end of its interval; None for an unknown figure.

        Of theta_rms the RMS over time of half the band's width, alpha.
        """
        farther = {f.name: max(f.high - f.value, f.value - f.low) for f in self.figures}
        return (farther | {"theta_rms": self.theta_band}).get(name)


def propagate(
    given: files.UncertainScene,
    *,
    model: EventBasedModel | None = None,
    samples: int = SAMPLES,
    seed: int = _SEED,
    indices: bool = True,
) -> Inputs:
    """Play draws of an uncertain scene with an event-based model (default: the unilateral one).

    `samples` is rounded up to a power of two. Deterministic in `seed`. Raises `InputError` where
    nothing of the scene is uncertain, or a draw is not a scene.
    """
    from rockcheck.ebm import natural

    if not given.spreads:
        raise InputError(
            "no number of this scene is uncertain: write one as { value = 0.3, sd = 0.03 }"
        )
    model = model or EventBasedModel(pivot="unilateral", tolerance=1e-8)
    count = 1 << max(1, (samples - 1).bit_length())
    values = given.values(
        scipy.stats.qmc.Sobol(len(given.spreads), seed=np.random.default_rng(seed)).random(count)
    )
    step = max(given.scene.output_step, given.scene.duration / MOST_ROWS)
    given = replace(given, scene=given.scene.replace(output_step=step))
    # The scene itself, and its draws.
    scenes = [given.scene, *map(given.at, values)]
    found, peaks = _played(scenes, model, rows=len(given.scene.output_times))
    ended = np.arange(found.out.shape[1]) >= found.runs["rows"][:, None]
    theta = np.where(ended, found.runs["motion"]["theta"][:, None], found.out)[1:]
    low, high = _ends(theta / given.scene.block.alpha)
    slips = np.array(
        [
            kinematics.slip(scene.block, x, tilt)
            for scene, end in zip(scenes, found.runs["motion"].tolist(), strict=True)
            for x, _, tilt, *_ in natural.to_si(scene, np.array([end]))
        ]
    )
    stands, fallen = found.side == 0, found.side[1:] != 0
    share = scipy.stats.binomtest(int(np.sum(fallen)), count).proportion_ci(
        ensemble.CONFIDENCE, method="wilson"
    )
    return Inputs(
        samples=count,
        model=model.name,
        names=given.names,
        figures=(
            _interval("peak_rotation", "alpha", peaks),
            *(
                [_interval("last_slip", "m", slips[stands])]
                if stands[0] and not fallen.all()
                else ()
            ),
        ),
        overturns=Interval(
            name="overturns",
            unit="1",
            value=float(np.mean(fallen)),
            low=share.low,
            high=share.high,
        ),
        sensitivities=sensitivities(given, model, seed=seed)
        if indices and given.independent
        else (),
        theta_band=float(np.sqrt(np.mean((0.5 * (high - low)) ** 2))),
        note=""
        if given.independent
        else "inputs are correlated: Sobol indices, which are for independent ones, are left out",
    )


def _played(
    scenes: Sequence[Scene], model: EventBasedModel, rows: int = 0
) -> "tuple[Outcomes, Floats]":
    """What a model makes of scenes, with rows of theta; and their peaks, in alpha, at most 1."""
    from rockcheck.ebm.batch import pack, run_batch

    found = run_batch(pack(scenes, model), model, until_decided=False, rows=rows, columns=2)
    alphas = np.array([scene.block.alpha for scene in scenes])
    return found, np.minimum(found.runs["peak"] / alphas, 1.0)


def sensitivities(
    given: files.UncertainScene,
    model: EventBasedModel,
    *,
    samples: int = SAMPLES,
    seed: int = _SEED,
) -> tuple[Sensitivity, ...]:
    """First and total Sobol indices of the peak rotation, largest total first.

    By scipy, after Saltelli et al. (2010). The number of runs is `samples` (a power of two) times
    the number of inputs plus two. Empty where the peak does not vary.
    """

    def peak_and_fall(points: Floats) -> Floats:
        found, peaks = _played([given.at(row) for row in points.T], model)
        return np.array([peaks, found.side != 0], dtype=float)

    laws: list[Any] = [spread.law for spread in given.spreads.values()]
    found = scipy.stats.sobol_indices(
        func=peak_and_fall, n=samples, dists=laws, rng=np.random.default_rng(seed)
    )
    # of one input scipy gives numbers in place of rows
    first, total = (np.reshape(some, (2, -1))[0] for some in (found.first_order, found.total_order))
    if not np.any(total):
        return ()
    return tuple(
        Sensitivity(name=name, first=float(a), total=float(b))
        for name, a, b in sorted(
            zip(given.names, first, total, strict=True), key=lambda row: -row[2]
        )
    )


def _ends(values: Floats | list[float]) -> Floats:
    """The ends of the interval of `CONFIDENCE` of values, which may be rows."""
    half = 0.5 * ensemble.CONFIDENCE
    return np.quantile(values, (0.5 - half, 0.5 + half), axis=0)


def _interval(name: str, unit: str, values: Floats) -> Interval:
    """The scene's own value, the first one, with the interval of its draws'."""
    low, high = _ends(values[1:]).tolist()
    return Interval(name=name, unit=unit, value=float(values[0]), low=low, high=high)
