"""Tables of numbers: CSV with named columns, and plain columns of text."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise

import numpy as np

from rockcheck.scenes.base import LEAST, Floats
from rockcheck.scenes.errors import InputError, printable
from rockcheck.scenes.reading import MOST_COLUMNS
from rockcheck.scenes.recordings.headers import facts_of
from rockcheck.scenes.recordings.layout import MOST_HEADER, Layout, NumberedLines, layout_of
from rockcheck.scenes.recordings.order import Shape, are_times, settled_order
from rockcheck.scenes.recordings.recording import (
    MOST_SAMPLES,
    UNITS,
    Contradiction,
    Reading,
    Recording,
    fault,
    is_number,
    known_unit,
    number,
    option,
    place_of,
)
from rockcheck.scenes.recordings.stated import Fact, Stated, missing, recording_of

#: Names of a column of accelerations that say its unit.
NAMED = {f"acceleration_{unit.replace('/', '_')}": unit for unit in UNITS}
_SECONDS = r"(?:m|milli)?s(?:ec(?:ond)?s?)?"
_TIMES = re.compile(
    rf"(?:time|t)(?:[_ ]?{_SECONDS}|\s*+[\[(]\s*+{_SECONDS}\s*+[\])])?", re.IGNORECASE
)
#: Names of times in units that are not read: in s they would be another motion.
_OTHER_TIMES = re.compile(
    r"(?:time|t)(?:[_ ]|\s*+[\[(]\s*+)"
    r"(?:min(?:ute)?s?|h(?:(?:ou)?rs?)?|(?:u|µ|μ|micro|n|nano)s(?:ec(?:ond)?s?)?|d(?:ays?)?|y(?:ea)?rs?)"
    r"\s*+[\])]?",
    re.IGNORECASE,
)
#: The end of a name of times that are in ms.
_MILLISECONDS = re.compile(r"m(?:illi)?s(?:ec(?:ond)?s?)?\s*+[\])]?", re.IGNORECASE)
_BRACKETS = re.compile(r"[\[(]([^\])]{1,20})[\])]")
_ACCELERATION = re.compile(r"a(?:cc(?:el(?:erations?)?)?)?\.?(?=[\s_\-\[(,]|$)", re.IGNORECASE)
#: Most lines whose first number is looked at, to know whether it is a time.
_LOOKED_AT = 2000


def read_table(lines: list[str], reading: Reading) -> list[Recording]:
    """Read a column of times and one of accelerations, or accelerations alone.

    Lines that start with # or % are remarks. What the lines above the numbers state is held
    against them.
    """
    cells = _cells_of(lines, reading)
    _check_unit_of_time(cells)
    above = islice(enumerate(lines, 1), min(cells.rows[0][0] - 1, MOST_HEADER))
    facts = facts_of(above, reading.unit or "")
    time = _time_of(cells, reading)
    if time is None and cells.width > 1 and not cells.names:
        step = reading.time_step or (facts.time_step.value if facts.time_step else None)
        shape = Shape(
            [len(cells.layout.words(*row)) for row in cells.rows], first_line=cells.rows[0][0]
        )
        order, notes = settled_order(shape, facts.count, step, reading)
        if order == "rows":
            return [_along_rows(cells, shape, facts, reading, notes)]
        return [_column(cells, time, facts, reading, notes)]
    if reading.order == "rows" and cells.width > 1 and "order" not in reading.overriding:
        raise Contradiction(
            f"{'the header names columns' if cells.names else 'the first column holds times'};"
            " leave the option order out, or override the file:"
            f" {option('order', 'rows!')}",
            "order",
        )
    if reading.order == "rows" and cells.width > 1:
        return [_along_rows(cells, None, facts, reading, ["numbers are taken along the lines"])]
    return [_column(cells, time, facts, reading, [])]


def _along_rows(
    cells: "_Cells", shape: Shape | None, facts: Stated, reading: Reading, notes: Sequence[str]
) -> Recording:
    """All numbers, line after line. Only the last line may be shorter, unless a count is stated."""
    values: list[float] = []
    is_counted = facts.count is not None and "order" not in reading.overriding
    last = cells.rows[-1][0]
    for n, line in cells.rows:
        words = cells.layout.words(n, line)
        is_short = len(words) < cells.width
        if len(words) > cells.width or (is_short and n != last and not is_counted):
            raise fault(f"{len(words)} fields where the first line has {cells.width}", n)
        values += [number(n, word) for word in words]
    if reading.column is not None:
        raise fault("numbers run along the lines; leave the option column out")
    if not is_counted:
        facts, notes = _without_count(facts, len(values), notes)
    return recording_of(values, facts, reading, form=cells.form, notes=notes)


def _without_count(facts: Stated, samples: int, notes: Sequence[str]) -> tuple[Stated, list[str]]:
    """The facts without a count that an option overrides, and a note on it."""
    if facts.count is None or facts.count.value == samples:
        return facts, [*notes]
    note = f"the header states {facts.count.value} samples, the table has {samples}"
    return replace(facts, count=None), [*notes, note]


def _column(
    cells: "_Cells", time: int | None, facts: Stated, reading: Reading, notes: Sequence[str]
) -> Recording:
    """One column of accelerations, and perhaps one of times."""
    time, place, unit = _columns(cells, time, reading)
    if unit:
        facts = replace(facts, unit=Fact(unit))
    if time is None and reading.time_step is None and facts.time_step is None:
        raise missing("no column of times; ", facts, reading)
    samples, times, words = cells.read(place, time)
    if cells.width > 2:
        facts = replace(facts, peak=None)  # of which column is not known
    facts, notes = _with_count_checked(facts, len(samples), reading, notes)
    if time is not None:
        name = cells.names[time] if cells.names else ""
        if _are_milliseconds(name):
            times, words = 1e-3 * times, [f"{1e-3 * float(seconds):.12g}" for seconds in times]
        step, step_notes = _checked_step(times, words, [n for n, _ in cells.rows], facts, reading)
        facts = replace(facts, time_step=Fact(step))
        notes += [*step_notes, *_time_notes(name, time)]
        reading = reading.model_copy(update={"time_step": None})
    component = f"column {place + 1}" * (cells.width > 1)
    if cells.names:
        component = printable(cells.names[place], 30)
    return recording_of(samples, facts, reading, form=cells.form, component=component, notes=notes)


def _with_count_checked(
    facts: Stated, samples: int, reading: Reading, notes: Sequence[str]
) -> tuple[Stated, list[str]]:
    """The facts, their count held against a column of so many samples, and notes on it."""
    if facts.count is None or facts.count.value == samples:
        return facts, [*notes]
    if "order" not in reading.overriding:
        raise fault(
            f"the header states {facts.count.value} samples, the table has {samples}; to read it"
            f" all the same: {option('order', 'columns!')}",
            facts.count.line,
        )
    return _without_count(facts, samples, notes)


@dataclass(frozen=True)
class _Cells:
    """The lines of data and their layout; `names` is empty where no line names the columns."""

    rows: NumberedLines
    layout: Layout
    names: list[str]
    width: int

    @property
    def form(self) -> str:
        """The format, as a recording names it."""
        return "table" if self.layout.separator is None else "CSV"

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
    skipped = reading.header_lines or 0
    rows: NumberedLines = [
        (n, line)
        for n, line in enumerate(lines, 1)
        if n > skipped and line.strip() and line[0] not in "#%"
    ]
    if reading.component is not None:
        raise fault("a table has columns; give the option column in place of component")
    if not rows:
        raise fault("empty")
    layout = layout_of(rows, reading)
    names, rows = _names_of(rows, layout, reading)
    if not _names_columns(names, layout, reading):
        names = []
    if not rows:
        raise fault("no line of numbers below the names of columns")
    width = len(names) or len(layout.words(*rows[0]))
    if len(rows) > MOST_SAMPLES:
        raise fault(f"more than {MOST_SAMPLES} lines")
    if width > MOST_COLUMNS:
        raise fault(f"more than {MOST_COLUMNS} columns", rows[0][0])
    return _Cells(rows, layout, names, width)


def _names_of(
    rows: NumberedLines, layout: Layout, reading: Reading
) -> tuple[list[str], NumberedLines]:
    """The columns' names, [] where no line names them, and the lines of data."""
    first = layout.words(*rows[0])
    if any(word in NAMED or word == "time_s" for word in first):
        return first, rows[1:]
    if all(map(is_number, first)):
        return [], rows
    searched = rows[: MOST_HEADER if reading.header_lines is None else 2]
    for index, ((n, above), line) in enumerate(pairwise(searched), 1):
        words = layout.words(*line)
        if all(map(is_number, words)):
            return _header_names(layout.words(n, _closed_up(above)), len(words)), rows[index:]
    # A column of words, or an empty one, beside those of numbers: names have numbers below them; of
    # another line it is not clear whether it is the first of the data.
    numeric = [[*map(is_number, layout.words(*row))] for row in rows[:2]]
    names = first if numeric[0] != numeric[-1] else []
    if len(numeric[-1]) == len(first) and (names or reading.header_lines is not None):
        return names, rows[bool(names) :]
    if not any(_is_mostly_numbers(layout.words(*row)) for row in rows):
        raise fault("no line of numbers")
    raise fault(
        f"no line of numbers within the first {MOST_HEADER}; give the lines to leave out:"
        f" {option('header_lines', 3)}",
        rows[0][0],
    )


