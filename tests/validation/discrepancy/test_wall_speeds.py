"""Speeds at walls and reach of histories whose extremes lie between rows."""

import numpy as np
import pytest

from rockcheck import Block, Event, Wall, load_scene
from rockcheck.validation.discrepancy.compare import largest_reach, wall_speeds


@pytest.mark.parametrize(
    ("before", "at", "speed", "near", "turn"),
    [
        (None, 0.3, 0.4, {}, 0.0),
        (0.15, 0.3, 0.3, {}, 0.0),
        (None, 0.05, 0.1, {}, 0.0),
        (None, 1e-12, 0.1, {}, 0.0),
        (None, 0.3, 0.4, {"right": 1e-3}, 0.0),
        (None, 0.3, 1e-5, {}, 1e-5),
    ],
)
def test_the_speed_at_the_wall_is_carried_on_over_no_other_event(
    made, before, at, speed, near, turn
):
    """From rows 0.1 s apart to the event 0.1 s after the last, 0.1 m/s more a row; an event between
    the rows has changed the speed, so the last one stands, as does the first row's where there is
    no other. The wall is on the left. One on the right may be nearer in the last row, but it is not
    struck; a block that turns upright until the event strikes with its top."""
    history = made(
        turn * (0.1 * np.arange(4) - 0.25),
        t=0.1 * np.arange(4),
        x_dot=np.array([-0.1, -0.2, -0.3, 0.2]) * (turn == 0.0),
        theta_dot=np.full(4, turn),
        events=[Event(t=t, kind=kind) for t, kind in ((before, "slip"), (at, "wall impact")) if t],
    )
    scene = load_scene("fig5a").replace(
        block=Block(half_width=0.3, half_height=1.0),
        walls=[Wall(side=side, gap=gap) for side, gap in {"left": 0.03, **near}.items()],
    )
    assert [*wall_speeds(history, scene)] == [(pytest.approx(speed), "left")]


def test_rounding_is_no_reach(made):
    history = made(np.full(4, 1e-17), t=0.1 * np.arange(4))
    assert largest_reach(history, load_scene("fig5a"), "left") == 0.0
