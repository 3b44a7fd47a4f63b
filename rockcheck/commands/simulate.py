"""`rockcheck scenes`, `new` and `simulate`: what there is, a scene file, one history.

`rockcheck record` says how a file of a recorded ground motion was read. And `rockcheck warm`
compiles the models' code ahead, in several processes, so that a user waits for no compiler.
"""

import os
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from rockcheck.commands import (
    AllowCodeOption,
    JobsOption,
    PlotOption,
    answer,
    check_file,
    console,
    model_names,
    playing,
    progress,
    report_file,
    save_figure,
    scene_names,
    setting_of,
    tell_left_out,
)
from rockcheck.reports.style import ENDINGS, FORMATS, kind_of
from rockcheck.scenes import History, InputError, ModelFailure, Scene, load_scene, named_scenes
from rockcheck.scenes.errors import printable
from rockcheck.scenes.files import read_toml
from rockcheck.scenes.history import check_format
from rockcheck.scenes.progress import announcing, listening, one_run
from rockcheck.scenes.recordings import UNITS, Reading, Recording, intensity, read_components
from rockcheck.scenes.recordings.sets import Odd, files_of, record_path
from rockcheck.scenes.writing import write_new
from rockcheck.validation.discrepancy.compare import motion_of
from rockcheck.validation.execute.models import (
    FAMILIES,
    REFERENCE,
    Work,
    build,
    check_allowed,
    is_own,
    play,
)
from rockcheck.validation.execute.pool import Call, Failure, Pool, guarded
from rockcheck.validation.execute.store import TABLE, name_of
from rockcheck.validation.finding import Column, Finding, Table, Text, text
from rockcheck.validation.suite.motions import RecordSet

ReadOption = Annotated[
    list[str] | None,
    typer.Option(
        "--read",
        metavar="KEY=VALUE",
        help="What a file does not say of itself, or which part of it is wanted; repeatable. unit:"
        f" {', '.join(UNITS)}; time_step, s; column: that of the accelerations, its number"
        " from 1, or its name; header_lines to skip; decimal: . or ,; component: its number from 1,"
        " or its name.",
    ),
]
RecordsArgument = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[RECORDS]...",
        help='Record files, folders of them, or patterns such as "RSN1_H*.AT2".',
    ),
]

#: Parts of the line that pictures a motion, and its marks from the smallest acceleration to the
#: largest.
_PARTS, _MARKS = 60, " ▁▂▃▄▅▆▇█"


def scenes() -> None:
    """List the named scenes, suites and models, with a line each."""
    from rockcheck.reports.document import show
    from rockcheck.validation.suite.suites import named_suites

    suites = {name: read_toml(path) for name, path in named_suites().items()}
    listings = {
        "scene": {name: load_scene(name).description for name in named_scenes()},
        "suite": {name: one.get("description", "") for name, one in suites.items()},
        "model": {name: family.summary for name, family in FAMILIES.items()},
    }
    tables = [
        Table(title, [text(title), text("about", " ")], list(rows.items()), most=len(rows))
        for title, rows in listings.items()
    ]
    show(Finding("scenes", "", "", tables), console())
    answer({f"{title}s": rows for title, rows in listings.items()})


def new(
    path: Annotated[
        Path, typer.Argument(metavar="FILE.toml", help="File to write; it must not exist yet.")
    ],
) -> None:
    """Write a scene file to start from.

    It is ready to run, and has a remark on every setting. A file that is there already is left as
    it is.
    """
    if path.suffix.lower() != ".toml":
        raise InputError(f"{printable(path)}: give the name of a .toml file")
    content = (resources.files("rockcheck.validation") / "data" / "new_scene.toml").read_text(
        encoding="utf-8"
    )
    try:
        write_new(path, content)
    except FileExistsError:
        raise InputError(f"{printable(path)}: is there already; it is left as it is") from None
    except OSError as error:
        raise InputError(f"{printable(path)}: cannot be written: {error.strerror}") from None
    scene = load_scene(path)
    console().print(
        f"{path}: a block of {2 * scene.block.half_width:g} m x {2 * scene.block.half_height:g} m",
        soft_wrap=True,
    )
    console().print(f"next: rockcheck simulate {path} --model ebm-unilateral", soft_wrap=True)
    answer({"file": path})


