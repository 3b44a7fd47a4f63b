"""The fate of a block: what becomes of it, however long a scene's history is drawn.

A history's outcome says what it shows at its end. A fate goes on: the excitation to its end, then
the base at rest, until the energy decides, the block rests, or it lies.
"""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from rockcheck.ebm import EventBasedModel, fates
from rockcheck.ebm.extremes import extremes_from
from rockcheck.ebm.table import table_of
from rockcheck.scenes import Extremes, Floats, History, ModelFailure, Scene, Side, kinematics
from rockcheck.scenes.history import OUTCOMES, STILL
from rockcheck.scenes.scene import MOST_SAMPLES
from rockcheck.validation.discrepancy.figures import extremes_in

#: A motion is followed up to this many 1/p after the base has come to rest; event-based models,
#: which cost a thousandth, go farther in `rockcheck.ebm.fates`.
CAP = 60.0
#: A first look is taken so many 1/p after that; each further one takes twice as long.
FIRST_LOOK = 7.5
#: Share of the energy of standing on the weaker corner that decides: engines, and impacts at walls,
#: may add a little.
MARGIN = 0.9

Verdict = Literal["stays", "falls", "open"]


@dataclass(frozen=True)
class Fate:
    """What becomes of a block.

    `outcome` is one of a history's, or "undecided": none of what stays. `at_s` is when it was
    decided, s: of a block that overturns the time of that. `history` is the motion up to then, and
    `extremes` are its.
    """

    outcome: str
    extremes: Extremes
    at_s: float
    history: History


def fate_of(model: Any, scene: Scene) -> Fate:
    """Plays a scene on until its outcome is certain; its own duration does not count.

    The motion goes on for at most `CAP`/p after the base has come to rest. A block that still moves
    then, and cannot be proved to stand, is "undecided". Raises what `simulate` raises.
    """
    if isinstance(model, EventBasedModel) and model.decides:
        return _event_based(model, scene)
    quiet = max(scene.excitation.quiet_after, scene.vertical.quiet_after)
    unit = 1.0 / scene.frequency_parameter
    ahead, before = FIRST_LOOK, np.full(6, math.inf)
    while True:
        played = lasting(scene, quiet + ahead * unit)
        history = model.simulate(played)
        end = float(history.channels["t"][-1])
        if history.outcome.startswith("overturned"):
            fallen = history.overturned_at
            return Fate(history.outcome, extremes_in(history, played), fallen or end, history)
        extremes = extremes_in(history, played)
        state = last_state(history)
        verdict = decided(played, state, extremes.peak_rotation)
        # It may rest against a wall.
        rests = bool(np.all(np.abs(state[3:]) < STILL) and np.all(np.abs(state - before) < STILL))
        if rests or history.outcome == "at rest" or verdict == "stays":
            return Fate("at rest", extremes, end, history)
        if ahead >= CAP:
            break
        ahead, before = min(2.0 * ahead, CAP), state
    outcome = "undecided"
    if verdict == "falls":
        outcome = f"overturned {side_of(history)}"
    return Fate(outcome, extremes, end, history)


def _event_based(model: EventBasedModel, scene: Scene) -> Fate:
    """The fate by the event-based model's own decision; its history lasts as long as the scene."""
    played = fates.play_fates(table_of(scene), model, keeps=fates.Keep.EXTREMES, jobs=1)
    outcome = int(played.outcome[0])
    if outcome == fates.FAILED:
        raise ModelFailure(f"{model.name}: {played.reasons[0]}")
    assert played.extremes is not None, "asked for"
    extremes = extremes_from(scene, {name: float(c[0]) for name, c in played.extremes.items()})
    words = (*OUTCOMES, "undecided")
    return Fate(words[outcome], extremes, float(played.time_s[0]), model.simulate(scene))


def lasting(scene: Scene, duration: float) -> Scene:
    """The scene for as long as `duration` (s).

    Rows are farther apart where they would be too many.
    """
    step = max(scene.output_step, 1.001 * duration / MOST_SAMPLES)
    return scene.replace(duration=duration, output_step=step)


def last_state(history: History) -> Floats:
    """x, y, theta of the box's centre and their rates in the last row (6)."""
    names = "x", "y", "theta", "x_dot", "y_dot", "theta_dot"
    return np.array([float(history.channels[name][-1]) for name in names])


def side_of(history: History) -> Side:
    """The side to which a block is tilted at the end."""
    return "left" if history.channels["theta"][-1] > 0.0 else "right"


def decided(scene: Scene, state: Floats, peak: float) -> Verdict:
    """What the energy says of a block in this state (6) over a base at rest.

    "stays": it has too little energy to stand on its weaker corner, and to turn farther than its
    `peak` (rad) so far. Of a floor that rebounds this is not said: an impact with friction may add
    energy. "falls": it is past its balance point and turns outward, with no wall on that side.
    """
    block, gravity = scene.block, scene.gravity
    _, y, theta, x_dot, y_dot, theta_dot = state.tolist()
    side: Side = "left" if theta > 0.0 else "right"
    outward = theta * theta_dot > 0.0
    if abs(theta) > block.pivot(side).alpha:
        return "falls" if outward and scene.wall(side) is None else "open"
    if scene.floor.restitution > 0.0 and scene.floor.mu_s > 0.0:
        return "open"
    energy = float(kinematics.energy(block, gravity, y, theta, x_dot, y_dot, theta_dot))
    corner = gravity * (block.radius - block.weaker_pivot.height)
    if energy >= MARGIN * corner:
        return "open"
    reached = max(_highest(scene, "left", energy), _highest(scene, "right", energy))
    return "stays" if reached <= peak else "open"


def _highest(scene: Scene, side: Side, energy: float) -> float:
    """The rotation (rad) about a corner to which an energy (J/kg) can lift the block.

    The energy is too little to stand on that corner.
    """
    pivot = scene.block.pivot(side)
    height = pivot.height + max(energy, 0.0) / scene.gravity
    return pivot.alpha - math.acos(height / pivot.radius)
