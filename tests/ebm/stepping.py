"""Runs of the event core, as its parts take them, for tests that call these one by one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from rockcheck.ebm import natural
from rockcheck.ebm.core import march, modes
from rockcheck.ebm.core.names import Family, Pivot
from rockcheck.ebm.core.state import STATE, Control, Records, Run, workspace
from rockcheck.scenes import Scene


def nothing() -> Records:
    """Records without rows."""
    return Records(np.empty((0, 6)), np.empty(0, dtype=np.int8), np.empty((0, 5)))


def run_at(motion: Sequence[float] = (0.0,) * 6, *, t: float = 0.0, **mode: int) -> Run:
    """A run with this motion (x, y, theta and their rates) and these fields of its mode; the others
    are 0."""
    state = np.zeros(1, STATE)[0]
    state.t, state.t_end = t, math.inf
    put(state.motion, motion)
    for name, value in mode.items():
        setattr(state.mode, name, value)
    modes.forget(state)
    return Run(state, *workspace(), Control(1e-10, 100, 100, False, 1.0), nothing())


def put(motion: Any, values: Sequence[float]) -> None:
    """Writes x, y, theta and their rates."""
    for name, value in zip(motion.dtype.names, values, strict=True):
        setattr(motion, name, value)


def six(motion: Any) -> np.ndarray:
    """x, y, theta and their rates."""
    return np.array(motion.tolist())


def play(scene: Scene, setting: Any, control: Control, work: Any = None) -> Any:
    """The state after the compiled loop has played the scene, without rows."""
    states = natural.start_of(scene)
    march.play(setting, natural.base_of(scene), states, work or workspace(), control, nothing())
    return states[0]


TILTED = {"family": Family.TILT, "pull": 1}
ROCKS = TILTED | {"pivot": Pivot.STICK}
