"""Tables of numbers: CSV with named columns, and plain columns of text."""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rockcheck.scenes.base import LEAST, Floats
from rockcheck.scenes.errors import InputError, printable, refuse
from rockcheck.scenes.reading import MOST_COLUMNS
from rockcheck.scenes.recordings.recording import (
    MOST_SAMPLES,
    UNITS,
    Reading,
    Recording,
    fault,
    is_number,
    known_unit,
    number,
    option,
    place_of,
    settled_unit,
)

#: Names of a column of accelerations that say its unit.
NAMED = {f"acceleration_{unit.replace('/', '_')}": unit for unit in UNITS}
_TIMES = re.compile(r"(?:time|t)(?:_s|\s*+[\[(]\s*+s(?:ec)?\s*+[\])])?", re.IGNORECASE)
_BRACKETS = re.compile(r"[\[(]([^\])]{1,20})[\])]")
_DECIMAL_COMMA = re.compile(r"[-+]?\d*+,\d++(?:[eEdD][-+]?\d++)?")
#: Most lines of words at the start of a table.
_MOST_HEADER = 200

NumberedLines = list[tuple[int, str]]


@dataclass(frozen=True)
class _Layout:
    """Separator of a table's fields, and whether a comma stands before the decimals.

    `separator` None: fields are separated by blanks.
    """

    separator: str | None
    decimal_comma: bool

    def words(self, n: int, line: str) -> list[str]:
        """The fields of a line; decimal commas become points."""
        if self.separator is None or '"' not in line:
            words = line.split(self.separator)
        else:
            try:
                words = next(csv.reader([line], delimiter=self.separator))
            except csv.Error as error:
                raise fault(f"not a line of a CSV table: {printable(error)}", n) from None
        words = [word.strip() for word in words]
        if not self.decimal_comma:
            return words
        return [
            word.replace(",", ".", 1) if _DECIMAL_COMMA.fullmatch(word) else word for word in words
        ]


def read_table(lines: list[str], reading: Reading) -> list[Recording]:
    """Read a column of times and one of accelerations, or accelerations alone.

    Lines that start with # or % are remarks.
    """
    cells = _cells_of(lines, reading)
    time, place, stated = _columns(cells, reading)
    if time is None and reading.time_step is None:
        raise fault(f"no column of times; give the time step: {option('time_step', 0.01)}")
    unit = settled_unit(stated, reading)
    samples, times, words = cells.read(place, time)
    step, notes = float(reading.time_step or 0.0), list[str]()
    if time is not None:
        step, notes = _step_of(times, words, [n for n, _ in cells.rows], reading)
        if not cells.names or cells.names[time].lower() in ("t", "time"):
            notes.append(f"column {time + 1} is taken as the time in s")
    return [
        Recording(
            samples=samples * UNITS[unit],
            time_step=step,
            unit=unit,
            form="table" if cells.layout.separator is None else "CSV",
            component=printable(cells.names[place], 30)
            if cells.names
            else f"column {place + 1}" * (cells.width > 1),
            notes=tuple(notes),
        )
    ]


@dataclass(frozen=True)
class _Cells:
    """The lines of data and their layout; `names` is empty where no line names the columns."""

    rows: NumberedLines
    layout: _Layout
    names: list[str]
    width: int

    def read(self, place: int, time: int | None) -> tuple[Floats, Floats, list[str]]:
        """Numbers of column `place` and of column `time`, and the words of the latter."""
        values, times, words = [], [], []
        for n, line in self.rows:
            cells = self.layout.words(n, line)
            if len(cells) != self.width:
                whose = "the header names" if self.names else "the first line has"
                raise fault(f"{len(cells)} fields where {whose} {self.width}", n)
            if time is not None:
                times.append(number(n, cells[time]))
                words.append(cells[time])
            values.append(number(n, cells[place]))
        return np.array(values), np.array(times), words