def _is_mostly_numbers(words: Sequence[str]) -> bool:
    """Whether at least half of the words of a line are numbers, as in no line of prose."""
    return 2 * sum(map(is_number, words)) >= len(words)


def _closed_up(line: str) -> str:
    """A line of names without blanks before the brackets of their units."""
    return line.replace(" [", "[").replace(" (", "(")


def _header_names(words: list[str], width: int) -> list[str]:
    """The names of `width` columns in the words of a line, [] if it does not name so many.

    A unit may stand behind the name, as in "time s acc cm/s2".
    """
    if len(words) == width:
        return words
    names: list[str] = []
    for word in words:
        if names and (known_unit(word) or re.fullmatch(_SECONDS, word, re.IGNORECASE)):
            names[-1] += f" {word}"
        else:
            names.append(word)
    return names if len(names) == width else []


def unit_of_name(name: str) -> str:
    """The unit that the name of a column states, as `acc [cm/s2]`, `acc cm/s2` or `a_g`; or ""."""
    if name in NAMED:
        return NAMED[name]
    for bracketed in _BRACKETS.findall(name):
        if unit := known_unit(bracketed):
            return unit
    if start := _ACCELERATION.match(name):
        return known_unit(name[start.end() :].strip(" _-,"))
    return ""


def _time_notes(name: str, time: int) -> list[str]:
    """A note where the name of the column of times does not state their unit."""
    return [] if _states_unit_of_time(name) else [f"column {time + 1} is taken as the time in s"]


