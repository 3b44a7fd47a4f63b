"""Builds a History from any model's states on the output grid."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import kinematics
from rockcheck.scenes.base import Floats
from rockcheck.scenes.history import Event, History, outcome_of
from rockcheck.scenes.scene import Scene

#: Size from which a note warns of lengths in mm, m.
LARGE = 100.0
#: |theta| times its rate (rad^2/s) from which a block turns further.
FALLING = 0.01
STATE = ("x", "y", "theta", "x_dot", "y_dot", "theta_dot")


def observe(
    scene: Scene,
    model: str,
    state: Floats,
    *,
    mode: NDArray[Any] | None = None,
    events: Sequence[Event] = (),
    outcome: str | None = None,
    notes: Sequence[str] = (),
    **about: Any,
) -> History:
    """The History of a run, from its `state` at the output times.

    `state` has one row per output time, and may have one at the duration (`Scene.run_times`): x, y,
    theta, x_dot, y_dot, theta_dot (SI). Fewer rows mean that the run ended early; rows from the
    first |theta| >= pi/2 on are left out. `mode` and `outcome` are derived from the motion where
    the model does not know them; `about` are further fields of `History`, such as its cost and
    settings. Adds a note where the record is shorter than the scene.
    Raises `ValueError` where the block overturned and the model neither reported the event nor
    knows the outcome.
    """
    tipped = np.flatnonzero(np.abs(state[:, 2]) >= math.pi / 2)
    rows = max(int(tipped[0]) if tipped.size else len(state), 1)
    state, on_grid = state[:rows], len(scene.output_times) if rows == len(scene.run_times) else rows
    channels: dict[str, NDArray[Any]] = {
        "t": scene.output_times[:rows],
        **dict(zip(STATE, state[:on_grid].T, strict=True)),
    }
    channels["slip"] = kinematics.slip(scene.block, channels["x"], channels["theta"])
    channels["slip_rate"] = kinematics.slip_rate(
        scene.block, channels["theta"], channels["x_dot"], channels["theta_dot"]
    )
    channels["mode"] = modes_of(scene, channels) if mode is None else mode[:rows]
    told = (event.kind for event in events if event.kind.startswith("overturned"))
    if outcome is None and not (outcome := next(told, None)):
        if tipped.size:
            raise ValueError("a model that lets the block overturn must report the event")
        # What falls to the scene's end is not down, however far it has turned.
        outcome = (
            "moving"
            if rows >= len(scene.output_times) and state[-1, 2] * state[-1, 5] > FALLING
            else outcome_of(dict(zip(STATE, state.T, strict=True)))
        )
    return History(
        name=scene.name,
        model=model,
        channels=channels,
        event_list=tuple(events),
        outcome=outcome,
        notes=(*scene_notes(scene), *notes),
        block=scene.block.per_unit_mass,
        **about,
    )


def scene_notes(scene: Scene) -> tuple[str, ...]:
    """Notes for a reader of any history of this scene."""
    size = 2.0 * max(scene.block.half_width, scene.block.half_height)
    notes = {f"the block is {size:g} m large: lengths are in m, not mm": size > LARGE}
    for which, excitation in (("horizontal", scene.excitation), ("vertical", scene.vertical)):
        if excitation.kind == "record":
            end = f"{excitation.quiet_after:g} s, before the scene's {scene.duration:g} s"
            notes |= {f"the {which} record: {note}": True for note in excitation.notes}
            notes[f"the {which} record ends at {end}; the base is at rest after it"] = (
                excitation.quiet_after < scene.duration
            )
    return tuple(note for note, applies in notes.items() if applies)


def modes_of(scene: Scene, channels: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
    """Modes of motion from the kinematics, for models with contacts instead of modes.

    Tolerances are in SI units.
    """
    block = scene.block
    theta, sliding = channels["theta"], np.abs(channels["slip_rate"]) > 1e-3
    flat = (np.abs(theta) < 1e-4 * block.alpha) & (np.abs(channels["theta_dot"]) < 1e-3)
    gaps = (
        kinematics.clearance(scene.block, wall.side, wall.gap, channels["x"], theta)
        for wall in scene.walls
    )
    touching = np.any([np.zeros(len(theta), bool), *(gap < 1e-5 for gap in gaps)], axis=0)
    hop = kinematics.pivot_height(block, channels["y"], theta) > 1e-5
    return np.select(
        [hop, flat & ~sliding, flat, touching & ~sliding, touching, ~sliding],
        ["flight", "rest", "slide", "lean", "ladder", "rock"],
        default="slide-rock",
    )
