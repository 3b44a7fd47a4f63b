"""Figures of one scene for a paper: the quantities of its Figs. 4 and 5 for all models, and their differences below each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reports.style import PAGE, figure_style, looks, save
from reports.view import PAPER_CHANNELS, Band, Channel, SceneView
from scenes.excitations import GRAVITY_OF_RECORDS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: How an event is drawn on a model's track: kind, marker, size.
TRACKED = (("floor impact", "|", 5.0), ("wall impact", "D", 2.6))
#: Below this share of a channel's largest value differences are drawn on a linear scale where no tolerance says better.
FINE = 1e-3


def histories_figure(view: SceneView, against: str | None = None, channels: Sequence[Channel] = PAPER_CHANNELS) -> Figure:
    """Each channel of all models over time, under each the difference from `against` with the tolerances shaded, then impacts.

    `against` None: the first reference of the scene; where there is none the differences are left out.
    """
    from matplotlib.figure import Figure

    if against is None:
        against = next(iter(view.references), None)
    with figure_style():
        heights = [0.55] + [h for _ in channels for h in ([1.0, 0.62] if against else [1.0])] + [0.16 * len(view.histories) + 0.15]
        figure = Figure(figsize=(PAGE, 1.0 + 0.98 * sum(heights)), layout="constrained")
        figure.get_layout_engine().set(h_pad=0.015, hspace=0.0)  # type: ignore[union-attr]
        axes = list(figure.subplots(len(heights), 1, sharex=True, height_ratios=heights))
        _ground(axes[0], view)
        below = iter(axes[1:])
        for channel in channels:
            _values(next(below), view, channel)
            if against:
                _differences(next(below), view, channel, against)
        _tracks(next(below), view)
        for ax in axes:
            _mark_horizon(ax, view)
        axes[-1].set_xlabel("time (s)")
        axes[-1].set_xlim(float(view.t[0]), float(view.t[-1]) or 1.0)
        figure.align_ylabels(axes)
        handles, labels = axes[1].get_legend_handles_labels()
        if handles:
            figure.legend(handles, labels, loc="outside upper left", ncols=6, title=_title(view, against), alignment="left")
        figure.text(0.999, 0.001, _stamp(view), ha="right", va="bottom", fontsize=4.5, color="#777777")
    return figure


def thumbnail(view: SceneView) -> Figure:
    """Rotation of all models, small and without words."""
    from matplotlib.figure import Figure

    with figure_style():
        figure = Figure(figsize=(3.4, 0.9))
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        for model, look in looks(view.run.models).items():
            if model in view.values:
                ax.plot(view.t, view.values[model]["theta"], color=look.light, linewidth=0.7)
        ax.axhline(0.0, color="#bbbbbb", linewidth=0.4, zorder=0)
        ax.margins(x=0.0, y=0.08)
        ax.set_axis_off()
    return figure


def write_figures(view: SceneView, folder: Path) -> list[Path]:
    """Write the figures of a scene into `folder`: one for each reference that its models are held against, and a thumbnail."""
    written = save(thumbnail(view), folder / f"{view.slug}-small", ["svg"])
    for against in view.references or (None,):
        written += save(histories_figure(view, against), folder / figure_stem(view, against))
    return written


def figure_stem(view: SceneView, against: str | None) -> str:
    """File name, without its suffix, of the figure whose differences are from `against`."""
    if against is None or against == next(iter(view.references), None):
        return view.slug
    return f"{view.slug}-against-{''.join(c if c.isalnum() or c in '._-' else '-' for c in against)}"


def fineness(view: SceneView, channel: Channel, bands: Sequence[Band]) -> float:
    """Where the scale of differences turns from linear to logarithmic, in the channel's unit: the tightest tolerance.

    Where there is none, a thousandth of the channel's largest value.
    """
    limits = [band.limit for band in bands if band.channel == channel.name and band.limit > 0.0]
    if limits:
        return min(limits)
    with np.errstate(invalid="ignore"):
        largest = max((_largest(columns[channel.name]) for columns in view.values.values()), default=0.0)
    return float(f"{FINE * largest:.1g}") or 1e-12


def _largest(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.max(np.abs(known))) if len(known) else 0.0


def _ground(ax: Axes, view: SceneView) -> None:
    ax.plot(view.t, view.ground / GRAVITY_OF_RECORDS, color="#666666", linewidth=0.5)
    ax.set_ylabel("base\n(g)")


def _values(ax: Axes, view: SceneView, channel: Channel) -> None:
    """One channel of all models, the first reference drawn wide below the others; wall impacts on each model's own curve."""
    for order, (model, look) in enumerate(looks(view.run.models).items()):
        if model not in view.values:
            continue
        first = model == next(iter(view.references), None)
        values = view.values[model][channel.name]
        ax.plot(view.t, values, **look.line | ({"linewidth": 1.6, "zorder": 1.9} if first else {"zorder": 2.0 + 0.01 * order}))
        if channel.name == "theta":
            times = np.array([e.t for e in view.histories[model].event_list if e.kind == "wall impact"])
            if len(times):
                at = np.interp(times, view.t, np.nan_to_num(values))
                ax.plot(times, at, marker="D", markersize=2.4, markerfacecolor="white", markeredgecolor=look.light, linestyle="")
    ax.set_ylabel(channel.symbol)


