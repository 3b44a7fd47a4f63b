"""The acceleration that the block feels in the frame of its shaking base, as a mean over each step of an engine."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scenes import Record, Rest, Scene
from scenes.excitations import Ricker, Sine

FloatArray = NDArray[np.float64]
SAMPLES_A_PERIOD = 4000  # of a pulse: its integral is then good to 2e-7 of itself


class BaseVelocity:
    """The time integral of one excitation, exact for a record: linear acceleration between samples."""

    def __init__(self, excitation: Rest | Ricker | Sine | Record) -> None:
        if isinstance(excitation, Record):
            self.interval = excitation.time_step
        elif isinstance(excitation, Rest):
            self.interval = 1.0
        else:
            self.interval = excitation.period / SAMPLES_A_PERIOD
        count = math.ceil(excitation.quiet_after / self.interval - 1e-9) + 1
        self.samples = excitation.acceleration(self.interval * np.arange(count))
        steps = 0.5 * self.interval * (self.samples[1:] + self.samples[:-1])
        self.sums = np.concatenate([[0.0], np.cumsum(steps)])

    def __call__(self, t: FloatArray) -> FloatArray:
        """Velocity of the base in m/s at times `t` >= 0 in s, zero at t = 0."""
        if len(self.samples) == 1:
            return np.zeros_like(t)
        place = np.minimum(t / self.interval, len(self.samples) - 1.0)
        index = np.minimum(place.astype(np.intp), len(self.samples) - 2)
        part = place - index
        here, following = self.samples[index], self.samples[index + 1]
        velocity: FloatArray = self.sums[index] + self.interval * part * (here + 0.5 * part * (following - here))
        return velocity


def felt_acceleration(scene: Scene, edges: FloatArray) -> FloatArray:
    """What the block feels, -u and -(g + vg) in m/s^2, as means over the steps between the times `edges`; shape (steps, 2)."""
    lengths = np.diff(edges)
    means = [np.diff(BaseVelocity(excitation)(edges)) / lengths for excitation in (scene.excitation, scene.vertical)]
    return -np.column_stack([means[0], scene.gravity + means[1]])
