"""Files and command lines made up by a fuzzer: a result or one clear line, never a traceback, a hang, or a file elsewhere.

A thousand of each in the everyday tests; `ROCKCHECK_FUZZ=100000` asks for more, and then the search follows coverage: inputs
that run new lines of a reader are bred from.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings, target
from hypothesis import strategies as st

from scenes import History, InputError, load_scene
from scenes.records import read_record
from validation.cli import main
from validation.measured import read_measured
from validation.results import Run
from validation.store import Store, name_of
from validation.suites import load_suite

EXAMPLES = int(os.environ.get("ROCKCHECK_FUZZ", "1000"))
GUIDED = EXAMPLES > 1000
fuzzed = settings(
    max_examples=EXAMPLES,
    deadline=5000,
    database=None,
    derandomize=not GUIDED,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large],
)

AT2 = """PEER NGA STRONG MOTION DATABASE RECORD
Imperial Valley-02, 5/19/1940, El Centro Array #9, 180
ACCELERATION TIME SERIES IN UNITS OF G
NPTS=      6, DT=   .0100 SEC,
   .1000000E-02  -.2000000E-02   .3000000E-02   .4D-02   .5E-02
   .6000000E-02
"""
CSV = "# a remark\ntime_s,acceleration_m_s2\n0.0,0.1\n0.01,-0.2\n0.02,0.3\n"
SCENE = """duration = 2.0
output_step = 0.01
[block]
half_width = 0.3
half_height = 1.0
[floor]
friction = 0.4
[[walls]]
side = "left"
gap = 0.02
restitution = 0.5
[excitation]
kind = "ricker"
amplitude = 4.0
period = 0.7
"""
SUITE = """description = "a suite"
reference = "ebm"
scenes = ["fig4a"]
[models.ebm]
"""
HISTORY = "t,theta,x\n0.0,0.1,0.0\n0.1,0.05,0.0\n0.2,-0.01,0.001\n"
NASTY = (
    "nan",
    "inf",
    "-inf",
    "1e999999",
    "1e-999999",
    "-1",
    "0",
    "1" * 400,
    "9" * 30,
    "0x10",
    "1_000",
    "١٢",
    "\x00",
    "\x1b[2J",
    "\x1b]0;x\x07",
    "../../../etc/passwd",
    "/etc/passwd",
    "..",
    "~",
    "<script>alert(1)</script>",
    "'\"><img src=x onerror=alert(1)>",
    "{{7*7}}",
    "%s%n",
    "$(touch x)",
    "`id`",
    "=1+1",
    "\ufeff",
    "\u202e",
    "\ud7ff",
    "\r",
    "\n",
    "\n\n",
    "\t",
    ",",
    ";",
    "#",
    "[",
    "]",
    "[[",
    "=",
    '"',
    '"""',
    "\\",
    "'",
    "NPTS=",
    "DT=",
    "NPTS= 99999999, DT= 0",
    "[" * 3000,
    "{" * 3000,
    "a." * 2000,
    "file = '/dev/zero'",
    "file = '.'",
    "inf = nan",
    "duration = 1e308",
    "output_step = 1e-308",
    "kind = 'record'",
    "unscaled = [1e308, -1e308]",
    "time_step = 1e-320",
    "true",
    "1979-05-27",
)


def mutated(valid: str) -> st.SearchStrategy[bytes]:
    """A valid text with some pieces cut out and nasty ones put in, or bytes of any kind."""
    piece = st.one_of(st.sampled_from(NASTY), st.text(max_size=8), st.floats().map(str), st.integers().map(str))
    edit = st.tuples(st.integers(0, len(valid)), st.integers(0, 12), piece)

    def edited(edits: list[tuple[int, int, str]]) -> bytes:
        text = valid
        for place, cut, new in edits:
            text = text[:place] + new + text[place + cut :]
        return text.encode("utf-8", "surrogatepass")

    return st.one_of(st.lists(edit, min_size=1, max_size=4).map(edited), st.binary(max_size=200))


@contextlib.contextmanager
def followed() -> Iterator[None]:
    """In a long run: tells the search how many lines of our own code an input has run."""
    if not GUIDED:
        yield
        return
    root, lines = str(Path(__file__).parents[2]), set()

    def local(frame: Any, event: str, _: Any) -> Any:
        if event == "line":
            lines.add((frame.f_code.co_filename, frame.f_lineno))
        return local

    def trace(frame: Any, event: str, _: Any) -> Any:
        return local if frame.f_code.co_filename.startswith(root) else None

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        yield
    finally:
        sys.settrace(before)
        target(float(len(lines)), label="lines run")


