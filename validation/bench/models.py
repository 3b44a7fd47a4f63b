"""Work and precision: what an error costs with each model, scene by scene."""

from __future__ import annotations

import itertools
import math
import time
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import Any

from rockcheck.scenes import History, InputError, ModelFailure
from rockcheck.scenes.progress import OnProgress, unheard
from rockcheck.validation.bench.convergence import slope
from rockcheck.validation.bench.scenes import FAMILIES, MEMBERS, QUICK, prepared
from rockcheck.validation.discrepancy.compare import compare
from rockcheck.validation.discrepancy.measures import IMPACTS
from rockcheck.validation.execute.models import build, not_installed
from rockcheck.validation.execute.pool import Call, Pool

#: Errors at which each model's cost is given, alpha.
LEVEL = 1e-3
#: The cost at which engines are compared in their league, CPU s a simulated second.
EQUAL_COST = 0.02
#: Runs at least this long (s) are timed once, shorter ones `REPEATS` times.
LONG_ENOUGH, REPEATS = 0.02, 3
#: An engine's step (s) below which its runs are played side by side in worker processes, after all others.
SIDE_BY_SIDE = 1e-4
#: Share of the time after which the longest runs get their turn.
SHARE_OF_SHORT = 0.6
#: An order is fitted to median errors between these, alpha: below is rounding, above nothing converges yet.
FITTED = 3e-13, 0.2


@dataclass(frozen=True)
class DiagramLine:
    """A line of the diagrams: a model, the setting that is swept, coarse to fine, and the model that is its reference."""

    label: str
    model: str
    knob: str
    values: tuple[float, ...]
    fixed: dict[str, Any] = field(default_factory=dict, hash=False)
    reference: str = "ebm-unilateral"
    #: The values of `--quick`.
    quick: tuple[float, ...] = ()
    remark: str = ""

    def settings(self, value: float) -> dict[str, Any]:
        """The model's settings at one value."""
        return {self.knob: value, **self.fixed}


_TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
_STEPS = (1e-2, 1e-3, 1e-4, 1e-5)
_LARGEST = (8e-3, 4e-3, 2e-3, 1e-3)
#: The dearer a step, the fewer of them: the time of the whole benchmark is limited.
ENGINE_STEPS = {"mujoco": _STEPS, "pybullet": _STEPS, "pymunk": _STEPS[:3], "dart": _STEPS[:3], "drake": _STEPS[:2]}
LINES = {
    line.label: line
    for line in (
        DiagramLine("ebm", "ebm", "tolerance", _TOLERANCES, reference="ebm", quick=_TOLERANCES),
        DiagramLine("ebm-unilateral", "ebm-unilateral", "tolerance", _TOLERANCES, quick=_TOLERANCES),
        DiagramLine("ebm-bouc-wen", "ebm-bouc-wen", "yield_displacement", (1e-4, 1e-5, 1e-6), reference="ebm", quick=(1e-4, 1e-5)),
        DiagramLine(
            "cm", "cm", "penetration", (1e-4, 1e-5, 1e-6, 1e-7, 1e-8), quick=(1e-5, 1e-6, 1e-7), remark="step tied to the penetration"
        ),
        *(
            line
            for engine, steps in ENGINE_STEPS.items()
            for line in (
                DiagramLine(engine, engine, "time_step", steps, quick=steps[:3]),
                DiagramLine(f"{engine} adaptive", engine, "largest_step", _LARGEST, {"time_step": "adaptive"}, quick=_LARGEST[1:3]),
                DiagramLine(f"{engine} default", engine, "time_step", steps[:3], {"settings": "default"}, quick=_STEPS[:2]),
            )
            if engine != "drake" or "adaptive" not in line.label  # its steps cannot vary
        ),
    )
}
#: Kinds of scenes over which the engines' settings are summed up: how the families' names begin.
KINDS = {"free, pulses": ("free", "pulse"), "slip, walls": ("slip", "wall"), "records": ("fig",), "all": ("",)}
#: What is not measured, and why.
LEFT_OUT = (
    "default settings at a step of 1e-5 s: at 1e-4 s they have stopped converging, or converge as at larger steps",
    "PyBullet's other solvers and MuJoCo's RK4 and pyramidal cone: no better limit, or none, at more cost",
    "pymunk and DART at 1e-5 s and Drake below 1e-3 s: a simulated second of Drake at 1e-4 s takes it more than a second",
    "native batches of an engine (mujoco.rollout): they cannot end a step at an event; their cost is in the table of savings",
    "measured histories: they have no cost",
)


