"""How long a comparison of two histories of one scene means anything."""

from collections.abc import Iterator
from contextlib import suppress
from itertools import chain

import numpy as np

from rockcheck.ebm.core.names import RULE_NAMES, Rule
from rockcheck.ebm.model import EventBasedModel, ImpactLaw
from rockcheck.ebm.ties import ties_of
from rockcheck.scenes import InputError, Scene

#: The relative disturbance, and the separation (alpha) up to which two histories still count as the
#: same.
PERTURBATION, ALLOWED = 1e-6, 1e-3
START = ("initial_rotation", "initial_angular_velocity", "initial_velocity", "initial_height")
#: The choice, as `History.cost.rules` counts it, at which the laws of one bottom corner before the
#: other part.
LANDS_FLAT = RULE_NAMES[Rule.FLAT_LANDING]


def predictability_horizon(
    scene: Scene,
    model: EventBasedModel | None = None,
    *,
    perturbation: float = PERTURBATION,
    allowed: float = ALLOWED,
) -> float:
    """Time in s up to which two histories of this scene can be compared point by point.

    The scene is played by `model` (default: the unilateral one at tolerance 1e-13) as it is and
    with a relative `perturbation` of either sign of its excitation and of its initial state; a
    rotation or velocity that is zero gets that part of alpha, alpha p or R alpha p. The horizon is
    the last output time up to which all rotations stay within `allowed` (alpha) of the undisturbed
    ones; the scene's duration where they always do.

    With 1e-6 and 1e-3 it is the time in which the motion amplifies an error a thousandfold. Beyond
    it an error of 1e-4 alpha, as a good engine has, has grown to a tenth of the motion. How far two
    histories are apart then depends on the scene, not on the models. It is the ratio that matters:
    with 1e-7 and 1e-4 the horizon of El Centro is the same. Deterministic. The model's tolerance
    has to be well below the perturbation. Raises what `simulate` raises.

    Where several contacts are struck at once, as when a block lands flush against a wall or flat on
    the floor, the scene is played under the `other_laws` of impacts, too: histories mean the same
    only as long as they do not depend on the law. So it is where the mechanics has more than one
    answer (`ebm.ties`).
    """
    model = model or EventBasedModel(pivot="unilateral", tolerance=1e-13)
    played = model.simulate(scene)
    undisturbed = played.channels["theta"]
    rows = len(undisturbed)
    laws = other_laws(model, walls=bool(scene.walls), flat=LANDS_FLAT in played.cost.rules)
    others = ((model.model_copy(update={"impacts": law}), scene) for law in laws)
    for other, disturbed in chain(others, _disturbed(scene, model, perturbation)):
        theta = other.simulate(disturbed).channels["theta"][:rows]
        apart = np.abs(theta - undisturbed[: len(theta)]) > allowed * scene.block.alpha
        rows = int(np.argmax(apart)) if apart.any() else rows
    whole = rows == len(undisturbed)
    horizon = scene.duration if whole else float(scene.output_times[max(rows - 1, 1)])
    return min([horizon, *(max(tie.apart_s, scene.output_step) for tie in ties_of(scene, model))])


def may_fly(scene: Scene) -> bool:
    """Whether the block can leave the floor, and so land flat."""
    lifted = scene.initial_height > 0.0 or scene.vertical.kind != "rest"
    return lifted or bool(scene.walls) or scene.floor.restitution > 0.0


def other_laws(model: EventBasedModel, *, walls: bool, flat: bool) -> tuple[ImpactLaw, ...]:
    """The laws of impacts under which a model's motion is to be the same, for it to be trusted.

    `walls`: beside walls; `flat`: where it lands flat.
    """
    matter: dict[ImpactLaw, bool] = {
        "moreau": True,
        "floor-first": walls,
        "leading-first": flat,
        "trailing-first": flat,
    }
    others = (law for law, matters in matter.items() if matters and law != model.impacts)
    return tuple(others) if model.pivot == "unilateral" else ()


def _disturbed(
    scene: Scene, model: EventBasedModel, perturbation: float
) -> Iterator[tuple[EventBasedModel, Scene]]:
    """The scene with disturbed excitation, and with disturbed initial states, of either sign.

    The base motion is a little stronger or weaker; the start is farther from rest, nearer to it, or
    off zero.
    """
    alpha, rate = scene.block.alpha, scene.block.alpha * scene.frequency_parameter
    speed = scene.block.radius * rate
    units = {"initial_rotation": alpha, "initial_angular_velocity": rate, "initial_velocity": speed}
    given = {name: value for name in START if (value := getattr(scene, name)) != 0.0}
    for change in (-perturbation, perturbation):
        if scene.excitation.kind != "rest" or scene.vertical.kind != "rest":
            factor = 1.0 + change
            yield (
                model,
                scene.replace(
                    excitation=scene.excitation.scaled(factor),
                    vertical=scene.vertical.scaled(factor),
                ),
            )
        farther = {name: value + change * value for name, value in given.items()}
        zeros = [{name: change * unit} for name, unit in units.items() if name not in given]
        for start in (farther, *zeros):
            with suppress(InputError):  # inside a wall, or slip where the model never does
                disturbed = scene.replace(**start)
                model.check(disturbed)
                yield model, disturbed
