"""The tables of a run's pages.

First the answer: how far each model lies from the run's reference, scene by scene and over all
scenes.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from statistics import geometric_mean
from typing import Any

from rockcheck.reports.show.words import duration, number, ratio, unit, window
from rockcheck.reports.style import Look, label_of, looks
from rockcheck.reports.view import FALL, SceneView, fall_to
from rockcheck.scenes import Side, experience
from rockcheck.scenes.history_files import events_path
from rockcheck.validation.discrepancy import figures
from rockcheck.validation.finding import (
    Axis,
    Block,
    Column,
    Mark,
    Panel,
    Plot,
    Series,
    Style,
    Table,
    text,
)
from rockcheck.validation.suite import across, results
from rockcheck.validation.suite.tables import nearest, used
from rockcheck.validation.suite.tolerances import known
from rockcheck.validation.suite.verdicts import apart

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


def checks_table(cells: Iterable[results.Cell], name: str = "") -> Table:
    """All checks of a place's cells; folded under its name where that is given."""
    rows = [_check_row(cell, check) for cell in cells for check in cell.checks]
    count = f"{name}: {len(rows)} check{'' if len(rows) == 1 else 's'}" if name else ""
    without_scene = [[verdict, *more] for verdict, _, *more in (CHECKS, *rows)]
    return Table("checks", without_scene[0], without_scene[1:], count, folded=bool(name))


