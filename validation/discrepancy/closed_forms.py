"""Distance of a history from a closed form: sliding, wall rebound, bounce, quarter period, impact.

In: a `WindowedHistory` with its scene. Out: a number for each of `FIGURES`, 0 where it is perfect;
`Unavailable` is raised for a scene that has no such closed form. `measures` lists them for
`describe`, which computes them on request.
"""

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import Pivot, Scene, interpolation, kinematics
from rockcheck.validation.criteria import quarter_period
from rockcheck.validation.discrepancy.figures import (
    NOT_DEFINED,
    Measure,
    Unavailable,
    WindowedHistory,
    by_name,
)


def _sliding_distance(motion: WindowedHistory) -> float:
    scene = _flat_start(motion, "a block that starts sliding flat", walls=0)
    _check_stopped(motion, scene, abs(scene.initial_velocity))
    x = motion.channel("x")
    return abs(float(x[-1] - x[0])) - scene.initial_velocity**2 / _braking(scene)


def _wall_rebound(motion: WindowedHistory) -> float:
    scene = _flat_start(motion, "a block that slides flat into a wall", walls=1)
    wall = scene.walls[0]
    outward = kinematics.OUTWARD[wall.side]
    speed_squared = scene.initial_velocity**2 - _braking(scene) * wall.gap
    moves_to_wall = outward * scene.initial_velocity < 0.0
    if not (moves_to_wall and speed_squared > 0.0):
        raise Unavailable("a block that reaches the wall is needed")
    speed_lost_in_wall = (1.0 - wall.restitution) * math.sqrt(speed_squared)
    _check_stopped(motion, scene, abs(scene.initial_velocity) - speed_lost_in_wall)
    from_wall = wall.gap + outward * float(motion.channel("x")[-1])
    return from_wall - wall.restitution**2 * speed_squared / _braking(scene)


def _bounce_height(motion: WindowedHistory) -> float:
    scene = _scene(motion)
    height, e = scene.initial_height, scene.floor.restitution
    tilts = scene.initial_rotation != 0.0 or scene.initial_angular_velocity != 0.0
    if height <= 0.0 or tilts:
        raise Unavailable("a block that drops flat is needed")
    t = motion.channel("t")
    first_bounce = math.sqrt(2.0 * height / scene.gravity)
    second_bounce = first_bounce * (1.0 + 2.0 * e)
    hop = (t > first_bounce) & (t < second_bounce)
    if not np.any(hop):
        raise Unavailable("rows after the first bounce are needed")
    hop_height = _largest(motion, "y", hop) - motion.block.half_height
    return hop_height - e**2 * height


def _quarter_period(motion: WindowedHistory) -> float:
    scene, pivot, _ = _released(motion)
    floor_impacts = motion.events("floor impact")
    if not floor_impacts:
        raise Unavailable("a floor impact is needed")
    release = abs(scene.initial_rotation)
    return floor_impacts[0].t - quarter_period(pivot, scene.gravity, release)


def _impact_ratio(motion: WindowedHistory) -> float:
    scene, old, new = _released(motion)
    floor_impacts = motion.events("floor impact")
    if len(floor_impacts) < 2:
        raise Unavailable("two floor impacts are needed")
    t = motion.channel("t")
    swing = (t > floor_impacts[0].t) & (t < floor_impacts[1].t)
    if not np.any(swing):
        raise Unavailable("rows between the first two floor impacts are needed")
    swing_peak = max(_largest(motion, "theta", swing), _largest(motion, "theta", swing, sense=-1.0))
    before = _impact_rate(old, scene.gravity, abs(scene.initial_rotation))
    after = _impact_rate(new, scene.gravity, swing_peak)
    housner = 1.0 - new.share * new.arm * (new.arm + old.arm) / new.radius**2
    return after / before - housner


def _impact_rate(pivot: Pivot, gravity: float, peak: float) -> float:
    """|dtheta/dt| over sqrt 2 at theta = 0 of a block that turns back at the rotation `peak`."""
    energy = math.cos(pivot.alpha - peak) - math.cos(pivot.alpha)
    return pivot.frequency_parameter(gravity) * math.sqrt(energy)


def _largest(
    motion: WindowedHistory, name: str, rows: NDArray[np.bool_], sense: float = 1.0
) -> float:
    """Largest value of a coordinate in these rows and between them, or of its negative."""
    coordinate = sense * motion.channel(name)[rows]
    rate = np.full(len(coordinate), math.nan)
    if interpolation.RATES[name] in motion.history.channels:
        rate = sense * motion.channel(interpolation.RATES[name])[rows]
    return interpolation.largest(motion.channel("t")[rows], coordinate, rate, np.empty(0))[0]


def _scene(motion: WindowedHistory) -> Scene:
    """The scene; raises `Unavailable` unless it is known and its base is at rest."""
    scene = motion.scene
    if scene is None or scene.excitation.kind != "rest" or scene.vertical.kind != "rest":
        raise Unavailable("closed forms need a known scene with a base at rest")
    return scene


def _flat_start(motion: WindowedHistory, description: str, *, walls: int) -> Scene:
    """The scene; raises `Unavailable` unless its block starts sliding flat with `walls` walls."""
    scene = _scene(motion)
    starts_flat = scene.initial_rotation == 0.0 and scene.initial_height == 0.0
    slides_only = scene.initial_velocity != 0.0 and scene.initial_angular_velocity == 0.0
    if not (starts_flat and slides_only and len(scene.walls) == walls):
        raise Unavailable(f"{description} is needed")
    return scene


def _braking(scene: Scene) -> float:
    """The loss of speed squared by friction on the way, m/s^2."""
    return 2.0 * scene.floor.friction * scene.gravity


def _check_stopped(motion: WindowedHistory, scene: Scene, speed: float) -> None:
    """Raises `Unavailable` if the window ends before friction has taken `speed` (m/s)."""
    taken = scene.floor.friction * scene.gravity * float(motion.channel("t")[-1])
    if motion.history.overturned_at is None and taken <= speed:
        raise Unavailable(f"{NOT_DEFINED}: the window ends before the block has stopped")


def _released(motion: WindowedHistory) -> tuple[Scene, Pivot, Pivot]:
    """The scene, the pivot on which its block, released from a tilt, rocks first, and the other."""
    scene = _scene(motion)
    old, new = scene.block.pivot("left"), scene.block.pivot("right")
    if scene.initial_rotation <= 0.0:
        old, new = new, old
    is_tilted = 0.0 < abs(scene.initial_rotation) < old.alpha
    at_rest = scene.initial_velocity == 0.0 and scene.initial_angular_velocity == 0.0
    if not (is_tilted and at_rest and scene.initial_height == 0.0 and not scene.walls):
        raise Unavailable("a block released at rest from a tilt is needed")
    return scene, old, new


_error = partial(Measure, on_request=True, exact=True)
FIGURES = by_name(
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
