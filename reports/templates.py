"""Pages from templates, and the assets beside them: all pages have one look.

In: what a page shows, by name. Out: a file made from a template of `data/templates`. `document` and
`site` call it.
"""

import shlex
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from rockcheck.reports import style
from rockcheck.reports.show.words import (
    duration,
    moment,
    number,
    readable,
    unit,
    window,
)
from rockcheck.reports.table_text import words_of
from rockcheck.scenes import errors, writing
from rockcheck.validation.finding import Column, Mark, Table, plain

#: Characters above which a text has a wide column.
LONG_TEXT = 24


def text_class(table: Table, number: int) -> str:
    """The class of a column that holds text: "text", or "text long" where that needs room."""
    lengths = [len(str(plain(row[number]) or "")) for row in table.rows]
    return "text long" if max(lengths, default=0) > LONG_TEXT else "text"


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
} | {"share": lambda used: words_of(Mark(used), Column("used", kind="used"), number)}


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
            for look in style.every_look()
        ),
    )
