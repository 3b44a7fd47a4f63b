"""The pages of a finished run, and whose turn it is to write into its folder.

The pages are one folder that opens from the file system and needs no other place.
"""

import json
import os
import platform
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout

from rockcheck.reports import (
    document,
    manifest,
    overview,
    style,
    table_text,
    tables,
    templates,
)
from rockcheck.reports.drawers import figure_of
from rockcheck.reports.ensemble_page import EnsembleView
from rockcheck.reports.histories_figure import histories_figure, thumbnail as thumbnail_of
from rockcheck.reports.payload import payload_of, summary_of
from rockcheck.reports.show.words import scene_facts
from rockcheck.reports.view import CHANNELS, SceneView, scene_views, slugs_of
from rockcheck.reports.workers import side_by_side
from rockcheck.scenes import (
    Record,
    Scene,
    errors,
    experience,
    files,
    printable,
    progress,
    reading,
    writing,
)
from rockcheck.scenes.recordings import GRAVITY_OF_RECORDS, stated
from rockcheck.validation.execute import models, pool, provenance
from rockcheck.validation.finding import Plot
from rockcheck.validation.suite import results, verdict_scale
from rockcheck.validation.suite.job_page import markdown
from rockcheck.validation.suite.junit import junit
from rockcheck.validation.suite.run_tables import files_of
from rockcheck.validation.suite.shown_scenes import shown

#: The page to open.
INDEX = "index.html"
#: What a page with figures for a paper takes to be made, in pages without. Less than FEW in all are
#: written by the process itself: it has what draws anyway, and another process takes as long as
#: twenty pages to have it, too.
PRINTED, FEW = 10, 40
#: The format of a figure that every page has; of those in all formats see `write_site`.
SHOWN = ("svg",)


#: Studies of other commands that may stand beside a run.
STUDIES = (
    ("Assessment", "assess/index.html"),
    ("Benchmark", "benchmark/index.html"),
    ("Stress", "stress/index.html"),
    ("Conformance", "conformance/index.html"),
    ("Overturning spectra", "spectrum/index.html"),
    ("Trend", "trend/index.html"),
)


LOCK, HOLDER = ".lock", ".lock.holder"
#: Time that a run waits for another one in the same folder: before it says so, and in all, s.
SILENT, PATIENCE = 2.0, 600.0


@contextmanager
def _turn(folder: Path) -> Iterator[None]:
    """Within this block no other run writes into `folder`.

    A run that waits says for which one, and gives up after `PATIENCE` s.
    """
    lock, holder = FileLock(writing.no_link(folder / LOCK)), folder / HOLDER
    try:
        lock.acquire(timeout=SILENT)
    except Timeout:
        # Empty where it has just gone, or has not said who it is.
        other = printable(reading.head_of(holder, 1000)) or "another run"
        whom = f"{other}, which holds {printable(folder / LOCK)}"
        print(f"rockcheck: waiting up to {PATIENCE:g} s for {whom}", file=sys.stderr)
        try:
            lock.acquire(timeout=PATIENCE)
        except Timeout:
            raise errors.InputError(
                f"{printable(folder)}: waited {PATIENCE:g} s for {whom}: end it, or give another"
                " --out"
            ) from None
    try:
        writing.write_whole(holder, f"process {os.getpid()} on {platform.node()}")
        yield
    finally:
        holder.unlink(missing_ok=True)
        lock.release()


def keep(run: results.Run, folder: Path, *, pages: bool = True) -> Path:
    """Write run.json, its schema and the tables; returns run.json.

    The histories are there already. Pages of an earlier run are removed, since they show other
    numbers: the index, the trend, and unless it is to have `pages` all. Two runs take turns.
    """
    contents = {f"{table.name}.csv": table_text.csv(table) for table in files_of(run)}
    contents |= {"junit.xml": junit(run), "summary.md": markdown(run)}
    with _turn(folder):
        earlier = manifest.read(folder).files
        if pages:
            index = {name: content_hash for name, content_hash in earlier.items() if name == INDEX}
            manifest.remove_left_over(folder, index)
        else:
            manifest.remove_left_over(folder, earlier)
            manifest.remove(folder, [manifest.MANIFEST])
        if (folder / "trend/run.json").is_file():
            manifest.remove(folder, ["trend/index.html"])
        writing.write_together({folder / name: content for name, content in contents.items()})
        return run.save(folder)


