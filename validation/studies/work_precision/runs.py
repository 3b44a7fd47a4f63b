"""Work and precision: what an error costs with each model, and what it converges to.

The scenes come in families of ten members each, since a single run can be lucky by a factor of
five; for convergence there are 18 single ones beside a wall. The members of a family differ by a
few per cent in tilt or amplitude, so that their uplifts and impacts fall on other phases of a step.
Each is played up to its horizon of predictability and compared up to there.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from statistics import median
from typing import Any

import numpy as np
import pandas as pd

from rockcheck.ebm import EventBasedModel, predictability_horizon, spectrum
from rockcheck.engines import registry
from rockcheck.engines.facts import EngineFacts
from rockcheck.scenes import PAPER_BLOCK, Floor, History, Rest, Ricker, Scene, Wall, load_scene
from rockcheck.validation.discrepancy import impacts
from rockcheck.validation.discrepancy.compare import compare
from rockcheck.validation.execute import models
from rockcheck.validation.study import Task

MEMBERS = 10
#: Tolerance of the references, and the longest time to which a record is played, s.
REFERENCE_TOLERANCE, RECORD_DURATION = 1e-13, 8.0


@dataclass(frozen=True)
class SceneFamily:
    """A name, a few words, and its members by number, 0 to `MEMBERS` - 1."""

    name: str
    words: str
    member: Callable[[int], Scene]


def pulse(
    frequency_ratio: float,
    amplitude_ratio: float,
    friction: float,
    *,
    walls: tuple[Wall, ...] = (),
    name: str = "pulse",
) -> Scene:
    """A scene of 3 s under a Ricker pulse, see `node_pulse`."""
    still = Scene(
        name=name,
        block=PAPER_BLOCK,
        floor=Floor(friction=friction),
        walls=walls,
        excitation=Rest(),
        duration=3.0,
    )
    amplitude, period = spectrum.node_pulse(still, amplitude_ratio, frequency_ratio)
    return still.replace(excitation=Ricker(amplitude=amplitude, period=period))


def _pulses(
    name: str, frequency_ratio: float, amplitude_ratio: float, friction: float, *walls: Wall
) -> SceneFamily:
    beside = "".join(f", wall at {1e3 * wall.gap:g} mm, e {wall.restitution:g}" for wall in walls)
    return SceneFamily(
        name,
        f"Ricker pulse, ω_p = {frequency_ratio:g} p, a_p = {amplitude_ratio:g} g tan α,"
        f" μ {friction:g}{beside}",
        lambda k: pulse(
            frequency_ratio,
            amplitude_ratio * (1.0 + 0.01 * (k - 4.5)),
            friction,
            walls=walls,
            name=f"{name} {k}",
        ),
    )


def _record(name: str, words: str) -> SceneFamily:
    def member(k: int) -> Scene:
        scene = load_scene(name)
        return scene.replace(
            name=f"{name} {k}",
            excitation=scene.excitation.scaled((1.5 + 0.02 * k) / 1.6),
            duration=RECORD_DURATION,
        )

    return SceneFamily(name, f"El Centro × 1.5 to 1.68, {words}", member)


FAMILIES = {
    family.name: family
    for family in (
        SceneFamily(
            "free",
            "free rocking from 0.3 to 0.75 α, μ 1",
            lambda k: Scene(
                name=f"free {k}",
                block=PAPER_BLOCK,
                floor=Floor(friction=1.0),
                excitation=Rest(),
                duration=3.0,
                initial_rotation=(0.30 + 0.05 * k) * PAPER_BLOCK.alpha,
            ),
        ),
        _pulses("pulse a", 4.5, 4.0, 1.0),
        _pulses("pulse b", 6.0, 6.0, 1.0),
        _pulses("pulse c", 6.0, 8.0, 1.0),
        _pulses("slip a", 4.5, 4.0, 0.3),
        _pulses("slip b", 6.0, 6.0, 0.3),
        *(
            _pulses(
                f"wall {1e3 * gap:g} mm e {e:g}",
                6.0,
                3.0,
                0.6,
                Wall(side="left", gap=gap, restitution=e),
            )
            for gap in (0.003, 0.053)
            for e in (0.0, 0.5, 1.0)
        ),
        _record("fig4a", "μ 0.3, no wall"),
        _record("fig5a", "μ 0.3, wall at 53 mm, e 0"),
    )
}
QUICK, QUICK_MEMBERS = ("free", "pulse a", "slip a", "wall 53 mm e 0"), 2

#: omega_p/p, a_p/(g tan alpha) and friction of pulses that hit a left wall at every gap, and leave
#: the block standing.
PULSES = {"long": (3.0, 2.5, 0.3), "medium": (4.5, 2.5, 0.3), "short": (6.0, 2.5, 0.6)}
GAPS, RESTITUTIONS = (0.003, 0.053, 0.103), (0.0, 0.5)
#: Longest run of a wall scene, s; the horizon of predictability may end it before.
DURATION = 5.0


WALLS = {
    scene.name: scene.replace(duration=DURATION)
    for scene in (
        pulse(
            *PULSES[name],
            walls=(Wall(side="left", gap=gap, restitution=e),),
            name=f"{name} {1e3 * gap:g} mm e {e:g}",
        )
        for name, gap, e in itertools.product(PULSES, GAPS, RESTITUTIONS)
    )
}
QUICK_WALLS = ("long 53 mm e 0.5", "medium 53 mm e 0", "short 3 mm e 0")


@dataclass(frozen=True)
class Prepared:
    """A member cut at its horizon, and the reference of each kind of model.

    `model_form` is how far the references are apart (RMS, alpha).
    """

    scene: Scene
    references: dict[str, History]
    model_form: float


@cache
def prepared(family: str, member: int) -> Prepared:
    """Cuts a member, or a scene of `WALLS`, at its horizon and plays its references.

    They take milliseconds.
    """
    whole = WALLS.get(family) or FAMILIES[family].member(member)
    scene = whole.replace(duration=predictability_horizon(whole))
    references = {
        model.name: model.simulate(scene)
        for model in (
            EventBasedModel(tolerance=REFERENCE_TOLERANCE, pivot="unilateral"),
            EventBasedModel(tolerance=REFERENCE_TOLERANCE, pivot="bilateral"),
        )
    }
    return Prepared(
        scene,
        references,
        compare(
            references["ebm"], references["ebm-unilateral"], scene=scene, measures=["theta_rms"]
        )["theta_rms"],
    )


REFERENCES = ("ebm-unilateral", "ebm")
#: Error at which each model's cost is given, alpha; and the result where it is not reached.
LEVEL, NOTHING = 1e-3, (math.nan, False)
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


@dataclass(frozen=True, kw_only=True)
class DiagramLine(models.Work):
    """A line of the diagrams: a model, and the setting that is swept, coarse to fine.

    `reference` is the model that it is compared with.
    """

    knob: str
    values: tuple[float, ...]
    reference: str = "ebm-unilateral"
    #: The values of `--quick`, and those beside a wall, by which convergence is judged.
    quick: tuple[float, ...] = ()
    converge: tuple[float, ...] = ()


_TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
#: Three tell an order; the CM's step is 3/sqrt(k/m), k/m = g/penetration: 8e-4, 9e-5 and 1e-5 s.
_PENETRATIONS = (1e-6, 1e-8, 1e-10)
#: Largest steps of engines that step adaptively, s.
_LARGEST = (8e-3, 4e-3, 2e-3, 1e-3)
#: Steps of engines with their default settings in a quick run, s; in a whole run the first
#: `DEFAULT_STEPS` of their diagram.
_QUICK_DEFAULT, DEFAULT_STEPS = (1e-2, 1e-3), 3


def lines_of_engine(facts: EngineFacts) -> list[DiagramLine]:
    """An engine's lines: fixed steps, adaptive ones where it has them, its default settings.

    A quick run leaves out the finest step, which costs more than all others together.
    """
    engine, steps = facts.name, facts.benchmark.diagram
    lines = [
        DiagramLine(
            label=engine,
            family=engine,
            knob="time_step",
            values=steps,
            quick=steps[: max(len(steps) - 1, 2)],
            converge=facts.benchmark.convergence,
        )
    ]
    if facts.steps_vary:
        adaptive = DiagramLine(
            label=f"{engine} adaptive",
            family=engine,
            settings={"time_step": "adaptive"},
            knob="largest_step",
            values=_LARGEST,
            quick=_LARGEST[1:3],
        )
        lines.append(adaptive)
    default = DiagramLine(
        label=f"{engine} default",
        family=engine,
        settings={"settings": "default"},
        knob="time_step",
        values=steps[:DEFAULT_STEPS],
        quick=_QUICK_DEFAULT,
    )
    return [*lines, default]


LINES = {
    line.label: line
    for line in (
        *(
            DiagramLine(
                label=name,
                family=name,
                knob="tolerance",
                values=_TOLERANCES,
                reference=name,
                quick=_TOLERANCES,
            )
            for name in ("ebm", "ebm-unilateral")
        ),
        DiagramLine(
            label="ebm-bouc-wen",
            family="ebm-bouc-wen",
            knob="yield_displacement",
            values=(1e-4, 1e-5, 1e-6),
            reference="ebm",
            quick=(1e-4, 1e-5),
        ),
        DiagramLine(
            label="cm",
            family="cm",
            knob="penetration",
            values=(1e-4, 1e-5, 1e-6, 1e-7, 1e-8),
            quick=(1e-5, 1e-6, 1e-7),
            converge=_PENETRATIONS,
        ),
        *(line for facts in registry.every() for line in lines_of_engine(facts)),
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
#: Not measured, and why.
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

    def record(self, **found: Any) -> BenchmarkRun:
        """The row of the run, with what was found."""
        return BenchmarkRun(
            self.family,
            self.member,
            self.line,
            self.value,
            prepared(self.family, self.member).scene.duration,
            **found,
        )

    def play(self) -> list[BenchmarkRun]:
        """Plays the member with the setting; short runs several times, for the median time."""
        line, ready = LINES[self.line], prepared(self.family, self.member)
        model = models.build(line.family, {line.knob: self.value, **line.settings})
        history = model.simulate(ready.scene)
        costs = [history.cost]
        while len(costs) < self.repeats and costs[0].wall_seconds < LONG_ENOUGH:
            costs.append(model.simulate(ready.scene).cost)
        reference = ready.references[line.reference]
        errors = compare(reference, history, measures=["theta_rms", "theta_peak"])
        first = [
            min(
                (event.t for event in h.event_list if event.kind in impacts.IMPACTS),
                default=math.nan,
            )
            for h in (reference, history)
        ]
        return [
            self.record(
                rms=errors["theta_rms"],
                largest=errors["theta_peak"],
                peak=abs(history.peak_rotation - reference.peak_rotation)
                / (reference.alpha or 1.0),
                first_impact=abs(first[1] - first[0]),
                against_ebm=compare(ready.references["ebm"], history, measures=["theta_rms"])[
                    "theta_rms"
                ],
                step=float(history.settings.get("time_step", math.nan))
                if line.knob != "largest_step"
                else self.value,
                cpu=median(cost.cpu_seconds for cost in costs),
                wall=median(cost.wall_seconds for cost in costs),
                set_up=median(cost.set_up for cost in costs),
                steps=costs[0].steps,
            )
        ]


def frame_of(samples: Sequence[BenchmarkRun]) -> pd.DataFrame:
    """Runs, a row each with its number: family by family, line by line, coarse to fine.

    Besides their fields the errors against each of `REFERENCES`, infinite where a run failed.
    """
    frame = pd.DataFrame([*samples])
    errors = {
        reference: frame[error].where(frame.failure == "").fillna(math.inf)
        for reference, error in zip(REFERENCES, ("rms", "against_ebm"), strict=True)
    }
    families = pd.Categorical(frame.family, [*FAMILIES, *WALLS])
    frame = frame.assign(**errors, family=families, line=pd.Categorical(frame.line, [*LINES]))
    return _ordered(frame, "family", "line")


def _ordered(frame: pd.DataFrame, *names: str) -> pd.DataFrame:
    order = [*names, "value"]
    return frame.sort_values(order, ascending=[name != "value" for name in order], kind="stable")


def grouped(frame: pd.DataFrame, *names: str) -> list[tuple[Any, pd.DataFrame]]:
    """The rows by the values of these columns, in the order in which they come."""
    return [*frame.groupby([*names], sort=False, observed=True)]


#: Errors of a setting by their share of the sample, and medians, some of them a simulated second.
SHARES = {"rms": 0.5, "rms_10": 0.1, "rms_90": 0.9}
MEDIANS = ("largest", "peak", "first_impact", "cpu", "wall", "set_up", "steps")
RATES = ("cpu", "wall", "steps")
TINY = 1e-9


def points_of(frame: pd.DataFrame) -> pd.DataFrame:
    """Median error and median cost of the settings of all lines in all families.

    The errors come with their 10-90 % band and the worst; the cost is that of a simulated second. A
    run that failed counts as infinitely wrong.
    """
    names, rows = ("family", "line", "value"), []
    # halfway between two values where a share lies between them; infinite ones are not averaged
    sides = np.add.outer([-TINY, TINY], [*SHARES.values()])
    for at, samples in grouped(frame, *names):
        good = samples[samples.failure == ""]
        rates = good[[*RATES]].div(good.horizon, axis=0)
        medians = good.drop(columns=[*RATES]).join(rates)[[*MEDIANS]].median()
        errors, failed = samples[REFERENCES[0]].tolist(), len(samples) - len(good)
        shares = np.quantile(errors, sides, method="inverted_cdf").mean(axis=0).tolist()
        rows.append(
            (*at, len(samples), failed, *shares, *medians, math.inf if failed else good.rms.max())
        )
    return pd.DataFrame(rows, columns=[*names, "runs", "failed", *SHARES, *MEDIANS, "rms_worst"])


def trends_of(points: pd.DataFrame) -> pd.DataFrame:
    """Order of convergence, and cost of an error of `LEVEL`, of each line in each family.

    `order` in the swept setting is NaN where fewer than two settings can be fitted. `cpu` is in s a
    simulated second, NaN where the level is not reached; `at_coarsest` where already the coarsest
    setting reaches it. `ratio` is to the `ebm` line's cost.
    """
    lines = dict(grouped(points, "family", "line"))
    costs = {at: cost_at(line) for at, line in lines.items()}
    return pd.DataFrame(
        [
            (
                *at,
                slope(line.value, line.rms, FITTED),
                *costs[at],
                costs[at][0] / costs.get((at[0], "ebm"), NOTHING)[0],
            )
            for at, line in lines.items()
        ],
        columns=["family", "line", "order", "cpu", "at_coarsest", "ratio"],
    )


def pooled(frame: pd.DataFrame, kinds: Mapping[str, tuple[str, ...]] = KINDS) -> pd.DataFrame:
    """Every setting of the engines' lines over all scenes of each kind; `family` is the kind."""
    engines = _ordered(
        frame[[LINES[line].family in models.ENGINE_NAMES for line in frame.line]], "line"
    )
    return points_of(
        pd.concat(
            engines[engines.family.str.startswith(starts)].assign(family=kind)
            for kind, starts in kinds.items()
        )
    )


