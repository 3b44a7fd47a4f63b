"""A run as a finding: tables of verdicts, of outcomes, and the files of all figures.

In: a finished run. Out: blocks for the terminal, Markdown and CSV. The command, the plugin and the
pages call it.
"""

from collections.abc import Iterator
from operator import attrgetter
from typing import Any

from rockcheck.validation.discrepancy import figures
from rockcheck.validation.finding import Block, Column, Finding, Mark, Table, Text, Verdict, text
from rockcheck.validation.suite import results, tolerances
from rockcheck.validation.suite.limits_used import nearest, used
from rockcheck.validation.suite.reasons import improvements, note_lines, verdict_lines
from rockcheck.validation.suite.run_summary import outcome_row
from rockcheck.validation.suite.shown_scenes import not_shown, shown

OUTCOMES = (
    "peak: largest rotation; apart: RMS difference from the reference, to the horizon of"
    " predictability; in alpha"
)


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
    return Finding("run", run.suite, f"verdict: {run.verdict_words}", blocks)


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
    state: Verdict = "changed" if cell.verdict_words == "no tolerance yet" else cell.verdict
    return [
        cell.model,
        judged if cell.status == "done" else cell.reason or "failed",
        _limit_used(near) if near else "",
        f"-{unsure}" if idle else Mark(f"{cell.verdict_words}{unsure}", state),
    ]


def _limit_used(check: results.Check) -> float | str:
    if tolerances.known(check.figure.measure).yes_no:
        return figures.value_words(check.figure.value, yes_no=True)
    return "-" if check.waits_for_tolerance else used(check)


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
