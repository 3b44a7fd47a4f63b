"""A finding as CSV, Markdown and a page; `reports.terminal` shows it on a terminal.

Each block is rendered from one description. All pages have one look, made of the templates in
`data/templates`.
"""

import math
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from pydantic import TypeAdapter, ValidationError

from rockcheck.reports import drawers, manifest, style
from rockcheck.reports.live import live_data, write_scripts
from rockcheck.reports.show.words import (
    duration,
    moment,
    number,
    readable,
    unit,
    window,
)
from rockcheck.reports.workers import side_by_side
from rockcheck.scenes import InputError, errors, printable, reading, writing
from rockcheck.validation.execute.pool import Call, Failure, Pool, guarded
from rockcheck.validation.finding import Column, Finding, Mark, Plot, Table, Text, plain

#: The folder of a page's figures.
FIGURES = "figures"
#: The data of a figure, and limits of drawing it anew: s, and MB.
PLOT, DRAWING, DRAWING_MB = TypeAdapter(Plot), 60.0, 4000.0
#: Characters above which a text has a wide column.
LONG_TEXT = 24
#: Of a verdict: its sign, and its colour on a terminal.
SIGN_AND_COLOUR = {
    "": ("", ""),
    "pass": ("✓", "green"),
    "changed": ("△", "yellow"),
    "incomplete": ("–", "yellow"),
    "fail": ("✕", "red"),
    "error": ("!", "red"),
}


def row_cells(
    row: Sequence[Any], columns: Sequence[Column], write: Callable[[float, int], str] = number
) -> list[tuple[Mark, Column, str]]:
    """The cells of a row: each as a mark, its column, and its words.

    `write` says how a number with so many digits is written.
    """
    marks = [cell if isinstance(cell, Mark) else Mark(cell) for cell in row]
    return [
        (mark, column, _words(mark, column, write))
        for mark, column in zip(marks, columns, strict=True)
    ]


def text_class(table: Table, number: int) -> str:
    """The class of a column that holds text: "text", or "text long" where that needs room."""
    lengths = [len(str(plain(row[number]) or "")) for row in table.rows]
    return "text long" if max(lengths, default=0) > LONG_TEXT else "text"


def _words(mark: Mark, column: Column, write: Callable[[float, int], str]) -> str:
    """A cell's value for people; a sign before it where it has a verdict."""
    digits = mark.digits or column.digits
    match column.kind, mark.value:
        case _, value if value is None or value != value:  # NaN
            said = column.empty
        case "model", value:
            said = style.label_of(str(value))
        case _, bool(value):
            said = "yes" if value else "no"
        case "used", int(value) | float(value) if value > 1.0:
            said = f"{value:.3g}×" if value < math.inf else "beyond"
        case "used", int(value) | float(value):
            said = f"{100.0 * value:.0f} %"
        case "percent", int(value) | float(value):
            said = f"{100.0 * value:.{max(digits - 2, 0)}f} %"
        case "number", float(value):
            said = write(value, digits)
        case _, value:
            said = str(value)
    return f"{SIGN_AND_COLOUR[mark.verdict][0]} {said}".strip()


def failure_lines(failures: Mapping[str, str]) -> list[str]:
    """A line a reason: the first task that failed for it, and how many more."""
    tasks: dict[str, list[str]] = {}
    for task, reason in failures.items():
        tasks.setdefault(reason, []).append(task)
    return [
        f"{labels[0]} and {len(labels) - 1} more: {reason}"
        if len(labels) > 1
        else f"{labels[0]}: {reason}"
        for reason, labels in tasks.items()
    ]


def csv(table: Table) -> str:
    """A table as CSV with all digits."""
    return writing.table_text(
        [column.name for column in table.columns],
        ([plain(cell) for cell in row] for row in table.rows),
    )


def markdown(found: Finding) -> str:
    """The whole finding as Markdown."""
    parts = [f"# {found.title}", found.answer, *filter(None, map(block_markdown, found.blocks))]
    if found.failures:
        parts += ["## Failed", "\n".join(f"- {line}" for line in failure_lines(found.failures))]
    if found.made is not None:
        about = {"made": found.made.created, **found.made.versions, **found.made.hardware}
        parts.append(", ".join(f"{name} {value}" for name, value in about.items()))
    return "\n\n".join(parts) + "\n"


def block_markdown(block: Table | Plot | Text) -> str:
    """A block as Markdown, as the documentation and `summary.md` have it."""
    match block:
        case Text():
            lists = ([f"{name}: {value}" for name, value in block.facts], block.items)
            parts = [block.text, *("\n".join(f"- {item}" for item in items) for items in lists)]
        case Table() if block.on != "file":
            table = block.shown
            rows = ([said for *_, said in row_cells(row, table.columns)] for row in table.rows)
            parts = [writing.markdown_table([one.head for one in table.columns], rows), table.note]
        case _:
            return ""
    return "\n\n".join(filter(None, [block.title and f"## {block.title}", *parts]))


def _draw(data: Path, path: Path, stamp: str = "") -> None:
    """Draw a figure from its data: of the page with its stamp, else a file that the user named."""
    plot = PLOT.validate_python(reading.read_json(data))
    style.save_as(drawers.figure_of(plot), path, stamp=stamp, named=not stamp)


