"""How long each command takes: `python docs/site_tools/times.py` measures on this machine and keeps
docs/runs/times.json, which docs/running.md quotes."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

import whole_runs

from rockcheck.validation.execute import provenance
from rockcheck.validation.finding import Column, Finding, Made, Table, text

UNITS = (("wall", "wall clock"), ("cpu", "CPU"))
COMMANDS = {
    "simulate fig5a --model ebm-unilateral": "one history of 36 s",
    "validate smoke --out smoke": "six scenes, five models",
    "validate smoke --out smoke --quiet": "the same, read back",
    "validate paper --out paper": "the paper's scenes",
    "assess fig5a --out assess": "one scene, how sure and by hand methods",
    "spectrum fig8 --size 40 --out fig8": "seven spectra of 1,600 pulses",
    "spectrum --out paper-spectra": "28 spectra of 10,000 pulses",
    "conformance --engine mujoco --out conformance": "the cards of an engine",
    "benchmark --quick --out quick": "run time against error, in small",
    "stress --quick --out stress": "some thousand random runs",
}


def measured(command: str, folder: str) -> list[object]:
    """A row: the command, what it does, wall-clock and CPU seconds."""
    began, before = time.perf_counter(), os.times()
    words = [sys.executable, "-m", "rockcheck", *command.split()]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"rockcheck {command}: exit {done.returncode}: {done.stderr}")
    wall, after = time.perf_counter() - began, os.times()
    cpu = sum(after[2:4]) - sum(before[2:4])
    return [f"rockcheck {command.split(' --out')[0]}", COMMANDS[command], wall, cpu]


def main() -> None:
    """Measures all, one after the other."""
    load, began = os.getloadavg()[0], time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        rows = [measured(command, folder) for command in COMMANDS]
    columns = [text("command"), text("what"), *(Column(n, u, "s", digits=2) for n, u in UNITS)]
    about = Made(
        created=time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        jobs=os.cpu_count() or 1,
        wall_seconds=time.perf_counter() - began,
        versions=provenance.versions(),
        hardware={**provenance.hardware(), "load before": f"{load:.1f}"},
    )
    table = Table("commands", columns, rows, "Commands")
    answer = f"{len(rows)} commands, one after the other, models compiled."
    whole_runs.keep(
        "times", Finding("times", "How long commands take", answer, [table], made=about)
    )


if __name__ == "__main__":
    main()
