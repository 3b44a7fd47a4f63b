"""Options that several commands have, and what the shell completes them with.

In: nothing. Out: types of parameters for Typer. The commands' functions are declared with them.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from rockcheck.reports.style import ENDINGS
from rockcheck.scenes import named_scenes
from rockcheck.validation.execute.models import FAMILIES

OUT = Path("rockcheck-report")


OutOption = Annotated[
    Path,
    typer.Option("--out", help="Folder to write; the page to open is index.html in it."),
]


JobsOption = Annotated[
    int | None, typer.Option("--jobs", min=1, help="Worker processes (default: one a core).")
]


AllowCodeOption = Annotated[
    list[str] | None,
    typer.Option(
        "--allow-code",
        metavar="MODULE:CLASS",
        help="A model of your own that may be run: its code is imported; repeatable.",
    ),
]


@dataclass(frozen=True)
class Played:
    """The options of a study: the folder that it writes, and where it is played."""

    out: OutOption = OUT
    jobs: JobsOption = None
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            help="Run on a Dask cluster instead: its address, or local:N for N local workers.",
        ),
    ] = None


PlotOption = Annotated[
    Path | None, typer.Option("--plot", metavar="FILE", help=f"Figure to draw: {ENDINGS}.")
]


def completing(
    known: Callable[[], Iterable[str]], *, files: bool = True
) -> Callable[[str], list[str]]:
    """For the shell's completion: the names that are `known`, and the TOML `files` here."""

    def complete(incomplete: str) -> list[str]:
        here = sorted(path.name for path in Path().glob("*.toml")) if files else []
        return [name for name in (*known(), *here) if name.startswith(incomplete)]

    return complete


scene_names = completing(named_scenes)


model_names = completing(lambda: FAMILIES, files=False)
