"""The cache of compiled code: what lies in it is unpickled and run, so it must be the user's own,
and whole. Threads that run kernels: what a call gives, what Ctrl-C leaves of it, what workers
announce."""

import contextlib
import gc
import importlib
import json
import os
import runpy
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numba
import numpy as np
import pytest

from rockcheck.commands.simulate import PARTS
from rockcheck.ebm.core import march
from rockcheck.scenes import compiled, progress
from rockcheck.validation.execute.pool import Call, Pool

#: A package of one kernel. Played, it says whether the kernel was ready, how many functions were
#: read from the cache, and how many compiled. The interpreter and the machine code that is taken
#: for some types say the same as the kernel.
_TINY = """
import numpy as np
from rockcheck.scenes.compiled import for_types_of, inner_kernel, interpreted, is_ready, kernel

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
    ready, values = is_ready(doubled, np.ones(1)), np.array([1.0, 2.0])
    assert not hasattr(doubled, "stats") or interpreted(doubled)(values) == 6.0
    assert for_types_of(doubled, np.ones(1))(values) == doubled(values) == 6.0
    assert doubled(values.astype(np.float32)) == 6.0
    stats = getattr(doubled, "stats", None)
    print("ready" if ready else "not ready", "interpreted" if stats is None else \
f"{sum(stats.cache_hits.values())} read, {sum(stats.cache_misses.values())} compiled")
"""
COMPILED, READ = "0 read, 2 compiled", "2 read, 0 compiled"


@pytest.fixture
def tiny(tmp_path):
    (tmp_path / "tiny").mkdir()
    (tmp_path / "tiny" / "kernels.py").write_text(_TINY)
    return tmp_path / "tiny" / "kernels.py"


@pytest.fixture
def replay(tmp_path, tiny, monkeypatch, capsys):
    monkeypatch.setenv("HOME", str(tmp_path))

    def replay(said: str, cache_dir: str = "cache", user_wide: str = "") -> str:
        """Play the kernel as a new process would, its functions made anew; returns its stderr."""
        monkeypatch.setenv("XDG_CACHE_HOME", user_wide)
        monkeypatch.setattr(
            compiled.config, "CACHE_DIR", str(tmp_path / cache_dir) if cache_dir else ""
        )
        compiled._cache_folder.cache_clear()
        runpy.run_path(str(tiny), run_name="__main__")
        out, err = capsys.readouterr()
        assert out.endswith(f"{said}\n")
        return err

    yield replay
    compiled._cache_folder.cache_clear()


def recorded(monkeypatch, owner, name, about):
    plain, seen = getattr(owner, name), []
    monkeypatch.setattr(owner, name, lambda *given: (seen.append(about(*given)), plain(*given))[1])
    return seen


@pytest.mark.skipif(compiled.config.DISABLE_JIT, reason="interpreted")
def test_the_compiler_does_nothing_twice(monkeypatch):
    """An inner kernel is linked, and no machine code is made of it alone. Each kind of call is
    typed once. Afterwards numba is as it was."""
    emitted = recorded(
        monkeypatch,
        compiled.JITCodeLibrary,
        "_finalize_specific",
        lambda self: self.name.rpartition(".")[2],
    )
    asked = recorded(
        monkeypatch,
        numba.types.functions.BaseFunction,
        "get_call_type",
        lambda self, _, *types: f"{self} {types}",
    )

    @compiled.inner_kernel
    def fourth(x):
        return x * x * x * x

    powers = numba.njit(pipeline_class=compiled._Compiler)(lambda x: fourth(x) - x * x * x)
    # Of a type that nothing else is compiled for; for Python it stays the function that it is.
    assert powers(np.float32(3.0)) == 54.0
    assert fourth(2) == 16
    assert {"<lambda>", "fourth"} & set(emitted) == {"<lambda>"}
    assert len(asked) == len(set(asked)) == 2
    assert "get_call_type" not in vars(numba.types.Function)


def files(tmp_path: Path) -> list[Path]:
    return sorted((tmp_path / "cache").glob("tiny-kernels-*/*.nbc"))


