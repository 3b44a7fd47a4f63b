"""The figures of a scene for a paper: histories with their differences, and a thumbnail.

In: a `SceneView`. Out: figures of matplotlib. Called by `site`, which saves them. They show the
quantities of the paper's Figs. 4 and 5 for all models, and their differences below each.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from rockcheck.reports.style import PAGE, SUPERSCRIPTS, Figure, Look, new_figure
from rockcheck.reports.view import PAPER_CHANNELS, Band, Channel, SceneView
from rockcheck.scenes import excitations
from rockcheck.validation.discrepancy import figures

#: How an event is drawn on a model's track: kind, marker, size.
TRACKED = (("floor impact", "|", 5.0), ("wall impact", "D", 2.6))
#: The least that the axis of a thumbnail shows to either side, alpha: noise is not blown up.
LEAST = 1e-3
#: Below this share of a channel's largest value differences are drawn on a linear scale.
FINE = 1e-3
LEGEND_COLUMNS = 6
TOLERANCE = "#009168"
#: The mark of a limit of the RMS.
LIMIT: dict[str, Any] = {
    "color": TOLERANCE,
    "marker": "_",
    "markersize": 7.0,
    "markeredgewidth": 1.4,
}


def histories_figure(view: SceneView, against: str | None = None) -> Figure:
    """Each channel of all models over time, below it the difference from `against`, then impacts.

    Tolerances are shaded.

    `against` None: the first reference of the scene; where there is none the differences are left
    out.
    """
    against = against or view.figure_references[0]
    heights = (
        [0.55]
        + ([1.0, 0.62] if against else [1.0]) * len(PAPER_CHANNELS)
        + [0.16 * len(view.histories) + 0.15]
    )
    beyond = view.horizon is not None and view.horizon < view.t[-1]
    shades = _shades(view, against, beyond)
    legend_rows = -(-(len(view.histories) + len(shades)) // LEGEND_COLUMNS)
    # Margins in inches: a layout engine would need several times the drawing's own time.
    top, bottom, space = 0.25 + 0.16 * legend_rows, 0.42, 0.09
    height = top + bottom + 0.92 * sum(heights) + space * len(heights)
    with new_figure(figsize=(PAGE, height)) as figure:
        axes = list(figure.subplots(len(heights), 1, sharex=True, height_ratios=heights))
        figure.subplots_adjust(
            0.95 / PAGE, bottom / height, 1.0 - 0.08 / PAGE, 1.0 - top / height, hspace=space / 0.7
        )
        axes[0].plot(
            view.t, view.ground / excitations.GRAVITY_OF_RECORDS, color="#666666", linewidth=0.5
        )
        axes[0].set_ylabel("base\n(g)")
        panels = iter(axes[1:])
        for channel in PAPER_CHANNELS:
            _values(next(panels), view, channel)
            if against:
                _differences(next(panels), view, channel, against)
        _tracks(next(panels), view)
        for ax in axes:
            if beyond:
                ax.axvspan(view.horizon, view.t[-1], color="#000000", alpha=0.05, linewidth=0)
            ax.yaxis.set_label_coords(-0.6 / (PAGE - 1.03), 0.5)
        axes[-1].set(xlabel="time (s)", xlim=(float(view.t[0]), float(view.t[-1]) or 1.0))
        edge = 0.08 / PAGE
        below = f"; below each the difference from {view.looks[against].label}" if against else ""
        figure.text(
            edge,
            1.0 - 0.06 / height,
            f"{view.name}: all models{below}",
            va="top",
            weight="bold",
            fontsize=8.5,
        )
        handles, labels = axes[1].get_legend_handles_labels()
        figure.legend(
            handles + shades,
            [_short(label, 24) for label in labels + [str(shade.get_label()) for shade in shades]],
            ncols=LEGEND_COLUMNS,
            loc="upper left",
            bbox_to_anchor=(0.0, 1.0 - 0.2 / height),
            borderaxespad=0.0,
        )
        figure.text(
            1.0 - edge,
            0.03 / height,
            ", ".join(
                f"{name} {view.run.versions[name]}"
                for name in ("rockcheck", *view.run.models)
                if name in view.run.versions
            ),
            ha="right",
            va="bottom",
            fontsize=4.5,
            color="#777777",
        )
    return figure


def thumbnail(curves: Iterable[tuple[Any, Any, Look]], *, step: bool = False) -> Figure:
    """Some curves (x, y, and whose) over each other, small and without words."""
    with new_figure(figsize=(3.4, 0.9)) as figure:
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        for x, y, look in curves:
            ax.plot(
                x, y, color=look.light, linewidth=0.7, drawstyle="steps-post" if step else "default"
            )
        if step:
            ax.set_ylim(0.0, 1.0)
        else:
            ax.axhline(0.0, color="#bbbbbb", linewidth=0.4, zorder=0)
            ax.margins(x=0.0, y=0.08)
            ax.set_ylim(min(ax.get_ylim()[0], -LEAST), max(ax.get_ylim()[1], LEAST))
        ax.set_axis_off()
    return figure


def fineness(view: SceneView, channel: Channel, bands: Sequence[Band]) -> float:
    """Where the scale of differences turns from linear to logarithmic, in the channel's unit.

    The tightest tolerance that is not below a thousandth of the channel's largest value, else that
    thousandth: finer scales would show nothing but decades.
    """
    largest = max((_largest(columns[channel.name]) for columns in view.drawn.values()), default=0.0)
    least = float(f"{FINE * largest:.1g}") or 1e-12
    return min(
        (band.limit for band in bands if band.channel == channel.name and band.limit >= least),
        default=least,
    )


def _largest(values: np.ndarray) -> float:
    return float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))


def _values(ax: Any, view: SceneView, channel: Channel) -> None:
    """One channel of all models, the first reference drawn wide below the others.

    Wall impacts are marked on each model's own curve.
    """
    first = view.figure_references[0]
    for order, model in enumerate(model for model in view.looks if model in view.values):
        look, values = view.looks[model], view.drawn[model][channel.name]
        if model in view.measured:
            rows = view.measured[model]
            ax.plot(
                view.t[rows],
                values[rows],
                ".",
                color=look.light,
                markersize=2.0,
                label=look.label,
                zorder=3.0,
            )
        else:
            ax.plot(
                view.t,
                values,
                **look.line
                | (
                    {"linewidth": 1.6, "zorder": 1.9}
                    if model == first
                    else {"zorder": 2.0 + 0.01 * order}
                ),
            )
        if channel.name == "theta":
            _marks(ax, view, model, look.light)
    ax.set_ylabel(channel.symbol)


def _marks(ax: Any, view: SceneView, model: str, colour: str) -> None:
    """A diamond at each wall impact, and a cross where the block falls: the curve ends there."""
    theta, until = view.drawn[model]["theta"], view.falls.get(model, math.inf)
    if model in view.falls:
        row = int(np.searchsorted(view.t, until))
        ax.plot(
            view.t[row],
            theta[row],
            marker="x",
            markersize=4.5,
            markeredgewidth=1.2,
            color=colour,
            zorder=4.0,
        )
    if times := [
        event.t
        for event in view.histories[model].event_list
        if event.kind == "wall impact" and event.t <= until
    ]:
        ax.plot(
            times,
            np.interp(times, view.t, np.nan_to_num(theta)),
            marker="D",
            markersize=2.4,
            markerfacecolor="white",
            markeredgecolor=colour,
            linestyle="",
        )


def _differences(ax: Any, view: SceneView, channel: Channel, against: str) -> None:
    bands = [band for band in view.bands(against) if band.channel == channel.name]
    for limit, until in sorted(
        {(band.limit, band.until) for band in bands if band.kind == "peak"}, reverse=True
    ):
        ax.fill_between([0.0, until], -limit, limit, color=TOLERANCE, alpha=0.13, linewidth=0)
    for limit, until in sorted({(band.limit, band.until) for band in bands if band.kind == "rms"}):
        ax.plot([until, until], [0.0, limit], color=TOLERANCE, linewidth=0.8, zorder=3.0)
        ax.plot(until, limit, **LIMIT, zorder=3.0)
    for band in {
        band.model: band
        for band in sorted(bands, key=lambda band: band.until)
        if band.kind == "rms"
    }.values():
        running = view.running_rms(band)
        ax.plot(
            view.t[: len(running)],
            running,
            color=view.looks[band.model].light,
            linewidth=1.5,
            alpha=0.8,
        )
    fine = largest = fineness(view, channel, bands)
    for model, difference in view.differences(channel.name, against).items():
        largest = max(largest, _largest(difference))
        ax.plot(view.t, difference, **view.looks[model].line | {"linewidth": 0.6})
    ax.axhline(0.0, color="#888888", linewidth=0.4, zorder=1)
    ax.set_yscale("asinh", linear_width=fine)
    # Zero, and plus and minus the top power of ten and one at most two decades below it.
    top = math.floor(math.log10(max(largest, fine)))
    low = max(math.ceil(math.log10(fine)), top - 2)
    ticks = {0.0: "0"}
    for power in {min(low, top), top}:
        words = f"10{str(power).translate(SUPERSCRIPTS)}"
        ticks |= {10.0**power: words, -(10.0**power): f"−{words}"}
    ax.set(
        yticks=list(ticks),
        yticklabels=list(ticks.values()),
        ylim=(-1.3 * largest, 1.3 * largest),
    )
    ax.minorticks_off()
    ax.set_ylabel("difference", color="#555555", fontsize=6.5)
    ax.tick_params(axis="y", labelsize=5.5, colors="#555555")


def _tracks(ax: Any, view: SceneView) -> None:
    shown = [model for model in view.looks if model in view.histories]
    for row, model in enumerate(shown):
        for kind, marker, size in TRACKED:
            times = [e.t for e in figures.WindowedHistory(view.histories[model]).events(kind)]
            ax.plot(
                times,
                [row] * len(times),
                marker=marker,
                markersize=size,
                markeredgewidth=0.5,
                color=view.looks[model].light,
                linestyle="",
            )
    ax.set_yticks(
        range(len(shown)), [_short(view.looks[model].label) for model in shown], fontsize=6
    )
    ax.set_ylim(len(shown) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    ax.text(
        0.998,
        0.97,
        "impacts: | floor, ◆ wall",
        transform=ax.transAxes,
        ha="right",
        va="top",
        fontsize=6,
        color="#555555",
    )


def _short(label: str, most: int = 17) -> str:
    return label if len(label) <= most else label[: most - 1] + "…"


def _shades(view: SceneView, against: str | None, beyond: bool) -> list[Any]:
    """Legend entries for what the figure has besides the models."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    bands = view.bands(against) if against else ()
    shown = {channel.name for channel in PAPER_CHANNELS}
    kinds = {band.kind for band in bands if band.channel in shown}
    entries: list[tuple[bool, Any]] = [
        ("peak" in kinds, Patch(color=TOLERANCE, alpha=0.25, label="tolerance")),
        ("rms" in kinds, Line2D([], [], color="#555555", linewidth=1.8, label="RMS so far")),
        ("rms" in kinds, Line2D([], [], **LIMIT | {"linestyle": "", "label": "its limit"})),
        (beyond, Patch(color="#000000", alpha=0.08, label="beyond the horizon")),
    ]
    return [handle for shown, handle in entries if shown]
