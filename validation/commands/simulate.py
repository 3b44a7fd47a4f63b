"""`rockcheck simulate`: one history."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path
from typing import Annotated, Any

import typer

from rockcheck.scenes import InputError, load_scene
from rockcheck.scenes.errors import printable
from rockcheck.scenes.progress import listening
from rockcheck.validation.commands import answer, console, model_names, progress, scene_names
from rockcheck.validation.execute.models import FAMILIES, build, family, is_own
from rockcheck.validation.execute.store import name_of


def run(
    scene: Annotated[str, typer.Argument(help="A named scene or a .toml file.", autocompletion=scene_names)],
    model: Annotated[str, typer.Option("--model", help=f"One of {', '.join(FAMILIES)}.", autocompletion=model_names)],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="CSV to write (default: SCENE--MODEL.csv).")] = None,
    settings: Annotated[list[str] | None, typer.Option("--set", help="A setting of the model, such as time_step=1e-4; repeatable.")] = None,
) -> None:
    """Simulate one scene with one model.

    Writes the history as CSV; its events go to a second file beside it.
    """
    if is_own(model):
        sys.path.append(str(Path.cwd()))
    player = build(model, dict(setting_of(text) for text in settings or []))
    what = load_scene(scene)
    path = output or Path(f"{name_of(what.name, model)}.csv")
    if not path.parent.is_dir():
        raise InputError(f"{printable(path.parent)}: no such folder", "--output")
    compiles = ", a first run compiles" if family(model).compiled else ""
    with progress(f"{what.name}, {model}{compiles}") as on_progress, listening(on_progress):
        history = player.simulate(what)
    try:
        history.save(path)
    except OSError as error:
        raise InputError(f"{printable(path)}: cannot be written: {error.strerror}", "--output") from None
    peak = history.peak_rotation / what.block.alpha
    took = f"simulated in {history.cost.wall_seconds:.2g} s"
    console().print(f"{what.name}, {model}: {history.outcome}, peak rotation {peak:.4g} alpha, {took}")
    console().print(f"history: {path}", soft_wrap=True)
    answer(
        {
            "scene": what.name,
            "model": model,
            "outcome": history.outcome,
            "peak_rotation_alpha": peak,
            "wall_seconds": history.cost.wall_seconds,
            "notes": history.notes,
            "history": path,
        }
    )


def setting_of(text: str) -> tuple[str, Any]:
    """key=value, the value as in TOML; a bare word is a string."""
    key, equals, value = text.partition("=")
    if not equals or not key.isidentifier():
        raise InputError(f"{printable(text)!r}: key=value is asked for", "--set")
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key, value
