"""The base motion as a velocity: its differences are exact mean accelerations over a step."""

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import Excitation, Floats, Record, Rest, Scene


class BaseVelocity(NamedTuple):
    """The time integral of one excitation: of a record's straight lines, of a pulse's spline.

    The `pieces` are polynomials in the time since their start, each of `interval` s; after all of
    them the velocity is `last`, m/s.
    """

    pieces: list[list[float]]  # lists: an engine's loop asks for one time after another
    interval: float
    last: float


@lru_cache(maxsize=8)
def velocity_of(excitation: Excitation) -> BaseVelocity:
    """The velocity of the base, zero at t = 0; for `velocity_at`, and not to be changed."""
    if isinstance(excitation, Rest) or excitation.quiet_after == 0.0:  # a record of one sample
        return BaseVelocity([], 1.0, 0.0)
    interval = excitation.sample_step
    times = interval * np.arange(math.ceil(excitation.quiet_after / interval - 1e-9) + 1.0)
    last = times[-1]
    if last > excitation.quiet_after and math.isclose(last, excitation.quiet_after):
        times[-1] = excitation.quiet_after  # rounding, where the acceleration may jump
    samples = excitation.acceleration(times)
    if isinstance(excitation, Record):
        return _velocity_of_samples(times, samples, interval)
    from scipy.interpolate import CubicSpline  # it takes longer to import than a run of a record

    velocity = CubicSpline(times, samples).antiderivative()
    return BaseVelocity(velocity.c[::-1].T.tolist(), interval, float(velocity(times[-1])))


def _velocity_of_samples(
    times: Floats, samples: NDArray[np.floating[Any]], interval: float
) -> BaseVelocity:
    """The velocity of a base whose acceleration is linear between its samples."""
    half_jerks, lengths = 0.5 * (np.diff(samples) / interval), np.diff(times)
    gains = np.column_stack([samples[:-1] * lengths, half_jerks * (lengths * lengths)])
    velocities = np.concatenate([[0.0], np.cumsum(gains)[1::2]])
    pieces = np.column_stack([velocities[:-1], samples[:-1], half_jerks])
    return BaseVelocity(pieces.tolist(), interval, float(velocities[-1]))


def velocity_at(t: Any, pieces: Any, interval: Any, last: Any) -> Any:
    """Velocity in m/s at the time `t` >= 0 in s, from what a `BaseVelocity` holds."""
    index = int(t / interval)
    if index >= len(pieces):
        return last
    since, power, velocity = t - interval * index, 1.0, 0.0
    for coefficient in pieces[index]:
        velocity += coefficient * power
        power *= since
    return velocity


def velocities_at(times: NDArray[np.floating[Any]], base: BaseVelocity) -> Floats:
    """`velocity_at` many times at once, with the same figures to the bit."""
    if not base.pieces:
        return np.full(len(times), base.last)
    index = np.minimum(times / base.interval, len(base.pieces)).astype(np.int64)
    since = times - base.interval * index
    power, velocity = np.ones(len(times)), np.zeros(len(times))
    for coefficients in np.array([*base.pieces, np.zeros(len(base.pieces[0]))]).T:
        velocity += coefficients[index] * power
        power = power * since
    return np.where(index < len(base.pieces), velocity, base.last)


def starts_of_motion(scene: Scene, *base: BaseVelocity) -> list[float]:
    """Sorted times at which a block at rest on the floor may start or stop to slide or tip, s.

    There |u| crosses mu (g + vg) or tan(alpha) (g + vg); accelerations are taken to be linear
    between the ends of the pieces of `base`.
    """
    times = np.unique([t for one in base for t in one.interval * np.arange(len(one.pieces) + 1)])
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
