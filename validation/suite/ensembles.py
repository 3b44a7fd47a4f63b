"""Results of ensembles: the batches of each model joined, compared and judged.

In: the planned batches of an ensemble by model, and what each gave. Out: an `EnsembleRecord`, and a
cell for each model. `runner` calls `judged_ensemble`.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from operator import attrgetter

import numpy as np

from rockcheck.validation.discrepancy import measures
from rockcheck.validation.discrepancy.compare import evaluate
from rockcheck.validation.discrepancy.ensemble import Sample, Samples
from rockcheck.validation.execute import models, pool
from rockcheck.validation.suite import judging, motions, results
from rockcheck.validation.suite.cells import Suite
from rockcheck.validation.suite.comparing import ComparedFigure
from rockcheck.validation.suite.planning import BatchRecord, Planned, PlannedBatch


@dataclass(frozen=True)
class JudgedEnsemble:
    """The results of an ensemble, and a judged cell for each model."""

    record: results.EnsembleRecord
    cells: Sequence[results.Cell]


def judged_ensemble(
    suite: Suite,
    ensemble: motions.Ensemble,
    batches: Mapping[str, Sequence[PlannedBatch]],
    outcomes: Mapping[Planned, models.Played | pool.Failure],
) -> JudgedEnsemble:
    """An ensemble's results; `batches` by model, `outcomes` are what each gave.

    `suite` is the one that has the ensemble, not one that joins it.
    """
    records = {
        model: [batch_record(batch, outcomes[batch]) for batch in planned]
        for model, planned in batches.items()
    }
    joined = results.EnsembleRecord(
        name=ensemble.name,
        description=ensemble.description,
        definition=ensemble.model_dump(mode="json", exclude_none=True),
        peaks={model: _joined_peaks(of_model) for model, of_model in records.items()},
        outcomes={model: _joined_outcomes(of_model) for model, of_model in records.items()},
    )
    cells = []
    for model, planned in batches.items():
        reason = _failure(joined.samples[model])
        cell = judging.cell_of(planned, [outcomes[batch] for batch in planned], reason)
        cell = cell.model_copy(update={"cost": _total_cost(records[model])})
        if cell.status == "done":
            cell = _judged(suite, cell, joined)
        cells.append(cell)
    return JudgedEnsemble(joined, cells)


def batch_record(batch: PlannedBatch, outcome: models.Played | pool.Failure) -> BatchRecord:
    """The record of a batch; of one that failed, each scene has its reason."""
    if isinstance(outcome, models.Played):
        record: BatchRecord = outcome.record
        return record
    count = len(batch.numbers)
    return BatchRecord(
        peaks=(None,) * count, outcomes=(outcome.reason,) * count, cost=results.CostRecord()
    )


def _joined_peaks(records: Sequence[BatchRecord]) -> tuple[float | None, ...]:
    return tuple(chain.from_iterable(record.peaks for record in records))


def _joined_outcomes(records: Sequence[BatchRecord]) -> tuple[str, ...]:
    return tuple(chain.from_iterable(record.outcomes for record in records))


def _total_cost(records: Sequence[BatchRecord]) -> results.CostRecord:
    totals = {
        name: sum(getattr(record.cost, name) for record in records)
        for name in (*models.SUMMED, "worker_seconds")
    }
    return results.CostRecord(**totals)


def _failure(sample: Sample) -> str:
    """Why an ensemble has no result of a model: its first failure; empty if it has one."""
    if not sample.failures:
        return ""
    first = sample.outcomes[int(np.argmin(np.isfinite(sample.peaks)))]
    return f"{sample.failures} of {len(sample.peaks)} scenes failed; the first: {first}"


def _judged(suite: Suite, cell: results.Cell, joined: results.EnsembleRecord) -> results.Cell:
    """The cell with its figures against each reference, and their checks."""
    sample = joined.samples[cell.model]
    required = suite.required(cell.scene, cell.model)
    figures = list(_figures(suite.yardsticks(required), cell.model, joined))
    checks = judging.checks_of(suite, required, figures, attrgetter("resolution"))
    return cell.model_copy(
        update={
            "outcome": f"{int(np.sum(sample.fallen))} of {len(sample.peaks)} overturned",
            "figures": tuple(compared.figure for compared in figures),
            "checks": tuple(checks),
        }
    )


def _figures(
    yardsticks: Sequence[str], model: str, joined: results.EnsembleRecord
) -> Iterator[ComparedFigure]:
    """All statistics of a model against each yardstick that has a result in every scene."""
    finished = joined.finished
    for yardstick in yardsticks:
        if yardstick == model or yardstick not in finished:
            continue
        samples = Samples(finished[yardstick], finished[model])
        for measure in measures.STATISTICS.values():
            yield ComparedFigure(evaluate(measure, samples, "alpha", against=yardstick))
