"""Verdicts as tables: for the terminal, and as CSV."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from rich.table import Table
from rich.text import Text

from rockcheck.scenes.writing import table_text
from rockcheck.validation.discrepancy.figures import Figure, value_words
from rockcheck.validation.suite.results import MISSING, SEVERITY, Cell, Check, Run, Strict, worst
from rockcheck.validation.suite.tolerances import HORIZON, MEASURES, apart

#: The most scenes that tables and pages show one by one.
MOST_SHOWN = 200
COLOURS = {
    "pass": "green",
    "incomplete": "yellow",
    "changed": "yellow",
    "fail": "red",
    "error": "red",
}


def shown(run: Run, most: int = MOST_SHOWN) -> tuple[str, ...]:
    """The scenes and ensembles that are shown one by one, in the suite's order: all, of a large run
    the worst `most`.

    The worst are those with the worst verdict, and of these the nearest to a limit. Ensembles are
    always shown.
    """
    cells = run.by_scene()
    if len(cells) <= most:
        return tuple(cells)
    ensembles = {ensemble.name for ensemble in run.ensembles}

    def badness(place: str) -> tuple[int, float]:
        of_place = cells[place].values()
        shares = (used(check) for cell in of_place for check in cell.checks)
        return SEVERITY.index(worst([cell.verdict for cell in of_place])), max(shares, default=0.0)

    scenes = [place for place in cells if place not in ensembles]
    chosen = ensembles | set(sorted(scenes, key=badness, reverse=True)[:most])
    return tuple(place for place in cells if place in chosen)


def not_shown(run: Run) -> Iterator[str]:
    """A line that says how many scenes are not `shown`, where some are not."""
    if more := len(run.places) - len(shown(run)):
        yield f"and {more} more scenes, none of them worse; their figures are in figures.csv"


def verdict_table(run: Run) -> Table:
    """A row a cell, within 80 columns: the check that is nearest to its limit, how much of that it
    uses, and the verdict.

    Of a large run, the scenes that are `shown`.
    """
    table = Table(box=None, pad_edge=False, expand=False)
    table.add_column("scene", overflow="ellipsis", no_wrap=True, max_width=22)
    table.add_column("model", overflow="ellipsis", no_wrap=True, max_width=14)
    table.add_column("nearest to its limit", overflow="ellipsis", no_wrap=True, max_width=24)
    table.add_column("used", justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    before = ""
    places = set(shown(run))
    for cell in run.cells:
        if cell.scene not in places:
            continue
        near = nearest(cell)
        judged = windowed(near) if near else "as it must be" if cell.checks else "nothing judged"
        words = judged if cell.status == "done" else cell.reason or "failed"
        verdict = (
            Text("-")
            if cell.status == "done" and not cell.checks
            else Text(cell.words, COLOURS[cell.verdict])
        )
        if cell.converged is False:
            verdict.append(", not converged", "yellow")
        table.add_row(
            "" if cell.scene == before else cell.scene,
            cell.model,
            Text(words),
            percent(near) if near else "",
            verdict,
        )
        before = cell.scene
    return table


def outcome_tables(run: Run) -> Iterator[tuple[str, Table]]:
    """Each scene with a row a model, within 80 columns: what becomes of the block, its peak
    rotation, and how far from the reference."""
    for scene, cells in run.by_scene().items():
        table = Table(box=None, pad_edge=False, expand=False)
        for name, width in (("", 0), ("model", 16), ("outcome", 26)):
            table.add_column(name, overflow="fold", min_width=width)
        for name in ("peak", "apart", "took"):
            table.add_column(name, justify="right", no_wrap=True, min_width=8)
        for cell in cells.values():
            words = cell.fate if cell.status == "done" else cell.reason or "failed"
            colour = {"failed": "red", "done": ""}.get(cell.status, "yellow")
            row = outcome_row(cell, run.reference)
            peak, apart = (
                "" if row[name] is None else f"{row[name]:.3g}"
                for name in ("peak_rotation_alpha", "apart_alpha")
            )
            apart = "ref." if cell.model == run.reference else apart
            took = f"{cell.cost.wall_seconds:.1f} s" if cell.status == "done" else ""
            table.add_row("", cell.model, Text(words, colour), peak, apart, took)
        yield scene, table


def outcome_row(cell: Cell, reference: str) -> dict[str, Any]:
    """What a cell came to, in plain values; `peak_rotation_alpha` is None for a block that fell."""
    figures = {(f.measure, f.against, f.window): f.value for f in cell.figures}
    fell = cell.outcome.startswith("overturned")
    return {
        "scene": cell.scene,
        "model": cell.model,
        "status": cell.status,
        "outcome": cell.outcome or None,
        "overturned_at_s": cell.overturned_at,
        "peak_rotation_alpha": None if fell else figures.get(("peak_rotation", "", "")),
        "apart_alpha": figures.get(("theta_rms", reference, HORIZON)),
        "wall_seconds": cell.cost.wall_seconds,
    }


def summary(run: Run) -> dict[str, Any]:
    """The verdicts in a few plain values: of the run, of each cell, and why anything is not a
    pass."""
    return {
        "suite": run.suite,
        "verdict": run.verdict,
        "exit_code": run.exit_code,
        "wall_seconds": run.wall_seconds,
        "cells": [
            {
                "scene": cell.scene,
                "model": cell.model,
                "outcome": cell.outcome,
                "overturned_at_s": cell.overturned_at,
                "checks": len(cell.checks),
                "verdict": cell.verdict if cell.checks or cell.status != "done" else None,
                "converged": cell.converged,
                "impact_law": cell.impact_law.law if cell.impact_law else None,
                "explanations": [
                    f"{e.quantity} against {e.against}: {e.verdict}" for e in cell.explanations
                ],
            }
            for cell in run.cells
        ],
        "reasons": list(verdict_lines(run)),
        "better": list(improvements(run)),
    }


def verdict_lines(run: Run) -> Iterator[str]:
    """Why anything is not a pass, a line each."""
    yield from run.faults
    absent = {cell.model: cell.reason for cell in run.cells if cell.status in MISSING}
    yield from (f"{model}: {reason}" for model, reason in absent.items())
    for cell in run.cells:
        if cell.status not in MISSING:
            yield from cell_lines(cell)
    if run.judged and not any(
        cell.status != "done" or any(c.verdict != "not defined" for c in cell.checks)
        for cell in run.cells
    ):
        yield "nothing was judged: no measure that is defined here is required or has a tolerance"


def improvements(run: Run) -> Iterator[str]:
    """The figures that are better than was expected, a line each."""
    yield from (
        f"{place(cell)}: {title(check)}: {check.reason}"
        for cell, check in run.checks()
        if check.verdict == "better"
    )


def cell_lines(cell: Cell, strict: Strict = True) -> Iterator[str]:
    """Why a cell is not a pass for a run that is so strict, a line each."""
    if cell.status != "done":
        yield f"{place(cell)}: {cell.reason}"
    yield from (
        f"{place(cell)}: {title(check)}: {check.reason}"
        for check in cell.checks
        if check.fails(strict)
    )


def place(cell: Cell) -> str:
    """The cell's scene and model."""
    return f"{cell.scene}, {cell.model}"


