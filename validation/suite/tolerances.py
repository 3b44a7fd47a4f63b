"""Tolerances: the expected value of each figure, its limits, and the verdict on its value.

A tolerance file is TOML; a table a scene, model and reference, a line a measure:

    [fig5a.mujoco.ebm-unilateral]
    "theta_rms@8s" = { expected = 2.3e-4, limit = 2e-3, drift = 1e-4, why = "first-order error" }

The third name is the reference model, or "figures" for a figure of the cell itself, its distance
from a closed form among them. The first may be "*", every scene that the model plays: such a line
holds where a scene has no line for the measure, and completes a scene's own line:

    ["*".mujoco.ebm-unilateral]
    outcome_agrees = { expected = 1.0, limit = 0.0, drift = 0.0, why = "the same outcome" }
    "theta_rms@8s" = { why = "first-order step error" }

`@` bounds the window: seconds, or `@horizon`. `limit` bounds the distance from the perfect value
(from `expected` for figures of the cell itself; for "at least" measures the value itself). All in
the measure's unit.

The judgement of a figure depends on its measure:

| measure | distance within `limit` | better, where it moved by more than `drift` |
|---|---|---|
| error (has a perfect value) | from the perfect value | that distance fell by more than it |
| quantity | from `expected`, beyond its floor | it came nearer to the reference's by more |

The move of a figure is its difference from `expected`, counting only the parts beyond their floor
(`floor_of`; a count has none): two values below it do not differ. The limit of an error is not
changed by the floor. A figure that moved by more than `drift` is *better* if the last column holds,
else *changed*; better passes, even for a quantity beyond its limit. A quantity is better only where
the reference solves the same equations and is itself as expected (`runner`). A ratio to zero is
*not defined*.
"""

import math
import re
import tomllib
from collections import ChainMap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import tomlkit

from rockcheck.scenes import (
    Finite,
    Frozen,
    InputError,
    NonNegative,
    Scene,
    errors,
    printable,
    reading,
    writing,
)
from rockcheck.validation.discrepancy import figures, measures
from rockcheck.validation.suite import results
from rockcheck.validation.uncertainty.numerical import Numerical

MEASURES: Mapping[str, figures.Measure] = ChainMap(
    measures.DIFFERENCES, measures.FIGURES, measures.STATISTICS
)
#: In place of a measure that only another version has: nothing is known of it.
UNKNOWN = figures.Measure("", "", "", "", float, resolution=0.0)
#: The third name of a table of a cell's own figures, in place of a reference model.
OWN_FIGURES = "figures"
HORIZON = "horizon"
#: The first name of a table that holds for every scene.
EVERY = "*"
#: By unit, the quantity whose numerical uncertainty is used for the others.
STANDS_FOR = {"angle": "theta_rms", "m": "last_slip", "s": "end_time"}


def measure_of(what: str) -> figures.Measure:
    """The measure of "theta_rms", "theta_rms@8s" or "theta_rms@horizon".

    Raises `InputError` for an unknown measure or bad window.
    """
    name, at, window = what.partition("@")
    errors.one_of("measure", name, MEASURES)
    if at and window != HORIZON and not re.fullmatch(r"(?=.*[1-9])\d+(\.\d+)?s", window):
        raise InputError(
            f"window {printable(window)!r} of {name}: give seconds such as 8s, or {HORIZON}"
        )
    return MEASURES[name]


def known(name: str) -> figures.Measure:
    """The measure of a figure of any run; `UNKNOWN` where this version has none of that name."""
    return MEASURES.get(name, UNKNOWN)


class Tolerance(Frozen):
    """One line of a tolerance file; see the module."""

    limit: NonNegative
    expected: Finite | None = None
    drift: NonNegative | None = None
    why: str = ""


class ToleranceKey(NamedTuple):
    """What a tolerance is for: scene, model, reference or "figures", and "measure@window"."""

    scene: str
    model: str
    against: str
    windowed: str

    @property
    def measure(self) -> str:
        """The name of the measure."""
        return self.windowed.partition("@")[0]

    @property
    def window(self) -> str:
        """The window, such as "8s"; empty for the whole time."""
        return self.windowed.partition("@")[2]

    def __str__(self) -> str:
        return f"[{self.scene}.{self.model}.{self.against}] {self.windowed}"


Tolerances = dict[ToleranceKey, Tolerance]


