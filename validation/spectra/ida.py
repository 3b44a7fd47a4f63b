"""Incremental dynamic analysis: peak rotation against the intensity of recorded motions (Vamvatsikos and Cornell 2002).

Each record is scaled to every intensity and played in both directions. An intensity measure is in proportion to the scale, so the
factor is the wanted value over that of the record as it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.batch import pack, run_batch
from rockcheck.scenes import InputError, Record, Scene
from rockcheck.scenes.errors import unknown_name
from rockcheck.scenes.progress import OnProgress, unheard
from rockcheck.scenes.recordings import Recording, intensity
from rockcheck.scenes.writing import table_text
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.spectra.fragility import CONFIDENCE, FEWEST, Floats, FragilityCurve, curve_of, fit_lognormal

#: Shares of the motions whose peaks stay below the curves that are drawn.
BAND = (0.16, 0.5, 0.84)
#: Peaks that a fragility curve is given for (alpha); a block that overturns exceeds all.
CAPACITIES = (0.1, 0.5, 1.0)
#: Sets of motions drawn anew for the interval of a fitted median.
_FITS = 200


@dataclass(frozen=True)
class Measure:
    """A measure of intensity, by the name that the command knows: its label, its unit, and its value for a record and a scene."""

    label: str
    unit: str
    of: Callable[[Recording, Scene, float], float]


def _per_slope(scene: Scene) -> float:
    """1/(g tan alpha), s^2/m."""
    pivot = scene.block.weaker_pivot
    return pivot.height / (scene.gravity * pivot.arm)


MEASURES: Mapping[str, Measure] = {
    "pga": Measure("PGA", "g", lambda record, scene, period: intensity.peak_acceleration(record)),
    "pgv": Measure("PGV", "m/s", lambda record, scene, period: intensity.peak_velocity(record)),
    "sa": Measure("Sa(T1), 5 %", "g", lambda record, scene, period: intensity.spectral_acceleration(record, period)),
    "pga-ratio": Measure("PGA/(g tan α)", "1", lambda record, scene, period: float(np.max(np.abs(record.samples))) * _per_slope(scene)),
    "pgv-ratio": Measure(
        "p PGV/(g tan α)",
        "1",
        lambda record, scene, period: intensity.peak_velocity(record) * scene.frequency_parameter * _per_slope(scene),
    ),
}


class Line(Stored):
    """One motion: its record, +1 as recorded or -1 reversed, its own intensity, and peak |theta| (alpha; None where it overturns)."""

    record: str
    direction: int
    own: float
    peaks: tuple[float | None, ...]


class Capacity(Stored):
    """The probability that the peak exceeds `limit` (alpha), with the 95 % interval of the fitted median (None where none fits)."""

    limit: float
    curve: FragilityCurve
    low: float | None = None
    high: float | None = None


class Ida(Stored):
    """`ida.json`: the lines of all motions over `intensities`, their quantiles (by share, None where overturned), and fragilities."""

    format: int = 1
    scene: str
    model: str
    measure: str
    label: str
    unit: str
    period: float | None = None
    intensities: tuple[float, ...]
    lines: tuple[Line, ...]
    quantiles: Mapping[str, tuple[float | None, ...]]
    capacities: tuple[Capacity, ...]


def analyse(
    scene: Scene,
    motions: Sequence[tuple[str, Recording]],
    intensities: Floats,
    *,
    measure: str = "pga",
    period: float | None = None,
    capacities: Sequence[float] = CAPACITIES,
    model: EventBasedModel | None = None,
    jobs: int | None = None,
    on_progress: OnProgress = unheard,
) -> Ida:
    """Peak rotation of the scene's block under each motion, scaled to each of the `intensities` (of `MEASURES[measure]`).

    `period` (s) is that of "sa". The model is the unilateral event-based one unless another is given; each run goes on until its
    peak is certain. Raises `InputError` for an unknown measure, fewer than two motions, or one without motion.
    """
    if measure not in MEASURES:
        raise InputError(str(unknown_name("intensity", measure, list(MEASURES))), "--intensity")
    if (measure == "sa") != (period is not None):
        raise InputError("is needed with --intensity sa, and with no other", "--period")
    if len(motions) < FEWEST:
        raise InputError(f"{len(motions)} is too few: give at least {FEWEST} records")
    model = model or EventBasedModel(pivot="unilateral", tolerance=1e-8)
    peaks = np.empty((len(motions), 2, len(intensities)))
    own = np.empty(len(motions))
    for i, (name, recording) in enumerate(motions):
        own[i] = MEASURES[measure].of(recording, scene, period or 0.0)
        if own[i] <= 0.0:
            raise InputError(f"{name}: a record without motion has no intensity")
        record = Record.from_samples(recording.samples, recording.time_step)
        scales = np.concatenate([intensities, -intensities]) / own[i]
        packed = pack([scene.replace(excitation=record.scaled(float(scale))) for scale in scales], model)
        found = run_batch(packed, model, jobs=jobs)
        peaks[i] = np.where(found.side != 0, np.inf, found.peak / scene.block.alpha).reshape(2, len(intensities))
        on_progress(i + 1, len(motions), name)
    return Ida(
        scene=scene.name,
        model=model.name,
        measure=measure,
        label=MEASURES[measure].label.replace("T1", f"{period:g} s" if period else "T1"),
        unit=MEASURES[measure].unit,
        period=period,
        intensities=tuple(map(float, intensities)),
        lines=tuple(
            Line(record=name, direction=1 - 2 * k, own=own[i], peaks=_known(peaks[i, k]))
            for i, (name, _) in enumerate(motions)
            for k in (0, 1)
        ),
        quantiles={f"{share:g}": _known(_quantile(peaks.reshape(-1, len(intensities)), share)) for share in BAND},
        capacities=tuple(_capacity(limit, peaks > limit, intensities) for limit in capacities),
    )


def _quantile(peaks: Floats, share: float) -> Floats:
    """The smallest peak that the share of the motions does not exceed; infinite where that overturns."""
    return np.quantile(peaks, share, axis=0, method="inverted_cdf")


def _known(peaks: Floats) -> tuple[float | None, ...]:
    return tuple(float(peak) if math.isfinite(peak) else None for peak in peaks)


def _capacity(limit: float, exceeded: NDArray[np.bool_], intensities: Floats) -> Capacity:
    curve = curve_of(
        f"peak above {limit:g} α" if limit != 1.0 else "peak above α, or overturned", exceeded, np.zeros_like(exceeded), intensities
    )
    drawn = np.random.default_rng(2).integers(len(exceeded), size=(_FITS, len(exceeded)))
    runs = np.full(len(intensities), exceeded.shape[0] * exceeded.shape[1])
    fits = [fit_lognormal(intensities, exceeded[rows].sum(axis=(0, 1)), runs) for rows in drawn] if curve.median else []
    medians = [fit[0] for fit in fits if fit]
    if len(medians) < 0.9 * _FITS:
        return Capacity(limit=limit, curve=curve)
    low, high = np.quantile(medians, [0.5 - CONFIDENCE / 2, 0.5 + CONFIDENCE / 2])
    return Capacity(limit=limit, curve=curve, low=float(low), high=float(high))


def lines_table(found: Ida) -> str:
    """All runs as CSV: record, direction, intensity, peak (alpha; empty where it overturns)."""
    columns = ("record", "direction", f"intensity_{found.measure}", "peak_rotation_alpha", "overturned")
    rows: list[tuple[Any, ...]] = [
        (line.record, line.direction, level, "" if peak is None else peak, int(peak is None))
        for line in found.lines
        for level, peak in zip(found.intensities, line.peaks, strict=True)
    ]
    return table_text(columns, rows)
