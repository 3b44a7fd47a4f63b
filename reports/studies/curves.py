"""Curves over an intensity that a page names under the pointer: fragility, and the lines of an incremental dynamic analysis."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rockcheck.scenes.writing import write_whole
from rockcheck.validation.spectra.fragility import FragilityCurve

#: By day and by night, in the order of the curves; grey for what only makes the background.
COLOURS = (("#0072b2", "#3d9fdc"), ("#d55e00", "#e8762a"), ("#009168", "#00b583"), ("#a87900", "#d19a10"), ("#bf5f92", "#d98ab4"))
#: The axis of peak ground acceleration.
PGA = "peak acceleration, g"
GREY = ("#9a9a9a", "#767c85")


@dataclass(frozen=True)
class Curve:
    """One curve: values over the chart's axis (None where there is none), a band, a fit, all in the chart's unit."""

    label: str
    values: tuple[float | None, ...]
    colour: tuple[str, str]
    low: tuple[float | None, ...] = ()
    high: tuple[float | None, ...] = ()
    fit: tuple[float | None, ...] = ()
    width: float = 2.0


@dataclass(frozen=True)
class Chart:
    """Curves over one axis of intensity; `most` ends the vertical scale. Of `single` ones the curve next to the pointer is named.

    With `per_unit` the axis is drawn a second time, in `other_unit`, of which one unit of the axis has so many.
    """

    name: str
    across: str
    along: str
    intensities: tuple[float, ...]
    curves: tuple[Curve, ...]
    most: float = 1.0
    single: bool = False
    per_unit: float = 0.0
    other_unit: str = ""
    other_label: str = ""


def fragility_chart(name: str, across: str, curves: Sequence[FragilityCurve], pga_g: float | None = None) -> Chart:
    """The curves of the probability with their bands and lognormal fits; `pga_g` is the peak acceleration (g) of an intensity of 1."""
    shown = []
    for curve, colour in zip(curves, COLOURS, strict=False):
        _, share, low, high, fit = (tuple(map(_known, column)) for column in zip(*curve.points, strict=True))
        shown.append(Curve(curve.label, share, colour, low, high, fit))
    return Chart(
        name,
        across,
        "probability",
        tuple(point[0] for point in curves[0].points),
        tuple(shown),
        per_unit=pga_g or 0.0,
        other_unit="g",
        other_label=PGA,
    )


def _known(value: float) -> float | None:
    return float(f"{value:.5g}") if math.isfinite(value) else None


def write_charts(charts: Iterable[Chart], path: Path) -> None:
    """Write charts as a script that the page reads."""
    text = json.dumps([asdict(chart) for chart in charts], allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    write_whole(path, f"window.rockcheckCurves = {text};\n")