def parse_tolerances(
    tables: Mapping[str, Any], cells: Iterable[tuple[str, str]] = ()
) -> Tolerances:
    """The tolerances in the tables of a file.

    A line for every scene becomes one for each of `cells` (scene, model). Raises `InputError`
    naming the place of an unusable line.
    """
    tolerances: Tolerances = {}
    for key, line in _spread(dict(_lines(tables)), list(cells)):
        try:
            tolerances[key] = _tolerance(key, line)
        except InputError as error:
            raise InputError(f"{printable(key)}: {error}") from None
    return tolerances


def _tolerance(key: ToleranceKey, line: Mapping[str, Any]) -> Tolerance:
    """A validated line."""
    measure = measure_of(key.windowed)
    tolerance = Tolerance(**line)
    if (measure.name in measures.FIGURES) != (key.against == OWN_FIGURES):
        raise InputError(f"figures of a cell itself, and only they, stand under {OWN_FIGURES!r}")
    if tolerance.expected is None and not measure.is_error:
        raise InputError("is missing", "expected")
    return tolerance


def _spread(
    lines: Mapping[ToleranceKey, Mapping[str, Any]], cells: Sequence[tuple[str, str]]
) -> Iterator[tuple[ToleranceKey, Mapping[str, Any]]]:
    """The lines, with those for every scene repeated for each cell of the model.

    A scene's own line takes precedence; what it leaves out comes from the line for every scene.
    """
    of_a_scene = {key: line for key, line in lines.items() if key.scene != EVERY}
    for key, line in of_a_scene.items():
        yield key, {**lines.get(key._replace(scene=EVERY), {}), **line}
    completed = {key[1:] for key in of_a_scene}
    for key, line in lines.items():
        if key.scene != EVERY or (key[1:] in completed and "limit" not in line):
            continue
        # Without a cell the line stays as it is, and is reported as a tolerance without a cell.
        scenes = [scene for scene, model in cells if model == key.model] or [EVERY]
        for scene in scenes:
            cell_key = key._replace(scene=scene)
            if cell_key not in of_a_scene:
                yield cell_key, line


def _lines(
    tables: Mapping[str, Any], *above: str
) -> Iterator[tuple[ToleranceKey, Mapping[str, Any]]]:
    """The lines of nested tables; `above` are the names of the tables that these lie in."""
    for name, inner in tables.items():
        path = (*above, str(name))
        is_line = len(path) == len(ToleranceKey._fields)
        if not isinstance(inner, Mapping):
            if is_line:
                key = printable(ToleranceKey(*path))
                raise InputError(f"{key}: must be a table {{ expected, limit, drift, why }}")
            table = printable(".".join(path))
            raise InputError(f"{table}: must be tables [scene.model.reference]")
        if is_line:
            yield ToleranceKey(*path), inner
        else:
            yield from _lines(inner, *path)


def floor_of(measure: figures.Measure, scene: Scene, numerical: Numerical | None) -> float:
    """Smallest meaningful value of a cell's figure, in the measure's unit; 0 for a count.

    The largest of the measure's resolution, the run's numerical uncertainty if known, and, for a
    quantity, the error of a chord between rows (`between_rows`). An error is read at the rows' own
    times.
    """
    if not measure.resolution:
        return 0.0
    known = (
        [numerical.u_num(name) for name in (measure.name, STANDS_FOR.get(measure.unit, ""))]
        if numerical
        else []
    )
    rows = (
        figures.between_rows(
            measure.unit, scene.frequency_parameter, scene.gravity, scene.output_step
        )
        if not measure.is_error
        else 0.0
    )
    return max(measure.resolution, rows, next((u for u in known if u is not None), 0.0))


def judge(
    figure: figures.Figure,
    tolerance: Tolerance | None,
    *,
    kind: results.Kind,
    measure: figures.Measure,
    gap: str = "",
    floor: float | None = None,
    beside: float | None = None,
) -> results.Check:
    """The verdict on a figure: a missing, infinite or incompletely compared one never passes.

    `floor` is the figure's (None: its measure's resolution), `beside` the reference's same figure,
    where that is a yardstick.
    """
    given = tolerance or Tolerance(limit=0.0)
    least = measure.resolution if floor is None else floor
    value = figure.value
    verdict: results.CheckVerdict = "fail"
    if figure.undefined:
        verdict, reason = "not defined", figure.note
    elif value is None or not math.isfinite(value):
        reason = figure.note or "not a number"
    elif gap or tolerance is None:
        reason = gap or "no tolerance yet"
    else:
        perfect = measure.ideal if measure.is_error else beside
        verdict, reason = _verdict(figure, value, tolerance, measure, least, kind, perfect)
    return results.Check(
        figure=figure,
        kind=kind,
        verdict=verdict,
        reason=reason,
        ideal=measure.ideal if measure.is_error else given.expected,
        expected=given.expected,
        limit=None if tolerance is None else tolerance.limit,
        drift=given.drift,
        why=given.why,
        gap=gap,
        floor=least,
        beside=beside,
    )


