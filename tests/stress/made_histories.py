"""Histories of columns that are made up."""

import numpy as np

from rockcheck import Event, Floor, History, Scene
from rockcheck.scenes import PAPER_BLOCK
from rockcheck.scenes.history import Cost

BLOCK = PAPER_BLOCK
G = 9.81
STANDS = Scene(name="stands", block=BLOCK, floor=Floor(friction=0.3), duration=0.4, output_step=0.1)


def history(t, *, mode="rest", theta=0.0, events=(), outcome="at rest", cost=None, **columns):
    """A history of these columns; numbers do not change, and the rest is zero."""
    t = np.asarray(t, dtype=float)
    names = ("x", "y", "x_dot", "y_dot", "theta_dot", "slip", "slip_rate")
    given = dict.fromkeys(names, 0.0) | {"y": BLOCK.half_height, "theta": theta} | columns
    channels = {
        name: np.broadcast_to(value, t.shape).astype(float) for name, value in given.items()
    }
    return History(
        name="made",
        model="made",
        channels=channels | {"t": t, "mode": np.broadcast_to(mode, t.shape)},
        event_list=tuple(Event(t=t, kind=kind) for t, kind in events),
        outcome=outcome,
        block=BLOCK,
        cost=cost or Cost(),
    )
