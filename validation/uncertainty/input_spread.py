"""What the spread of a scene's numbers does to its figures: u_input and Sobol indices.

In: a scene with uncertain numbers (`scenes.files`). Out: its figures with intervals, and which
number matters most. Suites and the study of populations call it. The numbers are drawn together,
quasi-randomly. They give u_input, how far a figure may lie from the scene's because the scene
itself is not known exactly (ASME V&V 20-2009, section 4, by sampling).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy  # it loads its parts as they are used

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Floats, InputError, Scene, files, kinematics
from rockcheck.validation.discrepancy import ensemble
from rockcheck.validation.discrepancy.figures import Stored

if TYPE_CHECKING:
    from rockcheck.ebm.batch import Outcomes


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
    low, high = ends_of(theta / given.scene.block.alpha)
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


def ends_of(values: Floats | list[float]) -> Floats:
    """The ends of the interval of `CONFIDENCE` of values, which may be rows."""
    half = 0.5 * ensemble.CONFIDENCE
    return np.quantile(values, (0.5 - half, 0.5 + half), axis=0)


def _interval(name: str, unit: str, values: Floats) -> Interval:
    """The scene's own value, the first one, with the interval of its draws'."""
    low, high = ends_of(values[1:]).tolist()
    return Interval(name=name, unit=unit, value=float(values[0]), low=low, high=high)
