"""`rockcheck report`: render a finished run again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rockcheck.commands import answer, console, progress
from rockcheck.commands.publish import publish
from rockcheck.validation.suite.results import Run


def run(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a finished run.")],
    scene: Annotated[
        list[str] | None, typer.Option("--scene", metavar="NAME", help="A scene that gets a page, too (may be repeated).")
    ] = None,
) -> None:
    """Render the pages of a finished run again.

    A run of more than 200 scenes has pages of 200: those that are not within tolerance, then the nearest to a limit.
    """
    Run.load(folder)
    with progress("pages") as on_progress:
        index = publish(folder, afresh=not scene, wanted=scene or (), on_progress=on_progress)
    console().print(f"report: {index}", soft_wrap=True)
    answer({"report": index})
