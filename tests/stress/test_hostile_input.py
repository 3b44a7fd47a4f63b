"""Files and command lines made up by a fuzzer: a result or one clear line, never a traceback, a
hang, or a file elsewhere.

Each reader is a function of any bytes. Here Hypothesis makes a thousand inputs for each, from the
shape that a valid one has; `fuzz.py` beside this file makes a hundred thousand each night, and
follows which lines of the readers they reach.
"""

from __future__ import annotations

import contextlib
import functools
import gzip
import io
import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rockcheck.commands.cli import main
from rockcheck.scenes import History, InputError, load_scene
from rockcheck.scenes.recordings import read_components
from rockcheck.validation.discrepancy.measured import read_measured
from rockcheck.validation.execute.models import build
from rockcheck.validation.execute.store import COMPARISONS, SUFFIXES, TABLE, Store, _sealed, name_of
from rockcheck.validation.suite.results import Run
from rockcheck.validation.suite.suites import load_suite

fuzzed = settings(
    max_examples=1000,
    deadline=5000,
    database=None,
    derandomize=True,
    suppress_health_check=[
        HealthCheck.function_scoped_fixture,
        HealthCheck.too_slow,
        HealthCheck.data_too_large,
    ],
)

AT2 = """PEER NGA STRONG MOTION DATABASE RECORD
Imperial Valley-02, 5/19/1940, El Centro Array #9, 180
ACCELERATION TIME SERIES IN UNITS OF G
NPTS=      6, DT=   .0100 SEC,
   .1000000E-02  -.2000000E-02   .3000000E-02   .4D-02   .5E-02
   .6000000E-02
"""
CSV = "# a remark\ntime_s,acceleration_m_s2\n0.0,0.1\n0.01,-0.2\n0.02,0.3\n"
V2 = """Corrected accelerogram   89146-L2500-12044.02       Chan  1: 360 Deg     from
 100 Integer-header values follow on  10 lines, Format= (10I8)
 100 Real-header values follow on  4 lines, Format= (10F8.3)
     0.0     0.0     0.0
     0.0     0.0     0.0
     0.0     0.0     0.0
     0.0     0.0     0.0   0.005
       9 acceleration pts, approx    0 secs, units=cm/sec2 (04),Format=(8F10.5)
   0.10000   0.20000   0.30000   0.40000   0.50000  -0.60000   0.70000   0.80000
   0.90000
 3 points of accel data equally spaced at  .005 sec, in cm/sec2. (8f10.6)
  -.000010  -.000009  -.000010
"""
ESM = (
    "EVENT_NAME: X\nSAMPLING_INTERVAL_S: 0.005000\nNDATA: 3\nSTREAM: HNN\nUNITS: cm/s^2\n"
    "DATA_TYPE: ACCELERATION\n0.1\n-0.2\n0.3\n"
)
KNET = """Origin Time       2011/03/11 14:46:00
Sampling Freq(Hz) 100Hz
Duration Time(s)  .08
Dir.              N-S
Scale Factor      3920(gal)/6182761
Memo.
     4711     4712     4709     4711     4715     4711     4700     4711
"""
COLUMNS = "of a table\n t [s];acc [cm/s2];x\n5,00;0,1;0\n5,01;0,2;0\n5,02;-0,3;0\n"
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
LONG = {"validate", "accept", "spectrum", "benchmark", "stress"}


#: Between the words of a command line in an input.
BETWEEN = "\x1f"


def assert_one_clear_line(message: str) -> None:
    assert message.strip()
    assert message.isprintable(), f"not one printable line: {message!r}"
    assert len(message) < 1500


def result_or_line(read: Callable[[], Any]) -> Any:
    """What `read` gives, None where it raises a proper `InputError`; anything else is a fault."""
    try:
        return read()
    except InputError as error:
        assert_one_clear_line(str(error))
        return None


def feed_record(content: bytes, folder: Path, name: str) -> None:
    path = folder / name
    path.write_bytes(content)
    for found in result_or_line(lambda: read_components(path)) or []:
        assert len(found.samples) >= 1
        assert all(map(math.isfinite, found.samples))
        assert 0.0 < found.time_step < math.inf


def feed_scene(content: bytes, folder: Path) -> None:
    path = folder / "a.toml"
    path.write_bytes(content)
    if scene := result_or_line(lambda: load_scene(path)):
        assert 0.0 < scene.duration < math.inf
        assert len(scene.output_times) <= 5_000_001


def feed_suite(content: bytes, folder: Path) -> None:
    path = folder / "a.toml"
    path.write_bytes(content)
    result_or_line(lambda: load_suite(str(path)))


