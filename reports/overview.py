"""The answer first: how far each model lies from the run's reference, scene by scene, and over all
scenes."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rockcheck.reports.style import PAGE, figure_style, log_scales, looks, save
from rockcheck.reports.tables import overrun
from rockcheck.reports.view import FALL
from rockcheck.scenes.experience import Trust, known
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.suite.experience import FEWEST, bias_and_scatter, pairs_of
from rockcheck.validation.suite.results import Cell, Check, Run
from rockcheck.validation.suite.tolerances import MEASURES, apart

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

QUANTITY = "peak_rotation"
#: The figure of all peaks; no scene's file has such a name.
PEAKS = "overview-peaks"


@dataclass(frozen=True)
class Entry:
    """One model in one scene: the RMS difference of the rotation and the ratio of the peaks, both
    against the run's reference.

    `rms` is the judged figure of the shortest window, else the one of the whole time, which is
    `whole`. `u_num` is the model's numerical uncertainty of `whole` (alpha), where it is known.
    `apart`: of it and the reference one falls and the other does not, or to another side.
    """

    cell: Cell
    rms: Figure | None
    whole: Figure | None
    ratio: float | None
    u_num: float | None
    outcome: str
    apart: bool

    @property
    def used(self) -> float:
        """The largest share of a limit that the cell uses; infinite where it has no history."""
        return (
            math.inf
            if self.cell.status != "done"
            else max(map(overrun, self.cell.checks), default=0.0)
        )

    @property
    def nearest(self) -> Check | None:
        """The check that uses most of its limit."""
        return max(self.cell.checks, key=overrun, default=None)


@dataclass(frozen=True)
class Row:
    """A scene: its name, and an entry for each model (None where it does not play it)."""

    scene: str
    entries: tuple[Entry | None, ...]

    @property
    def worst(self) -> float:
        """The largest share of a limit that any model uses, as a number that a page can sort by."""
        return min(max((entry.used for entry in self.entries if entry), default=0.0), 1e9)

    @property
    def verdicts(self) -> str:
        """The verdicts in the row, each once; "not-converged" too where a cell is not."""
        cells = [entry.cell for entry in self.entries if entry]
        return " ".join(
            dict.fromkeys(
                [
                    *(cell.verdict for cell in cells),
                    *("not-converged" for cell in cells if cell.converged is False),
                ]
            )
        )


@dataclass(frozen=True)
class Glance:
    """What most readers ask: the entry farthest from the reference, the scenes whose outcome
    depends on the model, and what is no longer as it was accepted (the farthest first; `judged`
    were looked at). A figure that is out of a limit but as it was accepted has not changed."""

    farthest: Entry | None
    apart: tuple[Row, ...]
    changed: tuple[tuple[Cell, Check], ...]
    judged: int


@dataclass(frozen=True)
class Accuracy:
    """A model over all scenes: (reference's, model's) peaks (alpha), bias and scatter in this run,
    and over all suites."""

    model: str
    pairs: Sequence[tuple[float, float]]
    here: Trust | None
    everywhere: Trust | None


def matrix(run: Run) -> list[Row]:
    """A row a scene, an entry a model of the run."""
    cells = run.by_scene()
    return [
        Row(
            scene, tuple(_entry(cells.get(scene, {}), model, run.reference) for model in run.models)
        )
        for scene in run.scenes
    ]


def glance(run: Run, rows: Sequence[Row] | None = None) -> Glance:
    """The answers that the index gives first; `rows` are those of the run's `matrix`, where they
    are known."""
    rows = matrix(run) if rows is None else rows
    entries = [
        one
        for row in rows
        for one in row.entries
        if one and one.cell.model != run.reference and one.rms
    ]
    accepted = [(cell, check) for cell, check in run.checks() if check.expected is not None]
    return Glance(
        farthest=max(
            entries, key=lambda one: (one.rms.value if one.rms else None) or 0.0, default=None
        ),
        apart=tuple(row for row in rows if any(one and one.apart for one in row.entries)),
        changed=tuple(
            sorted(
                (pair for pair in accepted if _moved(pair[1])), key=lambda pair: -overrun(pair[1])
            )
        ),
        judged=len(accepted),
    )


def _moved(check: Check) -> bool:
    """Whether a figure left its drift band; without one, its limit."""
    value, expected = check.figure.value, check.expected
    if check.drift is None or value is None or expected is None:
        return check.weighs != "pass"
    measure = MEASURES.get(check.figure.measure)
    return (
        apart(value, expected, check.floor, (measure.ideal if measure else None) or 0.0)
        > check.drift
    )


def entry(run: Run, scene: str, model: str) -> Entry | None:
    """How far a model lies from the run's reference in a scene; None where it does not play it."""
    return _entry({cell.model: cell for cell in run.of_scene(scene)}, model, run.reference)


