"""What the benchmark says of errors and costs that are made up: lines, standings, tables."""

import itertools
import math
from types import SimpleNamespace

import pandas as pd
import pytest

from rockcheck.engines.facts import BenchmarkSteps
from rockcheck.reports import table_text
from rockcheck.validation.studies.work_precision import timing_blocks
from rockcheck.validation.studies.work_precision.curves import LEVEL, cost_at, error_at, slope
from rockcheck.validation.studies.work_precision.lines import LINES, lines_of_engine
from rockcheck.validation.studies.work_precision.points import KINDS, frame_of
from rockcheck.validation.studies.work_precision.runs import BenchmarkRun
from rockcheck.validation.studies.work_precision.savings import Saving
from rockcheck.validation.studies.work_precision.sentences import answer
from rockcheck.validation.studies.work_precision.standings import first_steps, league
from rockcheck.validation.studies.work_precision.timings import BatchSize, BatchTime, at_level

# --- what is swept


@pytest.mark.parametrize("line", LINES.values(), ids=LINES)
def test_the_values_of_a_line_fall_from_coarse_to_fine(line):
    assert sorted(set(line.values), reverse=True) == list(line.values)


@pytest.mark.parametrize("line", LINES.values(), ids=LINES)
def test_a_quick_run_has_two_values_or_more(line):
    assert len(set(line.quick)) >= 2


@pytest.mark.parametrize(
    "label", [label for label, line in LINES.items() if line.knob in ("tolerance", "penetration")]
)
def test_tolerances_and_penetrations_are_evenly_spaced_in_their_logarithm(label):
    values = LINES[label].values
    ratios = [fine / coarse for coarse, fine in itertools.pairwise(values)]
    assert ratios == pytest.approx([ratios[0]] * len(ratios))


@pytest.mark.parametrize(
    "label", [label for label, line in LINES.items() if line.knob == "largest_step"]
)
def test_each_largest_step_is_half_of_the_one_before(label):
    values = LINES[label].values
    assert [fine / coarse for coarse, fine in itertools.pairwise(values)] == [0.5, 0.5, 0.5]


def test_penetrations_by_which_convergence_is_judged_make_steps_of_a_tenth():
    """The step of the continuous model goes with the root of the penetration."""
    ratios = [fine / coarse for coarse, fine in itertools.pairwise(LINES["cm"].converge)]
    assert ratios == pytest.approx([0.01, 0.01])


@pytest.mark.parametrize("label", ["ebm", "ebm-unilateral", "ebm-bouc-wen", "cm"])
def test_a_quick_run_has_values_of_the_whole_one(label):
    assert set(LINES[label].quick) <= set(LINES[label].values)


@pytest.mark.parametrize(
    "label",
    [label for label, line in LINES.items() if label == line.family and line.knob == "time_step"],
)
def test_a_quick_run_leaves_out_the_finest_step_of_an_engine(label):
    values = LINES[label].values
    assert LINES[label].quick == (values[:-1] if len(values) > 2 else values)


# --- curves


def line_of(*points):
    return pd.DataFrame(points, columns=["value", "rms", "cpu"])


@pytest.mark.parametrize(
    ("vary", "labels"),
    [(True, ["e", "e adaptive", "e tolerance", "e default"]), (False, ["e", "e default"])],
)
def test_an_engine_has_lines_of_adaptive_steps_where_its_steps_vary(vary, labels):
    facts = SimpleNamespace(name="e", benchmark=BenchmarkSteps(), steps_vary=vary)
    assert [line.label for line in lines_of_engine(facts)] == labels


@pytest.mark.parametrize(
    ("steps", "quick"),
    [((1e-2, 1e-3, 1e-4), (1e-2, 1e-3)), ((1e-2, 1e-3), (1e-2, 1e-3))],
)
def test_a_quick_run_of_an_engine_has_two_steps_at_least(steps, quick):
    benchmark = BenchmarkSteps(diagram=steps)
    facts = SimpleNamespace(name="e", benchmark=benchmark, steps_vary=False)
    assert lines_of_engine(facts)[0].quick == quick


