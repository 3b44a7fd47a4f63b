"""Figures of one scene for a paper.

They show the quantities of its Figs. 4 and 5 for all models, and their differences below each.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rockcheck.reports.show.words import SUPERSCRIPTS, number
from rockcheck.reports.style import PAGE, Look, figure_style, looks, save
from rockcheck.reports.view import PAPER_CHANNELS, Band, Channel, SceneView
from rockcheck.scenes.excitations import GRAVITY_OF_RECORDS
from rockcheck.validation.discrepancy.figures import IMPACTS, WindowedHistory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

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


def histories_figure(
    view: SceneView, against: str | None = None, channels: Sequence[Channel] = PAPER_CHANNELS
) -> Figure:
    """Each channel of all models over time, below it the difference from `against`, then impacts.

    Tolerances are shaded.

    `against` None: the first reference of the scene; where there is none the differences are left
    out.
    """
    from matplotlib.figure import Figure

    if against is None:
        against = next(iter(view.references), None)
    known = looks(view.run.models)
    with figure_style():
        heights = (
            [0.55]
            + [h for _ in channels for h in ([1.0, 0.62] if against else [1.0])]
            + [0.16 * len(view.histories) + 0.15]
        )
        beyond = view.horizon is not None and view.horizon < view.t[-1]
        shades = _shades(view, against, channels, beyond)
        legend_rows = -(-(len(view.histories) + len(shades)) // LEGEND_COLUMNS)
        # Margins in inches: a layout engine would need several times the drawing's own time.
        top, bottom, space = 0.25 + 0.16 * legend_rows, 0.42, 0.09
        height = top + bottom + 0.92 * sum(heights) + space * len(heights)
        figure = Figure(figsize=(PAGE, height))
        axes = list(figure.subplots(len(heights), 1, sharex=True, height_ratios=heights))
        figure.subplots_adjust(
            0.95 / PAGE, bottom / height, 1.0 - 0.08 / PAGE, 1.0 - top / height, hspace=space / 0.7
        )
        axes[0].plot(view.t, view.ground / GRAVITY_OF_RECORDS, color="#666666", linewidth=0.5)
        axes[0].set_ylabel("base\n(g)")
        panels = iter(axes[1:])
        for channel in channels:
            _values(next(panels), view, channel)
            if against:
                _differences(next(panels), view, channel, against)
        _tracks(next(panels), view)
        for ax in axes:
            if beyond:
                ax.axvspan(view.horizon, view.t[-1], color="#000000", alpha=0.05, linewidth=0)
            ax.yaxis.set_label_coords(-0.6 / (PAGE - 1.03), 0.5)
        axes[-1].set_xlabel("time (s)")
        axes[-1].set_xlim(float(view.t[0]), float(view.t[-1]) or 1.0)
        edge = 0.08 / PAGE
        below = f"; below each the difference from {known[against].label}" if against else ""
        title = f"{view.name}: all models{below}"
        figure.text(edge, 1.0 - 0.06 / height, title, va="top", weight="bold", fontsize=8.5)
        used, versions = ("rockcheck", *view.run.models), view.run.versions
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
            ", ".join(f"{name} {versions[name]}" for name in used if name in versions),
            ha="right",
            va="bottom",
            fontsize=4.5,
            color="#777777",
        )
    return figure


def thumbnail(curves: Iterable[tuple[Any, Any, Look]], *, step: bool = False) -> Figure:
    """Some curves (x, y, and whose) over each other, small and without words."""
    from matplotlib.figure import Figure

    with figure_style():
        figure = Figure(figsize=(3.4, 0.9))
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        for x, y, look in curves:
            style = "steps-post" if step else "default"
            ax.plot(x, y, color=look.light, linewidth=0.7, drawstyle=style)
        low, high = 0.0, 1.0
        if not step:
            ax.axhline(0.0, color="#bbbbbb", linewidth=0.4, zorder=0)
            ax.margins(x=0.0, y=0.08)
            low, high = min(ax.get_ylim()[0], -LEAST), max(ax.get_ylim()[1], LEAST)
        ax.set_ylim(low, high)
        ax.set_axis_off()
    return figure


def write_figures(view: SceneView, folder: Path) -> None:
    """Write the figures of a scene into `folder`.

    A thumbnail of all rotations, and where the run asks for them those for a paper, one a
    reference.
    """
    known = looks(view.run.models)
    curves = [(view.t, view.drawn[m]["theta"], known[m]) for m in known if m in view.values]
    save(thumbnail(curves), folder / f"{view.slug}-small", ["svg"])
    for against in view.figure_references if view.printed else ():
        save(histories_figure(view, against), folder / figure_stem(view, against))


def summary(view: SceneView) -> str:
    """The figure of a scene in words: each model's peak rotation, impacts and outcome."""
    said = []
    for model, history in view.histories.items():
        impacts = len(WindowedHistory(history).events(*IMPACTS))
        peak = number(history.peak_rotation / view.scene.block.alpha)
        reached = f"peak {peak} α, " if history.overturned_at is None else ""
        said.append(f"{model}: {reached}{impacts} impacts, {history.fate}")
    return "; ".join(said) + "."


