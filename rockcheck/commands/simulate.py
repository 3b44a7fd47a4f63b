"""`rockcheck simulate`: one history."""

import tempfile
from collections import deque
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from rockcheck.commands import (
    AllowCodeOption,
    answer,
    check_file,
    console,
    model_names,
    playing,
    report_file,
    save_figure,
    scene_names,
    setting_of,
)
from rockcheck.reports.style import ENDINGS, FORMATS, kind_of
from rockcheck.scenes import History, InputError, ModelFailure, Scene, load_scene
from rockcheck.scenes.errors import printable
from rockcheck.scenes.history import check_format
from rockcheck.scenes.progress import listening, one_run
from rockcheck.validation.discrepancy.motion import motion_of
from rockcheck.validation.execute.models import FAMILIES, Work, build, check_allowed, is_own, play
from rockcheck.validation.execute.pool import Call, Failure, Pool, guarded
from rockcheck.validation.execute.store import TABLE, name_of

#: The model that plays where none is named: the fair reference for engines.
REFERENCE = "ebm-unilateral"


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
