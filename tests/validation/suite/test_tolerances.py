"""Tolerances: what passes, what has changed, what fails; and how `accept` may rewrite them."""

import math
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest

from rockcheck.validation.discrepancy import figures
from rockcheck.validation.suite import accepting, results, suites, tolerances, verdicts

LINE = tolerances.Tolerance(expected=1.0e-3, limit=2.0e-3, drift=1.0e-4, why="a test")


def check(value, line=LINE, measure="theta_rms", note="", **more):
    figure = figures.Figure(
        measure=measure, label=measure, unit="alpha", value=value, against="r", note=note
    )
    return verdicts.judge(
        figure, line, kind="numerical", measure=tolerances.MEASURES[measure], **more
    )


@pytest.mark.parametrize(
    ("one", "reason"),
    [
        *(
            (check(value, LINE, measure, note), note or "not a number")
            for measure in ("theta_rms", "events_agree_until", "peak_rotation")
            for value in (None, math.nan, math.inf, -math.inf)
            for note in ("", "m has no events")
        ),
        (check(0.0, line=None), "no tolerance yet"),
        (check(1.0e-3, gap="mujoco ends at 3 s"), "mujoco ends at 3 s"),
    ],
)
def test_what_is_no_number_or_has_no_tolerance_or_a_gap_fails_and_says_why(one, reason):
    assert one.verdict == "fail"
    assert one.reason == reason
    assert (one.figure.value is None and one.figure.of_a_fall) is False


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("[a.b.c]\ntheta_rsm = {limit = 1.0}", "did you mean 'theta_rms'"),
        ('[a.b.c]\n"theta_rms@8" = {limit = 1.0}', "window '8'"),
        ('[a.b.c]\n"theta_rms@0s" = {limit = 1.0}', "window '0s'"),
        ("[a.b.c]\ntheta_rms = {limit = nan}", "limit"),
        ("[a.b.c]\ntheta_rms = {limit = -1.0}", "limit"),
        ("[a.b.c]\ntheta_rms = {expected = 1.0}", "limit: is missing"),
        ("[a.b.c]\ntheta_rms = {limit = 1.0, dirft = 1.0}", "dirft: unknown key"),
        ("[a.b.c]\ntheta_rms = 1.0", "a table"),
        ("[a.b.c]\npeak_rotation = {limit = 1.0, expected = 1.0}", "figures"),
        ("[a.b.figures]\npeak_rotation = {limit = 1.0}", "expected: is missing"),
        ("a = 1", "tables"),
        # What another measure has for every scene completes no line.
        (
            '["*".b.c]\ntheta_rms = {why = "so"}\n[a.b.c]\nx_rms = {expected = 0.1, limit = 1.0}',
            "theta_rms: limit: is missing",
        ),
    ],
)
def test_faults_in_a_file_are_named(fault_of, text, fault):
    assert fault in str(fault_of(tolerances.parse_tolerances, tomllib.loads(text), [("a", "b")]))


FILE = (
    "# by hand\n\n[s.m.r]\n# the main one\n"
    'theta_rms = { expected = 0.001, limit = 0.002, drift = 0.0001, why = "a test" }\n'
)
NOT_DEFINED = check(None, None, "peak_ratio", "not defined here: the reference does not rotate")


@pytest.fixture
def accepted(written):
    """What `accept` says that it has changed and refused, and the file that had a text before it
    and has another after it; a link leads to it."""

    def accept_of(text, *checks, reason=None):
        kept = written("kept.toml", text)
        path = kept.with_name(f"{len(list(kept.parent.iterdir()))}.tolerances.toml")
        path.symlink_to(kept)
        run = results.Run(
            suite="mine",
            created="",
            reference="r",
            models=("r", "m"),
            scenes={"s": {}},
            cells=(results.Cell(scene="s", model="m", status="done", checks=checks),),
        )
        member = SimpleNamespace(
            path=Path("mine.toml"), tolerances_path=path, scenes={"s": None}, ensembles={}
        )
        return *accepting.accept(SimpleNamespace(members=[member]), run, reason), kept.read_text(
            "utf-8"
        )

    return accept_of


