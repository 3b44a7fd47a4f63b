"""Text files of strong-motion networks whose header states count, step and unit.

| format | recognised by | numbers |
|---|---|---|
| China, national format | NO. OF POINTS, EQUALLY SPACED INTERVALS OF | along the lines |
| GeoNet V1A, V2A | "accelerogram" and GNS Science | 10 fields of 8 characters, mm/s^2 |
| SMC of the USGS | first line, and `*` as the eleventh | 8 fields of 10 characters, cm/s^2 |
| NSMN, AFAD | STRONG GROUND MOTION RECORDS OF TURK | three columns, gal |
| CWB | #Earthquake Information | time and three columns, gal |
| SCEC BBP | # time(sec) and N-S(cm/s/s) | time and three columns |
| name, count and step | second line: a count and a time step | along the lines; no unit |

Sources: the descriptions of the formats that the networks publish.
"""

import re
from collections.abc import Callable, Iterable

from rockcheck.scenes.base import MOST
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
)
from rockcheck.scenes.recordings.stated import Fact, Stated, recording_of

_COUNT_AND_STEP = re.compile(rf"\s*+(\d{{1,9}})\s++({NUMBER})\s*+")
#: How many lines are searched for the header, and how many characters of each.
_HEADER_LINES = 100
_WIDE = 200

_CHINA_COUNT = re.compile(
    rf"NO\.\s*+OF\s*+POINTS\s*+:\s*+(\d++)\s++EQUALLY\s++SPACED\s++INTERVALS\s++OF\s*+:\s*+({NUMBER})",
    re.IGNORECASE,
)
_CHINA_PEAK = re.compile(
    rf"PEAK\s++VALUE\s*+:\s*+({NUMBER})(?:\s*+AT\s[^D]{{0,40}}DURATION\s*+:\s*+({NUMBER}))?",
    re.IGNORECASE,
)
_CHINA_UNIT = re.compile(r"\bUNIT\s*+:\s*+([A-Z/0-9^]++)", re.IGNORECASE)
_CHINA_COMPONENT = re.compile(r"\bCOMP\.\s*+([A-Z0-9]++)", re.IGNORECASE)

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

_NSMN = "STRONG GROUND MOTION RECORDS OF TURK"
_CWB = "#Earthquake Information"
_BBP = re.compile(r"[#%]\s*+time\s*+\(s(?:ec)?\)\s++", re.IGNORECASE)


def network_reader(head: list[str]) -> Callable[[list[str], Reading], list[Recording]] | None:
    """The reader for a file that begins with the lines `head`; None if it has another format."""
    lines = [line[:_WIDE] for line in head]
    if any(map(_CHINA_COUNT.search, lines[:30])):
        return read_china
    if _GEONET.match(lines[0]):
        return read_geonet
    if _SMC.match(lines[0]) and len(lines) > _SMC_TEXT and "*" in lines[_SMC_TEXT - 1]:
        return read_smc
    if _NSMN in lines[0]:
        return read_nsmn
    if lines[0].startswith(_CWB):
        return read_cwb
    if any(_BBP.match(line) and known_unit(_bracketed(line)[-1]) for line in lines):
        return read_bbp
    if _is_count_and_step(lines):
        return read_count_and_step
    return None


def _is_count_and_step(lines: list[str]) -> bool:
    """Whether a title and a line of a count and a time step stand above lines of other width."""
    if len(lines) < 3 or not lines[0].strip() or _are_numbers(lines[0]):
        return False
    match = _COUNT_AND_STEP.fullmatch(lines[1])
    if match is None or int(match[1]) < 2 or not _are_numbers(lines[2]):
        return False
    return 0.0 < number(2, match[2]) <= 1.0 and len(lines[2].split()) != 2


def read_count_and_step(lines: list[str], reading: Reading) -> list[Recording]:
    """A title, a line of the count and the time step in s, and numbers along the lines."""
    match = _COUNT_AND_STEP.fullmatch(lines[1][:_WIDE])
    if match is None:
        raise fault("no count and time step", 2)
    count = checked_count(2, "the count", match[1])
    stated = Stated(
        count=Fact(count, "the header", 2),
        time_step=Fact(checked_step(2, "the time step", match[2]), "the header", 2),
    )
    values = numbers(enumerate(lines[2:], 3), count)
    return [recording_of(values, stated, reading, form="count and step")]


