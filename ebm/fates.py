"""What becomes of many runs: each one is played until nothing can change it, whatever its duration.

A run is a row of numbers in a RunTable: a scene, a motion of the base, factors, gaps. The motion is
played to its own end. Then the base is at rest, until the block overturns, energy proves that it
cannot, it rests, or its swings repeat. What is still open after a thousand times 1/p is UNDECIDED.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.model import EventBasedModel
from rockcheck.ebm.table import RunTable
from rockcheck.scenes import Floats, progress

__all__ = ["Fates", "RunTable", "play_fates"]
#: The codes of `Fates.outcome`; the first four in the order of `scenes.history.OUTCOMES`.
AT_REST, MOVING, OVERTURNED_LEFT, OVERTURNED_RIGHT, UNDECIDED, FAILED = range(6)
#: Rows that are packed at once.
_ROWS = 65_536
_STARTS_INSIDE = "the block would start inside a wall"


@dataclass(frozen=True, kw_only=True)
class Fates:
    """What became of the runs of a table, an entry a row.

    `outcome` is one of the codes above. `time_s` (s) is when that was certain. `peak` (rad) is the
    largest |theta| of the whole motion, pi/2 where the block overturned. `extremes`, if asked for,
    has the names of `scenes.extremes.Extremes`, SI units, and for each wall names such as
    `wall_left_speed`; NaN where there is none. `reasons` says why a row is FAILED, by its number.
    """

    outcome: NDArray[np.int8]
    time_s: Floats
    peak: Floats
    extremes: Mapping[str, Floats] | None = None
    reasons: Mapping[int, str] = field(default_factory=dict)

    @property
    def overturned(self) -> NDArray[np.bool_]:
        """Which runs overturn."""
        return np.isin(self.outcome, (OVERTURNED_LEFT, OVERTURNED_RIGHT))


def play_fates(
    table: RunTable,
    model: EventBasedModel,
    *,
    jobs: int | None = None,
    on_progress: progress.OnProgress = progress.unheard,
) -> Fates:
    """What becomes of each row of a table.

    A run that fails is made once more by `model.finer()`. The result of a row depends neither on
    the other rows nor on `jobs` (threads; default: all cores). Raises `InputError` where the model
    cannot play a scene, and for Bouc-Wen friction, which has no decision.
    """
    from rockcheck.ebm import batch, packing
    from rockcheck.ebm.core.names import FAILURES
    from rockcheck.ebm.core.state import FOUND

    draws, motions = packing.draws_of(table, model), packing.motions_of(table)
    inside = packing.inside_a_wall(table)
    count = len(table.scene)
    runs = np.zeros(count, FOUND)
    runs["fate"], runs["t"], runs["peak"] = FAILED, np.nan, np.nan
    play = np.flatnonzero(~inside)
    for first in range(0, len(play), _ROWS):
        which = play[first : first + _ROWS]
        packed = packing.rows_of(table, draws, motions, which)
        tell = partial(_tell, on_progress, first, count)
        runs[which] = batch.run_decided(packed, model, jobs=jobs, on_progress=tell).runs
    reasons = dict.fromkeys(np.flatnonzero(inside).tolist(), _STARTS_INSIDE)
    for row in np.flatnonzero((runs["fate"] == FAILED) & ~inside).tolist():
        reasons[row] = FAILURES[int(runs["ending"][row])]
    return Fates(
        outcome=runs["fate"].astype(np.int8),
        time_s=runs["t"] * draws.time[table.scene],
        peak=runs["peak"].copy(),
        reasons=reasons,
    )


def _tell(
    on_progress: progress.OnProgress,
    before: int,
    count: int,
    done: float,
    total: float,
    what: str = "",
) -> None:
    """Tells how many of all rows are done, where some were done before these."""
    on_progress(before + done, count)
