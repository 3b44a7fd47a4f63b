"""What every engine shares: its settings, the march through a scene, and the history that comes out."""

from __future__ import annotations

import math
import time
from abc import abstractmethod
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from typing import ClassVar, Literal, Protocol, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import field_validator, model_validator

from rockcheck.engines.adaptive import Push, march_adaptively
from rockcheck.engines.base_motion import BaseMotion
from rockcheck.engines.contacts import contacts_of
from rockcheck.engines.events import events_of
from rockcheck.scenes import Block, Cost, History, InputError, ModelFailure, Record, Rest, Ricker, Scene, Sine, Wall
from rockcheck.scenes.base import Frozen, Positive
from rockcheck.scenes.errors import printable
from rockcheck.scenes.observation import observe
from rockcheck.scenes.progress import tell

FloatArray = NDArray[np.float64]
Marched = tuple[FloatArray, FloatArray, FloatArray]  # times (n) and states (n, 6) at step ends, felt accelerations (n-1, 2)
MOST_STEPS = 5_000_000
STEPS_AT_ONCE = 2048
BLOWN_UP = 1e6  # m, rad, m/s or rad/s: no scene comes near it


class World(Protocol):
    """One scene as an engine holds it: a block of unit mass that is free to move in its plane."""

    def place(self, state: FloatArray) -> None:
        """Put the block where `state` (6) says."""

    def march(self, felt: FloatArray, dt: float) -> FloatArray:
        """States (n, 6) after each of n steps of `dt` s, with the `felt` accelerations (n, 2) in m/s^2."""

    def close(self) -> None:
        """Give back what the engine holds."""


class RigidWorld(World, Protocol):
    """A world whose contacts stop or bounce within one step, whatever the step, so that steps can vary."""

    @property
    def push(self) -> Push:
        """The engine as a map of velocities."""


class Engine(Frozen):
    """A physics engine as a model of the block.

    `time_step` in s, or "adaptive": then steps end at the events and are at most `largest_step` s long, which has no
    meaning otherwise. `settings` "best" is the set-up that converges to rigid contact with Coulomb friction and Newton's
    restitution; "default" is the engine as it comes, a box on a floor with the engine's own contact parameters, which
    cannot step adaptively.
    """

    name: ClassVar[str]
    time_step: float | Literal["adaptive"] = 1e-4
    largest_step: Positive = 1e-3
    settings: Literal["best", "default"] = "best"

    @field_validator("time_step", mode="plain")
    @classmethod
    def _step_or_adaptive(cls, value: object) -> float | Literal["adaptive"]:
        if value == "adaptive":
            return "adaptive"
        if isinstance(value, int | float) and not isinstance(value, bool) and 0.0 < value < math.inf:
            return float(value)
        raise InputError(f'{printable(value)} is not allowed: a step above 0 s, or "adaptive", is asked for')

    @model_validator(mode="after")
    def _rigid_if_adaptive(self) -> Self:
        if self.settings == "default" and self.time_step == "adaptive":
            raise InputError('"adaptive" is not allowed with settings = "default": give a step in s', "time_step")
        return self

    @abstractmethod
    def rigid_world(self, scene: Scene) -> RigidWorld:
        """The scene as this engine holds it at its best."""

    @abstractmethod
    def stock_world(self, scene: Scene) -> World:
        """The scene as this engine holds it with its own contact parameters."""

    def notes(self, scene: Scene) -> list[str]:
        """What this engine cannot do of the scene, a line each."""
        if scene.floor.mu_s == scene.floor.friction:
            return []
        return [f"the engine has one friction coefficient: kinetic {scene.floor.friction:g} is used for static {scene.floor.mu_s:g}"]

    def simulate(self, scene: Scene) -> History:
        """The history of the scene as the engine plays it.

        The cost's `wall_seconds` and `cpu_seconds` are those of the march alone. Raises `InputError` if the scene needs
        more than five million steps, `ModelFailure` if the motion blows up or its events do not end.
        """
        step = self.largest_step if self.time_step == "adaptive" else self.time_step
        if scene.duration / step > MOST_STEPS:
            key = "largest_step" if self.time_step == "adaptive" else "time_step"
            raise InputError(f"{step:g} is not allowed: {scene.duration:g} s would need more than {MOST_STEPS} steps", key)
        start = time.perf_counter()
        unit = scene.block.radius if self.settings == "best" else 1.0  # of length, m
        played = in_units_of(unit, scene)
        base = BaseMotion(played)
        march: Callable[[], Marched]
        with ExitStack() as stack:
            if self.time_step == "adaptive":
                rigid = self.rigid_world(played)
                stack.callback(rigid.close)
                march = partial(march_adaptively, played, base, rigid.push, step)
            else:
                world = self.rigid_world(played) if self.settings == "best" else self.stock_world(played)
                stack.callback(world.close)
                times = step * np.arange(math.ceil(scene.output_times[-1] / step - 1e-9) + 1)
                march = partial(_march, world, played, times, base.felt_acceleration(times))
            begin, begin_cpu = time.perf_counter(), time.process_time()
            times, states, felt = march()
            cost = Cost(
                wall_seconds=time.perf_counter() - begin,
                cpu_seconds=time.process_time() - begin_cpu,
                set_up=begin - start,
                steps=len(states) - 1,
            )
        states[:, [0, 1, 3, 4]] *= unit
        return observe(
            scene,
            self.name,
            at_output_times(scene, times, states),
            events=events_of(scene, contacts_of(scene), times, states, unit * felt),
            cost=cost,
            settings=self.model_dump(),
            notes=self.notes(scene),
        )


