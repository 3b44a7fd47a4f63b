"""What a worker anywhere does with a cell, and cells in processes of this machine."""

from __future__ import annotations

import dataclasses
import sys
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rockcheck.scenes import History, InputError, ModelFailure, Scene
from rockcheck.scenes.base import MOST
from rockcheck.scenes.errors import printable
from rockcheck.validation.execute.models import build_own, is_own
from rockcheck.validation.execute.pool import Failure, guarded
from rockcheck.validation.uncertainty.numerical import failed, numerical_uncertainty


@dataclass(frozen=True, kw_only=True)
class Work:
    """What a worker anywhere needs to know of the model: its label in the suite, the name of its
    family, its settings.

    `search_path` holds folders in which a model of the user's own may lie.
    """

    label: str
    family: str
    settings: dict[str, Any]
    search_path: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Task(Work):
    """One scene, whose history counts; `uncertainty` asks for its numerical error, too."""

    scene: Scene
    uncertainty: bool = False


@dataclass(frozen=True, kw_only=True)
class BatchTask(Work):
    """Many scenes, of which only peak rotation and outcome count."""

    scenes: tuple[Scene, ...]


@dataclass(frozen=True)
class Played:
    """What a worker gives back: the history's files by suffix, and the record.

    `history` is the history itself, where it is sure to be the one that the files hold: a model of
    the user's own may give anything. `traceback` is that of an exception in a scene of a batch.
    """

    record: dict[str, Any]
    files: dict[str, bytes] = field(default_factory=dict, repr=False)
    history: History | None = field(default=None, repr=False)
    traceback: str = ""


def play(task: Task | BatchTask) -> Played:
    """Simulate. Raises what goes wrong in the model; in a batch it is told of the scene."""
    began = time.perf_counter()
    sys.path.extend(path for path in task.search_path if path not in sys.path)
    if isinstance(task, BatchTask):
        return _play_batch(task, began)
    history = _simulate(task, task.scene)
    cost = {key: value for key, value in vars(history.cost).items() if value is not None}
    record = {
        "outcome": history.outcome,
        "notes": list(history.notes),
        "settings": _plain(history.settings),
        "uncertainty": dict(history.uncertainty),
        "numerical": _numerical(task, history) if task.uncertainty else None,
        "cost": {**cost, "worker_seconds": time.perf_counter() - began},
    }
    return Played(record, history.packed(), None if is_own(task.family) else history)


def _play_batch(task: BatchTask, began: float) -> Played:
    """Peak |theta| (alpha) and outcome of each scene; None and the reason where it failed."""
    peaks: list[float | None] = []
    outcomes: list[str] = []
    cost = {"wall_seconds": 0.0, "cpu_seconds": 0.0, "set_up": 0.0, "steps": 0, "evaluations": 0}
    trace = ""
    for scene in task.scenes:
        found = guarded(_simulate, task, scene)
        if isinstance(found, Failure):
            trace = trace or found.traceback
            peaks.append(None)
            outcomes.append(found.reason)
            continue
        peaks.append(found.peak_rotation / scene.block.alpha)
        outcomes.append(found.outcome)
        cost = {key: value + getattr(found.cost, key) for key, value in cost.items()}
    cost["worker_seconds"] = time.perf_counter() - began
    return Played({"peaks": peaks, "outcomes": outcomes, "cost": cost}, traceback=trace)


def _simulate(task: Work, scene: Scene) -> History:
    returned: object = build_own(task.family, task.settings).simulate(scene)
    if not isinstance(returned, History):
        raise ModelFailure(
            f"{task.family} returned {type(returned).__name__}; `simulate` must return a"
            " rockcheck.History"
        )
    history = dataclasses.replace(returned, model=task.label)
    if fault := _not_finite(history):
        raise ModelFailure(fault)
    return history


def _numerical(task: Task, history: History) -> dict[str, Any] | None:
    """The numerical uncertainty of a run, None for a model without a step; a coarser run that fails
    is not converged.
    """
    try:
        found = numerical_uncertainty(build_own(task.family, task.settings), task.scene, history)
    except (ModelFailure, InputError) as error:
        found = failed(history, f"a coarser run failed: {printable(error)}")
    return None if found is None else found.model_dump(mode="json")


def _not_finite(history: History) -> str:
    for name, column in history.channels.items():
        if column.dtype.kind == "f" and not np.all(np.abs(column) <= MOST):  # NaN, too
            row = int(np.flatnonzero(~(np.abs(column) <= MOST))[0])
            return f"{name} is {column[row]} at t = {history.channels['t'][row]:g} s"
    if len(history.channels["t"]) == 0:
        return "the history is empty"
    return ""


def _plain(settings: Any) -> dict[str, Any]:
    """Settings as JSON has them, in the order in which the store gives them back."""
    plain = {
        str(key): value if isinstance(value, str | int | float | bool | None) else str(value)
        for key, value in settings.items()
    }
    return dict(sorted(plain.items()))
