"""Formats with a header: PEER AT2, ESM (DYNA), K-NET/KiK-net ASCII, and V2.

V2 files of strong-motion networks, of one or several channels, are COSMOS 1.20 and the older format
of CSMIP (CDMG). Their numbers stand in fields of the width that the file states, and may touch.
Only the blocks of acceleration are read. Source: COSMOS Strong Motion Data Format, version 1.20
(2001): integer header 54 is the azimuth, real header 62 the time step of these samples in ms, and
34 that of the raw record in s, which counts only where 62 is not known.
"""

import math
import re
from dataclasses import dataclass, replace
from itertools import islice, takewhile

import numpy as np

from rockcheck.scenes.base import LEAST, MOST
from rockcheck.scenes.errors import InputError, printable
from rockcheck.scenes.recordings.network_lines import digit_notes
from rockcheck.scenes.recordings.recording import (
    NUMBER,
    UNITS,
    Reading,
    Recording,
    checked_count,
    checked_step,
    fault,
    is_number,
    known_unit,
    number,
    numbers,
    option,
)
from rockcheck.scenes.recordings.stated import Fact, Stated, last_digit, recording_of

AT2_HEADER = re.compile(rf"NPTS\s*+=\s*+(\d++)\s*+(?:,\s*+)?DT\s*+=\s*+({NUMBER})", re.IGNORECASE)
AT2_HEADER_PLAIN = re.compile(rf"^\s*+(\d++)\s++({NUMBER})\s++NPTS\s*+(?:,\s*+)?DT", re.IGNORECASE)
_UNITS = re.compile(
    r"(?:UNITS?(?:\s++|\s*+:\s*+)(?:(?:OF|IN|ARE|:)\s*+)?|\bACC(?:EL(?:ERATIONS?)?)?\.?\s++IN\s++)"
    r"\(?([A-Z0-9^*'²]++(?:\s*+/\s*+[A-Z0-9^*²]++)*+)",
    re.IGNORECASE,
)
_OTHER_KIND = re.compile(r"\b(?:VELOCITY|DISPLACEMENT)\s++TIME\s++(?:SERIES|HIST)", re.IGNORECASE)
_ESM_LINE = re.compile(r"([A-Z][A-Z0-9_^/]*+)\s*+:(.*+)")
_KNET_SCALE = re.compile(rf"({NUMBER})\s*+\(gal\)\s*+/\s*+({NUMBER})", re.IGNORECASE)
#: The channels of KiK-net down the borehole; 4, 5 and 6 are at the surface.
_BELOW_GROUND = ("1", "2", "3")
_KNET_RATE = re.compile(rf"({NUMBER})\s*+(?:Hz)?", re.IGNORECASE)

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
#: The peak in the text of CSMIP's header, and in that of COSMOS, where "Uncor max" is another.
_PEAK = re.compile(
    rf"(?:\bPeak\s++accel\w*+\s*+=|\bProcessed:.{{0,60}}\bMax\s*+=)\s*+({NUMBER})\s*+([a-z/0-9^]++)",
    re.IGNORECASE,
)
#: Where the sensor stands, in the text of COSMOS.
_DOWNHOLE = re.compile(
    r"\bLocation\s*+:.{0,60}?\b(?:down-?\s?hole|bore-?\s?hole|depth)", re.IGNORECASE
)
_COSMOS_UNITS = {"2": "g", "02": "g", "4": "cm/s2", "04": "cm/s2"}
_DIRECTIONS = {n: f"{n} deg" for n in range(361)} | {400: "up", 401: "down", 402: "vertical"}
NO_FIELDS = "a format without fields"


def _refuse_other_kinds(header: list[str]) -> None:
    """Raise `InputError` where a header says that the file holds no accelerations."""
    for n, line in enumerate(header, 1):
        other = _OTHER_KIND.search(line[:_WIDE])
        if other is not None:
            raise InputError(
                f"{printable(other[0], 30)!r}; only accelerations can be read", f"line {n}"
            )


