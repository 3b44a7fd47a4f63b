"""What is judged near zero: errors, quantities and counts, their floors, what is better, and ratios
to nothing."""

import tomllib
import xml.etree.ElementTree as ET
from pathlib import Path
from types import SimpleNamespace

import pytest

from rockcheck.commands.cli import main
from rockcheck.scenes import Block, Floor, Rest, Scene
from rockcheck.validation.discrepancy.compare import compare
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.suite.acceptance import accept
from rockcheck.validation.suite.across import _moved
from rockcheck.validation.suite.results import Cell, Check, Run
from rockcheck.validation.suite.tables import improvements, junit, verdict_lines
from rockcheck.validation.suite.tolerances import MEASURES, Tolerance, floor_of, judge
from rockcheck.validation.uncertainty.numerical import Numerical, Quantity

SCENE = Scene(
    name="s",
    block=Block(half_width=0.2, half_height=1.0),
    floor=Floor(friction=0.5),
    excitation=Rest(),
    duration=2.0,
    output_step=0.005,
)


def check(
    measure: str,
    value: float | None,
    line: Tolerance | None,
    *,
    kind: str = "numerical",
    note: str = "",
    **more: float,
) -> Check:
    figure = Figure(measure=measure, label=measure, unit="1", value=value, against="r", note=note)
    return judge(figure, line, kind=kind, measure=MEASURES[measure], **more)


def run_of(*checks: Check, **more: object) -> Run:
    cell = Cell(scene="s", model="m", status="done", checks=checks)
    return Run(
        suite="mine",
        created="",
        reference="r",
        scenes={"s": {}},
        models=("r", "m"),
        cells=(cell,),
        **more,
    )


@pytest.mark.parametrize(
    ("measure", "line", "values"),
    [
        # A quantity counts by what it has beyond its floor, on either side of zero; far from zero
        # the floor says nothing.
        (
            "last_rotation",
            (2.8e-6, 1e-5, 1e-6),
            {2.2e-5: "pass", -2.2e-5: "pass", 2.5e-5: "changed", 3.5e-5: "fail", -3.5e-5: "fail"},
        ),
        ("last_rotation", (0.2, 1e-5, 1e-6), {0.2: "pass", 0.200005: "changed", 0.20002: "fail"}),
        # The drift band is as wide as it says, whatever the size of what was expected.
        ("end_time", (6.0, 1.0, 0.25), {6.25: "pass", 6.5: "changed", 7.5: "fail"}),
        (
            "floor_impacts",
            (50.0, 5.0, 1.0),
            {51.0: "pass", 52.0: "changed", 48.0: "changed", 56.0: "fail"},
        ),
        ("peak_rotation", (0.33, 0.01, 0.001), {0.33: "pass", 0.335: "changed", 0.345: "fail"}),
        # A figure just at its drift passes, one just at its limit does not fail: numbers that a
        # computer holds exactly.
        (
            "theta_rms",
            (0.25, 0.5, 0.125),
            {0.375: "pass", 0.125: "pass", 0.3750001: "changed", 0.1249999: "better"}
            | {0.5: "changed", 0.5000001: "fail", -0.5: "changed", 0.0: "better", -0.75: "fail"},
        ),
        # An error is better where it falls. Its limit holds as it is written.
        (
            "theta_rms",
            (2.3e-2, 4.6e-2, 1e-3),
            {1.4e-7: "better", 2.25e-2: "pass", 2.5e-2: "changed", 5e-2: "fail"},
        ),
        ("theta_rms", (0.1, 0.05, 1e-3), {0.06: "fail"}),
        ("theta_rms", (0.0, 1e-9, 0.0), {1e-10: "pass", 2e-9: "fail"}),
        (
            "peak_ratio",
            (1.125, 0.25, 0.01),
            {1.0: "better", 1.0625: "better", 0.875: "changed", 0.5: "fail"},
        ),
        (
            "peak_ratio",
            (1.0, 0.1, 0.05),
            {1.0: "pass", 0.94: "changed", 0.89: "fail", 1.11: "fail"},
        ),
        ("outcome_agrees", (0.0, 1.0, 0.0), {0.0: "pass", 1.0: "better"}),
        ("outcome_agrees", (1.0, 0.0, 0.0), {1.0: "pass", 0.0: "fail"}),
        ("events_agree_until", (None, 8.0, None), {8.0: "pass", 12.0: "pass", 7.9: "fail"}),
        (
            "events_agree_until",
            (9.0, 8.0, 0.1),
            {12.0: "better", 9.05: "pass", 8.5: "changed", 7.0: "fail"},
        ),
    ],
)
def test_the_rule(measure, line, values):
    tolerance = Tolerance(**dict(zip(("expected", "limit", "drift"), line, strict=True)))
    floor = 2.3e-5 if MEASURES[measure].role == "quantity" else None
    assert {
        value: check(measure, value, tolerance, floor=floor).verdict for value in values
    } == values


