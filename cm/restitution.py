"""The restitution that a contact of the Continuous Model reaches, read off the motion."""

import math

import numpy as np
from numpy.typing import NDArray

from rockcheck.cm.model import ContinuousModel
from rockcheck.scenes import History, InputError, Scene


def measured_restitution(model: ContinuousModel, scene: Scene) -> float:
    """Restitution of the first impact in `scene`: normal speed after over normal speed before.

    The scene is played twice, the second time up to that impact with 20 output times in every
    1/sqrt(k/m). Raises `InputError` if nothing strikes.
    """
    strikes = [event for event in model.simulate(scene).event_list if event.kind.endswith("impact")]
    if not strikes:
        raise InputError(f"nothing strikes in scene {scene.name!r}")
    first = strikes[0]
    contact_time = 1.0 / math.sqrt(model.stiffness_in(scene))
    sample = max(0.05 * contact_time, first.t / 2e6)
    history = model.simulate(
        scene.replace(duration=first.t + 6.0 * contact_time, output_step=sample)
    )
    onset = int(first.t / sample)
    # Of the corners about to touch, the fastest.
    near = [
        rate
        for gap, rate in _contacts(scene, history, first.kind)
        if rate[onset] < 0.0 and gap[onset] < -3.0 * sample * rate[onset]
    ]
    struck = min(near, key=lambda rate: float(rate[onset]))
    return float(max(np.max(struck[onset:]), 0.0) / -struck[onset])


def _contacts(
    scene: Scene, history: History, kind: str
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Gap (m) and rate (m/s) of every corner that may meet the floor, or a wall."""
    c, block = history.channels, scene.block
    sin, cos, w = np.sin(c["theta"]), np.cos(c["theta"]), c["theta_dot"]
    found = []
    for outward in (1.0, -1.0):  # the left and the right side
        for up in (-1.0, 1.0):
            a, b = -outward * block.half_width, up * block.half_height
            rx, ry = a * cos - b * sin, a * sin + b * cos
            wall = scene.wall("left" if outward > 0.0 else "right")
            if kind == "floor impact" and up < 0.0:
                found.append((c["y"] + ry, c["y_dot"] + w * rx))
            elif kind == "wall impact" and wall is not None:
                found.append(
                    (
                        outward * (c["x"] + rx) + block.half_width + wall.gap,
                        outward * (c["x_dot"] - w * ry),
                    )
                )
    return found
