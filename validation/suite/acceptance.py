"""`accept`: make the figures of a run the expected ones in the suite's tolerance file.

The file keeps its comments and order.
"""

import math
import re
from collections.abc import Iterable, Mapping
from itertools import chain
from typing import Any

import tomlkit

from rockcheck.scenes import InputError, printable, reading, writing
from rockcheck.validation.suite import results, suites, tolerances

#: Limit and drift band of a new line: multiples of a difference from the perfect value, and of a
#: cell's own figure.
ROOM, DRIFT = 2.0, 0.2
OWN_ROOM, OWN_DRIFT = 0.02, 0.002
#: The least limit and drift band of new lines: multiples of the measure's resolution, and a share
#: of the limit.
LEAST_LIMIT, LEAST_DRIFT, LEAST_SHARE = 10.0, 1.0, 0.01


def accept(
    suite: suites.Suite, run: results.Run, reason: str | None, *, write: bool = True
) -> tuple[list[str], list[str]]:
    """Write the figures of `run` into the tolerance file of `suite`.

    Returns the changes and the refusals, a line each. A change is new, tightened (to a better
    value), loosened (a wider limit) or moved (another expected value); the last two need a
    `reason`, which goes into the file. A check without a figure, and a line that would not pass
    now, is always refused; a figure that is not defined needs no line. Without `write` the file
    stays as it is.
    """
    checks = [pair for pair in run.checks() if pair[1].verdict != "not defined"]
    found = [
        _accepted_in(
            part,
            [(c, one) for c, one in checks if c.scene in part.scenes or c.scene in part.ensembles],
            reason,
            write,
        )
        for part in suite.parts
    ]
    changes, refused = (list(chain.from_iterable(lines)) for lines in zip(*found, strict=True))
    return changes, refused


def _accepted_in(
    suite: suites.Suite,
    checks: Iterable[tuple[results.Cell, results.Check]],
    reason: str | None,
    write: bool,
) -> tuple[list[str], list[str]]:
    path, changes, refused = suite.tolerances_path, list[str](), list[str]()
    document = tomlkit.parse(reading.read_text(path)) if path.exists() else tomlkit.document()
    tables: Any = (
        document.setdefault("tolerances", tomlkit.table()) if path == suite.path else document
    )
    for cell, check in checks:
        against, line = check.figure.against or tolerances.OWN_FIGURES, _accepted(check, reason)
        where = f"[{cell.scene}.{cell.model}.{against}] {check.figure.windowed}"
        old = {name: getattr(check, name) for name in tolerances.Tolerance.model_fields}
        if isinstance(line, str):
            refused.append(f"{where}: {line}")
        elif line != old:
            changes.append(f"{where}: {_named(check, line)}: {_shown(old)} -> {_shown(line)}")
            entry = tomlkit.inline_table()
            entry.update(line)
            table = (
                tables.setdefault(cell.scene, tomlkit.table(is_super_table=True))
                .setdefault(cell.model, tomlkit.table(is_super_table=True))
                .setdefault(against, tomlkit.table())
            )
            table[check.figure.windowed] = entry
    if write and changes:
        try:
            writing.write_whole(path, re.sub(r"}\n+\[", "}\n\n[", tomlkit.dumps(document)))
        except OSError as error:
            raise InputError(f"{printable(path)}: cannot be written: {error.strerror}") from None
    return changes, refused


def _accepted(check: results.Check, reason: str | None) -> dict[str, Any] | str:
    """The new line of a check, or why there is none."""
    value, new = check.figure.value, check.limit is None
    if value is None or not math.isfinite(value) or check.gap:
        return check.gap or check.reason
    worse = check.verdict in ("fail", "changed") and not new
    if worse and not reason:
        return f"{check.reason}; moving what is expected needs --reason"
    why = (reason or "first accepted figure") if new else (reason if worse else check.why)
    expected = value if check.verdict != "pass" or check.expected is None else check.expected
    limit, drift = _bounds(check, value)
    line: dict[str, Any] = {
        "expected": float(f"{expected:.8g}"),
        "limit": limit,
        "drift": drift,
        "why": why,
    }
    again = tolerances.judge(
        check.figure,
        tolerances.Tolerance(**line),
        kind=check.kind,
        measure=tolerances.MEASURES[check.figure.measure],
        floor=check.floor,
    )
    return line if again.verdict == "pass" else again.reason


def _bounds(check: results.Check, value: float) -> tuple[float, float]:
    """Limit and drift band of the new line: the old ones, of a better error tighter if need be.

    The room of a first line where there is none, or where the limit is exceeded.
    """
    measure = tolerances.MEASURES[check.figure.measure]
    size, at_least = abs(value - (measure.ideal or 0.0)), measure.sense == "at least"
    room, band = (OWN_ROOM, OWN_DRIFT) if measure.ideal is None else (ROOM, DRIFT)
    limit = (
        _round(0.9 * value, down=True)
        if at_least
        else _round(max(room * size, LEAST_LIMIT * measure.resolution))
    )
    drift = _round(max(band * size, LEAST_SHARE * limit, LEAST_DRIFT * measure.resolution))
    if measure.yes_no:
        limit, drift = size, 0.0  # 0: must be yes; 1: need not be
    tighter = check.verdict == "better" and measure.role == "error"
    if check.limit is not None and check.verdict != "fail":
        stricter = max if at_least else min
        limit = stricter(check.limit, limit) if tighter else check.limit
    if check.drift is not None:
        drift = min(check.drift, drift) if tighter else check.drift
    return limit, drift


def _named(check: results.Check, line: Mapping[str, Any]) -> str:
    if check.limit is None:
        return "new"
    at_least = tolerances.MEASURES[check.figure.measure].sense == "at least"
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
