"""`rockcheck report`: render a finished run again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rockcheck.validation.commands import answer, console, progress
from rockcheck.validation.commands.pages.publish import publish
from rockcheck.validation.suite.results import Run


def run(folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a finished run.")]) -> None:
    """Render the pages of a finished run again."""
    Run.load(folder)
    with progress("pages") as on_progress:
        index = publish(folder, afresh=True, on_progress=on_progress)
    console().print(f"report: {index}", soft_wrap=True)
    answer({"report": index})
