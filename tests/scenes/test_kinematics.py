"""Where a block's corners are and how they move, from its box turned by hand; what is observed."""

import math

import numpy as np
import pytest

from rockcheck import Block, Event, Floor, Record, Rest, Scene, Wall
from rockcheck.scenes import kinematics, observation

BLOCK = Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.08, -0.2), moment_of_inertia=0.3)
#: x, y and theta of the box's centre, and their rates.
STATES = [(0.2, 1.1, 0.15, 0.4, -0.3, 0.7), (-0.1, 0.9, -0.25, -0.2, 0.5, -0.9)]


def corner(state, bx, bz, since=0.0):
    """Where a point of the box is that far on, at constant rates."""
    x, y, theta, x_dot, y_dot, w = state
    turned = theta + since * w
    return np.array(
        [
            x + since * x_dot + bx * math.cos(turned) - bz * math.sin(turned),
            y + since * y_dot + bx * math.sin(turned) + bz * math.cos(turned),
        ]
    )


def velocity(state, bx, bz):
    return (corner(state, bx, bz, 1e-6) - corner(state, bx, bz, -1e-6)) / 2e-6


def lower(state):
    """The lower corner: the left one of a block that is turned to the left."""
    return (-0.3 if state[2] > 0.0 else 0.3), -1.0


@pytest.mark.parametrize("state", STATES)
def test_a_slip_is_how_far_the_lower_corner_has_come(state):
    bx, bz = lower(state)
    x, _, theta, x_dot, _, w = state
    assert kinematics.slip(BLOCK, x, theta) == pytest.approx(corner(state, bx, bz)[0] - bx)
    assert kinematics.slip_rate(BLOCK, theta, x_dot, w) == pytest.approx(velocity(state, bx, bz)[0])


@pytest.mark.parametrize("state", STATES)
def test_the_height_of_the_pivot_is_that_of_the_lower_corner(state):
    _, y, theta, *_ = state
    expected = corner(state, *lower(state))[1]
    assert kinematics.pivot_height(BLOCK, y, theta) == pytest.approx(expected)


CORNERS = [(-0.3, -1.0), (0.3, -1.0), (-0.3, 1.0), (0.3, 1.0)]


@pytest.mark.parametrize("state", STATES)
def test_a_clearance_is_that_of_the_farthest_corner(state):
    places = [corner(state, *each)[0] for each in CORNERS]
    x, _, theta, *_ = state
    left = kinematics.clearance(BLOCK, "left", 0.5, x, theta)
    right = kinematics.clearance(BLOCK, "right", 0.5, x, theta)
    assert left == pytest.approx(min(places) + 0.8)
    assert right == pytest.approx(0.8 - max(places))


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize(("side", "out"), [("left", -1.0), ("right", 1.0)])
def test_corners_of_a_side_are_apart_from_its_wall_and_come_nearer(state, side, out):
    x, _, theta, x_dot, _, w = state
    found = kinematics.side_corners(BLOCK, side, 0.5, x, theta, x_dot, w)
    for (away, toward), bz in zip(found, (-1.0, 1.0), strict=True):
        assert away == pytest.approx(0.8 - out * corner(state, out * 0.3, bz)[0])
        assert toward == pytest.approx(out * velocity(state, out * 0.3, bz)[0])


@pytest.mark.parametrize("state", STATES)
def test_top_corners_are_where_the_turned_box_has_them(state):
    expected = [corner(state, bx, 1.0)[0] for bx in (-0.3, 0.3)]
    assert kinematics.top_corners(BLOCK, state[0], state[2]) == pytest.approx(expected)


@pytest.mark.parametrize("state", STATES)
def test_the_mass_moves_as_a_point_of_the_box(state):
    found = kinematics.of_mass(BLOCK, state)
    assert found[:2] == pytest.approx(corner(state, 0.08, -0.2))
    assert found[3:5] == pytest.approx(velocity(state, 0.08, -0.2))
    assert found[[2, 5]].tolist() == [state[2], state[5]]
    assert kinematics.of_box(BLOCK, found) == pytest.approx(state)


@pytest.mark.parametrize("state", STATES)
def test_energy_is_that_of_the_mass(state):
    """From standing still, where the mass is 0.8 m above the floor."""
    _, y, theta, x_dot, y_dot, w = state
    vx, vy = velocity(state, 0.08, -0.2)
    expected = 0.5 * (vx**2 + vy**2 + 0.3 * w**2) + 10.0 * (corner(state, 0.08, -0.2)[1] - 0.8)
    found = kinematics.energy(BLOCK, 10.0, y, theta, x_dot, y_dot, w)
    assert found == pytest.approx(expected)


def test_a_homogeneous_block_has_its_mass_in_the_middle():
    plain = Block(half_width=0.3, half_height=1.0)
    assert kinematics.mass_motion(plain, 1.1, 0.2, 0.4, -0.3, 0.7) == (1.1, 0.4, -0.3)
    assert kinematics.energy(plain, 10.0, 1.2, 0.2, 0.4, 0.0, 0.0) == pytest.approx(2.08)


# What a run shows