def at_the_cost(points: pd.DataFrame) -> list[float]:
    """By point, the error of the engine's adaptive line at that CPU time; NaN outside its range.

    Interpolated as by `error_at`.
    """
    lines = dict(grouped(points, "family", "line"))
    return [
        error_at(lines.get((one.family, f"{LINES[one.line].family} adaptive"), points[:0]), one.cpu)
        for one in points.itertuples()
    ]


def league(found: pd.DataFrame) -> list[tuple[str, float, float, float, float]]:
    """The engines' lines over pulses and free rocking, the cheapest at an error of `LEVEL` first.

    Lines that never reach it come last, by their best error.

    Line, CPU time (s a simulated second) of an error of `LEVEL`, RMS error (alpha) at `EQUAL_COST`,
    least error at any setting that was played, and its cost; NaN where the line does not reach it.
    """
    rows = []
    for (label,), mine in grouped(found[found.family == next(iter(KINDS))], "line"):
        if (good := mine[np.isfinite(mine.rms)]).size:
            best = good.loc[good.rms.idxmin()]
            at_equal = error_at(mine, EQUAL_COST)
            rows.append((label, cost_at(mine)[0], at_equal, float(best.rms), float(best.cpu)))
    return sorted(rows, key=lambda row: (math.isnan(row[1]), row[3 if math.isnan(row[1]) else 1]))


