"""Ensembles: rocking is chaotic, so single histories are not predictable, but distributions are
(Bachmann et al. 2018).

An ensemble is one table of a suite, drawn the same for every model:

    [[ensemble]]
    name = "pulses"
    count = 500
    seed = 1
    scene = { duration = 10.0, block = { ... }, floor = { friction = 0.5 } }
    # each optional: uniform, lognormal (median, sigma of the logarithm)
    friction = { uniform = [0.2, 0.8] }
    gap = { uniform = [0.01, 0.1] }                    # of every wall of the scene, m
    pulse = { period = {...}, amplitude = {...} }      # a Ricker pulse of random phase, m/s^2 and s
    noise = { amplitude = {...}, frequency = 2.5, damping = 0.6, strong = 8.0 }

A pulse of phase phi is cos(phi) times the symmetric Ricker pulse plus sin(phi) times the
antisymmetric one. Noise is white noise through the Kanai-Tajimi filter, of power spectrum (1 + 4
z^2 r^2)/((1 - r^2)^2 + 4 z^2 r^2), r = f/`frequency`, z = `damping`, times a half-sine envelope of
`strong` seconds; `amplitude` is its peak acceleration, m/s^2.
"""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from rockcheck.scenes import InputError, Record, Ricker, Scene, Wall
from rockcheck.scenes.base import Finite, Frozen, NonNegative, Positive

#: Of the generated records, s.
RECORD_STEP = 0.002


class Distribution(Frozen):
    """`uniform` between two values, or `lognormal` with a median and the standard deviation of the
    logarithm."""

    uniform: tuple[Finite, Finite] | None = None
    lognormal: tuple[Positive, NonNegative] | None = None

    @model_validator(mode="after")
    def _one(self) -> Distribution:
        if (self.uniform is None) == (self.lognormal is None):
            raise InputError("give exactly one of uniform, lognormal")
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
        phase, period, amplitude = (
            chance.uniform(0.0, 2.0 * math.pi),
            self.period.draw(chance),
            self.amplitude.draw(chance),
        )
        t = np.arange(0.0, 4.0 * period, RECORD_STEP)
        parts = (
            Ricker(amplitude=1.0, period=period, symmetric=symmetric).acceleration(t)
            for symmetric in (True, False)
        )
        even, odd = parts
        return Record.from_samples(
            amplitude * (math.cos(phase) * even + math.sin(phase) * odd), RECORD_STEP
        )


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
        power = (1.0 + 4.0 * self.damping**2 * ratio**2) / (
            (1.0 - ratio**2) ** 2 + 4.0 * self.damping**2 * ratio**2
        )
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
            change["floor"] = base.floor.model_copy(
                update={"friction": self.friction.draw(chance), "static_friction": None}
            )
        if self.gap is not None:
            change["walls"] = tuple(
                Wall(side=w.side, gap=self.gap.draw(chance), restitution=w.restitution)
                for w in base.walls
            )
        return base.replace(**change)