@dataclass(frozen=True)
class BenchmarkRun:
    """One run: where, with what, its errors against the reference of its kind of model, and its cost.

    `rms` and `largest` are those of theta up to the horizon, `peak` the error of the largest |theta|, all in alpha;
    `first_impact` the error of the first impact's time, s. NaN errors and a `failure` where there is no history.
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
    cpu: float = math.nan
    wall: float = math.nan
    set_up: float = math.nan
    steps: int = 0
    failure: str = ""


@dataclass(frozen=True)
class Point:
    """A setting of a line in a family: median error with its 10-90 % band, and median cost a simulated second.

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


@dataclass(frozen=True)
class Trend:
    """A line in a family: its order of convergence in the swept setting, and what an error of `LEVEL` costs.

    `order` is NaN where fewer than two settings can be fitted. `cpu` is in s a simulated second, NaN where the level is
    not reached; `at_coarsest` where already the coarsest setting reaches it. `ratio` is to the `ebm` line's.
    """

    family: str
    line: str
    order: float
    cpu: float
    at_coarsest: bool
    ratio: float


@dataclass(frozen=True)
class Pooled:
    """An engine's line at one setting over all scenes of a kind: CPU time (s a simulated second) and errors (RMS, alpha).

    `at_the_cost` is the error of the engine's adaptive line at this CPU time, interpolated; NaN outside its range.
    """

    kind: str
    line: str
    value: float
    runs: int
    failed: int
    cpu: float
    rms: float
    rms_worst: float
    at_the_cost: float


@dataclass(frozen=True)
class WorkPrecision:
    """All runs, and what they say."""

    samples: tuple[BenchmarkRun, ...]
    points: tuple[Point, ...]
    trends: tuple[Trend, ...]
    #: The engines' settings over whole kinds of scenes.
    pooled: tuple[Pooled, ...]
    #: By family: horizons (s) and model-form error (RMS, alpha) of its members, medians.
    horizons: dict[str, float]
    model_form: dict[str, float]
    left_out: tuple[str, ...]

    def line(self, family: str, line: str) -> list[Point]:
        """The points of a line in a family, coarse to fine."""
        return [point for point in self.points if (point.family, point.line) == (family, line)]


def measure(family: str, member: int, label: str, value: float, repeats: int = REPEATS) -> BenchmarkRun:
    """Plays one member with one setting; short runs `repeats` times, for the median time."""
    line, ready = LINES[label], prepared(family, member)
    place: dict[str, Any] = {"family": family, "member": member, "line": label, "value": value, "horizon": ready.horizon}
    try:
        model = build(line.model, line.settings(value))
        history = model.simulate(ready.scene)
        costs = [history.cost]
        while len(costs) < repeats and costs[0].wall_seconds < LONG_ENOUGH:
            costs.append(model.simulate(ready.scene).cost)
    except (ModelFailure, InputError, ImportError) as error:
        return BenchmarkRun(**place, failure=str(error))
    return BenchmarkRun(
        **place,
        **errors_of(ready.references[line.reference], history),
        cpu=median(cost.cpu_seconds for cost in costs),
        wall=median(cost.wall_seconds for cost in costs),
        set_up=median(cost.set_up for cost in costs),
        steps=costs[0].steps,
    )


def errors_of(reference: History, history: History) -> dict[str, Any]:
    """The errors of a `BenchmarkRun`."""
    found = compare(reference, history, measures=["theta_rms", "theta_peak"])
    alpha = reference.alpha or 1.0
    first = [min((event.t for event in h.event_list if event.kind in IMPACTS), default=math.nan) for h in (reference, history)]
    return {
        "rms": found["theta_rms"],
        "largest": found["theta_peak"],
        "peak": abs(history.peak_rotation - reference.peak_rotation) / alpha,
        "first_impact": abs(first[1] - first[0]),
    }


def work_precision(*, quick: bool = False, jobs: int = 1, deadline: float = math.inf, on_progress: OnProgress = unheard) -> WorkPrecision:
    """Plays all lines in all families.

    Runs are interleaved: member by member, family by family, every model and setting in turn, so that whatever else the
    machine does touches all alike; one at a time. An engine's runs at `SIDE_BY_SIDE` follow, and those below in `jobs` processes.
    What has not begun at `deadline` (of `time.monotonic`; the others: at `SHARE_OF_SHORT` of the time) is left out and listed.
    """
    plays = planned(quick=quick)
    short = [play for play in plays if _stage(play) < 2]
    samples: list[BenchmarkRun] = []
    now = time.monotonic()
    for n, play in enumerate(sorted(short, key=_stage)):
        if time.monotonic() > now + SHARE_OF_SHORT * (deadline - now):
            break
        on_progress(n, len(short), f"{play[0]}, {play[2]}")
        samples.append(measure(*play))
    samples += _side_by_side([play for play in plays if _stage(play) == 2], jobs, deadline, on_progress)
    done = {(s.family, s.member, s.line, s.value) for s in samples}
    return evaluated(samples, [play for play in plays if play not in done])


