"""What an engine gives, a `World`, and how its steps follow each other.

They are all of one length, or as long as the events allow.

With a fixed step, an engine's error has two sources: the time of its impacts and a drift along the
arcs of its contacts. Both are of first order in the step. At adaptive steps the engine only turns
velocities into velocities, at the mean pose of a step (drift, kick, drift): its contact solver is
part of a third-order integrator with event location. Step ends are placed where gaps close, where
slip stops and where a block at rest may start to move. An impact has a separate step, so short that
nothing else happens in it. Between events the acceleration changes smoothly from step to step; that
change corrects the drift, which is then of third order. How much it corrects is known after the
step, and bounds its error: the next step is as long as a tolerance allows, and a step with too
large an error is taken again.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from rockcheck.engines import base_motion
from rockcheck.scenes import Block, Floats, ModelFailure, Scene, kinematics, progress
from rockcheck.scenes.interpolation import Track

Vector = tuple[float, float, float]  # along x, y and theta
State = tuple[float, float, float, float, float, float]
#: Times (n) and states (n, 6) at step ends, felt accelerations (n-1, 2).
Marched = tuple[Floats, Floats, Floats]
STEPS_AT_ONCE = 2048
#: Where a block lies on its side: contacts stop it a hair before a quarter turn, or after it.
LYING = math.pi / 2 - 1e-6
#: Rows of an adaptive march for which there is room at first.
ROOM = 8192
#: An `embedding` of a world whose lengths are in block radii.
EMBEDDED = 1e-9
#: s: where a tolerance lets steps be longer, events and extremes are read off states so far apart.
FINE = 5e-4
#: With this tolerance a block of some metres takes steps of `FINE` and more.
FINE_TOLERANCE = 1e-8
#: The tolerance where neither it nor a longest step is given.
USUAL_TOLERANCE = 1e-9
BLOWN_UP = 1e6  # m, rad, m/s or rad/s: no scene comes near it


class World(ABC):
    """One scene as an engine holds it: a block of unit mass that is free to move in its plane.

    A state is x, y, theta of the mass's centre and their rates, x = 0 where the centre of the box
    stands first; theta is counterclockwise positive.
    """

    #: How deep a block that begins on the floor is put at fixed steps, in lengths: an engine that
    #: sees only contacts that overlap would let it fall freely for its first step.
    embedding: ClassVar[float] = 0.0

    @abstractmethod
    def place(self, x: float, y: float, theta: float, vx: float, vy: float, w: float) -> None:
        """Put the block into this state."""

    @abstractmethod
    def step(self, felt: tuple[float, float], dt: float) -> None:
        """One step of `dt` s under the acceleration `felt`, right and up, in lengths / s^2."""

    @abstractmethod
    def state(self) -> State:
        """Where the block is."""

    def ready(self, dt: float) -> None:  # noqa: B027 - most engines take steps of any length
        """Before the block is placed for fixed steps of `dt` s: this is no run time."""

    def bounce(self, bouncing: bool) -> None:  # noqa: B027 - asked of those alone whose steps can vary
        """Let contacts have their restitution, or none."""

    def push(
        self, pose: Vector, velocity: Vector, dt: float, felt: tuple[float, float], bouncing: bool
    ) -> Vector:
        """The engine as a map of velocities, for adaptive steps: the velocity after one.

        It follows from pose and velocity before it, its length `dt` (s) and the acceleration `felt`
        (m/s^2), with the contacts closed at that pose. They take their restitution only where
        `bouncing`; otherwise they stop what approaches.
        """
        self.bounce(bouncing)
        self.place(*pose, *velocity)
        self.step(felt, dt)
        return self.state()[3:]

    def close(self) -> None:  # noqa: B027 - most engines hold nothing
        """Give back what the engine holds."""


def in_units_of(length: float, scene: Scene) -> Scene:
    """The scene with all lengths in units of `length` m.

    An engine's absolute tolerances then fit any block.
    """
    block, (dx, dz) = scene.block, scene.block.offset
    return scene.replace(
        block=Block(  # of 1 kg
            half_width=block.half_width / length,
            half_height=block.half_height / length,
            centre_of_mass=(dx / length, dz / length),
            moment_of_inertia=None
            if block.moment_of_inertia is None
            else block.gyration_squared / length**2,
        ),
        walls=tuple(wall.replace(gap=wall.gap / length) for wall in scene.walls),
        excitation=scene.excitation.scaled(1.0 / length),
        vertical=scene.vertical.scaled(1.0 / length),
        initial_velocity=scene.initial_velocity / length,
        initial_height=scene.initial_height / length,
        gravity=scene.gravity / length,
    )


def march_fixed(world: World, scene: Scene, times: Floats, felt: Floats) -> Marched:
    """Times, states of the mass's centre at step ends, felt accelerations, until the block lies.

    The first state in which the block lies is the last one returned. Raises `ModelFailure` if the
    motion blows up or the block falls through the floor.
    """
    first_state = kinematics.of_mass(scene.block, np.array(scene.initial_state))
    pieces = [first_state[None, :]]
    x, y, *rest = first_state.tolist()
    depth = world.embedding if scene.initial_height == 0.0 else 0.0
    world.place(x, y - depth, *rest)
    for first in range(0, len(felt), STEPS_AT_ONCE):
        progress.tell(first, len(felt))
        some, dt = felt[first : first + STEPS_AT_ONCE], float(times[1])
        states = np.empty((len(some), 6))
        for row, (ax, ay) in enumerate(some.tolist()):
            world.step((ax, ay), dt)
            states[row] = world.state()
        tipped = np.flatnonzero(np.abs(states[:, 2]) >= LYING)
        if tipped.size:
            states = states[: tipped[0] + 1]
        if not np.all(np.abs(states) < BLOWN_UP):  # catches nan, too
            raise ModelFailure(
                f"the motion blew up between t = {times[first]:g} and"
                f" {times[first + len(states)]:g} s"
            )
        if np.any(states[:, 1] < 0.0):
            raise ModelFailure(
                f"the block fell through the floor before t = {times[first + len(states)]:g} s: is"
                " the step too long?"
            )
        pieces.append(states)
        if tipped.size:
            break
    marched = np.concatenate(pieces)
    return times[: len(marched)], marched, felt


def time_of_fall(times: Floats, states: Floats) -> float:
    """When a block that lies at the last step end was down, s; infinity if it does not lie."""
    if abs(states[-1, 2]) < LYING:
        return math.inf
    before, after = np.abs(states[-2:, 2]).tolist()  # it may begin as good as down
    part = min((math.pi / 2 - before) / (after - before), 1.0) if after > before else 0.0
    return float(times[-2] + part * (times[-1] - times[-2]))


def at_output_times(scene: Scene, times: Floats, states: Floats, smooth: bool) -> Floats:
    """States at the run's times: positions by cubic Hermite interpolation.

    Velocities are its slope where steps are `smooth`, that is, impacts have steps of their own.
    Else they are linear: a velocity that jumps inside a step would overshoot.
    """
    inside = scene.run_times
    inside = np.minimum(inside[inside <= times[-1] * (1.0 + 1e-12) + 1e-12], times[-1])
    found = Track.of(times, states, ()).states_at(inside)
    # A cubic over a long step may show a fall that is none.
    upright = inside < time_of_fall(times, states)
    found[upright, 2] = np.clip(found[upright, 2], -LYING, LYING)
    if not smooth:
        for column in (3, 4, 5):
            found[:, column] = np.interp(inside, times, states[:, column])
    return found


def in_fine_steps(times: Floats, states: Floats, felt: Floats) -> Marched:
    """The march of smooth steps with states in between, at most `FINE` s apart.

    Positions are those of the cubic through both ends of a step, velocities its slope.
    """
    parts = np.maximum(np.ceil(np.diff(times) / FINE), 1.0).astype(int)
    ends = np.cumsum(parts)
    step = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(1, len(step) + 1) - np.repeat(ends - parts, parts)) / parts[step]
    finer = np.concatenate([times[:1], times[step] + share * np.diff(times)[step]])
    between = Track.of(times, states, ()).states_at(finer)
    at_ends = np.concatenate([[0], ends])
    finer[at_ends], between[at_ends] = times, states
    return finer, between, felt[step]


@dataclass(frozen=True)
class FixedStep:
    """Steps of `largest` s, each."""

    largest: float
    #: The settings of an engine that hold its fields.
    knobs: ClassVar[tuple[str, ...]] = ("time_step",)
    #: The one of them that limits the usual step.
    limiting: ClassVar[str] = "time_step"
    #: Whether a step's motion is smooth: an impact may lie in it.
    smooth: ClassVar[bool] = False

    @property
    def usual(self) -> float:
        """How long a step usually is, s."""
        return self.largest

    def coarser(self, factor: float) -> "FixedStep":
        """Steps `factor` times as long."""
        return FixedStep(factor * self.largest)

    def ready(self, world: World, scene: Scene) -> Callable[[], Marched]:
        """The march of a world through a scene, which is still to be called."""
        count = math.ceil(scene.run_times[-1] / self.largest - 1e-9)
        times = self.largest * np.arange(count + 1)
        world.ready(self.largest)
        base = base_motion.velocity_of(scene.excitation), base_motion.velocity_of(scene.vertical)
        speeds = np.transpose([base_motion.velocities_at(times, one) for one in base])
        # The mean of -u and of -(g + vg) over each step.
        felt = -np.diff(speeds, axis=0) / np.diff(times)[:, None] - np.array([0.0, scene.gravity])
        return partial(march_fixed, world, scene, times, felt)


@dataclass(frozen=True)
class AdaptiveStep:
    """Steps that end at the events and are at most `largest` s long.

    Steps at impacts and just after events are `short` times their usual length. With a `tolerance`,
    in units of alpha (rotation) and alpha R (place), no step has a larger error, as estimated.
    """

    largest: float = 5e-4
    short: float = 1.0
    tolerance: float | None = None
    knobs: ClassVar[tuple[str, ...]] = ("largest_step", "short_steps", "tolerance")

    @property
    def limiting(self) -> str:
        """The setting that limits the usual step."""
        return "largest_step" if self.usual == self.largest else "tolerance"

    @property
    def usual(self) -> float:
        """How long a step usually is, s; with a tolerance, in the rocking of a block of some m."""
        if self.tolerance is None:
            return self.largest
        return min(self.largest, FINE * (self.tolerance / FINE_TOLERANCE) ** (1.0 / 3.0))

    def coarser(self, factor: float) -> "AdaptiveStep":
        """Steps `factor` times as long: the error of one grows with the cube of its length."""
        tolerance = None if self.tolerance is None else factor**3 * self.tolerance
        return AdaptiveStep(factor * self.largest, factor * self.short, tolerance)

    @property
    def smooth(self) -> bool:
        """Whether the motion in a step is read off as the cubic that the step is known to be."""
        return self.tolerance is not None

    def ready(self, world: World, scene: Scene) -> Callable[[], Marched]:
        """The march of a world through a scene until |theta| = pi/2, to be called once.

        Its compiled step is loaded. The scene is one of a block with R = 1, see `in_units_of`. The
        march raises `ModelFailure` if the motion blows up or needs more than 100,000 + 20 end /
        `usual` steps, with those taken again, `end` the last of the scene's `run_times`.
        """
        from rockcheck.engines import adaptive_march, kernels
        from rockcheck.scenes.compiled import for_types_of

        course, run, request = adaptive_march.start(
            scene, self.largest, self.usual, self.short, self.tolerance
        )
        most_steps = 100_000 + 20 * int(course.end / self.usual)
        first = np.empty((ROOM, kernels.COLUMNS))
        first[0, :7] = 0.0, *run.states[0].motion
        step = for_types_of(kernels.step, run, course, (0.0, 0.0, 0.0), first[0])
        planned = kernels.plan(run, course)

        def march() -> Marched:
            rows, count, going, asked = first, 1, planned, 0
            while going:
                asked += 1
                x, y, theta, vx, vy, w, dt, ax, ay, impact = request.tolist()
                kicked = world.push((x, y, theta), (vx, vy, w), dt, (ax, ay), impact != 0.0)
                if count == len(rows):
                    rows = np.concatenate([rows, np.empty_like(rows)])
                going = step(run, course, kicked, rows[count])
                count += going != kernels.AGAIN
                if asked % 512 == 0:
                    progress.tell(rows[count - 1, 0], course.end)
                if going == kernels.LOST or asked > most_steps:
                    raise ModelFailure(
                        "no end to the events, or a motion that blew up, after"
                        f" {count} steps at t = {rows[count - 1, 0]:g} s"
                    )
            return rows[:count, 0].copy(), rows[:count, 1:7].copy(), rows[1:count, 7:].copy()

        return march
