"""Lines over axes, strips of points, and the table of stable steps, as figures.

In: a plot of a finding. Out: a figure of matplotlib. Called by `drawers`.
"""

import math
from typing import Any, Literal

import numpy as np

from rockcheck.reports.style import PAGE, Figure, look_by_key, look_of, new_figure, power_of_ten
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


def _scale(ax: Any, of: Literal["x", "y"], axis: Axis) -> None:
    """One axis: limits, ticks, and where it is logarithmic at most seven powers of ten.

    Below two of them, ticks at 1, 2 and 5 of each. The common style leaves the $ of matplotlib's
    own labels of powers as it is.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    if axis.log:
        ax.set(**{f"{of}scale": "log"})
    if axis.limits is not None:
        ax.set(**{f"{of}lim": axis.limits})
    if axis.log:
        low, high = getattr(ax, f"get_{of}lim")()
        subs = (1.0, 2.0, 5.0) if high < 100.0 * low else (1.0,)
        getattr(ax, f"{of}axis").set(
            major_locator=LogLocator(subs=subs, numticks=7),
            major_formatter=FuncFormatter(lambda value, _: power_of_ten(value)),
            minor_locator=NullLocator(),
        )
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
            (drawn,) = ax.plot(series.x, y, color=colour[0], **_line_of(series))
        if series.label and series.style != "thin":
            handles.setdefault(series.label, drawn)


def _line_of(series: Series) -> dict[str, Any]:
    """Keywords for the line of a series: its style's, and the marker or dashes of its look."""
    line = dict(STYLES[series.style])
    if series.style == "line" and (model := look_of(series.look)):
        line["marker"] = model.marker
    if series.style == "step" and (look := look_by_key(series.look)):
        line["linestyle"] = look.line["linestyle"]
    return line


def colours(panel: Panel) -> list[tuple[str, str]]:
    """The colours of a panel's series, for light and dark pages.

    Series with one label, such as a line and its fit, share a colour.
    """
    by_label: dict[str, tuple[str, str]] = {}
    pairs = []
    for series in panel.series:
        if look := look_by_key(series.look):
            pair = look.light, look.dark
        elif series.style in ("thin", "level"):
            pair = GREY
        else:
            pair = by_label.setdefault(series.label, COLOURS[len(by_label) % len(COLOURS)])
        pairs.append(pair)
    return pairs


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
