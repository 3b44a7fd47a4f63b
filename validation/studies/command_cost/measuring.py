"""The cost of one command: wall clock, CPU and peak memory of a process and its workers.

In: the words of a command and the folder that it runs in. Out: a `Cost`. The tasks of the study
call it.
"""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from rockcheck.scenes import ModelFailure, printable
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.studies.command_cost import launch

#: Bytes of a unit of `ru_maxrss`: macOS counts bytes, other systems kilobytes.
UNIT = 1 if sys.platform == "darwin" else 1024
#: The launcher without the user's site and environment: the smallest process that Python makes.
LAUNCHER = (sys.executable, "-I", "-S", launch.__file__)


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
    launched = subprocess.run(
        [*LAUNCHER, sys.executable, "-m", "rockcheck", *words],
        cwd=folder,
        env=os.environ | environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    if launched.returncode not in (0, 1):
        raise ModelFailure(
            f"rockcheck {' '.join(words)}: exit {launched.returncode}:"
            f" {printable(launched.stderr, 500)}"
        )
    used = json.loads(launched.stdout)
    return Cost(wall=used["wall"], cpu=used["cpu"], peak=float(used["peak"] * UNIT))