def first_steps(frame: pd.DataFrame) -> list[tuple[str, dict[str, float], float]]:
    """The largest step (s) of each engine's line whose median error is at most `LEVEL`.

    The line; its step in each kind of `LEAGUE` and in all of them ("all"), NaN where there is none;
    the smallest step that was played.
    """
    rows = []
    for (label,), line in grouped(pooled(frame, LEAGUE), "line"):
        good = line[line.rms <= LEVEL]
        met = {kind: set(good.value[good.family == kind]) for kind in LEAGUE}
        met["all"] = set.intersection(*met.values())
        rows.append(
            (
                label,
                {kind: max(values, default=math.nan) for kind, values in met.items()},
                line.value.min(),
            )
        )
    return rows


def error_at(line: pd.DataFrame, cpu: float) -> float:
    """Median error of a line, coarse to fine, at a CPU time; NaN outside its range.

    Both are interpolated on logarithmic axes.
    """
    for (e, a), (f, b) in itertools.pairwise(zip(line.rms, line.cpu, strict=True)):
        if a <= cpu <= b and a < b and f > 0.0 and math.isfinite(e):
            return float(e * (f / e) ** (math.log(cpu / a) / math.log(b / a)))
    return math.nan


def cost_at(line: pd.DataFrame) -> tuple[float, bool]:
    """CPU s a simulated second at a median error of `LEVEL`.

    The second value is true where the coarsest setting already reaches the level. Between settings
    both logarithms are interpolated linearly; NaN where no setting reaches the level. The cheapest
    counts.
    """
    points = list(zip(line.rms, line.cpu, strict=True))
    costs = [(cpu, n == 0) for n, (rms, cpu) in enumerate(points) if rms <= LEVEL]
    for (e, a), (f, b) in itertools.pairwise(points):
        if e > LEVEL >= f > 0.0 and math.isfinite(e):
            costs.append((a * (b / a) ** (math.log(e / LEVEL) / math.log(e / f)), False))
    return min(costs, default=NOTHING)


