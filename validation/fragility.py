"""Fragility: the probability that a block overturns, against the intensity of the base motion, with and without its wall."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ebm.spectrum import SAFE, Floats
from scenes import InputError, Record, Scene
from validation.results import Stored
from validation.spectra import Asked, Panel, Tiles

#: Frequencies of the set of pulses, each played in both directions.
PULSES = 50
BOOTSTRAPS, CONFIDENCE = 2000, 0.95
FEWEST_MOTIONS = 4


class Case(Stored):
    """One curve. A point is intensity, share overturned, lower and upper end of its confidence band, fitted probability.

    The fit is a lognormal curve: `median` is the intensity at which its probability is one half, `dispersion` the standard
    deviation of its logarithm; both None (and the probabilities NaN) where all or none overturn.
    """

    label: str
    motions: int
    median: float | None
    dispersion: float | None
    points: tuple[tuple[float, float, float, float, float], ...]


class Fragility(Stored):
    """`fragility.json`."""

    format: int = 1
    title: str
    about: str
    intensity: str
    cases: tuple[Case, ...]


def fragility(panel: Panel, asked: Asked, records: Sequence[Path], tiles: Tiles) -> Fragility:
    """The curves of a scene for a set of records, or, without any, for pulses of the scene's kind over the frequencies asked.

    Each motion is played in both directions at every intensity: its peak acceleration over g tan(alpha), the amplitudes
    asked. Raises `InputError` for a set of fewer than `FEWEST_MOTIONS`.
    """
    scene = panel.scene
    walls = [("with the wall", scene)] if scene.walls else []
    cases = []
    for label, case in [*walls, ("without a wall", scene.replace(walls=()))]:
        overturned = _play_records(case, asked, records, tiles) if records else _play_pulses(case, asked, tiles)
        if len(overturned) < FEWEST_MOTIONS:
            raise InputError(f"{len(overturned) // 2} motion(s) are too few: give at least {FEWEST_MOTIONS // 2} records", "--record")
        cases.append(_case(label, overturned, asked.amplitudes))
    motions = f"{len(records)} records" if records else f"{PULSES} pulses"
    about = (
        f"{motions}, each in both directions. Lines: share of the motions that overturn the block; bands: {CONFIDENCE:.0%}, by drawing the"
        f" set of motions anew {BOOTSTRAPS} times; dots: the lognormal curve of the greatest likelihood."
    )
    return Fragility(title=f"{panel.title}, {motions}", about=about, intensity="peak acceleration / (g tan α)", cases=tuple(cases))


def _play_pulses(scene: Scene, asked: Asked, tiles: Tiles) -> NDArray[np.bool_]:
    if scene.excitation.kind not in ("ricker", "sine"):
        raise InputError("is needed: the scene's excitation is no pulse", "--record")
    frequencies = np.geomspace(asked.frequencies[0], asked.frequencies[-1], PULSES)
    nodes = [(sign * a, f) for sign in (1.0, -1.0) for f in frequencies for a in asked.amplitudes]
    a, f = np.array(nodes).T
    sides, _ = tiles.play(scene, a, f, model=asked.model, settings=asked.settings)
    return (sides != SAFE).reshape(2 * PULSES, len(asked.amplitudes))


def _play_records(scene: Scene, asked: Asked, records: Sequence[Path], tiles: Tiles) -> NDArray[np.bool_]:
    rows = []
    for path in records:
        record = Record.from_file(path)
        peak = float(np.max(np.abs(record.samples)))
        if peak == 0.0:
            raise InputError(f"{path.name}: a record without motion has no intensity", "--record")
        scales = asked.amplitudes * scene.gravity * scene.block.half_width / scene.block.half_height / peak
        moved = scene.replace(excitation=record)
        for sign in (1.0, -1.0):
            sides, _ = tiles.play(moved, sign * scales, np.ones(len(scales)), model=asked.model, settings=asked.settings)
            rows.append(sides != SAFE)
    return np.array(rows)


def _case(label: str, overturned: NDArray[np.bool_], intensities: Floats) -> Case:
    """The curve of one case from the outcomes, motion by intensity."""
    random = np.random.default_rng(1)
    drawn = random.integers(len(overturned), size=(BOOTSTRAPS, len(overturned)))
    shares = [overturned[motions].mean(axis=0) for motions in drawn]
    low, high = np.quantile(shares, [0.5 - CONFIDENCE / 2, 0.5 + CONFIDENCE / 2], axis=0)
    fit = fit_lognormal(intensities, overturned.sum(axis=0), len(overturned))
    fitted = lognormal(intensities, *fit) if fit else np.full(len(intensities), np.nan)
    columns = (intensities, overturned.mean(axis=0), low, high, fitted)
    points = tuple((float(x), float(share), float(lo), float(hi), float(p)) for x, share, lo, hi, p in zip(*columns, strict=True))
    median, dispersion = fit or (None, None)
    return Case(label=label, motions=len(overturned), median=median, dispersion=dispersion, points=points)


def lognormal(intensities: Floats, median: float, dispersion: float) -> Floats:
    """Probability of overturning Phi(ln(x/median)/dispersion)."""
    from scipy.special import ndtr

    p: Floats = ndtr(np.log(intensities / median) / dispersion)
    return p


def fit_lognormal(intensities: Floats, overturned: NDArray[np.int64], motions: int) -> tuple[float, float] | None:
    """Median and dispersion of the lognormal curve of the greatest likelihood (Baker 2015); None where all or none overturn.

    `overturned` counts the motions, of `motions`, that overturn the block at each intensity.
    """
    from scipy.optimize import minimize
    from scipy.special import log_ndtr

    if not 0 < overturned.sum() < motions * len(overturned):
        return None

    def unlikelihood(place: Floats) -> float:
        linear = (np.log(intensities) - place[0]) / np.exp(place[1])
        return -float(np.sum(overturned * log_ndtr(linear) + (motions - overturned) * log_ndtr(-linear)))

    found = minimize(
        unlikelihood, [float(np.mean(np.log(intensities))), -0.7], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-9}
    )
    return float(np.exp(found.x[0])), float(np.exp(found.x[1]))


def csv(found: Fragility) -> str:
    """The curves as a table."""
    lines = ["case,intensity,share_overturned,band_low,band_high,lognormal_fit"]
    lines += [f"{case.label}," + ",".join(map(repr, point)) for case in found.cases for point in case.points]
    return "\n".join(lines) + "\n"
