"""Where engines and the continuous model break: largest stable steps, and blocks that should stand.

Lengths are in R, times in sqrt(R/g): a domino and a tower get the same step.

In: a setup of a model and a value of an axis. Out: `MapResult`. Called by the study.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rockcheck.engines import registry
from rockcheck.engines.facts import EngineFacts
from rockcheck.scenes import (
    PAPER_BLOCK,
    Block,
    Floor,
    Record,
    Rest,
    Ricker,
    Scene,
    Sine,
    Wall,
    errors,
    kinematics,
    printable,
)
from rockcheck.validation.execute.models import Work, build, not_installed
from rockcheck.validation.studies.stress.energy import energy_without_source
from rockcheck.validation.studies.stress.motion import Motion, not_finite
from rockcheck.validation.study import Task

SLOPE = math.tan(0.25)
#: Axes: their words, the usual value, the values that are played; all else is the paper's block
#: beside a wall. In m; 1; 1; g tan alpha.
AXES: dict[str, tuple[str, float, tuple[float, ...]]] = {
    "size": ("half diagonal R, m", 1.6, (1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1000.0)),
    "friction": ("friction of the floor", 0.3, (0.0, 0.1, 0.3, 0.6, 0.9, 1.2)),
    "restitution": ("restitution of the wall", 0.5, (0.0, 0.25, 0.5, 0.75, 0.95)),
    "shaking": ("peak acceleration, g tan α", 3.0, (0.5, 1.5, 3.0, 10.0, 30.0, 100.0)),
}
#: Steps that are tried, sqrt(R/g), coarse to fine; and the limits of a stable run: depth in R,
#: energy without source.
STEPS = (0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 3e-4)
DEEPEST, MOST_ENERGY = 0.02, 0.1
#: Adaptive steps are as fine as they need to be: their largest step is varied, down to this.
ADAPTIVE_FINEST = 3e-3
#: Stand-still runs: a block left alone, one that is pushed or shaken (or left alone, where a step
#: takes a millisecond), and in a quick run, s; and the step (s).
HOUR, PUSHED, QUICK_REST, REST_STEP = 3600.0, 300.0, 10.0, 5e-3
QUICK_STEPS, QUICK_VALUES = STEPS[1:-1:2], 2


@dataclass(frozen=True, kw_only=True)
class ModelSetup(Work):
    """A model with its default settings ("default") or its best ones.

    `knob` is its name for the step. A block is left alone for `alone` s. `finest` is the finest
    step that is tried, sqrt(R/g).
    """

    knob: str = "time_step"
    alone: float = HOUR
    finest: float = STEPS[-1]


def setups_of_engine(facts: EngineFacts) -> list[ModelSetup]:
    """An engine as it comes, at its best, and with adaptive steps where it has them."""
    engine = facts.name
    setups = [
        ModelSetup(label=f"{engine} default", family=engine, settings={"settings": "default"}),
        ModelSetup(label=engine, family=engine),
    ]
    if facts.steps_vary:
        adaptive = ModelSetup(
            label=f"{engine} adaptive",
            family=engine,
            settings={"time_step": "adaptive"},
            knob="largest_step",
            alone=PUSHED if facts.dear_adaptive_steps else HOUR,
            finest=ADAPTIVE_FINEST,
        )
        setups.append(adaptive)
    return setups


SETUPS = {
    setup.label: setup
    for setup in (
        *(
            setup
            for facts in registry.every()
            if facts.in_stress_maps
            for setup in setups_of_engine(facts)
        ),
        ModelSetup(label="cm paper", family="cm", settings={"damping_rule": "paper"}),
        ModelSetup(label="cm", family="cm"),
    )
}


@dataclass(frozen=True)
class MapResult:
    """The result at a `MapPoint`: its `value`, a step, and a fault.

    On an axis `step` is the largest (sqrt(R/g)) up to which the model is stable, 0 where none is,
    and `fault` is how the next coarser one breaks. Of a block that should stand still for `value` s
    `step` is the model's (s), `moves` are its largest movements of each kind, in R, alpha or
    sqrt(g R), and `fault` says why the run did not end.
    """

    value: float
    step: float
    moves: dict[str, float] = field(default_factory=dict)
    fault: str = ""


def scene_at(axis: str, value: float) -> Scene:
    """A block of the paper's shape beside a wall under a pulse, with one parameter changed."""
    values = {name: usual for name, (_, usual, _) in AXES.items()} | {axis: value}
    radius, unit = values["size"], math.sqrt(values["size"] / 9.81)
    block_period = 2.0 * math.pi * unit / math.sqrt(0.75)
    return Scene(
        name=f"{axis} {value:g}",
        block=Block(half_width=radius * math.sin(0.25), half_height=radius * math.cos(0.25)),
        floor=Floor(friction=values["friction"]),
        walls=(Wall(side="left", gap=0.03 * radius, restitution=values["restitution"]),),
        excitation=Ricker(amplitude=9.81 * SLOPE * values["shaking"], period=0.3 * block_period),
        duration=8.0 * unit,
        output_step=0.02 * unit,
    )


