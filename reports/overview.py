"""How far each model lies from the run's reference: by scene, at a glance, and over all scenes.

In: a finished run. Out: entries of the matrix on its index, the answers above it, and blocks on
peaks. Called by `site` and its templates.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from rockcheck.reports.style import Look, looks
from rockcheck.reports.view import FALL, fall_to
from rockcheck.scenes import Side, experience
from rockcheck.validation.discrepancy import figures
from rockcheck.validation.finding import Axis, Block, Column, Panel, Plot, Series, Style, Table
from rockcheck.validation.suite import model_bias, results
from rockcheck.validation.suite.limits_used import nearest, used
from rockcheck.validation.suite.tolerances import known
from rockcheck.validation.suite.verdicts import apart

#: What is drawn of an expected peak: the bias, and so many standard deviations below and above it.
DEVIATIONS: dict[float, Style] = {0.0: "smooth", -2.0: "dots", 2.0: "dots"}
#: The figure of all peaks; no scene's file has such a name.
PEAKS = "overview~peaks"


@dataclass(frozen=True)
class Entry:
    """How far a model lies from the run's reference in a scene, which it plays.

    Of its `cell`: `rms`, the RMS difference of rotation, is the judged figure of the shortest
    window, else the one of the `whole` time; `ratio` is that of the peaks. `u_num` is the model's
    numerical uncertainty of `whole` (alpha), where known.

    `apart`: of it and the reference one falls and the other does not, or to another side, and
    `why_apart`. `nearest` is the check that uses most of its limit, `used` the largest share; None
    where there is no history.
    """

    cell: results.Cell
    rms: figures.Figure | None
    whole: figures.Figure | None
    ratio: float | None
    u_num: float | None
    outcome: str
    apart: bool
    why_apart: str
    nearest: results.Check | None
    used: float | None


#: By scene and model.
Matrix = Mapping[str, Mapping[str, Entry]]


@dataclass(frozen=True)
class Glance:
    """The answers that the index gives first.

    The entry `farthest` from the reference, the scenes whose outcome depends on the model (`apart`,
    each with its row), and what has `changed` since it was accepted (the farthest first; `judged`
    were looked at). A figure that is out of a limit but as it was accepted has not changed.
    """

    farthest: Entry | None
    apart: Sequence[tuple[str, Mapping[str, Entry]]]
    changed: Sequence[tuple[results.Cell, results.Check]]
    judged: int


def matrix(run: results.Run, scenes: Iterable[str] = ()) -> Matrix:
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


def glance(run: results.Run, rows: Matrix) -> Glance:
    """The answers that the index gives first; `rows` are the run's `matrix`."""
    distances = [
        (entry.rms.value, entry)
        for row in rows.values()
        for entry in row.values()
        if entry.cell.model != run.reference and entry.rms and entry.rms.value is not None
    ]
    _, farthest = max(distances, key=lambda distance: distance[0], default=(0.0, None))
    parted = [
        (scene, row) for scene, row in rows.items() if any(entry.apart for entry in row.values())
    ]
    accepted = [(cell, check) for cell, check in run.checks() if check.expected is not None]
    moved = [(cell, check) for cell, check in accepted if _moved(check)]
    return Glance(
        farthest=farthest,
        apart=parted,
        changed=sorted(moved, key=lambda pair: -used(pair[1])),
        judged=len(accepted),
    )


def _moved(check: results.Check) -> bool:
    """Whether a figure left its drift band; without one, its limit."""
    value, expected = check.figure.value, check.expected
    if check.drift is None or value is None or expected is None:
        return check.weight != "pass"
    ideal = known(check.figure.measure).ideal or 0.0
    return apart(value, expected, check.floor, ideal) > check.drift


def entry(run: results.Run, cells: Mapping[str, results.Cell], model: str) -> Entry:
    """The entry of a model in a scene; `cells` are those of the scene, by model."""
    cell, reference = cells[model], cells.get(run.reference)
    rms = [
        figure
        for figure in cell.figures
        if figure.measure == "theta_rms"
        and figure.against == run.reference
        and figure.value is not None
    ]
    whole = next((figure for figure in rms if not figure.window), None)
    is_apart = _falls_apart(run, cell, reference)
    is_done = cell.status == "done"
    return Entry(
        cell=cell,
        rms=min(rms, key=lambda figure: figure.until or math.inf, default=None),
        whole=whole,
        ratio=results.value_of(cell.figures, "peak_ratio", run.reference),
        u_num=cell.numerical.u_num("theta_rms") if cell.numerical and whole else None,
        outcome=outcome_of(run, cell),
        apart=is_apart,
        why_apart=why_apart(cell) if is_apart else "",
        nearest=nearest(cell.checks),
        used=max(map(used, cell.checks), default=0.0) if is_done else None,
    )


