"""The answers of an assessment as numbers.

In: gathered results. Out: small typed answers, by pure functions. Called by whoever words,
tabulates or draws them (`sentences`, `blocks`, `data`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rockcheck.scenes import Side
from rockcheck.validation.discrepancy.compare import QUANTITIES, spread
from rockcheck.validation.studies.population import results
from rockcheck.validation.studies.population.gathered import Gathered
from rockcheck.validation.studies.population.intensity_measures import size_of
from rockcheck.validation.studies.population.plan import FINE_UP_TO, clearance_of
from rockcheck.validation.uncertainty.lognormal import Lognormal, fit_least
from rockcheck.validation.uncertainty.proportions import FEW_RECORDS, Share, share_of_runs

# Does it fall?


@dataclass(frozen=True)
class FallAnswer:
    """How the runs end: how many of each fate, and the share that overturns.

    `records` counts the motions, `few` tells that they are too few for a probability.
    """

    runs: int
    records: int
    fates: Mapping[str, int]
    overturning: Share

    @property
    def few(self) -> bool:
        """Whether there are several records, and too few."""
        return 1 < self.records < FEW_RECORDS


def fall_answer(gathered: Gathered) -> FallAnswer:
    """How all runs that count end. What is undecided is not among those that stay."""
    runs = [run for _, run in gathered.all_runs]
    decided = {case: [run for run in runs if run.decided] for case, runs in gathered.runs.items()}
    hits = [sum(run.overturned for run in runs) for runs in decided.values()]
    return FallAnswer(
        runs=len(runs),
        records=len(gathered.runs),
        fates={fate: sum(run.fate == fate for run in runs) for fate in results.FATES},
        overturning=share_of_runs(np.array(hits), np.array([*map(len, decided.values())])),
    )


# How far does it move?


@dataclass(frozen=True)
class QuantityAnswer:
    """The spread of one figure over the runs that stand and have it, and the largest's case."""

    name: str
    label: str
    unit: str
    help: str
    values: tuple[float, ...]
    largest_case: str | None

    @property
    def spread(self) -> dict[str, float | None]:
        """Median, 16 and 84 % quantiles and the largest; None without values."""
        return spread(self.values)


def quantity_answers(gathered: Gathered) -> list[QuantityAnswer]:
    """The four figures of the runs that stand."""
    standing = [(case, run) for case, run in gathered.all_runs if run.stands]
    answers = []
    for quantity in QUANTITIES:
        values = [
            (value, case)
            for case, run in standing
            if (value := value_of(run, quantity.name)) is not None
        ]
        answers.append(
            QuantityAnswer(
                name=quantity.name,
                label=quantity.label,
                unit=quantity.unit,
                help=quantity.help,
                values=tuple(value for value, _ in values),
                largest_case=max(values)[1] if values else None,
            )
        )
    return answers


def value_of(run: results.RunResult, quantity: str) -> float | None:
    """One of the four figures of a run."""
    if quantity == "wall_speed":
        return run.largest_wall_speed
    value: float | None = getattr(run, quantity)
    return value


# Which gap is safe?


@dataclass(frozen=True)
class CaseFalls:
    """The intervals (of a gap, or of an intensity) in which a draw of a case does not stand."""

    case: str
    draw: int
    intervals: tuple[results.FallInterval, ...]


@dataclass(frozen=True)
class GapRowAnswer:
    """All runs at one gap, m."""

    gap: float
    runs: int
    overturned: int
    undecided: int
    struck: int
    median_speed: float | None
    largest_speed: float | None


