"""Reading foreign files safely: only regular files, of bounded size, as UTF-8 text."""

from __future__ import annotations

import gzip
import json
import os
import re
import stat
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, cast

from rockcheck.scenes.errors import InputError, inert, printable
from rockcheck.scenes.writing import mapped

if TYPE_CHECKING:
    import pandas as pd

#: Largest text file, bytes.
MOST_BYTES = 400_000_000
#: Largest table, bytes: the longest history that a scene may ask for, with all its digits.
MOST_TABLE_BYTES = 1_500_000_000
#: Most columns of a table, and the longest line, bytes.
MOST_COLUMNS, MOST_LINE = 1000, 1_000_000


def within(folder: Path, *parts: str) -> Path:
    """Path of a part of a folder that somebody may have sent.

    Raises `InputError` where it leads out of the folder, as by a link.
    """
    path = folder.joinpath(*parts)
    if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder)):
        raise InputError(f"{printable(path)}: cannot be read: lies outside the run's folder")
    return path


@contextmanager
def open_regular(path: Path, most: int = MOST_BYTES) -> Iterator[IO[bytes]]:
    """A regular file of at most `most` bytes, open for reading.

    Raises `InputError` for anything else, such as a pipe or a device, which may have no end or wait
    for ever, and does not open it; also where the system cannot read the file.
    """
    shown = printable(path)
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise InputError(f"{shown}: cannot be read: not a file", file=path)
        at_once = getattr(os, "O_NONBLOCK", 0)
        with open(path, "rb", opener=lambda name, how: os.open(name, how | at_once)) as stream:
            about = os.fstat(stream.fileno())
            if not stat.S_ISREG(about.st_mode):
                raise InputError(f"{shown}: cannot be read: not a file", file=path)
            if about.st_size > most:
                raise InputError(f"{shown}: larger than {most} bytes", file=path)
            yield stream
    except InputError:
        raise
    except (OSError, ValueError) as error:  # a path that holds a null character is a ValueError
        raise InputError(
            f"{shown}: cannot be read: {getattr(error, 'strerror', None) or error}", file=path
        ) from None


def read_bytes(path: Path, most: int = MOST_BYTES) -> bytes:
    """The content of a file. Raises `InputError` where it is no file, or too large."""
    with open_regular(path, most) as stream:
        content = stream.read(most + 1)
    if len(content) > most:  # it has grown
        raise InputError(f"{printable(path)}: larger than {most} bytes", file=path)
    return content


def head_of(path: Path, most: int) -> str:
    """The first `most` bytes of a text file; empty where there is none."""
    try:
        with open_regular(path) as stream:
            return stream.read(most).decode(errors="replace")
    except InputError:
        return ""


def read_json(path: Path) -> Any:
    """The value of a JSON file, its texts `inert`. Raises `InputError` where it is no such file."""
    text = read_text(path)
    try:
        value = json.loads(text)
        plain = text.isascii() and "\\" not in text
        return value if plain else mapped(value, lambda x: inert(x) if isinstance(x, str) else x)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{printable(path)}: not JSON: {printable(error)}") from None


def read_text(path: Path, most: int = MOST_BYTES, *, latin: bool = False) -> str:
    """The text of a file without a byte-order mark.

    Raises `InputError` where it is no file, too large or not UTF-8.

    With `latin` a file that is not UTF-8 is read as UTF-16 if it has that byte-order mark, else as
    Latin-1 if it has no control characters.
    """
    content = read_bytes(path, most)
    try:
        text = (
            content.decode("utf-16")
            if latin and _NOT_UTF8.match(content)
            else content.decode("utf-8-sig")
        )
    except UnicodeDecodeError:
        if not latin or _CONTROLS.search(content):
            raise InputError(f"{printable(path)}: not a text file", file=path) from None
        text = content.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


#: First bytes of a file that gzip has compressed.
_GZIP = b"\x1f\x8b"
#: The marks of UTF-16, and bytes that no text holds.
_NOT_UTF8 = re.compile(rb"\xff\xfe|\xfe\xff")
_CONTROLS = re.compile(rb"[\x00-\x08\x0b\x0e-\x19\x1b-\x1f\x7f]")


