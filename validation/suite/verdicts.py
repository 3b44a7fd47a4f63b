"""Verdicts for machines and job pages: JUnit XML and Markdown."""

from __future__ import annotations

import re
from collections.abc import Container, Iterator

from junitparser import Error, Failure, JUnitXml, Skipped, TestCase, TestSuite

from rockcheck.scenes.errors import inert, printable
from rockcheck.scenes.writing import markdown_table
from rockcheck.validation.suite.results import Cell, Check, Run, Strict
from rockcheck.validation.suite.tables import (
    MOST_SHOWN,
    improvements,
    not_shown,
    share,
    shown,
    title,
    used,
    verdict_lines,
)

MARKS = {"pass": "✅", "incomplete": "⚪", "changed": "🟡", "fail": "❌", "error": "💥"}


def junit(run: Run) -> str:
    """JUnit XML: a test suite a scene, a test case a check and one for each cell's run, which is an
    error where it failed.

    A figure that changed within its limit, and a model that is not installed, are failures only in
    a strict run, one that is better in a run that is strict both ways. What is not defined is
    skipped.
    """
    document = JUnitXml(f"rockcheck {run.suite}")
    for scene, cells in run.by_scene().items():
        suite = TestSuite(scene)
        suite.extend([case for cell in cells.values() for case in _cases(cell, run.strict)])
        document.append(suite)  # `add_testsuite` looks through all that are there
    if run.faults:
        suite = TestSuite("tolerances")
        for fault in run.faults:
            suite.add_testcase(_case("tolerances", fault, Failure(fault)))
        document.append(suite)
    document.update_statistics()
    return inert(bytes(document.tostring()).decode()) + "\n"  # XML knows no control characters


def _cases(cell: Cell, strict: Strict) -> Iterator[TestCase]:
    place = f"{cell.scene}.{cell.model}"
    ways = {
        "failed": Error(cell.reason),
        "absent": Failure(cell.reason) if strict else Skipped(cell.reason),
        "unavailable": Skipped(cell.reason),
    }
    ran = _case(place, "runs", ways.get(cell.status))
    ran.time = cell.cost.worker_seconds
    yield ran
    if cell.numerical is not None:
        yield _case(
            place,
            "converged",
            None if cell.numerical.converged else Skipped("; ".join(cell.numerical.reasons)),
        )
    for check in cell.checks:
        failure = Failure(check.reason, check.verdict) if check.fails(strict) else None
        yield _case(
            place,
            title(check),
            Skipped(check.reason) if check.verdict == "not defined" else failure,
        )


def _case(place: str, name: str, result: Failure | Error | Skipped | None) -> TestCase:
    case = TestCase(name, place)
    if result is not None:
        case.result = [result]
    return case


def markdown(run: Run) -> str:
    """A summary for a job's page: the verdict, what is not a pass and why, and a table of scenes by
    models."""
    lines = [
        f"## {MARKS[run.verdict]} rockcheck {_plain(run.suite)}: {run.words}",
        "",
        f"{len(run.cells)} simulations, {run.up_to_date} up to date,"
        f" {sum(1 for _ in run.checks())} checks, {run.wall_seconds:.1f} s.",
        "",
    ]
    for heading, found in (
        ("", list(verdict_lines(run))),
        ("Better than expected:", list(improvements(run))),
    ):
        more = (
            [f"- and {len(found) - MOST_SHOWN} more, in junit.xml"]
            if len(found) > MOST_SHOWN
            else []
        )
        lines += [heading, ""] if heading and found else []
        lines += [*(f"- {_plain(one)}" for one in found[:MOST_SHOWN]), *more, ""] if found else []
    cells, places = run.by_scene(), shown(run)
    rows = (
        (_plain(scene), *(_entry(cells[scene].get(model), run.judged) for model in run.models))
        for scene in places
    )
    table = markdown_table(("scene", *map(_plain, run.models)), rows)
    rest = [
        line for one in not_shown(run) for line in ("", one)
    ]  # a line right below would be a row of the table
    return "\n".join([*lines, table, *rest, *_laws(run, places)]) + "\n"


def _laws(run: Run, places: Container[str]) -> Iterator[str]:
    """Which law of impacts each model followed, where these scenes have a landing that tells; it is
    no verdict."""
    told = {
        cell.scene: cell.impact_law.t
        for cell in run.cells
        if cell.impact_law and cell.scene in places
    }
    if not told:
        return
    models = [
        model
        for model in run.models
        if any(cell.model == model and cell.impact_law for cell in run.cells)
    ]
    yield from (
        "",
        "The law of impacts followed at the first landing at which laws part (not judged):",
        "",
    )
    found = {(cell.scene, cell.model): cell.impact_law.law for cell in run.cells if cell.impact_law}
    rows = (
        (_plain(scene), f"{t:.3f} s", *(found.get((scene, model), "") for model in models))
        for scene, t in told.items()
    )
    yield markdown_table(("scene", "landing", *map(_plain, models)), rows)


def _entry(cell: Cell | None, judged: bool) -> str:
    if cell is None:
        return ""
    sure = " (not converged)" if cell.converged is False else ""
    if not judged and cell.status == "done":
        return _plain(cell.fate)
    return f"{MARKS[cell.verdict]} {_plain(_worst(cell.checks))}{sure}".strip()


def _worst(checks: tuple[Check, ...]) -> str:
    against_others = [
        check for check in checks if check.figure.against and check.kind == "numerical"
    ]
    return share(max(against_others, key=used)) if against_others else ""


def _plain(text: str) -> str:
    """Text that somebody else may have chosen, as Markdown that shows it and does nothing: no tag,
    link, picture or new line."""
    return (
        re.sub(r"([\\`*\[\]!#~])", r"\\\1", printable(text, 1000))
        .replace("&", "&amp;")
        .replace("<", "&lt;")
        .replace("://", ":&#47;/")
    )
