"""What changed between two finished runs, and over a history of them, from runs made by hand."""

import math
from pathlib import Path

import pytest

from rockcheck import InputError
from rockcheck.reports import table_text
from rockcheck.validation.discrepancy import figures
from rockcheck.validation.suite import results, run_changes, trend


def figure(measure="theta_rms", value=1.0, note=""):
    return figures.Figure(
        measure=measure, label=measure, unit="alpha", value=value, against="r", note=note
    )


def check(one, verdict="pass"):
    return results.Check(figure=one, kind="numerical", verdict=verdict, limit=9.0)


def cell(model, *checks, scene="s", **more):
    return results.Cell(
        scene=scene,
        model=model,
        status="done",
        checks=checks,
        figures=tuple(one.figure for one in checks),
        **more,
    )


def run_of(*cells, **more):
    return results.Run(
        suite="mine",
        created="today",
        reference="r",
        scenes={"s": {}},
        models=("r", "m", "n"),
        cells=cells,
        **more,
    )


def run_with(values, verdict="pass"):
    """A run of a cell with figures of these values; the first one is judged so."""
    verdicts = [verdict, *["pass"] * (len(values) - 1)]
    checks = [
        check(figure(measure, value), judged)
        for (measure, value), judged in zip(values.items(), verdicts, strict=True)
    ]
    return run_of(cell("m", *checks))


# --- two runs


def test_verdicts_come_before_cells_outcomes_and_figures():
    before = run_of(
        cell("m", check(figure(value=1.0)), outcome="at rest"), cell("n", check(figure()))
    )
    after = run_of(cell("m", check(figure(value=2.0), "fail"), outcome="moving"))
    changes = run_changes.changes(before, after)
    assert [change.what for change in changes] == ["verdict"] * 3 + ["cell", "outcome", "figure"]


def test_of_figures_that_moved_the_largest_share_comes_first():
    before = run_with({"theta_rms": 1.0, "theta_peak": 100.0, "x_rms": 4.0})
    after = run_with({"theta_rms": 1.2, "theta_peak": 101.0, "x_rms": 2.0})
    changes = run_changes.changes(before, after)
    assert [change.name.partition(" ")[0] for change in changes] == [
        "x_rms",
        "theta_rms",
        "theta_peak",
    ]


def test_the_size_of_a_change_is_its_share_of_the_larger_value():
    change = run_changes.Change(what="figure", before=-4.0, after=1.0)
    assert change.size == pytest.approx(1.25)


@pytest.mark.parametrize(("before", "after"), [("pass", "fail"), (None, 1.0), (1.0, None)])
def test_what_is_no_number_on_both_sides_changed_without_bound(before, after):
    assert run_changes.Change(what="figure", before=before, after=after).size == math.inf


def test_a_cell_that_is_new_was_not_there():
    changes = run_changes.changes(run_of(), run_of(cell("m", check(figure()))))
    news = [(change.before, change.after) for change in changes if change.what == "cell"]
    assert news == [(None, "there")]


def test_a_figure_of_one_run_alone_is_no_change():
    both = run_of(cell("m", check(figure())))
    more = figure("x_rms", 3.0)
    extra = both.cells[0].model_copy(update={"figures": (*both.cells[0].figures, more)})
    assert run_changes.changes(both, both.model_copy(update={"cells": (extra,)})) == []


def test_a_check_of_one_run_alone_is_a_verdict_that_changed():
    before = run_of(cell("m", check(figure())))
    after = run_of(cell("m", check(figure()), check(figure("x_rms"))))
    changes = run_changes.changes(before, after)
    assert [(change.name, change.before, change.after) for change in changes] == [
        ("x_rms against r", None, "pass")
    ]


@pytest.mark.parametrize(
    ("was", "now", "moved"),
    [
        (1000.0, 1000.0 + 0.9e-6, False),  # within rounding of the larger value
        (1000.0, 1000.0 + 1.1e-6, True),
        (0.5, 0.5 + 0.9e-6, False),  # within the resolution of the measure
        (0.5, 0.5 + 1.1e-6, True),
        (0.5, 0.5 - 1.1e-6, True),
        (None, None, False),
        (None, 0.5, True),
    ],
)
def test_a_figure_has_moved_beyond_rounding_and_resolution(was, now, moved):
    assert run_changes.has_moved("s, m: theta_rms@8s against r", was, now) == moved


