"""Tables of how sure an assessment is: sources of uncertainty, other models, hand methods.

In: typed answers (`certainty`) and gathered results. Out: blocks of a finding. Called by the study.
"""

from collections.abc import Sequence

import numpy as np

from rockcheck.scenes import experience
from rockcheck.validation.criteria import CRITERIA
from rockcheck.validation.finding import (
    Block,
    Column,
    Mark,
    Table,
    Text,
    text,
)
from rockcheck.validation.studies.population import results
from rockcheck.validation.studies.population.certainty import MethodScore, UncertaintyAnswer
from rockcheck.validation.studies.population.gathered import Gathered
from rockcheck.validation.studies.population.sentences import NEGLIGIBLE, UNITS

#: What each source of uncertainty is.
SOURCES = {
    "records": "scatter between the records",
    "inputs": "draws of the scene's uncertain numbers",
    "numerical error": "the model's own step or tolerance",
    "model form": "difference of the other models",
    "law of impacts": "half the difference between the laws of impacts",
}


def contribution_table(answer: UncertaintyAnswer) -> Table:
    """Where the uncertainty comes from."""
    rows = [
        [part.source, part.share, part.sd, SOURCES[part.source]] for part in answer.contributions
    ]
    matters = any(part.sd > NEGLIGIBLE for part in answer.contributions)
    unknown = f" Not known: {', '.join(answer.unknown)}." if answer.unknown else ""
    unit = "α" if answer.of == "peak rotation" else ""
    return Table(
        "contributions",
        [
            text("source"),
            Column("share", kind="percent", digits=3),
            Column("sd", "standard deviation", unit),
            text("what", "what it is", brief=False),
        ],
        rows,
        "How sure",
        note=f"Of the variance of the {answer.of}.{unknown}",
        on="all" if len(rows) > 1 and matters else "file",
        folded=True,
    )


def numerical_blocks(gathered: Gathered) -> list[Block]:
    """The numerical uncertainty of a single run."""
    own = gathered.own_certainty
    if gathered.plan.recorded or own is None or own.numerical is None:
        return []
    columns = [
        text("name", "quantity"),
        *(Column(name, name, digits=4) for name in ("value", "u_num", "order")),
        text("unit"),
        text("verdict"),
    ]
    rows = [
        [
            quantity.name,
            quantity.value,
            quantity.u_num,
            quantity.order,
            quantity.unit,
            quantity.verdict,
        ]
        for quantity in own.numerical.quantities
    ]
    blocks: list[Block] = [
        Table(
            "numerical",
            columns,
            rows,
            "Numerical uncertainty",
            f"By {own.numerical.method}.",
            folded=True,
        )
    ]
    if own.numerical.reasons:
        blocks.append(Text(items=own.numerical.reasons))
    return blocks


def sensitivity_table(gathered: Gathered) -> list[Block]:
    """Which uncertain number matters most."""
    if gathered.sensitivities is None or not gathered.sensitivities.indices:
        return []
    columns = [
        text("input", "what matters most for the peak"),
        Column("alone", kind="percent", digits=2),
        Column("with_others", kind="percent", digits=2),
    ]
    rows = [
        [index.name, max(index.first, 0.0), max(index.total, 0.0)]
        for index in gathered.sensitivities.indices
    ]
    return [Table("sensitivities", columns, rows, note="Sobol indices.", folded=True)]


def method_blocks(scores: Sequence[MethodScore]) -> list[Block]:
    """What hand methods say, and what they are."""
    columns = [
        text("name", "method"),
        text("event", "it"),
        Column("predicts", "says"),
        Column("simulated", "is"),
        Column("agrees"),
        Column("estimate", help="Median of what it estimates."),
        Column("motion", help="Median of the simulated motion."),
        text("unit"),
        Column("unsafe", help="Runs that moved farther than estimated."),
    ]
    rows = []
    for criterion, score in zip(CRITERIA, scores, strict=True):
        estimates = score.unsafe is not None
        rows.append(
            [
                criterion.name,
                criterion.event,
                f"{score.predicts} of {score.of}",
                score.simulated,
                score.agrees,
                score.estimate,
                score.motion if estimates else None,
                UNITS.get(score.unit, score.unit) if estimates else "",
                Mark(score.unsafe, "changed" if score.unsafe else ""),
            ]
        )
    known = [[one.name, one.formula, one.source, one.holds] for one in CRITERIA]
    return [
        Table(
            "criteria",
            columns,
            rows,
            "What hand methods say",
            note="Estimates to be judged, not judges: in how many runs it happens by the method and"
            " by the simulation, and in how many both agree.",
            folded=True,
        ),
        Table(
            "methods",
            [text("name", "method"), text("formula"), text("source"), text("holds", "range")],
            known,
            "The hand methods",
            on="page",
            folded=True,
        ),
    ]


def model_table(gathered: Gathered) -> list[Block]:
    """How far other models, and another law of impacts, are from the first model."""
    compared = dict(gathered.others)
    if gathered.by_other_law:
        compared["another law of impacts"] = gathered.by_other_law
    rows = []
    for model, runs in compared.items():
        apart = [
            (run.peak_rotation or 0.0) - (gathered.as_it_is[case].peak_rotation or 0.0)
            for case, run in runs.items()
            if case in gathered.as_it_is and run.stands and gathered.as_it_is[case].stands
        ]
        settings = gathered.plan.models.get(model, {})
        trust = experience.trust_of(model, settings).get("peak_rotation")
        rows.append(
            [
                model,
                len(runs),
                sum(run.overturned for run in runs.values()),
                float(np.sqrt(np.mean(np.square(apart)))) if apart else None,
                max(map(abs, apart), default=None),
                getattr(trust, "bias", None),
                getattr(trust, "scatter", None),
            ]
        )
    if not rows:
        return []
    columns = [
        text("model", "compared with the first model"),
        Column("runs"),
        Column("overturned"),
        Column("rms", "RMS difference", "α"),
        Column("largest", "largest", "α"),
        Column("bias", "bias in the suites", optional=True),
        Column("scatter", "σ in the suites", kind="percent", digits=3, optional=True),
    ]
    note = f"Differences in peak rotation from {gathered.plan.model}, where both stand."
    return [Table("models", columns, rows, "Other models", note, folded=True)]


def threshold_table(gathered: Gathered) -> list[Block]:
    """What the first model says on both sides of the thresholds that the batch found."""
    rows = [
        [threshold.case, threshold.what, gathered.done[threshold.task].result.fate]
        for threshold in gathered.plan.thresholds(gathered.done)
        if isinstance(gathered.done.get(threshold.task), results.Shown)
    ]
    if not rows:
        return []
    plan = gathered.plan
    return [
        Table(
            "thresholds",
            [text("record" if plan.recorded else "scene"), text("at"), text("outcome")],
            rows,
            f"{plan.model} at the thresholds found",
            f"{plan.batch_model} stands at the first of each pair, and falls at the second.",
            on="page",
        )
    ]
