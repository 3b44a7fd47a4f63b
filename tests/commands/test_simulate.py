"""`rockcheck simulate`, `new` and `warm`: what is played, written and told."""

from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest

from rockcheck.commands import simulate
from rockcheck.scenes import errors, load_scene
from rockcheck.validation.execute import pool

T = 0.01 * np.arange(100)


@pytest.fixture
def played(tmp_path, monkeypatch, made):
    """What is built, by name and settings; its history is made up. In an empty folder."""
    built = []

    def build(name, settings=None):
        built.append((name, settings))
        history = made(0.3 * np.sin(3.0 * T), T, model=name)
        return SimpleNamespace(simulate=lambda scene: history)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(simulate.models, "build", build)
    return built


def test_without_a_name_the_history_is_called_after_scene_and_model(played, typed, told, tmp_path):
    typed("simulate", "fig5a", "--model", "cm", holds=["fig5a, cm: moving", "history: fig5a--cm"])
    assert {path.name for path in tmp_path.iterdir()} == {"fig5a--cm.csv", "fig5a--cm.events.csv"}
    assert told("simulate", "fig5a", "--model", "cm")["history"] == "fig5a--cm.csv"
    assert played[0] == ("cm", {})


def test_settings_are_the_model_s(played, typed):
    typed("simulate", "fig5a", "--model", "cm", "--set", "stiffness=2e6", "--set", "a=b")
    assert played == [("cm", {"stiffness": 2e6, "a": "b"})]


def test_endings_tell_histories_from_figures(played, told, tmp_path):
    words = ("simulate", "fig5a", "-o", "a.csv", "-o", "b.svg", "-o", "c.csv.gz")
    value = told(*words)
    assert value["files"] == ["a.csv", "b.svg", "c.csv.gz"]
    assert value["history"] == "a.csv"
    assert {path.name for path in tmp_path.iterdir()} == {
        *("a.csv", "a.events.csv", "b.svg", "c.csv.gz", "c.events.csv.gz"),
    }
    assert told("simulate", "fig5a", "-o", "b.svg")["history"] is None


@pytest.mark.parametrize("name", ["a.json", "a.jpg", "none/a.csv"])
def test_a_file_that_cannot_be_written_is_refused_before_anything_is_played(
    name, played, refused, tmp_path
):
    said = refused("simulate", "fig5a", "-o", name)
    assert "--output" in said or ".csv.gz" in said
    assert list(tmp_path.iterdir()) == []


def test_a_history_and_a_figure_are_offered_where_an_ending_is_neither(played, refused):
    said = refused("simulate", "fig5a", "-o", "a.json")
    assert ".csv or .csv.gz" in said
    assert "its figure as " in said


@pytest.fixture
def apart(monkeypatch):
    """Plays a model of one's own with this outcome, in place of another process."""

    def play(outcome):
        counts = []

        @contextmanager
        def processes(count):
            counts.append(count)
            yield SimpleNamespace(run=lambda calls: [SimpleNamespace(outcome=outcome)])

        monkeypatch.setattr(simulate.pool, "Pool", processes)
        history = simulate.played_apart("mine:Model", {"a": 1}, load_scene("fig5a"))
        assert counts == [1]
        return history

    return play


def test_a_model_of_ones_own_is_played_in_a_process_of_its_own(apart):
    assert apart(SimpleNamespace(history="a history")) == "a history"


def test_what_a_model_of_ones_own_refuses_is_bad_input(apart, fault_of):
    assert "no such size" in str(fault_of(apart, pool.Failure("no such size", refused=True)))


@pytest.mark.parametrize("traceback", ["", "line 3, in simulate"])
def test_a_model_of_ones_own_that_fails_leaves_its_traceback(traceback, apart, monkeypatch):
    kept = []
    monkeypatch.setattr(simulate, "report_file", lambda text: kept.append(text) or "fault.txt")
    with pytest.raises(errors.ModelFailure) as error:
        apart(pool.Failure("ZeroDivisionError", traceback=traceback))
    assert str(error.value).startswith("mine:Model: ZeroDivisionError")
    assert ("its traceback: fault.txt" in str(error.value)) == bool(traceback)
    assert kept == [traceback] * bool(traceback)


def test_a_new_scene_is_ready_to_run_and_replaces_none(tmp_path, monkeypatch, typed, refused):
    monkeypatch.chdir(tmp_path)
    typed("new", "mine.toml", holds=["mine.toml: a block of 0.", "next: rockcheck simulate mine"])
    assert load_scene("mine.toml").name == "mine"
    (tmp_path / "mine.toml").write_text("my own")
    assert "is there already" in refused("new", "mine.toml")
    assert (tmp_path / "mine.toml").read_text() == "my own"
    assert "give the name of a .toml file" in refused("new", "mine.txt")


def test_each_part_is_compiled_and_told_with_its_time(monkeypatch, told):
    heard = []

    @contextmanager
    def progress(title):
        yield lambda *how: heard.append(how)

    monkeypatch.setattr(simulate, "progress", progress)
    monkeypatch.setattr(
        "rockcheck.reports.workers.side_by_side",
        lambda calls, jobs, least: (one.function(*one.arguments) for one in calls),
    )
    built = []
    model = SimpleNamespace(simulate=lambda scene: None)
    monkeypatch.setattr(simulate.models, "build", lambda name: built.append(name) or model)
    seconds = told("warm")["seconds"]
    assert list(seconds) == list(simulate.PARTS)
    assert all(0.0 <= one < 10.0 for one in seconds.values())
    assert [done for done, *_ in heard] == [0, 1, 2, 3]
    assert {total for _, total, _ in heard} == {3}
    assert set(built) == {name for names in simulate.PARTS.values() for name in names}
