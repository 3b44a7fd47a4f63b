"""What the lines above a table of numbers state, line by line."""

import pytest

from rockcheck.scenes.recordings.headers import facts_of


def stated(*lines, unit=""):
    return facts_of(enumerate(lines, 1), unit)


def value(fact):
    return None if fact is None else fact.value


@pytest.mark.parametrize(
    ("line", "count"),
    [
        ("NPTS: 4000", 4000),
        ("number of points = 12", 12),
        ("500 data points", 500),
        ("NPTS: 1", 1),
        ("NPTS: 0", None),
        ("NPTS: 123456789012", None),
        ("points", None),
    ],
)
def test_a_count_has_a_label(line, count):
    assert value(stated(line).count) == count


@pytest.mark.parametrize(
    ("line", "step"),
    [
        ("DT = 0.005", 0.005),
        ("time step: 0.02 s", 0.02),
        ("sampling rate: 200", 0.005),
        ("sampling rate (Hz): 50", 0.02),
        ("sampling rate: 0.5", 2.0),
        ("sampling rate: 0", None),
        ("DT = 0", None),
        ("DT = 5 ms", None),
    ],
)
def test_a_time_step_is_stated_itself_or_by_its_rate(line, step):
    assert value(stated(line).time_step) == step


@pytest.mark.parametrize(
    ("line", "unit"),
    [("units: cm/s2", "cm/s2"), ("acceleration in g", "g"), ("a table (m/s^2)", "m/s2")],
)
def test_a_unit_is_known_by_its_words(line, unit):
    assert value(stated(line).unit) == unit


def test_a_duration_is_right_within_a_second():
    found = stated("duration: 40.5 s")
    assert value(found.duration) == 40.5
    assert found.duration_within == 1.0


@pytest.mark.parametrize(
    ("lines", "given", "peak"),
    [
        (["peak acceleration: -250 cm/s2"], "", 2.5),
        (["PGA = 0.5 g"], "", 0.5 * 9.80665),
        (["PGA = 250", "units: cm/s2"], "", 2.5),
        (["PGA = 250"], "cm/s2", 2.5),
        (["PGA = 250"], "", None),
    ],
)
def test_a_peak_has_its_unit_or_that_of_the_header(lines, given, peak):
    assert value(stated(*lines, unit=given).peak) == (None if peak is None else pytest.approx(peak))


def test_a_fact_names_its_line():
    assert stated("a record", "NPTS: 400").count.line == 2


def test_lines_that_do_not_agree_state_nothing():
    assert stated("DT = 0.005", "sampling rate: 100").time_step is None
    assert value(stated("DT = 0.005", "sampling rate: 200").time_step) == 0.005


def test_a_line_is_searched_up_to_its_three_hundredth_character():
    assert value(stated(" " * 290 + "NPTS: 4000").count) == 4000
    assert stated(" " * 300 + "NPTS: 4000").count is None


@pytest.mark.parametrize("before", range(250, 300))
def test_where_a_long_line_is_cut_no_number_is_read_short(before):
    line = "-" * before + " DT = 0.0123456 s" + " and more of it" * 20
    assert value(stated(line).time_step) in (None, 0.0123456)


@pytest.mark.parametrize("before", range(250, 300))
def test_where_a_long_line_is_cut_a_number_keeps_its_unit(before):
    """Milliseconds are not read as seconds."""
    line = "-" * before + " DT = 5 ms" + " and more of it" * 20
    assert stated(line).time_step is None


def test_what_a_long_line_states_before_its_cut_is_read():
    assert value(stated("DT = 0.01 s" + " and more of it" * 40).time_step) == 0.01


def test_what_ends_forty_characters_before_the_cut_is_read():
    assert value(stated("-" * 250 + " DT = 0.01" + " s" + "-" * 60).time_step) == 0.01
    assert stated("-" * 251 + " DT = 0.01" + " s" + "-" * 60).time_step is None
