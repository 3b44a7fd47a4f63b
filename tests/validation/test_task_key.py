"""The key of a task of a study: with what it changes, and with what it does not."""

from dataclasses import dataclass, replace

import pytest
from squares import Squares

from rockcheck.validation import study
from rockcheck.validation.execute import provenance
from rockcheck.validation.study import Task, run


@dataclass(frozen=True)
class Timed(Task):
    number: int


@pytest.fixture
def changed(monkeypatch):
    """Whether the key of a task changes where a function of `provenance` says something else."""

    def with_another(name, **how):
        task = Timed(number=1, **how)
        before = task.key
        with monkeypatch.context() as patch:
            patch.setattr(provenance, name, lambda *given: {"another": "one"})
            return replace(task).key != before

    return with_another


def test_a_key_changes_with_the_fields():
    assert Timed(number=1).key != Timed(number=2).key
    assert Timed(number=1).key == Timed(number=1).key


@pytest.mark.parametrize("what", ["code_digest", "versions"])
def test_a_key_changes_with_the_code_and_the_libraries(changed, what):
    assert changed(what)


@pytest.mark.parametrize(("how", "counts"), [({}, False), ({"where": "timed"}, True)])
def test_a_key_changes_with_the_processor_where_a_time_counts(changed, how, counts):
    assert changed("hardware", **how) is counts


def test_a_run_reads_the_code_again(tmp_path, written, monkeypatch):
    heard = []
    monkeypatch.setattr(provenance, "read_code_again", lambda: heard.append(1))
    run(Squares([2.0], written("log", "")), tmp_path / "out", jobs=0)
    assert heard == [1]


@pytest.mark.parametrize(
    ("asked", "tasks", "cores", "begun"), [(300, 3, 2, 3), (2, 3, 8, 2), (300, 1, 4, 4)]
)
def test_no_more_processes_begin_than_there_is_work_or_cores_for(
    tmp_path, written, monkeypatch, asked, tasks, cores, begun
):
    class Few(study.pool.Pool):
        def __init__(self, jobs, memory_mb=None):
            heard.append(jobs)
            super().__init__(1, memory_mb)

    heard = []
    monkeypatch.setattr(study.pool, "Pool", Few)
    monkeypatch.setattr(study.os, "cpu_count", lambda: cores)
    values = [float(value) for value in range(2, 2 + tasks)]
    run(Squares(values, written("log", "")), tmp_path / "out", jobs=asked)
    assert heard == [begun]
