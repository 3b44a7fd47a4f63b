"""Comparison of runs: changes between two, trends over many, and experience with each model.

Changes between two runs (`rockcheck compare`), figures over a history of runs (`rockcheck validate
--history FILE`), and, over several suites, bias and scatter of each model's figures and the domain
that the scenes cover.

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
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import Field, ValidationError

from rockcheck.scenes import InputError
from rockcheck.scenes.errors import from_validation, printable
from rockcheck.scenes.experience import Experience, Range, Trust, axes_of
from rockcheck.scenes.reading import read_text
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.execute.models import FAMILIES, build
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
from rockcheck.validation.suite.results import Cell, Run, value_of
from rockcheck.validation.suite.tolerances import MEASURES

T = TypeVar("T")
#: A figure has moved if it differs by more than this share, and by more than its measure's
#: resolution.
ROUNDING = 1e-9
#: Most moved figures that the changes between two runs list.
MOST_MOVED = 20
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


def changes(before: Run, after: Run) -> list[Change]:
    """All differences: verdicts, cells, outcomes, then figures, the largest change first.

    Raises `InputError` for runs of two suites.
    """
    if before.suite != after.suite:
        raise InputError(
            f"the runs are of two suites, {printable(before.suite)} and {printable(after.suite)}"
        )
    found = (
        [Change(what="verdict", before=before.words, after=after.words)]
        if before.words != after.words
        else []
    )
    old, new = ({(cell.scene, cell.model): cell for cell in run.cells} for run in (before, after))
    for place in dict.fromkeys((*old, *new)):
        if place in old and place in new:
            found += _of_cell(old[place], new[place])
        else:
            was, now = ("there", None) if place in old else (None, "there")
            found.append(Change(scene=place[0], model=place[1], what="cell", before=was, after=now))
    order = ("verdict", "cell", "outcome", "figure")
    return sorted(found, key=lambda change: (order.index(change.what), -change.size))


def difference(before: Run, after: Run) -> Finding:
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
    table = Table("changed", columns, rows, most=len(rows))
    return Finding(
        "changes",
        f"{after.suite}, before and after",
        f"{after.suite}: {f'{words} changed' if words else 'nothing changed'}",
        [*([table] if rows else []), Text(items=told)],
        data={
            "suite": after.suite,
            "verdict": [before.words, after.words],
            "versions": versions,
            "changes": [change.model_dump() for change in found],
        },
        exit_code=int(bool(counts["verdict"] or counts["cell"])),
    )


def _of_cell(old: Cell, new: Cell) -> Iterator[Change]:
    place = {"scene": old.scene, "model": old.model}
    said = [
        {("verdict", ""): cell.words, ("outcome", ""): cell.fate}
        | {("verdict", check.figure.title): check.words for check in cell.checks}
        for cell in (old, new)
    ]
    for (what, name), was, now in _pairs(*said):
        if was != now:
            yield Change(**place, what=what, name=name, before=was, after=now)
    figures = ({figure.title: figure for figure in cell.figures} for cell in (old, new))
    for name, one, other in _pairs(*figures):
        if (
            one
            and other
            and not (one.of_a_fall or other.of_a_fall)
            and _moved(one.measure, one.value, other.value)
        ):
            yield Change(**place, what="figure", name=name, before=one.value, after=other.value)


def _pairs(old: Mapping[Any, T], new: Mapping[Any, T]) -> Iterator[tuple[Any, T | None, T | None]]:
    yield from ((name, old.get(name), new.get(name)) for name in dict.fromkeys((*old, *new)))


def _moved(name: str, was: float | None, now: float | None) -> bool:
    """Whether a measure's value has moved by more than rounding and its resolution."""
    if was is None or now is None:
        return was is not now
    measure = MEASURES.get(name)
    least = measure.resolution if measure else 0.0
    return abs(now - was) > max(least, ROUNDING * max(abs(was), abs(now)))


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


def moment_of(run: Run, folder: Path) -> Moment:
    """A run as a line of a history; the suite lies in `folder`."""
    names = [
        (f"{cell.scene}, {cell.model}: {check.figure.title}", check) for cell, check in run.checks()
    ]
    return Moment(
        created=run.created,
        commit=commit_of(folder),
        rockcheck=run.versions.get("rockcheck", ""),
        suite=run.suite,
        verdict=run.words,
        wall_seconds=run.wall_seconds,
        figures={
            name: None if check.figure.of_a_fall else check.figure.value for name, check in names
        },
        not_passed=tuple(name for name, check in names if check.weighs != "pass"),
    )


