"""Two hundred hostile cases: files, caches, environments, signals and limits. `python
tests/stress/hostile.py` tries all of them.

Each ends within 60 s with an exit code that it may have, at most one line on stderr, no traceback,
and no file where none belongs. `test_hostile.py` beside this file tries a tenth of them.
"""

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from nasty import AT2, CSV, HISTORY

SECONDS = 60.0
SCENE = """name = "a"
duration = 0.5
output_step = 0.01
block = { half_width = 0.3, half_height = 1.0 }
floor = { friction = 0.4 }
excitation = { kind = "ricker", amplitude = 4.0, period = 0.7 }
"""
SUITE = 'reference = "ebm"\nscenes = ["a.toml"]\n[models.ebm]\n'

#: What a file of any kind may be instead of what it says that it is.
WHOLE: dict[str, Callable[[Path, bytes], object]] = {
    "empty": lambda path, _: path.write_bytes(b""),
    "a null byte": lambda path, _: path.write_bytes(b"\0"),
    "random bytes": lambda path, _: path.write_bytes(bytes(range(256)) * 40),
    "UTF-16": lambda path, valid: path.write_bytes(valid.decode().encode("utf-16")),
    "a byte-order mark": lambda path, valid: path.write_bytes(b"\xef\xbb\xbf" + valid),
    "cut short": lambda path, valid: path.write_bytes(valid[: len(valid) // 2]),
    "twice": lambda path, valid: path.write_bytes(valid + valid),
    "a line of a megabyte": lambda path, valid: path.write_bytes(valid + b"x" * 1_000_000),
    "digits": lambda path, valid: path.write_bytes(valid + b"1" * 100_000 + b"x\n"),
    "blanks": lambda path, valid: path.write_bytes(b" " * 100_000 + b"\n" + valid),
    "commas": lambda path, valid: path.write_bytes(valid + b"," * 200_000),
    "quotes": lambda path, valid: path.write_bytes(valid + b'"' * 100_001),
    "brackets": lambda path, valid: path.write_bytes(b"[" * 100_000 + valid),
    "dots": lambda path, valid: path.write_bytes(b"a" + b".a" * 100_000 + b" = 1\n" + valid),
    "lines": lambda path, valid: path.write_bytes(valid + b"\n" * 1_000_000),
    "remarks": lambda path, valid: path.write_bytes(b"# remark\n" * 100_000 + valid),
    "escapes": lambda path, valid: path.write_bytes(b"\x1b[2J\x1b]0;x\x07" + valid),
    "a pipe": lambda path, _: os.mkfifo(path),
    "a device": lambda path, _: path.symlink_to("/dev/zero"),
    "a folder": lambda path, _: path.mkdir(),
    "a link to itself": lambda path, _: path.symlink_to(path),
    "a link to nowhere": lambda path, _: path.symlink_to(path.with_name("nowhere")),
    "a sparse terabyte": lambda path, _: (path.touch(), os.truncate(path, 2**40)),
}


SIMULATE = ("simulate", "a.toml", "--model", "ebm", "-o", "o.csv")
#: Of each reader: the file, what is valid there, and the command that reads it.
READERS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "scene": ("a.toml", SCENE, SIMULATE),
    "suite": (
        "s.toml",
        SUITE,
        ("validate", "s.toml", "--no-report", "--jobs", "1", "--out", "out"),
    ),
    "history": ("h.csv", HISTORY, ("compare", "h.csv", "good.csv")),
    "AT2": ("r.AT2", AT2, ("simulate", "at2.toml", "--model", "ebm", "-o", "o.csv")),
    "record": ("r.csv", CSV, ("simulate", "record.toml", "--model", "ebm", "-o", "o.csv")),
    "run": ("run/run.json", "{}", ("report", "run")),
}
#: Numbers and words in place of a scene's.
VALUES = (
    "nan",
    "inf",
    "-1.0",
    "0.0",
    "1e308",
    "1e-308",
    "true",
    '"x"',
    "[]",
    "{}",
    "1979-05-27",
    "9" * 400,
)
#: Names of models that a suite or a command line may name, and that run nothing.
CODE = (
    "os:system",
    "subprocess:Popen",
    "builtins:exec",
    "spy:Told",
    "a.b:C",
    "os:",
    ":system",
    "../spy:Told",
)
#: Environments in which `rockcheck scenes` and `--version` work, or say in a line why not.
ENVIRONMENTS = (
    {"NUMBA_DISABLE_JIT": "1"},
    {"NUMBA_CACHE_DIR": "/dev/null/x"},
    {"HOME": "/nonexistent", "XDG_CACHE_HOME": "/nonexistent"},
    {"COLUMNS": "1"},
    {"COLUMNS": "x"},
    {"LC_ALL": "C", "PYTHONUTF8": "0"},
    {"PYTHONIOENCODING": "ascii"},
    {"TERM": "x\x1b"},
    {"TMPDIR": "/nonexistent"},
    {"NO_COLOR": "1", "FORCE_COLOR": "1"},
)
LIMITED = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(getattr(resource, sys.argv[1]), (int(sys.argv[2]),) * 2)
from rockcheck.commands.cli import main
sys.exit(main(sys.argv[3:]))
"""
#: Valid files of every kind.
FILES = {
    **{file: valid for file, valid, _ in READERS.values()},
    "good.csv": HISTORY,
    "at2.toml": re.sub("{ kind.*", '{ kind = "record", file = "r.AT2" }', SCENE),
    "record.toml": re.sub("{ kind.*", '{ kind = "record", file = "r.csv" }', SCENE),
    "spy.py": "from pathlib import Path\n"
    "(Path(__file__).parent / 'imported').write_text('')\n"
    "class Told: pass\n",
}
ROCKCHECK = (sys.executable, "-m", "rockcheck")


@dataclass(frozen=True)
class Case:
    """A command in a prepared folder, the exit codes that it may have, and a signal that it gets
    after some seconds."""

    name: str
    words: tuple[str, ...]
    prepare: Callable[[Path], object] = lambda folder: None
    codes: tuple[int, ...] = (0, 1, 2, 3)
    environment: dict[str, str] = field(default_factory=dict)
    signal_after: float | None = None
    limit: tuple[str, ...] = ()


def cases() -> Iterator[Case]:
    for reader, (file, valid, words) in READERS.items():
        for kind, spoil in WHOLE.items():
            yield Case(
                f"{reader}: {kind}",
                words,
                lambda folder, f=file, v=valid, s=spoil: _replaced(folder / f, v, s),
            )
    for key in ("duration", "half_width", "friction", "amplitude"):
        for value in VALUES:
            text = re.sub(rf"\b{key} = [^,}}\n]+", lambda _, k=key, v=value: f"{k} = {v}", SCENE)
            yield Case(f"scene: {key} = {value[:12]}", SIMULATE, _writes("a.toml", text))
    for name in CODE:
        text = f'{SUITE}[models.x]\nmodel = "{name}"\ncommand = "touch imported"\n'
        yield Case(f"code: {name}", ("validate", "s.toml"), _writes("s.toml", text), (2,))
    for environment in ENVIRONMENTS:
        yield Case(
            f"environment: {environment}", ("scenes",), environment=environment, codes=(0, 2)
        )
    for size in (0, 100, 3000):
        yield Case(f"disk: {size} bytes", SIMULATE, limit=("RLIMIT_FSIZE", str(size)))
    for count in (12, 24):
        yield Case(
            f"files: {count}", ("scenes",), limit=("RLIMIT_NOFILE", str(count)), codes=(0, 1, 2, 70)
        )
    fast = SCENE.replace(
        "amplitude = 4.0, period = 0.7", "amplitude = 1e30, period = 1e-28"
    ).replace("ricker", "sine")
    for wait in (1.5, 4.0):
        spoil = _writes("a.toml", fast)
        yield Case(f"Ctrl-C after {wait} s", SIMULATE, spoil, (0, 2, 3, 130, -2), signal_after=wait)


def _replaced(path: Path, valid: str, spoil: Callable[[Path, bytes], object]) -> None:
    path.unlink(missing_ok=True)
    spoil(path, valid.encode())


def _writes(name: str, text: str) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_text(text)


def try_case(case: Case) -> str:
    """Why a case is not as it should be; empty where it is."""
    with tempfile.TemporaryDirectory() as inside:
        folder = Path(inside)
        (folder / "run").mkdir()
        for name, text in FILES.items():
            (folder / name).write_text(text)
        case.prepare(folder)
        running = subprocess.Popen(
            [sys.executable, "-B", "-c", LIMITED, *case.limit, *case.words]
            if case.limit
            else [*ROCKCHECK, *case.words],
            cwd=folder,
            env={**os.environ, **case.environment},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
        )
        try:
            if case.signal_after is not None:
                time.sleep(case.signal_after)
                running.send_signal(signal.SIGINT)
            _, text = running.communicate(timeout=SECONDS)
        except subprocess.TimeoutExpired:
            running.kill()
            running.communicate()
            return f"did not end within {SECONDS:g} s"
        lines = [
            line for line in text.splitlines() if "no private folder for compiled code" not in line
        ]
        if running.returncode not in case.codes:
            return f"exit code {running.returncode}: {text[-300:]}"
        if running.returncode != -2 and (
            "Traceback" in text or len(lines) > 1 or any(not line.isprintable() for line in lines)
        ):
            return f"stderr: {text[-300:]}"
        if (folder / "imported").exists():
            return "code was run"
        leavings = [path.name for path in folder.rglob("*.part")]
        return f"left behind: {leavings}" if leavings else ""


def main() -> int:
    signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # a shell's background jobs, and all that they start, ignore Ctrl-C
    tried = list(cases())
    faults = 0
    for case in tried:
        if fault := try_case(case):
            faults += 1
            print(f"{case.name}: {fault}", flush=True)
    print(f"{len(tried)} hostile cases, {faults} not as they should be")
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())
