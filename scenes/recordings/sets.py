"""Sets of recorded motions: which files are meant, and which of their components shake a block from
side to side.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from pathlib import Path

from rockcheck.scenes.errors import InputError, printable
from rockcheck.scenes.recordings import Reading, Recording, read_components

#: Where the records lie that come with the package.
RECORDS = Path(str(resources.files("rockcheck.scenes"))) / "data" / "records"
#: How files and networks name the vertical component; K-NET's third and sixth channels (KiK-net)
#: are vertical, too.
_VERTICAL = re.compile(
    r"(?:.*[-_. ])?(?:up|dn|dwn|down|u-?d|ver|vrt|vert|vertical|[HBES][NLGH]Z)", re.IGNORECASE
)
_KIKNET = ("3", "6")
#: The part of a file's name that says so, with its sign before it.
_UPWARD = re.compile(
    r"(?:^|[-_. ])(?:up|dn|dwn|down|u-?d|vertical|vert|vrt|ver|[HBES][NLGH]Z|[VZ])"
    r"(?=\d?(?:[-_. ]|$))",
    re.IGNORECASE,
)


class Odd(str):
    """What a folder or a pattern holds beside records, and why it is none: named, and left out."""

    __slots__ = ()


def files_of(words: Sequence[str | Path], folder: Path = Path()) -> dict[Path, bool]:
    """The files that are meant, each once, and whether it was named itself: paths, folders (all
    files in them), and patterns such as "RSN1_H*.AT2", all in `folder`. A name may also be that of
    a record that comes with the package.

    A pattern may stand in quotes, so that no shell has expanded it. Raises `InputError` where a
    folder or a pattern holds no file.
    """
    found: dict[Path, bool] = {}
    for word in words:
        path = record_path(str(word), folder)
        if path.is_dir():
            inside = _files(path.iterdir())
        elif path.exists() or not any(sign in path.name for sign in "*?["):
            found[path] = True
            continue
        else:
            inside = _files(path.parent.glob(path.name))
        if not inside:
            raise InputError(
                f"{printable(path)}:"
                f" {'a folder without files' if path.is_dir() else 'no such files'}"
            )
        found = dict.fromkeys(inside, False) | found
    return found


def record_path(name: str, folder: Path) -> Path:
    """The file of that name in `folder`, else among the records that come with the package."""
    beside, shipped = folder / name, RECORDS / name
    return (
        shipped if not beside.exists() and Path(name).name == name and shipped.exists() else beside
    )


def _files(paths: Iterable[Path]) -> list[Path]:
    return sorted(path for path in paths if path.is_file() and not path.name.startswith("."))


def motions_of(
    paths: Iterable[Path], reading: Reading
) -> tuple[list[tuple[str, Recording]], list[str]]:
    """The horizontal components of the files, each with a name, and what is left out: the names of
    the vertical ones, and `Odd` files.

    The name is the file's, with the component's where the file has several. A component or column
    that `reading` names is taken as it is. Raises as `read_components`, and where all components
    are vertical.
    """
    motions: list[tuple[str, Recording]] = []
    read, odd = _read(paths, reading)
    left_out: list[str] = []
    for path, components in read.items():
        for one in components:
            name = f"{path.name} {one.component}" if len(components) > 1 else path.name
            if reading.component is None and reading.column is None and is_vertical(path, one):
                left_out.append(name)
            else:
                motions.append((name, one))
    if left_out and not motions:
        raise InputError(f"{left_out[0]}: a vertical component, and no horizontal one is given")
    return motions, [*left_out, *odd]


def _read(paths: Iterable[Path], reading: Reading) -> tuple[dict[Path, list[Recording]], list[Odd]]:
    """The components of each file, and why others have none.

    Raises `InputError` where that is one that was named, or all of them.
    """
    read: dict[Path, list[Recording]] = {}
    faults: list[InputError] = []
    for path in paths:
        try:
            read[path] = read_components(path, reading)
        except InputError as error:
            if not isinstance(paths, Mapping) or paths[path]:
                raise
            faults.append(error)
    if faults and not read:
        raise faults[0]
    return read, [Odd(error) for error in faults]


def verticals_of(paths: Iterable[Path], reading: Reading) -> dict[str, Recording]:
    """By the name of each horizontal motion (see `motions_of`), its vertical component.

    It is the one in the same file, else that of the file in the same folder whose name differs only
    in the component, as ELC-UP.AT2 does from ELC180.AT2. Raises `InputError` where there is not
    exactly one, and for a vertical component that belongs to no motion.
    """
    horizontal: dict[Path, list[str]] = {}
    upward: dict[Path, list[Recording]] = {}
    for path, components in _read(paths, reading)[0].items():
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
            raise InputError(
                f"{printable(path)}: {len(up)} vertical components {where}: give exactly one",
                "vertical",
            )
        used.add(source)
        found |= dict.fromkeys(names, up[0])
    if unused := [path for path in alone if path not in used]:
        raise InputError(
            f"{printable(unused[0])}: a vertical component, and no horizontal one is named alike",
            "vertical",
        )
    return found


def _vertical_file(path: Path, alone: Iterable[Path]) -> Path | None:
    """The file with the vertical component of `path`: the one whose name agrees in most letters
    around the component.
    """
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