def commit_of(folder: Path) -> str:
    """The commit that is checked out in `folder`, "-dirty" appended if files have changed.

    Outside of a repository the continuous integration's commit, "" without one.
    """
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
            return printable(found.stdout.strip())
    return printable(next((os.environ[name][:12] for name in COMMITS if os.environ.get(name)), ""))


def remember(path: Path, moment: Moment) -> list[Moment]:
    """Append a run to the history; returns all its runs of the same suite, the oldest first.

    Raises `InputError`.
    """
    known = read_history(path) if path.exists() else []
    try:
        with path.open("a+b") as stream:
            if stream.tell():  # an editor may have left the last line without its end
                stream.seek(-1, os.SEEK_END)
            end = b"" if stream.read(1) in b"\n" else b"\n"
            stream.write(end + moment.model_dump_json().encode() + b"\n")
    except OSError as error:
        raise InputError(f"{printable(path)}: cannot be written: {error.strerror}") from None
    return [one for one in (*known, moment) if one.suite == moment.suite]


def read_history(path: Path) -> list[Moment]:
    """The runs of a history. Raises `InputError`, naming the line, for an unusable line."""
    found = []
    for n, line in enumerate(read_text(path).splitlines(), 1):
        if not line.strip():
            continue
        try:
            found.append(Moment.model_validate_json(line))
        except ValidationError as error:
            raise InputError(
                f"{printable(path)}, line {n}: not a run of a history: {from_validation(error)}"
            ) from None
    return found


class Trend(Stored):
    """One figure over the runs of a history: its values, None where it is missing."""

    name: str
    values: tuple[float | None, ...]

    @property
    def known(self) -> list[float]:
        """The values that are not missing."""
        return [value for value in self.values if value is not None]

    @property
    def spread(self) -> float:
        """Largest less smallest value over the largest magnitude; 0 if fewer than two are known."""
        most = max(map(abs, self.known), default=0.0)
        return (max(self.known) - min(self.known)) / most if most > 0.0 else 0.0

    @property
    def moved(self) -> bool:
        """Whether the last value differs from the one before."""
        if len(self.values) < 2:
            return False
        check = self.name.rpartition(": ")[2]
        return _moved(re.split("[@ ]", check)[0], *self.values[-2:])


#: Most figures drawn (those that varied most), and most moved figures listed; the table has
#: all that varied.
DRAWN, LISTED = 12, 10


def trend_of(moments: Sequence[Moment]) -> Finding:
    """The finding on a suite's figures over its runs.

    Lists the figures that moved since the run before, draws and tabulates those that varied, and
    lists the runs.
    """
    last = moments[-1]
    every = [
        Trend(name=name, values=tuple(moment.figures.get(name) for moment in moments))
        for name in last.figures
    ]
    every.sort(key=lambda trend: -trend.spread)
    found = [trend for trend in every if trend.spread > 0.0]
    moved = [trend for trend in every if trend.moved]
    before = f" since {moments[-2].commit or moments[-2].created}" if len(moments) > 1 else ""
    told = [
        f"{one.name}: {' -> '.join('-' if v is None else f'{v:.6g}' for v in one.values[-2:])}"
        for one in moved[:LISTED]
    ]
    panels = [_panel(one, moments) for one in found[:DRAWN]]
    rows = [
        [one.name, one.values[0], min(one.known), max(one.known), *one.values[-2:]] for one in found
    ]
    columns = [text("figure"), *map(Column, ("first", "least", "most", "before", "now"))]
    made = [
        [one.created, one.commit, one.rockcheck, one.verdict, len(one.not_passed)]
        for one in reversed(moments)
    ]
    about = [*map(text, ("made", "commit", "rockcheck", "verdict")), Column("not_passed")]
    blocks: list[Block] = [
        Text(f"{len(moments)} runs, {len(moved)} figures moved{before}", items=told),
        *([Plot("trend", panels=panels, x=Axis("run"), shared=False)] if panels else []),
        Table("figures", columns, rows, "What varied", on="page"),
        Table("runs", about, made, "Runs", on="page"),
    ]
    counts = f"{len(found)} figures varied, {len(every) - len(found)} stayed the same"
    return Finding(
        "trend",
        f"{last.suite} over {len(moments)} runs",
        f"{counts}. The last run: {last.verdict}.",
        blocks,
    )


