"""`rockcheck stress`: many random runs of every model, what they break, and the smallest scenes
that show it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from rockcheck.validation.execute.models import not_installed
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.finding import Block, Column, Finding, Mark, Plot, Table, table_of, text
from rockcheck.validation.studies.stress.invariants import INVARIANTS, CheckedRun
from rockcheck.validation.studies.stress.players import PLAYERS
from rockcheck.validation.studies.stress.runs import (
    MOST_FILES,
    Broken,
    Chunk,
    RunTotals,
    Shrinking,
    chunk,
    parts,
)
from rockcheck.validation.studies.stress.stability import AXIS_WORDS, STEPS, Stable, Still, places
from rockcheck.validation.study import Study, Task

What = Literal["all", "runs", "maps"]
#: Runs in one task: event-based ones, others.
CHUNK, APPROXIMATE_CHUNK = 250, 20
#: How long (s) all failures may be shrunk, one process at work, in a whole run and in a quick one;
#: the part of that for one of them; and how much later a process whose trial hangs is ended.
SHRINKING, SHRINKING_QUICK, ONE_FAILURE, HANGING = 120.0, 10.0, 0.25, 5.0
#: What is listed of a block that should stand still, and its unit.
MOVES = {"creep": "R", "sinking": "R", "rotation": "α", "uplift": "R", "jitter": "√(gR)"}


@dataclass(frozen=True)
class Stress(Study):
    """What is played: all, runs or maps; `runs` of each of the `models`, by default as many as
    `PLAYERS` says of all that are installed."""

    what: What = "all"
    seed: int = 1
    quick: bool = False
    runs: int | None = None
    models: Sequence[str] = ()
    name = "stress"
    record = RunTotals | Still | Stable | str
    memory_mb = 4096.0

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Task]:
        """Chunks and places; smaller tasks for those that are lost; then failures are shrunk."""
        lost = [task for task, one in done.items() if isinstance(one, Failure)]
        work: list[Task] = [*self._chunks(), *(places(self.quick) if self.what != "runs" else ())]
        work += [part for task in lost for part in parts(task)]
        if any(task not in done for task in work):
            return work
        gone = {(one.model, one.first) for one in lost if isinstance(one, Chunk) and one.count == 1}
        found = [one for totals in self._totals(done) for one in totals.shown]
        small = [one for one in found if (one.model, one.number) not in gone]
        share = min(ONE_FAILURE, 1.0 / max(1, len(small)))
        budget = share * (SHRINKING_QUICK if self.quick else SHRINKING)
        return work + [
            Shrinking(
                one, budget, seconds=budget + HANGING, expected=0.5 * budget, compiles=one.model
            )
            for one in small
        ]

    def _chunks(self) -> list[Chunk]:
        """The runs, the slowest models first, so that all cores end together."""
        found = []
        every = [label for label in PLAYERS if not not_installed(label.split()[0])]
        for label in () if self.what == "maps" else self.models or every:
            player = PLAYERS[label]
            count = self.runs or (player.quick if self.quick else player.runs)
            most = CHUNK if player.event_based else APPROXIMATE_CHUNK
            most = max(10, min(most, count // 4)) if self.quick else most
            found += [
                chunk(label, self.seed, first, min(most, count - first))
                for first in range(0, count, most)
            ]
        return sorted(found, key=lambda one: PLAYERS[one.model].event_based)

    def _totals(self, done: Mapping[Any, Any]) -> list[RunTotals]:
        """What the models showed; a run whose process was lost does not end."""
        found = {label: RunTotals(model=label) for label in PLAYERS}
        for task, one in done.items():
            if isinstance(one, RunTotals):
                found[task.model].add(one)
            elif isinstance(task, Chunk) and task.count == 1:
                lost = CheckedRun(figures={"ends": math.inf}, failure=one.reason)
                found[task.model].see(lost, task.seed, task.first)
        return [totals for totals in found.values() if totals.counts]

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The tables, the maps, and the scenes of failures."""
        totals = self._totals(done)
        small = {task.broken: one for task, one in done.items() if isinstance(one, str)}
        at = [done[place] for place in places(self.quick) if place in done]
        stable = [one for one in at if isinstance(one, Stable)]
        still = [one for one in at if isinstance(one, Still)]
        runs = sum(one.counts["runs"] for one in totals)
        broken = sum(len(one.failures) for one in totals if PLAYERS[one.model].event_based)
        said = f"failures of event-based models: {broken}"
        return Finding(
            self.name,
            "Stress: random scenes against what must always hold",
            f"seed {self.seed}: {runs:,} runs,"
            f" {said if broken else 'no failure of an event-based model'}",
            [
                *(_runs(totals) if totals else ()),
                *(_maps(stable) if stable else ()),
                *([_stood(still)] if still else ()),
            ],
            data={
                "seed": self.seed,
                "quick": self.quick,
                "batches": {
                    one.model: vars(one) | {"failures": len(one.failures)} for one in totals
                },
            },
            verdict="fail" if broken else "pass",
            exit_code=int(broken > 0),
            files={
                f"failures/{one.name}": small.get(one)
                or one.text(one.scene, "as it was found: not shrunk in time")
                for some in totals
                for one in some.shown
            },
        )


