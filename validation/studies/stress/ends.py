"""What becomes of a block: the fate of a scene against histories, however long these are.

In: an event-based model, a scene and its history. Out: how often they contradict each other. Called
by `checks`.
"""

import math

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.fates import FAILED, OVERTURNED_LEFT, OVERTURNED_RIGHT, play_fates
from rockcheck.ebm.table import table_of
from rockcheck.scenes import History, ModelFailure, Scene

#: A long history goes on for this time (sqrt(R/g)) after the base, has so many rows, and may take
#: so many steps.
LONG, ROWS, MOST_STEPS = 1000.0, 100, 50_000
FALLS = {"overturned left": OVERTURNED_LEFT, "overturned right": OVERTURNED_RIGHT}
MIRRORED = {OVERTURNED_LEFT: OVERTURNED_RIGHT, OVERTURNED_RIGHT: OVERTURNED_LEFT}


def contradictions(model: EventBasedModel, scene: Scene, history: History) -> float | None:
    """How often the fate of a scene is not that of histories, its mirror image, or other rows.

    None where there is no fate (Bouc-Wen friction), or a long history takes too many steps.
    """
    if not model.decides:
        return None
    quiet = max(scene.excitation.quiet_after, scene.vertical.quiet_after)
    lasts = quiet + LONG * math.sqrt(scene.block.radius / scene.gravity)
    long = scene.replace(duration=lasts, output_step=lasts / ROWS)
    brief = scene.replace(duration=0.5 * scene.duration, output_step=0.3 * scene.output_step)
    scenes = scene, brief, long, scene.mirrored()
    capped = model.model_copy(update={"most_steps": MOST_STEPS})
    try:
        end = capped.simulate(long)
    except ModelFailure:
        return None
    fates = play_fates(table_of(*scenes), model, jobs=1).outcome.tolist()
    fate, *others, image = fates
    return float(
        sum(other != fate for other in others)
        + (image != MIRRORED.get(fate, fate))
        + (not _agrees(fate, history))
        + (not _agrees(fate, end, whole=True))
    )


def _agrees(fate: int, history: History, *, whole: bool = False) -> bool:
    """Whether a block whose history that is may have this fate.

    At the end of a `whole` one what falls has fallen.
    """
    if history.outcome in FALLS:
        return fate == FALLS[history.outcome]
    return fate != FAILED and not (whole and fate in MIRRORED)