PlannedRun = tuple[str, int, str, float]


def planned(*, quick: bool = False) -> list[PlannedRun]:
    """All runs of models that are installed: family, member, line and value of its setting."""
    return [
        (family, member, line.label, value)
        for member in range(MEMBERS)
        for family in (QUICK if quick else tuple(FAMILIES))
        for line in LINES.values()
        if not not_installed(line.model)
        for value in (line.quick if quick else line.values)
    ]


def _stage(play: PlannedRun) -> int:
    """0: at once; 1: an engine's small steps; 2: its smallest, side by side. Where time is short, the dearest runs are left out."""
    if LINES[play[2]].knob != "time_step" or play[3] > SIDE_BY_SIDE:
        return 0
    return 1 if play[3] == SIDE_BY_SIDE else 2


def _side_by_side(plays: Sequence[PlannedRun], jobs: int, deadline: float, on_progress: OnProgress) -> Iterable[BenchmarkRun]:
    """Plays in worker processes; nothing new begins after the deadline."""
    if not plays:
        return []
    samples: list[BenchmarkRun] = []
    waiting = deque(Call(measure, (*play, 1), key=play) for play in plays if time.monotonic() < deadline)
    with Pool(jobs) as pool:
        for ended in pool.run(waiting):
            samples.append(_lost(ended.call.key, ended.fault) if ended.error else ended.result)
            on_progress(len(samples), len(plays), "long runs")
            if time.monotonic() > deadline:
                waiting.clear()
    return samples


def _lost(play: PlannedRun, fault: str) -> BenchmarkRun:
    family, member, label, value = play
    return BenchmarkRun(family, member, label, value, prepared(family, member).horizon, failure=fault)


def evaluated(samples: Sequence[BenchmarkRun], missing: Sequence[PlannedRun]) -> WorkPrecision:
    """What the samples say; `missing` are runs that there was no time for."""
    groups: dict[tuple[str, str, float], list[BenchmarkRun]] = {}
    for sample in samples:
        groups.setdefault((sample.family, sample.line, sample.value), []).append(sample)
    order = {name: n for n, name in enumerate([*FAMILIES, *LINES])}
    keys = sorted(groups, key=lambda key: (order[key[0]], order[key[1]], -key[2]))
    points = tuple(_point(groups[key]) for key in keys)
    families = list(dict.fromkeys(point.family for point in points))
    trends: list[Trend] = []
    for family in families:
        mine = [point for point in points if point.family == family]
        base, _ = cost_at([point for point in mine if point.line == "ebm"])
        for label in dict.fromkeys(point.line for point in mine):
            line = [point for point in mine if point.line == label]
            cpu, at_coarsest = cost_at(line)
            trends.append(Trend(family, label, order_of(line), cpu, at_coarsest, cpu / base))
    members = {family: [prepared(family, k) for k in range(MEMBERS)] for family in families}
    return WorkPrecision(
        samples=tuple(samples),
        points=points,
        trends=tuple(trends),
        pooled=tuple(pooled(samples)),
        horizons={family: median(member.horizon for member in found) for family, found in members.items()},
        model_form={family: median(member.model_form for member in found) for family, found in members.items()},
        left_out=(*LEFT_OUT, *_missing(missing), *_failures(samples)),
    )


def _point(samples: Sequence[BenchmarkRun]) -> Point:
    good = [sample for sample in samples if not sample.failure]
    errors = [math.inf if sample.failure or math.isnan(sample.rms) else sample.rms for sample in samples]

    def middling(name: str, *, a_second: bool = False) -> float:
        values = [getattr(s, name) / (s.horizon if a_second else 1.0) for s in good]
        values = [value for value in values if not math.isnan(value)]
        return median(values) if values else math.nan

    return Point(
        family=samples[0].family,
        line=samples[0].line,
        value=samples[0].value,
        runs=len(samples),
        failed=len(samples) - len(good),
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
    )


