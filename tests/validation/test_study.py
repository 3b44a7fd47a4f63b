"""The shape of every study: what the one runner does for a made-up one, and that the real ones have
the shape."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from squares import Squares

from rockcheck.reports.document import publish
from rockcheck.reports.table_text import block_markdown, csv
from rockcheck.scenes import progress
from rockcheck.validation.execute.store import RECORDS, Store
from rockcheck.validation.finding import (
    Axis,
    Column,
    Finding,
    Mark,
    Panel,
    Plot,
    Series,
    Table,
    Text,
    text,
)
from rockcheck.validation.studies.work_precision.study import WorkPrecision
from rockcheck.validation.study import FAULTS, run


@pytest.fixture
def log(written):
    return written("log", "")


def played(log: Path) -> list[float]:
    return sorted(map(float, log.read_text().split()))


@pytest.mark.parametrize("jobs", [0, 1, 2])
def test_what_was_played_is_read_back_whatever_plays_it(tmp_path, log, jobs):
    heard = []
    study = Squares([2.0, 3.0, 3.0, 11.0], log)  # whose square is a task of a second wave
    how = {"folder": tmp_path / "out", "jobs": jobs}
    found = run(study, **how, on_progress=lambda done, of, what="": heard.append((done, of)))
    values = [2.0, 3.0, 11.0, 121.0, 14641.0]
    rows = [[value, value**2] for value in values]
    assert found.table("squares").rows == run(study, **how).table("squares").rows == rows
    assert played(log) == values
    assert heard[0] == (0, 3)
    assert heard[-1] == (5, 5)
    assert found.complete is True
    assert run(study, **how, force=True).data == {"count": 5}
    assert played(log) == sorted(2 * values)


def test_a_fault_of_one_task_takes_no_other_down(tmp_path, log):
    values = [2.0, 13.0, 14.0, 15.0, 17.0]
    found = run(Squares(values, log, seconds=20.0), tmp_path / "out", jobs=1)
    assert found.data | {
        where.partition(",")[0]: why.partition(":")[0] for where, why in found.failures.items()
    } == {
        "count": 1,
        "13": "no square of 13",
        "14": "ZeroDivisionError",
        "15": "the process ended with code 3",
        "17": "the process ended with code 0",
    }
    assert ["a bug" in one.read_text() for one in (tmp_path / "out" / FAULTS).iterdir()] == [True]
    run(Squares([2.0, 13.0], log), tmp_path / "out", jobs=1)
    assert played(log) == [2.0, 13.0, 13.0, *values[2:]], "what failed is played again"


#: A study as a script, which imports what lies beside it.
SCRIPT = """
from dataclasses import dataclass
from pathlib import Path
from beside import number
from rockcheck.validation.finding import Finding
from rockcheck.validation.study import Study, Task, run

@dataclass(frozen=True)
class Of(Task):
    number: float

@dataclass(frozen=True)
class Product:
    value: float

class Once(Study):
    name, record = "once", Product

    def tasks(self, done):
        return [Of(1.0)]

    @staticmethod
    def play(task):
        return Product(2.0 * task.number * number)

    def gather(self, done):
        return Finding("once", "", ", ".join(str(one.value) for one in done.values()))