def write_figure(folder: Path, name: str, path: Path) -> Path:
    """Draw a finished run's scene or ensemble into the file `path`; returns it.

    The file name ends in one of `style.FORMATS`. A scene's figure shows differences from its first
    reference. Raises `InputError` for what the run does not have.
    """
    view = _Pages(folder, (name,)).views[name]
    if not (view.curves if isinstance(view, EnsembleView) else view.histories):
        raise errors.InputError(
            f"{printable(name)}: no model has a history of it: {'; '.join(view.missing.values())}"
        )
    if isinstance(view, EnsembleView):
        return style.save_as(figure_of(view.distributions()), path)
    return style.save_as(histories_figure(view), path)


def write_site(
    folder: Path,
    *,
    jobs: int = 1,
    wanted: Sequence[str] = (),
    all_figures: bool = False,
    on_progress: progress.OnProgress = progress.unheard,
) -> Path:
    """Write `index.html` and a page a scene and an ensemble, beside a finished run.

    Figures and data are written with them. Returns the index. Two runs take turns.

    The figures for print are one SVG of each scene for which the run asks, with differences from
    its first reference; with `all_figures` one for each reference, also as PDF and PNG. What a page
    shows over time it draws itself.

    In a large run the scenes that are `shown` have a page, and those that are `wanted`. Pages are
    made in up to `jobs` processes. Files of earlier pages that these do not have are removed.
    Raises `InputError` where a wanted scene is not of the run.
    """
    with _turn(folder):
        earlier = manifest.read(folder).files
        pages = _Pages(folder, wanted, all_figures)
        templates.write_assets(folder)
        paths = _write_pages(pages, jobs, on_progress)
        written = {path.relative_to(folder).as_posix() for path in paths}
        manifest.remove_left_over(folder, earlier, written)
        manifest.write(folder, paths, _made_of(pages.run, folder, all_figures))
    return folder / INDEX


def is_up_to_date(run: results.Run, folder: Path, *, all_figures: bool = False) -> bool:
    """Whether a folder has this very run and its pages: nothing was played, judged or drawn anew.

    The run that made them may have been another one: its date and its times are told.
    """
    if run.up_to_date < len(run.cells):
        return False
    try:
        earlier = results.Run.load(folder)
        tables_are_whole = all(
            reading.read_text(folder / f"{table.name}.csv") == table_text.csv(table)
            for table in files_of(run)
        )
    except errors.InputError:
        return False
    if not (folder / "junit.xml").is_file() or not (folder / "summary.md").is_file():
        return False
    is_same_run = _facts_of(earlier) == _facts_of(run)
    return (
        is_same_run
        and tables_are_whole
        and manifest.is_whole(folder, _made_of(run, folder, all_figures))
    )


def _facts_of(run: results.Run) -> dict[str, Any]:
    """All of a run but when it was made, and what of it was read back."""
    facts = run.model_dump(mode="json", exclude={"created", "wall_seconds"})
    for cell in facts["cells"]:
        del cell["read_back"]
    return facts


def _made_of(run: results.Run, folder: Path, all_figures: bool) -> str:
    """Hash of all that the pages of a run depend on."""
    return provenance.digest(
        json.dumps(
            [
                _facts_of(run),
                style.drawn_by(),
                provenance.code_digest("rockcheck.validation.suite"),
                templates.folder_argument(folder),
                [page for _, page in STUDIES if (folder / page).exists()],
                all_figures,
            ],
            sort_keys=True,
        )
    )