def in_units_of(length: float, scene: Scene) -> Scene:
    """The scene with all lengths in units of `length` m, so that the absolute tolerances of an engine fit any block."""

    def rescaled(excitation: Rest | Ricker | Sine | Record) -> Rest | Ricker | Sine | Record:
        sizes = {name: getattr(excitation, name) / length for name in ("amplitude", "scale") if hasattr(excitation, name)}
        return excitation.model_copy(update=sizes)

    return scene.replace(
        block=Block(half_width=scene.block.half_width / length, half_height=scene.block.half_height / length),
        walls=tuple(Wall(side=wall.side, gap=wall.gap / length, restitution=wall.restitution) for wall in scene.walls),
        excitation=rescaled(scene.excitation),
        vertical=rescaled(scene.vertical),
        initial_velocity=scene.initial_velocity / length,
        initial_height=scene.initial_height / length,
        gravity=scene.gravity / length,
    )


def _march(world: World, scene: Scene, times: FloatArray, felt: FloatArray) -> Marched:
    """Times, states at all step ends and felt accelerations, up to the first state with |theta| >= pi/2."""
    dt = float(times[1]) if len(times) > 1 else 0.0
    pieces = [np.array(scene.initial_state)[None, :]]
    world.place(pieces[0][0])
    for first in range(0, len(felt), STEPS_AT_ONCE):
        tell(first, len(felt))
        states = world.march(felt[first : first + STEPS_AT_ONCE], dt)
        tipped = np.flatnonzero(np.abs(states[:, 2]) >= math.pi / 2)
        if tipped.size:
            states = states[: tipped[0] + 1]
        if not np.all(np.abs(states) < BLOWN_UP):  # catches nan, too
            raise ModelFailure(f"the motion blew up between t = {times[first]:g} and {times[first + len(states)]:g} s")
        if np.any(states[:, 1] < 0.0):
            raise ModelFailure(f"the block fell through the floor before t = {times[first + len(states)]:g} s: is the step too long?")
        pieces.append(states)
        if tipped.size:
            break
    marched = np.concatenate(pieces)
    return times[: len(marched)], marched, felt


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
