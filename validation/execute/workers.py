"""Cells in processes of their own: what a worker does, and the local pool with its limits of time and memory.

A worker that crashes, hangs or runs out of memory costs its own cell and nothing else.
"""

from __future__ import annotations

import dataclasses
import multiprocessing
import os
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rockcheck.scenes import History, InputError, ModelFailure, Scene
from rockcheck.scenes.errors import printable
from rockcheck.validation.execute.models import build, family

if TYPE_CHECKING:
    from pebble import ProcessPool

#: One thread a worker: the cells are what runs in parallel.
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
#: What the first task of a package may take in addition, to compile, s.
COMPILING = 600.0


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
    """One scene, whose history counts."""

    scene: Scene


@dataclass(frozen=True, kw_only=True)
class BatchTask(Work):
    """Many scenes, of which only peak rotation and outcome count."""

    scenes: tuple[Scene, ...]


@dataclass(frozen=True)
class TaskResult:
    """What a worker gives back: the history's files by suffix and the record, or the reason of its failure."""

    files: dict[str, str] = field(default_factory=dict, repr=False)
    record: dict[str, Any] = field(default_factory=dict)
    failure: str = ""


def play(task: Task | BatchTask) -> TaskResult:
    """Simulate. Whatever goes wrong in the model is this task's failure, told in one line."""
    began = time.perf_counter()
    sys.path.extend(path for path in task.search_path if path not in sys.path)
    if isinstance(task, BatchTask):
        return _play_batch(task, began)
    history, fault = _simulate(task, task.scene)
    if history is None:
        return TaskResult(failure=fault)
    with tempfile.TemporaryDirectory() as folder:
        history.save(Path(folder) / "history.csv")
        files = {path.name.removeprefix("history"): path.read_text(encoding="utf-8") for path in Path(folder).iterdir()}
    cost = {key: value for key, value in vars(history.cost).items() if value is not None}
    record = {
        "outcome": history.outcome,
        "notes": list(history.notes),
        "settings": _plain(history.settings),
        "cost": {**cost, "worker_seconds": time.perf_counter() - began},
    }
    return TaskResult(files=files, record=record)


def _play_batch(task: BatchTask, began: float) -> TaskResult:
    """Peak |theta| in alpha and outcome of each scene; None and the reason where the model failed."""
    peaks: list[float | None] = []
    outcomes: list[str] = []
    cost = {"wall_seconds": 0.0, "cpu_seconds": 0.0, "set_up": 0.0, "steps": 0, "evaluations": 0}
    for scene in task.scenes:
        history, fault = _simulate(task, scene)
        peaks.append(None if history is None else history.peak_rotation / scene.block.alpha)
        outcomes.append(fault if history is None else history.outcome)
        if history is not None:
            cost = {key: value + getattr(history.cost, key) for key, value in cost.items()}
    cost["worker_seconds"] = time.perf_counter() - began
    return TaskResult(record={"peaks": peaks, "outcomes": outcomes, "cost": cost})


def _simulate(task: Work, scene: Scene) -> tuple[History | None, str]:
    """The history under the model's label in the suite, or the reason why there is none."""
    try:
        history = dataclasses.replace(build(task.family, task.settings).simulate(scene), model=task.label)
    except (ModelFailure, InputError) as error:
        return None, printable(error, 300)
    except MemoryError:
        return None, "out of memory"
    except Exception as error:  # a model of whatever kind must not end the run
        return None, printable(f"{type(error).__name__}: {error}", 300)
    fault = _not_finite(history)
    return (None, fault) if fault else (history, "")


def _not_finite(history: History) -> str:
    for name, column in history.channels.items():
        if column.dtype.kind == "f" and not np.all(np.isfinite(column)):
            row = int(np.flatnonzero(~np.isfinite(column))[0])
            return f"{name} is {column[row]} at t = {history.channels['t'][row]:g} s"
    if len(history.channels["t"]) == 0:
        return "the history is empty"
    return ""


def _plain(settings: Any) -> dict[str, Any]:
    """Settings as JSON has them, in the order in which the store gives them back."""
    plain = {str(key): value if isinstance(value, str | int | float | bool | None) else str(value) for key, value in settings.items()}
    return dict(sorted(plain.items()))


