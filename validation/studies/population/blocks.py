"""The tables and plots of an assessment's page.

In: typed answers (`statistics`), or the results themselves (`gathered`). Out: blocks of a finding,
a function a block. Called by the study.
"""

import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rockcheck.scenes import Rest, Scene, writing
from rockcheck.validation.discrepancy.compare import QUANTITIES
from rockcheck.validation.finding import (
    Axis,
    Block,
    Column,
    Mark,
    Panel,
    Plot,
    Series,
    Table,
    Text,
    text,
)
from rockcheck.validation.studies.population.gathered import Gathered
from rockcheck.validation.studies.population.intensity_measures import size_of
from rockcheck.validation.studies.population.sentences import UNITS, count_of
from rockcheck.validation.studies.population.statistics import (
    FallAnswer,
    QuantityAnswer,
    value_of,
)
from rockcheck.validation.studies.population.tasks import MOST_ROWS
from rockcheck.version import __version__

#: Points of a history, and of a curve, on the page.
POINTS = 400


def scene_plot(scene: Scene) -> Plot:
    """The block beside its walls, to scale."""
    return Plot(
        "scene",
        "What is assessed",
        kind="block",
        data={"scene": scene.replace(excitation=Rest(), vertical=Rest()).model_dump(mode="json")},
        note="The block as it stands at first, and its walls, to scale.",
    )


def scene_text(scene: Scene, gathered: Gathered) -> Text:
    """Block, floor, walls and motions, in words."""
    block, floor, building = scene.block, scene.floor, gathered.plan.own.building
    uncertain = next(iter(gathered.plan.cases.values())).names
    static = f", static {floor.mu_s:.3g}" if floor.mu_s != floor.friction else ""
    rebound = f", restitution {floor.restitution:.3g}" if floor.restitution else ""
    walls = [
        f"{wall.side}, gap {1e3 * wall.gap:.3g} mm, restitution {wall.restitution:.2g}"
        for wall in scene.walls
    ]
    facts = [
        ("block", f"{2.0 * block.half_width:.4g} m wide, {2.0 * block.half_height:.4g} m high"),
        ("α", f"{block.alpha:.3g} rad"),
        ("friction", f"{floor.friction:.3g}{static}{rebound}"),
        ("wall", "; ".join(walls) or "none"),
        ("uncertain", ", ".join(uncertain)),
        ("building", building.words if building else ""),
        ("base", _base_words(gathered)),
        ("played by", f"{gathered.plan.model}, rockcheck {__version__}"),
    ]
    return Text(facts=[fact for fact in facts if fact[1]])


def _base_words(gathered: Gathered) -> str:
    if gathered.plan.recorded:
        return f"{count_of(len(gathered.plan.cases), 'recorded motion')}, listed below"
    excitation = gathered.plan.own.scene.excitation
    if excitation.kind == "rest":
        return "at rest"
    if excitation.kind == "record":
        return f"{excitation.source}, peak {excitation.peak:.3g} g"
    size = f"{excitation.amplitude:.3g} m/s², period {excitation.period:.3g} s"
    return f"{excitation.kind} pulse, {size}"


def answer_table(answers: Mapping[str, Sequence[str]]) -> Table:
    """The questions and their answers."""
    rows = [[question, " ".join(sentences)] for question, sentences in answers.items()]
    return Table("answers", [text("question"), text("answer")], rows)


def outcome_table(answer: FallAnswer) -> Table:
    """How the runs end."""
    share = answer.overturning
    rows: list[list[Any]] = [
        [fate, count, None, None, None] for fate, count in answer.fates.items() if count
    ]
    rows.append(["overturned", share.count, share.probability, share.low, share.high])
    shares = [
        Column(name, label, kind="percent", digits=3)
        for name, label in (("probability", ""), ("low", "95 % from"), ("high", "to"))
    ]
    return Table(
        "outcomes",
        [text("outcome"), Column("runs"), *shares],
        rows,
        "What happens",
        note="Each run is played until its outcome is decided, whatever the scene's duration."
        f" Interval: {share.method}; draws of one record count as one record.",
        on="all" if answer.runs > 1 else "file",
    )