def read_at2(lines: list[str], reading: Reading) -> list[Recording]:
    """Read PEER: header lines with the units, NPTS and DT, then accelerations in g."""
    found = (AT2_HEADER.search(line) or AT2_HEADER_PLAIN.search(line) for line in lines[:20])
    header, match = next((pair for pair in enumerate(found, 1) if pair[1]), (0, None))
    if match is None:
        raise fault("no header line with NPTS and DT within the first 20 lines")
    words = (word for line in lines[:header] for word in _UNITS.findall(line))
    stated = next(filter(None, map(known_unit, words)), "")
    _refuse_other_kinds(lines[:header])
    if not stated and reading.unit is None:
        raise InputError(
            "no header line states the unit, as UNITS OF G or ACCELERATION IN CM/S2; give it:"
            f" {option('unit', 'cm/s2')}"
        )
    count = checked_count(header, "NPTS", match[1])
    facts = Stated(
        count=Fact(count, "NPTS", header),
        time_step=Fact(checked_step(header, "DT", match[2]), "DT", header),
        unit=Fact(stated, "UNITS") if stated else None,
    )
    end = _end_of_samples(lines, header, count)
    behind = " ".join(" ".join(lines[end:]).split())
    values = numbers(enumerate(lines[header:end], header + 1), count)
    notes = [f"left out behind the last sample: {printable(behind, 60)!r}"] if behind else []
    notes += digit_notes(lines[header:end], header + 1)
    fields = lines[1].split(",")  # event, date, station and component, or another form
    name = fields[-1].strip()[:10]
    component = name if len(fields) > 2 and re.fullmatch(r"[0-9A-Za-z-]{1,6}", name) else ""
    return [recording_of(values, facts, reading, form="PEER AT2", component=component, notes=notes)]


def _end_of_samples(lines: list[str], first: int, count: int) -> int:
    """Index behind the line that completes `count` numbers; of all lines where none does.

    It is also that of all lines where a line of numbers stands behind, as too many are then.
    """
    samples = 0
    for index, line in enumerate(lines[first:], first):
        if samples == count and line.strip():
            return len(lines) if _has_numbers(lines[index:]) else index
        words = line.split()
        if not all(map(is_number, words)):
            break
        samples += len(words)
    return len(lines)


def _has_numbers(lines: list[str]) -> bool:
    """Whether one of these lines has numbers alone."""
    return any(all(map(is_number, line.split())) for line in lines if line.strip())


def read_esm(lines: list[str], reading: Reading) -> list[Recording]:
    """ESM (DYNA 1.2): lines of KEY: value, then one acceleration a line."""
    said = [match for match in takewhile(bool, map(_ESM_LINE.match, lines)) if match]
    header = {match[1]: (n, match[2].strip()) for n, match in enumerate(said, 1)}
    first = min(len(said) + 1, len(lines))
    needed = ("NDATA", "SAMPLING_INTERVAL_S")
    (place, counted), (line, interval) = (header.get(key, (0, "")) for key in needed)
    kind_line, kind = header.get("DATA_TYPE", (0, "ACCELERATION"))
    if kind.upper() != "ACCELERATION":
        raise InputError(
            f"DATA_TYPE {printable(kind, 30)!r}; only ACCELERATION can be read", f"line {kind_line}"
        )
    for key, word in zip(needed, (counted, interval), strict=True):
        if not word:
            raise InputError(f"no header line that states {key}")
    if not re.fullmatch(r"[0-9]++", counted):
        raise InputError(f"NDATA {printable(counted, 30)!r} is not a count", f"line {place}")
    count = checked_count(place, "NDATA", counted)
    unit_line, unit_word = header.get("UNITS", (0, ""))
    unit = known_unit(unit_word)
    length_line, length = header.get("DURATION_S", (0, ""))
    peak_line, peak = header.get("PGA_CM/S^2", (0, ""))
    facts = Stated(
        count=Fact(count, "NDATA", place),
        time_step=Fact(
            checked_step(line, "SAMPLING_INTERVAL_S", interval), "SAMPLING_INTERVAL_S", line
        ),
        unit=Fact(unit, "UNITS", unit_line) if unit else None,
        duration=Fact(number(length_line, length), "DURATION_S", length_line)
        if is_number(length)
        else None,
        peak=Fact(number(peak_line, peak) * UNITS["gal"], "PGA", peak_line)
        if is_number(peak)
        else None,
        peak_within=last_digit(peak) * UNITS["gal"] if is_number(peak) else 0.0,
    )
    values = numbers(enumerate(lines[first - 1 :], first))
    component = printable(header.get("STREAM", (0, ""))[1], 30)
    return [recording_of(values, facts, reading, form="ESM ASCII", component=component)]


