"""What the continuous model notes of a run, at places and rates worked out by hand."""

import math

import numpy as np
import pytest

from rockcheck import Block, Event, Floor, History, Scene, Wall
from rockcheck.cm.extremes import (
    FLAT_SHARE,
    extremes_at_start,
    extremes_of,
    note_mode,
    note_place,
)
from rockcheck.scenes import PAPER_BLOCK

B, H = PAPER_BLOCK.half_width, PAPER_BLOCK.half_height
FLAT = 1e-6


def scene(**change):
    given = {"name": "made", "block": PAPER_BLOCK, "floor": Floor(friction=0.5), "duration": 1.0}
    return Scene(**given | change)


def corner(x, y, theta, across, along):
    """A corner at a distance from the box's centre across and along its height, m."""
    return (
        x + across * math.cos(theta) - along * math.sin(theta),
        y + across * math.sin(theta) + along * math.cos(theta),
    )


def noted_of(places, **change):
    """What is noted of places x, y, theta, a second apart."""
    noted = extremes_at_start(scene(**change))
    for t, (x, y, theta) in enumerate(places):
        sides = [corner(0.0, 0.0, theta, across, along) for along in (-H, H) for across in (-B, B)]
        offsets = tuple(value for side in sides for value in side)
        note_place(noted, x, y, theta, float(t), offsets)
    return noted


PLACES = [
    (0.0, H, 0.0),
    (-0.12, H + 0.03, 0.06),
    (-0.30, H + 0.01, 0.04),
    (0.25, H + 0.02, -0.09),
    (0.40, H - 0.01, -0.05),
    (0.05, H, 0.01),
]
#: Of each place its four corners: bottom left, bottom right, top left, top right.
CORNERS = [
    [corner(*place, across, along) for along in (-H, H) for across in (-B, B)] for place in PLACES
]


def test_the_largest_rotation_to_each_side_is_noted_with_its_time():
    noted = noted_of(PLACES)
    assert noted.rotation_left == 0.06
    assert noted.rotation_left_time == 1.0
    assert noted.rotation_right == 0.09
    assert noted.rotation_right_time == 3.0


def test_the_first_of_equal_rotations_is_when_it_was_reached():
    noted = noted_of([(0.0, H, 0.0), (0.0, H, 0.05), (0.0, H, -0.05)] * 2)
    assert noted.rotation_left_time == 1.0
    assert noted.rotation_right_time == 2.0


def test_the_reach_is_that_of_the_corners_of_each_side():
    noted = noted_of(PLACES)
    left = min(min(bottom[0], top[0]) for bottom, _, top, _ in CORNERS)
    right = max(max(bottom[0], top[0]) for _, bottom, _, top in CORNERS)
    assert noted.reach_left == pytest.approx(-left - B)
    assert noted.reach_right == pytest.approx(right - B)


@pytest.mark.parametrize("theta", [0.3, -0.3])
def test_the_bottom_corner_reaches_farthest_of_a_block_that_turns_away(theta):
    (bottom_left, bottom_right, *_) = [
        corner(0.0, H, theta, across, along) for along in (-H, H) for across in (-B, B)
    ]
    noted = noted_of([(0.0, H, theta)])
    if theta > 0.0:
        assert noted.reach_right == pytest.approx(bottom_right[0] - B)
    else:
        assert noted.reach_left == pytest.approx(-bottom_left[0] - B)


def test_the_top_is_displaced_from_its_first_place():
    noted = noted_of(PLACES)
    moved = [
        abs(top[0] - start) for row in CORNERS for top, start in zip(row[2:], (-B, B), strict=True)
    ]
    assert noted.top_displacement == pytest.approx(max(moved))


def test_the_first_place_of_a_tilted_block_s_top_is_its_own():
    tilt = 0.1
    start = scene(initial_rotation=tilt).initial_state
    noted = noted_of([tuple(start[:3])], initial_rotation=tilt)
    assert noted.top_displacement == pytest.approx(0.0, abs=1e-12)
    left, right = (corner(*start[:3], across, H)[0] for across in (-B, B))
    assert noted.top_left == pytest.approx(left)
    assert noted.top_right == pytest.approx(right)


def test_the_lower_corner_hops_and_slips():
    noted = noted_of(PLACES)
    lower = [min((row[0], -B), (row[1], B), key=lambda pair: pair[0][1]) for row in CORNERS]
    assert noted.hop == pytest.approx(max(place[1] for place, _ in lower))
    assert noted.slip == pytest.approx(max(abs(place[0] - first) for place, first in lower))


def noted_modes(rows, **change):
    """Times of the first uplift and the first slip, of rows theta, rate of turning and of slip."""
    noted = extremes_at_start(scene(**change))
    for t, (theta, turning, slipping) in enumerate(rows):
        note_mode(noted, theta, turning, slipping, float(t), FLAT)
    return noted.uplift_time, noted.slip_time


STILL = (0.0, 0.0, 0.0)


def test_what_stands_still_neither_uplifts_nor_slips():
    uplift, slip = noted_modes([STILL, STILL])
    assert math.isnan(uplift)
    assert math.isnan(slip)