def _verdict(
    figure: figures.Figure,
    value: float,
    line: Tolerance,
    measure: figures.Measure,
    floor: float,
    kind: results.Kind,
    perfect: float | None,
) -> tuple[results.CheckVerdict, str]:
    """The verdict by the table at the top of this module, and why the figure is no plain pass.

    `perfect`: the value to which a better one is nearer, None where it is not known.
    """
    expected, drift = line.expected, math.inf if line.drift is None else line.drift
    moved = 0.0 if expected is None else apart(value, expected, floor, measure.ideal or 0.0)
    outside = _outside(figure, value, line, measure, moved)
    if outside and measure.is_error:
        return "fail", outside
    if expected is None or not (outside or moved > drift):
        return "pass", ""
    if measure.sense == "at least":
        nearer = value - expected
    else:
        nearer = 0.0 if perfect is None else abs(expected - perfect) - abs(value - perfect)
    if kind != "model form" and nearer > (line.drift or 0.0):
        return "better", f"{value:.6g} was {expected:.6g}" + (
            f", nearer to {perfect:.6g}" if perfect else ""
        )
    return (
        ("fail", outside)
        if outside
        else ("changed", f"{value:.6g} was {expected:.6g} (drift allowed {drift:.2g})")
    )


def _outside(
    figure: figures.Figure, value: float, line: Tolerance, measure: figures.Measure, moved: float
) -> str:
    """Why a figure is beyond its limit, empty if not; `moved` is its distance from `expected`."""
    limit, unit = line.limit, "" if figure.unit == "1" else f" {figure.unit}"
    if measure.sense == "at least":
        return "" if value >= limit else f"{value:.4g} is below the limit {limit:.4g}{unit}"
    ideal = measure.ideal if measure.is_error else line.expected
    away = math.inf if ideal is None else abs(value - ideal) if measure.is_error else moved
    if away <= limit:
        return ""
    if limit:
        beyond = f"{value:.4g} is more than {limit:.4g}" + (f" from {ideal:.6g}" if ideal else "")
        return beyond + unit
    return f"{value:.6g}, not {ideal:.6g}" + (f" ({figure.note})" if figure.note else "")


def apart(value: float, expected: float, floor: float, zero: float = 0.0) -> float:
    """Distance of two values, counting of each only the part beyond `floor` around `zero`.

    The full distance if both are beyond the floor on the same side.
    """
    one, other = value - zero, expected - zero
    if min(abs(one), abs(other)) > floor and one * other > 0.0:
        return abs(value - expected)
    beyond = [math.copysign(max(abs(size) - floor, 0.0), size) for size in (one, other)]
    return abs(beyond[0] - beyond[1])


# `accept`: the figures of a run become the expected ones. The file keeps its comments and order.

#: Limit and drift band of a new line: multiples of a difference from the perfect value, and of a
#: cell's own figure.
ROOM, DRIFT = 2.0, 0.2
OWN_ROOM, OWN_DRIFT = 0.02, 0.002
#: The least limit and drift band of new lines: multiples of the measure's resolution, and a share
#: of the limit.
LEAST_LIMIT, LEAST_DRIFT, LEAST_SHARE = 10.0, 1.0, 0.01


def accepted_in(
    path: Path,
    checks: Iterable[tuple[results.Cell, results.Check]],
    reason: str | None,
    *,
    nested: bool,
    write: bool,
) -> tuple[list[str], list[str]]:
    """Write the figures of these checks into a tolerance file; see `suites.accept`.

    `nested`: into the table `[tolerances]` of a suite file. Raises `InputError` for a file whose
    form cannot be kept.
    """
    changes: list[str] = []
    refused: list[str] = []
    document = tomlkit.parse(reading.read_text(path)) if path.exists() else tomlkit.document()
    tables: Any = document.setdefault("tolerances", tomlkit.table()) if nested else document
    try:
        for cell, check in checks:
            against = check.figure.against or OWN_FIGURES
            key = ToleranceKey(cell.scene, cell.model, against, check.figure.windowed)
            old_line = {name: getattr(check, name) for name in Tolerance.model_fields}
            line = _accepted(check, reason)
            if isinstance(line, str):
                refused.append(f"{key}: {line}")
            elif line != old_line:
                change = f"{_shown(old_line)} -> {_shown(line)}"
                changes.append(f"{key}: {_named(check, line)}: {change}")
                _write_line(tables, key, line)
        text = tomlkit.dumps(document)
        is_kept = tomllib.loads(text) == document.unwrap()
    except ValueError:  # tables in one line, or keys with points
        is_kept = False
    if not is_kept:
        raise InputError(
            f"{printable(path)}: cannot be changed: write a table a scene, model and reference,"
            " [scene.model.reference]",
            file=path,
        )
    if write and changes:
        writing.write_whole(path, re.sub(r"}\n+\[", "}\n\n[", text), named=True)
    return changes, refused


