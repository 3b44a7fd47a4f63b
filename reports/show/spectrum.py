"""Overturning spectra in the paper's colours, and the scripts of their interactive page."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rockcheck.ebm.spectrum import LEFT, Spectrum
from rockcheck.reports.style import LOOKS, PAGE, figure_style
from rockcheck.scenes.recordings.recording import GRAVITY_OF_RECORDS
from rockcheck.scenes.writing import script_text, write_whole
from rockcheck.validation.finding import Plot

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The paper's colours.
COLOURS = {
    "safe": "#3b6fb6",
    "counterclockwise": "#e8833a",
    "clockwise": "#f2cf4a",
    "overturned": "#e8833a",
    "undecided": "#9a9a9a",
}
#: Names in `COLOURS` of the outcome letters (`validation.studies.spectrum.tiles`), without a wall
#: or with one.
LETTERS = {"S": "safe", "L": "counterclockwise", "R": "clockwise", "U": "undecided"}
#: Colours of the letters of `validation.paper.measures`: FALLEN, STANDS, GAINED, LOST.
MARKED = {"F": "#e9e9e9", "T": "#a9c1df", "G": "#009168", "X": "#c4342d"}
#: The mark of a node whose outcome depends on the law of impacts.
LAW_MARK: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 4.0,
    "markerfacecolor": "none",
    "markeredgecolor": "black",
    "markeredgewidth": 0.8,
}
#: The mark of a scene's own pulse.
OWN_MARK: dict[str, Any] = {
    "linestyle": "none",
    "marker": "*",
    "markersize": 11.0,
    "markerfacecolor": "white",
    "markeredgecolor": "black",
    "markeredgewidth": 0.9,
    "label": "the scene's own pulse",
}


def spectrum_figure(spectrum: Spectrum) -> Figure:
    """One overturning spectrum as a figure."""
    from rockcheck.reports.show.drawing import new_figure

    figure = new_figure(4.5, 3.6)
    draw(spectrum, figure.subplots())
    return figure


def draw(spectrum: Spectrum, axes: Any) -> None:
    """Draw a spectrum into matplotlib axes in the paper's colours.

    Blue is safe, grey undecided. Without a wall, orange is overturned counterclockwise and yellow
    clockwise; with a wall, orange is overturned either way. A black ring marks a node whose outcome
    depends on the law of impacts.
    """
    letters = np.array(["L", "S", "R"])[spectrum.outcomes - LEFT]
    letters[tuple(spectrum.undecided.T)] = "U"
    law: Any = [] if spectrum.depends_on_law is None else spectrum.depends_on_law
    axis = spectrum.frequency_ratios, spectrum.amplitude_ratios
    _paint(axes, letters, *axis, free=not spectrum.scene.walls, law=law)
    horizontal, vertical = axis_labels(spectrum.scene.excitation.kind == "record")
    axes.set_xlabel(horizontal)
    axes.set_ylabel(vertical)


def _paint(axes: Any, letters: Any, x: Any, y: Any, *, free: bool, law: Any) -> None:
    from matplotlib.colors import ListedColormap

    colours = {letter: COLOURS[name] for letter, name in LETTERS.items()} | MARKED
    if not free:
        colours["R"] = COLOURS["overturned"]
    codes = np.searchsorted(sorted(colours), letters)
    colour_map = ListedColormap([colours[letter] for letter in sorted(colours)])
    look = {"cmap": colour_map, "vmin": 0, "vmax": len(colours) - 1}
    axes.pcolormesh(x, y, codes, shading="nearest", rasterized=True, **look)
    if len(law):
        i, j = np.transpose(law)
        axes.plot(np.asarray(x)[j], np.asarray(y)[i], **LAW_MARK)
    axes.grid(False)


def axis_labels(record: bool) -> tuple[str, str]:
    """Plain-text labels of a spectrum's horizontal and vertical axes.

    Frequency and amplitude ratio of a pulse; for a record, the size of the block relative to its
    own and the scale of the record.
    """
    of_record = "size of the block / its own", "scale of the record"
    return of_record if record else ("\u03c9\u209a / p", "a\u209a / (g tan \u03b1)")


def figure(plot: Plot) -> Figure:
    """The figure of a plot of the kind "spectra" (see `validation.studies.spectrum`).

    Each panel's `place` is its first row, its number of rows and its column.
    """
    from matplotlib.figure import Figure

    data = plot.data
    panels = data["panels"]
    rows = max(panel["place"][0] + panel["place"][1] for panel in panels)
    horizontal, vertical = axis_labels(data["record"])
    with figure_style():
        figure = Figure(figsize=(PAGE if len(panels) > 1 else PAGE / 1.6, data["height"]))
        x, y = data["frequencies"], data["amplitudes"]
        for panel, place in zip(panels, _places(data, rows, bool(plot.title)), strict=True):
            row, high, column = panel["place"]
            axes = figure.add_axes(place)
            letters = np.array(list(panel["outcomes"])).reshape(len(y), len(x))
            _paint(axes, letters, x, y, free=panel["free"], law=panel.get("law", ()))
            axes.set_title(panel["title"], fontsize=7.0)
            axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
            below, beside = row + high == rows or column < high - 1, _beside(panel)
            axes.tick_params(labelbottom=below, labelleft=beside, labelsize=6.5)
            axes.locator_params(integer=not data["record"])
            axes.spines[["top", "right"]].set_visible(True)
            of = LOOKS[panel["row"]].label.replace(", ", ",\n") if "row" in panel else vertical
            axes.set_xlabel(horizontal if below else "", fontsize=7.0)
            axes.set_ylabel(of if beside else "", fontsize=7.0)
        if units := data["pulse"] if len(panels) == 1 else None:
            if own := units.get("own"):
                axes.plot(*own, **OWN_MARK)
            _units(axes, data)
        handles, columns = _legend(data)
        figure.legend(handles=handles, loc="lower center", ncols=columns, fontsize=7)
        figure.suptitle(
            plot.title, fontsize=9, x=0.01, y=1.0 - 0.06 / data["height"], ha="left", va="top"
        )
    return figure


def _beside(panel: Any) -> bool:
    """Whether a panel's vertical axis is labelled.

    Where panels are two grid rows high, column 0 holds the panel without a wall, midway between the
    rows of the others: it is labelled below, and column 1 beside, too.
    """
    _, high, column = panel["place"]
    return bool(column < high)


def _places(data: Any, rows: int, title: bool) -> list[tuple[float, float, float, float]]:
    """Where each panel's axes are: left, bottom, width and height, in shares of the figure.

    Margins in inches: a layout engine would need longer than the drawing.
    """
    panels, height = data["panels"], data["height"]
    width = PAGE if len(panels) > 1 else PAGE / 1.6
    units = 0.4 if len(panels) == 1 and data["pulse"] else 0.0
    wide = {column: 0.1 for *_, column in (panel["place"] for panel in panels)}
    for panel in filter(_beside, panels):
        wide[panel["place"][2]] = 0.53 if "row" in panel else 0.45
    across = (width - 0.1 - units - sum(wide.values())) / len(wide)
    lines = max(panel["title"].count("\n") for panel in panels)
    above = (0.27 if title else 0.03) + 0.22 + 0.13 * lines + units
    handles, columns = _legend(data)
    below = 0.5 + 0.15 * -(-len(handles) // columns)
    lower = any(panel["title"] for panel in panels if panel["place"][0] > 0)
    between = 0.3 if lower else 0.12
    row_height = (height - above - below + between) / rows
    return [
        (
            (sum(wide[k] for k in range(column + 1)) + column * across) / width,
            (height - above - (row + high) * row_height + between) / height,
            across / width,
            (high * row_height - between) / height,
        )
        for row, high, column in (panel["place"] for panel in panels)
    ]


def _units(axes: Any, data: Any) -> None:
    """Add axes with the frequency (Hz) and the peak acceleration (g) of the pulses."""
    hertz = 1.0 / data["pulse"]["period"][0] / data["frequencies"][0]
    g = data["pulse"]["amplitude"][0] / data["amplitudes"][0] / GRAVITY_OF_RECORDS
    above = axes.secondary_xaxis("top", functions=(lambda x: x * hertz, lambda x: x / hertz))
    above.set_xlabel("frequency of the pulse, Hz")
    beside = axes.secondary_yaxis("right", functions=(lambda y: y * g, lambda y: y / g))
    beside.set_ylabel("peak acceleration, g")


def outcome_key(panels: Any) -> dict[str, str]:
    """Legend texts of the panels' colours, by the colours' names in `COLOURS`."""
    free, walled = (any(panel["free"] is wall for panel in panels) for wall in (True, False))
    key = {"safe": "safe"}
    if free:
        key["clockwise"] = f"{'no wall: ' if walled else ''}overturned clockwise"
    other = "overturned" + ("; no wall:" if free and walled else "")
    key["counterclockwise"] = other + (" counterclockwise" if free else "")
    return key | {"undecided": "undecided"}


def _legend(data: Any) -> tuple[list[Any], int]:
    """The entries of a figure's legend, and how many stand in a row."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    shown = "".join(panel["outcomes"] for panel in data["panels"])
    key = {MARKED[letter]: words for letter, words in data.get("key", {}).items()} or {
        COLOURS[name]: words
        for name, words in outcome_key(data["panels"]).items()
        if name != "undecided" or "U" in shown
    }
    handles: list[Any] = [Patch(facecolor=colour, label=words) for colour, words in key.items()]
    if any(panel.get("law") for panel in data["panels"]):
        handles.append(Line2D([], [], label="depends on the impact law", **LAW_MARK))
    if (data.get("pulse") or {}).get("own"):
        handles.append(Line2D([], [], **OWN_MARK | {"markersize": 7.0}))
    return handles, 4 if "key" not in data else 1


def write_scripts(plot: Plot, folder: Path) -> list[str]:
    """Write the data of an interactive spectrum to `folder`; returns the scripts its page loads.

    `<name>.nodes.js` is small, and the page loads it at once. `<name>.histories.js` is loaded when
    a node is played, and is not among the scripts returned.
    """
    panels = plot.data["panels"]
    data = plot.data | {"stem": plot.name, "axes": axis_labels(plot.data["record"])}
    data["key"] = outcome_key(panels)
    data["panels"] = [
        {name: panel[name] for name in ("title", "free", "nodes")}
        | {"outcomes": _runs(panel["outcomes"])}
        for panel in panels
    ]
    for what, content in (("Nodes", data), ("Histories", plot.played)):
        place = f"(window.rockcheck{what} ??= {{}})[{json.dumps(plot.name)}]"
        write_whole(folder / f"{plot.name}.{what.lower()}.js", script_text(place, content))
    return ["pages/assets/animation.js", f"figures/{plot.name}.nodes.js", "pages/assets/nodes.js"]


def _runs(letters: str) -> str:
    """Run-length encoding of the letters: "SSL" gives "2S1L"."""
    return "".join(f"{len(list(same))}{letter}" for letter, same in itertools.groupby(letters))
