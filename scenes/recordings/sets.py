"""Sets of recorded motions: which files are meant, and which of their components shake a block from side to side."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from rockcheck.scenes.errors import InputError, printable
from rockcheck.scenes.recordings import Reading, Recording, read_components

#: How files and networks name the vertical component; K-NET's third and sixth channels (KiK-net) are vertical, too.
_VERTICAL = re.compile(r"(?:.*[-_. ])?(?:up|dn|dwn|down|u-?d|ver|vrt|vert|vertical|[HBES][NLGH]Z)", re.IGNORECASE)
_KIKNET = ("3", "6")


def files_of(words: Sequence[str | Path]) -> list[Path]:
    """The files that are meant, each once: paths, folders (all files in them), and patterns such as "RSN1_H*.AT2".

    A pattern may stand in quotes, so that no shell has expanded it. Raises `InputError` where a folder or a pattern holds no file.
    """
    found: list[Path] = []
    for word in words:
        path = Path(word)
        if path.is_dir():
            inside = _files(path.iterdir())
        elif path.exists() or not any(sign in path.name for sign in "*?["):
            inside = [path]
        else:
            inside = _files(path.parent.glob(path.name))
        if not inside:
            raise InputError(f"{printable(path)}: {'a folder without files' if path.is_dir() else 'no such files'}")
        found += inside
    return list(dict.fromkeys(found))


def _files(paths: Iterable[Path]) -> list[Path]:
    return sorted(path for path in paths if path.is_file() and not path.name.startswith("."))


def motions_of(paths: Sequence[Path], reading: Reading) -> tuple[list[tuple[str, Recording]], list[str]]:
    """The horizontal components of the files, each with a name, and the names of the vertical ones, which are left out.

    The name is the file's, with the component's where the file has several. A component or column that `reading` names is taken as it is.
    Raises as `read_components`, and where all components are vertical.
    """
    motions: list[tuple[str, Recording]] = []
    left_out: list[str] = []
    for path in paths:
        components = read_components(path, reading)
        for one in components:
            name = f"{path.name} {one.component}" if len(components) > 1 else path.name
            if reading.component is None and reading.column is None and is_vertical(path, one):
                left_out.append(name)
            else:
                motions.append((name, one))
    if left_out and not motions:
        raise InputError(f"{left_out[0]}: a vertical component, and no horizontal one is given")
    return motions, left_out


def verticals_of(paths: Sequence[Path], reading: Reading) -> dict[str, Recording]:
    """By the name of each horizontal motion (see `motions_of`), the vertical component of the same file.

    Raises `InputError` for a file that has not exactly one.
    """
    found: dict[str, Recording] = {}
    for path in paths:
        up = [one for one in read_components(path, reading) if is_vertical(path, one)]
        if len(up) != 1:
            raise InputError(f"{printable(path)}: {len(up)} vertical components; one beside the horizontal ones is asked for", "vertical")
        found |= {name: up[0] for name, _ in motions_of([path], reading)[0]}
    return found


def is_vertical(path: Path, recording: Recording) -> bool:
    """Whether the component is the vertical one, or, of a table, which has none, the file."""
    if recording.form.startswith("K-NET") and recording.component in _KIKNET:
        return True
    channel = "" if recording.form in ("CSV", "table") else recording.component
    return channel in ("V", "Z") or bool(_VERTICAL.fullmatch(channel or path.stem))
