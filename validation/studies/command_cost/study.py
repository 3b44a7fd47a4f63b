"""What each command costs, in an empty folder and again in the same one.

In: commands as a user types them. Out: a table of wall clock, CPU and peak memory and, with a
history, a plot over commits. `rockcheck benchmark commands` plays it; docs/running.md quotes it.

Compiled code is there beforehand, but for the command that compiles. Each command runs alone.
"""

import statistics
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from pydantic import Field

from rockcheck.validation import history_file
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.finding import (
    Axis,
    Block,
    Column,
    Finding,
    Panel,
    Plot,
    Series,
    Table,
    text,
)
from rockcheck.validation.studies.command_cost.measuring import Cost, cost_of
from rockcheck.validation.study import Study, Task

#: How often a command of some seconds runs: the median counts. Others, and all of a quick study,
#: run once.
REPEATS = 3
MEGABYTE = 1e6


@dataclass(frozen=True)
class Command:
    """A command that is measured: its words, what it does, and what runs before, unmeasured.

    `long` ones take more than some seconds: they run once, and a quick study leaves them out. One
    that `compiles` finds no compiled code the first time.
    """

    words: str
    what: str
    before: tuple[str, ...] = ()
    long: bool = False
    compiles: bool = False


COMMANDS = {
    command.words: command
    for command in (
        Command("--version", "the version"),
        Command("scenes", "models and scenes by name"),
        Command("simulate fig5a --model ebm-unilateral", "one history of 36 s"),
        Command(
            "compare a.csv b.csv",
            "two histories of 36 s",
            before=(
                "simulate fig5a --model ebm-unilateral -o a.csv",
                "simulate fig5a --model cm -o b.csv",
            ),
        ),
        Command("validate smoke", "six scenes, five models"),
        Command("validate paper", "the paper's scenes", long=True),
        Command("validate walls", "walls at many gaps", long=True),
        Command(
            "report rockcheck-report --scene smoke-record -o record.svg",
            "a figure for print",
            before=("validate smoke",),
        ),
        Command("assess fig5a", "one scene: falls, gaps, intensities"),
        Command("spectrum fig8 --size 40", "seven spectra of 1,600 pulses"),
        Command("spectrum", "28 spectra of 10,000 pulses", long=True),
        Command("conformance --engine mujoco", "the cards of an engine"),
        Command("benchmark ebm --quick", "compiled batches, in small"),
        Command("benchmark --quick", "run time against error, in small", long=True),
        Command("stress --quick", "some thousand random runs", long=True),
        Command("warm", "compile everything", long=True, compiles=True),
    )
}


class CommandCosts(Stored):
    """The costs of a command: in an empty folder, and again in the same one."""

    first: tuple[Cost, ...]
    again: tuple[Cost, ...]


@dataclass(frozen=True)
class CommandTask(Task):
    """A command, run so many times in an empty folder, each time followed by once more."""

    command: str
    repeats: int

    @property
    def label(self) -> str:
        """The command."""
        return self.command

    def play(self) -> CommandCosts:
        """Runs it; raises `ModelFailure` where it fails."""
        first, again = zip(*(self._pair() for _ in range(self.repeats)), strict=True)
        return CommandCosts(first=first, again=again)

    def _pair(self) -> tuple[Cost, Cost]:
        command = COMMANDS[self.command]
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            environment = {"NUMBA_CACHE_DIR": str(folder / "compiled")} if command.compiles else {}
            for earlier in command.before:
                cost_of(earlier.split(), folder, environment)
            words = command.words.split()
            return cost_of(words, folder, environment), cost_of(words, folder, environment)


class CostsOfRun(Stored):
    """One run in a history: time, commit, and the median costs of each command."""

    created: str
    commit: str = ""
    first: dict[str, Cost] = Field(default_factory=dict)
    again: dict[str, Cost] = Field(default_factory=dict)


