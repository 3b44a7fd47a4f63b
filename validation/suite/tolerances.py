"""Tolerances: what each figure was expected to be, how far it may go, and the verdict on what it is.

A tolerance file is TOML; a table a scene, model and reference, a line a measure:

    [fig5a.mujoco.ebm-unilateral]
    "theta_rms@8s" = { expected = 2.3e-4, limit = 2e-3, drift = 1e-4, why = "first-order step error, prototype 2e-4" }

The third name is the reference model, or "figures" for a figure of the cell itself, its distance from a closed form among
them. The first may be "*", every scene that the model plays: such a line holds where a scene has none of its own, and gives
what a scene's own line leaves out:

    ["*".mujoco.ebm-unilateral]
    outcome_agrees = { expected = 1.0, limit = 0.0, drift = 0.0, why = "the same outcome" }
    "theta_rms@8s" = { why = "first-order step error" }

`@` bounds the window: seconds, or `@horizon`. `limit` bounds the distance from the perfect value (from `expected`
for figures of the cell itself; for "at least" measures the value itself). Within the limit, but further than `drift` from
`expected`, is *changed*. All in the measure's unit.
"""

from __future__ import annotations

import math
import re
from collections import ChainMap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from rockcheck.scenes import InputError
from rockcheck.scenes.base import Finite, Frozen, NonNegative
from rockcheck.scenes.errors import printable, unknown_name
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.discrepancy.measures import DIFFERENCES, FIGURES, Measure
from rockcheck.validation.discrepancy.statistics import STATISTICS
from rockcheck.validation.suite.results import Check, CheckVerdict, Kind

MEASURES: Mapping[str, Measure] = ChainMap(DIFFERENCES, FIGURES, STATISTICS)
#: The third name of a table that is not a reference model.
OWN_FIGURES = "figures"
HORIZON = "horizon"
#: The first name of a table that holds for every scene.
EVERY = "*"


@dataclass(frozen=True, order=True)
class Windowed:
    """A measure over a window: "theta_rms", "theta_rms@8s" or "theta_rms@horizon"."""

    measure: str
    window: str = ""

    @classmethod
    def parse(cls, text: str) -> Windowed:
        """Read "measure@window"; raises `InputError` for an unknown measure or a window that is none."""
        name, at, window = text.partition("@")
        if name not in MEASURES:
            raise unknown_name("measure", name, MEASURES)
        if at and window != HORIZON and not re.fullmatch(r"\d+(\.\d+)?s", window):
            raise InputError(f"window {printable(window)!r} of {name}: give seconds such as 8s, or {HORIZON}")
        return cls(name, window)

    @property
    def seconds(self) -> float | None:
        """The window's end in s, None for the whole time and for the horizon."""
        return float(self.window[:-1]) if self.window.endswith("s") else None

    @property
    def definition(self) -> Measure:
        """The measure itself."""
        return MEASURES[self.measure]

    def __str__(self) -> str:
        return f"{self.measure}@{self.window}" if self.window else self.measure


class Tolerance(Frozen):
    """One line of a tolerance file; see the module."""

    limit: NonNegative
    expected: Finite | None = None
    drift: NonNegative | None = None
    why: str = ""


@dataclass(frozen=True, order=True)
class Place:
    """Where a tolerance belongs: scene, model, what it is held against, and the windowed measure."""

    scene: str
    model: str
    against: str
    what: Windowed

    def __str__(self) -> str:
        return f"{self.scene}.{self.model}.{self.against}: {self.what}"


Tolerances = dict[Place, Tolerance]
_Path = tuple[str, ...]


