"""Engines' parameters for a wanted restitution and friction, found by dropping and sliding a block.

In go engines and what is wanted; out come parameters in each engine's words, and what they reach.
`rockcheck conformance --tune` calls it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from rockcheck.engines import steps
from rockcheck.scenes import Floats, Floor, InputError, ModelFailure, Scene, printable
from rockcheck.validation.execute import models, pool
from rockcheck.validation.finding import Column, Finding, Mark, Table, text
from rockcheck.validation.studies.conformance.impacts import DROP
from rockcheck.validation.studies.conformance.phenomenon import SQUAT, G
from rockcheck.validation.study import Study, Task

#: Tolerance of the restitution, absolute, and of the friction, relative.
NEAR = 2e-3
SLIDING = 1.5  # m/s
#: Tries of the friction.
MOST_TRIES = 12
#: Allowed values of what is wanted: least and most.
WANTED = {
    "restitution": (0.0, 1.0),
    "friction": (1e-6, 1.3),
    "time_step": (1e-6, 0.01),
    "penetration": (0.0, math.inf),
}


@dataclass(frozen=True)
class Calibration:
    """Parameters in the engine's own words, and the contact reached with them.

    Reached are `restitution`, `friction` and `penetration` (m); `reached` tells whether they are
    near enough to the wanted ones.
    """

    parameters: dict[str, str]
    restitution: float
    friction: float
    penetration: float
    reached: bool


@dataclass(frozen=True)
class Tune(Task):
    """An engine's wanted restitution and friction, and largest penetration (m), at a step (s)."""

    engine: str
    restitution: float
    friction: float = 0.3
    time_step: float = 1e-3
    penetration: float = math.inf

    def __post_init__(self) -> None:
        for name, (least, most) in WANTED.items():
            value = getattr(self, name)
            if not isinstance(value, int | float) or not least <= value <= most:
                raise InputError(
                    f"{printable(value)} is not allowed: give {least:g} to {most:g}",
                    "--tune" if name == "restitution" else f"--set {name}",
                )

    def play(self) -> Calibration:
        """Parameters in the engine's own words, and the contact reached with them.

        The rebound of a block dropped from 0.2 m gives the restitution, the way of one sliding at
        1.5 m/s the friction. Raises `InputError` where the engine cannot reach the restitution,
        naming what it can.
        """
        model: Any = models.build(self.engine, {"time_step": self.time_step, "settings": "default"})
        bench = Bench(model, self.time_step, self.friction)
        restitution = self.restitution_parameter(bench, model.contact_parameters.range)
        friction, slid = bench.friction_parameter(restitution)
        rebound, depth = bench.drop(restitution)
        numbers = {"step": self.time_step, "restitution": restitution, "friction": friction}
        numbers |= model.tuned(self.time_step)
        numbers["push"] = -numbers.get("erp", 0.0) / self.time_step**2
        numbers["damp"] = -restitution / self.time_step
        words = model.contact_parameters.words
        return Calibration(
            {where: what.format_map(numbers) for where, what in words.items()},
            rebound,
            slid,
            max(depth, 0.0),
            reached=abs(rebound - self.restitution) <= 5.0 * NEAR
            and abs(slid - self.friction) <= 5.0 * NEAR * self.friction
            and depth <= self.penetration,
        )

    def restitution_parameter(self, bench: "Bench", ends: tuple[float, float]) -> float:
        """The engine's parameter between those `ends` that gives the wanted restitution."""
        from scipy.optimize import brentq

        wanted = self.restitution
        reached = [bench.drop(end)[0] for end in ends]
        if not min(reached) - NEAR <= wanted <= max(reached) + NEAR:
            raise InputError(
                f"{wanted:g} cannot be reached by {self.engine} at a step of {self.time_step:g} s:"
                f" {min(reached):.3g} to {max(reached):.3g} can",
                "--tune",
            )
        for end, restitution in zip(ends, reached, strict=True):
            if abs(restitution - wanted) <= NEAR:
                return end
        root: float = brentq(
            lambda parameter: bench.drop(parameter)[0] - wanted, *ends, xtol=1e-5, rtol=1e-5
        )
        return root


