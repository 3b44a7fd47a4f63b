"""The cache of compiled code: what lies in it is unpickled and run, so it must be the user's own,
and whole."""

import gc
import json
import os
import pickle
import runpy
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numba
import numpy as np
import pytest

from rockcheck import ebm
from rockcheck.commands.warm import PARTS
from rockcheck.ebm.core import march
from rockcheck.scenes import compiled
from rockcheck.scenes.progress import announcing

#: A package of one kernel, played in a process of its own; says how many functions were read from
#: the cache and how many compiled.
_TINY = """
import numpy as np
from rockcheck.scenes.compiled import inner_kernel, kernel

@inner_kernel
def twice(x):
    return 2.0 * x

@kernel
def doubled(values):
    total = 0.0
    for value in values:
        total += twice(value)
    return total

if __name__ == "__main__":
    assert doubled(np.array([1.0, 2.0])) == 6.0
    assert doubled(np.array([1.0, 2.0], dtype=np.float32)) == 6.0
    stats = getattr(doubled, "stats", None)
    print("interpreted" if stats is None else \
f"{sum(stats.cache_hits.values())} read, {sum(stats.cache_misses.values())} compiled")
"""


@pytest.fixture
def tiny(tmp_path):
    (tmp_path / "tiny").mkdir()
    path = tmp_path / "tiny" / "kernels.py"
    path.write_text(_TINY)
    return path