def test_runs_of_two_suites_have_no_changes():
    with pytest.raises(InputError, match="two suites, mine and other"):
        run_changes.changes(run_of(), run_of().model_copy(update={"suite": "other"}))


# --- the finding on two runs


def test_the_answer_counts_what_changed():
    found = run_changes.difference(
        run_with({"theta_rms": 1.0, "x_rms": 1.0}), run_with({"theta_rms": 2.0, "x_rms": 2.0})
    )
    assert found.answer == "mine: 2 figures changed"


def test_one_change_is_in_the_singular():
    found = run_changes.difference(run_with({"theta_rms": 1.0}), run_with({"theta_rms": 2.0}))
    assert found.answer == "mine: 1 figure changed"


@pytest.mark.parametrize(
    ("after", "code"),
    [
        (run_with({"theta_rms": 2.0}), 0),
        (run_with({"theta_rms": 1.0}, "changed"), 1),
        (run_of(cell("m", check(figure())), cell("n", check(figure()))), 1),
    ],
    ids=["a figure", "a verdict", "a cell"],
)
def test_a_verdict_or_a_cell_that_changed_is_exit_1(after, code):
    assert run_changes.difference(run_with({"theta_rms": 1.0}), after).exit_code == code


def test_versions_that_differ_are_listed():
    before = run_of(versions={"numpy": "2.0", "scipy": "1.15", "numba": "0.68"})
    after = run_of(versions={"numpy": "2.1", "scipy": "1.15", "mujoco": "3.2"})
    lines = run_changes.difference(before, after).blocks[-1].items
    assert lines == ["mujoco absent -> 3.2", "numba 0.68 -> absent", "numpy 2.0 -> 2.1"]


def run_of_cells(count, value):
    return run_of(
        *(cell("m", check(figure(value=value)), scene=f"s{number}") for number in range(count))
    )


@pytest.mark.parametrize(("more", "rows"), [(0, 20), (1, 20), (3, 20), (-1, 19)])
def test_at_most_so_many_moved_figures_are_in_the_table(more, rows):
    count = run_changes.MOST_MOVED + more
    found = run_changes.difference(run_of_cells(count, 1.0), run_of_cells(count, 2.0))
    assert len(found.table("changed").rows) == rows


@pytest.mark.parametrize(
    ("more", "lines"), [(0, []), (1, ["1 more figures moved: --json"])], ids=["all", "one more"]
)
def test_those_that_are_not_in_the_table_are_counted(more, lines):
    count = run_changes.MOST_MOVED + more
    found = run_changes.difference(run_of_cells(count, 1.0), run_of_cells(count, 2.0))
    assert found.blocks[-1].items == lines


def test_all_changes_are_in_the_data():
    count = run_changes.MOST_MOVED + 3
    found = run_changes.difference(run_of_cells(count, 1.0), run_of_cells(count, 2.0))
    assert len(found.data["changes"]) == count


def test_a_change_of_the_run_itself_stands_in_a_row_of_the_run():
    found = run_changes.difference(run_with({"x_rms": 1.0}), run_with({"x_rms": 1.0}, "fail"))
    assert found.table("changed").rows[0] == ["the run", "", "verdict", "pass", "fail"]


# --- a history of runs


def summary(figures_, created="today", commit="", not_passed=()):
    return trend.RunSummary(
        created=created,
        commit=commit,
        suite="mine",
        verdict="pass",
        figures={f"s, m: {name}": value for name, value in figures_.items()},
        not_passed=tuple(f"s, m: {name}" for name in not_passed),
    )


THREE = [
    summary({"theta_rms": 1.0, "x_rms": 1.0, "theta_peak": 5.0}, "first"),
    summary({"theta_rms": 3.0, "x_rms": 1.1, "theta_peak": 5.0}, "second", not_passed=["x_rms"]),
    summary({"theta_rms": 2.0, "x_rms": 1.1, "theta_peak": 5.0}, "third"),
]


def test_a_line_of_a_history_has_the_checks_that_do_not_pass():
    run = run_of(cell("m", check(figure()), check(figure("x_rms"), "changed")))
    line = trend.summary_of_run(run, Path())
    assert line.not_passed == ("s, m: x_rms against r",)


def test_figures_that_varied_and_those_that_did_not_are_counted():
    answer = trend.trend_of(THREE).answer
    assert answer == "2 figures varied, 1 stayed the same. The last run: pass."


