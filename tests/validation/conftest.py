"""Synthetic histories: motions whose discrepancies are known by hand."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rockcheck.scenes import Event, History

HALF_WIDTH, HALF_HEIGHT = 0.397, 1.555
ALPHA = float(np.arctan2(HALF_WIDTH, HALF_HEIGHT))
RADIUS = float(np.hypot(HALF_WIDTH, HALF_HEIGHT))


def synthetic(
    theta: Any,
    t: Any = None,
    *,
    model: str = "made",
    events: Sequence[Event] = (),
    outcome: str = "moving",
    **columns: Any,
) -> History:
    """A history with theta in alpha; x, y and velocities are zero unless given, y touches the floor."""
    theta = ALPHA * np.asarray(theta, dtype=float)
    time = np.asarray(t if t is not None else 0.01 * np.arange(len(theta)), dtype=float)
    zero = np.zeros(len(theta))
    channels = {"t": time, "x": zero, "y": RADIUS * np.cos(ALPHA - np.abs(theta)), "theta": theta}
    channels |= dict.fromkeys(("x_dot", "y_dot", "theta_dot", "slip", "slip_rate"), zero)
    channels |= {name: np.asarray(column, dtype=float) for name, column in columns.items()}
    return History(
        name="made",
        model=model,
        channels=channels,
        event_list=tuple(events),
        outcome=outcome,
        half_width=HALF_WIDTH,
        half_height=HALF_HEIGHT,
    )


@pytest.fixture
def made() -> Callable[..., History]:
    """`synthetic`, for tests."""
    return synthetic


@pytest.fixture
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The working folder is an empty one, but for the models of `faulty.py`, imported afresh."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(Path(__file__).parent / "models" / "faulty.py", tmp_path / "faulty.py")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "faulty", raising=False)
