"""What a worker anywhere does with a cell, and cells in processes of this machine."""

from __future__ import annotations

import dataclasses
import sys
import time
import traceback
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rockcheck.scenes import History, InputError, ModelFailure, Scene
from rockcheck.scenes.base import MOST
from rockcheck.scenes.errors import printable
from rockcheck.validation.execute.models import build_own, family, is_own
from rockcheck.validation.execute.pool import Call, Pool
from rockcheck.validation.uncertainty.numerical import failed, numerical_uncertainty


@dataclass(frozen=True, kw_only=True)
class Work:
    """What a worker anywhere needs to know of the model: its label in the suite, the name of its family, its settings.

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
class TaskResult:
    """What a worker gives back: the history's files by suffix and the record, or the reason of its failure.

    `history` is the history itself, where it is sure to be the one that the files hold: a model of the user's own may give anything.
    `bad_input` says that the model refused what it was given. `traceback` is that of an exception which no model may raise.
    """

    files: dict[str, bytes] = field(default_factory=dict, repr=False)
    history: History | None = field(default=None, repr=False)
    record: dict[str, Any] = field(default_factory=dict)
    failure: str = ""
    bad_input: bool = False
    traceback: str = ""


def play(task: Task | BatchTask) -> TaskResult:
    """Simulate. Whatever goes wrong in the model is this task's failure, told in one line."""
    began = time.perf_counter()
    sys.path.extend(path for path in task.search_path if path not in sys.path)
    if isinstance(task, BatchTask):
        return _play_batch(task, began)
    history, failed = _simulate(task, task.scene)
    if history is None:
        return failed
    files = history.packed()
    cost = {key: value for key, value in vars(history.cost).items() if value is not None}
    record = {
        "outcome": history.outcome,
        "notes": list(history.notes),
        "settings": _plain(history.settings),
        "uncertainty": dict(history.uncertainty),
        "numerical": _numerical(task, history) if task.uncertainty else None,
        "cost": {**cost, "worker_seconds": time.perf_counter() - began},
    }
    return TaskResult(files=files, history=None if is_own(task.family) else history, record=record)


def _play_batch(task: BatchTask, began: float) -> TaskResult:
    """Peak |theta| in alpha and outcome of each scene; None and the reason where the model failed."""
    peaks: list[float | None] = []
    outcomes: list[str] = []
    cost = {"wall_seconds": 0.0, "cpu_seconds": 0.0, "set_up": 0.0, "steps": 0, "evaluations": 0}
    trace = ""
    for scene in task.scenes:
        history, failed = _simulate(task, scene)
        trace = trace or failed.traceback
        peaks.append(None if history is None else history.peak_rotation / scene.block.alpha)
        outcomes.append(failed.failure if history is None else history.outcome)
        if history is not None:
            cost = {key: value + getattr(history.cost, key) for key, value in cost.items()}
    cost["worker_seconds"] = time.perf_counter() - began
    return TaskResult(record={"peaks": peaks, "outcomes": outcomes, "cost": cost}, traceback=trace)


def _simulate(task: Work, scene: Scene) -> tuple[History | None, TaskResult]:
    """The history under the model's label in the suite, or None and the reason why there is none."""
    try:
        returned: object = build_own(task.family, task.settings).simulate(scene)
        if not isinstance(returned, History):
            raise ModelFailure(f"{task.family} returned {type(returned).__name__}; `simulate` must return a rockcheck.History")
        history = dataclasses.replace(returned, model=task.label)
        fault = _not_finite(history)
    except (ModelFailure, InputError) as error:
        return None, TaskResult(failure=printable(error, 300), bad_input=isinstance(error, InputError))
    except MemoryError:
        return None, TaskResult(failure="out of memory")
    except Exception as error:  # a model of whatever kind must not end the run
        return None, TaskResult(failure=printable(f"{type(error).__name__}: {error}", 300), traceback=traceback.format_exc())
    return (None, TaskResult(failure=fault)) if fault else (history, TaskResult())


def _numerical(task: Task, history: History) -> dict[str, Any] | None:
    """The numerical uncertainty of a run, None for a model without a step; a coarser run that fails is not converged."""
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
    plain = {str(key): value if isinstance(value, str | int | float | bool | None) else str(value) for key, value in settings.items()}
    return dict(sorted(plain.items()))


def local(
    tasks: Sequence[Task | BatchTask], *, jobs: int, seconds: Sequence[float], memory_mb: float | None
) -> Iterator[tuple[int, TaskResult]]:
    """Play tasks in `jobs` processes; yields (index, result) as they end. `seconds` limits each task's wall time.

    Of each package that compiles, one task goes first, with time for that, and the others of the package wait for it.
    """
    if not tasks:
        return
    calls = (Call(play, (tasks[n],), seconds[n], compiled_by(tasks[n]), n) for n in in_order(tasks))
    with Pool(max(1, min(jobs, len(tasks))), memory_mb) as pool:
        for ended in pool.run(deque(calls)):
            yield ended.call.key, TaskResult(failure=ended.fault) if ended.error else ended.result


def in_order(tasks: Sequence[Work]) -> list[int]:
    """The numbers of the tasks as they are to begin.

    One of each package that compiles goes first, since the others of it wait for that one; then what is not compiled, which takes
    longest; the quick rest fills the processes up to the end.
    """
    first = {compiled_by(task): n for n, task in reversed(list(enumerate(tasks)))}

    def turn(n: int) -> int:
        package = compiled_by(tasks[n])
        return 1 if not package else 0 if first[package] == n else 2

    return sorted(range(len(tasks)), key=turn)


def compiled_by(task: Work) -> str:
    """The package whose code a task may have to compile, empty where there is none."""
    kind = family(task.family)
    return kind.module if kind.compiled else ""
