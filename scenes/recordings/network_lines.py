"""Parts of the readers of networks' text files: header lines, fixed fields and rows of numbers."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence

from rockcheck.scenes.recordings.recording import NUMBER, Reading, Recording, fault, number
from rockcheck.scenes.recordings.stated import Stated, recording_of

#: How many lines are searched for the header, and how many characters of each.
HEADER_LINES = 120
WIDE = 200


def fields(
    lines: list[str], first: int, count: int, *, across: int, width: int, lead: int = 0
) -> tuple[list[float], int]:
    """`count` numbers in fields of `width` characters, `across` on a line, and the index behind.

    `first` is the index of the first line; the first field of a line is wider by `lead`. Fields may
    touch. Raises `InputError` where a line does not end with its last field, as where a digit is
    missing, and where a field is empty or no number.
    """
    values: list[float] = []
    index = first
    while len(values) < count and index < len(lines):
        line = lines[index].rstrip()
        on_line = min(across, count - len(values))
        length = lead + on_line * width
        if len(line) > length:
            raise fault(
                f"numbers go on behind the {on_line} fields of {width} characters", index + 1
            )
        if len(line) < length:
            raise fault(
                f"{len(line)} characters, not {length} for {on_line} fields of {width}: a number"
                " or a digit is missing",
                index + 1,
            )
        ends = range(lead + width, length + 1, width)
        words = [line[end - width : end].strip() for end in ends]
        if lead:
            words[0] = line[: lead + width].strip()
        values += [number(index + 1, word) for word in words]
        index += 1
    if len(values) < count:
        raise fault(f"the header says {count} samples, the file has {len(values)}", first + 1)
    return values, index


def components_of(
    rows: list[tuple[int, list[float]]],
    names: Iterable[str],
    stated: Stated,
    reading: Reading,
    form: str,
    notes: Sequence[str] = (),
) -> list[Recording]:
    """A recording for each column."""
    return [
        recording_of(
            [row[k] for _, row in rows],
            stated,
            reading,
            form=form,
            component=name[:30],
            notes=notes,
        )
        for k, name in enumerate(names)
    ]


def rows_of(lines: list[str], first: int, width: int) -> list[tuple[int, list[float]]]:
    """The numbers of each line from the index `first`; raises where there are not `width`."""
    rows = []
    for n, line in enumerate(lines[first:], first + 1):
        words = line.split()
        if not words or line[0] in "#%":
            continue
        if len(words) != width:
            raise fault(f"{len(words)} numbers, not {width}", n)
        rows.append((n, [number(n, word) for word in words]))
    return rows


def check_times(rows: list[tuple[int, list[float]]], step: float) -> None:
    """Raises `InputError` where a time is off the uniform step by half of it or more."""
    for index, (n, row) in enumerate(rows):
        if abs(row[0] - rows[0][1][0] - index * step) >= 0.5 * step:
            raise fault(f"time {row[0]:g} s is off the uniform step {step:.6g} s", n)


def first_of_numbers(lines: list[str], width: int) -> int:
    """Index of the first line of `width` numbers."""
    for index, line in enumerate(lines[:HEADER_LINES]):
        if are_numbers(line) and len(line.split()) == width:
            return index
    raise fault(f"no line of {width} numbers within the first {HEADER_LINES}")


def are_numbers(line: str) -> bool:
    """Whether the line holds numbers alone, and at least one."""
    words = line[:WIDE].split()
    return bool(words) and all(re.fullmatch(NUMBER, word) for word in words)


def value_of(lines: list[str], key: str) -> tuple[int, str]:
    """Line and value of the header line that begins with `key`; (0, "") if there is none."""
    for n, line in enumerate(lines[:HEADER_LINES], 1):
        if line.upper().startswith(key.upper()):
            return n, line[:WIDE].partition(":")[2].strip()
    return 0, ""


def first_in_head(lines: list[str], pattern: re.Pattern[str]) -> tuple[int, re.Match[str] | None]:
    """Number and match of the first header line in which `pattern` occurs; (0, None) if none."""
    return first_match([(n, line[:WIDE]) for n, line in enumerate(lines[:30], 1)], pattern)


def first_match(
    text: list[tuple[int, str]], pattern: re.Pattern[str]
) -> tuple[int, re.Match[str] | None]:
    """Number and match of the first line in which `pattern` occurs; (0, None) if none."""
    for n, line in text:
        if match := pattern.search(line):
            return n, match
    return 0, None


def bracketed(line: str) -> list[str]:
    """What stands in brackets, each; a last "" where nothing does."""
    return re.findall(r"[(\[]([^)\]]{1,20})[)\]]", line) or [""]


def digit_notes(lines: Sequence[str], first_line: int) -> list[str]:
    """A note where nearly all lines of samples have one length, and one or two have another.

    Such a line has lost a digit, or has one too many. The last one may be shorter. `first_line` is
    the number of the first line.
    """
    lengths = [(n, len(line.rstrip())) for n, line in enumerate(lines, first_line) if line.strip()]
    if len(lengths) < 8:
        return []
    usual = Counter(length for _, length in lengths).most_common(1)[0][0]
    odd = [(n, length) for n, length in lengths[:-1] if length != usual]
    if not 1 <= len(odd) <= 2:
        return []
    return [
        f"line {n} has {length} characters, nearly all others have {usual}: is a digit missing?"
        for n, length in odd
    ]
