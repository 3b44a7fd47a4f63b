"""Calls in processes of their own, with limits of time and memory.

For cells, spectra, studies and pages, on this machine (`Pool`) or beside the workers of a Dask
cluster (`Cluster`).

A process that crashes, hangs or runs out of memory loses its current call, and nothing else. A Dask
worker is protected in the same way: its child process ends, the worker does not. The child is kept
for the next call of the same run, since starting one takes as long as many a call.
"""

import gc
import math
import multiprocessing
import os
import signal
import threading
import time
import traceback
import uuid
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from importlib.util import find_spec
from multiprocessing import context, resource_tracker, util
from typing import Any, Self

from rockcheck.scenes import InputError, ModelFailure, printable, progress

#: One thread a process: the calls are what runs in parallel.
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
#: Calls given out per process: it begins the next while the run reads its last result.
AHEAD = 2
#: Extra time (s) of the first call that uses compiled code, to compile it.
COMPILING = 600.0
#: How often the run looks which calls play, s.
LOOK = 1.0
#: How often a pool begins anew with new processes.
MOST_BREAKS = 10
#: Exit code of a process that ended by itself, told in place of 0.
ENDED = 256
#: Threads that a run allows this process; 0: one a core.
THREADS: ContextVar[int] = ContextVar("threads", default=0)


@dataclass(frozen=True, eq=False)
class Call:
    """A function of a module with arguments that can be pickled, for one process.

    `seconds` limits its wall time. `compiles` names the code that it may have to compile: of the
    calls with the same name one goes first, with `COMPILING` s more, and the others wait for it.
    `key` lets the caller recognise the call.
    """

    function: Callable[..., Any]
    arguments: tuple[Any, ...] = ()
    seconds: float = math.inf
    compiles: str = ""
    key: Any = None


@dataclass(frozen=True)
class Failure:
    """Why a task has no result, in one line. `refused`: the model or study refused its input.

    `timed_out`: it did not end within its time limit.
    `traceback` is given for an unexpected exception, one that is no `ModelFailure`, `InputError` or
    `MemoryError`.
    """

    reason: str
    refused: bool = False
    timed_out: bool = False
    traceback: str = ""


def guarded(function: Callable[..., Any], *arguments: Any) -> Any:
    """What the function returns, or a `Failure` for any exception in it."""
    try:
        return function(*arguments)
    except (ModelFailure, InputError) as error:
        return Failure(printable(error, 300), refused=isinstance(error, InputError))
    except MemoryError:
        return Failure("out of memory")
    except Exception as error:  # a task of whatever kind must not end the run
        return Failure(
            printable(f"{type(error).__name__}: {error}", 300),
            traceback=traceback.format_exc(),
        )


def cores() -> int:
    """Number of threads for this process: one in a worker, else `THREADS`, or one a core."""
    one = os.environ.get("NUMBA_NUM_THREADS") == "1"
    return 1 if one else THREADS.get() or os.cpu_count() or 1


@dataclass(frozen=True, eq=False)
class Ended:
    """A call that has ended: its result, or the error that it or its process ended with."""

    call: Call
    result: Any = None
    error: BaseException | None = None
    #: Its time limit, s.
    seconds: float = math.inf

    @property
    def outcome(self) -> Any:
        """The result, or a `Failure` where there is none."""
        from pebble import ProcessExpired

        match self.error:
            case None:
                return self.result
            case TimeoutError():
                return Failure(f"did not end within {self.seconds:g} s", timed_out=True)
            case ProcessExpired(exitcode=int(code)) if code < 0:
                names = {-one: one.name for one in signal.Signals}
                reason = f"crashed: {names.get(code, f'signal {-code}')}"
            case ProcessExpired():
                reason = f"the process ended with code {(self.error.exitcode or 0) % ENDED}"
            case MemoryError():
                reason = "out of memory"
            case _:
                reason = printable(f"{type(self.error).__name__}: {self.error}", 300)
        return Failure(reason)


class _Worker(context.SpawnProcess):
    # Pebble takes one that ended with 0 for idle, and waits for its call for ever. So ends a call
    # whose code is not Python's, such as Fortran's STOP.
    @property
    def exitcode(self) -> int | None:
        return ENDED if super().exitcode == 0 else super().exitcode


class _Workers(context.SpawnContext):
    # Pebble drops its locks, and with them their names, before it ends its processes. One that is
    # just starting would look for these names in vain, with a traceback.
    Process = _Worker

    def __init__(self) -> None:
        super().__init__()
        self._locks: list[Any] = []

    def RLock(self) -> Any:
        lock = super().RLock()
        self._locks.append(lock)
        return lock


