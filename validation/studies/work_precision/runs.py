"""Work and precision: what an error costs with each model, scene by scene, and what it converges
to."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter
from statistics import median
from typing import Any

import numpy as np

from rockcheck.scenes import History
from rockcheck.validation.discrepancy.compare import compare
from rockcheck.validation.discrepancy.measures import IMPACTS
from rockcheck.validation.execute.models import build
from rockcheck.validation.studies.work_precision.scenes import FAMILIES, WALLS, prepared
from rockcheck.validation.study import Task

#: Errors at which each model's cost is given, alpha.
LEVEL = 1e-3
#: The cost at which engines are compared in their league, CPU s a simulated second.
EQUAL_COST = 0.02
#: Runs at least this long (s) are timed once, shorter ones `REPEATS` times.
LONG_ENOUGH, REPEATS = 0.02, 3
#: An engine's step (s) below which its runs are played side by side in worker processes, after all
#: others.
SIDE_BY_SIDE = 1e-4
#: An order is fitted to median errors between these, alpha: below is rounding, above nothing
#: converges yet.
FITTED = 3e-13, 0.2


@dataclass(frozen=True)
class DiagramLine:
    """A line of the diagrams: a model, the setting that is swept, coarse to fine, and the model
    that is its reference."""

    label: str
    model: str
    knob: str
    values: tuple[float, ...]
    fixed: dict[str, Any] = field(default_factory=dict, hash=False)
    reference: str = "ebm-unilateral"
    #: The values of `--quick`, and those beside a wall, by which convergence is judged.
    quick: tuple[float, ...] = ()
    converge: tuple[float, ...] = ()
    remark: str = ""

    def settings(self, value: float) -> dict[str, Any]:
        """The model's settings at one value."""
        return {self.knob: value, **self.fixed}


_TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
_STEPS = (1e-2, 1e-3, 1e-4, 3e-5)
#: Three steps tell an order; the CM's step is 3/sqrt(k/m), k/m = g/penetration: 8e-4, 9e-5 and 1e-5
#: s.
_CONVERGE = {"mujoco": 3, "pybullet": 3, "pymunk": 3, "dart": 2, "drake": 2}
_REFINED, _PENETRATIONS = (1e-3, 1e-4, 4e-5), (1e-6, 1e-8, 1e-10)
_LARGEST = (8e-3, 4e-3, 2e-3, 1e-3)
#: The dearer a step, the fewer of them: the time of the whole benchmark is limited.
ENGINE_STEPS = {
    "mujoco": _STEPS,
    "pybullet": _STEPS,
    "pymunk": _STEPS[:3],
    "dart": _STEPS[:3],
    "drake": _STEPS[:2],
    "box2d": _STEPS[:3],
    "physx": _STEPS[:3],
    "jolt": _STEPS[:3],
}
#: Engines whose steps cannot vary. Those in single precision are not asked what they converge to.
FIXED = ("drake", "box2d", "physx", "jolt")
LINES = {
    line.label: line
    for line in (
        DiagramLine("ebm", "ebm", "tolerance", _TOLERANCES, reference="ebm", quick=_TOLERANCES),
        DiagramLine(
            "ebm-unilateral", "ebm-unilateral", "tolerance", _TOLERANCES, quick=_TOLERANCES
        ),
        DiagramLine(
            "ebm-bouc-wen",
            "ebm-bouc-wen",
            "yield_displacement",
            (1e-4, 1e-5, 1e-6),
            reference="ebm",
            quick=(1e-4, 1e-5),
        ),
        DiagramLine(
            "cm",
            "cm",
            "penetration",
            (1e-4, 1e-5, 1e-6, 1e-7, 1e-8),
            quick=(1e-5, 1e-6, 1e-7),
            converge=_PENETRATIONS,
            remark="step tied to the penetration",
        ),
        *(
            line
            for engine, steps in ENGINE_STEPS.items()
            for line in (
                DiagramLine(
                    engine,
                    engine,
                    "time_step",
                    steps,
                    quick=steps[:3],
                    converge=_REFINED[: _CONVERGE.get(engine, 0)],
                ),
                DiagramLine(
                    f"{engine} adaptive",
                    engine,
                    "largest_step",
                    _LARGEST,
                    {"time_step": "adaptive"},
                    quick=_LARGEST[1:3],
                ),
                DiagramLine(
                    f"{engine} default",
                    engine,
                    "time_step",
                    steps[:3],
                    {"settings": "default"},
                    quick=_STEPS[:2],
                ),
            )
            if engine not in FIXED or "adaptive" not in line.label
        ),
    )
}
#: Kinds of scenes over which the engines' settings are summed up: how the families' names begin.
KINDS = {
    "free, pulses": ("free", "pulse"),
    "slip, walls": ("slip", "wall"),
    "records": ("fig",),
    "all": ("",),
}
#: Kinds of scenes in each of which an engine has to meet `LEVEL`.
LEAGUE = {"free": ("free",), "pulse": ("pulse",), "wall": ("wall",)}
#: What is not measured, and why.
LEFT_OUT = (
    "default settings at a step of 3e-5 s: at 1e-4 s they have stopped converging, or converge as"
    " at larger steps",
    "PyBullet's other solvers and MuJoCo's RK4 and pyramidal cone: no better limit, or none, at"
    " more cost",
    "pymunk and DART at 3e-5 s and Drake below 1e-3 s: a simulated second of Drake at 1e-4 s takes"
    " it more than a second",
    "native batches of an engine (mujoco.rollout): they cannot end a step at an event; their cost"
    " is in the table of savings",
    "measured histories: they have no cost",
)