def feed_history(content: bytes, folder: Path) -> None:
    path = folder / "h.csv"
    path.write_bytes(content)
    for read in (History.load, read_measured):
        if history := result_or_line(lambda read=read: read(path)):
            assert all(map(math.isfinite, history.channels["theta"]))


@functools.cache
def stored_files() -> dict[str, bytes]:
    """A small finished run as its files: run.json, a history, its events and its record."""
    from rockcheck.ebm import EventBasedModel

    scene = load_scene("fig4a").replace(duration=0.5, name="short")
    history = EventBasedModel().simulate(scene)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        history.save(folder / "h.csv.gz")
        files = {suffix: (folder / f"h{suffix}").read_bytes() for suffix in SUFFIXES}
        Store(folder).put(
            "short--ebm--0",
            files,
            {"outcome": history.outcome, "cost": {}, "notes": [], "settings": {}},
        )
        record = (folder / "histories" / "short--ebm--0.json").read_bytes()
    scenes = {"short": scene.replace(excitation={"kind": "rest"}).model_dump(mode="json")}
    cell = {
        "scene": "short",
        "model": "ebm",
        "status": "done",
        "history": "histories/short--ebm--0.csv.gz",
        "outcome": history.outcome,
    }
    run = Run(
        suite="s",
        created="2026-01-01T00:00:00",
        reference="ebm",
        scenes=scenes,
        models=("ebm",),
        cells=(cell,),
    )
    return {"run.json": run.model_dump_json().encode(), "record": record, **files}


def feed_stored_run(content: bytes, folder: Path) -> None:
    (folder / "run.json").write_bytes(content)
    result_or_line(lambda: Run.load(folder))


def feed_stored_record(content: bytes, folder: Path) -> None:
    """A damaged record is as good as none."""
    store = Store(folder)
    for suffix in SUFFIXES:
        (folder / "histories" / f"a{suffix}").write_bytes(stored_files()[suffix])
    (folder / "histories" / "a.json").write_bytes(content)
    (folder / "comparisons" / "a.json").write_bytes(content)
    assert isinstance(store.get("a"), dict | None)
    assert isinstance(store.get_record(COMPARISONS, "a"), dict | None)


def feed_command_line(content: bytes, folder: Path) -> None:
    """`content` holds the words, with `BETWEEN` between them."""
    inside = folder / "inside"
    if not inside.exists():
        inside.mkdir()
        (inside / "a.toml").write_text(SCENE)
        (inside / "h.csv").write_text(HISTORY)
        for model in (
            "ebm",
            "ebm-unilateral",
            "cm",
        ):  # compiled now, not while an input has its time
            build(model, {}).simulate(load_scene(inside / "a.toml"))
    words = [
        word
        for word in content.decode("utf-8", "replace").split(BETWEEN)
        if word not in LONG or word == "accept"
    ]
    if "accept" in words:
        words = ["accept", "no-such-suite", *[word for word in words if word != "accept"]]
    out, err = io.StringIO(), io.StringIO()
    with contextlib.chdir(inside), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(words)
    assert code in (0, 1, 2, 3)
    assert {path.name for path in folder.iterdir()} == {"inside"}
    assert "\x1b" not in out.getvalue() + err.getvalue()
    if code in (2, 3):
        (line,) = err.getvalue().splitlines()
        assert line.startswith("rockcheck: ")
        assert_one_clear_line(line)


#: Of each reader: what feeds it, and a valid input.
READERS: dict[str, tuple[Callable[[bytes, Path], None], Callable[[], str]]] = {
    "at2": (functools.partial(feed_record, name="a.AT2"), lambda: AT2),
    "record_csv": (functools.partial(feed_record, name="a.csv"), lambda: CSV),
    "record_v2": (functools.partial(feed_record, name="a.V2"), lambda: V2),
    "record_esm": (functools.partial(feed_record, name="a.ASC"), lambda: ESM),
    "record_knet": (functools.partial(feed_record, name="a.NS"), lambda: KNET),
    "record_columns": (functools.partial(feed_record, name="a.txt"), lambda: COLUMNS),
    "scene_toml": (feed_scene, lambda: SCENE),
    "suite_toml": (feed_suite, lambda: SUITE),
    "history_csv": (feed_history, lambda: HISTORY),
    "stored_run": (feed_stored_run, lambda: stored_files()["run.json"].decode()),
    "stored_record": (feed_stored_record, lambda: stored_files()["record"].decode()),
    "command_line": (
        feed_command_line,
        lambda: BETWEEN.join(("simulate", "a.toml", "--model", "ebm", "-o", "out.csv")),
    ),
}


