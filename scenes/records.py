"""Strict readers of recorded ground motions: PEER .AT2 and CSV."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes.errors import InputError, printable
from rockcheck.scenes.reading import read_text

GRAVITY_OF_RECORDS = 9.80665  # m/s^2, the unit "g" of record files (standard gravity)
MOST_SAMPLES = 10_000_000

# Whatever repeats is possessive: what does not match ends after one pass, however long the line.
_NUMBER = r"[-+]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eEdD][-+]?\d++)?"
_HEADER_NAMED = re.compile(rf"NPTS\s*+=\s*+(\d++)\s*+(?:,\s*+)?DT\s*+=\s*+({_NUMBER})", re.IGNORECASE)
_HEADER_PLAIN = re.compile(rf"^\s*+(\d++)\s++({_NUMBER})\s++NPTS\s*+(?:,\s*+)?DT", re.IGNORECASE)
_UNITS_G = re.compile(r"UNITS?\s++(?:(?:OF|IN|ARE|:)\s*+)?\(?G(?:'?S)?\b", re.IGNORECASE)
_UNIT_FACTORS = {"acceleration_g": GRAVITY_OF_RECORDS, "acceleration_m_s2": 1.0}


def read_record(path: Path) -> tuple[NDArray[np.float64], float]:
    """Samples in m/s^2 and their time step in s, from a PEER .AT2 or a CSV file.

    Raises `InputError`, naming the file and the line, when the file is missing, has another format, a wrong count,
    no stated units, a time step that is not positive or not uniform, or a value that is not finite.
    """
    readers = {".at2": _read_at2, ".csv": _read_csv}
    if path.suffix.lower() not in readers:
        raise InputError(f"{printable(path)}: not a record file; a .AT2 or .csv file is asked for")
    return readers[path.suffix.lower()](path, read_text(path))


def _number(path: Path, line: int, word: str) -> float:
    if not re.fullmatch(_NUMBER, word):
        raise InputError(f"{printable(path)}, line {line}: {printable(word, 30)!r} is not a finite number")
    value = float(word.translate(str.maketrans("dD", "ee")))
    if not math.isfinite(value):
        raise InputError(f"{printable(path)}, line {line}: {printable(word, 30)!r} is not a finite number")
    return value


def _read_at2(path: Path, text: str) -> tuple[NDArray[np.float64], float]:
    """PEER format: header lines, one of which says the units and one NPTS and DT, then accelerations in g."""
    lines = text.splitlines()
    header = None
    for index, line in enumerate(lines[:20]):
        if match := _HEADER_NAMED.search(line) or _HEADER_PLAIN.search(line):
            header = index
            break
    if header is None or match is None:
        raise InputError(f"{printable(path)}: no header line with NPTS and DT within the first 20 lines")
    if not any(_UNITS_G.search(line) for line in lines[: header + 1]):
        raise InputError(f"{printable(path)}: no header line that states UNITS OF G")
    expected = int(match[1][:12])
    time_step = _number(path, header + 1, match[2])
    if time_step <= 0.0:
        raise InputError(f"{printable(path)}, line {header + 1}: DT {match[2]} is not positive")
    if not 1 <= expected <= MOST_SAMPLES:
        raise InputError(f"{printable(path)}, line {header + 1}: NPTS {match[1][:20]} is not in 1..{MOST_SAMPLES}")
    values = [_number(path, n, word) for n, line in enumerate(lines[header + 1 :], header + 2) for word in line.split()]
    if len(values) != expected:
        raise InputError(f"{printable(path)}, line {header + 1}: NPTS says {expected}, the file has {len(values)} samples")
    return np.array(values) * GRAVITY_OF_RECORDS, time_step


def _words(path: Path, number: int, line: str) -> list[str]:
    try:
        return [word.strip() for word in next(csv.reader([line]))]
    except csv.Error as error:
        raise InputError(f"{printable(path)}, line {number}: not a line of a CSV table: {printable(error)}") from None


def _read_csv(path: Path, text: str) -> tuple[NDArray[np.float64], float]:
    """CSV with a header line naming `time_s` and one of the acceleration columns; lines that start with # are remarks."""
    numbered = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not numbered:
        raise InputError(f"{printable(path)}: empty")
    names = _words(path, *numbered[0])
    units = [name for name in _UNIT_FACTORS if name in names]
    if "time_s" not in names or len(units) != 1:
        raise InputError(
            f"{printable(path)}, line {numbered[0][0]}: columns {printable(', '.join(names))!r};"
            f" time_s and exactly one of {', '.join(_UNIT_FACTORS)} are asked for"
        )
    columns = names.index("time_s"), names.index(units[0])
    times, values, places = [], [], []
    for n, line in numbered[1:]:
        words = _words(path, n, line)
        if len(words) != len(names):
            raise InputError(f"{printable(path)}, line {n}: {len(words)} fields where the header names {len(names)}")
        times.append(_number(path, n, words[columns[0]]))
        values.append(_number(path, n, words[columns[1]]))
        places.append(n)
    if len(values) < 2:
        raise InputError(f"{printable(path)}: {len(values)} sample(s); at least 2 are needed to know the time step")
    time = np.array(times)
    step = (time[-1] - time[0]) / (len(time) - 1)
    if abs(time[0]) > 1e-9:
        raise InputError(f"{printable(path)}, line {places[0]}: the first time is {times[0]:g} s, not 0")
    if not step > 0.0:
        raise InputError(f"{printable(path)}: time_s does not increase")
    # Times are usually printed with a few decimals: allow their rounding, nothing more.
    uneven = np.flatnonzero(np.abs(time - step * np.arange(len(time))) > 0.01 * step + 1e-9)
    if uneven.size:
        raise InputError(f"{printable(path)}, line {places[uneven[0]]}: time {times[uneven[0]]:g} s is off the uniform step {step:.6g} s")
    return np.array(values) * _UNIT_FACTORS[units[0]], float(f"{step:.12g}")
