"""Tables that any program wrote: CSV, with semicolons, tabs or blanks, and decimal commas.

In: a file. Out: the names of its columns, a row of units, the numbers, and the remarks above them.
Called by `History.load`.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rockcheck.scenes.columns import names_motion, unit_of
from rockcheck.scenes.errors import InputError, printable
from rockcheck.scenes.reading import MOST_COLUMNS, first_lines, read_table

if TYPE_CHECKING:
    import pandas as pd

#: Most lines in which the names of the columns are looked for.
MOST_HEAD = 200
#: What separates fields, the surest first; None: blanks.
SEPARATORS = (";", "\t", ",", None)


@dataclass(frozen=True)
class Table:
    """A table: its columns by their numbers in `frame`.

    `units` is empty without a row of units below the names. `remarks` are the lines above the names
    that begin with #, without it.
    """

    names: list[str]
    units: list[str]
    frame: pd.DataFrame
    remarks: list[str]


def read(path: Path) -> Table:
    """A table of a file, perhaps compressed. Raises `InputError` where it is none."""
    import pandas as pd

    lines, encoding = first_lines(path, MOST_HEAD)
    written = [n for n, line in enumerate(lines) if _content(line)]
    if not written:
        raise InputError(f"{printable(path)}: not a CSV table: it is empty")
    head = _names_line(lines, written)
    separator = _separator(lines[head])
    names = _fields(lines[head], separator)
    below = [n for n in written if n > head]
    units: list[str] = []
    if below and _are_units(_fields(lines[below[0]], separator), len(names)):
        units = _fields(lines[below.pop(0)], separator)
    remarks = [line[1:].strip() for line in lines[:head] if line.startswith("#")]
    if len(names) > MOST_COLUMNS:
        raise InputError(
            f"{printable(path)}: not a CSV table: line {head + 1}: more than {MOST_COLUMNS} columns"
        )
    numbered = list(range(len(names)))
    if not below:
        return Table(names, units, pd.DataFrame(columns=numbered), remarks)
    frame = read_table(
        path,
        header=None,
        names=numbered,
        skiprows=below[0],
        sep=separator or r"\s+",
        decimal=decimal_of(lines[below[0]], separator),
        encoding=encoding,
    )
    return Table(names, units, frame, remarks)


def _content(line: str) -> str:
    """A line without a remark."""
    return line.partition("#")[0].strip()


def _names_line(lines: Sequence[str], written: Sequence[int]) -> int:
    """The line that names the columns: the first with a time and a rotation, else the first."""
    for n in written:
        if names_motion(_fields(lines[n], _separator(lines[n]))):
            return n
    return written[0]


def _separator(line: str) -> str | None:
    """What separates the fields of a line of names."""
    content = _content(line)
    return next(sign for sign in SEPARATORS if sign is None or sign in content)


def _fields(line: str, separator: str | None) -> list[str]:
    """The fields of a line; a unit in brackets behind a blank belongs to the word before it."""
    content = _content(line)
    if separator is not None:
        try:
            return [field.strip() for field in next(csv.reader([content], delimiter=separator))]
        except csv.Error:  # a field of more than 100,000 characters: no name
            return [field.strip() for field in content.split(separator)]
    fields: list[str] = []
    for word in content.split():
        if fields and word.startswith(("(", "[")):
            fields[-1] += f" {word}"
        else:
            fields.append(word)
    return fields


def _are_units(fields: Sequence[str], count: int) -> bool:
    """Whether a line below the names gives the units of the columns."""
    known = [unit_of(field) for field in fields]
    others = [field for field, unit in zip(fields, known, strict=True) if not unit]
    return len(fields) == count and any(known) and all(field in ("", "-") for field in others)


def decimal_of(line: str, separator: str | None) -> str:
    """What stands before the decimals of a line of numbers."""
    content = _content(line)
    return "," if separator != "," and "," in content and "." not in content else "."