print(run(Once(), Path("out"), jobs=0).answer)
"""


def test_a_script_that_changed_plays_again(tmp_path, written):
    """Also one of whose neighbours has."""
    assert [
        float(
            subprocess.check_output(
                # Python tells changes of compiled files by size and second.
                [sys.executable, "-B", written("made.py", text)],
                cwd=written("beside.py", beside).parent,
            )
        )
        for text, beside in (
            (SCRIPT, "number = 1.0"),
            (SCRIPT.replace("2.0 *", "3.0 *"), "number = 1.0"),
            (SCRIPT.replace("2.0 *", "3.0 *"), "number = 5.0"),
        )
    ] == [2.0, 3.0, 15.0]


def test_an_interrupted_run_gathers_what_there_is_and_goes_on(tmp_path, log):
    late = run(Squares([2.0], log), tmp_path, jobs=0, minutes=1e-9)
    assert late.verdict == "incomplete", "there was no time"
    assert late.exit_code == 0, "there was no time"
    assert played(log) == [], "there was no time"
    found = run(Squares([2.0, 16.0, 3.0], log), tmp_path, jobs=0)
    assert found.complete is False
    assert found.exit_code == 130
    assert found.data == {"count": 1}
    assert run(Squares([2.0, 3.0], log), tmp_path, jobs=0).data == {"count": 2}
    assert played(log) == [2.0, 3.0, 16.0]


def test_timed_tasks_are_played_here_and_a_damaged_record_again(tmp_path, log):
    study = Squares([2.0], log, where="timed")
    run(study, tmp_path, jobs=2)
    (record,) = (tmp_path / "records").glob("*.json")
    assert json.loads(record.read_text())["content"]["record"]["process"] == os.getpid()
    record.write_text(record.read_text().replace("4.0", "5.0"))
    assert run(study, tmp_path, jobs=2).table("squares").rows == [[2.0, 4.0]]


@pytest.mark.parametrize(
    ("values", "expected", "said"), [([2.0, 3.0], 90.0, ["3 min"]), ([4.0], 1.0, [])]
)
def test_a_long_run_says_how_long(tmp_path, log, values, expected, said):
    heard = []
    with progress.announcing(heard.append):
        run(Squares(values, log, expected=expected), tmp_path, jobs=0)
    assert [part in words for part, words in zip(said, heard, strict=True)] == [True] * len(said)


def test_a_folder_that_cannot_be_used_is_bad_input(fault_of, log):
    assert "output folder" in str(fault_of(run, Squares([2.0], log), log))


FOUND = Finding(
    "made",
    "Made up <b>",
    "All is well.",
    [
        Text("In words.", title="Words", items=["one", "two"]),
        Table(
            "numbers",
            [
                text("name"),
                Column("bias", optional=True),  # no value: in files only
                Column("model", kind="model"),
                Column("share", kind="percent"),
                Column("x", "length", "m"),
            ],
            [
                ["=1+1|", None, "mujoco", 0.25, 1.23456e-9],
                ["b", Mark(None), "mine", None, Mark(2.0, "fail", "too long")],
            ],
            "Numbers",
        ),
        Plot(
            "curve",
            panels=[
                Panel(
                    "", [Series("a", [1.0, 2.0], [3.0, None]), Series("", y=[1.0], style="level")]
                )
            ],
            x=Axis("t"),
            live=True,
        ),
    ],
    verdict="fail",
    exit_code=1,
)


def test_one_table_is_csv_markdown_and_page(tmp_path):
    table = FOUND.table("numbers")
    head, first, second = csv(table).splitlines()
    assert head == "name,bias,model,share,x"
    assert second == "b,,mine,,2.0"
    assert "1.23456e-09" in first
    shown = block_markdown(table)
    wanted = {"length, m": True, "25.0 %": True, "✕ 2": True, "bias": False}
    assert {part: part in shown for part in wanted} == wanted
    assert "bias" in block_markdown(replace(table, rows=[["a", 0.0, "mine", 0.5, 1.0]]))
    page = publish(FOUND, tmp_path).read_text("utf-8")
    for part in ("Made up &lt;b&gt;", 'class="n fail" title="too long"'):
        assert part in page
    assert (tmp_path / "figures" / "curve.svg").stat().st_size > 1000
    assert json.loads((tmp_path / "run.json").read_text())["tables"]["numbers"][1]["x"] == 2.0
    assert "rockcheckCurves" in (tmp_path / "curves.js").read_text()


def test_a_record_of_a_real_study_is_read_back_as_it_was(tmp_path):
    study = WorkPrecision("ebm", quick=True)
    task = next(task for task in study.tasks({}) if getattr(task, "size", 0) == 1)
    record, store = study.play(task), Store(tmp_path, study.kinds)
    study.keep(store, task, record)
    store.put(RECORDS, "told", {"words": "a tab:\t"})
    assert [study.find(store, task), store.get(RECORDS, "told")] == [record, {"words": "a tab:?"}]
