"""What an engine gives: one scene as it holds it, to be placed, stepped and looked at."""

from abc import ABC, abstractmethod

import numpy as np

from rockcheck.engines.base_motion import FloatArray

Vector = tuple[float, float, float]  # along x, y and theta
State = tuple[float, float, float, float, float, float]


class World(ABC):
    """One scene as an engine holds it: a block of unit mass that is free to move in its plane.

    A state is x, y, theta of the mass's centre and their rates, x = 0 where the centre of the box
    stands first; theta is counterclockwise positive.
    """

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
        """Before the first of steps of `dt` s: what is done here is no run time."""

    def velocity(self) -> Vector:
        """How fast the block is."""
        return self.state()[3:]

    def march(self, felt: FloatArray, dt: float) -> FloatArray:
        """States (n, 6) after each of n steps of `dt` s, with the `felt` accelerations (n, 2)."""
        states = np.empty((len(felt), 6))
        for row, (ax, ay) in enumerate(felt.tolist()):
            self.step((ax, ay), dt)
            states[row] = self.state()
        return states

    def bounce(self, bouncing: bool) -> None:  # noqa: B027 - asked of those alone whose steps can vary
        """Let contacts have their restitution, or none."""

    def push(
        self, pose: Vector, velocity: Vector, dt: float, felt: tuple[float, float], bouncing: bool
    ) -> Vector:
        """The engine as a map of velocities, for adaptive steps: `engines.steps.Push`."""
        self.bounce(bouncing)
        self.place(*pose, *velocity)
        self.step(felt, dt)
        return self.velocity()

    def close(self) -> None:  # noqa: B027 - most engines hold nothing
        """Give back what the engine holds."""
