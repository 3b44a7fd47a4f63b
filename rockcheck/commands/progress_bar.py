"""Progress and the time left on stderr: a bar on a terminal, lines elsewhere.

In: how much is done, of how much. Out: what a person sees who waits. Commands that play call
it.
"""

import sys
import threading
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    Task as ProgressTask,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text

from rockcheck.commands.console import mode
from rockcheck.commands.pace import Pace
from rockcheck.scenes import printable
from rockcheck.scenes.progress import OnProgress
from rockcheck.validation.execute.models import compiles

#: Time between two lines of progress, s; and before the first one, which is printed only if more
#: than `EVERY` is left.
EVERY, EARLY = 10.0, 2.0


@contextmanager
def progress(
    title: str, models: Iterable[tuple[str, Mapping[str, Any]]] = ()
) -> Iterator[OnProgress]:
    """Show progress and the time left on stderr: a bar on a terminal, elsewhere lines.

    It says if one of the `models` (family, settings) that play may compile first. Nothing is shown
    where a command is quiet.
    """
    may_compile = any(compiles(*model) for model in models)
    title += ", may compile first" * may_compile
    screen, pace = Console(stderr=True), Pace(compiles=may_compile)
    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(20),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TimeLeft(pace),
        console=screen,
        transient=True,
        disable=mode.get() != "tables" or not screen.is_terminal,
    )
    bar.add_task(title, total=None, what="")
    (task,) = bar.tasks

    def on_progress(done: float, total: float, what: str = "") -> None:
        pace.hear(done, total)
        bar.update(
            task.id,
            total=total,
            completed=done,
            description=f"{title}: {printable(what, 24)}" if what else title,
            what=what,
        )

    over = threading.Event()
    if bar.disable and mode.get() != "quiet":
        threading.Thread(target=tell_lines, args=[title, task, pace, over], daemon=True).start()
    with nullcontext() if bar.disable else bar:
        try:
            yield on_progress
        finally:
            over.set()


def tell_lines(title: str, task: ProgressTask, pace: Pace, over: threading.Event) -> None:
    """Print lines of progress for a log until the work is `over`.

    None for a work of a few seconds.
    """
    wait = EARLY
    while not over.wait(wait):
        left = pace.left
        if wait == EVERY or (left is not None and left > EVERY):
            parts = f"{pace.done:.0f} of {pace.total:.0f}, " if pace.total else ""
            what = f" ({printable(task.fields['what'], 60)})" if task.fields["what"] else ""
            words = f"{parts}{time_words(pace)}{what}"
            print(f"rockcheck: {title}: {words}", file=sys.stderr, flush=True)
        wait = EVERY


def time_words(pace: Pace) -> str:
    """The time left, as "2:05 left"; before that is known the time so far."""
    left = pace.left
    minutes, seconds = divmod(int(pace.elapsed if left is None else left), 60)
    return f"{minutes}:{seconds:02d} {'so far' if left is None else 'left'}"


class TimeLeft(ProgressColumn):
    """The time left in a bar."""

    def __init__(self, pace: Pace) -> None:
        super().__init__()
        self.pace = pace

    def render(self, task: ProgressTask) -> Text:
        """The words of the time left; none before it is known."""
        return Text("" if self.pace.left is None else time_words(self.pace), style="cyan")