@dataclass(eq=False)
class Pool:
    """`jobs` processes with one thread and at most `memory_mb` each (None: as much as there is).

    A context: when an exception (Ctrl-C is one) leaves it, it ends the processes.
    """

    jobs: int
    memory_mb: float | None = None
    _pool: Any = field(default=None, init=False, repr=False)
    _environment: dict[str, str | None] = field(default_factory=dict, init=False, repr=False)
    _compiled: set[str] = field(default_factory=set, init=False, repr=False)
    _breaks_left: int = field(default=MOST_BREAKS, init=False, repr=False)

    def __enter__(self) -> Self:
        from pebble import ProcessPool

        self._environment = {key: os.environ.get(key) for key in ONE_THREAD}
        os.environ.update(ONE_THREAD)
        self._pool = ProcessPool(
            max_workers=self.jobs,
            context=_Workers(),
            initializer=prepare,
            initargs=(self.memory_mb, progress.announcer is not None),
        )
        try:
            with _interrupts_held():
                if not self._pool.active:  # asking starts it
                    raise RuntimeError("the processes do not start")
        except BaseException as error:
            self.__exit__(type(error))
            raise
        return self

    def __exit__(self, kind: object, *fault: object) -> None:
        try:
            self._pool.close() if kind is None else self._pool.stop()
            self._pool.join()
        finally:
            for key, value in self._environment.items():
                os.environ.pop(key, None) if value is None else os.environ.update({key: value})

    def run(
        self,
        calls: Iterable[Call],
        *,
        until: float = math.inf,
        on_playing: Callable[[list[Call]], None] = lambda calls: None,
    ) -> Iterator[Ended]:
        """Run the calls, and yield each as it ends.

        Calls that have not ended at `until` (of `time.monotonic`) are ended and not yielded. After
        each end, and now and then while none ends, `on_playing` hears which calls play.
        """
        waiting = deque(calls)
        running: dict[Future[Any], tuple[Call, float]] = {}
        told: set[Call] = set()
        try:
            while waiting or running:
                self._mend(waiting, running)
                self._begin(waiting, running)
                on_playing(_playing(running))
                done = _await_end(running, until, on_playing)
                if not done:
                    return
                if self._mend(waiting, running):
                    continue
                for future in sorted(done, key=list(running).index):  # as they were begun
                    call, seconds = running.pop(future)
                    if call not in dict(running.values()):
                        self._compiled.add(call.compiles)
                    if call not in told:
                        told.add(call)
                        error = future.exception()
                        yield Ended(call, None if error else future.result(), error, seconds)
        finally:
            for future in running:
                future.cancel()

    def _mend(self, waiting: deque[Call], running: dict[Future[Any], tuple[Call, float]]) -> bool:
        """Start the processes anew if the pool is broken, and put their calls back to wait.

        Pebble's pool breaks where a process ends before it was heard which call it began.
        """
        if not self._breaks_left or self._pool.active:
            return False
        self._breaks_left -= 1
        self.__exit__(RuntimeError)
        self.__enter__()
        waiting.extendleft(reversed(dict.fromkeys(call for call, _ in running.values())))
        running.clear()
        return True

    def _begin(self, waiting: deque[Call], running: dict[Future[Any], tuple[Call, float]]) -> None:
        """Give each process a call, and one ahead.

        A call that waits for another one to compile is passed over.
        """
        compiling = {
            call.compiles for call, _ in running.values() if call.compiles
        } - self._compiled
        held: list[Call] = []
        room = self._room()
        while waiting and len(running) < room:
            call = waiting.popleft()
            if call.compiles in compiling:
                held.append(call)
                continue
            first = bool(call.compiles) and call.compiles not in self._compiled
            compiling |= {call.compiles} if first else set()
            seconds = call.seconds + COMPILING if first else call.seconds
            running |= dict.fromkeys(self._schedule(call, seconds, first), (call, seconds))
        waiting.extendleft(reversed(held))

    def _room(self) -> int:
        return AHEAD * self.jobs

    def _schedule(self, call: Call, seconds: float, first: bool) -> list[Future[Any]]:
        """Give out a call with a limit of `seconds`; `first`: others wait for it to compile."""
        return [
            self._pool.schedule(
                call.function, args=call.arguments, timeout=None if seconds == math.inf else seconds
            )
        ]


def _await_end(
    running: dict[Future[Any], tuple[Call, float]],
    until: float,
    on_playing: Callable[[list[Call]], None],
) -> set[Future[Any]]:
    """Those that have ended, as soon as there are any; none where `until` comes first."""
    while True:
        left = max(0.0, until - time.monotonic())
        done = wait(running, min(left, LOOK), FIRST_COMPLETED).done
        if done or left <= LOOK:
            return done
        on_playing(_playing(running))


def _playing(running: dict[Future[Any], tuple[Call, float]]) -> list[Call]:
    """The calls that play, not those that wait for a process."""
    return [call for future, (call, _) in running.items() if future.running()]


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Delay Ctrl-C to the end of this block, and hide it from processes and threads started in it.

    Ctrl-C goes to all processes of a terminal. A starting process would die of it, with a
    traceback, before `prepare` makes it ignore the signal. The pool's threads, which replace lost
    workers, inherit this thread's mask.
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


