"""Figures over a history of runs (`rockcheck validate --history FILE`).

In: a finished run and a file of JSON lines, one a run (`RunSummary`). Out: the file with this run
appended, and a finding on what moved and what varied. The command calls it.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

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
    Text,
    text,
)
from rockcheck.validation.suite import results
from rockcheck.validation.suite.run_changes import has_moved

if TYPE_CHECKING:
    import pandas as pd


class RunSummary(Stored):
    """One run in a history: time, commit, version, verdict, and every judged figure.

    Figures are named "scene, model: check".
    """

    created: str
    commit: str = ""
    rockcheck: str = ""
    suite: str
    verdict: str
    wall_seconds: float = 0.0
    figures: dict[str, float | None] = Field(default_factory=dict)
    not_passed: tuple[str, ...] = ()


def summary_of_run(run: results.Run, folder: Path) -> RunSummary:
    """A run as a line of a history; the suite lies in `folder`, whose commit it has."""
    names = [
        (f"{cell.scene}, {cell.model}: {check.figure.title}", check) for cell, check in run.checks()
    ]
    return RunSummary(
        created=run.created,
        commit=history_file.commit_of(folder),
        rockcheck=run.versions.get("rockcheck", ""),
        suite=run.suite,
        verdict=run.verdict_words,
        wall_seconds=run.wall_seconds,
        figures={
            name: None if check.figure.of_a_fall else check.figure.value for name, check in names
        },
        not_passed=tuple(name for name, check in names if check.weight != "pass"),
    )


def read_runs(path: Path) -> list[RunSummary]:
    """The runs of a history; raises `InputError`, naming a line that is unusable."""
    return history_file.read_history(path, RunSummary)


def append_run(path: Path, run: RunSummary) -> list[RunSummary]:
    """Append a run to the history; returns all its runs of the same suite, the oldest first.

    Raises `InputError`, naming a line that is unusable.
    """
    runs = history_file.append_history(path, run)
    return [each for each in runs if each.suite == run.suite]


#: Most figures drawn: those that varied most. The table has all that varied.
DRAWN = 12
#: Most moved figures listed.
LISTED = 10


def trend_of(runs: Sequence[RunSummary]) -> Finding:
    """The finding on a suite's figures over its runs, the oldest first.

    Lists the figures that moved since the run before, draws and tabulates those that varied, and
    lists the runs.
    """
    last = runs[-1]
    count = f"{len(runs)} run{'s' if len(runs) > 1 else ''}"
    values = _values_of(runs)
    varied = _varied(values)
    same = values.shape[1] - len(varied)
    blocks: list[Block] = [_moved_text(values, runs, count)]
    if varied:
        panels = [_panel(name, runs) for name in varied[:DRAWN]]
        blocks.append(Plot("trend", panels=panels, x=Axis("run"), shared=False))
    blocks += [_varied_table(values[varied]), _runs_table(runs)]
    return Finding(
        "trend",
        f"{last.suite} over {count}",
        f"{len(varied)} figures varied, {same} stayed the same. The last run: {last.verdict}.",
        blocks,
    )


def _values_of(runs: Sequence[RunSummary]) -> "pd.DataFrame":
    """A row a run, a column a figure, those of the last run first; NaN where a run has none."""
    import pandas as pd

    # of all runs: a model that fails now may have had figures
    names = list(dict.fromkeys(name for run in reversed(runs) for name in run.figures))
    rows = [[run.figures.get(name) for name in names] for run in runs]
    return pd.DataFrame(rows, columns=names, dtype=float)


def _varied(values: "pd.DataFrame") -> list[str]:
    """The figures that are not the same in all runs, the widest spread first.

    What some of the runs did not have varied, too.
    """
    spread = _spread(values)
    partly = values.isna().any() & values.notna().any()
    return [name for name in _by_spread(values) if spread[name] > 0.0 or partly[name]]


def _by_spread(values: "pd.DataFrame") -> list[str]:
    spread = _spread(values)
    return sorted(values.columns, key=lambda name: -spread[name])


def _spread(values: "pd.DataFrame") -> "pd.Series[float]":
    """Range of each figure over its largest magnitude; 0 of one that is always 0 or missing."""
    return ((values.max() - values.min()) / values.abs().max()).fillna(0.0)


def _moved_text(values: "pd.DataFrame", runs: Sequence[RunSummary], count: str) -> Text:
    """What moved since the run before, a line each."""
    if len(runs) < 2:
        return Text(f"{count}, 0 figures moved")
    pairs = {name: _last_two(values[name]) for name in _by_spread(values)}
    moved = [name for name, (was, now) in pairs.items() if has_moved(name, was, now)]
    lines = [
        f"{name}: {_digits(pairs[name][0])} -> {_digits(pairs[name][1])}" for name in moved[:LISTED]
    ]
    since = runs[-2].commit or runs[-2].created
    return Text(f"{count}, {len(moved)} figures moved since {since}", items=lines)


def _last_two(figure: "pd.Series[float]") -> tuple[float | None, float | None]:
    was, now = (None if math.isnan(value) else value for value in figure.tolist()[-2:])
    return was, now


def _digits(value: float | None) -> str:
    return "-" if value is None else f"{value:.6g}"


def _varied_table(varied: "pd.DataFrame") -> Table:
    columns = [
        text("figure"),
        *(Column(name, digits=6) for name in ("first", "least", "most", "before", "now")),
    ]
    least, most = varied.min(), varied.max()
    rows = [
        [name, figure.iloc[0], least[name], most[name], *figure.tolist()[-2:]]
        for name, figure in varied.items()
    ]
    return Table("figures", columns, rows, "What varied", on="page" if rows else "file")


def _runs_table(runs: Sequence[RunSummary]) -> Table:
    columns = [*map(text, ("made", "commit", "rockcheck", "verdict")), Column("not_passed")]
    rows = [
        [run.created, run.commit, run.rockcheck, run.verdict, len(run.not_passed)]
        for run in reversed(runs)
    ]
    return Table("runs", columns, rows, "Runs", on="page")


def _panel(name: str, runs: Sequence[RunSummary]) -> Panel:
    values = [run.figures.get(name) for run in runs]
    numbers = list(range(1, len(runs) + 1))
    not_passed = [number for number in numbers if name in runs[number - 1].not_passed]
    return Panel(
        name.replace(": ", "\n", 1),
        [
            Series("", numbers, values),
            Series("not passed", not_passed, [values[n - 1] for n in not_passed], style="points"),
        ],
    )
