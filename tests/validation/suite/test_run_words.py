"""A finished run in words and tables: the terminal's, `--json`'s and a job page's."""

import pytest

from rockcheck.validation.discrepancy import figures
from rockcheck.validation.finding import Mark, plain
from rockcheck.validation.suite import (
    job_page,
    reasons,
    results,
    run_summary,
    run_tables,
    shown_scenes,
)


def check(value=0.1, verdict="pass", measure="theta_rms", limit=0.5, against="r", kind="numerical"):
    figure = figures.Figure(
        measure=measure, label=measure, unit="alpha", value=value, against=against
    )
    ideal = 0.0 if measure.startswith("theta") else 1.0
    return results.Check(
        figure=figure, kind=kind, verdict=verdict, limit=limit, ideal=ideal, reason="why"
    )


def cell(model="m", *checks, scene="s", reason="", **more):
    status = "failed" if reason else "done"
    return results.Cell(
        scene=scene, model=model, status=status, reason=reason, checks=checks, **more
    )


def run_of(*cells, **more):
    return results.Run(
        suite="mine",
        created="",
        reference="r",
        scenes={one.scene: {} for one in cells},
        models=("r", "m", "n"),
        cells=cells,
        **more,
    )


# --- remarks and reasons


@pytest.mark.parametrize(
    ("noted", "who"),
    [(("r", "m"), "all models"), (("m",), "m"), (("r",), "r")],
)
def test_a_remark_names_its_models_or_all(noted, who):
    cells = [cell(model, notes=("no lift",) if model in noted else ()) for model in ("r", "m")]
    assert list(reasons.note_lines(run_of(*cells))) == [f"s, {who}: no lift"]


def test_a_remark_of_the_only_model_names_it():
    lines = reasons.note_lines(run_of(cell("m", notes=("no lift",))))
    assert list(lines) == ["s, m: no lift"]


@pytest.mark.parametrize(
    ("verdict", "lines"),
    [("fail", ["s, m: theta_rms against r: why", "s, m: note: no lift"]), ("pass", [])],
)
def test_remarks_follow_the_reasons_of_a_cell_that_fails(verdict, lines):
    own = cell("m", check(verdict=verdict), notes=("no lift",))
    assert list(reasons.cell_lines(own)) == lines


# --- which scenes are shown


def test_two_hundred_scenes_are_shown_at_most():
    run = run_of(*(cell("m", check(), scene=f"s{number}") for number in range(202)))
    assert len(shown_scenes.shown(run)) == 200


def test_a_scene_without_checks_is_shown_after_those_near_a_limit():
    near = [cell("m", check(0.4), scene=f"s{number}") for number in range(200)]
    run = run_of(cell("m", scene="idle"), *near)
    assert "idle" not in shown_scenes.shown(run)


# --- the finding on a run


def row_of(*cells, **more):
    """The first row of verdicts of a run, without marks."""
    rows = run_tables.finding_of(run_of(*cells, **more)).table("verdicts").rows
    return [plain(entry) for entry in rows[0]]


@pytest.mark.parametrize(
    ("checks", "row"),
    [
        ([check(0.1), check(0.2, measure="theta_peak")], ["theta_peak", 0.4, "pass"]),
        # one that fails comes before one that is near its limit
        ([check(0.45), check(0.6, "fail", "theta_peak")], ["theta_peak", 1.2, "fail"]),
        # a limit of nothing, and a yes or no, are never near it
        ([check(0.0, limit=0.0)], ["as it must be", "", "pass"]),
        ([check(1.0, measure="outcome_agrees")], ["as it must be", "", "pass"]),
        ([check(0.0, "fail", "outcome_agrees")], ["outcome_agrees", "no", "fail"]),
        ([], ["nothing judged", "", "-"]),
    ],
)
def test_the_row_of_a_cell_has_the_check_that_is_nearest_to_its_limit(checks, row):
    assert row_of(cell("m", *checks)) == ["s", "m", *row]


