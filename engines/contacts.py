"""Which corners of the block can touch which surface of a scene, and the kinematics of those contacts.

A state is x, y, theta, dx/dt, dy/dt, dtheta/dt (SI, relative to the base, counterclockwise positive).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from scenes import Scene


@dataclass(frozen=True, kw_only=True)
class Contact:
    """One corner of the block and one surface that it can touch."""

    surface: Literal["floor", "left", "right"]
    corner: tuple[float, float]  # from the centroid, in the block's own frame, m
    normal: tuple[float, float]  # out of the surface
    distance: float  # of the surface from the place of the upright centroid's foot, along -normal, m
    restitution: float

    def arm(self, theta: Any) -> tuple[Any, Any]:
        """From the centroid to the corner of the block turned by `theta`, m (right, up)."""
        (bx, bz), cos, sin = self.corner, np.cos(theta), np.sin(theta)
        return bx * cos - bz * sin, bx * sin + bz * cos

    def gap(self, state: Any) -> Any:
        """Clear distance in m between corner and surface for states of shape (..., 6); negative is a penetration."""
        rx, ry = self.arm(state[..., 2])
        return self.normal[0] * (state[..., 0] + rx) + self.normal[1] * (state[..., 1] + ry) + self.distance

    def normal_row(self, theta: Any) -> tuple[Any, Any, Any]:
        """J of the gap's rate J . (dx/dt, dy/dt, dtheta/dt)."""
        rx, ry = self.arm(theta)
        return self.normal[0], self.normal[1], self.normal[1] * rx - self.normal[0] * ry


def contacts_of(scene: Scene) -> tuple[Contact, ...]:
    """The contacts a scene can use: its lower corners on the floor and, where there is a wall, the corners of that side."""
    b, h = scene.block.half_width, scene.block.half_height
    found = [
        Contact(surface="floor", corner=(bx, -h), normal=(0.0, 1.0), distance=0.0, restitution=scene.floor.restitution) for bx in (-b, b)
    ]
    for wall in scene.walls:
        outward = -1.0 if wall.side == "left" else 1.0
        found += [
            Contact(
                surface=wall.side,
                corner=(outward * b, bz),
                normal=(-outward, 0.0),
                distance=b + wall.gap,
                restitution=wall.restitution,
            )
            for bz in (-h, h)
        ]
    return tuple(found)
