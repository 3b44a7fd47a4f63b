"""Ensembles: rocking is chaotic, so single histories are not predictable, but distributions are (Bachmann et al. 2018).

An ensemble is one table of a suite, drawn the same for every model:

    [[ensemble]]
    name = "pulses"
    count = 500
    seed = 1
    scene = { duration = 10.0, block = { ... }, floor = { friction = 0.5 } }
    friction = { uniform = [0.2, 0.8] }                # each optional: uniform, lognormal (median, sigma of the logarithm)
    gap = { uniform = [0.01, 0.1] }                    # of every wall of the scene, m
    pulse = { period = {...}, amplitude = {...} }      # a Ricker pulse of random phase, m/s^2 and s
    noise = { amplitude = {...}, frequency = 2.5, damping = 0.6, strong = 8.0 }

A pulse of phase phi is cos(phi) times the symmetric Ricker pulse plus sin(phi) times the antisymmetric one. Noise is white
noise through the Kanai-Tajimi filter, of power spectrum (1 + 4 z^2 r^2)/((1 - r^2)^2 + 4 z^2 r^2), r = f/`frequency`, z =
`damping`, times a half-sine envelope of `strong` seconds; `amplitude` is its peak acceleration, m/s^2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from scenes import InputError, Record, Ricker, Scene, Wall
from scenes.base import Finite, Frozen, NonNegative, Positive
from validation.measures import Measure, register

Array = NDArray[np.float64]
#: Of the generated records, s.
RECORD_STEP = 0.002
#: Peaks below this (alpha) have no ratio worth a logarithm.
SMALLEST_PEAK = 1e-3
CONFIDENCE = 0.95


class Distribution(Frozen):
    """`uniform` between two values, or `lognormal` with a median and the standard deviation of the logarithm."""

    uniform: tuple[Finite, Finite] | None = None
    lognormal: tuple[Positive, NonNegative] | None = None

    @model_validator(mode="after")
    def _one(self) -> Distribution:
        if (self.uniform is None) == (self.lognormal is None):
            raise InputError("exactly one of uniform, lognormal is asked for")
        return self

    def draw(self, chance: np.random.Generator) -> float:
        """One value."""
        if self.uniform is not None:
            return float(chance.uniform(*self.uniform))
        assert self.lognormal is not None
        return float(self.lognormal[0] * np.exp(self.lognormal[1] * chance.standard_normal()))


class Pulse(Frozen):
    """A Ricker pulse of random phase: `period` (s) and `amplitude` (m/s^2)."""

    period: Distribution
    amplitude: Distribution

    def draw(self, chance: np.random.Generator) -> Record:
        """One pulse, sampled."""
        phase, period, amplitude = chance.uniform(0.0, 2.0 * math.pi), self.period.draw(chance), self.amplitude.draw(chance)
        t = np.arange(0.0, 4.0 * period, RECORD_STEP)
        parts = (Ricker(amplitude=1.0, period=period, symmetric=symmetric).acceleration(t) for symmetric in (True, False))
        even, odd = parts
        return Record.from_samples(amplitude * (math.cos(phase) * even + math.sin(phase) * odd), RECORD_STEP)


class Noise(Frozen):
    """Filtered noise; see the module."""

    amplitude: Distribution
    frequency: Positive
    damping: Positive
    strong: Positive

    def draw(self, chance: np.random.Generator) -> Record:
        """One ground motion, sampled."""
        amplitude = self.amplitude.draw(chance)
        count = math.ceil(self.strong / RECORD_STEP)
        ratio = np.fft.rfftfreq(count, RECORD_STEP) / self.frequency
        power = (1.0 + 4.0 * self.damping**2 * ratio**2) / ((1.0 - ratio**2) ** 2 + 4.0 * self.damping**2 * ratio**2)
        shaped = np.fft.irfft(np.fft.rfft(chance.standard_normal(count)) * np.sqrt(power), count)
        shaped *= np.sin(np.pi * np.arange(count) / count)
        return Record.from_samples(amplitude * shaped / np.max(np.abs(shaped)), RECORD_STEP)


class Ensemble(Frozen):
    """One `[[ensemble]]` table of a suite; see the module."""

    name: str
    description: str = ""
    count: Annotated[int, Field(ge=2, le=100_000)] = 500
    seed: Annotated[int, Field(ge=0)] = 0
    #: Scenes that one worker plays in one go.
    batch: Annotated[int, Field(ge=1)] = 25
    scene: dict[str, Any]
    friction: Distribution | None = None
    gap: Distribution | None = None
    pulse: Pulse | None = None
    noise: Noise | None = None

    @model_validator(mode="after")
    def _one_motion(self) -> Ensemble:
        if self.pulse is not None and self.noise is not None:
            raise InputError("cannot be given together with pulse", "noise")
        return self

    def drawn(self, base: Scene, number: int) -> Scene:
        """Scene number 0, 1, ... of the ensemble, the same whatever `count` is and whoever asks."""
        chance = np.random.default_rng([self.seed, number])
        change: dict[str, Any] = {"name": f"{self.name} {number + 1}"}
        motion = self.pulse or self.noise
        if motion is not None:
            change["excitation"] = motion.draw(chance)
        if self.friction is not None:
            change["floor"] = base.floor.model_copy(update={"friction": self.friction.draw(chance), "static_friction": None})
        if self.gap is not None:
            change["walls"] = tuple(Wall(side=w.side, gap=self.gap.draw(chance), restitution=w.restitution) for w in base.walls)
        return base.replace(**change)


@dataclass(frozen=True)
class Sample:
    """What one model made of an ensemble: peak rotation (alpha) and outcome of each scene; NaN and "" where it failed."""

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
        """ln(c/r) of the peaks where neither falls and both rock."""
        r, c = self.reference, self.candidate
        usable = ~r.fallen & ~c.fallen & (r.peaks > SMALLEST_PEAK) & (c.peaks > SMALLEST_PEAK)
        return np.log(c.peaks[usable] / r.peaks[usable])


STATISTICS: dict[str, Measure] = {}


def statistic(label: str, unit: str, **settings: Any) -> Callable[..., Any]:
    """Register a function of `Samples` as a measure of ensembles."""
    return register(STATISTICS, label, unit, **settings)


@statistic("Kolmogorov-Smirnov distance", "1", resolution=1e-3)
def ks_distance(samples: Samples) -> tuple[float, str]:
    """max |F_c - F_r| of the distributions of peak |theta|/alpha, the fallen beyond all others; the remark gives its p-value.

    Two-sample Kolmogorov-Smirnov test: the probability of such a distance between two samples of one distribution.
    """
    from scipy.stats import ks_2samp

    r, c = (np.where(sample.fallen, np.inf, sample.peaks) for sample in (samples.reference, samples.candidate))
    if np.any(np.isnan(r)) or np.any(np.isnan(c)):
        return math.nan, "a model failed in some of the scenes"
    ranks = np.unique(np.concatenate([r, c]), return_inverse=True)[1]  # the test takes no infinities, but only order counts
    found = ks_2samp(ranks[: len(r)], ranks[len(r) :])
    return float(found.statistic), f"p = {found.pvalue:.2g}"


@statistic("agreement on overturning", "1", ideal=1.0, resolution=1e-3)
def overturning_accuracy(samples: Samples) -> tuple[float, str]:
    """Share of scenes in which both fall or both stay; the remark gives its 95 % confidence interval (Wilson 1927)."""
    agree = samples.reference.fallen == samples.candidate.fallen
    return _share(int(np.sum(agree)), len(agree))


@statistic("precision of overturning", "1", ideal=1.0, resolution=1e-3)
def overturning_precision(samples: Samples) -> tuple[float, str]:
    """Share of the scenes in which the candidate falls that the reference falls in too; 1 if it falls in none."""
    both = int(np.sum(samples.reference.fallen & samples.candidate.fallen))
    return _share(both, int(np.sum(samples.candidate.fallen)))


@statistic("recall of overturning", "1", ideal=1.0, resolution=1e-3)
def overturning_recall(samples: Samples) -> tuple[float, str]:
    """Share of the scenes in which the reference falls that the candidate falls in too; 1 if it falls in none."""
    both = int(np.sum(samples.reference.fallen & samples.candidate.fallen))
    return _share(both, int(np.sum(samples.reference.fallen)))


@statistic("bias of peak rotation", "1", resolution=1e-4)
def peak_bias(samples: Samples) -> tuple[float, str]:
    """Mean of ln(c/r) of the peaks where neither falls; the remark gives its 95 % confidence interval (Student)."""
    from scipy.stats import t

    ratios = samples.log_ratios()
    if len(ratios) < 2:
        return math.nan, "fewer than two scenes in which both rock and neither falls"
    half = float(t.ppf(0.5 + 0.5 * CONFIDENCE, len(ratios) - 1) * np.std(ratios, ddof=1) / math.sqrt(len(ratios)))
    mean = float(np.mean(ratios))
    return mean, f"95 % [{mean - half:.2g}, {mean + half:.2g}], {len(ratios)} scenes"


@statistic("scatter of peak rotation", "1", resolution=1e-4)
def peak_scatter(samples: Samples) -> tuple[float, str]:
    """Standard deviation of ln(c/r) of the peaks where neither falls; the remark gives its 95 % interval (chi-squared)."""
    from scipy.stats import chi2

    ratios = samples.log_ratios()
    if len(ratios) < 2:
        return math.nan, "fewer than two scenes in which both rock and neither falls"
    scatter, free = float(np.std(ratios, ddof=1)), len(ratios) - 1
    low, high = (scatter * math.sqrt(free / chi2.ppf(0.5 + sign * 0.5 * CONFIDENCE, free)) for sign in (1.0, -1.0))
    return scatter, f"95 % [{low:.2g}, {high:.2g}]"


def _share(hits: int, of: int) -> tuple[float, str]:
    from scipy.stats import binomtest

    if of == 0:
        return 1.0, "none fall"
    interval = binomtest(hits, of).proportion_ci(CONFIDENCE, method="wilson")
    return hits / of, f"{hits} of {of}, 95 % [{interval.low:.3f}, {interval.high:.3f}]"