@dataclass(frozen=True)
class Play(Task):
    """One run: a member of a family of scenes, played by a line of the diagrams at one value."""

    family: str
    member: int
    line: str
    value: float
    repeats: int = REPEATS


@dataclass(frozen=True)
class BenchmarkRun:
    """One run: where, with what, its errors against the reference of its kind of model, and its
    cost.

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

    def error(self, reference: str) -> float:
        """The RMS error against one of the references; infinite where the run failed."""
        error = self.rms if reference == "ebm-unilateral" else self.against_ebm
        return math.inf if self.failure or math.isnan(error) else error


@dataclass(frozen=True)
class Point:
    """A setting of a line in a family, or in a kind of scenes: median error with its 10-90 % band
    and the worst, and median cost a simulated second.

    A run that failed counts as infinitely wrong.
    """

    family: str
    line: str
    value: float
    runs: int
    failed: int
    rms: float
    rms_10: float
    rms_90: float
    largest: float
    peak: float
    first_impact: float
    cpu: float
    wall: float
    set_up: float
    steps: float
    rms_worst: float = math.nan


@dataclass(frozen=True)
class Trend:
    """A line in a family: its order of convergence in the swept setting, and what an error of
    `LEVEL` costs.

    `order` is NaN where fewer than two settings can be fitted. `cpu` is in s a simulated second,
    NaN where the level is not reached; `at_coarsest` where already the coarsest setting reaches it.
    `ratio` is to the `ebm` line's.
    """

    family: str
    line: str
    order: float
    cpu: float
    at_coarsest: bool
    ratio: float


def play(task: Play) -> BenchmarkRun:
    """Plays one member with one setting; short runs several times, for the median time."""
    line, ready = LINES[task.line], prepared(task.family, task.member)
    model = build(line.model, line.settings(task.value))
    history = model.simulate(ready.scene)
    costs = [history.cost]
    while len(costs) < task.repeats and costs[0].wall_seconds < LONG_ENOUGH:
        costs.append(model.simulate(ready.scene).cost)
    paper = compare(ready.references["ebm"], history, measures=["theta_rms"])["theta_rms"]
    return BenchmarkRun(
        task.family,
        task.member,
        task.line,
        task.value,
        ready.horizon,
        **errors_of(ready.references[line.reference], history),
        against_ebm=paper,
        step=float(history.settings.get("time_step", math.nan))
        if line.knob != "largest_step"
        else task.value,
        cpu=median(cost.cpu_seconds for cost in costs),
        wall=median(cost.wall_seconds for cost in costs),
        set_up=median(cost.set_up for cost in costs),
        steps=costs[0].steps,
    )


def lost(task: Play, reason: str) -> BenchmarkRun:
    """What stands in the place of a run that failed."""
    horizon = prepared(task.family, task.member).horizon
    return BenchmarkRun(task.family, task.member, task.line, task.value, horizon, failure=reason)


def errors_of(reference: History, history: History) -> dict[str, Any]:
    """The errors of a `BenchmarkRun`."""
    found = compare(reference, history, measures=["theta_rms", "theta_peak"])
    alpha = reference.alpha or 1.0
    first = [
        min((event.t for event in h.event_list if event.kind in IMPACTS), default=math.nan)
        for h in (reference, history)
    ]
    return {
        "rms": found["theta_rms"],
        "largest": found["theta_peak"],
        "peak": abs(history.peak_rotation - reference.peak_rotation) / alpha,
        "first_impact": abs(first[1] - first[0]),
    }


def grouped(found: Iterable[Any], *names: str) -> dict[Any, list[Any]]:
    """By the values of these fields, in the order in which they come."""
    groups: dict[Any, list[Any]] = {}
    for one in found:
        groups.setdefault(attrgetter(*names)(one), []).append(one)
    return groups


def points_of(samples: Sequence[BenchmarkRun]) -> list[Point]:
    """The settings of all lines in all families, in their order."""
    order = {name: n for n, name in enumerate([*FAMILIES, *LINES])}
    ordered = sorted(samples, key=lambda one: (order[one.family], order[one.line], -one.value))
    return [_point(some) for some in grouped(ordered, "family", "line", "value").values()]


def trends_of(points: Sequence[Point]) -> list[Trend]:
    """Order and cost of each line in each family."""
    lines, found = grouped(points, "family", "line"), []
    for (family, label), line in lines.items():
        cpu, at_coarsest = cost_at(line)
        ratio = cpu / cost_at(lines.get((family, "ebm"), []))[0]
        found.append(Trend(family, label, order_of(line), cpu, at_coarsest, ratio))
    return found


def _point(samples: Sequence[BenchmarkRun]) -> Point:
    good = [sample for sample in samples if not sample.failure]
    errors = [sample.error("ebm-unilateral") for sample in samples]
    failed = len(samples) - len(good)

    def middling(name: str, *, a_second: bool = False) -> float:
        values = [getattr(s, name) / (s.horizon if a_second else 1.0) for s in good]
        known = [value for value in values if not math.isnan(value)]
        return median(known) if known else math.nan

    return Point(
        family=samples[0].family,
        line=samples[0].line,
        value=samples[0].value,
        runs=len(samples),
        failed=failed,
        rms=quantile(errors, 0.5),
        rms_10=quantile(errors, 0.1),
        rms_90=quantile(errors, 0.9),
        largest=middling("largest"),
        peak=middling("peak"),
        first_impact=middling("first_impact"),
        cpu=middling("cpu", a_second=True),
        wall=middling("wall", a_second=True),
        set_up=middling("set_up"),
        steps=middling("steps", a_second=True),
        rms_worst=math.inf if failed else max(one.rms for one in good),
    )


def pooled(
    samples: Sequence[BenchmarkRun], kinds: Mapping[str, tuple[str, ...]] = KINDS
) -> list[Point]:
    """Every setting of the engines' lines over all scenes of each kind, which is its `family`."""
    found = []
    for kind, starts in kinds.items():
        groups = grouped((s for s in samples if s.family.startswith(starts)), "line", "value")
        found += [
            replace(_point(groups[label, value]), family=kind)
            for label, line in LINES.items()
            for value in line.values
            if line.model in ENGINE_STEPS and (label, value) in groups
        ]
    return found


