"""The pages of a finished run.

They are one folder that opens from the file system and needs no other place.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence, Set
from functools import cache
from pathlib import Path
from typing import Any

from rockcheck.reports import tables
from rockcheck.reports.document import FIGURES, PAGES, Site, csv, row_cells
from rockcheck.reports.drawers import figure_of, side_by_side
from rockcheck.reports.ensembles import EnsembleView
from rockcheck.reports.figures import (
    figure_stem,
    histories_figure,
    summary,
    thumbnail,
    write_figures,
)
from rockcheck.reports.scene_data import payload, write_scene_file
from rockcheck.reports.show.words import scene_facts
from rockcheck.reports.style import drawn_by, kind_of, looks, save, save_as, stamp_in
from rockcheck.reports.tables import PEAKS, accuracy, entry, glance, matrix, outcome_of
from rockcheck.reports.view import CHANNELS, SceneView, scene_views, slugs_of
from rockcheck.scenes import InputError, experience
from rockcheck.scenes.errors import printable, unknown_name
from rockcheck.scenes.progress import OnProgress, unheard
from rockcheck.scenes.reading import MOST_BYTES, head_of
from rockcheck.scenes.writing import made, script_text, write_whole
from rockcheck.validation.execute.models import FAMILIES
from rockcheck.validation.execute.pool import Call
from rockcheck.validation.execute.provenance import digest
from rockcheck.validation.finding import Plot
from rockcheck.validation.suite.results import SEVERITY, Run
from rockcheck.validation.suite.tables import shown

#: The page to open.
INDEX = "index.html"
#: What a page with figures for a paper takes to be made, in pages without. Less than FEW in all are
#: written by the process itself: it has what draws anyway, and another process takes as long as
#: twenty pages to have it, too.
PRINTED, FEW = 25, 40


#: Studies of other commands that may stand beside a run.
STUDIES = (
    ("Convergence", "convergence/index.html"),
    ("Benchmark", "benchmark/index.html"),
    ("Stress", "stress/index.html"),
    ("Conformance", "conformance/index.html"),
    ("Overturning spectra", "spectrum/index.html"),
    ("Incremental dynamic analysis", "ida/index.html"),
    ("Fragility", "fragility/index.html"),
    ("Trend", "trend/index.html"),
)


View = SceneView | EnsembleView


def write_figure(folder: Path, name: str, path: Path) -> Path:
    """Draw a finished run's scene or ensemble into the file `path`; returns it.

    The file name ends in one of `style.FORMATS`. A scene's figure shows differences from its first
    reference. Raises `InputError` for what the run does not have.
    """
    kind_of(path)
    pages = _Pages(folder, (name,))
    view = pages.views[name]
    if isinstance(view, EnsembleView):
        return save_as(figure_of(view.distributions()), path)
    if not view.histories:
        raise InputError(
            f"{printable(name)}: no model has a history of it: {'; '.join(view.missing.values())}"
        )
    return save_as(histories_figure(view), path)


def write_site(
    folder: Path,
    *,
    jobs: int = 1,
    afresh: bool = True,
    wanted: Sequence[str] = (),
    on_progress: OnProgress = unheard,
) -> Path:
    """Write `index.html` and a page a scene and an ensemble, beside a finished run.

    Figures and data are written with them. Returns the index.

    In a large run the scenes that are `shown` have a page, and those that are `wanted`. Pages are
    made in up to `jobs` processes. Unless `afresh`, one stays that shows the same as it would now.
    What belonged to scenes without a page is removed. Raises `InputError` where a wanted scene is
    not of the run.
    """
    pages = _Pages(folder, wanted)
    pages.site.assets()
    stamps = {name: pages.stamp(view) for name, view in pages.views.items()}
    waiting = {
        name: stamp
        for name, stamp in stamps.items()
        if afresh or stamp_in(folder / _address(pages.views[name])) != stamp
    }
    for done, _ in enumerate(_write_pages(pages, waiting, jobs), 1):
        on_progress(done, len(waiting) + 1)
    _remove_pages(folder, {f"{view.slug}.html" for view in pages.views.values()})
    return folder / INDEX


def remove_site(folder: Path) -> None:
    """Remove the pages of an earlier run, with their figures and data; by their stamps."""
    _remove_pages(folder)
    if stamp_in(folder / INDEX):
        for path in (folder / INDEX, folder / PAGES / FIGURES / f"{PEAKS}.svg"):
            path.unlink(missing_ok=True)


def _remove_pages(folder: Path, current: Set[str] = frozenset()) -> None:
    for page in (folder / PAGES).glob("*.html"):
        if page.name not in current and stamp_in(page):
            for name in (page.name, *_belongings(page)):
                (folder / PAGES / name).unlink(missing_ok=True)


def _write_pages(pages: _Pages, stamps: Mapping[str, str], jobs: int) -> Iterator[None]:
    """Write these pages, each with its stamp, and last the index.

    They are made in processes of their own where that is quicker.
    """
    work = sum(PRINTED if pages.views[name].printed else 1 for name in stamps)
    if work < FEW:
        yield from map(pages.write, [*stamps, INDEX], [*stamps.values(), ""])
        return
    calls = [
        Call(_write_page, (pages.folder, pages.wanted, *one))
        for one in (*stamps.items(), (INDEX, ""))
    ]
    yield from side_by_side(calls, min(jobs, len(stamps)), least=2)


class _Pages:
    """The pages of a finished run, by name of the scene or the ensemble.

    They are those that are shown, and those that are wanted.
    """

    def __init__(self, folder: Path, wanted: Sequence[str] = ()) -> None:
        self.folder = folder
        self.run = Run.load(folder)
        self.wanted = tuple(wanted)
        slugs = slugs_of([*self.run.scenes, *(ensemble.name for ensemble in self.run.ensembles)])
        if unknown := [name for name in wanted if name not in slugs]:
            raise unknown_name("scene of the run", unknown[0], slugs)
        chosen = {*shown(self.run), *wanted}
        self.scenes = scene_views(self.run, folder, chosen)
        self.ensembles = [
            EnsembleView(self.run, one, slugs[one.name]) for one in self.run.ensembles
        ]
        found: list[View] = [*self.scenes, *self.ensembles]
        self.views = {view.name: view for view in found}
        links = [
            *((view.name, _address(view)) for view in found),
            *((title, address) for title, address in STUDIES if (folder / address).exists()),
        ]
        self.site = Site(folder, f"rockcheck: {self.run.suite}", tuple(links))

    def write(self, name: str, stamp: str) -> None:
        """Write figures and data, and last the page, with its `stamp`; or the index (`INDEX`)."""
        if name == INDEX:
            self._write_index()
            return
        view = self.views[name]
        page = self.folder / _address(view)
        before = _belongings(page)
        if isinstance(view, EnsembleView):
            template, shown = "finding.html", self._write_ensemble(view)
        else:
            template, shown = "scene.html", self._write_scene(view)
        shown |= {"view": view, "stamp": stamp} | _common(self.run)
        self.site.page(_address(view), template, **shown)
        for old in before - _belongings(page):
            (self.folder / PAGES / old).unlink(missing_ok=True)

    def _write_scene(self, view: SceneView) -> dict[str, Any]:
        """Write a scene's figures and data; returns what its page shows beside the view."""
        write_figures(view, made(self.folder, PAGES, FIGURES))
        data = script_text("window.rockcheck", payload(view))
        write_whole(made(self.folder, PAGES, "data") / f"{view.slug}.js", data)
        files = write_scene_file(view.scene, made(self.folder, PAGES, "scene-files"), view.slug)
        beside = [None, *self.scenes, None]
        place = beside.index(view)
        return {"files": files, "previous": beside[place - 1], "following": beside[place + 1]}

    def _write_ensemble(self, view: EnsembleView) -> dict[str, Any]:
        """Write an ensemble's figures and tables; returns what its page shows beside the view."""
        page, figures = view.page(), made(self.folder, PAGES, FIGURES)
        known = looks(self.run.models)
        curves = [(*view.curves[model], known[model]) for model in known if model in view.curves]
        save(thumbnail(curves, step=True), figures / f"{view.slug}-small", ["svg"])
        for plot in page.plots():
            save(figure_of(plot), figures / plot.name)
        for table in page.tables():
            *parts, name = table.name.split("/")
            write_whole(made(self.folder, PAGES, *parts) / f"{name}.csv", csv(table))
        return {"found": page}

    def _write_index(self) -> None:
        figures = made(self.folder, PAGES, FIGURES)
        blocks = accuracy(self.run)
        (figures / f"{PEAKS}.svg").unlink(missing_ok=True)
        for block in blocks:
            if isinstance(block, Plot):
                save(figure_of(block), figures / PEAKS)
        rows = matrix(self.run)
        links = {name: _address(view) for name, view in self.views.items()}
        self.site.page(
            INDEX,
            "index.html",
            scenes=self.scenes,
            ensembles=self.ensembles,
            worst=tables.worst_table(self.run, links),
            hidden_worst=max(0, len(tables.worst_first(self.run)) - tables.WORST),
            times=tables.times_table(self.run),
            summaries={m: FAMILIES[m].summary for m in self.run.models if m in FAMILIES},
            matrix=[row for row in rows if row.scene in self.views],
            accuracy=blocks,
            glance=glance(self.run, rows),
            **_common(self.run),
        )

    def stamp(self, view: View) -> str:
        """Hash of all that a page shows and of the code that draws it.

        When the run was, and what was read back, does not count.
        """
        run = self.run
        shown = {
            "what": view.record.model_dump(mode="json")
            if isinstance(view, EnsembleView)
            else [run.scenes[view.name], view.stride, view.printed],
            "cells": [cell.model_dump(mode="json", exclude={"read_back"}) for cell in view.cells],
            "run": run.model_dump(
                mode="json",
                include={
                    "suite",
                    "reference",
                    "model_form",
                    "models",
                    "measures",
                    "versions",
                    "hardware",
                },
            ),
            "links": self.site.links,
            "drawn by": drawn_by(),
        }
        return digest(json.dumps(shown, sort_keys=True))


def _address(view: View) -> str:
    return f"{PAGES}/{view.slug}.html"


#: A process of the pool reads the run once for all its pages.
_pages_of = cache(_Pages)


def _write_page(folder: Path, wanted: Sequence[str], name: str, stamp: str) -> None:
    _pages_of(folder, wanted).write(name, stamp)


def _belongings(page: Path) -> set[str]:
    """The files of a scene's page, relative to the folder of pages."""
    found = re.findall(
        r'(?:href|src)="((?:figures|data|scene-files)/[A-Za-z0-9._-]+)"', head_of(page, MOST_BYTES)
    )
    return {*found, f"figures/{page.stem}-small.svg"}


def _common(run: Run) -> dict[str, Any]:
    """What every page of a run shows, and calls."""
    functions = (
        row_cells,
        tables.checks_table,
        tables.measures_table,
        tables.runs_table,
        tables.uncertainty_table,
        tables.use,
        experience.outside,
        scene_facts,
        summary,
        figure_stem,
        entry,
        outcome_of,
    )
    return {
        "run": run,
        "looks": looks(run.models),
        "channels": CHANNELS,
        "VERDICTS": tables.VERDICTS,
        "SEVERITY": SEVERITY,
    } | {function.__name__: function for function in functions}
