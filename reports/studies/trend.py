"""Page of a suite's figures over its runs: what `rockcheck validate --history FILE` keeps."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rockcheck.reports.site import Site
from rockcheck.reports.style import PAGE, figure_style, save
from rockcheck.validation.suite.changes import Moment, Trend, trends

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: So many figures are drawn, those that varied most; the table has all that varied.
DRAWN, COLUMNS = 12, 3


def trend_figure(found: Sequence[Trend], moments: Sequence[Moment]) -> Figure:
    """A panel a figure: its value over the runs; a red mark where it did not pass."""
    from matplotlib.figure import Figure

    with figure_style():
        rows = -(-len(found) // COLUMNS)
        figure = Figure(figsize=(PAGE, 0.5 + 1.15 * rows), layout="constrained")
        panels = figure.subplots(rows, COLUMNS, sharex=True, squeeze=False).ravel()
        for ax, one in zip(panels, found, strict=False):
            values = [float("nan") if value is None else value for value in one.values]
            ax.plot(
                range(len(values)), values, "o-", color="#0072b2", markersize=2.5, linewidth=0.8
            )
            bad = [n for n, moment in enumerate(moments) if one.name in moment.not_passed]
            ax.plot(bad, [values[n] for n in bad], "o", color="#c1272d", markersize=3.5)
            place, _, check = one.name.partition(": ")
            ax.set_title(f"{place}\n{check}", fontsize=5.5, loc="left")
            ax.tick_params(labelsize=5.5)
            ax.set_xticks(
                range(len(moments)),
                [moment.commit[:7] or str(n + 1) for n, moment in enumerate(moments)],
                rotation=90,
            )
            if len(moments) > 20:
                ax.set_xticks(
                    [0, len(moments) - 1],
                    [moments[n].commit[:7] or str(n + 1) for n in (0, len(moments) - 1)],
                )
        for ax in panels[len(found) :]:
            ax.set_visible(False)
    return figure


def write_trend(moments: Sequence[Moment], folder: Path) -> Path:
    """Writes the figure and `index.html` into a folder below that of the report; returns the
    page."""
    found = [trend for trend in trends(moments) if trend.spread > 0.0]
    if found:
        save(trend_figure(found[:DRAWN], moments), folder / "figure", ["svg"])
    site = Site(
        folder,
        f"rockcheck: {moments[-1].suite} over {len(moments)} runs",
        (("Report", "../index.html"),),
    )
    site.assets()
    same = len(moments[-1].figures) - len(found)
    return site.page(
        "index.html",
        "trend.html",
        moments=moments,
        found=found,
        same=same,
        drawn=min(DRAWN, len(found)),
    )