def figure_stem(view: SceneView, against: str | None) -> str:
    """File name, without its suffix, of the figure whose differences are from `against`."""
    if against is None or against == next(iter(view.references), None):
        return view.slug
    return (
        f"{view.slug}-against-{''.join(c if c.isalnum() or c in '._-' else '-' for c in against)}"
    )


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
    known = values[np.isfinite(values)]
    return float(np.max(np.abs(known))) if len(known) else 0.0


def _values(ax: Axes, view: SceneView, channel: Channel) -> None:
    """One channel of all models, the first reference drawn wide below the others.

    Wall impacts are marked on each model's own curve.
    """
    looked = looks(view.run.models)
    first = next(iter(view.references), None)
    for order, model in enumerate(model for model in looked if model in view.values):
        look, values = looked[model], view.drawn[model][channel.name]
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


def _marks(ax: Axes, view: SceneView, model: str, colour: str) -> None:
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
    events = view.histories[model].event_list
    if times := [event.t for event in events if event.kind == "wall impact" and event.t <= until]:
        ax.plot(
            times,
            np.interp(times, view.t, np.nan_to_num(theta)),
            marker="D",
            markersize=2.4,
            markerfacecolor="white",
            markeredgecolor=colour,
            linestyle="",
        )


def _differences(ax: Axes, view: SceneView, channel: Channel, against: str) -> None:
    bands = [band for band in view.bands(against) if band.channel == channel.name]
    known = looks(view.run.models)
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
            view.t[: len(running)], running, color=known[band.model].light, linewidth=1.5, alpha=0.8
        )
    fine = largest = fineness(view, channel, bands)
    for model, difference in view.differences(channel.name, against).items():
        largest = max(largest, _largest(difference))
        ax.plot(view.t, difference, **known[model].line | {"linewidth": 0.6})
    ax.axhline(0.0, color="#888888", linewidth=0.4, zorder=1)
    ax.set_yscale("asinh", linear_width=fine)
    ticks = _decades(fine, largest)
    ax.set_yticks(list(ticks), list(ticks.values()))
    ax.minorticks_off()
    ax.set_ylim(-1.3 * largest, 1.3 * largest)
    ax.set_ylabel("difference", color="#555555", fontsize=6.5)
    ax.tick_params(axis="y", labelsize=5.5, colors="#555555")


def _decades(fine: float, largest: float) -> dict[float, str]:
    """Places and words of at most five ticks of an asinh axis.

    They are zero, and plus and minus two decades.
    """
    top = math.floor(math.log10(max(largest, fine)))
    low = max(math.ceil(math.log10(fine)), top - 2)
    ticks = {0.0: "0"}
    for power in {min(low, top), top}:
        words = f"10{str(power).translate(SUPERSCRIPTS)}"
        ticks |= {10.0**power: words, -(10.0**power): f"−{words}"}
    return ticks


def _tracks(ax: Axes, view: SceneView) -> None:
    """A row a model: its impacts, so that a missed or an extra one is seen at once."""
    known = looks(view.run.models)
    shown = [model for model in known if model in view.histories]
    for row, model in enumerate(shown):
        for kind, marker, size in TRACKED:
            times = [e.t for e in WindowedHistory(view.histories[model]).events(kind)]
            ax.plot(
                times,
                [row] * len(times),
                marker=marker,
                markersize=size,
                markeredgewidth=0.5,
                color=known[model].light,
                linestyle="",
            )
    ax.set_yticks(range(len(shown)), [_short(known[model].label) for model in shown], fontsize=6)
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


def _shades(
    view: SceneView, against: str | None, channels: Sequence[Channel], beyond: bool
) -> list[Patch | Line2D]:
    """Legend entries for what the figure has besides the models."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    names, bands = [channel.name for channel in channels], view.bands(against) if against else ()
    kinds = {band.kind for band in bands if band.channel in names}
    look: dict[str, Any] = {**LIMIT, "linestyle": "", "label": "its limit"}
    entries: list[tuple[bool, Patch | Line2D]] = [
        ("peak" in kinds, Patch(color=TOLERANCE, alpha=0.25, label="tolerance")),
        ("rms" in kinds, Line2D([], [], color="#555555", linewidth=1.8, label="RMS so far")),
        ("rms" in kinds, Line2D([], [], **look)),
        (beyond, Patch(color="#000000", alpha=0.08, label="beyond the horizon")),
    ]
    return [handle for shown, handle in entries if shown]
