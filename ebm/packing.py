"""Many runs as the compiled code takes them, packed from one table of numbers: a RunTable.

A scene is read once for all of its rows and the samples of a motion are stored once. What differs
from row to row (natural units, factors, gaps) is written by columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.core.block import SETTING
from rockcheck.ebm.core.ground import FORM
from rockcheck.ebm.core.names import Shape
from rockcheck.ebm.core.state import GIVEN, Rows
from rockcheck.ebm.natural import SampleStore, setting_of, state_of, time_unit
from rockcheck.ebm.table import RunTable
from rockcheck.scenes import Floats, Side, kinematics
from rockcheck.scenes.named_record import MOTION

#: Penetration that is put down to rounding, relative to half the box's diagonal.
_TOUCHES = 1e-12
_SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True)
class Draws:
    """The scenes of a table in natural units, one an entry."""

    setting: NDArray[np.void]
    motion: NDArray[np.void]
    length: Floats  # R, m
    time: Floats  # sqrt(R/g), s
    gravity: Floats  # m/s^2


def draws_of(table: RunTable, model: Any) -> Draws:
    """The scenes of a table; raises `InputError` where the model cannot play one of them."""
    for scene in table.scenes:
        model.check(scene)
    states = [tuple(state_of(scene).tolist()) for scene in table.scenes]
    return Draws(
        setting=np.array([setting_of(scene, model) for scene in table.scenes], SETTING),
        motion=np.array(states, MOTION),
        length=np.array([scene.block.radius for scene in table.scenes]),
        time=np.array([time_unit(scene) for scene in table.scenes]),
        gravity=np.array([scene.gravity for scene in table.scenes]),
    )


@dataclass(frozen=True)
class Motions:
    """The motions of a table in SI units, with all of their samples."""

    horizontal: NDArray[np.void]
    vertical: NDArray[np.void]
    samples: Floats


def motions_of(table: RunTable) -> Motions:
    """The motions of a table; each one's samples are stored once, however often it is used."""
    store = SampleStore()
    forms = np.array(
        [[store.form_of(motion, 1.0, 1.0) for motion in both] for both in table.motions], FORM
    ).reshape(-1, 2)
    return Motions(forms[:, 0], forms[:, 1], store.samples)


def rows_of(table: RunTable, draws: Draws, motions: Motions, which: NDArray[np.intp]) -> Rows:
    """These rows of a table, packed."""
    draw, motion = table.scene[which], table.motion[which]
    given = np.zeros(len(which), GIVEN)
    given["setting"], given["motion"] = draws.setting[draw], draws.motion[draw]
    units = draws.time[draw], draws.gravity[draw]
    along, upward = table.factor[which], table.vertical_factor[which]
    given["horizontal"] = _in_units(motions.horizontal[motion], along, *units)
    given["vertical"] = _in_units(motions.vertical[motion], upward, *units)
    for side, gaps in zip(_SIDES, (table.gap_left, table.gap_right), strict=True):
        _place_wall(given["setting"][side], gaps[which] / draws.length[draw], table.restitution)
    setting = given["setting"]
    setting["walls"] = np.isfinite(setting["left"]["gap"]) | np.isfinite(setting["right"]["gap"])
    return Rows(given, motions.samples)


def _in_units(forms: NDArray[np.void], factor: Floats, time: Floats, gravity: Floats) -> Any:
    """Motions in SI units, times a factor, in units of time (s) and gravity (m/s^2)."""
    forms = forms.copy()
    pulse = forms["kind"] == Shape.GAUSSIAN
    size = factor / gravity
    for power in range(4):
        forms[f"c{power}"] *= size * time**power
    forms["scale"] *= size
    forms["rate"] *= np.where(pulse, time**2, time)
    for name in ("centre", "quiet", "step"):
        forms[name] /= time
    forms["kind"] = np.where(factor == 0.0, Shape.STILL, forms["kind"])
    forms["quiet"] = np.where(factor == 0.0, 0.0, forms["quiet"])
    return forms


def _place_wall(side: NDArray[np.void], gaps: Floats, restitution: float) -> None:
    """Puts walls at these gaps, in R: NaN keeps the scene's own wall or none, inf removes it."""
    given = ~np.isnan(gaps)
    added = given & np.isinf(side["gap"])
    side["gap"] = np.where(given, gaps, side["gap"])
    side["e"] = np.where(added, restitution, side["e"])


def inside_a_wall(table: RunTable) -> NDArray[np.bool_]:
    """Which rows start with a corner inside a wall that the row has moved there."""
    inside = np.zeros(len(table.scene), dtype=bool)
    starts = [(scene.block, *scene.initial_state) for scene in table.scenes]
    size = np.array([block.half_diagonal for block, *_ in starts])[table.scene]
    for side, gaps in zip(_SIDES, (table.gap_left, table.gap_right), strict=True):
        clear = np.array(
            [kinematics.clearance(block, side, 0.0, x, tilt) for block, x, _, tilt, *_ in starts]
        )
        inside |= clear[table.scene] + gaps < -_TOUCHES * size
    return inside
