"""Writing: files that are complete or untouched; tables as CSV, values as JSON, cases as JUnit."""

import csv
import io
import json
import math
import operator
import os
import re
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path
from typing import Any, Literal

from rockcheck.scenes.errors import InputError, inert, printable


def made(folder: Path, *parts: str) -> Path:
    """A folder of results, made if need be, or one within it.

    Raises `InputError` for a part that is a link.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for part in parts:
        folder = no_link(folder / part)
        folder.mkdir(exist_ok=True)
    return folder


def no_link(path: Path) -> Path:
    """`path`; raises `InputError` if it is a link.

    Writing through a link would change a file outside the folder of results.
    """
    if path.is_symlink():
        raise InputError(
            f"{printable(path)}: a link; results are not written through it: remove it"
        )
    return path


def write_whole(path: Path, content: str | bytes, *, named: bool = False) -> Path:
    """Write a file so that a reader sees the old content or the new, never a part.

    See `write_together`.
    """
    write_together({path: content}, named=named)
    return path


def write_together(contents: Mapping[Path, str | bytes], *, named: bool = False) -> None:
    """Write files, text as UTF-8, so that all of them are new or all of them are as they were.

    A link, a pipe or a device in the way is replaced: whoever sent a folder may have put it there.
    If the user `named` this very file, a pipe or a device such as /dev/stdout is written into, and
    a link stays one. Raises `OSError` that names the file.
    """
    finished: list[tuple[Path, Path]] = []
    with ExitStack() as leavings:
        for path, content in contents.items():
            with _naming(path):
                data = content.encode() if isinstance(content, str) else content
                target = Path(os.path.realpath(path)) if named and path.is_symlink() else path
                if named and path.exists() and not path.is_file() and not path.is_dir():
                    path.write_bytes(data)
                    continue
                new = target.with_name(f".{target.name[:60]}.{uuid.uuid4().hex[:8]}.part")
                with new.open("xb") as stream:  # for whom the user's umask says
                    leavings.callback(new.unlink, missing_ok=True)
                    stream.write(data)
                if target.is_dir() and not target.is_symlink():
                    raise IsADirectoryError(21, "Is a directory")
                finished.append((new, target))
        for temporary, target in finished:
            with _naming(target):
                os.replace(temporary, target)


def write_new(path: Path, content: str) -> None:
    """Write a text file that must not be there yet, whole or not at all.

    Raises `FileExistsError` where it is.
    """
    with _naming(path):
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        try:
            with os.fdopen(handle, "wb") as stream:
                stream.write(content.encode())
        except BaseException:
            path.unlink(missing_ok=True)
            raise


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Errors of the system name this file, not the temporary one beside it."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None


#: Start of a cell that a spreadsheet takes for a formula; a number or a lone sign is none.
_FORMULA = re.compile(r"[=@＝＠](?!\Z)|[-+－＋](?!(?:inf|nan|\d*+\.?+\d*+(?:[eE][-+]?\d++)?)\Z)")


def table_text(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table as CSV, floats with all their digits; None and NaN are empty cells."""
    return _csv(columns, (map(_cell, row) for row in rows))


def columns_text(columns: Mapping[str, Sequence[object]]) -> str:
    """Columns of one length as CSV, floats with all their digits; NaN are empty cells."""
    return _csv(list(columns), zip(*map(_cells, columns.values()), strict=True))


def _cells(values: Sequence[object]) -> Sequence[object]:
    """A column's cells.

    Numbers are checked one by one only if there is a NaN, the one value that does not equal itself.
    """
    if len(values) and isinstance(values[0], str):
        return list(map(cache(_cell), values))
    return [_cell(value) for value in values] if any(map(operator.ne, values, values)) else values


def _csv(columns: Sequence[str], rows: Iterable[Iterable[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(map(_cell, columns))
    writer.writerows(rows)
    return text.getvalue()


def _cell(value: object) -> object:
    """A cell that a spreadsheet shows as it is: a formula has an apostrophe before it."""
    if isinstance(value, str):
        text = inert(value)
        return f"'{text}" if _FORMULA.match(text) else text
    return "" if value is None or (isinstance(value, float) and math.isnan(value)) else value


def markdown_table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table as Markdown, without a line's end; a bar in a cell is escaped."""
    lines = (columns, ["---"] * len(columns), *rows)
    return "\n".join(
        "| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines
    )


#: A case of JUnit: place, name, what came of it ("" for a pass), reason, verdict, and time (s).
Case = tuple[str, str, Literal["", "failed", "error", "skipped"], str, str, float | None]


def junit_text(name: str, suites: Iterable[tuple[str, Iterable[Case]]]) -> str:
    """JUnit XML: suites by their names, and their cases."""
    from junitparser import Error, Failure, JUnitXml, Skipped, TestCase, TestSuite

    kinds = {"failed": Failure, "error": Error, "skipped": Skipped}
    document = JUnitXml(inert(name))  # XML allows no control characters
    for title, cases in suites:
        suite = TestSuite(inert(title))
        for place, what, found, reason, verdict, seconds in cases:
            case = TestCase(inert(what), inert(place), seconds)
            case.result = [kinds[found](inert(reason), verdict)] if found else []
            suite.append(case)  # `add_testcase` and `add_testsuite` search all added before
        document.append(suite)
    document.update_statistics()
    return bytes(document.tostring()).decode() + "\n"


def mapped(value: Any, leaf: Callable[[Any], Any]) -> Any:
    """A value as JSON can hold it, with `leaf` of every key and of all that holds nothing more.

    Keys become texts, tuples lists.
    """
    if isinstance(value, Mapping):
        return {leaf(str(key)): mapped(item, leaf) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [mapped(item, leaf) for item in value]
    return leaf(value)


def finite(value: Any) -> Any:
    """A value as JSON can hold it (see `mapped`): numbers that are not finite become null."""
    return mapped(
        value, lambda one: None if isinstance(one, float) and not math.isfinite(one) else one
    )


def script_text(place: str, value: Any) -> str:
    """A value as a script that assigns it to `place`; a page may hold it."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return f"{place} = {text};\n"


def json_text(value: Any) -> str:
    """A value as indented JSON (see `finite`).

    Other types, such as a path, are written as text.
    """
    return json.dumps(finite(value), indent=1, allow_nan=False, default=str)
