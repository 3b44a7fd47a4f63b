"""Page and diagrams of a benchmark: work and precision, ratios, batches, savings."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rockcheck.reports.site import PAGES
from rockcheck.reports.studies.page import write_study
from rockcheck.reports.style import LOOKS, PAGE, figure_style, log_scales, save
from rockcheck.scenes.writing import made
from rockcheck.validation.bench.ebm import CASES, EbmSpeed
from rockcheck.validation.bench.ebm import LEVEL as BATCH_LEVEL
from rockcheck.validation.bench.models import LEVEL, LINES, DiagramLine, Point, WorkPrecision
from rockcheck.validation.bench.scenes import FAMILIES
from rockcheck.validation.bench.skipping import NOT_MEASURED
from rockcheck.validation.bench.study import Benchmark

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: The diagrams: a name for files, a title, and how its scenes' names begin.
SHEETS = (
    ("without-wall", "Without a wall", ("free", "pulse", "slip")),
    ("with-wall", "Beside a wall", ("wall",)),
    ("records", "El Centro", ("fig",)),
)
#: Floor of the diagrams' error axes: below are rounding errors.
FLOOR = 1e-13


def write_benchmark(found: Benchmark, folder: Path) -> Path:
    """Writes `index.html` with its diagrams into the folder of a benchmark; returns the page."""
    figures = made(folder, PAGES, "figures")
    sheets = []
    if found.models is not None:
        for name, title, starts in SHEETS:
            families = [family for family in found.models.horizons if family.startswith(starts)]
            if families:
                save(work_precision_figure(found.models, families), figures / name)
                sheets.append((name, title, families))
        save(ratio_figure(found.models), figures / "ratios")
    if found.ebm is not None:
        save(batch_figure(found.ebm), figures / "batches")
    return write_study(
        found,
        folder,
        "benchmark.html",
        sheets=sheets,
        lines=LINES,
        families=FAMILIES,
        cases=CASES,
        level=LEVEL,
        batch_level=BATCH_LEVEL,
        not_measured=NOT_MEASURED,
    )


def work_precision_figure(found: WorkPrecision, families: Sequence[str]) -> Figure:
    """Median error, with its 10-90 % band, over CPU time a simulated second: a panel a family, a line a model."""
    from matplotlib.figure import Figure

    columns = min(3, len(families))
    rows = math.ceil(len(families) / columns)
    with figure_style():
        figure = Figure(figsize=(PAGE, 2.1 * rows + 1.0), layout="constrained")
        axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        handles: dict[str, Any] = {}
        for ax, family in zip(axes.flat, families, strict=False):
            for label, line in LINES.items():
                points = [point for point in found.line(family, label) if _drawn(point)]
                if points:
                    handles.setdefault(label, _draw(ax, line, points))
            if found.model_form[family] > FLOOR:
                form = ax.axhline(found.model_form[family], color="#6e6e6e", linewidth=1.0, linestyle=(0, (6, 3)))
                handles.setdefault("model form: EBM against unilateral", form)
            ax.set(xscale="log", yscale="log", ylim=(FLOOR, 3.0), title=family)
            log_scales(ax)
        for ax in axes.flat[len(families) :]:
            ax.set_axis_off()
        for ax in axes[:, 0]:
            ax.set_ylabel("RMS error of θ / α")
        for ax in axes[-1, :]:
            ax.set_xlabel("CPU s a simulated s")
        names = {label: _label(label) for label in handles}
        figure.legend(handles.values(), [names[label] for label in handles], loc="outside lower center", ncols=4)
    return figure


def _drawn(point: Point) -> bool:
    return math.isfinite(point.rms) and math.isfinite(point.cpu) and point.rms > 0.0


def _label(line: str) -> str:
    """EBM, MuJoCo adaptive, ..."""
    model, _, rest = line.partition(" ")
    return " ".join(filter(None, [LOOKS[model].label if model in LOOKS else model, rest]))


def _appearance(label: str, line: DiagramLine) -> dict[str, Any]:
    """A model's colour and marker; default settings are hollow and dotted, adaptive stepping is dashed."""
    look = LOOKS[line.model]
    appearance: dict[str, Any] = {"color": look.light, "marker": look.marker, "markersize": 3.2, "linewidth": 0.9}
    if label.endswith("default"):
        appearance |= {"markerfacecolor": "white", "linestyle": (0, (1, 1.5))}
    elif label.endswith("adaptive"):
        appearance |= {"linestyle": (0, (4, 1.5)), "marker": "*", "markersize": 5.0}
    return appearance


