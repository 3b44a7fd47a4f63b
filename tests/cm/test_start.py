"""How a run begins: at rest where the block stands, and with the scene's own constants."""

import math

import numpy as np
import pytest
from step_parts import LOADED, STIFFNESS, G, parameters, state_of

from rockcheck import Block, Floor, Wall
from rockcheck.cm.contact_law import damping_ratio, damping_ratio_of_paper, least_restitution
from rockcheck.cm.geometry import FLOOR, LEFT_WALL, RIGHT_WALL, corners_at
from rockcheck.cm.start import parameters_of
from rockcheck.scenes import kinematics

PLAIN = LOADED.replace(block=Block(half_width=0.3, half_height=1.0))


def weights(scene):
    """What both floor contacts push with at the start, m/s^2: by their depths."""
    state, made = state_of(scene), parameters(scene)
    corners = corners_at(made.reach, state.motion.theta)
    gaps = state.motion.y + np.array([corners[1], corners[3]])
    return -STIFFNESS * gaps * state.contacts["closed"][FLOOR], corners


BESIDE = Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.08, 0.0))


@pytest.mark.parametrize(
    "block", [PLAIN.block, LOADED.block, BESIDE], ids=["plain", "loaded", "loaded at half height"]
)
def test_a_standing_block_is_in_balance(block):
    forces, corners = weights(LOADED.replace(block=block))
    assert np.sum(forces) == pytest.approx(G, rel=1e-6)
    assert forces @ [corners[0], corners[2]] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("tilt", "closed"), [(0.1, [True, False]), (-0.1, [False, True])])
def test_a_tilted_block_stands_on_its_lower_corner(tilt, closed):
    scene = PLAIN.replace(walls=[], initial_rotation=tilt)
    assert state_of(scene).contacts["closed"][FLOOR].tolist() == closed
    assert np.sum(weights(scene)[0]) == pytest.approx(G, rel=1e-6)


def test_a_block_in_the_air_touches_nothing():
    state = state_of(PLAIN.replace(initial_height=1e-6))
    assert not np.any(state.contacts["closed"])
    assert state.motion.y == 1.0 + 1e-6


def test_the_motion_is_that_of_the_mass():
    scene = LOADED.replace(walls=[], initial_rotation=0.1, initial_angular_velocity=-0.3)
    state = state_of(scene)
    expected = kinematics.of_mass(scene.block, scene.initial_state)
    expected[1] -= G / STIFFNESS
    assert state.motion.item() == pytest.approx(tuple(expected), rel=1e-14)
    assert state.past_motion == state.motion


def test_contacts_begin_without_a_strike_as_the_scene_is_damped():
    state, made = state_of(), parameters()
    assert np.all(state.contacts["strike_time"] == math.inf)
    assert np.all(state.contacts["last_closed"] == -math.inf)
    assert np.all(state.contacts["stiffness"] == STIFFNESS)
    for surface in (LEFT_WALL, RIGHT_WALL, FLOOR):
        expected = 2e4 * made.damping_ratio[surface]
        assert state.contacts["damping"][surface].tolist() == [expected, expected]


@pytest.mark.parametrize(
    ("gap", "velocity", "touched"),
    [
        (0.0, 0.0, True),
        (0.5e-9, 0.0, True),
        (2e-9, 0.0, False),
        (0.0, -0.5, False),
        (0.0, 0.5, True),
    ],
    ids=["touches", "as good as touches", "is apart", "strikes", "leaves"],
)
def test_a_wall_that_is_touched_is_not_struck(gap, velocity, touched):
    scene = PLAIN.replace(walls=[Wall(side="left", gap=gap)], initial_velocity=velocity)
    last_closed = state_of(scene).contacts["last_closed"]
    expected = 0.0 if touched else -math.inf
    assert last_closed[LEFT_WALL].tolist() == [expected, expected]
    assert np.all(last_closed[RIGHT_WALL] == -math.inf)


def test_constants_are_the_scenes():
    made = parameters()
    assert made.distance == (0.32, 0.37, 0.0)
    assert made.restitution == (0.5, 0.75, 0.25)
    assert made.mu_s == 0.4
    assert made.mu_k == 0.3
    assert made.gravity == G
    assert made.friction_damping == 1e5 * 1e4
    assert made.flat_angle == 1e-4 * LOADED.block.alpha
    assert made.surfaces.tolist() == [LEFT_WALL, RIGHT_WALL, FLOOR]


def test_the_inertia_is_the_blocks_where_it_is_given():
    block = Block(half_width=0.3, half_height=1.0, moment_of_inertia=0.2)
    made = parameters(PLAIN.replace(block=block))
    assert made.inverse_inertia == pytest.approx(1.0 / block.gyration_squared)
    assert made.inverse_inertia != pytest.approx(3.0 / (0.09 + 1.0))


def test_a_scene_without_walls_has_the_floor_alone():
    made = parameters(PLAIN.replace(walls=[]))
    assert made.surfaces.tolist() == [FLOOR]
    assert made.distance == (math.inf, math.inf, 0.0)
    assert made.inverse_inertia == 3.0 / (0.09 + 1.0)


@pytest.mark.parametrize("restitution", [0.0, 0.25])
def test_damping_is_calibrated_or_the_papers(restitution):
    scene = PLAIN.replace(floor=Floor(friction=0.3, restitution=restitution))
    least = least_restitution(STIFFNESS, scene.frequency_parameter)
    calibrated, paper = (
        parameters_of(scene, STIFFNESS, 1e-4, rule).damping_ratio for rule in (True, False)
    )
    assert calibrated[FLOOR] == damping_ratio(restitution, least)
    assert paper[FLOOR] == damping_ratio_of_paper(restitution)


def test_the_energy_allowed_is_that_of_the_start():
    scene = PLAIN.replace(walls=[], initial_velocity=2.0)
    state = state_of(scene)
    assert state.allowed_energy == pytest.approx(2.0)
    assert state.absolute_work == pytest.approx(2.0 + 0.01 * G * 0.3)
    assert state.grid == 1
    assert state.steps == 0
    assert state.sweeps == 0
    assert state.contact_step == math.inf
    assert state.first_strike == math.inf
