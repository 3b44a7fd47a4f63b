"""The extremes of a run of the Continuous Model, noted at the middle of each of its steps.

There position Verlet has the block's place to second order. A contact that closes tells the speed
with which its corner arrives.
"""

import math
from collections.abc import Sequence

import numpy as np

from rockcheck.scenes import (
    Extremes,
    Floats,
    History,
    Scene,
    Side,
    WallExtremes,
    interpolation,
    kinematics,
)
from rockcheck.scenes.compiled import inner_kernel
from rockcheck.scenes.extremes import NO_STRIKE

#: Offsets (x, y) of the corners from the mass's centre: bottom left, bottom right, top left, top
#: right.
Corners = tuple[float, float, float, float, float, float, float, float]
#: Indices of what is noted: largest rotation to each side and its time, slip, reach to each side,
#: displacement of the top, hop; first uplift and slip; whether it stood flat, and stuck, a step
#: ago; first places of the top corners; half the width of the block.
NOTED = 16
LEFT, LEFT_TIME, RIGHT, RIGHT_TIME, SLIP, REACH_LEFT, REACH_RIGHT, TOP, HOP = range(9)
UPLIFT_TIME, SLIP_TIME, FLAT, STICKS, TOP_LEFT, TOP_RIGHT, HALF_WIDTH = range(9, NOTED)
#: |theta| (rad), its rate (rad/s) and slip rate (m/s) below which a block stands flat, and sticks.
FLAT_SHARE = interpolation.FLAT
TURNING, SLIPPING = interpolation.TURNING, interpolation.SLIPPING


def noted_at_start(scene: Scene) -> Floats:
    """What is noted before the first step."""
    x, _, tilt, _, _, spin = scene.initial_state
    b, h = scene.block.half_width, scene.block.half_height
    noted = np.zeros(NOTED)
    noted[[UPLIFT_TIME, SLIP_TIME]] = math.nan
    noted[FLAT] = abs(tilt) < FLAT_SHARE * scene.block.alpha and abs(spin) < TURNING
    noted[STICKS] = abs(scene.initial_velocity) < SLIPPING
    noted[TOP_LEFT] = x - b * math.cos(tilt) - h * math.sin(tilt)
    noted[TOP_RIGHT] = x + b * math.cos(tilt) - h * math.sin(tilt)
    noted[HALF_WIDTH] = b
    return noted


@inner_kernel
def note_place(noted: Floats, x: float, y: float, theta: float, t: float, corners: Corners) -> None:
    """Notes where the block is in a step."""
    if theta > noted[LEFT]:
        noted[LEFT], noted[LEFT_TIME] = theta, t
    elif -theta > noted[RIGHT]:
        noted[RIGHT], noted[RIGHT_TIME] = -theta, t
    half = noted[HALF_WIDTH]
    left, right = x + min(corners[0], corners[4]), x + max(corners[2], corners[6])
    noted[REACH_LEFT] = max(noted[REACH_LEFT], -left - half)
    noted[REACH_RIGHT] = max(noted[REACH_RIGHT], right - half)
    moved = max(
        abs(x + corners[4] - noted[TOP_LEFT]),
        abs(x + corners[6] - noted[TOP_RIGHT]),
    )
    noted[TOP] = max(noted[TOP], moved)
    if corners[1] < corners[3]:
        lowest, slip = y + corners[1], x + corners[0] + half
    else:
        lowest, slip = y + corners[3], x + corners[2] - half
    noted[HOP] = max(noted[HOP], lowest)
    noted[SLIP] = max(noted[SLIP], abs(slip))


@inner_kernel
def note_mode(
    noted: Floats, theta: float, theta_dot: float, slip_rate: float, t: float, flat_angle: float
) -> None:
    """Notes when the block first leaves the floor's plane, and first slips."""
    flat = abs(theta) < flat_angle and abs(theta_dot) < TURNING
    if noted[FLAT] != 0.0 and not flat and math.isnan(noted[UPLIFT_TIME]):
        noted[UPLIFT_TIME] = t
    sticks = abs(slip_rate) < SLIPPING
    if noted[STICKS] != 0.0 and not sticks and math.isnan(noted[SLIP_TIME]):
        noted[SLIP_TIME] = t
    noted[FLAT], noted[STICKS] = 1.0 if flat else 0.0, 1.0 if sticks else 0.0


def extremes_of(
    scene: Scene,
    noted: Floats,
    last: Floats,
    history: History,
    strikes: Sequence[tuple[Side, float, float, float]],
) -> Extremes:
    """The extremes of a run whose box's centre ended in the state `last`.

    `strikes` are those of walls, in order of time: side, time (s), impulse and speed of approach
    (m/s).
    """
    walls = dict.fromkeys((wall.side for wall in scene.walls), NO_STRIKE)
    for side, t, impulse, speed in strikes:
        before = walls[side]
        walls[side] = WallExtremes(
            strikes=before.strikes + 1,
            first_s=t if before.first_s is None else before.first_s,
            speed=max(before.speed, speed),
            impulse=max(before.impulse, impulse),
        )
    left, left_time, right, right_time, slip, reach_left, reach_right, top, hop = noted[:9].tolist()
    uplift_time, slip_time = noted[[UPLIFT_TIME, SLIP_TIME]].tolist()
    fall = history.overturned_at
    if history.outcome == "overturned left":
        left, left_time = 0.5 * math.pi, fall
    if history.outcome == "overturned right":
        right, right_time = 0.5 * math.pi, fall
    return Extremes(
        rotation_left=left,
        rotation_left_s=left_time,
        rotation_right=right,
        rotation_right_s=right_time,
        slip=slip,
        last_slip=float(kinematics.slip(scene.block, last[0], last[2])),
        reach_left=reach_left,
        reach_right=reach_right,
        top_displacement=top,
        hop=hop,
        walls=walls,
        first_uplift_s=None if math.isnan(uplift_time) else uplift_time,
        first_slip_s=None if math.isnan(slip_time) else slip_time,
        source="model",
    )
