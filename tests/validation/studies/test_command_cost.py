"""What each command costs: measured in processes of their own, told in a table and over runs."""

import json
from pathlib import Path

import pytest

from rockcheck.scenes import ModelFailure
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.studies.command_cost import study
from rockcheck.validation.studies.command_cost.measuring import Cost, cost_of
from rockcheck.validation.studies.command_cost.study import (
    COMMANDS,
    Command,
    CommandCost,
    CommandCosts,
    CommandTask,
    CostsOfRun,
)


def cost(wall: float) -> Cost:
    return Cost(wall=wall, cpu=2.0 * wall, peak=3e6)


@pytest.fixture(scope="module")
def version_cost(tmp_path_factory):
    return cost_of(["--version"], tmp_path_factory.mktemp("run"), {})


def test_a_person_waits_no_shorter_than_one_processor_works(version_cost):
    assert 0.0 < version_cost.cpu <= 2.0 * version_cost.wall


def test_memory_is_that_of_a_python_process_in_bytes(version_cost):
    assert 5e6 < version_cost.peak < 500e6


def test_the_work_of_workers_counts(tmp_path):
    alone = cost_of(["simulate", "fig5a"], tmp_path, {})
    words = ["validate", "fig5a", "--models", "ebm-unilateral,cm", "--jobs", "2"]
    with_workers = cost_of(words, tmp_path, {})
    assert with_workers.cpu > 1.5 * alone.cpu


def test_a_command_that_fails_is_a_failure_that_says_why(tmp_path):
    with pytest.raises(ModelFailure, match=r"rockcheck simulate none: exit 2: .*unknown scene"):
        cost_of(["simulate", "none"], tmp_path, {})


def test_a_quick_study_leaves_out_what_takes_long():
    names = {task.command for task in CommandCost(quick=True).tasks({})}
    assert names == {words for words, command in COMMANDS.items() if not command.long}


def test_a_command_runs_in_an_empty_folder_then_again_in_the_same(monkeypatch):
    folders: list[tuple[str, bool]] = []

    def noted(words, folder, environment):
        folders.append((" ".join(words), any(folder.iterdir())))
        (folder / "file").touch()
        return cost(1.0)

    monkeypatch.setattr(study, "cost_of", noted)
    monkeypatch.setitem(COMMANDS, "mine", Command("mine", "", before=("first",)))
    CommandTask("mine", repeats=2).play()
    assert folders == 2 * [("first", False), ("mine", True), ("mine", True)]


def test_the_table_has_medians_and_the_slowest():
    costs = CommandCosts(
        first=(cost(1.0), cost(9.0), cost(2.0)), again=(cost(0.3), cost(0.1), cost(0.2))
    )
    finding = CommandCost().gather({CommandTask("--version", 3): costs})
    (row,) = finding.table("commands").records()
    assert row["command"] == "rockcheck --version"
    assert row["first"] == 2.0
    assert row["again"] == 0.2
    assert row["slowest"] == 9.0
    assert row["cpu"] == 4.0
    assert row["peak"] == 3.0
    assert finding.exit_code == 0


def test_over_a_history_each_command_has_a_panel_and_each_run_a_row():
    earlier = [CostsOfRun(created="2026-01-01", commit="abc", first={"--version": cost(4.0)})]
    costs = CommandCosts(first=(cost(1.0),), again=(cost(0.5),))
    finding = CommandCost(earlier=earlier).gather({CommandTask("--version", 1): costs})
    (plot,) = finding.plots()
    (panel,) = plot.panels
    first, again = panel.series
    assert list(first.y) == [4.0, 1.0]
    assert list(again.y) == [None, 0.5]
    assert [row["commit"] for row in finding.table("runs").records()][1] == "abc"


def test_a_history_grows_by_a_line_a_run(monkeypatch, typed, in_an_empty_folder):
    monkeypatch.setattr(study, "COMMANDS", {"--version": COMMANDS["--version"]})
    words = ["benchmark", "commands", "--quick", "--history", "costs.jsonl", "--out", "report"]
    typed(*words)
    typed(*words)
    lines = [json.loads(line) for line in Path("costs.jsonl").read_text("utf-8").splitlines()]
    assert [list(line["first"]) for line in lines] == [["--version"], ["--version"]]
    assert "Over the runs of the history" in Path("report/index.html").read_text("utf-8")


def test_a_line_that_is_no_run_is_refused_before_anything_runs(refused, in_an_empty_folder):
    Path("costs.jsonl").write_text('{"created": 3}\n', "utf-8")
    line = refused("benchmark", "commands", "--quick", "--history", "costs.jsonl")
    assert "costs.jsonl, line 1: not a run of a history" in line


def test_a_history_is_of_commands_alone(refused):
    assert "--history: is of commands" in refused("benchmark", "ebm", "--history", "costs.jsonl")


def test_a_command_that_failed_is_a_model_that_failed():
    finding = CommandCost().gather({CommandTask("--version", 3): Failure("exit 2")})
    assert finding.exit_code == 3
