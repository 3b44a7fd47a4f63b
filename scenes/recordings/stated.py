"""What a record file states of its motion, held against what was read from it.

A reader collects the facts of a header as it meets them, and `recording_of` does the rest:

    stated = Stated(
        count=Fact(5372, "NPTS", line=4),
        time_step=Fact(0.01, "DT", line=4),
        unit=Fact("g"),
        peak=Fact(0.28 * UNITS["g"], "PGA", line=2),
    )
    recording_of(values, stated, reading, form="PEER AT2")

Options of `Reading` supply what is not stated. They override what is stated only with an
exclamation mark, and a note says so.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from rockcheck.scenes.base import Floats
from rockcheck.scenes.errors import InputError
from rockcheck.scenes.recordings.recording import (
    GRAVITY_OF_RECORDS,
    UNITS,
    Reading,
    Recording,
    fault,
    option,
    settled_step,
    settled_unit,
)

#: How far the largest sample may be from the peak that the file states, relative to that peak.
PEAK_TOLERANCE = 0.03
#: Peaks in g: above the first a note tells it, above the second the unit is taken to be wrong. The
#: largest that a network has recorded is about 4 g (Iwate-Miyagi 2008, vertical).
LARGE_PEAK, LARGEST_PEAK = 5.0, 20.0
#: Time steps in s: above the first a note tells it, above the second the times are taken to be in
#: another unit. Records have 0.001 to 0.02 s, digitised film at most 0.04 s.
LONG_STEP, LONGEST_STEP = 0.05, 1.0

Value = TypeVar("Value")


@dataclass(frozen=True)
class Fact(Generic[Value]):
    """A value that a file states, the file's word for it, and the line where it stands."""

    value: Value
    name: str = ""
    line: int | None = None


@dataclass(frozen=True, kw_only=True)
class Stated:
    """The facts that a file states of a motion; None where it does not.

    | fact | meaning |
    |---|---|
    | `count` | number of samples |
    | `time_step` | s |
    | `unit` | a key of `UNITS` |
    | `duration` | s; right within `duration_within`, and always within 1.5 time steps |
    | `peak` | largest absolute acceleration, m/s^2; its sign does not matter |
    | `peak_within` | m/s^2; what the peak's last digit leaves open, beside `PEAK_TOLERANCE` |
    """

    count: Fact[int] | None = None
    time_step: Fact[float] | None = None
    unit: Fact[str] | None = None
    duration: Fact[float] | None = None
    duration_within: float = 0.0
    peak: Fact[float] | None = None
    peak_within: float = 0.0


def recording_of(
    values: Sequence[float] | Floats,
    stated: Stated,
    reading: Reading,
    *,
    form: str,
    component: str = "",
    notes: Sequence[str] = (),
) -> Recording:
    """The recording of `values`, in the file's unit, after all that is stated has been checked.

    Raises `InputError`, with both numbers, where samples or options contradict what is stated, and
    where unit or time step are neither stated nor given.
    """
    _check_count(len(values), stated.count)
    if stated.time_step is None and reading.time_step is None:
        raise missing("the time step is not stated; ", stated, reading)
    unit, unit_notes = _unit(stated.unit, reading)
    time_step, step_notes = _time_step(stated.time_step, reading)
    samples = np.asarray(values, dtype=float) * UNITS[unit]
    return Recording(
        samples=samples,
        time_step=time_step,
        unit=unit,
        form=form,
        component=component,
        notes=(
            *notes,
            *unit_notes,
            *step_notes,
            *duration_notes(len(samples), time_step, stated, reading),
            *peak_notes(samples, unit, stated, reading),
        ),
    )


def missing(reason: str, stated: Stated, reading: Reading) -> InputError:
    """The error of a file without a time step: asks for it, and for a unit that is missing too."""
    if stated.unit is not None or reading.unit is not None:
        return fault(f"{reason}give the time step: {option('time_step', 0.01)}")
    return fault(
        f"{reason}the unit is not stated either; give both: --read time_step=0.01 --read unit=g"
        ' (in a scene file: time_step = 0.01, unit = "g"); units are'
        f" {', '.join(UNITS)}"
    )


def last_digit(word: str) -> float:
    """Half of the last printed digit's unit in a number: 0.0005 in 0.058."""
    mantissa, _, exponent = word.lower().replace("d", "e").partition("e")
    decimals = len(mantissa.partition(".")[2])
    return 0.5 * 10.0 ** (int(exponent or 0) - decimals)