def at_the_cost(point: Point, points: Sequence[Point]) -> float:
    """The error of the engine's adaptive line at a point's CPU time, interpolated; NaN outside its
    range."""
    adaptive = f"{LINES[point.line].model} adaptive"
    line = [p for p in points if (p.family, p.line) == (point.family, adaptive)]
    return error_at(line, point.cpu)


def league(found: Sequence[Point]) -> list[tuple[str, float, float, float, float]]:
    """The engines' lines over pulses and free rocking, the cheapest at an error of `LEVEL` first;
    those that never reach it last, by their best error.

    Line, CPU time (s a simulated second) of an error of `LEVEL`, RMS error (alpha) at `EQUAL_COST`,
    least error at any setting that was played, and its cost; NaN where it does not reach so far.
    """
    rows, kind = [], next(iter(KINDS))
    for label, mine in grouped((one for one in found if one.family == kind), "line").items():
        if good := [one for one in mine if math.isfinite(one.rms)]:
            best = min(good, key=lambda one: one.rms)
            at_cost = error_at(mine, EQUAL_COST)
            rows.append((label, cost_at(mine)[0], at_cost, best.rms, best.cpu))
    return sorted(rows, key=lambda row: (math.isnan(row[1]), row[3 if math.isnan(row[1]) else 1]))


def first_steps(samples: Sequence[BenchmarkRun]) -> list[tuple[str, dict[str, float], float]]:
    """The engines' lines: the largest step (s) whose median error is at most `LEVEL`, in each kind
    of `LEAGUE` and in all of them, NaN where none is; and the smallest step that was played."""
    rows = []
    for label, line in grouped(pooled(samples, LEAGUE), "line").items():
        steps = {one.value for one in line}
        met = {
            kind: {one.value for one in line if one.family == kind and one.rms <= LEVEL}
            for kind in LEAGUE
        }
        met["all"] = set.intersection(*met.values())
        largest = {kind: max(values, default=math.nan) for kind, values in met.items()}
        rows.append((label, largest, min(steps)))
    return rows


def error_at(line: Sequence[Point], cpu: float) -> float:
    """Median error of a line, coarse to fine, at a CPU time, both interpolated on logarithmic axes;
    NaN outside its range."""
    for a, b in itertools.pairwise(line):
        if a.cpu <= cpu <= b.cpu and a.cpu < b.cpu and b.rms > 0.0 and math.isfinite(a.rms):
            share = math.log(cpu / a.cpu) / math.log(b.cpu / a.cpu)
            return float(a.rms * (b.rms / a.rms) ** share)
    return math.nan


