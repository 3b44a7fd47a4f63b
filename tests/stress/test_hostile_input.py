"""Files and command lines made up by a fuzzer: a result or one clear line, never a traceback, a
hang, or a file elsewhere.

Each reader is a function of any bytes. Here Hypothesis makes a thousand inputs for each, from the
shape that a valid one has; `fuzz.py` beside this file makes a hundred thousand each night, and
follows which lines of the readers they reach.
"""

import contextlib
import functools
import gzip
import io
import json
import math
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import nasty
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from rockcheck.commands.cli import main
from rockcheck.scenes import History, InputError, Scene, load_scene, recordings
from rockcheck.scenes.history_files import HEAD
from rockcheck.validation.execute import models
from rockcheck.validation.execute.store import (
    COMPARISONS,
    HISTORIES,
    SUFFIXES,
    TABLE,
    Store,
    name_of,
)
from rockcheck.validation.suite import results, suites

fuzzed = settings(
    max_examples=400,
    deadline=5000,
    database=None,
    derandomize=True,
    suppress_health_check=[
        HealthCheck.function_scoped_fixture,
        HealthCheck.too_slow,
        HealthCheck.data_too_large,
    ],
)

#: Commands that would run for minutes, were their arguments ever right.
LONG = {"validate", "accept", "spectrum", "benchmark", "stress"}


#: Between the words of a command line in an input.
BETWEEN = "\x1f"


def assert_one_clear_line(message: str) -> None:
    assert message.isprintable(), f"not one printable line: {message!r}"
    assert 0 < len(message.strip()) < 1500


def result_or_line(read: Callable[[], Any]) -> Any:
    """What `read` gives, None where it raises a proper `InputError`; anything else is a fault."""
    try:
        return read()
    except InputError as error:
        assert_one_clear_line(str(error))
        return None


def feed_file(
    content: bytes,
    folder: Path,
    *,
    name: str,
    reads: Sequence[Callable[[Path], Any]],
    check: Callable[[Any], object] = lambda found: None,
) -> None:
    path = folder / name
    path.write_bytes(content)
    for read in reads:
        if found := result_or_line(lambda read=read: read(path)):
            check(found)


def check_record(found: list[Any]) -> None:
    for one in found:
        assert len(one.samples) >= 1
        assert [value for value in one.samples if not math.isfinite(value)] == []
        assert 0.0 < one.time_step < math.inf


def check_scene(scene: Scene) -> None:
    assert 0.0 < scene.duration < math.inf
    assert len(scene.output_times) <= 5_000_001


def check_history(history: History) -> None:
    assert [value for value in history.channels["theta"] if not math.isfinite(value)] == []


@functools.cache
def stored_files() -> dict[str, bytes]:
    """A small finished run as its files: run.json, a history, its events and its record."""
    from rockcheck.ebm import EventBasedModel  # which the fuzzer must not instrument

    scene = load_scene("fig4a").replace(duration=0.5, name="short")
    history = EventBasedModel().simulate(scene)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        history.save(folder / "h.csv.gz")
        files = {suffix: (folder / f"h{suffix}").read_bytes() for suffix in SUFFIXES}
        Store(folder).put(
            HISTORIES,
            "short--ebm--0",
            {"outcome": history.outcome, "cost": {}, "notes": [], "settings": {}},
            files,
        )
        record = (folder / "histories" / "short--ebm--0.json").read_bytes()
    run = results.Run(
        suite="s",
        created="2026-01-01T00:00:00",
        reference="ebm",
        scenes={"short": scene.replace(excitation={"kind": "rest"}).model_dump(mode="json")},
        models=("ebm",),
        cells=(
            {
                "scene": "short",
                "model": "ebm",
                "status": "done",
                "history": "histories/short--ebm--0.csv.gz",
                "outcome": history.outcome,
            },
        ),
    )
    return {"run.json": run.model_dump_json().encode(), "record": record, **files}


def feed_stored_record(content: bytes, folder: Path) -> None:
    store = Store(folder)
    for suffix in SUFFIXES:
        (folder / "histories" / f"a{suffix}").write_bytes(stored_files()[suffix])
    (folder / "histories" / "a.json").write_bytes(content)
    (folder / "comparisons" / "a.json").write_bytes(content)
    assert isinstance(store.get(HISTORIES, "a"), dict | None)
    assert isinstance(store.get(COMPARISONS, "a"), dict | None)


