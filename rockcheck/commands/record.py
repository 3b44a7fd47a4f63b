"""`rockcheck record`: how a file of a recorded ground motion was read."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from rockcheck.commands.checks import check_file
from rockcheck.commands.console import answer, console
from rockcheck.commands.model_choice import settings_of
from rockcheck.commands.notices import tell_left_out
from rockcheck.commands.options import PlotOption
from rockcheck.reports.style import save_as
from rockcheck.scenes import InputError, Record, files as scene_files, printable, recordings
from rockcheck.scenes.recordings import sets
from rockcheck.validation.finding import Column, Finding, Table, Text, text
from rockcheck.validation.suite import motions

ReadOption = Annotated[
    list[str] | None,
    typer.Option(
        "--read",
        metavar="KEY=VALUE",
        help="What a file does not say of itself, or which part of it is wanted; repeatable. unit:"
        f" {', '.join(recordings.UNITS)}; time_step, s; column: that of the accelerations, its"
        " number from 1, or its name; order: rows where numbers run along the lines; header_lines"
        " to skip; decimal: . or ,; component: its number from 1, or its name. unit=g! overrides"
        " what the file states.",
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
    building: Annotated[
        str | None,
        typer.Option(
            "--building",
            metavar="SCENE",
            help="A scene file with a [building]: show the motion of its storey, and its floor"
            " spectrum, in place of the ground's.",
        ),
    ] = None,
    plot: PlotOption = None,
) -> None:
    """Show what files of recorded ground motions hold.

    Reads PEER AT2, COSMOS and CSMIP V2, ESM, K-NET and KiK-net, CSV and columns of text; what a
    file does not say is given by --read. --plot draws acceleration, velocity and Sa(T). Of several
    files a line each; files of a folder that are no records are left out.
    """
    from rockcheck.reports import terminal

    if plot is not None:
        check_file(plot, "--plot")
    reading = recordings.Reading(**settings_of(read or (), "--read"))
    paths = sets.files_of(files)
    components, faults = sets.read_files(paths, reading, keep_going=True)
    given = scene_with_building(building)
    motions = [
        (path, name, floor_recording(recording, given) if given else recording)
        for path, pairs in components.items()
        for name, recording in pairs
    ]
    values = [_value(path, recording) for path, _, recording in motions]
    for finding in _findings(motions, values, has_several_files=len(components) > 1):
        terminal.show(finding, console())
    if plot is not None and motions:
        from rockcheck.reports.show.drawing import recordings_figure

        figure = recordings_figure([(name, recording) for _, name, recording in motions[:12]])
        console().print(f"figure: {save_as(figure, plot)}", soft_wrap=True)
    if motions:
        answer(_result(values, faults))
    _tell_faults(paths, faults, is_empty=not motions)


def _findings(
    motions: Sequence[tuple[Path, str, recordings.Recording]],
    values: Sequence[dict[str, Any]],
    *,
    has_several_files: bool,
) -> list[Finding]:
    """All that is known of each motion of one file, or a row for each of several."""
    if has_several_files:
        return [_overview([name for _, name, _ in motions], values)]
    return [
        _details(path, recording, value)
        for (path, _, recording), value in zip(motions, values, strict=True)
    ]


def scene_with_building(name: str | None) -> scene_files.UncertainScene | None:
    """The scene that `--building` names. Raises `InputError` where it has no building."""
    if name is None:
        return None
    given = scene_files.load_uncertain_scene(name)
    if given.building is None:
        raise InputError(f"{printable(name)} has no [building]", "--building")
    return given


def floor_recording(
    ground: recordings.Recording, given: scene_files.UncertainScene
) -> recordings.Recording:
    """The motion of the storey on which a scene's block stands, under one of the ground."""
    scene = given.scene.replace(excitation=Record.from_samples(ground.samples, ground.time_step))
    assert given.building is not None, "asked for"
    storey = scene_files.on_storey(replace(given, scene=scene), given.building).scene.excitation
    assert isinstance(storey, Record), "of a record"
    notes = (*ground.notes, *storey.notes)
    return replace(ground, samples=storey.samples, time_step=storey.time_step, notes=notes)


def _result(values: Sequence[dict[str, Any]], faults: Sequence[InputError]) -> dict[str, Any]:
    """The records as JSON, and the faults of files that are no records."""
    result: dict[str, Any] = values[0] if len(values) == 1 else {"records": values}
    return result | ({"left_out": [*map(str, faults)]} if faults else {})


def _tell_faults(
    paths: Mapping[Path, bool], faults: Sequence[InputError], *, is_empty: bool
) -> None:
    """Print what is left out.

    Raises the fault of a file that was named itself, and where no record was read.
    """
    named = {f"{printable(path)}" for path, is_named in paths.items() if is_named}
    bad = [fault for fault in faults if str(fault).startswith(tuple(named))] if named else []
    raised = [*bad, *faults][:1] if bad or is_empty else []
    tell_left_out([sets.Odd(fault) for fault in faults if fault not in raised])
    if raised:
        more = f"; {len(faults)} files of {len(paths)} are not read" * (len(faults) > 1)
        raise InputError(f"{raised[0]}{more}")


def _value(path: Path, record: recordings.Recording) -> dict[str, Any]:
    """What is known of a record, as JSON."""
    intensity = recordings.intensity
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
        "sa_g": {
            f"{period:g}": intensity.spectral_acceleration(record, period)
            for period in intensity.PERIODS
        },
        "notes": record.notes,
    }


def _overview(names: Sequence[str], values: Sequence[Mapping[str, Any]]) -> Finding:
    """A row for each record, and each note once."""
    columns = [
        text("record"),
        Column("samples", digits=8),
        Column("step", unit="s", digits=6),
        Column("duration", unit="s", digits=6),
        text("unit"),
        Column("PGA", unit="g", digits=4),
        Column("PGV", unit="m/s", digits=3),
    ]
    keys = ("samples", "step_s", "duration_s", "unit", "pga_g", "pgv_m_s")
    rows = [
        [printable(name), *(value[key] for key in keys)]
        for name, value in zip(names, values, strict=True)
    ]
    notes = sets.grouped(
        f"{name}: {printable(note, 200)}"
        for name, value in zip(names, values, strict=True)
        for note in value["notes"]
    )
    table = Table("records", columns, rows, most=len(rows))
    lines = Text("", items=[f"note: {note}" for note in notes])
    return Finding("record", "records", "", [table, lines], {"records": values})


def _details(path: Path, record: recordings.Recording, value: Mapping[str, Any]) -> Finding:
    """All that is known of one record, with a line that pictures its accelerations."""
    parts = np.array_split(np.abs(record.samples), min(_PARTS, len(record.samples)))
    peaks = np.array([np.max(part) for part in parts])
    levels = np.ceil(peaks / (np.max(peaks) or 1.0) * (len(_MARKS) - 1)).astype(int)
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
    config = settings_of(read, "--read")
    if config and not records:
        raise InputError("needs records", "--read")
    scale, vertical = config.pop("scale", 1.0), config.pop("vertical", False)
    reading = {name: value for name, value in recordings.Reading(**config) if value is not None}
    files = tuple(str(sets.record_path(word, Path()).absolute()) for word in records)
    return (
        [motions.RecordSet(files=files, scale=scale, vertical=vertical, **reading)] if files else []
    )
