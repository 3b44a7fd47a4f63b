"""The pages of a finished run: one folder that opens from the file system and asks nothing of any other place."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from reports import tables, words
from reports.figures import figure_stem, write_figures
from reports.payload import script
from reports.scene_file import write_scene_file
from reports.style import LOOKS, SPARE, looks
from reports.view import CHANNELS, scene_views
from validation.results import Run, write_whole

DATA = Path(str(resources.files("reports"))) / "data"
#: The folder beside `index.html` that holds everything else.
PAGES = "pages"
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


def write_site(folder: Path) -> Path:
    """Write `index.html`, a page a scene, their figures and data into the folder of a finished run; returns the index."""
    run = Run.load(folder)
    views = scene_views(run, folder)
    pages = folder / PAGES
    links = [(view.name, f"{PAGES}/{view.slug}.html") for view in views]
    links += [(title, address) for title, address in STUDIES if (folder / address).exists()]
    site = Site(folder, f"rockcheck: {run.suite}", tuple(links))
    site.assets()
    for n, view in enumerate(views):
        write_figures(view, _made(pages / "figures"))
        write_whole(_made(pages / "data") / f"{view.slug}.js", script(view))
        site.page(
            f"{PAGES}/{view.slug}.html",
            "scene.html",
            view=view,
            files=write_scene_file(view.scene, _made(pages / "scene-files"), view.slug),
            previous=views[n - 1] if n else None,
            following=views[n + 1] if n + 1 < len(views) else None,
            **_common(run),
        )
    return site.page("index.html", "index.html", views=views, worst=tables.worst_first(run), times=tables.run_times(run), **_common(run))


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
