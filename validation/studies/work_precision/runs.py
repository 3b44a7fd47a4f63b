"""A run of the benchmark: a member of a family of scenes by a line of the diagrams.

In: `Play`. Out: `BenchmarkRun`, its errors against its reference and its cost.
"""

import math
from dataclasses import dataclass
from statistics import median
from typing import Any

from rockcheck.scenes import Cost, History, Scene
from rockcheck.validation.discrepancy import impacts
from rockcheck.validation.discrepancy.compare import compare
from rockcheck.validation.execute import models
from rockcheck.validation.studies.work_precision.benchmark_scenes import prepared
from rockcheck.validation.studies.work_precision.lines import LINES, DiagramLine
from rockcheck.validation.study import Task

#: Runs at least this long (s) are timed once, shorter ones `REPEATS` times.
LONG_ENOUGH, REPEATS = 0.02, 3


@dataclass(frozen=True)
class BenchmarkRun:
    """One run: its scene and setting, its errors against its reference, and its cost.

    `rms` and `largest` are those of theta up to the horizon, `peak` the error of the largest
    |theta|, all in alpha; `against_ebm` the RMS error against the paper's model; `first_impact`
    the error of the first impact's time and `step` the model's, s. A run that failed has NaN errors
    and the reason.
    """

    family: str
    member: int
    line: str
    value: float
    horizon: float
    rms: float = math.nan
    largest: float = math.nan
    peak: float = math.nan
    first_impact: float = math.nan
    against_ebm: float = math.nan
    step: float = math.nan
    cpu: float = math.nan
    wall: float = math.nan
    set_up: float = math.nan
    steps: int = 0
    failure: str = ""


@dataclass(frozen=True)
class Play(Task):
    """One run: a member of a family of scenes, played by a line of the diagrams at one value."""

    family: str
    member: int
    line: str
    value: float
    repeats: int = REPEATS

    def record(self, **results: Any) -> BenchmarkRun:
        """The row of the run, with its results."""
        return BenchmarkRun(
            self.family,
            self.member,
            self.line,
            self.value,
            prepared(self.family, self.member).scene.duration,
            **results,
        )

    def play(self) -> list[BenchmarkRun]:
        """Plays the member with the setting; short runs several times, for the median time."""
        line, ready = LINES[self.line], prepared(self.family, self.member)
        model = models.build(line.family, {line.knob: self.value, **line.settings})
        history = model.simulate(ready.scene)
        costs = self._costs(model, ready.scene, history.cost)
        paper = compare(ready.references["ebm"], history, measures=["theta_rms"])
        run = self.record(
            **errors_of(ready.references[line.reference], history),
            against_ebm=paper["theta_rms"],
            step=self._step(line, history),
            cpu=median(cost.cpu_seconds for cost in costs),
            wall=median(cost.wall_seconds for cost in costs),
            set_up=median(cost.set_up for cost in costs),
            steps=costs[0].steps,
        )
        return [run]

    def _costs(self, model: models.Model, scene: Scene, first: Cost) -> list[Cost]:
        """The cost of the first run, and of those that repeat it where it was short."""
        if first.wall_seconds >= LONG_ENOUGH:
            return [first]
        return [first, *(model.simulate(scene).cost for _ in range(self.repeats - 1))]

    def _step(self, line: DiagramLine, history: History) -> float:
        """The model's step, s: of adaptive ones the largest; NaN where it has none."""
        if line.knob == "largest_step":
            return self.value
        step = history.settings.get("time_step", math.nan)
        return math.nan if step == models.ADAPTIVE else float(step)


def errors_of(reference: History, history: History) -> dict[str, float]:
    """Errors of a history against its reference, by their names in `BenchmarkRun`."""
    errors = compare(reference, history, measures=["theta_rms", "theta_peak"])
    peak_error = abs(history.peak_rotation - reference.peak_rotation)
    return {
        "rms": errors["theta_rms"],
        "largest": errors["theta_peak"],
        "peak": peak_error / (reference.alpha or 1.0),
        "first_impact": abs(first_impact(history) - first_impact(reference)),
    }


def first_impact(history: History) -> float:
    """The time of the first impact, s; NaN where there is none."""
    times = [event.t for event in history.event_list if event.kind in impacts.IMPACTS]
    return min(times, default=math.nan)
