"""Intensity measures of recorded ground motions."""

import math

import numpy as np

from rockcheck.scenes.base import Floats
from rockcheck.scenes.recordings.recording import GRAVITY_OF_RECORDS, Recording

#: Periods at which spectral accelerations are given, s.
PERIODS = (0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0)
#: Steps per period, for the largest sample to be the peak within 0.1 %; and most steps in all.
_STEPS, _MOST_STEPS = 80, 5_000_000


def peak_acceleration(record: Recording) -> float:
    """PGA, the largest absolute acceleration, in g."""
    return float(np.max(np.abs(record.samples))) / GRAVITY_OF_RECORDS


def velocity(record: Recording) -> Floats:
    """Ground velocity at the samples in m/s, from rest, without baseline correction.

    Exact for straight lines between samples.
    """
    means = (record.samples[1:] + record.samples[:-1]) / 2.0
    return np.concatenate([[0.0], np.cumsum(record.time_step * means)])


def peak_velocity(record: Recording) -> float:
    """PGV, the largest absolute velocity, in m/s, also where it lies between two samples.

    There the acceleration passes through 0, from b to a: b^2/(2 (b - a)) steps are added.
    """
    before, after = record.samples[:-1], record.samples[1:]
    turns, samples = before * after < 0.0, velocity(record)
    added = record.time_step * before[turns] ** 2 / (2.0 * (before - after)[turns])
    return float(np.max(np.abs(np.concatenate([samples, samples[:-1][turns] + added]))))


def arias(record: Recording) -> float:
    """Arias intensity pi/(2 g) int a^2 dt in m/s, exact for straight lines between samples."""
    before, after = record.samples[:-1], record.samples[1:]
    squares = float(np.sum(before * before + before * after + after * after)) / 3.0
    return math.pi / (2.0 * GRAVITY_OF_RECORDS) * (squares * record.time_step)


def resolved_periods(record: Recording) -> tuple[float, float]:
    """The periods in s of which a record can tell: from two time steps to its duration."""
    return 2.0 * record.time_step, record.time_step * (len(record.samples) - 1)


def spectral_acceleration(record: Recording, period: float, damping: float = 0.05) -> float:
    """Pseudo-spectral acceleration in g of an oscillator of `period` (s).

    `damping` is relative to critical, below 1. The response is exact for straight lines between
    samples, and continues for one period after the last.
    """
    from scipy.signal import lfilter

    count = len(record.samples)
    parts = max(min(math.ceil(_STEPS * record.time_step / period), _MOST_STEPS // count), 1)
    step, rate = record.time_step / parts, 2.0 * math.pi / period
    tail = max(step, period / _MOST_STEPS) * np.arange(
        1, min(math.ceil(period / step), _MOST_STEPS) + 1
    )
    lines = np.interp(np.arange((count - 1) * parts + 1) / parts, np.arange(count), record.samples)
    # y'' + 2 D w y' + w^2 y = w^2 a, from rest, is w^2/w_D times the imaginary part of z' = pole z
    # + a. A straight line of a adds to z, in a step, so much for its value before and after it.
    pole = rate * complex(-damping, math.sqrt(1.0 - damping * damping))
    gain = np.expm1(pole * step)
    after = (gain / (pole * step) - 1.0) / pole
    before = gain / pole - after
    # the acceleration jumps from 0 to the first sample, and from the last one to 0
    states, _ = lfilter([after, before], [1.0, -1.0 - gain], lines, zi=[-after * lines[0]])
    response = np.abs(np.append(states, states[-1] * np.exp(pole * tail)).imag)
    return float(np.max(response)) * rate**2 / pole.imag / GRAVITY_OF_RECORDS
