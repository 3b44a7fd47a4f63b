"""A finding as a terminal's tables, CSV, Markdown and a page.

Each block is rendered from one description. All pages have one look, made of the templates in
`data/templates`.
"""

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from pydantic import TypeAdapter
from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text as Line

from rockcheck.reports.drawers import figure_of, live_data, scripts_of, side_by_side
from rockcheck.reports.show.words import (
    dash_array,
    duration,
    moment,
    number,
    readable,
    unit,
    window,
)
from rockcheck.reports.style import (
    BY_KEY,
    LOOKS,
    kind_of,
    label_of,
    looks,
    save,
    save_as,
    stamp_in,
    stamp_of,
)
from rockcheck.scenes.errors import InputError, inert, printable, unknown_name
from rockcheck.scenes.reading import MOST_BYTES, head_of, read_json, within
from rockcheck.scenes.writing import (
    finite,
    json_text,
    made,
    markdown_table,
    script_text,
    table_text,
    write_whole,
)
from rockcheck.validation.execute.pool import Call, Pool
from rockcheck.validation.finding import Column, Finding, Mark, Plot, Table, Text, plain

#: The sign of a verdict, beside its colour.
SIGNS = {"pass": "✓", "changed": "△", "incomplete": "–", "fail": "✕", "error": "!", "": ""}
#: The folder of a page's figures.
FIGURES = "figures"
#: The data of a figure, and limits of drawing it anew: s, and MB.
PLOT, DRAWING, DRAWING_MB = TypeAdapter(Plot), 60.0, 4000.0
#: The folder of the scenes that show a failure.
FAILING = "failures"
COLOURS = {
    "pass": "green",
    "changed": "yellow",
    "incomplete": "yellow",
    "fail": "red",
    "error": "red",
}


def words(cell: Any, column: Column, write: Callable[[float, int], str] = number) -> str:
    """A cell's value for people; a sign before it where it has a verdict."""
    if isinstance(cell, Mark) and cell.digits:
        column = replace(column, digits=cell.digits)
    shown = _value(plain(cell), column, write)
    sign = SIGNS[cell.verdict] if isinstance(cell, Mark) else ""
    return f"{sign} {shown}".strip()


def _value(value: Any, column: Column, write: Callable[[float, int], str]) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if column.kind == "model":
        return label_of(str(value))
    if isinstance(value, bool):
        return "yes" if value else "no"
    if column.kind in ("percent", "used") and isinstance(value, int | float):
        return _share(value, column)
    if column.kind == "number" and isinstance(value, float):
        return write(value, column.digits)
    return str(value)


def _share(value: float, column: Column) -> str:
    if column.kind == "used" and value > 1.0:
        return f"{_typed(value, 3)}×" if value < math.inf else "beyond"
    after = max(column.digits - 2, 0) if column.kind == "percent" else 0
    return f"{100.0 * value:.{after}f} %"


def _typed(value: float, digits: int) -> str:
    return f"{value:.{digits}g}"


def row_cells(row: Sequence[Any], columns: Sequence[Column]) -> list[dict[str, Any]]:
    """The cells of a row for the page."""
    return [_for_page(cell, column) for cell, column in zip(row, columns, strict=True)]


def _for_page(cell: Any, column: Column) -> dict[str, Any]:
    mark = cell if isinstance(cell, Mark) else Mark(cell)
    numeric = column.kind not in ("text", "model")
    return {
        "words": words(cell, column),
        "css": " ".join(filter(None, ["n" if numeric else column.kind, mark.verdict])),
        "verdict": mark.verdict,
        "tip": mark.words,
        "link": mark.link,
        "model": mark.value if column.kind == "model" else "",
        "more": mark.more,
        "used": mark.value if column.kind == "used" and mark.value is not None else None,
    }


def show(found: Finding, screen: Console) -> None:
    """The answer and the blocks that a terminal has room for."""
    for block in (block for block in found.blocks if block.on == "all"):
        if isinstance(block, Table):
            screen.print(_grid(block.shown))
            if len(block.rows) > block.most:
                screen.print(f"and {len(block.rows) - block.most} more rows: {block.name}.csv")
        elif isinstance(block, Text):
            for line in filter(None, (block.text, *map(": ".join, block.facts), *block.items)):
                screen.print(line, style=COLOURS.get(block.verdict, ""), soft_wrap=True)
    for where, reason in found.failures.items():
        screen.print(f"failed: {where}: {reason}", style="red", soft_wrap=True)
    if not found.complete:
        screen.print("not complete: the same command goes on where it ended", style="yellow")
    if found.answer:
        screen.print(found.answer, style="bold", soft_wrap=True)


