"""`rockcheck report`: render a finished run again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from validation.commands import console
from validation.publish import render
from validation.results import Run


def run(folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a finished run.")]) -> None:
    """Render the report of a finished run again."""
    Run.load(folder)
    console().print(f"report: {render(folder)}", soft_wrap=True)
