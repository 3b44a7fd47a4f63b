"""Threads that run kernels (`scenes.compiled`), and how Ctrl-C ends the wait for them. Needs no
compiler."""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from queue import SimpleQueue
from typing import TypeVar

Result = TypeVar("Result")


class _Runner:
    """A thread that runs the main thread's kernels, one after another."""

    def __init__(self) -> None:
        self.process = os.getpid()
        self.calls: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while (call := self.calls.get()) is not None:
            call()
            del call  # with the arrays that it was given

    def begin(self, call: Callable[[], Result]) -> Future[Result]:
        """What `call` returns or raises, once it has."""
        ended: Future[Result] = Future()

        def run() -> None:
            try:
                ended.set_result(call())
            except BaseException as error:
                ended.set_exception(error)

        self.calls.put(run)
        return ended

    def end(self) -> None:
        """After the call that it is in, nothing more is to come."""
        self.calls.put(None)


#: The thread that waits for calls, if there is one.
_RUNNERS: list[_Runner] = []


def interruptible(call: Callable[[], Result]) -> Result:
    """The result of `call`, which runs a kernel. Ctrl-C ends the wait at once.

    Python handles a signal only between two of its own steps, and a kernel may run for minutes. The
    main thread is the one that is interrupted; it has the kernel run in a second thread, which is
    kept: to start one takes longer than a short run. After Ctrl-C that thread goes on unobserved,
    and the next call has a new one. So has a forked process.
    """
    if threading.current_thread() is not threading.main_thread():
        return call()
    runner = _RUNNERS.pop() if _RUNNERS else None
    if runner is None or runner.process != os.getpid():
        runner = _Runner()
    try:
        ended = runner.begin(call)
        while not ended.done():
            wait((ended,), timeout=1.0)  # Windows wakes no wait without end
    except BaseException:
        runner.end()
        raise
    _RUNNERS.append(runner)
    return ended.result()


@contextlib.contextmanager
def threads(count: int) -> Iterator[ThreadPoolExecutor]:
    """Threads for kernels. When an exception (Ctrl-C is one) leaves the block, kernels that still
    run are not waited for."""
    pool = ThreadPoolExecutor(count)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()
