"""Tables and plots of the searches over a gap and over an intensity, from answers made up."""

import math
from dataclasses import replace

import pytest
from assessed import SAFE, SCENE, interval

from rockcheck import Wall
from rockcheck.validation.finding import Mark
from rockcheck.validation.studies.population.search_blocks import gap_blocks, intensity_blocks
from rockcheck.validation.studies.population.statistics import (
    CaseFalls,
    GapRowAnswer,
    IntensityAnswer,
    RecordIntensity,
)
from rockcheck.validation.uncertainty.lognormal import Lognormal

# Gaps

#: Of four runs at the second gap three strike, and one falls.
ROWS = (
    GapRowAnswer(0.0, 4, 0, 0, 4, 0.1, 0.2),
    GapRowAnswer(0.05, 4, 1, 0, 3, 0.3, 0.5),
)


def gaps(*falls, draws_every=None, walls=SCENE.walls):
    answer = replace(SAFE, draws_every=draws_every, free_runs=4, falls=falls, rows=ROWS)
    return {block.name: block for block in gap_blocks(answer, SCENE.replace(walls=walls))}


def falls(case="a", draw=0, count=1):
    """A draw of a case that falls in intervals a millimetre wide."""
    lows = [0.03 + 0.002 * k for k in range(count)]
    intervals = [interval(draw, low, low + 1e-3, low - 1e-4, low + 1.1e-3) for low in lows]
    return CaseFalls(case, draw, tuple(intervals))


def lines(panel):
    return {series.label: series for series in panel.series}


def test_shares_of_runs_that_strike_are_by_gap():
    shares, _ = gaps()["gaps-left"].panels
    struck = lines(shares)["struck"]
    assert struck.x == [0.0, 0.05]
    assert struck.y == [1.0, 0.75]


def test_the_wall_of_the_scene_on_that_side_is_marked_from_none_to_all():
    walls = [Wall(side="left", gap=0.02), Wall(side="right", gap=0.04)]
    shares, _ = gaps(walls=walls)["gaps-left"].panels
    mark = lines(shares)["gap of the scene"]
    assert mark.x == [0.02, 0.02]
    assert mark.y == [0.0, 1.0]


def test_a_side_without_a_wall_has_no_mark():
    shares, _ = gaps(walls=[Wall(side="right", gap=0.04)])["gaps-left"].panels
    assert "gap of the scene" not in lines(shares)


def test_speeds_are_by_gap():
    _, speeds = gaps()["gaps-left"].panels
    assert lines(speeds)["median"].y == [0.1, 0.3]
    assert lines(speeds)["largest"].y == [0.2, 0.5]


def test_the_intervals_are_those_of_the_scene_as_it_is():
    table = gaps(falls("a"), falls("b", draw=2))["gap_intervals_left"]
    (row,) = table.rows
    assert row == ["a", 0.03, 0.031, pytest.approx(0.0299), pytest.approx(0.0311)]


def test_ends_of_intervals_are_shown_to_four_digits():
    columns = gaps(falls())["gap_intervals_left"].columns
    assert [column.digits for column in columns[1:]] == [4, 4, 4, 4]


def test_where_they_stand_is_left_out_in_brief():
    columns = gaps(falls())["gap_intervals_left"].columns
    assert [column.name for column in columns if not column.brief] == [
        "stands_below",
        "stands_above",
    ]


@pytest.mark.parametrize(("draw", "on"), [(0, "page"), (1, "file")])
def test_a_table_without_intervals_is_a_file_alone(draw, on):
    assert gaps(falls(draw=draw))["gap_intervals_left"].on == on


@pytest.mark.parametrize(("count", "folded"), [(12, False), (13, True)])
def test_more_than_a_dozen_intervals_are_folded(count, folded):
    assert gaps(falls(count=count))["gap_intervals_left"].folded == folded


def test_the_intervals_of_draws_are_a_file_of_their_own():
    table = gaps(falls("a"), falls("b", draw=2), draws_every=0.01)["gap_intervals_left_draws"]
    (row,) = table.rows
    assert row[:3] == [2, "b", 0.03]
    assert table.on == "file"


def test_without_draws_there_is_no_such_file():
    assert "gap_intervals_left_draws" not in gaps(falls())


def test_a_gap_at_which_a_run_falls_fails():
    table = gaps()["gaps_left"]
    assert table.rows == [
        [0.0, 4, Mark(0, "pass"), 4, 0.1, 0.2],
        [0.05, 4, Mark(1, "fail"), 3, 0.3, 0.5],
    ]