def run(
    scene: Annotated[
        str, typer.Argument(help="A named scene or a .toml file.", autocompletion=scene_names)
    ],
    model: Annotated[
        str,
        typer.Option("--model", help=f"One of {', '.join(FAMILIES)}.", autocompletion=model_names),
    ] = REFERENCE,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            help="File to write, repeatable: a history as .csv, .csv.gz, .json or .mat, its figure"
            f" as {ENDINGS} (default: SCENE--MODEL.csv).",
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="A setting of the model, such as time_step=1e-4; repeatable."),
    ] = None,
    allow_code: AllowCodeOption = None,
) -> None:
    """Simulate one scene with one model.

    Writes the history as CSV, its events to a second file beside it; or both to one .json or .mat.
    A figure shows rotation, slip and impacts.
    """
    check_allowed(model, allow_code or ())
    given = dict(setting_of(text) for text in settings or [])
    simulate = (
        partial(_played_apart, model, given) if is_own(model) else build(model, given).simulate
    )
    what = load_scene(scene)
    files = output or [Path(f"{name_of(what.name, model)}.csv")]
    figures = [path for path in files if path.suffix.lower()[1:] in FORMATS]
    histories = [path for path in files if path not in figures]
    checks = dict.fromkeys(histories, partial(check_format, more=f"; its figure as {ENDINGS}"))
    for path in files:
        check_file(path, "--output", checks.get(path, kind_of))
    title = f"{what.name}, {model}"
    with playing(title, [(model, given)]) as on_progress, listening(on_progress), one_run():
        history = simulate(what)
    try:
        for path in histories:
            history.save(path)
    except OSError as error:
        raise InputError(
            f"{printable(path)}: cannot be written: {error.strerror}", "--output"
        ) from None
    motion = motion_of(history, what)
    took = f"simulated in {history.cost.wall_seconds:.2g} s"
    console().print(f"{title}: {', '.join([history.fate, *motion.words(), took])}")
    for note in history.notes:
        console().print(f"note: {note}", style="yellow", soft_wrap=True)
    for path in histories:
        console().print(f"history: {path}", soft_wrap=True)
    for path in figures:
        save_figure(history.plot(), path)
    answer(
        {
            "scene": what.name,
            "model": model,
            "outcome": history.outcome,
            "peak_rotation_alpha": motion.peak_rotation,
            "motion": motion.model_dump(),
            "overturned_at_s": history.overturned_at,
            "wall_seconds": history.cost.wall_seconds,
            "rules": dict(history.cost.rules),
            "notes": history.notes,
            "history": next(iter(histories), None),
            "files": files,
        }
    )


def _played_apart(model: str, settings: dict[str, Any], scene: Scene) -> History:
    """The history by a user-defined model, whose code is imported in a separate process."""
    work = Work(label=model, family=model, settings=settings, search_path=(str(Path.cwd()),))
    with Pool(1) as pool:
        (ended,) = pool.run(deque([Call(guarded, (play, work, scene))]))
    result = ended.outcome
    if isinstance(result, Failure):
        if result.refused:
            raise InputError(result.reason)
        where = f"; its traceback: {report_file(result.traceback)}" if result.traceback else ""
        raise ModelFailure(f"{result.reason}{where}")
    with tempfile.TemporaryDirectory() as folder:
        for suffix, content in result.files.items():
            (Path(folder) / f"history{suffix}").write_bytes(content)
        return History.load(Path(folder) / f"history{TABLE}")


