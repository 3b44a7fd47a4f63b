"""The tables of a run's pages: checks, what is worst, times, measures, uncertainty, settings.

In: a finished run, or a scene's view of it. Out: tables of a finding. Called by `site`, its
templates, and the page of an ensemble.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from statistics import geometric_mean
from typing import Any

from rockcheck.reports.show.words import duration, number, ratio, unit, window
from rockcheck.reports.style import label_of
from rockcheck.reports.view import SceneView
from rockcheck.scenes.history_files import events_path
from rockcheck.validation.discrepancy import figures
from rockcheck.validation.finding import (
    Column,
    Mark,
    Table,
    Verdict,
    text,
)
from rockcheck.validation.suite import results
from rockcheck.validation.suite.limits_used import used
from rockcheck.validation.suite.tolerances import known

#: What a verdict is called and the sign that goes with its colour.
NAME_AND_SIGN = {
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


def checks_table(cells: Iterable[results.Cell], name: str = "") -> Table:
    """All checks of a place's cells; folded under its name where that is given."""
    rows = [_check_row(cell, check) for cell in cells for check in cell.checks]
    count = f"{name}: {len(rows)} check{'' if len(rows) == 1 else 's'}" if name else ""
    without_scene = [[verdict, *more] for verdict, _, *more in (CHECKS, *rows)]
    return Table("checks", without_scene[0], without_scene[1:], count, folded=bool(name))


def verdict_mark(cell: results.Cell) -> Mark:
    """The verdict on a cell, also where there is nothing to judge."""
    return (
        Mark(NAME_AND_SIGN[cell.verdict][0], cell.verdict)
        if cell.verdict != "pass" or cell.checks
        else Mark("nothing judged")
    )


def worst_table(run: results.Run, links: Mapping[str, str]) -> Table:
    """What is not within tolerance, the worst first; `links` are the pages of the scenes."""
    return Table(
        "worst",
        CHECKS,
        [
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
        ],
        "Not within tolerance, the worst first",
    )


def _check_row(
    cell: results.Cell, check: results.Check, links: Mapping[str, str] | None = None
) -> list[Any]:
    figure = check.figure
    colour: Verdict = "" if check.verdict == "not defined" else check.weight
    against = f"against {label_of(figure.against)}, " if figure.against else ""
    return [
        Mark(check.verdict_words, "changed")
        if check.waits_for_tolerance
        else Mark(NAME_AND_SIGN[check.verdict][0], colour),
        Mark(cell.scene, link=(links or {}).get(cell.scene, "")),
        cell.model,
        Mark(figure.label, words=known(figure.measure).formula, more=against + window(figure)),
        check.kind,
        number(check.expected),
        "fell" if figure.of_a_fall else f"{number(figure.value, 4)} {unit(figure.unit)}",
        number(check.limit),
        used(check),
        Mark(check.reason or figure.note, more=check.why),
    ]


def worst_first(run: results.Run) -> list[tuple[results.Cell, results.Check | None]]:
    """What is not within tolerance, the worst first.

    Cells whose model failed, checks by how far they are out, those that changed, then cells whose
    model is not installed; where it has no wheel, that weighs nothing.

    A figure that has no tolerance yet is not out of one; the page counts these.
    """
    failed, absent = (
        [(cell, None) for cell in run.cells if cell.status == status]
        for status in ("failed", "absent")
    )
    return [
        *failed,
        *sorted(
            (
                (cell, check)
                for cell, check in run.checks()
                if check.weight != "pass" and not check.waits_for_tolerance
            ),
            key=lambda pair: (pair[1].verdict != "fail", -used(pair[1])),
        ),
        *absent,
    ]


def times_table(run: results.Run) -> Table:
    """Run times relative to the reference in the same scene, and their geometric mean.

    The seconds stand below.
    """
    places = run.by_scene
    taken = {
        model: {
            place: cells[model].cost.wall_seconds
            for place, cells in places.items()
            if model in cells and cells[model].status == "done"
        }
        for model in run.models
    }
    base, rows = taken.get(run.reference, {}), []
    for model, own in taken.items():
        ratios = {at: own[at] / base[at] for at in own if own[at] * base.get(at, 0.0) > 0.0}
        rows.append(
            [
                model,
                geometric_mean(ratios.values()) if ratios else None,
                *(
                    Mark(ratio(ratios.get(at)), more=duration(own[at]) if at in own else "")
                    for at in places
                ),
            ]
        )
    return Table(
        "times",
        [
            Column("model", kind="model"),
            Column("ratio", "geometric mean, ×"),
            *(Column(f"scene {place}", place) for place in places),
        ],
        rows,
    )