def quantity_table(answers: Sequence[QuantityAnswer], *, several: bool) -> Table:
    """How far it moves."""
    columns = [
        text("quantity", "how far it moves"),
        *(
            Column(name, label, digits=4, brief=several)
            for name, label in (("median", ""), ("p16", "16 %"), ("p84", "84 %"))
        ),
        Column("largest", "largest" if several else "value", digits=4),
        text("unit"),
        text("record", "its record", brief=several),
        Column("of", "of runs that stand", help="Runs that have the figure.", brief=several),
    ]
    shown = [answer for answer in answers if answer.values]
    rows = []
    for answer in shown:
        spread = answer.spread
        numbers = [spread[name] for name in ("median", "p16", "p84", "largest")]
        unit = UNITS.get(answer.unit, answer.unit)
        rows.append([answer.label, *numbers, unit, answer.largest_case, len(answer.values)])
    help_words = "; ".join(f"{answer.label}: {answer.help}" for answer in shown)
    return Table(
        "quantities",
        columns,
        rows,
        note=f"{help_words}. Of the whole motion, whatever the output step.",
        on="all" if shown else "file",
    )


def strip_plot(answers: Sequence[QuantityAnswer]) -> list[Block]:
    """A strip a figure; nothing where no figure has two values."""
    strips = [
        {
            "label": f"{answer.label}, {UNITS.get(answer.unit, answer.unit)}",
            "values": list(answer.values),
        }
        for answer in answers
        if len(answer.values) > 1
    ]
    if not strips:
        return []
    note = "A point a run that stands; the bar goes from 16 to 84 %, its line is the median."
    return [Plot("motion", "How far each run moves", kind="strips", data=strips, note=note)]


def history_plot(gathered: Gathered) -> list[Block]:
    """The rotations of the cases as they are."""
    rows = {
        case: np.atleast_1d(np.genfromtxt(io.StringIO(shown.history), delimiter=",", names=True))
        for case, shown in gathered.shown.items()
        if shown.history
    }
    if not rows:
        return []
    alpha = gathered.plan.own.scene.block.alpha
    times = np.linspace(0.0, max(row["t"][-1] for row in rows.values()), POINTS)
    lines = np.array(
        [
            np.interp(
                times,
                row["t"],
                row["theta"] / alpha,
                right=None if gathered.as_it_is[case].fate == "at rest" else math.nan,
            )
            for case, row in rows.items()
        ]
    )
    low, high = float(np.nanmin(lines)), float(np.nanmax(lines))
    beyond = max(0.05 * (high - low), 0.5e-3)  # noise is not blown up
    style: Any = "thin" if len(rows) > 1 else "smooth"
    series = [
        Series(case, times.tolist(), line, style=style)
        for case, line in zip(rows, writing.finite(lines.tolist()), strict=True)
    ]
    return [
        Plot(
            "histories",
            "Histories",
            panels=[Panel("", series)],
            x=Axis("time, s"),
            y=Axis("θ/α", limits=(low - beyond, high + beyond)),
            note="Rotation over the slenderness angle, positive to the left; a line a run.",
            live=True,
        )
    ]


def file_of(case: str) -> str:
    """The file of a case's history; no name of a record has a tilde."""
    return f"histories/{case.replace(' ', '~')}.csv"


def run_table(gathered: Gathered) -> Table:
    """Each case as it is, with the intensity of its motion."""
    plan = gathered.plan
    intensity = []
    if plan.measure is not None:
        intensity = [Column("intensity", plan.measure.label, plan.measure.unit)]
    rows = []
    for case, shown in gathered.shown.items():
        run = shown.result
        sizes = [size_of(plan.measure, plan.cases[case])] if plan.measure else []
        values = [None if run.overturned else value_of(run, q.name) for q in QUANTITIES]
        rows.append(
            [
                Mark(case, link=file_of(case) if shown.history else ""),
                *sizes,
                Mark(run.fate, "fail" if run.overturned else ""),
                *values,
            ]
        )
    units = [Column(q.name, q.label, UNITS.get(q.unit, q.unit)) for q in QUANTITIES]
    return Table(
        "runs",
        [text("record" if plan.recorded else "scene"), *intensity, text("outcome"), *units],
        rows,
        "Each record as it is" if plan.recorded else "The run",
        on="page",
        note=f"Each name leads to the run's history as CSV, in at most {MOST_ROWS} rows.",
        folded=len(rows) > 20,
    )


def note_text(gathered: Gathered) -> list[Block]:
    """What is to be known about the runs."""
    plan = gathered.plan
    notes = []
    varied = gathered.drawn or gathered.gaps or gathered.factors
    if not plan.plays_itself and varied:
        notes.append(f"draws, gaps and intensities are played by {plan.batch_model}")
    if not plan.batch_plays:
        notes.append(
            "no event-based model plays this scene: draws, gaps and intensities are left out"
        )
    missing = [case for case in plan.drawn if case not in gathered.drawn]
    if missing:
        notes.append(f"not all draws were played of: {', '.join(missing)}")
    notes += plan.left_out
    return [Text(items=notes, title="Notes", on="page")] if notes else []