def _cells_of(lines: list[str], reading: Reading) -> _Cells:
    rows: NumberedLines = [
        (n, line)
        for n, line in enumerate(lines, 1)
        if n > (reading.header_lines or 0) and line.strip() and line[0] not in "#%"
    ]
    refuse(
        (
            reading.component is not None,
            "a table has columns; give the option column in place of component",
            "",
        ),
        (not rows, "empty", ""),
    )
    layout = _layout_of(rows, reading)
    names, rows = _names_of(rows, layout, reading)
    width = len(names) or len(layout.words(*rows[0]))
    refuse(
        (not rows, "no line of numbers below the names of columns", ""),
        (len(rows) > MOST_SAMPLES, f"more than {MOST_SAMPLES} lines", ""),
        (
            width > MOST_COLUMNS,
            f"more than {MOST_COLUMNS} columns",
            "".join(f"line {n}" for n, _ in rows[:1]),
        ),
    )
    return _Cells(rows, layout, names, width)


def _layout_of(rows: NumberedLines, reading: Reading) -> _Layout:
    """The layout of a table, from its first line of numbers, else from its first line."""
    head = [line for _, line in rows[:_MOST_HEADER]]
    with_digits = next(
        (line for line in head if re.match(r"[\s\"]*+[-+.]?[-+.\d]", line)), head[0]
    )[:10_000]
    separator = next((sign for sign in ";\t" if sign in with_digits), None)
    if separator is None and "," in with_digits and reading.decimal != ",":
        words = with_digits.split()
        # Where each word between blanks is a number with one comma, or has none, the commas cannot
        # separate fields; that after a blank, in 0 ,1, does.
        if (
            len(words) > 1
            and "." not in with_digits
            and all(
                _DECIMAL_COMMA.fullmatch(word) and ("," in words[0] or word[0] != ",")
                for word in words
                if "," in word
            )
        ):
            return _Layout(None, True)
        if (
            "." not in with_digits
            and len(words) == 1
            and reading.decimal is None
            # no line names two columns: each with a comma is two runs of digits
            and all("," not in line or _DECIMAL_COMMA.fullmatch(line.strip()[:60]) for line in head)
        ):
            raise fault(
                f"a comma between columns or before the decimals? {option('decimal', ',')}, or"
                " decimal .",
                rows[-1][0],
            )
        return _Layout(",", False)
    comma = reading.decimal == "," or (
        reading.decimal is None and "." not in with_digits and "," in with_digits
    )
    return _Layout(separator, comma)


def _names_of(
    rows: NumberedLines, layout: _Layout, reading: Reading
) -> tuple[list[str], NumberedLines]:
    """The columns' names, [] where no line names them, and the lines of data."""
    first = layout.words(*rows[0])
    if any(word in NAMED or word == "time_s" for word in first):
        return first, rows[1:]
    if all(map(is_number, first)):
        return [], rows
    searched = rows[: _MOST_HEADER if reading.header_lines is None else 2]
    for index, ((n, above), line) in enumerate(pairwise(searched), 1):
        words = layout.words(*line)
        if all(map(is_number, words)):
            names = layout.words(n, above.replace(" [", "[").replace(" (", "("))
            return names if len(names) == len(words) else [], rows[index:]
    # A column of words, or an empty one, beside those of numbers: names have numbers below them; of
    # another line it is not clear whether it is the first of the data.
    numeric = [[*map(is_number, layout.words(*row))] for row in rows[:2]]
    names = first if numeric[0] != numeric[-1] else []
    if len(numeric[-1]) == len(first) and (names or reading.header_lines is not None):
        return names, rows[bool(names) :]
    raise fault(
        f"no line of numbers within the first {_MOST_HEADER}; give the lines to leave out:"
        f" {option('header_lines', 3)}",
        rows[0][0],
    )


