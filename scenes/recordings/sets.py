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
#: The part of a file's name that says so, with its sign before it.
_UPWARD = re.compile(r"(?:^|[-_. ])(?:up|dn|dwn|down|u-?d|vertical|vert|vrt|ver|[HBES][NLGH]Z|[VZ])(?=\d?(?:[-_. ]|$))", re.IGNORECASE)


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
    """By the name of each horizontal motion (see `motions_of`), its vertical component.

    It is the one in the same file, else that of the file in the same folder whose name differs only in the component, as ELC-UP.AT2
    does from ELC180.AT2. Raises `InputError` where there is not exactly one, and for a vertical component that belongs to no motion.
    """
    horizontal: dict[Path, list[str]] = {}
    upward: dict[Path, list[Recording]] = {}
    for path in paths:
        components = read_components(path, reading)
        up = [one for one in components if is_vertical(path, one)]
        if up:
            upward[path] = up
        if len(up) < len(components) or reading.component is not None or reading.column is not None:
            horizontal[path] = [name for name, _ in motions_of([path], reading)[0]]
    alone = {path: up for path, up in upward.items() if path not in horizontal}
    found: dict[str, Recording] = {}
    used: set[Path] = set()
    for path, names in horizontal.items():
        source = path if path in upward else _vertical_file(path, alone)
        up = upward[source] if source else []
        if source is None or len(up) != 1:
            where = "in it or in a file of the set that is named alike"
            raise InputError(f"{printable(path)}: {len(up)} vertical components {where}: give exactly one", "vertical")
        used.add(source)
        found |= dict.fromkeys(names, up[0])
    if unused := [path for path in alone if path not in used]:
        raise InputError(f"{printable(unused[0])}: a vertical component, and no horizontal one is named alike", "vertical")
    return found


def _vertical_file(path: Path, alone: Iterable[Path]) -> Path | None:
    """The file with the vertical component of `path`: the one whose name agrees in most letters around the component."""
    fits: dict[int, list[Path]] = {}
    for other in alone:
        for said in _UPWARD.finditer(other.name):
            before, after = other.name[: said.start()].lower(), other.name[said.end() :].lower()
            name = path.name.lower()
            if other.parent == path.parent and name.startswith(before) and name.endswith(after):
                fits.setdefault(len(before) + len(after), []).append(other)
    best = fits[max(fits)] if fits else []
    return best[0] if len(set(best)) == 1 else None


def is_vertical(path: Path, recording: Recording) -> bool:
    """Whether the component is the vertical one, or, of a table, which has none, the file."""
    if recording.form.startswith("K-NET") and recording.component in _KIKNET:
        return True
    channel = "" if recording.form in ("CSV", "table") else recording.component
    return channel in ("V", "Z") or bool(_VERTICAL.fullmatch(channel or path.stem))
