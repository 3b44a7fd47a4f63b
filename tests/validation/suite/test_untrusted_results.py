"""What is read back is not trusted: a result that was damaged, edited or exchanged is found, and
played or compared again."""

import itertools
import json
import os
import re
from xml.etree import ElementTree

import pytest

from rockcheck.validation.execute.store import COMPARISONS, HISTORIES, Store
from rockcheck.validation.suite import job_page, junit, results, suites
from rockcheck.validation.suite.runner import run_suite

SUITE = """
reference = "still"
[models.still]
model = "faulty:Still"
[models.near]
model = "faulty:Still"
offset = 1e-3
[[scene]]
name = "short"
duration = 0.5
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
[[ensemble]]
name = "crowd"
count = 4
[ensemble.scene]
duration = 0.2
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
[tolerances.short.near.still]
theta_peak = { expected = 0.0038, limit = 0.01, drift = 0.001, why = "a test" }
[tolerances.crowd.near.still]
ks_distance = { expected = 1.0, limit = 1.0, drift = 0.0, why = "a test" }
"""


@pytest.fixture
def run(tmp_path, written, faulty):
    path = written("mine.toml", SUITE)
    return lambda: run_suite(
        suites.load_suite(path, allow_code=["faulty:Still"]), tmp_path / "out", jobs=0
    )


def stored(folder, kind="json"):
    """The files of that kind, by what follows the first point of their names."""
    files = (
        path for name in (HISTORIES, COMPARISONS) for path in (folder / "out" / name).iterdir()
    )
    return sorted(path for path in files if path.name.partition(".")[2] == kind)


def plain(run):
    return [(cell.figures, cell.verdict, cell.outcome, cell.reason) for cell in run.cells]


def sealed(path, content):
    """Replace a record by another one with its right hash."""
    Store(path.parent.parent).put(path.parent.name, path.stem, content)


DAMAGE = {
    "figures edited": lambda path: path.write_text(
        json.dumps(json.loads(path.read_text(), parse_float=lambda value: 0.5 * float(value) + 7.0))
    ),
    "an outcome edited": lambda path: path.write_text(
        path.read_text().replace('"at rest"', '"overturned left"')
    ),
    "no content": lambda path: path.write_text("{}"),
    "a list": lambda path: path.write_text("[]"),
    "a number": lambda path: path.write_text("7"),
    "null": lambda path: path.write_text("null"),
    "gone": lambda path: path.unlink(),
    "empty": lambda path: path.write_bytes(b""),
    "cut short": lambda path: path.write_bytes(path.read_bytes()[: len(path.read_bytes()) // 2]),
    "no hash": lambda path: path.write_text(
        json.dumps({"content": json.loads(path.read_text())["content"]})
    ),
    "not text": lambda path: path.write_bytes(b"\xff\xfe\x00"),
    "deep": lambda path: path.write_text("[" * 100_000),
    "another shape, well hashed": lambda path: sealed(
        path, {"figures": 7, "peaks": [1], "outcome": 3}
    ),
    "empty, well hashed": lambda path: sealed(path, {}),
    "a batch in place of a cell, well hashed": lambda path: sealed(
        path,
        {"peaks": [0.1], "outcomes": ["moving"], "cost": {}}
        | {"files": json.loads(path.read_text())["content"].get("files")},
    ),
}


@pytest.mark.parametrize(
    ("kind", "damage"),
    [
        *(("json", damage) for damage in DAMAGE),
        *itertools.product(("csv.gz", "events.csv.gz"), ("gone", "empty", "cut short")),
    ],
)
def test_what_is_damaged_is_found_and_made_again(tmp_path, run, kind, damage):
    before = plain(run())
    whole = {path: path.read_bytes() for path in stored(tmp_path, kind)}
    assert len(whole) >= 2
    for path in whole:
        DAMAGE[damage](path)
    assert whole != {path: path.exists() and path.read_bytes() for path in whole}
    for is_read_back in (False, True):
        again = run()
        assert plain(again) == before
        assert all(cell.read_back for cell in again.cells) == is_read_back


@pytest.mark.needs("POSIX")
def test_a_record_that_is_a_pipe_is_not_waited_for(tmp_path, run):
    before = plain(run())
    for path in stored(tmp_path):
        path.unlink()
        os.mkfifo(path)
        assert Store(tmp_path / "out").get(path.parent.name, path.stem) is None
        path.unlink()
    assert plain(run()) == before


def test_a_record_under_another_name_is_none(tmp_path, run):
    before = plain(run())
    texts = {path: path.read_text() for path in (tmp_path / "out" / COMPARISONS).iterdir()}
    for path, other in zip(texts, [*list(texts)[1:], *texts], strict=False):
        path.write_text(texts[other])
    assert plain(run()) == before


EVIL = (
    "a|b](http://x.y/?z)<img src=x onerror=alert(1)>`c`![p](http://x.y/p.png)\n"
    "# title\x00\x1b[2J&amp; https://x.y www"
)


def test_names_in_the_summary_and_in_junit_are_text():
    made = results.Run(
        suite=EVIL,
        created="2026",
        reference="x",
        scenes={},
        faults=(EVIL,),
        models=(EVIL,),
        cells=(results.Cell(scene=EVIL, model=EVIL, status="failed", reason=EVIL),),
    )
    text = job_page.markdown(made)
    assert text.replace("\n", "").isprintable()
    assert len([line for line in text.splitlines() if line.startswith("#")]) == 1
    bare = re.sub(r"\\[\[\]`!]", "", text)
    assert [mark for mark in ("<", "://", "](", "![", "`") if mark in bare] == []
    rows = [line.replace("\\|", "") for line in text.splitlines() if line.startswith("|")]
    assert [row.count("|") for row in rows] == [3] * 3
    assert ElementTree.fromstring(junit.junit(made)).get("errors") == "1"