def assert_one_clear_line(message: str) -> None:
    assert message.strip()
    assert message.isprintable(), f"not one printable line: {message!r}"
    assert len(message) < 1500


def result_or_line(read: Callable[[], Any]) -> Any:
    """What `read` gives, None where it raises a proper `InputError`; anything else is a fault."""
    with followed():
        try:
            return read()
        except InputError as error:
            assert_one_clear_line(str(error))
            return None


@fuzzed
@given(mutated(AT2))
def test_at2(tmp_path, content):
    path = tmp_path / "a.AT2"
    path.write_bytes(content)
    if found := result_or_line(lambda: read_record(path)):
        samples, step = found
        assert len(samples) >= 1
        assert all(map(math.isfinite, samples))
        assert step > 0.0


@fuzzed
@given(mutated(CSV))
def test_record_csv(tmp_path, content):
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    if found := result_or_line(lambda: read_record(path)):
        samples, step = found
        assert len(samples) >= 2
        assert all(map(math.isfinite, samples))
        assert step > 0.0


@fuzzed
@given(mutated(SCENE))
def test_scene_toml(tmp_path, content):
    path = tmp_path / "a.toml"
    path.write_bytes(content)
    if scene := result_or_line(lambda: load_scene(path)):
        assert 0.0 < scene.duration < math.inf
        assert len(scene.output_times) <= 5_000_001


@fuzzed
@given(mutated(SUITE))
def test_suite_toml(tmp_path, content):
    path = tmp_path / "a.toml"
    path.write_bytes(content)
    result_or_line(lambda: load_suite(str(path)))


@fuzzed
@given(mutated(HISTORY))
def test_history_csv(tmp_path, content):
    path = tmp_path / "h.csv"
    path.write_bytes(content)
    for read in (History.load, read_measured):
        if history := result_or_line(lambda read=read: read(path)):
            assert all(map(math.isfinite, history.channels["theta"]))


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """A small finished run as its files: run.json, a history, its events and its record."""
    folder = tmp_path_factory.mktemp("stored")
    scene = load_scene("fig4a").replace(duration=0.5, name="short")
    from ebm import EventBasedModel

    history = EventBasedModel().simulate(scene)
    history.save(folder / "h.csv")
    store = Store(folder)
    files = {".csv": (folder / "h.csv").read_text(), ".events.csv": (folder / "h.events.csv").read_text()}
    store.put("short--ebm--0", files, {"outcome": history.outcome, "cost": {}, "notes": [], "settings": {}})
    scenes = {"short": scene.replace(excitation={"kind": "rest"}).model_dump(mode="json")}
    cell = {"scene": "short", "model": "ebm", "status": "done", "history": "histories/short--ebm--0.csv", "outcome": history.outcome}
    run = Run(suite="s", created="2026-01-01T00:00:00", reference="ebm", scenes=scenes, models=("ebm",), cells=(cell,))
    return {"run.json": run.model_dump_json(), "record": (folder / "histories" / "short--ebm--0.json").read_text(), **files}


@fuzzed
@given(st.data())
def test_stored_run(tmp_path, stored, data):
    (tmp_path / "run.json").write_bytes(data.draw(mutated(stored["run.json"])))
    result_or_line(lambda: Run.load(tmp_path))


@fuzzed
@given(st.data())
def test_stored_record(tmp_path, stored, data):
    """A damaged record is as good as none."""
    store = Store(tmp_path)
    for suffix in (".csv", ".events.csv"):
        (tmp_path / "histories" / f"a{suffix}").write_text(stored[suffix])
    content = data.draw(mutated(stored["record"]))
    (tmp_path / "histories" / "a.json").write_bytes(content)
    (tmp_path / "comparisons" / "a.json").write_bytes(content)
    with followed():
        assert isinstance(store.get("a"), dict | None)
        assert isinstance(store.get_comparison("a"), dict | None)


WORDS = (
    "simulate",
    "compare",
    "report",
    "scenes",
    "new",
    "accept",
    "--model",
    "ebm",
    "ebm-unilateral",
    "cm",
    "fig4a",
    "a.toml",
    "h.csv",
    "h.csv",
    "-o",
    "out.csv",
    "--set",
    "tolerance=1e-8",
    "tolerance=nan",
    "tolerance=[1]",
    "x=",
    "=1",
    "pivot='x'",
    "most_steps=1",
    "--until",
    "--offset",
    "1",
    "nan",
    "-1",
    "--scene",
    "--help",
    "--json",
    "--quiet",
    "--no-such",
    "--",
    "-",
    "",
    ".",
    "..",
    "/",
    "/dev/null/x",
    "no.toml",
    "module:Class",
    "os:system",
    "posixpath:join",
    "*",
    "a" * 5000,
)
#: Commands that would run for minutes, were their arguments ever right.
LONG = {"validate", "accept", "spectrum", "benchmark", "convergence", "stress"}