def feed_command_line(content: bytes, folder: Path) -> None:
    """`content` holds the words, with `BETWEEN` between them."""
    inside = folder / "inside"
    if not inside.exists():
        inside.mkdir()
        (inside / "a.toml").write_text(nasty.SCENE)
        (inside / "h.csv").write_text(nasty.HISTORY)
        for model in ("ebm", "ebm-unilateral", "cm"):  # compiled before an input has its time
            models.build(model, {}).simulate(load_scene(inside / "a.toml"))
    given = content.decode("utf-8", "replace").split(BETWEEN)
    words = ["accept", "no-such-suite"] if "accept" in given else []
    words += [word for word in given if word not in LONG]
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


feed_record = functools.partial(feed_file, reads=[recordings.read_components], check=check_record)
feed_scene = functools.partial(feed_file, name="a.toml", reads=[load_scene], check=check_scene)
#: Of each reader: what feeds it, and a valid input.
READERS: dict[str, tuple[Callable[[bytes, Path], None], Callable[[], str]]] = {
    "at2": (functools.partial(feed_record, name="a.AT2"), lambda: nasty.AT2),
    "record_csv": (functools.partial(feed_record, name="a.csv"), lambda: nasty.CSV),
    "record_v2": (functools.partial(feed_record, name="a.V2"), lambda: nasty.V2),
    "record_esm": (functools.partial(feed_record, name="a.ASC"), lambda: nasty.ESM),
    "record_knet": (functools.partial(feed_record, name="a.NS"), lambda: nasty.KNET),
    "record_columns": (functools.partial(feed_record, name="a.txt"), lambda: nasty.COLUMNS),
    "scene_toml": (feed_scene, lambda: nasty.SCENE),
    "suite_toml": (
        functools.partial(
            feed_file, name="a.toml", reads=[lambda path: suites.load_suite(str(path))]
        ),
        lambda: nasty.SUITE,
    ),
    "history_csv": (
        functools.partial(
            feed_file,
            name="h.csv",
            reads=[History.load],
            check=check_history,
        ),
        lambda: nasty.HISTORY,
    ),
    "stored_run": (
        functools.partial(
            feed_file, name="run.json", reads=[lambda path: results.Run.load(path.parent)]
        ),
        lambda: stored_files()["run.json"].decode(),
    ),
    "stored_record": (feed_stored_record, lambda: stored_files()["record"].decode()),
    "command_line": (
        feed_command_line,
        lambda: BETWEEN.join(("simulate", "a.toml", "--model", "ebm", "-o", "out.csv")),
    ),
}


def mutated(valid: str) -> st.SearchStrategy[bytes]:
    """A valid text with some pieces cut out and nasty ones put in, or bytes of any kind."""
    piece = st.one_of(
        st.sampled_from(nasty.NASTY),
        st.text(max_size=8),
        st.floats().map(str),
        st.integers().map(str),
    )
    edit = st.tuples(st.integers(0, len(valid)), st.integers(0, 12), piece)

    def edited(edits: list[tuple[int, int, str]]) -> bytes:
        text = valid
        for place, cut, new in edits:
            text = text[:place] + new + text[place + cut :]
        return text.encode("utf-8", "surrogatepass")

    return st.one_of(st.lists(edit, min_size=1, max_size=4).map(edited), st.binary(max_size=200))


