"""`rockcheck scenes`: what there is to run."""

from __future__ import annotations

from collections.abc import Iterable

from rich.table import Table

from rockcheck.commands import answer, console
from rockcheck.scenes import load_scene, named_scenes
from rockcheck.validation.execute.models import FAMILIES
from rockcheck.validation.suite.suites import describe_suite, named_suites


def run() -> None:
    """List the named scenes, suites and models, with a line each."""
    listings = {
        "scene": {name: load_scene(name).description for name in named_scenes()},
        "suite": {name: describe_suite(path) for name, path in named_suites().items()},
        "model": {name: family.summary for name, family in FAMILIES.items()},
    }
    for title, rows in listings.items():
        console().print(_listing(title, rows.items()))
    answer({f"{title}s": rows for title, rows in listings.items()})


def _listing(title: str, rows: Iterable[tuple[str, str]]) -> Table:
    table = Table(box=None, pad_edge=False, title_justify="left")
    table.add_column(title, no_wrap=True, style="bold")
    table.add_column("")
    for name, description in rows:
        table.add_row(name, description)
    return table
