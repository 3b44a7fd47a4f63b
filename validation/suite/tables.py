"""Verdicts as blocks of a finding; for machines and job pages as JUnit XML and Markdown."""

import math
import re
from collections.abc import Container, Iterable, Iterator, Mapping
from operator import attrgetter
from typing import Any

from rockcheck.scenes import printable, writing
from rockcheck.validation.discrepancy import figures
from rockcheck.validation.finding import Block, Column, Finding, Mark, Table, Text, Verdict, text
from rockcheck.validation.suite import results, tolerances, verdicts

#: The most scenes that tables and pages show one by one.
MOST_SHOWN = 200
OUTCOMES = (
    "peak: largest rotation; apart: RMS difference from the reference, to the horizon of"
    " predictability; in alpha"
)


def shown(run: results.Run) -> tuple[str, ...]:
    """The scenes and ensembles shown one by one, in the suite's order: at most `MOST_SHOWN` scenes.

    Those with the worst verdict, and of these the nearest to a limit. Ensembles are always shown.
    """
    cells, ensembles = run.by_scene, {ensemble.name for ensemble in run.ensembles}
    badness = {
        place: (
            max(results.SEVERITY.index(cell.verdict) for cell in models.values()),
            max((used(check) for cell in models.values() for check in cell.checks), default=0.0),
        )
        for place, models in cells.items()
        if place not in ensembles
    }
    chosen = ensembles.union(sorted(badness, key=badness.__getitem__, reverse=True)[:MOST_SHOWN])
    return tuple(place for place in cells if place in chosen)


def not_shown(run: results.Run) -> list[str]:
    """A line with the number of scenes that are not `shown`; empty if there are none."""
    more = len(run.by_scene) - len(shown(run))
    said = f"and {more} more scenes, none of them worse; their figures are in figures.csv"
    return [said] if more else []


def finding_of(run: results.Run) -> Finding:
    """A run on a terminal: verdicts, or outcomes if nothing is judged, and why it does not pass."""
    wrong = Text(items=list(verdict_lines(run)), verdict="fail" if run.exit_code else "changed")
    if not run.judged:
        notes = Text(items=list(note_lines(run)), verdict="changed")
        return Finding(
            "run", run.suite, "nothing judged", [*outcome_tables(run), Text(OUTCOMES), notes, wrong]
        )
    cells = run.by_scene
    rows = [
        ["" if n else scene, *_verdict_row(cell)]
        for scene in shown(run)
        for n, cell in enumerate(cells[scene].values())
    ]
    columns = [
        *map(text, ("scene", "model", "nearest to its limit")),
        Column("used", kind="used"),
        text("verdict"),
    ]
    better, waits = list(improvements(run)), run.without_tolerance
    makes = "`rockcheck accept` makes today's the expected ones"
    blocks: list[Block] = [
        Table("verdicts", columns, rows, most=len(rows)),
        Text(items=not_shown(run)),
        wrong,
        Text(f"better than expected; {makes}:" if better else ""),
        Text(items=better, verdict="fail" if run.strict == "both" else "pass"),
        Text(f"{waits} figures have no tolerance yet: {makes}" if waits else ""),
        Text(
            f"{run.up_to_date} of {len(run.cells)} simulations were up to date; played and judged"
            f" in {run.wall_seconds:.1f} s"
        ),
    ]
    return Finding("run", run.suite, f"verdict: {run.words}", blocks)


def _verdict_row(cell: results.Cell) -> list[Any]:
    # a yes-or-no measure, or a limit of 0, is never near its limit
    weighed = [
        one
        for one in cell.checks
        if one.verdict == "fail" or (one.limit and not tolerances.known(one.figure.measure).yes_no)
    ]
    near = nearest(weighed)
    unsure = ", not converged" if cell.converged is False else ""
    judged = near.figure.windowed if near else "as it must be" if cell.checks else "nothing judged"
    idle = cell.status == "done" and not cell.checks
    state: Verdict = "changed" if cell.words == "no tolerance yet" else cell.verdict
    return [
        cell.model,
        judged if cell.status == "done" else cell.reason or "failed",
        _limit_used(near) if near else "",
        f"-{unsure}" if idle else Mark(f"{cell.words}{unsure}", state),
    ]