@fuzzed
@given(st.lists(st.one_of(st.sampled_from(WORDS), st.sampled_from(NASTY), st.text(max_size=6)), max_size=7))
def test_command_line(tmp_path_factory, capsys, words):
    folder = tmp_path_factory.getbasetemp() / "command-line"
    inside = folder / "inside"
    if not inside.exists():
        inside.mkdir(parents=True)
        (inside / "a.toml").write_text(SCENE)
        (inside / "h.csv").write_text(HISTORY)
    words = [word for word in words if word not in LONG or word == "accept"]
    if "accept" in words:
        words = ["accept", "no-such-suite", *[word for word in words if word != "accept"]]
    with contextlib.chdir(inside), followed():
        code = main(words)
    heard = capsys.readouterr()
    assert code in (0, 1, 2, 3)
    assert {path.name for path in folder.iterdir()} == {"inside"}
    assert "\x1b" not in heard.out + heard.err
    if code in (2, 3):
        (line,) = heard.err.splitlines()
        assert line.startswith("rockcheck: ")
        assert_one_clear_line(line)


#: Small files, or small numbers in them, that ask for a great deal.
BOMBS = {
    "a.AT2": "UNITS OF G\nNPTS= 9999999, DT= .01 SEC\n1 2 3\n",
    "b.AT2": "UNITS OF G\nNPTS= 3, DT= 1e-300 SEC\n1 2 3\n",
    "c.AT2": "UNITS OF G\nNPTS= " + "9" * 100_000 + ", DT= .01\n1\n",
    "d.AT2": "UNITS OF G\nNPTS= 1, DT= .01 SEC\n" + "9" * 1_000_000 + "\n",
    "a.csv": "time_s,acceleration_g" + ",x" * 200_000 + "\n0,1\n",
    "b.csv": "time_s,acceleration_g\n" + '"' + "x\n" * 100_000,
    "a.toml": SCENE.replace("output_step = 0.01", "output_step = 1e-300"),
    "b.toml": SCENE.replace("duration = 2.0", "duration = 1e300"),
    "c.toml": "a = " + "[" * 100_000 + "]" * 100_000,
    "d.toml": "a" + ".a" * 100_000 + " = 1",
    "e.toml": SCENE.replace("half_width = 0.3", "half_width = 1e-300"),
    "f.toml": SCENE.replace("period = 0.7", "period = 1e-300"),
    "g.toml": SCENE.replace("half_height = 1.0", "half_height = 1e300"),
    "h.toml": SCENE.replace("amplitude = 4.0", "amplitude = 1e300"),
    "i.toml": SCENE.replace('kind = "ricker"\namplitude = 4.0\nperiod = 0.7', 'kind = "record"\nfile = "/dev/zero"'),
    "j.toml": SCENE.replace(
        'kind = "ricker"\namplitude = 4.0\nperiod = 0.7', 'kind = "sine"\namplitude = 1.0\nperiod = 1e-9\ncycles = 1000'
    ),
    "k.toml": SCENE.replace('kind = "ricker"\namplitude = 4.0\nperiod = 0.7', 'kind = "record"\nunscaled = [1.0, 2.0]\ntime_step = 1e-320'),
    "l.toml": SCENE.replace("gap = 0.02", "gap = 1e-320"),
    "m.toml": SCENE + "gravity = 1e-300\n",
    "n.toml": "gravity = 1e300\n" + SCENE,
    "o.toml": "initial_angular_velocity = 1e300\n" + SCENE,
    "p.toml": "initial_height = 1e300\n" + SCENE,
}

