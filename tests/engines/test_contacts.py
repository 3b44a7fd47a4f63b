"""The contacts of a scene, and the base motion as engines feel it, by hand."""

import math

import numpy as np
import pytest

from rockcheck import Block, Cosine, Floor, HalfSine, Record, Rest, Scene, Sine, Wall
from rockcheck.engines import base_motion, contacts

SCENE = Scene(
    name="contacts",
    block=Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.1, -0.2)),
    floor=Floor(friction=0.5),
    walls=[
        Wall(side="left", gap=0.05, restitution=0.0),
        Wall(side="right", gap=0.07, restitution=0.25),
    ],
    duration=1.0,
)
LOWER_LEFT, LOWER_RIGHT = (-0.4, -0.8), (0.2, -0.8)
UPPER_LEFT, UPPER_RIGHT = (-0.4, 1.2), (0.2, 1.2)

# Contacts


def test_each_surface_meets_the_corners_that_face_it():
    found = [(c.surface, c.corner) for c in contacts.contacts_of(SCENE)]
    expected = [
        ("floor", LOWER_LEFT),
        ("floor", LOWER_RIGHT),
        ("left", LOWER_LEFT),
        ("left", UPPER_LEFT),
        ("right", LOWER_RIGHT),
        ("right", UPPER_RIGHT),
    ]
    assert [surface for surface, _ in found] == [surface for surface, _ in expected]
    assert np.array([corner for _, corner in found]) == pytest.approx(
        np.array([corner for _, corner in expected])
    )


def test_surfaces_have_their_normal_and_their_distance_from_the_foot():
    floor, left, right = contacts.surfaces_of(SCENE)
    assert (floor.normal, floor.distance) == ((0.0, 1.0), 0.0)
    assert left.normal == (1.0, 0.0)
    assert left.distance == pytest.approx(0.35)
    assert right.normal == (-1.0, 0.0)
    assert right.distance == pytest.approx(0.37)


def test_walls_are_smooth():
    assert [surface.friction for surface in contacts.surfaces_of(SCENE)] == [0.5, 0.0, 0.0]


def test_a_slab_lies_behind_its_surface():
    floor, left, right = contacts.surfaces_of(SCENE)
    assert floor.behind(0.5) == pytest.approx((0.0, -0.5))
    assert left.behind(0.5) == pytest.approx((-0.85, 0.0))
    assert right.behind(0.5) == pytest.approx((0.87, 0.0))


def test_a_slab_is_thick_along_its_normal():
    floor, left, _ = contacts.surfaces_of(SCENE)
    assert floor.extent(1.0, 9.0) == (9.0, 9.0, 1.0)
    assert left.extent(1.0, 9.0) == (1.0, 9.0, 9.0)


def test_a_corner_that_touches_two_surfaces_is_one():
    assert len(contacts.corners_of(SCENE)) == 4
    assert len(contacts.corners_of(SCENE.replace(walls=()))) == 2


@pytest.mark.parametrize(
    ("floor", "wall", "any_of_them"),
    [(0.0, 0.0, False), (0.5, 0.0, True), (0.0, 0.5, True)],
)
def test_a_scene_rebounds_where_any_surface_does(floor, wall, any_of_them):
    scene = SCENE.replace(
        floor=Floor(friction=0.5, restitution=floor),
        walls=[Wall(side="left", gap=0.0, restitution=wall)],
    )
    assert contacts.rebounds(scene) == any_of_them


@pytest.mark.parametrize(
    ("alpha", "least", "count"), [(0.1, 50, 600), (0.1, 700, 700), (0.01, 50, 10_000)]
)
def test_slender_blocks_take_more_sweeps(alpha, least, count):
    block = Block(half_width=math.sin(alpha), half_height=math.cos(alpha))
    assert contacts.sweeps(block, least) == pytest.approx(count, abs=1)


# Base motion


def velocities(excitation, times):
    velocity = base_motion.velocity_of(excitation)
    return [base_motion.velocity_at(t, *velocity) for t in times]


def test_a_base_at_rest_stands():
    assert velocities(Rest(), [0.0, 1.0]) == [0.0, 0.0]


def test_a_record_of_one_sample_moves_nothing():
    assert velocities(Record.from_samples([3.0], 0.1), [0.0, 0.05, 1.0]) == [0.0, 0.0, 0.0]


