"""Formats of one component with a header of its own: PEER AT2, ESM (DYNA) and K-NET/KiK-net
ASCII."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from rockcheck.scenes.base import LEAST, MOST
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
    numbers,
    only_for_tables,
    option,
    settled_step,
    settled_unit,
)

AT2_HEADER = re.compile(rf"NPTS\s*+=\s*+(\d++)\s*+(?:,\s*+)?DT\s*+=\s*+({NUMBER})", re.IGNORECASE)
AT2_HEADER_PLAIN = re.compile(rf"^\s*+(\d++)\s++({NUMBER})\s++NPTS\s*+(?:,\s*+)?DT", re.IGNORECASE)
_UNITS = re.compile(
    r"UNITS?(?:\s++|\s*+:\s*+)(?:(?:OF|IN|ARE|:)\s*+)?\(?([A-Z0-9^*'²]++(?:\s*+/\s*+[A-Z0-9^*²]++)*+)",
    re.IGNORECASE,
)
_ESM_LINE = re.compile(r"([A-Z][A-Z0-9_^/]*+)\s*+:(.*+)")
_KNET_SCALE = re.compile(rf"({NUMBER})\s*+\(gal\)\s*+/\s*+({NUMBER})", re.IGNORECASE)
_KNET_RATE = re.compile(rf"({NUMBER})\s*+(?:Hz)?", re.IGNORECASE)


def read_at2(path: Path, lines: list[str], reading: Reading) -> Recording:
    """PEER: header lines, one of which says the units and one NPTS and DT, then accelerations in
    g."""
    only_for_tables(path, reading, "a PEER file")
    header = match = None
    for index, line in enumerate(lines[:20]):
        if match := AT2_HEADER.search(line) or AT2_HEADER_PLAIN.search(line):
            header = index
            break
    if header is None or match is None:
        raise fault(path, "no header line with NPTS and DT within the first 20 lines")
    stated = next(
        filter(
            None,
            (known_unit(word) for line in lines[: header + 1] for word in _UNITS.findall(line)),
        ),
        "",
    )
    if not stated and reading.unit is None:
        raise fault(
            path,
            "no header line that states UNITS OF G or another; give the unit:"
            f" {option('unit', 'cm/s2')}",
        )
    unit = settled_unit(path, stated, reading)
    count = checked_count(path, header + 1, "NPTS", match[1])
    step = settled_step(path, checked_step(path, header + 1, "DT", match[2]), reading)
    values = numbers(path, enumerate(lines[header + 1 :], header + 2), count)
    if len(values) != count:
        raise fault(path, f"NPTS says {count}, the file has {len(values)} samples", header + 1)
    return Recording(
        samples=np.array(values) * UNITS[unit],
        time_step=step,
        unit=unit,
        form="PEER AT2",
        component=_at2_component(lines),
    )


def _at2_component(lines: list[str]) -> str:
    """What the second line ends in: event, date, station, component; "" where it is another
    line."""
    fields = lines[1].split(",") if len(lines) > 1 else []
    name = fields[-1].strip()[:10] if len(fields) > 2 else ""
    return printable(name) if re.fullmatch(r"[0-9A-Za-z-]{1,6}", name) else ""


def read_esm(path: Path, lines: list[str], reading: Reading) -> Recording:
    """ESM (DYNA 1.2): lines of KEY: value, then one acceleration a line."""
    only_for_tables(path, reading, "an ESM file")
    header: dict[str, tuple[int, str]] = {}
    first = len(lines)
    for n, line in enumerate(lines, 1):
        if not (match := _ESM_LINE.match(line)):
            first = n
            break
        header[match[1]] = n, match[2].strip()

    def stated(key: str) -> tuple[int, str]:
        if not header.get(key, (0, ""))[1]:
            raise fault(path, f"no header line that states {key}")
        return header[key]

    kind = header.get("DATA_TYPE", (0, "ACCELERATION"))
    if kind[1].upper() != "ACCELERATION":
        raise fault(
            path, f"DATA_TYPE {printable(kind[1], 30)!r}; only ACCELERATION can be read", kind[0]
        )
    place, count_word = stated("NDATA")
    if not re.fullmatch(r"[0-9]++", count_word):
        raise fault(path, f"NDATA {printable(count_word, 30)!r} is not a count", place)
    count = checked_count(path, place, "NDATA", count_word)
    step_line, step_word = stated("SAMPLING_INTERVAL_S")
    step = settled_step(
        path, checked_step(path, step_line, "SAMPLING_INTERVAL_S", step_word), reading
    )
    units = header.get("UNITS", (0, ""))
    unit = settled_unit(path, known_unit(units[1]), reading)
    values = numbers(path, enumerate(lines[first - 1 :], first))
    if len(values) != count:
        raise fault(path, f"NDATA says {count}, the file has {len(values)} samples", place)
    stream = printable(header.get("STREAM", (0, ""))[1], 30)
    return Recording(
        samples=np.array(values) * UNITS[unit],
        time_step=step,
        unit=unit,
        form="ESM ASCII",
        component=stream,
    )


def read_knet(path: Path, lines: list[str], reading: Reading) -> Recording:
    """K-NET and KiK-net: 17 header lines with their names in the first 18 columns, then counts of
    the digitiser.

    The counts have an offset: their mean is taken out, as it is for the Max. Acc. that such a file
    states.
    """
    only_for_tables(path, reading, "a K-NET file")
    header: dict[str, tuple[int, str]] = {}
    for n, line in enumerate(lines[:40], 1):
        header[line[:18].strip()] = n, line[18:].strip()
        if line.startswith("Memo"):
            break
    else:
        raise fault(path, "no header line Memo. within the first 40 lines")
    scale = _KNET_SCALE.match(header.get("Scale Factor", (0, ""))[1])
    rate = _KNET_RATE.match(header.get("Sampling Freq(Hz)", (0, ""))[1])
    if not scale or not rate:
        raise fault(
            path,
            f"no header line that states {'Sampling Freq(Hz)' if scale else 'Scale Factor in gal'}",
        )
    place = header["Scale Factor"][0]
    factor, counts = number(path, place, scale[1]), number(path, place, scale[2])
    if counts == 0.0 or not LEAST <= abs(factor / counts) <= MOST:
        raise fault(path, f"Scale Factor {printable(scale[0], 40)} is not usable", place)
    hertz = checked_step(path, header["Sampling Freq(Hz)"][0], "Sampling Freq(Hz)", rate[1])
    values = np.array(numbers(path, enumerate(lines[n:], n + 1)))
    _check_duration(path, header.get("Duration Time(s)"), hertz, len(values))
    unit = settled_unit(path, "gal", reading)
    samples = values * (factor / counts * UNITS[unit])
    mean = float(np.mean(samples))
    step = settled_step(path, 1.0 / hertz, reading)
    found = Recording(
        samples=samples - mean,
        time_step=step,
        unit=unit,
        form="K-NET ASCII",
        component=printable(header.get("Dir.", (0, ""))[1], 30),
    )
    return found.noted(
        f"the mean, {mean / UNITS[unit]:.4g} gal, is taken out: the offset of the digitiser"
    )


def _check_duration(path: Path, stated: tuple[int, str] | None, hertz: float, found: int) -> None:
    if not found:
        raise fault(path, "no samples after the line Memo.")
    if stated:
        expected = number(path, stated[0], stated[1]) * hertz
        if abs(expected - found) > 0.5:
            raise fault(
                path,
                f"Duration Time(s) {stated[1]} is {expected:.10g} samples, the file has {found}",
                stated[0],
            )
