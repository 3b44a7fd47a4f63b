"""The tables of a run's pages: checks, measures, uncertainties, settings and run times."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from statistics import geometric_mean
from typing import Any

from rockcheck.reports.show.words import duration, number, ratio, unit, window
from rockcheck.reports.style import looks
from rockcheck.reports.view import SceneView
from rockcheck.scenes.history import events_path
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.finding import Column, Mark, Table, text
from rockcheck.validation.suite.results import Cell, Check, Run
from rockcheck.validation.suite.tables import used
from rockcheck.validation.suite.tolerances import MEASURES

#: What a verdict is called and the sign that goes with its colour.
VERDICTS = {
    "pass": ("within tolerance", "✓"),
    "better": ("better", "✓"),
    "not defined": ("not defined here", "–"),
    "incomplete": ("not installed", "–"),
    "changed": ("changed", "△"),
    "fail": ("out of tolerance", "✕"),
    "error": ("failed", "!"),
}
CHECKS = [
    *map(text, ("verdict", "scene")),
    Column("model", kind="model"),
    *map(text, ("measure", "kind")),
    *map(Column, ("expected", "value", "limit")),
    Column("used", "of the limit", kind="used"),
    text("reason"),
]
#: So many of what is not within tolerance are listed first.
WORST = 12


def checks_table(cells: Iterable[Cell], name: str = "") -> Table:
    """All checks of a place's cells; folded under its name where that is given."""
    rows = [_check_row(cell, check) for cell in cells for check in cell.checks]
    count = f"{name}: {len(rows)} check{'' if len(rows) == 1 else 's'}" if name else ""
    columns = [CHECKS[0], *CHECKS[2:]]
    return Table("checks", columns, [[row[0], *row[2:]] for row in rows], count, folded=bool(name))


def verdict_mark(cell: Cell) -> Mark:
    """The verdict on a cell, also where there is nothing to judge."""
    if cell.verdict == "pass" and not cell.checks:
        return Mark("nothing judged")
    return Mark(VERDICTS[cell.verdict][0], cell.verdict)


def worst_table(run: Run, links: Mapping[str, str]) -> Table:
    """What is not within tolerance, the worst first; `links` are the pages of the scenes."""
    rows = [
        _check_row(cell, check, links)
        if check
        else [
            verdict_mark(cell),
            Mark(cell.scene, link=links.get(cell.scene, "")),
            cell.model,
            "no history",
            *[""] * 4,
            None,
            cell.reason,
        ]
        for cell, check in worst_first(run)[:WORST]
    ]
    return Table("worst", CHECKS, rows, "Not within tolerance, the worst first")


def _check_row(cell: Cell, check: Check, links: Mapping[str, str] | None = None) -> list[Any]:
    """One check: what was expected, what came out, the limit, how much of it is used, and why it
    is not a pass."""
    figure, waits = check.figure, check.words == "no tolerance yet"
    against = f"against {_label(figure.against)}, " if figure.against else ""
    return [
        Mark(check.words, "changed")
        if waits
        else Mark(
            VERDICTS[check.verdict][0], "" if check.verdict == "not defined" else check.weighs
        ),
        Mark(cell.scene, link=(links or {}).get(cell.scene, "")),
        cell.model,
        Mark(figure.label, words=formula(figure.measure), more=against + window(figure)),
        check.kind,
        number(check.expected),
        "fell" if figure.of_a_fall else f"{number(figure.value, 4)} {unit(figure.unit)}",
        number(check.limit),
        use(check),
        Mark(check.reason or figure.note, more=check.why),
    ]


def _label(model: str) -> str:
    return looks([model])[model].label


def formula(measure: str) -> str:
    """How a measure is defined, empty where it is not known."""
    return MEASURES[measure].formula if measure in MEASURES else ""


def worst_first(run: Run) -> list[tuple[Cell, Check | None]]:
    """What is not within tolerance: cells without a history, then checks by how far they are out,
    then those that changed.

    A figure that has no tolerance yet is not out of one; the page counts these.
    """
    failed: list[tuple[Cell, Check | None]] = [
        (cell, None) for cell in run.cells if cell.status != "done"
    ]
    checks = [
        (cell, check)
        for cell, check in run.checks()
        if check.weighs != "pass" and check.words != "no tolerance yet"
    ]
    return failed + sorted(checks, key=lambda pair: (pair[1].verdict != "fail", -overrun(pair[1])))


def overrun(check: Check) -> float:
    """How many times its limit a check uses, infinite where that cannot be said."""
    value, limit = check.figure.value, check.limit
    if value is None or not limit:
        return math.inf if check.verdict == "fail" else 0.0
    if check.ideal is None:
        return limit / value if value > 0.0 else math.inf
    return abs(value - check.ideal) / limit


def use(check: Check) -> float:
    """How much of its limit a check uses: above 1 only where it is out."""
    return overrun(check) if check.verdict == "fail" else min(1.0, used(check))


