"""Fragility curves: the probability of an event against the intensity of the base motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.validation.discrepancy.statistics import CONFIDENCE
from rockcheck.validation.finding import Axis, Block, Column, Panel, Plot, Series, Table, text
from rockcheck.validation.uncertainty.population import wilson

Floats = NDArray[np.float64]
#: Shares of the motions whose peaks stay below the quantiles' curves.
BAND = (0.16, 0.5, 0.84)
#: The end of the axis of peaks (alpha).
FALLEN = 1.25
#: Sets of motions drawn anew for the interval of a fitted median.
DRAWS = 200


@dataclass(frozen=True)
class Curve:
    """One curve. A point is intensity, share, lower and upper end of its band, fitted probability.

    The fit is a lognormal curve: at the intensity `median`, known to lie between `low` and `high`,
    its probability is one half; `dispersion` is the standard deviation of its logarithm. They are
    None, and the probabilities NaN, where nothing fits. `motions` were each played in both
    directions; `undecided` runs failed: shares, bands and the fit are those of the others (NaN at an
    intensity where all failed).
    """

    label: str
    motions: int
    undecided: int
    median: float | None
    dispersion: float | None
    low: float | None
    high: float | None
    points: tuple[tuple[float, ...], ...]


def curve_of(
    label: str,
    hit: NDArray[np.bool_],
    failed: NDArray[np.bool_],
    intensities: Floats,
    draws: int = 0,
) -> Curve:
    """The curve of runs (motion, direction, intensity): in which it happened, which failed.

    With `draws` of the motions the fitted median has an interval.
    """
    from scipy.special import ndtr

    hits, decided = (hit & ~failed).sum(axis=1), (~failed).sum(axis=1)  # (motion, intensity)
    median, dispersion = fit = fit_lognormal(intensities, hits.sum(axis=0), decided.sum(axis=0))
    fitted = np.full(len(intensities), np.nan)
    between: tuple[float | None, float | None] = (None, None)
    if median is not None and dispersion is not None:
        fitted = ndtr(np.log(intensities / median) / dispersion)
        between = _interval(intensities, hits, decided, draws)
    points = np.column_stack([intensities, *_band(hits, decided), fitted]).tolist()
    return Curve(label, len(hit), int(failed.sum()), *fit, *between, tuple(map(tuple, points)))


def _band(hits: NDArray[np.int64], decided: NDArray[np.int64]) -> tuple[Floats, Floats, Floats]:
    """Share and the ends of its interval at each intensity, from counts of runs (motion,
    intensity).

    The directions of a motion tell of the same motion, so the number in Wilson's interval is the
    effective one: share (1 - share) over the variance of the share between motions, at least that
    of the motions and at most that of the runs (Korn and Graubard 1998). NaN where no run was
    decided.
    """
    runs, motions = decided.sum(axis=0), (decided > 0).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = hits.sum(axis=0) / runs
        squares = ((hits - share * decided) ** 2).sum(axis=0)
        variance = motions / (motions - 1) * squares / runs**2
        effective = np.clip(share * (1.0 - share) / variance, motions, runs)
        return share, *wilson(share, np.where(variance > 0.0, effective, motions))


def _interval(
    intensities: Floats, hits: NDArray[np.int64], decided: NDArray[np.int64], draws: int
) -> tuple[float | None, float | None]:
    """The interval of the fitted median: of sets of motions drawn anew, where most have a fit."""
    sets = np.random.default_rng(2).integers(len(hits), size=(draws, len(hits)))
    fits = [
        fit_lognormal(intensities, hits[rows].sum(axis=0), decided[rows].sum(axis=0))[0]
        for rows in sets
    ]
    medians = [median for median in fits if median is not None]
    if not medians or len(medians) < 0.9 * draws:
        return None, None
    low, high = np.quantile(medians, [0.5 - CONFIDENCE / 2, 0.5 + CONFIDENCE / 2])
    return float(low), float(high)


def fit_lognormal(
    intensities: Floats, hits: NDArray[np.int64], runs: NDArray[np.int64]
) -> tuple[float | None, float | None]:
    """Median and dispersion of the lognormal curve of the greatest likelihood (Baker 2015).

    `hits` counts the runs, of those that were decided, in which it happened at each intensity. None
    where that is all or none, or where the curve does not rise with the intensity.
    """
    from scipy.optimize import minimize
    from scipy.special import log_ndtr

    if not 0 < hits.sum() < runs.sum():
        return None, None
    logarithm = np.log(intensities)
    centre = float(np.mean(logarithm))

    def unlikelihood(line: Floats) -> float:
        # convex, as a straight line in ln x; not so in median and dispersion
        linear = line[0] + line[1] * (logarithm - centre)
        return -float(np.sum(hits * log_ndtr(linear) + (runs - hits) * log_ndtr(-linear)))

    how = {"xatol": 1e-9, "fatol": 1e-9, "maxiter": 2000}
    level, slope = minimize(unlikelihood, [0.0, 1.0], method="Nelder-Mead", options=how).x
    if slope <= 0.0:
        return None, None
    return float(np.exp(centre - level / slope)), float(1.0 / slope)


def blocks_of(
    curves: Sequence[Curve], across: Column, other: dict[str, Any] | None = None
) -> list[Block]:
    """The curves, drawn and as tables, over the intensity `across`; `other`: its axis in another
    unit, see `finding.Plot`."""
    columns = [
        text("case", "event"),
        Column("median", f"median {across.label}", across.unit),
        Column("low", "95 % from"),
        Column("high", "to"),
        Column("dispersion", digits=2, help=f"standard deviation of ln({across.label})"),
        Column("motions", brief=False),
        Column("undecided", "undecided runs", brief=False),
    ]
    rows = [
        [getattr(one, "label" if c.name == "case" else c.name) for c in columns] for one in curves
    ]
    if other:
        columns.append(Column(f"median_{other['other_unit']}", "median", other["other_unit"]))
        rows = [[*row, row[1] and row[1] * other["per_unit"]] for row in rows]
    series = []
    for one in curves:
        level, share, low, high, fit = zip(*one.points, strict=True)
        series.append(Series(one.label, level, share, low, high, style="smooth"))
        series += [Series(one.label, level, fit, style="dots")] if one.median else []
    names = ("intensity", "share", "band_low", "band_high", "lognormal_fit")
    return [
        Plot(
            "fragility",
            "Fragility",
            panels=[Panel("", series)],
            x=Axis(across.head),
            y=Axis("probability", limits=(0.0, 1.0)),
            note="Share of the runs, its 95 % band (Wilson's, with the motions as independent), and"
            " the lognormal curve of the greatest likelihood, dotted.",
            live=True,
            data=other,
        ),
        Table(
            "fits",
            columns,
            rows,
            note="Lognormal fits; the interval of the median is from drawing the motions anew.",
        ),
        Table(
            "fragility",
            [text("case"), *map(Column, names)],
            [[one.label, *point] for one in curves for point in one.points],
            on="file",
        ),
    ]


def lines_of(motions: Sequence[str], peaks: Floats, levels: Floats, across: Column) -> list[Block]:
    """Peaks (motion, direction, intensity) as a line a motion, and their quantiles: the smallest
    peak that the share of the motions does not exceed. A line ends where the block falls."""
    x, signs = levels.tolist(), (1, -1)
    known = np.where(np.isfinite(peaks), peaks, None).tolist()
    every = np.nanquantile(peaks.reshape(-1, len(x)), BAND, axis=0, method="inverted_cdf")
    quantiles = np.where(np.isfinite(every), every, None)
    names = ("direction", "intensity", "peak_rotation_alpha", "overturned")
    lines = [
        (name, sign, line)
        for name, both in zip(motions, known, strict=True)
        for sign, line in zip(signs, both, strict=True)
    ]
    series = [
        *(
            Series(name if sign > 0 else f"{name}, reversed", x, line, style="thin")
            for name, sign, line in lines
        ),
        *(
            Series(f"{100.0 * share:g} %", x, line, style="smooth")
            for share, line in zip(BAND, quantiles.tolist(), strict=True)
        ),
    ]
    fell = iter(np.isinf(peaks).ravel().tolist())
    return [
        Plot(
            "lines",
            f"Peak rotation against {across.label}",
            panels=[Panel("", series)],
            x=Axis(across.head),
            y=Axis("peak |θ|/α", limits=(0.0, FALLEN)),
            note="A grey line a motion; it ends where the block falls. Coloured: the peak that 16,"
            " 50 and 84 % of the motions stay below.",
            live=True,
        ),
        Table(
            "lines",
            [text("motion"), *map(Column, names)],
            [
                [name, sign, level, peak, int(next(fell))]
                for name, sign, line in lines
                for level, peak in zip(x, line, strict=True)
            ],
            on="file",
        ),
        Table(
            "quantiles",
            [Column("intensity"), *(Column(f"p{100.0 * share:g}") for share in BAND)],
            [[level, *row] for level, row in zip(x, quantiles.T.tolist(), strict=True)],
            on="file",
        ),
    ]