@pytest.fixture
def play(tmp_path, tiny):
    def play(said: str, **environment: str) -> str:
        """Play the kernel in a new process; returns its stderr."""
        place = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")} | environment
        done = subprocess.run(
            [sys.executable, str(tiny)],
            capture_output=True,
            text=True,
            env={**os.environ, **place},
            timeout=120,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert done.stdout == f"{said}\n"
        return done.stderr

    return play


@pytest.fixture
def replay(tmp_path, tiny, monkeypatch, capsys):
    monkeypatch.setenv("HOME", str(tmp_path))

    def replay(said: str, cache_dir: str | None = None, user_wide: str = "") -> str:
        """Play the kernel as a new process would, its functions made anew; returns its stderr."""
        monkeypatch.setenv("XDG_CACHE_HOME", user_wide)
        folder = str(tmp_path / "cache") if cache_dir is None else cache_dir
        monkeypatch.setattr(compiled.config, "CACHE_DIR", folder)
        compiled._cache_folder.cache_clear()
        runpy.run_path(str(tiny), run_name="__main__")
        out, err = capsys.readouterr()
        assert out == f"{said}\n"
        return err

    yield replay
    compiled._cache_folder.cache_clear()


@pytest.mark.skipif(compiled.config.DISABLE_JIT, reason="interpreted")
def test_an_inner_kernel_is_linked_and_no_machine_code_is_made_of_it_alone(monkeypatch):
    emitted = []
    finish = compiled.JITCodeLibrary._finalize_specific
    monkeypatch.setattr(
        compiled.JITCodeLibrary,
        "_finalize_specific",
        lambda self: (emitted.append(type(self)), finish(self)),
    )

    @compiled.inner_kernel
    def lowest(x, y):
        return x if x < y else y

    @compiled.inner_kernel
    def middle(x, y, z):
        return max(lowest(x, y), min(max(x, y), z))

    @numba.njit
    def median(rows):
        return [middle(row[0], row[1], row[2]) + lowest(0.0, 1.0) for row in rows]

    assert median(np.array([[1.0, 3.0, 2.0], [5.0, 4.0, 9.0]])) == [2.0, 5.0]
    assert emitted
    assert compiled._Linked not in emitted
    assert lowest(1, 2) == 1  # for Python it stays the function that it is


def test_a_kernel_is_ready_once_it_is_compiled_or_kept(tiny, play):
    """Before, the interpreter plays it; it says the same."""
    begins = 'if __name__ == "__main__":\n'
    asked = "    print(is_ready(doubled, np.ones(1)), interpreted(doubled)(np.array([1.0, 2.0])))\n"
    source = _TINY.replace(begins, begins + asked)
    tiny.write_text(
        source.replace("import inner_kernel", "import inner_kernel, interpreted, is_ready")
    )
    assert play("False 6.0\n0 read, 2 compiled") == ""
    assert play("True 6.0\n2 read, 0 compiled") == ""


def test_the_machine_code_for_some_types_is_the_kernel_that_is_kept(tmp_path, play):
    """A loop in Python takes it once: found for the types of tuples and arrays, and read back by
    the next process."""
    (tmp_path / "tiny" / "kernels.py").write_text(
        _TINY.replace(
            "assert doubled(np", "assert for_types_of(doubled, np.ones(1))(np", 1
        ).replace("import inner_kernel", "import for_types_of, inner_kernel")
    )
    assert play("0 read, 2 compiled") == ""
    assert play("2 read, 0 compiled") == ""
    assert play("interpreted", NUMBA_DISABLE_JIT="1") == ""


def files(tmp_path: Path) -> list[Path]:
    return sorted((tmp_path / "cache").glob("tiny-kernels-*/*.nbc"))


def test_what_was_compiled_is_read_back(tmp_path, play):
    assert play("0 read, 2 compiled") == ""
    assert len(files(tmp_path)) == 2
    assert play("2 read, 0 compiled") == ""
    (tmp_path / "tiny" / "kernels.py").write_text(_TINY.replace("2.0 * x", "x + x"))
    assert play("0 read, 2 compiled") == ""


def test_the_key_is_of_all_that_lies_below_the_package(tmp_path, monkeypatch):
    """A function of rockcheck.ebm.core.march may call one of any module of rockcheck.ebm."""
    assert compiled._package(march.play.py_func) == Path(ebm.__file__).parent
    monkeypatch.setattr(compiled.config, "CACHE_DIR", str(tmp_path / "cache"))
    below = tmp_path / "package" / "core" / "deep.py"
    below.parent.mkdir(parents=True)
    keys = set()
    for text in ("x = 1", "x = 2", "x = 1"):
        below.write_text(text)
        keys.add(compiled._cache_folder.__wrapped__(tmp_path / "package"))
    assert len(keys) == 2


def flipped(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


#: What may lie where a compiled function did, by the place and its content.
DAMAGES = {
    "cut short": lambda path, content: path.write_bytes(content[: len(content) // 2]),
    "a flipped bit": lambda path, content: path.write_bytes(flipped(content)),
    "empty": lambda path, content: path.write_bytes(b""),
    "a folder": lambda path, content: (path / "inside").mkdir(parents=True),
    "a pipe": lambda path, content: os.mkfifo(path),
    "another's pickle": lambda path, content: path.write_bytes(
        pickle.dumps(_Planted(str(path.parents[2] / "ran")))
    ),
    "a link to nowhere": lambda path, content: path.symlink_to(path.with_name("nowhere")),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_compiled_again(tmp_path, replay, damage):
    """And what the planted pickle would do is not done."""
    replay("0 read, 2 compiled")
    for path in files(tmp_path):
        content = path.read_bytes()
        path.unlink()
        DAMAGES[damage](path, content)
    assert replay("0 read, 2 compiled") == ""
    assert replay("2 read, 0 compiled") == ""
    assert not (tmp_path / "ran").exists()


class _Planted:
    """Its pickle makes a file as it is read."""

    def __init__(self, path: str) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[str, ...]]:
        return os.mkdir, (self.path,)


def exchanged(folder: Path) -> None:
    """In its place a link to it stands."""
    folder.symlink_to(folder.rename(folder.parent.parent / "elsewhere"))


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize(
    "spoil",
    [lambda folder: folder.chmod(0o777), exchanged, lambda folder: folder.parent.chmod(0o777)],
    ids=["open to others", "a link", "below a folder that all may change"],
)
def test_a_folder_that_others_may_change_is_not_used(tmp_path, replay, spoil):
    """It is closed to them; else the next place is taken, or none: then one line says so."""
    replay("0 read, 2 compiled")
    (folder,) = (tmp_path / "cache").glob("tiny-kernels-*")
    assert folder.stat().st_mode & 0o777 == 0o700
    spoil(folder)
    assert replay("0 read, 2 compiled") == (
        "rockcheck: no private folder for compiled code, each run compiles anew:"
        " set NUMBA_CACHE_DIR to one of your own\n"
    )


@pytest.mark.needs("POSIX")
def test_a_folder_of_another_user_is_not_used(tmp_path, monkeypatch):
    folder = tmp_path / "cache" / "tiny-kernels-0"
    folder.mkdir(parents=True, mode=0o700)
    assert compiled._is_private(folder, os.getuid())
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    assert not compiled._is_private(folder, os.getuid())


@pytest.mark.needs("POSIX")
def test_no_folder_that_could_be_foreseen(tmp_path, replay):
    """Where the package's folder cannot be written, the user's own cache is taken, never a common
    one."""
    (tmp_path / "tiny" / "__pycache__").write_text("not a folder")
    assert replay("0 read, 2 compiled", cache_dir="") == ""
    assert len(list((tmp_path / ".cache" / "rockcheck").glob("tiny-kernels-*/*.nbc"))) == 2
    assert replay("2 read, 0 compiled", cache_dir="") == ""
    assert "no private folder" in replay("0 read, 2 compiled", cache_dir="", user_wide="/dev/null")


def test_everything_can_be_imported_without_the_compiler():
    """NUMBA_DISABLE_JIT=1, as for a debugger."""
    imports = (
        "import rockcheck, rockcheck.ebm, rockcheck.cm, rockcheck.engines,"
        " rockcheck.ebm.core.bouc_wen"
    )
    play = (
        "scene = rockcheck.load_scene('fig4a').replace(duration=0.2);"
        " print(rockcheck.EventBasedModel().simulate(scene).outcome)"
    )
    command = [sys.executable, "-c", f"{imports}; {play}"]
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout == "at rest\n"


@pytest.mark.needs("POSIX")
def test_the_wait_for_compiled_code_can_be_interrupted(tmp_path):
    """Ctrl-C while a kernel runs for minutes: the process ends at once, with 130."""
    script = tmp_path / "slow.py"
    script.write_text(_SLOW)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    for how in ("one", "many"):
        with subprocess.Popen(
            [sys.executable, str(script), how], stdout=subprocess.PIPE, text=True, env=environment
        ) as running:
            try:
                assert running.stdout.readline() == "begins\n"
                time.sleep(1.0)
                running.send_signal(signal.SIGINT)
                assert running.communicate(timeout=60)[0] == "interrupted\n"
                assert running.returncode == 130
            finally:
                running.kill()


_SLOW = """
import os, signal, sys
from rockcheck.scenes.compiled import kernel
from rockcheck.scenes.progress import interruptible, threads

# a shell's background jobs, and all that they start, ignore Ctrl-C
signal.signal(signal.SIGINT, signal.default_int_handler)

@kernel
def spin(count):
    total = 0.0
    for k in range(count):
        total = (total + k) % 7.0
    return total

spin(1)
print("begins", flush=True)
try:
    if sys.argv[1] == "one":
        interruptible(lambda: spin(10**12))
    else:
        with threads(2) as pool:
            list(pool.map(spin, [10**12] * 4))
except KeyboardInterrupt:
    print("interrupted", flush=True)
    os._exit(130)
"""


def compilation(compiling, module):
    """A compilation of a function of that module, as numba tells of it, that takes a tenth of a
    second."""
    event = SimpleNamespace(
        data={"dispatcher": SimpleNamespace(py_func=SimpleNamespace(__module__=module))}
    )
    compiling.on_start(event)
    compiling.on_start(event)  # of a function that it calls
    time.sleep(0.1)
    compiling.on_end(event)
    compiling.on_end(event)


def test_a_long_compilation_is_announced_once_a_package(monkeypatch):
    """Whoever waits knows for what; of one that is quick nothing is said, nor where nobody
    asked."""
    heard, compiling = [], compiled._Compiling()
    monkeypatch.setattr(compiled, "_SILENT", 60.0)
    with announcing(heard.append):
        compilation(compiling, "rockcheck.ebm.core.march")
        assert heard == []
        monkeypatch.setattr(compiled, "_SILENT", 0.0)
        for module in ("rockcheck.ebm.core.march", "rockcheck.ebm.batch", "rockcheck.cm.kernels"):
            compilation(compiling, module)
    compilation(compiling, "rockcheck.elsewhere")
    assert [words.split(" for this machine")[0] for words in heard] == [
        "compiling the event-based models",
        "compiling the continuous model",
    ]
    assert gc.isenabled()


@pytest.mark.long
def test_what_is_compiled_ahead_is_not_compiled_again(typed):
    """`rockcheck warm` covers what commands need; a second time all of it is there."""
    assert "the continuous model" in typed("warm")[0]
    said = typed("warm", "--json", "--jobs", "1")
    assert list(json.loads(said.out)["seconds"]) == list(PARTS)
    assert said.err == ""
    code = (
        "from rockcheck.commands.warm import PARTS;"
        "[run() for run in PARTS.values()];"
        "from rockcheck.ebm.core import march; print(sum(march.play.stats.cache_misses.values()),"
        " len(march.play.signatures) <= 1)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True
    )
    assert done.stdout == "0 True\n"


def test_each_kind_of_call_is_typed_once(monkeypatch):
    """numba tries all that an operator may mean; for the same types what it found goes for all
    places. Afterwards numba is as it was."""
    plain, asked = numba.types.functions.BaseFunction.get_call_type, []

    def counted(self, context, args, kws):
        asked.append((str(self), args))
        return plain(self, context, args, kws)

    monkeypatch.setattr(numba.types.functions.BaseFunction, "get_call_type", counted)
    powers = numba.njit(pipeline_class=compiled._Compiler)(lambda x: x * x * x * x - x * x)
    assert powers(3.0) == 72.0
    assert len(asked) == len(set(asked)) <= 2
    assert "get_call_type" not in vars(numba.types.Function)
