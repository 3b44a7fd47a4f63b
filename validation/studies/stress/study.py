"""`rockcheck stress`: random runs of every model, what they break, and minimal failing scenes.

Also where engines and the continuous model break: the largest stable step, and how a block moves
that should stand still.

In these maps lengths are in R, times in sqrt(R/g): a domino and a tower get the same step.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

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
from rockcheck.validation.execute import pool
from rockcheck.validation.execute.models import Work, build, not_installed
from rockcheck.validation.finding import Column, Finding, Mark, Plot, Table, text
from rockcheck.validation.studies.stress.invariants import (
    DISTURBANCE,
    INVARIANTS,
    SEEN,
    CheckedRun,
    Motion,
    energy_without_source,
    not_finite,
)
from rockcheck.validation.studies.stress.runs import (
    MOST_FILES,
    MOST_TRIALS,
    PLAYERS,
    Broken,
    Chunk,
    EventBased,
    RunTotals,
    Shrinking,
    limits,
    parts,
)
from rockcheck.validation.study import Study, Task

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


SETUPS = {
    setup.label: setup
    for setup in (
        *(
            setup
            for engine in ("mujoco", "pybullet", "pymunk", "dart", "drake")
            for setup in (
                ModelSetup(
                    label=f"{engine} default", family=engine, settings={"settings": "default"}
                ),
                ModelSetup(label=engine, family=engine),
                ModelSetup(
                    label=f"{engine} adaptive",
                    family=engine,
                    settings={"time_step": "adaptive"},
                    knob="largest_step",
                    alone=PUSHED if engine == "dart" else HOUR,
                    finest=ADAPTIVE_FINEST,
                ),
            )
            if setup.label != "drake adaptive"  # its steps cannot vary
        ),
        ModelSetup(label="cm paper", family="cm", settings={"damping_rule": "paper"}),
        ModelSetup(label="cm", family="cm"),
    )
}


@dataclass(frozen=True)
class Found:
    """What is found at a `Place`: its `value`, a step, and a fault.

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
    at = {name: usual for name, (_, usual, _) in AXES.items()} | {axis: value}
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


