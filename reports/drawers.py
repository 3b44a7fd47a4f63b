"""How the plots of a finding are drawn.

Lines over axes, and what needs a drawer of its own.
"""

import json
import math
from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.patches import Polygon, Rectangle

from rockcheck.ebm.spectrum import LEFT, Spectrum
from rockcheck.reports.style import BY_KEY, LOOKS, PAGE, Figure, new_figure, power_of_ten
from rockcheck.scenes import Floats, Scene, recordings, writing
from rockcheck.validation.execute.pool import Call, Pool, cores
from rockcheck.validation.finding import Axis, Panel, Plot, Series

#: Colours by day and by night of series without a look, in their order; grey for "thin" ones
#: and levels.
COLOURS = (
    ("#0072b2", "#3d9fdc"),
    ("#d55e00", "#e8762a"),
    ("#009168", "#00b583"),
    ("#a87900", "#d19a10"),
    ("#bf5f92", "#d98ab4"),
)
GREY = ("#9a9a9a", "#767c85")
#: Colours of a block: its edges, floor and walls; its face.
INK, SHADE = "#1b1b1b", "#d5d5d5"
#: Panels beside each other.
COLUMNS = 3
STYLES: dict[str, dict[str, Any]] = {
    "line": {"marker": "o", "markersize": 3.0},
    "smooth": {},
    "dashed": {"linestyle": (0, (5, 2))},
    "dotted": {"linestyle": (0, (1.5, 2))},
    "points": {"linestyle": "none", "marker": "o", "markersize": 3.0},
    "dots": {"linestyle": (0, (0.7, 1.7)), "linewidth": 0.8},
    "thin": {"linewidth": 0.5, "alpha": 0.6},
    "marked": {"linestyle": (0, (4, 1.5)), "marker": "*", "markersize": 5.0},
    "step": {"drawstyle": "steps-post"},
    "cross": {"linestyle": "none", "marker": "x", "markersize": 3.0},
}
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


def figure_of(plot: Plot) -> Figure:
    """The figure of a plot; lines, unless its kind has a drawer of its own."""
    return {
        "block": block,
        "spectra": spectra,
        "stable-steps": stable_steps,
        "strips": strips,
    }.get(plot.kind, lines)(plot)


def block(plot: Plot) -> Figure:
    """The block of a scene with its walls, to scale, in m."""
    with new_figure(figsize=(0.5 * PAGE, 0.5 * PAGE), layout="constrained") as figure:
        draw_block(figure.add_subplot(), Scene.model_validate(plot.data["scene"]))
    return figure


def lines(plot: Plot) -> Figure:
    """A panel beside the other, on common axes, with one legend below."""
    columns = min(COLUMNS, len(plot.panels))
    rows = math.ceil(len(plot.panels) / columns)
    height = (3.4 if rows == 1 else 2.1 * rows) + 0.4
    with new_figure(figsize=(PAGE, height), layout="constrained") as figure:
        grid = figure.subplots(rows, columns, sharex=True, sharey=plot.shared, squeeze=False)
        handles: dict[str, Any] = {}
        per = plot.data["per_unit"] if plot.data else 1.0
        for ax, panel in zip(grid.flat, plot.panels, strict=False):
            _draw(ax, panel, handles)
            place = ax.get_subplotspec()
            ax.set(
                title=panel.title,
                xlabel=plot.x.label if place.is_last_row() else "",
                ylabel=plot.y.label if place.is_first_col() else "",
            )
            _scale(ax, "x", plot.x)
            _scale(ax, "y", plot.y)
            if plot.data:
                ax.secondary_xaxis(
                    "top",
                    functions=(lambda x: x * per, lambda x: x / per),
                    xlabel=plot.data["other_label"],
                )
        for ax in grid.flat[len(plot.panels) :]:
            ax.set_axis_off()
        if handles:
            figure.legend(handles.values(), handles, loc="outside lower center", ncols=4)
    return figure


def stable_steps(plot: Plot) -> Figure:
    """A panel an axis: the largest stable step of each model with its settings.

    Each cell shows the step by its colour and as a number.
    """
    tried, models = plot.data["tried"], plot.data["models"]
    with new_figure(figsize=(PAGE, 5.6), layout="constrained") as figure:
        for ax, (words, values, found) in zip(
            figure.subplots(2, 2).flat, plot.data["panels"], strict=True
        ):
            steps = np.array(found, dtype=float)
            with np.errstate(divide="ignore"):
                ax.imshow(
                    np.log10(steps),
                    cmap="viridis",
                    vmin=np.log10(tried[-1]),
                    vmax=np.log10(tried[0]),
                    aspect="auto",
                )
            for (row, column), step in np.ndenumerate(steps):
                ax.text(
                    column,
                    row,
                    "" if np.isnan(step) else f"{step:g}" if step else "none",
                    ha="center",
                    va="center",
                    fontsize=6,
                    color="#1b1b1b" if step >= tried[2] or not step else "w",
                )
            ax.set(
                xticks=range(len(values)),
                xticklabels=[f"{value:g}" for value in values],
                yticks=range(len(models)),
                yticklabels=models,
                xlabel=words,
            )
            ax.grid(visible=False)
    return figure