def slope(
    steps: Iterable[float], errors: Iterable[float], fitted: tuple[float, float] = (0.0, math.inf)
) -> float:
    """Slope of log error over log step by least squares; NaN with fewer than two usable steps.

    Usable are those whose error lies between the two of `fitted`.
    """
    usable = [
        (math.log(step), math.log(error))
        for step, error in zip(steps, errors, strict=True)
        if math.isfinite(step) and fitted[0] < error < fitted[1]
    ]
    if len({step for step, _ in usable}) < 2:
        return math.nan
    x, y = np.array(usable).T
    return float(np.polyfit(x, y, 1)[0])


# Convergence: beside a wall engines and CM tend to the model whose floor can only push, not to the
# paper's.

#: A run counts as converged if its order in the step is at least this, where the finest error is
#: not already below `ROUNDED` (alpha).
LEAST_ORDER, ROUNDED = 0.5, 1e-6


def levels_of(frame: pd.DataFrame) -> pd.DataFrame:
    """The wall scenes' errors (alpha) by reference, model and setting, coarse to fine.

    `within` is the number of runs whose error is at most `LEVEL`.
    """
    return pd.DataFrame(
        {
            "model": model,
            "reference": reference,
            "value": value,
            "step": runs.step[runs.failure == ""].median(),
            "median": runs[reference].median(),
            "largest": runs[reference].max(),
            "runs": len(runs),
            "within": int((runs[reference] <= LEVEL).sum()),
        }
        for reference, ((model, value), runs) in itertools.product(
            REFERENCES, grouped(_ordered(frame, "line"), "line", "value")
        )
    )