SCENE = Scene(
    name="seen",
    block=Block(half_width=0.3, half_height=1.0),
    floor=Floor(friction=0.5),
    duration=0.4,
    output_step=0.1,
)
FLAT = (0.0, 1.0, 0.0, 0.0, 0.0, 0.0)


def mode(x=0.0, up=0.0, theta=0.0, x_dot=0.0, w=0.0, walls=()):
    """The mode of a block whose lower corner is that far above the floor."""
    scene = SCENE.replace(walls=walls)
    y = math.hypot(0.3, 1.0) * math.cos(math.atan(0.3) - abs(theta)) + up
    slip_rate = kinematics.slip_rate(scene.block, theta, x_dot, w)
    values = {"x": x, "y": y, "theta": theta, "theta_dot": w, "slip_rate": slip_rate}
    channels = {name: np.array([value]) for name, value in values.items()}
    return str(observation.modes_of(scene, channels)[0])


BESIDE = (Wall(side="left", gap=0.2),)
#: Where a block that is turned by 0.1 touches the wall with its upper corner.
AT_WALL = 0.3 * math.cos(0.1) + math.sin(0.1) - 0.5


@pytest.mark.parametrize(
    ("motion", "expected"),
    [
        ({}, "rest"),
        ({"x_dot": 0.9e-3}, "rest"),
        ({"x_dot": 1.1e-3}, "slide"),
        ({"up": 1.1e-5}, "flight"),
        ({"up": 0.9e-5}, "rest"),
        ({"theta": 0.9e-4 * math.atan(0.3)}, "rest"),
        ({"theta": 1.1e-4 * math.atan(0.3)}, "rock"),
        ({"theta": 0.1}, "rock"),
        ({"theta": 0.1, "x_dot": 0.1}, "slide-rock"),
        ({"theta": 0.1, "x": AT_WALL, "walls": BESIDE}, "lean"),
        ({"theta": 0.1, "x": AT_WALL + 1.1e-5, "walls": BESIDE}, "rock"),
        ({"theta": 0.1, "x": AT_WALL, "x_dot": 0.1, "walls": BESIDE}, "ladder"),
        ({"w": 1.1e-3, "x_dot": -1.1e-3}, "rock"),
    ],
)
def test_modes_follow_from_the_motion(motion, expected):
    assert mode(**motion) == expected


def observed(rows, **more):
    return observation.observe(SCENE, "made", np.array(rows, dtype=float), **more)


def test_a_run_of_all_rows_is_kept_whole():
    history = observed([FLAT] * 5)
    assert history.channels["t"] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
    assert history.outcome == "at rest"
    assert history.channels["mode"].tolist() == ["rest"] * 5


def test_a_row_at_the_end_that_is_off_the_grid_is_not_shown():
    """Of 0.38 s, with a row each 0.1 s."""
    scene = SCENE.replace(duration=0.38)
    ends = (0.0, 0.3, 1.54, 0.0, 0.0, 0.1)
    history = observation.observe(scene, "made", np.array([FLAT] * 4 + [ends]))
    assert history.channels["t"] == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert history.channels["theta"][-1] == 0.0
    assert history.outcome == "moving"


def test_a_row_at_a_right_angle_is_left_out():
    rows = [FLAT, (0.0, 1.0, math.pi / 2.0, 0.0, 0.0, 1.0)]
    history = observed(rows, events=[Event(t=0.1, kind="overturned left")])
    assert len(history.channels["t"]) == 1


def test_rows_from_a_right_angle_on_are_left_out():
    rows = [FLAT, (0.0, 1.0, 1.5, 0.0, 0.0, 1.0), (0.0, 1.0, 1.6, 0.0, 0.0, 1.0)]
    down = [Event(t=0.15, kind="overturned left")]
    history = observed(rows, events=down)
    assert len(history.channels["t"]) == 2
    assert history.outcome == "overturned left"


def test_a_fall_without_its_event_is_a_mistake_of_the_model():
    with pytest.raises(ValueError, match="must report the event"):
        observed([FLAT, (0.0, 1.0, 1.6, 0.0, 0.0, 1.0)])


def test_what_still_falls_at_the_end_moves():
    """It has turned by more than 1.52 rad, and turns on; or stands still there."""
    falls = (0.0, 0.3, 1.54, 0.0, 0.0, 0.1)
    assert observed([FLAT] * 4 + [falls]).outcome == "moving"
    lies = (0.0, 0.3, 1.54, 0.0, 0.0, 0.0)
    assert observed([FLAT] * 4 + [lies]).outcome == "overturned left"


def notes(**change):
    return observation.scene_notes(SCENE.replace(**change))


@pytest.mark.parametrize(("half_height", "count"), [(50.0, 0), (50.1, 1)])
def test_a_block_larger_than_a_hundred_metres_may_be_in_millimetres(half_height, count):
    assert len(notes(block=Block(half_width=1.0, half_height=half_height))) == count


@pytest.mark.parametrize(("samples", "count"), [(3, 1), (5, 0), (9, 0)])
def test_a_record_that_ends_before_its_scene_is_told(samples, count):
    short = Record.from_samples([1.0] * samples, 0.1)
    assert len(notes(excitation=short)) == count
    found = notes(excitation=Rest(), vertical=short)
    assert len(found) == count
    assert all("the vertical record ends at 0.2 s" in note for note in found)
