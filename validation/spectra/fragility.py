"""Fragility: the probability that a block overturns, against the intensity of the base motion, with and without its wall."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.spectrum import SAFE, Floats
from rockcheck.scenes import InputError, Record, Scene
from rockcheck.scenes.recordings import Recording
from rockcheck.scenes.recordings.recording import GRAVITY_OF_RECORDS
from rockcheck.scenes.writing import table_text
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.spectra.study import Panel, SpectrumRequest
from rockcheck.validation.spectra.tiles import Tiles

#: Frequencies of the set of pulses.
PULSES = 50
CONFIDENCE = 0.95
FEWEST = 2


class FragilityCurve(Stored):
    """One curve. A point is intensity, share overturned, lower and upper end of its confidence band, fitted probability.

    The fit is a lognormal curve: `median` is the intensity at which its probability is one half, `dispersion` the standard
    deviation of its logarithm; both None (and the probabilities NaN) where all or none overturn. `motions` are the records or
    pulses, each in both directions; `undecided` runs failed, and count neither as overturned nor as safe: shares, bands and the
    fit are those of the others (NaN at an intensity where all failed).
    """

    label: str
    motions: int
    undecided: int
    median: float | None
    dispersion: float | None
    points: tuple[tuple[float, float, float, float, float], ...]


class Fragility(Stored):
    """`fragility.json`; `pga_g` is the peak acceleration (g) of a motion of intensity 1, None in files of older versions."""

    format: int = 1
    title: str
    about: str
    intensity: str
    pga_g: float | None = None
    cases: tuple[FragilityCurve, ...]


def fragility(panel: Panel, request: SpectrumRequest, records: Sequence[tuple[str, Recording]], tiles: Tiles) -> Fragility:
    """The curves of a scene for a set of named records, or, without any, for pulses of the scene's kind over the frequencies asked.

    Each motion is played in both directions at every intensity: its peak acceleration over g tan(alpha), the amplitudes
    asked. Raises `InputError` for a set of fewer than `FEWEST`.
    """
    scene = panel.scene
    walls = [("with the wall", scene)] if scene.walls else []
    cases = []
    if 0 < len(records) < FEWEST:
        raise InputError(f"{len(records)} is too few: give at least {FEWEST} records", "--record")
    for label, case in [*walls, ("without a wall", scene.replace(walls=()))]:
        sides, failed = _play_records(case, request, records, tiles) if records else _play_pulses(case, request, tiles)
        cases.append(curve_of(label, sides != SAFE, failed, request.amplitudes))
    motions = f"{len(records)} records" if records else f"{PULSES} pulses"
    about = (
        f"{motions}, each in both directions. Lines: share of the runs that overturn the block; bands: its {CONFIDENCE:.0%} interval"
        f" (Wilson), with the {'records' if records else 'pulses'} as independent; dots: the lognormal curve of the greatest likelihood."
    )
    if undecided := sum(case.undecided for case in cases):
        about += f" {undecided} runs failed: they count neither as overturned nor as safe."
    return Fragility(
        title=f"{panel.title}, {motions}",
        about=about,
        intensity="peak acceleration / (g tan α)",
        pga_g=scene.gravity * scene.block.slope / GRAVITY_OF_RECORDS,
        cases=tuple(cases),
    )


Runs = tuple[NDArray[np.int8], NDArray[np.bool_]]


def _play_pulses(scene: Scene, request: SpectrumRequest, tiles: Tiles) -> Runs:
    """Sides and failures (pulse, direction, intensity)."""
    if scene.excitation.kind not in ("ricker", "sine"):
        raise InputError("is needed: the scene's excitation is no pulse", "--record")
    frequencies = np.geomspace(request.frequencies[0], request.frequencies[-1], PULSES)
    f, sign, a = np.meshgrid(frequencies, [1.0, -1.0], request.amplitudes, indexing="ij")
    sides, failed = tiles.play(scene, (sign * a).ravel(), f.ravel(), model=request.model, settings=request.settings)
    return sides.reshape(a.shape), failed.reshape(a.shape)


def _play_records(scene: Scene, request: SpectrumRequest, records: Sequence[tuple[str, Recording]], tiles: Tiles) -> Runs:
    """Sides and failures (record, direction, intensity)."""
    found = []
    for name, recording in records:
        record = Record.from_samples(recording.samples, recording.time_step)
        peak = float(np.max(np.abs(record.samples)))
        if peak == 0.0:
            raise InputError(f"{name}: a record without motion has no intensity", "--record")
        scales = request.amplitudes * scene.gravity * scene.block.slope / peak
        both = np.concatenate([scales, -scales])
        played = tiles.play(scene.replace(excitation=record), both, np.ones(len(both)), model=request.model, settings=request.settings)
        found.append([runs.reshape(2, len(scales)) for runs in played])
    sides, failed = zip(*found, strict=True)
    return np.array(sides), np.array(failed)


def curve_of(label: str, overturned: NDArray[np.bool_], failed: NDArray[np.bool_], intensities: Floats) -> FragilityCurve:
    """The curve of one case from its runs (motion, direction, intensity): which overturned, and which failed."""
    motions = len(overturned)
    fallen, decided = (overturned & ~failed).sum(axis=1), (~failed).sum(axis=1)  # (motion, intensity)
    share, low, high = _band(fallen, decided)
    fit = fit_lognormal(intensities, fallen.sum(axis=0), decided.sum(axis=0))
    fitted = lognormal(intensities, *fit) if fit else np.full(len(intensities), np.nan)
    columns = (intensities, share, low, high, fitted)
    points = tuple((float(x), float(y), float(lo), float(hi), float(p)) for x, y, lo, hi, p in zip(*columns, strict=True))
    median, dispersion = fit or (None, None)
    undecided = int(failed.sum())
    return FragilityCurve(label=label, motions=motions, undecided=undecided, median=median, dispersion=dispersion, points=points)


def _band(fallen: NDArray[np.int64], decided: NDArray[np.int64]) -> tuple[Floats, Floats, Floats]:
    """Share that overturns and the ends of its interval at each intensity, from counts of runs (motion, intensity).

    Wilson's interval, which holds near 0 and 1, too, where motions drawn anew all say the same. The directions of a motion
    tell of the same motion, so the number in it is the effective one: share (1 - share) over the variance of the share
    between motions, at least that of the motions and at most that of the runs (Korn and Graubard 1998). NaN where no run
    was decided.
    """
    from scipy.special import ndtri

    runs, motions = decided.sum(axis=0), (decided > 0).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = fallen.sum(axis=0) / runs
        variance = motions / (motions - 1) * ((fallen - share * decided) ** 2).sum(axis=0) / runs**2
        count = np.where(variance > 0.0, np.clip(share * (1.0 - share) / variance, motions, runs), motions)
        z2 = float(ndtri(0.5 + 0.5 * CONFIDENCE)) ** 2 / count
        middle = (share + 0.5 * z2) / (1.0 + z2)
        half = np.sqrt(z2 * share * (1.0 - share) + 0.25 * z2 * z2) / (1.0 + z2)
    return share, middle - half, middle + half


def lognormal(intensities: Floats, median: float, dispersion: float) -> Floats:
    """Probability of overturning Phi(ln(x/median)/dispersion)."""
    from scipy.special import ndtr

    p: Floats = ndtr(np.log(intensities / median) / dispersion)
    return p


def fit_lognormal(intensities: Floats, overturned: NDArray[np.int64], runs: NDArray[np.int64]) -> tuple[float, float] | None:
    """Median and dispersion of the lognormal curve of the greatest likelihood (Baker 2015).

    None where all or none overturn, or where it does not rise with the intensity.

    `overturned` counts the runs, of those that were decided, that overturn the block at each intensity.
    """
    from scipy.optimize import minimize
    from scipy.special import log_ndtr

    if not 0 < overturned.sum() < runs.sum():
        return None
    logarithm = np.log(intensities)
    centre = float(np.mean(logarithm))

    def unlikelihood(line: Floats) -> float:  # convex, as a straight line in ln x; not so in median and dispersion
        linear = line[0] + line[1] * (logarithm - centre)
        return -float(np.sum(overturned * log_ndtr(linear) + (runs - overturned) * log_ndtr(-linear)))

    level, slope = minimize(unlikelihood, [0.0, 1.0], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-9, "maxiter": 2000}).x
    if slope <= 0.0:
        return None
    return float(np.exp(centre - level / slope)), float(1.0 / slope)


def curves_table(found: Fragility) -> str:
    """The curves as CSV."""
    columns = ("case", "intensity", "share_overturned", "band_low", "band_high", "lognormal_fit")
    return table_text(columns, ((case.label, *point) for case in found.cases for point in case.points))