def _limit_used(check: results.Check) -> float | str:
    if tolerances.known(check.figure.measure).yes_no:
        return figures.value_words(check.figure.value, yes_no=True)
    return "-" if check.words == "no tolerance yet" else used(check)


def outcome_tables(run: results.Run) -> Iterator[Table]:
    """A table per scene, a row per model: outcome, peak rotation, difference from the reference."""
    columns = [*map(text, ("model", "outcome")), *map(Column, ("peak", "apart", "took"))]
    for scene, cells in run.by_scene.items():
        rows = []
        for cell in cells.values():
            known, done = outcome_row(cell, run.reference), cell.status == "done"
            rows.append(
                [
                    cell.model,
                    cell.fate if done else Mark(cell.reason or "failed", cell.verdict),
                    known["peak_rotation_alpha"],
                    "ref." if cell.model == run.reference else known["apart_alpha"],
                    f"{cell.cost.wall_seconds:.1f} s" if done else "",
                ]
            )
        yield Table("outcomes", columns, rows, scene)


def note_lines(run: results.Run) -> Iterator[str]:
    """What the models say of their runs, such as a physics that they leave out, a line each.

    A note that several models share is a line with their names.
    """
    for scene, cells in run.by_scene.items():
        models: dict[str, list[str]] = {}
        for model, cell in cells.items():
            for note in cell.notes:
                models.setdefault(note, []).append(model)
        for note, names in models.items():
            who = "all models" if len(names) == len(cells) > 1 else ", ".join(names)
            yield f"{scene}, {who}: {note}"


def outcome_row(cell: results.Cell, reference: str) -> dict[str, Any]:
    """The result of a cell in plain values; `peak_rotation_alpha` is None for a block that fell."""
    return {
        "scene": cell.scene,
        "model": cell.model,
        "status": cell.status,
        "outcome": cell.outcome or None,
        "overturned_at_s": cell.overturned_at,
        "peak_rotation_alpha": None
        if cell.outcome.startswith("overturned")
        else results.value_of(cell.figures, "peak_rotation"),
        "apart_alpha": results.value_of(cell.figures, "theta_rms", reference, tolerances.HORIZON),
        "wall_seconds": cell.cost.wall_seconds,
    }


def summary(run: results.Run) -> dict[str, Any]:
    """The verdicts of the run and its cells in plain values, with the reasons of each non-pass.

    Where nothing is judged, the outcome of each cell.
    """
    common = {
        "suite": run.suite,
        "exit_code": run.exit_code,
        "reasons": list(verdict_lines(run)),
    }
    if not run.judged:
        return common | {
            "judged": False,
            "reference": run.reference,
            "cells": [outcome_row(cell, run.reference) for cell in run.cells],
        }
    return common | {
        "verdict": run.verdict,
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
        "better": list(improvements(run)),
    }


def verdict_lines(run: results.Run) -> Iterator[str]:
    """Why anything is not a pass, a line each."""
    yield from run.wrong
    missing = [cell for cell in run.cells if cell.status in results.MISSING]
    yield from dict.fromkeys(f"{cell.model}: {cell.reason}" for cell in missing)
    for cell in run.cells:
        if cell.status not in results.MISSING:
            yield from cell_lines(cell)


def improvements(run: results.Run) -> Iterator[str]:
    """The figures that are better than expected, a line each."""
    yield from (
        f"{cell.scene}, {cell.model}: {check.figure.title}: {check.reason}"
        for cell, check in run.checks()
        if check.verdict == "better"
    )


