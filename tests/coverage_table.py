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
from collections import defaultdict
from fnmatch import fnmatch
from itertools import groupby
from pathlib import Path

ROOT = Path(__file__).parents[1]
LEAST = 0.9


def main() -> None:
    """Prints the table, and the modules below nine tenths with their lines."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (compiled,) = (
        one["module"]
        for one in settings["tool"]["mypy"]["overrides"]
        if one.get("disallow_untyped_defs") is False
    )
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "coverage.json")
        subprocess.run(
            [sys.executable, "-m", "coverage", "json", "-q", "-o", str(file)], check=True, cwd=ROOT
        )
        found = json.loads(file.read_text(encoding="utf-8"))["files"]
    rows: defaultdict[str, list[dict[str, int]]] = defaultdict(list)
    short = []
    for name, one in sorted(found.items()):
        module = Path(name).with_suffix("").as_posix().replace("/", ".")
        inner = any(fnmatch(f"rockcheck.{module}", pattern) for pattern in compiled)
        summary = one["summary"]
        rows[f"{Path(name).parent.as_posix()}{', compiled' if inner else ''}"].append(summary)
        if share(summary) < LEAST:
            short.append(f"{name}: {share(summary):.0%}, lines {ranges(one['missing_lines'])}")
    print(f"{'folder':32}{'modules':>8}{'lines':>8}{'branches':>10}{'covered':>9}")
    rows["all"] = [part for parts in rows.values() for part in parts]
    for folder, parts in rows.items():
        total = {
            key: sum(part[key] for part in parts)
            for key in parts[0]
            if isinstance(parts[0][key], int)
        }
        print(
            f"{folder:32}{len(parts):8}{total['num_statements']:8}{total['num_branches']:10}{share(total):9.1%}"
        )
    print(*([f"\nbelow {LEAST:.0%}:", *short] if short else []), sep="\n")


def share(summary: dict[str, int]) -> float:
    """Lines and branches that were run, of all."""
    of = summary["num_statements"] + summary["num_branches"]
    return (summary["covered_lines"] + summary["covered_branches"]) / of if of else 1.0


def ranges(lines: list[int]) -> str:
    """Line numbers, neighbours put together."""
    # Of neighbours the number less the place in the list is the same.
    grouped = groupby(enumerate(lines), key=lambda pair: pair[1] - pair[0])
    spans = [[line for _, line in span] for _, span in grouped]
    return ", ".join(str(s[0]) if len(s) == 1 else f"{s[0]}-{s[-1]}" for s in spans)


if __name__ == "__main__":
    main()
