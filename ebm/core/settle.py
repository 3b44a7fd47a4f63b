"""The one Zeno rule: impacts that accumulate end in rest.

A contact that is struck more slowly than the *settling speed* stays closed, and a block that lands
with less spin lies flat. A hundred impacts within a short time raise the settling speed tenfold, up
to a bound; after a quiet of that time it falls back. After five hundred times as many impacts, or
too many at one instant, all impacts are plastic. So impacts are finitely many in any finite time.
"""

import numpy as np

from rockcheck.ebm.core.names import Rule
from rockcheck.ebm.core.series import INSTANT
from rockcheck.scenes.compiled import inner_kernel

#: The settling speed, sqrt(g R): 1e-7 rad/s for the paper's block.
SETTLE = 5e-8
# This many impacts within this time raise it tenfold, up to a bound. After as long without impacts
# it falls back. After this many such rises all impacts are plastic.
_IMPACTS, _QUIET, _FASTEST, _TIMES = 100, 2.5e-2, 2.5e-3, 500
#: After this many impacts at one instant the next ones are plastic.
_AT_ONCE = 20


@inner_kernel
def settling_speed(state):
    """The speed below which a contact that is struck now stays closed."""
    t = state.t
    if t - state.last_impact > _QUIET:
        state.settling_speed, state.full = SETTLE, 0
    if t - state.counted_since > _QUIET:
        state.counted_since, state.counted = t, 0
    state.at_once = state.at_once + 1 if t - state.last_impact <= INSTANT else 0
    state.last_impact = t
    state.counted += 1
    if state.counted >= _IMPACTS:
        state.counted = 0
        state.full += 1
        state.rules[Rule.RATTLES] += 1
        raised = min(10.0 * state.settling_speed, _FASTEST)
        state.settling_speed = raised if state.full < _TIMES else np.inf
    if state.at_once >= _AT_ONCE:
        state.rules[Rule.ENDLESS_STAGES] += 1
        return np.inf
    return state.settling_speed
