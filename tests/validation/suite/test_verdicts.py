"""What CI reads: totals and failures of the JUnit file, limits that hold to the last digit,
statistics against their definitions."""

import xml.etree.ElementTree as ET

import pytest

from rockcheck.validation.discrepancy import figures, impact_laws, measures
from rockcheck.validation.suite import (
    job_page,
    junit,
    results,
    run_summary,
    run_tables,
    shown_scenes,
    tolerances,
    verdicts,
)
from rockcheck.validation.uncertainty.numerical import Numerical, Quantity

EXACT = tolerances.Tolerance(expected=1.0, limit=0.0, drift=0.0, why="the same outcome")
LINE = tolerances.Tolerance(expected=0.25, limit=0.5, drift=0.125, why="a test")


def check(
    value: float | None,
    measure: str = "theta_rms",
    line: tolerances.Tolerance = LINE,
    *,
    kind: str = "numerical",
    **more: str,
) -> results.Check:
    about = {"label": measure, "unit": "alpha", "against": "r", **more}
    return verdicts.judge(
        figures.Figure(measure=measure, value=value, **about),
        line,
        kind=kind,
        measure=measures.DIFFERENCES[measure],
    )


def run_of(*cells: results.Cell, **more: object) -> results.Run:
    return results.Run(
        suite="mine",
        created="",
        reference="r",
        scenes={cell.scene: {} for cell in cells},
        models=("r", *dict.fromkeys(c.model for c in cells)),
        cells=cells,
        **more,
    )


def cell(
    scene: str, model: str, *checks: results.Check, reason: str = "", **more: object
) -> results.Cell:
    status = "failed" if reason else "done"
    return results.Cell(
        scene=scene, model=model, status=status, reason=reason, checks=checks, **more
    )


BROKEN = cell("a", "n", reason="more than 10 events")
MIXED = (
    cell(
        "a", "m", check(0.25), check(0.4, "theta_peak"), check(0.75, "x_rms")
    ),  # passes, has changed, fails
    BROKEN,
    cell("b", "m", check(0.4), check(0.9, "theta_peak")),
)


def totals(element: ET.Element) -> dict[str, int]:
    return {name: int(element.get(name, 0)) for name in ("tests", "failures", "errors")}


@pytest.mark.parametrize(("strict", "failures"), [(False, [1, 1, 1]), (True, [2, 2, 1])])
def test_totals_and_failures_of_the_junit_file(strict, failures):
    root = ET.fromstring(
        junit.junit(run_of(*MIXED, strict=strict, faults=("s.m.r: theta_rms: no such cell",)))
    )
    suites = {suite.get("name"): suite for suite in root.iter("testsuite")}
    assert {name: totals(suite) for name, suite in suites.items()} == {
        "a": {"tests": 5, "failures": failures[0], "errors": 1},
        "b": {"tests": 3, "failures": failures[1], "errors": 0},
        "tolerances": {"tests": 1, "failures": failures[2], "errors": 0},
    }
    assert totals(root) == {"tests": 9, "failures": sum(failures), "errors": 1}
    red = {
        (case.get("classname"), case.get("name").partition(" ")[0])
        for case in root.iter("testcase")
        if len(case)
    }
    changed = {("a.m", "theta_peak"), ("b.m", "theta_rms")} if strict else set()
    assert {one for one in red if one[0] != "tolerances"} == changed | {
        ("a.m", "x_rms"),
        ("a.n", "runs"),
        ("b.m", "theta_peak"),
    }
    assert [error.get("message") for error in root.iter("error")] == ["more than 10 events"]


@pytest.mark.parametrize(("read_back", "seconds"), [(False, 7.5), (True, 0.0)])
def test_a_cell_that_was_read_back_took_no_time(read_back, seconds):
    ran = cell("a", "m", cost=results.CostRecord(worker_seconds=7.5), read_back=read_back)
    assert float(ET.fromstring(junit.junit(run_of(ran))).find("testsuite").get("time")) == seconds


SURE = Quantity(name="theta_peak", unit="alpha", value=0.5, verdict="converged")