def _check_unit_of_time(cells: "_Cells") -> None:
    """Raise `InputError` where a column's name states a unit of time that is not read."""
    for name in cells.names:
        if _OTHER_TIMES.fullmatch(name):
            raise fault(
                f"column {printable(name)!r}: times are read in s or in ms; convert them, and name"
                " them time_s or time_ms",
                cells.rows[0][0] - 1,
            )


def _are_milliseconds(name: str) -> bool:
    """Whether the name of a column of times says that they are in ms."""
    return bool(_TIMES.fullmatch(name) and _MILLISECONDS.search(name.lower().removeprefix("time")))


def _states_unit_of_time(name: str) -> bool:
    """Whether the name of a column of times states a unit."""
    return bool(_TIMES.fullmatch(name)) and name.lower() not in ("t", "time")


def _names_columns(names: Sequence[str], layout: Layout, reading: Reading) -> bool:
    """Whether the line above the numbers names columns, and is no other line of as many words."""
    if layout.separator is not None or reading.column in names:
        return True
    return any(
        _TIMES.fullmatch(name) or _ACCELERATION.match(name) or unit_of_name(name) for name in names
    )


def _time_of(cells: _Cells, reading: Reading) -> int | None:
    """The column of times, by its name, else the first one where its numbers are times; or None."""
    times = [index for index, name in enumerate(cells.names) if _TIMES.fullmatch(name)]
    if len(times) == 1:
        return times[0]
    if times or cells.width < 2:
        return None
    words = [cells.layout.words(*row)[:1] for row in cells.rows[:_LOOKED_AT]]
    numbers = [
        number(n, word)
        for (n, _), (word,) in zip(cells.rows, filter(None, words), strict=False)
        if is_number(word)
    ]
    is_named_otherwise = bool(cells.names)
    is_time = are_times(numbers, is_step_given=is_named_otherwise or reading.time_step is not None)
    return 0 if is_time and len(numbers) == len(words) else None


def _columns(cells: _Cells, time: int | None, reading: Reading) -> tuple[int | None, int, str]:
    """The columns of times and of accelerations, and the unit of the latter.

    Times are None if there is no such column. The unit is the one that the column's name states, ""
    if none. Raises `InputError` where the columns are not clear.
    """
    names = cells.names
    stated = [unit_of_name(name) for name in names] or [""] * cells.width
    if reading.column is not None:
        place = _chosen(cells, reading.column)
        return None if time == place else time, place, stated[place]
    rest = [index for index in range(cells.width) if index != time]
    chosen = (
        [index for index, name in enumerate(names) if name in NAMED]
        or [index for index in rest if stated[index] and _ACCELERATION.match(names[index])]
        or rest
    )
    if len(chosen) == 1 and (time is not None or reading.time_step is not None or cells.width == 1):
        return time, chosen[0], stated[chosen[0]]
    raise _unclear(cells)


def _unclear(cells: _Cells) -> InputError:
    if cells.names:
        message = (
            f"columns {printable(', '.join(cells.names))!r}; name them time_s and exactly one of"
            f" {', '.join(NAMED)}, or give the column"
        )
        return fault(f"{message}: {option('column', 2)}", cells.rows[0][0] - 1)
    message = f"{cells.width} columns; give that of the accelerations"
    return fault(f"{message}: {option('column', 2)}", cells.rows[0][0])


