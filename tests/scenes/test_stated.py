"""What a file states of its motion is held against what was read."""

import numpy as np
import pytest

from rockcheck.scenes import Record, recordings
from rockcheck.scenes.recordings import Reading
from rockcheck.scenes.recordings.stated import Fact, Stated, last_digit, recording_of

G = 9.80665
VALUES = [0.0, 0.1, -0.3, 0.2]
STATED = {
    "count": Fact(4, "NPTS", line=4),
    "time_step": Fact(0.02, "DT", line=4),
    "unit": Fact("g"),
    "duration": Fact(0.08, "LENGTH", line=2),
    "peak": Fact(-0.3 * G, "PGA", line=3),
}


def read(values=VALUES, changes=(), **options):
    stated = Stated(**{**STATED, **dict(changes)})
    return recording_of(values, stated, Reading(**options), form="made up")


def test_a_file_that_agrees_with_itself_is_read_without_a_note():
    recording = read()
    np.testing.assert_allclose(recording.samples, np.array(VALUES) * G)
    assert recording.time_step == 0.02
    assert recording.notes == ()


@pytest.mark.parametrize("options", [{"unit": "g"}, {"time_step": 0.02}, {"unit": "g!"}])
def test_an_option_that_says_the_same_is_fine(options):
    assert read(**options).notes == ()


@pytest.mark.parametrize("seconds", [0.05, 0.06, 0.08, 0.1, 0.11])
def test_a_duration_may_count_samples_or_steps(seconds):
    assert read(changes={"duration": Fact(seconds)}).notes == ()


@pytest.mark.parametrize(
    ("word", "half"), [("0.058", 5e-4), ("58", 0.5), ("5.8E-2", 5e-4), ("5.8D+03", 50.0)]
)
def test_the_last_digit_leaves_half_of_its_unit_open(word, half):
    assert last_digit(word) == pytest.approx(half)


def test_a_peak_may_differ_by_its_tolerance():
    assert read(changes={"peak": Fact(0.308 * G)}).notes == ()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"count": Fact(5, "NPTS", line=4)}, "line 4: NPTS says 5, the file has 4 samples"),
        (
            {"duration": Fact(0.2, "LENGTH", line=2)},
            "line 2: LENGTH says 0.2 s, 4 samples every 0.02 s are 0.08 s",
        ),
        (
            {"peak": Fact(0.31 * G, "PGA", line=3)},
            "line 3: PGA says a peak of 0.31 g, the largest sample is 0.3 g",
        ),
    ],
)
def test_a_contradiction_names_both_numbers(changes, message, fault_of):
    assert message in str(fault_of(read, changes=changes))


@pytest.mark.parametrize(
    ("options", "message", "override"),
    [
        ({"unit": "gal"}, "the file states the unit g, not gal", "unit=gal!"),
        ({"time_step": 0.01}, "states a time step of 0.02 s, not 0.01 s", "time_step=0.01!"),
    ],
)
def test_an_option_that_contradicts_the_file_needs_a_mark(options, message, override, fault_of):
    fault = str(fault_of(read, **options))
    assert message in fault
    assert f"--read {override}" in fault


def test_a_marked_unit_holds_and_leaves_notes():
    recording = read(unit="gal!")
    assert recording.samples[2] == pytest.approx(-0.003)
    assert recording.notes[0] == "the unit gal is given; the file states g"
    assert recording.notes[1].startswith("PGA says a peak of ")


def test_a_marked_time_step_holds_and_leaves_notes():
    recording = read(time_step="0.01!", changes={"duration": Fact(2.0)})
    assert recording.time_step == 0.01
    assert recording.notes[0] == "the time step 0.01 s is given; the file states 0.02 s"
    assert recording.notes[1].startswith("the header says 2 s")


def test_what_is_not_stated_is_asked_for(fault_of):
    assert "--read time_step" in str(fault_of(read, changes={"time_step": None}))
    assert "--read unit" in str(fault_of(read, changes={"unit": None}))


def columns(peak):
    return f"time_s,acceleration_g\n0,0\n0.01,{peak}\n0.02,0\n"


def test_a_peak_above_5_g_is_told(written):
    (recording,) = recordings.read_components(written("a.csv", columns(6.0)))
    assert "6 g is more than any record known" in recording.notes[0]
    assert recordings.read_record(written("b.csv", columns(4.9))).notes == ()


def test_a_peak_above_20_g_is_refused_unless_it_is_asked_for(written, fault_of):
    path = written("a.csv", columns(299.9))
    fault = str(fault_of(Record.from_file, path))
    assert "a peak of 299.9 g in the unit g" in fault
    assert "--read unit=g!" in fault
    assert Record.from_file(path, unit="g!").peak == pytest.approx(299.9)


def stepped(step, header="time_s"):
    rows = "".join(f"{step * n:.10g},{0.1 * (n % 2)}\n" for n in range(200))
    return f"{header},acceleration_g\n{rows}"


@pytest.mark.parametrize("header", ["time_ms", "t_ms", "Time [ms]", "time (msec)"])
def test_times_may_be_in_milliseconds(written, header):
    recording = recordings.read_record(written("a.csv", stepped(10, header)))
    assert recording.time_step == pytest.approx(0.01)
    assert recording.notes == ()


def test_milliseconds_that_are_called_seconds_are_refused(written, fault_of):
    path = written("a.csv", stepped(10))
    fault = str(fault_of(Record.from_file, path))
    assert "a time step of 10 s; no record of an earthquake is so coarse" in fault
    assert "--read time_step=10!" in fault
    assert Record.from_file(path, time_step="10!").time_step == 10.0


def test_a_step_longer_than_that_of_records_is_told(written):
    recording = recordings.read_record(written("a.csv", stepped(0.1)))
    assert "a time step of 0.1 s is longer than that of records" in recording.notes[0]
    assert recordings.read_record(written("b.csv", stepped(0.05))).notes == ()


def test_a_first_column_of_times_is_known_whatever_it_is_called(written, fault_of):
    path = written("a.csv", stepped(0.01, "Zeit"))
    recording = recordings.read_record(path)
    assert recording.time_step == pytest.approx(0.01)
    assert recording.notes == ("column 1 is taken as the time in s",)
    assert "the times have a step of 0.01 s, not 0.1 s" in (
        str(fault_of(Record.from_file, path, time_step=0.1))
    )
