"""Scenes with a known answer: how far a history is from it. Figures whose perfect value is 0,
computed where they are asked for. Adds them to the book of figures."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from rockcheck.scenes import Scene
from rockcheck.scenes.block import Pivot
from rockcheck.validation.discrepancy.measures import (
    FIGURES,
    Measure,
    Unavailable,
    WindowedHistory,
    by_name,
)


def _sliding_distance(motion: WindowedHistory) -> float:
    scene = _flat_start(motion, "a block that starts sliding flat", walls=0)
    x = motion.channel("x")
    return abs(float(x[-1] - x[0])) - scene.initial_velocity**2 / _braking(scene)


def _wall_rebound(motion: WindowedHistory) -> float:
    scene = _flat_start(motion, "a block that slides flat into a wall", walls=1)
    wall = scene.walls[0]
    speed2 = scene.initial_velocity**2 - _braking(scene) * wall.gap
    _need(speed2 > 0.0, "a block that reaches the wall")
    from_wall = wall.gap - abs(float(motion.channel("x")[-1]))
    return from_wall - wall.restitution**2 * speed2 / _braking(scene)


def _bounce_height(motion: WindowedHistory) -> float:
    scene = _scene(motion)
    height, e = scene.initial_height, scene.floor.restitution
    _need(height > 0.0 and scene.initial_rotation == 0.0, "a block that drops flat")
    t = motion.channel("t")
    strikes = math.sqrt(2.0 * height / scene.gravity)
    lands = strikes * (1.0 + 2.0 * e)
    hop = motion.channel("y")[(t > strikes) & (t < lands)] - motion.block.half_height
    _need(len(hop) > 0, "rows after the first bounce")
    return float(np.max(hop)) - e**2 * height


def _quarter_period(motion: WindowedHistory) -> float:
    from scipy.integrate import quad

    scene = _scene(motion)
    pivot = _released(motion)[0]
    tilt, alpha = abs(scene.initial_rotation), pivot.alpha
    p = pivot.frequency_parameter(scene.gravity)

    def pace(root: float) -> float:
        # theta = theta_0 - root^2 takes the singularity at the start away.
        theta = tilt - root**2
        if root <= 0.0:
            return 2.0 / (p * math.sqrt(2.0 * math.sin(alpha - tilt)))
        # cos(alpha - theta_0) - cos(alpha - theta)
        gap = 2.0 * math.sin(alpha - 0.5 * (tilt + theta)) * math.sin(0.5 * (tilt - theta))
        return 2.0 * root / (p * math.sqrt(2.0 * gap))

    quarter = quad(pace, 0.0, math.sqrt(tilt), epsabs=1e-13, epsrel=1e-13)[0]
    impacts = motion.events("floor impact")
    _need(bool(impacts), "a floor impact")
    return impacts[0].t - quarter


def _impact_ratio(motion: WindowedHistory) -> float:
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
    if motion.scene is None or {motion.scene.excitation.kind, motion.scene.vertical.kind} != {
        "rest"
    }:
        raise Unavailable("closed forms need a known scene with a base at rest")
    return motion.scene


def _flat_start(motion: WindowedHistory, what: str, *, walls: int) -> Scene:
    """The scene of `what`, which slides flat from the start on."""
    scene = _scene(motion)
    slides = scene.initial_velocity != 0.0 and scene.initial_rotation == 0.0
    _need(slides and len(scene.walls) == walls, what)
    return scene


def _braking(scene: Scene) -> float:
    """Loss of speed squared by friction on the way, m/s^2."""
    return 2.0 * scene.floor.friction * scene.gravity


def _released(motion: WindowedHistory) -> tuple[Pivot, Pivot]:
    """The pivot on which a block released from a tilt rocks first, and the other one."""
    scene = _scene(motion)
    left, right = scene.block.pivot("left"), scene.block.pivot("right")
    old, new = (left, right) if scene.initial_rotation > 0.0 else (right, left)
    moving = scene.initial_velocity, scene.initial_angular_velocity, scene.initial_height
    _need(
        0.0 < abs(scene.initial_rotation) < old.alpha and not any(moving) and not scene.walls,
        "a block released at rest from a tilt",
    )
    return old, new


def _need(holds: bool, what: str) -> None:
    if not holds:
        raise Unavailable(f"{what} is needed")


_error = partial(Measure, on_request=True, exact=True)
FIGURES |= by_name(
    _error(
        "sliding_distance_error",
        "error of sliding distance",
        "m",
        "|x at the end - x at the start| - v0^2/(2 mu g): a block that slides flat to a stop on a"
        " base at rest, m.",
        _sliding_distance,
    ),
    _error(
        "wall_rebound_error",
        "error of wall rebound",
        "m",
        "Place where a block that slides flat into a wall stops, less e^2 (v0^2 - 2 mu g gap)/(2 mu"
        " g) from the wall, m.\n\nCase III: it leaves the wall at e times the speed that friction"
        " has left it.",
        _wall_rebound,
    ),
    _error(
        "bounce_height_error",
        "error of bounce height",
        "m",
        "Highest point after the first bounce, less e_g^2 h: a block that drops flat from h, m.",
        _bounce_height,
    ),
    _error(
        "quarter_period_error",
        "error of quarter period",
        "s",
        "Time of the first floor impact, less Housner's quarter period: a block released at theta_0"
        " that does not slip, s.\n\nT/4 = int_0^theta_0 d theta / sqrt(2 p^2 [cos(alpha - theta_0)"
        " - cos(alpha - theta)]), without his small angles, with p and alpha of the pivot on the"
        " side to which it is tilted.",
        _quarter_period,
    ),
    _error(
        "impact_ratio_error",
        "error of impact ratio",
        "1",
        "Ratio of angular velocities over the first floor impact, less Housner's 1 - 1.5 sin^2"
        " alpha, for a block released at rest.\n\nFrom the turning points before and after it,"
        " between which energy is kept: dtheta/dt at the impact is p sqrt(2 [cos(alpha - |theta|) -"
        " cos alpha]) with p and alpha of the pivot. A block that is not homogeneous keeps its"
        " angular momentum about the new pivot: 1 - a (a + a')/(I/m + R^2), where a is the new"
        " pivot's distance from the mass's centre along the floor and a' the old one's.",
        _impact_ratio,
    ),
)
