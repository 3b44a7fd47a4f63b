"""A recorded ground motion as read from a file, and the options of its reader."""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, Strict, StringConstraints, model_validator

from rockcheck.scenes.base import LEAST, MOST, Floats, Frozen, Positive
from rockcheck.scenes.errors import InputError, printable

GRAVITY_OF_RECORDS = 9.80665  # m/s^2, the unit "g" of record files (standard gravity)
MOST_SAMPLES = 10_000_000

Unit = Literal["g", "mg", "m/s2", "cm/s2", "gal", "mm/s2", "ft/s2"]
#: m/s^2 in each unit that a record may have.
UNITS: dict[str, float] = {
    "g": GRAVITY_OF_RECORDS,
    "mg": GRAVITY_OF_RECORDS / 1000.0,
    "m/s2": 1.0,
    "cm/s2": 0.01,
    "gal": 0.01,
    "mm/s2": 0.001,
    "ft/s2": 0.3048,
}

# All repetitions are possessive: a failed match takes one pass, however long the line.
NUMBER = r"[-+]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eEdD][-+]?\d++)?"
_NUMBER = re.compile(rf"{NUMBER}|[-+]?(?:nan|inf(?:inity)?)", re.IGNORECASE)
_EXPONENT = str.maketrans("dD", "ee")
#: Also as in m s^-2, m_s2, and ms-2.
_PER_SECOND_SQUARED = (
    r"(?:/\(?s(?:ec)?(?:/s(?:ec)?|(?:\^|\*\*)?2)\)?|[._*]?s(?:ec)?(?:\^|\*\*)?\(?-2|_s(?:ec)?_?2)"
)
_SPELLINGS = {unit: unit.replace("/s2", _PER_SECOND_SQUARED) for unit in UNITS} | {
    "g": r"g(?:'?s)?",
    "gal": r"gals?",
}
_SPELT = {unit: re.compile(pattern, re.IGNORECASE) for unit, pattern in _SPELLINGS.items()}

#: Options that may overrule what a file states.
OVERRIDABLE = ("unit", "time_step", "order")
Word = Annotated[str, StringConstraints(min_length=1, max_length=100)]
Place = Annotated[int, Strict(), Field(ge=1, le=1000)]