def record(
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
    if plot is not None:
        check_file(plot, "--plot")
    reading = Reading(**dict(setting_of(word, "--read") for word in read or ()))
    asked = files_of(files)
    found, faults = _components(asked, reading)
    values = [_values(path, record) for path, record in found]
    for (path, record), value in zip(found, values, strict=True):
        _show(path, record, value)
    if plot is not None and found:
        from rockcheck.reports.show.drawing import recordings_figure

        save_figure(
            recordings_figure(
                [(f"{path.name} {one.component}".strip(), one) for path, one in found[:12]]
            ),
            plot,
        )
    if found:
        answer(values[0] if len(values) == 1 else {"records": values})
    if faults:
        tell_left_out(faults[1:])
        more = f"; {len(faults)} files of {len(asked)} are not read" if len(faults) > 1 else ""
        raise InputError(f"{faults[0]}{more}")


def _components(
    files: Iterable[Path], reading: Reading
) -> tuple[list[tuple[Path, Recording]], list[Odd]]:
    found: list[tuple[Path, Recording]] = []
    faults: list[Odd] = []
    for path in files:
        try:
            found += [(path, one) for one in read_components(path, reading)]
        except InputError as error:
            faults.append(Odd(error))
    return found, faults


def _values(path: Path, record: Recording) -> dict[str, Any]:
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


def _show(path: Path, record: Recording, value: dict[str, Any]) -> None:
    from rockcheck.reports.document import show

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
        ("|a|", _picture(record)),
        *(("note", printable(note, 200)) for note in record.notes),
    ]
    title = f"{path}, {record.component}" if record.component else str(path)
    show(
        Finding(
            "record",
            title,
            "",
            [Text(title), Table("record", [text("record"), text("value", " ")], rows)],
        ),
        console(),
    )


def _picture(record: Recording) -> str:
    """The largest acceleration in each part of the motion, as bars."""
    parts = np.array_split(np.abs(record.samples), min(_PARTS, len(record.samples)))
    peaks = np.array([np.max(part) for part in parts])
    levels = np.ceil(peaks / (np.max(peaks) or 1.0) * (len(_MARKS) - 1)).astype(int)
    return "".join(_MARKS[level] for level in levels)


def record_sets(records: Sequence[str], read: Sequence[str]) -> list[RecordSet]:
    """The records, and how they are read. Raises `InputError`."""
    given = dict(setting_of(word, "--read") for word in read)
    if not records:
        if given:
            raise InputError("needs records", "--read")
        return []
    scale, vertical = given.pop("scale", 1.0), given.pop("vertical", False)
    return [
        RecordSet(
            files=tuple(str(record_path(word, Path()).absolute()) for word in records),
            scale=scale,
            vertical=vertical,
            **{name: value for name, value in Reading(**given) if value is not None},
        )
    ]


def _begin(*names: str) -> None:
    for name in names:
        build(name).simulate(load_scene("fig5a").replace(duration=0.1))


def _engine_steps() -> None:
    from rockcheck.engines.steps import adaptive_march, in_units_of

    scene = load_scene("fig5a").replace(duration=0.1)
    scene = in_units_of(scene.block.radius, scene)
    adaptive_march(scene, lambda pose, velocity, dt, felt, bouncing: velocity, longest=1e-3)


#: The parts that are compiled, the longest first. The event loops of both kinds of friction share
#: functions, so that one process compiles them in two thirds of the time.
PARTS: Mapping[str, Callable[[], object]] = {
    "the event-based models": partial(_begin, "ebm", "ebm-bouc-wen"),
    "the continuous model": partial(_begin, "cm"),
    "the physics engines: their adaptive steps": _engine_steps,
}


def compile_part(name: str) -> float:
    """Compile one part of `PARTS`, or find it in the cache; returns how long that took, s."""
    began = time.perf_counter()
    PARTS[name]()
    return time.perf_counter() - began


def warm(jobs: JobsOption = None) -> None:
    """Compile the models' code ahead.

    Models compile their code on their first run on a machine, and once more after an update of
    rockcheck; what is compiled already is only looked up. Afterwards no command waits for a
    compiler.
    """
    from rockcheck.reports.document import show

    console().print(f"compiling {len(PARTS)} parts, what is compiled already is only looked up")
    taken: dict[str, float] = {}
    pool = Pool(min(jobs or os.cpu_count() or 1, len(PARTS)))
    with progress("compiling") as on_progress, announcing(None), pool:
        on_progress(0, len(PARTS), "")
        for ended in pool.run(deque(Call(compile_part, (name,), key=name) for name in PARTS)):
            if ended.error is not None:
                raise ended.error
            taken[ended.call.key] = ended.result
            on_progress(len(taken), len(PARTS), ended.call.key)
    seconds = {name: taken[name] for name in PARTS}
    columns = [text("compiled code for"), Column("s", digits=2)]
    show(Finding("warm", "", "", [Table("compiled", columns, list(seconds.items()))]), console())
    answer({"seconds": seconds})