def fault_of(line: ModelSetup, scene: Scene, step: float) -> str:
    """How a run of that step (sqrt(R/g)) breaks, empty where it does not.

    "blows up", "sinks", "gains energy", or why the model refuses the scene.
    """
    unit, radius = math.sqrt(scene.block.radius / scene.gravity), scene.block.radius
    # The CM ends a step at each row.
    scene = scene.replace(output_step=max(scene.output_step, step * unit))
    # The CM's contact is as stiff as the block's size asks for.
    stiff = {"penetration": 1e-7 * radius} if line.family == "cm" else {}
    try:
        history = build(line.family, line.settings | {line.knob: step * unit} | stiff).simulate(
            scene
        )
    except errors.ModelFailure as error:
        return "sinks" if "through the floor" in str(error) else "blows up"
    except errors.InputError as error:
        return printable(error, 60)
    if not_finite(history):
        return "blows up"
    motion = Motion(scene, history)
    speed = float(np.max(np.hypot(motion.channels["x_dot"], motion.channels["y_dot"])))
    # The depth of one step is no fault.
    if motion.deepest > DEEPEST + 2.0 * step * speed * unit / radius:
        return "sinks"
    return "gains energy" if energy_without_source(motion) > MOST_ENERGY else ""


#: Push or shaking (at 1 Hz) under which a block should still stand, as a share of what would move
#: it.
CASES = {"left alone": 0.0, "pushed": 0.5, "shaken": 0.8}


def stand_still(label: str, case: str, duration: float) -> MapResult:
    """Plays the paper's block in a case in which it should not move."""
    block, mu, step = PAPER_BLOCK, 0.3, REST_STEP
    push = CASES[case] * 9.81 * min(SLOPE, mu)
    excitation: Rest | Record | Sine = Rest()
    if case == "pushed":
        excitation = Record.from_samples([push, push], time_step=duration + 1.0)
    elif case == "shaken":
        cycles = int(min(1000, max(duration - 1, 1)))
        excitation = Sine(amplitude=push, period=1.0, cycles=cycles)
    scene = Scene(
        name=case,
        block=block,
        floor=Floor(friction=mu),
        excitation=excitation,
        duration=duration,
        output_step=max(step, duration / 4000),
    )
    line = SETUPS[label]
    # the CM's own step makes an hour cheap
    steps = {} if line.family == "cm" else {line.knob: step}
    try:
        history = build(line.family, line.settings | steps).simulate(scene)
    except (errors.ModelFailure, errors.InputError) as error:
        return MapResult(duration, step, fault=printable(error, 120))
    channels, radius = history.channels, block.radius
    late = channels["t"] > 0.5 * channels["t"][-1]
    height = kinematics.pivot_height(block, channels["y"], channels["theta"])
    lifted = height + 2.0 * block.half_width * np.abs(np.sin(channels["theta"]))
    speed = np.sqrt(
        channels["x_dot"] ** 2 + channels["y_dot"] ** 2 + (radius * channels["theta_dot"]) ** 2
    )
    return MapResult(
        float(channels["t"][-1]),
        float(history.settings.get("time_step", step)) if line.family == "cm" else step,
        {
            "creep": history.extremes.slip / radius,
            "sinking": max(0.0, float(np.max(-height))) / radius,
            "rotation": history.extremes.peak_rotation / block.alpha,
            "uplift": max(0.0, float(np.max(lifted))) / radius,
            "jitter": float(np.sqrt(np.mean(speed[late] ** 2))) / math.sqrt(9.81 * radius)
            if late.any()
            else math.nan,
        },
        "" if not history.outcome.startswith("overturned") else history.outcome,
    )


@dataclass(frozen=True)
class MapPoint(Task):
    """A point of a map.

    It is a model with settings at a value of an axis, or a block that should stand for `value` s.
    `map_name` is the axis or, of `CASES`, the case.
    """

    line: str
    map_name: str
    value: float
    quick: bool = False

    def play(self) -> MapResult:
        """The largest stable step, from the finest up to the first that breaks; or movements."""
        if self.map_name in CASES:
            return stand_still(self.line, self.map_name, self.value)
        setup = SETUPS[self.line]
        scene = scene_at(self.map_name, self.value)
        steps = QUICK_STEPS if self.quick else STEPS
        largest_stable = 0.0
        for step in sorted(step for step in steps if step >= setup.finest):
            fault = fault_of(setup, scene, step)
            if fault:
                return MapResult(self.value, largest_stable, fault=fault)
            largest_stable = step
        return MapResult(self.value, largest_stable)


def map_points(quick: bool = False, models: Sequence[str] = ()) -> list[MapPoint]:
    """The maps of all `SETUPS` that are installed, the longest tasks first.

    `quick` has fewer values, steps and seconds; with `models` only theirs.
    """
    families = {model.split()[0] for model in models}
    lines = [
        label
        for label, setup in SETUPS.items()
        if not not_installed(setup.family) and (not families or setup.family in families)
    ]
    return _cases_at_rest(lines, quick) + _values_of_axes(lines, quick)


def _limits(quick: bool) -> dict[str, Any]:
    # A point takes far less than its time limit.
    return {"seconds": 600.0, "expected": 0.5 if quick else 4.0}


def _cases_at_rest(lines: Sequence[str], quick: bool) -> list[MapPoint]:
    points = []
    for case, line in itertools.product(CASES, lines):
        duration = PUSHED if CASES[case] else SETUPS[line].alone
        if quick:
            duration = QUICK_REST
        points.append(MapPoint(line, case, duration, **_limits(quick)))
    return points


def _values_of_axes(lines: Sequence[str], quick: bool) -> list[MapPoint]:
    points = []
    for axis, (_, _, values) in AXES.items():
        every = max(1, len(values) // QUICK_VALUES) if quick else 1
        for value, line in itertools.product(values[::every], lines):
            points.append(MapPoint(line, axis, value, quick, **_limits(quick)))
    return points
