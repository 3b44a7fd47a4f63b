"""The storeys of a building: on which of them a block falls, and from which intensity on.

In: a plan a storey. Out: a finding with a row a storey. Called by `assess --storeys`. All else of
one storey is what `assess` says of a scene that stands there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rockcheck.scenes.buildings import Regular
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.finding import (
    Axis,
    Block,
    Column,
    Finding,
    Mark,
    Panel,
    Plot,
    Series,
    Table,
    Text,
)
from rockcheck.validation.studies.population import damage, results, statistics
from rockcheck.validation.studies.population.blocks import scene_text
from rockcheck.validation.studies.population.gathered import Gathered
from rockcheck.validation.studies.population.intensity_measures import measure_of, size_of
from rockcheck.validation.studies.population.plan import Plan
from rockcheck.validation.studies.population.sentences import count_of, edge_sentences
from rockcheck.validation.study import Study, Task
from rockcheck.version import __version__


@dataclass(frozen=True, kw_only=True)
class Storeys(Study):
    """A block on several storeys of a building, a plan by the storey's number."""

    plans: Mapping[int, Plan]
    name = "assess"
    record = results.Result

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Task]:
        """Of each storey the runs as they are, and the search over the factor."""
        return [
            task
            for plan in self.plans.values()
            for tasks in (plan.undrawn, plan.factors)
            for task in tasks.values()
        ]

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The table, the plot, and which storeys are safe."""
        storeys = [storey_of(number, Gathered(plan, done)) for number, plan in self.plans.items()]
        failures = {
            task.label: outcome.reason
            for task, outcome in done.items()
            if isinstance(outcome, Failure)
        }
        return finding_of(storeys, next(iter(self.plans.values())), failures)


@dataclass(frozen=True)
class Storey:
    """What happens on a storey.

    `floor_acceleration` (g) is the median of the peaks; `fallen` of `runs` overturn as the motions
    are; `falls` is the intensity that overturns, `exceeded` that which exceeds each capacity.
    """

    number: int
    floor_acceleration: float
    fallen: int
    runs: int
    falls: statistics.IntensityAnswer | None
    exceeded: Sequence[damage.DamageAnswer]


def storey_of(number: int, gathered: Gathered) -> Storey:
    """What happens on the storey of a plan."""
    plan, peak = gathered.plan, measure_of("pfa")
    ended = [gathered.done.get(task) for task in plan.undrawn.values()]
    runs = [drawn.results[0] for drawn in ended if isinstance(drawn, results.Drawn)]
    return Storey(
        number,
        float(np.median([size_of(peak, given) for given in plan.cases.values()])),
        sum(run.overturned for run in runs),
        len(runs),
        statistics.intensity_answer(gathered),
        damage.damage_answers(gathered),
    )


def finding_of(storeys: Sequence[Storey], plan: Plan, failures: Mapping[str, str]) -> Finding:
    """The table, the plot, and which storeys are safe, in words and as data."""
    name = plan.own.scene.name
    table = storey_table(storeys, plan)
    return Finding(
        "assess",
        f"Assessment by storey: {name}",
        answer_of(storeys, name),
        [storeys_text(plan), table, *storey_plot(storeys)],
        {"scene": name, "model": plan.batch_model, "storeys": table.records()},
        exit_code=3 if failures else 0,
        failures=failures,
    )


def answer_of(storeys: Sequence[Storey], name: str) -> str:
    """On which storeys it falls."""
    fallen = [storey for storey in storeys if storey.fallen]
    if not fallen:
        return f"{name} overturns on none of {len(storeys)} storeys."
    words = ", ".join(
        f"{storey.number} ({storey.fallen} of {storey.runs} motions)" for storey in fallen
    )
    return f"{name} overturns on storey {words}."


def storeys_text(plan: Plan) -> Text:
    """Block, floor, walls, building and motions, in words; and a tie of the friction."""
    facts = dict(scene_text(plan.own.scene, Gathered(plan, {})).facts)
    assert isinstance(plan.own.building, Regular), "asked for by storey"
    if plan.recorded:
        facts["base"] = count_of(len(plan.cases), "recorded motion")
    facts["building"] = f"storeys: {plan.own.building.of_storeys}"
    facts["played by"] = f"{plan.batch_model}, rockcheck {__version__}"
    return Text(facts=list(facts.items()), items=edge_sentences(plan.own.scene))


def storey_table(storeys: Sequence[Storey], plan: Plan) -> Table:
    """A row a storey."""
    measure = plan.measure
    label, unit = (measure.label, measure.unit) if measure else ("intensity", "")
    columns = [
        Column("storey"),
        Column("pfa", "median peak floor acceleration", "g"),
        Column("overturned"),
        Column("runs", "of"),
        Column("median", f"overturns: median {label}", unit, digits=4),
        Column("dispersion"),
        *(
            Column(capacity.name, f"{capacity.words}: median {label}", unit, digits=4)
            for capacity in plan.capacities
        ),
    ]
    rows = []
    for storey in storeys:
        fit = storey.falls.fit if storey.falls else None
        medians = {
            answer.capacity.name: answer.intensity.fit.median
            for answer in storey.exceeded
            if answer.intensity.fit
        }
        rows.append(
            [
                storey.number,
                storey.floor_acceleration,
                Mark(storey.fallen, "fail" if storey.fallen else "pass"),
                storey.runs,
                fit.median if fit else None,
                fit.dispersion if fit else None,
                *(medians.get(capacity.name) for capacity in plan.capacities),
            ]
        )
    return Table(
        "storeys",
        columns,
        rows,
        "On which storeys it falls",
        note="Overturned: as the motions are. Medians are of the intensity of the ground, but for"
        " the peak floor acceleration. Empty: some motion, or none, exceeds it up to 32 times where"
        " the block may rock.",
    )


def storey_plot(storeys: Sequence[Storey]) -> list[Block]:
    """The medians over the storeys; nothing where no curve fits."""
    answers = [
        (storey.number, words, answer)
        for storey in storeys
        for words, answer in _answers_of(storey)
        if answer.fit is not None
    ]
    if not answers:
        return []
    series = []
    for words in dict.fromkeys(words for _, words, _ in answers):
        points = [
            (float(number), answer.fit.median)
            for number, of, answer in answers
            if of == words and answer.fit is not None
        ]
        series.append(Series(words, [x for x, _ in points], [y for _, y in points]))
    return [
        Plot(
            "storeys",
            "Which intensity each storey bears",
            panels=[Panel("", series)],
            x=Axis("storey"),
            y=Axis(f"median {answers[0][2].head}"),
            live=True,
        )
    ]


def _answers_of(storey: Storey) -> list[tuple[str, statistics.IntensityAnswer]]:
    """The answers of a storey that have an intensity, with what happens there."""
    falls = [] if storey.falls is None else [("overturns", storey.falls)]
    return falls + [(answer.capacity.words, answer.intensity) for answer in storey.exceeded]
