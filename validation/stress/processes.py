"""Worker processes of a stress run: a task that hangs or kills its process costs itself and nothing else."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

from scenes.errors import printable
from validation.workers import ONE_THREAD, death, prepare

if TYPE_CHECKING:
    from pebble import ProcessPool


@contextmanager
def workers(jobs: int, memory_mb: float) -> Iterator[ProcessPool]:
    """A pool of processes with one thread each; left by an exception (Ctrl-C is one), it ends whatever they do."""
    from pebble import ProcessPool

    before = {key: os.environ.get(key) for key in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        with ProcessPool(max_workers=jobs, context=get_context("spawn"), initializer=prepare, initargs=(memory_mb,)) as pool:
            try:
                yield pool
            except BaseException:
                pool.stop()
                raise
    finally:
        for key, value in before.items():
            os.environ.pop(key, None) if value is None else os.environ.update({key: value})


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
