"""What changed between two finished spectra, or sets of spectra, node by node.

In go two folders, or their `run.json` files; out comes a finding that counts the nodes which end
otherwise. `rockcheck compare` calls it.
"""

from collections.abc import Mapping
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import InputError, printable, reading
from rockcheck.validation.finding import Column, Finding, Table, Verdict, text

#: How a spectrum's CSV file begins; `spectrum_files` writes it.
REMARK = "# rockcheck spectrum "
#: Outcomes by what stands in the file: the side to which the block falls, 0 if it stays.
UNDECIDED = 2
OUTCOMES = {"-1": -1, "0": 0, "1": 1, "": UNDECIDED}
COLUMNS = (
    text("spectrum"),
    Column("nodes"),
    Column("changed"),
    Column("falls_now"),
    Column("stays_now"),
    Column("other_side"),
    Column("undecided", brief=False),
    Column("far", "far off", help="Changed with no other outcome within two nodes before."),
)


@dataclass(frozen=True)
class Grid:
    """A spectrum as its file has it: both axes as they are written, and the outcomes (i, j)."""

    axes: tuple[tuple[str, ...], tuple[str, ...]]
    outcomes: NDArray[np.int8]


@dataclass(frozen=True)
class Change:
    """Counts of the nodes of one spectrum: all, those that end otherwise, and how these end now.

    `undecided` are those that were or are it. `far` counts those with no other outcome near them
    before (`agreement.NEAR`): not a boundary that has moved by a node or two.
    """

    nodes: int
    changed: int
    falls_now: int
    stays_now: int
    other_side: int
    undecided: int
    far: int


def wrote(path: Path) -> bool:
    """Whether the path is a finished study of spectra: a folder or its `run.json`."""
    try:
        data = reading.read_json(_run_file(path))
    except InputError:
        return False
    tables = data.get("tables") if isinstance(data, dict) else None
    return isinstance(tables, dict) and "spectra" in tables


def changes(before: Path, after: Path, share: float) -> Finding:
    """Nodes that end otherwise in the later of two studies, each a folder or its `run.json`.

    Exit code 1 where in any spectrum more than this `share` of the nodes do, or one is missing.
    Raises `InputError` for what is no such study, and where the grids differ.
    """
    old, new = _spectra_of(before), _spectra_of(after)
    both = {name: change_of(old[name], new[name], name) for name in old if name in new}
    missing = [name for name in old if name not in new]
    moved = {name: change for name, change in both.items() if change.changed}
    too_many = [name for name, change in moved.items() if change.changed > share * change.nodes]
    verdict: Verdict = "pass"
    if moved or missing:
        verdict = "fail" if too_many or missing else "changed"
    return Finding(
        "spectrum-changes",
        "Overturning spectra: what changed",
        _answer(both, missing),
        [Table("changes", list(COLUMNS), [[name, *astuple(moved[name])] for name in moved])],
        verdict=verdict,
        exit_code=int(verdict == "fail"),
    )


def change_of(old: Grid, new: Grid, name: str) -> Change:
    """The change of one spectrum. Raises `InputError` where the grids differ."""
    if old.axes != new.axes:
        sizes = " and ".join(f"{len(x)} x {len(y)}" for y, x in (old.axes, new.axes))
        raise InputError(f"{printable(name)}: {sizes} nodes that are not the same: play one grid")
    from rockcheck.ebm.spectrum import vary  # with Numba, which takes half a second to import
    from rockcheck.validation.studies.spectrum.agreement import NEAR

    was, now = old.outcomes, new.outcomes
    changed = was != now
    is_decided = (was != UNDECIDED) & (now != UNDECIDED)
    fell, falls = np.abs(was) == 1, np.abs(now) == 1
    near = vary(np.where(was == UNDECIDED, 0, was).astype(np.int8), 2 * NEAR + 1)
    kinds = (falls & ~fell, fell & ~falls, fell & falls)
    counted = [
        changed,
        *(changed & is_decided & kind for kind in kinds),
        changed & ~is_decided,
        changed & ~near,
    ]
    return Change(was.size, *(int(np.sum(one)) for one in counted))


def _answer(changes: Mapping[str, Change], missing: list[str]) -> str:
    moved = [change for change in changes.values() if change.changed]
    changed, nodes = (
        sum(getattr(change, name) for change in changes.values()) for name in ("changed", "nodes")
    )
    far = sum(change.far for change in moved)
    words = f"{changed} of {nodes} nodes end otherwise"
    if moved:
        words += f", in {len(moved)} of {len(changes)} spectra, {far} of them far from a boundary"
    return words + (f"; missing now: {', '.join(missing)}" if missing else "")


def _run_file(path: Path) -> Path:
    return path / "run.json" if path.is_dir() else path


def _spectra_of(path: Path) -> dict[str, Grid]:
    """The spectra that a study has written, by the names of their files."""
    run_file = _run_file(path)
    data: Any = reading.read_json(run_file)
    files = data.get("files") if isinstance(data, dict) else None
    found = {}
    for name in files if isinstance(files, dict) else ():
        if name.endswith(".csv") and "/" not in name:
            file = reading.within(run_file.parent, name)
            if reading.head_of(file, len(REMARK)) == REMARK:
                found[name.removesuffix(".csv")] = _grid_of(file)
    if not found:
        raise InputError(f"{printable(path)}: no spectra that `rockcheck spectrum` wrote")
    return found


def _grid_of(file: Path) -> Grid:
    _, *lines = reading.read_text(file).splitlines()
    try:
        heading, *rows = (line.split(",") for line in lines)
        outcomes = np.array([[OUTCOMES[cell] for cell in row[1:]] for row in rows], np.int8)
    except (KeyError, ValueError):
        raise InputError(f"{printable(file)}: not a spectrum as rockcheck wrote it") from None
    axes = tuple(row[0] for row in rows), tuple(heading[1:])
    if outcomes.shape != tuple(map(len, axes)) or not outcomes.size:
        raise InputError(f"{printable(file)}: not a spectrum as rockcheck wrote it")
    return Grid(axes, outcomes)