def _check_count(samples: int, count: Fact[int] | None) -> None:
    if count is not None and samples != count.value:
        name = count.name or "the header"
        raise fault(f"{name} says {count.value}, the file has {samples} samples", count.line)


def _unit(stated: Fact[str] | None, reading: Reading) -> tuple[str, list[str]]:
    """The unit, and a note where it is not the one that is stated."""
    file_unit = stated.value if stated is not None else ""
    unit = settled_unit(file_unit, reading)
    if file_unit and UNITS[unit] != UNITS[file_unit]:
        return unit, [f"the unit {unit} is given; the file states {file_unit}"]
    return unit, []


def _time_step(stated: Fact[float] | None, reading: Reading) -> tuple[float, list[str]]:
    """The time step in s, and a note where it is not the one that is stated."""
    if stated is None:
        assert reading.time_step is not None  # `recording_of` has looked
        return reading.time_step, []
    step = settled_step(stated.value, reading)
    if step != stated.value:
        return step, [f"the time step {step:g} s is given; the file states {stated.value:g} s"]
    return step, []


def duration_notes(samples: int, time_step: float, stated: Stated, reading: Reading) -> list[str]:
    """A note where a time step that was given for the stated one contradicts the duration.

    Raises `InputError` where the duration is contradicted otherwise. It may count the samples or
    the steps between them.
    """
    duration = stated.duration
    if duration is None:
        return []
    slack = max(1.5 * time_step, stated.duration_within)
    if abs(samples * time_step - duration.value) <= slack * (1.0 + 1e-9):
        return []
    name = duration.name or "the header"
    message = (
        f"{name} says {duration.value:g} s, {samples} samples every {time_step:g} s are"
        f" {samples * time_step:g} s"
    )
    if "time_step" in reading.overriding:
        return [message]
    hint = f"; to read it all the same: {option('time_step', f'{time_step:g}!')}"
    raise fault(f"{message}{hint}", duration.line)


def peak_notes(samples: Floats, unit: str, stated: Stated, reading: Reading) -> list[str]:
    """A note where a unit that was given for the stated one contradicts the peak, in m/s^2.

    Raises `InputError` where the peak is contradicted otherwise.
    """
    peak = stated.peak
    if peak is None:
        return []
    largest = float(np.max(np.abs(samples), initial=0.0))
    expected = abs(peak.value)
    if abs(largest - expected) <= max(PEAK_TOLERANCE * expected, stated.peak_within):
        return []
    name = peak.name or "the header"
    message = (
        f"{name} says a peak of {expected / UNITS[unit]:.4g} {unit}, the largest sample is"
        f" {largest / UNITS[unit]:.4g} {unit}"
    )
    if "unit" in reading.overriding:
        return [message]
    hint = f"; to read it all the same: {option('unit', f'{unit}!')}"
    raise fault(f"{message}{hint}", peak.line)


def size_notes(recording: Recording, reading: Reading) -> list[str]:
    """Notes on a peak that few earthquakes reach, and on a time step that few records have.

    Raises `InputError` for a size that none has, unless it was given with an exclamation mark.
    """
    return [*_largest_notes(recording, reading), *_step_notes(recording.time_step, reading)]


def _step_notes(step: float, reading: Reading) -> list[str]:
    if step > LONGEST_STEP and "time_step" not in reading.overriding:
        raise fault(
            f"a time step of {step:.4g} s; no record of an earthquake is so coarse: are the times"
            " in ms? Give the right step with an exclamation mark, or this one to read it all the"
            f" same: {option('time_step', f'{step:g}!')}"
        )
    if step > LONG_STEP:
        return [f"a time step of {step:.4g} s is longer than that of records: is it right?"]
    return []


def _largest_notes(recording: Recording, reading: Reading) -> list[str]:
    peak = float(np.max(np.abs(recording.samples), initial=0.0)) / GRAVITY_OF_RECORDS
    if peak > LARGEST_PEAK and "unit" not in reading.overriding:
        raise fault(
            f"a peak of {peak:.4g} g in the unit {recording.unit}; no earthquake has shaken the"
            f" ground so: give the right unit with an exclamation mark, or this one to read it all"
            f" the same: {option('unit', f'{recording.unit}!')}"
        )
    if peak > LARGE_PEAK:
        return [f"a peak of {peak:.4g} g is more than any record known: is {recording.unit} right?"]
    return []
