"""The contacts of a scene, each a corner of the block and a surface, and their kinematics.

All functions take scalars or arrays, SI units, relative to the base, counterclockwise positive.
"""

import math
from dataclasses import dataclass
from typing import Any, Literal

from rockcheck.scenes import Block, Scene

Arm = tuple[Any, Any]
Point = tuple[float, float]


@dataclass(frozen=True, kw_only=True, slots=True)
class Surface:
    """The floor, or a wall: a half-plane that the block can touch."""

    surface: Literal["floor", "left", "right"]
    normal: Point  # out of the surface
    # from the surface to the point of the floor below the centre of the box as it stands, m
    distance: float
    friction: float
    restitution: float

    def behind(self, depth: float) -> Point:
        """The point `depth` m behind the surface, straight across from the foot of the block."""
        back = -(self.distance + depth)
        return back * self.normal[0], back * self.normal[1]

    def extent(self, thick: float, wide: float) -> tuple[float, float, float]:
        """Along x, y and z of a slab behind the surface, `thick` along its normal."""
        return thick if self.normal[0] else wide, wide, thick if self.normal[1] else wide


@dataclass(frozen=True, kw_only=True, slots=True)
class Contact(Surface):
    """One corner of the block and one surface that it can touch."""

    corner: Point  # from the mass's centre, in the block's own frame, m


def arm_of(bx: Any, bz: Any, cos: Any, sin: Any) -> Arm:
    """Vector from the centre of mass to the corner (bx, bz), right and up, m.

    `cos` and `sin` are those of the block's rotation theta.
    """
    return bx * cos - bz * sin, bx * sin + bz * cos


def gap_of(nx: Any, nz: Any, distance: Any, x: Any, y: Any, arm: Arm) -> Any:
    """Gap between a corner and a surface with normal (nx, nz), m; negative is a penetration."""
    return nx * (x + arm[0]) + nz * (y + arm[1]) + distance


def rate_of(nx: Any, nz: Any, x_dot: Any, y_dot: Any, theta_dot: Any, arm: Arm) -> Any:
    """The rate of the gap to a surface with the normal (nx, nz), m/s."""
    return nx * (x_dot - theta_dot * arm[1]) + nz * (y_dot + theta_dot * arm[0])


def surfaces_of(scene: Scene) -> tuple[Surface, ...]:
    """The floor and the walls of a scene; the walls are smooth."""
    floor, b = scene.floor, scene.block.half_width
    return (
        Surface(
            surface="floor",
            normal=(0.0, 1.0),
            distance=0.0,
            friction=floor.friction,
            restitution=floor.restitution,
        ),
        *(
            Surface(
                surface=wall.side,
                normal=(1.0 if wall.side == "left" else -1.0, 0.0),
                distance=b + wall.gap,
                friction=0.0,
                restitution=wall.restitution,
            )
            for wall in scene.walls
        ),
    )


def contacts_of(scene: Scene) -> tuple[Contact, ...]:
    """The contacts of a scene: lower corners with the floor, corners of a side with its wall."""
    b, h = scene.block.half_width, scene.block.half_height
    dx, dz = scene.block.offset
    return tuple(
        Contact(
            surface=face.surface,
            corner=(bx - dx, bz - dz),
            normal=face.normal,
            distance=face.distance,
            friction=face.friction,
            restitution=face.restitution,
        )
        for face in surfaces_of(scene)
        for bx in (-b, b)
        for bz in (-h, h)
        if bx * face.normal[0] + bz * face.normal[1] < 0.0
    )


def corners_of(scene: Scene) -> list[Point]:
    """The corners that can touch something, from the mass's centre, m."""
    return list(dict.fromkeys(contact.corner for contact in contacts_of(scene)))


def sweeps(block: Block, least: int) -> int:
    """How many sweeps over the contacts a solver needs that solves one after the other.

    Where both lower corners touch and friction holds, each sweep takes a share 3 alpha^2 off what
    is missing: of a slender block little. So many leave 2e-8 of it; of the most slender blocks
    (alpha below 0.025) more, in 10,000 sweeps.
    """
    return min(max(least, math.ceil(6.0 / block.alpha**2)), 10_000)


def rebounds(scene: Scene) -> bool:
    """Whether any contact of a scene has restitution."""
    return any(surface.restitution > 0.0 for surface in surfaces_of(scene))