def write_figure(folder: Path, name: str, path: Path) -> Path:
    """Draw a figure of a study anew, from the data in its `folder`, into the file `path`.

    Returns the path; its ending is one of `style.FORMATS`. Raises `InputError` where the study has
    no such figure, or its data cannot be drawn within `DRAWING` s.
    """
    known = {one.stem: one for one in (folder / FIGURES).glob("*.json")}
    data = known[errors.one_of("figure", name, known)]
    with Pool(1, DRAWING_MB) as pool:
        (ended,) = pool.run([Call(guarded, (_draw, data, path), DRAWING)])
    if isinstance(ended.outcome, Failure):
        raise InputError(f"{printable(data)}: no data of a figure: {ended.outcome.reason}")
    return path


def _left_by_another(folder: Path, hashes: Mapping[str, str]) -> Iterator[str]:
    """Files of the run that was in the folder, which this one does not have.

    A figure goes with its data, where its stamp is that of the data.
    """
    before: dict[str, str] = {}
    with suppress(InputError, KeyError, TypeError, ValidationError):
        before = manifest.HASHES.validate_python(
            reading.read_json(reading.within(folder, "run.json"))["files"]
        )
    left_over = {name: before[name] for name in before.keys() - hashes.keys()}
    for name, content in manifest.unchanged(folder, left_over):
        yield name
        stamp, data = style.stamp_of(content.decode(errors="replace")), Path(name)
        drawn = data.with_suffix(".svg")
        if data.parts[0] == FIGURES and stamp.split()[0] in style.stamp_in(folder / drawn):
            yield str(drawn)


def publish(found: Finding, folder: Path, *, of_run: bool = False) -> Path:
    """Write `run.json`, tables as CSV, `summary.md`, figures and `index.html`; returns the page.

    The scenes of failures are written beside them. The folder holds one run: files of another are
    removed. Figures are written as the page shows them, and as the data that `write_figure` draws.
    The page leads to that of a run in the folder above, if one is there, or is to come (`of_run`).
    """
    plots = list(found.plots())
    data = {
        f"{FIGURES}/{plot.name}.json": writing.json_text(asdict(replace(plot, played=None)))
        for plot in plots
    }
    contents: dict[str, str | bytes] = {
        **{f"{table.name}.csv": csv(table) for table in found.tables()},
        **found.files,
        **data,
        "summary.md": markdown(found),
    }
    hashes = {name: manifest.hash_of(content) for name, content in contents.items()}
    manifest.remove(folder, _left_by_another(folder, hashes))
    contents["run.json"] = writing.json_text(found.as_dict() | {"files": hashes}) + "\n"
    for name, content in contents.items():
        *parts, last = name.split("/")
        writing.write_whole(writing.made(folder, *parts) / last, content)
    figures = writing.made(folder, FIGURES)
    calls = []
    for name, drawn in data.items():
        path, stamp = (folder / name).with_suffix(".svg"), style.stamp_of(drawn)
        if style.stamp_in(path) != stamp:
            calls.append(Call(_draw, (folder / name, path, stamp)))
    list(side_by_side(calls))
    write_assets(folder)
    if live := [live_data(plot) for plot in plots if plot.live and plot.kind == "lines"]:
        writing.write_whole(
            folder / "curves.js",
            writing.script_text("window.rockcheckCurves", writing.finite(live)),
        )
    return write_page(
        folder,
        "index.html",
        "finding.html",
        site={
            "name": f"rockcheck: {found.title}",
            "links": [("Report", "../index.html")]
            if of_run or (folder.parent / "index.html").exists()
            else [],
        },
        found=found,
        here=folder_argument(folder),
        live=bool(live),
        scripts=dict.fromkeys(
            script
            for plot in plots
            if plot.live and plot.kind == "spectra"
            for script in write_scripts(plot, figures)
        ),
        looks=style.looks(style.LOOKS),
        row_cells=row_cells,
        formats=("svg",),
    )


DATA = Path(str(resources.files("rockcheck.reports"))) / "data"
#: The templates with what they call.
TEMPLATES = Environment(
    loader=FileSystemLoader(DATA / "templates"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    finalize=lambda value: errors.inert(value) if type(value) is str else value,
)
TEMPLATES.globals["text_class"] = text_class
TEMPLATES.filters |= {
    one.__name__: one for one in (number, unit, duration, moment, window, readable)
} | {"share": lambda used: _words(Mark(used), Column("used", kind="used"), number)}
#: The folder beside `index.html` that holds everything else.
PAGES = "pages"


def write_page(folder: Path, address: str, template: str, **context: Any) -> Path:
    """Write the page `address` of a folder of pages, from a template of `data/templates/`.

    The address is relative to the folder, with slashes. Of the context, `site` says the folder's
    `name` and the `links` of its navigation: (title, address).
    """
    *parts, name = address.split("/")
    return writing.write_whole(
        writing.made(folder, *parts) / name,
        TEMPLATES.get_template(template).render(
            root="../" * len(parts), address=address, **context
        ),
    )


def folder_argument(folder: Path) -> str:
    """A page's folder in its commands: as the user gave it, of an absolute path the name."""
    return shlex.quote(folder.name if folder.is_absolute() else folder.as_posix())


def write_assets(folder: Path) -> None:
    """Write style sheets, scripts and the plotting library, once for all pages of a folder."""
    target = writing.made(folder, PAGES, "assets")
    for source in (*(DATA / "assets").iterdir(), *(DATA / "vendor").glob("*/*")):
        name = source.name if source.name != "LICENSE" else f"LICENSE.{source.parent.name}.txt"
        writing.write_whole(target / name, source.read_bytes())
    writing.write_whole(
        target / "models.css",
        "".join(
            f".look-{look.key} {{ --look: light-dark({look.light}, {look.dark}); }}\n"
            for look in style.BY_KEY.values()
        ),
    )
