"""How the plots of a finding are drawn.

Lines over axes, and by `DRAWERS` what needs a drawer of its own.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from rockcheck.reports.style import BY_KEY, LOOKS, PAGE, figure_style, log_scales
from rockcheck.validation.execute.pool import Call, Pool, cores
from rockcheck.validation.finding import Axis, Panel, Plot

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Drawers of other kinds of plots: module and function, which takes the plot and returns a figure.
DRAWERS = {
    "spectra": "rockcheck.reports.show.spectrum:figure",
    "stable-steps": f"{__name__}:stable_steps",
    "strips": f"{__name__}:strips",
}
#: What writes the scripts of a live plot of such a kind: module and function, which takes the plot
#: and the folder of figures and returns the scripts that the page reads, in order.
SCRIPTS = {"spectra": "rockcheck.reports.show.spectrum:write_scripts"}
#: Colours by day and by night of series without a look, in their order; grey for "thin" ones.
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


def figure_of(plot: Plot) -> Figure:
    """The figure of a plot."""
    drawn: Figure = resolve_name(DRAWERS.get(plot.kind, f"{__name__}:lines"))(plot)
    return drawn


def scripts_of(plots: Sequence[Plot], folder: Path) -> list[str]:
    """Writes the scripts of live plots with a drawer of their own; returns those of the page."""
    found = [
        resolve_name(SCRIPTS[plot.kind])(plot, folder)
        for plot in plots
        if plot.live and plot.kind in SCRIPTS
    ]
    return list(dict.fromkeys(script for some in found for script in some))


def lines(plot: Plot) -> Figure:
    """A panel beside the other, on common axes, with one legend below."""
    from matplotlib.figure import Figure

    columns = min(COLUMNS, len(plot.panels))
    rows = math.ceil(len(plot.panels) / columns)
    with figure_style():
        figure = Figure(
            figsize=(PAGE, (3.4 if rows == 1 else 2.1 * rows) + 0.4), layout="constrained"
        )
        grid = figure.subplots(rows, columns, sharex=True, sharey=plot.shared, squeeze=False)
        handles: dict[str, Any] = {}
        per = plot.data["per_unit"] if plot.data else 1.0
        for ax, panel in zip(grid.flat, plot.panels, strict=False):
            _draw(ax, panel, handles)
            ax.set_title(panel.title)
            _scale(ax, plot.x, plot.y)
            if plot.data:
                above = ax.secondary_xaxis("top", functions=(lambda x: x * per, lambda x: x / per))
                above.set_xlabel(plot.data["other_label"])
        for ax in grid.flat[len(plot.panels) :]:
            ax.set_axis_off()
        for ax in grid[:, 0]:
            ax.set_ylabel(plot.y.label)
        for ax in grid[-1, :]:
            ax.set_xlabel(plot.x.label)
        if handles:
            figure.legend(handles.values(), handles, loc="outside lower center", ncols=4)
    return figure


def stable_steps(plot: Plot) -> Figure:
    """A panel an axis: the largest stable step of each model with its settings.

    Each cell shows the step by its colour and as a number.
    """
    import numpy as np
    from matplotlib.figure import Figure

    tried, models = plot.data["tried"], plot.data["models"]
    with figure_style():
        figure = Figure(figsize=(PAGE, 5.6), layout="constrained")
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
                    f"{step:g}" if step else "none",
                    ha="center",
                    va="center",
                    fontsize=6,
                    color="#1b1b1b" if step >= tried[2] or not step else "w",
                )
            ax.set_xticks(range(len(values)), [f"{value:g}" for value in values])
            ax.set_yticks(range(len(models)), models)
            ax.grid(visible=False)
            ax.set_xlabel(words)
    return figure


def strips(plot: Plot) -> Figure:
    """A strip a figure: a point a run, a bar from the 16 to the 84 % quantile, and the median."""
    import numpy as np
    from matplotlib.figure import Figure

    with figure_style():
        # Margins in inches: a layout engine would need longer than the drawing.
        height, row = 0.5 * len(plot.data) + 0.1, 0.5
        figure = Figure(figsize=(PAGE, height))
        rows = figure.subplots(len(plot.data), 1, squeeze=False)[:, 0]
        figure.subplots_adjust(
            1.25 / PAGE,
            0.24 / height,
            1.0 - 0.12 / PAGE,
            1.0 - 0.06 / height,
            hspace=row / 0.26 - 1.0,
        )
        for ax, one in zip(rows, plot.data, strict=True):
            values = np.sort(np.array(one["values"], dtype=float))
            low, median, high = np.quantile(values, (0.16, 0.5, 0.84))
            # points that would hide each other go up and down in turn
            beside = 0.25 * ((np.arange(len(values)) % 3) - 1)
            ax.barh(0.0, high - low, left=low, height=0.9, color=COLOURS[0][0], alpha=0.15)
            ax.plot([median, median], [-0.5, 0.5], color=COLOURS[0][0], linewidth=1.6, zorder=3)
            ax.plot(values, beside, "o", markersize=3.0, color=COLOURS[1][0], alpha=0.8)
            ax.set_xlim(0.0, max(float(values[-1]) * 1.06, 1e-3))
            ax.set_ylim(-0.6, 0.6)
            ax.set_yticks([])
            ax.grid(axis="y", visible=False)
            ax.set_ylabel(one["label"], rotation=0, ha="right", va="center")
    return figure


def _scale(ax: Axes, x: Axis, y: Axis) -> None:
    for axis, scale, limit in ((x, ax.set_xscale, ax.set_xlim), (y, ax.set_yscale, ax.set_ylim)):
        if axis.log:
            scale("log")
        if axis.limits is not None:
            limit(*axis.limits)
    log_scales(ax)
    for ticks, put in ((x.ticks, ax.set_xticks), (y.ticks, ax.set_yticks)):
        if ticks:
            put(list(ticks), list(ticks.values()))


def _draw(ax: Axes, panel: Panel, handles: dict[str, Any]) -> None:
    import numpy as np

    for series, colour in zip(panel.series, colours(panel), strict=True):
        low, y, high = (np.array(one, float) for one in (series.low, series.y, series.high))
        if series.style == "level":
            drawn = ax.axhline(y[0], color="#6e6e6e", linewidth=1.0, linestyle=(0, (6, 3)))
        else:
            if series.high:
                ax.fill_between(series.x, low, high, color=colour[0], alpha=0.15, linewidth=0)
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
        if series.style == "thin"
        else own.setdefault(series.label, COLOURS[len(own) % len(COLOURS)])
        for series in panel.series
    ]


def live_data(plot: Plot) -> dict[str, Any]:
    """What the page's script needs to draw a plot of one panel and to read it under the pointer."""
    (panel,) = plot.panels
    fits = {series.label: series for series in panel.series if series.style == "dots"}
    curves = [
        {
            "label": series.label,
            "values": _short(series.y),
            "colour": colour,
            "low": _short(series.low),
            "high": _short(series.high),
            "fit": _short(fits[series.label].y)
            if series.label in fits and series.style != "thin"
            else [],
            "dash": {"dashed": [8, 4], "dotted": [2, 3]}.get(series.style, []),
            "width": 0.7 if series.style == "thin" else 2.0,
        }
        for series, colour in zip(panel.series, colours(panel), strict=True)
        if series.style != "dots"
    ]
    return {
        "name": plot.name,
        "across": plot.x.label,
        "along": plot.y.label,
        "intensities": list(panel.series[0].x),
        "curves": curves,
        "least": plot.y.limits[0] if plot.y.limits else 0.0,
        "most": plot.y.limits[1] if plot.y.limits else None,
        "single": any(series.style == "thin" for series in panel.series),
        **(plot.data or {"per_unit": 0.0, "other_unit": "", "other_label": ""}),
    }


def _short(values: Any) -> list[float | None]:
    return [
        None if value is None or not math.isfinite(value) else float(f"{value:.5g}")
        for value in values
    ]


def side_by_side(calls: Iterable[Call], jobs: int | None = None, least: int = 4) -> Iterator[None]:
    """Make these calls, in `jobs` processes (default: one a core) if there are at least `least`.

    A process takes a second to import what draws.
    """
    waiting = deque(calls)
    jobs = min(jobs or cores(), len(waiting))
    if jobs < 2 or len(waiting) < least:
        yield from (call.function(*call.arguments) for call in waiting)
        return
    with Pool(jobs) as pool:
        for ended in pool.run(waiting):
            if ended.error is not None:
                raise ended.error
            yield
