"""The tables of a run: what is not within tolerance, run times, measures, runs."""

import math

import pytest

from rockcheck.reports import tables
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.finding import Mark, plain
from rockcheck.validation.suite import results


def check(verdict, value=0.5, limit=1.0, measure="theta_rms", **more):
    figure = Figure(measure=measure, label="RMS", unit="alpha", value=value, against="ebm", **more)
    return results.Check(
        figure=figure, kind="numerical", verdict=verdict, ideal=0.0, expected=0.25, limit=limit
    )


def cell(model="cm", scene="a", *, status="done", seconds=1.0, **more):
    cost = results.CostRecord(wall_seconds=seconds, steps=12345, evaluations=7)
    return results.Cell(scene=scene, model=model, status=status, cost=cost, **more)


def run(*cells):
    return results.Run(
        suite="made up",
        created="2026-01-01",
        reference="ebm",
        models=tuple(dict.fromkeys(one.model for one in cells)),
        scenes={one.scene: {} for one in cells},
        cells=cells,
    )


def test_the_worst_stands_first():
    checks = {
        "a little out": check("fail", 1.5),
        "far out": check("fail", 3.0),
        "changed": check("changed", 0.5),
        "changed more": check("changed", 0.9),
    }
    judged = [cell(scene=name, checks=(one,)) for name, one in checks.items()]
    within = cell(scene="within", checks=(check("pass"), check("fail", 2.0, limit=None)))
    absent, failed = (cell(scene=status, status=status) for status in ("absent", "failed"))
    worst = tables.worst_first(run(absent, within, *judged, failed))
    assert [one.scene for one, _ in worst] == [
        *("failed", "far out", "a little out", "changed more", "changed", "absent"),
    ]


def test_what_is_wrong_is_told_with_its_check_or_its_reason():
    wrong = cell(scene="b", checks=(check("fail", 3.0),))
    failed = cell(scene="a", status="failed", reason="it crashed")
    table = tables.worst_table(run(wrong, failed), {"b": "pages/b.html"})
    first, second = ([plain(one) for one in row] for row in table.rows)
    assert first[1:4] == ["a", "cm", "no history"]
    assert first[-1] == "it crashed"
    assert second[1:4] == ["b", "cm", "RMS"]
    assert second[8] == pytest.approx(3.0)
    assert [row[1].link for row in table.rows] == ["", "pages/b.html"]
    assert {len(row) for row in table.rows} == {len(table.columns)}


@pytest.mark.parametrize(
    ("verdict", "colour"),
    [("fail", "fail"), ("changed", "changed"), ("not defined", ""), ("pass", "pass")],
)
def test_a_check_has_the_colour_of_its_weight(verdict, colour):
    table = tables.checks_table([cell(checks=(check(verdict),))])
    assert table.rows[0][0].verdict == colour
    waits = tables.checks_table([cell(checks=(check("fail", limit=None),))])
    assert waits.rows[0][0] == Mark("no tolerance yet", "changed")


def test_run_times_are_ratios_where_both_are_known():
    table = tables.times_table(
        run(
            cell("ebm", "a", seconds=0.2),
            cell("ebm", "b", seconds=0.0),
            cell("cm", "a", seconds=0.8),
            cell("cm", "b", seconds=5.0),
            cell("mujoco", "a", status="failed"),
            cell("mujoco", "b", seconds=0.5),
            cell("dart", "a", seconds=0.0),
        )
    )
    rows = {row[0]: row[1:] for row in table.rows}
    assert rows["cm"][0] == pytest.approx(4.0)
    assert rows["mujoco"][0] is rows["dart"][0] is None
    assert rows["ebm"][0] == 1.0
    assert [one.more for one in rows["cm"][1:]] == [tables.duration(0.8), tables.duration(5.0)]
    assert [bool(one.more) for one in rows["mujoco"][1:]] == [False, True]
    assert rows["cm"][1].value != rows["cm"][2].value


