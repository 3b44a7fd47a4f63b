"""What the columns of a history's table are called, in any program.

In: names of columns, and perhaps a row of units. Out: quantities of a history, and the factors to
SI units. Called by `History.load`.
"""

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence

from rockcheck.scenes.errors import InputError, printable

#: The columns of a history, and those of its events.
COLUMNS = ("t", "x", "y", "theta", "x_dot", "y_dot", "theta_dot", "slip", "slip_rate", "mode")
#: Units that a column may have, as in `theta_deg` or `x_dot_mm_s`, and their SI value.
TIMES = {"s": 1.0, "ms": 1e-3}
ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0}
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
ANGLE_RATES = {f"{unit}_s": factor for unit, factor in ANGLES.items()}
SPEEDS = {f"{unit}_s": factor for unit, factor in LENGTHS.items()}
UNITS: Mapping[str, Mapping[str, float]] = {
    "t": TIMES,
    "theta": ANGLES,
    "theta_dot": ANGLE_RATES,
    **dict.fromkeys(("x", "y", "slip"), LENGTHS),
    **dict.fromkeys(("x_dot", "y_dot", "slip_rate"), SPEEDS),
}
#: Names that other programs give, in lower case with single blanks; they need a unit.
NAMES = {
    "t": "t",
    "time": "t",
    "theta": "theta",
    "θ": "theta",
    "rotation": "theta",
    "rotation angle": "theta",
    "angle": "theta",
    "angle of rotation": "theta",
    "rocking angle": "theta",
    "tilt": "theta",
    "tilt angle": "theta",
    "theta dot": "theta_dot",
    "rotation rate": "theta_dot",
    "rotational velocity": "theta_dot",
    "angular velocity": "theta_dot",
    "x": "x",
    "y": "y",
    "slip": "slip",
    "sliding": "slip",
    "x dot": "x_dot",
    "y dot": "y_dot",
    "slip rate": "slip_rate",
    "sliding velocity": "slip_rate",
}
#: What units are spelt like, in lower case without blanks.
_SPELLINGS = {
    "s": ("s", "sec", "secs", "second", "seconds"),
    "ms": ("ms", "msec", "millisecond", "milliseconds"),
    "rad": ("rad", "rads", "radian", "radians"),
    "mrad": ("mrad", "milliradian", "milliradians"),
    "deg": ("deg", "degs", "degree", "degrees", "°", "º"),
    "m": ("m", "metre", "metres", "meter", "meters"),
    "cm": ("cm",),
    "mm": ("mm",),
    "in": ("in", "inch", "inches"),
}
_UNIT_OF = {word: unit for unit, words in _SPELLINGS.items() for word in words}
_PER_SECOND = re.compile(r"(.+?)(?:/s(?:ec)?|_s|[·*]?s\^?-1)")
_BRACKETED = re.compile(r"(.*?)[\[(]([^\[\]()]{1,20})[\])]")
_AFTER_COMMA = re.compile(r"(.*),([^,]{1,20})")


def unit_of(text: str) -> str:
    """The unit that a text spells, as a name of a column has it: `deg_s` for "°/s"; "" if none."""
    word = re.sub(r"\s+", "", text).strip("[]().").lower()
    if word in _UNIT_OF:
        return _UNIT_OF[word]
    rate = _PER_SECOND.fullmatch(word)
    if rate is not None and rate[1] in _UNIT_OF:
        return f"{_UNIT_OF[rate[1]]}_s"
    return ""


def meanings_of(names: Sequence[str], units: Sequence[str] = ()) -> dict[str, tuple[int, float]]:
    """By quantity the number of its column, from 0, and the factor to SI units.

    `units` is a row of units below the names. A name of `COLUMNS` without a unit is in SI units;
    names that other programs give count where no such name is there, and need a unit. Raises
    `InputError` for a unit that a quantity cannot have, and for what is there twice.
    """
    stated = units or [""] * len(names)
    columns: dict[str, tuple[int, float]] = {}
    for index, (name, unit) in enumerate(zip(names, stated, strict=True)):
        quantity, own_unit = _plain_parts(name)
        if quantity:
            has_unit = bool(own_unit or unit)
            factor = _factor(name, quantity, own_unit or unit) if has_unit else 1.0
            _add(columns, names, quantity, index, factor)
    foreign: dict[str, tuple[int, float]] = {}
    for index, (name, unit) in enumerate(zip(names, stated, strict=True)):
        quantity, own_unit = _foreign_parts(name)
        if quantity and quantity not in columns:
            _add(foreign, names, quantity, index, _factor(name, quantity, own_unit or unit))
    _check_twice(names)
    return columns | foreign


def _add(
    columns: dict[str, tuple[int, float]],
    names: Sequence[str],
    quantity: str,
    index: int,
    factor: float,
) -> None:
    """Add the column of a quantity; raises `InputError` where the quantity has one."""
    if quantity in columns:
        other = names[columns[quantity][0]]
        raise InputError(
            f"column {printable(names[index])!r} gives {quantity} a second time, beside"
            f" {printable(other)!r}"
        )
    columns[quantity] = (index, factor)


def names_motion(names: Sequence[str]) -> bool:
    """Whether there are names of a time and of a rotation among them."""
    quantities = {_plain_parts(name)[0] or _foreign_parts(name)[0] for name in names}
    return {"t", "theta"} <= quantities


def _plain_parts(name: str) -> tuple[str, str]:
    """The quantity of a history's own name, and its unit; "" for another name."""
    plain = re.sub(r"^time(?=_|$)", "t", name)
    if plain in COLUMNS:
        return plain, ""
    quantity = max((q for q in UNITS if plain.startswith(f"{q}_")), key=len, default="")
    return (quantity, plain[len(quantity) + 1 :]) if quantity else ("", "")


def _foreign_parts(name: str) -> tuple[str, str]:
    """The quantity of a name that another program gives, and its unit; "" for something else."""
    if _plain_parts(name)[0]:
        return "", ""
    words, unit = _split(name)
    return NAMES.get(words, ""), unit


def _split(name: str) -> tuple[str, str]:
    """The words of a name, and the unit at its end: in brackets, after a comma, or alone."""
    for pattern in (_BRACKETED, _AFTER_COMMA):
        match = pattern.fullmatch(name.strip())
        if match is not None:
            return _bare(match[1]), match[2]
    words = re.split(r"[\s_]+", name.strip())
    if len(words) > 1 and unit_of(words[-1]):
        return _bare(" ".join(words[:-1])), words[-1]
    return _bare(name), ""


def _bare(text: str) -> str:
    """A name in lower case with single blanks."""
    return re.sub(r"[\s_.-]+", " ", text).strip().lower()


def _factor(name: str, quantity: str, unit: str) -> float:
    """The SI value of a unit of the quantity."""
    known = UNITS.get(quantity, {})
    spelt = unit if unit in known else unit_of(unit)
    if spelt in known:
        return known[spelt]
    raise InputError(f"column {printable(name)!r}: give a unit of {quantity}: {', '.join(known)}")


def _check_twice(names: Sequence[str]) -> None:
    """Raise `InputError` for a name that is there twice."""
    for name, count in Counter(filter(None, names)).items():
        if count > 1:
            shown = printable(name)
            raise InputError(f"column {shown!r} gives {shown} a second time")