def fields(
    lines: list[str], first: int, count: int, *, across: int, width: int
) -> tuple[list[float], int]:
    """`count` numbers in fields of `width` characters, `across` on a line, and the index behind.

    `first` is the index of the first line. Fields may touch. Raises `InputError` where a field is
    empty or no number, and where a line goes on behind its last field.
    """
    values: list[float] = []
    index = first
    while len(values) < count:
        if index >= len(lines):
            break
        line = lines[index].rstrip()
        on_line = min(across, count - len(values))
        if len(line) > on_line * width:
            raise fault(
                f"numbers go on behind the {on_line} fields of {width} characters", index + 1
            )
        for place in range(on_line):
            word = line[place * width : (place + 1) * width].strip()
            if not word:
                raise fault(f"{place} fields of {width} characters, not {on_line}", index + 1)
            values.append(number(index + 1, word))
        index += 1
    if len(values) < count:
        raise fault(f"the header says {count} samples, the file has {len(values)}", first + 1)
    return values, index


def read_china(lines: list[str], reading: Reading) -> list[Recording]:
    """The national format of China: a header in words, then numbers along the lines."""
    place, match = _first_in(lines, _CHINA_COUNT)
    if match is None:
        raise fault("no header line that states NO. OF POINTS and INTERVALS OF")
    count = checked_count(place, "NO. OF POINTS", match[1])
    step = checked_step(place, "INTERVALS OF", match[2])
    unit_line, unit_match = _first_in(lines, _CHINA_UNIT)
    unit = known_unit(unit_match[1]) if unit_match else ""
    peak_line, peak_match = _first_in(lines, _CHINA_PEAK)
    peak = duration = None
    if peak_match and unit:
        peak = Fact(number(peak_line, peak_match[1]) * UNITS[unit], "PEAK VALUE", peak_line)
    if peak_match and peak_match[2]:
        duration = Fact(number(peak_line, peak_match[2]), "DURATION", peak_line)
    stated = Stated(
        count=Fact(count, "NO. OF POINTS", place),
        time_step=Fact(step, "INTERVALS OF", place),
        unit=Fact(unit, "UNIT", unit_line) if unit else None,
        duration=duration,
        duration_within=1.0,
        peak=peak,
    )
    behind = max(place, unit_line, peak_line)
    first = behind + next(
        (k for k, line in enumerate(lines[behind : behind + 30]) if _are_numbers(line)), 0
    )
    _, component = _first_in(lines, _CHINA_COMPONENT)
    values = numbers(enumerate(lines[first:], first + 1), count)
    name = component[1][:30] if component else ""
    return [recording_of(values, stated, reading, form="China", component=name)]


def _first_in(lines: list[str], pattern: re.Pattern[str]) -> tuple[int, re.Match[str] | None]:
    """Number and match of the first header line in which `pattern` occurs; (0, None) if none."""
    return _first([(n, line[:_WIDE]) for n, line in enumerate(lines[:30], 1)], pattern)


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
    kind = _GEONET.match(lines[index][:_WIDE])
    if kind is None:
        raise fault("no line that begins a channel: other samples than the header says", index + 1)
    reals_at = index + _GEONET_TEXT
    data_at = reals_at + _GEONET_REALS
    if data_at >= len(lines):
        raise fault("the file ends within a header", len(lines))
    reals = [_geonet_reals(lines, n) for n in range(reals_at, data_at)]
    text = [(n + 1, lines[n][:_WIDE]) for n in range(index, reals_at)]
    counts_line = reals_at + 4
    if kind[1]:
        step_line, match = _first(text, _GEONET_INTERVAL)
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
    peak_line, peak = _first(text, _GEONET_PEAK)
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
    kind = _SMC.match(lines[0][:_WIDE])
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


def read_nsmn(lines: list[str], reading: Reading) -> list[Recording]:
    """NSMN and AFAD (Turkey): lines of KEY: value, then columns N-S, E-W and U-D in gal."""
    count_line, count_word = _value(lines, "NUMBER OF DATA")
    step_line, step_word = _value(lines, "SAMPLING INTERVAL")
    if not re.fullmatch(r"\d{1,10}", count_word):
        raise fault("no header line that states NUMBER OF DATA", count_line)
    step = checked_step(step_line, "SAMPLING INTERVAL", step_word.split(" ")[0])
    count = checked_count(count_line, "NUMBER OF DATA", count_word)
    first = _first_of_numbers(lines, 3)
    stated = Stated(
        count=Fact(count, "NUMBER OF DATA", count_line),
        time_step=Fact(step, "SAMPLING INTERVAL", step_line),
        unit=Fact("gal", "the format NSMN"),
    )
    rows = _rows(lines, first, 3)
    return _components(rows, ("N-S", "E-W", "U-D"), stated, reading, "NSMN")


