"""Sets of recorded motions: their files, and their horizontal and vertical components."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from rockcheck.scenes.base import DATA
from rockcheck.scenes.errors import InputError, printable, refuse
from rockcheck.scenes.recordings import Reading, Recording, read_components

#: How files and networks name the vertical component. No network calls a horizontal one V or Z.
_VERTICAL = re.compile(
    r"(?:.*[-_. ])?(?:up|dn|dwn|down|u-?d|ver|vrt|vert|vertical|[HBES][NLGH]Z|[VZ])",
    re.IGNORECASE,
)
#: The part of a file's name that marks a vertical component, with the separator before it.
_UPWARD = re.compile(
    r"(?:^|[-_. ])(?:up|dn|dwn|down|u-?d|vertical|vert|vrt|ver|[HBES][NLGH]Z|[VZ])"
    r"(?=\d?(?:[-_. ]|$))",
    re.IGNORECASE,
)
#: What may stand there in the name of a horizontal one, and is not more of a station's name, as the
#: 0-NS of S10-NS would be after S1: a number goes on as an azimuth only.
_ACROSS = re.compile(r"(?:^|[-_. ]).*|(?:(?<!\d)|(?!\d)|(?=\d{3}(?!\d)))[^-_. ]*")


#: Components of files, by their names.
Components = dict[Path, list[tuple[str, Recording]]]


class Odd(str):
    """Fault of a file in a folder or pattern that is no record: it is reported and left out."""

    __slots__ = ()


def files_of(words: Sequence[str | Path], folder: Path = Path()) -> dict[Path, bool]:
    """The files that `words` select, each once, and whether it was named itself.

    A word is a path, a folder (all files in it) or a pattern such as "RSN1_H*.AT2", in `folder`; or
    the name of a record that comes with the package. A pattern may stand in quotes, so that no
    shell has expanded it. Raises `InputError` where a folder or a pattern holds no file.
    """
    found: dict[Path, bool] = {}
    for word in words:
        path = record_path(str(word), folder)
        if not path.is_dir() and (path.exists() or not any(sign in path.name for sign in "*?[")):
            found[path] = True
            continue
        listed, none = (
            (path.iterdir(), "a folder without files")
            if path.is_dir()
            else (path.parent.glob(path.name), "no such files")
        )
        inside = sorted(one for one in listed if one.is_file() and not one.name.startswith("."))
        if not inside:
            raise InputError(f"{printable(path)}: {none}")
        found |= {one: found.get(one, False) for one in inside}
    return found


def record_path(name: str, folder: Path) -> Path:
    """The file of that name in `folder`, else among the records that come with the package."""
    beside, shipped = folder / name, DATA / "records" / name
    return (
        shipped if not beside.exists() and Path(name).name == name and shipped.exists() else beside
    )


def motions_of(
    paths: Iterable[Path], reading: Reading, *, paired: bool = False
) -> tuple[list[tuple[str, Recording]], list[str]]:
    """The horizontal components of the files with their names, and the names left out.

    Left out are vertical components, by name, and `Odd` files. A component or column that `reading`
    names is taken as horizontal, unless the motions are `paired` with vertical ones. Raises as
    `read_components`, and where all components are vertical.
    """
    named = not paired and (reading.component, reading.column) != (None, None)
    across, upward, faults = _parted(paths, reading, named)
    if faults and not across:
        raise faults[0]
    motions = [one for components in across.values() for one in components]
    left_out = [name for components in upward.values() for name, _ in components]
    if left_out and not motions:
        raise InputError(f"{left_out[0]}: a vertical component, and no horizontal one is given")
    return motions, [*left_out, *map(Odd, faults)]


def _parted(
    paths: Iterable[Path], reading: Reading, named: bool
) -> tuple[Components, Components, list[InputError]]:
    """The horizontal and the vertical components of each file, and the faults of the others.

    All are horizontal if they are `named`.
    """
    read, faults = read_files(paths, reading)
    across, upward = (
        {
            path: [one for one in found if up == (not named and is_vertical(path, one[1]))]
            for path, found in read.items()
        }
        for up in (False, True)
    )
    return across, upward, faults


def read_files(paths: Iterable[Path], reading: Reading) -> tuple[Components, list[InputError]]:
    """The components of each file that can be read, by name, and the faults of the others.

    A component's name is that of its file, with its own name added where the file has several, and
    the folder's where files of two folders have one name. Raises `InputError` for a file that was
    named itself.
    """
    read: Components = {}
    paths = paths if isinstance(paths, Mapping) else dict.fromkeys(paths, True)
    alike = Counter(path.name for path in paths)
    faults: list[InputError] = []
    for path in paths:
        try:
            found = read_components(path, reading)
        except InputError as error:
            if paths[path]:
                raise
            faults.append(error)
        else:
            name = path.name if alike[path.name] == 1 else "/".join(path.parts[-2:])
            read[path] = [
                (f"{name} {one.component}" if len(found) > 1 else name, one) for one in found
            ]
    return read, faults


def verticals_of(paths: Iterable[Path], reading: Reading) -> list[Recording]:
    """The vertical component of each horizontal motion, in the order of `motions_of`.

    It is the one in the same file, else that of the file in the same folder whose name differs only
    in the component, as ELC-UP.AT2 does from ELC180.AT2. Raises `InputError` where there is not
    exactly one, and for a vertical component that belongs to no motion.
    """
    across, upward, _ = _parted(paths, reading, named=False)
    alone = [path for path, components in across.items() if not components]
    sources = {
        path: path if upward[path] else _vertical_file(path, alone)
        for path, components in across.items()
        if components
    }
    ups = {path: upward[source] if source else [] for path, source in sources.items()}
    refuse(
        *(
            (
                len(up) != 1,
                f"{printable(path)}: {len(up)} vertical components in it or in a file of the set"
                " that is named alike: give exactly one",
                "vertical",
            )
            for path, up in ups.items()
        ),
        *(
            (
                path not in sources.values(),
                f"{printable(path)}: a vertical component, and no horizontal one is named alike",
                "vertical",
            )
            for path in alone
        ),
    )
    return [up[0][1] for path, up in ups.items() for _ in across[path]]


def _vertical_file(path: Path, alone: Iterable[Path]) -> Path | None:
    """The file with the vertical component of `path`, or None.

    Its name agrees with that of `path` in most letters around the component. None if several agree
    equally.
    """
    letters = {
        other: _agreement(path.name.lower(), other.name.lower())
        for other in alone
        if other.parent == path.parent
    }
    most = max(letters.values(), default=-1)
    best = [other for other, count in letters.items() if count == most >= 0]
    return best[0] if len(best) == 1 else None


def _agreement(name: str, other: str) -> int:
    """In how many letters around the component of `other` the names agree; -1 where they do not."""
    return max(
        (
            len(other) - len(said[0])
            for said in _UPWARD.finditer(other)
            if name.startswith(other[: said.start()])
            and name.endswith(other[said.end() :])
            and _ACROSS.fullmatch(name, said.start(), len(name) - len(other) + said.end())
        ),
        default=-1,
    )


def is_vertical(path: Path, recording: Recording) -> bool:
    """Whether the component is vertical, by its name; of a table, by the file's name."""
    if recording.form.startswith("K-NET") and recording.component in ("3", "6"):  # of KiK-net
        return True
    channel = "" if recording.form in ("CSV", "table") else recording.component
    return bool(_VERTICAL.fullmatch(channel or path.stem))
