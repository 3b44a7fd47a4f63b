"""`python -m rockcheck`, and the command `rockcheck`."""

import atexit
import gc
import io
import os
import sys
import time
from typing import Any

#: Start of the program, by `time.perf_counter`.
BEGAN = time.perf_counter()


@atexit.register
def _leave_garbage() -> None:
    """Gives the memory back as a whole: a last search for garbage would take 0.3 s.

    Box2D's binding needs it: it would list on stderr all that it still holds.
    """
    if "pyb2d3" not in sys.modules:
        gc.freeze()


class _Pipe(io.FileIO):
    """An output whose reader may close it, as in `rockcheck scenes | head -1`.

    The rest is dropped, and the exit code stays.
    """

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except OSError as error:  # what waits to be written would be tried again as Python ends
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            if not isinstance(error, BrokenPipeError):
                raise
        return len(data)


def main() -> int:
    """Run the command line; returns the exit code."""
    try:
        from rockcheck.commands.cli import main as run
        from rockcheck.scenes import progress
    except KeyboardInterrupt:
        os._exit(130)

    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        # not where somebody else has put another in its place
        if stream is None or stream is not getattr(sys, f"__{name}__"):
            continue
        stream.reconfigure(errors="replace")  # its encoding may know no ✓
        if not stream.isatty():
            pipe = io.BufferedWriter(_Pipe(stream.fileno(), "w", closefd=False))
            at_once = stream.line_buffering or stream.write_through
            text = io.TextIOWrapper(pipe, stream.encoding, "replace", line_buffering=at_once)
            setattr(sys, name, text)
    code = run(began=BEGAN)
    # Compiled code may still run in threads, which Python would wait for.
    if code == progress.INTERRUPTED:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    return code


if __name__ == "__main__":
    sys.exit(main())