def read_cwb(lines: list[str], reading: Reading) -> list[Recording]:
    """CWB (Taiwan): lines of #key: value, then time and columns U, N, E in gal."""
    rate_line, rate_word = _value(lines, "#SampleRate")
    length_line, length = _value(lines, "#RecordLength")
    rate = checked_step(rate_line, "#SampleRate", rate_word.split(" ")[0])
    duration = None
    if length_line:
        seconds = number(length_line, length.split(" ")[0])
        duration = Fact(seconds, "#RecordLength", length_line)
    stated = Stated(
        time_step=Fact(float(f"{1.0 / rate:.12g}"), "#SampleRate", rate_line),
        unit=Fact("gal", "the format CWB"),
        duration=duration,
    )
    rows = _rows(lines, _first_of_numbers(lines, 4), 4)
    _check_times(rows, 1.0 / rate)
    across = [(n, row[1:]) for n, row in rows]
    return _components(across, ("U-D", "N-S", "E-W"), stated, reading, "CWB")


def read_bbp(lines: list[str], reading: Reading) -> list[Recording]:
    """SCEC BBP: a line # time(sec) N-S(cm/s/s) E-W(cm/s/s) U-D(cm/s/s), then four columns."""
    place, words = next(
        (n, line[:_WIDE].lstrip("#% ").split())
        for n, line in enumerate(lines, 1)
        if _BBP.match(line[:_WIDE])
    )
    names = [word.partition("(")[0] for word in words[1:]]
    unit = known_unit(_bracketed(lines[place - 1][:_WIDE])[-1])
    rows = _rows(lines, _first_of_numbers(lines, len(words)), len(words))
    if len(rows) < 2:
        raise fault("fewer than 2 samples", place)
    step = float(f"{(rows[-1][1][0] - rows[0][1][0]) / (len(rows) - 1):.6g}")
    _check_times(rows, checked_step(rows[0][0], "the time step", f"{step!r}"))
    stated = Stated(time_step=Fact(step, "the times"), unit=Fact(unit, "the header", place))
    across = [(n, row[1:]) for n, row in rows]
    return _components(across, names, stated, reading, "SCEC BBP")


def _components(
    rows: list[tuple[int, list[float]]],
    names: Iterable[str],
    stated: Stated,
    reading: Reading,
    form: str,
) -> list[Recording]:
    """A recording for each column."""
    return [
        recording_of([row[k] for _, row in rows], stated, reading, form=form, component=name[:30])
        for k, name in enumerate(names)
    ]


def _rows(lines: list[str], first: int, width: int) -> list[tuple[int, list[float]]]:
    """The numbers of each line from the index `first`; raises where there are not `width`."""
    rows = []
    for n, line in enumerate(lines[first:], first + 1):
        words = line.split()
        if not words or line[0] in "#%":
            continue
        if len(words) != width:
            raise fault(f"{len(words)} numbers, not {width}", n)
        rows.append((n, [number(n, word) for word in words]))
    return rows


def _check_times(rows: list[tuple[int, list[float]]], step: float) -> None:
    """Raises `InputError` where a time is off the uniform step by half of it or more."""
    for index, (n, row) in enumerate(rows):
        if abs(row[0] - rows[0][1][0] - index * step) >= 0.5 * step:
            raise fault(f"time {row[0]:g} s is off the uniform step {step:.6g} s", n)


def _first_of_numbers(lines: list[str], width: int) -> int:
    """Index of the first line of `width` numbers."""
    for index, line in enumerate(lines[:_HEADER_LINES]):
        if _are_numbers(line) and len(line.split()) == width:
            return index
    raise fault(f"no line of {width} numbers within the first {_HEADER_LINES}")


def _are_numbers(line: str) -> bool:
    words = line[:_WIDE].split()
    return bool(words) and all(re.fullmatch(NUMBER, word) for word in words)


def _value(lines: list[str], key: str) -> tuple[int, str]:
    """Line and value of the header line that begins with `key`; (0, "") if there is none."""
    for n, line in enumerate(lines[:_HEADER_LINES], 1):
        if line.upper().startswith(key.upper()):
            return n, line[:_WIDE].partition(":")[2].strip()
    return 0, ""


def _first(
    text: list[tuple[int, str]], pattern: re.Pattern[str]
) -> tuple[int, re.Match[str] | None]:
    for n, line in text:
        if match := pattern.search(line):
            return n, match
    return 0, None


def _bracketed(line: str) -> list[str]:
    """What stands in brackets, each; a last "" where nothing does."""
    return re.findall(r"[(\[]([^)\]]{1,20})[)\]]", line) or [""]


#: The readers, and their files in the words of a message.
NETWORKS: dict[Callable[[list[str], Reading], list[Recording]], str] = {
    read_china: "a file of the Chinese network",
    read_geonet: "a GeoNet file",
    read_smc: "an SMC file",
    read_nsmn: "an NSMN file",
    read_cwb: "a CWB file",
    read_bbp: "a BBP file",
    read_count_and_step: "a file with a count and a time step",
}
