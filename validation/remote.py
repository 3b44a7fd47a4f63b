"""The same cells on a Dask cluster: each in a process of its own beside the Dask worker, with the same limits as at home.

A Dask worker is kept out of harm's way: a crash, a hang or a memory hog ends a child process, not the worker.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from validation.cluster import connected
from validation.workers import COMPILING, ONE_THREAD, BatchTask, Played, Task, death, leaders, play, prepare


class OnCluster:
    """Plays tasks on the Dask cluster at an address, or on "local:N" workers; a `validation.runner.Executor`."""

    def __init__(self, address: str) -> None:
        self.address = address

    def __call__(
        self, tasks: Sequence[Task | BatchTask], *, jobs: int, seconds: Sequence[float], memory_mb: float
    ) -> Iterator[tuple[int, Played]]:
        """Yields (index, result) as they end; the cluster's size, not `jobs`, says how many run at once."""
        if not tasks:
            return
        from distributed import as_completed

        first = leaders(tasks)
        with connected(self.address) as client:
            futures = {}
            for n, task in enumerate(tasks):
                limit = seconds[n] + (COMPILING if n in first else 0.0)  # a cluster's machines compile each for itself
                futures[client.submit(alone, task, limit, memory_mb, pure=False, retries=2)] = n
            for future, result in as_completed(futures, with_results=True, raise_errors=False):
                yield futures[future], result if isinstance(result, Played) else Played(failure=f"the cluster lost it: {result}")


def alone(task: Task | BatchTask, seconds: float, memory_mb: float) -> Played:
    """Play a task in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        given, back = Path(folder) / "task", Path(folder) / "result"
        given.write_bytes(pickle.dumps((task, memory_mb)))
        environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        try:
            done = subprocess.run(
                [sys.executable, "-m", "validation.remote", str(given), str(back)], timeout=seconds, env=environment, check=False
            )
        except subprocess.TimeoutExpired:
            return Played(failure=f"did not end within {seconds:g} s")
        if not back.exists():
            return Played(failure=death(done.returncode))
        result: Played = pickle.loads(back.read_bytes())
        return result


def _child(given: Path, back: Path) -> None:
    task, memory_mb = pickle.loads(given.read_bytes())
    prepare(memory_mb)
    result = pickle.dumps(play(task))
    part = back.with_suffix(".part")
    part.write_bytes(result)
    part.replace(back)


if __name__ == "__main__":
    from validation import remote  # what is pickled here must be known by its real name

    remote._child(Path(sys.argv[1]), Path(sys.argv[2]))