@contextmanager
def workers(jobs: int, memory_mb: float) -> Iterator[ProcessPool]:
    """A pool of processes with one thread each; left by an exception (Ctrl-C is one), it ends whatever they do."""
    from pebble import ProcessPool

    before = {key: os.environ.get(key) for key in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        with ProcessPool(
            max_workers=jobs, context=multiprocessing.get_context("spawn"), initializer=prepare, initargs=(memory_mb,)
        ) as pool:
            try:
                with _interrupts_held():
                    if not pool.active:  # asking starts it
                        raise RuntimeError("the workers do not start")
                yield pool
            except BaseException:
                pool.stop()
                raise
    finally:
        for key, value in before.items():
            os.environ.pop(key, None) if value is None else os.environ.update({key: value})


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Ctrl-C waits for the end of this block, and never reaches processes and threads that are started in it.

    Ctrl-C goes to all processes of a terminal. One that starts would die of it, with a traceback, before `prepare` can say otherwise.
    The pool's threads, which replace lost workers, keep this thread's mask.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # as it starts it lets SIGINT through again
    came: list[int] = []
    handler = signal.getsignal(signal.SIGINT)
    ours = callable(handler) and threading.current_thread() is threading.main_thread()
    if ours:  # whichever thread the signal comes to, its handler runs in this one
        signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        if ours:
            signal.signal(signal.SIGINT, handler)
        if came:
            signal.raise_signal(signal.SIGINT)


def loss_of(future: Future[Any]) -> str:
    """Why a process gave nothing back; empty where it did."""
    from pebble import ProcessExpired

    error = future.exception()
    if error is None:
        return ""
    if isinstance(error, TimeoutError):
        return "hangs"
    if isinstance(error, ProcessExpired):
        return death(int(error.exitcode or 0))
    return printable(f"{type(error).__name__}: {error}", 300)


def local(tasks: Sequence[Task | BatchTask], *, jobs: int, seconds: Sequence[float], memory_mb: float) -> Iterator[tuple[int, TaskResult]]:
    """Play tasks in `jobs` processes; yields (index, result) as they end. `seconds` limits each task's wall time.

    Of each package that compiles, one task goes first, with time for that, and the others of the package wait for it.
    """
    if not tasks:
        return
    leader_of = leaders(tasks)
    with workers(max(1, min(jobs, len(tasks))), memory_mb) as pool:
        running: dict[Any, tuple[int, float]] = {}

        def begin(n: int) -> None:
            limit = seconds[n] + (COMPILING if leader_of.get(n) == n else 0.0)
            running[pool.schedule(play, args=(tasks[n],), timeout=limit)] = n, limit

        for n in range(len(tasks)):
            if leader_of.get(n, n) == n:
                begin(n)
        while running:
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                done, limit = running.pop(future)
                for n in [n for n, leader in leader_of.items() if leader == done != n]:
                    begin(n)
                yield done, _outcome(future, limit)


def leaders(tasks: Sequence[Work]) -> dict[int, int]:
    """For each task of a package that compiles: the first task of that package."""
    first: dict[str, int] = {}
    return {n: first.setdefault(family(task.family).module, n) for n, task in enumerate(tasks) if family(task.family).compiled}


def prepare(memory_mb: float) -> None:
    """Make this worker die with the run, and fail where it takes more memory than it may (where the system can say so)."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the run itself ends its workers
    if (run := multiprocessing.parent_process()) is not None:
        threading.Thread(target=_follow, args=(run,), daemon=True).start()
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # the terminal is the run's; engines greet on it from C
        os.dup2(nowhere, stream)
    try:
        import resource

        most = int(memory_mb * 2**20)
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (ImportError, ValueError, OSError):
        pass


def _follow(run: Any) -> None:
    """End this process, whatever it is doing, once the run has ended in whatever way."""
    run.join()
    os._exit(1)


def _outcome(future: Any, seconds: float) -> TaskResult:
    from pebble import ProcessExpired

    try:
        result: TaskResult = future.result()
    except TimeoutError:
        return TaskResult(failure=f"did not end within {seconds:g} s")
    except ProcessExpired as error:
        return TaskResult(failure=death(int(error.exitcode or 0)))
    except MemoryError:
        return TaskResult(failure="out of memory")
    except Exception as error:  # such as a result that cannot be sent back
        return TaskResult(failure=printable(f"{type(error).__name__}: {error}", 300))
    return result


def death(code: int) -> str:
    """How a process ended, from its exit code."""
    if code < 0:
        try:
            return f"crashed: {signal.Signals(-code).name}"
        except ValueError:
            return f"crashed: signal {-code}"
    return f"the process ended with code {code}"
