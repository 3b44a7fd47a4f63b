"""Page and figure of an incremental dynamic analysis."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rockcheck.reports.site import Site
from rockcheck.reports.studies.curves import COLOURS as COLOURS_OF
from rockcheck.reports.studies.curves import GREY, Chart, Curve, fragility_chart, write_charts
from rockcheck.reports.style import PAGE, figure_style, save
from rockcheck.validation.spectra.fragility import Floats
from rockcheck.validation.spectra.ida import Ida

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#0072b2", "#d55e00", "#009168", "#a87900", "#bf5f92", "#5b4db3")
#: A curve that has overturned goes on to this peak, the end of the axis (alpha).
FALLEN = 1.25


def ida_figure(found: Ida) -> Figure:
    """Left: the curves of all motions, their median and 16 to 84 % band. Right: fragility curves with their bands and fits."""
    from matplotlib.figure import Figure

    with figure_style():
        figure = Figure(figsize=(PAGE, 3.3), layout="constrained")
        curves, fragility = figure.subplots(1, 2)
        _curves(curves, found)
        _fragility(fragility, found)
    return figure


def _curves(ax: Axes, found: Ida) -> None:
    level = np.array(found.intensities)
    for line in found.lines:
        ax.plot(_drawn(line.peaks), level, color="#9a9a9a", linewidth=0.4)
    low, middle, high = (_drawn(peaks) for peaks in found.quantiles.values())
    ax.fill_betweenx(level, low, high, color=COLOURS[0], alpha=0.15, linewidth=0, label="16 to 84 %")
    ax.plot(middle, level, color=COLOURS[0], linewidth=1.6, label="median")
    ax.axvline(1.0, color="#888888", linewidth=0.6, linestyle=":")
    ax.set_xlim(0.0, FALLEN)
    ax.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0, FALLEN], ["0", "0.25", "0.5", "0.75", "1", "fell"])
    ax.set_ylim(0.0, level[-1])
    ax.set_xlabel("peak rotation |θ|/α")
    ax.set_ylabel(_axis(found))
    ax.legend(loc="lower right")


def _drawn(peaks: tuple[float | None, ...]) -> Floats:
    return np.array([FALLEN if peak is None else min(peak, FALLEN) for peak in peaks])


def _fragility(ax: Axes, found: Ida) -> None:
    for one, colour in zip(found.capacities, COLOURS, strict=False):
        points = np.array(one.curve.points)
        ax.fill_between(points[:, 0], points[:, 2], points[:, 3], color=colour, alpha=0.12, linewidth=0)
        ax.plot(points[:, 0], points[:, 1], color=colour, label=one.curve.label)
        ax.plot(points[:, 0], points[:, 4], color=colour, linestyle=(0, (0.7, 1.7)), linewidth=0.8)
    ax.set_xlim(0.0, found.intensities[-1])
    ax.set_ylim(-0.02, 1.02)
    ax.set_xlabel(_axis(found))
    ax.set_ylabel("probability")
    ax.legend(loc="best", fontsize=6.5)


def _axis(found: Ida) -> str:
    return found.label if found.unit == "1" else f"{found.label} ({found.unit})"


def _lines_chart(found: Ida) -> Chart:
    """The lines of all motions, and their quantiles."""
    curves = [
        Curve(f"{line.record}{'' if line.direction > 0 else ', reversed'}", _cut(line.peaks), GREY, width=0.7) for line in found.lines
    ]
    quantiles = zip(found.quantiles.items(), (1, 0, 1), strict=False)
    curves += [Curve(f"{100.0 * float(share):g} %", _cut(peaks), COLOURS_OF[colour], width=2.2) for (share, peaks), colour in quantiles]
    return Chart("lines", _axis(found), "peak |θ|/α", found.intensities, tuple(curves), most=FALLEN, single=True)


def _cut(peaks: tuple[float | None, ...]) -> tuple[float | None, ...]:
    return tuple(None if peak is None or peak > FALLEN else float(f"{peak:.5g}") for peak in peaks)


def write_ida(found: Ida, folder: Path) -> Path:
    """Writes the figure and `index.html` into the folder of the analysis; returns the page."""
    save(ida_figure(found), folder / "figure")
    above = (("Report", "../index.html"),) if (folder.parent / "index.html").exists() else ()
    site = Site(folder, f"rockcheck: incremental dynamic analysis of {found.scene}", above)
    site.assets()
    write_charts(
        [_lines_chart(found), fragility_chart("fragility", _axis(found), [one.curve for one in found.capacities])], folder / "ida.curves.js"
    )
    records = list(dict.fromkeys((line.record, line.own) for line in found.lines))
    return site.page("index.html", "ida.html", found=found, records=records, created=datetime.now(UTC).isoformat(timespec="seconds"))