@dataclass(frozen=True)
class Bench:
    """An engine as it comes, its step (s), and the friction under which blocks drop and slide."""

    model: Any
    step: float
    friction: float

    def drop(self, restitution: float) -> tuple[float, float]:
        """Restitution of the rebound at that parameter, and penetration, m."""
        scene = Scene(
            name="drop",
            block=SQUAT,
            floor=Floor(friction=self.friction),
            initial_height=DROP,
            duration=0.65,
        )
        parameters = {"restitution": restitution, "friction": self.friction}
        heights = self.states(scene, parameters)[:, 1] - SQUAT.half_height
        later = heights[int((math.sqrt(2.0 * DROP / G) + 0.02) / self.step) :]
        return math.sqrt(max(float(np.max(later)), 0.0) / DROP), -float(np.min(heights))

    def friction_parameter(self, restitution: float) -> tuple[float, float]:
        """The parameter that gives the friction, and the friction that the slide shows."""
        scene = Scene(
            name="slide",
            block=SQUAT,
            floor=Floor(friction=self.friction),
            initial_velocity=SLIDING,
            duration=SLIDING / (self.friction * G) + 0.3,
        )
        parameter = self.friction
        for _ in range(MOST_TRIES):
            states = self.states(scene, {"restitution": restitution, "friction": parameter})
            slid = SLIDING**2 / (2.0 * G * float(states[-1, 0]))
            if abs(slid - self.friction) <= NEAR * self.friction:
                break
            parameter *= self.friction / slid
        return parameter, slid

    def states(self, scene: Scene, parameters: Mapping[str, float]) -> Floats:
        """The states at all step ends with the engine's parameters of contact."""
        step = self.step
        times: Floats = step * np.arange(math.ceil(scene.duration / step) + 1, dtype=np.float64)
        gravity = np.tile([0.0, -G], (len(times) - 1, 1))
        world = self.model.tuned_world(scene, parameters, step)
        try:
            world.ready(step)
            return steps.march_fixed(world, scene, times, gravity)[1]
        except ModelFailure as error:
            raise InputError(
                f"{self.model.name} cannot play a drop with these parameters: {error}",
                "--set time_step",
            ) from None
        finally:
            world.close()


@dataclass(frozen=True)
class Tuning(Study):
    """The wanted restitution and friction of each engine."""

    wanted: tuple[Tune, ...]
    name = "tuning"
    record = Calibration

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Tune]:
        """All at once."""
        return self.wanted

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """Tables of parameters and contacts reached. Raises `InputError` where no engine can."""
        found = {task: each for task, each in done.items() if isinstance(each, Calibration)}
        refused = [
            each for each in done.values() if isinstance(each, pool.Failure) and each.refused
        ]
        if refused and not found:
            raise InputError(refused[0].reason)
        reached = sum(calibration.reached for calibration in found.values())
        engines = {
            task.engine: {"engine": task.engine, "step": task.time_step, **asdict(calibration)}
            for task, calibration in found.items()
        }
        return Finding(
            self.name,
            "Parameters for a wanted restitution",
            f"{reached} of {len(self.wanted)} engines reach what is wanted.",
            [parameters_table(found), reached_table(found)],
            {"engines": engines},
            "pass" if reached == len(self.wanted) else "fail",
            int(reached < len(self.wanted)),
        )


def parameters_table(found: Mapping[Tune, Calibration]) -> Table:
    """What to set, in each engine's words."""
    return Table(
        "parameters",
        [Column("engine", kind="model"), text("where"), text("what")],
        [
            [task.engine, where, what]
            for task, calibration in found.items()
            for where, what in calibration.parameters.items()
        ],
        "Parameters",
    )


def reached_table(found: Mapping[Tune, Calibration]) -> Table:
    """What that gives."""
    rows = []
    for task, calibration in found.items():
        numbers = [calibration.restitution, calibration.friction, calibration.penetration]
        mark = Mark(calibration.reached, "pass" if calibration.reached else "fail")
        rows.append([task.engine, task.time_step, *numbers, mark])
    return Table(
        "reached",
        [
            Column("engine", kind="model"),
            Column("step", unit="s"),
            Column("restitution"),
            Column("friction"),
            Column("penetration", unit="m", digits=2),
            text("reached"),
        ],
        rows,
        "Reached",
    )