@dataclass(frozen=True)
class GapAnswer:
    """Which gaps on one side are safe.

    Gaps (m) from `low` to `high` were looked at: the scene as it is every `looked_every` up to
    `finely_up_to`, and beyond that every `beyond_every`; its draws every `draws_every` and
    `draws_beyond_every` (None without draws).
    `clearance` is how far the block reaches without the wall, falls included, of which there are
    `free_overturned`. `safe_up_to` is the largest gap up to which no run was seen to fall, None
    where one falls at the smallest; `first` is what falls first above it. `complete` tells whether
    all runs have a result.
    """

    side: Side
    low: float
    high: float
    looked_every: float
    finely_up_to: float
    beyond_every: float
    draws_every: float | None
    draws_beyond_every: float | None
    clearance: float
    free_overturned: int
    free_runs: int
    safe_up_to: float | None
    first: CaseFalls | None
    falls: tuple[CaseFalls, ...]
    rows: tuple[GapRowAnswer, ...]
    undecided: int
    runs: int
    complete: bool

    @property
    def has_safe_gap(self) -> bool:
        """Whether no run was seen to fall all the way from the least to the largest gap."""
        return not any(
            interval.stands_below is None and interval.stands_above is None
            for case in self.falls
            for interval in case.intervals
        )

    @property
    def islands(self) -> int:
        """How many intervals have a gap above them at which the run stands again."""
        return sum(
            interval.stands_above is not None for case in self.falls for interval in case.intervals
        )


def gap_answers(gathered: Gathered) -> list[GapAnswer]:
    """The answer for each side whose gap was searched."""
    return [answer for side in gathered.gaps if (answer := _gap_answer(gathered, side)) is not None]


def _gap_answer(gathered: Gathered, side: Side) -> GapAnswer | None:
    searches, free = gathered.gaps[side], gathered.free[side]
    clearance = clearance_of(free, side)
    if not searches or clearance is None:
        return None
    task = next(iter(gathered.plan.gap_tasks(gathered.done)[side].values()))
    falls = tuple(
        case_falls
        for case, search in searches.items()
        for case_falls in by_draw(case, search.intervals)
    )
    first = min(falls, key=lambda case: case.intervals[0].low, default=None)
    counted = [run for drawn in free.values() for run in drawn.counted]
    finely = round(min(task.fine[-1], task.fine[0] + FINE_UP_TO), 12)  # as the grid is
    every, beyond_every = _widest_steps(np.array(task.fine), finely)
    draws_every, draws_beyond_every = _widest_steps(np.array(task.coarse), finely)
    return GapAnswer(
        side=side,
        low=task.fine[0],
        high=task.fine[-1],
        looked_every=every,
        finely_up_to=finely,
        beyond_every=beyond_every,
        draws_every=draws_every if task.draws else None,
        draws_beyond_every=draws_beyond_every if task.draws else None,
        clearance=clearance,
        free_overturned=sum(run.overturned for run in counted),
        free_runs=len(counted),
        safe_up_to=safe_up_to(falls, task.fine[-1]),
        first=first,
        falls=falls,
        rows=tuple(gap_rows(searches)),
        undecided=sum(search.undecided for search in searches.values()),
        runs=sum(search.runs for search in searches.values()),
        complete=len(searches) == len(gathered.plan.cases),
    )


def _widest_steps(grid: np.ndarray, middle: float) -> tuple[float, float]:
    """The widest steps of an increasing grid up to `middle` and beyond it; 0 where it has none."""
    steps = np.diff(grid)
    is_beyond = grid[:-1] >= middle
    near = np.max(steps[~is_beyond], initial=0.0)
    return float(near), float(np.max(steps[is_beyond], initial=0.0))


def by_draw(case: str, intervals: Sequence[results.FallInterval]) -> list[CaseFalls]:
    """The intervals of a case, by its draws."""
    draws: dict[int, list[results.FallInterval]] = {}
    for interval in intervals:
        draws.setdefault(interval.draw, []).append(interval)
    return [CaseFalls(case, draw, tuple(found)) for draw, found in draws.items()]


def safe_up_to(falls: Sequence[CaseFalls], high: float) -> float | None:
    """The largest value up to which nothing was seen to fall; None where it does at the least."""
    first = [case.intervals[0].stands_below for case in falls]
    standing = [below for below in first if below is not None]
    return None if len(standing) < len(first) else min(standing, default=high)


