"""Tables without times, headers of tables in words, and what a damaged table is read as."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from rockcheck.scenes import InputError, Record, recordings
from rockcheck.scenes.recordings import Reading, sets
from rockcheck.scenes.recordings.headers import facts_of
from rockcheck.scenes.recordings.layout import (
    Layout,
    has_decimal_commas,
    is_ambiguous_comma,
    layout_of,
)
from rockcheck.scenes.recordings.order import Shape, are_times, runs_along_rows
from rockcheck.scenes.recordings.recording import known_unit, numbers
from rockcheck.scenes.recordings.tables import unit_of_name
from rockcheck.validation.studies.population.intensity_measures import measure_of
from rockcheck.validation.suite.motions import RecordSet

VALUES = np.sin(0.3 * np.arange(100))
KNOWN = {"unit": "m/s2", "time_step": 0.02}


def along_lines(values=VALUES, across=5):
    words = [f"{value:.5f}" for value in values]
    return "".join(" ".join(words[k : k + across]) + "\n" for k in range(0, len(words), across))


def with_times(header="", separator=" "):
    rows = (f"{0.01 * k:.2f}{separator}{value:.5f}\n" for k, value in enumerate(VALUES))
    return header + "".join(rows)


def read(written, text, **options):
    return recordings.read_record(written("a.txt", text), Reading(**options))


def test_a_table_without_times_is_read_in_neither_order_alone(written, fault_of):
    fault = str(fault_of(read, written, along_lines(), **KNOWN))
    assert "along the lines: 100 samples, 2 s at 0.02 s" in fault
    assert "the column 2: 20 samples, 0.4 s at 0.02 s" in fault
    assert "--read order=rows" in fault
    assert "--read column=2" in fault


@pytest.mark.parametrize("across", [2, 5, 8, 10])
def test_order_rows_reads_along_the_lines(across, written):
    recording = read(written, along_lines(across=across), order="rows", **KNOWN)
    np.testing.assert_allclose(recording.samples, VALUES, atol=1e-5)


def test_a_column_says_what_it_leaves_out(written):
    recording = read(written, along_lines(), column=2, **KNOWN)
    np.testing.assert_allclose(recording.samples, VALUES[1::5], atol=1e-5)
    assert "along the lines there are 100 samples, 2 s" in recording.notes[0]


def test_order_columns_asks_for_the_column(written, fault_of):
    fault = str(fault_of(read, written, along_lines(), order="columns", **KNOWN))
    assert "5 columns; give that of the accelerations" in fault


def test_a_shorter_last_line_says_along_the_lines(written):
    recording = read(written, along_lines(VALUES[:98]), **KNOWN)
    np.testing.assert_allclose(recording.samples, VALUES[:98], atol=1e-5)
    assert recording.notes == ("the last line is shorter: numbers are taken along the lines",)


def test_a_shorter_last_line_is_no_column(written, fault_of):
    fault = str(fault_of(read, written, along_lines(VALUES[:98]), column=2, **KNOWN))
    assert "line 20: 3 numbers where the first line has 5" in fault


def test_a_shorter_line_in_between_is_a_fault(written, fault_of):
    text = along_lines().replace("\n", " 1.0\n", 1)
    assert "fields where the first line has 6" in str(
        fault_of(read, written, text, order="rows", **KNOWN)
    )


@pytest.mark.parametrize(
    "header",
    [
        "NPTS = 100\n",
        "NO. OF POINTS: 100\n",
        "number of samples: 100, units m/s2\n",
        "100 points\n",
    ],
)
def test_a_count_in_the_header_decides(header, written):
    recording = read(written, header + along_lines(), **KNOWN)
    np.testing.assert_allclose(recording.samples, VALUES, atol=1e-5)
    assert "along its lines" in recording.notes[0]


def test_a_count_may_decide_for_the_columns(written):
    recording = read(written, "NPTS = 20\n" + along_lines(), column=1, **KNOWN)
    np.testing.assert_allclose(recording.samples, VALUES[::5], atol=1e-5)


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        ({}, ["states 101 samples", "along the lines there are 100", "down a column 20"]),
        ({"order": "rows"}, ["states 101 samples", "--read order=rows!"]),
    ],
)
def test_a_count_that_fits_neither_order_is_an_error(options, parts, written, fault_of):
    fault = str(fault_of(read, written, "NPTS = 101\n" + along_lines(), **KNOWN, **options))
    for part in parts:
        assert part in fault


def test_a_marked_order_overrides_the_count_and_leaves_a_note(written):
    recording = read(written, "NPTS = 101\n" + along_lines(), order="rows!", **KNOWN)
    assert len(recording.samples) == 100
    assert recording.notes == ("the header states 101 samples, the table has 100",)


def test_times_are_no_numbers_along_the_lines(written, fault_of):
    fault = str(fault_of(read, written, with_times(), unit="m/s2", order="rows"))
    assert "the first column holds times" in fault


def test_times_are_held_against_the_option(written, fault_of):
    fault = str(fault_of(read, written, with_times(), unit="m/s2", time_step=0.02))
    assert "the times have a step of 0.01 s, not 0.02 s" in fault
    assert "--read time_step=0.02!" in fault


def test_a_line_of_other_words_names_no_columns(written, fault_of):
    """Five words over five numbers."""
    text = "RECORDED SOMEWHERE LONG AGO 1\n" + along_lines()
    assert "5 numbers a line" in str(fault_of(read, written, text, **KNOWN))


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("# dt = 0.02 s\n", "states a time step of 0.02 s, the times have 0.01 s"),
        ("# sampling rate: 50 Hz\n", "states a time step of 0.02 s, the times have 0.01 s"),
        ("# npts: 101\n", "states 101 samples, the table has 100"),
        ("# duration: 8 s\n", "says 8 s, 100 samples every 0.01 s are 1 s"),
        ("# PGA = 2.0 m/s2\n", "says a peak of 2 m/s2, the largest sample is 1 m/s2"),
        ("# units: gal\n", "states the unit gal, not m/s2"),
    ],
)
def test_what_a_header_states_is_held_against_the_table(header, message, written, fault_of):
    assert message in str(fault_of(read, written, with_times(header), unit="m/s2"))


@pytest.mark.parametrize("step", ["0.01", "0.0100999", "0.0099001"])
def test_a_time_step_of_the_header_is_that_of_the_times_within_a_hundredth(step, written):
    assert read(written, with_times(f"# dt = {step} s\n"), unit="m/s2").time_step == 0.01


def test_a_header_that_is_right_needs_no_option(written):
    header = "NPTS: 100\nDT = 0.01 s\nUnits: cm/s/s\nPGA = 1.0 cm/s2\n"
    recording = read(written, header + along_lines())
    np.testing.assert_allclose(recording.samples, 0.01 * VALUES, atol=1e-7)
    assert recording.time_step == 0.01


@pytest.mark.parametrize("unit", ["cm/sec2", "g", "m/s2"])
def test_a_line_of_the_header_may_say_in_what_unit_accelerations_are(unit):
    facts = facts_of([(1, "EW component"), (2, f"ACCELERATION IN {unit.upper()}")])
    assert facts.unit is not None
    assert facts.unit.value == known_unit(unit)


def test_values_of_a_header_that_differ_count_for_nothing():
    facts = facts_of([(1, "NPTS = 100"), (2, "NPTS = 200")])
    assert facts.count is None


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("acc cm/s2", "cm/s2"),
        ("a_g", "g"),
        ("accel_g", "g"),
        ("(m/s^2)", "m/s2"),
        ("acceleration_gal", "gal"),
        ("acc [mg]", "mg"),
        ("acc_m_s2", "m/s2"),
        ("acceleration (cm/sec/sec)", "cm/s2"),
        ("acc m s^-2", "m/s2"),
        ("a(gal)", "gal"),
        ("velocity m/s", ""),
        ("angle", ""),
        ("a", ""),
    ],
)
def test_names_of_columns_state_units(name, unit):
    assert unit_of_name(name) == unit


@pytest.mark.parametrize("header", ["time s acc cm/s2\n", "t acc_cm_s2\n", "time [s] a (gal)\n"])
def test_a_unit_in_a_header_is_not_overridden_in_silence(header, written, fault_of):
    text = with_times(header)
    assert read(written, text).samples == pytest.approx(0.01 * VALUES, abs=1e-7)
    assert "--read unit=g!" in str(fault_of(read, written, text, unit="g"))


@pytest.mark.parametrize(
    ("line", "decimal"),
    [("0,0 1,5", True), ("0 ,15", False), ("0.1, 0.2", False), ("1,5 2", True), ("1,5", False)],
)
def test_decimal_commas(line, decimal):
    assert has_decimal_commas(line) == decimal


@pytest.mark.parametrize(("head", "ambiguous"), [(["0,5"], True), (["t,a", "0,5"], False)])
def test_an_ambiguous_comma(head, ambiguous):
    assert is_ambiguous_comma("0,5", head) == ambiguous


@pytest.mark.parametrize(
    ("line", "decimal_comma"), [("0;1", False), ("0;1,5", True), ("0.5;1.5", False)]
)
def test_between_semicolons_a_comma_stands_before_decimals(line, decimal_comma):
    assert layout_of([(1, line)], Reading()) == Layout(";", decimal_comma)


def test_decimal_commas_are_known_on_a_line_of_any_length():
    line = "1,234 " * 2000
    assert layout_of([(1, line)], Reading()) == Layout(None, True)


@pytest.mark.parametrize(
    ("widths", "along"), [([5, 5, 2], True), ([5, 5, 5], False), ([5, 2, 5], False), ([5], False)]
)
def test_which_lines_run_along(widths, along):
    assert runs_along_rows(Shape(widths, first_line=1)) == along


@pytest.mark.parametrize(
    ("widths", "even"),
    [([5], True), ([5, 5, 2], True), ([5, 5, 7], False), ([5, 2, 5], False), ([5, 5, 2, 5], False)],
)
def test_lines_are_even_but_for_a_shorter_last_one(widths, even):
    assert Shape(widths, first_line=1).is_even == even


@pytest.mark.parametrize(
    ("values", "times"),
    [
        (0.01 * np.arange(50), True),
        (5.0 + 0.02 * np.arange(50), True),
        (np.round(np.arange(50) / 300, 2), True),
        (np.sin(np.arange(50)), False),
        (np.zeros(50), False),
        (np.arange(10.0), True),
        (np.arange(9.0), False),
        # of ten steps one or two are negative
        (np.array([0, 1, 2, 3, 4.1, 4, 6, 7, 8, 9, 10]), True),
        (np.array([0, 1, 2, 3, 4.1, 4, 6.1, 6, 8, 9, 10]), False),
    ],
)
def test_which_numbers_are_times(values, times):
    assert are_times(values, is_step_given=True) == times


def test_numbers_that_run_together_stand_in_columns_of_one_width(fault_of):
    lines = [(1, "-1.5-2.5"), (2, "-3.5-4.5"), (3, "-5.5")]
    assert numbers(lines, 5) == [-1.5, -2.5, -3.5, -4.5, -5.5]
    uneven = [lines[0], (2, "-5.5"), (3, "-3.5-4.5")]
    assert "'-1.5-2.5' is not a finite number" in str(fault_of(numbers, uneven, 5))
    assert "'x' is not a finite number" in str(fault_of(numbers, [(1, "0.1 x")]))


def test_a_folder_is_supplied_with_what_its_files_do_not_state(tmp_path):
    (tmp_path / "a.csv").write_text("time_s,acceleration_m_s2\n0,1\n0.01,2\n")
    (tmp_path / "b.txt").write_text("0 0.1\n0.01 0.2\n")
    motions, left_out = sets.motions_of(sets.files_of([tmp_path]), Reading(unit="g"))
    assert left_out == []
    units = {name: recording.unit for name, recording in motions}
    assert units == {"a.csv": "m/s2", "b.txt": "g"}
    assert motions[0][1].notes == ("the file's unit holds, not g, as for the set",)


def test_a_marked_unit_holds_for_a_whole_folder(tmp_path):
    (tmp_path / "a.csv").write_text("time_s,acceleration_m_s2\n0,1\n0.01,2\n")
    ((_, recording),), _ = sets.motions_of(sets.files_of([tmp_path]), Reading(unit="g!"))
    assert recording.unit == "g"
    assert recording.notes == ("the unit g is given; the file states m/s2",)


def test_what_is_left_out_is_a_line_a_reason():
    messages = [f"set/{k}.VT2, line {k}: 'VELOCITY'; only accelerations" for k in range(1, 43)]
    assert sets.grouped([*messages, "set/photo.jpg: not a text file"]) == [
        "42 files, 1.VT2, 2.VT2, 3.VT2, ...: 'VELOCITY'; only accelerations",
        "set/photo.jpg: not a text file",
    ]


def test_borehole_channels_stand_apart_unless_named(tmp_path):
    def knet(name, direction):
        header = {"Origin Time": "2011", "Sampling Freq(Hz)": "100Hz", "Dir.": direction}
        header |= {"Scale Factor": "3920(gal)/6182761", "Memo.": ""}
        path = tmp_path / name
        path.write_text("".join(f"{k:<18}{v}\n" for k, v in header.items()) + "0 1000 -1000 0\n")
        return path

    below, above = knet("S.EW1", "2"), knet("S.EW2", "5")
    motions, left_out = sets.motions_of(sets.files_of([tmp_path]), Reading())
    assert [name for name, _ in motions] == ["S.EW2"]
    assert "S.EW1: a borehole channel" in left_out[0]
    motions, left_out = sets.motions_of(sets.files_of([below, above]), Reading())
    assert [name for name, _ in motions] == ["S.EW1", "S.EW2"]


def test_the_command_shows_a_row_a_file(tmp_path, monkeypatch, typed):
    monkeypatch.chdir(tmp_path)
    for name in "ab":
        (tmp_path / f"{name}.csv").write_text("time_s,acceleration_g\n0,0\n0.01,0.25\n")
    (tmp_path / "photo.jpg").write_bytes(b"\xff\xd8\x00")
    for k in range(3):
        (tmp_path / f"{k}.txt").write_text("read me\n")
    out, _ = typed("record", ".", holds=["a.csv", "photo.jpg: not a text file"])
    assert len(out.strip().splitlines()) == 5


def test_a_record_tells_of_no_period_beyond_its_length(written, fault_of):
    recording = read(written, along_lines(), order="rows", **KNOWN)
    value = measure_of("sa:99").of
    assert "sa:99 is not resolved" in str(fault_of(value, recording, None))
    value = measure_of("sa:1").of
    assert value(recording, None) > 0.0


@pytest.mark.parametrize(
    ("unit", "size"),
    [("mg", 9.80665e-3), ("gal", 0.01), ("mm/s2", 1e-3), ("ft/s2", 0.3048), ("g", 9.80665)],
)
def test_a_unit_has_its_size_in_m_s2(unit, size, written):
    recording = read(written, with_times(), unit=unit)
    np.testing.assert_allclose(recording.samples, size * VALUES, atol=1e-5 * size)


@pytest.mark.parametrize(
    ("most", "beyond"),
    [
        ({"column": 1000}, {"column": 1001}),
        ({"component": 1000}, {"component": 1001}),
        ({"column": "a" * 100}, {"column": "a" * 101}),
        ({"header_lines": 10_000}, {"header_lines": 10_001}),
    ],
)
def test_an_option_has_a_largest_value(most, beyond, fault_of):
    assert Reading(**most)
    fault_of(Reading, **beyond)


def test_a_scale_of_nothing_is_refused(written, fault_of):
    path = written("a.csv", "time_s,acceleration_g\n0,0\n0.01,0.25\n")
    assert "scale: 0 leaves nothing" in str(fault_of(Record.from_file, path, scale=0.0))
    assert "scale: 0 leaves nothing" in str(fault_of(RecordSet, files=(str(path),), scale=0.0))


MUTATED = settings(
    max_examples=150,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
HEADER = "NPTS: 100\nDT = 0.01 s\nUnits: cm/s2\nPGA = 1.0 cm/s2\n"
TABLES = [HEADER + along_lines(), with_times(HEADER), HEADER + along_lines(across=1)]


def told_or_right(path, expected, tolerance):
    """The file at `path` is read as `expected`, or with a note, or refused."""
    try:
        recording = recordings.read_record(path)
    except InputError:
        return
    notes = [note for note in recording.notes if "column 1 is taken" not in note]
    notes = [note for note in notes if "the table has them along" not in note]
    if not notes:
        assert len(recording.samples) == len(expected)
        np.testing.assert_allclose(recording.samples, expected, atol=tolerance)


@MUTATED
@given(text=st.sampled_from(TABLES), line=st.integers(0, 103))
def test_a_line_that_is_cut_out_is_noticed(text, line, tmp_path):
    lines = text.splitlines()
    del lines[4 + line % (len(lines) - 4)]
    path = tmp_path / "a.txt"
    path.write_text("\n".join(lines) + "\n")
    told_or_right(path, 0.01 * VALUES, 1e-7)


@MUTATED
@given(text=st.sampled_from(TABLES), length=st.integers(1, 700))
def test_a_file_that_is_cut_off_is_noticed(text, length, tmp_path):
    path = tmp_path / "a.txt"
    path.write_text(text[:-length])
    # a cut within the last number leaves it with fewer digits
    told_or_right(path, 0.01 * VALUES, 0.01)


@MUTATED
@given(text=st.sampled_from(TABLES), unit=st.sampled_from(["g", "m/s2", "mg", "ft/s2", "mm/s2"]))
def test_a_unit_that_is_swapped_is_noticed(text, unit, tmp_path):
    path = tmp_path / "a.txt"
    path.write_text(text.replace("Units: cm/s2", f"Units: {unit}"))
    told_or_right(path, 0.01 * VALUES, 1e-7)


@MUTATED
@given(text=st.sampled_from(TABLES), digit=st.integers(0, 20))
def test_a_digit_that_is_dropped_from_the_header_is_noticed(text, digit, tmp_path):
    places = [k for k, sign in enumerate(text[: len(HEADER)]) if sign.isdigit()]
    place = places[digit % len(places)]
    path = tmp_path / "a.txt"
    path.write_text(text[:place] + text[place + 1 :])
    told_or_right(path, 0.01 * VALUES, 1e-7)