def parse_tolerances(tables: Mapping[str, Any], cells: Iterable[tuple[str, str]] = ()) -> Tolerances:
    """The tolerances in the tables of a file; a line for every scene becomes one for each of `cells` (scene, model).

    Raises `InputError` naming the place of whatever is not usable.
    """
    found: Tolerances = {}
    for (scene, model, against, key), line in _spread(dict(_lines(tables, depth=4)), cells):
        where = f"[{scene}.{model}.{against}] {key}"
        try:
            place = Place(scene, model, against, Windowed.parse(key))
            if not isinstance(line, Mapping):
                raise InputError("must be a table { expected, limit, drift, why }")
            tolerance = Tolerance(**line)
            measure = place.what.definition
            if (measure.name in FIGURES) != (against == OWN_FIGURES):
                raise InputError(f"figures of a cell itself, and only they, stand under {OWN_FIGURES!r}")
            if measure.ideal is None and measure.sense == "at most" and tolerance.expected is None:
                raise InputError("is missing", "expected")
        except InputError as error:
            raise InputError(f"{printable(where)}: {error}") from None
        found[place] = tolerance
    return found


def _spread(lines: Mapping[_Path, Any], cells: Iterable[tuple[str, str]]) -> Iterator[tuple[_Path, Any]]:
    """The lines with those for every scene at each of the model's cells, below what the scene itself says."""
    played = list(cells)
    common = {path: line for path, line in lines.items() if path[0] == EVERY}
    for path, line in lines.items():
        below = common.get((EVERY, *path[1:]))
        if path[0] != EVERY:
            yield path, {**below, **line} if isinstance(below, Mapping) and isinstance(line, Mapping) else line
    for (_, *rest), line in common.items():
        scenes = [scene for scene, model in played if model == rest[0]]
        completes = any(path[0] != EVERY and path[1:] == tuple(rest) for path in lines)
        if completes and isinstance(line, Mapping) and "limit" not in line:
            continue
        # Where no cell is run it stays as it is, and is reported as a tolerance without a cell.
        yield from (((scene, *rest), line) for scene in scenes or [EVERY] if (scene, *rest) not in lines or scene == EVERY)


def _lines(tables: Mapping[str, Any], depth: int, above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    for name, inner in tables.items():
        path = (*above, str(name))
        if len(path) == depth:
            yield path, inner
        elif isinstance(inner, Mapping):
            yield from _lines(inner, depth, path)
        else:
            raise InputError(f"{printable('.'.join(path))}: must be tables [scene.model.reference]")


def judge(figure: Figure, tolerance: Tolerance | None, *, kind: Kind, measure: Measure, gap: str = "") -> Check:
    """The verdict on a figure. What is missing, not finite or not compared over the whole window never passes."""
    given = tolerance or Tolerance(limit=0.0)
    ideal = measure.ideal if measure.sense == "at least" or measure.ideal is not None else given.expected
    value = figure.value
    verdict: CheckVerdict = "fail"
    reason = ""
    if value is None or not math.isfinite(value):
        reason = figure.note or "not a number"
    elif gap:
        reason = gap
    elif tolerance is None:
        reason = "no tolerance yet"
    elif measure.sense == "at least" and not value >= tolerance.limit:
        reason = f"{value:.4g} is below the limit {tolerance.limit:.4g}"
    elif measure.sense == "at most" and (ideal is None or not abs(value - ideal) <= tolerance.limit):
        away = "" if not ideal else f" from {ideal:.6g}"
        reason = f"{value:.4g} is more than {tolerance.limit:.4g}{away}" if tolerance.limit else f"{value:.6g}, not {ideal:.6g}"
        if not tolerance.limit and figure.note:
            reason += f" ({figure.note})"
    elif tolerance.expected is not None and tolerance.drift is not None and not abs(value - tolerance.expected) <= tolerance.drift:
        verdict, reason = "changed", f"{value:.6g} was {tolerance.expected:.6g} (drift allowed {tolerance.drift:.2g})"
    else:
        verdict = "pass"
    return Check(
        figure=figure,
        kind=kind,
        verdict=verdict,
        reason=reason,
        ideal=ideal,
        expected=given.expected,
        limit=None if tolerance is None else tolerance.limit,
        drift=given.drift,
        why=given.why,
        gap=gap,
    )