def title(check: Check) -> str:
    """The check as tolerances name it: measure, window, and what it is held against."""
    against = f" against {check.figure.against}" if check.figure.against else ""
    return f"{windowed(check)}{against}"


def windowed(check: Check) -> str:
    """What is checked, as tolerances name it: measure and window."""
    return f"{check.figure.measure}{'@' if check.figure.window else ''}{check.figure.window}"


def used(check: Check) -> float:
    """Share of its limit that a check uses up, 0 to 1 within it; infinite where it cannot be
    judged.

    0 where nothing is asked, and where the limit lies around a value that is no longer wanted.
    """
    value, limit = check.figure.value, check.limit
    if check.verdict == "not defined" or (check.verdict == "better" and check.beside is not None):
        return 0.0
    if check.verdict == "fail" or value is None or limit is None:
        return math.inf
    if asks(check):
        return 0.0
    if check.ideal is None:  # an "at least" measure: what is there of what is needed
        return limit / value if value > 0.0 else 0.0
    measure = MEASURES.get(check.figure.measure)
    floor = 0.0 if measure is None or measure.role == "error" else check.floor
    return apart(value, check.ideal, floor) / limit if limit > 0.0 else 0.0


def percent(check: Check) -> str:
    """`used` in words; a yes-or-no measure has no share."""
    if asks(check):
        return value_words(check.figure.value, yes_no=True)
    if check.words == "no tolerance yet":
        return "-"
    return f"{100.0 * used(check):.0f} %" if math.isfinite(used(check)) else "beyond"


def nearest(cell: Cell) -> Check | None:
    """The check that failed, else the one nearest to its limit. A yes-or-no measure, or a limit of
    0, is never near its limit."""
    return max(
        (check for check in cell.checks if check.verdict == "fail" or graded(check)),
        key=used,
        default=None,
    )


def asks(check: Check) -> bool:
    """Whether the measure is a yes-or-no one."""
    measure = MEASURES.get(check.figure.measure)
    return measure is not None and measure.yes_no


def graded(check: Check) -> bool:
    """Whether a check has a limit that can be used up in part."""
    return bool(check.limit) and not asks(check)


def share(check: Check) -> str:
    """A check in a few words: name, figure, limit."""
    figure = check.figure
    if asks(check):
        return f"{windowed(check)} {value_words(figure.value, yes_no=True)}"
    value = (
        "-"
        if figure.value is None
        else f"off {abs(figure.value - check.ideal):.1e}"
        if check.ideal
        else f"{figure.value:.2e}"
    )
    limit = "none" if check.limit is None else f"{check.limit:.2g}"
    return f"{windowed(check)} {value} / {limit}"


def checks_csv(run: Run) -> str:
    """All checks, a row each."""
    tolerance = ("expected", "limit", "drift", "verdict", "reason", "why")
    rows = (
        (*_row(cell, check.figure), check.kind, *(getattr(check, name) for name in tolerance))
        for cell, check in run.checks()
    )
    return table_text((*ROW, "kind", *tolerance), rows)


def figures_csv(run: Run) -> str:
    """All figures, judged or not, a row each."""
    return table_text(
        (*ROW, "note"),
        ((*_row(cell, figure), figure.note) for cell in run.cells for figure in cell.figures),
    )


ROW = ("scene", "model", "against", "measure", "window", "value", "unit")


def _row(cell: Cell, figure: Figure) -> tuple[object, ...]:
    return (
        cell.scene,
        cell.model,
        figure.against,
        figure.measure,
        figure.window,
        figure.value,
        figure.unit,
    )
