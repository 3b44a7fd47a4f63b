"""Overturning spectra in the paper's colours, and the scripts of their interactive page."""

import json
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from rockcheck.ebm.spectrum import LEFT, Spectrum
from rockcheck.reports.style import LOOKS, PAGE, Figure, new_figure
from rockcheck.scenes import writing
from rockcheck.scenes.recordings.recording import GRAVITY_OF_RECORDS
from rockcheck.validation.finding import Plot

#: The paper's colours.
COLOURS = {
    "safe": "#3b6fb6",
    "counterclockwise": "#e8833a",
    "clockwise": "#f2cf4a",
    "overturned": "#e8833a",
    "undecided": "#9a9a9a",
}
#: Colours of the letters of `validation.paper.measures`: FALLEN, STANDS, GAINED, LOST.
MARKED = {"F": "#e9e9e9", "T": "#a9c1df", "G": "#009168", "X": "#c4342d"}
#: Colours of all letters; of the outcome letters (`validation.studies.spectrum.tiles`) without a
#: wall.
LETTERS = MARKED | {
    "S": COLOURS["safe"],
    "L": COLOURS["counterclockwise"],
    "R": COLOURS["clockwise"],
    "U": COLOURS["undecided"],
}
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
    from rockcheck.reports.show.drawing import NotebookFigure

    figure = NotebookFigure(figsize=(4.5, 3.6), layout="constrained")
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
    x, y = spectrum.frequency_ratios, spectrum.amplitude_ratios
    _paint(axes, letters, x, y, free=not spectrum.scene.walls, law=spectrum.depends_on_law)
    horizontal, vertical = axis_labels(spectrum.scene.excitation.kind == "record")
    axes.set(xlabel=horizontal, ylabel=vertical)


def _paint(axes: Any, letters: Any, x: Any, y: Any, *, free: bool, law: Any) -> None:
    from matplotlib.colors import ListedColormap

    colours = LETTERS if free else LETTERS | {"R": COLOURS["overturned"]}
    axes.pcolormesh(
        x,
        y,
        np.searchsorted(sorted(colours), letters),
        shading="nearest",
        rasterized=True,
        cmap=ListedColormap([colours[letter] for letter in sorted(colours)]),
        vmin=0,
        vmax=len(colours) - 1,
    )
    if law is not None and len(law):
        i, j = np.transpose(law)
        axes.plot(np.asarray(x)[j], np.asarray(y)[i], **LAW_MARK)
    axes.grid(False)


def axis_labels(record: bool) -> tuple[str, str]:
    """Plain-text labels of a spectrum's horizontal and vertical axes.

    Frequency and amplitude ratio of a pulse; for a record, the size of the block relative to its
    own and the scale of the record.
    """
    return (
        ("size of the block / its own", "scale of the record")
        if record
        else ("\u03c9\u209a / p", "a\u209a / (g tan \u03b1)")
    )


