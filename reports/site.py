"""The pages of a finished run: one folder that opens from the file system and asks nothing of any other place."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from importlib import resources
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from reports import tables, words
from reports.figures import figure_stem, write_figures
from reports.payload import script
from reports.scene_file import write_scene_file
from reports.style import LOOKS, SPARE, looks
from reports.view import CHANNELS, SceneView, scene_views
from scenes.progress import tell
from validation import provenance
from validation.results import Run, write_whole

DATA = Path(str(resources.files("reports"))) / "data"
#: The folder beside `index.html` that holds everything else.
PAGES = "pages"
#: Fewer pages than this are written by the process itself.
FEW = 3
#: What a verdict is called and the sign that goes with its colour.
VERDICTS = {"pass": ("within tolerance", "✓"), "changed": ("changed", "△"), "fail": ("out of tolerance", "✕"), "error": ("failed", "!")}


@dataclass(frozen=True)
class Site:
    """A folder of pages with one look; `links` are its parts for the navigation, (title, address from the index)."""

    folder: Path
    name: str
    links: tuple[tuple[str, str], ...] = ()

    def page(self, address: str, template: str, **context: Any) -> Path:
        """Write the page `address` (relative to the folder, with slashes) from a template of `data/templates/`."""
        root = "../" * address.count("/")
        text = _environment().get_template(template).render(site=self, root=root, address=address, **context)
        path = self.folder / address
        path.parent.mkdir(parents=True, exist_ok=True)
        return write_whole(path, text)

    def assets(self) -> None:
        """Write style sheets, scripts and the plotting library, once for all pages."""
        target = _made(self.folder / PAGES / "assets")
        for source in sorted((DATA / "assets").iterdir()):
            shutil.copyfile(source, target / source.name)
        for source in sorted((DATA / "vendor").glob("*/*")):
            name = source.name if source.name != "LICENSE" else f"LICENSE.{source.parent.name}.txt"
            shutil.copyfile(source, target / name)
        write_whole(target / "models.css", model_styles())


#: Studies of other commands that may stand beside a run.
STUDIES = (("Convergence", "convergence/index.html"), ("Benchmark", "benchmark/index.html"), ("Overturning spectra", "spectra.html"))


def write_site(folder: Path, *, jobs: int = 1, afresh: bool = True) -> Path:
    """Write `index.html`, a page a scene, their figures and data into the folder of a finished run; returns the index.

    Scenes are drawn in up to `jobs` processes. Unless `afresh`, a scene's page stays that shows the same as it would now.
    What belonged to scenes that the run does not have any more is removed.
    """
    run = Run.load(folder)
    views = scene_views(run, folder)
    site = _site(run, views, folder)
    site.assets()
    waiting = [view.name for view in views if afresh or _stamp_of(folder / _address(view)) != _stamp(site, view)]
    for done, _ in enumerate(_write_scenes(folder, waiting, jobs)):
        tell(done / len(waiting))
    current = {f"{view.slug}.html" for view in views}
    for page in (folder / PAGES).glob("*.html"):
        if page.name not in current and _stamp_of(page):
            for name in (page.name, *_belongings(page)):
                (folder / PAGES / name).unlink(missing_ok=True)
    return site.page("index.html", "index.html", views=views, worst=tables.worst_first(run), times=tables.run_times(run), **_common(run))


def _site(run: Run, views: Sequence[SceneView], folder: Path) -> Site:
    links = [(view.name, _address(view)) for view in views]
    links += [(title, address) for title, address in STUDIES if (folder / address).exists()]
    return Site(folder, f"rockcheck: {run.suite}", tuple(links))


def _address(view: SceneView) -> str:
    return f"{PAGES}/{view.slug}.html"


def _write_scenes(folder: Path, names: Sequence[str], jobs: int) -> Iterator[None]:
    """Write the pages of these scenes; a process of its own costs a second, so a few pages do not get one."""
    if min(jobs, len(names)) < 2 or len(names) < FEW:
        yield from map(_SceneWriter(folder), names)
        return
    with ProcessPoolExecutor(min(jobs, len(names)), get_context("spawn"), _begin_process, (folder,)) as pool:
        yield from pool.map(_write_in_process, names)


class _SceneWriter:
    """Writes pages of a run's scenes by name."""

    def __init__(self, folder: Path) -> None:
        self.run = Run.load(folder)
        self.views = {view.name: view for view in scene_views(self.run, folder)}
        self.site = _site(self.run, list(self.views.values()), folder)

    def __call__(self, name: str) -> None:
        """Figures, data, scene file, and last the page, which names the stamp of what it shows."""
        view, names = self.views[name], list(self.views)
        place = names.index(name)
        pages, page = view.folder / PAGES, view.folder / _address(view)
        before = _belongings(page)
        write_figures(view, _made(pages / "figures"))
        write_whole(_made(pages / "data") / f"{view.slug}.js", script(view))
        self.site.page(
            _address(view),
            "scene.html",
            view=view,
            stamp=_stamp(self.site, view),
            files=write_scene_file(view.scene, _made(pages / "scene-files"), view.slug),
            previous=self.views[names[place - 1]] if place else None,
            following=self.views[names[place + 1]] if place + 1 < len(names) else None,
            **_common(self.run),
        )
        for old in before - _belongings(page):
            (pages / old).unlink(missing_ok=True)


