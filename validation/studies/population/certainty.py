"""How sure the answers of an assessment are, and how hand methods score, as numbers.

In: gathered results. Out: small typed answers, by pure functions. Called by whoever words,
tabulates or draws them (`sentences`, `certainty_blocks`, `data`).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rockcheck.scenes import experience
from rockcheck.validation.studies.population import results
from rockcheck.validation.studies.population.gathered import Gathered
from rockcheck.validation.uncertainty.numerical import Numerical

#: A slip (m) or rotation (alpha) below this is none: models with contacts yield a little.
MOVED = 1e-6
#: A number that answers for a run.
Response = Callable[[results.RunResult], float]


# How sure is that?

Source = Literal["records", "inputs", "numerical error", "law of impacts", "model form"]


@dataclass(frozen=True)
class Contribution:
    """The part of one source in the variance of the answer; `sd` is in the answer's unit."""

    source: Source
    share: float
    sd: float


@dataclass(frozen=True)
class UncertaintyAnswer:
    """Where the uncertainty comes from.

    Where some runs fall and others stand, the answer is the outcome, 1 or 0: a peak that is cut at
    the fall would hide what differs between records. Else it is the peak rotation, alpha.
    """

    of: Literal["outcome", "peak rotation"]
    contributions: tuple[Contribution, ...]
    unknown: tuple[Source, ...]


def uncertainty_answer(gathered: Gathered) -> UncertaintyAnswer:
    """The variance of the answer by source, the largest first."""
    standing = [run.stands for _, run in gathered.all_runs if run.decided]
    by_outcome = len(set(standing)) > 1 or _another_outcome(gathered)
    response = _outcome if by_outcome else _peak
    squares: dict[Source, list[float]] = {
        "records": _between_records(gathered, response),
        "inputs": _within_records(gathered, response),
        "numerical error": _numerical(gathered, by_outcome=by_outcome),
        "law of impacts": [
            (0.5 * difference) ** 2
            for difference in _apart(gathered, gathered.by_other_law, response)
        ],
        "model form": [
            difference**2
            for others in gathered.others.values()
            for difference in _apart(gathered, others, response)
        ],
    }
    variance = {source: float(np.mean(each)) for source, each in squares.items() if each}
    total = sum(variance.values()) or 1.0
    ordered = sorted(variance.items(), key=lambda item: -item[1])
    return UncertaintyAnswer(
        of="outcome" if by_outcome else "peak rotation",
        contributions=tuple(
            Contribution(source, value / total, math.sqrt(value)) for source, value in ordered
        ),
        unknown=tuple(source for source, each in squares.items() if not each),
    )


def _another_outcome(gathered: Gathered) -> bool:
    """Whether another model, or another law of impacts, ends a run otherwise."""
    return any(
        run.overturned != gathered.as_it_is[case].overturned
        for runs in (*gathered.others.values(), gathered.by_other_law)
        for case, run in runs.items()
        if case in gathered.as_it_is and run.decided
    )


def _outcome(run: results.RunResult) -> float:
    return float(run.overturned)


def _peak(run: results.RunResult) -> float:
    return run.peak_rotation or 0.0


def _between_records(gathered: Gathered, response: Response) -> list[float]:
    means = [np.mean([*map(response, runs)]) for runs in gathered.runs.values() if runs]
    return [float(np.var(means, ddof=1))] if len(means) > 1 else []


def _within_records(gathered: Gathered, response: Response) -> list[float]:
    if not gathered.drawn:
        return []
    return [float(np.var([*map(response, runs)])) for runs in gathered.runs.values() if runs]


def _numerical(gathered: Gathered, *, by_outcome: bool) -> list[float]:
    """Variances by the step or tolerance: none in the outcome of a run that is converged."""
    if by_outcome:
        return [0.0 if judged.converged else 0.25 for judged in gathered.judged.values()]
    errors = [_error_of_peak(case, gathered) for case in gathered.judged]
    return [(error / experience.WIDTH) ** 2 for error in errors if error is not None]


