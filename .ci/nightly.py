"""What is too long for each change, on a machine of any kind: `make nightly`, or `NIGHTLY_QUICK=1
make nightly` for some minutes of it.

The slow tests, the whole stress run, what each command costs, a fuzzer for each reader, hostile
cases, and known weaknesses of what is depended on. Every part is run, whatever the others did. The
result goes to docs/nightly.json, which the page "Reliability" shows. Exit 1 where a part failed.
`NIGHTLY_SEED` (default: the day's number) seeds what is random.
"""

from __future__ import annotations

import datetime
import importlib.util
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
KEPT = ROOT / "docs" / "nightly.json"
#: What each command costs, a JSON line a night.
COSTS = ROOT / "docs" / "runs" / "commands.jsonl"
READERS = (
    "at2",
    "record_csv",
    "record_v2",
    "record_esm",
    "record_knet",
    "record_columns",
    "scene_toml",
    "suite_toml",
    "history_csv",
    "stored_run",
    "stored_record",
    "command_line",
)
LOCK = ".ci/requirements.txt"


@dataclass(frozen=True)
class Part:
    """A command, and how to read its figures from what it said; `needs` is a module without which
    it is not run."""

    name: str
    command: tuple[str, ...]
    figures: Callable[[str], str]
    needs: str = ""


@dataclass(frozen=True)
class Done:
    """What became of a part: "passed", "failed" or "not run", its time (s), and its figures in
    words."""

    name: str
    command: str
    result: str
    seconds: float
    figures: str


def last_line(said: str) -> str:
    """The last line that says something."""
    lines = [line.strip(" =") for line in said.splitlines() if line.strip(" =")]
    return lines[-1] if lines else "nothing was said"


def stress_line(said: str) -> str:
    """The line with runs and failures."""
    return next(
        (line for line in said.splitlines() if re.match(r"seed \d+: ", line)), last_line(said)
    )


def fuzz_line(said: str) -> str:
    """The line with inputs and seconds."""
    return next((line for line in said.splitlines() if line.startswith("Done ")), last_line(said))


def audited(said: str) -> str:
    """How many packages were looked up, and what is known of them; pip-audit's JSON is the last
    line."""
    try:
        found = json.loads(last_line(said))["dependencies"]
    except (ValueError, KeyError):
        return last_line(said)
    known = [
        f"{one['name']} {one['version']}: {weak['id']}"
        for one in found
        for weak in one.get("vulns", ())
    ]
    skipped = sum("skip_reason" in one for one in found)
    return f"{len(found) - skipped} of {len(found)} packages looked up; " + (
        "; ".join(known) or "no known weakness"
    )


def parts(quick: bool, seed: int, folder: Path) -> Iterator[Part]:
    """All parts, the shortest first."""
    python = sys.executable
    audit = (
        "-m",
        "pip_audit",
        "-r",
        LOCK,
        "--require-hashes",
        "--disable-pip",
        "--format",
        "json",
        "--progress-spinner",
        "off",
    )
    yield Part("known weaknesses of dependencies", (python, *audit), audited, "pip_audit")
    if (ROOT / "tests/stress/hostile.py").exists():
        yield Part("hostile cases", (python, "tests/stress/hostile.py"), last_line)
    slow = ("-m", "pytest", "-q", "-m", "slow", *(["tests/cm", "tests/engines"] if quick else []))
    yield Part("slow tests", (python, *slow), last_line)
    stress = (
        "-m",
        "rockcheck",
        "stress",
        "--seed",
        str(seed),
        "--out",
        str(folder / "stress"),
        *(["--quick"] if quick else []),
    )
    yield Part("stress", (python, *stress), stress_line)
    costs = (
        "-m",
        "rockcheck",
        "benchmark",
        "commands",
        "--history",
        str(COSTS),
        "--out",
        str(folder / "commands"),
        *(["--quick"] if quick else []),
    )
    yield Part("costs of commands", (python, *costs), last_line)
    for reader in READERS[:2] if quick else READERS:
        options = (
            f"-runs={2000 if quick else 100000}",
            f"-seed={seed}",
            f"-artifact_prefix={folder}/",
        )
        yield Part(
            f"fuzz {reader}",
            (python, "tests/stress/fuzz.py", reader, *options),
            fuzz_line,
            "atheris",
        )


def play(part: Part, folder: Path) -> Done:
    """Runs a part; what it said goes to a file of its name."""
    words = " ".join(part.command).replace(sys.executable, "python").replace(str(folder), "OUT")
    if part.needs and importlib.util.find_spec(part.needs) is None:
        return Done(part.name, words, "not run", 0.0, f"{part.needs} is not installed")
    print(f"nightly: {part.name}: {words}", flush=True)
    began = time.monotonic()
    ended = subprocess.run(
        part.command,
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    (folder / f"{part.name.replace(' ', '-')}.log").write_text(ended.stdout, encoding="utf-8")
    done = Done(
        part.name,
        words,
        "failed" if ended.returncode else "passed",
        round(time.monotonic() - began, 1),
        part.figures(ended.stdout),
    )
    if part.name.startswith("known") and done.figures.startswith("0 of"):
        done = Done(
            part.name,
            words,
            "not run",
            done.seconds,
            f"no list of known weaknesses can be reached: {done.figures}",
        )
    print(
        f"nightly: {part.name}: {done.result} in {done.seconds:.0f} s: {done.figures}", flush=True
    )
    if done.result == "failed":
        print("\n".join(ended.stdout.splitlines()[-40:]), flush=True)
    return done


def commit() -> str:
    """The commit that was tried, with a word where files differ from it."""

    def git(*words: str) -> str:
        return subprocess.run(
            ["git", *words], cwd=ROOT, capture_output=True, text=True, check=False
        ).stdout.strip()

    changed = git(
        "status",
        "--porcelain",
        "--untracked-files=no",
        "--",
        ".",
        ":!docs/nightly.json",
        ":!docs/runs/commands.jsonl",
    )
    return (git("rev-parse", "--short", "HEAD") or "unknown") + (" and changes" if changed else "")


def main() -> int:
    """Runs all parts and keeps their results; the exit code."""
    quick = bool(os.environ.get("NIGHTLY_QUICK"))
    today = datetime.datetime.now(datetime.UTC).date()
    seed = int(os.environ.get("NIGHTLY_SEED") or today.toordinal())
    folder = Path(os.environ.get("NIGHTLY_OUT") or tempfile.mkdtemp(prefix="rockcheck-nightly-"))
    folder.mkdir(parents=True, exist_ok=True)
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    done: list[Done] = []
    for part in parts(quick, seed, folder):
        done.append(play(part, folder))
        kept["short" if quick else "whole"] = {
            "date": today.isoformat(),
            "commit": commit(),
            "seed": seed,
            "python": platform.python_version(),
            "machine": f"{platform.system()}, {platform.machine()}, {os.cpu_count()} cores",
            "parts": [asdict(one) for one in done],
        }
        # After each part: a night that is cut short keeps what it has found.
        KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    print(f"nightly: {KEPT.relative_to(ROOT)} has the results; what was said is in {folder}")
    return int(any(one.result == "failed" for one in done))


if __name__ == "__main__":
    sys.exit(main())