def _grid(table: Table) -> Grid:
    grid = Grid(box=None, pad_edge=False, title=table.title or None, title_justify="left")
    for column in table.columns:
        if column.brief:
            left = column.kind in ("text", "model")
            grid.add_column(column.head, justify="left" if left else "right", overflow="fold")
    for row in table.rows[: table.most]:
        grid.add_row(
            *(
                Line(
                    inert(words(cell, column, _typed)),
                    COLOURS.get(cell.verdict, "") if isinstance(cell, Mark) else "",
                )
                for cell, column in zip(row, table.columns, strict=True)
                if column.brief
            )
        )
    return grid


def csv(table: Table) -> str:
    """A table as CSV with all digits."""
    heads = [column.name for column in table.columns]
    return table_text(heads, ([plain(cell) for cell in row] for row in table.rows))


def markdown(found: Finding) -> str:
    """The whole finding as Markdown."""
    parts = [f"# {found.title}", found.answer, *filter(None, map(block_markdown, found.blocks))]
    if found.failures:
        parts += ["## Failed", "\n".join(f"- {at}: {why}" for at, why in found.failures.items())]
    if found.made is not None:
        about = {"made": found.made.created, **found.made.versions, **found.made.hardware}
        parts.append(", ".join(f"{name} {value}" for name, value in about.items()))
    return "\n\n".join(parts) + "\n"


def block_markdown(block: Table | Plot | Text) -> str:
    """A block as Markdown, as the documentation and `summary.md` have it."""
    title = f"## {block.title}\n\n" if block.title else ""
    if isinstance(block, Text):
        facts = "\n".join(f"- {name}: {value}" for name, value in block.facts)
        parts = [block.text, facts, "\n".join(f"- {item}" for item in block.items)]
        return title + "\n\n".join(filter(None, parts))
    if isinstance(block, Plot) or block.on == "file":
        return ""
    block = block.shown
    rows = (
        [words(cell, column) for cell, column in zip(row, block.columns, strict=True)]
        for row in block.rows
    )
    table = markdown_table([column.head for column in block.columns], rows)
    return title + table + (f"\n\n{block.note}" if block.note else "")


def _draw(plot: Plot, stem: Path, stamp: str) -> None:
    save(figure_of(plot), stem, ["svg"], stamp=stamp)


def _draw_again(data: Path, path: Path) -> None:
    save_as(figure_of(PLOT.validate_python(read_json(data))), path)


def write_figure(folder: Path, name: str, path: Path) -> Path:
    """Draw a figure of a study anew, from the data in its `folder`, into the file `path`.

    Returns the path; its ending is one of `style.FORMATS`. Raises `InputError` where the study has
    no such figure, or its data cannot be drawn within `DRAWING` s.
    """
    kind_of(path)
    known = {one.stem: one for one in (folder / FIGURES).glob("*.json")}
    if name not in known:
        raise unknown_name("figure", name, known)
    with Pool(1, DRAWING_MB) as pool:
        (ended,) = pool.run(deque([Call(_draw_again, (known[name], path), DRAWING)]))
    if ended.error is not None:
        raise InputError(f"{printable(known[name])}: no data of a figure: {ended.outcome.reason}")
    return path


def _left_by_another(folder: Path, found: Finding) -> Iterator[Path]:
    """Tables and figures of the run that was in the folder, which this one does not have.

    No other file is taken for one: a table has the columns that its run.json says, and a figure's
    stamp is that of the data beside it.
    """
    before: Any = None
    with suppress(InputError):
        before = read_json(within(folder, "run.json"))
    tables = before.get("tables") if isinstance(before, dict) else None
    for name, rows in tables.items() if isinstance(tables, dict) else ():
        path, mine = folder / f"{name}.csv", name in {one.name for one in found.tables()}
        if not mine and path.parent == folder and _holds(path, rows):
            yield path
    drawn = {plot.name for plot in found.plots()}
    for data in (folder / FIGURES).glob("*.json"):
        svg = data.with_suffix(".svg")
        ours = stamp_in(svg).split()[:1] == stamp_of(head_of(data, MOST_BYTES)).split()[:1]
        if data.stem not in drawn and ours:
            yield from (data, svg)


