"""`rockcheck validate`: the main job."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console

from rockcheck.commands import (
    OUT,
    AllowCodeOption,
    JobsOption,
    OutOption,
    SchedulerOption,
    answer,
    console,
    suite_names,
    tell_left_out,
    tell_missing,
    usable_folder,
)
from rockcheck.commands.publish import keep
from rockcheck.commands.run import ForceOption, chosen_models, play, play_scene, published, tell_faults
from rockcheck.scenes import InputError
from rockcheck.scenes.errors import printable
from rockcheck.validation.suite.changes import Moment, moment_of, remember, trends
from rockcheck.validation.suite.results import Run, Strict
from rockcheck.validation.suite.suites import is_scene, load_suite, scene_suite
from rockcheck.validation.suite.tables import improvements, not_shown, summary, verdict_lines, verdict_table

#: The folder of the trend's page, and so many figures that moved are told.
TREND, MOST_MOVED = "trend", 10
Strictness = Literal["worse", "both"]
SuiteArgument = Annotated[str | None, typer.Argument(help="A named suite or a .toml file (default: paper).", autocompletion=suite_names)]


def run(
    suite: SuiteArgument = None,
    out: OutOption = OUT,
    jobs: JobsOption = None,
    quick: Annotated[bool, typer.Option("--quick", help="The suite smoke: the smallest that means something.")] = False,
    force: ForceOption = False,
    strict: Annotated[
        Strictness | None,
        typer.Option("--strict", help="Figures that left their drift band for the worse fail; with `--strict both` better ones, too."),
    ] = None,
    scheduler: SchedulerOption = None,
    allow_code: AllowCodeOption = None,
    history: Annotated[
        Path | None, typer.Option("--history", metavar="FILE", help="Append this run to FILE (a JSON line a run), and show the trend.")
    ] = None,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Render the pages; without them only run.json and tables.")] = True,
) -> None:
    """Run a suite, compare, judge, write the report.

    Every model on every scene; cells whose results are up to date are read back. A scene in place of a suite is played by all models,
    as by `rockcheck run`, and nothing is judged.

    Exit 0: within tolerance. 1: out of tolerance. 2: bad input. 3: a model failed. 70: a fault of rockcheck itself.
    """
    if quick and suite not in (None, "smoke"):
        raise InputError(f"cannot be given together with the suite {suite!r}", "--quick")
    folder = usable_folder(out)
    if suite is not None and is_scene(suite):
        if strict:
            raise InputError(f"{printable(suite)} is a scene, and nothing of it is judged: give a suite", "--strict")
        console().print(f"{suite} is a scene: all models play it, nothing is judged (as `rockcheck run {suite}`)", soft_wrap=True)
        alone = scene_suite(suite, chosen_models())
        tell_missing()
        play_scene(alone, folder, jobs=jobs, force=force, scheduler=scheduler, report=report)
    how: Strict = "both" if strict == "both" else strict is not None
    finished = play_suite(suite or ("smoke" if quick else "paper"), folder, jobs, force, how, scheduler, allow_code)
    kept = keep(finished, folder)
    show(finished, console())
    tell_faults(finished, folder)
    moments = [] if history is None else remember(history, moment_of(finished, Path(finished.tolerances_file).parent))
    if history is not None:
        tell_trend(moments, history)
    if history is not None and report:
        from rockcheck.reports.studies.trend import write_trend

        console().print(f"trend: {write_trend(moments, usable_folder(folder, TREND))}", soft_wrap=True)
    page = published(folder, jobs) if report else kept
    console().print(f"report: {page}", soft_wrap=True)
    answer(summary(finished) | {"report": page})
    raise typer.Exit(finished.exit_code)


def play_suite(
    suite: str, folder: Path, jobs: int | None, force: bool, strict: Strict, scheduler: str | None, allow_code: Sequence[str] | None
) -> Run:
    """Run a suite with a progress bar on stderr."""
    loaded = load_suite(suite, allow_code=allow_code or ())
    tell_left_out(loaded.left_out)
    return play(loaded, folder, jobs, force, strict, scheduler)


def tell_trend(moments: Sequence[Moment], path: Path) -> None:
    """How many runs a history has, and the figures that moved since the one before."""
    moved = [trend for trend in trends(moments) if trend.moved]
    since = f", {len(moved)} figures moved since {moments[-2].commit or moments[-2].created}" if len(moments) > 1 else ""
    console().print(f"{path}: {len(moments)} runs{since}", soft_wrap=True)
    for trend in moved[:MOST_MOVED]:
        was, now = ("-" if value is None else f"{value:.6g}" for value in trend.values[-2:])
        console().print(f"  {trend.name}: {was} -> {now}", soft_wrap=True)


def show(finished: Run, out: Console) -> None:
    """The verdicts: a table, the reasons of what is not a pass, and a last line."""
    out.print(verdict_table(finished))
    for line in not_shown(finished):
        out.print(line)
    for line in verdict_lines(finished):
        out.print(line, style="red" if finished.exit_code else "yellow")
    better = list(improvements(finished))
    if better:
        out.print("better than expected; `rockcheck accept` makes today's the expected ones:")
    for line in better:
        out.print(line, style="red" if finished.strict == "both" else "green")
    if finished.without_tolerance:
        out.print(f"{finished.without_tolerance} figures have no tolerance yet: `rockcheck accept` makes today's the expected ones")
    out.print(f"{finished.up_to_date} of {len(finished.cells)} simulations were up to date; {finished.wall_seconds:.1f} s")
    out.print(f"verdict: {finished.words}", style="bold")
