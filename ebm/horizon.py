"""How long a comparison of two histories of one scene means anything."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from rockcheck.ebm.model import EventBasedModel
from rockcheck.scenes.errors import InputError
from rockcheck.scenes.history import History
from rockcheck.scenes.scene import Scene

#: What is disturbed, relatively, and the separation in alpha up to which histories still say the same.
PERTURBATION, ALLOWED = 1e-6, 1e-3
#: How near to the wall a block lands that lands against it (of R), and what impulse matters (of sqrt(g R), per unit mass).
FLUSH, MATTERS = 1e-9, 1e-3
START = ("initial_rotation", "initial_angular_velocity", "initial_velocity", "initial_height")


def predictability_horizon(
    scene: Scene, model: EventBasedModel | None = None, *, perturbation: float = PERTURBATION, allowed: float = ALLOWED
) -> float:
    """Time in s up to which two histories of this scene can be compared point by point.

    The scene is played by `model` (default: the unilateral one at tolerance 1e-13) as it is and with a relative
    `perturbation` of either sign of its excitation and of its initial state. The horizon is the last output time up to
    which all rotations stay within `allowed` (alpha) of the undisturbed ones; the scene's duration where they always do.

    With 1e-6 and 1e-3 it is the time in which the motion amplifies an error a thousandfold. Beyond it an error of 1e-4 alpha,
    which is a good engine's, is as large as a tenth of the motion: how far two histories are apart then tells of the scene, no
    more of the models. It is the ratio that matters: with 1e-7 and 1e-4 the horizon of El Centro is the same. Deterministic.
    The model's tolerance has to be well below the perturbation. Raises what `simulate` raises.

    It ends earlier where a rocking block lands flush against a wall with restitution: both corners of a side meet the wall as
    the other bottom corner meets the floor, and what follows depends on the order in which they are taken, in any model.
    """
    model = model or EventBasedModel(pivot="unilateral", tolerance=1e-13)
    history = model.simulate(scene)
    undisturbed = history.channels["theta"]
    rows = min(len(undisturbed), int(np.searchsorted(history.channels["t"], _flush_landing(scene, history))))
    for disturbed in _disturbed(scene, perturbation):
        theta = model.simulate(disturbed).channels["theta"][:rows]
        apart = np.abs(theta - undisturbed[: len(theta)]) > allowed * scene.block.alpha
        rows = int(np.argmax(apart)) if apart.any() else rows
    return scene.duration if rows == len(undisturbed) else float(scene.output_times[max(rows - 1, 1)])


def _flush_landing(scene: Scene, history: History) -> float:
    """Time in s of the first landing on both floor and bouncing wall, infinite where there is none."""
    t, slip, mode = (history.channels[name] for name in ("t", "slip", "mode"))
    flush = [wall.gap * (1.0 if wall.side == "right" else -1.0) for wall in scene.walls if wall.restitution > 0.0]
    matters = MATTERS * math.sqrt(scene.gravity * scene.block.radius)
    for event in history.event_list:
        before = int(np.searchsorted(t, event.t)) - 1
        # While it rocks, the pivot's slip is where the block will stand.
        rocks = event.kind == "floor impact" and event.impulse > matters and before >= 0 and mode[before] == "rock"
        if rocks and any(abs(slip[before] - place) < FLUSH * scene.block.radius for place in flush):
            return event.t
    return math.inf


def _disturbed(scene: Scene, perturbation: float) -> Iterator[Scene]:
    """The scene with a base motion a little stronger or weaker, and with a start a little farther from or nearer to rest."""
    start = {name: value for name in START if (value := getattr(scene, name)) != 0.0}
    for factor in (1.0 - perturbation, 1.0 + perturbation):
        if scene.excitation.kind != "rest" or scene.vertical.kind != "rest":
            yield scene.replace(excitation=scene.excitation.scaled(factor), vertical=scene.vertical.scaled(factor))
        if start:
            with suppress(InputError):  # farther from rest would be inside a wall
                yield scene.replace(**{name: factor * value for name, value in start.items()})
