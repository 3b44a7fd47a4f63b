"""`rockcheck run`: one scene by all models, perhaps under records, without a suite."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer

from rockcheck.commands import (
    OUT,
    AllowCodeOption,
    JobsOption,
    OutOption,
    SchedulerOption,
    answer,
    console,
    model_names,
    progress,
    scene_names,
    tell_left_out,
    tell_missing,
    usable_folder,
)
from rockcheck.commands.publish import keep, publish
from rockcheck.commands.record import (
    ColumnOption,
    ComponentOption,
    DecimalOption,
    HeaderLinesOption,
    TimeStepOption,
    UnitOption,
    reading_of,
)
from rockcheck.commands.simulate import setting_of
from rockcheck.scenes import InputError
from rockcheck.scenes.errors import printable
from rockcheck.scenes.recordings.sets import record_path
from rockcheck.validation.execute.models import FAMILIES, family, is_own, not_installed
from rockcheck.validation.suite.record_sets import RecordSet
from rockcheck.validation.suite.results import Run, Strict
from rockcheck.validation.suite.runner import run_suite
from rockcheck.validation.suite.suites import Suite, scene_suite
from rockcheck.validation.suite.tables import outcome_row, outcome_tables, verdict_lines

ALL = "all"
ForceOption = Annotated[bool, typer.Option("--force", help="Run every cell, also those whose results are up to date.")]
RecordOption = Annotated[
    list[str] | None,
    typer.Option("--record", help='Record files, a folder of them, or a pattern such as "RSN1_H*.AT2"; repeatable.'),
]
MoreRecords = Annotated[list[str] | None, typer.Argument(metavar="[RECORDS]...", help="More records, as a shell's own pattern gives them.")]


def run(
    scene: Annotated[str, typer.Argument(help="A named scene or a .toml file.", autocompletion=scene_names)],
    more: MoreRecords = None,
    records: RecordOption = None,
    models: Annotated[
        str, typer.Option("--models", help="all: those that are installed; or names, with commas between.", autocompletion=model_names)
    ] = ALL,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="A setting of a model, such as mujoco.time_step=1e-3; repeatable.")
    ] = None,
    scale: Annotated[float, typer.Option("--scale", help="Factor of the records' accelerations.")] = 1.0,
    vertical: Annotated[
        bool, typer.Option("--vertical", help="With the vertical component: of the same file, or of a file of the set that is named alike.")
    ] = False,
    unit: UnitOption = None,
    time_step: TimeStepOption = None,
    column: ColumnOption = None,
    header_lines: HeaderLinesOption = None,
    decimal: DecimalOption = None,
    component: ComponentOption = None,
    out: OutOption = OUT,
    jobs: JobsOption = None,
    force: ForceOption = False,
    scheduler: SchedulerOption = None,
    allow_code: AllowCodeOption = None,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Render the pages; without them only run.json and tables.")] = True,
) -> None:
    """Play one scene by all models, beside each other.

    With records: once for each, in place of the scene's own excitation. A table and a report; nothing is judged, and no suite is needed.
    """
    words = [*(records or []), *(more or [])]
    reading = reading_of(unit, time_step, column, header_lines, decimal, component)
    given = {name: value for name, value in reading if value is not None}
    if not words and (given or vertical or scale != 1.0):
        raise InputError("is missing: a unit, a scale or another option of records is given", "--record")
    files = tuple(str(record_path(word, Path()).absolute()) for word in words)
    sets = [RecordSet(files=files, scale=scale, vertical=vertical, **given)] if files else []
    suite = scene_suite(scene, chosen_models(models, settings or ()), records=sets, allow_code=allow_code or ())
    folder = usable_folder(out)
    if models == ALL:
        tell_missing()
    play_scene(suite, folder, jobs=jobs, force=force, scheduler=scheduler, report=report)


def chosen_models(names: str = ALL, settings: Sequence[str] = ()) -> dict[str, dict[str, Any]]:
    """The models by name, each with its settings; of all, those that are installed. Raises `InputError` for an unknown one."""
    if names == ALL:
        found: dict[str, dict[str, Any]] = {name: {} for name in FAMILIES if name != "measured" and not not_installed(name)}
    else:
        found = {name.strip(): {} for name in names.split(",") if name.strip()}
        for name in found:
            family(name)
        if not found or "measured" in found:
            raise InputError(f"{printable(names)!r} is not allowed: models that play, with commas between, or all", "--models")
    for text in settings:
        model, dot, rest = text.partition(".")
        if not dot or model not in found:
            raise InputError(f"{printable(text)!r}: write MODEL.key=value, with MODEL one of {', '.join(found)}", "--set")
        key, value = setting_of(rest)
        found[model][key] = value
    return found


def play_scene(suite: Suite, folder: Path, *, jobs: int | None, force: bool, scheduler: str | None, report: bool) -> None:
    """Play a suite that judges nothing; a table, the report, and exit 3 where a model failed.

    Raises `InputError` where `folder` holds a judged run, whose pages and tables this one would overwrite.
    """
    before = None
    with suppress(InputError):  # no run there, or none that can be read
        before = Run.load(folder)
    if before is not None and before.judged:
        raise InputError(f"{printable(folder)} holds the judged run of suite {before.suite!r}: give another folder", "--out")
    finished = play(suite, folder, jobs, force, False, scheduler)
    kept = keep(finished, folder)
    screen = console()
    tell_left_out(suite.left_out, "--vertical plays such a component together with the horizontal ones")
    for name, table in outcome_tables(finished):
        screen.print(name, style="bold", soft_wrap=True)
        screen.print(table)
    screen.print(
        "peak: largest rotation; apart: RMS difference from the reference, to the horizon of predictability; in alpha", soft_wrap=True
    )
    for line in verdict_lines(finished):
        screen.print(line, style="red" if finished.exit_code else "yellow", soft_wrap=True)
    tell_faults(finished, folder)
    page = published(folder, jobs) if report else kept
    screen.print(f"report: {page}", soft_wrap=True)
    answer(
        {
            "suite": finished.suite,
            "judged": False,
            "reference": finished.reference,
            "exit_code": finished.exit_code,
            "cells": [outcome_row(cell, finished.reference) for cell in finished.cells],
            "left_out": suite.left_out,
            "reasons": list(verdict_lines(finished)),
            "report": page,
        }
    )
    raise typer.Exit(finished.exit_code)


def play(suite: Suite, folder: Path, jobs: int | None, force: bool, strict: Strict, scheduler: str | None) -> Run:
    """Run a suite with a progress bar on stderr."""
    compiles = ", a first run compiles" if any(not is_own(one.family_name) and one.family.compiled for one in suite.models.values()) else ""
    with progress(f"{suite.name}{compiles}") as on_progress:
        return run_suite(suite, folder, jobs=jobs, force=force, strict=strict, scheduler=scheduler, on_progress=on_progress)


def published(folder: Path, jobs: int | None) -> Path:
    """The pages of the run that was kept in `folder`, with a progress bar; returns the page to open."""
    with progress("pages") as on_progress:
        return publish(folder, jobs=jobs, on_progress=on_progress)


def tell_faults(finished: Run, folder: Path) -> None:
    """A line on stderr for each exception that no model may raise: of rockcheck's own models to report, of one's own to mend."""
    for cell in finished.cells:
        if not cell.traceback:
            continue
        where, path = f"{cell.scene}, {cell.model}: {cell.reason}", folder / cell.traceback
        said = f"a fault of rockcheck itself, {where}: please report it with {path}" if cell.unexpected else f"{where}: traceback in {path}"
        print(printable(f"rockcheck: {said}", 1400), file=sys.stderr)
