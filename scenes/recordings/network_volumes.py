"""Uncorrected accelerograms in the layout of Volume 1: CSMIP (CDMG), RENADIC, USC and BHRC.

A channel has 13 lines of text, 100 integers, 50 reals, and its samples. Samples are equally spaced,
below a line that says so, or stand in pairs of a time and an acceleration, or follow at once in ten
fields of 13 characters (BHRC). What holds for all: integer 28 is the count, integer 27 the azimuth,
real 3 the length in s, real 5 the unit in g.
"""

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

from rockcheck.scenes.recordings.network_lines import (
    WIDE,
    are_numbers,
    check_times,
    fields,
    first_match,
)
from rockcheck.scenes.recordings.recording import (
    NUMBER,
    UNITS,
    Reading,
    Recording,
    checked_count,
    checked_step,
    fault,
    is_number,
    known_unit,
    number,
)
from rockcheck.scenes.recordings.stated import Fact, Stated, last_digit, recording_of

_START = re.compile(r"(?:.*\bUNCORRECTED\s++ACCELEROGRAM\s++DATA\b|\*\s*+VOL1)", re.IGNORECASE)
_COUNT = re.compile(r"\bNO\.\s*+OF\s*+POINTS\s*+=\s*+(\d++)", re.IGNORECASE)
_LENGTH = re.compile(rf"\b(?:RECORD\s++LENGTH|DURATION)\s*+=\s*+({NUMBER})", re.IGNORECASE)
_PEAK = re.compile(rf"\bMAX\s*+=\s*+({NUMBER})\s*+([A-Z/0-9]++)", re.IGNORECASE)
_UNIT = re.compile(r"\bUNITS\b.{0,60}?\b(?:AND|IS|ARE)\s++(G\s*+/\s*+10|(?!SEC)[A-Z/0-9]++)", re.I)
_CHANNEL = re.compile(r"\s*+CHAN\s*+\d++:\s*+([A-Z0-9]++(?:\s++DEG\b)?)", re.IGNORECASE)
_COMPONENT = re.compile(r"\s*+COMP\s++([A-Z0-9]++)", re.IGNORECASE)
_EQUALLY = re.compile(
    rf"\s*+(\d++)\s++POINTS\s++OF\s++ACCEL\w*+\s++DATA\s++EQUALLY\s++SPACED\s++AT\s*+({NUMBER})",
    re.IGNORECASE,
)
_FIELDS = re.compile(r"\(\s*+(\d{1,2})F(\d{1,2})\.\d", re.IGNORECASE)
_EQUALLY_UNIT = re.compile(r"\b(?:UNITS\s*+:|IN)\s*+([A-Z/0-9]++)", re.IGNORECASE)

_TEXT, _REALS = 13, 7
#: Directions by their number in the header, beside azimuths of 0 to 360.
_DIRECTIONS = {400: "vertical", 500: "up", 600: "down", 700: "L", 800: "T"}
#: Lines of integers, and the width of one.
_INTEGER_WIDTHS = {7: 5, 5: 4}


@dataclass
class _Header:
    """A channel's header: facts, the factor from the file's numbers to `unit`, and the line."""

    stated: Stated
    unit: str
    factor: float
    name: str
    first_line: int
    data: int


def is_volume_one(lines: list[str]) -> bool:
    """Whether these lines begin an uncorrected accelerogram."""
    return len(lines) > _TEXT and _START.match(lines[0]) is not None


def read_volume_one(lines: list[str], reading: Reading) -> list[Recording]:
    """Every channel of an uncorrected accelerogram, in the file's order."""
    recordings = []
    index = 0
    while index < len(lines):
        if index and not _START.match(lines[index][:WIDE]):
            if are_numbers(lines[index]):
                raise fault("more numbers than the header says", index + 1)
            index += 1
            continue
        recording, index = _channel(lines, index, reading)
        recordings.append(recording)
    return recordings


def _channel(lines: list[str], index: int, reading: Reading) -> tuple[Recording, int]:
    """The channel that begins at the index, and the index behind its samples."""
    header = _header(lines, index)
    if header.data >= len(lines):
        raise fault("the file ends before its samples", len(lines))
    line = lines[header.data][:WIDE]
    if equally := _EQUALLY.match(line):
        return _equally_spaced(lines, header, equally, reading)
    if re.search(r"[A-DF-Z]{2}", line, re.IGNORECASE):
        raise fault("samples that are neither equally spaced nor pairs with times", header.data + 1)
    if "E" in line.upper():
        return _without_times(lines, header, reading)
    return _with_times(lines, header, reading)


