"""Accepting: the figures of a run become the expected ones, in the suite's tolerance files.

In go a suite and a run; out come the changes and the refusals, a line each, and changed files.
`rockcheck accept` calls it. A file keeps its comments and order.
"""

import math
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import tomlkit

from rockcheck.scenes import InputError, printable, reading, writing
from rockcheck.validation.discrepancy import figures
from rockcheck.validation.suite import results
from rockcheck.validation.suite.suites import Suite
from rockcheck.validation.suite.tolerances import CELL_FIGURES, MEASURES, Tolerance, ToleranceKey
from rockcheck.validation.suite.verdicts import judge

#: Limit and drift band of a new line: multiples of a difference from the perfect value, and of a
#: cell's own figure.
ROOM, DRIFT = 2.0, 0.2
FIGURE_ROOM, FIGURE_DRIFT = 0.02, 0.002
#: The least limit and drift band of new lines: multiples of the measure's resolution, and a share
#: of the limit.
LEAST_LIMIT, LEAST_DRIFT, LEAST_SHARE = 10.0, 1.0, 0.01


def accept(
    suite: Suite, run: results.Run, reason: str | None, *, write: bool = True
) -> tuple[list[str], list[str]]:
    """Write the figures of `run` into the tolerance file of `suite`.

    Returns the changes and the refusals, a line each. A change is new, tightened (to a better
    value), loosened (a wider limit) or moved (another expected value); the last two need a
    `reason`, which goes into the file. A check without a figure, and a line that would not pass
    now, is always refused; a figure that is not defined needs no line. Without `write` the file
    stays as it is.
    """
    changes: list[str] = []
    refusals: list[str] = []
    for member in suite.members:
        checks = [
            (cell, check)
            for cell, check in run.checks()
            if check.verdict != "not defined"
            and (cell.scene in member.scenes or cell.scene in member.ensembles)
        ]
        member_changes, member_refusals = _accept_in_file(
            member.tolerances_path,
            checks,
            reason,
            nested=member.tolerances_path == member.path,
            write=write,
        )
        changes += member_changes
        refusals += member_refusals
    return changes, refusals


def _accept_in_file(
    path: Path,
    checks: Iterable[tuple[results.Cell, results.Check]],
    reason: str | None,
    *,
    nested: bool,
    write: bool,
) -> tuple[list[str], list[str]]:
    """Write the figures of these checks into a tolerance file; see `accept`.

    `nested`: into the table `[tolerances]` of a suite file. Raises `InputError` for a file whose
    form cannot be kept.
    """
    changes: list[str] = []
    refusals: list[str] = []
    document = tomlkit.parse(reading.read_text(path)) if path.exists() else tomlkit.document()
    tables: Any = document.setdefault("tolerances", tomlkit.table()) if nested else document
    try:
        for cell, check in checks:
            against = check.figure.against or CELL_FIGURES
            key = ToleranceKey(cell.scene, cell.model, against, check.figure.windowed)
            old_line = {name: getattr(check, name) for name in Tolerance.model_fields}
            line = _new_line(check, reason)
            if isinstance(line, str):
                refusals.append(f"{key}: {line}")
            elif line != old_line:
                move = f"{_shown(old_line)} -> {_shown(line)}"
                changes.append(f"{key}: {_change(check, line)}: {move}")
                _write_line(tables, key, line)
        text = tomlkit.dumps(document)
        is_unharmed = tomllib.loads(text) == document.unwrap()
    except ValueError:  # tables in one line, or keys with points
        is_unharmed = False
    if not is_unharmed:
        raise InputError(
            f"{printable(path)}: cannot be changed: write a table a scene, model and reference,"
            " [scene.model.reference]",
            file=path,
        )
    if write and changes:
        writing.write_whole(path, re.sub(r"}\n+\[", "}\n\n[", text), named=True)
    return changes, refusals


def _write_line(tables: Any, key: ToleranceKey, line: Mapping[str, Any]) -> None:
    """Put a line into the tables of a file."""
    of_scene = tables.setdefault(key.scene, tomlkit.table(is_super_table=True))
    of_model = of_scene.setdefault(key.model, tomlkit.table(is_super_table=True))
    entry = tomlkit.inline_table()
    entry.update(line)
    of_model.setdefault(key.against, tomlkit.table())[key.windowed] = entry


def _new_line(check: results.Check, reason: str | None) -> dict[str, Any] | str:
    """The new line of a check, or why there is none."""
    value = check.figure.value
    if value is None or not math.isfinite(value) or check.gap:
        return check.gap or check.reason
    is_new = check.limit is None
    is_worse = check.verdict in ("fail", "changed") and not is_new
    if is_worse and not reason:
        return f"{check.reason}; moving what is expected needs --reason"
    why = check.why
    if is_new:
        why = reason or "first accepted figure"
    elif is_worse and reason:
        why = reason
    if check.verdict == "pass" and check.expected is not None:
        expected = check.expected
    else:
        expected = _short(value, check.limit, check.drift)
    limit, drift = _bounds(check, value, abs(value - expected))
    line: dict[str, Any] = {"expected": expected, "limit": limit, "drift": drift, "why": why}
    again = judge(
        check.figure,
        Tolerance(**line),
        kind=check.kind,
        measure=MEASURES[check.figure.measure],
        floor=check.floor,
    )
    return line if again.verdict == "pass" else again.reason


def _short(value: float, limit: float | None, drift: float | None) -> float:
    """`value` with eight digits where there is room for rounding in limit and drift band."""
    for bound in (limit, drift):
        if bound is not None and bound <= 1e-7 * abs(value):
            return value
    return float(f"{value:.8g}")


def _bounds(check: results.Check, value: float, moved: float) -> tuple[float, float]:
    """Limit and drift band of the new line: the old ones, of a better error tighter if need be.

    The room of a first line where there is none, or where the limit is exceeded. A value that has
    `moved` within a line without a band stays within its new one.
    """
    measure = MEASURES[check.figure.measure]
    size = abs(value - (measure.ideal or 0.0))
    limit, drift = _first_bounds(measure, value, size, moved)
    tighter = check.verdict == "better" and measure.is_error
    if check.limit is not None and check.verdict != "fail":
        stricter = max if measure.sense == "at least" else min
        limit = stricter(check.limit, limit) if tighter else check.limit
    if check.drift is not None:
        drift = min(check.drift, drift) if tighter else check.drift
    return limit, drift


def _first_bounds(
    measure: figures.Measure, value: float, size: float, moved: float
) -> tuple[float, float]:
    """Limit and drift band of a first line; `size` is the distance from the perfect value."""
    if measure.yes_no:
        return size, moved  # 0: must be yes; 1: need not be
    room, band = (FIGURE_ROOM, FIGURE_DRIFT) if measure.ideal is None else (ROOM, DRIFT)
    if measure.sense == "at least":
        limit = _round(0.9 * value, down=True)
    else:
        limit = _round(max(room * size, LEAST_LIMIT * measure.resolution))
    least_drift = max(LEAST_SHARE * limit, LEAST_DRIFT * measure.resolution)
    return limit, _round(max(band * size, least_drift, 1.1 * moved))


def _change(check: results.Check, line: Mapping[str, Any]) -> str:
    """What becomes of a line: new, loosened, tightened or moved."""
    if check.limit is None:
        return "new"
    if MEASURES[check.figure.measure].sense == "at least":
        is_looser = line["limit"] < check.limit
    else:
        is_looser = line["limit"] > check.limit
    if is_looser:
        return "loosened"
    return "tightened" if check.weight == "pass" else "moved"


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
