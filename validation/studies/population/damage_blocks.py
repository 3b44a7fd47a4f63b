"""Tables and plots of the intensities that exceed capacities.

In: typed answers (`damage`). Out: sentences, blocks of a finding, and data. Called by the study.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rockcheck.validation.finding import Axis, Block, Column, Panel, Plot, Series, Table, text
from rockcheck.validation.studies.population.damage import FEWEST_TESTED, UNLIKELY, DamageAnswer


def damage_sentences(answers: Sequence[DamageAnswer]) -> list[str]:
    """The median of each capacity."""
    return [_sentence(answer) for answer in answers]


def _sentence(answer: DamageAnswer) -> str:
    intensity, capacity = answer.intensity, answer.capacity.words
    unit = f" {intensity.unit}" if intensity.unit else ""
    label = intensity.label
    if not answer.exceeded_by:
        beyond = min(record.beyond for record in intensity.records)
        return f"{capacity.capitalize()}: not up to {label} {beyond:.3g}{unit}."
    if intensity.fit is None:
        least = min(record.least for record in intensity.records if record.least is not None)
        return f"{capacity.capitalize()}: from {label} {least:.3g}{unit}."
    return (
        f"{capacity.capitalize()}: median {label} {intensity.fit.median:.3g}{unit}, dispersion"
        f" {intensity.fit.dispersion:.2f}."
    )


def damage_blocks(answers: Sequence[DamageAnswer]) -> list[Block]:
    """The curves, their numbers, and the intensities of each motion; nothing without answers."""
    if not answers:
        return []
    return [*_curve_plot(answers), _curve_table(answers), _record_table(answers)]


def _curve_table(answers: Sequence[DamageAnswer]) -> Table:
    intensity = answers[0].intensity
    columns = [
        text("capacity"),
        Column("median", f"median {intensity.label}", intensity.unit, digits=4),
        Column("low", "from", intensity.unit),
        Column("high", "to", intensity.unit),
        Column("dispersion"),
        Column("exceeded_by", "motions that exceed it"),
        Column("motions", "of"),
        Column("islands", "with islands", brief=False),
        Column("likely", "Lilliefors p", brief=False),
        text("remark", brief=False),
    ]
    rows = []
    for answer in answers:
        fit = answer.intensity.fit
        numbers = [fit.median, fit.low, fit.high, fit.dispersion] if fit else [None] * 4
        rows.append(
            [
                answer.capacity.words,
                *numbers,
                answer.exceeded_by,
                len(answer.intensity.records),
                answer.islands,
                answer.likely,
                _remark(answer),
            ]
        )
    return Table(
        "capacities",
        columns,
        rows,
        "At which intensity a capacity is exceeded",
        note="Medians and dispersions of the greatest likelihood, with 95 % intervals from drawing"
        " the motions anew. A block that overturns exceeds each capacity. Islands: motions that"
        " exceed it and at some larger intensity do not.",
    )


def _remark(answer: DamageAnswer) -> str:
    """What speaks against a lognormal curve."""
    remarks = []
    if answer.likely is not None and answer.likely < UNLIKELY:
        remarks.append("not lognormal")
    if answer.islands:
        remarks.append("the curve counts the least intensity of each motion")
    if len(answer.intensity.records) < FEWEST_TESTED:
        remarks.append("too few motions to test")
    return "; ".join(remarks)


def _record_table(answers: Sequence[DamageAnswer]) -> Table:
    intensity = answers[0].intensity
    columns = [
        text("record"),
        Column("as_it_is", f"{intensity.label} as it is", intensity.unit),
        *(
            Column(answer.capacity.name, answer.capacity.words, intensity.unit, digits=4)
            for answer in answers
        ),
    ]
    rows = [
        [
            record.case,
            record.as_it_is,
            *(answer.intensity.records[number].least for answer in answers),
        ]
        for number, record in enumerate(intensity.records)
    ]
    return Table(
        "damage",
        columns,
        rows,
        "The least intensity of each motion",
        on="page",
        folded=len(rows) > 12,
    )


def _curve_plot(answers: Sequence[DamageAnswer]) -> list[Block]:
    drawn = [
        (answer, answer.intensity.fit)
        for answer in answers
        if answer.intensity.fit is not None and answer.intensity.fit.dispersion > 0.0
    ]
    if not drawn:
        return []
    medians = [fit.median for _, fit in drawn]
    widest = max(fit.dispersion for _, fit in drawn)
    x = np.geomspace(min(medians) * np.exp(-2.5 * widest), max(medians) * np.exp(2.5 * widest), 200)
    series = [
        Series(answer.capacity.words, x.tolist(), fit.probability(x).tolist(), style="smooth")
        for answer, fit in drawn
    ]
    return [
        Plot(
            "capacities",
            "Probability that a capacity is exceeded",
            panels=[Panel("", series)],
            x=Axis(answers[0].intensity.head, log=True),
            y=Axis("probability", limits=(0.0, 1.0)),
            live=True,
        )
    ]


def damage_data(answers: Sequence[DamageAnswer]) -> dict[str, Any]:
    """The curves for programs; None where there is none."""
    curves = []
    for answer in answers:
        fit = answer.intensity.fit
        curves.append(
            {
                "capacity": answer.capacity.name,
                "measure": answer.intensity.measure,
                "unit": answer.intensity.unit,
                "median": fit.median if fit else None,
                "dispersion": fit.dispersion if fit else None,
                "low": fit.low if fit else None,
                "high": fit.high if fit else None,
                "lilliefors_p": answer.likely,
                "exceeded_by": answer.exceeded_by,
                "motions": len(answer.intensity.records),
                "islands": answer.islands,
            }
        )
    return {"fragility": curves}