def _draw(ax: Axes, line: DiagramLine, points: Sequence[Point]) -> Any:
    cpu = [point.cpu for point in points]
    appearance = _appearance(line.label, line)
    lows = [max(point.rms_10, FLOOR) for point in points]
    highs = [point.rms_90 if math.isfinite(point.rms_90) else 3.0 for point in points]
    ax.vlines(cpu, lows, highs, color=appearance["color"], linewidth=0.6, alpha=0.6)
    return ax.plot(cpu, [point.rms for point in points], **appearance)[0]


def ratio_figure(found: WorkPrecision) -> Figure:
    """Run time at an error of `LEVEL` over the EBM's: a row a line, a dot a family of scenes."""
    from matplotlib.figure import Figure

    with figure_style():
        figure = Figure(figsize=(PAGE, 0.24 * len(LINES) + 0.9), layout="constrained")
        ax = figure.subplots()
        families = list(found.horizons)
        for row, (label, line) in enumerate(LINES.items()):
            trends = [trend for trend in found.trends if trend.line == label]
            reached = [trend for trend in trends if math.isfinite(trend.ratio)]
            look = _appearance(label, line) | {"linestyle": "none"}
            heights = [row + 0.5 * (families.index(trend.family) / max(len(families) - 1, 1) - 0.5) for trend in reached]
            ax.plot([trend.ratio for trend in reached], heights, **look)
            if len(reached) < len(trends):
                text = f"{len(trends) - len(reached)} of {len(trends)} scenes: not reached"
                ax.annotate(text, (1.0, row), xycoords=("axes fraction", "data"), ha="right", va="center", fontsize=6.5, color="#555555")
        ax.axvline(1.0, color="#1b1b1b", linewidth=0.6)
        ax.set(xscale="log", xlabel=f"CPU time at an error of {LEVEL:g} α over the EBM's", ylim=(len(LINES) - 0.4, -0.6))
        low, high = ax.get_xlim()
        ax.set_xlim(low, high * 12.0)  # room for the words
        log_scales(ax)
        ax.set_yticks(range(len(LINES)), [_label(label) for label in LINES])
        ax.grid(visible=False, axis="y")
    return figure


def batch_figure(speed: EbmSpeed) -> Figure:
    """Microseconds a trajectory over the 95th percentile of the peak's error, a line a batch."""
    from matplotlib.figure import Figure

    with figure_style():
        figure = Figure(figsize=(PAGE, 2.6), layout="constrained")
        ax = figure.subplots()
        for case, marker, colour in zip(CASES, "osD^v", _colours(), strict=True):
            rows = [row for row in speed.times if row.case == case.name and row.error_95 > 0.0]
            errors, costs = [row.error_95 for row in rows], [1e6 * row.cpu for row in rows]
            ax.plot(errors, costs, marker=marker, color=colour, label=f"{case.name}: {case.words}")
        ax.axvline(BATCH_LEVEL, color="#6e6e6e", linewidth=0.8, linestyle=(0, (6, 3)))
        ax.set(xscale="log", yscale="log", xlabel="p95 error of the peak, rad (rotation)", ylabel="CPU μs a trajectory, one core")
        log_scales(ax)
        ax.set_ylim(3.0, 3000.0)
        ax.invert_xaxis()
        figure.legend(loc="outside right center")
    return figure


def _colours() -> Iterable[str]:
    return (LOOKS[model].light for model in ("ebm", "cm", "mujoco", "ebm-unilateral", "pybullet"))
