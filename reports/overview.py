"""The answer first: how far each model lies from the run's reference, scene by scene, and over all
scenes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rockcheck.reports.style import looks
from rockcheck.reports.tables import overrun
from rockcheck.reports.view import FALL
from rockcheck.scenes.experience import Trust, known
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.finding import Axis, Block, Column, Panel, Plot, Series, Table
from rockcheck.validation.suite.experience import FEWEST, bias_and_scatter, pairs_of
from rockcheck.validation.suite.results import Cell, Check, Run
from rockcheck.validation.suite.tolerances import MEASURES, apart

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
    def why_apart(self) -> str:
        """Why an outcome other than the reference's is within tolerance; "" where it is not, or
        both are the same."""
        if not self.apart or not self.cell.checks or self.cell.verdict != "pass":
            return ""
        judged = any(check.figure.measure == "outcome_agrees" for check in self.cell.checks)
        return f"not as the reference; {'accepted' if judged else 'not judged'}"

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
    """'left', 'right', or '' if the block does not overturn."""
    words = outcome.split()
    return words[1] if words and words[0] in ("overturned", "falling") else ""


def accuracy(run: Run) -> list[Block]:
    """Peak rotation by each model against the reference's, over all scenes: a point a scene, lines
    for the bias and two standard deviations; bias and scatter of this run and of all suites.

    Nothing where neither is known.
    """
    pairs = {m: found for (m, name), found in pairs_of([run]).items() if name == QUANTITY}
    everywhere = {m: of[QUANTITY] for m, of in known().trust.items() if QUANTITY in of}
    here = {
        m: Trust(bias=bias, scatter=scatter, count=len(pairs[m]))
        for m in run.models
        if m in pairs and len(pairs[m]) >= FEWEST
        for bias, scatter in (bias_and_scatter(pairs[m]),)
    }
    found = [model for model in run.models if model in pairs]
    if not any(model in here or model in everywhere for model in found):
        return []
    styles = looks(run.models)
    values = [value for model in found for pair in pairs[model] for value in pair]
    ends = (
        10.0 ** math.floor(math.log10(0.8 * min(values))),
        10.0 ** math.ceil(math.log10(1.25 * max(values))),
    )
    panels, rows = [], []
    for model in found:
        x, y = zip(*pairs[model], strict=True)
        trusts = here.get(model), everywhere.get(model)
        trust, look = trusts[1] or trusts[0], styles[model].key
        lines = [Series("", ends, ends, style="thin")]
        if trust:
            factors = [trust.bias * math.exp(sigma * trust.scatter) for sigma in (0.0, -2.0, 2.0)]
            bias, *two = ([factor * end for end in ends] for factor in factors)
            lines.append(Series("", ends, bias, look=look, style="smooth"))
            lines += [Series("", ends, line, look=look, style="dots") for line in two]
        lines.append(Series("", x, y, look=look, style="points"))
        panels.append(Panel(styles[model].label, lines))
        shown = [(one.bias, one.scatter) if one else (None, None) for one in trusts]
        rows.append([model, len(x), *shown[0], *shown[1]])
    columns = [
        Column("model", kind="model"),
        Column("scenes_here"),
        *(
            Column(
                f"{what}_{where}",
                f"{what}, {where.replace('_', ' ')}",
                digits=digits,
                optional=True,
            )
            for where in ("here", "all_suites")
            for what, digits in (("bias", 4), ("scatter", 2))
        ),
    ]
    x_axis, y_axis = (
        Axis(f"peak |θ|/α by {of}", log=True, limits=ends)
        for of in (styles[run.reference].label, "the model")
    )
    title, note = (
        "Predicted against reference",
        (
            "Peak rotation of the blocks that stand. Grey: equal. Coloured: the bias; dotted: two"
            " standard deviations."
        ),
    )
    return [
        Plot(PEAKS, title, panels=panels, x=x_axis, y=y_axis, note=note),
        Table("accuracy", columns, rows),
    ]