class _Pages:
    """The pages of a finished run, by name of the scene or the ensemble.

    They are those that are shown, and those that are wanted.
    """

    def __init__(self, folder: Path, wanted: Sequence[str] = (), all_figures: bool = False) -> None:
        self.folder = folder
        self.all_figures = all_figures
        self.formats = style.FORMATS if all_figures else SHOWN
        self.run = results.Run.load(folder)
        self.wanted = tuple(wanted)
        slugs = slugs_of([*self.run.scenes, *(ensemble.name for ensemble in self.run.ensembles)])
        if unknown := [name for name in wanted if name not in slugs]:
            raise errors.unknown_name("scene of the run", unknown[0], slugs)
        self.scenes = scene_views(self.run, folder, {*shown(self.run), *wanted})
        self.ensembles = [
            EnsembleView(self.run, record.name, slugs[record.name], record)
            for record in self.run.ensembles
        ]
        views: list[SceneView | EnsembleView] = [*self.scenes, *self.ensembles]
        self.views = {view.name: view for view in views}
        self.links = {view.name: f"{templates.PAGES}/{view.slug}.html" for view in views}
        #: What every page shows, and calls.
        self.common: dict[str, Any] = {
            "site": {
                "name": f"rockcheck: {self.run.suite}",
                "links": [
                    *self.links.items(),
                    *((title, page) for title, page in STUDIES if (folder / page).exists()),
                ],
            },
            "run": self.run,
            "here": templates.folder_argument(folder),
            "formats": self.formats,
            "looks": style.looks(self.run.models),
            "channels": CHANNELS,
            "SEVERITY": verdict_scale.SEVERITY,
            "VERDICTS": tables.NAME_AND_SIGN,
            "tables": tables,
            "overview": overview,
            "row_cells": table_text.row_cells,
        }

    def write(self, name: str) -> list[Path]:
        """Write figures and data, and last the page; without a name the index.

        Returns the files that it has written.
        """
        view, address = self.views.get(name), self.links.get(name, INDEX)
        match view:
            case SceneView():
                template, (context, paths) = "scene.html", self._write_scene(view)
            case EnsembleView():
                template, (context, paths) = "finding.html", self._write_ensemble(view)
            case None:
                template, (context, paths) = "index.html", self._write_index()
        page = templates.write_page(
            self.folder, address, template, view=view, **context, **self.common
        )
        return [*paths, page]

    def _write_scene(self, view: SceneView) -> tuple[dict[str, Any], list[Path]]:
        """Write a scene's figures and data; returns what its page shows beside the view, and them.

        The figures are a thumbnail of all rotations, and where the run asks for them those for a
        paper.
        """
        drawn = writing.made(self.folder, templates.PAGES, document.FIGURES)
        curves = (
            (view.t, columns["theta"], view.looks[model]) for model, columns in view.drawn.items()
        )
        thumbnail = drawn / f"{view.slug}~small.svg"
        paths = [style.save_as(thumbnail_of(curves), thumbnail, named=False)]
        stems = self._stems(view)
        for against, stem in stems.items():
            figure = histories_figure(view, against)
            paths += style.save(figure, drawn / stem, self.formats)
        data = writing.made(self.folder, templates.PAGES, "data") / f"{view.slug}.js"
        payload = writing.script_text("window.rockcheck", payload_of(view))
        paths.append(writing.write_whole(data, payload))
        scene_folder = writing.made(self.folder, templates.PAGES, "scene-files")
        scene_files = write_scene_file(view.scene, scene_folder, view.slug)
        paths += [scene_folder / name for name in scene_files]
        neighbours = [None, *self.scenes, None]
        number = neighbours.index(view)
        context = {
            "files": scene_files,
            "previous": neighbours[number - 1],
            "following": neighbours[number + 1],
            "facts": scene_facts(view.scene),
            "beyond": experience.outside(view.scene),
            "summary": summary_of(view),
            "stems": stems,
        }
        return context, paths

    def _stems(self, view: SceneView) -> dict[str | None, str]:
        """The names of a scene's figures for print, by the reference of their differences."""
        if not view.printed:
            return {}
        references = view.figure_references if self.all_figures else view.figure_references[:1]
        slugs = slugs_of([str(against) for against in references])
        return {
            against: f"{view.slug}~against-{slugs[str(against)]}" if number else view.slug
            for number, against in enumerate(references)
        }

    def _write_ensemble(self, view: EnsembleView) -> tuple[dict[str, Any], list[Path]]:
        """Write an ensemble's figures and tables; returns what its page shows, and them."""
        page, drawn = view.page(), writing.made(self.folder, templates.PAGES, document.FIGURES)
        curves = [
            (*view.curves[model], look)
            for model, look in view.looks.items()
            if model in view.curves
        ]
        thumbnail = drawn / f"{view.slug}~small.svg"
        paths = [style.save_as(thumbnail_of(curves, step=True), thumbnail, named=False)]
        for plot in page.plots():
            paths += style.save(figure_of(plot), drawn / plot.name, self.formats)
        for table in page.tables():
            *parts, name = table.name.split("/")
            path = writing.made(self.folder, templates.PAGES, *parts) / f"{name}.csv"
            paths.append(writing.write_whole(path, table_text.csv(table)))
        return {"found": page}, paths

    def _write_index(self) -> tuple[dict[str, Any], list[Path]]:
        """Write the figures of the index; returns what it shows, and them."""
        drawn = writing.made(self.folder, templates.PAGES, document.FIGURES)
        blocks, matrix = overview.accuracy(self.run), overview.matrix(self.run)
        paths = []
        for block in blocks:
            if isinstance(block, Plot):
                paths += style.save(figure_of(block), drawn / block.name, self.formats)
        context = {
            "scenes": self.scenes,
            "ensembles": self.ensembles,
            "links": self.links,
            "worst": tables.worst_table(self.run, self.links),
            "hidden_worst": max(0, len(tables.worst_first(self.run)) - tables.WORST),
            "times": tables.times_table(self.run),
            "summaries": {
                m: models.FAMILIES[m].summary for m in self.run.models if m in models.FAMILIES
            },
            "matrix": {scene: row for scene, row in matrix.items() if scene in self.views},
            "accuracy": blocks,
            "glance": overview.glance(self.run, matrix),
        }
        return context, paths


