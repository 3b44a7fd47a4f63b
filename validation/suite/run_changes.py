"""What changed between two runs of a suite (`rockcheck compare`).

In: two finished runs. Out: the changes of verdicts, cells, outcomes and figures, and a finding that
tells them. The command and `trend` call it.
"""

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Literal

from rockcheck.scenes import InputError, printable
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.finding import (
    Column,
    Finding,
    Table,
    Text,
    text,
)
from rockcheck.validation.suite import results, tolerances

#: A figure has moved if it differs by more than this share, and by more than its measure's
#: resolution.
ROUNDING = 1e-9
#: Most moved figures that the changes between two runs list.
MOST_MOVED = 20


class Change(Stored):
    """A difference between two runs: a cell in one run only, an outcome, a figure or a verdict.

    Verdicts are on a check, a cell or the run. `name` is the figure or check as tolerances name it;
    `before` and `after` are None where it is missing.
    """

    scene: str = ""
    model: str = ""
    what: Literal["cell", "outcome", "figure", "verdict"]
    name: str = ""
    before: str | float | None = None
    after: str | float | None = None

    @property
    def size(self) -> float:
        """Change of a figure relative to the larger magnitude; infinite for other changes."""
        if not isinstance(self.before, float) or not isinstance(self.after, float):
            return math.inf
        return abs(self.after - self.before) / max(abs(self.before), abs(self.after))


def changes(before: results.Run, after: results.Run) -> list[Change]:
    """All differences: verdicts, cells, outcomes, then figures, the largest change first.

    Raises `InputError` for runs of two suites.
    """
    if before.suite != after.suite:
        raise InputError(
            f"the runs are of two suites, {printable(before.suite)} and {printable(after.suite)}"
        )
    found: list[Change] = []
    if before.verdict_words != after.verdict_words:
        found.append(Change(what="verdict", before=before.verdict_words, after=after.verdict_words))
    old = {(cell.scene, cell.model): cell for cell in before.cells}
    new = {(cell.scene, cell.model): cell for cell in after.cells}
    for scene, model in old | new:
        changes_of_cell = _changes_of_cell(old.get((scene, model)), new.get((scene, model)))
        found += [
            change.model_copy(update={"scene": scene, "model": model}) for change in changes_of_cell
        ]
    order = ("verdict", "cell", "outcome", "figure")
    return sorted(found, key=lambda change: (order.index(change.what), -change.size))


def _changes_of_cell(before: results.Cell | None, after: results.Cell | None) -> Iterator[Change]:
    """What changed in a cell; of one that only one of the runs has, that alone.

    A figure that only one of them has is no change: the suite's measures are not its results.
    """
    if before is None or after is None:
        yield Change(
            what="cell", before="there" if before else None, after="there" if after else None
        )
        return
    if before.verdict_words != after.verdict_words:
        yield Change(what="verdict", before=before.verdict_words, after=after.verdict_words)
    if before.fate != after.fate:
        yield Change(what="outcome", before=before.fate, after=after.fate)
    old_checks = {check.figure.title: check.verdict_words for check in before.checks}
    new_checks = {check.figure.title: check.verdict_words for check in after.checks}
    for title in old_checks | new_checks:
        was, now = old_checks.get(title), new_checks.get(title)
        if was != now:
            yield Change(what="verdict", name=title, before=was, after=now)
    old_figures, new_figures = _figures_of(before), _figures_of(after)
    for title, value in old_figures.items():
        if title in new_figures and has_moved(title, value, new_figures[title]):
            yield Change(what="figure", name=title, before=value, after=new_figures[title])


def _figures_of(cell: results.Cell) -> dict[str, float | None]:
    """The figures of a cell by their titles; not the peak of a block that fell."""
    return {figure.title: figure.value for figure in cell.figures if not figure.of_a_fall}


def difference(before: results.Run, after: results.Run) -> Finding:
    """The finding on the changes between two finished runs of a suite.

    Its table has at most `MOST_MOVED` of the figures that moved, its data has all. Exit code 1 if a
    verdict changed or a cell is in one of the runs only. Raises `InputError` for runs of two
    suites.
    """
    moved = changes(before, after)
    counts = Counter(change.what for change in moved)
    words = ", ".join(f"{n} {what}{'s' if n > 1 else ''}" for what, n in counts.items())
    versions = {
        name: (before.versions.get(name), after.versions.get(name))
        for name in sorted({*before.versions, *after.versions})
        if before.versions.get(name) != after.versions.get(name)
    }
    lines = [
        f"{name} {was or 'absent'} -> {now or 'absent'}" for name, (was, now) in versions.items()
    ]
    more = max(0, counts["figure"] - MOST_MOVED)
    if more:
        lines.append(f"{more} more figures moved: --json")
    listed = moved[: len(moved) - more]
    return Finding(
        "changes",
        f"{after.suite}, before and after",
        f"{after.suite}: {f'{words} changed' if words else 'nothing changed'}",
        [*([_table(listed)] if listed else []), Text(items=lines)],
        data={
            "suite": after.suite,
            "verdict": [before.verdict_words, after.verdict_words],
            "versions": versions,
            "changes": [change.model_dump() for change in moved],
        },
        exit_code=int(bool(counts["verdict"] or counts["cell"])),
    )


def _table(moved: Sequence[Change]) -> Table:
    columns = [
        *map(text, ("scene", "model", "what")),
        *(Column(name, digits=6) for name in ("before", "after")),
    ]
    rows = [
        [
            change.scene or "the run",
            change.model,
            f"{change.what} {change.name}".strip(),
            change.before,
            change.after,
        ]
        for change in moved
    ]
    return Table("changed", columns, rows, most=len(rows))


def has_moved(title: str, was: float | None, now: float | None) -> bool:
    """Whether a figure has moved by more than rounding and its measure's resolution.

    `title` begins with the measure, perhaps after "scene, model: ".
    """
    if was is None or now is None:
        return was is not now
    measure = tolerances.known(re.split("[@ ]", title.rpartition(": ")[2])[0])
    return abs(now - was) > max(measure.resolution, ROUNDING * max(abs(was), abs(now)))