@pytest.mark.parametrize(
    ("measure", "line", "beside", "values"),
    [
        ("peak_rotation", (3.06e-4, 1e-5, 1e-6), 0.0, {7.7e-5: "better", 4e-4: "fail"}),
        ("peak_rotation", (3.06e-4, 1e-5, 1e-6), None, {7.7e-5: "fail", 4e-4: "fail"}),
        (
            "floor_impacts",
            (5.0, 0.1, 0.01),
            41.0,
            {53.0: "better", 41.0: "better", 4.0: "fail", 78.0: "fail"},
        ),
        ("highest_hop", (1.2e-3, 2e-3, 2e-6), 1.3e-3, {1.3e-3: "better", 1e-3: "changed"}),
    ],
)
def test_a_quantity_is_better_where_it_comes_nearer_to_the_reference(measure, line, beside, values):
    tolerance = Tolerance(**dict(zip(("expected", "limit", "drift"), line, strict=True)))
    assert {
        value: check(measure, value, tolerance, kind="absolute", beside=beside).verdict
        for value in values
    } == values


def test_nearer_to_another_model_form_is_not_better():
    line = Tolerance(expected=0.3, limit=0.5, drift=0.01)
    assert check("theta_rms", 0.1, line, kind="model form").verdict == "changed"


def test_floors_come_from_the_rows_and_from_u_num():
    """p = sqrt(3 g/(4 R)): what a block turns beyond a chord between two rows, (p h)^2/8 in alpha;
    g h^2/8 in m; a row in time."""
    p2 = 0.75 * 9.81 / (0.2**2 + 1.0) ** 0.5
    floors = {
        name: floor_of(MEASURES[name], SCENE, None)
        for name in ("last_rotation", "last_x", "end_time", "theta_rms", "floor_impacts")
    }
    assert floors == pytest.approx(
        {
            "last_rotation": p2 * 0.005**2 / 8,
            "last_x": 9.81 * 0.005**2 / 8,
            "end_time": 0.005,
            "theta_rms": 1e-6,
            "floor_impacts": 0.0,
        }
    )
    found = (
        Quantity(name="theta_rms", unit="alpha", value=1.0, u_num=3e-4, verdict="converged"),
        Quantity(name="peak_rotation", unit="alpha", value=1.0, u_num=0.1, verdict="not converged"),
    )
    known = Numerical(method="", quantities=found)
    assert [
        floor_of(MEASURES[name], SCENE, known)
        for name in ("theta_rms", "theta_peak", "peak_rotation")
    ] == [3e-4, 3e-4, 3e-4]


BETTER = check("theta_rms", 1e-3, Tolerance(expected=0.1, limit=0.2, drift=0.01))
PASSES = check("theta_rms", 0.1, Tolerance(expected=0.1, limit=0.2, drift=0.01))
CHANGED = check("theta_rms", 0.15, Tolerance(expected=0.1, limit=0.2, drift=0.01))
NOTHING = check("peak_ratio", None, None, note="not defined here: the reference does not rotate")


@pytest.mark.parametrize(
    ("strict", "codes", "failures"), [(False, (0, 0), 0), (True, (0, 1), 0), ("both", (1, 1), 1)]
)
def test_what_is_better_passes_unless_both_are_asked_for(strict, codes, failures):
    better = run_of(BETTER, PASSES, strict=strict)
    assert (better.exit_code, run_of(CHANGED, strict=strict).exit_code) == codes
    assert better.verdict == "pass"
    assert [
        line.startswith("s, m: theta_rms against r: 0.001 was 0.1") for line in improvements(better)
    ] == [True]
    assert not list(verdict_lines(better))
    assert ET.fromstring(junit(better)).get("failures") == str(failures)


def test_a_ratio_to_nothing_is_not_defined(made):
    """Neither against one that also stands, nor against one that moves; a candidate that stands
    beside a reference that rocks has one."""
    still, shivers, rocks = (
        made([0.0] * 300),
        made([1e-5, -1e-5] * 150, model="n"),
        made([0.1, -0.2] * 150, model="c"),
    )
    ratios = ("peak_ratio", "sprague_geers_m", "sprague_geers_p", "sprague_geers_c")
    for reference, candidate in (
        (still, rocks),
        (still, still),
        (shivers, rocks),
        (shivers, still),
    ):
        found = compare(reference, candidate)
        assert [found.figure(name).undefined for name in ratios] == [True] * 4
        assert not found.figure("theta_rms").undefined
    found = compare(rocks, still)
    assert [found.figure(name).undefined for name in ratios] == [False] * 4
    assert found["peak_ratio"] == 0.0