@pytest.mark.parametrize("lifted", [(1e-3, 0.0, 0.0), (0.0, 0.1, 0.0), (-1e-3, -0.1, 0.0)])
def test_the_first_uplift_counts(lifted):
    uplift, _ = noted_modes([STILL, lifted, STILL, lifted])
    assert uplift == 1.0


def test_the_first_slip_counts():
    _, slip = noted_modes([STILL, STILL, (0.0, 0.0, -0.1), STILL, (0.0, 0.0, 0.1)])
    assert slip == 2.0


def test_a_block_that_starts_tilted_uplifts_after_it_has_stood():
    tilted = (0.1, 0.0, 0.0)
    uplift, _ = noted_modes([tilted, STILL, tilted], initial_rotation=0.1)
    assert uplift == 2.0


@pytest.mark.parametrize(("share", "stands"), [(0.9, True), (1.1, False)])
def test_a_block_stands_flat_within_a_share_of_its_slenderness(share, stands):
    tilt = share * FLAT_SHARE * PAPER_BLOCK.alpha
    assert extremes_at_start(scene(initial_rotation=tilt)).stood_flat == stands


def test_a_block_that_starts_turning_uplifts_after_it_has_stood():
    turning = (0.0, 0.1, 0.0)
    uplift, _ = noted_modes([turning, STILL, turning], initial_angular_velocity=0.1)
    assert uplift == 2.0


def test_a_block_that_starts_sliding_slips_after_it_has_stuck():
    sliding = (0.0, 0.0, 0.1)
    _, slip = noted_modes([sliding, STILL, sliding], initial_velocity=0.1)
    assert slip == 2.0


def told(strikes=(), *, outcome="moving", events=(), modes=(STILL,), last=(0.0, H, 0.0)):
    """The extremes of a run between two walls that turned by 0.06 and 0.09."""
    walls = [Wall(side="left", gap=1.0), Wall(side="right", gap=1.0)]
    between = scene(walls=walls)
    noted = noted_of(PLACES, walls=walls)
    for t, row in enumerate(modes):
        note_mode(noted, *row, float(t), FLAT)
    t = np.array([0.0, 1.0])
    history = History(
        name="made",
        model="made",
        channels={"t": t, "theta": 0.0 * t},
        event_list=events,
        outcome=outcome,
        block=PAPER_BLOCK,
    )
    return extremes_of(between, noted, np.array([*last, 0.0, 0.0, 0.0]), history, strikes)


def test_strikes_are_counted_by_wall():
    found = told([("left", 0.3, 2.0, 0.5), ("right", 0.4, 1.0, 0.2), ("left", 0.6, 1.5, 0.8)])
    left, right = found.walls["left"], found.walls["right"]
    assert left.strikes == 2
    assert left.first_s == 0.3
    assert left.impulse == 2.0
    assert left.speed == 0.8
    assert right.strikes == 1
    assert right.first_s == 0.4
    assert right.impulse == 1.0
    assert right.speed == 0.2


def test_a_wall_that_is_never_struck_has_no_first_time():
    wall = told().walls["left"]
    assert wall.strikes == 0
    assert wall.first_s is None


def test_what_stands_keeps_its_rotations():
    found = told()
    assert found.rotation_left == 0.06
    assert found.rotation_left_s == 1.0
    assert found.rotation_right == 0.09
    assert found.rotation_right_s == 3.0
    assert found.source == "model"


@pytest.mark.parametrize("side", ["left", "right"])
def test_what_overturns_turns_by_a_quarter_to_that_side(side):
    outcome = f"overturned {side}"
    found = told(outcome=outcome, events=(Event(t=0.7, kind=outcome),))
    other = {"left": ("right", 0.09), "right": ("left", 0.06)}[side]
    assert getattr(found, f"rotation_{side}") == 0.5 * math.pi
    assert getattr(found, f"rotation_{side}_s") == 0.7
    assert getattr(found, f"rotation_{other[0]}") == other[1]


def test_what_never_lifted_nor_slipped_has_no_time():
    found = told()
    assert found.first_uplift_s is None
    assert found.first_slip_s is None


def test_the_times_of_uplift_and_slip_are_told():
    found = told(modes=(STILL, (0.1, 0.0, 0.0), (0.1, 0.0, 0.2)))
    assert found.first_uplift_s == 1.0
    assert found.first_slip_s == 2.0


def test_the_last_slip_is_that_of_the_corner_it_stands_on():
    theta = 0.1
    on_left = corner(0.02, 0.0, theta, B, H)[0]  # the centre, from the left corner
    found = told(last=(on_left - B, 0.0, theta))
    assert found.last_slip == pytest.approx(0.02)


def test_the_mass_s_centre_does_not_change_where_the_box_is():
    block = Block(half_width=B, half_height=H, centre_of_mass=(0.1, 0.2))
    noted = noted_of(PLACES, block=block)
    assert noted.reach_left == pytest.approx(noted_of(PLACES).reach_left)