def test_the_order_is_that_of_the_errors_that_can_be_fitted():
    steps, errors = [1e-1, 1e-2, 1e-3], [1e-1, 1e-2, 1e-9]
    assert slope(steps, errors, (1e-6, 1.0)) == pytest.approx(1.0)


def test_a_step_that_is_not_known_is_not_fitted():
    assert slope([math.inf, 1e-2, 1e-3], [1e-1, 1e-2, 1e-4]) == pytest.approx(2.0)


def test_of_a_single_step_there_is_no_order():
    assert math.isnan(slope([1e-2, 1e-2], [1e-2, 1e-3]))


def test_two_steps_make_an_order():
    assert slope([1e-2, 1e-3], [1e-2, 1e-4]) == pytest.approx(2.0)


def test_an_error_of_nothing_is_not_interpolated():
    cost, _ = cost_at(line_of((1e-2, 1e-2, 1.0), (1e-3, 0.0, 16.0)))
    assert cost == 16.0


def test_a_run_that_failed_is_not_interpolated():
    cost, _ = cost_at(line_of((1e-2, math.inf, 1.0), (1e-3, 1e-4, 16.0)))
    assert cost == 16.0


def test_at_the_same_cost_twice_there_is_no_error_between():
    assert math.isnan(error_at(line_of((1e-2, 1e-2, 1.0), (1e-3, 1e-4, 1.0)), 1.0))


def test_an_error_at_a_cost_needs_two_errors():
    assert math.isnan(error_at(line_of((1e-2, 1e-2, 1.0), (1e-3, 0.0, 16.0)), 4.0))


# --- engines beside each other


def played(line, *settings, family="free"):
    """A run a setting: its value, its error and its CPU time a simulated second."""
    return [
        BenchmarkRun(
            family, 0, line, value, 2.0, rms=rms, cpu=2.0 * cpu, wall=cpu, set_up=0.0, steps=10
        )
        for value, rms, cpu in settings
    ]


def points(**lines):
    """The points of lines over the kind of scenes in which engines are compared."""
    kind = next(iter(KINDS))
    rows = [
        {"family": family, "line": line, "value": value, "rms": rms, "cpu": cpu}
        for family in (kind, "all")
        for line, settings in lines.items()
        for value, rms, cpu in settings
        if family == kind or line == "mujoco"
    ]
    return pd.DataFrame(rows)


CHEAP = [(1e-2, 1e-2, 0.01), (1e-3, 1e-4, 0.04)]
DEAR = [(1e-2, 1e-2, 0.1), (1e-3, 1e-4, 0.4)]
NEVER = [(1e-2, 1e-1, 1e-3), (1e-3, 1e-2, 2e-3)]
WORSE = [(1e-2, 0.5, 1e-4)]


def test_the_cheapest_line_at_the_level_comes_first_and_what_never_meets_it_last():
    standings = league(points(worse=WORSE, dear=DEAR, never=NEVER, mujoco=CHEAP))
    assert [standing.line for standing in standings] == ["mujoco", "dear", "never", "worse"]


def test_a_standing_has_the_cost_of_the_level_and_the_error_of_a_cost():
    (standing,) = league(points(mujoco=CHEAP))
    assert standing.cost == pytest.approx(0.02)
    assert standing.error == pytest.approx(LEVEL)
    assert standing.best == 1e-4
    assert standing.best_cost == 0.04


def test_a_line_that_always_failed_has_no_standing():
    assert league(points(mujoco=[(1e-2, math.inf, 0.1)])) == []


def first_step(*runs):
    (found,) = first_steps(frame_of([run for some in runs for run in some]))
    return found


def test_the_first_step_is_the_largest_that_meets_the_level():
    free = played("mujoco", (1e-2, 1e-2, 1.0), (1e-3, LEVEL, 1.0), (1e-4, 1e-4, 1.0))
    found = first_step(free)
    assert found.by_kind["free"] == 1e-3
    assert found.smallest == 1e-4


