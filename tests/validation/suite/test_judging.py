"""From a suite to the checks of its cells: what is measured, what is a yardstick, what is left out.
No model plays: records are made by hand."""

import dataclasses

import pytest

from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.execute import models, pool, provenance
from rockcheck.validation.study import FAULTS
from rockcheck.validation.suite import comparing, judging, planning, suites, tolerances
from rockcheck.validation.uncertainty import numerical

SUITE = """
reference = "ebm-unilateral"
[models.ebm-unilateral]
[models.ebm]
[models.cm]
[require]
figures = ["peak_rotation"]
[[scene]]
name = "s"
duration = 2.0
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
walls = [{ side = "left", gap = 0.05, restitution = 0.5 }]
[[scene]]
name = "long"
duration = 3.0
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
"""
LINE = """[tolerances.s.{}.figures]
peak_rotation = {{ expected = 0.5, limit = 0.05, drift = 0.01, why = "a test" }}
"""
RECORD = planning.CellRecord(
    outcome="at rest", notes=(), settings={}, uncertainty={}, numerical=None, cost={}
)
PLAYED = models.Played(RECORD)


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    path = tmp_path_factory.mktemp("judged") / "mine.toml"
    lines = map(LINE.format, ("ebm-unilateral", "ebm", "cm"))
    path.write_text(SUITE + "".join(lines), "utf-8")
    return suites.load_suite(path)


def planned(suite, model="cm"):
    return planning.plan(suite).cells["s"][model]


def figure(measure="peak_rotation", value=0.5, against=""):
    return Figure(measure=measure, label="", unit="alpha", value=value, against=against)


def cell_of(suite, peak, model="cm", reference=None, **more):
    """A cell with this peak rotation; `more` says what of it could not be compared."""
    compared = comparing.ComparedFigure(figure(value=peak), **more)
    record = comparing.ComparisonRecord(figures=(compared,), overturned_at=1.5)
    return judging.judged_cell(suite, planned(suite, model), PLAYED, record, reference)


def verdict_of(suite, peak, model="cm", reference=None):
    (check,) = cell_of(suite, peak, model, reference).checks
    return check.verdict


# --- the reference as a yardstick


@pytest.mark.parametrize(
    ("reference_peak", "verdict"), [(0.46, "better"), (0.54, "changed")], ids=["nearer", "farther"]
)
def test_a_figure_that_moved_is_better_if_it_is_nearer_to_the_reference(
    suite, reference_peak, verdict
):
    reference = cell_of(suite, reference_peak, "ebm-unilateral")
    reference = reference.model_copy(update={"checks": ()})
    assert verdict_of(suite, 0.47, reference=reference) == verdict


def test_without_a_reference_a_figure_that_moved_has_changed(suite):
    assert verdict_of(suite, 0.47) == "changed"


def test_the_reference_of_another_model_form_is_no_yardstick(suite):
    """Beside a wall the block may hop, which this model forbids."""
    reference = cell_of(suite, 0.46, "ebm-unilateral").model_copy(update={"checks": ()})
    assert verdict_of(suite, 0.47, "ebm", reference) == "changed"


def test_a_figure_of_the_reference_that_is_not_as_expected_is_no_yardstick(suite):
    assert verdict_of(suite, 0.47, reference=cell_of(suite, 0.46, "ebm-unilateral")) == "changed"


def test_yardsticks_are_the_reference_s_figures_of_itself(suite):
    reference = cell_of(suite, 0.5, "ebm-unilateral")
    more = (*reference.figures, figure("theta_rms", 0.1, against="ebm"))
    assert judging.usable_figures(reference.model_copy(update={"figures": more})) == {
        "peak_rotation": 0.5
    }


# --- what a check is


def test_a_suite_that_judges_nothing_has_no_checks(suite, monkeypatch):
    monkeypatch.setitem(suite.__dict__, "judged", False)
    assert cell_of(suite, 0.5).checks == ()


def checks_of(suite, key, kind, *compared):
    return list(judging.checks_of(suite, {key: kind}, compared, lambda measure: 0.0))