def orders_of(frame: pd.DataFrame, levels: pd.DataFrame) -> pd.DataFrame:
    """Slopes of log error over log step by model and reference.

    They are given for the median error (`scene` is empty), and scene by scene.
    """
    lines, rows = dict(grouped(frame.sort_index(), "line", "family")), []
    settings = dict(grouped(levels, "model", "reference"))
    for model, reference in itertools.product(dict.fromkeys(levels.model), REFERENCES):
        mine = settings[model, reference]
        rows += [
            (model, reference, slope(mine.step, mine["median"]), ""),
            *(
                (model, reference, slope(one.step, one[reference]), scene)
                for scene in WALLS
                if (one := lines.get((model, scene))) is not None
            ),
        ]
    return pd.DataFrame(rows, columns=["model", "reference", "order", "scene"])


def exceptions_of(frame: pd.DataFrame, orders: pd.DataFrame) -> Iterable[str]:
    """The wall scenes in which a model does not converge to the unilateral one, a line each."""
    lines = dict(grouped(frame, "line", "family"))
    for one in orders[orders.reference == REFERENCES[0]].itertuples():
        errors = lines[one.model, one.scene][REFERENCES[0]].tolist() if one.scene else [math.inf]
        slow = errors[-1] > ROUNDED and not one.order >= LEAST_ORDER
        if math.isfinite(errors[-1]) and (errors[-1] > LEVEL or slow):
            said = " → ".join(f"{error:.1e}" for error in errors)
            yield f"{one.scene}, {one.model}: {said} α, order {one.order:.2f}"