COMMAND_LINES = st.lists(
    st.one_of(st.sampled_from(nasty.WORDS), st.sampled_from(nasty.NASTY), st.text(max_size=6)),
    max_size=7,
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


_PLAY_BOMBS = """
import resource, sys, time
from pathlib import Path
import pandas, numba, rockcheck.ebm.core.march  # what a run needs in any case
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
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    for name, text in nasty.BOMBS.items():
        (tmp_path / "in" / name).write_text(text)
    script = [sys.executable, "-c", _PLAY_BOMBS, str(tmp_path / "in"), str(tmp_path / "out")]
    done = subprocess.run(script, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "Traceback" not in done.stderr, done.stderr[-2000:]
    for line in done.stderr.splitlines():
        assert len(line) < 600


@pytest.mark.parametrize("name", nasty.HOSTILE_NAMES)
def test_names_are_told_from_paths_and_from_markup(tmp_path, written, fault_of, name):
    """A scene cannot be called like that; a file name made of any name stays in its folder."""
    path = written("a.toml", f"name = {json.dumps(name)}\n" + nasty.SCENE)
    if name != "CON":
        fault = fault_of(load_scene, path)
        assert "name" in str(fault)
        assert_one_clear_line(str(fault))
    file = name_of(name, "ebm")
    assert (tmp_path / f"{file}.csv").resolve().parent == tmp_path.resolve()
    assert file.isascii()


def test_a_stored_path_does_not_leave_the_run(tmp_path, refused):
    data = json.loads(stored_files()["run.json"])
    (tmp_path / "secret.csv").write_bytes(gzip.decompress(stored_files()[TABLE]))
    run = tmp_path / "run"
    run.mkdir()
    for path in ("../secret.csv", str(tmp_path / "secret.csv"), "histories/../../secret.csv"):
        data["cells"][0]["history"] = path
        (run / "run.json").write_text(json.dumps(data))
        assert "history" in refused("report", str(run))
        assert not list(run.glob("**/*.html"))


def test_markup_in_a_stored_run_is_text_on_the_page(tmp_path):
    data = json.loads(stored_files()["run.json"])
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
    Store(tmp_path).put(
        HISTORIES, "short--ebm--0", {}, {one: stored_files()[one] for one in SUFFIXES}
    )
    assert main(["report", str(tmp_path)]) == 0
    pages = [*tmp_path.glob("**/*.html"), *tmp_path.glob("**/data/*.js")]
    text = "".join(page.read_text(encoding="utf-8") for page in pages)
    assert re.findall("<script>alert|<img src=x", text) == []
    assert "&lt;script&gt;alert" in (tmp_path / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "name",
    ["x" * 5000, "/../../../../etc/passwd", "\0", "\ud800"],
    ids=["long", "elsewhere", "null", "surrogate"],
)
def test_a_record_names_no_file_but_its_own(tmp_path, name):
    """Found by fuzzing: a record that names a file with a name too long, or elsewhere, is as good
    as none."""
    store = Store(tmp_path)
    store.put(HISTORIES, "a", {}, {suffix: stored_files()[suffix] for suffix in SUFFIXES})
    assert store.get(HISTORIES, "a") == {}
    files = json.loads((tmp_path / "histories" / "a.json").read_text())["content"]["files"]
    store.put(HISTORIES, "a", {"files": {**files, name: "0"}})
    assert store.get(HISTORIES, "a") is None


def test_a_heading_in_quotes(written):
    """Found by fuzzing: a measured history whose heading is quoted, as some programs write it,
    ended in a traceback."""
    path = written("h.csv", '\ufeff"t_s","theta_deg" # a remark\n0.0,90.0\n0.5,0.0\n')
    assert History.load(path).channels["theta"].tolist() == [math.pi / 2, 0.0]


def test_a_path_does_not_steer_the_terminal(tmp_path, monkeypatch, capsys):
    """Found by fuzzing: what a file is called was written to the terminal as it is; so was the name
    in a history's header."""
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "fig4a", "--model", "ebm", "-o", "a\x1b]0;x\x07\udcff.csv"]) == 0
    (tmp_path / "older.csv").write_text(
        "t,theta,rockcheck_history\n"
        '0.0,0.1,"{""name"": ""\\u001b[2J"", ""model"": ""\\u001b[2J""}"\n0.5,0.2,\n'
    )
    (tmp_path / "h.csv").write_text(
        f'# {HEAD}\n# model: "\\u001b[2J"\n# name: "\\u001b[2J"\nt,theta\n0.0,0.1\n0.5,0.2\n'
    )
    assert main(["compare", "older.csv", "h.csv"]) in (0, 1)
    heard = capsys.readouterr()
    assert "history: a?]0;x??.csv" in heard.out
    assert "\x1b" not in heard.out + heard.err
