"""What the tasks of an assessment keep: the fate of runs, and the intervals in which runs fall.

In: what a model or a batch has played. Out: small records, which the store reads back. Called by
the tasks (`tasks`) and by all that tells something of them (`statistics`).
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from pydantic import Field

from rockcheck.ebm import fates
from rockcheck.scenes import Side, history
from rockcheck.scenes.extremes import Extremes
from rockcheck.validation.discrepancy import figures
from rockcheck.validation.uncertainty.input_spread import Sensitivity
from rockcheck.validation.uncertainty.numerical import Numerical

#: Fates of a run: the outcomes of a history, then one that nothing decided, and a run that failed.
UNDECIDED, FAILED = "undecided", "failed"
FATES = (*history.OUTCOMES, UNDECIDED, FAILED)
#: Fates of a block that stands: it cannot fall any more.
STANDING = ("at rest", "moving")
SIDES: tuple[Side, Side] = ("left", "right")


class RunResult(figures.Stored):
    """A run, played until its fate is known.

    `peak_rotation` is in alpha. `slip`, `top_displacement` and `reach` (farthest beyond the block's
    first place, by side) are in m, `wall_speed` (m/s) is the largest speed at each wall that was
    struck. Extremes are of the whole motion; None where they were not asked for, or the run failed.
    """

    fate: Literal["at rest", "moving", "overturned left", "overturned right", "undecided", "failed"]
    peak_rotation: float | None = None
    slip: float | None = None
    top_displacement: float | None = None
    reach: Mapping[Side, float] = Field(default_factory=dict)
    wall_speed: Mapping[Side, float] = Field(default_factory=dict)
    reason: str = ""

    @property
    def overturned(self) -> bool:
        """Whether the block overturned."""
        return self.fate.startswith("overturned")

    @property
    def stands(self) -> bool:
        """Whether the block stands for good."""
        return self.fate in STANDING

    @property
    def decided(self) -> bool:
        """Whether the fate is known."""
        return self.overturned or self.stands

    @property
    def largest_wall_speed(self) -> float | None:
        """The largest speed at any wall, m/s; None where none was struck."""
        return max(self.wall_speed.values(), default=None)


def result_of(fate: str, extremes: Extremes, alpha: float) -> RunResult:
    """The result of a run of any model; `alpha` is the block's slenderness angle, rad."""
    return RunResult.model_construct(
        fate=fate,
        peak_rotation=extremes.peak_rotation / alpha,
        slip=extremes.slip,
        top_displacement=extremes.top_displacement,
        reach={"left": extremes.reach_left, "right": extremes.reach_right},
        wall_speed={side: wall.speed for side, wall in extremes.walls.items() if wall.strikes},
    )


def results_of(played: fates.Fates, alphas: Sequence[float]) -> list[RunResult]:
    """The results of a batch whose extremes were asked for; `alphas` of the block of each run."""
    columns = played.extremes
    assert columns is not None, "extremes were asked for"
    return [
        RunResult.model_construct(
            fate=FATES[code],
            reason=played.reasons.get(k, ""),
            **({} if FATES[code] == FAILED else _extremes_at(columns, k, alpha)),
        )
        for k, (code, alpha) in enumerate(zip(played.outcome.tolist(), alphas, strict=True))
    ]


def _extremes_at(columns: Mapping[str, Any], k: int, alpha: float) -> dict[str, Any]:
    """The extremes of run `k` of a batch, as fields of a `RunResult`."""
    peak = max(columns["rotation_left"][k], columns["rotation_right"][k])
    struck = [side for side in SIDES if columns[f"wall_{side}_strikes"][k] > 0]
    return {
        "peak_rotation": float(peak) / alpha,
        "slip": float(columns["slip"][k]),
        "top_displacement": float(columns["top_displacement"][k]),
        "reach": {side: float(columns[f"reach_{side}"][k]) for side in SIDES},
        "wall_speed": {side: float(columns[f"wall_{side}_speed"][k]) for side in struck},
    }


class Shown(figures.Stored):
    """A case as it is: its result, its history as CSV, and what hand methods say.

    `until_s` (s) is when its fate was known. `methods` holds by hand method whether its event
    happens, and how far the block goes.
    """

    kind: Literal["shown"] = "shown"
    result: RunResult
    until_s: float = 0.0
    history: str = ""
    methods: tuple[tuple[bool, float | None], ...] = ()


class Drawn(figures.Stored):
    """The results of draws of a scene's uncertain numbers.

    `results` has the scene as it is first, then its draws in their order.
    """

    kind: Literal["drawn"] = "drawn"
    results: tuple[RunResult, ...]

    @property
    def draws(self) -> tuple[RunResult, ...]:
        """The results of the draws; empty where no number is uncertain."""
        return self.results[1:]

    @property
    def counted(self) -> tuple[RunResult, ...]:
        """The runs that count: the draws or, where there are none, the scene as it is."""
        return self.draws or self.results


class FallInterval(figures.Stored):
    """An interval of a searched number in which a draw does not stand; see `search.Fall`.

    Draw 0 is the scene as it is.
    """

    draw: int
    low: float
    high: float
    stands_below: float | None
    stands_above: float | None


class GapRow(figures.Stored):
    """The runs of a case at one gap (m): how many, their fates, and the speeds at that wall."""

    gap: float
    runs: int
    overturned: int
    undecided: int
    speeds: tuple[float, ...]


class GapSearch(figures.Stored):
    """The search of a case over the gap of one wall.

    `intervals` (m) are those in which it does not stand, of the scene as it is and of its draws;
    `rows` are the runs at the gaps that are tabulated; `runs` is how many were played.
    """

    kind: Literal["gaps"] = "gaps"
    intervals: tuple[FallInterval, ...]
    rows: tuple[GapRow, ...]
    undecided: int
    runs: int


class FactorSearch(figures.Stored):
    """The search of a case over a factor on its motion.

    `intervals` are those in which it does not stand, `exceeded` those in which each capacity is
    exceeded, by its name.
    """

    kind: Literal["factors"] = "factors"
    intervals: tuple[FallInterval, ...]
    exceeded: Mapping[str, tuple[FallInterval, ...]] = Field(default_factory=dict)
    undecided: int
    runs: int


class Certainty(figures.Stored):
    """How sure a run is: its numerical uncertainty, and when it depends on the law of impacts.

    `depends_on_law_from_s` (s) is the first landing at which the laws of impacts part. `ties` are
    instants at which the mechanics has more than one answer: what they are, when (s), the fates.
    """

    kind: Literal["certainty"] = "certainty"
    numerical: Numerical | None = None
    depends_on_law_from_s: float | None = None
    ties: tuple[tuple[str, float, tuple[str, ...]], ...] = ()


class Sensitivities(figures.Stored):
    """Sobol indices of the peak rotation by uncertain number, largest total first."""

    kind: Literal["sensitivities"] = "sensitivities"
    indices: tuple[Sensitivity, ...]


class Peaks(figures.Stored):
    """Peak rotations (alpha) at intensities: infinite of a run that overturned, NaN if failed."""

    kind: Literal["peaks"] = "peaks"
    peaks: tuple[float, ...]


Result = Shown | Drawn | GapSearch | FactorSearch | Certainty | Sensitivities | Peaks


def counts_of(outcome: Any) -> dict[str, int]:
    """How many runs of a batch have each fate."""
    numbers = np.bincount(outcome, minlength=len(FATES)).tolist()
    return dict(zip(FATES, numbers, strict=True))
