"""`rockcheck scenes`: what there is to run; and `rockcheck new`: a scene file to start from."""

from importlib import resources
from pathlib import Path
from typing import Annotated

import typer

from rockcheck.commands import answer, console
from rockcheck.scenes import InputError, load_scene, named_scenes
from rockcheck.scenes.errors import printable
from rockcheck.scenes.files import read_toml
from rockcheck.scenes.writing import write_new
from rockcheck.validation.execute.models import FAMILIES
from rockcheck.validation.finding import Finding, Table, text
from rockcheck.validation.suite.suites import named_suites


def run() -> None:
    """List the named scenes, suites and models, with a line each."""
    from rockcheck.reports.document import show

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
    text = (resources.files("rockcheck.validation") / "data" / "new_scene.toml").read_text(
        encoding="utf-8"
    )
    try:
        write_new(path, text)
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
