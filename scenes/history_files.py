"""The files of a history: a table of its motion below its metadata, and a table of its events.

In, to write: metadata, channels and events. Out, when read: `Contents`, in SI units. Called by
`History`; any other CSV with columns of t and theta is read, too.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, FiniteFloat

from rockcheck.scenes import tables
from rockcheck.scenes.base import MOST, Floats, Frozen, NonNegative, Positive
from rockcheck.scenes.block import Block
from rockcheck.scenes.columns import COLUMNS, meanings_of
from rockcheck.scenes.errors import InputError, printable
from rockcheck.scenes.events import EVENT_COLUMNS, Event, event_table
from rockcheck.scenes.reading import read_table
from rockcheck.scenes.writing import columns_text, write_together

if TYPE_CHECKING:
    import pandas as pd

#: The first line of a CSV; those below it give the metadata, a key a line as JSON.
HEAD = "rockcheck history: its metadata, a key a line; pandas.read_csv(FILE, comment='#')"
#: Files of rockcheck 0.1 before November 2026 hold the metadata in the first row of this column.
OLDER_HEAD = "rockcheck_history"
#: The columns of events that hold words: any text is a kind or a mode, also "None" and "hit #2".
WORDS = ("kind", "mode_before", "mode_after")
#: Endings of files of other kinds that may hold a history; no text is read from them.
NOT_READ = (".json", ".mat", ".parquet")
#: Metadata of the block; `_MASS` of one that is not homogeneous.
_SIZES, _MASS = ("half_width", "half_height"), ("centre_of_mass", "moment_of_inertia")
#: How other programs may name the columns that are needed.
_EXAMPLES = {"t": "'Time (s)' or t_ms", "theta": "'Rotation (deg)' or theta_mrad"}


class Metadata(Frozen):
    """What `write` writes above the table; all of it may be missing in another program's file."""

    model_config = ConfigDict(extra="ignore")
    name: Any = None
    model: Any = "measured"
    outcome: Any = None
    half_width: Positive | None = None
    half_height: Positive | None = None
    centre_of_mass: Any = None
    moment_of_inertia: Any = None
    settings: Mapping[str, Any] = {}
    notes: tuple[Any, ...] = ()
    uncertainty: Mapping[str, NonNegative] = {}
    cost: Mapping[str, int | FiniteFloat | Mapping[str, Any] | None] = {}
    extremes: Any = None


@dataclass(frozen=True)
class Contents:
    """What the files of a history hold; `block` is None where they do not give both its sizes.

    `converted`: a column had another unit, so that the metadata are not of this table.
    """

    metadata: Metadata
    block: Block | None
    channels: Mapping[str, NDArray[Any]]
    events: tuple[Event, ...]
    converted: bool


# Writing


def check_format(path: Path, more: str = "") -> None:
    """Raise `InputError` if no history can be written into a file of that name.

    A name without an ending, such as /dev/stdout, is allowed. The message ends with `more` that is
    allowed.
    """
    is_packed = path.name.lower().endswith(".csv.gz")
    if path.suffix.lower() not in ("", ".csv") and not is_packed:
        raise InputError(
            f"{printable(path)}: a history is written as .csv or .csv.gz,"
            f" not as {printable(path.suffix)}{more}"
        )


def write(
    path: Path,
    metadata: Mapping[str, Any],
    channels: Mapping[str, NDArray[Any]],
    events: Sequence[Event],
) -> None:
    """Write the table of a history, and beside it that of its events.

    Both are written whole, or none is touched. Raises as `History.save`.
    """
    check_format(path)
    motion_table: str | bytes
    events_table: str | bytes
    if path.suffix.lower() == ".gz":
        motion_table, events_table = packed(metadata, channels, events)
    else:
        motion_table = _motion_text(metadata, channels)
        events_table = columns_text(event_table(events))
    contents = {path: motion_table}
    if path.is_file() or not path.exists():  # nothing is written beside /dev/stdout
        contents = {events_path(path): events_table, path: motion_table}
    write_together(contents, named=True)


def packed(
    metadata: Mapping[str, Any], channels: Mapping[str, NDArray[Any]], events: Sequence[Event]
) -> tuple[bytes, bytes]:
    """The table of a history and that of its events, compressed: ".csv.gz", ".events.csv.gz"."""
    motion_text = _motion_text(metadata, channels)
    return _compressed(motion_text), _compressed(columns_text(event_table(events)))


def _compressed(text: str) -> bytes:
    # The same text gives the same bytes. Digits of floats hardly repeat: level 4 saves 12 %
    # more in three times the time.
    return gzip.compress(text.encode(), compresslevel=2, mtime=0)


def _motion_text(metadata: Mapping[str, Any], channels: Mapping[str, NDArray[Any]]) -> str:
    lines = [f"# {HEAD}\n"]
    for key, value in sorted(metadata.items()):
        lines.append(f"# {key}: {json.dumps(value, sort_keys=True, default=str)}\n")
    columns = {name: np.asarray(channels[name]).tolist() for name in COLUMNS if name in channels}
    return "".join(lines) + columns_text(columns)


def events_path(path: Path) -> Path:
    """The file of the events beside a history's CSV; it is compressed if the CSV is."""
    packing = path.suffix if path.name.lower().endswith(".csv.gz") else ""
    return path.with_name(f"{Path(path.name.removesuffix(packing)).stem}.events.csv{packing}")


