"""The scenes as plain tables, for a simulator elsewhere.

In goes a folder; out come `scenes.csv`, the sampled base motions and what explains them. `rockcheck
conformance --export` calls it.
"""

from pathlib import Path
from typing import Any

import numpy as np

from rockcheck.engines import base_motion
from rockcheck.scenes import Floats, Scene, writing
from rockcheck.validation.studies.conformance.phenomena import PHENOMENA, SCENES
from rockcheck.validation.studies.conformance.players import ABOUT

TEXTS = Path(__file__).parents[2] / "data" / "export"
#: Time step of the sampled base motion, s.
BASE_STEP = 1e-3
BASE = ("t_s", "x_velocity_m_s", "y_velocity_m_s", "x_acceleration_m_s2", "y_acceleration_m_s2")
STATE = ("x_m", "y_m", "theta_rad", "x_dot_m_s", "y_dot_m_s", "theta_dot_rad_s")


def export(folder: Path) -> list[str]:
    """Write all scenes as tables into a folder; returns their names.

    An existing `engine.toml` stays as it is.
    """
    for name, scene in SCENES.items():
        if scene.excitation.kind != "rest" or scene.vertical.kind != "rest":
            base = writing.table_text(BASE, base_of(scene).tolist())
            writing.write_whole(folder / f"{name}-base.csv", base)
    rows = [row_of(scene) for scene in SCENES.values()]
    table = writing.table_text(tuple(rows[0]), [tuple(row.values()) for row in rows])
    writing.write_whole(folder / "scenes.csv", table)
    writing.write_whole(folder / "README.md", explanation())
    if not (folder / ABOUT).exists():
        writing.write_whole(folder / ABOUT, (TEXTS / ABOUT).read_text(encoding="utf-8"))
    return list(SCENES)


def base_of(scene: Scene) -> Floats:
    """The sampled base motion, a row a time, the columns of `BASE`."""
    t = BASE_STEP * np.arange(round(scene.duration / BASE_STEP) + 1)
    motions = scene.excitation, scene.vertical
    velocities = [base_motion.velocities_at(t, base_motion.velocity_of(one)) for one in motions]
    accelerations = [motion.acceleration(t) for motion in motions]
    return np.column_stack([t, *velocities, *accelerations])


def row_of(scene: Scene) -> dict[str, Any]:
    """Geometry, contacts and initial state of a scene by column; "" where there is no wall."""
    row: dict[str, Any] = {
        "scene": scene.name,
        "duration_s": scene.duration,
        "output_step_s": scene.output_step,
        "gravity_m_s2": scene.gravity,
        "half_width_m": scene.block.half_width,
        "half_height_m": scene.block.half_height,
        "friction": scene.floor.friction,
        "floor_restitution": scene.floor.restitution,
    }
    for side in ("left", "right"):
        wall = scene.wall(side)
        row[f"{side}_wall_gap_m"] = "" if wall is None else wall.gap
        row[f"{side}_wall_restitution"] = "" if wall is None else wall.restitution
    return row | dict(zip(STATE, map(float, scene.initial_state), strict=True))


def explanation() -> str:
    """The README of an exported folder: how scenes are meant, and which phenomena they show."""
    head = (TEXTS / "README.md").read_text(encoding="utf-8")
    lines = [
        f"- {phenomenon.id} {phenomenon.name}:"
        f" {', '.join(scene.name for scene in phenomenon.scenes)}"
        for phenomenon in PHENOMENA.values()
    ]
    return "\n".join([head, *lines, ""])
