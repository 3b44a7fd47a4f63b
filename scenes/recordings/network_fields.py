"""Files in fixed fields of GeoNet (New Zealand) and of the USGS (SMC)."""

import re

from rockcheck.scenes.base import MOST
from rockcheck.scenes.recordings.network_lines import WIDE, fields, first_match
from rockcheck.scenes.recordings.recording import (
    NUMBER,
    Reading,
    Recording,
    checked_count,
    checked_step,
    fault,
    number,
)
from rockcheck.scenes.recordings.stated import Fact, Stated, recording_of

_GEONET = re.compile(r"\s*+(un)?corrected accelerogram\b.*GNS Science", re.IGNORECASE)
_GEONET_INTERVAL = re.compile(
    rf"units of\s*+({NUMBER})\s*+mm/s/s\s++at intervals of\s*+({NUMBER})\s*+s", re.IGNORECASE
)
_GEONET_PEAK = re.compile(rf"Acceleration:\s*+Peak\s*+({NUMBER})\s*+mm/s/s", re.IGNORECASE)
_GEONET_TEXT, _GEONET_REALS, _GEONET_ACROSS, _GEONET_WIDTH = 16, 10, 10, 8

_SMC = re.compile(
    r"\s*+([1-6])\s++(?:UN)?CORRECTED\s++ACCELEROGRAM|\s*+[1-6]\s++(VELOCITY|DISPLACEMENT)"
)
_SMC_TEXT, _SMC_REALS = 11, 10


def is_geonet(lines: list[str]) -> bool:
    """Whether these lines begin a GeoNet file."""
    return bool(_GEONET.match(lines[0]))


def is_smc(lines: list[str]) -> bool:
    """Whether these lines begin a SMC file."""
    return bool(_SMC.match(lines[0])) and len(lines) > _SMC_TEXT and "*" in lines[_SMC_TEXT - 1]


def read_geonet(lines: list[str], reading: Reading) -> list[Recording]:
    """GeoNet V1A and V2A: blocks of 16 lines of text, 10 of numbers, and the samples."""
    last = max(n for n, line in enumerate(lines) if line.strip())
    recordings = []
    index = 0
    while index <= last:
        recording, index = _geonet_channel(lines[: last + 1], index, reading)
        recordings.append(recording)
    return recordings


def _geonet_channel(lines: list[str], index: int, reading: Reading) -> tuple[Recording, int]:
    kind = _GEONET.match(lines[index][:WIDE])
    if kind is None:
        raise fault("no line that begins a channel: other samples than the header says", index + 1)
    reals_at = index + _GEONET_TEXT
    data_at = reals_at + _GEONET_REALS
    if data_at >= len(lines):
        raise fault("the file ends within a header", len(lines))
    reals = [_geonet_reals(lines, n) for n in range(reals_at, data_at)]
    text = [(n + 1, lines[n][:WIDE]) for n in range(index, reals_at)]
    counts_line = reals_at + 4
    if kind[1]:
        step_line, match = first_match(text, _GEONET_INTERVAL)
        if match is None:
            raise fault("no line that states at intervals of", index + 1)
        step = checked_step(step_line, "at intervals of", match[2])
        scale = number(step_line, match[1])
        counts = [int(reals[3][0])]
    else:
        step_line, step, scale = reals_at + 7, reals[6][5], 1.0
        counts = [int(value) for value in reals[3][3:6]]
        step = checked_step(step_line, "the time step", f"{step!r}")
    if scale != 1.0:
        raise fault(f"units of {scale:g} mm/s/s; only those of 1 mm/s/s can be read", step_line)
    count = checked_count(counts_line, "the count of samples", str(counts[0]))
    values, end = fields(lines, data_at, count, across=_GEONET_ACROSS, width=_GEONET_WIDTH)
    for size in counts[1:]:
        end += -(-size // _GEONET_ACROSS)
    if end > len(lines):
        raise fault("the file ends before the last line that its header states", len(lines))
    peak_line, peak = first_match(text, _GEONET_PEAK)
    component = lines[index + 12].split()[1:2]
    stated = Stated(
        count=Fact(count, "the header", counts_line),
        time_step=Fact(step, "the header", step_line),
        unit=Fact("mm/s2", "the header", index + 1),
        peak=Fact(number(peak_line, peak[1]) * 1e-3, "Peak", peak_line) if peak else None,
    )
    name = component[0][:30] if component else ""
    return recording_of(values, stated, reading, form="GeoNet", component=name), end


def _geonet_reals(lines: list[str], index: int) -> list[float]:
    values = [number(index + 1, word) for word in lines[index].split()]
    if len(values) != _GEONET_ACROSS:
        raise fault(f"{len(values)} header values, not {_GEONET_ACROSS}", index + 1)
    if any(abs(value) > MOST for value in values):
        raise fault("a header value is too large", index + 1)
    return values


def read_smc(lines: list[str], reading: Reading) -> list[Recording]:
    """SMC of the USGS: 11 lines of text, 48 integers, 50 reals, comments, samples in cm/s^2."""
    kind = _SMC.match(lines[0][:WIDE])
    if kind is None or kind[2]:
        raise fault("only accelerations can be read", 1)
    integers, index = fields(lines, _SMC_TEXT, 48, across=8, width=10)
    # What is not known is 1.7e38 there, and no number for a reader of samples.
    rate_line = index + 1
    rate = checked_step(rate_line, "the sampling rate", lines[index][15:30].strip())
    index += _SMC_REALS
    comments = int(integers[15])
    if not 0 <= comments <= len(lines):
        raise fault(f"{comments} comment lines", _SMC_TEXT + 2)
    for n in range(index, min(index + comments, len(lines))):
        if not lines[n].startswith("|"):
            raise fault("a comment line that does not begin with |", n + 1)
    index += comments
    count = checked_count(_SMC_TEXT + 3, "the count of samples", f"{integers[16]:.0f}".strip("-"))
    values, end = fields(lines, index, count, across=8, width=10)
    if any(line.strip() for line in lines[end:]):
        raise fault(f"the header says {count} samples, more follow", end + 1)
    stated = Stated(
        count=Fact(count, "the header", _SMC_TEXT + 3),
        time_step=Fact(float(f"{1.0 / rate:.12g}"), "the header", rate_line),
        unit=Fact("cm/s2", "the format SMC"),
    )
    missing = integers[0]
    upward, azimuth = integers[12], integers[13]
    name = ""
    if upward != missing and upward in (0.0, 180.0):
        name = "up" if upward == 0.0 else "down"
    elif azimuth != missing:
        name = f"{azimuth:.0f} deg"
    return [recording_of(values, stated, reading, form="SMC", component=name)]
