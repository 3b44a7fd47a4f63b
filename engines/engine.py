"""What every engine shares: its settings, the march through a scene, and the history that comes out."""

from __future__ import annotations

import math
import time
from abc import abstractmethod
from typing import ClassVar, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from engines.base_motion import felt_acceleration
from engines.contacts import contacts_of
from engines.events import events_of
from scenes import Cost, History, InputError, ModelFailure, Scene
from scenes.base import Frozen, Positive
from scenes.observation import observe

FloatArray = NDArray[np.float64]
MOST_STEPS = 5_000_000
STEPS_AT_ONCE = 2048
BLOWN_UP = 1e6  # m, rad, m/s or rad/s: no scene comes near it


class World(Protocol):
    """One scene as an engine holds it: a block of unit mass that is free to move in its plane."""

    def place(self, state: FloatArray) -> None:
        """Put the block where `state` (6) says."""

    def march(self, accelerations: FloatArray) -> FloatArray:
        """States (n, 6) after each of n steps, with the felt `accelerations` (n, 2) in m/s^2."""

    def close(self) -> None:
        """Give back what the engine holds."""


class Engine(Frozen):
    """A physics engine as a model of the block.

    `time_step` in s. `settings` "best" is the set-up that converges to rigid contact with Coulomb friction and Newton's
    restitution; "default" is the engine as it comes: a box on a floor, with the engine's own contact parameters.
    """

    name: ClassVar[str]
    time_step: Positive = 1e-4
    settings: Literal["best", "default"] = "best"

    @abstractmethod
    def world(self, scene: Scene) -> World:
        """The scene as this engine holds it."""

    def notes(self, scene: Scene) -> list[str]:
        """What this engine cannot do of the scene, a line each."""
        if scene.floor.mu_s == scene.floor.friction:
            return []
        return [f"the engine has one friction coefficient: kinetic {scene.floor.friction:g} is used for static {scene.floor.mu_s:g}"]

    def simulate(self, scene: Scene) -> History:
        """The history of the scene as the engine plays it.

        Its cost's `wall_seconds` and `cpu_seconds` are those of the march alone. Raises `InputError` if the scene needs
        more than five million steps, `ModelFailure` if the motion blows up.
        """
        if scene.duration / self.time_step > MOST_STEPS:
            raise InputError(
                f"{self.time_step:g} is not allowed: {scene.duration:g} s would need more than {MOST_STEPS} steps", "time_step"
            )
        start = time.perf_counter()
        world = self.world(scene)
        try:
            steps = math.ceil(scene.output_times[-1] / self.time_step - 1e-9)
            times = self.time_step * np.arange(steps + 1)
            felt = felt_acceleration(scene, times)
            begin, begin_cpu = time.perf_counter(), time.process_time()
            states = _march(world, np.array(scene.initial_state), felt)
            cost = Cost(
                wall_seconds=time.perf_counter() - begin,
                cpu_seconds=time.process_time() - begin_cpu,
                set_up=begin - start,
                steps=len(states) - 1,
            )
        finally:
            world.close()
        times = times[: len(states)]
        return observe(
            scene,
            self.name,
            at_output_times(scene, times, states),
            events=events_of(scene, contacts_of(scene), times, states, felt),
            cost=cost,
            settings=self.model_dump(),
            notes=self.notes(scene),
        )


def _march(world: World, initial: FloatArray, felt: FloatArray) -> FloatArray:
    """States at all step ends, the initial one first, up to the first one with |theta| >= pi/2."""
    world.place(initial)
    pieces = [initial[None, :]]
    for first in range(0, len(felt), STEPS_AT_ONCE):
        states = world.march(felt[first : first + STEPS_AT_ONCE])
        if not np.all(np.abs(states) < BLOWN_UP):  # catches nan, too
            raise ModelFailure(f"the motion blew up between steps {first} and {first + len(states)}")
        pieces.append(states)
        tipped = np.flatnonzero(np.abs(states[:, 2]) >= math.pi / 2)
        if tipped.size:
            pieces[-1] = states[: tipped[0] + 1]
            break
    return np.concatenate(pieces)


def at_output_times(scene: Scene, times: FloatArray, states: FloatArray) -> FloatArray:
    """States on the scene's output grid: positions by cubic Hermite interpolation between steps, velocities linear.

    Velocities jump at impacts, where a cubic would overshoot.
    """
    from scipy.interpolate import CubicHermiteSpline

    wanted = scene.output_times
    wanted = wanted[wanted <= times[-1] * (1.0 + 1e-12) + 1e-12]
    if len(times) == 1:
        return states[: len(wanted)]
    inside = np.minimum(wanted, times[-1])
    positions = CubicHermiteSpline(times, states[:, :3], states[:, 3:])(inside)
    velocities = np.column_stack([np.interp(inside, times, states[:, column]) for column in (3, 4, 5)])
    return np.hstack([positions, velocities])
