"""`rockcheck scenes`, `new` and `simulate`: what there is, a scene file, one history.

And `rockcheck warm`: compiles the models' code ahead, in several processes, so that a user waits
for no compiler.
"""

import time
from collections.abc import Mapping, Sequence
from functools import partial
from importlib import resources
from itertools import chain
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from rockcheck.commands.checks import check_file
from rockcheck.commands.console import console, report_file
from rockcheck.commands.ending import finish_command
from rockcheck.commands.model_choice import check_one_model, settings_of
from rockcheck.commands.motions import Synthetic, check_none_asked, write_motions
from rockcheck.commands.options import AllowCodeOption, JobsOption, model_names, scene_names
from rockcheck.commands.progress_bar import progress
from rockcheck.reports.style import ENDINGS, FORMATS, kind_of, save_as
from rockcheck.scenes import History, Scene, errors, files, printable, writing
from rockcheck.scenes.history_files import check_format
from rockcheck.scenes.progress import LISTENER, ONE_RUN, announcing, within
from rockcheck.validation.discrepancy.compare import motion_of, motion_words
from rockcheck.validation.execute import models, pool, store
from rockcheck.validation.finding import Column, Finding, Table, Text, text


def scenes() -> None:
    """List the named scenes, suites and models, with a line each."""
    from rockcheck.validation.suite.suites import named_suites

    listings = {
        "scene": {name: files.load_scene(name).description for name in files.named_scenes()},
        "suite": {
            name: files.read_toml(path).get("description", "")
            for name, path in named_suites().items()
        },
        "model": {name: family.summary for name, family in models.FAMILIES.items()},
    }
    tables = [
        Table(title, [text(title), text("about", " ")], list(rows.items()), most=len(rows))
        for title, rows in listings.items()
    ]
    finish_command(
        Finding("scenes", "", "", tables),
        value={f"{title}s": rows for title, rows in listings.items()},
    )


def new(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="FILE.toml",
            help="File to write; it must not exist yet. With --motions a folder.",
        ),
    ],
    motions: Synthetic = Synthetic(),
) -> None:
    """Write a scene file to start from, or ground motions.

    The scene is ready to run, and has a remark on every setting. A file that is there already is
    left as it is.

    Motions follow the horizontal elastic spectrum of EN 1998-1, type 1, 5 % damped. Each is a CSV
    file that all commands read, the same on every call. They differ less from each other than
    recorded ones do.
    """
    if motions.motions is not None:
        write_motions(path, motions)
    check_none_asked(motions)
    if path.suffix.lower() != ".toml":
        raise errors.InputError(f"{printable(path)}: give the name of a .toml file")
    template = Path(str(resources.files("rockcheck.validation"))) / "data" / "new_scene.toml"
    scene = files.load_scene(template).replace(name=path.stem)  # a name that a scene may have
    try:
        writing.write_new(path, template.read_text(encoding="utf-8"))
    except FileExistsError:
        raise errors.InputError(
            f"{printable(path)}: is there already; it is left as it is"
        ) from None
    size = f"{2 * scene.block.half_width:g} m x {2 * scene.block.half_height:g} m"
    lines = [
        f"{path}: a block of {size}",
        f"next: rockcheck simulate {path} --model ebm-unilateral",
    ]
    finish_command(Finding("new", "", "", [Text(items=lines)]), value={"file": path})


