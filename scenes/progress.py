"""Progress of long work, and the threads that it runs in.

One protocol of progress serves models, spectra, studies, suites and pages.

Long work calls `on_progress(done, total, what)`. A model has no argument for it: it calls `tell`,
which reaches the `LISTENER` of the same thread. Without one the call costs nothing.

Threads run kernels (`scenes.compiled`); Ctrl-C ends the wait for them at once. Needs no compiler.
"""

import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from contextvars import ContextVar
from queue import SimpleQueue
from typing import Any, Protocol, TypeVar

Value = TypeVar("Value")
#: Exit code of a run that Ctrl-C ended.
INTERRUPTED = 130


class OnProgress(Protocol):
    """Callback of long work, called now and then.

    It takes the parts done, the parts in all (of any unit), and a few words on the latest part.
    """

    def __call__(self, done: float, total: float, what: str = "") -> None:
        """See the class."""


def unheard(done: float, total: float, what: str = "") -> None:
    """An `OnProgress` that does nothing."""


#: What receives the progress that models `tell` in this thread.
LISTENER: ContextVar[OnProgress] = ContextVar("listener", default=unheard)


def tell(done: float, total: float) -> None:
    """Pass the progress on to the listener of this thread, if there is one."""
    LISTENER.get()(done, total)


@contextmanager
def within(variable: ContextVar[Value], value: Value) -> Iterator[None]:
    """Within this block, in this thread, the variable has this value."""
    token = variable.set(value)
    try:
        yield
    finally:
        variable.reset(token)


#: What receives this process's announcements; None: nobody does.
announcer: Callable[[str], None] | None = None


def announce(words: str) -> None:
    """Print in one line what a user waits for, from any thread.

    Silent where no block is `announcing`.
    """
    if announcer is not None:
        announcer(words)


@contextmanager
def announcing(say: Callable[[str], None] | None) -> Iterator[None]:
    """Within this block `say` receives this process's announcements; None: nobody does."""
    global announcer
    before, announcer = announcer, say
    try:
        yield
    finally:
        announcer = before


#: Whether a short run does not wait for the compiler: nothing else will be played.
ONE_RUN: ContextVar[bool] = ContextVar("one_run", default=False)


#: The function to call and the future of its result; None ends the thread.
Calls = SimpleQueue[tuple[Callable[[], Any], Future[Any]] | None]
#: The process and the calls of the thread that waits for them, if there is one.
_RUNNERS: list[tuple[int, Calls]] = []


def _serve(calls: Calls) -> None:
    """Run the main thread's kernels, one after another."""
    while (work := calls.get()) is not None:
        call, ended = work
        try:
            ended.set_result(call())
        except BaseException as error:
            ended.set_exception(error)
        del work, call, ended  # and the arrays that the call holds


def interruptible(call: Callable[[], Value]) -> Value:
    """The result of `call`, which runs a kernel. Ctrl-C ends the wait at once.

    Python handles a signal only between two of its own steps, and a kernel may run for minutes. So
    the main thread, which receives the signal, runs the kernel in a second thread. That thread is
    kept: to start one takes longer than a short run. After Ctrl-C it runs on unobserved, and the
    next call starts a new one; so does a forked process.
    """
    if threading.current_thread() is not threading.main_thread():
        return call()
    process, calls = _RUNNERS.pop() if _RUNNERS else (0, Calls())
    if process != os.getpid():
        process, calls = os.getpid(), Calls()
        threading.Thread(target=_serve, args=[calls], daemon=True).start()
    ended: Future[Value] = Future()
    try:
        calls.put((call, ended))
        while not ended.done():
            wait((ended,), timeout=1.0)  # Windows interrupts no wait without a timeout
    except BaseException:
        calls.put(None)
        raise
    _RUNNERS.append((process, calls))
    return ended.result()


@contextmanager
def threads(count: int | None) -> Iterator[ThreadPoolExecutor]:
    """Threads for kernels (None: as many as the machine has cores).

    When an exception (Ctrl-C is one) leaves the block, kernels that still run are not waited for.
    """
    pool = ThreadPoolExecutor(count or os.cpu_count())
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()
