"""Where engines and the continuous model break: the largest stable step, and what a block does that
should stand still.

Lengths are in R, times in sqrt(R/g): the same step is asked of a domino and of a tower.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rockcheck.scenes import (
    Block,
    Floor,
    InputError,
    ModelFailure,
    Record,
    Rest,
    Ricker,
    Scene,
    Sine,
    Wall,
    kinematics,
)
from rockcheck.scenes.errors import printable
from rockcheck.scenes.scene import PAPER_BLOCK
from rockcheck.validation.execute.models import build, not_installed
from rockcheck.validation.studies.stress.mechanics import motion_of, not_finite
from rockcheck.validation.studies.stress.players import energy_without_source
from rockcheck.validation.study import Task

SLOPE = math.tan(0.25)
#: Values along each axis; all else is the paper's block beside a wall: R in m, friction,
#: restitution of the wall, a_p/(g tan alpha).
AXES: dict[str, tuple[float, ...]] = {
    "size": (1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1000.0),
    "friction": (0.0, 0.1, 0.3, 0.6, 0.9, 1.2),
    "restitution": (0.0, 0.25, 0.5, 0.75, 0.95),
    "shaking": (0.5, 1.5, 3.0, 10.0, 30.0, 100.0),
}
USUAL: dict[str, float] = {"size": 1.6, "friction": 0.3, "restitution": 0.5, "shaking": 3.0}
AXIS_WORDS: dict[str, str] = {
    "size": "half diagonal R, m",
    "friction": "friction of the floor",
    "restitution": "restitution of the wall",
    "shaking": "peak acceleration, g tan α",
}
#: Steps that are tried, sqrt(R/g), coarse to fine, and what a stable run keeps to: depth in R,
#: energy without source.
STEPS = (0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 3e-4)
DEEPEST, MOST_ENERGY = 0.02, 0.1
#: Adaptive steps are as fine as they need to be: what is tried is how large they may grow, from
#: here on.
ADAPTIVE_FINEST = 3e-3
#: Stand-still runs: a block left alone, one that is pushed or shaken (or left alone, where a step
#: takes a millisecond), and in a quick run, s; and the step (s).
HOUR, PUSHED, QUICK_REST, REST_STEP = 3600.0, 300.0, 10.0, 5e-3
QUICK_STEPS, QUICK_VALUES = STEPS[1:-1:2], 2
#: What a place may take, s: far more than it needs.
MOST_SECONDS = 600.0


@dataclass(frozen=True)
class ModelSetup:
    """A model with settings as they come ("default") or at their best; `knob` is what the step is
    called there.

    A block is left `alone` for so long, s. `finest` is the finest step that is tried, sqrt(R/g).
    """

    label: str
    family: str
    settings: tuple[tuple[str, Any], ...]
    knob: str = "time_step"
    alone: float = HOUR
    finest: float = STEPS[-1]


SETUPS = {
    setup.label: setup
    for setup in (
        *(
            setup
            for engine in ("mujoco", "pybullet", "pymunk", "dart", "drake")
            for setup in (
                ModelSetup(f"{engine} default", engine, (("settings", "default"),)),
                ModelSetup(engine, engine, ()),
                ModelSetup(
                    f"{engine} adaptive",
                    engine,
                    (("time_step", "adaptive"),),
                    "largest_step",
                    PUSHED if engine == "dart" else HOUR,
                    ADAPTIVE_FINEST,
                ),
            )
            if setup.label != "drake adaptive"  # its steps cannot vary
        ),
        ModelSetup("cm paper", "cm", (("damping_rule", "paper"),)),
        ModelSetup("cm", "cm", ()),
    )
}


@dataclass(frozen=True)
class Stable:
    """The largest step (sqrt(R/g)) from which on a model is stable, 0 where none was; and what the
    next coarser one does."""

    line: str
    axis: str
    value: float
    step: float
    fault: str = ""


@dataclass(frozen=True)
class Still:
    """What a block does that should stand still: the largest of each, R, alpha or sqrt(g R);
    `fault` where the run did not end."""

    line: str
    case: str
    simulated: float
    step: float
    moves: dict[str, float] = field(default_factory=dict)
    fault: str = ""


def scene_at(axis: str, value: float) -> Scene:
    """The paper's shape of block beside a wall under a pulse, with one thing changed."""
    at = USUAL | {axis: value}
    radius, unit = at["size"], math.sqrt(at["size"] / 9.81)
    own = 2.0 * math.pi * unit / math.sqrt(0.75)
    return Scene(
        name=f"{axis} {value:g}",
        block=Block(half_width=radius * math.sin(0.25), half_height=radius * math.cos(0.25)),
        floor=Floor(friction=at["friction"]),
        walls=(Wall(side="left", gap=0.03 * radius, restitution=at["restitution"]),),
        excitation=Ricker(amplitude=9.81 * SLOPE * at["shaking"], period=0.3 * own),
        duration=8.0 * unit,
        output_step=0.02 * unit,
    )


