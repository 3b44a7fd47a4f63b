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
BOOTSTRAPS, CONFIDENCE = 400, 0.95
FEWEST_MOTIONS = 4


class Case(Stored):
    """One curve. A point is intensity, share overturned, fitted probability, and the lower and upper end of its band.

    `median` is the intensity at which the fitted probability is one half, `dispersion` the standard deviation of its
    logarithm; both None where no lognormal curve fits (all or none overturn).
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
        f"{motions}, each in both directions. Points: share of the motions that overturn the block. Lines: lognormal curves of the greatest"
        f" likelihood; bands: {CONFIDENCE:.0%} by drawing the set of motions anew {BOOTSTRAPS} times."
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
    fit = fit_lognormal(intensities, overturned.sum(axis=0), len(overturned))
    draws = []
    for _ in range(BOOTSTRAPS):
        drawn = overturned[random.integers(len(overturned), size=len(overturned))]
        draws.append(lognormal(intensities, fit_lognormal(intensities, drawn.sum(axis=0), len(drawn))))
    low, high = np.quantile(draws, [0.5 - CONFIDENCE / 2, 0.5 + CONFIDENCE / 2], axis=0)
    columns = (intensities, overturned.mean(axis=0), lognormal(intensities, fit), low, high)
    points = tuple((float(x), float(share), float(p), float(lo), float(hi)) for x, share, p, lo, hi in zip(*columns, strict=True))
    median, dispersion = fit if fit else (None, None)
    return Case(label=label, motions=len(overturned), median=median, dispersion=dispersion, points=points)


def lognormal(intensities: Floats, fit: tuple[float, float] | None) -> Floats:
    """Probability of overturning Phi(ln(x/median)/dispersion); zero without a fit."""
    from scipy.special import ndtr

    if fit is None:
        return np.zeros(len(intensities))
    p: Floats = ndtr(np.log(intensities / fit[0]) / fit[1])
    return p


def fit_lognormal(intensities: Floats, overturned: NDArray[np.int64], motions: int) -> tuple[float, float] | None:
    """Median and dispersion of the lognormal curve of the greatest likelihood (Baker 2015); None where nothing overturns.

    `overturned` counts the motions, of `motions`, that overturn the block at each intensity. Binomial likelihood, as a
    probit regression on the logarithm of the intensity by Fisher's scoring.
    """
    from scipy.special import ndtr

    if not overturned.any():
        return None
    design = np.stack([np.ones(len(intensities)), np.log(intensities)], axis=1)
    share = overturned / motions
    guess = float(np.interp(0.5, np.maximum.accumulate(share), np.log(intensities)))
    slope = np.array([-2.0 * guess, 2.0])
    for _ in range(100):
        linear = np.clip(design @ slope, -6.0, 6.0)
        p = ndtr(linear)
        density = np.exp(-0.5 * linear**2) / np.sqrt(2.0 * np.pi)
        weight = motions * density**2 / (p * (1.0 - p))
        step = np.linalg.solve(
            (design.T * weight) @ design + 1e-9 * np.eye(2), design.T @ (motions * (share - p) * density / (p * (1.0 - p)))
        )
        slope = slope + np.clip(step, -5.0, 5.0)
        if np.max(np.abs(step)) < 1e-10:
            break
    if slope[1] <= 1e-6:
        return None
    return float(np.exp(-slope[0] / slope[1])), float(1.0 / slope[1])


def csv(found: Fragility) -> str:
    """The curves as a table."""
    lines = ["case,intensity,share_overturned,fitted_probability,band_low,band_high"]
    lines += [f"{case.label}," + ",".join(map(repr, point)) for case in found.cases for point in case.points]
    return "\n".join(lines) + "\n"