def _chosen(cells: _Cells, column: int | str) -> int:
    listed = printable(", ".join(cells.names)) if cells.names else f"1 to {cells.width}"
    return place_of("column", column, cells.names or [""] * cells.width, listed)


def _checked_step(
    times: Floats, words: Sequence[str], lines: Sequence[int], facts: Stated, reading: Reading
) -> tuple[float, list[str]]:
    """The time step in s of a column of times, held against the header's and the given one.

    And notes on it. Raises `InputError` where they contradict each other.
    """
    if reading.time_step is not None and "time_step" in reading.overriding:
        return reading.time_step, [f"the time step {reading.time_step:g} s is given, not the times"]
    try:
        step, notes = _step_of(times, words, lines, reading)
    except InputError:
        if reading.time_step is None:
            raise
        own = reading.model_copy(update={"time_step": None})
        step, _ = _step_of(times, words, lines, own)
        raise Contradiction(
            f"the times have a step of {step:g} s, not {reading.time_step:g} s; leave the option"
            " time_step out, or override the file:"
            f" {option('time_step', f'{reading.time_step:g}!')}",
            "time_step",
        ) from None
    header = facts.time_step
    if header is not None and abs(header.value - step) > 0.01 * step:
        raise fault(
            f"the header states a time step of {header.value:g} s, the times have {step:g} s; to"
            f" read them all the same: {option('time_step', f'{step:g}!')}",
            header.line,
        )
    return step, notes


def _decimals(word: str) -> int:
    mantissa, _, exponent = word.lower().replace("d", "e").partition("e")
    return len(mantissa.partition(".")[2]) - max(min(int(exponent[:5] or 0), 300), -300)


def _off_step(time: Floats, first: int, step: float) -> tuple[int, float]:
    """The number of a time that is off, and the step that it is off: where a sample is missing.

    It is the `first` that is off the mean `step` where no gap stands out.
    """
    gaps = np.diff(time)
    usual = float(np.median(gaps))
    widest = int(np.argmax(gaps))
    if np.all(gaps > 0.0) and gaps[widest] > 1.5 * usual:
        return widest + 1, usual
    return first, step


def _step_of(
    time: Floats,
    words: Sequence[str],
    lines: Sequence[int],
    reading: Reading,
) -> tuple[float, list[str]]:
    """The time step of a column of times, within the digits printed, and notes on it.

    It is the first of these that all times agree with: the mean step as printed; a whole number of
    samples a second, each time within its last digit; the mean step to twelve digits, each time
    within its last digit or 1 % of a step. Of a step that is a whole number of last digits no digit
    is lost. If `reading` gives a time step, only that one is tried. Raises `InputError` where none
    fits.
    """
    mean = float(f"{float(time[-1] - time[0]) / max(len(time) - 1, 1):.12g}")
    if len(words) < 2:
        raise fault(f"{len(words)} sample(s); at least 2 are needed to know the time step")
    if not mean > LEAST:
        raise fault("time_s does not increase")
    digit = 10.0 ** -min(max(map(_decimals, words)), 30)
    # A coarser digit could hide a sample that is missing or in the wrong place.
    tells = digit <= 0.5 * mean

    def slack(step: float) -> float:
        is_printed_whole = abs(step / digit - round(step / digit)) < 1e-6
        return 0.0 if is_printed_whole else digit * (1.0 + 1e-6)

    rounding = 1e-9 * max(1.0, float(np.max(np.abs(time))))
    printed = float(f"{round(mean / digit) * digit:.12g}") if digit > 1e-12 else mean
    candidates = [
        (printed, min(rounding, 0.01 * mean)),
        (whole := 1.0 / max(round(1.0 / mean), 1), slack(whole) if tells else 0.0),
        (mean, max(0.01 * mean, slack(mean) if tells else 0.0) + 1e-9),
    ]
    if (given := reading.time_step) is not None:
        candidates = [(given, max(0.01 * given, slack(given)) + 1e-9)]
    for step, most in candidates:
        uneven = np.flatnonzero(np.abs(time - time[0] - step * np.arange(len(time))) > most)
        if step > 0.0 and not uneven.size:
            break
    else:
        first, step = _off_step(time, int(uneven[0]), step)
        hint = "" if tells else f"; times of {digit:g} s may hide it: {option('time_step', 0.005)}"
        raise fault(
            f"time {words[first]} s is off the uniform step {step:.6g} s{hint}", lines[first]
        )
    notes = [f"the first time is {time[0]:g} s; it is 0 here"] if abs(time[0]) > rounding else []
    return step, notes
