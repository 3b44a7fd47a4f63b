"""`python -m rockcheck`, and the command `rockcheck`."""

import atexit
import gc
import os
import sys
import time
from collections.abc import Sequence

#: Start of the program, by `time.perf_counter`.
BEGAN = time.perf_counter()


@atexit.register
def _leave_garbage() -> None:
    """Gives the memory back as a whole: a last search for garbage would take 0.3 s.

    Box2D's binding needs it: it would list on stderr all that it still holds.
    """
    if "pyb2d3" not in sys.modules:
        gc.freeze()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    from rockcheck.commands.cli import main as run
    from rockcheck.scenes import progress

    code = run(arguments, began=BEGAN)
    # Compiled code may still run in threads, which Python would wait for.
    if code == progress.INTERRUPTED:
        os._exit(code)
    return code


if __name__ == "__main__":
    sys.exit(main())
