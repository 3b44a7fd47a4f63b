"""A scene: a rigid block on a shaking floor, perhaps beside walls.

It knows nothing of the models that play it.
"""

import math
from typing import Annotated, Self

import numpy as np
from pydantic import AfterValidator, Field, StringConstraints, model_validator

from rockcheck.scenes import kinematics
from rockcheck.scenes.base import Finite, Floats, Frozen, NonNegative, Positive, Restitution, Shown
from rockcheck.scenes.block import PAPER_BLOCK, Block, Side
from rockcheck.scenes.errors import InputError
from rockcheck.scenes.excitations import Excitation, Rest

__all__ = ["PAPER_BLOCK", "Block", "Floor", "Scene", "Wall"]

MOST_SAMPLES = 5_000_000
#: At mu = 4/3 the pivot of a homogeneous block can jam while it slips (Painleve); physics beyond it
#: is not unique.
PAINLEVE_FRICTION = 4.0 / 3.0
#: Any acceleration of the base moves a block on ice: of less than this part of g, it is left out.
LEAST_MOVING = 0.01


class Floor(Frozen):
    """The floor's Coulomb friction and restitution.

    `friction` is the kinetic coefficient; `static_friction` None means the same. `restitution` is
    the normal one, e_g. Beyond `Scene.friction_limit` engines alone play it.
    """

    friction: NonNegative
    static_friction: NonNegative | None = None
    restitution: Restitution = 0.0

    @model_validator(mode="after")
    def _coulomb(self) -> Self:
        if self.mu_s < self.friction:
            raise InputError(
                f"{self.mu_s:g} is not allowed: must be at least the kinetic friction"
                f" {self.friction:g}",
                "static_friction",
            )
        return self

    @property
    def mu_s(self) -> float:
        """Static friction coefficient."""
        return self.friction if self.static_friction is None else self.static_friction


class Wall(Frozen):
    """A rigid frictionless wall.

    `gap` is the clear distance in m to the side of the upright block, `restitution` is e.
    """

    side: Side
    gap: NonNegative
    restitution: Restitution = 0.0


