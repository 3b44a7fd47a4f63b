"""Histories: files of JSON lines, a line a run, the oldest first.

In: a path and the type of its lines. Out: the lines, or the file with one more. The trend of a
suite and that of the commands' costs are kept so.
"""

import os
import shutil
import subprocess
from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from rockcheck.scenes import InputError, errors, printable, reading
from rockcheck.validation.discrepancy.figures import Stored

#: Environment variables in which continuous integration gives its commit.
COMMITS = ("GITHUB_SHA", "CI_COMMIT_SHA", "BUILD_SOURCEVERSION", "CIRCLE_SHA1")

Line = TypeVar("Line", bound=Stored)


def read_history(path: Path, kind: type[Line]) -> list[Line]:
    """The lines of a history, the oldest first; none where there is no file yet.

    Raises `InputError`, naming a line that is unusable.
    """
    if not path.exists():
        return []
    runs: list[Line] = []
    for number, line in enumerate(reading.read_text(path).splitlines(), 1):
        if not line.strip():
            continue
        try:
            runs.append(kind.model_validate_json(line))
        except ValidationError as error:
            raise InputError(
                f"{printable(path)}, line {number}: not a run of a history:"
                f" {errors.from_validation(error)}"
            ) from None
    return runs


def append_history(path: Path, run: Line) -> list[Line]:
    """Append a run to a history; returns all its runs, the oldest first.

    Raises `InputError` (see `read_history`).
    """
    earlier = read_history(path, type(run))
    with path.open("a+b") as stream:
        if stream.tell():  # an editor may have left the last line without its end
            stream.seek(-1, os.SEEK_END)
        end = b"" if stream.read(1) in b"\n" else b"\n"
        stream.write(end + run.model_dump_json().encode() + b"\n")
    return [*earlier, run]


def commit_of(folder: Path) -> str:
    """The commit that is checked out in a folder, "-dirty" appended if files have changed.

    Outside of a repository it is the continuous integration's, "" without one.
    """
    git = shutil.which("git")
    if git:
        words = ["describe", "--always", "--dirty", "--abbrev=12", "--exclude", "*"]
        described = subprocess.run(
            [git, "-C", str(folder), *words],
            capture_output=True,
            text=True,
            check=False,
            stdin=subprocess.DEVNULL,
        )
        if described.returncode == 0:
            return printable(described.stdout.strip())
    given = [os.environ[name] for name in COMMITS if os.environ.get(name)]
    return printable(given[0][:12]) if given else ""