def strips(plot: Plot) -> Figure:
    """A strip a figure: a point a run, a bar from the 16 to the 84 % quantile, and the median."""
    # Margins in inches: a layout engine would need longer than the drawing.
    height = 0.5 * len(plot.data) + 0.1
    with new_figure(figsize=(PAGE, height)) as figure:
        rows = figure.subplots(len(plot.data), 1, squeeze=False)[:, 0]
        figure.subplots_adjust(
            1.25 / PAGE,
            0.24 / height,
            1.0 - 0.12 / PAGE,
            1.0 - 0.06 / height,
            hspace=0.5 / 0.26 - 1.0,
        )
        for ax, one in zip(rows, plot.data, strict=True):
            values = np.sort(np.array(one["values"], dtype=float))
            low, median, high = np.quantile(values, (0.16, 0.5, 0.84))
            # points that would hide each other go up and down in turn
            beside = 0.25 * ((np.arange(len(values)) % 3) - 1)
            ax.barh(0.0, high - low, left=low, height=0.9, color=COLOURS[0][0], alpha=0.15)
            ax.plot([median, median], [-0.5, 0.5], color=COLOURS[0][0], linewidth=1.6, zorder=3)
            ax.plot(values, beside, "o", markersize=3.0, color=COLOURS[1][0], alpha=0.8)
            ax.set(xlim=(0.0, max(float(values[-1]) * 1.06, 1e-3)), ylim=(-0.6, 0.6), yticks=[])
            ax.grid(axis="y", visible=False)
            ax.set_ylabel(one["label"], rotation=0, ha="right", va="center")
    return figure


def draw_block(axes: Any, scene: Scene) -> None:
    """Draw block (at its initial position and rotation), floor and walls to scale, in m."""
    block = scene.block
    x, y, theta = scene.initial_state[:3]
    turn = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (block.half_width, block.half_height)
    axes.add_patch(Polygon(corners @ turn.T + (x, y), facecolor=SHADE, edgecolor=INK))
    if block.centre_of_mass is not None:
        axes.plot(*(np.array(block.offset) @ turn.T + (x, y)), marker="+", color=INK)
    reach = 1.4 * block.half_diagonal
    axes.axhline(0.0, color=INK, linewidth=2)
    thick = 0.12 * block.half_diagonal
    for wall in scene.walls:
        place = block.half_width + wall.gap
        left = -place - thick if wall.side == "left" else place
        axes.add_patch(Rectangle((left, 0.0), thick, 2.4 * block.half_height, facecolor=INK))
    axes.set(
        xlim=(-reach, reach),
        ylim=(-0.1 * block.half_height, 2.4 * block.half_height),
        aspect="equal",
        xlabel="m",
    )
    axes.tick_params(labelsize="small")


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
            of = LOOKS[panel["row"]].label.replace(", ", ",\n") if "row" in panel else vertical
            axes.set_xlabel(horizontal if below else "", fontsize=7.0)
            axes.set_ylabel(of if beside else "", fontsize=7.0)
        if pulse:
            _units(axes, data)
        if own := data.get("own"):
            axes.plot(*own, **OWN_MARK | {"label": own_label(data["record"])})
        figure.legend(handles=handles, loc="outside lower center", ncols=columns, fontsize=7)
        figure.suptitle(plot.title, fontsize=9, x=0.01, ha="left")
    return figure


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