def line_of(expected, limit, drift, why="a test"):
    return {"expected": expected, "limit": limit, "drift": drift, "why": why}


FAR = tolerances.Tolerance(expected=0.1, limit=0.2, drift=0.01, why="a test")


@pytest.mark.parametrize(
    ("one", "reason", "change", "line"),
    [
        (
            check(1.5e-3),
            "another step",
            "[s.m.r] theta_rms: moved: expected 0.001, limit 0.002, drift 0.0001 -> "
            "expected 0.0015, limit 0.002, drift 0.0001",
            line_of(1.5e-3, 2e-3, 1e-4, "another step"),
        ),
        (check(1e-3, FAR), None, ": tightened: ", line_of(1e-3, 2e-3, 2e-4)),
        (check(0.15, FAR), "why not", ": moved: ", line_of(0.15, 0.2, 0.01, "why not")),
        (check(0.5, FAR), "so", ": loosened: ", line_of(0.5, 1.0, 0.01, "so")),
        # A line without a band gets one that today's value is within; a narrow one takes no
        # rounding.
        (check(0.15, FAR.replace(drift=None)), None, ": tightened: ", line_of(0.1, 0.2, 0.055)),
        (
            check(0.1234567891, FAR.replace(drift=0.0)),
            "so",
            ": moved: ",
            line_of(0.1234567891, 0.2, 0.0, "so"),
        ),
        (
            check(0.1234567891, FAR.replace(drift=1e-11)),
            "so",
            ": moved: ",
            line_of(0.1234567891, 0.2, 1e-11, "so"),
        ),
        # A quantity that has come to that of the reference.
        (check(0.5, FAR, "last_x", beside=0.5), None, ": tightened: ", line_of(0.5, 0.2, 0.01)),
        (
            check(1.23456789e-3, None, "x_rms"),
            None,
            ": new: ",
            line_of(0.0012345679, 2.5e-3, 2.5e-4, "first accepted figure"),
        ),
        (
            check(0.99, None, "peak_ratio"),
            None,
            ": new: ",
            line_of(0.99, 0.02, 2e-3, "first accepted figure"),
        ),
    ],
)
def test_accept_names_each_change_and_leaves_the_rest_of_the_file(
    accepted, one, reason, change, line
):
    (said,), refused, text = accepted(FILE, one, NOT_DEFINED, reason=reason)
    assert change in said
    assert refused == []
    lines = tomllib.loads(FILE)["s"]["m"]["r"] | {one.figure.measure: line}
    assert tomllib.loads(text) == {"s": {"m": {"r": lines}}}
    assert text.startswith(FILE.partition("theta_rms")[0])


@pytest.mark.parametrize(
    ("one", "reason", "refusals"),
    [
        (check(1.05e-3), None, []),  # it passes
        (check(1.05e-3, LINE.replace(expected=1.000000001e-3)), None, []),
        (check(1.5e-3), None, ["needs --reason"]),
        (check(0.5, FAR), None, ["needs --reason"]),
        (check(math.nan), "because", ["theta_rms: "]),
        (check(1e-3, gap="m ends at 3 s"), "because", ["[s.m.r] theta_rms: m ends at 3 s"]),
    ],
)
def test_accept_leaves_what_passes_and_refuses_what_it_may_not_write(
    accepted, one, reason, refusals
):
    changes, refused, text = accepted(FILE, one, reason=reason)
    assert changes == []
    assert text == FILE
    assert [said for said, line in zip(refusals, refused, strict=True) if said in line] == refusals


@pytest.mark.parametrize("text", ["s.m.q.x = { a = 1 }\ns.m.p.x = { a = 1 }\n", "s = { m = {} }\n"])
def test_accept_leaves_a_file_whose_form_it_cannot_keep(accepted, fault_of, text):
    assert "[scene.model.reference]" in str(fault_of(accepted, text, check(1.0, None)))