def verdict_mark(cell: results.Cell) -> Mark:
    """The verdict on a cell, also where there is nothing to judge."""
    return (
        Mark(VERDICTS[cell.verdict][0], cell.verdict)
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
    figure, weighs = check.figure, "" if check.verdict == "not defined" else check.weighs
    against = f"against {label_of(figure.against)}, " if figure.against else ""
    return [
        Mark(check.words, "changed")
        if check.words == "no tolerance yet"
        else Mark(VERDICTS[check.verdict][0], weighs),
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
                if check.weighs != "pass" and check.words != "no tolerance yet"
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
            check.weighs if check and check.verdict != "not defined" else "",
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


#: One model in one scene, see `entry`.
Entry = Mapping[str, Any]
#: What is drawn of an expected peak: the bias, and so many standard deviations below and above it.
DEVIATIONS: dict[float, Style] = {0.0: "smooth", -2.0: "dots", 2.0: "dots"}
#: The figure of all peaks; no scene's file has such a name.
PEAKS = "overview~peaks"


def matrix(run: results.Run, scenes: Iterable[str] = ()) -> dict[str, dict[str, Entry]]:
    """By scene and model: an entry for each cell of these scenes, or of all."""
    cells = run.by_scene
    return {
        scene: {
            model: entry(run, cells[scene], model)
            for model in run.models
            if model in cells.get(scene, ())
        }
        for scene in scenes or run.scenes
    }


def glance(run: results.Run, rows: Mapping[str, Mapping[str, Entry]]) -> dict[str, Any]:
    """The answers that the index gives first; `rows` are the run's `matrix`.

    The entry `farthest` from the reference, the scenes whose outcome depends on the model (`apart`,
    each with its row), and what has `changed` since it was accepted (the farthest first; `judged`
    were looked at). A figure that is out of a limit but as it was accepted has not changed.
    """
    others = (
        one
        for row in rows.values()
        for one in row.values()
        if one["cell"].model != run.reference and one["rms"]
    )
    accepted = [(cell, check) for cell, check in run.checks() if check.expected is not None]
    return {
        "farthest": max(others, key=lambda one: one["rms"].value, default=None),
        "apart": [
            (at, row) for at, row in rows.items() if any(one["apart"] for one in row.values())
        ],
        "changed": sorted(
            (pair for pair in accepted if _moved(pair[1])), key=lambda pair: -used(pair[1])
        ),
        "judged": len(accepted),
    }


def _moved(check: results.Check) -> bool:
    """Whether a figure left its drift band; without one, its limit."""
    value, expected = check.figure.value, check.expected
    if check.drift is None or value is None or expected is None:
        return check.weighs != "pass"
    ideal = known(check.figure.measure).ideal or 0.0
    return apart(value, expected, check.floor, ideal) > check.drift


def entry(run: results.Run, cells: Mapping[str, results.Cell], model: str) -> Entry:
    """How far a model lies from the run's reference in a scene, which it plays.

    `cells` are those of the scene, by model. Of its `cell`: `rms`, the RMS difference of rotation,
    is the judged figure of the shortest window, else the one of the `whole` time; `ratio` is that
    of the peaks. `u_num` is the model's numerical uncertainty of `whole` (alpha), where known.

    `apart`: of it and the reference one falls and the other does not, or to another side, and
    `why_apart`. `nearest` is the check that uses most of its limit, `used` the largest share;
    infinite where there is no history.
    """
    cell, figures, against = cells[model], cells[model].figures, run.reference
    of = "theta_rms", against
    found = [f for f in figures if (f.measure, f.against) == of and f.value is not None]
    whole = next((f for f in found if not f.window), None)
    compared = (cell, cells.get(against))
    outcomes = [outcome_of(run, one) for one in compared if one and one.status == "done"]
    sides = {("left" in outcome) - ("right" in outcome) for outcome in outcomes}
    return {
        "cell": cell,
        "rms": min(found, key=lambda figure: figure.until or math.inf, default=None),
        "whole": whole,
        "ratio": results.value_of(figures, "peak_ratio", against),
        "u_num": cell.numerical.u_num("theta_rms") if cell.numerical and whole else None,
        "outcome": outcome_of(run, cell),
        "apart": len(sides) > 1,
        "why_apart": why_apart(cell) if len(sides) > 1 else "",
        "nearest": nearest(cell.checks),
        "used": max(map(used, cell.checks), default=0.0) if cell.status == "done" else math.inf,
    }


def why_apart(cell: results.Cell) -> str:
    """Why an outcome other than the reference's is within tolerance; "" where it is not."""
    judged = any(check.figure.measure == "outcome_agrees" for check in cell.checks)
    said = f"not as the reference; {'accepted' if judged else 'not judged'}"
    return said if cell.checks and cell.verdict == "pass" else ""


def outcome_of(run: results.Run, cell: results.Cell) -> str:
    """The outcome of a cell; "falling left" or "falling right" if the run ends during the fall.

    A block that may lean on a wall on that side is not falling.
    """
    turns = (f for f in cell.figures if f.unit == "alpha")
    last = results.value_of(turns, "last_rotation") or 0.0
    side: Side = "left" if last > 0.0 else "right"
    if cell.outcome != "moving" or abs(last) <= FALL:
        return cell.fate
    scene = run.load_scene(cell.scene)
    falls = abs(last) > fall_to(side, scene.block) and not scene.wall(side)
    return f"falling {side}" if falls else cell.fate


def alike(run: results.Run, cells: Sequence[results.Cell]) -> list[list[results.Cell]]:
    """Cells of a scene by what its card says of them: verdict, whether judged, and outcome."""
    groups: dict[tuple[str, str, bool, str], list[results.Cell]] = {}
    for cell in cells:
        outcome = outcome_of(run, cell) if cell.outcome else ""
        groups.setdefault((cell.verdict, cell.words, bool(cell.checks), outcome), []).append(cell)
    return list(groups.values())


def accuracy(run: results.Run) -> list[Block]:
    """Peak rotation by each model against the reference's, over all scenes.

    A point a scene, lines for the bias and two standard deviations; bias and scatter of this run
    and of all suites.

    Nothing where neither is known.
    """
    # one that was falling at the end does not stand
    stand = [cell for cell in run.cells if not outcome_of(run, cell).startswith("falling")]
    pairs = across.pairs_of([run.model_copy(update={"cells": stand})])
    styles, settings = looks(run.models), {cell.model: cell.settings for cell in run.cells}
    trusts = {
        model: (
            across.trust_in(pairs[model]),
            experience.trust_of(model, settings.get(model, {})).get("peak_rotation"),
        )
        for model in run.models
        if model in pairs
    }
    if not any(map(any, trusts.values())):
        return []
    values = [value for model in trusts for pair in pairs[model] for value in pair]
    ends = (
        10.0 ** math.floor(math.log10(0.8 * min(values))),
        10.0 ** math.ceil(math.log10(1.25 * max(values))),
    )
    panels = [
        _predicted(styles[model], pairs[model], in_all or here, ends)
        for model, (here, in_all) in trusts.items()
    ]
    rows = [
        [model, len(pairs[model])]
        + [getattr(one, name, None) for one in trust for name in ("bias", "scatter")]
        for model, trust in trusts.items()
    ]
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
    return [
        Plot(
            PEAKS,
            "Predicted against reference",
            panels=panels,
            x=x_axis,
            y=y_axis,
            note="Peak rotation of the blocks that stand. Grey: equal. Coloured: the bias; dotted:"
            " two standard deviations.",
        ),
        Table("accuracy", columns, rows),
    ]


def _predicted(
    look: Look,
    pairs: Sequence[tuple[float, float]],
    trust: experience.Trust | None,
    ends: tuple[float, float],
) -> Panel:
    """A point a pair of peaks, and the lines on which they are expected."""
    expected = trust and [
        Series(
            "",
            ends,
            [trust.bias * math.exp(sigma * trust.scatter) * end for end in ends],
            look=look.key,
            style=style,
        )
        for sigma, style in DEVIATIONS.items()
    ]
    x, y = zip(*pairs, strict=True)
    return Panel(
        look.label,
        [
            Series("", ends, ends, style="thin"),
            *(expected or ()),
            Series("", x, y, look=look.key, style="points"),
        ],
    )