def _write_line(tables: Any, key: ToleranceKey, line: Mapping[str, Any]) -> None:
    """Put a line into the tables of a file."""
    of_scene = tables.setdefault(key.scene, tomlkit.table(is_super_table=True))
    of_model = of_scene.setdefault(key.model, tomlkit.table(is_super_table=True))
    entry = tomlkit.inline_table()
    entry.update(line)
    of_model.setdefault(key.against, tomlkit.table())[key.windowed] = entry


def _accepted(check: results.Check, reason: str | None) -> dict[str, Any] | str:
    """The new line of a check, or why there is none."""
    value, new = check.figure.value, check.limit is None
    if value is None or not math.isfinite(value) or check.gap:
        return check.gap or check.reason
    worse = check.verdict in ("fail", "changed") and not new
    if worse and not reason:
        return f"{check.reason}; moving what is expected needs --reason"
    why = (reason or "first accepted figure") if new else (reason if worse else check.why)
    expected = (
        check.expected
        if check.verdict == "pass" and check.expected is not None
        else _short(value, check.limit, check.drift)
    )
    limit, drift = _bounds(check, value, abs(value - expected))
    line: dict[str, Any] = {
        "expected": expected,
        "limit": limit,
        "drift": drift,
        "why": why,
    }
    again = judge(
        check.figure,
        Tolerance(**line),
        kind=check.kind,
        measure=MEASURES[check.figure.measure],
        floor=check.floor,
    )
    return line if again.verdict == "pass" else again.reason


def _short(value: float, *rooms: float | None) -> float:
    """`value` with eight digits where there is room for rounding in limit and drift band."""
    return (
        value
        if any(room is not None and room <= 1e-7 * abs(value) for room in rooms)
        else float(f"{value:.8g}")
    )


def _bounds(check: results.Check, value: float, moved: float) -> tuple[float, float]:
    """Limit and drift band of the new line: the old ones, of a better error tighter if need be.

    The room of a first line where there is none, or where the limit is exceeded. A value that has
    `moved` within a line without a band stays within its new one.
    """
    measure = MEASURES[check.figure.measure]
    size, at_least = abs(value - (measure.ideal or 0.0)), measure.sense == "at least"
    room, band = (OWN_ROOM, OWN_DRIFT) if measure.ideal is None else (ROOM, DRIFT)
    limit = (
        _round(0.9 * value, down=True)
        if at_least
        else _round(max(room * size, LEAST_LIMIT * measure.resolution))
    )
    drift = _round(
        max(band * size, LEAST_SHARE * limit, LEAST_DRIFT * measure.resolution, 1.1 * moved)
    )
    if measure.yes_no:
        limit, drift = size, moved  # 0: must be yes; 1: need not be
    tighter = check.verdict == "better" and measure.is_error
    if check.limit is not None and check.verdict != "fail":
        stricter = max if at_least else min
        limit = stricter(check.limit, limit) if tighter else check.limit
    if check.drift is not None:
        drift = min(check.drift, drift) if tighter else check.drift
    return limit, drift


def _named(check: results.Check, line: Mapping[str, Any]) -> str:
    if check.limit is None:
        return "new"
    at_least = MEASURES[check.figure.measure].sense == "at least"
    if line["limit"] < check.limit if at_least else line["limit"] > check.limit:
        return "loosened"
    return "tightened" if check.weighs == "pass" else "moved"


def _round(value: float, down: bool = False) -> float:
    """`value` with two digits, rounded up (or down)."""
    unit = 10.0 ** (math.floor(math.log10(abs(value) or 1.0)) - 1)
    steps = math.floor(value / unit) if down else math.ceil(value / unit * (1.0 - 1e-12))
    return float(f"{steps * unit:.2g}")


def _shown(line: Mapping[str, Any]) -> str:
    if line["limit"] is None:
        return "none"
    return ", ".join(
        f"{name} {'-' if line[name] is None else line[name]}"
        for name in ("expected", "limit", "drift")
    )
