"""The scenes for another engine, in any language: plain columns, and a README that says how they
are meant."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from rockcheck.engines.base_motion import BaseMotion
from rockcheck.scenes import Scene
from rockcheck.scenes.writing import table_text, write_whole
from rockcheck.validation.studies.conformance.phenomena import PHENOMENA, SCENES
from rockcheck.validation.studies.conformance.study import ABOUT

TEXTS = Path(__file__).parents[2] / "data" / "export"
#: Of the sampled base motion, s.
STEP = 1e-3
STATE = ("x_m", "y_m", "theta_rad", "x_dot_m_s", "y_dot_m_s", "theta_dot_rad_s")
MOTION = ("t_s", "x_velocity_m_s", "y_velocity_m_s", "x_acceleration_m_s2", "y_acceleration_m_s2")


def export(folder: Path) -> list[str]:
    """Write all scenes as tables into a folder; returns their names. An `engine.toml` that is there
    stays."""
    for name, scene in SCENES.items():
        if scene.excitation.kind != "rest" or scene.vertical.kind != "rest":
            write_whole(folder / f"{name}-base.csv", table_text(MOTION, _motion(scene)))
    rows = [_row(scene) for scene in SCENES.values()]
    write_whole(
        folder / "scenes.csv", table_text(tuple(rows[0]), (tuple(row.values()) for row in rows))
    )
    played = [
        f"- {one.id} {one.name}: {', '.join(scene.name for scene in one.scenes)}"
        for one in PHENOMENA.values()
    ]
    about = (TEXTS / "README.md").read_text(encoding="utf-8")
    write_whole(folder / "README.md", "\n".join([about, *played, ""]))
    if not (folder / ABOUT).exists():
        write_whole(folder / ABOUT, (TEXTS / ABOUT).read_text(encoding="utf-8"))
    return list(SCENES)


def _motion(scene: Scene) -> Iterable[Any]:
    """The base motion at the ends of its steps."""
    base = BaseMotion(scene)
    t = STEP * np.arange(round(scene.duration / STEP) + 1)
    velocity = np.array([base.velocity(time) for time in t.tolist()])
    accelerations = (one.acceleration(t) for one in (scene.excitation, scene.vertical))
    return np.column_stack([t, velocity, *accelerations]).tolist()


def _row(scene: Scene) -> dict[str, Any]:
    """A scene in plain columns."""
    walls = {wall.side: wall for wall in scene.walls}
    return {
        "scene": scene.name,
        "duration_s": scene.duration,
        "output_step_s": scene.output_step,
        "gravity_m_s2": scene.gravity,
        "half_width_m": scene.block.half_width,
        "half_height_m": scene.block.half_height,
        "friction": scene.floor.friction,
        "floor_restitution": scene.floor.restitution,
        **{
            f"{side}_wall_{name}": getattr(walls.get(side), key, "")
            for side in ("left", "right")
            for name, key in (("gap_m", "gap"), ("restitution", "restitution"))
        },
        **dict(zip(STATE, map(float, scene.initial_state), strict=True)),
    }
