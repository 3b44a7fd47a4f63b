"""Which corners of the block can touch which surface of a scene, and the kinematics of those
contacts.

All methods take scalars or arrays, SI units, relative to the base, counterclockwise positive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from rockcheck.scenes import Scene

Arm = tuple[Any, Any]


@dataclass(frozen=True, kw_only=True, slots=True)
class Contact:
    """One corner of the block and one surface that it can touch."""

    surface: Literal["floor", "left", "right"]
    corner: tuple[float, float]  # from the mass's centre, in the block's own frame, m
    normal: tuple[float, float]  # out of the surface
    # from the surface to the point of the floor below the centre of the box as it stands, m
    distance: float
    restitution: float

    def arm(self, cos: Any, sin: Any) -> Arm:
        """From the mass's centre to the corner of the block turned by theta, given its cosine and
        sine: right, up, m."""
        return arm_of(*self.corner, cos, sin)

    def gap(self, x: Any, y: Any, arm: Arm) -> Any:
        """Clear distance between corner and surface, m; negative is a penetration."""
        return gap_of(*self.normal, self.distance, x, y, arm)

    def rate(self, x_dot: Any, y_dot: Any, theta_dot: Any, arm: Arm) -> Any:
        """The gap's rate, m/s."""
        return rate_of(*self.normal, x_dot, y_dot, theta_dot, arm)


def arm_of(bx: Any, bz: Any, cos: Any, sin: Any) -> Arm:
    """`Contact.arm` of the corner (bx, bz)."""
    return bx * cos - bz * sin, bx * sin + bz * cos


def gap_of(nx: Any, nz: Any, distance: Any, x: Any, y: Any, arm: Arm) -> Any:
    """`Contact.gap` of a surface with the normal (nx, nz)."""
    return nx * (x + arm[0]) + nz * (y + arm[1]) + distance


def rate_of(nx: Any, nz: Any, x_dot: Any, y_dot: Any, theta_dot: Any, arm: Arm) -> Any:
    """`Contact.rate` of a surface with the normal (nx, nz)."""
    return nx * (x_dot - theta_dot * arm[1]) + nz * (y_dot + theta_dot * arm[0])


def acceleration_of(
    nx: Any, nz: Any, x_ddot: Any, y_ddot: Any, theta_ddot: Any, theta_dot: Any, arm: Arm
) -> Any:
    """The acceleration of the gap to a surface with the normal (nx, nz), m/s^2."""
    turning = theta_dot * theta_dot
    return nx * (x_ddot - theta_ddot * arm[1] - turning * arm[0]) + nz * (
        y_ddot + theta_ddot * arm[0] - turning * arm[1]
    )


def contacts_of(scene: Scene) -> tuple[Contact, ...]:
    """The contacts a scene can use: its lower corners on the floor and, where there is a wall, the
    corners of that side."""
    b, h = scene.block.half_width, scene.block.half_height
    dx, dz = scene.block.offset
    found = [
        Contact(
            surface="floor",
            corner=(bx - dx, -h - dz),
            normal=(0.0, 1.0),
            distance=0.0,
            restitution=scene.floor.restitution,
        )
        for bx in (-b, b)
    ]
    for wall in scene.walls:
        inward = 1.0 if wall.side == "left" else -1.0
        found += [
            Contact(
                surface=wall.side,
                corner=(-inward * b - dx, bz - dz),
                normal=(inward, 0.0),
                distance=b + wall.gap,
                restitution=wall.restitution,
            )
            for bz in (-h, h)
        ]
    return tuple(found)