def _columns(cells: _Cells, reading: Reading) -> tuple[int | None, int, str]:
    """The columns of times and of accelerations, and the unit of the latter.

    Times are None if there is no such column. The unit is the one that the column's name states, ""
    if none. Raises `InputError` where the columns are not clear.
    """
    names = cells.names
    stated = [
        NAMED.get(name) or next(map(known_unit, _BRACKETS.findall(name)), "") for name in names
    ] or [""] * cells.width
    times = [index for index, name in enumerate(names) if _TIMES.fullmatch(name)]
    time: int | None = times[0] if len(times) == 1 else None
    if not names and cells.width > 1 and reading.time_step is None:
        time = 0
    if reading.column is not None:
        place = _chosen(cells, reading.column)
        return None if time == place else time, place, stated[place]
    rest = [index for index in range(cells.width) if index != time]
    chosen = (
        [index for index, name in enumerate(names) if name in NAMED]
        or [i for i in rest if stated[i] and names[i].lower().startswith("acc")]
        or rest
    )
    if len(chosen) == 1 and (time is not None or reading.time_step is not None or cells.width == 1):
        return time, chosen[0], stated[chosen[0]]
    raise _unclear(cells)


def _unclear(cells: _Cells) -> InputError:
    said = (
        f"columns {printable(', '.join(cells.names))!r}; name them time_s and exactly one of"
        f" {', '.join(NAMED)}, or give the column"
        if cells.names
        else f"{cells.width} columns; give that of the accelerations"
    )
    line = cells.rows[0][0] - bool(cells.names) if cells.rows else 1
    return fault(f"{said}: {option('column', 2)}", line)


def _chosen(cells: _Cells, column: int | str) -> int:
    shown = printable(", ".join(cells.names)) if cells.names else f"1 to {cells.width}"
    return place_of("column", column, cells.names or [""] * cells.width, shown)


def _decimals(word: str) -> int:
    mantissa, _, exponent = word.lower().replace("d", "e").partition("e")
    return len(mantissa.partition(".")[2]) - max(min(int(exponent[:5] or 0), 300), -300)


def _step_of(
    time: Floats,
    words: Sequence[str],
    lines: Sequence[int],
    reading: Reading,
) -> tuple[float, list[str]]:
    """The time step of a column of times, within the digits printed, and notes on it.

    It is the first of these that all times agree with: the mean step as printed; a whole number of
    samples a second, each time within its last digit; the mean step, each time within its last
    digit or 1 % of a step. If `reading` gives a time step, only that one is tried. Raises
    `InputError` where none fits.
    """
    mean = float(time[-1] - time[0]) / max(len(time) - 1, 1)
    refuse(
        (
            len(words) < 2,
            f"{len(words)} sample(s); at least 2 are needed to know the time step",
            "",
        ),
        (not mean > LEAST, "time_s does not increase", ""),
    )
    digit = 10.0 ** -min(max(map(_decimals, words)), 30)
    # A coarser digit could hide a sample that is missing or in the wrong place.
    tells = digit <= 0.5 * mean
    slack = digit * (1.0 + 1e-6) if tells or reading.time_step else 0.0
    rounding = 1e-9 * max(1.0, float(np.max(np.abs(time))))
    printed = float(f"{round(mean / digit) * digit:.12g}") if digit > 1e-12 else mean
    candidates = [
        (printed, min(rounding, 0.01 * mean)),
        (1.0 / max(round(1.0 / mean), 1), slack),
        (mean, max(0.01 * mean, slack) + 1e-9),
    ]
    if reading.time_step is not None:
        candidates = [(reading.time_step, max(0.01 * reading.time_step, slack) + 1e-9)]
    for step, most in candidates:
        uneven = np.flatnonzero(np.abs(time - time[0] - step * np.arange(len(time))) > most)
        if step > 0.0 and not uneven.size:
            break
    else:
        first = int(uneven[0])
        hint = "" if tells else f"; times of {digit:g} s may hide it: {option('time_step', 0.005)}"
        raise fault(
            f"time {words[first]} s is off the uniform step {step:.6g} s{hint}", lines[first]
        )
    notes = [f"the first time is {time[0]:g} s; it is 0 here"] if abs(time[0]) > rounding else []
    return float(f"{step:.12g}") if step == mean and reading.time_step is None else step, notes
