"""What CI reads: totals and failures of the JUnit file, limits that hold to the last digit,
statistics against their definitions."""

import xml.etree.ElementTree as ET

import pytest

from rockcheck.scenes import InputError
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.discrepancy.impact_laws import LawFollowed
from rockcheck.validation.discrepancy.measures import DIFFERENCES
from rockcheck.validation.suite.results import Cell, Check, CostRecord, EnsembleRecord, Run
from rockcheck.validation.suite.tables import (
    MARKS,
    MOST_SHOWN,
    junit,
    markdown,
    shown,
    verdict_table,
)
from rockcheck.validation.suite.tolerances import Tolerance, judge, parse_tolerances
from rockcheck.validation.uncertainty.numerical import Numerical, Quantity

LINE = Tolerance(expected=0.25, limit=0.5, drift=0.125, why="a test")


def check(value: float | None, measure: str = "theta_rms", line: Tolerance = LINE) -> Check:
    figure = Figure(measure=measure, label=measure, unit="alpha", value=value, against="r")
    return judge(figure, line, kind="numerical", measure=DIFFERENCES[measure])


def run_of(*cells: Cell, **more: object) -> Run:
    scenes = {cell.scene: {} for cell in cells}
    return Run(
        suite="mine",
        created="",
        reference="r",
        scenes=scenes,
        models=("r", *dict.fromkeys(c.model for c in cells)),
        cells=cells,
        **more,
    )


def cell(scene: str, model: str, *checks: Check, reason: str = "") -> Cell:
    return Cell(
        scene=scene,
        model=model,
        status="failed" if reason else "done",
        reason=reason,
        checks=checks,
    )


MIXED = (
    cell(
        "a", "m", check(0.25), check(0.4, "theta_peak"), check(0.75, "x_rms")
    ),  # passes, has changed, fails
    cell("a", "n", reason="more than 10 events"),
    cell("b", "m", check(0.4), check(0.9, "theta_peak")),
)


def totals(element: ET.Element) -> dict[str, int]:
    return {name: int(element.get(name, 0)) for name in ("tests", "failures", "errors")}