def cell_lines(cell: results.Cell, strict: results.Strict = True) -> Iterator[str]:
    """Why a cell does not pass in a run of that strictness, a line each."""
    place = f"{cell.scene}, {cell.model}"
    if cell.status != "done":
        yield f"{place}: {cell.reason}"
    yield from (
        f"{place}: {check.figure.title}: {check.reason}"
        for check in cell.checks
        if check.fails(strict)
    )
    if any(check.fails(strict) for check in cell.checks):
        yield from (f"{place}: note: {note}" for note in cell.notes)


def used(check: results.Check) -> float:
    """Share of its limit that a check uses: above 1 only where it is out.

    Infinite where that cannot be said. 0 for a check that is not defined, of a yes-or-no measure,
    and for a better figure whose limit lies around the outdated expected value.
    """
    measure, value, limit = tolerances.known(check.figure.measure), check.figure.value, check.limit
    fails = check.verdict == "fail"
    if check.verdict == "not defined" or (check.verdict == "better" and check.beside is not None):
        return 0.0
    if value is None or limit is None or check.gap:
        return math.inf
    if not limit or measure.yes_no:
        return math.inf if fails else 0.0
    most = math.inf if fails else 1.0
    if check.ideal is None:  # an "at least" measure: the needed share of the value
        return min(limit / value if value > 0.0 else math.inf, most)
    floor = 0.0 if measure.is_error else check.floor
    return min(verdicts.apart(value, check.ideal, floor) / limit, most)


def nearest(checks: Iterable[results.Check]) -> results.Check | None:
    """The check that uses most of its limit: one that fails before one without a tolerance."""
    return max(checks, key=lambda check: (check.words == "fail", used(check)), default=None)


def share(check: results.Check) -> str:
    """A check in a few words: name, figure, limit."""
    figure = check.figure
    if tolerances.known(figure.measure).yes_no:
        return f"{figure.windowed} {figures.value_words(figure.value, yes_no=True)}"
    value = (
        "-"
        if figure.value is None
        else f"off {abs(figure.value - check.ideal):.1e}"
        if check.ideal
        else f"{figure.value:.2e}"
    )
    limit = "none" if check.limit is None else f"{check.limit:.2g}"
    return f"{figure.windowed} {value} / {limit}"


def files_of(run: results.Run) -> Iterator[Table]:
    """All checks, a row each; and all figures, judged or not."""
    place = ("scene", "model", "against", "measure", "window", "value", "unit")
    tolerance = ("expected", "limit", "drift", "verdict", "reason", "why")
    of_figure, of_check = attrgetter(*place[2:]), attrgetter("kind", *tolerance)
    yield Table(
        "checks",
        list(map(Column, (*place, "kind", *tolerance))),
        [
            [cell.scene, cell.model, *of_figure(check.figure), *of_check(check)]
            for cell, check in run.checks()
        ],
    )
    yield Table(
        "figures",
        list(map(Column, (*place, "note"))),
        [
            [cell.scene, cell.model, *of_figure(one), one.note]
            for cell in run.cells
            for one in cell.figures
        ],
    )


MARKS = {"pass": "✅", "incomplete": "⚪", "changed": "🟡", "fail": "❌", "error": "💥"}


def junit(run: results.Run) -> str:
    """JUnit XML: a test suite per scene, a test case per check and one for each cell's run.

    A failed run is an error. A figure that changed within its limit, and a model that is not
    installed, are failures only in a strict run; a better figure only if the run is strict both
    ways. A check that is not defined is skipped.
    """
    suites: list[tuple[str, list[writing.Case]]] = [
        (scene, [case for cell in cells.values() for case in _cases(cell, run.strict)])
        for scene, cells in run.by_scene.items()
    ]
    faults: list[writing.Case] = [
        ("tolerances", fault, "failed", fault, "", None) for fault in run.wrong
    ]
    return writing.junit_text(
        f"rockcheck {run.suite}", [*suites, *([("tolerances", faults)] if faults else [])]
    )