def read_knet(lines: list[str], reading: Reading) -> list[Recording]:
    """K-NET and KiK-net: 17 header lines, then counts of the digitiser.

    Names of the header stand in the first 18 columns. The counts have an offset: their mean is
    taken out, as it is for the Max. Acc. that the file states.
    """
    end = next((n for n, line in enumerate(lines[:40], 1) if line.startswith("Memo")), None)
    if end is None:
        raise fault("no header line Memo. within the first 40 lines")
    header = {line[:18].strip(): (n, line[18:].strip()) for n, line in enumerate(lines[:end], 1)}
    scale = _KNET_SCALE.match(header.get("Scale Factor", (0, ""))[1])
    rate = _KNET_RATE.match(header.get("Sampling Freq(Hz)", (0, ""))[1])
    if not scale or not rate:
        raise fault(
            f"no header line that states {'Sampling Freq(Hz)' if scale else 'Scale Factor in gal'}",
        )
    place = header["Scale Factor"][0]
    factor, counts = number(place, scale[1]), number(place, scale[2])
    hertz = checked_step(header["Sampling Freq(Hz)"][0], "Sampling Freq(Hz)", rate[1])
    values = np.array(numbers(enumerate(lines[end:], end + 1)))
    line_of, length = header.get("Duration Time(s)", (0, ""))
    expected = number(line_of, length) * hertz if line_of else float(len(values))
    if counts == 0.0 or not LEAST <= abs(factor / counts) <= MOST:
        raise InputError(f"Scale Factor {printable(scale[0], 40)} is not usable", f"line {place}")
    if not len(values):
        raise InputError("no samples after the line Memo.")
    if abs(expected - len(values)) > 0.5:
        raise InputError(
            f"Duration Time(s) {length} is {expected:.10g} samples, the file has {len(values)}",
            f"line {line_of}",
        )
    gals = values * (factor / counts)
    mean = float(np.mean(gals))
    peak_line, peak = header.get("Max. Acc. (gal)", (0, ""))
    facts = Stated(
        time_step=Fact(1.0 / hertz, "Sampling Freq(Hz)"),
        unit=Fact("gal", "Scale Factor", place),
        peak=Fact(number(peak_line, peak) * UNITS["gal"], "Max. Acc.", peak_line)
        if is_number(peak)
        else None,
        peak_within=last_digit(peak) * UNITS["gal"] if is_number(peak) else 0.0,
    )
    note = f"the mean, {mean:.4g} gal, is taken out: the offset of the digitiser"
    component = printable(header.get("Dir.", (0, ""))[1], 30)
    recording = recording_of(
        gals - mean, facts, reading, form="K-NET ASCII", component=component, notes=(note,)
    )
    return [replace(recording, borehole=component in _BELOW_GROUND)]