@pytest.mark.parametrize(("strict", "failures"), [(False, [1, 1, 1]), (True, [2, 2, 1])])
def test_totals_and_failures_of_the_junit_file(strict, failures):
    """A test case a run and a check; what has changed is red in a strict run only; totals of a
    suite and of all are the sums."""
    root = ET.fromstring(
        junit(run_of(*MIXED, strict=strict, faults=("s.m.r: theta_rms: no such cell",)))
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
    expected = {("a.m", "x_rms"), ("a.n", "runs"), ("b.m", "theta_peak")} | (
        {("a.m", "theta_peak"), ("b.m", "theta_rms")} if strict else set()
    )
    assert {one for one in red if one[0] != "tolerances"} == expected
    (error,) = root.iter("error")
    assert error.get("message") == "more than 10 events"


def test_a_cell_that_was_read_back_took_no_time():
    ran = cell("a", "m", check(0.25)).model_copy(update={"cost": CostRecord(worker_seconds=7.5)})
    for read_back, seconds in ((False, 7.5), (True, 0.0)):
        root = ET.fromstring(junit(run_of(ran.model_copy(update={"read_back": read_back}))))
        assert float(root.find("testsuite").get("time")) == seconds


def test_a_cell_that_has_not_converged_is_skipped_with_its_reason():
    """A case of its own, beside the run's: green where the run has converged, none where nothing
    was asked for."""

    def found(*quantities: Quantity) -> Cell:
        numerical = Numerical(method="steps h, 2h, 3h and 4h", quantities=quantities)
        return cell("a", "m", check(0.25)).model_copy(update={"numerical": numerical})

    sure = Quantity(name="theta_peak", unit="alpha", value=0.5, verdict="converged")
    unsure = Quantity(
        name="outcome",
        unit="",
        value="right",
        verdict="not converged",
        reason="the outcome changes: right, right, stands",
    )
    cases = {}
    for name, one in {
        "asked": found(sure),
        "unsure": found(sure, unsure),
        "unasked": cell("a", "m", check(0.25)),
    }.items():
        root = ET.fromstring(junit(run_of(one)))
        cases[name] = [case for case in root.iter("testcase") if case.get("name") == "converged"]
        assert totals(root) == {"tests": 2 + len(cases[name]), "failures": 0, "errors": 0}
    assert cases["unasked"] == []
    assert [len(case) for case in cases["asked"]] == [0]
    (skipped,) = cases["unsure"][0]
    assert (skipped.tag, skipped.get("message")) == ("skipped", unsure.reason)


def test_the_table_of_laws_has_the_models_that_met_a_landing():
    """One row a scene with such a landing, one column a model that followed a law in any scene;
    others have none."""

    def followed(scene: str, model: str, law: str) -> Cell:
        return cell(scene, model).model_copy(
            update={"impact_law": LawFollowed(t=1.25, law=law, errors={}, spread=0.1)}
        )

    cells = (
        followed("a", "m", "closed"),
        cell("a", "n"),
        cell("a", "o"),
        followed("b", "n", "open"),
        cell("b", "m"),
        cell("c", "m"),
    )
    table = markdown(run_of(*cells)).split("(not judged):")[1].strip().splitlines()
    rows = [[entry.strip() for entry in line.strip("|").split("|")] for line in table]
    assert [rows[0], *rows[2:]] == [
        ["scene", "landing", "m", "n"],
        ["a", "1.250 s", "closed", ""],
        ["b", "1.250 s", "", "open"],
    ]


def test_the_summary_of_a_run_that_nothing_judges_tells_the_outcomes():
    """And of a cell without a history that it failed, not an outcome."""
    fell = cell("a", "m").model_copy(update={"outcome": "overturned left", "overturned_at": 3.21})
    row = markdown(
        run_of(fell, cell("a", "n", reason="more than 10 events"), judged=False)
    ).splitlines()[-1]
    assert [entry.strip() for entry in row.strip("|").split("|")] == [
        "a",
        "",
        "overturned left at 3.21 s",
        MARKS["error"],
    ]


def test_the_summary_names_what_is_not_a_pass():
    text = markdown(run_of(*MIXED))
    assert "## 💥 rockcheck mine: error" in text
    assert "3 simulations, 0 up to date, 5 checks" in text
    assert "theta_peak against r: 0.9 is more than 0.5" in text
    assert [line for line in text.splitlines() if line.startswith("| a |")] == [
        "| a |  | ❌ x_rms 7.50e-01 / 0.5 | 💥 |"
    ]


def test_a_large_run_shows_its_worst_scenes_in_the_suites_order():
    """The one that is out of tolerance, the nearest to their limits, and all ensembles; JUnit has
    every scene."""
    near = [cell(f"near {n}", "m", check(0.4)) for n in range(MOST_SHOWN - 1)]
    far = [cell(f"far {n}", "m", check(0.25)) for n in range(30)]
    drawn = EnsembleRecord(name="drawn", definition={}, peaks={}, outcomes={})
    run = run_of(
        *far[:10],
        cell("drawn", "m", check(0.1)),
        *near,
        *far[10:],
        cell("out", "m", check(0.75)),
        ensembles=(drawn,),
    )
    assert shown(run) == ("drawn", *(one.scene for one in near), "out")
    assert len(verdict_table(run).rows) == MOST_SHOWN + 1
    text = markdown(run)
    assert "| out |" in text
    assert "| far 3 |" not in text
    assert "|\n\nand 30 more scenes" in text  # not a row of the table
    assert len(ET.fromstring(junit(run)).findall("testsuite")) == len(run.cells)
    assert shown(run_of(*near)) == tuple(one.scene for one in near)


def test_the_summary_of_a_run_that_is_wrong_everywhere_has_an_end():
    text = markdown(run_of(*(cell(f"s{n}", "m", check(0.75)) for n in range(MOST_SHOWN + 7))))
    assert text.count("is more than 0.5") == MOST_SHOWN
    assert "- and 7 more, in junit.xml" in text


def test_what_waits_for_its_tolerance_has_not_failed():
    """Nor has what no tolerance is written for: unless nothing was computed, part of the window is
    missing, or something else failed."""
    waits = check(0.25).model_copy(update={"limit": None, "verdict": "fail"})
    gone = waits.model_copy(update={"figure": waits.figure.model_copy(update={"value": None})})
    assert [one.words for one in (waits, waits.model_copy(update={"gap": "ends early"}), gone)] == [
        "no tolerance yet",
        "fail",
        "fail",
    ]
    for cells, faults, expected in (
        ((cell("a", "m", waits),), (), "no tolerance yet"),
        ((cell("a", "m", waits),), ("a tolerance without its cell",), "fail"),
        ((cell("a", "m", waits), cell("b", "m", check(0.75))), (), "fail"),
        ((cell("a", "m", waits), cell("b", "m", reason="no motion")), (), "error"),
    ):
        assert run_of(*cells, faults=faults).words == expected


def test_the_worst_cell_is_the_verdict_of_the_run_and_has_its_exit_code():
    """A model that is not installed, a figure that has changed, a tolerance without its cell,
    nothing to judge by, a fault inside."""
    absent = Cell(scene="a", model="n", status="absent", reason="needs it")
    passes, changed, failed = (cell("a", "m", check(value)) for value in (0.25, 0.4, 0.75))
    strange = Cell(scene="a", model="o", status="failed", reason="a fault", unexpected=True)
    for cells, more, verdict, code, strict in (
        ((passes,), {}, "pass", 0, 0),
        ((passes, absent), {}, "incomplete", 0, 1),
        ((passes, absent, changed), {}, "changed", 0, 1),
        ((changed, failed), {}, "fail", 1, 1),
        ((failed, cell("b", "m", reason="no motion")), {}, "error", 3, 3),
        ((passes, strange), {}, "error", 70, 70),
        ((passes,), {"faults": ("no such cell",)}, "fail", 1, 1),
        ((cell("a", "m"),), {}, "fail", 1, 1),
        ((cell("a", "m"),), {"judged": False}, "pass", 0, 0),
    ):
        runs = [run_of(*cells, strict=how, **more) for how in (False, True)]
        assert [run.verdict for run in runs] == [verdict, verdict]
        assert [run.exit_code for run in runs] == [code, strict]
    assert run_of(cell("a", "m"), judged=False).words == "not judged"
    assert not any(value for name, value in vars(CostRecord()).items() if name != "rules"), (
        "what was not counted is nothing"
    )


def test_a_figure_that_is_missing_is_not_the_worst_of_those_that_are_there():
    text = markdown(run_of(cell("a", "m", check(0.9, "theta_peak"), check(None, "x_rms"))))
    assert "| a |  | ❌ theta_peak 9.00e-01 / 0.5 |" in text


def test_the_table_shows_what_two_solutions_of_the_same_equations_differ_by():
    """Neither what another model form differs by, nor a figure that is held against no other
    model."""
    figure = Figure(measure="theta_rms", label="theta_rms", unit="alpha", value=0.9, against="r")
    form = judge(figure, LINE, kind="model form", measure=DIFFERENCES["theta_rms"])
    alone = judge(
        figure.model_copy(update={"measure": "x_rms", "against": ""}),
        LINE,
        kind="numerical",
        measure=DIFFERENCES["x_rms"],
    )
    text = markdown(
        run_of(cell("a", "m", check(0.26, "theta_peak"), form, alone), cell("a", "n", form, alone))
    )
    assert "| a |  | ❌ theta_peak 2.60e-01 / 0.5 | ❌ |" in text


def test_a_line_for_every_scene_is_completed_by_the_same_line_only():
    """Another measure's line leaves it as it is: without a limit."""
    tables = {
        "*": {"m": {"r": {"theta_rms": {"why": "a test"}}}},
        "a": {"m": {"r": {"x_rms": {"expected": 0.1, "limit": 1.0}}}},
    }
    with pytest.raises(InputError, match="theta_rms: limit: is missing"):
        parse_tolerances(tables, [("a", "m")])


def test_the_reason_gives_the_remark_where_the_figure_itself_is_asked_for():
    """Which outcomes they were; of a figure with a limit the distance says enough."""
    figure = Figure(
        measure="outcome_agrees",
        label="outcome",
        unit="1",
        value=0.0,
        against="r",
        note="at rest, not overturned left",
    )
    exact = Tolerance(expected=1.0, limit=0.0, drift=0.0, why="the same outcome")
    wide = Tolerance(expected=1.0, limit=0.5, drift=0.0, why="half of it")
    told, untold = (
        judge(figure, line, kind="numerical", measure=DIFFERENCES["outcome_agrees"]).reason
        for line in (exact, wide)
    )
    assert told == "0, not 1 (at rest, not overturned left)"
    assert untold == "0 is more than 0.5 from 1"
