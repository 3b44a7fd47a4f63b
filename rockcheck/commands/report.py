"""`rockcheck report`: render a finished run again, or one figure of it for a paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rockcheck.commands import answer, console, progress
from rockcheck.commands.publish import publish
from rockcheck.scenes import InputError
from rockcheck.scenes.errors import printable
from rockcheck.validation.suite.results import Run


def run(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a finished run.")],
    scene: Annotated[
        list[str] | None,
        typer.Option(
            "--scene",
            metavar="NAME",
            help="A scene that gets a page, too (repeatable), or that -o draws.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="Draw one scene or ensemble, and stop: .svg, .png or .pdf."
        ),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option(
            "--against",
            help="With -o: the model whose differences are shown (default: the first reference).",
        ),
    ] = None,
) -> None:
    """Render the pages of a finished run again.

    A run of more than 200 scenes has pages of 200: those that are not within tolerance, then the
    nearest to a limit. With --scene NAME -o FILE.pdf: that figure alone, all models over time with
    their differences and tolerances.
    """
    Run.load(folder)
    if output is not None:
        _draw(folder, scene or [], output, against)
        return
    if against is not None:
        raise InputError("needs -o FILE", "--against")
    with progress("pages") as on_progress:
        index = publish(folder, afresh=not scene, wanted=scene or (), on_progress=on_progress)
    console().print(f"report: {index}", soft_wrap=True)
    answer({"report": index})


def _draw(folder: Path, scenes: list[str], path: Path, against: str | None) -> None:
    from rockcheck.reports.site import write_figure

    if len(scenes) != 1:
        raise InputError("needs one --scene NAME", "--output")
    if not path.parent.is_dir():
        raise InputError(f"{printable(path.parent)}: no such folder", "--output")
    written = write_figure(folder, scenes[0], path, against)
    console().print(f"figure: {written}", soft_wrap=True)
    answer({"figure": written})