def _write_pages(pages: _Pages, jobs: int, on_progress: progress.OnProgress) -> list[Path]:
    """Write all pages, the index last; returns the files that belong to them."""
    views = pages.views.values()
    are_few = sum(PRINTED if view.printed else 1 for view in views) < FEW
    if are_few:
        calls = [pool.Call(pages.write, (name,)) for name in pages.views]
        jobs = 1
    else:
        arguments = pages.folder, pages.wanted, pages.all_figures
        calls = [pool.Call(_write_page, (*arguments, name)) for name in pages.views]
    paths = []
    for done, of_page in enumerate(side_by_side(calls, jobs, least=2), 1):
        paths += of_page
        on_progress(done, len(calls) + 1)
    paths += pages.write("")
    on_progress(len(calls) + 1, len(calls) + 1)
    return paths


#: A process of the pool reads the run once for all its pages.
_pages_of = cache(_Pages)


def _write_page(folder: Path, wanted: Sequence[str], all_figures: bool, name: str) -> list[Path]:
    return _pages_of(folder, wanted, all_figures).write(name)


def write_scene_file(scene: Scene, folder: Path, slug: str) -> dict[str, str]:
    """Write the scene as `<slug>.toml` with its records as CSV beside it.

    What is at its default is left out. Returns file names and texts, the TOML first.

    `load_scene` reads the file back to a scene that moves in the same way.
    """
    tables, records = files.tables_of(scene), {}
    for key in ("excitation", "vertical"):
        excitation, name = getattr(scene, key), f"{slug}-{key}.csv"
        if isinstance(excitation, Record):
            tables[key] = {
                "kind": "record",
                "file": name,
                "scale": excitation.scale,
                "time_step": excitation.time_step,  # all its digits
            }
            peak = float(np.max(np.abs(excitation.unscaled), initial=0.0))
            if peak > stated.LARGEST_PEAK * GRAVITY_OF_RECORDS:
                tables[key]["unit"] = "m/s2!"  # it is meant, however large
            if excitation.time_step > stated.LONGEST_STEP:
                tables[key]["time_step"] = f"{excitation.time_step!r}!"  # however coarse
            rows = (
                (f"{excitation.time_step * n:.12g}", value)
                for n, value in enumerate(excitation.unscaled)
            )
            writing.write_whole(
                folder / name,
                f"# {re.sub(r'[^ -~]', '?', excitation.source)}\n"
                + writing.table_text(("time_s", "acceleration_m_s2"), rows),
            )
            records[name] = ""
    text = files.scene_text(tables)
    writing.write_whole(folder / f"{slug}.toml", text)
    return {f"{slug}.toml": text, **records}
