"""The convergence study: beside a wall, engines and CM tend to the event-based model whose floor can only push, not to the paper's.

As the step falls, the error against `ebm-unilateral` is numerical and falls with it; the error against `ebm`, which excludes
flight, ends at the difference in form between the two.
"""

from __future__ import annotations

import itertools
import math
import os
import time
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from statistics import median
from typing import Literal

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.horizon import predictability_horizon
from rockcheck.scenes import History, InputError, ModelFailure, Scene, Wall
from rockcheck.scenes.progress import OnProgress, unheard
from rockcheck.scenes.writing import json_text, records_text, write_whole
from rockcheck.validation.bench.scenes import pulse
from rockcheck.validation.discrepancy.compare import compare
from rockcheck.validation.execute.models import build, not_installed
from rockcheck.validation.execute.pool import Call, Pool
from rockcheck.validation.execute.study import Study, header

Reference = Literal["ebm-unilateral", "ebm"]
REFERENCES: tuple[Reference, ...] = ("ebm-unilateral", "ebm")
REFERENCE_TOLERANCE = 1e-12
#: Longest run, s; the horizon of predictability may end it before.
DURATION = 5.0
#: A run counts as converged if its error at the finest setting is at most this (alpha) ...
LEVEL = 1e-3
#: ... and its order in the step at least this, where the finest error is not already below `ROUNDED` (alpha).
LEAST_ORDER, ROUNDED = 0.5, 1e-6


@dataclass(frozen=True)
class StepSweep:
    """A model and the setting that is refined, coarse to fine; one that has no restitution plays the scenes without it."""

    model: str
    knob: str
    values: tuple[float, ...]
    bounces: bool = True

    def plays(self, scene: Scene) -> bool:
        """Whether the model can play a scene of the study."""
        return self.bounces or not any(wall.restitution for wall in scene.walls)


#: The step of the CM is 3/sqrt(k/m), k/m = g/penetration: with these penetrations (m) 8e-4, 9e-5 and 1e-5 s.
SWEEPS = {
    sweep.model: sweep
    for sweep in (
        StepSweep("mujoco", "time_step", (1e-3, 1e-4, 1e-5)),
        StepSweep("pybullet", "time_step", (1e-3, 1e-4, 1e-5)),
        StepSweep("pymunk", "time_step", (1e-3, 1e-4, 1e-5)),
        StepSweep("dart", "time_step", (1e-3, 1e-4)),  # softer than it could tell below
        StepSweep("drake", "time_step", (1e-3, 1e-4), bounces=False),
        StepSweep("cm", "penetration", (1e-6, 1e-8, 1e-10)),
    )
}
#: omega_p/p, a_p/(g tan alpha) and friction of pulses that hit a left wall at every gap, and leave the block standing.
PULSES = {"long": (3.0, 2.5, 0.3), "medium": (4.5, 2.5, 0.3), "short": (6.0, 2.5, 0.6)}
GAPS, RESTITUTIONS = (0.003, 0.053, 0.103), (0.0, 0.5)


def _beside_a_wall(name: str, gap: float, restitution: float) -> Scene:
    walls = (Wall(side="left", gap=gap, restitution=restitution),)
    return pulse(*PULSES[name], walls=walls, name=f"{name} {1e3 * gap:g} mm e {restitution:g}").replace(duration=DURATION)


SCENES = {scene.name: scene for scene in itertools.starmap(_beside_a_wall, itertools.product(PULSES, GAPS, RESTITUTIONS))}
#: The scenes of `--quick`.
QUICK = ("long 53 mm e 0.5", "medium 53 mm e 0", "short 3 mm e 0")


@dataclass(frozen=True)
class StudyScene:
    """A scene of the study: the time (s) it is compared up to, and how the references end and differ (RMS of theta, alpha)."""

    scene: str
    horizon: float
    model_form: float
    ends: dict[Reference, str]


@dataclass(frozen=True)
class SweepRun:
    """One run: its step in s, and its RMS error of theta in alpha against each reference; NaN with a `failure`."""

    scene: str
    model: str
    value: float
    step: float = math.nan
    against_unilateral: float = math.nan
    against_ebm: float = math.nan
    cpu: float = math.nan
    failure: str = ""

    def error(self, reference: Reference) -> float:
        """The error against a reference; infinite for a run that failed."""
        error = self.against_unilateral if reference == "ebm-unilateral" else self.against_ebm
        return math.inf if self.failure or math.isnan(error) else error