class Reading(Frozen):
    """Options of a reader: values that a record file does not state, and the part to read.

    None: as the file says. A value that differs from what the file states is an error, unless an
    exclamation mark follows it, as in `unit="g!"`: then it holds, and a note says so.

    | option | meaning |
    |---|---|
    | `unit` | of the accelerations |
    | `time_step` | s, where neither a header nor a column of times gives it |
    | `column` | of a table: the column of accelerations, its number from 1 or its name |
    | `header_lines` | of a table: number of first lines without data |
    | `decimal` | of a table: the decimal separator |
    | `order` | of a table without times: whether numbers run along the lines, or down the columns |
    | `component` | of a file with several: its number from 1 or its name |
    | `overriding` | names of the options that were given with an exclamation mark |
    """

    unit: Unit | None = None
    time_step: Positive | None = None
    column: Place | Word | None = None
    header_lines: Annotated[int, Strict(), Field(ge=0, le=10_000)] | None = None
    decimal: Literal[".", ","] | None = None
    order: Literal["rows", "columns"] | None = None
    component: Place | Word | None = None
    overriding: tuple[Literal["unit", "time_step", "order"], ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _take_marks(cls, data: Any) -> Any:
        """Turn the mark of `unit="g!"` into an entry of `overriding`."""
        if not isinstance(data, dict):
            return data
        marked = {
            name: data[name].removesuffix("!").strip()
            for name in OVERRIDABLE
            if isinstance(data.get(name), str) and data[name].endswith("!")
        }
        if not marked:
            return data
        if "time_step" in marked and is_number(marked["time_step"]):
            marked["time_step"] = float(marked["time_step"].translate(_EXPONENT))
        overriding = (*data.get("overriding", ()), *marked)
        return {**data, **marked, "overriding": tuple(dict.fromkeys(overriding))}


@dataclass(frozen=True, kw_only=True)
class Recording:
    """One component of a record: unscaled samples in m/s^2, the first at t = 0.

    `time_step` is in s. `unit` and `form` are the file's unit and format, `component` is the
    direction or channel ("" where the file names none). `notes` say what was changed in the samples
    or assumed. `borehole`: the channel is one below the ground.
    """

    samples: Floats
    time_step: float
    unit: str
    form: str
    component: str = ""
    notes: tuple[str, ...] = ()
    borehole: bool = False


class Contradiction(InputError):
    """An option that contradicts what the file states; `option` is its name."""

    def __init__(
        self, message: str, option: str, key: str = "", *, file: Path | None = None
    ) -> None:
        self.option = option
        super().__init__(message, key, file=file)


def fault(said: str, line: int | None = None) -> InputError:
    """The `InputError` for a file, and for a line of it; `read_components` names the file."""
    return InputError(said, f"line {line}" if line else "")


def option(name: str, value: str | float) -> str:
    """Text that shows how to give an option, on the command line and in a scene file."""
    quote = '"' if isinstance(value, str) else ""
    return f"--read {name}={value} (in a scene file: {name} = {quote}{value}{quote})"


def number(line: int, word: str) -> float:
    """The finite number in `word`, in Fortran's notation or C's.

    Raises `InputError` if it is none, or larger than `MOST`.
    """
    value = float(word.translate(_EXPONENT)) if is_number(word) else math.nan
    if abs(value) <= MOST:
        return value
    shown = printable(word, 30)
    said = (
        f"{shown} is larger than {MOST:g}"
        if math.isfinite(value)
        else f"{shown!r} is not a finite number"
    )
    raise fault(said, line)


def place_of(kind: str, asked: int | str, names: Sequence[str], listed: str) -> int:
    """Place from 0 of the column or component that is `asked` for, by its number or its name.

    `kind` and `listed` are words for the message of the `InputError` where there is no such one.
    """
    if isinstance(asked, int) and asked <= len(names):
        return asked - 1
    if names.count(str(asked)) == 1:  # a name may be a number, such as that of an azimuth
        return names.index(str(asked))
    raise fault(f"no single {kind} {printable(repr(asked))}; there are {listed}")


def is_number(word: str) -> bool:
    """Whether `word` has the form of a number, also of one that is not finite."""
    return _NUMBER.fullmatch(word) is not None


def numbers(lines: Iterable[tuple[int, str]], count: int = 0) -> list[float]:
    """All numbers of numbered lines, separated by blanks.

    Where some have run together and there are `count`, the lines are cut into columns of one width.
    """
    rows = [(n, line.rstrip()) for n, line in lines if not line.isspace() and line]
    cells = [(n, word) for n, line in rows for word in line.split()]
    if count and not all(is_number(word) for _, word in cells):
        cells = _columns(rows, count) or cells
    return [number(n, word) for n, word in cells]


def _columns(rows: list[tuple[int, str]], count: int) -> list[tuple[int, str]]:
    """The cells of `count` numbers in columns of one width, as Fortran writes them.

    [] if the lines do not divide into equal columns.
    """
    lengths = [len(line) for _, line in rows]
    width, rest = divmod(sum(lengths), count)
    if rest or not width or len(set(lengths[:-1])) > 1 or any(one % width for one in lengths):
        return []
    return [
        (n, line[k : k + width].strip()) for n, line in rows for k in range(0, len(line), width)
    ]


def known_unit(text: str) -> str:
    """The unit that `text` spells, such as cm/sec/sec for cm/s2; "" where it spells none."""
    word = text.strip().strip("()[] .").replace("²", "2").replace(" ", "")[:20]
    return next((unit for unit, spelt in _SPELT.items() if spelt.fullmatch(word)), "")


def settled_unit(stated: str, reading: Reading) -> str:
    """The unit of the file: stated in it, or given by `reading`.

    Raises `InputError` where it is neither, and where the two differ, unless that of `reading` is
    to override the file's.
    """
    if reading.unit is None:
        if stated:
            return stated
        raise fault(
            f"the unit of acceleration is not stated; give it: {option('unit', 'g')}, or one of"
            f" {', '.join(UNITS)}"
        )
    if not stated or "unit" in reading.overriding:
        return reading.unit
    if UNITS[stated] != UNITS[reading.unit]:
        raise Contradiction(
            f"the file states the unit {stated}, not {reading.unit}; leave the option unit out, or"
            f" override the file: {option('unit', f'{reading.unit}!')}",
            "unit",
        )
    return stated


def settled_step(stated: float, reading: Reading) -> float:
    """The time step in s that a header states.

    Raises `InputError` where `reading` gives another that is not to override it.
    """
    if reading.time_step is None or abs(stated - reading.time_step) <= 1e-6 * stated:
        return stated
    if "time_step" in reading.overriding:
        return reading.time_step
    override = option("time_step", f"{reading.time_step:g}!")
    raise Contradiction(
        f"the file states a time step of {stated:g} s, not {reading.time_step:g} s; leave the"
        f" option time_step out, or override the file: {override}",
        "time_step",
    )


def checked_count(line: int, name: str, count: str) -> int:
    """A number of samples from a header; raises `InputError` if it is out of range."""
    value = int(count[:12])
    if not 1 <= value <= MOST_SAMPLES:
        raise fault(f"{name} {count[:20]} is not in 1..{MOST_SAMPLES}", line)
    return value


def checked_step(line: int, name: str, word: str) -> float:
    """A time step from a header, s; raises `InputError` if it is below `LEAST`."""
    value = number(line, word)
    if value < LEAST:
        raise fault(
            f"{name} {word} is {'not positive' if value <= 0.0 else f'below {LEAST:g}'}", line
        )
    return value