_PLAY_BOMBS = """
import resource, sys, time
from pathlib import Path
import pandas, numba, ebm.trajectory  # what a run needs in any case
resource.setrlimit(resource.RLIMIT_DATA, (2**30, 2**30))
from validation.cli import main
from scenes import InputError
from scenes.records import read_record
for path in sorted(Path(sys.argv[1]).iterdir()):
    began = time.monotonic()
    if path.suffix == ".toml":
        for model in ("ebm", "ebm-unilateral"):
            assert main(["simulate", str(path), "--model", model, "-o", str(Path(sys.argv[2]) / "o.csv")]) in (0, 2, 3), path
    else:
        try:
            read_record(path)
        except InputError as error:
            assert "\\n" not in str(error) and len(str(error)) < 500, path
    print(path.name, round(time.monotonic() - began, 1))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of memory are set as POSIX does")
def test_bombs_stay_below_a_gigabyte_and_a_minute(tmp_path):
    """Files that ask for much are played with 1 GiB of memory: each gives a result or one line."""
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    for name, text in BOMBS.items():
        (tmp_path / "in" / name).write_text(text)
    script = [sys.executable, "-c", _PLAY_BOMBS, str(tmp_path / "in"), str(tmp_path / "out")]
    done = subprocess.run(script, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "Traceback" not in done.stderr
    assert all(len(line) < 600 for line in done.stderr.splitlines())


HOSTILE_NAMES = ("../../outside", "<script>alert(1)</script>", "a\x1b[2Jb", "..", "/etc/x", "a" * 300, "x\ny", "{{7*7}}", "CON")


@pytest.mark.parametrize("name", HOSTILE_NAMES)
def test_names_are_told_from_paths_and_from_markup(tmp_path, name):
    """A scene cannot be called like that; a file name made of any name stays in its folder."""
    (tmp_path / "a.toml").write_text(f"name = {json.dumps(name)}\n" + SCENE)
    if name != "CON":
        with pytest.raises(InputError, match="name") as error:
            load_scene(tmp_path / "a.toml")
        assert_one_clear_line(str(error.value))
    file = tmp_path / f"{name_of(name, 'ebm')}.csv"
    assert file.resolve().parent == tmp_path.resolve()
    assert name_of(name, "ebm").isascii()


def test_a_stored_path_does_not_leave_the_run(tmp_path, stored, capsys):
    """A run's file whose history lies elsewhere is refused, before any page is written."""
    data = json.loads(stored["run.json"])
    (tmp_path / "secret.csv").write_text(stored[".csv"])
    run = tmp_path / "run"
    run.mkdir()
    for path in ("../secret.csv", str(tmp_path / "secret.csv"), "histories/../../secret.csv"):
        data["cells"][0]["history"] = path
        (run / "run.json").write_text(json.dumps(data))
        assert main(["report", str(run)]) == 2
        assert "history" in capsys.readouterr().err
        assert not list(run.glob("**/*.html"))


def test_markup_in_a_stored_run_is_text_on_the_page(tmp_path, stored):
    """Descriptions, reasons and versions of a run that somebody sent are escaped; no text of theirs is a tag."""
    data = json.loads(stored["run.json"])
    evil = "</script><script>alert(1)</script><img src=x onerror=alert(1)>"
    data |= {"description": evil, "suite": evil, "versions": {evil: evil}, "hardware": {evil: evil}, "faults": [evil], "created": evil}
    data["cells"][0] |= {"reason": evil, "notes": [evil]}
    data["scenes"]["short"]["description"] = evil
    (tmp_path / "run.json").write_text(json.dumps(data))
    store = Store(tmp_path)
    store.put("short--ebm--0", {suffix: stored[suffix] for suffix in (".csv", ".events.csv")}, {})
    assert main(["report", str(tmp_path)]) == 0
    pages = [*tmp_path.glob("**/*.html"), *tmp_path.glob("**/data/*.js")]
    assert pages
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert "<script>alert" not in text, page
        assert "<img src=x" not in text, page
    assert "&lt;script&gt;alert" in (tmp_path / "index.html").read_text(encoding="utf-8")


def test_nothing_received_is_executed():
    """No pickle, eval or exec in any module: what a user might receive is read as text.

    `validation.remote` sends tasks to the workers of one's own cluster, as the cluster's library does itself.
    """
    import ast

    root = Path(__file__).parents[2]
    for path in (
        path for package in ("scenes", "ebm", "cm", "engines", "validation", "reports") for path in (root / package).rglob("*.py")
    ):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        names = {node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
        imports = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
        imports |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        assert not names & {"eval", "exec", "compile", "__import__"}, path
        assert path.name == "remote.py" or not imports & {"pickle", "marshal", "shelve", "dill", "cloudpickle"}, path


def test_a_record_names_no_file_but_its_own(tmp_path, stored):
    """Found by fuzzing: a record that names a file with a name too long, or elsewhere, is as good as none."""
    store = Store(tmp_path)
    store.put("a", {suffix: stored[suffix] for suffix in (".csv", ".events.csv")}, {})
    assert store.get("a") == {}
    record = tmp_path / "histories" / "a.json"
    files = json.loads(record.read_text())["files"]
    for name in ("x" * 5000, "/../../../../etc/passwd", "\0", "\ud800"):
        record.write_text(json.dumps({"files": {**files, name: "0"}}))
        assert store.get("a") is None
