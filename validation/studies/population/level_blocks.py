"""The answer over given intensities (`--levels`), as a sentence, tables and plots.

In: levels whose tasks have ended, and their curves. Out: a sentence and blocks. The study calls
it.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rockcheck.scenes import Floats
from rockcheck.validation.finding import (
    Axis,
    Block,
    Column,
    Panel,
    Plot,
    Series,
    Style,
    Table,
    text,
)
from rockcheck.validation.studies.population.levels import Levels
from rockcheck.validation.uncertainty import fragility

#: Shares of the motions whose peaks stay below the quantiles' curves.
BAND: dict[float, Style] = {0.16: "dotted", 0.5: "smooth", 0.84: "dashed"}
#: The end of the axis of peaks (alpha).
FALLEN = 1.25


def sentence_of(levels: Levels, curves: Sequence[fragility.Curve]) -> str:
    """The medians of the curves."""
    medians = [
        f"{curve.label} {curve.median:.3g} {levels.across.unit}".rstrip()
        for curve in curves
        if curve.median > 0.0
    ]
    motions = len({motion for _, motion in levels.cases})
    return (
        f"{motions} motions in both directions, {len(levels.levels)} intensities."
        f" Median {levels.across.label}: {', '.join(medians) or 'no curve fits'}."
    )


def blocks_of(
    levels: Levels, curves: Sequence[fragility.Curve], done: Mapping[Any, Any]
) -> list[Block]:
    """The curves, the lines of all motions, and the motions as they are."""
    blocks: list[Block] = []
    if levels.lines and (peaks := levels.peaks(done)):
        names = [task.about[1] for task in levels.played(done)]
        blocks += line_blocks(names, np.concatenate([*peaks.values()]), levels)
    if curves:
        blocks += [curve_plot(curves, levels), fit_table(curves, levels), curve_table(curves)]
    motions = {motion: size for (_, motion), (_, size) in levels.cases.items()}
    own = Column("own", f"{levels.across.label} as it is", levels.across.unit)
    rows = [[motion, size] for motion, size in motions.items()]
    blocks.append(Table("motions", [text("motion"), own], rows, "Motions", on="page", folded=True))
    return blocks


def curve_plot(curves: Sequence[fragility.Curve], levels: Levels) -> Plot:
    """The curves with their bands, and their fits."""
    series = []
    for curve in curves:
        level, share, low, high, fit = zip(*curve.points, strict=True)
        series.append(Series(curve.label, level, share, low, high, style="smooth"))
        series.append(Series(curve.label, level, fit, style="dots"))
    in_g = {"other_unit": "g", "other_label": "peak acceleration, g", "per_unit": levels.per_g}
    return Plot(
        "fragility",
        "Fragility",
        panels=[Panel("", series)],
        x=Axis(levels.across.head),
        y=Axis("probability", limits=(0.0, 1.0)),
        note="Share of the runs, its 95 % band (the motions count, not the runs), and the lognormal"
        " curve of the greatest likelihood, dotted.",
        live=True,
        data=in_g if levels.per_g else None,
    )


def fit_table(curves: Sequence[fragility.Curve], levels: Levels) -> Table:
    """The lognormal fits."""
    columns = [
        text("case", "event"),
        Column("median", f"median {levels.across.label}", levels.across.unit),
        Column("low", "95 % from"),
        Column("high", "to"),
        Column("dispersion", digits=2, help=f"standard deviation of ln({levels.across.label})"),
        Column("motions", brief=False),
        Column("undecided", "undecided runs", brief=False),
    ]
    rows: list[list[Any]] = [
        [
            curve.label,
            curve.median,
            curve.low,
            curve.high,
            curve.dispersion,
            curve.motions,
            curve.undecided,
        ]
        for curve in curves
    ]
    if levels.per_g:
        columns.append(Column("median_g", "median", "g"))
        rows = [[*row, levels.per_g * row[1]] for row in rows]
    note = "Lognormal fits; the interval of the median is from drawing the motions anew."
    return Table("fits", columns, rows, note=note)


def curve_table(curves: Sequence[fragility.Curve]) -> Table:
    """The points of the curves."""
    names = ("intensity", "share", "band_low", "band_high", "lognormal_fit")
    rows = [[curve.label, *point] for curve in curves for point in curve.points]
    return Table("fragility", [text("case"), *map(Column, names)], rows, on="file")


def line_blocks(motions: Sequence[str], peaks: Floats, levels: Levels) -> list[Block]:
    """Peaks (motion, direction, level) as a line a motion and direction, and their quantiles.

    A quantile is the smallest peak that the share of the motions does not exceed. A line ends where
    the block falls.
    """
    x = levels.levels.tolist()
    flat = peaks.reshape(-1, len(x))
    quantiles = np.nanquantile(flat, list(BAND), axis=0, method="inverted_cdf")
    lines = [
        (name, sign, line)
        for name, both in zip(motions, peaks.tolist(), strict=True)
        for sign, line in zip((1, -1), both, strict=True)
    ]
    drawn = [
        Series(name if sign > 0 else f"{name}, reversed", x, line, style="thin")
        for name, sign, line in lines
    ]
    bands = [
        Series(f"{100.0 * share:g} %", x, line, style=style)
        for (share, style), line in zip(BAND.items(), quantiles.tolist(), strict=True)
    ]
    ida = [
        [name, sign, level, math.nan if peak == math.inf else peak, int(peak == math.inf)]
        for name, sign, line in lines
        for level, peak in zip(x, line, strict=True)
    ]
    of_levels = [
        [level, *(math.nan if value == math.inf else value for value in row)]
        for level, row in zip(x, quantiles.T.tolist(), strict=True)
    ]
    ida_columns = map(Column, ("direction", "intensity", "peak_rotation_alpha", "overturned"))
    shares = [Column(f"p{100.0 * share:g}") for share in BAND]
    return [
        Plot(
            "lines",
            f"Peak rotation against {levels.across.label}",
            panels=[Panel("", [*drawn, *bands])],
            x=Axis(levels.across.head),
            y=Axis("peak |θ|/α", limits=(0.0, FALLEN)),
            note="A grey line a motion; it ends where the block falls. Coloured: the peak that 16,"
            " 50 and 84 % of the motions stay below.",
            live=True,
        ),
        Table("ida", [text("record"), *ida_columns], ida, on="file"),
        Table("quantiles", [Column("intensity"), *shares], of_levels, on="file"),
    ]
