"""`rockcheck record`: how a file of a recorded ground motion was read."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from rockcheck.commands import (
    PlotOption,
    answer,
    check_file,
    console,
    settings_of,
    tell_left_out,
)
from rockcheck.reports.style import save_as
from rockcheck.scenes import InputError, printable, recordings
from rockcheck.scenes.recordings import sets
from rockcheck.validation.finding import Finding, Table, Text, text
from rockcheck.validation.suite import motions

ReadOption = Annotated[
    list[str] | None,
    typer.Option(
        "--read",
        metavar="KEY=VALUE",
        help="What a file does not say of itself, or which part of it is wanted; repeatable. unit:"
        f" {', '.join(recordings.UNITS)}; time_step, s; column: that of the accelerations, its"
        " number from 1, or its name; header_lines to skip; decimal: . or ,; component: its number"
        " from 1, or its name.",
    ),
]

#: Parts of the line that pictures a motion, and its marks from the smallest acceleration to the
#: largest.
_PARTS, _MARKS = 60, " ▁▂▃▄▅▆▇█"


def run(
    files: Annotated[
        list[str],
        typer.Argument(help='Record files, folders of them, or patterns such as "RSN1_H*.AT2".'),
    ],
    read: ReadOption = None,
    plot: PlotOption = None,
) -> None:
    """Show what files of recorded ground motions hold.

    Reads PEER AT2, COSMOS and CSMIP V2, ESM, K-NET and KiK-net, CSV and columns of text; what a
    file does not say is given by --read. --plot draws acceleration, velocity and Sa(T).
    """
    from rockcheck.reports import document

    if plot is not None:
        check_file(plot, "--plot")
    reading = recordings.Reading(**settings_of(read or (), "--read"))
    asked = sets.files_of(files)
    known, faults = sets.read_files(dict.fromkeys(asked, False), reading)
    found = [(path, *one) for path, components in known.items() for one in components]
    told = [_finding(path, record) for path, _, record in found]
    for one in told:
        document.show(one, console())
    if plot is not None and found:
        from rockcheck.reports.show.drawing import recordings_figure

        figure = recordings_figure([(name, one) for _, name, one in found[:12]])
        console().print(f"figure: {save_as(figure, plot)}", soft_wrap=True)
    if found:
        values = [one.data for one in told]
        answer(values[0] if len(values) == 1 else {"records": values})
    if faults:
        tell_left_out([*map(sets.Odd, faults[1:])])
        more = f"; {len(faults)} files of {len(asked)} are not read" * (len(faults) > 1)
        raise InputError(f"{faults[0]}{more}")


def _finding(path: Path, record: recordings.Recording) -> Finding:
    # The largest acceleration in each part of the motion, as bars.
    parts = np.array_split(np.abs(record.samples), min(_PARTS, len(record.samples)))
    peaks = np.array([np.max(part) for part in parts])
    levels = np.ceil(peaks / (np.max(peaks) or 1.0) * (len(_MARKS) - 1)).astype(int)
    value: dict[str, Any] = {
        "file": path,
        "format": record.form,
        "component": record.component,
        "samples": len(record.samples),
        "step_s": record.time_step,
        "duration_s": record.time_step * (len(record.samples) - 1),
        "unit": record.unit,
        "pga_g": recordings.intensity.peak_acceleration(record),
        "pgv_m_s": recordings.intensity.peak_velocity(record),
        "arias_m_s": recordings.intensity.arias(record),
        "sa_g": {
            f"{period:g}": recordings.intensity.spectral_acceleration(record, period)
            for period in recordings.intensity.PERIODS
        },
        "notes": record.notes,
    }

    rows = [
        ("format", f"{value['format']}, unit {value['unit']}"),
        (
            "samples",
            f"{value['samples']} every {value['step_s']:.6g} s, {value['duration_s']:.6g} s",
        ),
        ("PGA", f"{value['pga_g']:.4g} g"),
        ("PGV", f"{value['pgv_m_s']:.4g} m/s"),
        ("Arias", f"{value['arias_m_s']:.4g} m/s"),
        ("Sa(T), 5 %", ", ".join(f"{at} s: {sa:.3g} g" for at, sa in value["sa_g"].items())),
        ("|a|", "".join(_MARKS[level] for level in levels)),
        *(("note", printable(note, 200)) for note in record.notes),
    ]
    title = f"{path}, {record.component}" if record.component else str(path)
    table = Table("record", [text("record"), text("value", " ")], rows)
    return Finding("record", title, "", [Text(title), table], value)


def record_sets(records: Sequence[str], read: Sequence[str]) -> list[motions.RecordSet]:
    """The records, and how they are read. Raises `InputError`."""
    given = settings_of(read, "--read")
    if given and not records:
        raise InputError("needs records", "--read")
    scale, vertical = given.pop("scale", 1.0), given.pop("vertical", False)
    reading = {name: value for name, value in recordings.Reading(**given) if value is not None}
    files = tuple(str(sets.record_path(word, Path()).absolute()) for word in records)
    return (
        [motions.RecordSet(files=files, scale=scale, vertical=vertical, **reading)] if files else []
    )