class Scene(Shown, Frozen):
    """All that a model needs to know; SI units, angles in rad, counterclockwise positive.

    The box stands with its centre above x = 0 unless it starts tilted: `initial_rotation` tilts it
    about the corner it would rock on, which keeps its place. `initial_angular_velocity` (rad/s) and
    `initial_velocity` (m/s, the slip rate of that corner) complete its state (see `initial_state`);
    `initial_height` (m) lifts it off the floor. `duration` counts from the excitation's start.
    `gravity` in m/s^2.
    """

    name: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _.,+=()-]{0,99}$")]
    block: Block
    floor: Floor
    walls: Annotated[
        tuple[Wall, ...],
        AfterValidator(lambda walls: tuple(sorted(walls, key=lambda wall: wall.side))),
    ] = ()
    excitation: Excitation = Rest()
    vertical: Excitation = Rest()
    duration: Positive
    output_step: Positive = 0.005
    initial_rotation: Annotated[Finite, Field(gt=-math.pi / 2, lt=math.pi / 2)] = 0.0
    initial_angular_velocity: Finite = 0.0
    initial_velocity: Finite = 0.0
    initial_height: NonNegative = 0.0
    gravity: Positive = 9.81
    description: Annotated[str, StringConstraints(max_length=500)] = ""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        x, _, tilt, *_ = self.initial_state
        clear = {
            wall.side: kinematics.clearance(self.block, wall.side, wall.gap, x, tilt)
            for wall in self.walls
        }
        if len(clear) < len(self.walls):
            raise InputError(
                "two walls on one side; at most one wall on the left and one on the right are"
                " allowed",
                "walls",
            )
        if self.duration / self.output_step > MOST_SAMPLES:
            raise InputError(
                f"{self.output_step:g} s gives more than {MOST_SAMPLES} samples in"
                f" {self.duration:g} s",
                "output_step",
            )
        for side, gap in clear.items():
            if gap < -1e-12 * self.block.half_diagonal:
                raise InputError(
                    f"{tilt:g} is not allowed: the block would start {-gap:.3g} m inside the"
                    f" {side} wall",
                    "initial_rotation",
                )
        return self

    def wall(self, side: Side) -> Wall | None:
        """The wall on that side, or None."""
        return next((wall for wall in self.walls if wall.side == side), None)

    @property
    def friction_limit(self) -> float:
        """Friction from which on a slipping pivot of this block may jam (Painleve); at most 4/3."""
        return min(PAINLEVE_FRICTION, self.block.least_painleve_friction)

    def check_friction(self, model: str) -> None:
        """Raise `InputError` where the friction reaches `friction_limit`: `model` is not for it.

        The motion is then not unique for them; engines play such a scene in their own way.
        """
        if self.floor.mu_s < self.friction_limit:
            return
        limit = self.friction_limit
        words = "4/3" if limit == PAINLEVE_FRICTION else f"{limit:.4g}"
        raise InputError(
            f"{self.floor.mu_s:g} is not allowed for {model}: must be below {words}, where a"
            " slipping pivot of this block may jam (Painleve); physics engines play it",
            "floor.friction" if self.floor.static_friction is None else "floor.static_friction",
        )

    @property
    def frequency_parameter(self) -> float:
        """Frequency parameter p of the weaker pivot with this scene's gravity, rad/s.

        p = sqrt(3 g/(4 R)) of a homogeneous block.
        """
        return self.block.weaker_pivot.frequency_parameter(self.gravity)

    @property
    def moving_acceleration(self) -> float:
        """Least horizontal base acceleration (m/s^2) that moves a block at rest.

        It uplifts above g tan(alpha) or slides above mu_s g; on ice `LEAST_MOVING` stands for it.
        """
        return self.gravity * max(min(self.block.slope, self.floor.mu_s), LEAST_MOVING)

    @property
    def output_times(self) -> Floats:
        """The output grid: multiples of `output_step` from 0 up to `duration`, s."""
        return self.output_step * np.arange(
            math.floor(self.duration / self.output_step * (1.0 + 1e-12)) + 1, dtype=np.float64
        )

    @property
    def run_times(self) -> Floats:
        """The output grid and, where it ends earlier, the duration: a run goes to the last, s."""
        grid = self.output_times
        return np.append(grid, self.duration) if grid[-1] < self.duration * (1.0 - 1e-12) else grid

    @property
    def initial_state(self) -> tuple[float, float, float, float, float, float]:
        """x, y, theta of the box's centre and their rates at t = 0 (SI, relative to the base).

        The block turns about the lower corner.
        """
        tilt, spin, block = self.initial_rotation, self.initial_angular_velocity, self.block
        radius, alpha = block.half_diagonal, block.box_angle
        pivot = math.copysign(1.0, tilt if tilt != 0.0 else spin)
        s, c = math.sin(alpha - abs(tilt)), math.cos(alpha - abs(tilt))
        x = pivot * (radius * s - block.half_width) if tilt != 0.0 else 0.0
        y = self.initial_height + (radius * c if tilt != 0.0 else block.half_height)
        return (
            x,
            y,
            tilt,
            self.initial_velocity - radius * c * spin,
            pivot * radius * s * spin,
            spin,
        )

    def mirrored(self) -> Self:
        """The same scene with left and right exchanged."""
        swap: dict[str, Side] = {"left": "right", "right": "left"}
        return self.replace(
            block=self.block.mirrored(),
            walls=tuple(wall.replace(side=swap[wall.side]) for wall in self.walls),
            excitation=self.excitation.scaled(-1.0),
            initial_rotation=-self.initial_rotation,
            initial_angular_velocity=-self.initial_angular_velocity,
            initial_velocity=-self.initial_velocity,
        )
