"""`rockcheck warm`: the compiled code, ahead."""

from __future__ import annotations

import os

from rich.table import Table

from rockcheck.commands import JobsOption, answer, console, progress
from rockcheck.scenes.progress import announcing


def run(jobs: JobsOption = None) -> None:
    """Compile the models' code ahead.

    Models compile their code on their first run on a machine, and once more after an update of
    rockcheck; what is compiled already is only looked up. Afterwards no command waits for a
    compiler.
    """
    from rockcheck.validation.execute.warming import PARTS, warm

    screen = console()
    screen.print(f"compiling {len(PARTS)} parts, what is compiled already is only looked up")
    with progress("compiling") as on_progress, announcing(None):
        taken = warm(jobs or os.cpu_count() or 1, on_progress=on_progress)
    table = Table(box=None, pad_edge=False)
    table.add_column("compiled code for")
    table.add_column("s", justify="right")
    for name, seconds in taken.items():
        table.add_row(name, f"{seconds:.1f}")
    screen.print(table)
    answer({"seconds": taken})