@dataclass(frozen=True)
class CommandCost(Study):
    """All commands, or the `quick` ones. `earlier` are the runs of a history, the oldest first."""

    quick: bool = False
    earlier: Sequence[CostsOfRun] = ()
    name = "commands"
    record = CommandCosts

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Task]:
        """A task a command."""
        return [
            CommandTask(command.words, 1 if self.quick or command.long else REPEATS, where="timed")
            for command in COMMANDS.values()
            if not (self.quick and command.long)
        ]

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The table, and the plot over the history."""
        costs = {
            task.command: record
            for task, record in done.items()
            if isinstance(record, CommandCosts)
        }
        blocks: list[Block] = [cost_table(costs)]
        now = CostsOfRun(
            created=datetime.now(UTC).isoformat(timespec="seconds"),
            commit=history_file.commit_of(Path()),
            first={command: _median(record.first) for command, record in costs.items()},
            again={command: _median(record.again) for command, record in costs.items()},
        )
        if self.earlier:
            blocks += [history_plot([*self.earlier, now]), runs_table([*self.earlier, now])]
        return Finding(
            self.name,
            "What each command costs",
            f"{len(costs)} commands, one after the other, in an empty folder and again in it.",
            blocks,
            data=now.model_dump(),
            exit_code=3 if len(costs) < len(done) else 0,
        )


def _median(costs: Sequence[Cost]) -> Cost:
    return Cost(
        wall=statistics.median(cost.wall for cost in costs),
        cpu=statistics.median(cost.cpu for cost in costs),
        peak=statistics.median(cost.peak for cost in costs),
    )


def cost_table(costs: Mapping[str, CommandCosts]) -> Table:
    """A row a command."""
    columns = [
        text("command"),
        text("what", brief=False),
        Column("first", "wall clock", "s", digits=2, help="in an empty folder"),
        Column("again", "again", "s", digits=2, help="once more in the same folder"),
        Column("slowest", "slowest first", "s", digits=2, brief=False),
        Column("cpu", "CPU", "s", help="in an empty folder, of all processes"),
        Column("cpu_again", "CPU again", "s", brief=False),
        Column("peak", "peak memory", "MB", digits=3, help="of the largest process"),
    ]
    rows = []
    for command, record in costs.items():
        first, again = _median(record.first), _median(record.again)
        rows.append(
            [
                f"rockcheck {command}",
                COMMANDS[command].what,
                first.wall,
                again.wall,
                max(cost.wall for cost in record.first),
                first.cpu,
                again.cpu,
                max(first.peak, again.peak) / MEGABYTE,
            ]
        )
    note = (
        "Medians of three runs; what takes long runs once. Compiled code is there beforehand, but"
        " for rockcheck warm."
    )
    return Table("commands", columns, rows, "Commands", note=note)


def history_plot(runs: Sequence[CostsOfRun]) -> Plot:
    """Wall clock of each command over the runs of a history."""
    numbers = list(range(1, len(runs) + 1))
    panels = [
        Panel(
            f"rockcheck {command}",
            [
                Series("first", numbers, _walls([run.first.get(command) for run in runs])),
                Series("again", numbers, _walls([run.again.get(command) for run in runs])),
            ],
        )
        for command in runs[-1].first
    ]
    return Plot(
        "over-runs",
        "Over the runs of the history",
        panels=panels,
        x=Axis("run"),
        y=Axis("wall clock, s"),
        shared=False,
    )


def _walls(costs: Sequence[Cost | None]) -> list[float | None]:
    return [None if cost is None else cost.wall for cost in costs]


def runs_table(runs: Sequence[CostsOfRun]) -> Table:
    """The runs of a history, the last one first."""
    rows = [[number, run.created, run.commit] for number, run in enumerate(runs, 1)]
    return Table(
        "runs", [Column("run"), text("made"), text("commit")], rows[::-1], "Runs", on="page"
    )
