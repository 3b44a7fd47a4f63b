"""The extremes of a run, noted at the middle of each of its steps.

In: where the block is in a step, how it moves; at the end the strikes of walls.
Out: EXTREMES, the record of what is noted; the `Extremes` of a history.
Called by `cm.start` and `cm.integrate` (noting) and `cm.model` (the end).

At the middle of a step position Verlet has the block's place to second order. A contact that closes
tells the speed with which its corner arrives.
"""

import math
from collections.abc import Sequence

import numpy as np

from rockcheck.cm.geometry import Corners
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
from rockcheck.scenes.named_record import filled, record

#: What is noted of a run; m, rad, s.
EXTREMES = record(
    # Largest rotation to each side, and when.
    rotation_left="f8",
    rotation_left_time="f8",
    rotation_right="f8",
    rotation_right_time="f8",
    # Largest |slip|; how far a corner gets beyond each side's first place; the largest horizontal
    # displacement of a top corner; the largest height of the lower corner.
    slip="f8",
    reach_left="f8",
    reach_right="f8",
    top_displacement="f8",
    hop="f8",
    # When it first uplifts, and first slips; NaN before.
    uplift_time="f8",
    slip_time="f8",
    # Whether it stood flat, and stuck, a step ago.
    stood_flat="?",
    stuck="?",
    # First places of the top corners; half the width of the block.
    top_left="f8",
    top_right="f8",
    half_width="f8",
)
#: |theta| (rad), its rate (rad/s) and slip rate (m/s) below which a block stands flat, and sticks.
FLAT_SHARE = interpolation.FLAT
TURNING = interpolation.TURNING
SLIPPING = interpolation.SLIPPING


def extremes_at_start(scene: Scene) -> np.record:
    """What is noted before the first step."""
    x, _, tilt, _, _, spin = scene.initial_state
    top_left, top_right = kinematics.top_corners(scene.block, x, tilt).tolist()
    return filled(
        EXTREMES,
        uplift_time=math.nan,
        slip_time=math.nan,
        stood_flat=abs(tilt) < FLAT_SHARE * scene.block.alpha and abs(spin) < TURNING,
        stuck=abs(scene.initial_velocity) < SLIPPING,
        top_left=top_left,
        top_right=top_right,
        half_width=scene.block.half_width,
    )


@inner_kernel
def note_place(
    extremes: np.record, x: float, y: float, theta: float, t: float, corners: Corners
) -> None:
    """Notes where the block is in a step."""
    if theta > extremes.rotation_left:
        extremes.rotation_left = theta
        extremes.rotation_left_time = t
    elif -theta > extremes.rotation_right:
        extremes.rotation_right = -theta
        extremes.rotation_right_time = t
    half = extremes.half_width
    left = x + min(corners[0], corners[4])
    right = x + max(corners[2], corners[6])
    extremes.reach_left = max(extremes.reach_left, -left - half)
    extremes.reach_right = max(extremes.reach_right, right - half)
    moved_left = abs(x + corners[4] - extremes.top_left)
    moved_right = abs(x + corners[6] - extremes.top_right)
    extremes.top_displacement = max(extremes.top_displacement, max(moved_left, moved_right))
    if corners[1] < corners[3]:
        lowest = y + corners[1]
        slip = x + corners[0] + half
    else:
        lowest = y + corners[3]
        slip = x + corners[2] - half
    extremes.hop = max(extremes.hop, lowest)
    extremes.slip = max(extremes.slip, abs(slip))


@inner_kernel
def note_mode(
    extremes: np.record,
    theta: float,
    theta_dot: float,
    slip_rate: float,
    t: float,
    flat_angle: float,
) -> None:
    """Notes when the block first leaves the floor's plane, and first slips."""
    flat = abs(theta) < flat_angle and abs(theta_dot) < TURNING
    if extremes.stood_flat and not flat and math.isnan(extremes.uplift_time):
        extremes.uplift_time = t
    sticks = abs(slip_rate) < SLIPPING
    if extremes.stuck and not sticks and math.isnan(extremes.slip_time):
        extremes.slip_time = t
    extremes.stood_flat = flat
    extremes.stuck = sticks


def extremes_of(
    scene: Scene,
    noted: np.record,
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
    rotation_left = float(noted.rotation_left)
    rotation_right = float(noted.rotation_right)
    left_time = float(noted.rotation_left_time)
    right_time = float(noted.rotation_right_time)
    fall = history.overturned_at
    if fall is not None and history.outcome == "overturned left":
        rotation_left = 0.5 * math.pi
        left_time = fall
    if fall is not None and history.outcome == "overturned right":
        rotation_right = 0.5 * math.pi
        right_time = fall
    return Extremes(
        rotation_left=rotation_left,
        rotation_left_s=left_time,
        rotation_right=rotation_right,
        rotation_right_s=right_time,
        slip=float(noted.slip),
        last_slip=float(kinematics.slip(scene.block, last[0], last[2])),
        reach_left=float(noted.reach_left),
        reach_right=float(noted.reach_right),
        top_displacement=float(noted.top_displacement),
        hop=float(noted.hop),
        walls=walls,
        first_uplift_s=_time_or_none(float(noted.uplift_time)),
        first_slip_s=_time_or_none(float(noted.slip_time)),
        source="model",
    )


def _time_or_none(time: float) -> float | None:
    """None for NaN."""
    return None if math.isnan(time) else time