def mutated(valid: str) -> st.SearchStrategy[bytes]:
    """A valid text with some pieces cut out and nasty ones put in, or bytes of any kind."""
    piece = st.one_of(
        st.sampled_from(NASTY), st.text(max_size=8), st.floats().map(str), st.integers().map(str)
    )
    edit = st.tuples(st.integers(0, len(valid)), st.integers(0, 12), piece)

    def edited(edits: list[tuple[int, int, str]]) -> bytes:
        text = valid
        for place, cut, new in edits:
            text = text[:place] + new + text[place + cut :]
        return text.encode("utf-8", "surrogatepass")

    return st.one_of(st.lists(edit, min_size=1, max_size=4).map(edited), st.binary(max_size=200))


COMMAND_LINES = st.lists(
    st.one_of(st.sampled_from(WORDS), st.sampled_from(NASTY), st.text(max_size=6)), max_size=7
).map(lambda words: BETWEEN.join(words).encode("utf-8", "surrogatepass"))


@pytest.mark.long
@pytest.mark.parametrize("reader", READERS)
def test_any_input(tmp_path, reader):
    """A result or one clear line, which each `feed_...` asserts of what it is given; all else is
    raised."""
    feed, valid = READERS[reader]
    feed(valid().encode(), tmp_path)

    @fuzzed
    @given(COMMAND_LINES if reader == "command_line" else mutated(valid()))
    def fed(content: bytes) -> None:
        feed(content, tmp_path)

    fed()


@pytest.fixture(scope="module")
def stored() -> dict[str, str]:
    return stored_files()


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
    "i.toml": SCENE.replace(
        'kind = "ricker"\namplitude = 4.0\nperiod = 0.7', 'kind = "record"\nfile = "/dev/zero"'
    ),
    "j.toml": SCENE.replace(
        'kind = "ricker"\namplitude = 4.0\nperiod = 0.7',
        'kind = "sine"\namplitude = 1.0\nperiod = 1e-9\ncycles = 1000',
    ),
    "k.toml": SCENE.replace(
        'kind = "ricker"\namplitude = 4.0\nperiod = 0.7',
        'kind = "record"\nunscaled = [1.0, 2.0]\ntime_step = 1e-320',
    ),
    "l.toml": SCENE.replace("gap = 0.02", "gap = 1e-320"),
    "m.toml": SCENE + "gravity = 1e-300\n",
    "n.toml": "gravity = 1e300\n" + SCENE,
    "o.toml": "initial_angular_velocity = 1e300\n" + SCENE,
    "p.toml": "initial_height = 1e300\n" + SCENE,
}

_PLAY_BOMBS = """
import resource, sys, time
from pathlib import Path
import pandas, numba, ebm.core.march  # what a run needs in any case
resource.setrlimit(resource.RLIMIT_DATA, (2**30, 2**30))
from rockcheck.commands.cli import main
from rockcheck.scenes import InputError
from rockcheck.scenes.recordings import read_record
for path in sorted(Path(sys.argv[1]).iterdir()):
    began = time.monotonic()
    if path.suffix == ".toml":
        for model in ("ebm", "ebm-unilateral"):
            assert main(["simulate", str(path), "--model", model, "-o", \
str(Path(sys.argv[2]) / "o.csv")]) in (0, 2, 3), path
    else:
        try:
            read_record(path)
        except InputError as error:
            assert "\\n" not in str(error) and len(str(error)) < 500, path
    print(path.name, round(time.monotonic() - began, 1))
"""


