"""The commands of `rockcheck`, a module each, and the options that they share."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from scenes import InputError
from scenes.errors import printable

OUT = Path("rockcheck-report")

OutOption = Annotated[Path, typer.Option("--out", help="Folder to write; the page to open is index.html in it.")]
JobsOption = Annotated[int | None, typer.Option("--jobs", min=1, help="Worker processes (default: one a core).")]
SchedulerOption = Annotated[
    str | None, typer.Option("--scheduler", help="Run on a Dask cluster instead: its address, or local:N for N local workers.")
]


def console() -> Console:
    """Where tables go: stdout, at most as wide as the terminal, 80 columns where there is none."""
    return Console(markup=False, highlight=False)


def usable_folder(path: Path) -> Path:
    """`path`, made if need be; raises `InputError` where it cannot be written."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{printable(path)}: cannot be used as a folder: {error.strerror}") from None
    if not os.access(path, os.W_OK | os.X_OK):
        raise InputError(f"{printable(path)}: not writable")
    return path
