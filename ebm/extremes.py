"""Extremes that the event core has kept, in SI units: of one run, or of many as columns."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import Extremes, Floats, Scene, Side, WallExtremes
from rockcheck.scenes.extremes import NO_STRIKE

SIDES: tuple[Side, Side] = ("left", "right")


def columns_of(
    kept: NDArray[np.void], setting: NDArray[np.void], length: Floats, time: Floats
) -> dict[str, Floats]:
    """Extremes of runs by name, in SI units, an entry a run; what is not there is NaN.

    `kept` has an EXTREMES a run, `setting` its SETTING; `length` is R (m) and `time` sqrt(R/g) (s).
    """
    columns: dict[str, Floats] = {}
    displacement = np.zeros(len(kept))
    for i, side in enumerate(SIDES):
        outward, inward, start = kept["tops"][:, i, 0], kept["tops"][:, i, 1], kept["start"][:, i]
        farthest = np.maximum(outward, kept["bottoms"][:, i])
        columns[f"rotation_{side}"] = kept["turned"][:, i].copy()
        columns[f"rotation_{side}_s"] = kept["turned_at"][:, i] * time
        columns[f"reach_{side}"] = _length(farthest - setting[side]["arm"], length)
        displacement = np.maximum.reduce([displacement, outward - start, inward + start])
    columns["top_displacement"] = _length(displacement, length)
    columns["slip"] = _length(kept["slip"], length)
    last = kept["last_slip"]
    columns["last_slip"] = np.sign(last) * _length(np.abs(last), length)
    columns["hop"] = _length(kept["hop"], length)
    columns["first_uplift_s"], columns["first_slip_s"] = kept["uplift"] * time, kept["slips"] * time
    return columns | strikes_of(kept, setting, length, time)


def _length(value: Floats, length: Floats) -> Floats:
    """A length in R as one in m; 0 where it is rounding of the run, or below 0."""
    from rockcheck.ebm.core.names import Kind
    from rockcheck.ebm.core.series import NOISE

    return np.where(value > NOISE[Kind.POSITION], value, 0.0) * length


def strikes_of(
    kept: NDArray[np.void], setting: NDArray[np.void], length: Floats, time: Floats
) -> dict[str, Floats]:
    """Of `columns_of` those of the walls, NaN where there is none."""
    speed_unit = length / time
    columns: dict[str, Floats] = {}
    for i, side in enumerate(SIDES):
        values = {
            "strikes": kept["strikes"][:, i].astype(float),
            "first_s": np.where(kept["strikes"][:, i] > 0, kept["first"][:, i] * time, np.nan),
            "speed": kept["speed"][:, i] * speed_unit,
            "impulse": kept["impulse"][:, i] * speed_unit,
        }
        there = np.isfinite(setting[side]["gap"])
        for name, column in values.items():
            columns[f"wall_{side}_{name}"] = np.where(there, column, np.nan)
    return columns


def extremes_of(scene: Scene, kept: NDArray[np.void], setting: NDArray[np.void]) -> Extremes:
    """The extremes of a scene's run; `kept` and `setting` have one entry."""
    from rockcheck.ebm import natural

    length, time = np.array([scene.block.radius]), np.array([natural.time_unit(scene)])
    columns = columns_of(kept, setting, length, time)
    return extremes_from(scene, {name: float(column[0]) for name, column in columns.items()})


def extremes_from(scene: Scene, values: Mapping[str, float]) -> Extremes:
    """The extremes of a scene's run from numbers by name, as of `columns_of`."""
    return Extremes(
        **{name: values[name] for name in values if not name.startswith(("wall_", "first_"))},
        walls={wall.side: _wall_of(values, wall.side) for wall in scene.walls},
        first_uplift_s=_or_none(values["first_uplift_s"]),
        first_slip_s=_or_none(values["first_slip_s"]),
        source="model",
    )


def _wall_of(values: Mapping[str, float], side: Side) -> WallExtremes:
    """How the block strikes the wall on this side."""
    strikes = int(values[f"wall_{side}_strikes"])
    if strikes == 0:
        return NO_STRIKE
    return WallExtremes(
        strikes=strikes,
        first_s=values[f"wall_{side}_first_s"],
        speed=values[f"wall_{side}_speed"],
        impulse=values[f"wall_{side}_impulse"],
    )


def _or_none(value: float) -> float | None:
    """None for NaN."""
    return None if math.isnan(value) else value