def _error_of_peak(case: str, gathered: Gathered) -> float | None:
    judged: Numerical = gathered.judged[case]
    fell = gathered.as_it_is[case].overturned
    return 0.0 if fell and judged.converged else judged.u_num("peak_rotation")


def _apart(
    gathered: Gathered, others: Mapping[str, results.RunResult], response: Response
) -> list[float]:
    """How far the answer of each other run is from the case's own."""
    return [
        response(run) - response(gathered.as_it_is[case])
        for case, run in others.items()
        if case in gathered.as_it_is and run.fate != results.FAILED
    ]


def leading_number(gathered: Gathered) -> str | None:
    """The uncertain number with which the answer correlates most, within the records."""
    columns = []
    for case, runs in gathered.drawn.items():
        values = np.array([[value for _, value in draw] for draw in gathered.plan.numbers[case]])
        peaks = np.array([min(_peak(run), 1.0) for run in runs])
        spreads = np.maximum(values.std(axis=0), 1e-300)
        columns.append(((values - values.mean(axis=0)) / spreads).T @ (peaks - peaks.mean()))
    if not columns:
        return None
    case = next(iter(gathered.drawn))
    names = [name for name, _ in gathered.plan.numbers[case][0]]
    return names[int(np.argmax(np.abs(np.sum(columns, axis=0))))]


# What do hand methods say?


@dataclass(frozen=True)
class MethodScore:
    """What a hand method says of the cases, against what the simulation does.

    It `predicts` its event in so many `of` the cases; it was `simulated` in so many, and both say
    the same in `agrees`. `estimate` and `motion` are lower medians of how far it goes, `unsafe`
    counts the runs that moved farther than estimated; None of a method without an estimate.
    """

    method: str
    predicts: int
    of: int
    simulated: int
    agrees: int
    estimate: float | None
    motion: float | None
    unsafe: int | None
    unit: str


#: The event of a hand method: the figure of a run, its unit, and above what it happens.
EVENTS = {
    "uplifts": ("peak_rotation", "alpha", MOVED),
    "slides": ("slip", "m", MOVED),
    "overturns": ("peak_rotation", "alpha", math.inf),
}


def method_scores(gathered: Gathered, methods: Sequence[tuple[str, str]]) -> list[MethodScore]:
    """A score a hand method, of its name and event, in the order in which cases have them."""
    cases = [
        (shown.result, shown.methods)
        for shown in gathered.shown.values()
        if shown.methods and shown.result.decided
    ]
    return [
        _score(name, event, [(run, *said[k]) for run, said in cases])
        for k, (name, event) in enumerate(methods)
    ]


def _score(
    name: str, event: str, runs: Sequence[tuple[results.RunResult, bool, float | None]]
) -> MethodScore:
    figure, unit, least = EVENTS[event]
    happened = [run.overturned or (getattr(run, figure) or 0.0) > least for run, _, _ in runs]
    if event == "slides":
        happened = [(run.slip or 0.0) > least for run, _, _ in runs]
    pairs = [
        (estimate, math.inf if run.overturned and unit == "alpha" else getattr(run, figure) or 0.0)
        for run, _, estimate in runs
        if estimate is not None
    ]
    return MethodScore(
        method=name,
        predicts=sum(predicted for _, predicted, _ in runs),
        of=len(runs),
        simulated=sum(happened),
        agrees=sum(
            predicted == there for (_, predicted, _), there in zip(runs, happened, strict=True)
        ),
        estimate=_lower_median([estimate for estimate, _ in pairs]),
        motion=_lower_median([motion for _, motion in pairs]),
        unsafe=sum(motion > estimate * (1.0 + MOVED) + MOVED for estimate, motion in pairs)
        if pairs
        else None,
        unit=unit,
    )


def _lower_median(values: Sequence[float]) -> float | None:
    """The lower median; None of no values, and where it is infinite."""
    if not values:
        return None
    middle = sorted(values)[(len(values) - 1) // 2]
    return middle if math.isfinite(middle) else None