def _runs(totals: Sequence[RunTotals]) -> Iterator[Block]:
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
        " its data by 1e-8 turns the block by 1e-6 rad. Energy is integrated in every tenth run.",
    )
    failures = [failure for one in totals for failure in one.failures]
    yield table_of("failures", Broken, failures)
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
    """An invariant: its worst figure and the run of it, and its figure in each model."""
    known = [(*one.worst[name], one.model) for one in totals if name in one.worst]
    worst, run, model = max(known, default=(None, "", ""))
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


def _maps(found: Sequence[Stable]) -> list[Block]:
    lines = list(dict.fromkeys(one.line for one in found))
    panels, tables = [], []
    for axis, words in AXIS_WORDS.items():
        of = {(one.line, one.value): one for one in found if one.axis == axis}
        values = list(dict.fromkeys(value for _, value in of))
        rows = [[of.get((line, value)) for value in values] for line in lines]
        panels.append([words, values, [[one and one.step for one in row] for row in rows]])
        table = Table(
            f"steps-{axis}",
            [text("line", "model"), *(text(f"{value:g}") for value in values)],
            [
                [line, *(one and f"{one.step:g} {one.fault}".strip() for one in row)]
                for line, row in zip(lines, rows, strict=True)
            ],
            f"Largest stable step, √(R/g), by {words}",
            folded=True,
        )
        tables.append(table)
    plot = Plot(
        "stable-steps",
        "Where engines and the continuous model break: largest stable step, √(R/g)",
        "stable-steps",
        data={"tried": STEPS, "models": lines, "panels": panels},
        note="All finer steps that were tried are stable, too. The paper's shape of block beside a"
        " wall, R 1.6 m, friction 0.3, restitution of the wall 0.5, pulse of 3 g tan α, one thing"
        " changed. A run is stable if it does not blow up, no corner sinks deeper than 0.02 R and"
        " the distance of a step, and the energy gained without a source is below a tenth of all"
        " work. “none”: not even the finest step is stable (3e-4, with adaptive steps 3e-3).",
    )
    return [plot, *tables, table_of("stable-steps", Stable, found)]


def _stood(found: Sequence[Still]) -> Table:
    return Table(
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
            [one.case, one.line, one.simulated, one.step, *map(one.moves.get, MOVES), one.fault]
            for one in found
        ],
        "What should stand still",
        "The paper's block on friction 0.3: left alone, pushed by half of what would move it, or"
        " shaken at 1 Hz by 0.8 of it; the largest of each in the run, jitter the RMS speed of its"
        " second half. A perfect model has zero everywhere.",
    )