@pytest.mark.parametrize(
    ("measure", "value"),
    [*(("theta_rms", value) for value in (0.0, 1e-12, 3.3e-7, 0.123, 17.0)), ("peak_ratio", 0.99)],
)
def test_a_new_line_holds_what_it_was_made_from(accepted, measure, value):
    _, _, text = accepted("", check(value, None, measure))
    (line,) = tolerances.parse_tolerances(tomllib.loads(text)).values()
    assert check(value, line, measure).verdict == "pass"


@pytest.mark.parametrize("name", suites.named_suites())
def test_a_shipped_suite_loads_and_its_tolerances_are_whole_and_have_cells(name):
    suite = suites.load_suite(name)
    assert {((of or scene).name, variant.label) for scene, variant, of in suite.cells()} >= {
        (place.scene, place.model) for place in suite.tolerances
    }
    assert [
        str(place)
        for place, line in suite.tolerances.items()
        if None in (line.expected, line.drift) or not line.why
    ] == []


ALIKE = tolerances.Tolerance(expected=1.0, limit=0.0, drift=0.0, why="the same")
EVERYWHERE = """
["*".m.r]
outcome_agrees = { expected = 1.0, limit = 0.0, drift = 0.0, why = "the same" }
theta_rms = { why = "the step" }
[a.m.r]
theta_rms = { expected = 0.001, limit = 0.002, drift = 0.0001 }
[b.m.r]
theta_rms = { expected = 0.003, limit = 0.004, drift = 0.0001, why = "another" }
outcome_agrees = { expected = 0.0, limit = 1.0, drift = 0.0, why = "one falls" }
"""


def test_a_line_for_every_scene():
    lines = tolerances.parse_tolerances(
        tomllib.loads(EVERYWHERE), [("a", "m"), ("b", "m"), ("c", "m"), ("a", "r")]
    )
    assert {
        (place.scene, str(place.windowed)): (line.limit, line.why) for place, line in lines.items()
    } == {
        ("a", "theta_rms"): (0.002, "the step"),
        ("b", "theta_rms"): (0.004, "another"),
        ("a", "outcome_agrees"): (0.0, "the same"),
        ("b", "outcome_agrees"): (1.0, "one falls"),
        ("c", "outcome_agrees"): (0.0, "the same"),
    }
    assert {place.scene for place in tolerances.parse_tolerances(tomllib.loads(EVERYWHERE))} == {
        "*",
        "a",
        "b",
    }, "without a cell it is told as a fault"


def test_accept_writes_a_scene_s_own_line_beside_one_for_every_scene(accepted):
    text = EVERYWHERE.replace("[a.m.r]", "[s.m.r]")
    same, other = (check(value, ALIKE, "outcome_agrees") for value in (1.0, 0.0))
    assert accepted(text, same) == ([], [], text)
    written = tomllib.loads(accepted(text, other, reason="one falls now")[2])
    assert written["s"]["m"]["r"]["outcome_agrees"] == line_of(0.0, 1.0, 0.0, "one falls now")
    assert written["*"] == tomllib.loads(EVERYWHERE)["*"]


def test_a_better_figure_keeps_its_why_though_a_reason_is_given_for_others(accepted):
    better = check(0.5e-3)
    changes, refusals, text = accepted("", better, reason="a finer step")
    assert better.verdict == "better"
    assert refusals == []
    assert len(changes) == 1
    assert 'why = "a test"' in text


@pytest.mark.parametrize(("value", "limit"), [(5.0, 4.5), (1.2345, 1.1), (0.0345, 0.031)])
def test_what_is_to_be_at_least_so_large_has_a_limit_a_tenth_below(accepted, value, limit):
    """Of two digits, rounded down."""
    *_, text = accepted("", check(value, None, "events_agree_until"), reason="a test")
    line = tomllib.loads(text)["s"]["m"]["r"]["events_agree_until"]
    assert line["limit"] == limit
