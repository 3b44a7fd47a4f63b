"""Files with a column for each component: NSMN (Turkey), CWB (Taiwan), SCEC BBP, UNAM (Mexico)."""

import re

from rockcheck.scenes.recordings.network_lines import (
    WIDE,
    bracketed,
    check_times,
    components_of,
    digit_notes,
    first_of_numbers,
    rows_of,
    value_of,
)
from rockcheck.scenes.recordings.recording import (
    UNITS,
    Reading,
    Recording,
    checked_count,
    checked_step,
    fault,
    known_unit,
    number,
)
from rockcheck.scenes.recordings.stated import Fact, Stated, last_digit, recording_of

_UNAM = "ARCHIVO ESTANDAR DE ACELERACION"
_NSMN = "STRONG GROUND MOTION RECORDS OF TURK"
_CWB = "#Earthquake Information"
_BBP = re.compile(r"[#%]\s*+time\s*+\(s(?:ec)?\)\s++", re.IGNORECASE)


def is_unam(lines: list[str]) -> bool:
    """Whether these lines begin a UNAM file."""
    return any(_UNAM in line.upper() for line in lines[:12])


def is_nsmn(lines: list[str]) -> bool:
    """Whether these lines begin a NSMN file."""
    return _NSMN in lines[0]


def is_cwb(lines: list[str]) -> bool:
    """Whether these lines begin a CWB file."""
    return lines[0].startswith(_CWB)


def is_bbp(lines: list[str]) -> bool:
    """Whether these lines begin a SCEC BBP file."""
    return any(_BBP.match(line) and known_unit(bracketed(line)[-1]) for line in lines)


def read_nsmn(lines: list[str], reading: Reading) -> list[Recording]:
    """NSMN and AFAD (Turkey): lines of KEY: value, then columns N-S, E-W and U-D in gal."""
    count_line, count_word = value_of(lines, "NUMBER OF DATA")
    step_line, step_word = value_of(lines, "SAMPLING INTERVAL")
    if not re.fullmatch(r"\d{1,10}", count_word):
        raise fault("no header line that states NUMBER OF DATA", count_line)
    step = checked_step(step_line, "SAMPLING INTERVAL", step_word.split(" ")[0])
    count = checked_count(count_line, "NUMBER OF DATA", count_word)
    first = first_of_numbers(lines, 3)
    stated = Stated(
        count=Fact(count, "NUMBER OF DATA", count_line),
        time_step=Fact(step, "SAMPLING INTERVAL", step_line),
        unit=Fact("gal", "the format NSMN"),
    )
    rows = rows_of(lines, first, 3)
    notes = digit_notes(lines[first:], first + 1)
    return components_of(rows, ("N-S", "E-W", "U-D"), stated, reading, "NSMN", notes)


def read_cwb(lines: list[str], reading: Reading) -> list[Recording]:
    """CWB (Taiwan): lines of #key: value, then time and columns U, N, E in gal."""
    rate_line, rate_word = value_of(lines, "#SampleRate")
    length_line, length = value_of(lines, "#RecordLength")
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
    first = first_of_numbers(lines, 4)
    rows = rows_of(lines, first, 4)
    notes = digit_notes(lines[first:], first + 1)
    check_times(rows, 1.0 / rate)
    across = [(n, row[1:]) for n, row in rows]
    return components_of(across, ("U-D", "N-S", "E-W"), stated, reading, "CWB", notes)


def read_bbp(lines: list[str], reading: Reading) -> list[Recording]:
    """SCEC BBP: a line # time(sec) N-S(cm/s/s) E-W(cm/s/s) U-D(cm/s/s), then four columns."""
    place, words = next(
        (n, line[:WIDE].lstrip("#% ").split())
        for n, line in enumerate(lines, 1)
        if _BBP.match(line[:WIDE])
    )
    names = [word.partition("(")[0] for word in words[1:]]
    unit = known_unit(bracketed(lines[place - 1][:WIDE])[-1])
    first = first_of_numbers(lines, len(words))
    rows = rows_of(lines, first, len(words))
    notes = digit_notes(lines[first:], first + 1)
    if len(rows) < 2:
        raise fault("fewer than 2 samples", place)
    step = float(f"{(rows[-1][1][0] - rows[0][1][0]) / (len(rows) - 1):.6g}")
    check_times(rows, checked_step(rows[0][0], "the time step", f"{step!r}"))
    stated = Stated(time_step=Fact(step, "the times"), unit=Fact(unit, "the header", place))
    across = [(n, row[1:]) for n, row in rows]
    return components_of(across, names, stated, reading, "SCEC BBP", notes)


def read_unam(lines: list[str], reading: Reading) -> list[Recording]:
    """UNAM (Mexico): lines of KEY : /value/value/value, then a column in gal for each channel."""
    count_line, counts = _listed(lines, "NUM. TOTAL DE MUESTRAS, C1-C6")
    step_line, steps = _listed(lines, "INTERVALO DE MUESTREO, C1-C6")
    length_line, lengths = _listed(lines, "DURACION DEL REGISTRO")
    peak_line, peaks = _listed(lines, "ACEL. MAX.")
    _, names = _listed(lines, "ORIENTACION C1-C6")
    unit_line, unit_words = value_of(lines, "UNIDADES DE LOS DATOS")
    if not counts or not steps:
        missing = "INTERVALO DE MUESTREO" if counts else "NUM. TOTAL DE MUESTRAS"
        raise fault(f"no header line that states {missing}")
    unit = next(filter(None, map(known_unit, re.split(r"[\s()\[\]]++", unit_words))), "gal")
    width = len(counts)
    first = first_of_numbers(lines, width)
    rows = rows_of(lines, first, width)
    notes = digit_notes(lines[first:], first + 1)
    recordings = []
    for channel in range(width):
        if not re.fullmatch(r"\d{1,9}", counts[channel]):
            raise fault("NUM. TOTAL DE MUESTRAS is no count", count_line)
        peak = number(peak_line, peaks[channel]) if channel < len(peaks) else None
        stated = Stated(
            count=Fact(int(counts[channel]), "NUM. TOTAL DE MUESTRAS", count_line),
            time_step=Fact(
                checked_step(
                    step_line, "INTERVALO DE MUESTREO", steps[min(channel, len(steps) - 1)]
                ),
                "INTERVALO DE MUESTREO",
                step_line,
            ),
            unit=Fact(unit, "UNIDADES DE LOS DATOS", unit_line),
            duration=Fact(number(length_line, lengths[channel]), "DURACION", length_line)
            if channel < len(lengths)
            else None,
            peak=Fact(peak * UNITS["gal"], "ACEL. MAX.", peak_line) if peak is not None else None,
            peak_within=last_digit(peaks[channel]) * UNITS["gal"] if peak is not None else 0.0,
        )
        name = _direction(names[channel]) if channel < len(names) else ""
        values = [row[channel] for _, row in rows]
        recordings.append(
            recording_of(values, stated, reading, form="UNAM", component=name, notes=notes)
        )
    return recordings


def _listed(lines: list[str], key: str) -> tuple[int, list[str]]:
    """Line and values of a header line of values between slashes; (0, []) if there is none."""
    line, text = value_of(lines, key)
    return line, [word.strip() for word in text.split("/") if word.strip()]


def _direction(word: str) -> str:
    """The name of a channel: V for a vertical one, which may have a sign; else as in the file."""
    return "V" if re.fullmatch(r"[^0-9]*\bV\b[^0-9]*", word) else word[:30]
