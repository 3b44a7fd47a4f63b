"""The one Zeno rule: impacts that accumulate end in rest.

A contact that is struck more slowly than the *settling speed* stays closed, and a block that lands
with less spin lies flat. A hundred impacts within a short time raise the settling speed tenfold, up
to a bound; after a quiet of that time it falls back. After five hundred times as many impacts, or
too many at one instant, all impacts are plastic. So impacts are finitely many in any finite time.
"""

from __future__ import annotations

import numpy as np

from rockcheck.ebm.core.rules import ENDLESS_STAGES, RATTLES
from rockcheck.ebm.core.series import INSTANT
from rockcheck.scenes.compiled import inner_kernel

#: The settling speed, sqrt(g R): 1e-7 rad/s for the paper's block.
SETTLE = 5e-8
# This many impacts within this time raise it tenfold, up to a bound. After a quiet of that time it
# falls back. After this many such rises all impacts are plastic.
_IMPACTS, _QUIET, _FASTEST, _TIMES = 100, 2.5e-2, 2.5e-3, 500
#: After this many impacts at one instant the next ones are plastic.
_AT_ONCE = 20
_SPEED, _SINCE, _LAST, _COUNT, _FULL, _SAME = range(6)


@inner_kernel
def no_impacts(rattle):
    """Begins the memory: the settling speed, when the count began, the last impact, the count, how
    often it was full, at once."""
    rattle[:] = 0.0
    rattle[_SPEED], rattle[_SINCE], rattle[_LAST] = SETTLE, -1.0, -1.0


@inner_kernel
def settling_speed(rattle, t, rules):
    """The speed below which a contact that is struck at time t stays closed."""
    if t - rattle[_LAST] > _QUIET:
        rattle[_SPEED], rattle[_FULL] = SETTLE, 0.0
    if t - rattle[_SINCE] > _QUIET:
        rattle[_SINCE], rattle[_COUNT] = t, 0.0
    rattle[_SAME] = rattle[_SAME] + 1.0 if t - rattle[_LAST] <= INSTANT else 0.0
    rattle[_LAST] = t
    rattle[_COUNT] += 1.0
    if rattle[_COUNT] >= _IMPACTS:
        rattle[_COUNT] = 0.0
        rattle[_FULL] += 1.0
        rules[RATTLES] += 1
        rattle[_SPEED] = min(10.0 * rattle[_SPEED], _FASTEST) if rattle[_FULL] < _TIMES else np.inf
    if rattle[_SAME] >= _AT_ONCE:
        rules[ENDLESS_STAGES] += 1
        return np.inf
    return rattle[_SPEED]