@dataclass(frozen=True)
class Level:
    """All runs of a model at one setting: errors (alpha) against a reference; `within`: how many are at most `LEVEL`."""

    model: str
    reference: Reference
    value: float
    step: float
    median: float
    largest: float
    runs: int
    within: int


@dataclass(frozen=True)
class Order:
    """Slope of log error over log step, by least squares: of the median error, or in one `scene` where that is not empty."""

    model: str
    reference: Reference
    order: float
    scene: str = ""


@dataclass(frozen=True, kw_only=True)
class Convergence(Study):
    """What was found."""

    cases: tuple[StudyScene, ...]
    plays: tuple[SweepRun, ...]
    levels: tuple[Level, ...]
    orders: tuple[Order, ...]
    #: A line each: the runs that do not converge to the unilateral model.
    exceptions: tuple[str, ...]

    @property
    def model_form(self) -> float:
        """Median difference between the references, alpha."""
        return median(case.model_form for case in self.cases)

    def order(self, model: str, reference: Reference, scene: str = "") -> float:
        """The observed order of a model; NaN where it cannot be fitted."""
        return next((o.order for o in self.orders if (o.model, o.reference, o.scene) == (model, reference, scene)), math.nan)

    def level(self, model: str, reference: Reference, value: float) -> Level:
        """A model's errors at one setting."""
        return next(one for one in self.levels if (one.model, one.reference, one.value) == (model, reference, value))

    def line(self, model: str, scene: str) -> list[SweepRun]:
        """The runs of a model in a scene, coarse to fine."""
        return [play for play in self.plays if (play.model, play.scene) == (model, scene)]

    def models(self, scene: str = "") -> list[str]:
        """The models that were played, or that played a scene."""
        return list(dict.fromkeys(play.model for play in self.plays if scene in ("", play.scene)))


@cache
def _prepared(name: str) -> tuple[Scene, dict[Reference, History]]:
    """A scene cut at its horizon of predictability, and how the references play it; they take milliseconds."""
    scene = SCENES[name]
    scene = scene.replace(duration=min(scene.duration, predictability_horizon(scene)))
    unilateral, paper = (EventBasedModel(pivot=pivot, tolerance=REFERENCE_TOLERANCE) for pivot in ("unilateral", "bilateral"))
    return scene, {"ebm-unilateral": unilateral.simulate(scene), "ebm": paper.simulate(scene)}


def study_scene(name: str) -> StudyScene:
    """What is to be known of a scene before any model is refined in it."""
    scene, played = _prepared(name)
    form = _rms(played["ebm-unilateral"], played["ebm"])
    return StudyScene(name, scene.duration, form, {reference: played[reference].outcome for reference in REFERENCES})


def play(name: str, model: str, value: float) -> SweepRun:
    """Plays one scene with a model at one value of the setting that is refined."""
    scene, references = _prepared(name)
    try:
        history = build(model, {SWEEPS[model].knob: value}).simulate(scene)
    except (ModelFailure, InputError, ImportError) as error:
        return SweepRun(name, model, value, failure=str(error))
    return SweepRun(
        name,
        model,
        value,
        step=float(history.settings["time_step"]),
        against_unilateral=_rms(references["ebm-unilateral"], history),
        against_ebm=_rms(references["ebm"], history),
        cpu=history.cost.cpu_seconds,
    )


def _rms(reference: History, candidate: History) -> float:
    return compare(reference, candidate, measures=["theta_rms"])["theta_rms"]


def run_convergence(*, quick: bool = False, jobs: int | None = None, on_progress: OnProgress = unheard) -> Convergence:
    """Plays every scene with every model that is installed at every setting in `jobs` processes (default: one a core).

    `quick`: the scenes `QUICK` without the finest settings, in this process.
    """
    began, jobs = time.monotonic(), 1 if quick else jobs or os.cpu_count() or 1
    names = QUICK if quick else tuple(SCENES)
    cases = [study_scene(name) for name in names]
    planned = [
        (name, sweep.model, value)
        for place in range(2 if quick else 3)
        for sweep in SWEEPS.values()
        if not not_installed(sweep.model)
        for name in names
        if sweep.plays(SCENES[name])
        for value in sweep.values[place : place + 1]
    ]
    plays: list[SweepRun] = []
    for found in itertools.starmap(play, planned) if jobs == 1 else _side_by_side(planned[::-1], jobs):  # the longest first
        plays.append(found)
        on_progress(len(plays), len(planned), f"{found.scene}, {found.model}")
    return evaluated(cases, plays, quick=quick, jobs=jobs, began=began)


