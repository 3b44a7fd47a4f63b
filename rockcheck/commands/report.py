"""`rockcheck report`: render a finished run again, or one of its figures for a paper.

Any command writes a finished run into its folder by `keep` (run.json, tables) and `publish`
(pages).
"""

import os
import platform
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated

import typer
from filelock import FileLock, Timeout

from rockcheck.commands import answer, check_file, console, progress
from rockcheck.scenes.errors import InputError, printable
from rockcheck.scenes.progress import OnProgress, unheard
from rockcheck.scenes.reading import read_text
from rockcheck.scenes.writing import no_link, write_whole
from rockcheck.validation.suite.results import Run
from rockcheck.validation.suite.tables import files_of, junit, markdown


def run(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a finished run.")],
    scene: Annotated[
        list[str] | None,
        typer.Option(
            "--scene",
            metavar="NAME",
            help="A scene that gets a page, too (repeatable), or what -o draws: a scene, an"
            " ensemble, or a figure of a study.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Draw that alone, and stop: .svg, .png or .pdf."),
    ] = None,
) -> None:
    """Render the pages of a finished run again.

    A run of more than 200 scenes has pages of 200: those that are not within tolerance, then the
    nearest to a limit. With --scene NAME -o FILE.pdf: that figure alone, all models over time with
    their differences and tolerances; of a study's folder the figure of that name.
    """
    if output is not None:
        from rockcheck.reports import document, site

        part = document if (folder / document.FIGURES).is_dir() else site
        if scene is None or len(scene) != 1:
            raise InputError("needs one --scene NAME", "--output")
        check_file(output, "--output")
        written = part.write_figure(folder, scene[0], output)
        console().print(f"figure: {written}", soft_wrap=True)
        answer({"figure": written})
        return
    Run.load(folder)
    with progress("pages") as on_progress:
        index = publish(folder, afresh=not scene, wanted=scene or (), on_progress=on_progress)
    console().print(f"report: {index}", soft_wrap=True)
    answer({"report": index})


LOCK, HOLDER = ".lock", ".lock.holder"
#: Time that a run waits for another one in the same folder: before it says so, and in all, s.
SILENT, PATIENCE = 2.0, 600.0


@contextmanager
def _turn(folder: Path) -> Iterator[None]:
    """Within this block no other run writes into `folder`.

    A run that waits says for which one, and gives up after `PATIENCE` s.
    """
    lock, holder = FileLock(no_link(folder / LOCK)), folder / HOLDER
    try:
        lock.acquire(timeout=SILENT)
    except Timeout:
        other = ""
        with suppress(InputError):  # it has just gone, or has not said who it is
            other = printable(read_text(holder, most=1000))
        whom = f"{other or 'another run'}, which holds {printable(folder / LOCK)}"
        print(f"rockcheck: waiting up to {PATIENCE:g} s for {whom}", file=sys.stderr)
        try:
            lock.acquire(timeout=PATIENCE)
        except Timeout:
            raise InputError(
                f"{printable(folder)}: waited {PATIENCE:g} s for {whom}: end it, or give another"
                " --out"
            ) from None
    try:
        write_whole(holder, f"process {os.getpid()} on {platform.node()}")
        yield
    finally:
        holder.unlink(missing_ok=True)
        lock.release()


def keep(run: Run, folder: Path) -> Path:
    """Write run.json, its schema and the tables; returns run.json.

    The histories are there already. Two runs take turns.
    """
    from rockcheck.reports.document import csv

    with _turn(folder):
        for table in files_of(run):
            write_whole(folder / f"{table.name}.csv", csv(table))
        write_whole(folder / "junit.xml", junit(run))
        write_whole(folder / "summary.md", markdown(run))
        return run.save(folder)


def publish(
    folder: Path,
    *,
    jobs: int | None = None,
    afresh: bool = False,
    wanted: Sequence[str] = (),
    on_progress: OnProgress = unheard,
) -> Path:
    """Write the pages of the run that was kept in `folder`; returns the page to open.

    Unless `afresh`, only pages whose content changed. `jobs` processes draw, by default one a core.
    Scenes that are `wanted` have a page in a large run, too.
    """
    from rockcheck.reports.site import write_site

    with _turn(folder):
        return write_site(
            folder,
            jobs=jobs or os.cpu_count() or 1,
            afresh=afresh,
            wanted=wanted,
            on_progress=on_progress,
        )


def withdraw(folder: Path) -> None:
    """Remove the pages of an earlier run in `folder`: they show other numbers than its run.json."""
    from rockcheck.reports.site import remove_site

    with _turn(folder):
        remove_site(folder)
