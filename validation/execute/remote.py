"""The same cells on a Dask cluster: each in a process of its own beside the Dask worker, with the
same limits as at home.

A Dask worker is kept out of harm's way: a crash, a hang or a memory hog ends a child process, not
the worker. The child is kept for the next task of the same run, since starting one takes as long as
many a task.
"""

from __future__ import annotations

import contextlib
import math
import os
import pickle
import subprocess
import sys
import threading
import time
import uuid
from collections import Counter, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import IO, Any, Self

from rockcheck.scenes import ModelFailure
from rockcheck.validation.execute.cluster import connected
from rockcheck.validation.execute.pool import (
    COMPILING,
    ONE_THREAD,
    Call,
    Ended,
    Failure,
    death,
    prepare,
)

#: What a process that has closed its streams may take to end, s.
PATIENCE = 10.0
#: What a process may take to start, s. It counts for no task's limit.
STARTING = 120.0
#: What a process says once it waits for its first task.
READY = b"ready\n"


@dataclass(eq=False)
class Cluster:
    """The workers of a Dask cluster: `run` is that of `pool.Pool`. A context.

    Each call runs in a process of its own beside the Dask worker, with the same limits as at home.
    """

    address: str
    memory_mb: float | None = None
    jobs: int = field(default=1, init=False)
    _client: Any = field(default=None, init=False, repr=False)
    _stack: contextlib.ExitStack = field(
        default_factory=contextlib.ExitStack, init=False, repr=False
    )
    _run: str = field(default_factory=lambda: uuid.uuid4().hex, init=False, repr=False)
    _compiled: set[str] = field(default_factory=set, init=False, repr=False)
    _calls: dict[Any, Call] = field(default_factory=dict, init=False, repr=False)
    _held: dict[str, list[Call]] = field(default_factory=dict, init=False, repr=False)
    _leaders: Counter[str] = field(default_factory=Counter, init=False, repr=False)

    def __enter__(self) -> Self:
        self._client = self._stack.enter_context(connected(self.address))
        self.jobs = max(1, len(self._machines()))
        return self

    def __exit__(self, *fault: object) -> None:
        self._stack.__exit__(*fault)  # type: ignore[arg-type]

    def _machines(self) -> dict[str, str]:
        """The address of a worker on each machine."""
        workers = self._client.scheduler_info(n_workers=-1)["workers"].items()
        return {about["host"]: address for address, about in workers}

    def run(self, waiting: deque[Call], *, until: float = math.inf) -> Iterator[Ended]:
        """Runs the calls and yields each as it ends. More may be put into `waiting` meanwhile.

        Of the calls that may have to compile the same code, one goes first on each machine, with
        time for that, and the others wait for it. What has not ended at `until` (of
        `time.monotonic`) is dropped.
        """
        from distributed import as_completed

        running = as_completed(with_results=True, raise_errors=False)
        self._begin(waiting, running)
        told: set[Call] = set()
        while self._calls:
            future, result = next(running)
            if time.monotonic() > until:
                return
            call = self._calls.pop(future)
            if call not in told:
                told.add(call)
                lost = (
                    None
                    if future.status == "finished"
                    else ModelFailure(f"the cluster lost it: {result}")
                )
                yield Ended(call, None if lost else result, lost, call.seconds)
            self._leaders[call.compiles] -= 1
            if call.compiles in self._held and self._leaders[call.compiles] == 0:
                self._compiled.add(call.compiles)
                waiting.extend(self._held.pop(call.compiles))
            self._begin(waiting, running)

    def _begin(self, waiting: deque[Call], running: Any) -> None:
        """Submits what need not wait for another call to compile."""
        while waiting:
            call = waiting.popleft()
            if not call.compiles or call.compiles in self._compiled:
                self._submit(call, running)
            elif call.compiles in self._held:
                self._held[call.compiles].append(call)
            else:
                self._held[call.compiles] = []
                for machine in self._machines().values() or [None]:
                    self._leaders[call.compiles] += 1
                    self._submit(call, running, COMPILING, machine)

    def _submit(
        self, call: Call, running: Any, extra: float = 0.0, machine: str | None = None
    ) -> None:
        # A worker that is lost must not hold its tasks back: the machine is a wish, not an order.
        where = {} if machine is None else {"workers": [machine], "allow_other_workers": True}
        given = call.function, call.arguments, call.seconds + extra, self.memory_mb, self._run
        future = self._client.submit(alone, *given, pure=False, retries=2, **where)
        self._calls[future] = call
        running.add(future)


class _Child:
    """A process that calls functions one after the other, given and returned as pickles."""

    def __init__(self, run: str, memory_mb: float | None) -> None:
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

    def call(self, function: Callable[..., Any], arguments: tuple[Any, ...], seconds: float) -> Any:
        """What the function returns, or how the process ended; a process that takes longer is
        ended."""
        given, back = self.process.stdin, self.process.stdout
        assert given is not None
        assert back is not None
        results: list[Any] = []
        asked = function, arguments
        listener = threading.Thread(
            target=_exchange, args=(asked, given, back, results, self.ready), daemon=True
        )
        listener.start()
        while listener.is_alive() and not self.ready.wait(0.1) and time.monotonic() < self.latest:
            pass
        listener.join((None if seconds == math.inf else seconds) if self.ready.is_set() else 0.0)
        if results:
            return results[0]
        hangs = listener.is_alive()
        self.end(0.0 if hangs else PATIENCE)
        if hangs:
            said = (
                f"did not end within {seconds:g} s"
                if self.ready.is_set()
                else f"did not start within {STARTING:g} s"
            )
            return Failure(said)
        return Failure(death(self.process.returncode))

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


def _exchange(
    asked: Any, given: IO[bytes], back: IO[bytes], results: list[Any], ready: threading.Event
) -> None:
    try:
        if not ready.is_set():
            if back.readline() != READY:
                return  # it has ended as it started
            ready.set()
        pickle.dump(asked, given)
        given.flush()
        results.append(pickle.load(back))
    except (OSError, EOFError, pickle.UnpicklingError):
        return  # the process has ended


_mine = threading.local()


def alone(
    function: Callable[..., Any],
    arguments: tuple[Any, ...],
    seconds: float,
    memory_mb: float | None,
    run: str,
) -> Any:
    """Call a function in a process apart: that of this thread's last call where it was of the same
    run, so of the same code.

    Returns a `Failure` where the process ends without a result.
    """
    child: _Child | None = getattr(_mine, "child", None)
    if child is None or child.run != run or child.ended:
        if child is not None:
            child.end()
        child = _mine.child = _Child(run, memory_mb)
    return child.call(function, arguments, seconds)


def _serve(memory_mb: float | None) -> None:
    """What the process does: until its input ends, a call in, a result out."""
    results = os.fdopen(os.dup(1), "wb")  # the stream itself is closed to whatever engines say
    prepare(memory_mb)
    results.write(READY)
    results.flush()
    while True:
        try:
            function, arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        pickle.dump(function(*arguments), results)
        results.flush()


if __name__ == "__main__":
    from rockcheck.validation.execute import (
        remote,
    )  # what is pickled here must be known by its real name

    remote._serve(float(sys.argv[1]) if sys.argv[1] != "None" else None)
