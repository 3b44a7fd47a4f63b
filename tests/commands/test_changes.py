"""What changed: `rockcheck compare` between two finished runs, and `validate --history` over
many."""

import os
import subprocess
from pathlib import Path

import pytest

from rockcheck.commands.cli import main
from rockcheck.reports import site
from rockcheck.validation.discrepancy import figures
from rockcheck.validation.suite import results, run_changes, trend

SUITE = """
reference = "still"
[models.still]
model = "faulty:Still"
[models.near]
model = "faulty:Still"
offset = {offset}
[[scene]]
name = "short"
duration = 0.004  # one row
block = {{ half_width = 0.4, half_height = 1.5 }}
floor = {{ friction = 0.5 }}
[tolerances.short.near.still]
theta_peak = {{ expected = 0.0038, limit = 0.005, drift = 0.001, why = "a test" }}
"""
CODE = ("--allow-code", "faulty:Still", "--jobs", "1")


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder):
    """A run in the folder `a`, whose one check passes."""
    ran("a", 0.001)


def ran(out: str, offset: float, *words: str, code: int = 0) -> None:
    Path("mine.toml").write_text(SUITE.format(offset=offset), "utf-8")
    assert main(["validate", "mine.toml", *CODE, "--no-report", "--out", out, *words]) == code


@pytest.fixture
def diff(told):
    return lambda a, b, code: told("compare", a, b, code=code)["changes"]


def test_the_same_run_has_no_change(told, typed):
    ran("b", 0.001)
    assert told("compare", "a", "b").items() >= {"changes": [], "exit_code": 0}.items()
    assert typed("compare", "a", "b")[0] == "mine: nothing changed\n"


def test_a_figure_that_moves_within_its_limits_is_told_and_no_fault(diff):
    ran("b", 0.00102)
    changes = diff("a", "b", 0)
    assert {change["what"] for change in changes} == {"figure"}
    peak = {(change["model"], change["name"]): change for change in changes}[
        "near", "theta_peak against still"
    ]
    assert peak["after"] / peak["before"] == pytest.approx(1.02, rel=1e-6)


def test_a_verdict_that_changes_is_exit_1_and_comes_first(diff, told, typed):
    ran("b", 0.002, code=1)
    assert [
        (place, c["scene"], c["model"], c["name"], c["before"], c["after"])
        for place, c in enumerate(diff("a", "b", 1))
        if c["what"] == "verdict"
    ] == [
        (0, "", "", "", "pass", "fail"),
        (1, "short", "near", "", "pass", "fail"),
        (2, "short", "near", "theta_peak against still", "pass", "fail"),
    ]
    typed("compare", "a", "b", code=1, holds=["mine: 3 verdicts, "], columns=80)
    back = told("compare", "b", "a", code=1)
    first = back["changes"][0]
    assert first["before"] == "fail"
    assert first["after"] == "pass"
    assert back["exit_code"] == 1


def changed(**change: object) -> None:
    Path("b").mkdir()
    results.Run.load("a").model_copy(update=change).save(Path("b"))


def test_a_cell_that_is_gone_is_a_change(diff):
    changed(cells=results.Run.load("a").cells[:1])
    assert [
        (one["model"], one["before"], one["after"])
        for one in diff("a", "b", 1)
        if one["what"] == "cell"
    ] == [("near", "there", None)]


def test_runs_of_two_suites_are_not_compared(refused):
    changed(suite="other")
    assert refused("compare", "a", "b") == "rockcheck: the runs are of two suites, mine and other"
    assert "no finished run here" in refused("compare", "a", "none")


@pytest.mark.parametrize(
    ("peak", "note", "names", "kept"),
    [
        (0.3, "", ["peak_rotation"], 0.3),
        (7.8, "the block overturned at 1 s", [], None),
    ],
)
def test_the_peak_of_a_block_that_fell_is_no_figure_that_changes(peak, note, names, kept):
    run = results.Run.load("a")
    near = run.by_scene["short"]["near"]

    def reached(peak: float) -> results.Run:
        figure = figures.Figure(
            measure="peak_rotation", label="peak rotation", unit="alpha", value=peak, note=note
        )
        check = near.checks[0].model_copy(update={"figure": figure})
        return run.model_copy(
            update={"cells": (near.model_copy(update={"figures": (figure,), "checks": (check,)}),)}
        )

    before = reached(peak)
    assert [one.name for one in run_changes.changes(before, reached(peak + 0.1))] == names
    assert list(trend.summary_of_run(before, Path()).figures.values()) == [kept]