DIFFERENCE = tolerances.ToleranceKey("s", "cm", "ebm-unilateral", "theta_rms@1s")
APART = Figure(
    measure="theta_rms",
    label="",
    unit="alpha",
    value=0.1,
    against="ebm-unilateral",
    window="1s",
)


@pytest.mark.parametrize(
    ("kind", "fall", "gap"),
    [
        ("numerical", False, "ends at 1 s"),
        ("model form", False, "ends at 1 s"),
        ("measured", False, "ends at 1 s" + judging.OFFSET_HINT),
        ("numerical", True, "ends at 1 s"),
        ("model form", True, ""),
        ("measured", True, "ends at 1 s"),
    ],
)
def test_a_fall_leaves_a_gap_except_between_model_forms(suite, kind, fall, gap):
    compared = comparing.ComparedFigure(APART, "ends at 1 s", fall)
    (check,) = checks_of(suite, DIFFERENCE, kind, compared)
    assert check.gap == gap


def test_a_measured_history_without_a_gap_has_no_hint(suite):
    (check,) = checks_of(suite, DIFFERENCE, "measured", comparing.ComparedFigure(APART))
    assert check.gap == ""


def test_a_figure_that_is_missing_names_the_reference_and_the_window(suite):
    (check,) = checks_of(suite, DIFFERENCE, "numerical")
    assert check.verdict == "fail"
    assert check.reason == "nothing of ebm-unilateral to compare with here"
    assert check.figure.title == "theta_rms@1s against ebm-unilateral"


def test_a_figure_of_the_cell_itself_that_is_missing_was_not_computed(suite):
    key = tolerances.ToleranceKey("s", "cm", tolerances.CELL_FIGURES, "peak_rotation")
    (check,) = checks_of(suite, key, "absolute")
    assert check.reason == "not computed"
    assert check.figure.against == ""


# --- a cell without figures


REFUSED, SLOW = pool.Failure("no walls", refused=True), pool.Failure("too slow", timed_out=True)
CRASHED = pool.Failure("crashed", traceback="Traceback")


@pytest.mark.parametrize(
    ("outcome", "unnamed", "status"),
    [
        (REFUSED, {"cm"}, "unavailable"),
        (SLOW, {"cm"}, "unavailable"),
        (CRASHED, {"cm"}, "failed"),
        (REFUSED, {"ebm"}, "failed"),
        (REFUSED, (), "failed"),
    ],
)
def test_what_nobody_named_is_left_out_if_it_cannot_play_or_takes_too_long(
    suite, outcome, unnamed, status
):
    cell = judging.cell_of([planned(suite)], [outcome], outcome.reason, unnamed)
    assert cell.status == status


def test_what_is_left_out_says_how_it_is_played(suite):
    cell = judging.cell_of([planned(suite)], [REFUSED], "no walls", {"cm"})
    assert cell.reason == ("no walls; left out, since nobody named it: --models cm plays it alone")


def test_an_exception_of_a_model_of_rockcheck_is_unexpected_and_has_a_file(suite):
    task = planned(suite)
    cell = judging.cell_of([task], [CRASHED], "crashed")
    assert cell.unexpected
    assert cell.traceback == f"{FAULTS}/{task.kept_as}.txt"


def test_what_failed_without_an_exception_is_not_unexpected(suite):
    cell = judging.cell_of([planned(suite)], [REFUSED], "no walls")
    assert not cell.unexpected
    assert cell.traceback == ""


@pytest.mark.parametrize("read_back", [False, True])
def test_a_cell_is_read_back_where_its_run_was(suite, read_back):
    played = models.Played(RECORD, read_back=read_back)
    assert judging.cell_of([planned(suite)], [played]).read_back == read_back


def test_the_key_of_a_cell_is_that_of_its_task(suite):
    assert judging.cell_of([planned(suite)], [PLAYED]).key == planned(suite).key


@pytest.mark.parametrize("asked", [False, True])
def test_how_the_numerical_error_is_found_matters_where_it_is_asked_for(suite, monkeypatch, asked):
    config = suite.config.model_copy(update={"uncertainty": asked})
    asking = dataclasses.replace(suite, config=config)
    before, digest = planned(asking).key, provenance.code_digest

    def changed(module, *folders):
        return "another" if module == numerical.__name__ else digest(module, *folders)

    monkeypatch.setattr(provenance, "code_digest", changed)
    assert (planned(asking).key != before) == asked