@pytest.mark.parametrize(
    ("quantities", "marks"),
    [
        (None, []),
        ([SURE], [[]]),
        (
            [SURE, SURE.model_copy(update={"verdict": "not converged", "reason": "it changes"})],
            [[("skipped", "it changes")]],
        ),
    ],
)
def test_a_cell_that_has_not_converged_is_skipped_with_its_reason(quantities, marks):
    numerical = quantities and Numerical(method="steps h, 2h, 3h and 4h", quantities=quantities)
    root = ET.fromstring(junit.junit(run_of(cell("a", "m", check(0.25), numerical=numerical))))
    cases = [case for case in root.iter("testcase") if case.get("name") == "converged"]
    assert [[(one.tag, one.get("message")) for one in case] for case in cases] == marks
    assert totals(root) == {"tests": 2 + len(cases), "failures": 0, "errors": 0}


def test_the_table_of_laws_has_the_models_that_met_a_landing():
    laws = {"am": "closed", "an": "", "ao": "", "bn": "open", "bm": "", "cm": ""}
    met = {
        law: impact_laws.LawFollowed(t=1.25, law=law, errors={}, spread=0.1)
        for law in ("closed", "open")
    }
    cells = (cell(*names, impact_law=met.get(law)) for names, law in laws.items())
    table = job_page.markdown(run_of(*cells)).split("(not judged):")[1].strip().splitlines()
    rows = [[entry.strip() for entry in line.strip("|").split("|")] for line in table]
    assert [rows[0], *rows[2:]] == [
        ["scene", "landing", "m", "n"],
        ["a", "1.250 s", "closed", ""],
        ["b", "1.250 s", "", "open"],
    ]


def test_the_summary_names_what_is_not_a_pass():
    text = job_page.markdown(run_of(*MIXED))
    said = (
        "## 💥 rockcheck mine: error",
        "3 simulations, 0 up to date, 5 checks",
        "theta_peak against r: 0.9 is more than 0.5",
    )
    assert [words for words in said if words not in text] == []


def test_a_large_run_shows_its_worst_scenes_in_the_suites_order():
    """The one that is out of tolerance, the nearest to their limits, and all ensembles; JUnit has
    every scene."""
    near = [cell(f"near {n}", "m", check(0.4)) for n in range(shown_scenes.MOST_SHOWN - 1)]
    far = [cell(f"far {n}", "m", check(0.25)) for n in range(30)]
    drawn = results.EnsembleRecord(name="drawn", definition={}, peaks={}, outcomes={})
    worst = (cell("drawn", "m", check(0.1)), *near, cell("out", "m", WAITS, check(0.75)))
    run = run_of(*far[:10], *worst[:-1], *far[10:], worst[-1], ensembles=(drawn,))
    assert shown_scenes.shown(run) == tuple(one.scene for one in worst)
    assert shown_scenes.shown(run_of(*near)) == tuple(one.scene for one in near)
    found = run_tables.finding_of(run)
    rows, (wrong, better) = found.table("verdicts").rows, found.blocks[2:4]
    # what fails is worse than what waits for a tolerance
    assert len(rows) == shown_scenes.MOST_SHOWN + 1
    assert rows[0][2] == worst[0].checks[0].figure.windowed
    assert rows[-1][3] == 1.5
    assert wrong.verdict == "fail"
    assert better.text
    text = job_page.markdown(run)
    # the number of the others is not a row of the table
    assert [words in text for words in ("| out |", "|\n\nand 30 more scenes", "| far 3 |")] == [
        True,
        True,
        False,
    ]
    assert len(ET.fromstring(junit.junit(run)).findall("testsuite")) == len(run.cells)


def test_the_summary_of_a_run_that_is_wrong_everywhere_has_an_end():
    text = job_page.markdown(
        run_of(*(cell(f"s{n}", "m", check(0.75)) for n in range(shown_scenes.MOST_SHOWN + 7)))
    )
    assert text.count("is more than 0.5") == shown_scenes.MOST_SHOWN
    assert "- and 7 more, in junit.xml" in text


WAITS = check(0.25).model_copy(update={"limit": None, "verdict": "fail"})


@pytest.mark.parametrize(
    ("one", "words"),
    [
        (WAITS, "no tolerance yet"),
        (WAITS.model_copy(update={"gap": "early"}), "fail"),
        (WAITS.model_copy(update={"figure": check(None).figure}), "fail"),
        # A run of such checks.
        (run_of(cell("a", "m", WAITS)), "no tolerance yet"),
        (run_of(cell("a", "m", WAITS), faults=("a tolerance without its cell",)), "fail"),
        (run_of(cell("a", "m", WAITS), cell("b", "m", check(0.75))), "fail"),
        (run_of(cell("a", "m", WAITS), BROKEN), "error"),
    ],
)
def test_what_waits_for_its_tolerance_has_not_failed_unless_something_else_has(one, words):
    assert one.verdict_words == words