@pytest.mark.needs("git")
def test_a_history_of_runs_grows_by_a_line_and_shows_what_moved(capsys, typed):
    for words in (
        ["init", "-q"],
        ["add", "mine.toml"],
        ["-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "one"],
    ):
        subprocess.run(["git", *words], check=True)
    ran("a", 0.001, "--history", "runs.jsonl")
    ran("a", 0.00105, "--history", "runs.jsonl")
    typed(
        *("validate", "mine.toml", *CODE, "--out", "a", "--history", "runs.jsonl"),
        holds=["3 runs, 0 figures moved since "],
    )
    head = subprocess.run(
        ["git", "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=True
    ).stdout.strip()
    lines = Path("runs.jsonl").read_text("utf-8").splitlines()
    moments = [trend.RunSummary.model_validate_json(line) for line in lines]
    assert [one.commit for one in moments] == [head, f"{head}-dirty", f"{head}-dirty"]
    name = "short, near: theta_peak against still"
    first, second, third = (one.figures[name] for one in moments)
    assert second / first == pytest.approx(1.05, rel=1e-6)
    assert third == second
    # nothing has varied in one run: no empty table; a figure that is gone has varied
    assert [
        [table.name for table in trend.trend_of(some).tables() if table.on == "page"]
        for some in (
            moments[:1],
            [moments[0], moments[0].model_copy(update={"figures": {}})],
        )
    ] == [["runs"], ["figures", "runs"]]
    trend_page, page = (Path(f"a/{of}index.html").read_text("utf-8") for of in ("trend/", ""))
    assert [
        words
        for words in ("mine over 3 runs", name, head, '"../index.html"', f"{second:.6g}")
        if words not in trend_page
    ] == []
    assert 'href="trend/index.html"' in page
    os.truncate("runs.jsonl", Path("runs.jsonl").stat().st_size - 1)  # as some editors do
    ran("a", 0.001, "--history", "runs.jsonl")
    lines = Path("runs.jsonl").read_text("utf-8").splitlines()
    # without a report there is no page, which would end with another run
    assert len(lines) == 4
    assert f"{name}: " in capsys.readouterr().out
    assert not Path("a/trend/index.html").exists()


@pytest.mark.parametrize(
    "line",
    ["{", "[]", '{"suite": 3}', '{"created": "x", "suite": "mine", "verdict": "pass", "more": 1}'],
)
def test_a_history_that_is_none_is_named_with_its_line(capsys, line):
    Path("runs.jsonl").write_text(f"\n{line}\n", "utf-8")
    ran("a", 0.001, "--history", "runs.jsonl", code=2)
    said = capsys.readouterr().err
    assert said.startswith("rockcheck: runs.jsonl, line 2: not a run of a history")
    assert Path("runs.jsonl").read_text("utf-8") == f"\n{line}\n"


def test_without_a_report_the_pages_of_the_run_before_are_gone():
    """They would show other numbers than run.json. Files of the user's stay. With a report the
    index goes until it is written again: that may take long, or fail; and so does the trend, which
    would end with another run."""
    assert main(["validate", "mine.toml", *CODE, "--out", "a", "--history", "runs.jsonl"]) == 0
    site.keep(results.Run.load("a"), Path("a"))
    assert [Path(f"a/{of}index.html").exists() for of in ("", "trend/")] == [False, False]
    assert main(["report", "a"]) == 0
    Path("a/pages/mine.html").write_text("my own", "utf-8")
    assert Path("a/pages/short.html").is_file()
    ran("a", 0.0012)
    left = (*Path("a").glob("*.html"), *Path("a/pages").rglob("*.*"))
    assert [path.name for path in left if path.parent.name != "assets"] == ["mine.html"]
    Path("a/index.html").write_text("my own", "utf-8")
    ran("a", 0.001)
    assert Path("a/index.html").is_file()