def test_the_runs_by_gap_are_folded_on_the_page():
    table = gaps()["gaps_left"]
    assert table.folded
    assert table.on == "page"
    assert table.columns[0].digits == 4


# Intensities

FIT = Lognormal(0.5, 0.3, 0.4, 0.6, ((0.4, 0.3), (0.6, 0.3)))


def record(case, least, *islands):
    return RecordIntensity(case, 0.4, least, 40.0, islands)


RECORDS = (record("a", 0.8), record("b", 0.2), record("c", None), record("d", 0.4))


def intensities(records=RECORDS, fit=FIT, unit="g"):
    answer = IntensityAnswer("pga", "PGA", unit, tuple(records), fit, 0)
    return {block.name: block for block in intensity_blocks(answer)}


def test_a_scene_that_was_not_scaled_has_no_intensities():
    assert intensity_blocks(None) == []


def test_a_record_may_stand_again():
    table = intensities([record("a", 0.6, (0.61234, 0.7), (0.8, 0.9))])["intensities"]
    assert table.rows == [["a", 0.4, 0.6, 40.0, "0.6123 to 0.7, 0.8 to 0.9", None]]


def test_the_intensity_from_which_a_record_falls_for_good_is_shown():
    falls = replace(record("a", 0.6, (0.6, 0.7)), for_good=0.9)
    table = intensities([falls])["intensities"]
    assert table.records()[0]["for_good"] == 0.9


def test_the_least_intensity_is_shown_to_four_digits():
    columns = {column.name: column for column in intensities()["intensities"].columns}
    assert columns["least"].digits == 4
    assert not columns["looked_up_to"].brief
    assert not columns["islands"].brief


@pytest.mark.parametrize(("count", "on"), [(1, "file"), (2, "page")])
def test_the_intensity_of_one_record_is_a_file_alone(count, on):
    assert intensities(RECORDS[:count])["intensities"].on == on


@pytest.mark.parametrize(("count", "folded"), [(12, False), (13, True)])
def test_more_than_a_dozen_records_are_folded(count, folded):
    assert intensities([record("a", 0.5)] * count)["intensities"].folded == folded


def test_a_step_is_the_share_of_all_records_that_have_fallen():
    """Of four records the third does not fall."""
    (panel,) = intensities()["intensity"].panels
    steps = lines(panel)["records"]
    assert steps.x == [0.1, 0.2, 0.4, 0.8]
    assert steps.y == [0.0, 0.25, 0.5, 0.75]


def test_the_curve_goes_from_half_the_least_to_twice_the_largest():
    (panel,) = intensities()["intensity"].panels
    curve = lines(panel)["lognormal"]
    assert curve.x[0] == pytest.approx(0.1)
    assert curve.x[-1] == pytest.approx(1.6)


def test_the_curve_is_the_lognormal_distribution():
    (panel,) = intensities()["intensity"].panels
    curve = lines(panel)["lognormal"]
    expected = [0.5 * math.erfc(-math.log(x / 0.5) / (0.3 * math.sqrt(2.0))) for x in curve.x]
    assert curve.y == pytest.approx(expected)


def test_the_band_of_draws_that_agree_is_the_curve():
    agreeing = Lognormal(0.5, 0.3, 0.5, 0.5, ((0.5, 0.3),) * 3)
    (panel,) = intensities(fit=agreeing)["intensity"].panels
    curve = lines(panel)["lognormal"]
    assert curve.low == pytest.approx(curve.y)
    assert curve.high == pytest.approx(curve.y)


def test_the_curve_has_points_at_each_step_and_just_below():
    (panel,) = intensities()["intensity"].panels
    ratios = [x / 0.4 for x in lines(panel)["lognormal"].x if abs(x / 0.4 - 1.0) < 1e-3]
    assert ratios == pytest.approx([1.0 - 1e-6, 1.0], abs=1e-9)


def test_the_axis_of_probability_is_from_none_to_all():
    plot = intensities()["intensity"]
    assert plot.y.limits == (0.0, 1.0)
    assert plot.x.log
    assert plot.live


@pytest.mark.parametrize(("unit", "label"), [("g", "PGA, g"), ("", "PGA")])
def test_the_axis_of_intensity_has_the_unit_of_the_measure(unit, label):
    assert intensities(unit=unit)["intensity"].x.label == label


@pytest.mark.parametrize("fit", [None, Lognormal(0.5, 0.0, 0.5, 0.5, ())])
def test_without_a_spread_there_is_no_curve(fit):
    assert "intensity" not in intensities(fit=fit)
