"""Verdicts: the figures of a cell against the tolerances of its suite.

In: what a cell's run gave and its comparisons, or an ensemble's figures. Out: `results.Check`s and
a `results.Cell`. Nothing here knows a store; `runner` and `ensembles` call it.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import partial

from rockcheck.validation.discrepancy.figures import Figure, Measure
from rockcheck.validation.execute import models, pool, provenance
from rockcheck.validation.execute.store import HISTORIES, TABLE
from rockcheck.validation.study import FAULTS
from rockcheck.validation.suite import results, tolerances, verdicts
from rockcheck.validation.suite.cells import Suite
from rockcheck.validation.suite.comparing import ComparedFigure, ComparisonRecord
from rockcheck.validation.suite.planning import CellRecord, Planned, PlannedCell

Required = Mapping[tolerances.ToleranceKey, results.Kind]

#: Remark on a gap in a measured history.
OFFSET_HINT = (
    "; `offset` of the measured model shifts its times, a window such as theta_rms@8s ends sooner"
)


def judged_cell(
    suite: Suite,
    planned: PlannedCell,
    played: models.Played,
    comparison: ComparisonRecord,
    reference: results.Cell | None,
) -> results.Cell:
    """A cell that was played, with its checks.

    `reference` is the judged cell of the suite's reference on that scene, None for the reference
    itself, and where it has none.
    """
    record: CellRecord = played.record
    required = suite.required(planned.scene_name, planned.variant.label)
    floor = partial(verdicts.floor_of, scene=planned.scene, numerical=record.numerical)
    checks = list(checks_of(suite, required, comparison.figures, floor))
    if reference is not None and _is_judged_beside(suite, planned, checks):
        beside = usable_figures(reference)
        checks = list(checks_of(suite, required, comparison.figures, floor, beside))
    return cell_of([planned], [played]).model_copy(
        update={
            "settings": record.settings,
            "history": f"{HISTORIES}/{planned.kept_as}{TABLE}",
            "outcome": record.outcome,
            "overturned_at": comparison.overturned_at,
            "notes": (*record.notes, *comparison.hints),
            "cost": record.cost,
            "figures": tuple(compared.figure for compared in comparison.figures),
            "checks": tuple(checks),
            "numerical": record.numerical,
            "impact_law": comparison.impact_law,
        }
    )


def _is_judged_beside(suite: Suite, planned: Planned, checks: Sequence[results.Check]) -> bool:
    """Whether the reference's figures say if a figure that moved is better.

    They do where the reference solves the same equations.
    """
    moved = any(check.kind == "absolute" and check.weight != "pass" for check in checks)
    label = planned.variant.label
    rotation = tolerances.ToleranceKey(
        planned.scene_name, label, suite.config.reference, "theta_rms"
    )
    return moved and suite.kind(rotation) == "numerical"


def usable_figures(reference: results.Cell) -> dict[str, float | None]:
    """The figures of the reference itself, by "measure@window".

    One that is not as expected itself is no yardstick.
    """
    unexpected = {
        check.figure.windowed
        for check in reference.checks
        if check.verdict != "pass" and not check.figure.against
    }
    return {
        figure.windowed: figure.value
        for figure in reference.figures
        if not figure.against and figure.windowed not in unexpected
    }


def cell_of(
    planned: Sequence[Planned],
    outcomes: Sequence[models.Played | pool.Failure],
    reason: str = "",
    unnamed: Collection[str] = (),
) -> results.Cell:
    """The cell of what was played, without figures: one task, or the batches of an ensemble.

    `reason` says why it failed, empty if it did not. A model of those that nobody named
    (`unnamed`), and that cannot play the scene or takes too long, is left out.
    """
    first, variant = planned[0], planned[0].variant
    left_out = variant.label in unnamed and _is_left_out(outcomes[0])
    if left_out:
        reason += f"; left out, since nobody named it: --models {variant.label} plays it alone"
    missing = models.not_installed(variant.family)
    traced = [
        f"{FAULTS}/{task.kept_as}.txt"
        for task, outcome in zip(planned, outcomes, strict=True)
        if outcome.traceback
    ]
    return results.Cell(
        scene=first.scene_name,
        model=variant.label,
        settings=dict(variant.settings),
        key=_key_of(planned),
        status="unavailable" if left_out else _status(variant.family, missing, reason),
        reason=missing or reason,
        read_back=all(
            isinstance(outcome, models.Played) and outcome.read_back for outcome in outcomes
        ),
        traceback=traced[0] if traced else "",
        # in a user's own model an exception is that model's fault, not rockcheck's
        unexpected=bool(traced) and not models.is_own(variant.family),
    )


def _is_left_out(outcome: models.Played | pool.Failure) -> bool:
    """Whether there is no history since the model cannot play the scene, or takes too long."""
    return isinstance(outcome, pool.Failure) and (outcome.refused or outcome.timed_out)


def _key_of(planned: Sequence[Planned]) -> str:
    """The key of a cell; that of batches covers all of theirs."""
    if isinstance(planned[0], PlannedCell):
        return planned[0].key
    return provenance.digest("".join(batch.key for batch in planned))


def _status(family: str, missing: str, reason: str) -> results.Status:
    if missing:
        return "absent" if models.class_of(family).has_wheel() else "unavailable"
    return "failed" if reason else "done"


def checks_of(
    suite: Suite,
    required: Required,
    compared: Sequence[ComparedFigure],
    floor: Callable[[Measure], float],
    beside: Mapping[str, float | None] | None = None,
) -> Iterator[results.Check]:
    """The judged figures of a cell; none if its suite judges nothing.

    `floor` is the least meaningful value of a measure. `beside` has the reference's own figures, by
    "measure@window", where these are yardsticks.
    """
    if not suite.judged:
        return
    by_name = {
        (one.figure.against or tolerances.CELL_FIGURES, one.figure.windowed): one
        for one in compared
    }
    for key, kind in required.items():
        measure = tolerances.measure_of(key.windowed)
        line = suite.tolerances.get(key)
        found = by_name.get((key.against, key.windowed))
        if found is None:
            found = ComparedFigure(_missing_figure(key, measure))
        yardstick = None
        if beside is not None and line is not None and kind == "absolute":
            yardstick = beside.get(key.windowed)
        yield verdicts.judge(
            found.figure,
            line,
            kind=kind,
            measure=measure,
            gap=_gap_that_counts(found, kind),
            floor=floor(measure),
            beside=yardstick,
        )


def _missing_figure(key: tolerances.ToleranceKey, measure: Measure) -> Figure:
    """A figure without a value, so that its check cannot pass."""
    of_history = key.against == tolerances.CELL_FIGURES
    return Figure(
        measure=measure.name,
        label=measure.label,
        unit=measure.unit.replace("angle", "alpha"),
        value=None,
        against="" if of_history else key.against,
        window=key.window,
        note="not computed" if of_history else f"nothing of {key.against} to compare with here",
    )


def _gap_that_counts(compared: ComparedFigure, kind: results.Kind) -> str:
    """What of the window could not be compared.

    A difference of model form may make one block fall, and that is no gap.
    """
    if compared.fall:
        return "" if kind == "model form" else compared.gap
    if compared.gap and kind == "measured":
        return compared.gap + OFFSET_HINT
    return compared.gap
