"""Geometry and energy of the block's state, the same for every model. Arrays or scalars, SI units, per unit mass."""

from __future__ import annotations

from typing import Any

import numpy as np

from rockcheck.scenes.scene import Block, Scene


def slip(block: Block, x: Any, theta: Any) -> Any:
    """How far the pivot corner (the lower one) stands from its first place along the floor, m.

    A function of the state: x - S (R sin(alpha - |theta|) - B), continuous through theta = 0.
    """
    return x - np.sign(theta) * (block.radius * np.sin(block.alpha - np.abs(theta)) - block.half_width)


def slip_rate(block: Block, theta: Any, x_dot: Any, theta_dot: Any) -> Any:
    """Horizontal velocity V = dx/dt + R cos(alpha - |theta|) dtheta/dt of the pivot corner, m/s."""
    return x_dot + block.radius * np.cos(block.alpha - np.abs(theta)) * theta_dot


def pivot_height(block: Block, y: Any, theta: Any) -> Any:
    """Height of the lowest corner above the floor, m: positive is a hop, negative a penetration."""
    return y - block.radius * np.cos(block.alpha - np.abs(theta))


def wall_gap(scene: Scene, side: str, x: Any, theta: Any) -> Any:
    """Clear distance between the block and the wall on `side`, m: negative is a penetration."""
    outward = 1.0 if side == "left" else -1.0
    wall = next(w for w in scene.walls if w.side == side)
    block = scene.block
    return outward * x + block.half_width + wall.gap - block.radius * np.sin(block.alpha + np.abs(theta))


def energy(block: Block, gravity: float, y: Any, x_dot: Any, y_dot: Any, theta_dot: Any) -> Any:
    """Kinetic plus potential energy per unit mass in the base's frame, zero for the block standing still, J/kg."""
    inertia = block.radius**2 / 3.0
    return 0.5 * (x_dot**2 + y_dot**2 + inertia * theta_dot**2) + gravity * (y - block.half_height)