def _header(lines: list[str], index: int) -> _Header:
    text = [(n + 1, lines[n][:WIDE]) for n in range(index, min(index + _TEXT, len(lines)))]
    integers_at = index + _TEXT
    reals_at = next(
        (n for n in range(integers_at, min(integers_at + 9, len(lines))) if "." in lines[n]), 0
    )
    width = _INTEGER_WIDTHS.get(reals_at - integers_at)
    if width is None:
        raise fault("no header of 100 integers in 7 lines or in 5", integers_at + 1)
    integers = _integers(lines[integers_at:reals_at], width)
    count_line, count = _count(text, integers, integers_at + 1)
    real_line = reals_at + 1
    reals = _first_reals(lines[reals_at], real_line)
    length_line, length = first_match(text, _LENGTH)
    peak_line, peak = first_match(text, _PEAK)
    unit, factor = _unit(text, reals.get(5, 0.0), real_line)
    duration = number(length_line, length[1]) if length else reals.get(3, 0.0)
    peak_unit = known_unit(peak[2]) if peak else ""
    stated = Stated(
        count=Fact(count, "the header", count_line),
        unit=Fact(unit, "the header") if unit else None,
        duration=Fact(duration, "the header", length_line or real_line) if duration > 0 else None,
        peak=Fact(number(peak_line, peak[1]) * UNITS[peak_unit], "MAX", peak_line)
        if peak and peak_unit
        else None,
        peak_within=last_digit(peak[1]) * UNITS[peak_unit] if peak and peak_unit else 0.0,
    )
    name = _name(text, integers)
    return _Header(stated, unit, factor, name, index + 1, reals_at + _REALS)


def _integers(lines: Iterable[str], width: int) -> dict[int, int]:
    """The integers by their places from 1; lines may be cut behind their last one."""
    values: dict[int, int] = {}
    across = 80 // width
    for row, line in enumerate(lines):
        for place in range(across):
            word = line[place * width : (place + 1) * width].strip()
            if re.fullmatch(r"-?\d++", word):
                values[row * across + place + 1] = int(word)
    return values


def _first_reals(line: str, n: int) -> dict[int, float]:
    """The first five reals by their places from 1, in fields of 13 characters or of 10."""
    width = 13 if "E" in line.upper() else 10
    words = {k + 1: line[k * width : (k + 1) * width].strip() for k in range(5)}
    return {place: number(n, word) for place, word in words.items() if is_number(word)}


def _count(
    text: list[tuple[int, str]], integers: dict[int, int], integers_line: int
) -> tuple[int, int]:
    """Line and value of the count; words and integers must agree on it."""
    line, match = first_match(text, _COUNT)
    in_integers = integers.get(28, 0)
    if match is None:
        return integers_line, checked_count(integers_line, "the count of points", str(in_integers))
    count = checked_count(line, "NO. OF POINTS", match[1])
    if in_integers > 0 and in_integers != count:
        raise fault(f"NO. OF POINTS says {count}, integer 28 says {in_integers}", line)
    return line, count


def _unit(text: list[tuple[int, str]], in_g: float, real_line: int) -> tuple[str, float]:
    """The unit, and the factor from the file's numbers to it; words and real 5 must agree."""
    line, match = first_match(text, _UNIT)
    word = re.sub(r"\s", "", match[1]).lower() if match else ""
    if "count" in word:
        raise fault("raw counts of the digitiser; only accelerations can be read", line)
    if word == "g/10" or (not word and math.isclose(in_g, 0.1)):
        unit, factor = "g", 0.1
    elif word:
        unit, factor = known_unit(word), 1.0
    else:
        unit, factor = ("g", in_g) if in_g > 0.0 else ("", 1.0)
    if unit == "g" and in_g > 0.0 and not math.isclose(in_g, factor, rel_tol=1e-3):
        raise fault(f"the unit is {factor:g} g in words, real 5 says {in_g:g} g", line or real_line)
    return unit, factor


