"""Tolerances: what passes, what has changed, what fails; and how `accept` may rewrite them."""

import math
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest

from rockcheck.scenes import InputError
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.discrepancy.measures import DIFFERENCES, FIGURES
from rockcheck.validation.suite.acceptance import accept
from rockcheck.validation.suite.results import Cell, Run
from rockcheck.validation.suite.suites import load_suite, named_suites
from rockcheck.validation.suite.tolerances import (
    Tolerance,
    Windowed,
    judge,
    parse_tolerances,
)

LINE = Tolerance(expected=1.0e-3, limit=2.0e-3, drift=1.0e-4, why="a test")


def figure(value, measure="theta_rms", **more):
    return Figure(measure=measure, label=measure, unit="alpha", value=value, **more)


def verdict(value, line=LINE, measure="theta_rms", **more):
    known = DIFFERENCES.get(measure) or FIGURES[measure]
    return judge(figure(value, measure), line, kind="numerical", measure=known, **more).verdict


@pytest.mark.parametrize("value", [None, math.nan, math.inf, -math.inf])
def test_what_is_not_a_number_fails(value):
    assert verdict(value) == "fail"
    assert verdict(value, measure="events_agree_until") == "fail"
    assert verdict(value, measure="peak_rotation") == "fail"


def test_no_tolerance_and_a_gap_fail():
    assert verdict(0.0, line=None) == "fail"
    assert verdict(1.0e-3, gap="mujoco ends at 3 s") == "fail"


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("[a.b.c]\ntheta_rsm = {limit = 1.0}", "did you mean 'theta_rms'"),
        ('[a.b.c]\n"theta_rms@8" = {limit = 1.0}', "window '8'"),
        ("[a.b.c]\ntheta_rms = {limit = nan}", "limit"),
        ("[a.b.c]\ntheta_rms = {limit = -1.0}", "limit"),
        ("[a.b.c]\ntheta_rms = {expected = 1.0}", "limit: is missing"),
        ("[a.b.c]\ntheta_rms = {limit = 1.0, dirft = 1.0}", "dirft: unknown key"),
        ("[a.b.c]\ntheta_rms = 1.0", "a table"),
        ("[a.b.c]\npeak_rotation = {limit = 1.0, expected = 1.0}", "figures"),
        ("[a.b.figures]\npeak_rotation = {limit = 1.0}", "expected: is missing"),
        ("a = 1", "tables"),
    ],
)
def test_faults_in_a_file_are_named(text, fault):
    with pytest.raises(InputError, match=fault) as caught:
        parse_tolerances(tomllib.loads(text))
    assert "\n" not in str(caught.value)


def made_run(*checks):
    cell = Cell(scene="s", model="m", status="done", checks=checks)
    return Run(
        suite="mine", created="", reference="r", scenes={"s": {}}, models=("r", "m"), cells=(cell,)
    )


def check(value, line=LINE, measure="theta_rms"):
    return judge(
        figure(value, measure, against="r"), line, kind="numerical", measure=DIFFERENCES[measure]
    )


def accepted(path: Path, run: Run, reason: str | None = None):
    part = SimpleNamespace(
        path=Path("mine.toml"), tolerances_path=path, scenes={"s": None}, ensembles={}
    )
    return accept(SimpleNamespace(parts=[part]), run, reason)


FILE = (
    "# by hand\n\n[s.m.r]\n# the main one\n"
    'theta_rms = { expected = 0.001, limit = 0.002, drift = 0.0001, why = "a test" }\n'
)


@pytest.fixture
def tolerance_file(tmp_path):
    path = tmp_path / "mine.tolerances.toml"
    path.write_text(FILE, encoding="utf-8")
    return path


def test_accept_leaves_what_passes(tolerance_file):
    assert accepted(tolerance_file, made_run(check(1.05e-3))) == ([], [])
    assert tolerance_file.read_text() == FILE


def test_accept_moves_the_expected_figure_only_with_a_reason_and_keeps_the_limit(tolerance_file):
    changes, refused = accepted(tolerance_file, made_run(check(1.5e-3)))
    assert changes == []
    assert "--reason" in refused[0]
    assert tolerance_file.read_text() == FILE
    changes, refused = accepted(tolerance_file, made_run(check(1.5e-3)), "another step")
    assert refused == []
    assert changes == [
        "[s.m.r] theta_rms: moved: expected 0.001, limit 0.002, drift 0.0001 -> expected 0.0015,"
        " limit 0.002, drift 0.0001"
    ]
    text = tolerance_file.read_text()
    assert text.startswith("# by hand\n\n[s.m.r]\n# the main one\n")
    assert tomllib.loads(text)["s"]["m"]["r"]["theta_rms"] == {
        "expected": 0.0015,
        "limit": 0.002,
        "drift": 0.0001,
        "why": "another step",
    }