def quantile(values: Sequence[float], share: float) -> float:
    """The value below which `share` of the sample lies, halfway between two where it lies between
    them; values may be infinite."""
    ordered, place = sorted(values), share * len(values)
    below = ordered[max(math.ceil(place - 1e-9) - 1, 0)]
    above = ordered[min(math.floor(place + 1e-9), len(values) - 1)]
    return 0.5 * (below + above)


def order_of(line: Sequence[Point]) -> float:
    """Slope of log median error over log of the swept setting, by least squares; NaN with fewer
    than two points."""
    return slope((p.value, p.rms) for p in line if FITTED[0] < p.rms < FITTED[1])


def cost_at(line: Sequence[Point], level: float = LEVEL) -> tuple[float, bool]:
    """CPU s a simulated second at a median error of `level`, and whether the coarsest setting
    already reaches it.

    Between settings both logarithms are interpolated linearly; NaN where no setting reaches the
    level. The cheapest counts.
    """
    costs = [(p.cpu, n == 0) for n, p in enumerate(line) if p.rms <= level]
    for a, b in itertools.pairwise(line):
        if a.rms > level >= b.rms > 0.0 and math.isfinite(a.rms):
            share = math.log(a.rms / level) / math.log(a.rms / b.rms)
            costs.append((a.cpu * (b.cpu / a.cpu) ** share, False))
    return min(costs, default=(math.nan, False))


def slope(points: Iterable[tuple[float, float]]) -> float:
    """Slope of log error over log step by least squares; NaN with fewer than two usable steps."""
    usable = [
        (math.log(step), math.log(error))
        for step, error in points
        if math.isfinite(step) and 0.0 < error < math.inf
    ]
    if len({step for step, _ in usable}) < 2:
        return math.nan
    x, y = np.array(usable).T
    return float(np.polyfit(x, y, 1)[0])


# Convergence: beside a wall engines and CM tend to the model whose floor can only push, not to the
# paper's.

REFERENCES = ("ebm-unilateral", "ebm")
#: A run counts as converged if its order in the step is at least this, where the finest error is
#: not already below `ROUNDED` (alpha).
LEAST_ORDER, ROUNDED = 0.5, 1e-6


@dataclass(frozen=True)
class Level:
    """All wall scenes by a model at one setting: errors (alpha) against a reference; `within`: how
    many are at most `LEVEL`."""

    model: str
    reference: str
    value: float
    step: float
    median: float
    largest: float
    runs: int
    within: int


@dataclass(frozen=True)
class Order:
    """Slope of log error over log step: of the median error, or in one `scene` where that is not
    empty."""

    model: str
    reference: str
    order: float
    scene: str = ""


def levels_of(samples: Sequence[BenchmarkRun]) -> list[Level]:
    """The wall scenes' errors by model, reference and setting, coarse to fine."""
    ordered = sorted(samples, key=lambda one: (list(LINES).index(one.line), -one.value))
    groups, found = grouped(ordered, "line", "value"), []
    for reference, ((model, value), runs) in itertools.product(REFERENCES, groups.items()):
        errors = [one.error(reference) for one in runs]
        steps = [one.step for one in runs if not one.failure] or [math.nan]
        within = sum(error <= LEVEL for error in errors)
        sizes = median(errors), max(errors), len(runs), within
        found.append(Level(model, reference, value, median(steps), *sizes))
    return found


def orders_of(samples: Sequence[BenchmarkRun], levels: Sequence[Level]) -> list[Order]:
    """Observed orders by model and reference: of the medians, and scene by scene."""
    lines, found = grouped(samples, "line", "family"), []
    for (model, reference), mine in grouped(
        sorted(levels, key=lambda level: list(LINES).index(level.model)), "model", "reference"
    ).items():
        medians = slope((level.step, level.median) for level in mine)
        found.append(Order(model, reference, medians))
        for scene in (scene for scene in WALLS if (model, scene) in lines):
            steps = ((one.step, one.error(reference)) for one in lines[model, scene])
            found.append(Order(model, reference, slope(steps), scene))
    return found


def exceptions_of(samples: Sequence[BenchmarkRun], orders: Sequence[Order]) -> Iterable[str]:
    """The wall scenes in which a model does not converge to the unilateral one, a line each."""
    lines = grouped(sorted(samples, key=lambda one: -one.value), "line", "family")
    for one in orders:
        if not one.scene or one.reference != REFERENCES[0]:
            continue
        errors = [run.error(one.reference) for run in lines[one.model, one.scene]]
        slow = errors[-1] > ROUNDED and not one.order >= LEAST_ORDER
        if math.isfinite(errors[-1]) and (errors[-1] > LEVEL or slow):
            said = " → ".join(f"{error:.1e}" for error in errors)
            yield f"{one.scene}, {one.model}: {said} α, order {one.order:.2f}"