def _entry(cells: Mapping[str, Cell], model: str, against: str) -> Entry | None:
    """`entry`, of a scene's cells by model and the name of the reference."""
    cell, reference = cells.get(model), cells.get(against)
    if cell is None:
        return None
    figures = [check.figure for check in cell.checks] + list(cell.figures)
    found = [
        f
        for f in figures
        if f.measure == "theta_rms" and f.against == against and f.value is not None
    ]
    whole = next((f for f in found if not f.window), None)
    falls = [
        _side(outcome_of(one))
        for one in (cell, reference)
        if one is not None and one.status == "done"
    ]
    return Entry(
        cell=cell,
        rms=min(found, key=lambda figure: figure.until or math.inf, default=None),
        whole=whole,
        ratio=next(
            (
                f.value
                for f in figures
                if f.measure == "peak_ratio" and f.against == against and not f.window
            ),
            None,
        ),
        u_num=cell.numerical.u_num("theta_rms") if cell.numerical and whole else None,
        outcome=outcome_of(cell),
        apart=len(set(falls)) > 1,
    )


def outcome_of(cell: Cell) -> str:
    """What became of the block; "falling left" or "falling right" where the run ends while it
    falls."""
    figures = (*(check.figure for check in cell.checks), *cell.figures)
    last = next(
        (
            f.value
            for f in figures
            if f.measure == "last_rotation" and f.unit == "alpha" and not f.window
        ),
        None,
    )
    if cell.outcome == "moving" and last is not None and abs(last) > FALL:
        return f"falling {'left' if last > 0.0 else 'right'}"
    return cell.fate


def _side(outcome: str) -> str:
    """The side to which a block falls, empty where it stays."""
    words = outcome.split()
    return words[1] if words and words[0] in ("overturned", "falling") else ""


def accuracies(run: Run) -> list[Accuracy]:
    """Each model that has peaks to be compared with the reference's, in the run's order."""
    pairs = {model: found for (model, name), found in pairs_of([run]).items() if name == QUANTITY}
    everywhere = known().trust
    return [
        Accuracy(m, pairs[m], _trust(pairs[m]), everywhere.get(m, {}).get(QUANTITY))
        for m in run.models
        if m in pairs
    ]


def _trust(pairs: Sequence[tuple[float, float]]) -> Trust | None:
    if len(pairs) < FEWEST:
        return None
    bias, scatter = bias_and_scatter(pairs)
    return Trust(bias=bias, scatter=scatter, count=len(pairs))


def peaks_figure(run: Run, found: Sequence[Accuracy]) -> Drawing:
    """Peak rotation by each model against the reference's: a point a scene, a line for its bias,
    dashed lines at two sigma."""
    from matplotlib.figure import Figure

    styles = looks(run.models)
    columns = min(4, len(found))
    rows = -(-len(found) // columns)
    values = [value for one in found for pair in one.pairs for value in pair]
    low, high = (
        10.0 ** whole(math.log10(end))
        for whole, end in ((math.floor, 0.8 * min(values)), (math.ceil, 1.25 * max(values)))
    )
    with figure_style():
        height = 0.7 + 1.85 * rows
        figure = Figure(figsize=(PAGE, height))
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
        figure.subplots_adjust(
            0.085, 0.42 / height, 0.98, 1.0 - 0.3 / height, wspace=0.22, hspace=0.3
        )
        for ax, one in zip(panels, found, strict=False):
            _points(ax, one, styles[one.model].light, (low, high))
            ax.set_title(styles[one.model].label)
        for ax in panels[len(found) :]:
            ax.set_visible(False)
        figure.supxlabel(
            f"peak |θ|/α by {styles[run.reference].label}", fontsize=7.5, y=0.05 / height
        )
        figure.supylabel("peak |θ|/α by the model", fontsize=7.5, x=0.005)
    return figure


def _points(ax: Axes, one: Accuracy, color: str, ends: tuple[float, float]) -> None:
    x, y = np.array(one.pairs).T
    line = np.array(ends)
    ax.plot(line, line, color="#999999", linewidth=0.6, zorder=1)
    trust = one.everywhere or one.here
    if trust is not None:
        ax.plot(line, trust.bias * line, color=color, linewidth=0.7, zorder=2)
        for side in (-2.0, 2.0):
            ax.plot(
                line,
                trust.bias * math.exp(side * trust.scatter) * line,
                color=color,
                linewidth=0.6,
                linestyle="--",
                zorder=2,
            )
    ax.plot(x, y, ".", color=color, markersize=5.0, markeredgewidth=0, alpha=0.7, zorder=3)
    ax.set_xscale("log")
    ax.set_yscale("log")
    log_scales(ax, decades=4)
    ax.set_xlim(*ends)
    ax.set_ylim(*ends)


def write_overview(run: Run, folder: Path, scenes: Container[str]) -> Mapping[str, object]:
    """Writes the figure of all peaks into `folder`, where there is something to say; returns what
    the index shows.

    `scenes` are those that have a page; the others stand in no table.
    """
    found = accuracies(run)
    found = found if any(one.here or one.everywhere for one in found) else []
    if found:
        save(peaks_figure(run, found), folder / PEAKS, ["svg"])
    else:
        (folder / f"{PEAKS}.svg").unlink(missing_ok=True)
    rows = matrix(run)
    return {
        "matrix": [row for row in rows if row.scene in scenes],
        "accuracies": found,
        "glance": glance(run, rows),
    }