def _differences(ax: Axes, view: SceneView, channel: Channel, against: str) -> None:
    bands = [band for band in view.bands(against) if band.channel == channel.name]
    for limit, until in sorted({(band.limit, band.until) for band in bands}, reverse=True):
        ax.fill_between([0.0, until], -limit, limit, color="#009168", alpha=0.13, linewidth=0)
    known = looks(view.run.models)
    for model, difference in view.differences(channel.name, against).items():
        ax.plot(view.t, difference, **known[model].line | {"linewidth": 0.6})
    ax.axhline(0.0, color="#888888", linewidth=0.4, zorder=1)
    ax.set_yscale("asinh", linear_width=fineness(view, channel, bands))
    ax.yaxis.set_major_locator(_asinh_ticks(fineness(view, channel, bands)))
    ax.minorticks_off()
    ax.set_ylabel("difference", color="#555555", fontsize=6.5)
    ax.tick_params(axis="y", labelsize=5.5, colors="#555555")


def _asinh_ticks(fine: float) -> object:
    """At most five ticks: zero, and plus and minus the decades that show both ends."""
    from matplotlib.ticker import Locator

    class Decades(Locator):
        def __call__(self) -> list[float]:
            return self.tick_values(*self.axis.get_view_interval())  # type: ignore[union-attr]

        def tick_values(self, vmin: float, vmax: float) -> list[float]:
            top = max(abs(vmin), abs(vmax), fine)
            high = 10.0 ** np.floor(np.log10(top))
            low = max(10.0 ** np.ceil(np.log10(fine)), high / 1e2)
            steps = [low, high] if low < 0.5 * high else [high]
            return [sign * step for sign in (-1.0, 1.0) for step in steps] + [0.0]

    return Decades()


def _tracks(ax: Axes, view: SceneView) -> None:
    """A row a model: its impacts, so that a missed or an extra one is seen at once."""
    known = looks(view.run.models)
    shown = [model for model in known if model in view.histories]
    for row, model in enumerate(shown):
        for kind, marker, size in TRACKED:
            times = [e.t for e in view.histories[model].event_list if e.kind == kind]
            ax.plot(times, [row] * len(times), marker=marker, markersize=size, markeredgewidth=0.5, color=known[model].light, linestyle="")
    ax.set_yticks(range(len(shown)), [known[model].label for model in shown], fontsize=6)
    ax.set_ylim(len(shown) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    ax.set_ylabel("impacts")


def _mark_horizon(ax: Axes, view: SceneView) -> None:
    if view.horizon is not None and view.horizon < view.t[-1]:
        ax.axvspan(view.horizon, float(view.t[-1]), color="#000000", alpha=0.05, linewidth=0)


def _title(view: SceneView, against: str | None) -> str:
    """What the figure shows, in one line; a dollar sign in a name is no mathematics."""
    words = f"{view.name}: all models" + (f"; below each the difference from {looks(view.run.models)[against].label}" if against else "")
    return words.replace("$", r"\$")


def _stamp(view: SceneView) -> str:
    versions = view.run.versions
    used = [name for name in ("rockcheck", *view.run.models) if name in versions]
    return ", ".join(f"{name} {versions[name]}" for name in used)
