"""What becomes of many runs: each one is played until nothing can change it, whatever its duration.

A run is a row of numbers in a RunTable: a scene, a motion of the base, factors, gaps. The motion is
played to its own end. Then the base is at rest, until the block overturns, energy proves that it
cannot, it rests, or its swings repeat. What is still open after a thousand times 1/p is UNDECIDED.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.core.names import Keep
from rockcheck.ebm.model import EventBasedModel
from rockcheck.ebm.table import RunTable
from rockcheck.scenes import Floats, progress

__all__ = ["Fates", "Keep", "RunTable", "play_fates"]
#: The codes of `Fates.outcome`; the first four in the order of `scenes.history.OUTCOMES`.
AT_REST, MOVING, OVERTURNED_LEFT, OVERTURNED_RIGHT, UNDECIDED, FAILED = range(6)
_STARTS_INSIDE = "the block would start inside a wall"


@dataclass(frozen=True, kw_only=True)
class Fates:
    """What became of the runs of a table, an entry a row.

    `outcome` is one of the codes above. `time_s` (s) is when that was certain. `peak` (rad) is the
    largest |theta| of the whole motion, pi/2 where the block overturned; both are NaN where a row
    is FAILED, and `reasons` says why, by its number. `extremes`, if kept, has the names of
    `scenes.extremes.Extremes`, SI units, and for each wall names such as `wall_left_speed`; NaN
    where there is none. Of strikes it has the walls alone.
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
    keeps: Keep = Keep.NOTHING,
    jobs: int | None = None,
    on_progress: progress.OnProgress = progress.unheard,
) -> Fates:
    """What becomes of each row of a table.

    A run goes on until its outcome and its peak are certain; where it `keeps` strikes or extremes,
    until none of these can change. `time_s` is then. A run that fails is made once more by
    `model.finer()`. The result of a row depends neither on the other rows nor on `jobs` (threads;
    default: all cores). Raises `InputError` where the model cannot play a scene, and for Bouc-Wen
    friction, whose runs do not know when they are decided.
    """
    from rockcheck.ebm import batch, packing
    from rockcheck.ebm.core.names import FAILURES
    from rockcheck.ebm.core.state import FOUND
    from rockcheck.ebm.extremes import columns_of, strikes_of

    draws, inside = packing.draws_of(table, model), packing.inside_a_wall(table)
    played, count = np.flatnonzero(~inside), len(inside)
    packed = packing.rows_of(table, draws, packing.motions_of(table), played)
    found = batch.run_decided(packed, model, keeps=keeps, jobs=jobs, on_progress=on_progress)
    runs = np.zeros(count, FOUND)
    runs["fate"], runs["t"], runs["peak"] = FAILED, np.nan, np.nan
    runs[played] = found.runs
    reasons = dict.fromkeys(np.flatnonzero(inside).tolist(), _STARTS_INSIDE)
    for row in played[found.failed].tolist():
        reasons[row] = FAILURES[int(runs["ending"][row])]
    failed = runs["fate"] == FAILED
    runs["t"][failed] = runs["peak"][failed] = np.nan
    length, time = draws.length[table.scene], draws.time[table.scene]
    columns: dict[str, Floats] | None = None
    if keeps != Keep.NOTHING:
        setting = packed.given["setting"]
        read = columns_of if keeps == Keep.EXTREMES else strikes_of
        known = read(found.extremes, setting, length[played], time[played])
        columns = {name: np.full(count, np.nan) for name in known}
        for name, column in known.items():
            columns[name][played] = np.where(found.failed, np.nan, column)
    return Fates(
        outcome=runs["fate"].astype(np.int8),
        time_s=runs["t"] * time,
        peak=runs["peak"].copy(),
        extremes=columns,
        reasons=reasons,
    )
