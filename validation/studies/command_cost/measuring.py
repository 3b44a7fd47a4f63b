"""The cost of one command: wall clock, CPU and peak memory of a process and its workers.

In: the words of a command and the folder that it runs in. Out: a `Cost`. The tasks of the study
call it.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from rockcheck.scenes import ModelFailure, printable
from rockcheck.validation.discrepancy.figures import Stored

#: Bytes of a unit of `ru_maxrss`: macOS counts bytes, other systems kilobytes.
UNIT = 1 if sys.platform == "darwin" else 1024


class Cost(Stored):
    """What a command took.

    `wall` is the time (s) that a person waited, `cpu` that of all processors (s), workers included,
    `peak` the memory (bytes) of its largest process.
    """

    wall: float
    cpu: float
    peak: float


def cost_of(words: Sequence[str], folder: Path, environment: dict[str, str]) -> Cost:
    """Run a command of rockcheck in a folder; raises `ModelFailure` where it does not end well.

    A suite out of tolerance (exit 1) costs what it costs.
    """
    began = time.perf_counter()
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(
            [sys.executable, "-m", "rockcheck", *words],
            cwd=folder,
            env=os.environ | environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=errors,
        )
        used = _wait(process)
        wall = time.perf_counter() - began
        if process.returncode not in (0, 1):
            errors.seek(0)
            message = errors.read().decode(errors="replace")
            raise ModelFailure(
                f"rockcheck {' '.join(words)}: exit {process.returncode}: {printable(message, 500)}"
            )
    return Cost(wall=wall, cpu=used.ru_utime + used.ru_stime, peak=float(used.ru_maxrss * UNIT))


def _wait(process: "subprocess.Popen[bytes]") -> resource.struct_rusage:
    """Wait for a process; what it and the processes that it waited for have used."""
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return used
