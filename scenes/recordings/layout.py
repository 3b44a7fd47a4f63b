"""How the fields of a table's lines are separated, and what a comma in them means.

| first line of numbers | fields | why |
|---|---|---|
| `0.1 0.2` | 2 | blanks |
| `0.1, 0.2` | 2 | a comma beside a decimal point separates |
| `0;1,5` | 2 | semicolons separate, the comma is a decimal one |
| `0,1 1,5` | 2 | each word is a number with one comma: decimal commas |
| `0,1` | ? | ambiguous: asked for |
| `0 ,15` | 2 | no number begins with a comma after a blank |
"""

import csv
import re
from dataclasses import dataclass

from rockcheck.scenes.errors import printable
from rockcheck.scenes.recordings.recording import Reading, fault, option

NumberedLines = list[tuple[int, str]]

#: Most lines of words at the start of a table.
MOST_HEADER = 200
_DECIMAL_COMMA = re.compile(r"[-+]?\d*+,\d++(?:[eEdD][-+]?\d++)?")
_BEGINS_WITH_NUMBER = re.compile(r"[\s\"]*+[-+.]?[-+.\d]")


@dataclass(frozen=True)
class Layout:
    """Separator of a table's fields, and whether a comma stands before the decimals.

    `separator` None: fields are separated by blanks.
    """

    separator: str | None
    decimal_comma: bool

    def words(self, n: int, line: str) -> list[str]:
        """The fields of line `n`; decimal commas become points."""
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
        return [word.replace(",", ".", 1) if is_decimal_comma(word) else word for word in words]


def is_decimal_comma(word: str) -> bool:
    """Whether `word` is a number with one comma, as 1,5 or ,5 or -1,5e3."""
    return _DECIMAL_COMMA.fullmatch(word) is not None


def has_decimal_commas(line: str) -> bool:
    """Whether the words between blanks are numbers, with commas before their decimals.

    Each word with a comma must be such a number. A comma after a blank, as in 0 ,1, separates.
    """
    words = line.split()
    if len(words) < 2 or "." in line:
        return False
    with_commas = [word for word in words if "," in word]
    starts_with_comma = any(word[0] == "," for word in with_commas)
    if starts_with_comma and "," not in words[0]:
        return False
    return all(map(is_decimal_comma, with_commas))


def is_ambiguous_comma(line: str, head: list[str]) -> bool:
    """Whether the only comma of a line may separate two whole numbers, or stand before decimals.

    A line of the `head` that names two columns, with a comma between them, decides.
    """
    if "." in line or len(line.split()) != 1:
        return False
    return all("," not in other or is_decimal_comma(other.strip()) for other in head)


def layout_of(rows: NumberedLines, reading: Reading) -> Layout:
    """The layout of a table, from its first line of numbers, else from its first line."""
    head = [line for _, line in rows[:MOST_HEADER]]
    lines_of_numbers = (line for line in head if _BEGINS_WITH_NUMBER.match(line))
    line = next(lines_of_numbers, head[0])
    for sign in ";\t":
        if sign in line:
            return Layout(sign, _takes_commas_for_decimals(line, reading))
    if "," not in line or reading.decimal == ",":
        return Layout(None, _takes_commas_for_decimals(line, reading))
    if has_decimal_commas(line):
        return Layout(None, True)
    if reading.decimal is None and is_ambiguous_comma(line, head):
        raise fault(
            f"a comma between columns or before the decimals? {option('decimal', ',')}, or"
            " decimal .",
            rows[-1][0],
        )
    return Layout(",", False)


def _takes_commas_for_decimals(line: str, reading: Reading) -> bool:
    """Where commas do not separate fields: whether they stand before decimals."""
    if reading.decimal is not None:
        return reading.decimal == ","
    return "," in line and "." not in line