def gap_rows(searches: Mapping[str, results.GapSearch]) -> list[GapRowAnswer]:
    """The runs of all cases at each tabulated gap."""
    rows = []
    for at_gap in zip(*(search.rows for search in searches.values()), strict=True):
        speeds = [speed for row in at_gap for speed in row.speeds]
        rows.append(
            GapRowAnswer(
                gap=at_gap[0].gap,
                runs=sum(row.runs for row in at_gap),
                overturned=sum(row.overturned for row in at_gap),
                undecided=sum(row.undecided for row in at_gap),
                struck=len(speeds),
                median_speed=float(np.median(speeds)) if speeds else None,
                largest_speed=max(speeds, default=None),
            )
        )
    return rows


def overturned_steps(answer: GapAnswer) -> tuple[list[float], list[float]]:
    """The share of the runs that overturn, as a step at each gap (m) where one begins or ceases to.

    By the intervals of the search: of the draws, or of the scenes as they are where there are none.
    """
    drawn = answer.draws_every is not None
    intervals = [
        interval for case in answer.falls if bool(case.draw) == drawn for interval in case.intervals
    ]
    changes = [(interval.low, 1) for interval in intervals]
    changes += [
        (interval.stands_above, -1) for interval in intervals if interval.stands_above is not None
    ]
    gaps, shares, overturned = [answer.low], [0.0], 0
    for gap, change in sorted(changes):
        overturned += change
        gaps.append(gap)
        shares.append(overturned / answer.free_runs)
    return [*gaps, answer.high], [*shares, shares[-1]]


# At which intensity does it fall?


@dataclass(frozen=True)
class RecordIntensity:
    """The intensities at which a motion was seen to overturn the block.

    `as_it_is` is its intensity, `least` the least at which it falls (None: not up to `beyond`),
    `islands` the intervals above which the block stands again, and `for_good` the intensity from
    which it falls up to `beyond` (None: it stands there).
    """

    case: str
    as_it_is: float
    least: float | None
    beyond: float
    islands: tuple[tuple[float, float], ...]
    for_good: float | None = None


@dataclass(frozen=True)
class IntensityAnswer:
    """The least intensity of each motion, and the lognormal curve of all.

    `undecided` counts the runs of the search that nothing decided: they count as falls.
    """

    measure: str
    label: str
    unit: str
    records: tuple[RecordIntensity, ...]
    fit: Lognormal | None
    undecided: int

    @property
    def head(self) -> str:
        """The measure with its unit, as a heading: "PGA, g"."""
        return f"{self.label}, {self.unit}" if self.unit else self.label


def intensity_answer(gathered: Gathered) -> IntensityAnswer | None:
    """The search over the factor on each motion; None where no motion was scaled."""
    plan = gathered.plan
    return least_intensities(
        gathered,
        {case: search.intervals for case, search in gathered.factors.items()},
        {case: plan.factors[case].factors[-1] for case in gathered.factors},
        sum(search.undecided for search in gathered.factors.values()),
    )


def least_intensities(
    gathered: Gathered,
    intervals: Mapping[str, Sequence[results.FallInterval]],
    most: Mapping[str, float],
    undecided: int,
) -> IntensityAnswer | None:
    """The intensities of each motion in the `intervals` of its factor, which went up to `most`.

    None where no motion was scaled.
    """
    measure = gathered.plan.measure
    if measure is None or not intervals:
        return None
    records = []
    for case, falls in intervals.items():
        size = size_of(measure, gathered.plan.cases[case])
        islands = [fall for fall in falls if fall.stands_above is not None]
        records.append(
            RecordIntensity(
                case=case,
                as_it_is=size,
                least=size * falls[0].low if falls else None,
                beyond=size * most[case],
                islands=tuple((size * fall.low, size * fall.high) for fall in islands),
                for_good=size * falls[-1].low if len(falls) > len(islands) else None,
            )
        )
    least = [record.least for record in records if record.least is not None]
    beyond = [record.beyond for record in records if record.least is None]
    return IntensityAnswer(
        measure=measure.name,
        label=measure.label,
        unit=measure.unit,
        records=tuple(records),
        fit=fit_least(least, beyond),
        undecided=undecided,
    )
