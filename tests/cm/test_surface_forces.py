"""The forces of one surface, and of several in turn."""

import math

import numpy as np
import pytest
from step_parts import LOADED, STIFFNESS, G, parameters, state_of, step_at

from rockcheck import Wall
from rockcheck.cm.contact_law import felt_share
from rockcheck.cm.geometry import (
    FLOOR,
    LEFT_WALL,
    RIGHT_WALL,
    Corner,
    apply_impulse,
    corners_at,
    pair_at,
)
from rockcheck.cm.impacts import closing_time
from rockcheck.cm.surface_forces import (
    apply_surfaces,
    push,
    surface_force,
    walls_push,
    with_forces,
)

LENGTH = 1e-4
OTHER = Corner(0.2, -0.9, 0.2, 1.5, 0.1, 0.0, 0.0, 0.0)


def corner(gap, rate, before=0.0):
    return Corner(0.2, -0.9, 0.2, 1.8, gap, before, rate, 0.0)


def pushed(gap, rate, *, closed, lookahead=0.0, before=0.0, last_closed=-5.0):
    """The contact after a step, and what it does in it."""
    made, contact = parameters(), state_of().contacts[LEFT_WALL, 0]
    contact.closed, contact.last_closed = closed, last_closed
    contact.stiffness, contact.damping = 2.0 * STIFFNESS, 300.0
    comes = corner(gap, rate, before)
    step = step_at(made, length=LENGTH)
    return contact, push(contact, made, step, LEFT_WALL, comes, OTHER, 0.4, lookahead)


# One contact


@pytest.mark.parametrize("lookahead", [0.0, LENGTH])
def test_a_closed_contact_has_the_force_of_spring_and_damper(lookahead):
    gap, rate, before = -3e-7, 2e-4, -1e-4
    contact, (force, loss, length) = pushed(
        gap, rate, closed=True, lookahead=lookahead, before=before
    )
    share = felt_share(300.0 * 1.8 * LENGTH)
    felt = before + share * (rate - before)
    expected = -2.0 * STIFFNESS * (gap + lookahead * rate) - 300.0 * felt
    assert force == pytest.approx(expected, rel=1e-12)
    assert loss == pytest.approx(LENGTH * (share * 300.0 + 2.0 * STIFFNESS * lookahead), rel=1e-12)
    assert length == math.inf
    assert contact.closed


@pytest.mark.parametrize(
    ("gap", "rate", "lookahead", "stays"),
    [
        (1e-8, -2e-4, LENGTH, True),
        (1e-8, -2e-4, 0.0, False),
        (1e-8, -0.5e-4, LENGTH, False),
        (-1e-12, 1.0, LENGTH, True),
        (1e-12, 0.0, 0.0, False),
    ],
    ids=["settled", "young", "slow", "overlaps", "opens"],
)
def test_a_settled_contact_stays_closed_where_it_would_close_within_the_step(
    gap, rate, lookahead, stays
):
    contact, answer = pushed(gap, rate, closed=True, lookahead=lookahead)
    assert contact.closed == stays
    if not stays:
        assert answer == (0.0, 0.0, math.inf)
        assert contact.last_closed == 1.0


@pytest.mark.parametrize("lookahead", [0.0, LENGTH])
def test_an_open_contact_closes_only_where_it_overlaps(lookahead):
    contact, answer = pushed(1e-9, -1.0, closed=False, lookahead=lookahead)
    assert not contact.closed
    assert answer == (0.0, 0.0, math.inf)
    contact, (force, loss, length) = pushed(-1e-9, -1.0, closed=False)
    assert contact.closed
    assert force > 0.0
    assert loss > 0.0
    assert length < 1e-4


#: The depth under the block's weight, and the speed below which it is no impact.
DEPTH, SLOW = G / STIFFNESS, 0.01 * G / math.sqrt(STIFFNESS)


@pytest.mark.parametrize(
    ("gap", "rate", "counts"),
    [
        (0.9 * DEPTH, -0.9 * SLOW, True),
        (0.9 * DEPTH, 0.9 * SLOW, True),
        (1.1 * DEPTH, -0.9 * SLOW, False),
        (0.9 * DEPTH, 1.1 * SLOW, False),
    ],
)
def test_an_open_contact_that_is_near_and_slow_counts_as_closed_until_now(gap, rate, counts):
    contact, _ = pushed(gap, rate, closed=False)
    assert contact.last_closed == (1.0 if counts else -5.0)


# One surface


def at_wall(*, depth=1e-7, v=(0.0, 0.0, 0.0), theta=0.0, closed=(True, True), surface=LEFT_WALL):
    """State, constants and a step in which the block overlaps a wall."""
    made, state = parameters(), state_of()
    state.contacts["closed"][surface] = closed
    state.contacts["damping"][surface] = 40.0
    x = -0.02 + 0.08 - depth
    step = step_at(made, place=(x, 5.0), theta=theta, v0=v, length=LENGTH)
    return state, made, step