def _holds(path: Path, rows: Any) -> bool:
    """Whether a CSV begins with the columns of these records."""
    first = rows[0] if isinstance(rows, list) and rows else None
    return isinstance(first, dict) and head_of(path, 10_000).startswith(table_text([*first], []))


def publish(found: Finding, folder: Path) -> Path:
    """Write `run.json`, tables as CSV, `summary.md`, figures and `index.html`; returns the page.

    The scenes of failures are written beside them. The folder holds one run: tables and figures of
    another are removed. Figures are written as the page shows them, and as the data that
    `write_figure` draws.
    """
    tables = {f"{table.name}.csv": csv(table) for table in found.tables()}
    for old in (*_left_by_another(folder, found), *(folder / FAILING).glob("*.toml")):
        old.unlink()
    write_whole(folder / "run.json", json_text(found.as_dict()) + "\n")
    for name, content in {**tables, **found.files, "summary.md": markdown(found)}.items():
        *parts, last = name.split("/")
        write_whole(made(folder, *parts) / last, content)
    plots = list(found.plots())
    figures = made(folder, FIGURES)
    calls = []
    for plot in plots:
        drawn = replace(plot, played=None)
        data, stem = json_text(asdict(drawn)), figures / plot.name
        write_whole(stem.with_suffix(".json"), data)
        stamp = stamp_of(data)
        if stamp_in(stem.with_suffix(".svg")) != stamp:
            calls.append(Call(_draw, (drawn, stem, stamp)))
    list(side_by_side(calls))
    above = (("Report", "../index.html"),) if (folder.parent / "index.html").exists() else ()
    site = Site(folder, f"rockcheck: {found.title}", above)
    site.assets()
    if live := [live_data(plot) for plot in plots if plot.live and plot.kind == "lines"]:
        write_whole(folder / "curves.js", script_text("window.rockcheckCurves", finite(live)))
    return site.page(
        "index.html",
        "finding.html",
        found=found,
        live=bool(live),
        scripts=scripts_of(plots, figures),
        looks=looks(LOOKS),
        row_cells=row_cells,
        figures=FIGURES,
        formats=(),
    )


DATA = Path(str(resources.files("rockcheck.reports"))) / "data"
#: The folder beside `index.html` that holds everything else.
PAGES = "pages"


@dataclass(frozen=True)
class Site:
    """A folder of pages with one look.

    `links` are its parts for the navigation: (title, address from the index).
    """

    folder: Path
    name: str
    links: tuple[tuple[str, str], ...] = ()

    def page(self, address: str, template: str, **context: Any) -> Path:
        """Write the page `address` from a template of `data/templates/`.

        The address is relative to the folder, with slashes.
        """
        root = "../" * address.count("/")
        text = (
            _environment()
            .get_template(template)
            .render(site=self, root=root, address=address, **context)
        )
        return write_whole(made(self.folder, *address.split("/")[:-1]) / Path(address).name, text)

    def assets(self) -> None:
        """Write style sheets, scripts and the plotting library, once for all pages."""
        target = made(self.folder, PAGES, "assets")
        for source in sorted((DATA / "assets").iterdir()):
            write_whole(target / source.name, source.read_bytes())
        for source in sorted((DATA / "vendor").glob("*/*")):
            name = source.name if source.name != "LICENSE" else f"LICENSE.{source.parent.name}.txt"
            write_whole(target / name, source.read_bytes())
        rows = (
            f".look-{look.key} {{ --look: light-dark({look.light}, {look.dark}); }}\n"
            for look in BY_KEY.values()
        )
        write_whole(target / "models.css", "".join(rows))


@cache
def _environment() -> Environment:
    """The templates with what they call.

    Kept, since compiling a page's templates takes longer than drawing its figures.
    """
    environment = Environment(
        loader=FileSystemLoader(DATA / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: inert(value) if type(value) is str else value,
    )
    for filter in (number, unit, duration, moment, window, dash_array, readable):
        environment.filters[filter.__name__] = filter
    return environment
