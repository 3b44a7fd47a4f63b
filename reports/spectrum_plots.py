"""Overturning spectra as figures, in the paper's colours.

In: a plot of a finding, or a spectrum. Out: a figure, or axes drawn into. Called by `drawers`, and
by `rockcheck.views`.
"""

from typing import Any

import numpy as np

from rockcheck.ebm.spectrum import LEFT, Spectrum
from rockcheck.reports.style import PAGE, Figure, label_of, new_figure
from rockcheck.scenes import recordings
from rockcheck.validation.finding import Plot

#: The paper's colours of outcomes.
OUTCOMES = {
    "safe": "#3b6fb6",
    "counterclockwise": "#e8833a",
    "clockwise": "#f2cf4a",
    "overturned": "#e8833a",
    "undecided": "#9a9a9a",
}
#: Colours of the letters of `validation.paper.tables`: FALLEN, STANDS, GAINED, LOST.
MARKED = {"F": "#e9e9e9", "T": "#a9c1df", "G": "#009168", "X": "#c4342d"}
#: Colours of all letters; of the outcome letters (`validation.studies.spectrum.tiles`) without a
#: wall.
LETTERS = MARKED | {
    "S": OUTCOMES["safe"],
    "L": OUTCOMES["counterclockwise"],
    "R": OUTCOMES["clockwise"],
    "U": OUTCOMES["undecided"],
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
}


def spectra(plot: Plot) -> Figure:
    """The overturning spectra of a figure (see `validation.studies.spectrum`).

    Each panel's `place` is its first row, its number of rows and its column.
    """
    data = plot.data
    panels = data["panels"]
    pulse, width = (data["pulse"], PAGE / 1.6) if len(panels) == 1 else (None, PAGE)
    rows = max(panel["place"][0] + panel["place"][1] for panel in panels)
    horizontal, vertical = axis_labels(data["record"])
    handles, columns = _legend(data)
    with new_figure(figsize=(width, data["height"]), layout="constrained") as figure:
        grid = figure.add_gridspec(rows, 1 + max(panel["place"][2] for panel in panels))
        x, y = data["frequencies"], data["amplitudes"]
        for panel in panels:
            row, high, column = panel["place"]
            axes = figure.add_subplot(grid[row : row + high, column])
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
            of = label_of(panel["row"]).replace(", ", ",\n") if "row" in panel else vertical
            axes.set_xlabel(horizontal if below else "", fontsize=7.0)
            axes.set_ylabel(of if beside else "", fontsize=7.0)
        if pulse:
            _units(axes, data)
        if own := data.get("own"):
            axes.plot(*own, **OWN_MARK | {"label": own_label(data["record"])})
        figure.legend(handles=handles, loc="outside lower center", ncols=columns, fontsize=7)
        figure.suptitle(plot.title, fontsize=9, x=0.01, ha="left")
    return figure


def draw_spectrum(spectrum: Spectrum, axes: Any) -> None:
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

    colours = LETTERS if free else LETTERS | {"R": OUTCOMES["overturned"]}
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


def _units(axes: Any, data: Any) -> None:
    """Add axes with the frequency (Hz) and the peak acceleration (g) of the pulses."""
    hertz = 1.0 / data["pulse"]["period"][0] / data["frequencies"][0]
    g = data["pulse"]["amplitude"][0] / data["amplitudes"][0] / recordings.GRAVITY_OF_RECORDS
    axes.secondary_xaxis(
        "top",
        functions=(lambda x: x * hertz, lambda x: x / hertz),
        xlabel="frequency of the pulse, Hz",
    )
    axes.secondary_yaxis(
        "right", functions=(lambda y: y * g, lambda y: y / g), ylabel="peak acceleration, g"
    )


def own_label(record: bool) -> str:
    """What the star in a spectrum is."""
    return "the block and the record as they are" if record else "the scene's own pulse"


def outcome_key(panels: Any) -> dict[str, str]:
    """Legend texts of the panels' colours, by the colours' names in `OUTCOMES`."""
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
        OUTCOMES[name]: words
        for name, words in outcome_key(data["panels"]).items()
        if name != "undecided" or "U" in shown
    }
    handles: list[Any] = [Patch(facecolor=colour, label=words) for colour, words in key.items()]
    if any(panel.get("law") for panel in data["panels"]):
        handles.append(Line2D([], [], label="depends on the impact law", **LAW_MARK))
    if data.get("own"):
        words = own_label(data["record"])
        handles.append(Line2D([], [], **OWN_MARK | {"markersize": 7.0, "label": words}))
    return handles, 1 if "key" in data else 2 if len(data["panels"]) == 1 else 4