def test_what_was_compiled_is_read_back_until_a_source_of_the_package_changes(
    tmp_path, tiny, replay, monkeypatch
):
    """By a new process, too. A function of rockcheck.ebm.core.march may call one of any module of
    rockcheck.ebm."""
    assert march.play._cache.cache_path.name.startswith("ebm-kernels-")
    assert replay(f"not ready {COMPILED}") == ""
    assert len(files(tmp_path)) == 2
    place = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    again = subprocess.run([sys.executable, str(tiny)], capture_output=True, text=True, env=place)
    assert again.stdout == f"ready {READ}\n"
    assert again.stderr == ""
    (tiny.parent / "core").mkdir()
    for text in ("x = 1", "x = 2"):
        (tiny.parent / "core" / "deep.py").write_text(text)
        assert replay(f"not ready {COMPILED}") == ""
    assert replay(f"ready {READ}") == ""
    monkeypatch.setattr(compiled.config, "DISABLE_JIT", 1)
    assert replay("ready interpreted") == ""


def test_what_was_compiled_is_not_read_back_after_a_change_of_the_scenes(tmp_path, monkeypatch):
    """Kernels of every package may call the cubic of `rockcheck.scenes.interpolation`."""
    scenes, package = tmp_path / "scenes", tmp_path / "tiny"
    for folder in (scenes, package):
        folder.mkdir()
        (folder / "a.py").write_text("x = 1")
    monkeypatch.setattr(compiled, "__file__", str(scenes / "compiled.py"))
    monkeypatch.setattr(compiled.config, "CACHE_DIR", str(tmp_path / "cache"))
    names = []
    for text in ("x = 1", "x = 2", "x = 1"):
        (scenes / "a.py").write_text(text)
        names.append(compiled._cache_folder.__wrapped__(package).name)
    assert names[0] == names[2] != names[1]


@pytest.mark.parametrize("package", ["ebm", "cm", "engines"])
def test_kernels_of_a_package_call_none_of_another_but_of_scenes(package):
    """The key of what was compiled has the sources of these two."""
    root = Path(compiled.__file__).parents[1]
    allowed = {root / package, root / "scenes"}
    for source in sorted((root / package).rglob("*.py")):
        module = importlib.import_module(
            ".".join(["rockcheck", *source.relative_to(root).with_suffix("").parts])
        )
        for value in vars(module).values():
            if isinstance(value, compiled._Inner):
                called = Path(value.py_func.__code__.co_filename)
                assert any(called.is_relative_to(folder) for folder in allowed), called


