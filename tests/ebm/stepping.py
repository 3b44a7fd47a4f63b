"""Runs of the event core, as its parts take them, for tests that call these one by one."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from rockcheck.ebm import EventBasedModel, natural
from rockcheck.ebm.core import march
from rockcheck.ebm.core.names import Family, Pivot
from rockcheck.ebm.core.series import WIDTH
from rockcheck.ebm.core.state import EXTREMES, FOUND, NEW_STATE, Records, Run, workspace
from rockcheck.ebm.natural import pack, state_for
from rockcheck.scenes import Block, Floor, History, Scene, Wall, kinematics


def nothing() -> Records:
    no_extremes = np.empty(0, EXTREMES)
    return Records(np.empty((0, 6)), np.empty(0, dtype=np.int8), np.empty((0, 5)), no_extremes)


def run_at(motion: Sequence[float] = (0.0,) * 6, *, t: float = 0.0, **mode: int) -> Run:
    """A run with this motion (x, y, theta and their rates) and these fields of its mode; the others
    are 0."""
    state = NEW_STATE.copy()[0]
    state.t, state.t_end = t, math.inf
    for name, value in zip(state.motion.dtype.names, motion, strict=True):
        setattr(state.motion, name, value)
    for name, value in mode.items():
        setattr(state.mode, name, value)
    state.since = t
    state.control = (1e-10, 100, 100, False, 1.0, False)
    return Run(state, *workspace(), nothing())


def six(motion: Any) -> np.ndarray:
    return np.array(motion.tolist())


def play(scene: Scene, model: EventBasedModel, work: Any = None) -> Any:
    """The state after the compiled loop has played the scene, without rows."""
    states = state_for(model, model.most_steps)
    march.play(
        pack([scene], model),
        states,
        work or workspace(),
        Records(*(part[None] for part in nothing()[:3]), np.empty(0, EXTREMES)),
        np.empty(1, FOUND),
    )
    return states[0]


def assert_contacts_hold(scene: Scene, history: History, reach: float = 1e-9) -> None:
    """Finite rows, and no corner by more than `reach` m in the floor or in a wall."""
    x, y, theta = (history.channels[name] for name in ("x", "y", "theta"))
    assert np.all(np.isfinite([x, y, theta]))
    assert np.min(kinematics.pivot_height(scene.block, y, theta)) > -reach
    for wall in scene.walls:
        assert np.min(kinematics.clearance(scene.block, wall.side, wall.gap, x, theta)) > -reach


def row_of(coefficients: Sequence[float]) -> np.ndarray:
    """The terms of a series, and behind them what must not be seen."""
    row = np.full((1, WIDTH), np.nan)
    row[0, : len(coefficients)] = coefficients
    return row


TILTED = {"family": Family.TILT, "pull": 1}
ROCKS = TILTED | {"pivot": Pivot.STICK}
FLAT = {"family": Family.FLAT, "sense": 1, "pull": 1}
RESTS = FLAT | {"pivot": Pivot.STICK}


def block_of(alpha: float, radius: float = 1.0) -> Block:
    return Block(half_width=radius * math.sin(alpha), half_height=radius * math.cos(alpha))


def setting_of(
    block: float | Block,
    mu: float = 0.5,
    e: float = 0.0,
    walls: Sequence[Wall] = (),
    **how: Any,
) -> Any:
    """A block, or one of R = 1 m and this alpha, as the compiled code has it: free to hop."""
    return natural.setting_of(
        Scene(
            name="block",
            block=block if isinstance(block, Block) else block_of(block),
            floor=Floor(friction=mu, restitution=e),
            walls=walls,
            duration=1.0,
        ),
        EventBasedModel(**{"pivot": "unilateral"} | how),
    )
