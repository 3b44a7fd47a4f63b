"""What the lines above a table of numbers state of it, in words."""

import re
from collections.abc import Iterable

from rockcheck.scenes.recordings.recording import (
    MOST_SAMPLES,
    NUMBER,
    UNITS,
    known_unit,
    number,
)
from rockcheck.scenes.recordings.stated import Fact, Stated, Value

NumberedLines = list[tuple[int, str]]

#: Longest line that is searched; in a longer one what ends so near to the cut is left out, for a
#: number or its unit may go on behind it.
_WIDE, _NEAR_THE_CUT = 300, 40
_IS = r"\s*+(?:\([^)]{0,20}\)\s*+)?(?:[:=]|\bof\b|\bis\b)\s*+(?:of\s*+)?[:=]?\s*+"
_COUNTS = (
    rf"\b(?:npts|ndata|(?:no\.?|number|num)\s*+of\s*+(?:data\s*+)?(?:points|samples|values))"
    rf"{_IS}(\d++)(?![.\d])",
    r"^\W*+(\d++)\s++(?:data\s++)?(?:points|samples|values)\b",
)
_STEPS = (
    rf"\b(?:dt|delta|time\s*+step|time\s*+interval|sampling\s*+interval|spaced\s*+intervals?)"
    rf"{_IS}({NUMBER})(?!\s*+(?:ms|hz))",
)
_RATES = (
    rf"\b(?:sampling|sample)\s*+(?:rate|freq(?:uency)?)(?:\s*+\(hz\))?{_IS}({NUMBER})\s*+"
    r"(?!\s*+(?:s|sec|ms)\b)",
)
_DURATIONS = (rf"\bduration{_IS}({NUMBER})\s*+(?:s|sec|seconds)\b",)
_PEAKS = (
    rf"\b(?:pga|peak\s*+(?:ground\s*+)?(?:acc(?:el(?:eration)?)?|value)|max(?:imum)?\.?\s*+"
    rf"acc(?:el(?:eration)?)?\.?){_IS}({NUMBER})\s*+([a-z/0-9^*²]*+)",
)
_UNITS = (
    r"\bunits?\b\s*+(?:[:=]|\bof\b|\bin\b|\bare\b)?\s*+\(?([a-z/0-9^*²]++)",
    r"\bacc(?:el(?:erations?)?)?\.?\s++in\s++([a-z/0-9^*²]++)",
    r"[\[(]([a-z/0-9^*². -]{1,20})[\])]",
    r"\b((?:cm|mm|m|ft)\s*+/\s*+s(?:ec)?(?:\s*+/\s*+s(?:ec)?|(?:\^|\*\*)?2)|gals?)(?![\w/])",
)


def facts_of(header: Iterable[tuple[int, str]], given_unit: str = "") -> Stated:
    """The facts that numbered header lines state.

    A fact counts where it has a label, and where all lines that state it agree. A peak without a
    unit has that of the header, or else `given_unit`.
    """
    lines = list(header)
    counts = [
        Fact(int(match[1]), "the header", n)
        for n, match in _matches(_COUNTS, lines)
        if len(match[1]) < 12 and 0 < int(match[1]) <= MOST_SAMPLES
    ]
    units = [
        Fact(spelt, "the header", n)
        for n, match in _matches(_UNITS, lines)
        if (spelt := known_unit(match[1]))
    ]
    unit = _agreed(units)
    steps = [Fact(number(n, match[1]), "the header", n) for n, match in _matches(_STEPS, lines)]
    for n, match in _matches(_RATES, lines):
        rate = number(n, match[1])
        if rate > 0.0:
            steps.append(Fact(float(f"{1.0 / rate:.12g}"), "the header", n))
    durations = [
        Fact(number(n, match[1]), "the header", n) for n, match in _matches(_DURATIONS, lines)
    ]
    peaks = []
    for n, match in _matches(_PEAKS, lines):
        peak_unit = known_unit(match[2]) or (unit.value if unit is not None else given_unit)
        if peak_unit:
            peaks.append(Fact(abs(number(n, match[1])) * UNITS[peak_unit], "the header", n))
    return Stated(
        count=_agreed(counts),
        time_step=_agreed([step for step in steps if step.value > 0.0]),
        unit=unit,
        duration=_agreed(durations),
        duration_within=1.0,
        peak=_agreed(peaks),
    )


def _matches(patterns: Iterable[str], lines: NumberedLines) -> list[tuple[int, re.Match[str]]]:
    return [
        (n, match)
        for pattern in patterns
        for n, line in lines
        for match in re.finditer(pattern, line[:_WIDE], re.IGNORECASE)
        if len(line) <= _WIDE or match.end() <= _WIDE - _NEAR_THE_CUT
    ]


def _agreed(facts: list[Fact[Value]]) -> Fact[Value] | None:
    """The first of the facts where all have its value, else None."""
    values = {fact.value for fact in facts}
    return facts[0] if len(values) == 1 else None