def _panel(trend: Trend, moments: Sequence[Moment]) -> Panel:
    points = dict(enumerate(trend.values, 1))
    bad = [n for n, moment in enumerate(moments, 1) if trend.name in moment.not_passed]
    marked = Series("not passed", bad, [points[n] for n in bad], style="points")
    return Panel(
        trend.name.replace(": ", "\n", 1), [Series("", list(points), trend.values), marked]
    )


#: Smallest peak (alpha) for a meaningful ratio, and the fewest pairs from which a
#: scatter is computed.
LEAST, FEWEST = 1e-3, 5
#: Settings that change no motion.
LIMITS = {"estimate_error", "most_steps", "most_events"}


def pairs_of(runs: Iterable[Run]) -> dict[str, list[tuple[float, float]]]:
    """Peak rotations (reference's, model's) of all scenes by model, if both allow a ratio.

    Both must be finite and larger than `LEAST`. Blocks that fall have no peak: they are left out,
    as are cells of the reference itself.
    """
    found: defaultdict[str, list[tuple[float, float]]] = defaultdict(list)
    for run in runs:
        peaks = _peaks(run)
        reference = peaks.pop(run.reference, {})
        for model, own in peaks.items():
            found[model] += [(reference[place], own[place]) for place in own if place in reference]
    return {model: pairs for model, pairs in found.items() if pairs}


def _peaks(run: Run) -> dict[str, dict[tuple[str, int], float]]:
    """The peak rotations that allow a ratio, by model, and by scene and number in its ensemble."""
    every = [
        (cell.model, (cell.scene, 0), cell.outcome, value_of(cell.figures, "peak_rotation"))
        for cell in run.cells
        if cell.status == "done"
    ]
    every += [
        (model, (drawn.name, n), drawn.outcomes[model][n], peak)
        for drawn in run.ensembles
        for model, peaks in drawn.peaks.items()
        for n, peak in enumerate(peaks)
    ]
    found: defaultdict[str, dict[tuple[str, int], float]] = defaultdict(dict)
    for model, place, outcome, peak in every:
        if peak is not None and peak > LEAST and not outcome.startswith("overturned"):
            found[model][place] = peak
    return found


def experience_of(runs: Sequence[Run]) -> Experience:
    """Bias and scatter by model and figure, and the domain of the scenes, over some runs.

    The domain is the range of each axis, `scenes.experience.axes_of`.
    """
    trust: dict[str, dict[str, Trust]] = {}
    for model, pairs in sorted(pairs_of(runs).items()):
        if found := trust_in(pairs):
            trust[model] = {"peak_rotation": found}
    scenes = [axes_of(run.load_scene(name)) for run in runs for name in run.scenes]
    domain = {}
    for axis in dict.fromkeys(axis for one in scenes for axis in one):
        numbers = [number for one in scenes for number in one.get(axis, ())]
        domain[axis] = Range(low=min(numbers), high=max(numbers))
    settings = {model: _settings_of(model, runs) for model in trust if model in FAMILIES}
    return Experience(
        suites=tuple(run.suite for run in runs), trust=trust, settings=settings, domain=domain
    )


def _settings_of(model: str, runs: Iterable[Run]) -> dict[str, tuple[Any, ...]]:
    """The values of each setting that a model had, but for those that change no motion."""
    values: defaultdict[str, dict[Any, None]] = defaultdict(dict)
    for given in [cell.settings for run in runs for cell in run.cells if cell.model == model]:
        had: Any = build(model, given)
        for name, value in had.model_dump(exclude=LIMITS, exclude_none=True).items():
            values[name][value] = None
    return {name: tuple(found) for name, found in values.items()}


def trust_in(pairs: Sequence[tuple[float, float]]) -> Trust | None:
    """Bias and scatter of (E, M) pairs, None for fewer than `FEWEST`."""
    if len(pairs) < FEWEST:
        return None
    bias, scatter = bias_and_scatter(pairs)
    return Trust(bias=bias, scatter=scatter, count=len(pairs))


def bias_and_scatter(pairs: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Delta and sigma of (E, M) pairs; see the module."""
    ratios = np.log([m / e for e, m in pairs])
    scatter = float(np.std(ratios, ddof=1))
    return math.exp(float(np.mean(ratios)) + 0.5 * scatter**2), scatter