def test_the_title_counts_the_runs():
    assert [trend.trend_of(THREE[:count]).title for count in (1, 2)] == [
        "mine over 1 run",
        "mine over 2 runs",
    ]


def test_the_table_has_the_widest_spread_first():
    rows = trend.trend_of(THREE).table("figures").rows
    assert rows == [
        ["s, m: theta_rms", 1.0, 1.0, 3.0, 3.0, 2.0],
        ["s, m: x_rms", 1.0, 1.0, 1.1, 1.1, 1.1],
    ]


def test_a_figure_that_is_always_zero_did_not_vary():
    runs = [summary({"theta_rms": 0.0}), summary({"theta_rms": 0.0})]
    assert trend.trend_of(runs).table("figures").rows == []


def test_a_figure_that_a_run_lacks_has_varied():
    runs = [summary({"theta_rms": 1.0, "x_rms": 2.0}), summary({"theta_rms": 1.0})]
    assert [row[0] for row in trend.trend_of(runs).table("figures").rows] == ["s, m: x_rms"]


def test_a_figure_that_no_run_has_did_not_vary():
    runs = [summary({"theta_rms": None}), summary({"theta_rms": None})]
    assert trend.trend_of(runs).table("figures").rows == []


def moved_text(runs):
    return trend.trend_of(runs).blocks[0]


def test_what_moved_since_the_run_before_is_listed():
    assert moved_text(THREE).items == ["s, m: theta_rms: 3 -> 2"]


def test_what_is_gone_is_listed_without_a_value():
    runs = [summary({"theta_rms": 1.5}), summary({"theta_rms": None})]
    assert moved_text(runs).items == ["s, m: theta_rms: 1.5 -> -"]


@pytest.mark.parametrize(("commit", "since"), [("", "second"), ("abc", "abc")])
def test_the_run_before_is_named_by_its_commit_or_else_its_time(commit, since):
    runs = [THREE[0], THREE[1].model_copy(update={"commit": commit}), THREE[2]]
    assert moved_text(runs).text == f"3 runs, 1 figures moved since {since}"


def test_of_a_single_run_nothing_moved():
    assert moved_text(THREE[:1]).text == "1 run, 0 figures moved"


def test_the_table_has_six_digits():
    table = trend.trend_of([summary({"theta_rms": 1.0}), summary({"theta_rms": 1.2345678})])
    assert " 1.23457 " in table_text.block_markdown(table.table("figures"))


@pytest.mark.parametrize(("note", "kept"), [("", 7.8), ("the block overturned at 1 s", None)])
def test_a_line_of_a_history_has_no_peak_of_a_block_that_fell(note, kept):
    run = run_of(cell("m", check(figure("peak_rotation", 7.8, note))))
    assert list(trend.summary_of_run(run, Path()).figures.values()) == [kept]


def many(value, count):
    return summary({f"theta_rms@{number}s": value + number for number in range(count)})


def test_ten_moved_figures_are_listed_at_most():
    runs = [many(1.0, 14), many(3.0, 14)]
    assert len(moved_text(runs).items) == 10


def test_twelve_figures_are_drawn_at_most():
    runs = [many(1.0, 14), many(3.0, 14)]
    (plot,) = trend.trend_of(runs).plots()
    assert len(plot.panels) == 12


def test_without_a_figure_that_varied_nothing_is_drawn():
    assert list(trend.trend_of([THREE[2], THREE[2]]).plots()) == []


def x_rms_panel():
    (plot,) = trend.trend_of(THREE).plots()
    return next(panel for panel in plot.panels if "x_rms" in panel.title)


def test_a_panel_has_a_line_over_the_runs_from_the_first():
    line = x_rms_panel().series[0]
    assert list(line.x) == [1, 2, 3]
    assert list(line.y) == [1.0, 1.1, 1.1]


def test_a_run_in_which_a_figure_did_not_pass_is_a_point():
    points = x_rms_panel().series[1]
    assert list(points.x) == [2]
    assert list(points.y) == [1.1]


def test_the_title_of_a_panel_has_the_figure_on_a_line_of_its_own():
    assert x_rms_panel().title == "s, m\nx_rms"


def test_the_runs_are_listed_from_the_last():
    rows = trend.trend_of(THREE).table("runs").rows
    assert [(row[0], row[-1]) for row in rows] == [("third", 0), ("second", 1), ("first", 0)]
