"""`rockcheck record`: what a file of a recorded ground motion was understood to hold."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.table import Table

from rockcheck.commands import answer, check_picture, console, save_picture, tell_left_out
from rockcheck.scenes import InputError
from rockcheck.scenes.errors import printable
from rockcheck.scenes.recordings import UNITS, Reading, Recording, intensity, read_components
from rockcheck.scenes.recordings.sets import Odd, files_of

UnitOption = Annotated[str | None, typer.Option("--unit", help=f"Unit of the accelerations: {', '.join(UNITS)}.")]
TimeStepOption = Annotated[float | None, typer.Option("--time-step", help="Time step, s, where the file has no times.")]
ColumnOption = Annotated[str | None, typer.Option("--column", help="Column of the accelerations: its number from 1, or its name.")]
HeaderLinesOption = Annotated[int | None, typer.Option("--header-lines", help="Number of lines to skip at the top.")]
DecimalOption = Annotated[str | None, typer.Option("--decimal", help="The decimal sign: . or ,")]
ComponentOption = Annotated[str | None, typer.Option("--component", help="Which of several components: its number from 1, or its name.")]

#: Parts of the line that pictures a motion, and its marks from the smallest acceleration to the largest.
_PARTS, _MARKS = 60, " ▁▂▃▄▅▆▇█"


def run(
    files: Annotated[list[str], typer.Argument(help='Record files, folders of them, or patterns such as "RSN1_H*.AT2".')],
    unit: UnitOption = None,
    time_step: TimeStepOption = None,
    column: ColumnOption = None,
    header_lines: HeaderLinesOption = None,
    decimal: DecimalOption = None,
    component: ComponentOption = None,
    plot: Annotated[Path | None, typer.Option("--plot", help="PNG to draw: acceleration, velocity and Sa(T).")] = None,
) -> None:
    """Show what files of recorded ground motions hold.

    Reads PEER AT2, COSMOS and CSMIP V2, ESM, K-NET and KiK-net, CSV and columns of text; what a file does not say is an option.
    """
    check_picture(plot)
    reading = reading_of(unit, time_step, column, header_lines, decimal, component)
    found: list[tuple[Path, Recording]] = []
    faults: list[Odd] = []
    asked = files_of(files)
    for path in asked:
        try:
            found += [(path, one) for one in read_components(path, reading)]
        except InputError as error:
            faults.append(Odd(error))
    values = [_values(path, record) for path, record in found]
    for (path, record), value in zip(found, values, strict=True):
        _show(path, record, value)
    if plot is not None and found:
        _draw(found, plot)
    if found:
        answer(values[0] if len(values) == 1 else {"records": values})
    if faults:
        tell_left_out(faults[1:])
        more = f"; {len(faults)} files of {len(asked)} are not read" if len(faults) > 1 else ""
        raise InputError(f"{faults[0]}{more}")


def reading_of(
    unit: str | None, time_step: float | None, column: str | None, header_lines: int | None, decimal: str | None, component: str | None
) -> Reading:
    """The options of a reader from those of a command; digits are a number, all else a name."""
    given: dict[str, Any] = {"unit": unit, "time_step": time_step, "header_lines": header_lines, "decimal": decimal}
    for name, word in (("column", column), ("component", component)):
        given[name] = int(word) if word is not None and word.isascii() and word.isdecimal() and len(word) < 9 else word
    return Reading(**given)


def _values(path: Path, record: Recording) -> dict[str, Any]:
    """What the samples amount to, as `--json` says it."""
    return {
        "file": path,
        "format": record.form,
        "component": record.component,
        "samples": len(record.samples),
        "step_s": record.time_step,
        "duration_s": record.time_step * (len(record.samples) - 1),
        "unit": record.unit,
        "pga_g": intensity.peak_acceleration(record),
        "pgv_m_s": intensity.peak_velocity(record),
        "arias_m_s": intensity.arias(record),
        "sa_g": {f"{period:g}": intensity.spectral_acceleration(record, period) for period in intensity.PERIODS},
        "notes": record.notes,
    }


def _show(path: Path, record: Recording, value: dict[str, Any]) -> None:
    out = console()
    title = f"{path}, {record.component}" if record.component else str(path)
    out.print(title, style="bold", soft_wrap=True)
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column("")
    table.add_column("", overflow="fold")
    table.add_row("format", f"{value['format']}, unit {value['unit']}")
    table.add_row("samples", f"{value['samples']} every {value['step_s']:.6g} s, {value['duration_s']:.6g} s")
    table.add_row("PGA", f"{value['pga_g']:.4g} g")
    table.add_row("PGV", f"{value['pgv_m_s']:.4g} m/s")
    table.add_row("Arias", f"{value['arias_m_s']:.4g} m/s")
    table.add_row("Sa(T), 5 %", ", ".join(f"{period} s: {sa:.3g} g" for period, sa in value["sa_g"].items()))
    table.add_row("|a|", _picture(record))
    for note in record.notes:
        table.add_row("note", printable(note, 200))
    out.print(table)


def _picture(record: Recording) -> str:
    """The largest acceleration in each part of the motion, as bars."""
    peaks = np.array([np.max(part) for part in np.array_split(np.abs(record.samples), min(_PARTS, len(record.samples)))])
    largest = float(np.max(peaks))
    levels = np.ceil(peaks / largest * (len(_MARKS) - 1)).astype(int) if largest > 0.0 else np.zeros(len(peaks), dtype=int)
    return "".join(_MARKS[level] for level in levels)


def _draw(found: list[tuple[Path, Recording]], plot: Path) -> None:
    from rockcheck.reports.show.drawing import recordings_figure

    save_picture(recordings_figure([(f"{path.name} {record.component}".strip(), record) for path, record in found[:12]]), plot)