def measures_table(view: SceneView, against: str) -> Table:
    """All figures of a scene that are held against `against`.

    A row a measure and window, a column a model.
    """
    shown = [
        (cell.model, figure, check)
        for cell in view.cells
        for figure, check in (
            *((check.figure, check) for check in cell.checks),
            *((figure, None) for figure in cell.figures),
        )
        if figure.against == against
    ]
    firsts: dict[tuple[str, str], figures.Figure] = {}
    marks: dict[tuple[str, str, str], Mark] = {}
    for model, figure, check in shown:
        firsts.setdefault((figure.measure, figure.window), figure)
        limit = f"limit {number(check.limit)}" if check else ""
        mark = Mark(
            f"{number(figure.value, 4)} {unit(figure.unit)}",
            check.weight if check and check.verdict != "not defined" else "",
            more="; ".join(filter(None, [limit, figure.note])),
        )
        marks.setdefault((figure.measure, figure.window, model), mark)
    models = list(dict.fromkeys(model for model, *_ in shown))
    return Table(
        "measures",
        [text("measure"), *map(Column, models)],
        [
            [
                Mark(firsts[key].label, words=known(key[0]).formula, more=window(firsts[key])),
                *(marks.get((*key, model)) for model in models),
            ]
            for key in sorted(firsts, key=lambda key: (key[0], firsts[key].until or math.inf))
        ],
        f"All measures against {label_of(against)}",
        folded=True,
    )


def uncertainty_table(view: SceneView) -> Table:
    """Differences of a scene's models from their references, and their known uncertainty."""
    return Table(
        "uncertainty",
        [
            Column("model", kind="model"),
            *map(text, ("quantity", "against")),
            Column("difference"),
            text("unit"),
            *(Column(f"u_{name}") for name in ("num", "input", "D")),
            text("says"),
        ],
        [
            [
                cell.model,
                one.quantity,
                label_of(one.against),
                None if one.quantity == "outcome" else one.error,
                unit(one.unit),
                one.u_num,
                one.u_input,
                one.u_data,
                Mark(one.verdict, more=one.reason),
            ]
            for cell in view.cells
            for one in cell.explanations
        ],
    )


def runs_table(
    run: results.Run,
    cells: Sequence[results.Cell],
    histories: Mapping[str, Any] | None = None,
) -> Table:
    """Settings, run times and outcomes of a place's cells.

    Of an ensemble (no `histories`) the time of all its scenes. Links lead from a scene's page.
    """
    whole = next((cell.cost.wall_seconds for cell in cells if cell.model == run.reference), 0.0)
    gains = {
        cell.model: [
            f"{cell.cost.energy_gains} impacts added energy,"
            f" at most {number(100.0 * cell.cost.largest_energy_gain, 2)} %"
        ]
        if cell.cost.energy_gains
        else []
        for cell in cells
    }
    costs = {
        cell.model: [
            duration(cell.cost.wall_seconds),
            ratio(cell.cost.wall_seconds / whole if whole > 0.0 else None),
            duration(cell.cost.set_up),
            f"{cell.cost.steps:,}".replace(",", "\u202f"),
            f"{cell.cost.evaluations:,}".replace(",", "\u202f"),
        ]
        for cell in cells
        if cell.status == "done"
    }
    rows = [
        [
            cell.model,
            ", ".join(f"{key} = {value}" for key, value in cell.settings.items()),
            *costs.get(cell.model, [""] * 5),
            Mark(cell.fate or cell.reason, more="; ".join([*cell.notes, *gains[cell.model]])),
            *(
                Mark("CSV", link=f"../{path}") if path and cell.model in histories else ""
                for path in (cell.history, events_path(Path(cell.history or "-")).as_posix())
                if histories is not None
            ),
        ]
        for cell in cells
    ]
    return Table(
        "models",
        [
            Column("model", kind="model"),
            text("settings"),
            *map(Column, ("run time", "against the reference", "set-up", "steps", "evaluations")),
            text("outcome and remarks"),
            *(text(name) for name in ("history", "events") if histories is not None),
        ],
        rows,
        "Models, settings and run times",
        folded=histories is not None,
    )
