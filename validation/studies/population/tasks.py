"""The tasks of an assessment: small, frozen, played anywhere, kept.

In: a case, that is a scene under one motion, and what is varied. Out: a record of `results`. Called
by the runner of studies, in whatever process.

Everything that is varied is played to its fate by the compiled batch, a row of numbers a run. Only
what the page draws is played as a history.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel, fates, ties
from rockcheck.scenes import Floats, History, Scene, Side, files, writing
from rockcheck.validation.criteria import CRITERIA, base_of
from rockcheck.validation.discrepancy import impact_laws
from rockcheck.validation.execute import models, pool
from rockcheck.validation.execute.fate import fate_of
from rockcheck.validation.studies.population import results, search
from rockcheck.validation.studies.population.rows import table_of
from rockcheck.validation.study import Task
from rockcheck.validation.uncertainty import input_spread
from rockcheck.validation.uncertainty.numerical import numerical_uncertainty

Numbers = tuple[tuple[str, float], ...]
Settings = tuple[tuple[str, Any], ...]
#: Usual time of a run, s, of compiled models and of others; total time of all tasks up to which
#: processes, which start in seconds, are not worth while beside the threads of a batch.
COMPILED_RUN, OTHER_RUN, SHORT_STUDY = 5e-4, 1.0, 60.0
#: Rows of a history that is kept, at the most.
MOST_ROWS = 2000
#: A gap is known to so many m.
GAP_RESOLUTION = 1e-4


@dataclass(frozen=True)
class CaseTask(Task):
    """Runs of one case by one model; `about` says which runs, in words."""

    about: tuple[str, ...]
    scene: Scene = field(repr=False)
    model: str
    settings: Settings = ()

    @property
    def label(self) -> str:
        """Which runs."""
        return ", ".join(filter(None, self.about))

    def built(self) -> Any:
        """The model that plays."""
        return models.build(self.model, dict(self.settings))


def effort(
    model: str, settings: Mapping[str, Any], runs: float, study_runs: float
) -> dict[str, Any]:
    """For a `Task` of so many `runs`: its usual time (s), and the code that it may have to compile.

    Compiled models are played in this process where all runs of the study take less than
    `SHORT_STUDY`: their batches use all cores. Others may crash, and are always played by a worker.
    """
    is_compiled = bool(models.family(model).compiled)
    seconds = COMPILED_RUN if is_compiled else OTHER_RUN
    is_short = is_compiled and study_runs * seconds < SHORT_STUDY
    return {
        "expected": runs * seconds,
        "compiles": models.compiles(model, settings),
        "where": "here" if is_short else "worker",
    }


@dataclass(frozen=True)
class ShownRun(CaseTask):
    """The case as it is, to its fate; with its history and hand methods where it is `drawn`."""

    drawn: bool = True

    def play(self) -> results.Shown:
        """The run."""
        played = fate_of(self.built(), self.scene)
        result = results.result_of(played.outcome, played.extremes, self.scene.block.alpha)
        if not self.drawn:
            return results.Shown(result=result, until_s=played.at_s)
        base = base_of(self.scene.replace(duration=motion_end(self.scene)))
        return results.Shown(
            result=result,
            until_s=played.at_s,
            history=history_text(played.history, self.scene.duration),
            methods=tuple(criterion.says(self.scene, base) for criterion in CRITERIA),
        )


def motion_end(scene: Scene) -> float:
    """The time (s) at which the base is at rest for good, or that of the scene if that is later."""
    return max(scene.duration, scene.excitation.quiet_after, scene.vertical.quiet_after)


def history_text(history: History, until: float) -> str:
    """The history up to a time (s) as CSV, in at most `MOST_ROWS` rows."""
    rows = int(np.searchsorted(history.channels["t"], until * (1.0 + 1e-9), side="right"))
    every = -(-rows // MOST_ROWS)
    columns: dict[str, Any] = {
        name: values[:rows:every] for name, values in history.channels.items()
    }
    return writing.columns_text(columns)


@dataclass(frozen=True)
class DrawTask(CaseTask):
    """Runs of a case as it is, and of draws of its uncertain numbers, by an event-based model."""

    draws: tuple[Numbers, ...] = field(default=(), repr=False)

    @cached_property
    def scenes(self) -> list[Scene]:
        """The scene as it is, then a scene a draw."""
        drawn = [files.with_numbers(self.scene, dict(numbers)) for numbers in self.draws]
        return [self.scene, *drawn]

    def batch(
        self,
        which: NDArray[np.int64],
        gaps: tuple[Side, Floats | float] | None = None,
        restitution: float = 0.0,
        *,
        factor: Floats | float = 1.0,
        vertical_factor: Floats | float = 1.0,
        keeps: fates.Keep = fates.Keep.NOTHING,
    ) -> fates.Fates:
        """The fates of rows of `scenes`; see `rows.table_of`."""
        model: EventBasedModel = self.built()
        table = table_of(
            self.scenes,
            which,
            gaps=gaps,
            restitution=restitution,
            factor=factor,
            vertical_factor=vertical_factor,
        )
        return fates.play_fates(table, model, keeps=keeps, jobs=pool.cores())


@dataclass(frozen=True)
class Draws(DrawTask):
    """The case as it is and its draws, with extremes; `without` the wall of a side."""

    without: Side | None = None

    def play(self) -> results.Drawn:
        """All runs at once."""
        gaps = None if self.without is None else (self.without, np.inf)
        played = self.batch(np.arange(len(self.scenes)), gaps, keeps=fates.Keep.EXTREMES)
        alphas = [scene.block.alpha for scene in self.scenes]
        return results.Drawn(results=tuple(results.results_of(played, alphas)))


@dataclass(frozen=True)
class GapTask(DrawTask):
    """The search over the gap of the wall on one side.

    `fine` are the gaps (m) at which the scene as it is is looked at, `coarse` those for its draws,
    `tabulated`, which are among both, those at which all runs are counted with their speeds.
    `reach` and `free_stands` are of each run without the wall: a wall beyond its reach changes
    nothing. The reach is infinite where that run was not decided.
    """

    side: Side = "left"
    restitution: float = 0.0
    fine: tuple[float, ...] = field(default=(), repr=False)
    coarse: tuple[float, ...] = field(default=(), repr=False)
    tabulated: tuple[float, ...] = ()
    reach: tuple[float, ...] = field(default=(), repr=False)
    free_stands: tuple[bool, ...] = field(default=(), repr=False)

    def play(self) -> results.GapSearch:
        """The look, the bisection, and the table."""
        counter = Counter()

        def stands(which: NDArray[np.int64], gaps: Floats) -> NDArray[np.bool_]:
            return self._at(which, gaps, counter).stands

        as_it_is, fine = np.array([0]), np.array(self.fine)
        seen = stands(np.repeat(as_it_is, len(fine)), fine).reshape(1, -1)
        intervals = self._intervals(stands, as_it_is, search.Look.at(fine, seen))
        # The look at the draws is the table, too: no run of them is played twice.
        counted = np.arange(1 if self.draws else 0, len(self.scenes))
        grid = np.unique(np.round(self.coarse if self.draws else self.tabulated, 12))
        look = self._at(
            np.repeat(counted, len(grid)), np.tile(grid, len(counted)), counter, speeds=True
        )
        if self.draws:
            seen = look.stands.reshape(len(counted), -1)
            intervals += self._intervals(stands, counted, search.Look.at(grid, seen))
        return results.GapSearch(
            intervals=tuple(intervals),
            rows=self._rows_of(look, grid),
            undecided=counter.undecided,
            runs=counter.runs,
        )

    def _intervals(
        self, stands: search.Stands, runs: NDArray[np.int64], look: search.Look
    ) -> list[results.FallInterval]:
        """The intervals of these runs, of a look at them and at the gap that each has."""

        def stands_of(which: NDArray[np.int64], gaps: Floats) -> NDArray[np.bool_]:
            return stands(runs[which], gaps)

        look = look.with_own(self._own_gaps[runs], stands_of)
        found = search.falls_within(stands_of, look, GAP_RESOLUTION)
        return [
            interval
            for run, falls in zip(runs.tolist(), found, strict=True)
            for interval in fall_intervals(run, falls)
        ]

    @cached_property
    def _own_gaps(self) -> Floats:
        """The gap (m) that each of the `scenes` has on this side, NaN without a wall there."""
        walls = [scene.wall(self.side) for scene in self.scenes]
        return np.array([np.nan if wall is None else wall.gap for wall in walls])

    def _at(
        self,
        which: NDArray[np.int64],
        gaps: Floats,
        counter: "Counter",
        *,
        speeds: bool = False,
    ) -> "_AtGaps":
        """What becomes of rows of `scenes` at gaps. A wall out of reach is not played."""
        count = len(which)
        at_gaps = _AtGaps(
            stands=np.array(self.free_stands)[which],
            overturned=~np.array(self.free_stands)[which],
            undecided=np.zeros(count, dtype=bool),
            speed=np.full(count, np.nan),
        )
        near = np.flatnonzero(gaps <= np.array(self.reach)[which])
        if not near.size:
            return at_gaps
        keeps = fates.Keep.STRIKES if speeds else fates.Keep.NOTHING
        played = self.batch(which[near], (self.side, gaps[near]), self.restitution, keeps=keeps)
        at_gaps.stands[near] = counter.standing(played)
        at_gaps.overturned[near] = np.isin(played.outcome, OVERTURNED)
        at_gaps.undecided[near] = played.outcome >= fates.UNDECIDED
        if played.extremes is not None:
            strikes = played.extremes[f"wall_{self.side}_strikes"]
            speed = played.extremes[f"wall_{self.side}_speed"]
            at_gaps.speed[near] = np.where(strikes > 0, speed, np.nan)
        return at_gaps

    def _rows_of(self, look: "_AtGaps", grid: Floats) -> tuple[results.GapRow, ...]:
        """The table: the runs that count at each tabulated gap."""
        overturned = look.overturned.reshape(-1, len(grid))
        undecided = look.undecided.reshape(-1, len(grid))
        speed = look.speed.reshape(-1, len(grid))
        columns = np.searchsorted(grid, np.round(self.tabulated, 12))
        return tuple(
            results.GapRow(
                gap=gap,
                runs=len(speed),
                overturned=int(overturned[:, column].sum()),
                undecided=int(undecided[:, column].sum()),
                speeds=tuple(speed[~np.isnan(speed[:, column]), column].tolist()),
            )
            for gap, column in zip(self.tabulated, columns, strict=True)
        )


@dataclass(frozen=True)
class _AtGaps:
    """What became of runs, an array element a run; `speed` is NaN where the wall is not struck."""

    stands: NDArray[np.bool_]
    overturned: NDArray[np.bool_]
    undecided: NDArray[np.bool_]
    speed: Floats


@dataclass(frozen=True)
class PeaksTask(DrawTask):
    """The peak rotations of the scene as it is at factors of its base motion.

    With `both` the vertical motion is scaled, too, by the size of the factor: it is not mirrored.
    """

    factors: tuple[float, ...] = field(default=(), repr=False)
    both: bool = False

    def play(self) -> results.Peaks:
        """The peaks, alpha; infinite where the block overturned, NaN where the run failed."""
        factor = np.array(self.factors)
        upward = np.abs(factor) if self.both else 1.0
        played = self.batch(np.zeros(len(factor), int), factor=factor, vertical_factor=upward)
        peaks = played.peak / self.scene.block.alpha
        peaks = np.where(np.isin(played.outcome, OVERTURNED), np.inf, peaks)
        peaks = np.where(played.outcome >= fates.UNDECIDED, np.nan, peaks)
        return results.Peaks(peaks=tuple(peaks.tolist()))


OVERTURNED = (fates.OVERTURNED_LEFT, fates.OVERTURNED_RIGHT)


class Counter:
    """Counts the runs of a search, and those that nothing decided."""

    def __init__(self) -> None:
        self.runs = self.undecided = 0

    def standing(self, played: fates.Fates) -> NDArray[np.bool_]:
        """Which runs stand for good. One that is not decided is not among them."""
        self.runs += len(played.outcome)
        self.undecided += int((played.outcome >= fates.UNDECIDED).sum())
        return np.isin(played.outcome, (fates.AT_REST, fates.MOVING))


def fall_intervals(run: int, falls: Sequence[search.Fall]) -> list[results.FallInterval]:
    """The intervals in which a run does not stand, as they are kept."""
    return [
        results.FallInterval(
            draw=run,
            low=fall.low,
            high=fall.high,
            stands_below=fall.stands_below,
            stands_above=fall.stands_above,
        )
        for fall in falls
    ]


@dataclass(frozen=True)
class CertaintyTask(CaseTask):
    """How sure the case as it is is."""

    def play(self) -> results.Certainty:
        """Plays coarser steps or a finer tolerance, the laws of impacts, and both sides of ties."""
        landing = None
        if self.scene.floor.restitution < 1.0:  # no event-based model plays a floor without loss
            landing = impact_laws.parting_landing(self.scene)
        found = ties.ties_of(self.scene)
        return results.Certainty(
            numerical=numerical_uncertainty(self.built(), self.scene),
            depends_on_law_from_s=None if landing is None else landing.t,
            ties=tuple((tie.what, tie.from_s, tie.fates) for tie in found),
        )


@dataclass(frozen=True)
class SensitivityTask(CaseTask):
    """Which uncertain number of a scene matters most for its peak rotation."""

    given: files.UncertainScene | None = field(default=None, repr=False, compare=False)

    def depends(self) -> Any:
        """Also what is not known of the scene."""
        assert self.given is not None, "a scene with uncertain numbers"
        spreads = {name: spread.model_dump() for name, spread in self.given.spreads.items()}
        return super().depends(), spreads

    def play(self) -> results.Sensitivities:
        """Sobol's indices."""
        assert self.given is not None, "a scene with uncertain numbers"
        return results.Sensitivities(indices=input_spread.sensitivities(self.given, self.built()))


def draws_of(given: files.UncertainScene, count: int) -> tuple[Numbers, ...]:
    """Draws of the uncertain numbers of a scene, quasi-random, the same on every call.

    `count` is a power of two. Raises `InputError` where a draw is no scene.
    """
    from scipy.stats import qmc

    sobol = qmc.Sobol(len(given.spreads), seed=np.random.default_rng(1))
    values = given.values(sobol.random(count))
    for row in values:
        given.at(row)
    return tuple(tuple(zip(given.names, row, strict=True)) for row in values.tolist())


def sequence_of(values: Sequence[float] | Floats) -> tuple[float, ...]:
    """Numbers as a field of a task."""
    return tuple(np.asarray(values, dtype=float).tolist())
