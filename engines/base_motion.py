"""The shaking base as its velocity: a difference of velocities is the exact mean of an acceleration over a step."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import Record, Rest, Scene
from rockcheck.scenes.excitations import Ricker, Sine

FloatArray = NDArray[np.float64]
SAMPLES_A_PERIOD = 4000  # of a pulse: its integral is then good to 2e-7 of itself


class BaseVelocity:
    """The time integral of one excitation whose acceleration is linear between samples, as that of a record is."""

    def __init__(self, excitation: Rest | Ricker | Sine | Record) -> None:
        if isinstance(excitation, Record):
            self.interval = excitation.time_step
        elif isinstance(excitation, Rest):
            self.interval = 1.0
        else:
            self.interval = excitation.period / SAMPLES_A_PERIOD
        self.times = self.interval * np.arange(math.ceil(excitation.quiet_after / self.interval - 1e-9) + 1)
        samples = excitation.acceleration(self.times)
        # Lists: an engine's loop asks for one time after another.
        self.sums: list[float] = [0.0, *np.cumsum(0.5 * self.interval * (samples[1:] + samples[:-1])).tolist()]
        self.samples: list[float] = samples.tolist()

    def __call__(self, t: float) -> float:
        """Velocity of the base in m/s at the time `t` >= 0 in s, zero at t = 0."""
        place = t / self.interval
        index = int(place)
        if index >= len(self.samples) - 1:
            return self.sums[-1]
        part = place - index
        here = self.samples[index]
        return self.sums[index] + self.interval * part * (here + 0.5 * part * (self.samples[index + 1] - here))


class BaseMotion:
    """The base motion of a scene along both axes; `starts` are times at which it may set a resting block in motion."""

    def __init__(self, scene: Scene) -> None:
        self.across, self.up, self.gravity = BaseVelocity(scene.excitation), BaseVelocity(scene.vertical), scene.gravity
        self.starts = _starts_of_motion(scene, np.unique(np.concatenate([self.across.times, self.up.times])))

    def velocity(self, t: float) -> tuple[float, float]:
        """Velocity of the base to the right and up in m/s at the time `t` >= 0 in s."""
        return self.across(t), self.up(t)

    def felt_acceleration(self, edges: FloatArray) -> FloatArray:
        """What the block feels, -u and -(g + vg) in m/s^2, as means over the steps between the times `edges`; shape (steps, 2)."""
        gained = np.diff([self.velocity(t) for t in edges.tolist()], axis=0)
        return -gained / np.diff(edges)[:, None] - np.array([0.0, self.gravity])


def _starts_of_motion(scene: Scene, times: FloatArray) -> list[float]:
    """Times in order at which a block at rest, flat on the floor, may start or stop to slide or to tip, s.

    There |u| passes mu (g + vg) or tan(alpha) (g + vg); accelerations are taken to be linear between `times`.
    """
    pushing = np.abs(scene.excitation.acceleration(times))
    holding = scene.gravity + scene.vertical.acceleration(times)
    found = []
    left, right = scene.block.pivot("left"), scene.block.pivot("right")
    for limit in dict.fromkeys((scene.floor.friction, left.arm / left.height, right.arm / right.height)):
        excess = pushing - limit * holding
        change = np.flatnonzero((excess[1:] > 0.0) != (excess[:-1] > 0.0))
        part = excess[change] / (excess[change] - excess[change + 1])
        found += (times[change] + part * (times[change + 1] - times[change])).tolist()
    return sorted(found)