def _side_by_side(planned: Sequence[tuple[str, str, float]], jobs: int) -> Iterable[SweepRun]:
    with Pool(jobs) as pool:
        for ended in pool.run(deque(Call(play, one) for one in planned)):
            scene, model, value = ended.call.arguments
            yield SweepRun(scene, model, value, failure=ended.fault) if ended.error else ended.result


def evaluated(
    cases: Sequence[StudyScene], plays: Iterable[SweepRun], *, quick: bool = False, jobs: int = 1, began: float = math.nan
) -> Convergence:
    """What the runs say; they `began` at that time (of `time.monotonic`)."""
    place = {name: n for n, name in enumerate([*SCENES, *SWEEPS])}
    ordered = sorted(plays, key=lambda one: (place[one.model], place[one.scene], -one.value))
    levels: list[Level] = []
    orders: list[Order] = []
    for model in dict.fromkeys(one.model for one in ordered):
        for reference in REFERENCES:
            mine = [one for one in ordered if one.model == model]
            values = sorted({one.value for one in mine}, reverse=True)
            found = [_level([one for one in mine if one.value == value], reference) for value in values]
            levels += found
            orders.append(Order(model, reference, slope([(level.step, level.median) for level in found])))
            for case in cases:
                points = [(one.step, one.error(reference)) for one in mine if one.scene == case.scene]
                orders.append(Order(model, reference, slope(points), case.scene))
    return Convergence(
        **header("convergence", quick=quick, jobs=jobs, began=began),
        cases=tuple(cases),
        plays=tuple(ordered),
        levels=tuple(levels),
        orders=tuple(orders),
        exceptions=tuple(_exceptions(ordered, orders)),
    )


def _level(plays: Sequence[SweepRun], reference: Reference) -> Level:
    errors = [one.error(reference) for one in plays]
    steps = [one.step for one in plays if not one.failure]
    return Level(
        model=plays[0].model,
        reference=reference,
        value=plays[0].value,
        step=median(steps) if steps else math.nan,
        median=median(errors),
        largest=max(errors),
        runs=len(plays),
        within=sum(error <= LEVEL for error in errors),
    )


def slope(points: Iterable[tuple[float, float]]) -> float:
    """Slope of log error over log step by least squares; NaN with fewer than two finite points."""
    usable = [(math.log(step), math.log(error)) for step, error in points if math.isfinite(step) and 0.0 < error < math.inf]
    if len(usable) < 2:
        return math.nan
    x, y = np.array(usable).T
    return float(np.polyfit(x, y, 1)[0])


def _exceptions(plays: Sequence[SweepRun], orders: Sequence[Order]) -> Iterable[str]:
    """The runs that fail or do not converge to the unilateral model, a line each."""
    fitted = {(order.model, order.scene): order.order for order in orders if order.reference == "ebm-unilateral"}
    for (model, scene), group in itertools.groupby(plays, key=lambda one: (one.model, one.scene)):
        line = list(group)
        for one in line:
            if one.failure:
                yield f"{scene}, {model} at {SWEEPS[model].knob} {one.value:g} failed: {one.failure}"
        finest, order = line[-1].error("ebm-unilateral"), fitted[model, scene]
        if math.isfinite(finest) and (finest > LEVEL or (finest > ROUNDED and not order >= LEAST_ORDER)):
            errors = " → ".join(f"{one.error('ebm-unilateral'):.1e}" for one in line)
            yield f"{scene}, {model}: {errors} α, order {order:.2f}"


def save(found: Convergence, folder: Path) -> None:
    """Writes the tables as CSV, and run.json with all else, into a folder."""
    tables: dict[str, tuple[type, Sequence[object]]] = {
        "runs": (SweepRun, found.plays),
        "levels": (Level, found.levels),
        "orders": (Order, found.orders),
    }
    for name, (kind, rows) in tables.items():
        write_whole(folder / f"{name}.csv", records_text(kind, rows))
    rest = {name: value for name, value in asdict(found).items() if name not in ("plays", "levels", "orders")}
    write_whole(folder / "run.json", json_text(rest) + "\n")