# --- what is measured


def keys(*windowed, against="r"):
    return [tolerances.ToleranceKey("s", "m", against, one) for one in windowed]


def wanted(required, finished=("r",), yardsticks=("r",)):
    return planning.wanted_measures(yardsticks, required, finished)


def test_over_the_whole_time_all_measures_are_wanted_that_are_not_on_request():
    names = wanted([])["r"][""]
    on_request = [name for name in names if tolerances.MEASURES[name].on_request]
    assert "theta_rms" in names
    assert on_request == []


def test_a_measure_on_request_is_wanted_where_it_is_required():
    name = next(name for name, one in planning.measures.DIFFERENCES.items() if one.on_request)
    assert name in wanted(keys(name))["r"][""]


def test_within_a_window_the_required_measures_alone_are_wanted():
    assert wanted(keys("theta_rms@8s"))["r"]["8s"] == ["theta_rms"]


def test_what_is_wanted_anyhow_is_wanted_once():
    assert wanted(keys("theta_rms"))["r"][""].count("theta_rms") == 1


def test_a_reference_that_has_not_finished_is_no_yardstick():
    assert wanted([], finished=()) == {}


def test_a_check_against_another_reference_asks_nothing_of_this_one():
    assert list(wanted(keys("theta_rms@8s", against="q"))["r"]) == [""]


def test_the_history_itself_is_measured_whoever_has_finished():
    own = wanted([], finished=(), yardsticks=(tolerances.CELL_FIGURES,))
    assert "peak_rotation" in own[tolerances.CELL_FIGURES][""]


def test_windows_end_where_they_say_and_the_horizon_is_asked_for():
    windows = {"r": {"": [], "8s": [], tolerances.HORIZON: []}}
    assert planning.window_ends(windows, lambda: 3.5) == {"8s": 8.0, tolerances.HORIZON: 3.5}


def test_no_horizon_is_computed_that_no_window_needs():
    def never():
        raise AssertionError("nobody needs it")

    assert planning.window_ends({"r": {"": [], "8s": []}}, never) == {"8s": 8.0}


# --- the order of play


def test_of_models_that_compile_nothing_the_longest_efforts_begin_first(suite):
    """A wall counts as much as the whole duration: 2 s beside a wall before 3 s without."""
    slow = [
        dataclasses.replace(planned(suite), kept_as=name, scene=suite.scenes[name], compiles="")
        for name in ("long", "s")
    ]
    assert [task.kept_as for task in planning.in_order_of_play(slow)] == ["s", "long"]


def test_what_compiles_begins_before_what_others_have_compiled(suite):
    first, second = (
        dataclasses.replace(planned(suite), kept_as=name, scene=suite.scenes[name], compiles="a")
        for name in ("long", "s")
    )
    assert planning.in_order_of_play([first, second]) == [first, second]


@pytest.mark.parametrize(
    ("window_end", "matters"), [(None, True), (1.0, True), (0.5, False), (0.4, False)]
)
def test_laws_of_impacts_matter_in_windows_that_end_after_the_landing(window_end, matters):
    landing = comparing.impact_laws.Landing(t=0.5, start=0, parts=1, branches={})
    assert comparing._laws_matter(landing, window_end) == matters


def test_without_a_landing_no_law_matters():
    assert not comparing._laws_matter(None, None)


@pytest.mark.parametrize(
    ("values", "law"),
    [
        ((0.9, 1.05), "open"),
        ((0.95, 0.9), ""),
        ((1.1, -1.05), ""),
        ((0.9, 1.1), ""),
        ((float("nan"), 3.0), "open"),
    ],
)
def test_the_nearest_law_is_that_of_the_ratio_nearest_to_one(values, law):
    ratios = dict(zip(("", "open"), values, strict=True))
    found, _ = comparing._nearest_law("r", {name: {"r": value} for name, value in ratios.items()})
    assert found == law
