"""Branch coverage by folder, from what `make coverage` has gathered: `python
tests/coverage_table.py`.

The compiled core (the modules that pyproject.toml exempts from type checking, for the compiler
infers them) has rows of its own: numba runs it unseen, and only the runs with NUMBA_DISABLE_JIT=1
count for it. A share is of lines and branches together, as coverage.py has it.
"""

import json
import subprocess
import sys
import tempfile
import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pandas as pd

ROOT = Path(__file__).parents[1]
LEAST = 90.0
COVERAGE = (sys.executable, "-m", "coverage")
COUNTS = ["num_statements", "num_branches", "covered_lines", "covered_branches"]


def main() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (compiled,) = (
        one["module"]
        for one in settings["tool"]["mypy"]["overrides"]
        if one.get("disallow_untyped_defs") is False
    )
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "coverage.json")
        subprocess.run([*COVERAGE, "json", "-q", "-o", str(file)], check=True, cwd=ROOT)
        found = json.loads(file.read_text(encoding="utf-8"))["files"]
    modules = pd.DataFrame.from_dict(
        {name: one["summary"] for name, one in found.items()}, orient="index"
    )
    dotted = [f"rockcheck.{name.removesuffix('.py').replace('/', '.')}" for name in found]
    inner = [any(fnmatch(name, pattern) for pattern in compiled) for name in dotted]
    folders = [
        f"{Path(name).parent.as_posix()}{', compiled' * one}"
        for name, one in zip(found, inner, strict=True)
    ]
    table = modules[COUNTS].groupby(folders).sum()
    table.loc["all"] = table.sum()
    table["covered, %"] = 100.0 * table[COUNTS[2:]].sum(axis=1) / table[COUNTS[:2]].sum(axis=1)
    print(table.round(1).to_string())
    short = modules.index[modules["percent_covered"] < LEAST]
    if len(short):
        print(f"\nbelow {LEAST:.0f} %:", flush=True)
        subprocess.run(
            [*COVERAGE, "report", "--show-missing", f"--include={','.join(short)}"],
            check=True,
            cwd=ROOT,
        )


if __name__ == "__main__":
    main()
