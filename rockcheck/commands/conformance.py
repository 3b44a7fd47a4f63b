"""`rockcheck conformance`: a card an engine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

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
    studied,
    usable_folder,
)
from rockcheck.commands.simulate import setting_of
from rockcheck.scenes import InputError
from rockcheck.scenes.errors import printable, unknown_name
from rockcheck.scenes.writing import write_whole

EngineOption = Annotated[
    list[str] | None,
    typer.Option(
        "--engine",
        help="A name or module:Class; repeatable (default: all installed).",
        autocompletion=model_names,
    ),
]
SettingsOption = Annotated[
    Literal["best", "default", "both"] | None,
    typer.Option("--settings", help="Set-up of the engines (default: best)."),
]
HistoriesOption = Annotated[
    list[Path] | None,
    typer.Option("--histories", help="Folder with an engine's own CSV, see --export; repeatable."),
]
ExportOption = Annotated[
    Path | None,
    typer.Option("--export", help="Write the scenes for another engine into a folder, and stop."),
]
TuneOption = Annotated[
    float | None,
    typer.Option("--tune", metavar="E", help="Find engines' own parameters for restitution E."),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="A setting of the engines, such as time_step=1e-3; repeatable."
        " With --tune: time_step, friction, penetration (m).",
    ),
]
ENGINE_TOML = """\
engine = "my engine"
version = "1.0"
settings = "as it comes"
step = 1e-3  # s
lacks = []  # or ["restitution"]
"""


def run(
    engine: EngineOption = None,
    settings: SettingsOption = None,
    histories: HistoriesOption = None,
    export: ExportOption = None,
    tune: TuneOption = None,
    sets: SetOption = None,
    allow_code: AllowCodeOption = None,
    out: OutOption = OUT / "conformance",
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
) -> None:
    """Hold engines against phenomena with a certain answer.

    Writes a card an engine: a page, JSON, JUnit and Markdown. Exit 1 where an engine fails one.
    With --tune, finds what an engine needs for a restitution: it drops a block, and slides it.
    """
    from rockcheck.validation.execute import models
    from rockcheck.validation.studies.conformance.study import Conformance, named, written
    from rockcheck.validation.studies.conformance.tuning import WANTED, Tuning

    if export is not None:
        _export(usable_folder(export))
        return
    given = dict(setting_of(text) for text in sets or [])
    known = models.engine_names()
    for name in engine or []:
        if models.is_own(name) and tune is None:
            models.check_allowed(name, allow_code or ())
        elif name not in known:
            allowed = f"give one of {', '.join(known)}" + ", or module:Class" * (tune is None)
            raise InputError(f"{printable(name)!r} is not allowed: {allowed}", "--engine")
        elif reason := models.not_installed(name):
            raise InputError(reason, f"--engine {name}")
    here = [] if histories else [name for name in known if not models.not_installed(name)]
    names = list(dict.fromkeys(engine or here))
    how = {"jobs": jobs, "scheduler": scheduler}
    if tune is not None:
        if settings or histories:
            raise InputError("goes with neither --settings nor --histories", "--tune")
        if unknown := given.keys() - WANTED:
            raise unknown_name("setting", min(unknown), WANTED)
        studied(Tuning(tuple(names), tune, **given), out / "tuned", **how)
    kinds = ("best", "default") if settings == "both" else (settings,)
    players = [named(name, kind, given) for name in names for kind in kinds]
    players += [written(folder) for folder in histories or []]
    studied(Conformance(tuple(players)), out, **how)


def _export(folder: Path) -> None:
    from rockcheck.reports.scene_file import write_scene_file
    from rockcheck.validation.studies.conformance.phenomena import SCENES
    from rockcheck.validation.studies.conformance.study import ABOUT, slug_of

    for name, scene in SCENES.items():
        write_scene_file(scene, folder, slug_of(name))
    if not (folder / ABOUT).exists():
        write_whole(folder / ABOUT, ENGINE_TOML)
    console().print(
        f"{len(SCENES)} scenes in {folder}: play each, write t_s, x_m, y_m, theta_rad of the"
        f" centroid,\nrelative to the base, as NAME.csv beside NAME.toml, fill in {ABOUT}, then:\n"
        f"  rockcheck conformance --histories {folder}",
        soft_wrap=True,
    )
    answer({"folder": folder, "scenes": {name: f"{slug_of(name)}.toml" for name in SCENES}})
