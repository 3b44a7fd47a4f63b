"""`rockcheck conformance`: a card an engine."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from rockcheck.commands import (
    OUT,
    AllowCodeOption,
    Played,
    answer,
    console,
    model_names,
    setting_of,
    studied,
    usable_folder,
)
from rockcheck.scenes import InputError
from rockcheck.scenes.errors import printable, unknown_name


def run(
    engine: Annotated[
        list[str] | None,
        typer.Option(
            "--engine",
            help="A name or module:Class; repeatable (default: all installed).",
            autocompletion=model_names,
        ),
    ] = None,
    histories: Annotated[
        list[Path] | None,
        typer.Option(
            "--histories", help="Folder with an engine's own CSV, see --export; repeatable."
        ),
    ] = None,
    export: Annotated[
        Path | None,
        typer.Option(
            "--export", help="Write the scenes for another engine into a folder, and stop."
        ),
    ] = None,
    tune: Annotated[
        float | None,
        typer.Option("--tune", metavar="E", help="Find engines' own parameters for restitution E."),
    ] = None,
    sets: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="A setting of the engines, such as time_step=1e-3; repeatable. Their set-up:"
            " settings=best (the default), default or both. With --tune: time_step, friction,"
            " penetration (m).",
        ),
    ] = None,
    allow_code: AllowCodeOption = None,
    played: Played = Played(OUT / "conformance"),
) -> None:
    """Check engines against phenomena with a known answer.

    Writes a card an engine: a page, JSON, JUnit and Markdown. Exit 1 where an engine fails one.
    With --tune, finds what an engine needs for a restitution: it drops a block, and slides it.
    """
    from rockcheck.validation.execute import models
    from rockcheck.validation.studies.conformance.study import Conformance, named, written
    from rockcheck.validation.studies.conformance.tuning import WANTED, Tune, Tuning

    if export is not None:
        _export(usable_folder(export))
        return
    known, given = models.engine_names(), dict(setting_of(text) for text in sets or [])
    here = [] if histories else [name for name in known if not models.not_installed(name)]
    names = list(dict.fromkeys(engine or here))
    for name in names:
        models.check_allowed(name, allow_code or ())
        if name not in known and (tune is not None or not models.is_own(name)):
            allowed = f"give one of {', '.join(known)}" + ", or module:Class" * (tune is None)
            raise InputError(f"{printable(name)!r} is not allowed: {allowed}", "--engine")
        if reason := models.not_installed(name):
            raise InputError(reason, f"--engine {name}")
    if tune is not None:
        if histories:
            raise InputError("does not go with --histories", "--tune")
        if unknown := given.keys() - (WANTED.keys() - {"restitution"}):
            raise unknown_name("setting", min(unknown), WANTED.keys() - {"restitution"})
        wanted = tuple(Tune(name, tune, **given) for name in names)
        studied(Tuning(wanted), replace(played, out=played.out / "tuned"))
    setup = given.pop("settings", None)
    kinds = ("best", "default") if setup == "both" else (setup,)
    players = [named(name, kind, given) for name in names for kind in kinds]
    players += [written(folder) for folder in histories or []]
    studied(Conformance(tuple(players)), played)


def _export(folder: Path) -> None:
    from rockcheck.reports.scene_data import write_scene_file
    from rockcheck.validation.studies.conformance.phenomena import SCENES
    from rockcheck.validation.studies.conformance.study import export

    for name, scene in SCENES.items():
        write_scene_file(scene, folder, name)
    names = export(folder)
    console().print(
        f"{len(names)} scenes in {folder}, README.md says how they are meant; then:\n"
        f"  rockcheck conformance --histories {folder}",
        soft_wrap=True,
    )
    answer({"folder": folder, "scenes": {name: f"{name}.toml" for name in names}})