def test_a_wall_pushes_with_what_its_contacts_remember():
    state, made, step = at_wall()
    v, closing, length = surface_force(state, made, LEFT_WALL, step, (0.0, 0.0, 0.0), LENGTH)
    forces = state.contacts["force"][LEFT_WALL]
    assert np.all(forces > 0.0)
    expected = with_forces(state, made, LEFT_WALL, step.corners, (0.0, 0.0, 0.0), LENGTH)
    assert v == pytest.approx(expected, rel=1e-12)
    assert v[0] == pytest.approx(LENGTH * np.sum(forces))
    assert closing == math.inf
    assert length == math.inf


def test_forces_of_a_surface_agree_with_the_velocity_they_give():
    """Each is the spring's and the damper's at the velocity after the step."""
    state, made, step = at_wall(theta=1e-8)
    v, *_ = surface_force(state, made, LEFT_WALL, step, (0.0, 0.0, 0.0), LENGTH)
    distance, inverse = made.distance[LEFT_WALL], made.inverse_inertia
    _, before = pair_at(step, (0.0, 0.0, 0.0), LEFT_WALL, distance, inverse)
    _, after = pair_at(step, v, LEFT_WALL, distance, inverse)
    for i in range(2):
        share = felt_share(40.0 * before[i].mobility * LENGTH)
        expected = -STIFFNESS * (before[i].gap + LENGTH * after[i].rate)
        expected -= 40.0 * share * after[i].rate
        assert state.contacts[LEFT_WALL, i].force == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("comes", [0, 1])
def test_an_open_contact_says_when_it_closes(comes):
    """By the corner that comes first; the other one is closed, or far."""
    spin = 0.5 if comes == 1 else -0.5
    v = (-1e-9, 0.0, spin)
    state, made, step = at_wall(depth=-5e-5, v=v, closed=(False, False))
    _, closing, _ = surface_force(state, made, LEFT_WALL, step, v, 0.0)
    _, pair = pair_at(step, v, LEFT_WALL, made.distance[LEFT_WALL], made.inverse_inertia)
    seen = pair[comes]
    assert closing == pytest.approx(-seen.gap / seen.rate - 0.5 * LENGTH, rel=1e-3)


def test_a_step_is_as_short_as_either_contact_needs():
    for closed in ((True, False), (False, True)):
        state, made, step = at_wall(v=(-0.5, 0.0, 0.0), closed=closed)
        _, _, length = surface_force(state, made, LEFT_WALL, step, (-0.5, 0.0, 0.0), 0.0)
        assert length < 1e-4


def test_a_floor_that_nothing_touches_has_no_friction():
    made, state = parameters(), state_of(LOADED.replace(initial_height=1.0))
    state.friction.force, state.friction.slips, state.friction.stretch = 3.0, True, 1e-6
    v = (0.1, 0.2, 0.3)
    after, *_ = surface_force(state, made, FLOOR, step_at(made, place=(0.0, 5.0)), v, 0.0)
    assert after == v
    assert state.friction.force == 0.0
    assert not state.friction.slips


def test_the_floors_forces_agree_with_the_velocity_they_give():
    made, state = parameters(), state_of()
    step = step_at(made, place=(0.08, state.motion.y), theta=0.0, v0=(0.0, 0.0, 0.0), length=LENGTH)
    v = (0.01, -LENGTH * G, 0.0)
    after, *_ = surface_force(state, made, FLOOR, step, v, LENGTH)
    forces, shear = state.contacts["force"][FLOOR], state.friction.force
    assert np.sum(forces) == pytest.approx(G, rel=0.05)
    assert shear < 0.0
    expected = apply_impulse(v, made.inverse_inertia, (1.0, 0.0), 0.8, LENGTH * shear)
    for i, x in ((0, step.corners[0]), (1, step.corners[2])):
        expected = apply_impulse(expected, made.inverse_inertia, (0.0, 1.0), x, LENGTH * forces[i])
    assert after == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("comes", "sign"), [(0, -1.0), (1, 1.0)])