_writer: _SceneWriter


def _begin_process(folder: Path) -> None:
    global _writer
    _writer = _SceneWriter(folder)


def _write_in_process(name: str) -> None:
    _writer(name)


def _stamp(site: Site, view: SceneView) -> str:
    """Hash of all that a scene's page shows and of the code that draws it; not when the run was, nor what was read back."""
    run = view.run
    shown = {
        "scene": run.scenes[view.name],
        "cells": [cell.model_dump(mode="json", exclude={"read_back"}) for cell in view.cells],
        "run": run.model_dump(mode="json", include={"suite", "reference", "model_form", "models", "measures", "versions", "hardware"}),
        "links": site.links,
        "stride": view.stride,
        "drawn by": _appearance(),
    }
    return provenance.digest(json.dumps(shown, sort_keys=True))


@cache
def _appearance() -> str:
    """Hash of the code, templates, scripts and styles that make the pages."""
    files = sorted(path for path in DATA.rglob("*") if path.is_file())
    hashes = [f"{path.name} {hashlib.sha256(path.read_bytes()).hexdigest()}" for path in files]
    return provenance.digest("\n".join([provenance.code_digest("reports"), provenance.version_of("matplotlib"), *hashes]))


def _stamp_of(page: Path) -> str:
    """The stamp that a page names, empty where there is no such page."""
    if not page.is_file():
        return ""
    with page.open(encoding="utf-8") as stream:
        found = re.search(r'<meta name="rockcheck-stamp" content="(\w+)">', stream.read(2000))
    return found[1] if found else ""


def _belongings(page: Path) -> set[str]:
    """The files of a scene's page, relative to the folder of pages."""
    if not page.is_file():
        return set()
    found = re.findall(r'(?:href|src)="((?:figures|data|scene-files)/[A-Za-z0-9._-]+)"', page.read_text(encoding="utf-8"))
    return {*found, f"figures/{page.stem}-small.svg"}


def _common(run: Run) -> dict[str, Any]:
    return {
        "run": run,
        "looks": looks(run.models),
        "channels": CHANNELS,
        "measures": {measure.name: measure for measure in run.measures},
    }


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def model_styles() -> str:
    """A style sheet with a class `look-<key>` for each look of a model that sets its colour, by day and by night."""
    rows = (f".look-{look.key} {{ --look: light-dark({look.light}, {look.dark}); }}" for look in (*LOOKS.values(), *SPARE))
    return "\n".join(rows) + "\n"


def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(DATA / "templates"), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    for filter in (words.number, words.unit, words.duration, words.ratio, words.window, words.dash_array):
        environment.filters[filter.__name__] = filter
    for function in (words.share, words.formula, tables.overrun, tables.measure_table, tables.scene_facts, tables.summary, figure_stem):
        environment.globals[function.__name__] = function
    environment.globals["VERDICTS"] = VERDICTS
    return environment
