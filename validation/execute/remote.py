"""The same cells on a Dask cluster: each in a process of its own beside the Dask worker, with the same limits as at home.

A Dask worker is kept out of harm's way: a crash, a hang or a memory hog ends a child process, not the worker. The child is
kept for the next task of the same run, since starting one takes as long as many a task.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Iterator, Sequence
from typing import IO, Any

from rockcheck.validation.execute.cluster import connected
from rockcheck.validation.execute.pool import COMPILING, ONE_THREAD, death, prepare
from rockcheck.validation.execute.workers import BatchTask, Task, TaskResult, compiled_by, play

#: What a process that has closed its streams may take to end, s.
PATIENCE = 10.0
#: What a process may take to start, s. It counts for no task's limit.
STARTING = 120.0
#: What a process says once it waits for its first task.
READY = b"ready\n"


class OnCluster:
    """Plays tasks on the Dask cluster at an address, or on "local:N" workers; a `validation.suite.runner.Executor`."""

    def __init__(self, address: str) -> None:
        self.address = address

    def __call__(
        self, tasks: Sequence[Task | BatchTask], *, jobs: int, seconds: Sequence[float], memory_mb: float
    ) -> Iterator[tuple[int, TaskResult]]:
        """Yields (index, result) as they end; the cluster's size, not `jobs`, says how many run at once.

        Of each package that compiles, one task goes first on each machine, with time for that, and the others wait for it.
        """
        if not tasks:
            return
        from distributed import as_completed

        leader_of = _leaders(tasks)
        run = uuid.uuid4().hex
        with connected(self.address) as client:
            machines = {about["host"]: address for address, about in client.scheduler_info(n_workers=-1)["workers"].items()}
            index: dict[Any, int] = {}
            awaited = dict.fromkeys(leader_of.values(), max(1, len(machines)))

            def submit(n: int, extra: float = 0.0, machine: str | None = None) -> Any:
                # A worker that is lost must not hold its tasks back: the machine is a wish, not an order.
                where = {} if machine is None else {"workers": [machine], "allow_other_workers": True}
                future = client.submit(alone, tasks[n], seconds[n] + extra, memory_mb, run, pure=False, retries=2, **where)
                index[future] = n
                return future

            free = [submit(n) for n in range(len(tasks)) if n not in leader_of]
            first = [submit(n, COMPILING, machine) for n in awaited for machine in machines.values() or [None]]
            told: set[int] = set()
            running = as_completed([*first, *free], with_results=True, raise_errors=False)
            for future, result in running:
                done = index.pop(future)
                if done in awaited:
                    awaited[done] -= 1
                    if awaited[done] == 0:
                        running.update([submit(n) for n, leader in leader_of.items() if leader == done != n])
                if done not in told:
                    told.add(done)
                    yield done, result if isinstance(result, TaskResult) else TaskResult(failure=f"the cluster lost it: {result}")


def _leaders(tasks: Sequence[Task | BatchTask]) -> dict[int, int]:
    """For each task of a package that compiles: the first task of that package."""
    first: dict[str, int] = {}
    return {n: first.setdefault(package, n) for n, task in enumerate(tasks) if (package := compiled_by(task))}


class _Child:
    """A process that plays tasks one after the other, given and returned as pickles."""

    def __init__(self, run: str, memory_mb: float) -> None:
        self.run = run
        self.ready = threading.Event()
        self.latest = time.monotonic() + STARTING
        self.process = subprocess.Popen(
            [
                sys.executable,
                "-P",
                "-m",
                "rockcheck.validation.execute.remote",
                str(memory_mb),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )

    def play(self, task: Task | BatchTask, seconds: float) -> TaskResult:
        """The result, or how the process ended; a process that takes longer is ended."""
        given, back = self.process.stdin, self.process.stdout
        assert given is not None
        assert back is not None
        results: list[TaskResult] = []
        listener = threading.Thread(target=_exchange, args=(task, given, back, results, self.ready), daemon=True)
        listener.start()
        while listener.is_alive() and not self.ready.wait(0.1) and time.monotonic() < self.latest:
            pass
        listener.join(seconds if self.ready.is_set() else 0.0)
        if results:
            return results[0]
        hangs = listener.is_alive()
        self.end(0.0 if hangs else PATIENCE)
        if hangs:
            return TaskResult(
                failure=f"did not end within {seconds:g} s" if self.ready.is_set() else f"did not start within {STARTING:g} s"
            )
        return TaskResult(failure=death(self.process.returncode))

    @property
    def ended(self) -> bool:
        """Whether it cannot take another task."""
        return self.process.poll() is not None

    def end(self, patience: float = 0.0) -> None:
        """End the process, unless it ends by itself within `patience` s."""
        try:
            self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                with contextlib.suppress(OSError):  # what was not taken any more
                    stream.close()


def _exchange(task: Task | BatchTask, given: IO[bytes], back: IO[bytes], results: list[TaskResult], ready: threading.Event) -> None:
    try:
        if not ready.is_set():
            if back.readline() != READY:
                return  # it has ended as it started
            ready.set()
        pickle.dump(task, given)
        given.flush()
        results.append(pickle.load(back))
    except (OSError, EOFError, pickle.UnpicklingError):
        return  # the process has ended


_mine = threading.local()


def alone(task: Task | BatchTask, seconds: float, memory_mb: float, run: str) -> TaskResult:
    """Play a task in a process apart: that of this thread's last task where it was of the same run, so of the same code."""
    child: _Child | None = getattr(_mine, "child", None)
    if child is None or child.run != run or child.ended:
        if child is not None:
            child.end()
        child = _mine.child = _Child(run, memory_mb)
    return child.play(task, seconds)


def _serve(memory_mb: float) -> None:
    """What the process does: until its input ends, a task in, a result out."""
    results = os.fdopen(os.dup(1), "wb")  # the stream itself is closed to whatever engines say
    prepare(memory_mb)
    results.write(READY)
    results.flush()
    while True:
        try:
            task = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        pickle.dump(play(task), results)
        results.flush()


if __name__ == "__main__":
    from rockcheck.validation.execute import remote  # what is pickled here must be known by its real name

    remote._serve(float(sys.argv[1]))