#: A pickle that makes a folder as it is read.
_EVIL = b"cos\nmkdir\n(Vran\ntR."
#: What may lie where a compiled function did, by the place and its content.
DAMAGES = {
    "cut short": lambda path, content: path.write_bytes(content[: len(content) // 2]),
    "a flipped bit": lambda path, content: path.write_bytes(
        content[:-9] + bytes([content[-9] ^ 1]) + content[-8:]
    ),
    "empty": lambda path, content: path.write_bytes(b""),
    "a folder": lambda path, content: (path / "inside").mkdir(parents=True),
    "a pipe": lambda path, content: os.mkfifo(path),
    "another's pickle": lambda path, content: path.write_bytes(_EVIL),
    "another's pickle below a hash": lambda path, content: path.write_bytes(bytes(32) + _EVIL),
    "a link to nowhere": lambda path, content: path.symlink_to(path.with_name("nowhere")),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_compiled_again_and_not_run(tmp_path, replay, monkeypatch, damage):
    monkeypatch.chdir(tmp_path)
    replay(COMPILED)
    for path in files(tmp_path):
        content = path.read_bytes()
        path.unlink()
        DAMAGES[damage](path, content)
    assert [replay(said) for said in (COMPILED, READ)] == ["", ""]
    assert not (tmp_path / "ran").exists()


#: What may be wrong with the folder of compiled code.
SPOILT = {
    "open to others": lambda folder, patch: folder.chmod(0o777),
    "a link": lambda folder, patch: folder.symlink_to(
        folder.rename(folder.parent.parent / "elsewhere")
    ),
    "below a folder that all may change": lambda folder, patch: folder.parent.chmod(0o777),
    "another user's": lambda folder, patch: patch.setattr(os, "geteuid", lambda: os.getuid() + 1),
}


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize("what", SPOILT)
def test_a_folder_that_others_may_change_is_not_used(tmp_path, replay, monkeypatch, what):
    """It is closed to them; else the next place is taken, or none: then one line says so."""
    replay(COMPILED)
    (folder,) = (tmp_path / "cache").glob("tiny-kernels-*")
    assert folder.stat().st_mode & 0o777 == 0o700
    SPOILT[what](folder, monkeypatch)
    assert replay(COMPILED) == (
        "rockcheck: no private folder for compiled code, each run compiles anew:"
        " set NUMBA_CACHE_DIR to one of your own\n"
    )


@pytest.mark.needs("POSIX")
def test_no_folder_that_could_be_foreseen(tmp_path, replay):
    """Where the package's folder cannot be written, the user's own cache is taken, never a common
    one."""
    (tmp_path / "tiny" / "__pycache__").write_text("not a folder")
    assert [replay(said, cache_dir="") for said in (COMPILED, READ)] == ["", ""]
    assert len(list((tmp_path / ".cache" / "rockcheck").glob("tiny-kernels-*/*.nbc"))) == 2
    assert "no private folder" in replay(COMPILED, cache_dir="", user_wide="/dev/null")


def test_everything_can_be_imported_without_the_compiler():
    code = (
        "import rockcheck, rockcheck.ebm, rockcheck.cm, rockcheck.engines,"
        " rockcheck.ebm.core.bouc_wen;"
        "scene = rockcheck.load_scene('fig4a').replace(duration=0.2);"
        "print(rockcheck.EventBasedModel().simulate(scene).outcome)"
    )
    said = subprocess.check_output(
        [sys.executable, "-c", code], text=True, env={**os.environ, "NUMBA_DISABLE_JIT": "1"}
    )
    assert said == "at rest\n"


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize("how", ["one", "many"])
def test_the_wait_for_compiled_code_can_be_interrupted(tmp_path, how):
    (tmp_path / "slow.py").write_text(_SLOW)
    place = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, str(tmp_path / "slow.py"), how]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=place) as running:
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


def test_a_long_compilation_is_announced_once_a_package(tmp_path, replay, monkeypatch):
    """Whoever waits knows for what; of one that is quick nothing is said."""
    heard: list[str] = []
    with progress.announcing(heard.append):
        for number, (patience, said) in enumerate([(60.0, 0), (0.0, 1), (0.0, 1)]):
            monkeypatch.setattr(compiled, "_SILENT", patience)
            replay(COMPILED, cache_dir=f"cache{number}")
            assert len(heard) == said
    assert heard[0].startswith("compiling __main__ for this machine")
    assert gc.isenabled()


@pytest.mark.long
def test_what_is_compiled_ahead_is_not_compiled_again(typed):
    assert "the continuous model" in typed("warm")[0]
    said = typed("warm", "--json", "--jobs", "1")
    assert list(json.loads(said.out)["seconds"]) == list(PARTS)
    assert said.err == ""
    code = (
        "from rockcheck.commands.simulate import PARTS, compile_part;"
        "[compile_part(name) for name in PARTS];"
        "from rockcheck.ebm.core import march; print(sum(march.play.stats.cache_misses.values()),"
        " len(march.play.signatures) <= 1)"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "0 True\n"


def test_interruptible_calls_share_a_thread_and_a_forked_process_has_its_own():
    first = progress.interruptible(threading.get_ident)
    assert first != threading.get_ident()
    with pytest.raises(ZeroDivisionError):
        progress.interruptible(lambda: 1 // 0)
    assert progress.interruptible(threading.get_ident) == first
    if hasattr(os, "fork"):
        child = os.fork()
        if child == 0:
            signal.alarm(60)
            os._exit(progress.interruptible(lambda: 7))
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7


@pytest.mark.needs("POSIX")
def test_the_call_after_an_interrupted_one_works_while_that_one_goes_on():
    released = threading.Event()
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            progress.interruptible(
                lambda: (os.kill(os.getpid(), signal.SIGINT), released.wait(60.0))
            )
        assert progress.interruptible(lambda: 3) == 3
        assert not released.is_set()
    finally:
        released.set()
        signal.signal(signal.SIGINT, previous)


def test_a_worker_announces_on_the_runs_own_stderr(capfd):
    """Its output goes nowhere otherwise; and it says nothing where the run does not want to hear of
    it."""
    calls = [Call(progress.announce, ("compiling",)), Call(print, ("noise",))]
    for hears, said in (
        (progress.announcing(lambda words: None), "rockcheck: compiling\n"),
        (contextlib.nullcontext(), ""),
    ):
        with hears, Pool(1) as pool:
            assert [ended.error for ended in pool.run(calls)] == [None, None]
        assert capfd.readouterr() == ("", said)
