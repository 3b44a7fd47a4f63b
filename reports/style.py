"""How a model looks, the same in every figure and on every page, and how figures are saved.

Hues are from Okabe & Ito's palette for colour-blind readers ("Color universal design", 2008),
darkened where a line on white would fall below a contrast of 3:1. A dash pattern says the same once
more for print without colour.
"""

import hashlib
import io
import json
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rockcheck.engines import registry
from rockcheck.scenes import InputError, printable, reading, writing
from rockcheck.validation.execute import models, provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure
else:  # it is imported only to draw: that takes a second
    Figure = Any

#: Width of a page of text in common journals, inches.
PAGE = 7.1
FORMATS = ("svg", "png", "pdf")
ENDINGS = ", ".join(f".{kind}" for kind in FORMATS)
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Look:
    """A model's label, colours, dash pattern and marker.

    Colours are on white and on black (hex); the dash pattern is in line widths, on and off.

    `key` names the colour in style sheets.
    """

    key: str
    label: str
    light: str
    dark: str
    dash: tuple[float, ...] = ()
    marker: str = "o"

    @property
    def line(self) -> dict[str, Any]:
        """Keywords for `Axes.plot`."""
        return {
            "color": self.light,
            "linestyle": (0, self.dash) if self.dash else "-",
            "label": self.label,
        }


#: The looks of the models that are no engines; an engine's is in its record.
LOOKS = {
    look.key: look
    for look in (
        Look("ebm", "EBM", "#1b1b1b", "#f2f2f2", (), "o"),
        Look("ebm-unilateral", "EBM, unilateral", "#0072b2", "#3d9fdc", (), "s"),
        Look("ebm-bouc-wen", "EBM, Bouc-Wen", "#a87900", "#d19a10", (3.0, 1.0, 1.0, 1.0), "P"),
        Look("cm", "CM", "#009168", "#00b583", (5.0, 1.5), "D"),
        Look("measured", "measured", "#6e6e6e", "#a0a0a0", (), "x"),
    )
}
#: For models that have no look of their own, in the order in which a run names them; their label is
#: the model's name.
SPARE = (
    Look("spare-1", "", "#5b4db3", "#978be8", (6.0, 2.0)),
    Look("spare-2", "", "#7d5a3c", "#b98f6b", (1.0, 1.0)),
    Look("spare-3", "", "#33798c", "#5fb3c9", (3.0, 2.0)),
    Look("spare-4", "", "#8a1f4b", "#e0719e", (8.0, 2.0, 2.0, 2.0)),
    Look("spare-5", "", "#4f6f1f", "#94bb57", (1.0, 2.0)),
)


@cache
def look_of(model: str) -> Look | None:
    """The look of a model of rockcheck; None of any other."""
    if model not in models.ENGINE_NAMES:
        return LOOKS.get(model)
    facts = registry.facts_of(model)
    line = facts.look
    return Look(model, facts.label, line.light, line.dark, line.dash, line.marker)


def look_by_key(key: str) -> Look | None:
    """A look as a plot's series names it: by its model, or by the key of a spare one."""
    return look_of(key) or next((look for look in SPARE if look.key == key), None)


def every_look() -> list[Look]:
    """The looks of all models of rockcheck in their order, then the spare ones."""
    return [*looks(models.FAMILIES).values(), *SPARE]


def looks(names: Iterable[str]) -> dict[str, Look]:
    """The look of each of a run's models.

    Models without one of their own get the spare colours, in order.
    """
    spare = cycle(SPARE)
    return {name: look_of(name) or replace(next(spare), label=name) for name in names}


def label_of(model: str) -> str:
    """A model's label: its name where it has no look of its own."""
    look = look_of(model)
    return look.label if look else model


#: The common style of all figures: sizes for a journal's page, a light grid, reproducible SVG.
STYLE: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 7.5,
    "axes.titlesize": 8.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 7.5,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.limits": (-4, 5),
    "text.parse_math": False,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.5,
    "lines.linewidth": 0.9,
    "lines.markersize": 4.0,
    "xtick.direction": "out",
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "legend.handlelength": 2.6,
    "path.simplify": True,
    "path.simplify_threshold": 0.5,
    "svg.fonttype": "path",
    "svg.hashsalt": "rockcheck",
    "pdf.fonttype": 42,
    "savefig.dpi": 150,
    "figure.dpi": 100,
}


@contextmanager
def new_figure(**how: Any) -> Iterator[Figure]:
    """A figure of the common style (`STYLE`), which a `with` block draws; it needs no display.

    `how` are the arguments of `matplotlib.figure.Figure`.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure as NewFigure

    with mpl.rc_context(STYLE):
        yield NewFigure(**how)


def power_of_ten(value: float) -> str:
    """10⁻³; plain from 0.1 to 1000, and where it is no power of ten."""
    exponent = round(math.log10(value))
    if not math.isclose(value, 10.0**exponent):
        return f"{value:g}"
    return f"{value:g}" if -1 <= exponent <= 3 else f"10{str(exponent).translate(SUPERSCRIPTS)}"


def kind_of(path: Path) -> str:
    """The format of a figure's file, one of `FORMATS`; raises `InputError` for another ending."""
    kind = path.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise InputError(
            f"{printable(path)}: a figure is written as {ENDINGS}, not as"
            f" {printable(path.suffix)!r}"
        )
    return kind


def save_as(figure: Figure, path: Path, *, stamp: str = "", named: bool = True) -> Path:
    """Write a figure into a file, in the format of its ending; returns it.

    The same figure gives the same bytes, for no date is written. `stamp` says what an SVG shows,
    see `stamp_of`; `named` that the user chose this very file.
    """
    import matplotlib as mpl

    kind, content = kind_of(path), io.BytesIO()
    undated: dict[str, dict[str, Any]] = {
        "svg": {"Date": None, "Creator": "rockcheck"} | ({"Identifier": stamp} if stamp else {}),
        "pdf": {"CreationDate": None, "Creator": "rockcheck"},
        "png": {"Software": "rockcheck"},
    }
    with mpl.rc_context(STYLE):
        figure.savefig(content, format=kind, metadata=undated[kind])
    figure.set_layout_engine(None)  # other formats are laid out alike
    writing.made(path.parent)
    return writing.write_whole(path, content.getvalue(), named=named)


def save(figure: Figure, stem: Path, formats: Sequence[str] = FORMATS) -> list[Path]:
    """Write a figure as `<stem>.svg` and so on, in each of the `formats` (see `save_as`)."""
    paths = (stem.with_name(f"{stem.name}.{kind}") for kind in formats)
    return [save_as(figure, path, named=False) for path in paths]


def stamp_of(shown: object) -> str:
    """Two short hashes: of what a figure shows, and of what draws it."""
    return f"{provenance.digest(json.dumps(shown, sort_keys=True))} {drawn_by()}"


@cache
def drawn_by() -> str:
    """Hash of all that draws figures and pages: code, templates, scripts, looks, matplotlib."""
    hashes = (
        hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(Path(__file__).parent.rglob("*"))
        if path.is_file() and path.suffix != ".pyc"
    )
    looks_of_models = map(repr, every_look())  # those of engines stand beside the engines
    return provenance.digest("\n".join([version("matplotlib"), *looks_of_models, *hashes]))


def stamp_in(path: Path) -> str:
    """The stamp that an SVG names near its beginning, empty where there is none."""
    identifier = re.search(r"<dc:identifier>([\w ]+)", reading.head_of(path, 4000))
    return identifier[1] if identifier else ""
