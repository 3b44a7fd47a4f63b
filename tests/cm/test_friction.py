"""The floor's friction and normal forces, against the equations that they solve."""

import math

import pytest
from step_parts import STIFFNESS, parameters, state_of, step_at

from rockcheck.cm.friction import Pushes, floor_forces, floor_load, move_spring
from rockcheck.cm.geometry import FLOOR, lower_corner, pair_at

PUSHES = Pushes(6.0, 5.0, 0.3, 0.4)


def solved(mu_s=1e9, *, mu_k=0.3, stretch=1e-8, slipped=False, vx=1e-4, theta=0.1):
    """What the floor does in a step, with all that it follows from."""
    made = parameters(mu_s=mu_s, mu_k=mu_k, friction_damping=2e3)
    step = step_at(made, theta=theta, length=1e-3)
    v = (vx, 0.0, 1e-5)
    friction = state_of().friction
    friction.stretch, friction.slipped = stretch, slipped
    _, pair = pair_at(step, v, FLOOR, 0.0, made.inverse_inertia)
    forces = floor_forces(friction, made, step, v, pair, PUSHES)
    return made, step, v, pair, friction, forces


def gains(made, step, pair, shear):
    """What the friction adds to both rates, of a unit of time."""
    height, _ = lower_corner(step, (0.0, 0.0, 0.0))
    turn = -made.inverse_inertia * height * shear
    return turn * pair.first.lever, turn * pair.second.lever, shear - turn * height


def check_normal_forces(made, step, pair, friction, forces):
    """F_i + d_i (what the forces give to corner i) = f_i, with the friction among them."""
    gain1, gain2, _ = gains(made, step, pair, friction.force)
    first, second, coupling = pair
    gain1 += first.mobility * forces.force1 + coupling * forces.force2
    gain2 += coupling * forces.force1 + second.mobility * forces.force2
    assert forces.force1 + PUSHES.loss1 * gain1 == pytest.approx(PUSHES.force1, rel=1e-9)
    assert forces.force2 + PUSHES.loss2 * gain2 == pytest.approx(PUSHES.force2, rel=1e-9)


@pytest.mark.parametrize("theta", [-0.1, 0.1])
def test_what_sticks_has_the_force_of_its_spring_and_damper(theta):
    made, step, v, pair, friction, forces = solved(theta=theta)
    check_normal_forces(made, step, pair, friction, forces)
    height, slip = lower_corner(step, v)
    _, _, gain = gains(made, step, pair, friction.force)
    turn = -made.inverse_inertia * height
    gain += turn * (pair.first.lever * forces.force1 + pair.second.lever * forces.force2)
    left = slip + step.length * gain
    assert friction.force == pytest.approx(-STIFFNESS * 1e-8 - 2e3 * left, rel=1e-9)
    assert not friction.slips


@pytest.mark.parametrize(("vx", "stretch"), [(2.0, 1e-8), (-2.0, -1e-8), (0.5, 1e-8)])
def test_what_slips_is_held_at_kinetic_friction(vx, stretch):
    made, step, _, pair, friction, forces = solved(0.4, vx=vx, stretch=stretch)
    check_normal_forces(made, step, pair, friction, forces)
    load = forces.force1 + forces.force2
    assert friction.slips
    assert friction.force == pytest.approx(-math.copysign(0.3 * load, vx), rel=1e-12)


@pytest.mark.parametrize("slipped", [False, True])
def test_what_slipped_a_step_ago_has_kinetic_friction(slipped):
    """Its pull is between both limits."""
    *_, friction, forces = solved()
    share = abs(friction.force) / (forces.force1 + forces.force2)
    *_, friction, _ = solved(1.2 * share, mu_k=0.8 * share, slipped=slipped)
    assert friction.slips == slipped


@pytest.mark.parametrize("mu_s", [0.4, 1e9])
def test_the_velocity_has_the_friction_and_no_normal_force(mu_s):
    made, step, v, pair, friction, forces = solved(mu_s, vx=2.0 if mu_s < 1.0 else 1e-4)
    impulse = step.length * friction.force
    height, _ = lower_corner(step, v)
    gain1, gain2, _ = gains(made, step, pair, impulse)
    expected = v[0] + impulse, v[1], v[2] - made.inverse_inertia * height * impulse
    assert forces.v == pytest.approx(expected, rel=1e-12)
    assert forces.gain1 == pytest.approx(gain1, rel=1e-12)
    assert forces.gain2 == pytest.approx(gain2, rel=1e-12)


def standing(force1=3.0, force2=1.0):
    state = state_of()
    state.contacts[FLOOR, 0].force, state.contacts[FLOOR, 1].force = force1, force2
    return state


def test_the_load_is_that_of_both_corners():
    assert floor_load(standing()) == 4.0


def test_a_spring_that_sticks_moves_with_the_corner():
    made = parameters()
    state, step, v = standing(), step_at(made), (0.02, 0.0, 0.1)
    state.friction.stretch, state.friction.slipped = 1e-6, True
    slip_rate = move_spring(state, made, step, v)
    assert slip_rate == lower_corner(step, v)[1]
    assert state.friction.stretch == 1e-6 + step.length * slip_rate
    assert not state.friction.slipped


@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_a_spring_that_slips_keeps_the_length_of_its_force(direction):
    made = parameters()
    state = standing()
    state.friction.slips = True
    move_spring(state, made, step_at(made), (5.0 * direction, 0.0, 0.0))
    assert state.friction.slipped
    assert state.friction.stretch == pytest.approx(direction * 0.3 * 4.0 / STIFFNESS)


def test_what_leaves_the_floor_forgets_its_friction():
    made, state = parameters(), standing(0.0, 0.0)
    friction = state.friction
    friction.force, friction.stretch, friction.slips, friction.slipped = 1.0, 2.0, True, True
    assert move_spring(state, made, step_at(made), (1.0, 0.0, 0.0)) == 0.0
    assert friction.item() == (0.0, 0.0, False, False)