@pytest.mark.needs("POSIX")
def test_bombs_stay_below_a_gigabyte_and_a_minute(tmp_path):
    """Files that ask for much are played with 1 GiB of memory: each gives a result or one line."""
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    for name, text in BOMBS.items():
        (tmp_path / "in" / name).write_text(text)
    script = [sys.executable, "-c", _PLAY_BOMBS, str(tmp_path / "in"), str(tmp_path / "out")]
    done = subprocess.run(script, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "Traceback" not in done.stderr
    assert all(len(line) < 600 for line in done.stderr.splitlines())


HOSTILE_NAMES = (
    "../../outside",
    "<script>alert(1)</script>",
    "a\x1b[2Jb",
    "..",
    "/etc/x",
    "a" * 300,
    "x\ny",
    "{{7*7}}",
    "CON",
)


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
    (tmp_path / "secret.csv").write_bytes(gzip.decompress(stored[TABLE]))
    run = tmp_path / "run"
    run.mkdir()
    for path in ("../secret.csv", str(tmp_path / "secret.csv"), "histories/../../secret.csv"):
        data["cells"][0]["history"] = path
        (run / "run.json").write_text(json.dumps(data))
        assert main(["report", str(run)]) == 2
        assert "history" in capsys.readouterr().err
        assert not list(run.glob("**/*.html"))


def test_markup_in_a_stored_run_is_text_on_the_page(tmp_path, stored):
    """Descriptions, reasons and versions of a run that somebody sent are escaped; no text of theirs
    is a tag."""
    data = json.loads(stored["run.json"])
    evil = "</script><script>alert(1)</script><img src=x onerror=alert(1)>"
    data |= {
        "description": evil,
        "suite": evil,
        "versions": {evil: evil},
        "hardware": {evil: evil},
        "faults": [evil],
        "created": evil,
    }
    data["cells"][0] |= {"reason": evil, "notes": [evil]}
    data["scenes"]["short"]["description"] = evil
    (tmp_path / "run.json").write_text(json.dumps(data))
    store = Store(tmp_path)
    store.put("short--ebm--0", {suffix: stored[suffix] for suffix in SUFFIXES}, {})
    assert main(["report", str(tmp_path)]) == 0
    pages = [*tmp_path.glob("**/*.html"), *tmp_path.glob("**/data/*.js")]
    assert pages
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert "<script>alert" not in text, page
        assert "<img src=x" not in text, page
    assert "&lt;script&gt;alert" in (tmp_path / "index.html").read_text(encoding="utf-8")


def test_a_record_names_no_file_but_its_own(tmp_path, stored):
    """Found by fuzzing: a record that names a file with a name too long, or elsewhere, is as good
    as none."""
    store = Store(tmp_path)
    store.put("a", {suffix: stored[suffix] for suffix in SUFFIXES}, {})
    assert store.get("a") == {}
    record = tmp_path / "histories" / "a.json"
    files = json.loads(record.read_text())["content"]["files"]
    for name in ("x" * 5000, "/../../../../etc/passwd", "\0", "\ud800"):
        record.write_text(_sealed("a", {"files": {**files, name: "0"}}))
        assert store.get("a") is None


def test_a_heading_in_quotes(tmp_path):
    """Found by fuzzing: a measured history whose heading is quoted, as some programs write it,
    ended in a traceback."""
    path = tmp_path / "h.csv"
    path.write_text('\ufeff"t_s","theta_deg" # a remark\n0.0,90.0\n0.5,0.0\n', encoding="utf-8")
    assert read_measured(path).channels["theta"].tolist() == [math.pi / 2, 0.0]


def test_a_heading_with_control_characters(tmp_path):
    """Found by fuzzing: what a heading has twice is told without the characters that would steer a
    terminal."""
    path = tmp_path / "h.csv"
    path.write_bytes(b"t,theta,\x1b[2Jx,\x1b[2Jx\n0,0,0,0\n")
    with pytest.raises(InputError) as error:
        read_measured(path)
    assert_one_clear_line(str(error.value))


def test_rows_longer_than_the_heading(tmp_path):
    """Found by fuzzing: their first value was left out, and all others were taken for the column
    before theirs."""
    path = tmp_path / "h.csv"
    path.write_text("t,theta\n0.0,0.1,7\n0.5,0.2,7\n")
    for read in (History.load, read_measured):
        with pytest.raises(InputError, match="rows have more values than the heading has columns"):
            read(path)


def test_a_column_that_is_there_twice(tmp_path):
    """Found by fuzzing: names that differ only in blanks around them ended in a traceback."""
    path = tmp_path / "h.csv"
    path.write_text("t,theta, t\n0.0,0.1,nan\n0.5,0.2,nan\n")
    with pytest.raises(InputError, match="two columns 't'"):
        History.load(path)
    with pytest.raises(InputError, match="gives t a second time"):
        read_measured(path)


def test_a_path_does_not_steer_the_terminal(tmp_path, monkeypatch, capsys):
    """Found by fuzzing: what a file is called was written to the terminal as it is; so was the name
    in a history's header."""
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "fig4a", "--model", "ebm", "-o", "a\x1b]0;x\x07\udcff.csv"]) == 0
    said = '"{""name"": ""\\u001b[2J"", ""model"": ""\\u001b[2J""}"'
    (tmp_path / "h.csv").write_text(f"t,theta,rockcheck_history\n0.0,0.1,{said}\n0.5,0.2,\n")
    assert main(["compare", "h.csv", "h.csv"]) in (0, 1)
    heard = capsys.readouterr()
    assert "history: a?]0;x??.csv" in heard.out
    assert "\x1b" not in heard.out + heard.err