ABSENT = results.Cell(scene="a", model="n", status="absent", reason="needs it")
PASSES, CHANGES, FAILS = (cell("a", "m", check(value)) for value in (0.25, 0.4, 0.75))


@pytest.mark.parametrize(
    ("cells", "more", "verdict", "code", "strict"),
    [
        ([PASSES], {}, "pass", 0, 0),
        ([PASSES, ABSENT], {}, "incomplete", 0, 1),
        ([PASSES, ABSENT, CHANGES], {}, "changed", 0, 1),
        ([CHANGES, FAILS], {}, "fail", 1, 1),
        ([FAILS, BROKEN], {}, "error", 3, 3),
        ([PASSES, cell("a", "o", reason="a fault", unexpected=True)], {}, "error", 70, 70),
        ([PASSES], {"faults": ("no such cell",)}, "fail", 1, 1),
        ([cell("a", "m")], {}, "fail", 1, 1),
        ([cell("a", "m")], {"judged": False}, "pass", 0, 0),
    ],
)
def test_the_worst_cell_is_the_verdict_of_the_run_and_has_its_exit_code(
    cells, more, verdict, code, strict
):
    runs = [run_of(*cells, strict=how, **more) for how in (False, True)]
    assert [
        (
            run.verdict,
            run.exit_code,
            any(f"<{red}" in junit.junit(run) for red in ("failure ", "error ")),
        )
        for run in runs
    ] == [(verdict, code, code > 0), (verdict, strict, strict > 0)]
    assert (runs[0].verdict_words == "not judged") == (not more.get("judged", True))
    assert [one.get("verdict") for one in run_summary.summary(runs[0])["cells"]] == [
        None if "judged" in more or not (one.checks or one.reason) else one.verdict for one in cells
    ]


FORM = check(0.9, kind="model form")
ALONE = check(0.9, "x_rms", against="")


@pytest.mark.parametrize(
    ("cells", "judged", "row"),
    [
        (MIXED, True, "| a |  | ❌ x_rms 7.50e-01 / 0.5 | 💥 |"),
        # Neither what another model form differs by, nor a figure that is held against no other
        # model, is what two solutions of the same equations differ by.
        (
            (cell("a", "m", check(0.26, "theta_peak"), FORM, ALONE), cell("a", "n", FORM, ALONE)),
            True,
            "| a |  | ❌ theta_peak 2.60e-01 / 0.5 | ❌ |",
        ),
        # A figure that is missing is not the worst of those that are there.
        (
            (cell("a", "m", check(0.9, "theta_peak"), check(None, "x_rms")),),
            True,
            "| a |  | ❌ theta_peak 9.00e-01 / 0.5 |",
        ),
        # Of a measure that is yes or no there is no distance.
        (
            (cell("a", "m", check(0.0, "outcome_agrees", EXACT), check(1.0, "outcome_agrees")),),
            True,
            "| a |  | ❌ outcome_agrees no |",
        ),
        ((cell("a", "m", WAITS, check(0.75)),), True, "| a |  | ❌ theta_rms 7.50e-01 / 0.5 |"),
        # Outcomes where nothing is judged, but of a cell without a history that it failed.
        (
            (cell("a", "m", outcome="overturned left", overturned_at=3.21), BROKEN),
            False,
            "| a |  | overturned left at 3.21 s | 💥 |",
        ),
    ],
)
def test_the_row_of_a_scene(cells, judged, row):
    lines = job_page.markdown(run_of(*cells, judged=judged)).splitlines()
    assert [line for line in lines if line.startswith("| a |")] == [row]


@pytest.mark.parametrize(
    ("limit", "reason"),
    [(0.0, "0, not 1 (at rest, not overturned left)"), (0.5, "0 is more than 0.5 from 1")],
)
def test_the_reason_gives_the_remark_where_the_figure_itself_is_asked_for(limit, reason):
    """Which outcomes they were; of a figure with a limit the distance says enough."""
    line = tolerances.Tolerance(expected=1.0, limit=limit, drift=0.0, why="the same outcome")
    more = {"unit": "1", "note": "at rest, not overturned left"}
    assert check(0.0, "outcome_agrees", line, **more).reason == reason
