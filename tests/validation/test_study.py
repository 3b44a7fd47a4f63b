"""The shape of every study: what the one runner does for a made-up one, and that the real ones have
the shape."""

import json
import os
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from rockcheck.reports.document import block_markdown, csv, publish
from rockcheck.scenes import InputError
from rockcheck.scenes.progress import announcing
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.execute.store import Store
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
from rockcheck.validation.study import FAULTS, Study, run


@pytest.fixture(autouse=True)
def _importable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers import the made-up study from its folder."""
    monkeypatch.syspath_prepend(Path(__file__).parent / "models")


def squares(*arguments: Any, **how: Any) -> Study:
    made: Study = import_module("squares").Squares(*arguments, **how)
    return made


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "log"
    path.touch()
    return path


def played(log: Path) -> list[float]:
    return sorted(map(float, log.read_text().split()))


@pytest.mark.parametrize("jobs", [0, 1, 2])
def test_what_was_played_is_read_back_whatever_plays_it(
    tmp_path: Path, log: Path, jobs: int
) -> None:
    heard: list[tuple[float, float]] = []
    study = squares([2.0, 3.0, 3.0, 11.0], log)  # whose square is a task of a second wave
    found = run(
        study,
        tmp_path / "out",
        jobs=jobs,
        on_progress=lambda done, of, what="": heard.append((done, of)),
    )
    again = run(study, tmp_path / "out", jobs=jobs)
    values = [2.0, 3.0, 11.0, 121.0, 14641.0]
    rows = [[value, value**2] for value in values]
    assert found.table("squares").rows == again.table("squares").rows == rows
    assert played(log) == values
    assert (heard[0], heard[-1]) == ((0, 3), (5, 5))
    assert found.complete
    assert found.made
    assert run(study, tmp_path / "out", jobs=jobs, force=True).data == {"count": 5}
    assert played(log) == sorted(2 * values)


def test_a_fault_of_one_task_takes_no_other_down(tmp_path: Path, log: Path) -> None:
    found = run(squares([2.0, 13.0, 14.0, 15.0], log), tmp_path / "out", jobs=1)
    assert found.data == {"count": 1}
    assert {
        where.partition(",")[0]: why.partition(":")[0] for where, why in found.failures.items()
    } == {
        "13": "no square of 13",
        "14": "ZeroDivisionError",
        "15": "the process ended with code 3",
    }
    (trace,) = (tmp_path / "out" / FAULTS).iterdir()
    assert "a bug" in trace.read_text()
    run(squares([2.0, 13.0], log), tmp_path / "out", jobs=1)
    assert played(log).count(13.0) == 2, "what failed is played again"
    assert played(log).count(2.0) == 1


def test_an_interrupted_run_gathers_what_there_is_and_goes_on(tmp_path: Path, log: Path) -> None:
    found = run(squares([2.0, 16.0, 3.0], log), tmp_path, jobs=0)
    assert (found.complete, found.exit_code, found.data) == (False, 130, {"count": 1})
    assert run(squares([2.0, 3.0], log), tmp_path, jobs=0).data == {"count": 2}
    assert played(log) == [2.0, 3.0, 16.0]


def test_what_there_is_no_time_for_is_left_out(tmp_path: Path, log: Path) -> None:
    found = run(squares([2.0], log), tmp_path, jobs=0, minutes=1e-9)
    assert (found.complete, found.exit_code, played(log)) == (False, 0, [])


def test_timed_tasks_are_played_here_and_a_damaged_record_again(tmp_path: Path, log: Path) -> None:
    study = squares([2.0], log, where="timed")
    run(study, tmp_path, jobs=2)
    (record,) = (tmp_path / "records").glob("*.json")
    assert json.loads(record.read_text())["content"]["record"]["process"] == os.getpid()
    record.write_text(record.read_text().replace("4.0", "5.0"))
    assert run(study, tmp_path, jobs=2).table("squares").rows == [[2.0, 4.0]]


def test_a_long_run_says_how_long(tmp_path: Path, log: Path) -> None:
    said: list[str] = []
    with announcing(said.append):
        run(squares([2.0, 3.0], log, expected=90.0), tmp_path, jobs=0)
        run(squares([4.0], log, expected=1.0), tmp_path, jobs=0)
    (words,) = said
    assert "3 min" in words


@pytest.mark.long
def test_on_a_dask_cluster_it_is_the_same(tmp_path: Path, log: Path) -> None:
    found = run(squares([2.0, 11.0, 13.0, 15.0], log), tmp_path / "out", scheduler="local:2")
    assert found.data == {"count": 4}
    assert len(found.failures) == 2


@pytest.mark.parametrize("address", ["local:0", "local:two", "nonsense", ""])
def test_a_wrong_scheduler_is_bad_input_before_anything_is_planned(
    tmp_path: Path, log: Path, monkeypatch: pytest.MonkeyPatch, address: str
) -> None:
    study, asked = squares([2.0], log), []
    monkeypatch.setattr(type(study), "tasks", lambda *_: asked.append(1))
    with pytest.raises(InputError) as told:
        run(study, tmp_path / "out", scheduler=address)
    assert told.value.key == "--scheduler"
    assert not asked
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "words", ["validate smoke", "assess fig5a", "spectrum", "conformance", "stress", "accept smoke"]
)
def test_every_study_says_so_in_one_line(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused
) -> None:
    monkeypatch.chdir(tmp_path)
    assert refused(*words.split(), "--scheduler", "local:0", "--quiet").startswith(
        "rockcheck: --scheduler: 'local:0'"
    )


def test_a_folder_that_cannot_be_used_is_bad_input(log: Path) -> None:
    with pytest.raises(InputError, match="output folder"):
        run(squares([2.0], log), log)


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
                Column("model", kind="model"),
                Column("share", kind="percent"),
                Column("x", "length", "m"),
            ],
            [
                ["=1+1|", "mujoco", 0.25, 1.23456e-9],
                ["b", "mine", None, Mark(2.0, "fail", "too long")],
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


def test_an_optional_column_without_a_value_is_in_files_only() -> None:
    columns = [text("name"), Column("bias", optional=True), Column("x")]
    table = Table("t", columns, [["a", None, 1.0], ["b", Mark(None), None]])
    assert [column.name for column in table.shown.columns] == ["name", "x"]
    assert table.shown.rows == [["a", 1.0], ["b", None]]
    assert csv(table).splitlines()[0] == "name,bias,x"
    known = replace(table, rows=[["a", 0.0, 1.0]])
    assert known.shown.rows == known.rows


def test_one_table_is_csv_markdown_and_page(tmp_path: Path) -> None:
    table = FOUND.table("numbers")
    assert csv(table).splitlines()[0] == "name,model,share,x"
    assert "1.23456e-09" in csv(table)
    assert csv(table).splitlines()[2] == "b,mine,,2.0"
    shown = block_markdown(table)
    assert "length, m" in shown
    assert "25.0 %" in shown
    assert "✕ 2" in shown
    page = publish(FOUND, tmp_path).read_text(encoding="utf-8")
    assert "Made up &lt;b&gt;" in page
    assert 'class="n fail" title="too long"' in page
    assert (tmp_path / "figures" / "curve.svg").stat().st_size > 1000
    assert json.loads((tmp_path / "run.json").read_text())["tables"]["numbers"][1]["x"] == 2.0
    assert "rockcheckCurves" in (tmp_path / "curves.js").read_text()


def test_a_record_of_a_real_study_is_read_back_as_it_was(tmp_path: Path) -> None:
    study = WorkPrecision("ebm", quick=True)
    task = next(task for task in study.tasks({}) if getattr(task, "size", 0) == 1)
    record, store = study.play(task), Store(tmp_path, study.kinds)
    assert not isinstance(record, Failure)
    study.keep(store, task, record)
    assert study.find(store, task) == record
    assert study.gather({task: record}).as_dict()
