"""What `rockcheck assess --json` says.

In: typed answers (`statistics`). Out: plain data; lengths in m, speeds in m/s, rotations in alpha,
None where there is none. The keys are an interface that programs read.
"""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rockcheck.scenes import history, writing
from rockcheck.validation.criteria import CRITERIA
from rockcheck.validation.studies.population import results
from rockcheck.validation.studies.population.certainty import MethodScore, UncertaintyAnswer
from rockcheck.validation.studies.population.gathered import Gathered
from rockcheck.validation.studies.population.sentences import is_converged
from rockcheck.validation.studies.population.statistics import (
    FallAnswer,
    GapAnswer,
    IntensityAnswer,
    QuantityAnswer,
    RecordIntensity,
)


def fall_data(answer: FallAnswer) -> dict[str, Any]:
    """How the runs end."""
    share = answer.overturning
    probability, low, high = writing.finite([share.probability, share.low, share.high])
    return {
        "runs": answer.runs,
        "records": answer.records,
        "outcomes": {name: answer.fates[name] for name in history.OUTCOMES},
        "undecided": answer.fates[results.UNDECIDED],
        "overturning": {
            "count": share.count,
            "probability": probability,
            "low": low,
            "high": high,
            "method": share.method,
        },
    }


def quantity_data(answers: Sequence[QuantityAnswer]) -> dict[str, Any]:
    """How far it moves where it stands; as "motion", too: a single run has other "quantities"."""
    quantities = {
        answer.name: {
            "unit": answer.unit,
            **answer.spread,
            "record": answer.largest_case,
            "of": len(answer.values),
        }
        for answer in answers
    }
    return {"quantities": quantities, "motion": quantities}


def gap_data(answers: Sequence[GapAnswer]) -> dict[str, Any]:
    """Which gaps are safe: of the first side, and of each."""
    if not answers:
        return {"gaps": [], "clearance": None, "none_overturns_up_to": None, "gap_search": None}
    first = answers[0]
    return {
        "gaps": [_gap_row(first, answer) for answer in first.rows],
        "clearance": first.clearance,
        "free_overturned": first.free_overturned,
        "none_overturns_up_to": first.safe_up_to,
        "gap_search": _gap_search(first),
        "gap_searches": [_gap_search(answer) for answer in answers],
    }


def _gap_row(answer: GapAnswer, row: Any) -> dict[str, Any]:
    return {
        "gap": row.gap,
        "side": answer.side,
        "runs": row.runs,
        "overturned": row.overturned,
        "undecided": row.undecided,
        "struck": row.struck,
        "wall_speed": {"median": row.median_speed, "largest": row.largest_speed},
    }


def _gap_search(answer: GapAnswer) -> dict[str, Any]:
    return {
        "side": answer.side,
        "from": answer.low,
        "to": answer.high,
        "looked_every": answer.looked_every,
        "looked_finely_up_to": answer.finely_up_to,
        "looked_beyond_every": answer.beyond_every or None,
        "draws_looked_every": answer.draws_every,
        "draws_looked_beyond_every": answer.draws_beyond_every or None,
        "resolved_to": 1e-4,
        "clearance": answer.clearance,
        "none_overturns_up_to": answer.safe_up_to,
        "runs": answer.runs,
        "undecided": answer.undecided,
        "complete": answer.complete,
        "falls": [
            {
                "record": case.case,
                "draw": case.draw,
                "intervals": [[interval.low, interval.high] for interval in case.intervals],
            }
            for case in answer.falls
        ],
    }


def intensity_data(answer: IntensityAnswer | None) -> dict[str, Any]:
    """At which intensity it falls."""
    if answer is None:
        return {"intensity": None}
    fit = answer.fit
    return {
        "intensity": {
            "measure": answer.measure,
            "label": answer.label,
            "unit": answer.unit,
            "median": fit.median if fit else None,
            "dispersion": fit.dispersion if fit else None,
            "low": fit.low if fit else None,
            "high": fit.high if fit else None,
            "undecided": answer.undecided,
            "records": [_record_intensity(record) for record in answer.records],
        }
    }


def _record_intensity(record: RecordIntensity) -> dict[str, Any]:
    return {
        "record": record.case,
        "as_it_is": record.as_it_is,
        "least": record.least,
        "looked_up_to": record.beyond,
        "islands": [list(island) for island in record.islands],
    }


def certainty_data(gathered: Gathered, answer: UncertaintyAnswer) -> dict[str, Any]:
    """How sure that is: of the scene's own excitation, and of all runs."""
    own = gathered.own_certainty or results.Certainty()
    quantities = [] if own.numerical is None else own.numerical.quantities
    numerical = {
        "converged": is_converged(own),
        "depends_on_law_from_s": own.depends_on_law_from_s,
        "method": own.numerical.method if own.numerical else "",
        "quantities": [quantity.model_dump() for quantity in quantities],
    }
    ties = [
        {"what": what, "from_s": when, "fates": list(fates), "record": case}
        for case, sure in gathered.certainty.items()
        for what, when, fates in sure.ties
    ]
    unit = "alpha" if answer.of == "peak rotation" else "1"
    data: dict[str, Any] = {
        "ties": ties,
        "numerical": numerical,
        "contributions": [
            {"source": part.source, "share": part.share, "sd": part.sd, "unit": unit}
            for part in answer.contributions
        ],
        "contributions_of": answer.of,
    }
    if len(gathered.all_runs) == 1 and not gathered.plan.recorded:
        data |= numerical
    return data


def method_data(scores: Sequence[MethodScore]) -> dict[str, Any]:
    """What hand methods say."""
    return {
        "criteria": [
            {
                "name": criterion.name,
                "formula": criterion.formula,
                "event": criterion.event,
                "source": criterion.source,
                "holds": criterion.holds,
                **{key: value for key, value in asdict(score).items() if key != "method"},
            }
            for criterion, score in zip(CRITERIA, scores, strict=True)
        ]
    }
