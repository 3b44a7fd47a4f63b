"""Geometry and energy of the block's state, the same for every model.

Arrays or scalars, SI units, per unit mass.

x and y locate the centre of the *box*: the corners do not depend on the centre of mass. Models that
need the centre of mass convert by `of_mass` and `of_box`; the two centres of a homogeneous block
are one.
"""

from functools import partial
from typing import Any

import numpy as np

from rockcheck.scenes.block import Block

#: Sign of each side in `clearance`: x is positive to the right.
OUTWARD = {"left": 1.0, "right": -1.0}


def slip(block: Block, x: Any, theta: Any) -> Any:
    """Distance of the pivot corner (the lower one) along the floor from its first place, m.

    A function of the state: x - S (R sin(alpha - |theta|) - B), continuous through theta = 0.
    """
    return x - np.sign(theta) * (
        block.half_diagonal * np.sin(block.box_angle - np.abs(theta)) - block.half_width
    )


def slip_rate(block: Block, theta: Any, x_dot: Any, theta_dot: Any) -> Any:
    """Horizontal velocity V = dx/dt + R cos(alpha - |theta|) dtheta/dt of the pivot corner, m/s."""
    return x_dot + block.half_diagonal * np.cos(block.box_angle - np.abs(theta)) * theta_dot


def pivot_height(block: Block, y: Any, theta: Any) -> Any:
    """Height of the lowest corner above the floor, m: positive is a hop, negative a penetration."""
    return y - block.half_diagonal * np.cos(block.box_angle - np.abs(theta))


def clearance(block: Block, side: str, gap: float, x: Any, theta: Any) -> Any:
    """Distance of the block from a vertical plane on `side`, m: negative is beyond.

    `gap` (m) is the distance of the plane from the upright block at x = 0.
    """
    reach = block.half_diagonal * np.sin(block.box_angle + np.abs(theta))
    return OUTWARD[side] * x + block.half_width + gap - reach


def side_corners(
    block: Block, side: str, gap: float, x: Any, theta: Any, x_dot: Any, theta_dot: Any
) -> Any:
    """Distances of the corners on `side` from its plane, m, and velocities toward it, m/s.

    Shape (2: bottom and top, 2, ...); the plane is that of `clearance`.
    """
    out, s, c = -OUTWARD[side], np.sin(theta), np.cos(theta)
    width, h = out * block.half_width, block.half_height
    return np.array(
        [
            [
                block.half_width + gap - out * (x + width * c - z * s),
                out * (x_dot - (width * s + z * c) * theta_dot),
            ]
            for z in (-h, h)
        ]
    )


def top_corners(block: Block, x: Any, theta: Any) -> Any:
    """Horizontal places of the two top corners (2, ...), m."""
    b, h = block.half_width, block.half_height
    return np.stack([x + d * np.cos(theta) - h * np.sin(theta) for d in (-b, b)])


def of_mass(block: Block, states: Any, sense: float = 1.0) -> Any:
    """States of the centre of mass, from the box's centre; (..., 6: x, y, theta and rates).

    With `sense` -1 the other way round.
    """
    if block.centre_of_mass is None:
        return states
    x, y, theta, x_dot, y_dot, w = np.moveaxis(np.asarray(states, dtype=float), -1, 0)
    (dx, dz), s, c = block.offset, np.sin(theta), np.cos(theta)
    right, up = sense * (dx * c - dz * s), sense * (dx * s + dz * c)
    return np.stack([x + right, y + up, theta, x_dot - w * up, y_dot + w * right, w], axis=-1)


#: States of the box's centre, from the centre of mass; (..., 6: x, y, theta and rates).
of_box = partial(of_mass, sense=-1.0)


def mass_motion(
    block: Block, y: Any, theta: Any, x_dot: Any, y_dot: Any, theta_dot: Any
) -> tuple[Any, Any, Any]:
    """Height and velocity (up; right, up) of the centre of mass, from the box's centre."""
    if block.centre_of_mass is None:
        return y, x_dot, y_dot
    state = np.stack(np.broadcast_arrays(0.0, y, theta, x_dot, y_dot, theta_dot), axis=-1)
    _, y, _, x_dot, y_dot, _ = np.moveaxis(of_mass(block, state), -1, 0)
    return y, x_dot, y_dot


def energy(
    block: Block, gravity: float, y: Any, theta: Any, x_dot: Any, y_dot: Any, theta_dot: Any
) -> Any:
    """Kinetic plus potential energy per unit mass in the base's frame, J/kg.

    Zero for the block standing still.
    """
    y, x_dot, y_dot = mass_motion(block, y, theta, x_dot, y_dot, theta_dot)
    kinetic = 0.5 * (x_dot**2 + y_dot**2 + block.gyration_squared * theta_dot**2)
    return kinetic + gravity * (y - block.weaker_pivot.height)