def run(
    scene: Annotated[
        str, typer.Argument(help="A named scene or a .toml file.", autocompletion=scene_names)
    ],
    model: Annotated[
        str,
        typer.Option(
            "--model", help=f"One of {', '.join(models.FAMILIES)}.", autocompletion=model_names
        ),
    ] = models.REFERENCE,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            help="File to write, repeatable: a history as .csv or .csv.gz, its figure as"
            f" {ENDINGS} (default: SCENE--MODEL.csv).",
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="A setting of the model, such as time_step=1e-4; repeatable."),
    ] = None,
    allow_code: AllowCodeOption = None,
) -> None:
    """Simulate one scene with one model.

    Writes the history as CSV, its events to a second file beside it.
    A figure shows rotation, slip and impacts.
    """
    check_one_model(model, "simulate")
    models.check_allowed(model, allow_code or ())
    given = settings_of(settings or ())
    simulate = (
        partial(played_apart, model, given)
        if models.is_own(model)
        else models.build(model, given).simulate
    )
    what = files.load_scene(scene)
    outputs = output or [Path(f"{store.name_of(what.name, model)}.csv")]
    figures = [path for path in outputs if path.suffix.lower()[1:] in FORMATS]
    histories = [path for path in outputs if path not in figures]
    for path in outputs:
        check_file(
            path,
            "--output",
            kind_of
            if path in figures
            else partial(check_format, more=f"; its figure as {ENDINGS}"),
        )
    title = f"{what.name}, {model}"
    with (
        progress(title, [(model, given)]) as on_progress,
        within(LISTENER, on_progress),
        within(ONE_RUN, True),
    ):
        history = simulate(what)
    for path in histories:
        history.save(path)
    motion = motion_of(history, what)
    console().print(
        f"{title}: {', '.join([history.fate, *motion_words(motion)])},"
        f" simulated in {history.cost.wall_seconds:.2g} s"
    )
    notes = Text(items=[f"note: {note}" for note in history.notes], verdict="changed")
    written = (("history", path) for path in histories)
    drawn = (("figure", save_as(history.plot(), path)) for path in figures)
    finish_command(
        Finding("simulate", title, "", [notes]),
        said=chain(written, drawn),
        value={
            "scene": what.name,
            "model": model,
            "outcome": history.outcome,
            "peak_rotation_alpha": motion["peak_rotation"],
            "motion": motion,
            "overturned_at_s": history.overturned_at,
            "wall_seconds": history.cost.wall_seconds,
            "rules": dict(history.cost.rules),
            "notes": history.notes,
            "history": next(iter(histories), None),
            "files": outputs,
        },
    )


def played_apart(model: str, settings: dict[str, Any], scene: Scene) -> History:
    """The history by a user-defined model, whose code is imported in a separate process."""
    work = models.Work(label=model, family=model, settings=settings, search_path=(str(Path.cwd()),))
    with pool.Pool(1) as apart:
        (ended,) = apart.run([pool.Call(pool.guarded, (models.play, work, scene))])
    result = ended.outcome
    if isinstance(result, pool.Failure):
        if result.refused:
            raise errors.InputError(result.reason)
        where = f"; its traceback: {report_file(result.traceback)}" if result.traceback else ""
        raise errors.ModelFailure(f"{model}: {result.reason}{where}")
    return cast(History, result.history)


#: The parts that are compiled, the longest first: the models that run them. The event loops of both
#: kinds of friction share functions, so that one process compiles them in two thirds of the time.
PARTS: Mapping[str, Sequence[str]] = {
    "the event-based models": ("ebm", "ebm-bouc-wen"),
    "the continuous model": ("cm",),
    "the physics engines: their adaptive steps": ("mujoco",),
}


def compile_part(name: str) -> tuple[str, float]:
    """Compile one part of `PARTS`, or find it in the cache; returns it and its time, s."""
    began = time.perf_counter()
    scene = files.load_scene("fig5a").replace(duration=0.1)
    for model in PARTS[name]:
        models.build(model).simulate(scene)
    return name, time.perf_counter() - began


def warm(jobs: JobsOption = None) -> None:
    """Compile the models' code ahead.

    Models compile their code on their first run on a machine, and once more after an update of
    rockcheck; what is compiled already is only looked up. Afterwards no command waits for a
    compiler.
    """
    from rockcheck.reports.workers import side_by_side

    console().print(f"compiling {len(PARTS)} parts, what is compiled already is only looked up")
    taken: dict[str, float] = {}
    calls = [pool.Call(compile_part, (name,)) for name in PARTS]
    with progress("compiling") as on_progress, announcing(None):
        on_progress(0, len(PARTS), "")
        for name, took in side_by_side(calls, jobs, least=1):
            taken[name] = took
            on_progress(len(taken), len(PARTS), name)
    seconds = {name: taken[name] for name in PARTS}
    columns = [text("compiled code for"), Column("s", digits=2)]
    table = Table("compiled", columns, list(seconds.items()))
    finish_command(Finding("warm", "", "", [table]), value={"seconds": seconds})
