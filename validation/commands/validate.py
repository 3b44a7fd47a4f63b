"""`rockcheck validate`: the main job."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from scenes import InputError
from validation import remote, workers
from validation.commands import OUT, JobsOption, OutOption, SchedulerOption, console, usable_folder
from validation.publish import keep, publish
from validation.results import Run
from validation.runner import run_suite
from validation.suites import load_suite
from validation.tables import verdict_lines, verdict_table

ForceOption = Annotated[bool, typer.Option("--force", help="Run every cell, also those whose results are up to date.")]
SuiteArgument = Annotated[str | None, typer.Argument(help="A named suite or a .toml file (default: paper).")]


def run(
    suite: SuiteArgument = None,
    out: OutOption = OUT,
    jobs: JobsOption = None,
    quick: Annotated[bool, typer.Option("--quick", help="The suite smoke: the smallest that means something.")] = False,
    force: ForceOption = False,
    strict: Annotated[bool, typer.Option("--strict", help="Figures that changed beyond their drift band fail.")] = False,
    scheduler: SchedulerOption = None,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Render the pages; without them only run.json and tables.")] = True,
) -> None:
    """Run every model of a suite on every scene, compare, judge, and write the report.

    Exit 0: within tolerance. 1: out of tolerance. 2: bad input. 3: a model failed.
    """
    if quick and suite not in (None, "smoke"):
        raise InputError(f"cannot be given together with the suite {suite!r}", "--quick")
    folder = usable_folder(out)
    finished = play_suite(suite or ("smoke" if quick else "paper"), folder, jobs, force, strict, scheduler)
    kept = keep(finished, folder)
    show(finished, console())
    console().print(f"report: {publish(finished, folder) if report else kept}", soft_wrap=True)
    raise typer.Exit(finished.exit_code)


def play_suite(suite: str, folder: Path, jobs: int | None, force: bool, strict: bool, scheduler: str | None) -> Run:
    """Run a suite with a progress bar on stderr."""
    loaded = load_suite(suite)
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    with bar:
        task = bar.add_task(loaded.name, total=None)

        def progress(done: int, of: int, what: str) -> None:
            bar.update(task, completed=done, total=of, description=f"{loaded.name}: {what[:40]}")

        play = workers.local if scheduler is None else remote.OnCluster(scheduler)
        return run_suite(loaded, folder, jobs=jobs, force=force, strict=strict, play=play, progress=progress)


def show(finished: Run, out: Console) -> None:
    """The verdicts: a table, the reasons of what is not a pass, and a last line."""
    out.print(verdict_table(finished))
    for line in verdict_lines(finished):
        out.print(line, style="red" if finished.exit_code else "yellow")
    cells = len(finished.cells)
    out.print(f"{finished.up_to_date} of {cells} cells were up to date; {finished.wall_seconds:.1f} s")
    out.print(f"verdict: {finished.verdict}", style="bold")