def _falls_apart(run: results.Run, cell: results.Cell, reference: results.Cell | None) -> bool:
    """Whether of two runs one falls and the other does not, or to another side."""
    sides = {
        _side(outcome_of(run, compared))
        for compared in (cell, reference)
        if compared is not None and compared.status == "done"
    }
    return len(sides) > 1


def _side(outcome: str) -> int:
    """1 where a block falls to the left, -1 to the right, 0 where it does not."""
    return ("left" in outcome) - ("right" in outcome)


def why_apart(cell: results.Cell) -> str:
    """Why an outcome other than the reference's is within tolerance; "" where it is not."""
    if not cell.checks or cell.verdict != "pass":
        return ""
    is_judged = any(check.figure.measure == "outcome_agrees" for check in cell.checks)
    return f"not as the reference; {'accepted' if is_judged else 'not judged'}"


def outcome_of(run: results.Run, cell: results.Cell) -> str:
    """The outcome of a cell; "falling left" or "falling right" if the run ends during the fall.

    A block that may lean on a wall on that side is not falling.
    """
    turns = (figure for figure in cell.figures if figure.unit == "alpha")
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
        groups.setdefault(
            (cell.verdict, cell.verdict_words, bool(cell.checks), outcome), []
        ).append(cell)
    return list(groups.values())


def accuracy(run: results.Run) -> list[Block]:
    """Peak rotation by each model against the reference's, over all scenes.

    A point a scene, lines for the bias and two standard deviations; bias and scatter of this run
    and of all suites.

    Nothing where neither is known.
    """
    # one that was falling at the end does not stand
    stand = [cell for cell in run.cells if not outcome_of(run, cell).startswith("falling")]
    pairs = model_bias.pairs_of([run.model_copy(update={"cells": stand})])
    settings = {cell.model: cell.settings for cell in run.cells}
    models = [model for model in run.models if model in pairs]
    here = {model: model_bias.trust_in(pairs[model]) for model in models}
    in_all = {
        model: experience.trust_of(model, settings.get(model, {})).get("peak_rotation")
        for model in models
    }
    if not any(here.values()) and not any(in_all.values()):
        return []
    looks_of = looks(run.models)
    ends = decades([value for model in models for pair in pairs[model] for value in pair])
    panels = [
        _predicted(looks_of[model], pairs[model], in_all[model] or here[model], ends)
        for model in models
    ]
    x_axis = Axis(f"peak |θ|/α by {looks_of[run.reference].label}", log=True, limits=ends)
    y_axis = Axis("peak |θ|/α by the model", log=True, limits=ends)
    rows = [
        [model, len(pairs[model]), *_trust_cells(here[model]), *_trust_cells(in_all[model])]
        for model in models
    ]
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
        Table("accuracy", ACCURACY, rows),
    ]


#: Columns of bias and scatter, in this run and in all suites.
ACCURACY = [
    Column("model", kind="model"),
    Column("scenes_here"),
    Column("bias_here", "bias, here", digits=4, optional=True),
    Column("scatter_here", "scatter, here", digits=2, optional=True),
    Column("bias_all_suites", "bias, all suites", digits=4, optional=True),
    Column("scatter_all_suites", "scatter, all suites", digits=2, optional=True),
]


def _trust_cells(trust: experience.Trust | None) -> list[float | None]:
    """Bias and scatter."""
    return [None, None] if trust is None else [trust.bias, trust.scatter]


def decades(values: Sequence[float]) -> tuple[float, float]:
    """Whole powers of ten around values, with room at both ends."""
    lowest, highest = math.log10(0.8 * min(values)), math.log10(1.25 * max(values))
    return 10.0 ** math.floor(lowest), 10.0 ** math.ceil(highest)


def _predicted(
    look: Look,
    pairs: Sequence[tuple[float, float]],
    trust: experience.Trust | None,
    ends: tuple[float, float],
) -> Panel:
    """A point a pair of peaks, and the lines on which they are expected."""
    expected: list[Series] = []
    if trust is not None:
        for sigma, style in DEVIATIONS.items():
            share = trust.bias * math.exp(sigma * trust.scatter)
            line = [share * end for end in ends]
            expected.append(Series("", ends, line, look=look.key, style=style))
    x, y = zip(*pairs, strict=True)
    equal = Series("", ends, ends, style="thin")
    points = Series("", x, y, look=look.key, style="points")
    return Panel(look.label, [equal, *expected, points])