def test_the_row_of_a_cell_that_failed_has_its_reason():
    assert row_of(cell("m", reason="no end")) == ["s", "m", "no end", "", "error"]


def test_the_name_of_a_scene_stands_in_its_first_row_alone():
    found = run_tables.finding_of(run_of(cell("m", check()), cell("n", check())))
    assert [row[0] for row in found.table("verdicts").rows] == ["s", ""]


@pytest.mark.parametrize(("strict", "verdict"), [(False, "pass"), (True, "pass"), ("both", "fail")])
def test_better_figures_are_red_where_they_fail_the_run(strict, verdict):
    found = run_tables.finding_of(run_of(cell("m", check(verdict="better")), strict=strict))
    texts = [block for block in found.blocks if getattr(block, "items", None)]
    assert texts[-1].verdict == verdict


def words_of(*cells):
    return " ".join(
        block.text
        for block in run_tables.finding_of(run_of(*cells)).blocks
        if hasattr(block, "text")
    )


@pytest.mark.parametrize(
    ("limit", "waits"), [(None, True), (0.5, False)], ids=["no tolerance", "a tolerance"]
)
def test_figures_without_a_tolerance_are_counted(limit, waits):
    words = words_of(cell("m", check(verdict="pass" if limit else "fail", limit=limit)))
    assert ("1 figures have no tolerance yet" in words) == waits


@pytest.mark.parametrize(
    ("verdict", "shown"), [("better", True), ("pass", False)], ids=["better", "as expected"]
)
def test_better_figures_have_a_heading(verdict, shown):
    assert ("better than expected;" in words_of(cell("m", check(verdict=verdict)))) == shown


def outcome_rows(*cells):
    (table,) = run_tables.outcome_tables(run_of(*cells, judged=False))
    return table.rows


@pytest.mark.parametrize(("model", "apart"), [("r", "ref."), ("m", 0.07)])
def test_the_reference_is_not_apart_from_itself(model, apart):
    figure = figures.Figure(
        measure="theta_rms", label="", unit="", value=0.07, against="r", window="horizon"
    )
    (row,) = outcome_rows(cell(model, figures=(figure,)))
    assert row[3] == apart


def test_a_cell_that_was_played_says_how_long_it_took():
    (row,) = outcome_rows(cell("m", outcome="at rest", cost=results.CostRecord(wall_seconds=1.25)))
    assert row[1] == "at rest"
    assert row[4] == "1.2 s"


def test_a_cell_that_failed_has_its_reason_in_place_of_an_outcome():
    (row,) = outcome_rows(cell("m", reason="no end"))
    assert row[1] == Mark("no end", "error")
    assert row[4] == ""


# --- plain values


PEAK = figures.Figure(measure="peak_rotation", label="", unit="alpha", value=0.4)


@pytest.mark.parametrize(
    ("outcome", "peak"), [("at rest", 0.4), ("overturned left", None)], ids=["stands", "falls"]
)
def test_a_block_that_fell_has_no_peak(outcome, peak):
    row = run_summary.outcome_row(cell("m", outcome=outcome, figures=(PEAK,)), "r")
    assert row["peak_rotation_alpha"] == peak
    assert row["outcome"] == outcome


def test_a_cell_that_failed_has_no_outcome():
    assert run_summary.outcome_row(cell("m", reason="no end"), "r")["outcome"] is None


# --- a job's page


@pytest.mark.parametrize(("more", "said"), [(0, False), (1, True)])
def test_reasons_beyond_the_most_shown_are_counted(more, said):
    count = shown_scenes.MOST_SHOWN + more
    run = run_of(*(cell("m", check(verdict="fail"), scene=f"s{n}") for n in range(count)))
    assert (f"- and {more} more, in junit.xml" in job_page.markdown(run)) == said


def test_a_name_of_more_than_a_thousand_letters_is_cut():
    page = job_page.markdown(run_of(cell("m", check())).model_copy(update={"suite": "x" * 1001}))
    assert "x" * 900 in page
    assert "x" * 1001 not in page