def times_table(run: Run) -> Table:
    """Run times relative to the reference in the same scene, and their geometric mean; the seconds
    below."""
    cells = run.by_scene()
    rows = []
    for model in run.models:
        taken = {
            place: (found[model].cost.wall_seconds, found[run.reference].cost.wall_seconds)
            if run.reference in found and found[run.reference].status == "done"
            else (found[model].cost.wall_seconds, 0.0)
            for place, found in cells.items()
            if model in found and found[model].status == "done"
        }
        ratios = {place: own / base for place, (own, base) in taken.items() if own * base > 0.0}
        shown = (
            Mark(ratio(ratios.get(place)), more=duration(taken[place][0]) if place in taken else "")
            for place in cells
        )
        rows.append([model, geometric_mean(ratios.values()) if ratios else None, *shown])
    columns = [Column(f"scene {place}", place) for place in cells]
    mean = Column("ratio", "geometric mean, ×")
    return Table("times", [Column("model", kind="model"), mean, *columns], rows)


def measures_table(view: SceneView, against: str) -> Table:
    """All figures of a scene that are held against `against`, a row a measure and window, a column
    a model."""
    found: dict[tuple[str, str], dict[str, tuple[Figure, Check | None]]] = {}
    for cell in view.cells:
        judged = [(check.figure, check) for check in cell.checks]
        for figure, check in (*judged, *((figure, None) for figure in cell.figures)):
            if figure.against == against:
                of_measure = found.setdefault((figure.measure, figure.window), {})
                of_measure.setdefault(cell.model, (figure, check))
    models = [cell.model for cell in view.cells if any(cell.model in row for row in found.values())]
    firsts = {key: next(iter(row.values()))[0] for key, row in found.items()}
    rows = [
        [_measure(firsts[key]), *(_measured(*found[key].get(m, (None, None))) for m in models)]
        for key in sorted(found, key=lambda key: (key[0], firsts[key].until or math.inf))
    ]
    title = f"All measures against {_label(against)}"
    columns = [text("measure"), *map(Column, models)]
    return Table("measures", columns, rows, title, folded=True)


def _measure(figure: Figure) -> Mark:
    return Mark(figure.label, words=formula(figure.measure), more=window(figure))


def _measured(figure: Figure | None, check: Check | None) -> Any:
    if figure is None:
        return None
    limit = f"limit {number(check.limit)}" if check else ""
    return Mark(
        f"{number(figure.value, 4)} {unit(figure.unit)}",
        check.weighs if check and check.verdict != "not defined" else "",
        more="; ".join(filter(None, [limit, figure.note])),
    )


def uncertainty_table(view: SceneView) -> Table:
    """The differences of a scene's models from their references, and what is known of their
    uncertainty."""
    rows = [
        [
            cell.model,
            one.quantity,
            _label(one.against),
            None if one.quantity == "outcome" else one.error,
            unit(one.unit),
            one.u_num,
            one.u_input,
            one.u_data,
            Mark(one.verdict, more=one.reason),
        ]
        for cell in view.cells
        for one in cell.explanations
    ]
    columns = [
        Column("model", kind="model"),
        *map(text, ("quantity", "against")),
        Column("difference"),
        text("unit"),
        *(Column(f"u_{name}") for name in ("num", "input", "D")),
        text("says"),
    ]
    return Table("uncertainty", columns, rows)


def runs_table(
    run: Run, cells: Sequence[Cell], root: str = "", histories: Mapping[str, Any] | None = None
) -> Table:
    """Settings, run times and outcomes of a place's cells; of an ensemble (no `histories`) the CPU
    time of all its scenes. `root` is the way to the run's folder."""
    of = "cpu_seconds" if histories is None else "wall_seconds"
    base = next((cell for cell in cells if cell.model == run.reference), None)
    rows = [
        [
            cell.model,
            ", ".join(f"{key} = {value}" for key, value in cell.settings.items()),
            *(_costs(cell, of, base) if cell.status == "done" else [""] * 5),
            Mark(cell.fate or cell.reason, more="; ".join([*cell.notes, *_energy(cell)])),
            *(
                Mark("CSV", link=f"{root}/{path}") if path and cell.model in histories else ""
                for path in (cell.history, events_path(Path(cell.history or "-")).as_posix())
                if histories is not None
            ),
        ]
        for cell in cells
    ]
    names = ("run time", "against the reference", "set-up", "steps", "evaluations")
    columns = [
        Column("model", kind="model"),
        text("settings"),
        *map(Column, names),
        *map(text, ("outcome and remarks", "history", "events")[: 1 if histories is None else 3]),
    ]
    title = "Models, settings and run times"
    return Table("models", columns, rows, title, folded=histories is not None)


def _costs(cell: Cell, of: str, base: Cell | None) -> list[str]:
    cost, whole = cell.cost, getattr(base.cost, of) if base else 0.0
    return [
        duration(getattr(cost, of)),
        ratio(getattr(cost, of) / whole if whole > 0.0 else None),
        duration(cost.set_up),
        *(f"{count:,}".replace(",", "\u202f") for count in (cost.steps, cost.evaluations)),
    ]


def _energy(cell: Cell) -> list[str]:
    most = f"at most {number(100.0 * cell.cost.largest_energy_gain, 2)} %"
    gains = cell.cost.energy_gains
    return [f"{gains} impacts added energy, {most}"] if gains else []
