"""`rockcheck ida`: peak rotation against the intensity of recorded motions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.table import Table

from rockcheck.commands import OUT, JobsOption, answer, console, out_option, progress, scene_names, tell_left_out, usable_folder
from rockcheck.commands.record import (
    ColumnOption,
    ComponentOption,
    DecimalOption,
    HeaderLinesOption,
    TimeStepOption,
    UnitOption,
    reading_of,
)
from rockcheck.commands.run import MoreRecords, RecordOption
from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import InputError, load_scene
from rockcheck.scenes.errors import unknown_name
from rockcheck.scenes.recordings.sets import files_of, motions_of
from rockcheck.scenes.writing import write_whole
from rockcheck.validation.spectra.ida import CAPACITIES, MEASURES, analyse, lines_table

IDA = "ida"
MOST_LEVELS = 1000


def run(
    scene: Annotated[str, typer.Argument(help="Block, floor and walls: a named scene or a .toml file.", autocompletion=scene_names)],
    more: MoreRecords = None,
    records: RecordOption = None,
    intensity: Annotated[str, typer.Option("--intensity", help=f"The measure of intensity: {', '.join(MEASURES)}.")] = "pga",
    period: Annotated[float | None, typer.Option("--period", help="T1 of --intensity sa, s.", min=1e-3)] = None,
    span: Annotated[tuple[float, float], typer.Option("--range", help="Least and largest intensity.")] = (0.05, 2.0),
    levels: Annotated[int, typer.Option("--levels", help="Intensities between them.", min=2, max=MOST_LEVELS)] = 40,
    capacity: Annotated[
        list[float] | None, typer.Option("--capacity", help="Peak rotation (alpha) of a fragility curve; repeatable.", min=1e-6, max=1.0)
    ] = None,
    pivot: Annotated[str, typer.Option("--pivot", help="unilateral, or bilateral as in the paper: the block cannot hop.")] = "unilateral",
    unit: UnitOption = None,
    time_step: TimeStepOption = None,
    column: ColumnOption = None,
    header_lines: HeaderLinesOption = None,
    decimal: DecimalOption = None,
    component: ComponentOption = None,
    out: Annotated[Path, out_option("ida/index.html")] = OUT,
    jobs: JobsOption = None,
) -> None:
    """Peak rotation against the intensity of records.

    Each record is scaled to every intensity and played in both directions by the event-based model: a curve a motion, their median
    and 16 to 84 % band, and fragility curves for peak rotations.
    """
    if not 0.0 < span[0] < span[1]:
        raise InputError(f"{span[0]:g} to {span[1]:g} is not allowed: 0 < least < largest", "--range")
    if pivot not in ("unilateral", "bilateral"):
        raise InputError(str(unknown_name("pivot", pivot, ("unilateral", "bilateral"))), "--pivot")
    words = [*(records or []), *(more or [])]
    if not words:
        raise InputError("no records are given: name files, a folder of them, or a pattern", "--record")
    motions, left_out = motions_of(files_of(words), reading_of(unit, time_step, column, header_lines, decimal, component))
    folder = usable_folder(out, IDA)
    with progress("ida") as on_progress:
        found = analyse(
            load_scene(scene),
            motions,
            np.linspace(*span, levels),
            measure=intensity,
            period=period,
            capacities=tuple(capacity) if capacity else CAPACITIES,
            model=EventBasedModel(pivot="unilateral" if pivot == "unilateral" else "bilateral", tolerance=1e-8),
            jobs=jobs,
            on_progress=on_progress,
        )
    write_whole(folder / "ida.json", found.model_dump_json(indent=1) + "\n")
    write_whole(folder / "ida.csv", lines_table(found))
    from rockcheck.reports.studies.ida import write_ida

    page = write_ida(found, folder)
    screen = console()
    table = Table(box=None, pad_edge=False)
    for name in ("", f"median, {found.unit}", "95 %", "dispersion"):
        table.add_column(name)
    for one in found.capacities:
        fit = one.curve
        within = f"{one.low:.3g} to {one.high:.3g}" if one.low is not None and one.high is not None else "-"
        median, dispersion = ("-", "-") if fit.median is None else (f"{fit.median:.3g}", f"{fit.dispersion:.2g}")
        table.add_row(fit.label, median, within, dispersion)
    screen.print(f"{found.scene}, {found.label}: {len(motions)} records in both directions, {levels} intensities", soft_wrap=True)
    tell_left_out(left_out)
    screen.print(table)
    screen.print(f"report: {page}", soft_wrap=True)
    answer(found.model_dump(mode="json", exclude={"lines"}) | {"report": page, "table": folder / "ida.csv", "left_out": left_out})
