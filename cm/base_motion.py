"""The motion of the base, whose acceleration is linear between samples.

In: an excitation and how long a run lasts (s).
Out: the base's samples and its velocity at any time (m/s), right or up positive.
Called by `cm.model` (samples) and `cm.integrate` (velocity).
"""

import math
from typing import NamedTuple

import numpy as np

from rockcheck.scenes import Excitation, Floats, Record, Rest, Scene
from rockcheck.scenes.compiled import inner_kernel

#: Samples of a period of a pulse; the straight lines between them are off by 2e-8 of its amplitude.
SAMPLES_A_PERIOD = 16384


class BaseMotion(NamedTuple):
    """The base's motion along one axis."""

    #: Accelerations, m/s^2.
    samples: Floats
    #: The sums of their means (of two neighbours each) up to every one.
    sums: Floats
    #: How many samples there are a second.
    rate: float


class Base(NamedTuple):
    """The base's motion, right and up positive."""

    horizontal: BaseMotion
    vertical: BaseMotion


def base_of(scene: Scene) -> Base:
    """The motion of the scene's base."""
    return Base(
        _motion_of(scene.excitation, scene.duration), _motion_of(scene.vertical, scene.duration)
    )


def _motion_of(excitation: Excitation, duration: float) -> BaseMotion:
    samples, rate = _samples(excitation, duration)
    return BaseMotion(samples, np.cumsum(samples) - 0.5 * (samples + samples[0]), rate)


def _samples(excitation: Excitation, duration: float) -> tuple[Floats, float]:
    """Samples (m/s^2) of the excitation, linear in between, and their number a second.

    A record keeps its samples, and no line leads beyond the last one.
    """
    if isinstance(excitation, Record):
        return excitation.samples, 1.0 / excitation.time_step
    if isinstance(excitation, Rest):
        return np.zeros(1), 1.0
    step = excitation.period / SAMPLES_A_PERIOD
    until = min(excitation.quiet_after, duration)
    if until in excitation.jumps:
        times = np.linspace(0.0, until, round(until / step) + 1)
        return excitation.acceleration(times), (len(times) - 1) / until
    return excitation.acceleration(step * np.arange(math.ceil(until / step) + 2)), 1.0 / step


@inner_kernel
def base_velocity(motion: BaseMotion, t: float) -> float:
    """Velocity of the base at `t`, m/s: its acceleration is linear between samples, zero after."""
    samples, sums, rate = motion
    left = int(t * rate)
    if left + 1 >= len(samples):
        return sums[len(samples) - 1] / rate
    part = t * rate - left
    rise = samples[left + 1] - samples[left]
    return (sums[left] + part * (samples[left] + 0.5 * part * rise)) / rate


@inner_kernel
def mean_acceleration(motion: BaseMotion, t: float, length: float) -> float:
    """Mean acceleration of the base over the `length` s from `t`, m/s^2."""
    return (base_velocity(motion, t + length) - base_velocity(motion, t)) / length