def test_what_is_not_defined_neither_passes_nor_fails():
    line = Tolerance(expected=1.0, limit=0.1, drift=0.01)
    with_line = check("peak_ratio", None, line, note=NOTHING.reason)
    assert (NOTHING.verdict, NOTHING.words, with_line.verdict) == (
        "not defined",
        "not defined",
        "not defined",
    )
    assert check("peak_ratio", None, line, note="m has no column theta").verdict == "fail"
    run = run_of(NOTHING, PASSES, strict=True)
    assert (run.verdict, run.exit_code, run.without_tolerance) == ("pass", 0, 0)
    assert ET.fromstring(junit(run)).get("skipped") == "1"
    assert run_of(NOTHING).verdict == "fail", "a run that judges nothing does not pass"


@pytest.fixture
def suite(tmp_path):
    suite = SimpleNamespace(path=Path("mine.toml"), scenes={"s": None}, ensembles={})
    suite.tolerances_path = tmp_path / "t.toml"
    suite.parts = (suite,)
    return suite


@pytest.mark.parametrize(
    ("old", "reason", "named", "line"),
    [
        (BETTER, None, "tightened", {"expected": 1e-3, "limit": 2e-3, "drift": 2e-4, "why": ""}),
        (
            CHANGED,
            "why not",
            "moved",
            {"expected": 0.15, "limit": 0.2, "drift": 0.01, "why": "why not"},
        ),
        (
            check("theta_rms", 0.5, Tolerance(expected=0.1, limit=0.2, drift=0.01)),
            "so",
            "loosened",
            {"expected": 0.5, "limit": 1.0, "drift": 0.01, "why": "so"},
        ),
        (check("theta_rms", 0.5, None), None, "new", None),
        (
            check("last_x", 0.5, Tolerance(expected=0.1, limit=0.2, drift=0.01), beside=0.5),
            None,
            "tightened",
            {"expected": 0.5, "limit": 0.2},
        ),
    ],
)
def test_accept_names_each_change(suite, old, reason, named, line):
    changes, refused = accept(suite, run_of(old, NOTHING), reason)
    assert refused == []
    assert [change.split(": ")[1] for change in changes] == [named]
    if line:
        again = tomllib.loads(suite.tolerances_path.read_text())["s"]["m"]["r"][old.figure.measure]
        assert {name: again[name] for name in line} == line


@pytest.mark.parametrize(
    "worse", [CHANGED, check("theta_rms", 0.5, Tolerance(expected=0.1, limit=0.2, drift=0.01))]
)
def test_accept_asks_a_reason_for_what_is_moved_or_loosened(suite, worse):
    changes, refused = accept(suite, run_of(worse), None)
    assert (changes, ["--reason" in line for line in refused]) == ([], [True])
    assert not suite.tolerances_path.exists()


@pytest.mark.parametrize(
    ("values", "moved"), [((1e-15, -3e-17), False), ((1e-15, 1e-3), True), ((0.0, None), True)]
)
def test_what_moves_within_its_resolution_is_no_trend(values, moved):
    for name in ("s, m: last_rotation", "s, m: theta_rms@8s against r"):
        assert _moved(name, *values) == moved


SUITE = """
reference = "still"
[models.still]
model = "faulty:Still"
[models.leans]
model = "faulty:Still"
offset = OFFSET
[require]
difference = ["theta_rms", "peak_ratio", "sprague_geers_c"]
figures = ["peak_rotation", "last_rotation"]
[[scene]]
name = "short"
duration = 0.2
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
"""
WORDS = ("mine.toml", "--allow-code", "faulty:Still", "--jobs", "1")


def lean(offset: str) -> None:
    Path("mine.toml").write_text(SUITE.replace("OFFSET", offset), encoding="utf-8")


@pytest.mark.usefixtures("in_an_empty_folder")
def test_a_better_step_passes_and_is_accepted_without_a_reason(typed):
    """The peak falls from 3.1e-4 to 7.7e-5 alpha, nearer to that of a reference that stands: to
    which no ratio is defined."""
    lean("8e-5")
    assert main(["accept", *WORDS]) == 0
    first = Path("mine.tolerances.toml").read_text()
    assert "peak_ratio" not in first
    assert main(["validate", *WORDS, "--no-report", "--strict"]) == 0
    lean("2e-5")
    out = typed("validate", *WORDS, "--no-report", "--strict")[0]
    assert "verdict: pass" in out
    for better in ("theta_rms against still", "peak_rotation", "last_rotation"):
        assert f"short, leans: {better}: 7.67" in out
    assert main(["validate", *WORDS, "--no-report", "--strict", "both"]) == 1
    assert main(["validate", "--strict", *WORDS, "--no-report"]) == 0, (
        "the suite is no value of --strict"
    )
    out = typed("accept", *WORDS)[0]
    assert out.count(": tightened: ") == 3
    assert main(["validate", *WORDS, "--no-report", "--strict", "both"]) == 0
    lean("8e-5")
    assert main(["validate", *WORDS, "--no-report"]) == 1, "back where it was is worse"
    assert "--reason" in typed("accept", *WORDS, code=1)[0]
