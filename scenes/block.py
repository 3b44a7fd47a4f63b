"""The block: a rigid box with two pivots, homogeneous or with given mass properties.

Mass properties are the centre of mass and the moment of inertia.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from rockcheck.scenes.base import Finite, Frozen, Positive
from rockcheck.scenes.errors import InputError

Side = Literal["left", "right"]

#: Relative excess of the moment of inertia over its bound that is put down to rounding.
ROUNDING = 1e-12


@dataclass(frozen=True, kw_only=True)
class Pivot:
    """A lower corner as the pivot of rocking.

    Lengths in m, from the corner to the centre of mass.
    """

    #: Horizontal and vertical distance.
    arm: float
    height: float
    #: R^2/(R^2 + I/m), the factor of g/R in p^2; 3/4 of a homogeneous block.
    share: float

    @property
    def alpha(self) -> float:
        """Slenderness angle of this side, rad.

        Tilted by this angle, the block has its centre of mass right above the corner.
        """
        return math.atan2(self.arm, self.height)

    @property
    def radius(self) -> float:
        """Distance R from the corner to the centre of mass, m."""
        return math.hypot(self.arm, self.height)

    def frequency_parameter(self, gravity: float) -> float:
        """Frequency parameter p in rad/s under `gravity` in m/s^2.

        p = sqrt(g R/(R^2 + I/m)); sqrt(3 g/(4 R)) of a homogeneous block.
        """
        return math.sqrt(self.share * gravity / self.radius)


class Block(Frozen):
    """A rigid rectangular block 2B x 2H; lengths in m.

    It is homogeneous unless `centre_of_mass` or `moment_of_inertia` is given.

    `mass` (kg) is optional: motion does not depend on it, forces and impulses are given per unit
    mass. `centre_of_mass` is its position (x, z) relative to the centre of the upright box, x to
    the right, z up. `moment_of_inertia` (kg m^2) is about the centre of mass and belongs to `mass`,
    or to 1 kg where no mass is given. Its default is the homogeneous block's, m (B^2 + H^2)/3.
    Raises `InputError` for a centre of mass outside the box, and for a moment of inertia that no
    mass inside the box can have: the largest is m (B^2 + H^2 - x^2 - z^2).

    If x is not 0, the two pivots differ. `alpha`, `radius`, `slope` and `frequency_parameter`
    belong to the weaker pivot: the corner nearer to the centre of mass, over which the block falls
    most easily. `pivot` gives either.
    """

    half_width: Positive
    half_height: Positive
    mass: Positive | None = None
    centre_of_mass: Annotated[
        tuple[Finite, Finite] | None,
        AfterValidator(lambda centre: None if centre == (0.0, 0.0) else centre),
    ] = None
    moment_of_inertia: Positive | None = None

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.homogeneous:
            return self
        (x, z), b, h = self.offset, self.half_width, self.half_height
        most, mass = b * b + h * h - x * x - z * z, self.mass or 1.0
        without = " (no mass is given: it is taken as that of 1 kg)" if self.mass is None else ""
        if not (abs(x) < b and abs(z) < h):
            raise InputError(
                f"({x:g}, {z:g}) is not allowed: must lie inside the box, x between -{b:g} and"
                f" {b:g} m and z between -{h:g} and {h:g} m",
                "centre_of_mass",
            )
        if self.gyration_squared > most * (1.0 + ROUNDING):
            raise InputError(
                f"{self.gyration_squared * mass:g} is not allowed{without}: a mass inside the box"
                f" with that centre has at most {most * mass:g} kg m^2",
                "moment_of_inertia",
            )
        return self

    @model_serializer(mode="wrap")
    def _as_written(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Serialised fields; None is left out, except for `mass`.

        So a homogeneous block's text and hash do not depend on the optional mass properties.
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
        """Centre of mass relative to the centre of the box (to the right, up), m."""
        return self.centre_of_mass or (0.0, 0.0)

    @property
    def half_diagonal(self) -> float:
        """Half the diagonal of the box, sqrt(B^2 + H^2), m: R of a homogeneous block."""
        return math.hypot(self.half_width, self.half_height)

    @property
    def box_angle(self) -> float:
        """atan(B/H), rad: alpha of a homogeneous block."""
        return math.atan2(self.half_width, self.half_height)

    @property
    def gyration_squared(self) -> float:
        """Moment of inertia about the centre of mass per unit mass, m^2."""
        moment = self.moment_of_inertia
        return self.half_diagonal**2 / 3.0 if moment is None else moment / (self.mass or 1.0)

    def pivot(self, side: Side) -> Pivot:
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
        """The pivot nearer to the centre of mass, over which the block falls most easily.

        The left one if both are at the same distance.
        """
        return self.pivot("right" if self.offset[0] > 0.0 else "left")

    @property
    def alpha(self) -> float:
        """Slenderness angle of the weaker pivot, rad; atan(B/H) of a homogeneous block."""
        return self.weaker_pivot.alpha

    @property
    def slope(self) -> float:
        """Base acceleration over g at which rocking begins: tan alpha of the weaker pivot."""
        return self.weaker_pivot.arm / self.weaker_pivot.height

    @property
    def radius(self) -> float:
        """Distance R from the weaker pivot to the centre of mass, m.

        Half the diagonal of a homogeneous block.
        """
        return self.weaker_pivot.radius

    @property
    def frequency_parameter(self) -> float:
        """Frequency parameter p of the weaker pivot on Earth, g = 9.81 m/s^2, rad/s.

        p = sqrt(3 g/(4 R)) of a homogeneous block. `Scene.frequency_parameter` uses the scene's
        gravity.
        """
        return self.weaker_pivot.frequency_parameter(9.81)

    @property
    def least_painleve_friction(self) -> float:
        """Friction coefficient above which a slipping pivot can jam (Painleve).

        2 sqrt(j (1 + j)) with j = I/(m R^2) and the larger R of both pivots; 4/3 of a homogeneous
        block.
        """
        if self.homogeneous:
            return 4.0 / 3.0
        j = self.gyration_squared / max(self.pivot("left").radius, self.pivot("right").radius) ** 2
        return 2.0 * math.sqrt(j * (1.0 + j))

    @property
    def per_unit_mass(self) -> Self:
        """The same block without its mass; the moment of inertia is per unit mass, m^2."""
        return self.replace(
            mass=None, moment_of_inertia=self.moment_of_inertia and self.gyration_squared
        )

    def mirrored(self) -> Self:
        """The same block with left and right exchanged."""
        x, z = self.offset
        return self if self.centre_of_mass is None else self.replace(centre_of_mass=(-x, z))

    def scaled(self, factor: float) -> Self:
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