def first_lines(path: Path, most: int) -> tuple[list[str], str]:
    """At most `most` first lines of a text file, plain or compressed by gzip, and its encoding.

    A file that is not UTF-8 is taken for Latin-1. Raises `InputError` where it cannot be read, and
    for a line that is too long for a table.
    """
    shown = printable(path)
    lines: list[bytes] = []
    with open_regular(path, MOST_TABLE_BYTES) as raw:
        try:
            stream = _unpacked(raw)
            while len(lines) < most and (line := stream.readline(MOST_LINE + 1)):
                lines.append(line)
        except (gzip.BadGzipFile, EOFError, zlib.error):
            raise InputError(f"{shown}: a compressed file that is damaged") from None
    for number, line in enumerate(lines, 1):
        if len(line) > MOST_LINE:
            raise InputError(
                f"{shown}: not a CSV table: line {number}: longer than {MOST_LINE} bytes"
            )
    content = b"".join(lines)
    try:
        text, encoding = content.decode("utf-8-sig"), "utf-8-sig"
    except UnicodeDecodeError:
        text, encoding = content.decode("latin-1"), "latin-1"
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), encoding


def _unpacked(raw: IO[bytes]) -> IO[bytes]:
    """The content of an open file, decompressed if gzip has compressed it."""
    packed = raw.read(len(_GZIP)) == _GZIP
    raw.seek(0)
    return cast(IO[bytes], gzip.GzipFile(fileobj=raw)) if packed else raw


def read_table(path: Path, **options: Any) -> pd.DataFrame:
    """A CSV file by pandas, plain or compressed by gzip; `options` are those of pandas.

    Lines that start with # are remarks.

    Raises `InputError` where it is no such file, or a line of it is too long for a table of
    histories.
    """
    import pandas as pd

    shown = printable(path)
    if pd.__version__ < "3":  # its reader loses the last bit of a number by default
        options = {"float_precision": "round_trip", **options}
    with open_regular(path, MOST_TABLE_BYTES) as raw:
        try:
            stream = _unpacked(raw)
            _check_lines(stream, shown)
            stream.seek(0)
            # It would take the first column for names of rows, or leave what is too much out.
            with warnings.catch_warnings(action="error", category=pd.errors.ParserWarning):
                return pd.read_csv(stream, **{"comment": "#", "index_col": False, **options})
        except (gzip.BadGzipFile, EOFError, zlib.error):
            raise InputError(f"{shown}: a compressed file that is damaged") from None
        except InputError:
            raise
        # of pandas' parser, too
        except (ValueError, OverflowError, RecursionError, pd.errors.ParserWarning) as error:
            raise InputError(
                f"{shown}: rows have more values than the heading has columns"
                if isinstance(error, Warning)
                else f"{shown}: not a CSV table: {printable(error)}"
            ) from None


def _check_lines(stream: IO[bytes], shown: str) -> None:
    """Check that each row stands on one line, and that lines, columns and size are bounded.

    Raises `InputError`.
    """
    size = 0
    for number, line in enumerate(iter(lambda: stream.readline(MOST_LINE + 1), b""), 1):
        size += len(line)
        if size > MOST_TABLE_BYTES:  # a small compressed file may hold very much
            raise InputError(f"{shown}: larger than {MOST_TABLE_BYTES} bytes")
        if len(line) > MOST_LINE:
            raise InputError(
                f"{shown}: not a CSV table: line {number}: longer than {MOST_LINE} bytes"
            )
        if line.startswith(b"#"):
            continue
        if line.count(b",") >= MOST_COLUMNS:
            raise InputError(
                f"{shown}: not a CSV table: line {number}: more than {MOST_COLUMNS} columns"
            )
        if line.count(b'"') % 2 and line.partition(b"#")[0].count(b'"') % 2:
            raise InputError(
                f"{shown}: not a CSV table: line {number}: a quotation mark that is not closed on"
                " its line"
            )