@dataclass
class _Block:
    """What is known of the next block of accelerations, from its headers and its own first line.

    `step` is the line of the time step, and its value (s); `count` samples, in all some whole
    `seconds` where these are stated; `peak` is in m/s^2; `across` numbers stand on a line, each
    `width` characters wide.
    """

    name: str = ""
    step: tuple[int, float] = (0, math.nan)
    count: str = ""
    seconds: str = ""
    unit: str = ""
    across: int = 8
    width: int = 10
    peak: Fact[float] | None = None
    peak_within: float = 0.0
    borehole: bool = False

    @property
    def height(self) -> int:
        return -(-int(self.count[:12]) // max(self.across, 1))


def is_volume(line: str) -> bool:
    """Whether this line occurs only in V2 files."""
    return bool(
        _HEADER.match(line[:_WIDE])
        or CSMIP_BLOCK.match(line[:_WIDE])
        or re.search(r"\(Format v0*1\.\d", line[:_WIDE], re.IGNORECASE)
    )


def read_volume(lines: list[str], reading: Reading) -> list[Recording]:
    """Every block of acceleration, in the file's order."""
    found: list[Recording] = []
    block, index = _Block(), 0
    while index < len(lines):
        line = lines[index][:_WIDE]
        index += 1
        if header := _HEADER.match(line):
            index = _heed(lines, index, header, block)
        elif said := COSMOS_BLOCK.match(line):
            block.count, block.seconds = said[1], said[2] or ""
            _refuse_counts(said, index)
            block.unit = known_unit(said[3]) or _COSMOS_UNITS.get(said[4] or "", "")
            block.across, block.width = int(said[5]), int(said[6])
        elif said := CSMIP_BLOCK.match(line):
            rest = line[said.end() :]
            block.count, block.step = said[1], (index, number(index, said[2]))
            block.unit = next(map(known_unit, _CSMIP_UNIT.findall(rest)), "")
            if shape := _CSMIP_FORMAT.search(rest):
                block.across, block.width = map(int, shape.groups())
        else:
            _take_text(line, index, block)
        if block.count:
            found.append(_recording(lines, index, block, reading))
            block, index = _Block(), index + block.height
    if not found:
        raise fault(
            "a V2 file without a block of accelerations; only corrected accelerations can be read",
        )
    return found


def _take_text(line: str, n: int, block: _Block) -> None:
    """Take the channel's name and its peak from a line of text, number `n`."""
    if named := _CHANNEL.search(line):
        block.name = named[2]
    if _DOWNHOLE.search(line):
        block.borehole = True
    peak = _PEAK.search(line)
    unit = known_unit(peak[2]) if peak else ""
    if peak and unit:
        block.peak = Fact(number(n, peak[1]) * UNITS[unit], "the header", n)
        block.peak_within = last_digit(peak[1]) * UNITS[unit]


def _refuse_counts(block: re.Match[str], line: int) -> None:
    """Raise `InputError` for a block whose unit is counts, COSMOS' unit 50."""
    if "count" in block[3].lower() or block[4] == "50":
        raise fault("raw counts of the digitiser; only accelerations can be read", line)


def _heed(lines: list[str], index: int, header: re.Match[str], block: _Block) -> int:
    """Take direction and time step from a block of header values; returns the line after it."""
    across, width = int(header[4]), int(header[5])
    if across < 1 or width < 1:
        raise InputError(NO_FIELDS, f"line {index}")
    end = min(index + int(header[3][:6]), len(lines))
    fields = (
        (n, line[k * width : (k + 1) * width].strip())
        for n, line in enumerate(lines[index:end], index + 1)
        for k in range(across)
    )
    words = dict(enumerate(islice(fields, 62), 1))
    if header[2].lower() == "integer":
        if re.fullmatch(r"[0-9]{1,3}", words.get(54, (0, ""))[1]):
            block.name = _DIRECTIONS.get(int(words[54][1]), block.name)
    else:
        for place, seconds in ((62, 1e-3), (34, 1.0)):
            n, text = words.get(place, (0, ""))
            if text and (value := number(n, text)) > 0.0:
                block.step = n, float(f"{value * seconds:.12g}")
                break
    return end


def _values_in_fields(lines: list[str], within: range, about: _Block, count: int) -> list[float]:
    """At most `count` numbers in the fields of a block's lines, up to the first line of others."""
    values: list[float] = []
    for n, line in zip(within, lines[within.start : within.stop], strict=False):
        on_line = min(about.across, count - len(values))
        places = range(0, on_line * about.width, about.width)
        words = [line[k : k + about.width].strip() for k in places]
        # a field is empty, or lines are shifted: the last one's number goes on behind it
        if "" in words or line[about.across * about.width :][:1].strip():
            break
        if len(line.rstrip()) < on_line * about.width:
            raise fault(f"{len(line.rstrip())} characters: a digit is missing", n + 1)
        values += [number(n + 1, word) for word in words]
    return values


def _recording(lines: list[str], index: int, about: _Block, reading: Reading) -> Recording:
    (place, seconds), here, end = about.step, f"line {index}", index + about.height
    if not place:
        raise InputError("no real header before this block states the time step", here)
    if about.across < 1 or about.width < 1:
        raise InputError(NO_FIELDS, here)
    count = checked_count(index, "the count of points", about.count)
    step = checked_step(place, "the time step", f"{seconds!r}")
    values = _values_in_fields(lines, range(index, end), about, count)
    if len(values) != count:
        raise InputError(
            f"the header says {count} points of acceleration, the block has {len(values)}", here
        )
    if {*map(is_number, "".join(lines[end : end + 1]).split())} == {True}:
        raise InputError(f"the header says {count} points of acceleration, more follow", here)
    length = float(about.seconds[:9]) if about.seconds else None
    facts = Stated(
        time_step=Fact(step, "the header", place),
        unit=Fact(about.unit, "the header", index) if about.unit else None,
        # A time step of another record would be a silent fault.
        duration=Fact(length, "the header", index) if length is not None else None,
        duration_within=1.0 + 0.01 * count * step,
        peak=about.peak,
        peak_within=about.peak_within,
    )
    recording = recording_of(values, facts, reading, form="V2", component=printable(about.name, 30))
    return replace(recording, borehole=about.borehole)
