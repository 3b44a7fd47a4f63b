"""Text files of strong-motion networks whose header states count, step and unit.

| format | recognised by | numbers | module |
|---|---|---|---|
| China, national format | NO. OF POINTS, EQUALLY SPACED INTERVALS OF | along the lines | here |
| GeoNet V1A, V2A | "accelerogram" and GNS Science | 10 fields of 8, mm/s^2 | `network_fields` |
| SMC of the USGS | first line, and `*` as the eleventh | 8 fields of 10 | `network_fields` |
| CSMIP V1, RENADIC, USC, BHRC | UNCORRECTED ACCELEROGRAM DATA | fields | `network_volumes` |
| NSMN | STRONG GROUND MOTION RECORDS OF TURK | three columns, gal | `network_columns` |
| CWB | #Earthquake Information | time, three columns, gal | `network_columns` |
| SCEC BBP | # time(sec) and N-S(cm/s/s) | time, three columns | `network_columns` |
| UNAM | ARCHIVO ESTANDAR DE ACELERACION | columns, gal | `network_columns` |
| name, count and step | second line: a count and a time step | along the lines; no unit | here |

AFAD's files of KEY: value are those of ESM. Sources: the descriptions of the formats that the
networks publish.
"""

import re
from collections.abc import Callable

from rockcheck.scenes.recordings.network_columns import (
    is_bbp,
    is_cwb,
    is_nsmn,
    is_unam,
    read_bbp,
    read_cwb,
    read_nsmn,
    read_unam,
)
from rockcheck.scenes.recordings.network_fields import is_geonet, is_smc, read_geonet, read_smc
from rockcheck.scenes.recordings.network_lines import WIDE, are_numbers, digit_notes, first_in_head
from rockcheck.scenes.recordings.network_volumes import is_volume_one, read_volume_one
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
from rockcheck.scenes.recordings.stated import Fact, Stated, last_digit, recording_of

Reader = Callable[[list[str], Reading], list[Recording]]
_COUNT_AND_STEP = re.compile(rf"\s*+(\d{{1,9}})\s++({NUMBER})\s*+")
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


def _is_count_and_step(lines: list[str]) -> bool:
    """Whether a title and a line of a count and a time step stand above lines of other width."""
    if len(lines) < 3 or not lines[0].strip() or are_numbers(lines[0]):
        return False
    match = _COUNT_AND_STEP.fullmatch(lines[1])
    if match is None or int(match[1]) < 2 or not are_numbers(lines[2]):
        return False
    return 0.0 < number(2, match[2]) <= 1.0 and len(lines[2].split()) != 2


def read_count_and_step(lines: list[str], reading: Reading) -> list[Recording]:
    """A title, a line of the count and the time step in s, and numbers along the lines."""
    match = _COUNT_AND_STEP.fullmatch(lines[1][:WIDE])
    if match is None:
        raise fault("no count and time step", 2)
    count = checked_count(2, "the count", match[1])
    stated = Stated(
        count=Fact(count, "the header", 2),
        time_step=Fact(checked_step(2, "the time step", match[2]), "the header", 2),
    )
    values = numbers(enumerate(lines[2:], 3), count)
    return [
        recording_of(
            values, stated, reading, form="count and step", notes=digit_notes(lines[2:], 3)
        )
    ]


def read_china(lines: list[str], reading: Reading) -> list[Recording]:
    """The national format of China: a header in words, then numbers along the lines."""
    place, match = first_in_head(lines, _CHINA_COUNT)
    if match is None:
        raise fault("no header line that states NO. OF POINTS and INTERVALS OF")
    count = checked_count(place, "NO. OF POINTS", match[1])
    step = checked_step(place, "INTERVALS OF", match[2])
    unit_line, unit_match = first_in_head(lines, _CHINA_UNIT)
    unit = known_unit(unit_match[1]) if unit_match else ""
    peak_line, peak_match = first_in_head(lines, _CHINA_PEAK)
    peak = duration = None
    peak_within = 0.0
    if peak_match and unit:
        peak = Fact(number(peak_line, peak_match[1]) * UNITS[unit], "PEAK VALUE", peak_line)
        peak_within = last_digit(peak_match[1]) * UNITS[unit]
    if peak_match and peak_match[2]:
        duration = Fact(number(peak_line, peak_match[2]), "DURATION", peak_line)
    stated = Stated(
        count=Fact(count, "NO. OF POINTS", place),
        time_step=Fact(step, "INTERVALS OF", place),
        unit=Fact(unit, "UNIT", unit_line) if unit else None,
        duration=duration,
        duration_within=1.0,
        peak=peak,
        peak_within=peak_within,
    )
    behind = max(place, unit_line, peak_line)
    first = behind + next(
        (k for k, line in enumerate(lines[behind : behind + 30]) if are_numbers(line)), 0
    )
    _, component = first_in_head(lines, _CHINA_COMPONENT)
    values = numbers(enumerate(lines[first:], first + 1), count)
    name = component[1][:30] if component else ""
    return [
        recording_of(
            values,
            stated,
            reading,
            form="China",
            component=name,
            notes=digit_notes(lines[first:], first + 1),
        )
    ]


def _is_china(lines: list[str]) -> bool:
    return any(_CHINA_COUNT.search(line) for line in lines[:30])


#: The readers, whether lines begin their format, and their files in the words of a message.
_FORMATS: tuple[tuple[Reader, Callable[[list[str]], bool], str], ...] = (
    (read_china, _is_china, "a file of the Chinese network"),
    (read_geonet, is_geonet, "a GeoNet file"),
    (read_smc, is_smc, "an SMC file"),
    (read_volume_one, is_volume_one, "an uncorrected accelerogram"),
    (read_nsmn, is_nsmn, "an NSMN file"),
    (read_cwb, is_cwb, "a CWB file"),
    (read_bbp, is_bbp, "a BBP file"),
    (read_unam, is_unam, "a UNAM file"),
    (read_count_and_step, _is_count_and_step, "a file with a count and a time step"),
)
NETWORKS: dict[Reader, str] = {reader: words for reader, _, words in _FORMATS}


def network_reader(head: list[str]) -> Reader | None:
    """The reader for a file that begins with the lines `head`; None if it has another format."""
    lines = [line[:WIDE] for line in head]
    for reader, is_format, _ in _FORMATS:
        if is_format(lines):
            return reader
    return None