def stand_still(label: str, case: str, duration: float) -> Found:
    """Plays the paper's block in a case in which it should not move."""
    block, mu, step = PAPER_BLOCK, 0.3, REST_STEP
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
    # the CM's own step makes an hour cheap
    steps = {} if line.family == "cm" else {line.knob: step}
    try:
        history = build(line.family, line.settings | steps).simulate(scene)
    except (errors.ModelFailure, errors.InputError) as error:
        return Found(duration, step, fault=printable(error, 120))
    channels, radius = history.channels, block.radius
    late = channels["t"] > 0.5 * channels["t"][-1]
    height = kinematics.pivot_height(block, channels["y"], channels["theta"])
    lifted = height + 2.0 * block.half_width * np.abs(np.sin(channels["theta"]))
    speed = np.sqrt(
        channels["x_dot"] ** 2 + channels["y_dot"] ** 2 + (radius * channels["theta_dot"]) ** 2
    )
    return Found(
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
    """A place of a map.

    It is a model with settings at a value of an axis, or a block that should stand for `value` s.
    """

    line: str
    at: str
    value: float
    quick: bool = False

    def play(self) -> Found:
        """The largest stable step, from the finest up to the first that breaks; or movements."""
        if self.at in CASES:
            return stand_still(self.line, self.at, self.value)
        setup, scene, best, fault = SETUPS[self.line], scene_at(self.at, self.value), 0.0, ""
        for step in sorted(
            one for one in (QUICK_STEPS if self.quick else STEPS) if one >= setup.finest
        ):
            if fault := fault_of(setup, scene, step):
                break
            best = step
        return Found(self.value, best, fault=fault)


def places(quick: bool = False, models: Sequence[str] = ()) -> list[Place]:
    """The maps of all `SETUPS` that are installed, the longest tasks first.

    `quick` has fewer values, steps and seconds; with `models` only theirs.
    """
    wanted = {model.split()[0] for model in models}
    lines = [
        label
        for label, setup in SETUPS.items()
        if not not_installed(setup.family) and (not wanted or setup.family in wanted)
    ]
    # A place takes far less than its time limit.
    how: dict[str, Any] = {"seconds": 600.0, "expected": 0.5 if quick else 4.0}
    return [
        Place(
            line,
            case,
            QUICK_REST if quick else PUSHED if CASES[case] else SETUPS[line].alone,
            **how,
        )
        for case, line in itertools.product(CASES, lines)
    ] + [
        Place(line, axis, value, quick, **how)
        for axis, (_, _, values) in AXES.items()
        for value in (values[:: max(1, len(values) // QUICK_VALUES)] if quick else values)
        for line in lines
    ]


What = Literal["all", "runs", "maps"]
#: Runs in one task: event-based ones, others.
CHUNK, APPROXIMATE_CHUNK = 250, 20
#: Trials by which all failures may be shrunk, in a whole run and in a quick one.
SHRINKING, SHRINKING_QUICK = 8000, 1600
#: Listed movements of a block that should stand still, and their units.
MOVES = {"creep": "R", "sinking": "R", "rotation": "α", "uplift": "R", "jitter": "√(gR)"}


@dataclass(frozen=True)
class Stress(Study):
    """The parts that are played: all, runs or maps.

    `runs` of each of the `models`; by default those of `PLAYERS`, of all that are installed.
    """

    what: What = "all"
    seed: int = 1
    quick: bool = False
    runs: int | None = None
    models: Sequence[str] = ()
    name = "stress"
    record = RunTotals | Found | str
    memory_mb = 4096.0

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Task]:
        """Chunks and places; smaller tasks for those that are lost; then failures are shrunk."""
        lost = [task for task, one in done.items() if isinstance(one, pool.Failure)]
        work: list[Task] = [
            *self._chunks(),
            *(places(self.quick, self.models) if self.what != "runs" else ()),
            *(part for task in lost for part in parts(task)),
        ]
        if any(task not in done for task in work):
            return work
        gone = {(one.model, one.first) for one in lost if isinstance(one, Chunk) and one.count == 1}
        small = [
            one
            for totals in self._totals(done)
            for one in totals.shown
            if (one.model, one.number) not in gone
        ]
        every = SHRINKING_QUICK if self.quick else SHRINKING
        trials = min(MOST_TRIALS, every // max(1, len(small)))
        return work + [Shrinking(one, trials, **limits(one.model, trials)) for one in small]

    def _chunks(self) -> Iterator[Chunk]:
        """The runs, the slowest models first, so that all cores end together."""
        labels: Sequence[str] = (
            ()
            if self.what == "maps"
            else self.models or [label for label in PLAYERS if not not_installed(label.split()[0])]
        )
        for label in sorted(labels, key=lambda label: isinstance(PLAYERS[label], EventBased)):
            player = PLAYERS[label]
            count = self.runs or (player.quick if self.quick else player.runs)
            most = CHUNK if isinstance(player, EventBased) else APPROXIMATE_CHUNK
            most = max(10, min(most, count // 4)) if self.quick else most
            for first in range(0, count, most):
                runs = min(most, count - first)
                yield Chunk(label, self.seed, first, runs, **limits(label, runs))

    def _totals(self, done: Mapping[Any, Any]) -> list[RunTotals]:
        """Totals of the models; a run whose process was lost counts as one that does not end."""
        found = {label: RunTotals(model=label) for label in PLAYERS}
        for task, one in done.items():
            if isinstance(one, RunTotals):
                found[task.model].add(one)
            elif isinstance(task, Chunk) and task.count == 1:
                found[task.model].see(
                    CheckedRun(figures={"ends": math.inf}, failure=one.reason),
                    task.seed,
                    task.first,
                )
        return [totals for totals in found.values() if totals.counts]

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The tables, the maps, and the scenes of failures."""
        totals = self._totals(done)
        small = {task.broken: one for task, one in done.items() if isinstance(one, str)}
        broken = [len(one.failures) for one in totals if isinstance(PLAYERS[one.model], EventBased)]
        return Finding(
            self.name,
            "Stress: random scenes against what must always hold",
            f"seed {self.seed}: {sum(one.counts['runs'] for one in totals):,} runs, "
            + (
                f"failures of event-based models: {sum(broken)}"
                if any(broken)
                else f"{'no failure' if broken else 'none'} of an event-based model"
            ),
            [
                *(_runs(totals) if totals else ()),
                *_maps(
                    {
                        place: one
                        for place in places(self.quick, self.models)
                        if isinstance(one := done.get(place), Found)
                    },
                    self.quick,
                ),
            ],
            data={
                "seed": self.seed,
                "quick": self.quick,
                "batches": {
                    one.model: vars(one) | {"failures": len(one.failures)} for one in totals
                },
            },
            verdict="fail" if any(broken) else "pass" if broken else "",
            exit_code=int(any(broken)),
            files={
                f"failures/{one.name}": small.get(one)
                or one.text(one.scene, "as it was found: not shrunk in time")
                for some in totals
                for one in some.shown
            },
        )


def _runs(totals: Sequence[RunTotals]) -> Iterator[Table]:
    yield Table(
        "models",
        [
            text("model"),
            text("plays", brief=False),
            Column("runs"),
            Column("broken", "broken runs"),
            Column("events"),
            Column("gaining", "gain energy"),
            Column("largest_gain", "most", kind="percent"),
            Column("horizons", "cut at horizon", brief=False),
            Column("cpu_seconds", "CPU", "s"),
        ],
        [
            [
                one.model,
                PLAYERS[one.model].words,
                one.counts["runs"],
                len({failure.number for failure in one.failures}),
                one.counts["events"],
                one.counts["gaining"],
                one.largest_gain,
                one.counts["horizons"],
                one.cpu_seconds,
            ]
            for one in totals
        ],
        "Models",
        "Newton's restitution with friction, and the paper's cascade of impacts, can add energy:"
        " such runs, and what an impact added at most, are listed. Without restitution, or with the"
        " energy cap, an impact of the unilateral model may not add any: that is an invariant.",
    )
    yield Table(
        "choices",
        [text("model"), text("choices")],
        [
            [one.model, ", ".join(f"{name} {n:,}" for name, n in one.rules.most_common())]
            for one in totals
            if one.rules
        ],
        "Modelling choices made",
    )
    yield Table(
        "invariants",
        [
            text("invariant"),
            text("words", "what its figure is", brief=False),
            Column("bound"),
            Column("worst", digits=2),
            text("run"),
            Column("failures"),
            Column("unjudged", "not judged"),
            *(Column(one.model, digits=2, brief=False) for one in totals),
        ],
        [_worst(name, totals) for name in INVARIANTS],
        "Invariants: worst figures",
        "Two histories of one scene are compared up to its horizon: where a relative disturbance of"
        f" its data by {DISTURBANCE:g} turns the block by {SEEN:g} rad. Energy is integrated in"
        " every ninth run.",
    )
    failures = [failure for one in totals for failure in one.failures]
    yield Table(
        "failures",
        [*map(Column, Broken.__dataclass_fields__)],
        [[*vars(one).values()] for one in failures],
        on="file",
    )
    yield Table(
        "scenes",
        [
            text("model"),
            text("invariant"),
            Column("run"),
            Column("figure", digits=2),
            text("scene"),
            text("words", "reason"),
        ],
        [
            [
                one.model,
                one.invariant,
                one.number,
                one.figure,
                Mark(one.name, link=f"failures/{one.name}"),
                one.words,
            ]
            for some in totals
            for one in some.shown
        ],
        f"Failures: {len(failures)}",
        f"At most {MOST_FILES} of a model and an invariant, each with its smallest scene.",
    )


def _worst(name: str, totals: Sequence[RunTotals]) -> list[Any]:
    worst, run, model = max(
        ((*one.worst[name], one.model) for one in totals if name in one.worst),
        default=(None, "", ""),
    )
    failed = [sum(failure.invariant == name for failure in one.failures) for one in totals]
    return [
        name,
        INVARIANTS[name].words,
        INVARIANTS[name].bound,
        worst,
        f"{model} {run}".strip(),
        sum(failed),
        sum(one.unjudged[name] for one in totals),
        *(
            Mark(
                one.worst.get(name, [None])[0],
                "fail" if n else "",
                f"{n} of {one.looked_at[name]} fail" if n else "",
            )
            for one, n in zip(totals, failed, strict=True)
        ),
    ]


def _maps(found: Mapping[Place, Found], quick: bool) -> Iterator[Plot | Table]:
    stable, still = (
        {place: one for place, one in found.items() if (place.at in CASES) == stands}
        for stands in (False, True)
    )
    if stable:
        steps = QUICK_STEPS if quick else STEPS
        lines = list(dict.fromkeys(place.line for place in stable))
        drawn = [_by_axis(axis, lines, stable) for axis in AXES]
        yield Plot(
            "stable-steps",
            "Where engines and the continuous model break: largest stable step, √(R/g)",
            "stable-steps",
            data={"tried": STEPS, "models": lines, "panels": [panel for panel, _ in drawn]},
            note="All finer steps that were tried are stable, too. The paper's shape of block"
            " beside a wall, R 1.6 m, friction 0.3, restitution of the wall 0.5, pulse of"
            " 3 g tan α, one thing changed. A run is stable if it does not blow up, no corner sinks"
            " deeper than 0.02 R and the distance of a step, and the energy gained without a source"
            " is below a tenth of all work. “none”: not even the finest step is stable"
            f" ({steps[-1]:g}, with adaptive steps"
            f" {min(one for one in steps if one >= ADAPTIVE_FINEST):g}).",
        )
        yield from (table for _, table in drawn)
        yield Table(
            "stable-steps",
            list(map(Column, ("line", "axis", "value", "step", "fault"))),
            [
                [place.line, place.at, place.value, one.step, one.fault]
                for place, one in stable.items()
            ],
            on="file",
        )
    if still:
        yield Table(
            "stand-still",
            [
                text("case", "block"),
                text("line", "model"),
                Column("simulated", "for", "s", digits=4),
                Column("step", unit="s", digits=2, brief=False),
                *(Column(name, unit=unit, digits=1) for name, unit in MOVES.items()),
                text("fault", " ", brief=False),
            ],
            [
                [place.at, place.line, one.value, one.step, *map(one.moves.get, MOVES), one.fault]
                for place, one in still.items()
            ],
            "What should stand still",
            "The paper's block on friction 0.3: left alone, pushed by half of what would move it,"
            " or shaken at 1 Hz by 0.8 of it; the largest of each in the run, jitter the RMS speed"
            " of its second half. A perfect model has zero everywhere.",
        )


def _by_axis(
    axis: str, lines: Sequence[str], found: Mapping[Place, Found]
) -> tuple[list[Any], Table]:
    of = {(place.line, place.value): one for place, one in found.items() if place.at == axis}
    values = list(dict.fromkeys(value for _, value in of))
    rows = [[of.get((line, value)) for value in values] for line in lines]
    words, _, _ = AXES[axis]
    return [words, values, [[one and one.step for one in row] for row in rows]], Table(
        f"steps-{axis}",
        [text("line", "model"), *(text(f"{value:g}") for value in values)],
        [
            [line, *(one and f"{one.step:g} {one.fault}".strip() for one in row)]
            for line, row in zip(lines, rows, strict=True)
        ],
        f"Largest stable step, √(R/g), by {words}",
        folded=True,
    )