def _cases(cell: results.Cell, strict: results.Strict) -> Iterator[writing.Case]:
    place = f"{cell.scene}.{cell.model}"
    came: Mapping[str, Any] = {
        "failed": "error",
        "absent": "failed" if strict else "skipped",
        "unavailable": "skipped",
    }
    seconds = 0.0 if cell.read_back else cell.cost.worker_seconds
    yield place, "runs", came.get(cell.status, ""), cell.reason, "", seconds
    if cell.numerical is not None:
        reasons = "; ".join(cell.numerical.reasons)
        yield place, "converged", "" if cell.converged else "skipped", reasons, "", None
    for check in cell.checks:
        wrong = "failed" if check.fails(strict) else ""
        found: Any = "skipped" if check.verdict == "not defined" else wrong
        yield place, check.figure.title, found, check.reason, check.verdict, None


def markdown(run: results.Run) -> str:
    """A summary for a job's page: the verdict, the reasons, and a table of scenes by models."""
    parts = [
        f"## {MARKS[run.verdict]} rockcheck {_plain(run.suite)}: {run.words}",
        f"{len(run.cells)} simulations, {run.up_to_date} up to date,"
        f" {sum(1 for _ in run.checks())} checks, {run.wall_seconds:.1f} s.",
    ]
    for heading, lines in (
        ([], list(verdict_lines(run))),
        (["Better than expected:"], list(improvements(run))),
    ):
        more = len(lines) - MOST_SHOWN
        rest = [f"- and {more} more, in junit.xml"] if more > 0 else []
        items = [*(f"- {_plain(one)}" for one in lines[:MOST_SHOWN]), *rest]
        parts += [*heading, "\n".join(items)] if lines else []
    cells, places = run.by_scene, shown(run)
    rows = (
        (_plain(scene), *(_entry(cells[scene].get(model), run.judged) for model in run.models))
        for scene in places
    )
    parts += [writing.markdown_table(("scene", *map(_plain, run.models)), rows), *not_shown(run)]
    return "\n\n".join([*parts, *_laws(run, places)]) + "\n"


def _laws(run: results.Run, places: Container[str]) -> Iterator[str]:
    """The law of impacts that each model followed, for scenes with a landing at which laws part.

    It is not judged.
    """
    found = {(cell.scene, cell.model): cell.impact_law for cell in run.cells if cell.impact_law}
    told = {scene: law.t for (scene, _), law in found.items() if scene in places}
    models = [model for model in run.models if any(model == of for _, of in found)]
    rows = (
        (
            _plain(scene),
            f"{t:.3f} s",
            *(found[scene, one].law if (scene, one) in found else "" for one in models),
        )
        for scene, t in told.items()
    )
    if told:
        yield "The law of impacts followed at the first landing at which laws part (not judged):"
        yield writing.markdown_table(("scene", "landing", *map(_plain, models)), rows)


def _entry(cell: results.Cell | None, judged: bool) -> str:
    if cell is None:
        return ""
    sure = " (not converged)" if cell.converged is False else ""
    if cell.status == "done" and not (judged and cell.checks):
        return f"{_plain(cell.fate)}{sure}"
    numerical = [one for one in cell.checks if one.figure.against and one.kind == "numerical"]
    worst = max(
        numerical,
        key=lambda one: (one.words == "fail", one.figure.value is not None, used(one)),
        default=None,
    )
    said = _plain(share(worst)) if worst else ""
    return f"{MARKS[cell.verdict]} {said}{sure}".strip()


def _plain(text: str) -> str:
    """Untrusted text as inert Markdown: no tag, link, picture or new line."""
    return (
        re.sub(r"([\\`*\[\]!#~])", r"\\\1", printable(text, 1000))
        .replace("&", "&amp;")
        .replace("<", "&lt;")
        .replace("://", ":&#47;/")
    )
