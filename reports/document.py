"""A study as a folder: a page, tables as CSV, Markdown, and figures with their data.

In: a finding. Out: the folder's files, and figures drawn anew when they are asked for. Commands
call it as they end.
"""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from rockcheck.reports import manifest, style
from rockcheck.reports.live import live_data, write_scripts
from rockcheck.reports.table_text import csv, markdown, row_cells
from rockcheck.reports.templates import folder_argument, write_assets, write_page
from rockcheck.reports.workers import side_by_side
from rockcheck.scenes import InputError, errors, printable, reading, writing
from rockcheck.validation.execute import models
from rockcheck.validation.execute.pool import Call, Failure, Pool, guarded
from rockcheck.validation.finding import Finding, Plot

#: The folder of a page's figures.
FIGURES = "figures"


#: The data of a figure.
PLOT = TypeAdapter(Plot)


#: Limits of drawing a figure anew: s, and MB.
DRAWING = 60.0


DRAWING_MB = 4000.0


def _draw(data: Path, path: Path, stamp: str = "") -> None:
    """Draw a figure from its data: of the page with its stamp, else a file that the user named."""
    plot = PLOT.validate_python(reading.read_json(data))
    from rockcheck.reports import drawers  # with Matplotlib, which takes a second to import

    style.save_as(drawers.figure_of(plot), path, stamp=stamp, named=not stamp)


def _axes_of(plot: Plot) -> int:
    """How many axes a plot has: they take the time to draw it."""
    data = plot.data
    return len(data["panels"]) if isinstance(data, Mapping) and "panels" in data else 1


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
    axes = {f"{FIGURES}/{plot.name}.json": _axes_of(plot) for plot in plots}
    for name in sorted(data, key=axes.__getitem__, reverse=True):  # what takes longest comes first
        path, stamp = (folder / name).with_suffix(".svg"), style.stamp_of(data[name])
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
        looks=style.looks(models.FAMILIES),
        row_cells=row_cells,
        formats=("svg",),
    )
