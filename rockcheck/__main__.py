"""`python -m rockcheck`, and the command `rockcheck`."""

import atexit
import gc
import os
import sys
import time
from collections.abc import Sequence

#: Start of the program, by `time.perf_counter`.
BEGAN = time.perf_counter()
# The memory goes back to the system as a whole: a last search for garbage would take 0.3 s.
atexit.register(gc.freeze)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    from rockcheck.commands.cli import main as run
    from rockcheck.scenes.progress import INTERRUPTED

    code = run(arguments, began=BEGAN)
    if code == INTERRUPTED:  # compiled code may still run in threads, which Python would wait for
        os._exit(code)
    return code


if __name__ == "__main__":
    sys.exit(main())