def _name(text: list[tuple[int, str]], integers: dict[int, int]) -> str:
    _, channel = first_match(text, _CHANNEL)
    if channel:
        return " ".join(channel[1].split())
    letter = text[4][1].strip()
    if letter in ("L", "T", "V"):
        return letter
    _, component = first_match(text, _COMPONENT)
    direction = integers.get(27, 0)
    if direction in _DIRECTIONS:
        return _DIRECTIONS[direction]
    if component:
        return component[1][:30]
    return f"{direction} deg" if 0 < direction <= 360 else ""


def _equally_spaced(
    lines: list[str], header: _Header, equally: re.Match[str], reading: Reading
) -> tuple[Recording, int]:
    """Samples below a line that states their count and step, and perhaps their fields."""
    line = header.data + 1
    rest = lines[header.data][equally.end() : WIDE]
    unit_match = _EQUALLY_UNIT.search(rest)
    unit = known_unit(unit_match[1]) if unit_match else ""
    if unit_match and "count" in unit_match[1].lower():
        raise fault("raw counts of the digitiser; only accelerations can be read", line)
    if unit and header.unit and unit != header.unit:
        raise fault(f"the unit is {header.unit} in the header, {unit} above the samples", line)
    count = checked_count(line, "the count of points", equally[1])
    shape = _FIELDS.search(rest)
    across = int(shape[1]) if shape else 8
    width = int(shape[2]) if shape else _width_of(lines, line, min(across, count))
    if across < 1 or width < 1:
        raise fault("a format without fields", line)
    values, end = fields(lines, line, count, across=across, width=width)
    step = Fact(checked_step(line, "the time step", equally[2]), "the line above", line)
    return _recording(values, header, reading, step, unit=unit or header.unit), end


def _width_of(lines: list[str], index: int, across: int) -> int:
    """The width of a field, where the first line of samples is full."""
    length = len(lines[index].rstrip()) if index < len(lines) else 0
    if length % across or not 4 * across <= length <= 20 * across:
        raise fault(f"a line that is not {across} fields of one width", index + 1)
    return length // across


def _with_times(lines: list[str], header: _Header, reading: Reading) -> tuple[Recording, int]:
    """Pairs of a time and an acceleration, five on a line, in fields of 7 characters.

    The first field of a line may have 8.
    """
    count = _stated_count(header)
    pairs = min(count, 5)
    lead = len(lines[header.data].rstrip()) - 14 * pairs
    if lead not in (0, 1):
        raise fault("a line that is not five pairs of 7 characters", header.data + 1)
    values, end = fields(lines, header.data, 2 * count, across=10, width=7, lead=lead)
    times = values[::2]
    step = (times[-1] - times[0]) / max(count - 1, 1)
    step = checked_step(header.data + 1, "the time step", f"{step:.6g}")
    check_times(
        [(header.data + 1 + k // 5, [time]) for k, time in enumerate(times)],
        step,
    )
    return _recording(values[1::2], header, reading, Fact(step, "the times")), end


def _without_times(lines: list[str], header: _Header, reading: Reading) -> tuple[Recording, int]:
    """Ten fields of 13 characters; the time step is the stated length by the count."""
    count = _stated_count(header)
    duration = header.stated.duration
    if duration is None:
        raise fault("no header line that states the length in s", header.first_line)
    rates = [count / duration.value, (count - 1) / duration.value]
    rate = min(rates, key=lambda value: abs(value - round(value)))
    step = float(f"{1.0 / rate:.9g}") if rate > 0.0 else 0.0
    step = checked_step(duration.line or 1, "the time step", f"{step!r}")
    values, end = fields(lines, header.data, count, across=10, width=13)
    fact = Fact(step, "the length by the count", duration.line)
    return _recording(values, header, reading, fact), end


def _stated_count(header: _Header) -> int:
    if header.stated.count is None:
        raise fault("no count of points", header.first_line)
    return header.stated.count.value


def _recording(
    values: list[float], header: _Header, reading: Reading, step: Fact[float], unit: str = ""
) -> Recording:
    facts = header.stated
    stated = Stated(
        count=facts.count,
        time_step=step,
        unit=Fact(unit, "the header") if unit else facts.unit,
        duration=facts.duration,
        peak=facts.peak,
        peak_within=facts.peak_within,
    )
    scaled = [value * header.factor for value in values]
    return recording_of(scaled, stated, reading, form="Volume 1", component=header.name)