def block_metadata(block: Block | None) -> dict[str, Any]:
    """The sizes of a block, None where it is unknown, and what it has if it is not homogeneous."""
    sizes = {name: getattr(block, name, None) for name in _SIZES}
    mass = {name: getattr(block, name, None) for name in _MASS}
    return sizes | {name: value for name, value in mass.items() if value}


# Reading


def read(path: Path) -> Contents:
    """The contents of a history's files. Raises as `History.load`."""
    shown = printable(path)
    ending = path.suffix.lower()
    if ending in NOT_READ:
        raise InputError(f"{shown}: a history is read from .csv or .csv.gz, not from {ending}")
    table = tables.read(path)
    beside = events_path(path)
    event_rows = _read_event_rows(beside)
    metadata = _metadata(table, shown)
    block = _block(metadata, shown)
    channels, converted = _channels(table, shown)
    return Contents(metadata, block, channels, _events(event_rows, beside), converted)


def _read_event_rows(path: Path) -> pd.DataFrame:
    """The rows of a table of events; none without a file."""
    import pandas as pd

    if not path.exists():
        return pd.DataFrame()
    words = dict.fromkeys(WORDS, str)
    return read_table(path, dtype=words, keep_default_na=False, comment=None)


def _events(rows: pd.DataFrame, path: Path) -> tuple[Event, ...]:
    try:
        rows = rows.reindex(columns=EVENT_COLUMNS, fill_value="")
        events = tuple(
            Event(
                t=float(t),
                kind=kind,
                mode_before=mode_before,
                mode_after=mode_after,
                impulse=float(impulse or 0.0),
            )
            for t, kind, mode_before, mode_after, impulse in rows.itertuples(index=False)
        )
        np.asarray_chkfinite([(event.t, event.impulse) for event in events])
    except (AttributeError, TypeError, ValueError):
        raise InputError(f"{printable(path)}: not an events table written by rockcheck") from None
    return events


def _metadata(table: tables.Table, shown: str) -> Metadata:
    try:
        return Metadata(**_stored_metadata(table))
    except InputError as error:
        raise InputError(f"{shown}: metadata: {error}") from None
    except (TypeError, ValueError, RecursionError):
        raise InputError(f"{shown}: metadata: not written by rockcheck") from None


def _stored_metadata(table: tables.Table) -> dict[str, Any]:
    """What is written above a table, or in the first row of a column of an older file."""
    if table.remarks[:1] == [HEAD]:
        pairs = [remark.partition(": ") for remark in table.remarks[1:]]
        return {key: json.loads(value) for key, _, value in pairs}
    if OLDER_HEAD in table.names and len(table.frame):
        older: dict[str, Any] = json.loads(table.frame[table.names.index(OLDER_HEAD)].iloc[0])
        return older
    return {}


def _block(metadata: Metadata, shown: str) -> Block | None:
    """The block of a table where both of its sizes are known."""
    sizes = {name: getattr(metadata, name) for name in (*_SIZES, *_MASS)}
    size_unknown = metadata.half_width is None or metadata.half_height is None
    mass_unknown = metadata.centre_of_mass is None and metadata.moment_of_inertia is None
    if size_unknown and mass_unknown:
        return None
    try:
        return Block(**sizes)
    except InputError as error:
        raise InputError(f"{shown}: metadata: {error}") from None
    except (TypeError, ValueError, RecursionError):
        raise InputError(f"{shown}: metadata: not written by rockcheck") from None


def _channels(table: tables.Table, shown: str) -> tuple[dict[str, NDArray[Any]], bool]:
    """The channels of a table in SI units, and whether any had another unit."""
    try:
        columns = meanings_of(table.names, table.units)
    except InputError as error:
        raise InputError(f"{shown}: {error}") from None
    for name in ("t", "theta"):
        if name not in columns:
            raise InputError(
                f"{shown}: no column {name!r}, or with a unit as in {_EXAMPLES[name]}; t and theta"
                f" are needed, of {', '.join(COLUMNS)}"
            )
    if len(table.frame) == 0:
        raise InputError(f"{shown}: no rows")
    channels: dict[str, NDArray[Any]] = {}
    for name in COLUMNS:
        if name not in columns:
            continue
        index, factor = columns[name]
        column = table.frame[index]
        if name == "mode":
            channels[name] = column.astype(str).to_numpy()
        else:
            channels[name] = factor * _numbers(column.rename(table.names[index]), shown)
    if np.any(np.diff(channels["t"]) <= 0.0):
        raise InputError(f"{shown}: column 't' does not increase")
    return channels, any(factor != 1.0 for _, factor in columns.values())


def _numbers(column: pd.Series[Any], shown: str) -> Floats:
    import pandas as pd

    words = column.astype(str) if column.dtype == bool else column  # True is no number
    try:
        values = pd.to_numeric(words).to_numpy(dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{shown}: column {column.name!r} is not numeric") from None
    bad = np.flatnonzero(~(np.abs(values) <= MOST))
    if bad.size:
        value = values[bad[0]]
        why = f"larger than {MOST:g}" if np.isfinite(value) else "not finite"
        raise InputError(f"{shown}: column {column.name!r}, row {bad[0] + 1}: {value} is {why}")
    return values
