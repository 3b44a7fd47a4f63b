"""The base motion as a velocity: its differences are exact mean accelerations over a step."""

import math
from typing import Any

import numpy as np

from rockcheck.scenes import Record, Rest, Scene
from rockcheck.scenes.excitations import FloatArray, Ricker, Sine

SAMPLES_A_PERIOD = 1000  # of a pulse: a cubic spline through them is good to 1e-11 of its amplitude


class BaseVelocity:
    """The time integral of one excitation: of a record's straight lines, of a pulse's spline."""

    def __init__(self, excitation: Rest | Ricker | Sine | Record) -> None:
        from scipy.interpolate import CubicSpline, PPoly

        if isinstance(excitation, Record):
            self.interval = excitation.time_step
        elif isinstance(excitation, Rest):
            self.interval = 1.0
        else:
            self.interval = excitation.period / SAMPLES_A_PERIOD
        self.times = self.interval * np.arange(
            math.ceil(excitation.quiet_after / self.interval - 1e-9) + 1
        )
        # Lists: an engine's loop asks for one time after another.
        self.pieces: list[list[float]] = []
        self.last = 0.0
        if len(self.times) > 1:
            samples = excitation.acceleration(self.times)
            lines = np.array([np.diff(samples) / self.interval, samples[:-1]])
            pieces = PPoly(
                lines if isinstance(excitation, Record) else CubicSpline(self.times, samples).c,
                self.times,
            )
            velocity = pieces.antiderivative()
            self.pieces, self.last = velocity.c[::-1].T.tolist(), float(velocity(self.times[-1]))

    def __call__(self, t: float) -> float:
        """Velocity of the base in m/s at the time `t` >= 0 in s, zero at t = 0."""
        return float(velocity_at(t, self.pieces, self.interval, self.last))


def velocity_at(t: Any, pieces: Any, interval: Any, last: Any) -> Any:
    """Velocity at the time `t`; after all `pieces` it is `last`.

    The pieces are polynomials in the time since their start; each lasts `interval` s.
    """
    index = int(t / interval)
    if index >= len(pieces):
        return last
    since, power, velocity = t - interval * index, 1.0, 0.0
    for coefficient in pieces[index]:
        velocity += coefficient * power
        power *= since
    return velocity


class BaseMotion:
    """The base motion of a scene along both axes.

    `starts` are the times at which it may set a resting block in motion.
    """

    def __init__(self, scene: Scene) -> None:
        self.across, self.up, self.gravity = (
            BaseVelocity(scene.excitation),
            BaseVelocity(scene.vertical),
            scene.gravity,
        )
        self.starts = _starts_of_motion(
            scene, np.unique(np.concatenate([self.across.times, self.up.times]))
        )

    def velocity(self, t: float) -> tuple[float, float]:
        """Velocity of the base to the right and up in m/s at the time `t` >= 0 in s."""
        return self.across(t), self.up(t)

    def felt_acceleration(self, edges: FloatArray) -> FloatArray:
        """Mean felt acceleration, -u and -(g + vg) in m/s^2, of each step; shape (steps, 2).

        The steps lie between the times `edges`.
        """
        gained = np.diff([self.velocity(t) for t in edges.tolist()], axis=0)
        return -gained / np.diff(edges)[:, None] - np.array([0.0, self.gravity])


def _starts_of_motion(scene: Scene, times: FloatArray) -> list[float]:
    """Sorted times at which a block at rest on the floor may start or stop to slide or tip, s.

    There |u| crosses mu (g + vg) or tan(alpha) (g + vg); accelerations are taken to be linear
    between `times`.
    """
    pushing = np.abs(scene.excitation.acceleration(times))
    holding = scene.gravity + scene.vertical.acceleration(times)
    found = []
    left, right = scene.block.pivot("left"), scene.block.pivot("right")
    for limit in dict.fromkeys(
        (scene.floor.friction, left.arm / left.height, right.arm / right.height)
    ):
        excess = pushing - limit * holding
        change = np.flatnonzero((excess[1:] > 0.0) != (excess[:-1] > 0.0))
        part = excess[change] / (excess[change] - excess[change + 1])
        found += (times[change] + part * (times[change + 1] - times[change])).tolist()
    return sorted(found)
