"""`rockcheck diff`: what changed between two finished runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from rockcheck.commands import answer, console
from rockcheck.validation.suite.changes import Change, changes, judged_otherwise
from rockcheck.validation.suite.results import Run

#: So many figures that moved are listed without --all.
SHOWN = 20


def run(
    before: Annotated[Path, typer.Argument(metavar="RUN_A", help="Folder of a finished run.")],
    after: Annotated[Path, typer.Argument(metavar="RUN_B", help="Folder of a later run of the same suite.")],
    everything: Annotated[bool, typer.Option("--all", help=f"All figures that moved, not only the {SHOWN} that moved most.")] = False,
) -> None:
    """Show what changed between two finished runs of a suite.

    Verdicts, cells that are in one run only, outcomes, figures, and versions of libraries. Exit 1 where a verdict or a cell changed.
    """
    old, new = Run.load(before), Run.load(after)
    found = changes(old, new)
    versions = {name: (old.versions.get(name), new.versions.get(name)) for name in sorted({*old.versions, *new.versions})}
    versions = {name: pair for name, pair in versions.items() if pair[0] != pair[1]}
    screen = console()
    counts = {what: sum(change.what == what for change in found) for what in ("verdict", "cell", "outcome", "figure")}
    told = ", ".join(f"{count} {what}{'s' if count > 1 else ''}" for what, count in counts.items() if count)
    screen.print(f"{old.suite}: {f'{told} changed' if told else 'nothing changed'}", style="bold", soft_wrap=True)
    for name, (was, now) in versions.items():
        screen.print(f"{name} {was or 'absent'} -> {now or 'absent'}")
    shown = found if everything else [change for change in found if change.what != "figure"] + _figures(found)[:SHOWN]
    if shown:
        screen.print(_table(shown))
    if len(found) > len(shown):
        screen.print(f"and {len(found) - len(shown)} more figures: --all")
    code = int(judged_otherwise(found))
    answer(
        {
            "suite": old.suite,
            "verdict": [old.words, new.words],
            "exit_code": code,
            "versions": versions,
            "changes": [change.model_dump() for change in found],
        }
    )
    raise typer.Exit(code)


def _figures(found: list[Change]) -> list[Change]:
    return [change for change in found if change.what == "figure"]


def _table(found: list[Change]) -> Table:
    table = Table(box=None, pad_edge=False)
    for name in ("scene", "model", "what", "before", "after"):
        table.add_column(name, overflow="fold")
    for change in found:
        values = (f"{value:.6g}" if isinstance(value, float) else value or "-" for value in (change.before, change.after))
        table.add_row(change.scene or "the run", change.model, f"{change.what} {change.name}".strip(), *values)
    return table
