"""The block: a rigid box, homogeneous or with its mass's centre and its moment of inertia given;
its two pivots.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import (
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)

from rockcheck.scenes.base import Finite, Frozen, Positive
from rockcheck.scenes.errors import InputError

#: The moment of inertia may exceed what the box allows by this share, for rounding.
ROUNDING = 1e-12


@dataclass(frozen=True, kw_only=True)
class Pivot:
    """A lower corner as the pivot of rocking.

    Lengths in m, from the corner to the mass's centre.
    """

    #: Horizontal and vertical distance.
    arm: float
    height: float
    #: R^2/(R^2 + I/m): how much of a pendulum of length R the block is about this corner; 3/4 where
    #: it is homogeneous.
    share: float

    @property
    def alpha(self) -> float:
        """Slenderness angle of this side, rad: tilted by as much, the mass's centre stands above
        the corner.
        """
        return math.atan2(self.arm, self.height)

    @property
    def radius(self) -> float:
        """R, m."""
        return math.hypot(self.arm, self.height)

    def frequency_parameter(self, gravity: float) -> float:
        """P = sqrt(g R/(R^2 + I/m)) in rad/s under `gravity` in m/s^2; sqrt(3 g/(4 R)) where the
        block is homogeneous.
        """
        return math.sqrt(self.share * gravity / self.radius)


class Block(Frozen):
    """A rigid rectangular block 2B x 2H; lengths in m.

    It is homogeneous unless the last two fields say otherwise.

    `mass` (kg) is optional: motion does not depend on it, forces and impulses are given per unit
    mass. `centre_of_mass` is the place (x, z) of the mass's centre from the centre of the box as it
    stands, x to the right, z up. `moment_of_inertia` (kg m^2) is about the mass's centre and goes
    with `mass`; where no mass is given it is that of 1 kg. It may be left out: then it is that of
    the homogeneous block, m (B^2 + H^2)/3. Raises `InputError` for a centre outside the box, and
    for a moment of inertia that no mass inside the box can have: with that centre m (B^2 + H^2 -
    x^2 - z^2) is the most.

    A block whose centre lies to one side has two different pivots. `alpha`, `radius`, `slope` and
    `frequency_parameter` are those of the corner over which it falls most easily, the one nearer to
    its mass's centre; `pivot` gives either.
    """

    half_width: Positive
    half_height: Positive
    mass: Positive | None = None
    centre_of_mass: tuple[Finite, Finite] | None = None
    moment_of_inertia: Positive | None = None

    @field_validator("centre_of_mass")
    @classmethod
    def _off_centre(cls, centre: tuple[float, float] | None) -> tuple[float, float] | None:
        return None if centre == (0.0, 0.0) else centre

    @model_validator(mode="after")
    def _possible(self) -> Block:
        if self.homogeneous:
            return self
        (x, z), b, h = self.offset, self.half_width, self.half_height
        if not (abs(x) < b and abs(z) < h):
            raise InputError(
                f"({x:g}, {z:g}) is not allowed: must lie inside the box, x between -{b:g} and"
                f" {b:g} m and z between -{h:g} and {h:g} m",
                "centre_of_mass",
            )
        most = b * b + h * h - x * x - z * z
        if self.gyration_squared > most * (1.0 + ROUNDING):
            mass = 1.0 if self.mass is None else self.mass
            without = (
                " (no mass is given: it is taken as that of 1 kg)" if self.mass is None else ""
            )
            raise InputError(
                f"{self.gyration_squared * mass:g} is not allowed{without}: a mass inside the box"
                " with that centre has at most"
                f" {most * mass:g} kg m^2",
                "moment_of_inertia",
            )
        return self

    @model_serializer(mode="wrap")
    def _as_written(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """What is not given is left out: a homogeneous block is written, and known by its hash, as
        ever.
        """
        return {
            name: value
            for name, value in write(self).items()
            if value is not None or name == "mass"
        }

    @property
    def homogeneous(self) -> bool:
        """Whether neither a centre of mass nor a moment of inertia is given: the paper's block."""
        return self.centre_of_mass is None and self.moment_of_inertia is None

    @property
    def offset(self) -> tuple[float, float]:
        """Place of the mass's centre from the box's centre, m: to the right, up."""
        return self.centre_of_mass or (0.0, 0.0)

    @property
    def half_diagonal(self) -> float:
        """Distance of the corners from the box's centre, sqrt(B^2 + H^2), m: R of a homogeneous
        block.
        """
        return math.hypot(self.half_width, self.half_height)

    @property
    def box_angle(self) -> float:
        """atan(B/H), rad: alpha of a homogeneous block."""
        return math.atan2(self.half_width, self.half_height)

    @property
    def gyration_squared(self) -> float:
        """Moment of inertia about the mass's centre per unit mass, m^2."""
        if self.moment_of_inertia is None:
            return self.half_diagonal**2 / 3.0
        return self.moment_of_inertia / (1.0 if self.mass is None else self.mass)

    def pivot(self, side: Literal["left", "right"]) -> Pivot:
        """The lower corner on that side.

        A block that tilts to the left (theta > 0) rocks on the left one.
        """
        x, z = self.offset
        arm, height = self.half_width + (x if side == "left" else -x), self.half_height + z
        square = arm * arm + height * height
        share = 0.75 if self.homogeneous else square / (square + self.gyration_squared)
        return Pivot(arm=arm, height=height, share=share)

    @property
    def weaker_pivot(self) -> Pivot:
        """The pivot nearer to the mass's centre, over which the block falls most easily; the left
        one where neither is.
        """
        return self.pivot("right" if self.offset[0] > 0.0 else "left")

    @property
    def alpha(self) -> float:
        """Slenderness angle atan(B/H), rad; of the weaker pivot."""
        return self.weaker_pivot.alpha

    @property
    def slope(self) -> float:
        """Tan alpha: the base acceleration over g at which the block begins to rock, of the weaker
        pivot.
        """
        pivot = self.weaker_pivot
        return pivot.arm / pivot.height

    @property
    def radius(self) -> float:
        """Distance R of the pivot from the mass's centre, m: half the diagonal; of the weaker
        pivot.
        """
        return self.weaker_pivot.radius

    @property
    def frequency_parameter(self) -> float:
        """P = sqrt(3 g / (4 R)), rad/s, on Earth: g = 9.81 m/s^2.

        `Scene.frequency_parameter` has the scene's own gravity.
        """
        return self.weaker_pivot.frequency_parameter(9.81)

    @property
    def least_painleve_friction(self) -> float:
        """2 sqrt(j (1 + j)), j = I/(m R^2): with more friction a slipping pivot can jam (Painleve);
        4/3 where homogeneous.
        """
        if self.homogeneous:
            return 4.0 / 3.0
        j = self.gyration_squared / max(self.pivot("left").radius, self.pivot("right").radius) ** 2
        return 2.0 * math.sqrt(j * (1.0 + j))

    def mirrored(self) -> Block:
        """The same block with left and right exchanged."""
        x, z = self.offset
        return self if self.centre_of_mass is None else self.replace(centre_of_mass=(-x, z))

    def scaled(self, factor: float) -> Block:
        """The block with all lengths `factor` times as long, and the same mass."""
        inertia = self.moment_of_inertia
        return self.replace(
            half_width=self.half_width * factor,
            half_height=self.half_height * factor,
            centre_of_mass=None
            if self.centre_of_mass is None
            else (self.offset[0] * factor, self.offset[1] * factor),
            moment_of_inertia=None if inertia is None else inertia * factor * factor,
        )


#: The block of the paper: R = 1.605 m, alpha = 0.25 rad, p = 2.14 rad/s.
PAPER_BLOCK = Block(half_width=0.397, half_height=1.555)
