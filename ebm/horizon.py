"""How long a comparison of two histories of one scene means anything."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Literal

import numpy as np

from rockcheck.ebm.model import EventBasedModel
from rockcheck.scenes.errors import InputError
from rockcheck.scenes.scene import Scene

#: The relative disturbance, and the separation (alpha) up to which two histories still count as the same.
PERTURBATION, ALLOWED = 1e-6, 1e-3
START = ("initial_rotation", "initial_angular_velocity", "initial_velocity", "initial_height")


def predictability_horizon(
    scene: Scene, model: EventBasedModel | None = None, *, perturbation: float = PERTURBATION, allowed: float = ALLOWED
) -> float:
    """Time in s up to which two histories of this scene can be compared point by point.

    The scene is played by `model` (default: the unilateral one at tolerance 1e-13) as it is and with a relative
    `perturbation` of either sign of its excitation and of its initial state. The horizon is the last output time up to
    which all rotations stay within `allowed` (alpha) of the undisturbed ones; the scene's duration where they always do.

    With 1e-6 and 1e-3 it is the time in which the motion amplifies an error a thousandfold. Beyond it an error of 1e-4 alpha,
    as a good engine has, has grown to a tenth of the motion. How far two histories are apart then depends on the scene, not on
    the models. It is the ratio that matters: with 1e-7 and 1e-4 the horizon of El Centro is the same. Deterministic.
    The model's tolerance has to be well below the perturbation. Raises what `simulate` raises.

    A scene with a wall is played once more under the other law of impacts: where several contacts are struck at once, as when a
    block lands flush against a bouncing wall, histories mean the same only as long as they do not depend on the law.
    """
    model = model or EventBasedModel(pivot="unilateral", tolerance=1e-13)
    undisturbed = model.simulate(scene).channels["theta"]
    rows = len(undisturbed)
    for other, disturbed in _disturbed(scene, model, perturbation):
        theta = other.simulate(disturbed).channels["theta"][:rows]
        apart = np.abs(theta - undisturbed[: len(theta)]) > allowed * scene.block.alpha
        rows = int(np.argmax(apart)) if apart.any() else rows
    return scene.duration if rows == len(undisturbed) else float(scene.output_times[max(rows - 1, 1)])


def other_law(model: EventBasedModel) -> Literal["moreau", "floor-first"]:
    """The law of impacts under which an event-based model's motion is to be the same, for it to be trusted."""
    return "floor-first" if model.impacts == "moreau" else "moreau"


def _disturbed(scene: Scene, model: EventBasedModel, perturbation: float) -> Iterator[tuple[EventBasedModel, Scene]]:
    """The other law of impacts; a base motion a little stronger or weaker; a start a little farther from or nearer to rest."""
    if model.pivot == "unilateral" and scene.walls:
        yield model.model_copy(update={"impacts": other_law(model)}), scene
    start = {name: value for name in START if (value := getattr(scene, name)) != 0.0}
    for factor in (1.0 - perturbation, 1.0 + perturbation):
        if scene.excitation.kind != "rest" or scene.vertical.kind != "rest":
            yield model, scene.replace(excitation=scene.excitation.scaled(factor), vertical=scene.vertical.scaled(factor))
        if start:
            with suppress(InputError):  # farther from rest would be inside a wall
                yield model, scene.replace(**{name: factor * value for name, value in start.items()})