def test_accept_refuses_what_is_not_a_figure(tolerance_file):
    changes, refused = accepted(tolerance_file, made_run(check(math.nan)), "because")
    assert (changes, len(refused)) == ([], 1)
    gap = judge(
        figure(1e-3, against="r"),
        LINE,
        kind="numerical",
        measure=DIFFERENCES["theta_rms"],
        gap="m ends at 3 s",
    )
    assert accepted(tolerance_file, made_run(gap), "because")[1] == [
        "[s.m.r] theta_rms: m ends at 3 s"
    ]
    assert tolerance_file.read_text() == FILE


def test_accept_writes_a_line_that_was_missing(tmp_path):
    path = tmp_path / "new.toml"
    accepted(path, made_run(check(1.23456789e-3, None), check(0.99, None, "peak_ratio")))
    lines = parse_tolerances(tomllib.loads(path.read_text()))
    assert {str(place.what): (line.expected, line.limit) for place, line in lines.items()} == {
        "theta_rms": (0.0012345679, 0.0025),
        "peak_ratio": (0.99, 0.02),
    }


def test_a_new_line_holds_what_it_was_made_from(tmp_path):
    numbers = [("theta_rms", value) for value in (0.0, 1e-12, 3.3e-7, 0.123, 17.0)]
    for number, (measure, value) in enumerate([*numbers, ("peak_ratio", 0.99)]):
        path = tmp_path / f"{number}.toml"
        accepted(path, made_run(check(value, None, measure)))
        (line,) = parse_tolerances(tomllib.loads(path.read_text())).values()
        assert verdict(value, line, measure) == "pass"


def test_shipped_suites_load_and_their_tolerances_have_cells():
    for name in named_suites():
        suite = load_suite(name)
        cells = {((of or scene).name, variant.label) for scene, variant, of in suite.cells()}
        assert cells, name
        for place, line in suite.tolerances.items():
            assert (place.scene, place.model) in cells, str(place)
            assert line.why, str(place)
            assert line.expected is not None, str(place)
            assert line.drift is not None, str(place)


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
    lines = parse_tolerances(
        tomllib.loads(EVERYWHERE), [("a", "m"), ("b", "m"), ("c", "m"), ("a", "r")]
    )
    assert {
        (place.scene, str(place.what)): (line.limit, line.why) for place, line in lines.items()
    } == {
        ("a", "theta_rms"): (0.002, "the step"),
        ("b", "theta_rms"): (0.004, "another"),
        ("a", "outcome_agrees"): (0.0, "the same"),
        ("b", "outcome_agrees"): (1.0, "one falls"),
        ("c", "outcome_agrees"): (0.0, "the same"),
    }
    assert {place.scene for place in parse_tolerances(tomllib.loads(EVERYWHERE))} == {
        "*",
        "a",
        "b",
    }, "without a cell it is told as a fault"


def test_accept_writes_a_scene_s_own_line_beside_one_for_every_scene(tmp_path):
    path = tmp_path / "mine.tolerances.toml"
    path.write_text(EVERYWHERE.replace("[a.m.r]", "[s.m.r]"), encoding="utf-8")
    lines = {
        str(place.what): line
        for place, line in parse_tolerances(tomllib.loads(path.read_text()), [("s", "m")]).items()
        if place.scene == "s"
    }
    same = made_run(
        check(1.0e-3, lines["theta_rms"]), check(1.0, lines["outcome_agrees"], "outcome_agrees")
    )
    assert accepted(path, same) == ([], [])
    changes, refused = accepted(
        path, made_run(check(0.0, lines["outcome_agrees"], "outcome_agrees")), "one falls now"
    )
    assert (len(changes), refused) == (1, [])
    written = tomllib.loads(path.read_text())
    assert written["s"]["m"]["r"]["outcome_agrees"] == {
        "expected": 0.0,
        "limit": 1.0,
        "drift": 0.0,
        "why": "one falls now",
    }
    assert written["*"] == tomllib.loads(EVERYWHERE)["*"]


def test_windows():
    assert str(Windowed.parse("theta_rms@8s")) == "theta_rms@8s"
    assert Windowed.parse("theta_rms@1.5s") == Windowed("theta_rms", "1.5s")
