"""Comparison of runs: changes between two, trends over many, and trust in each model.

Changes between two runs (`rockcheck compare`), figures over a history of runs (`rockcheck validate
--history FILE`), and, over several suites, bias and scatter of each model's figures.

A history of runs is a file of JSON lines, one a run: `Moment`. Bias and scatter as in the FDS
validation guide (McGrattan and Toman 2011). With M a model's figure and E the reference's,

    sigma = standard deviation of ln(M/E),      delta = exp(mean of ln(M/E) + sigma^2 / 2).

The reference's own numerical error is far below sigma and left out. A new prediction M is then
expected at M/delta, with a relative standard deviation sigma: `History.expected`.
"""

import math
import os
import re
import shutil
import subprocess
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field, ValidationError

from rockcheck.scenes import InputError, errors, experience, printable, reading
from rockcheck.validation.discrepancy.ensemble import SMALLEST_PEAK
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.finding import (
    Axis,
    Block,
    Column,
    Finding,
    Panel,
    Plot,
    Series,
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
#: What each cell tells: that it is there.
THERE: Mapping[Any, str] = {("cell", ""): "there"}
#: Environment variables in which continuous integration gives its commit.
COMMITS = ("GITHUB_SHA", "CI_COMMIT_SHA", "BUILD_SOURCEVERSION", "CIRCLE_SHA1")


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
    old, new = (  # by scene and model; the run's own verdict first
        {("", ""): {("verdict", ""): run.words}}
        | {(cell.scene, cell.model): _told(cell) for cell in run.cells}
        for run in (before, after)
    )
    every = (_changed(at, old.get(at, {}), new.get(at, {})) for at in old | new)
    order = ("verdict", "cell", "outcome", "figure")
    return sorted(chain(*every), key=lambda change: (order.index(change.what), -change.size))


def difference(before: results.Run, after: results.Run) -> Finding:
    """The finding on the changes between two finished runs of a suite.

    Its table has at most `MOST_MOVED` of the figures that moved, its data has all. Exit code 1 if a
    verdict changed or a cell is in one of the runs only. Raises `InputError` for runs of two
    suites.
    """
    found = changes(before, after)
    counts = Counter(change.what for change in found)
    words = ", ".join(f"{n} {what}{'s' if n > 1 else ''}" for what, n in counts.items())
    versions = {
        name: (before.versions.get(name), after.versions.get(name))
        for name in sorted({*before.versions, *after.versions})
        if before.versions.get(name) != after.versions.get(name)
    }
    told = [
        f"{name} {was or 'absent'} -> {now or 'absent'}" for name, (was, now) in versions.items()
    ]
    if left := max(0, counts["figure"] - MOST_MOVED):
        told.append(f"{left} more figures moved: --json")
    rows = [
        [one.scene or "the run", one.model, f"{one.what} {one.name}".strip(), one.before, one.after]
        for one in found[: len(found) - left]
    ]
    columns = [
        *map(text, ("scene", "model", "what")),
        *(Column(name, digits=6) for name in ("before", "after")),
    ]
    return Finding(
        "changes",
        f"{after.suite}, before and after",
        f"{after.suite}: {f'{words} changed' if words else 'nothing changed'}",
        [*([Table("changed", columns, rows, most=len(rows))] if rows else []), Text(items=told)],
        data={
            "suite": after.suite,
            "verdict": [before.words, after.words],
            "versions": versions,
            "changes": [change.model_dump() for change in found],
        },
        exit_code=int(bool(counts["verdict"] or counts["cell"])),
    )


def _told(cell: results.Cell) -> dict[tuple[Any, str], Any]:
    """What a cell's run told, by its kind and name; not the peak of a block that fell."""
    return (
        {**THERE, ("verdict", ""): cell.words, ("outcome", ""): cell.fate}
        | {("verdict", check.figure.title): check.words for check in cell.checks}
        | {("figure", one.title): one.value for one in cell.figures if not one.of_a_fall}
    )


def _changed(
    place: tuple[str, str], was: Mapping[Any, Any], now: Mapping[Any, Any]
) -> Iterator[Change]:
    """What a place tells otherwise in two runs; of one that only one of them has, that alone."""
    shared = was.keys() & now.keys()
    for key in {**was, **now} if shared else THERE:
        (what, name), one, other = key, was.get(key), now.get(key)
        both = key in shared
        if (both and _moved(name, one, other)) if what == "figure" else one != other:
            yield Change(
                scene=place[0], model=place[1], what=what, name=name, before=one, after=other
            )


def _moved(title: str, was: float | None, now: float | None) -> bool:
    """Whether a figure has moved by more than rounding and its measure's resolution.

    `title` begins with the measure, perhaps after "scene, model: ".
    """
    if was is None or now is None:
        return was is not now
    measure = tolerances.known(re.split("[@ ]", title.rpartition(": ")[2])[0])
    return abs(now - was) > max(measure.resolution, ROUNDING * max(abs(was), abs(now)))


class Moment(Stored):
    """One run in a history: time, commit, version, verdict, and every judged figure.

    Figures are named "scene, model: check".
    """

    created: str
    commit: str = ""
    rockcheck: str = ""
    suite: str
    verdict: str
    wall_seconds: float = 0.0
    figures: dict[str, float | None] = Field(default_factory=dict)
    not_passed: tuple[str, ...] = ()


def moment_of(run: results.Run, folder: Path) -> Moment:
    """A run as a line of a history; the suite lies in `folder`.

    The commit is that checked out in `folder`, "-dirty" appended if files have changed. Outside of
    a repository it is the continuous integration's, "" without one.
    """
    commit = next((os.environ[name][:12] for name in COMMITS if os.environ.get(name)), "")
    if git := shutil.which("git"):
        found = subprocess.run(
            [
                git,
                "-C",
                str(folder),
                *["describe", "--always", "--dirty", "--abbrev=12", "--exclude", "*"],
            ],
            capture_output=True,
            text=True,
            check=False,
            stdin=subprocess.DEVNULL,
        )
        if found.returncode == 0:
            commit = found.stdout.strip()
    names = [
        (f"{cell.scene}, {cell.model}: {check.figure.title}", check) for cell, check in run.checks()
    ]
    return Moment(
        created=run.created,
        commit=printable(commit),
        rockcheck=run.versions.get("rockcheck", ""),
        suite=run.suite,
        verdict=run.words,
        wall_seconds=run.wall_seconds,
        figures={
            name: None if check.figure.of_a_fall else check.figure.value for name, check in names
        },
        not_passed=tuple(name for name, check in names if check.weighs != "pass"),
    )


def recall(path: Path) -> list[Moment]:
    """The runs of a history, the oldest first; none where there is no file yet.

    Raises `InputError`, naming a line that is unusable.
    """
    known: list[Moment] = []
    lines = reading.read_text(path).splitlines() if path.exists() else []
    for n, line in enumerate(lines, 1):
        try:
            if line.strip():
                known.append(Moment.model_validate_json(line))
        except ValidationError as error:
            raise InputError(
                f"{printable(path)}, line {n}: not a run of a history:"
                f" {errors.from_validation(error)}"
            ) from None
    return known


def remember(path: Path, moment: Moment) -> list[Moment]:
    """Append a run to the history; returns all its runs of the same suite, the oldest first.

    Raises `InputError` (see `recall`).
    """
    known = recall(path)
    with path.open("a+b") as stream:
        if stream.tell():  # an editor may have left the last line without its end
            stream.seek(-1, os.SEEK_END)
        end = b"" if stream.read(1) in b"\n" else b"\n"
        stream.write(end + moment.model_dump_json().encode() + b"\n")
    return [one for one in (*known, moment) if one.suite == moment.suite]


#: Most figures drawn (those that varied most), and most moved figures listed; the table has
#: all that varied.
DRAWN, LISTED = 12, 10


def trend_of(moments: Sequence[Moment]) -> Finding:
    """The finding on a suite's figures over its runs.

    Lists the figures that moved since the run before, draws and tabulates those that varied, and
    lists the runs.
    """
    import pandas as pd

    last, number = moments[-1], f"{len(moments)} run{'s' * (len(moments) > 1)}"
    every = {
        name: [one.figures.get(name) for one in moments]
        # of all runs: a model that fails now may have had figures
        for name in dict.fromkeys(chain.from_iterable(one.figures for one in reversed(moments)))
    }
    values = pd.DataFrame(every, dtype=float)
    least, most = values.min(), values.max()
    spread = ((most - least) / values.abs().max()).fillna(0.0)
    names = sorted(every, key=lambda name: -spread[name])
    # what some of the runs did not have varied, too
    found = [name for name in names if spread[name] > 0.0 or values[name].isna().nunique() > 1]
    before, moved = "", []
    if len(moments) > 1:
        before = f" since {moments[-2].commit or moments[-2].created}"
        moved = [name for name in names if _moved(name, *every[name][-2:])]
    told = [
        f"{name}: {' -> '.join('-' if v is None else f'{v:.6g}' for v in every[name][-2:])}"
        for name in moved[:LISTED]
    ]
    panels = [_panel(name, every[name], moments) for name in found[:DRAWN]]
    rows = [[name, every[name][0], least[name], most[name], *every[name][-2:]] for name in found]
    columns = [
        text("figure"),
        *(Column(name, digits=6) for name in ("first", "least", "most", "before", "now")),
    ]
    made = [
        [one.created, one.commit, one.rockcheck, one.verdict, len(one.not_passed)]
        for one in reversed(moments)
    ]
    blocks: list[Block] = [
        Text(f"{number}, {len(moved)} figures moved{before}", items=told),
        *([Plot("trend", panels=panels, x=Axis("run"), shared=False)] if panels else []),
        Table("figures", columns, rows, "What varied", on="page" if rows else "file"),
        Table(
            "runs",
            [*map(text, ("made", "commit", "rockcheck", "verdict")), Column("not_passed")],
            made,
            "Runs",
            on="page",
        ),
    ]
    return Finding(
        "trend",
        f"{last.suite} over {number}",
        f"{len(found)} figures varied, {len(every) - len(found)} stayed the same. The last run:"
        f" {last.verdict}.",
        blocks,
    )


def _panel(name: str, values: Sequence[float | None], moments: Sequence[Moment]) -> Panel:
    bad = [n for n, moment in enumerate(moments, 1) if name in moment.not_passed]
    return Panel(
        name.replace(": ", "\n", 1),
        [
            Series("", list(range(1, len(moments) + 1)), values),
            Series("not passed", bad, [values[n - 1] for n in bad], style="points"),
        ],
    )


#: The fewest pairs from which a scatter is computed.
FEWEST = 5


def pairs_of(runs: Iterable[results.Run]) -> dict[str, list[tuple[float, float]]]:
    """Peak rotations (reference's, model's) of all scenes by model, if both allow a ratio.

    Both must be finite and larger than `SMALLEST_PEAK`. Blocks that fall have no peak: they are
    left out, as are cells of the reference itself.
    """
    found: defaultdict[str, list[tuple[float, float]]] = defaultdict(list)
    for run in runs:
        # by model, scene and number in its ensemble
        ends = [
            (
                (cell.model, cell.scene, 0),
                cell.outcome,
                results.value_of(cell.figures, "peak_rotation"),
            )
            for cell in run.cells
            if cell.status == "done"
        ] + [
            ((model, drawn.name, n), drawn.outcomes[model][n], peak)
            for drawn in run.ensembles
            for model, peaks in drawn.peaks.items()
            for n, peak in enumerate(peaks)
        ]
        stands = {
            key: peak
            for key, outcome, peak in ends
            if peak is not None and peak > SMALLEST_PEAK and not outcome.startswith("overturned")
        }
        for (model, scene, n), peak in stands.items():
            if model != run.reference and (run.reference, scene, n) in stands:
                found[model].append((stands[run.reference, scene, n], peak))
    return found


def trust_in(pairs: Sequence[tuple[float, float]]) -> experience.Trust | None:
    """Bias and scatter of (E, M) pairs, see the module; None for fewer than `FEWEST`."""
    if len(pairs) < FEWEST:
        return None
    ratios = np.log([m / e for e, m in pairs])
    scatter = float(np.std(ratios, ddof=1))
    return experience.Trust(
        bias=math.exp(float(np.mean(ratios)) + 0.5 * scatter**2), scatter=scatter, count=len(pairs)
    )