def pooled(samples: Sequence[BenchmarkRun]) -> Iterable[Pooled]:
    """Every setting of the engines' lines over all scenes of each kind."""
    for kind, starts in KINDS.items():
        mine = [s for s in samples if s.family.startswith(starts)]
        points = {
            (label, value): _point(group)
            for label, line in LINES.items()
            if line.model in ENGINE_STEPS
            for value in line.values
            if (group := [s for s in mine if (s.line, s.value) == (label, value)])
        }
        for (label, value), point in points.items():
            adaptive = [p for (other, _), p in points.items() if other == f"{LINES[label].model} adaptive"]
            good = [s.rms for s in mine if (s.line, s.value) == (label, value) and not s.failure]
            worst = math.inf if point.failed else max(good)
            yield Pooled(kind, label, value, point.runs, point.failed, point.cpu, point.rms, worst, error_at(adaptive, point.cpu))


@dataclass(frozen=True)
class Standing:
    """A line's place in the league of engines, over pulses and free rocking: NaN where it does not reach so far.

    `error` is the RMS error (alpha) at `EQUAL_COST`, `cost` the CPU time (s a simulated second) of an error of `LEVEL`,
    `best` the least error at any setting that was played, with its cost.
    """

    line: str
    error: float
    cost: float
    best: float
    best_cost: float


def league(found: Sequence[Pooled]) -> list[Standing]:
    """The engines' lines, the cheapest at an error of `LEVEL` first; those that never reach it last, by their best error."""
    standings = []
    for label in dict.fromkeys(one.line for one in found):
        mine = [one for one in found if (one.kind, one.line) == (next(iter(KINDS)), label)]
        good = [one for one in mine if math.isfinite(one.rms)]
        if good:
            best = min(good, key=lambda one: one.rms)
            standings.append(Standing(label, error_at(mine, EQUAL_COST), cost_at(mine)[0], best.rms, best.cpu))
    return sorted(standings, key=lambda one: (math.isnan(one.cost), one.best if math.isnan(one.cost) else one.cost))


def error_at(line: Sequence[Point | Pooled], cpu: float) -> float:
    """Median error of a line, coarse to fine, at a CPU time, both interpolated on logarithmic axes; NaN outside its range."""
    for a, b in itertools.pairwise(line):
        if a.cpu <= cpu <= b.cpu and a.cpu < b.cpu and b.rms > 0.0 and math.isfinite(a.rms):
            share = math.log(cpu / a.cpu) / math.log(b.cpu / a.cpu)
            return float(a.rms * (b.rms / a.rms) ** share)
    return math.nan


def quantile(values: Sequence[float], share: float) -> float:
    """The value below which `share` of the sample lies, halfway between two where it lies between them; values may be infinite."""
    ordered, place = sorted(values), share * len(values)
    below = ordered[max(math.ceil(place - 1e-9) - 1, 0)]
    above = ordered[min(math.floor(place + 1e-9), len(values) - 1)]
    return 0.5 * (below + above)


def order_of(line: Sequence[Point]) -> float:
    """Slope of log median error over log of the swept setting, by least squares; NaN with fewer than two points."""
    return slope((p.value, p.rms) for p in line if FITTED[0] < p.rms < FITTED[1])


def cost_at(line: Sequence[Point | Pooled], level: float = LEVEL) -> tuple[float, bool]:
    """CPU s a simulated second at a median error of `level`, and whether the coarsest setting already reaches it.

    Between settings both logarithms are interpolated linearly; NaN where no setting reaches the level. The cheapest counts.
    """
    costs = [(p.cpu, n == 0) for n, p in enumerate(line) if p.rms <= level]
    for a, b in itertools.pairwise(line):
        if a.rms > level >= b.rms > 0.0 and math.isfinite(a.rms):
            share = math.log(a.rms / level) / math.log(a.rms / b.rms)
            costs.append((a.cpu * (b.cpu / a.cpu) ** share, False))
    return min(costs, default=(math.nan, False))


def _missing(plays: Sequence[PlannedRun]) -> Iterable[str]:
    """Runs that there was no time for, a line for each line of the diagrams."""
    for label in dict.fromkeys(play[2] for play in plays):
        mine = [play for play in plays if play[2] == label]
        values = ", ".join(f"{value:g}" for value in dict.fromkeys(play[3] for play in mine))
        yield f"no time for {len(mine)} runs of {label} at {LINES[label].knob} {values}"


def _failures(samples: Sequence[BenchmarkRun]) -> Iterable[str]:
    """Runs that failed, a line for each setting, with the first one's reason."""
    groups: dict[tuple[str, float], list[BenchmarkRun]] = {}
    for sample in samples:
        if sample.failure:
            groups.setdefault((sample.line, sample.value), []).append(sample)
    for (label, value), failed in groups.items():
        first = failed[0]
        where = f"{first.family}, member {first.member}: {first.failure}"
        yield f"{len(failed)} runs of {label} at {LINES[label].knob} {value:g} failed, and count as infinitely wrong ({where})"
