"""What the scripts of a page need: charts read under the pointer, and spectra whose nodes play.

In: a plot of a finding. Out: JSON, and files beside the page. Called by `document`.
"""

import json
import math
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from rockcheck.reports.line_plots import colours
from rockcheck.reports.spectrum_plots import axis_labels, outcome_key
from rockcheck.scenes import Floats, writing
from rockcheck.validation.finding import Plot, Series

#: Room above the largest value of an axis without limits, a share of it.
MARGIN = 0.05


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
        "most": plot.y.limits[1] if plot.y.limits else _top_of(panel.series),
        "single": any(series.style == "thin" for series in panel.series),
        **(plot.data or {"per_unit": 0.0, "other_unit": "", "other_label": ""}),
    }


def _top_of(series: Sequence[Series]) -> float | None:
    """The end of an axis without limits: a margin above the largest value, None without any."""
    values = [value for curve in series for value in curve.y if value is not None]
    largest = max((value for value in values if math.isfinite(value)), default=0.0)
    return (1.0 + MARGIN) * largest if largest > 0.0 else None


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
