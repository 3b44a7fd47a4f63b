"""Files and folders that a command is to write, checked before it plays.

In: paths that the user gave. Out: folders that exist, or one line that says what is wrong. Commands
that write call it.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rockcheck.reports.style import kind_of
from rockcheck.scenes import InputError, printable, writing


def check_file(path: Path, option: str, check: Callable[[Path], Any] = kind_of) -> None:
    """Raise `InputError` that names the `option` where a file of that name cannot be written.

    `check` raises it for an ending that is not allowed, by default of a figure.
    """
    if not path.parent.is_dir():
        raise InputError(f"{printable(path.parent)}: no such folder", option)
    check(path)


def usable_folder(folder: Path, *parts: str) -> Path:
    """A folder, or one within it, made if need be.

    Raises `InputError` where it cannot be written, or lies behind a link in `folder`.
    """
    path = folder.joinpath(*parts)
    try:
        writing.made(folder, *parts)
    except OSError as error:
        raise InputError(
            f"{printable(path)}: cannot be used as a folder: {error.strerror}"
        ) from None
    if not os.access(path, os.W_OK | os.X_OK):
        raise InputError(f"{printable(path)}: not writable")
    return path
