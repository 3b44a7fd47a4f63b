"""Numbers and names as people read them, for the templates."""

from __future__ import annotations

import re
from datetime import datetime

from rockcheck.reports.show.words import SUPERSCRIPTS, number
from rockcheck.reports.style import Look
from rockcheck.validation.discrepancy.figures import Figure

_POWER = re.compile(r"(?<![\w.])([+-]?\d+(?:\.\d+)?)e([+-]?\d+)(?![\w.]\w)")
_MINUS = re.compile(r"(?<![\w.)\]-])-(?=\.?\d)")


def readable(text: str) -> str:
    """A sentence whose numbers do not break at a hyphen: -1.2e-3 as −1.2·10⁻³."""
    shown = _POWER.sub(
        lambda found: f"{found[1]}·10{str(int(found[2])).translate(SUPERSCRIPTS)}", text
    )
    return _MINUS.sub("−", shown)


def unit(name: str) -> str:
    """A unit for people."""
    return {"alpha": "α", "1": ""}.get(name, name)


def duration(seconds: float) -> str:
    """A time in s or ms."""
    return f"{seconds:.1f} s" if seconds >= 1.0 else f"{1e3 * seconds:.3g} ms"


def moment(created: str) -> str:
    """An ISO 8601 time to the minute. Any other text, as a run from elsewhere may hold, is returned
    unchanged."""
    try:
        return f"{datetime.fromisoformat(created):%Y-%m-%d %H:%M %Z}"
    except ValueError:
        return created


def ratio(value: float | None) -> str:
    """A ratio with its sign of multiplication."""
    if value is None:
        return "–"
    return f"{value:,.0f}×".replace(",", "\u202f") if value >= 100.0 else f"{number(value, 2)}×"


def window(figure: Figure) -> str:
    """The window of a figure in words."""
    if figure.window == "horizon":
        return "to the horizon" + (
            f" ({number(figure.until)} s)" if figure.until is not None else ""
        )
    return f"first {number(figure.until)} s" if figure.until is not None else "whole run"


def dash_array(look: Look) -> str:
    """The dash pattern of a model as SVG has it."""
    return " ".join(f"{2.0 * length:g}" for length in look.dash) or "none"
