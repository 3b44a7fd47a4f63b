"""V2 files of strong-motion networks: COSMOS 1.20 and the older one of CSMIP (CDMG), of one or
several channels.

Numbers stand in fields of the width that the file states, and may touch. Only the blocks of
acceleration are read. Source: COSMOS Strong Motion Data Format, version 1.20 (2001): integer header
54 is the azimuth, real header 62 the time step of these samples in ms, and 34 that of the raw
record in s, which counts only where 62 is not known.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rockcheck.scenes.errors import printable
from rockcheck.scenes.recordings.recording import (
    NUMBER,
    UNITS,
    Reading,
    Recording,
    checked_count,
    checked_step,
    fault,
    known_unit,
    number,
    only_for_tables,
    settled_step,
    settled_unit,
)

#: How many characters of a line may be a header.
_WIDE = 160
_FORMAT = r"\(?\s*+(\d{1,3})[FEI](\d{1,3})(?:\.\d++)?"
COSMOS_BLOCK = re.compile(
    rf"\s*+(\d++)\s++(?:[a-z]++\.?\s++)?accel[a-z]*+\.?\s++pts\b[^=\d]*+(\d++)?[^=]*+=\s*+([^,(]*+)(?:\((\d++)\))?[^=]*+=\s*+{_FORMAT}",
    re.IGNORECASE,
)
CSMIP_BLOCK = re.compile(
    rf"\s*+(\d++)\s++points\s++of\s++accel\s++data\s++equally\s++spaced\s++at\s*+({NUMBER})\s*+sec",
    re.IGNORECASE,
)
_HEADER = re.compile(
    rf"\s*+(\d++)\s++(integer|real)-header\s++values\s++follow\s++on\s++(\d++)\s++lines[^=]*+=\s*+{_FORMAT}",
    re.IGNORECASE,
)
_CSMIP_FORMAT = re.compile(_FORMAT.replace(r"\(?", r"\("), re.IGNORECASE)
_CSMIP_UNIT = re.compile(r"\b(?:in\s++|units\s*+:\s*+)([a-z/0-9^]++)", re.IGNORECASE)
_CHANNEL = re.compile(r"\bChan\s*+(\d++):\s*+([A-Za-z0-9]++(?: Deg\b)?)", re.IGNORECASE)
_COSMOS_UNITS = {"2": "g", "02": "g", "4": "cm/s2", "04": "cm/s2"}
_UP = {400: "up", 401: "down"}


@dataclass
class _Channel:
    """What the headers have said so far of the next block of accelerations."""

    name: str = ""
    step: tuple[int, float] | None = None


def is_volume(line: str) -> bool:
    """Whether this line can only stand in a V2 file."""
    return bool(
        _HEADER.match(line[:_WIDE])
        or CSMIP_BLOCK.match(line[:_WIDE])
        or re.search(r"\(Format v0*1\.\d", line[:_WIDE], re.IGNORECASE)
    )


def read_volume(path: Path, lines: list[str], reading: Reading) -> list[Recording]:
    """Every block of acceleration, in the file's order."""
    only_for_tables(path, reading, "a V2 file")
    found: list[Recording] = []
    channel, index = _Channel(), 0
    while index < len(lines):
        line = lines[index][:_WIDE]
        index += 1
        if header := _HEADER.match(line):
            index = _heed(path, lines, index, header, channel)
        elif block := COSMOS_BLOCK.match(line):
            if channel.step is None:
                raise fault(path, "no real header before this block states the time step", index)
            stated = known_unit(block[3]) or _COSMOS_UNITS.get(block[4] or "", "")
            found.append(
                _recording(
                    path,
                    lines,
                    index,
                    block[1],
                    channel.step,
                    stated,
                    (block[5], block[6]),
                    channel.name,
                    reading,
                )
            )
            _check_seconds(path, index, block[2], found[-1])
            channel, index = _Channel(), index + _height(int(block[1][:12]), int(block[5]))
        elif block := CSMIP_BLOCK.match(line):
            rest = line[block.end() :]
            shape, unit = _CSMIP_FORMAT.search(rest), _CSMIP_UNIT.search(rest)
            fields = (shape[1], shape[2]) if shape else ("8", "10")
            stated = known_unit(unit[1]) if unit else ""
            found.append(
                _recording(
                    path,
                    lines,
                    index,
                    block[1],
                    (index, number(path, index, block[2])),
                    stated,
                    fields,
                    channel.name,
                    reading,
                )
            )
            channel, index = _Channel(), index + _height(int(block[1][:12]), int(fields[0]))
        elif named := _CHANNEL.search(line):
            channel.name = named[2]
    if not found:
        raise fault(
            path,
            "a V2 file without a block of accelerations; only corrected accelerations can be read",
        )
    return found


def _height(count: int, across: int) -> int:
    """Lines of so many numbers."""
    return -(-count // max(across, 1))


def _heed(
    path: Path, lines: list[str], index: int, header: re.Match[str], channel: _Channel
) -> int:
    """Takes direction and time step from a block of header values; returns the line after it."""
    across, width = int(header[4]), int(header[5])
    rows = min(int(header[3][:6]), len(lines) - index)

    def word(place: int) -> tuple[int, str]:
        row, column = divmod(place - 1, across)
        return index + row + 1, lines[index + row][
            column * width : (column + 1) * width
        ].strip() if row < rows else ""

    if header[2].lower() == "integer":
        if re.fullmatch(r"[0-9]{1,3}", word(54)[1]):
            degrees = int(word(54)[1])
            channel.name = _UP.get(degrees, f"{degrees} deg" if degrees <= 360 else channel.name)
    else:
        for place, seconds in ((62, 1e-3), (34, 1.0)):
            n, text = word(place)
            if text and (value := number(path, n, text)) > 0.0:
                channel.step = n, float(f"{value * seconds:.12g}")
                break
    return index + rows


def _recording(
    path: Path,
    lines: list[str],
    index: int,
    count_word: str,
    step: tuple[int, float],
    stated: str,
    fields: tuple[str, str],
    name: str,
    reading: Reading,
) -> Recording:
    count = checked_count(path, index, "the count of points", count_word)
    across, width = int(fields[0]), int(fields[1])
    if across < 1 or width < 1:
        raise fault(path, "a format without fields", index)
    seconds = settled_step(
        path, checked_step(path, step[0], "the time step", f"{step[1]!r}"), reading
    )
    unit = settled_unit(path, stated, reading)
    values: list[float] = []
    for n, line in enumerate(lines[index : index + _height(count, across)], index + 1):
        here = min(across, count - len(values))
        words = [line[k * width : (k + 1) * width].strip() for k in range(here)]
        if "" in words:
            break
        values += [number(path, n, word) for word in words]
    if len(values) != count:
        raise fault(
            path,
            f"the header says {count} points of acceleration, the block has {len(values)}",
            index,
        )
    return Recording(
        samples=np.array(values) * UNITS[unit],
        time_step=seconds,
        unit=unit,
        form="V2",
        component=printable(name, 30),
    )


def _check_seconds(path: Path, index: int, stated: str | None, record: Recording) -> None:
    """The whole seconds that a block states must be those of its samples: a time step of another
    record would be a silent fault."""
    length = len(record.samples) * record.time_step
    if stated and abs(length - int(stated[:9])) > 1.0 + 0.01 * length:
        raise fault(
            path,
            f"{len(record.samples)} points every {record.time_step:g} s are {length:.6g} s, not"
            f" {stated[:9]} secs",
            index,
        )
