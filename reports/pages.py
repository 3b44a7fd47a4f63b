"""A folder of pages with one look, made of the templates in `data/templates`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from rockcheck.reports.show import words
from rockcheck.reports.style import LOOKS, SPARE
from rockcheck.scenes.errors import inert
from rockcheck.scenes.writing import made, write_whole

DATA = Path(str(resources.files("rockcheck.reports"))) / "data"
#: The folder beside `index.html` that holds everything else.
PAGES = "pages"


@dataclass(frozen=True)
class Site:
    """A folder of pages with one look; `links` are its parts for the navigation, (title, address
    from the index)."""

    folder: Path
    name: str
    links: tuple[tuple[str, str], ...] = ()

    def page(self, address: str, template: str, **context: Any) -> Path:
        """Write the page `address` (relative to the folder, with slashes) from a template of
        `data/templates/`."""
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
        write_whole(target / "models.css", model_styles())


def model_styles() -> str:
    """A style sheet with a class `look-<key>` for each look of a model that sets its colour, by day
    and by night."""
    rows = (
        f".look-{look.key} {{ --look: light-dark({look.light}, {look.dark}); }}"
        for look in (*LOOKS.values(), *SPARE)
    )
    return "\n".join(rows) + "\n"


@cache
def _environment() -> Environment:
    """The templates with what they call. Kept, since compiling a page's templates takes longer than
    drawing its figures."""
    environment = Environment(
        loader=FileSystemLoader(DATA / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: inert(value) if type(value) is str else value,
    )
    for filter in (
        words.number,
        words.unit,
        words.duration,
        words.moment,
        words.window,
        words.dash_array,
        words.readable,
    ):
        environment.filters[filter.__name__] = filter
    return environment