def _scale(ax: Any, of: Literal["x", "y"], axis: Axis) -> None:
    """One axis: limits, ticks, and where it is logarithmic at most seven powers of ten.

    The common style leaves the $ of matplotlib's own labels of powers as it is.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    if axis.log:
        ax.set(**{f"{of}scale": "log"})
        getattr(ax, f"{of}axis").set(
            major_locator=LogLocator(numticks=7),
            major_formatter=FuncFormatter(lambda value, _: power_of_ten(value)),
            minor_locator=NullLocator(),
        )
    if axis.limits is not None:
        ax.set(**{f"{of}lim": axis.limits})
    if axis.ticks:
        ax.set(**{f"{of}ticks": list(axis.ticks), f"{of}ticklabels": list(axis.ticks.values())})


def _draw(ax: Any, panel: Panel, handles: dict[str, Any]) -> None:
    for series, colour in zip(panel.series, colours(panel), strict=True):
        low, y, high = (np.array(one, float) for one in (series.low, series.y, series.high))
        if series.high:
            ax.fill_between(series.x, low, high, color=colour[0], alpha=0.15, linewidth=0)
        if series.style == "level":
            drawn = ax.axhline(y[0], color="#6e6e6e", linewidth=1.0, linestyle=(0, (6, 3)))
        else:
            look = STYLES[series.style] | (
                {"marker": LOOKS[series.look].marker}
                if series.look in LOOKS and series.style == "line"
                else {"linestyle": BY_KEY[series.look].line["linestyle"]}
                if series.look in BY_KEY and series.style == "step"
                else {}
            )
            (drawn,) = ax.plot(series.x, y, color=colour[0], **look)
        if series.label and series.style != "thin":
            handles.setdefault(series.label, drawn)


def colours(panel: Panel) -> list[tuple[str, str]]:
    """The colours of a panel's series, for light and dark pages.

    Series with one label, such as a line and its fit, share a colour.
    """
    own: dict[str, tuple[str, str]] = {}
    return [
        (BY_KEY[series.look].light, BY_KEY[series.look].dark)
        if series.look in BY_KEY
        else GREY
        if series.style in ("thin", "level")
        else own.setdefault(series.label, COLOURS[len(own) % len(COLOURS)])
        for series in panel.series
    ]


def live_data(plot: Plot) -> dict[str, Any]:
    """What the page's script needs to draw a plot of one panel and to read it under the pointer."""
    (panel,) = plot.panels
    axis = np.array(panel.series[0].x, float)
    fits = {series.label: series for series in panel.series if series.style == "dots"}
    return {
        "name": plot.name,
        "across": plot.x.label,
        "along": plot.y.label,
        "intensities": axis.tolist(),
        "log": plot.x.log,
        "curves": [
            _live_curve(series, axis, colour, fits.get(series.label))
            for series, colour in zip(panel.series, colours(panel), strict=True)
            if series.style != "dots"
        ],
        "least": plot.y.limits[0] if plot.y.limits else 0.0,
        "most": plot.y.limits[1] if plot.y.limits else None,
        "single": any(series.style == "thin" for series in panel.series),
        **(plot.data or {"per_unit": 0.0, "other_unit": "", "other_label": ""}),
    }


def _live_curve(
    series: Series, axis: Floats, colour: tuple[str, str], fit: Series | None
) -> dict[str, Any]:
    """One curve of a live chart, and the `fit` that is drawn with it."""
    is_thin = series.style == "thin"
    return {
        "label": series.label,
        "values": _short(_on(axis, series)),
        "fell": np.flatnonzero(np.array(series.y, float) == math.inf).tolist(),
        "colour": colour,
        "low": _short(series.low),
        "high": _short(series.high),
        "fit": [] if fit is None or is_thin else _short(fit.y),
        "dash": {"dashed": [8, 4], "dotted": [2, 3]}.get(series.style, []),
        "width": 0.7 if is_thin else 2.0,
    }


def _on(axis: Floats, series: Series) -> Floats:
    """A series at the values of an axis; NaN where it has none.

    The charts of a page have one axis for all their series. A step keeps its last value.
    """
    x, y = np.array(series.x, float), np.array(series.y, float)
    if np.array_equal(x, axis):
        return y
    if not len(x):
        return np.full(len(axis), math.nan)
    if series.style != "step":
        return np.interp(axis, x, y, left=math.nan, right=math.nan)
    last = np.searchsorted(x, axis, side="right") - 1
    return np.where(last >= 0, y[np.maximum(last, 0)], math.nan)


def _short(values: Any) -> list[float | None]:
    return [
        None if value is None or not math.isfinite(value) else float(f"{value:.5g}")
        for value in values
    ]


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


def side_by_side(calls: Iterable[Call], jobs: int | None = None, least: int = 4) -> Iterator[Any]:
    """Make these calls, in `jobs` processes (default: one a core) if there are at least `least`.

    Yields their results as they end. A process takes a second to import what draws.
    """
    waiting = list(calls)
    jobs = min(jobs or cores(), len(waiting))
    if jobs < 2 or len(waiting) < least:
        yield from (call.function(*call.arguments) for call in waiting)
        return
    with Pool(jobs) as pool:
        for ended in pool.run(waiting):
            if ended.error is not None:
                raise ended.error
            yield ended.result
