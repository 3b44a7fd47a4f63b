"""Conditions on every row: contacts, Coulomb's law, the signs of forces.

In: `Motion` of a run of an event-based model. Out: a figure for each invariant. Called by `checks`.
"""

import math
from collections.abc import Sequence

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import (
    Floats,
)
from rockcheck.validation.studies.stress.forces import Mask
from rockcheck.validation.studies.stress.motion import SLIPS, Motion

#: No condition is checked within this time (sqrt(R/g)) of an event or a jump.
NEAR = 1e-9


def conditions(model: EventBasedModel, motion: Motion) -> dict[str, float]:
    """Contacts, Coulomb's law and the signs of forces in every row, away from events."""
    # Rounding of x does not count as depth.
    rounding = 4e-16 * np.abs(motion.channels["x"]) / motion.radius
    depth = np.max([-motion.height, *(-gap - rounding for gap in motion.gaps.values())])
    figures = {
        "penetration": max(0.0, float(depth)),
        "floor": largest(np.abs(motion.height), ~motion.within("flight", "overturned")),
    }
    if model.friction == "bouc-wen":  # its pivot creeps, and its friction is not in a history
        return figures
    drift = 1e-6 * np.abs(motion.channels["x_dot"]) * motion.unit / motion.radius
    speed = np.abs(motion.slip) / (1.0 + drift + np.abs(motion.w))
    friction, push = _force_conditions(model, motion)
    return figures | {
        "stick": largest(speed, motion.within("rest", "rock", "lean")),
        "coulomb": friction,
        "push": push,
    }


def largest(values: Floats, rows: Mask) -> float:
    """The largest of the values in these rows, at least 0."""
    return float(np.max(values[rows], initial=0.0))


def none_between(times: Sequence[float], first: Floats, last: Floats) -> Mask:
    """Where none of the times lies between `first` and `last`."""
    before, until = np.searchsorted(np.sort(times), (first, last))
    return np.asarray(before == until)


def _force_conditions(model: EventBasedModel, motion: Motion) -> tuple[float, float]:
    """Largest friction beyond the cone, and largest tension, relative to 1 + |u| + |vg| + w^2."""
    scene, t, theta = motion.scene, motion.channels["t"], motion.channels["theta"]
    bases = [base for base in (scene.excitation, scene.vertical) if base.kind != "rest"]
    breaks = [
        *(event.t for event in motion.history.event_list),
        *(time for base in bases for time in (0.0, base.quiet_after)),
    ]
    near = NEAR * motion.unit + 1e-12 * np.abs(t)
    clear = none_between(breaks, t - near, t + near)
    u, g, w, mu_s = motion.u, 1.0 + motion.vertical, motion.w, motion.scene.floor.mu_s
    scale = 1.0 + np.abs(u) + np.abs(g) + w * w
    unilateral = model.pivot == "unilateral"
    pivots = scene.block.pivot("left"), scene.block.pivot("right")
    # A base that accelerates to the right tips the block to the left.
    tips = np.where(u > 0.0, *(pivot.arm / pivot.height for pivot in pivots))
    limit = tips if model.friction == "no-slip" else np.minimum(tips, max(mu_s, 1e-9))
    rest = clear & motion.within("rest") & ~(motion.tip | motion.far)
    excess = largest((np.abs(u) - limit * np.abs(g)) / scale, rest)
    tension = largest(-g / scale, clear & motion.within("rest", "slide") & unilateral)
    slides = motion.within("slide-rock", "ladder")
    tilted = (
        clear
        & motion.within("rock", "slide-rock", "lean", "ladder")
        & (theta != 0.0)
        & ~(motion.within("lean", "ladder") & (motion.tip == motion.far))
        & ~(slides & (np.abs(motion.slip) < SLIPS))
    )
    direction = np.where(slides, np.sign(motion.sign * motion.slip), 0.0)
    beyond, pulls = [], []
    # What happens within NEAR is one event, in the core and here: a spinning block passes through
    # its friction cone in less time. So a condition is broken only where it is broken for that long
    # before and after.
    for moment in (0.0, -NEAR, NEAR):
        (normal, friction, tip, far), _ = motion.forces(tilted, direction, later=moment)
        beyond.append(np.abs(friction) - mu_s * np.abs(normal))
        pulls.append(np.maximum(np.maximum(-tip, -far), -normal if unilateral else -math.inf))
    over = np.min(beyond, axis=0) / scale[tilted]
    pull = np.min(pulls, axis=0) / scale[tilted]
    if model.friction != "no-slip":
        excess = max(excess, largest(over, direction[tilted] == 0))
    return excess, max(tension, float(np.max(pull, initial=0.0)))
