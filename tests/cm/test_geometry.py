"""Where corners are and how they move, against the scene's kinematics and difference quotients."""

import math

import numpy as np
import pytest
from step_parts import LOADED, free_motion, parameters, step_at

from rockcheck.cm.geometry import (
    FLOOR,
    LEFT_WALL,
    RIGHT_WALL,
    apply_impulse,
    corner_over,
    corners_at,
    facing,
    lever_of,
    lower_corner,
    pair_at,
)

SURFACES = [LEFT_WALL, RIGHT_WALL, FLOOR]


def turned(point, theta):
    s, c = math.sin(theta), math.cos(theta)
    return point[0] * c - point[1] * s, point[0] * s + point[1] * c


@pytest.mark.parametrize("theta", [-0.7, 0.0, 0.4])
def test_corners_are_the_block_turned_about_its_mass(theta):
    block = LOADED.block
    (dx, dz), b, h = block.offset, block.half_width, block.half_height
    standing = [(-b - dx, -h - dz), (b - dx, -h - dz), (-b - dx, h - dz), (b - dx, h - dz)]
    expected = np.ravel([turned(corner, theta) for corner in standing])
    assert corners_at(parameters().reach, theta) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize(
    ("surface", "normal", "first", "second"),
    [
        (LEFT_WALL, (1.0, 0.0), 0, 2),
        (RIGHT_WALL, (-1.0, 0.0), 1, 3),
        (FLOOR, (0.0, 1.0), 0, 1),
    ],
)
def test_each_surface_faces_its_corners(surface, normal, first, second):
    corners = corners_at(parameters().reach, 0.2)
    points = np.reshape(corners, (4, 2)).tolist()
    answer = facing(surface, corners)
    assert answer[0] == normal
    assert list(answer[1]) == points[first]
    assert list(answer[2]) == points[second]


def gap_after(made, step, theta, surface, corner, v, since):
    """Gap of a surface's corner that far from the middle of the step."""
    place, turn = free_motion(step, theta, v, since)
    normal, *offsets = facing(surface, corners_at(made.reach, turn))
    return np.dot(normal, place + offsets[corner]) + made.distance[surface]


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("corner", [0, 1])
def test_gap_and_rates_are_those_of_the_corner(surface, corner):
    made, theta, v0 = parameters(), 0.1, (0.3, -0.4, 1.7)
    step = step_at(made, theta=theta, v0=v0, length=0.01)
    v = (-0.2, 0.5, 1.7)
    _, pair = pair_at(step, v, surface, made.distance[surface], made.inverse_inertia)
    seen = pair[corner]
    assert seen.gap == pytest.approx(gap_after(made, step, theta, surface, corner, v, 0.0))
    # At the ends of the step, whose middle is here: to the second order of half a step.
    for rate, speed, since in ((seen.before, v0, -0.005), (seen.rate, v, 0.005)):
        ends = [
            gap_after(made, step, theta, surface, corner, speed, since + apart)
            for apart in (-1e-6, 1e-6)
        ]
        assert rate == pytest.approx((ends[1] - ends[0]) / 2e-6, abs=1e-4)


@pytest.mark.parametrize("surface", SURFACES)
def test_mobility_is_what_an_impulse_gives(surface):
    made = parameters()
    step, v = step_at(made), (0.1, 0.2, 0.3)
    distance, inverse_inertia = made.distance[surface], made.inverse_inertia
    normal, pair = pair_at(step, v, surface, distance, inverse_inertia)
    struck = apply_impulse(v, inverse_inertia, normal, pair.first.lever, 0.5)
    _, after = pair_at(step, struck, surface, distance, inverse_inertia)
    assert after.first.rate - pair.first.rate == pytest.approx(0.5 * pair.first.mobility)
    assert after.second.rate - pair.second.rate == pytest.approx(0.5 * pair.coupling)


def test_an_impulse_turns_the_block_about_its_inertia():
    block, made = LOADED.block, parameters()
    assert 1.0 / made.inverse_inertia == pytest.approx(block.gyration_squared)
    v = apply_impulse((1.0, 2.0, 3.0), made.inverse_inertia, (0.6, 0.8), -0.4, 0.5)
    assert v == pytest.approx((1.3, 2.4, 3.0 - 0.2 / block.gyration_squared))
    assert lever_of((2.0, 3.0), (0.5, 0.25)) == 2.0 * 0.25 - 3.0 * 0.5


@pytest.mark.parametrize(("theta", "left_is_lower"), [(-0.1, False), (0.1, True)])
def test_the_lower_corner_slips_as_it_moves(theta, left_is_lower):
    made, v = parameters(), (0.2, -0.1, 0.9)
    step = step_at(made, theta=theta, v0=v, length=0.01)
    height, slip = lower_corner(step, v)
    first = 0 if left_is_lower else 2
    assert height == step.corners[first + 1]

    def place(since):
        centre, turn = free_motion(step, theta, v, since)
        return centre[0] + corners_at(made.reach, turn)[first]

    assert slip == pytest.approx((place(0.005 + 1e-6) - place(0.005 - 1e-6)) / 2e-6, abs=1e-4)


def test_a_corner_slips_as_its_offset_turns():
    made = parameters()
    corner = corner_over(step_at(made), (0.5, 0.1, 2.0), (0.0, 1.0), (-0.3, -0.8), 0.9, 3.0)
    assert corner.slip == 0.5 + 2.0 * 0.8
    assert corner.rx == -0.3
    assert corner.ry == -0.8
    assert corner.lever == -0.3
    assert corner.mobility == 1.0 + 3.0 * 0.3 * 0.3
