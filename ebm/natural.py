"""Between a scene (SI) and the natural units of the compiled code: lengths in R, accelerations in g, times in sqrt(R/g)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.core.ground import GAUSSIAN, Ground, ground_of
from rockcheck.ebm.core.motion import LAWS, LEAST_FRICTION, Setting
from rockcheck.scenes.scene import Scene

__all__ = ["GAUSSIAN", "grounds_of", "setting_of", "state_of", "time_unit", "to_si"]


def time_unit(scene: Scene) -> float:
    """sqrt(R/g), s."""
    return math.sqrt(scene.block.radius / scene.gravity)


def setting_of(scene: Scene, *, unilateral: bool, no_slip: bool, energy_cap: bool, impacts: str = "moreau") -> Setting:
    """Block, floor and walls of a scene in natural units."""
    alpha, radius = scene.block.alpha, scene.block.radius
    left, right = scene.wall("left"), scene.wall("right")
    return Setting(
        alpha=alpha,
        sin_alpha=math.sin(alpha),
        cos_alpha=math.cos(alpha),
        sin_2alpha=math.sin(2.0 * alpha),
        cos_2alpha=math.cos(2.0 * alpha),
        mu_s=max(scene.floor.mu_s, LEAST_FRICTION),
        mu_k=scene.floor.friction,
        e_floor=scene.floor.restitution,
        gap_left=left.gap / radius if left else math.inf,
        gap_right=right.gap / radius if right else math.inf,
        e_left=left.restitution if left else 0.0,
        e_right=right.restitution if right else 0.0,
        walls=bool(scene.walls),
        no_slip=no_slip,
        unilateral=unilateral,
        energy_cap=energy_cap,
        law=LAWS.index(impacts),
    )


def grounds_of(scene: Scene) -> tuple[Ground, Ground]:
    """Horizontal and vertical ground motion in natural units."""
    unit = time_unit(scene)
    return ground_of(scene.excitation, scene.gravity, unit), ground_of(scene.vertical, scene.gravity, unit)


def state_of(scene: Scene) -> NDArray[np.float64]:
    """The initial state in natural units, on its contacts to the rounding of the compiled code."""
    radius, unit, alpha = scene.block.radius, time_unit(scene), scene.block.alpha
    x, y, theta, vx, vy, w = scene.initial_state
    state = np.array([x / radius, y / radius, theta, vx * unit / radius, vy * unit / radius, w * unit])
    if scene.initial_height == 0.0:
        state[1] = math.cos(alpha - abs(theta))
    if scene.initial_velocity == 0.0:
        state[3] = -math.cos(alpha - abs(theta)) * state[5]
    return state


def to_si(scene: Scene, states: NDArray[np.float64]) -> NDArray[np.float64]:
    """States (n x 6: x, y, theta and rates) from natural units to SI."""
    radius, unit = scene.block.radius, time_unit(scene)
    return states * np.array([radius, radius, 1.0, radius / unit, radius / unit, 1.0 / unit])