def test_costs_are_those_of_runs_that_were_done():
    cells = [
        cell("ebm", seconds=2.0, history="a/ebm.csv", outcome="at rest"),
        cell("cm", seconds=8.0, settings={"stiffness": 9e6}),
        cell("mujoco", status="failed", reason="it crashed", history="a/mujoco.csv"),
    ]
    made = run(*cells)
    table = tables.runs_table(made, cells, {"ebm": None, "cm": None})
    rows = {row[0]: row[1:] for row in table.rows}
    assert {len(row) for row in table.rows} == {len(table.columns)}
    assert rows["cm"][0] == "stiffness = 9000000.0"
    assert rows["mujoco"][1:6] == [""] * 5
    assert rows["cm"][4] == "12\u202f345"
    assert rows["cm"][2] != rows["ebm"][2]
    assert [one.link for one in rows["ebm"][-2:]] == ["../a/ebm.csv", "../a/ebm.events.csv"]
    assert rows["cm"][-2] == ""
    assert rows["mujoco"][-2:] == ["", ""]
    assert rows["mujoco"][6].value == "it crashed"
    ensemble = tables.runs_table(made, cells)
    assert len(ensemble.columns) == len(table.columns) - 2


def test_a_ratio_is_to_the_reference_s_time():
    cells = [cell("ebm", seconds=0.5), cell("cm", seconds=2.0)]
    rows = tables.runs_table(run(*cells), cells).rows
    assert rows[1][3] == tables.ratio(4.0)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({}, "nothing judged"),
        ({"checks": (check("pass"),)}, "within tolerance"),
        ({"checks": (check("fail", 3.0),)}, "out of tolerance"),
        ({"status": "failed"}, "failed"),
    ],
)
def test_a_cell_with_nothing_to_judge_says_so(more, words):
    assert words in tables.verdict_mark(cell(**more)).value.lower()


def test_without_the_reference_s_time_there_is_no_ratio():
    cells = [cell("cm", seconds=8.0)]
    assert tables.runs_table(run(*cells), cells).rows[0][3] == tables.ratio(None)
    still = [cell("ebm", seconds=0.0), *cells]
    assert tables.runs_table(run(*still), still).rows[1][3] == tables.ratio(None)


def test_impacts_that_added_energy_are_told():
    cost = results.CostRecord(energy_gains=3, largest_energy_gain=0.02)
    gained = cell("cm").model_copy(update={"cost": cost, "notes": ("a note",)})
    rows = tables.runs_table(run(gained), [gained]).rows
    assert rows[0][7].more == "a note; 3 impacts added energy, at most 2 %"
    assert tables.runs_table(run(cell()), [cell()]).rows[0][7].more == ""


def test_measures_are_sorted_by_name_and_window():
    view = type("View", (), {})()
    figures = [
        Figure(measure=measure, label=measure, unit="alpha", value=0.1, against="ebm", **window)
        for measure, window in (
            ("theta_rms", {}),
            ("theta_rms", {"window": "8s", "until": 8.0}),
            ("peak_ratio", {}),
            ("theta_rms", {"window": "4s", "until": 4.0}),
        )
    ]
    other = figures[0].model_copy(update={"against": "cm"})
    view.cells = [cell("cm", figures=(*figures, other), checks=(check("fail", 0.3),))]
    table = tables.measures_table(view, "ebm")
    assert [(row[0].value, row[0].more) for row in table.rows] == [
        ("peak_ratio", tables.window(figures[2])),
        ("theta_rms", tables.window(figures[3])),
        ("theta_rms", tables.window(figures[1])),
        ("RMS", tables.window(figures[0])),
    ]
    assert all("theta" in row[0].words or "\u03b8" in row[0].words for row in table.rows)
    judged = table.rows[-1][1]
    assert judged.verdict == "fail"
    assert judged.more == "limit 1"
    assert not any(row[1].verdict or row[1].more for row in table.rows[:-1])
    assert math.isclose(0.3, float(judged.value.split()[0]))