def test_in_all_kinds_it_is_the_largest_that_meets_it_everywhere():
    values = {"free": (1e-4, 1e-4), "pulse a": (1e-2, 1e-4), "wall 53 mm e 0": (1e-4, 1e-4)}
    runs = [
        played("mujoco", (1e-2, coarse, 1.0), (1e-3, fine, 1.0), family=family)
        for family, (coarse, fine) in values.items()
    ]
    found = first_step(*runs)
    assert found.by_kind == {"free": 1e-2, "pulse": 1e-3, "wall": 1e-2, "all": 1e-3}


# --- sentences


STANDING = {"line": "mujoco", "cost": 12.0}
CHEAPEST = (
    "The cheapest engine at an error of 0.001 alpha is mujoco: 12 ms of CPU a simulated second."
)


def test_without_tables_nothing_was_measured():
    assert answer({}) == "Nothing was measured."


@pytest.mark.parametrize(
    ("standings", "words"),
    [
        ([STANDING, {"line": "dart", "cost": 99.0}], CHEAPEST),
        ([STANDING | {"cost": math.nan}], ""),
        ([], ""),
    ],
    ids=["two", "none reaches it", "no engine"],
)
def test_the_cheapest_engine_is_named_where_one_meets_the_level(standings, words):
    assert answer({"league": standings}) == words


def test_the_batches_are_told_by_case():
    rows = [{"case": "friction", "evaluations": 123.4}, {"case": "wall", "evaluations": 50.0}]
    assert answer({"batches-at-level": rows}) == (
        "A run of the event-based model costs, in right-hand sides: friction 123, wall 50."
    )


def test_of_each_model_the_finest_error_is_told():
    rows = [{"model": "cm", "median_ebm-unilateral": error} for error in (1e-2, 3e-5)]
    assert answer({"levels": rows}).endswith("at the finest setting, alpha: cm 3.0e-05.")


# --- timings


def batch(tolerance, error, cpu, case="friction"):
    return BatchTime(
        case=case,
        tolerance=tolerance,
        runs=100,
        cpu=cpu,
        wall=cpu,
        evaluations=50.0,
        error_50=error,
        error_95=error,
        wrong=3,
        failed=0,
        right_hand_side=2e-8,
    )


def test_the_cheapest_tolerance_that_is_good_enough_is_chosen():
    good = [batch(1e-8, 1e-9, 3e-6), batch(1e-6, 1e-9, 2e-6), batch(1e-4, 1.0, 1e-6)]
    assert at_level(good, "friction").tolerance == 1e-6


def test_no_tolerance_of_another_case_is():
    assert at_level([batch(1e-8, 1e-9, 3e-6, "wall")], "friction") is None


def test_batches_cost_microseconds_a_run():
    table = next(timing_blocks.batch_blocks([batch(1e-8, 1e-9, 3e-6)]))
    assert table.rows == [["friction", 1e-8, pytest.approx(3.0), 50.0, 1e-9, "3 of 100"]]


def test_a_right_hand_side_takes_nanoseconds():
    table = next(timing_blocks.batch_blocks([batch(1e-8, 1e-9, 3e-6)]))
    assert table.note.endswith("One right-hand side: 20.0 ns.")


def test_sizes_have_a_row_and_threads_a_column():
    table = timing_blocks.size_table(
        [BatchSize(1, 1, 4e-6), BatchSize(9, 1, 2e-6), BatchSize(9, 2, 1e-6)]
    )
    assert [column.name for column in table.columns] == ["runs", "threads_1", "threads_2"]
    assert table.rows == [
        [1, pytest.approx(4.0), None],
        [9, pytest.approx(2.0), pytest.approx(1.0)],
    ]


def test_a_saving_is_the_ratio_of_its_costs():
    (row,) = timing_blocks.saving_table([Saving("cm", "wall", "ms", 3.0, 2.0)]).records()
    assert row["ratio"] == 1.5


def test_errors_and_changes_have_two_digits():
    batches = next(timing_blocks.batch_blocks([batch(1e-8, 1.234e-9, 3e-6)]))
    saved = timing_blocks.saving_table([Saving("cm", "wall", "ms", 3.0, 2.0, change=1.234e-5)])
    assert " 1.2·10⁻⁹ " in table_text.block_markdown(batches)
    assert " 1.2·10⁻⁵ " in table_text.block_markdown(saved)
