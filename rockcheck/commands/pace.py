"""How long a command will still take.

In: how far it has come, each time that a part ends. Out: seconds. Called by the commands' progress.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

#: From so many ends on, the slowest does not count: it may have compiled code, or be unlike others.
ENOUGH = 3


@dataclass
class Pace:
    """An estimate of the time left, by the parts that ended since the work began.

    A part that already takes longer than the estimate is expected to take as long again: so the
    estimate grows while a slow part plays, in place of saying "2 s left" for minutes. `compiles`:
    the first part may wait for a compiler, and says nothing of the others.
    """

    compiles: bool = False
    clock: Callable[[], float] = time.monotonic
    done: float = 0.0
    total: float = 0.0
    _began: float = field(init=False)
    _ended_at: float = field(init=False)
    _is_heard: bool = field(default=False, init=False)
    #: Of each end: the time since the one before, s, and how many parts ended.
    _ends: list[tuple[float, float]] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        self._began = self._ended_at = self.clock()

    @property
    def elapsed(self) -> float:
        """Time since the work began, s."""
        return self.clock() - self._began

    def hear(self, done: float, total: float) -> None:
        """How far the work has come; what is done at the first call was read back, in no time."""
        now = self.clock()
        if self._is_heard and done > self.done:
            self._ends.append((now - self._ended_at, done - self.done))
            self._ended_at = now
        self._is_heard = True
        self.done, self.total = done, total

    @property
    def left(self) -> float | None:
        """Expected time left, s; None before it is known."""
        waiting = self.total - self.done
        ends = self._ends[1:] if self.compiles else self._ends
        if not ends:
            return None
        if waiting <= 0.0:
            return 0.0
        if len(ends) >= ENOUGH:
            ends = sorted(ends)[:-1]
        seconds = sum(taken for taken, _ in ends)
        parts = sum(ended for _, ended in ends)
        since = self.clock() - self._ended_at
        return max(waiting * seconds / parts - since, since)
