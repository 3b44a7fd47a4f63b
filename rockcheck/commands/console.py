"""What a command prints: text on stdout, one JSON value, or errors only.

In: the output mode that the user asked for, and values. Out: lines on stdout and stderr. All
commands call it; it imports no numbers, so that an error in the arguments costs nothing.
"""

import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, Literal

from rockcheck.scenes import printable, writing
from rockcheck.scenes.progress import announcing, within

if TYPE_CHECKING:
    from rockcheck.commands.screen import Screen

#: Most lines on what failed that --quiet prints.
MOST_WRONG = 100
#: Output of a command: tables and progress, one JSON value instead, or errors only.
OutputMode = Literal["tables", "json", "quiet"]
#: What the user asked for.
mode: ContextVar[OutputMode] = ContextVar("mode", default="tables")


@contextmanager
def output_mode(wanted: OutputMode) -> Iterator[None]:
    """Within this block commands print in this mode."""
    announce = _print_announcement if wanted == "tables" else None
    with within(mode, wanted), announcing(announce):
        yield


def _print_announcement(words: str) -> None:
    print(f"rockcheck: {words}", file=sys.stderr)


def console() -> "Screen":
    """The console for tables, on stdout; silent with --json and --quiet.

    At most as wide as the terminal, 80 columns where there is none; coloured on a terminal only.
    """
    from rockcheck.commands.screen import Screen

    return Screen(markup=False, emoji=False, highlight=False, quiet=mode.get() != "tables")


def answer(value: Any) -> None:
    """Print the command's result as JSON on stdout, if `--json` asks for it.

    Numbers that are not finite become null.
    """
    if mode.get() == "json":
        print(writing.json_text(value), flush=True)  # before what stderr has to say


def report_file(text: str) -> str:
    """Write a traceback into a file that only the user can read.

    Returns its path, "" where it cannot be written.
    """
    try:
        with tempfile.NamedTemporaryFile(
            "w",
            encoding="utf-8",
            errors="backslashreplace",
            prefix="rockcheck-fault-",
            suffix=".txt",
            delete=False,
        ) as stream:
            stream.write(text)
    except OSError:
        return ""
    return stream.name


def tell_wrong(lines: Sequence[str]) -> None:
    """Print on stderr what failed, where no table on stdout says it: with --quiet."""
    if mode.get() != "quiet":
        return
    for line in lines[:MOST_WRONG]:
        print(printable(f"rockcheck: {line}", 1400), file=sys.stderr)
    if len(lines) > MOST_WRONG:
        print(f"rockcheck: and {len(lines) - MOST_WRONG} more lines", file=sys.stderr)
