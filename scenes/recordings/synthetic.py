"""Synthetic ground motions that follow a target spectrum, for examples and first studies.

In: a target, how many motions, a seed. Out: recordings. Called by the command `new`.

A motion begins as noise with random phases under an envelope. Its Fourier amplitudes are scaled by
the ratio of the target to its own spectrum, again and again (Gasparini and Vanmarcke 1976). Such
motions differ less from each other than recorded ones do, and have no pulses of a near fault.
"""

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

import numpy as np
from pydantic import Field, Strict

from rockcheck.scenes.base import Floats, Frozen
from rockcheck.scenes.recordings import intensity
from rockcheck.scenes.recordings.recording import Recording

Ground = Literal["A", "B", "C", "D", "E"]
GROUNDS: tuple[Ground, ...] = get_args(Ground)
#: By type of ground: soil factor S, and corner periods T_B, T_C, T_D (s); EN 1998-1, table 3.2.
_SOIL: dict[Ground, tuple[float, float, float, float]] = {
    "A": (1.0, 0.15, 0.4, 2.0),
    "B": (1.2, 0.15, 0.5, 2.0),
    "C": (1.15, 0.20, 0.6, 2.0),
    "D": (1.35, 0.20, 0.8, 2.0),
    "E": (1.4, 0.15, 0.5, 2.0),
}
#: Periods (s) at which a motion follows its target. Longer and shorter ones fade out.
PERIODS = np.geomspace(0.03, 4.0, 48)
#: Scalings of the Fourier amplitudes.
_SCALINGS = 8
#: Shares of the duration at which the strong part begins and ends, and of it that fades at the end;
#: the rate at which motion decays after the strong part, of a duration.
_RISEN, _DECAYS, _FADES, _DECAY_RATE = 0.12, 0.55, 0.05, 7.0
#: The most motions at once.
MOST_MOTIONS = 100


class Target(Frozen):
    """The horizontal elastic spectrum of type 1, 5 % damped (EN 1998-1:2004, 3.2.2.2).

    `ground` is the type of ground, `acceleration` (g) that of rock, a_g: the spectrum at period 0
    is that times the soil factor.
    """

    ground: Ground = "B"
    acceleration: Annotated[float, Strict(), Field(gt=0.0, le=5.0)] = 0.3

    def spectral_acceleration(self, periods: Floats) -> Floats:
        """Sa in g at periods in s."""
        soil, rises_to, falls_from, displaces_from = _SOIL[self.ground]
        t = np.asarray(periods, dtype=float)
        plateau = 2.5 * self.acceleration * soil
        rising = self.acceleration * soil * (1.0 + 1.5 * np.minimum(t / rises_to, 1.0))
        falling = plateau * falls_from / np.maximum(t, falls_from)
        return np.minimum(rising, falling) * displaces_from / np.maximum(t, displaces_from)

    @property
    def words(self) -> str:
        """Which spectrum."""
        return (
            f"EN 1998-1, type 1, ground {self.ground}, {self.acceleration:g} g on rock, 5 % damped"
        )


@dataclass(frozen=True)
class _Times:
    """The samples of a motion: how many, and their step (s)."""

    count: int
    step: float

    @property
    def frequencies(self) -> Floats:
        """The frequencies of the Fourier series, Hz."""
        return np.asarray(np.fft.rfftfreq(self.count, self.step), dtype=float)

    @property
    def shares(self) -> Floats:
        """The times of the samples, as shares of the duration."""
        return np.linspace(0.0, 1.0, self.count)


def synthetic_motions(
    target: Target, count: int = 12, *, seed: int = 1, duration: float = 20.0, step: float = 0.01
) -> list[Recording]:
    """Motions (m/s^2) that follow a target, the same on every call.

    Each lasts `duration` s, has a sample every `step` s, and begins and ends at rest. Of one `seed`
    the first motions are the same whatever the `count`.
    """
    times = _Times(round(duration / step) + 1, step)
    return [
        _motion(target, times, np.random.default_rng([seed, number])) for number in range(count)
    ]


def _motion(target: Target, times: _Times, random: np.random.Generator) -> Recording:
    wanted = target.spectral_acceleration(PERIODS)
    samples = _at_rest(random.standard_normal(times.count) * _envelope(times), times)
    for _ in range(_SCALINGS):
        ratios = wanted / _spectrum(samples, times)
        samples = _at_rest(_scaled(samples, ratios, times), times)
    off = np.abs(np.log(wanted / _spectrum(samples, times)))
    note = f"synthetic: {target.words}; Sa is within {100.0 * np.expm1(off.max()):.0f} % of it"
    return _recording(samples, times, (f"{note} from {PERIODS[0]:g} to {PERIODS[-1]:g} s",))


def _recording(samples: Floats, times: _Times, notes: tuple[str, ...] = ()) -> Recording:
    return Recording(
        samples=samples, time_step=times.step, unit="m/s2", form="synthetic", notes=notes
    )


def _spectrum(samples: Floats, times: _Times) -> Floats:
    """Sa (g) at `PERIODS`."""
    recording = _recording(samples, times)
    return np.array(
        [intensity.spectral_acceleration(recording, period) for period in PERIODS.tolist()]
    )


def _scaled(samples: Floats, ratios: Floats, times: _Times) -> Floats:
    """The samples, their Fourier amplitudes times the ratio at the period of each."""
    frequencies = times.frequencies
    lowest, highest = 1.0 / PERIODS[-1], 1.0 / PERIODS[0]
    periods = 1.0 / np.maximum(frequencies, 0.5 * lowest)
    factors = np.exp(np.interp(np.log(periods), np.log(PERIODS), np.log(ratios)))
    # What is slower than the spectrum says would only move the baseline; what is faster, the peak.
    factors *= np.clip(2.0 * frequencies / lowest - 1.0, 0.0, 1.0)
    factors *= np.clip(3.0 - 2.0 * frequencies / highest, 0.0, 1.0)
    return np.fft.irfft(factors * np.fft.rfft(samples), times.count)


def _envelope(times: _Times) -> Floats:
    """Rises as a square, stays, and decays; after Jennings, Housner and Tsai (1968)."""
    shares = times.shares
    rising = np.square(np.minimum(shares / _RISEN, 1.0))
    return rising * np.exp(-_DECAY_RATE * np.maximum(shares - _DECAYS, 0.0))


def _at_rest(samples: Floats, times: _Times) -> Floats:
    """The samples, so that acceleration, velocity and displacement begin and end at 0.

    They fade in and out; two smooth slow motions take away the velocity and displacement at the
    end.
    """
    shares = times.shares
    ends = np.clip(np.minimum(shares, 1.0 - shares) / _FADES, 0.0, 1.0)
    faded = samples * np.square(np.sin(0.5 * np.pi * ends))
    slow = np.square(np.sin(np.pi * shares)) * np.array([np.ones(times.count), shares - 0.5])
    moments = np.array([np.ones(times.count), 1.0 - shares])  # velocity, displacement at the end
    amounts = np.linalg.solve(moments @ slow.T, moments @ faded)
    return np.asarray(faded - amounts @ slow)
