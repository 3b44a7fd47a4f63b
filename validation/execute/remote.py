"""The same calls on a Dask cluster, at an address or made of local workers: each in a process of
its own beside the Dask worker, with the same limits as at home.

A Dask worker is kept out of harm's way: a crash, a hang or a memory hog ends a child process, not
the worker. The child is kept for the next call of the same run, since starting one takes as long as
many a call.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import threading
import uuid
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from importlib.util import find_spec
from multiprocessing.util import Finalize
from typing import Any, Self

from rockcheck.scenes import InputError, ModelFailure
from rockcheck.scenes.errors import printable
from rockcheck.validation.execute.pool import AHEAD, Call, Failure, Pool


class Cluster(Pool):
    """The workers of a Dask cluster. Of the calls that may have to compile the same code, one goes
    first on each machine."""

    def __init__(self, address: str, memory_mb: float | None = None) -> None:
        super().__init__(1, memory_mb)
        self._address, self._run = address, uuid.uuid4().hex
        self._stack = contextlib.ExitStack()

    def __enter__(self) -> Self:
        self._pool = self._stack.enter_context(connected(self._address))
        return self

    def __exit__(self, *fault: Any) -> None:
        self._stack.__exit__(*fault)

    def _workers(self) -> dict[str, Any]:
        found: dict[str, Any] = self._pool.scheduler_info(n_workers=-1)["workers"]
        return found

    def _room(self) -> int:
        return AHEAD * max(1, sum(about["nthreads"] for about in self._workers().values()))

    def _schedule(self, call: Call, seconds: float, first: bool) -> list[Future[Any]]:
        machines = {about["host"]: address for address, about in self._workers().items()}
        # A worker that is lost must not hold its calls back: the machine is a wish, not an order.
        wishes = [{"workers": [one], "allow_other_workers": True} for one in machines.values()]
        given = call.function, call.arguments, seconds, self.memory_mb, self._run
        return [
            self._pool.get_executor(pure=False, retries=2, **where).submit(alone, *given)
            for where in (wishes if first and wishes else [{}])
        ]

    def _error(self, future: Future[Any]) -> BaseException | None:
        error = future.exception()
        return error and ModelFailure(f"the cluster lost it: {error}")


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
    if getattr(_mine, "run", "") != run:
        if hasattr(_mine, "pool"):
            _mine.pool.__exit__(InterruptedError)
        # Dask's workers end with their nanny, and so may have no children, says multiprocessing;
        # this one ends with its worker (`pool.prepare`).
        multiprocessing.current_process()._config["daemon"] = False  # type: ignore[attr-defined]
        _mine.run, _mine.pool = run, Pool(1, memory_mb).__enter__()
        Finalize(None, _mine.pool.__exit__, (InterruptedError,), exitpriority=100)
    (ended,) = _mine.pool.run(deque([Call(function, arguments, seconds)]))
    return Failure(ended.fault) if ended.error else ended.result


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """A `distributed.Client` for a scheduler's address ("tcp://host:8786"), or for "local:N", N
    workers of this machine.

    Work of a worker that dies goes to the others. Raises `InputError` where there is no such
    scheduler, or no `distributed`.
    """
    count = _local_workers(address)
    from distributed import Client, LocalCluster

    if count:
        with (
            LocalCluster(
                n_workers=count, threads_per_worker=1, dashboard_address="127.0.0.1:0"
            ) as cluster,
            Client(cluster) as client,
        ):
            yield client
        return
    try:
        client = Client(address, timeout=10)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"{printable(address)!r}: no scheduler answers there: {printable(error)}", "--scheduler"
        ) from None
    with client:
        yield client


def check_scheduler(address: str) -> None:
    """Raises `InputError` for an address that `connected` cannot use; starts no workers."""
    if not _local_workers(address):
        with connected(address):
            pass


def _local_workers(address: str) -> int:
    """N of "local:N", 0 for the address of a scheduler."""
    if find_spec("distributed") is None:
        raise InputError("needs the package distributed: pip install distributed", "--scheduler")
    kind, _, count = address.partition(":")
    if kind != "local":
        return 0
    if not count.isdecimal() or not 1 <= int(count) <= 256:
        said = f"{printable(address)!r} is not allowed: give local:N with 1 to 256 workers"
        raise InputError(said, "--scheduler")
    return int(count)
