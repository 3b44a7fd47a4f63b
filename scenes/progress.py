"""How far a run has come: one protocol for models, spectra, studies, suites and pages.

Long work calls `on_progress(done, total, what)`. A model has no argument for it. It calls `tell`,
which reaches the block that is `listening` in the same thread; without one the call costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from threading import Lock
from typing import Protocol


class OnProgress(Protocol):
    """Called now and then with the parts done, the parts in all (of any unit), and a few words on
    what was last."""

    def __call__(self, done: float, total: float, what: str = "") -> None:
        """See the class."""


def unheard(done: float, total: float, what: str = "") -> None:
    """An `OnProgress` that does nothing."""


_listener: ContextVar[OnProgress] = ContextVar("listener", default=unheard)


def tell(done: float, total: float, what: str = "") -> None:
    """Passes the progress on to the listener of this thread, if there is one."""
    _listener.get()(done, total, what)


@contextmanager
def listening(on_progress: OnProgress) -> Iterator[None]:
    """Within this block `on_progress` is called with what models `tell`, in this thread."""
    token = _listener.set(on_progress)
    try:
        yield
    finally:
        _listener.reset(token)


_announcer: Callable[[str], None] | None = None


def announce(words: str) -> None:
    """Says in one line what a user waits for, from any thread. It is silent where no block is
    `announcing`."""
    if _announcer is not None:
        _announcer(words)


def announced() -> bool:
    """Whether a block is `announcing`."""
    return _announcer is not None


def announce_by(say: Callable[[str], None] | None) -> None:
    """From now on `say` gets what is to be announced in this process; None: nobody."""
    global _announcer
    _announcer = say


@contextmanager
def announcing(say: Callable[[str], None] | None) -> Iterator[None]:
    """Within this block `say` gets what is to be announced in this process; None: nobody."""
    before = _announcer
    announce_by(say)
    try:
        yield
    finally:
        announce_by(before)


@dataclass
class Count:
    """Adds up the parts that several threads finish, and tells `on_progress` the sum."""

    on_progress: OnProgress = unheard
    total: float = 0.0
    done: float = 0.0
    _lock: Lock = field(default_factory=Lock, init=False, repr=False)

    def add(self, parts: float) -> None:
        """So many more parts are done."""
        with self._lock:
            self.done += parts
            self.on_progress(self.done, self.total)

    def part(self) -> OnProgress:
        """An `OnProgress` for one part of the whole work."""
        before = 0.0

        def told(done: float, total: float, what: str = "") -> None:
            nonlocal before
            self.add(done - before)
            before = done

        return told