def test_the_velocity_of_a_record_is_the_integral_of_its_lines():
    """From 1 to 3 m/s^2 in half a second, and to -1 in another."""
    found = velocities(Record.from_samples([1.0, 3.0, -1.0], 0.5), [0.0, 0.25, 0.5, 0.75, 1.0, 9.0])
    assert found == pytest.approx([0.0, 0.375, 1.0, 1.5, 1.5, 1.5])


def test_the_velocity_of_a_pulse_is_its_integral():
    """2 T/(2 pi) (1 - cos(2 pi t/T)) for an amplitude of 2."""
    times = np.array([0.0, 0.123, 0.35, 0.7, 2.0])
    expected = 1.4 / (2.0 * math.pi) * (1.0 - np.cos(2.0 * math.pi * np.minimum(times, 0.7) / 0.7))
    assert velocities(Sine(amplitude=2.0, period=0.7), times) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    "excitation",
    [Rest(), Sine(amplitude=2.0, period=0.7), Record.from_samples([1.0, 3.0, -1.0], 0.3)],
    ids=["rest", "sine", "record"],
)
def test_velocities_at_many_times_are_those_one_by_one(excitation):
    times = np.arange(0.0, 1.5, 0.0013)
    found = base_motion.velocities_at(times, base_motion.velocity_of(excitation))
    np.testing.assert_array_equal(found, velocities(excitation, times.tolist()))


def test_a_pulse_that_ends_between_two_samples_ends_there():
    """Half a sine of 0.7 s leaves a velocity of 2 times its duration over pi."""
    (last,) = velocities(HalfSine(amplitude=2.0, period=1.4), [5.0])
    assert last == pytest.approx(2.0 * 2.0 * 0.7 / math.pi, abs=1e-9)


def starts(samples, vertical=(0.0, 0.0), friction=0.4):
    scene = SCENE.replace(
        block=Block(half_width=0.3, half_height=1.0),
        floor=Floor(friction=friction),
        excitation=Record.from_samples(samples, 1.0),
        vertical=Record.from_samples(vertical, 1.0),
        gravity=10.0,
    )
    base = [base_motion.velocity_of(one) for one in (scene.excitation, scene.vertical)]
    return base_motion.starts_of_motion(scene, *base)


def test_a_block_may_move_where_the_base_reaches_friction_or_slope():
    """A ramp to 8 m/s^2 in 1 s passes 3 m/s^2, the slope's, and 4, that of friction."""
    assert starts([0.0, 8.0]) == pytest.approx([0.375, 0.5])


def test_it_may_stop_where_the_base_falls_below_them_on_either_side():
    assert starts([0.0, -8.0, 0.0]) == pytest.approx([0.375, 0.5, 1.5, 1.625])


def test_a_base_that_rises_holds_the_block():
    """With 2 m/s^2 up the limits are those of 12 m/s^2."""
    assert starts([0.0, 8.0], vertical=(2.0, 2.0)) == pytest.approx([0.45, 0.6])


def test_a_weak_base_moves_nothing():
    assert starts([0.0, 2.9, 0.0]) == []


def test_both_corners_of_a_loaded_block_have_a_limit():
    """Its slopes are 0.2/0.8 and 0.4/0.8, its friction 0.6: 2.5, 5 and 6 m/s^2."""
    ramp = Record.from_samples([0.0, 10.0], 1.0)
    scene = SCENE.replace(excitation=ramp, gravity=10.0, floor=Floor(friction=0.6))
    base = base_motion.velocity_of(scene.excitation)
    assert base_motion.starts_of_motion(scene, base) == pytest.approx([0.25, 0.5, 0.6])


def test_a_base_that_stays_beyond_a_limit_starts_nothing_anew():
    """It passes 3 m/s^2 once, and 4 after a sample of 3.5."""
    assert starts([0.0, 3.5, 8.0]) == pytest.approx([3.0 / 3.5, 1.0 + 0.5 / 4.5])


@pytest.mark.parametrize("period", [0.3, 0.6, 0.7, 1.1, 1.9, 2.3])
def test_a_pulse_that_ends_with_a_jump_ends_with_it(period):
    """Whole cycles of a cosine leave no velocity, however their end is rounded."""
    (last,) = velocities(Cosine(amplitude=2.0, period=period, cycles=3), [99.0])
    assert last == pytest.approx(0.0, abs=1e-9)
