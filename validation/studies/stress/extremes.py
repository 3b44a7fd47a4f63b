"""The extremes of a run against its rows, other rows of the same run, and its mirror image.

In: `Motion` of a run of any model. Out: figures in natural units. Called by `checks` and `players`.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import fields
from typing import Any, get_args

import numpy as np

from rockcheck.scenes import Extremes, History, Scene, Side, WallExtremes, kinematics
from rockcheck.validation.studies.stress.motion import Motion

#: A run that is played again has rows this many times as far apart.
COARSER = 3.1
#: Fields of `Extremes` and of a wall that are times, speeds or pure numbers; all else is a length.
TIMES = ("rotation_left_s", "rotation_right_s", "first_uplift_s", "first_slip_s", "first_s")
SPEEDS = ("speed", "impulse")
NUMBERS = ("rotation_left", "rotation_right", "strikes")


def shown_by_rows(motion: Motion) -> dict[str, float]:
    """By field of `Extremes` the largest that the rows show, rad or m."""
    block, channels = motion.scene.block, motion.channels
    x, theta = channels["x"], channels["theta"]
    shown = {"slip": np.max(np.abs(channels["slip"]))}
    displaced = []
    for side in get_args(Side):
        sign = 1.0 if side == "left" else -1.0
        shown[f"rotation_{side}"] = np.max(sign * theta)
        places = kinematics.side_corners(block, side, 0.0, x, theta, x, theta)[:, 0]
        shown[f"reach_{side}"] = np.max(-places)
        displaced.append(np.max(np.abs(places[1] - places[1][0])))
    shown["top_displacement"] = max(displaced)
    shown["hop"] = np.max(kinematics.pivot_height(block, channels["y"], theta))
    return {name: max(0.0, float(value)) for name, value in shown.items()}


def beyond(motion: Motion) -> float:
    """How far a row is beyond the extremes, R or rad, of 1 and the extreme itself."""
    extremes, unit = motion.history.extremes, motion.radius
    far = float(np.max(np.abs(motion.channels["x"])))
    excess = [0.0]
    for name, shown in shown_by_rows(motion).items():
        size = 1.0 if name in NUMBERS else unit
        extreme = getattr(extremes, name)
        # Rounding of a place far away from the start is no excess.
        excess.append((shown - extreme) / (size + abs(extreme) + far))
    return max(excess)


def unseen(motion: Motion, play: Callable[[Scene], History]) -> float:
    """How far the extremes are beyond the rows, over the way between two of them at most.

    The rows have to be dense. A block that falls is looked at up to its last row.
    """
    scene, history = motion.scene, motion.history
    last = float(motion.channels["t"][-1])
    if history.overturned_at is not None:
        if last <= scene.output_step:
            return 0.0
        scene = scene.replace(duration=last)
        history = play(scene)
    until_then = Motion(scene, history)
    way = _way(until_then)
    shares = [0.0]
    for name, shown in shown_by_rows(until_then).items():
        size = 1.0 if name in NUMBERS else motion.radius
        shares.append((getattr(history.extremes, name) - shown) / size / way)
    return max(shares)


def _way(motion: Motion) -> float:
    """A bound on what a place (R) or the rotation may change by, and back, between two rows.

    An impact may turn all speed into rotation; a speed is gained by the base, weight and turning.
    """
    channels, step, block = (
        motion.channels,
        motion.scene.output_step / motion.unit,
        motion.scene.block,
    )
    moves = (np.abs(channels["x_dot"]) + np.abs(channels["y_dot"])) * motion.unit
    turns = block.half_diagonal * np.abs(motion.w)
    speed = np.max(moves + turns) / motion.radius
    felt = 1.0 + np.max(np.abs(motion.u)) + np.max(np.abs(motion.vertical)) + np.max(motion.w**2)
    spin = max(1.0, motion.radius**2 / block.gyration_squared)
    return float(spin * step * (speed + felt * step)) + 1e-9


def change_with_rows(motion: Motion, play: Callable[[Scene], History]) -> float:
    """Largest change of an extreme if the run has rows farther apart, natural units.

    Relative to 1 and the extreme itself; infinite where it is there in one of the runs only.
    """
    scene = motion.scene
    step = min(COARSER * scene.output_step, scene.duration)
    again = play(scene.replace(output_step=step)).extremes
    pairs = zip(_numbers(motion.history.extremes), _numbers(again), strict=True)
    return max(_change(motion, *one, other[1]) for one, other in pairs)


def _numbers(extremes: Extremes | WallExtremes) -> Iterator[tuple[str, float]]:
    """The extremes by the names of their fields, walls last; NaN where there is none."""
    for field in fields(extremes):
        value: Any = getattr(extremes, field.name)
        if field.name == "walls":
            for wall in value.values():
                yield from _numbers(wall)
        elif field.name != "source":
            yield field.name, math.nan if value is None else float(value)


def _change(motion: Motion, name: str, one: float, other: float) -> float:
    if math.isnan(one) and math.isnan(other):
        return 0.0
    if math.isnan(one) or math.isnan(other):
        return math.inf
    size = motion.radius
    if name in NUMBERS:
        size = 1.0
    elif name in TIMES:
        size = motion.unit
    elif name in SPEEDS:
        size = motion.radius / motion.unit
    return abs(one - other) / (size + abs(one))


def bits_of_mirror_image(one: Extremes, image: Extremes) -> int:
    """Number of extremes that differ in any bit from those of the mirror image."""
    return sum(
        value != mirrored and not (math.isnan(value) and math.isnan(mirrored))
        for (_, value), (_, mirrored) in zip(
            sorted(_by_side(one, {})), sorted(_by_side(image, _SWAPPED)), strict=True
        )
    )


#: Sides in the mirror image.
_SWAPPED = {"left": "right", "right": "left"}


def _by_side(extremes: Extremes, swapped: dict[str, str]) -> Iterator[tuple[str, float]]:
    """The extremes by names that have their sides, each side as it is or `swapped`."""
    sign = -1.0 if swapped else 1.0
    for name, value in _numbers(Extremes(**{**vars(extremes), "walls": {}})):
        words = [swapped.get(word, word) for word in name.split("_")]
        yield "_".join(words), sign * value if name == "last_slip" else value
    for side, wall in extremes.walls.items():
        for name, value in _numbers(wall):
            yield f"{swapped.get(side, side)} wall {name}", value