def test_an_open_corner_of_the_floor_comes_as_the_forces_move_it(comes, sign):
    """Those at the other corner, on which the block stands and slips."""
    made, state = parameters(), state_of()
    theta, w = 8e-5 * sign, -1.3 * sign
    corners = corners_at(made.reach, theta)
    pivot = 2 * (1 - comes)
    v0 = (0.2, -w * corners[pivot], w)
    place = 0.08, -corners[pivot + 1] - 1e-7
    step = step_at(made, place=place, theta=theta, v0=v0, length=LENGTH)
    state.contacts["closed"][FLOOR] = [comes == 1, comes == 0]
    free = v0[0], v0[1] - LENGTH * G, w
    v, closing, _ = surface_force(state, made, FLOOR, step, free, LENGTH)
    assert state.friction.slips
    _, before = pair_at(step, free, FLOOR, 0.0, made.inverse_inertia)
    _, after = pair_at(step, v, FLOOR, 0.0, made.inverse_inertia)
    expected = closing_time(made, before[comes], after[comes].rate, LENGTH)
    assert closing == pytest.approx(expected, rel=1e-9)
    assert expected < 1e-3


# All surfaces


@pytest.mark.parametrize("surface", [LEFT_WALL, RIGHT_WALL])
@pytest.mark.parametrize("corner", [0, 1])
def test_a_wall_pushes_where_any_contact_of_it_does(surface, corner):
    state = state_of()
    state.contacts["force"][FLOOR] = 3.0
    assert not walls_push(state)
    state.contacts[surface, corner].force = 2.0
    assert walls_push(state)


@pytest.mark.parametrize("remembered", [0.0, 1.0])
def test_surfaces_in_turn_agree_with_each_other(remembered):
    """Whatever forces the sweeps begin with: the end is where each surface would leave it."""
    made, state = parameters(), state_of()
    state.contacts["closed"] = [[True, True], [False, False], [True, True]]
    state.contacts["force"][LEFT_WALL] = remembered
    x = -0.02 + 0.08 - 2e-8
    step = step_at(made, place=(x, state.motion.y), theta=0.0, v0=(0.0, 0.0, 0.0), length=LENGTH)
    free = (-LENGTH * 3.0, -LENGTH * G, 0.0)
    v, closing, length = apply_surfaces(state, made, step, free, True)
    total = free
    for surface in (LEFT_WALL, RIGHT_WALL, FLOOR):
        total = with_forces(state, made, surface, step.corners, total, LENGTH)
    assert v == pytest.approx(total, rel=1e-9)
    for surface in (LEFT_WALL, FLOOR):
        before = state.contacts["force"][surface].copy()
        without = with_forces(state, made, surface, step.corners, v, -LENGTH)
        surface_force(state, made, surface, step, without, LENGTH)
        assert state.contacts["force"][surface] == pytest.approx(before, rel=1e-3, abs=1e-3)
    assert state.sweeps > 1
    assert closing == math.inf
    assert length == math.inf


def test_one_surface_alone_is_solved_at_once():
    made, state = parameters(), state_of()
    step = step_at(made, place=(0.08, state.motion.y), theta=0.0, v0=(0.0, 0.0, 0.0), length=LENGTH)
    apply_surfaces(state, made, step, (0.0, -LENGTH * G, 0.0), True)
    assert state.sweeps == 1


@pytest.mark.parametrize(("surface", "theta"), [(RIGHT_WALL, 0.05), (LEFT_WALL, 0.05)])
def test_sweeps_go_on_whichever_corner_is_pushed(surface, theta):
    """The pivot on the floor, and a corner on the wall that the block is pressed to."""
    side = "left" if surface == LEFT_WALL else "right"
    scene = LOADED.replace(walls=[Wall(side=side, gap=0.07)])
    made, state = parameters(scene), state_of(scene)
    corners = corners_at(made.reach, theta)
    out = -1.0 if surface == LEFT_WALL else 1.0
    reach = max(out * corners[i] for i in range(0, 8, 2))
    x = out * (made.distance[surface] - reach + 1e-6)
    step = step_at(
        made, place=(x, -corners[1] - 1e-7), theta=theta, v0=(0.0, 0.0, 0.0), length=LENGTH
    )
    state.contacts["closed"] = False
    struck = 0 if surface == RIGHT_WALL else 1
    state.contacts["closed"][[surface, FLOOR], [struck, 0]] = True
    apply_surfaces(state, made, step, (out * LENGTH * 3.0, -LENGTH * G, 0.0), True)
    assert state.sweeps > 1
    assert state.contacts[surface, struck].force > 0.0


@pytest.mark.parametrize("settled", [False, True])
def test_springs_look_ahead_once_contacts_have_settled(settled):
    made, state = parameters(), state_of()
    step = step_at(made, place=(0.08, state.motion.y), theta=0.0, v0=(0.0, 0.0, 0.0), length=LENGTH)
    free = (0.0, -LENGTH * G, 0.0)
    v, *_ = apply_surfaces(state, made, step, free, settled)
    other = state_of()
    expected, *_ = surface_force(other, made, FLOOR, step, free, LENGTH if settled else 0.0)
    assert v == expected
