"""Sets of recorded motions: their files, and their horizontal and vertical components."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from rockcheck.scenes.base import DATA
from rockcheck.scenes.errors import InputError, printable
from rockcheck.scenes.recordings import Contradiction, Reading, Recording, read_components

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
#: A vertical channel's code in a file's name, and the name of a channel to the north.
_VERTICAL_CODE = re.compile(r"(?:^|[-_. ])[HBESC][NLGH]Z(?=[-_. ]|$)", re.IGNORECASE)
_AZIMUTH_0 = re.compile(r"(?:0|360) deg", re.IGNORECASE)
#: How many names of files a line about them lists.
_MOST_NAMES = 3
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
            raise InputError(f"{printable(path)}: {none}", file=path)
        found |= {one: found.get(one, False) for one in inside}
    return found


def record_path(name: str, folder: Path) -> Path:
    """The file of that name in `folder`, else among the records that come with the package."""
    beside, shipped = folder / name, DATA / "records" / name
    return (
        shipped if not beside.exists() and Path(name).name == name and shipped.exists() else beside
    )


def motions_of(
    paths: Iterable[Path], reading: Reading
) -> tuple[list[tuple[str, Recording]], list[str]]:
    """The horizontal components of the files with their names, and the names left out.

    Left out are vertical components, by name, and what is `Odd`: files that are no records, and
    borehole channels beside others. A component or column that `reading` names is taken as
    horizontal. Raises as `read_components`, and where all components are vertical.
    """
    is_named = (reading.component, reading.column) != (None, None)
    across, upward, odd = _parted(paths, reading, is_named)
    motions = [motion for components in across.values() for motion in components]
    vertical = [name for components in upward.values() for name, _ in components]
    if vertical and not motions:
        raise InputError(f"{vertical[0]}: a vertical component, and no horizontal one is given")
    return motions, [*vertical, *odd]


def pairs_of(
    paths: Iterable[Path], reading: Reading
) -> tuple[list[tuple[str, Recording, Recording]], list[Odd]]:
    """The horizontal components with their names and their vertical ones, and what is left out.

    The vertical component is the one in the same file, else that of the file in the same folder
    whose name differs only in the component, as ELC-UP.AT2 does from ELC180.AT2. A motion that has
    not exactly one is left out, and so is a vertical component of no motion. Raises `InputError`
    where there is no pair.
    """
    across, upward, odd = _parted(paths, reading, is_named=False)
    alone = [path for path, components in across.items() if not components and upward[path]]
    sources = {
        path: path if upward.get(path) else _vertical_file(path, alone)
        for path, components in across.items()
        if components
    }
    verticals = {path: upward[source] if source else [] for path, source in sources.items()}
    unpaired = _unpaired(verticals, [path for path in alone if path not in sources.values()])
    pairs = _paired(across, verticals)
    if unpaired and not pairs:
        raise InputError(unpaired[0], "vertical")
    return pairs, [*unpaired, *odd]


def _paired(across: Components, verticals: Components) -> list[tuple[str, Recording, Recording]]:
    """Each horizontal component with the vertical one of its file, where there is exactly one."""
    return [
        (name, motion, ups[0][1])
        for path, ups in verticals.items()
        if len(ups) == 1
        for name, motion in across[path]
    ]


def _unpaired(verticals: Components, alone: Iterable[Path]) -> list[Odd]:
    """What is left out of pairs: motions without one vertical component, and those `alone`."""
    motions = [
        Odd(
            f"{printable(path)}: {len(ups)} vertical components in it or in a file of the set that"
            " is named alike: give exactly one"
        )
        for path, ups in verticals.items()
        if len(ups) != 1
    ]
    others = [
        Odd(f"{printable(path)}: a vertical component, and no horizontal one is named alike")
        for path in alone
    ]
    return [*motions, *others]


def _parted(
    paths: Iterable[Path], reading: Reading, is_named: bool
) -> tuple[Components, Components, list[Odd]]:
    """The horizontal and the vertical components of each file, and what is left out.

    All are horizontal if they are `is_named` by the options. Raises the first fault where no file
    has a horizontal component.
    """
    paths = _with_names(paths)
    read, faults = read_files(paths, reading)
    odd = [*map(Odd, faults)]
    for path in _boreholes(paths, read):
        del read[path]
        odd.append(Odd(f"{printable(path)}: a borehole channel; name the file itself to play it"))
    upward = {} if is_named else {path: _verticals(path, found) for path, found in read.items()}
    across = {
        path: [pair for pair in found if is_named or not is_vertical(path, pair[1])]
        for path, found in read.items()
    }
    if faults and not any(across.values()):
        raise faults[0]
    return across, upward, odd


def _boreholes(paths: Mapping[Path, bool], read: Components) -> list[Path]:
    """The files that hold borehole channels beside others, and were not named themselves."""
    below = [path for path, found in read.items() if not paths[path] and _is_borehole(found)]
    return below if len(below) < len(read) else []


def _verticals(path: Path, found: Sequence[tuple[str, Recording]]) -> list[tuple[str, Recording]]:
    return [(name, recording) for name, recording in found if is_vertical(path, recording)]


def _with_names(paths: Iterable[Path]) -> Mapping[Path, bool]:
    """The paths, and whether each was named itself: all, unless `files_of` says otherwise."""
    return paths if isinstance(paths, Mapping) else dict.fromkeys(paths, True)


def read_files(
    paths: Iterable[Path], reading: Reading, *, keep_going: bool = False
) -> tuple[Components, list[InputError]]:
    """The components of each file that can be read, by name, and the faults of the others.

    A component's name is that of its file, with its own name added where the file has several, and
    the folder's where files of two folders have one name. To a file of a folder or pattern the
    options supply what it does not state; what it states holds, and a note says so. Raises
    `InputError` for a file that was named itself, unless it is to `keep_going`.
    """
    read: Components = {}
    paths = _with_names(paths)
    alike = Counter(path.name for path in paths)
    faults: list[InputError] = []
    for path, is_named in paths.items():
        try:
            found = read_components(path, reading) if is_named else _supplied(path, reading)
        except InputError as error:
            if is_named and not keep_going:
                raise
            faults.append(error)
        else:
            name = path.name if alike[path.name] == 1 else "/".join(path.parts[-2:])
            read[path] = _with_component_names(name, found)
    return read, faults


def _with_component_names(name: str, found: list[Recording]) -> list[tuple[str, Recording]]:
    if len(found) == 1:
        return [(name, found[0])]
    return [(f"{name} {recording.component}", recording) for recording in found]


def _supplied(path: Path, reading: Reading) -> list[Recording]:
    """The components of a file, without the options that contradict what it states."""
    notes: list[str] = []
    while True:
        try:
            found = read_components(path, reading)
        except Contradiction as error:
            value = getattr(reading, error.option)
            notes.append(f"the file's {error.option} holds, not {value}, as for the set")
            reading = reading.model_copy(update={error.option: None})
        else:
            return [replace(one, notes=(*one.notes, *notes)) for one in found]


def _is_borehole(found: Sequence[tuple[str, Recording]]) -> bool:
    """Whether the file holds channels down a borehole alone."""
    return all(recording.borehole for _, recording in found)


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
    """Whether the component is vertical, by its name; of a table, by the file's name.

    A channel code in the file's name counts for any format, as an azimuth of 0 may stand for none.
    """
    if recording.form.startswith("K-NET") and recording.component in ("3", "6"):  # of KiK-net
        return True
    channel = "" if recording.form in ("CSV", "table") else recording.component
    if _AZIMUTH_0.fullmatch(channel) and _VERTICAL_CODE.search(path.name):
        return True
    return bool(_VERTICAL.fullmatch(channel or path.stem))


def grouped(odd: Iterable[str]) -> list[str]:
    """A line for each reason for which files are left out, with how many they are and the first."""
    groups: dict[str, list[tuple[str, str]]] = {}
    for message in odd:
        name, _, reason = message.partition(": ")
        name = re.sub(r", line \d+$", "", name)
        groups.setdefault(re.sub(r"\d+", "#", reason), []).append((name, reason))
    return [_group_line(group) for group in groups.values()]


def _group_line(group: Sequence[tuple[str, str]]) -> str:
    names = [name for name, _ in group]
    reason = group[0][1]
    if len(names) == 1:
        return f"{names[0]}: {reason}"
    first = ", ".join(Path(name).name for name in names[:_MOST_NAMES])
    more = ", ..." if len(names) > _MOST_NAMES else ""
    return f"{len(names)} files, {first}{more}: {reason}"
