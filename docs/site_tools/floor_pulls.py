"""Counts the wall impacts of the suite `walls` at which the floor of the bilateral model pulls the
pivot down (docs/theory.md)."""

from __future__ import annotations

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Scene
from rockcheck.validation.suite.suites import load_suite

#: Spacing of the rows, s; an impact is looked at where no other event is within `ALONE` of them.
STEP, ALONE = 1e-4, 5
#: Less vertical impulse (per unit mass, m/s) is none: a block that stands flat slides into the
#: wall.
NONE = 1e-6


def floor_impulses(scene: Scene, model: EventBasedModel) -> list[float]:
    """The floor's vertical impulse per unit mass (m/s) at each wall impact that stands alone: the
    jump of y_dot."""
    history = model.simulate(scene.replace(output_step=STEP))
    times, rate = history.channels["t"], history.channels["y_dot"]
    instants = np.array([event.t for event in history.event_list])
    found = []
    for event in history.event_list:
        after = int(np.searchsorted(times, event.t, side="right"))
        alone = np.sum(np.abs(instants - event.t) < ALONE * STEP) == 1
        if event.kind == "wall impact" and alone and 2 <= after < len(times) - 1:
            came = rate[after - 1] + (rate[after - 1] - rate[after - 2]) / STEP * (
                event.t - times[after - 1]
            )
            went = rate[after] - (rate[after + 1] - rate[after]) / STEP * (times[after] - event.t)
            found.append(float(went - came))
    return found


def pulls() -> tuple[int, int]:
    """How many of the impacts have a floor impulse that pulls, and how many have one at all."""
    model = EventBasedModel()
    found = [
        one
        for scene in load_suite("walls").scenes.values()
        for one in floor_impulses(scene, model)
        if abs(one) > NONE
    ]
    return sum(one < 0.0 for one in found), len(found)
