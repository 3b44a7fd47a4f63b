"""Scenes with a known answer: how far a history is from it. Registered as figures whose perfect
value is 0."""

from __future__ import annotations

import math

import numpy as np

from rockcheck.scenes import Scene
from rockcheck.scenes.block import Pivot
from rockcheck.validation.discrepancy.measures import (
    FIGURES,
    Definition,
    Unavailable,
    WindowedHistory,
    register,
)


def closed_form(label: str, unit: str) -> Definition:
    """Register a function of a `WindowedHistory` as its distance from a closed form, computed where
    it is asked for."""
    return register(FIGURES, label, unit, ideal=0.0, on_request=True, exact=True)


@closed_form("error of sliding distance", "m")
def sliding_distance_error(motion: WindowedHistory) -> float:
    """|x at the end - x at the start| - v0^2/(2 mu g): a block that slides flat to a stop on a base
    at rest, m."""
    scene = _scene(motion)
    _need(
        scene.initial_velocity != 0.0 and not scene.walls and scene.initial_rotation == 0.0,
        "a block that starts sliding flat",
    )
    x = motion.channel("x")
    return abs(float(x[-1] - x[0])) - scene.initial_velocity**2 / (
        2.0 * scene.floor.friction * scene.gravity
    )


@closed_form("error of wall rebound", "m")
def wall_rebound_error(motion: WindowedHistory) -> float:
    """Place where a block that slides flat into a wall stops, less e^2 (v0^2 - 2 mu g gap)/(2 mu g)
    from the wall, m.

    Case III: it leaves the wall at e times the speed that friction has left it.
    """
    scene = _scene(motion)
    _need(
        len(scene.walls) == 1 and scene.initial_velocity != 0.0 and scene.initial_rotation == 0.0,
        "a block that slides flat into a wall",
    )
    wall = scene.walls[0]
    braking = 2.0 * scene.floor.friction * scene.gravity
    speed2 = scene.initial_velocity**2 - braking * wall.gap
    _need(speed2 > 0.0, "a block that reaches the wall")
    from_wall = wall.gap - abs(float(motion.channel("x")[-1]))
    return from_wall - wall.restitution**2 * speed2 / braking


@closed_form("error of bounce height", "m")
def bounce_height_error(motion: WindowedHistory) -> float:
    """Highest point after the first bounce, less e_g^2 h: a block that drops flat from h, m."""
    scene = _scene(motion)
    height, e = scene.initial_height, scene.floor.restitution
    _need(height > 0.0 and scene.initial_rotation == 0.0, "a block that drops flat")
    t = motion.channel("t")
    strikes = math.sqrt(2.0 * height / scene.gravity)
    lands = strikes * (1.0 + 2.0 * e)
    hop = motion.channel("y")[(t > strikes) & (t < lands)] - motion.block.half_height
    _need(len(hop) > 0, "rows after the first bounce")
    return float(np.max(hop)) - e**2 * height


@closed_form("error of quarter period", "s")
def quarter_period_error(motion: WindowedHistory) -> float:
    """Time of the first floor impact, less Housner's quarter period: a block released at theta_0
    that does not slip, s.

    T/4 = int_0^theta_0 d theta / sqrt(2 p^2 [cos(alpha - theta_0) - cos(alpha - theta)]), without
    his small angles, with p and alpha of the pivot on the side to which it is tilted.
    """
    from scipy.integrate import quad

    scene = _scene(motion)
    pivot = _released(motion)[0]
    tilt, alpha, p = (
        abs(scene.initial_rotation),
        pivot.alpha,
        pivot.frequency_parameter(scene.gravity),
    )

    def pace(
        root: float,
    ) -> float:  # theta = theta_0 - root^2 takes the singularity at the start away
        theta = tilt - root**2
        gap = (
            2.0 * math.sin(alpha - 0.5 * (tilt + theta)) * math.sin(0.5 * (tilt - theta))
        )  # cos(a - tilt) - cos(a - theta)
        return (
            2.0 * root / (p * math.sqrt(2.0 * gap))
            if root > 0.0
            else 2.0 / (p * math.sqrt(2.0 * math.sin(alpha - tilt)))
        )

    quarter = quad(pace, 0.0, math.sqrt(tilt), epsabs=1e-13, epsrel=1e-13)[0]
    impacts = motion.events("floor impact")
    _need(bool(impacts), "a floor impact")
    return impacts[0].t - quarter


@closed_form("error of impact ratio", "1")
def impact_ratio_error(motion: WindowedHistory) -> float:
    """Ratio of angular velocities over the first floor impact, less Housner's 1 - 1.5 sin^2 alpha,
    for a block released at rest.

    From the turning points before and after it, between which energy is kept: dtheta/dt at the
    impact is p sqrt(2 [cos(alpha - |theta|) - cos alpha]) with p and alpha of the pivot. A block
    that is not homogeneous keeps its angular momentum about the new pivot: 1 - a (a + a')/(I/m +
    R^2), where a is the new pivot's distance from the mass's centre along the floor and a' the old
    one's.
    """
    scene = _scene(motion)
    old, new = _released(motion)
    impacts = [event.t for event in motion.events("floor impact")]
    _need(len(impacts) >= 2, "two floor impacts")
    t, theta = motion.channel("t"), motion.channel("theta")
    swing = np.abs(theta[(t > impacts[0]) & (t < impacts[1])])
    _need(len(swing) > 0, "rows between the first two floor impacts")
    before, after = (
        pivot.frequency_parameter(scene.gravity)
        * math.sqrt(math.cos(pivot.alpha - tilt) - math.cos(pivot.alpha))
        for pivot, tilt in ((old, abs(scene.initial_rotation)), (new, float(np.max(swing))))
    )
    return after / before - (1.0 - new.share * new.arm * (new.arm + old.arm) / new.radius**2)


def _scene(motion: WindowedHistory) -> Scene:
    if (
        motion.scene is None
        or motion.scene.excitation.kind != "rest"
        or motion.scene.vertical.kind != "rest"
    ):
        raise Unavailable("closed forms need a known scene with a base at rest")
    return motion.scene


def _released(motion: WindowedHistory) -> tuple[Pivot, Pivot]:
    """The pivot on which a block released from a tilt rocks first, and the other one."""
    scene = _scene(motion)
    left, right = scene.block.pivot("left"), scene.block.pivot("right")
    old, new = (left, right) if scene.initial_rotation > 0.0 else (right, left)
    moving = (
        scene.initial_velocity != 0.0
        or scene.initial_angular_velocity != 0.0
        or scene.initial_height != 0.0
    )
    _need(
        0.0 < abs(scene.initial_rotation) < old.alpha and not moving and not scene.walls,
        "a block released at rest from a tilt",
    )
    return old, new


def _need(holds: bool, what: str) -> None:
    if not holds:
        raise Unavailable(f"{what} is needed")