def prepare(memory_mb: float | None, announces: bool = False) -> None:
    """Make this process end with the run, and limit its memory where the system can.

    Its output is discarded, except for messages if it `announces` them, such as a long compilation;
    these go to the run's standard error.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the run itself ends its processes
    # What draws makes many objects and few cycles. To search for these after each 700 new objects
    # would take a seventh of the time of a page.
    gc.set_threshold(10_000)
    if (run := multiprocessing.parent_process()) is not None:
        threading.Thread(target=_follow, args=(run,), daemon=True).start()
    if announces:
        terminal = os.dup(2)
        progress.announcer = lambda words: _write(terminal, f"rockcheck: {words}\n")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # the terminal is the run's; engines greet on it from C
        os.dup2(nowhere, stream)
    with suppress(ImportError, ValueError, OSError):
        import resource

        if memory_mb is not None:
            most = int(memory_mb * 2**20)
            resource.setrlimit(resource.RLIMIT_DATA, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _write(stream: int, text: str) -> None:
    with suppress(OSError):  # nobody reads any more
        os.write(stream, text.encode())


def _follow(run: Any) -> None:
    run.join()
    os._exit(1)


class Cluster(Pool):
    """The workers of a Dask cluster.

    Of the calls that may have to compile the same code, one goes first on each machine.
    """

    def __init__(self, address: str, memory_mb: float | None = None) -> None:
        super().__init__(1, memory_mb)
        self._address, self._run = address, uuid.uuid4().hex
        self._stack, self._breaks_left = ExitStack(), 0  # Dask replaces lost workers itself

    def __enter__(self) -> Self:
        self._pool = self._stack.enter_context(connected(self._address))
        return self

    def __exit__(self, *fault: Any) -> None:
        self._stack.__exit__(*fault)

    def _room(self) -> int:
        return AHEAD * max(1, sum(self._pool.nthreads().values()))

    def _schedule(self, call: Call, seconds: float, first: bool) -> list[Future[Any]]:
        workers = self._pool.scheduler_info(n_workers=-1)["workers"]
        machines = {about["host"]: address for address, about in workers.items()}
        # The machine is a preference only: the calls of a lost worker must go elsewhere.
        wishes = [{"workers": [one], "allow_other_workers": True} for one in machines.values()]
        given = call.function, call.arguments, seconds, self.memory_mb, self._run
        return [
            self._pool.get_executor(pure=False, retries=2, **where).submit(alone, *given)
            for where in (wishes if first and wishes else [{}])
        ]


_mine = threading.local()


def alone(
    function: Callable[..., Any],
    arguments: tuple[Any, ...],
    seconds: float,
    memory_mb: float | None,
    run: str,
) -> Any:
    """Call a function in a child process, kept by this thread for all calls of one run.

    One run means the same code. Returns a `Failure` where the process ends without a result.
    """
    if getattr(_mine, "run", "") != run:
        if hasattr(_mine, "pool"):
            _mine.pool.__exit__(InterruptedError)
        # Dask's workers end with their nanny, and so may have no children, says multiprocessing;
        # this one ends with its worker (`pool.prepare`).
        multiprocessing.current_process()._config["daemon"] = False  # type: ignore[attr-defined]
        _mine.run, _mine.pool = run, Pool(1, memory_mb).__enter__()
        util.Finalize(None, _mine.pool.__exit__, (InterruptedError,), exitpriority=100)
    (ended,) = _mine.pool.run([Call(function, arguments, seconds)])
    return ended.outcome


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """A `distributed.Client` for a scheduler "tcp://host:8786", or for "local:N".

    "local:N" starts N workers on this machine. Work of a worker that dies goes to the others.
    Raises `InputError` where no scheduler answers, or `distributed` is missing.
    """
    count = local_workers(address)
    from distributed import Client, LocalCluster

    with ExitStack() as stack:
        local = {"n_workers": count, "threads_per_worker": 1, "dashboard_address": "127.0.0.1:0"}
        where = stack.enter_context(LocalCluster(**local)) if count else address
        try:
            client = stack.enter_context(Client(where, timeout=10))
        except (OSError, ValueError, TimeoutError) as error:
            raise InputError(
                f"{printable(address)!r}: no scheduler answers there: {printable(error)}",
                "--scheduler",
            ) from None
        yield client


def local_workers(address: str) -> int:
    """N of "local:N", 0 for the address of a scheduler; raises `InputError` as `connected`."""
    if find_spec("distributed") is None:
        raise InputError("needs the package distributed: pip install distributed", "--scheduler")
    kind, _, count = address.partition(":")
    if kind not in ("local", ""):  # for an empty address Dask would start a cluster of its own
        return 0
    if not kind or not count.isdecimal() or not 1 <= int(count) <= 256:
        raise InputError(
            f"{printable(address)!r} is not allowed: give an address, or local:N with 1 to 256"
            " workers",
            "--scheduler",
        )
    return int(count)