def fault_of(line: ModelSetup, scene: Scene, step: float) -> str:
    """How a run of that step (sqrt(R/g)) breaks: "blows up", "sinks", "gains energy"; empty where
    it does not."""
    unit, radius = math.sqrt(scene.block.radius / scene.gravity), scene.block.radius
    scene = scene.replace(
        output_step=max(scene.output_step, step * unit)
    )  # the CM ends a step at each row
    # The CM's contact is as stiff as the block's size asks for.
    stiff = {"penetration": 1e-7 * radius} if line.family == "cm" else {}
    try:
        history = build(
            line.family, dict(line.settings) | {line.knob: step * unit} | stiff
        ).simulate(scene)
    except ModelFailure as error:
        return "sinks" if "through the floor" in str(error) else "blows up"
    except InputError as error:
        return printable(error, 60)
    if not_finite(history):
        return "blows up"
    motion = motion_of(scene, history)
    speed = float(np.max(np.hypot(motion.channels["x_dot"], motion.channels["y_dot"])))
    if (
        motion.deepest > DEEPEST + 2.0 * step * speed * unit / radius
    ):  # that of one step is no fault
        return "sinks"
    return "gains energy" if energy_without_source(motion) > MOST_ENERGY else ""


#: Push or shaking (at 1 Hz) under which a block should still stand, as a share of what would move
#: it.
CASES = {"left alone": 0.0, "pushed": 0.5, "shaken": 0.8}


def stand_still(label: str, case: str, duration: float, step: float = REST_STEP) -> Still:
    """Plays a block that should not move; the paper's."""
    block, mu = PAPER_BLOCK, 0.3
    push = CASES[case] * 9.81 * min(SLOPE, mu)
    excitation: Rest | Record | Sine = (
        Record.from_samples([push, push], time_step=duration + 1.0)
        if case == "pushed"
        else Sine(amplitude=push, period=1.0, cycles=int(min(1000, max(duration - 1, 1))))
        if case == "shaken"
        else Rest()
    )
    scene = Scene(
        name=case,
        block=block,
        floor=Floor(friction=mu),
        excitation=excitation,
        duration=duration,
        output_step=max(step, duration / 4000),
    )
    line = SETUPS[label]
    settings = dict(line.settings)
    if line.family != "cm":  # the CM's own step makes an hour cheap
        settings |= {line.knob: step}
    try:
        history = build(line.family, settings).simulate(scene)
    except (ModelFailure, InputError) as error:
        return Still(label, case, duration, step, fault=printable(error, 120))
    channels, radius = history.channels, block.radius
    late = channels["t"] > 0.5 * channels["t"][-1]
    height = kinematics.pivot_height(block, channels["y"], channels["theta"])
    lifted = height + 2.0 * block.half_width * np.abs(np.sin(channels["theta"]))
    speed = np.sqrt(
        channels["x_dot"] ** 2 + channels["y_dot"] ** 2 + (radius * channels["theta_dot"]) ** 2
    )
    return Still(
        label,
        case,
        float(channels["t"][-1]),
        float(history.settings.get("time_step", step)) if line.family == "cm" else step,
        {
            "creep": float(np.max(np.abs(channels["slip"]))) / radius,
            "sinking": max(0.0, float(np.max(-height))) / radius,
            "rotation": float(np.max(np.abs(channels["theta"]))) / block.alpha,
            "uplift": max(0.0, float(np.max(lifted))) / radius,
            "jitter": float(np.sqrt(np.mean(speed[late] ** 2))) / math.sqrt(9.81 * radius)
            if late.any()
            else math.nan,
        },
        "" if not history.outcome.startswith("overturned") else history.outcome,
    )


@dataclass(frozen=True)
class Place(Task):
    """A place of a map: a model with settings at a value of an axis, or a block that should stand
    so long (s)."""

    line: str
    at: str
    value: float
    quick: bool = False

    def play(self) -> Still | Stable:
        """What is there: steps are tried from the finest up to the first one that breaks."""
        if self.at in CASES:
            return stand_still(self.line, self.at, self.value)
        setup, scene, best, fault = SETUPS[self.line], scene_at(self.at, self.value), 0.0, ""
        for step in sorted(
            one for one in (QUICK_STEPS if self.quick else STEPS) if one >= setup.finest
        ):
            if fault := fault_of(setup, scene, step):
                break
            best = step
        return Stable(self.line, self.at, self.value, best, fault)


def places(quick: bool = False) -> list[Place]:
    """The maps of all `SETUPS` that are installed, the longest tasks first; `quick` has fewer
    values, steps and seconds."""
    lines = [label for label, setup in SETUPS.items() if not not_installed(setup.family)]
    how: dict[str, Any] = {"seconds": MOST_SECONDS, "expected": 0.5 if quick else 4.0}
    still = [
        Place(
            line,
            case,
            QUICK_REST if quick else PUSHED if CASES[case] else SETUPS[line].alone,
            **how,
        )
        for case, line in itertools.product(CASES, lines)
    ]
    values = [
        (axis, one)
        for axis, some in AXES.items()
        for one in (some[:: max(1, len(some) // QUICK_VALUES)] if quick else some)
    ]
    return still + [
        Place(line, axis, value, quick, **how) for axis, value in values for line in lines
    ]