def figure(plot: Plot) -> Figure:
    """The figure of a plot of the kind "spectra" (see `validation.studies.spectrum`).

    Each panel's `place` is its first row, its number of rows and its column.
    """
    data = plot.data
    panels = data["panels"]
    pulse, width = (data["pulse"], PAGE / 1.6) if len(panels) == 1 else (None, PAGE)
    rows = max(panel["place"][0] + panel["place"][1] for panel in panels)
    horizontal, vertical = axis_labels(data["record"])
    handles, columns = _legend(data)
    places = _places(
        panels,
        (width, data["height"]),
        rows,
        title=0.27 if plot.title else 0.03,
        units=0.4 if pulse else 0.0,
        below=0.5 + 0.15 * -(-len(handles) // columns),
    )
    with new_figure(figsize=(width, data["height"])) as figure:
        x, y = data["frequencies"], data["amplitudes"]
        for panel, place in zip(panels, places, strict=True):
            row, high, column = panel["place"]
            axes = figure.add_axes(place)
            letters = np.array(list(panel["outcomes"])).reshape(len(y), len(x))
            _paint(axes, letters, x, y, free=panel["free"], law=panel.get("law"))
            axes.set_title(panel["title"], fontsize=7.0)
            axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
            # Where panels are two grid rows high, column 0 holds the panel without a wall, midway
            # between the rows of the others: it is labelled below, and column 1 beside, too.
            below, beside = row + high == rows or column < high - 1, column < high
            axes.tick_params(labelbottom=below, labelleft=beside, labelsize=6.5)
            axes.locator_params(integer=not data["record"])
            axes.spines[["top", "right"]].set_visible(True)
            of = LOOKS[panel["row"]].label.replace(", ", ",\n") if "row" in panel else vertical
            axes.set_xlabel(horizontal if below else "", fontsize=7.0)
            axes.set_ylabel(of if beside else "", fontsize=7.0)
        if pulse:
            if own := pulse.get("own"):
                axes.plot(*own, **OWN_MARK)
            _units(axes, data)
        figure.legend(handles=handles, loc="lower center", ncols=columns, fontsize=7)
        figure.suptitle(
            plot.title, fontsize=9, x=0.01, y=1.0 - 0.06 / data["height"], ha="left", va="top"
        )
    return figure


def _places(
    panels: Any, size: tuple[float, float], rows: int, *, title: float, units: float, below: float
) -> list[tuple[float, float, float, float]]:
    """Where each panel's axes are: left, bottom, width and height, in shares of the figure.

    Its `size`, and the room for its title, for a pulse's units (above and beside), and for what
    stands below, are in inches: a layout engine would need longer than the drawing.
    """
    width, height = size
    wide: dict[int, float] = {}
    for panel in panels:
        _, high, column = panel["place"]
        labelled = 0.53 if "row" in panel else 0.45
        wide[column] = max(wide.get(column, 0.1), labelled if column < high else 0.1)
    across = (width - 0.1 - units - sum(wide.values())) / len(wide)
    above = title + 0.22 + 0.13 * max(panel["title"].count("\n") for panel in panels) + units
    between = 0.3 if any(panel["title"] for panel in panels if panel["place"][0] > 0) else 0.12
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
    axes.secondary_xaxis(
        "top",
        functions=(lambda x: x * hertz, lambda x: x / hertz),
        xlabel="frequency of the pulse, Hz",
    )
    axes.secondary_yaxis(
        "right", functions=(lambda y: y * g, lambda y: y / g), ylabel="peak acceleration, g"
    )


def outcome_key(panels: Any) -> dict[str, str]:
    """Legend texts of the panels' colours, by the colours' names in `COLOURS`."""
    free, walled = (any(panel["free"] is wall for panel in panels) for wall in (True, False))
    clockwise = {"clockwise": f"{'no wall: ' if walled else ''}overturned clockwise"}
    other = "overturned; no wall: counterclockwise" if walled else "overturned counterclockwise"
    return {
        "safe": "safe",
        **(clockwise if free else {}),
        "counterclockwise": other if free else "overturned",
        "undecided": "undecided",
    }


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
    panels = [
        {name: panel[name] for name in ("title", "free", "nodes")}
        # Run-length encoding of the letters: "SSL" is "2S1L".
        | {"outcomes": "".join(f"{len([*same])}{one}" for one, same in groupby(panel["outcomes"]))}
        for panel in plot.data["panels"]
    ]
    data = plot.data | {
        "stem": plot.name,
        "axes": axis_labels(plot.data["record"]),
        "key": outcome_key(panels),
        "panels": panels,
    }
    for what, content in (("Nodes", data), ("Histories", plot.played)):
        writing.write_whole(
            folder / f"{plot.name}.{what.lower()}.js",
            writing.script_text(
                f"(window.rockcheck{what} ??= {{}})[{json.dumps(plot.name)}]", content
            ),
        )
    return ["pages/assets/animation.js", f"figures/{plot.name}.nodes.js", "pages/assets/nodes.js"]
