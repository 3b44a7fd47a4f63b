"""How a worker plays a cell or a batch of scenes."""

import dataclasses
import sys
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rockcheck.scenes import Cost, History, InputError, ModelFailure, Scene
from rockcheck.scenes.base import MOST
from rockcheck.scenes.errors import printable
from rockcheck.validation.execute.models import build_own, is_own
from rockcheck.validation.execute.pool import Failure, guarded
from rockcheck.validation.uncertainty.numerical import failed, numerical_uncertainty

#: What a batch sums of the cost of its runs.
SUMMED = ("wall_seconds", "cpu_seconds", "set_up", "steps", "evaluations")


@dataclass(frozen=True, kw_only=True)
class Work:
    """The model that a worker plays: its label in the suite, the name of its family, its settings.

    `search_path` holds folders in which a user-defined model may lie.
    """

    label: str
    family: str
    settings: dict[str, Any]
    search_path: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Task(Work):
    """One scene, whose history is kept; `uncertainty` asks for its numerical error, too."""

    scene: Scene
    uncertainty: bool = False


@dataclass(frozen=True, kw_only=True)
class BatchTask(Work):
    """Many scenes, of which only peak rotation and outcome are kept."""

    scenes: tuple[Scene, ...]


@dataclass(frozen=True)
class Played:
    """The result of a worker: the record, and the history's files by suffix.

    `history` is the content of the files, None for a batch and for a user-defined model, which may
    return anything. `traceback` is that of an exception in a scene of a batch.
    """

    record: dict[str, Any]
    files: dict[str, bytes] = field(default_factory=dict, repr=False)
    history: History | None = field(default=None, repr=False)
    traceback: str = ""


def play(task: Task | BatchTask) -> Played:
    """Simulate. Raises the model's errors; in a batch they are recorded by scene."""
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
    found = [guarded(_end_of, task, scene) for scene in task.scenes]
    failed = [one for one in found if isinstance(one, Failure)]
    costs = [one[2] for one in found if not isinstance(one, Failure)]
    ends = [(None, one.reason) if isinstance(one, Failure) else one[:2] for one in found]
    cost = {key: sum(getattr(one, key) for one in costs) for key in SUMMED}
    record = {
        "peaks": [peak for peak, _ in ends],
        "outcomes": [outcome for _, outcome in ends],
        "cost": {**cost, "worker_seconds": time.perf_counter() - began},
    }
    return Played(record, traceback=next((one.traceback for one in failed if one.traceback), ""))


def _end_of(task: Work, scene: Scene) -> tuple[float, str, Cost]:
    history = _simulate(task, scene)
    return history.peak_rotation / scene.block.alpha, history.outcome, history.cost


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
    """Numerical uncertainty of a run; None for a model without a step.

    If a coarser run fails, the result is not converged.
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
    return "" if len(history.channels["t"]) else "the history is empty"


def _plain(settings: Any) -> dict[str, Any]:
    """Settings as plain JSON values, sorted as the store returns them."""
    return {
        str(key): value if isinstance(value, str | int | float | bool | None) else str(value)
        for key, value in sorted(settings.items(), key=lambda item: str(item[0]))
    }
