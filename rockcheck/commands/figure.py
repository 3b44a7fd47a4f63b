"""`rockcheck figure`: one figure of a finished run, for a paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rockcheck.commands import answer, console
from rockcheck.scenes import InputError
from rockcheck.scenes.errors import printable


def run(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a finished run.")],
    scene: Annotated[str, typer.Argument(help="A scene of the run, or an ensemble.")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="File to write: .svg, .png or .pdf (default: SCENE.pdf).")] = None,
    against: Annotated[
        str | None, typer.Option("--against", help="The model whose differences are shown (default: the scene's first reference).")
    ] = None,
) -> None:
    """Draw one scene of a finished run for a paper.

    All models over time, below each quantity their differences from the reference with the tolerances shaded, then impacts.
    """
    from rockcheck.reports.site import write_figure
    from rockcheck.validation.execute.store import name_of

    path = output or Path(f"{name_of(scene)}.pdf")
    if not path.parent.is_dir():
        raise InputError(f"{printable(path.parent)}: no such folder", "--output")
    written = write_figure(folder, scene, path, against)
    console().print(f"figure: {written}", soft_wrap=True)
    answer({"figure": written})
