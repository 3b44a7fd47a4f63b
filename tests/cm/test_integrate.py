"""Steps of a run against closed forms; the runs are so short that they need no compiler."""

import math

import numpy as np
import pytest
from step_parts import LOADED, STIFFNESS, G, parameters, state_of

from rockcheck import Block, ContinuousModel, Floor, Record, Wall
from rockcheck.cm.base_motion import base_of
from rockcheck.cm.geometry import FLOOR
from rockcheck.cm.integrate import advance, is_blown_up, step_length, take_step, write_row
from rockcheck.cm.state import STRIKE

PLAIN = LOADED.replace(
    block=Block(half_width=0.3, half_height=1.0), walls=[], duration=0.1, output_step=0.005
)
BLOCK = PLAIN.block


def played(scene, **settings):
    return ContinuousModel(**{"stiffness": 1e6} | settings).simulate(scene)


# Motion


def test_flight_is_a_parabola():
    flying = PLAIN.replace(
        initial_height=1.0,
        initial_velocity=0.4,
        initial_angular_velocity=0.7,
        excitation=Record.from_samples([1.0, 3.0], 1.0),
        vertical=Record.from_samples([2.0, 2.0], 1.0),
    )
    c = played(flying).channels
    t = c["t"]
    _, y, _, vx, vy, _ = flying.initial_state
    assert c["x"] == pytest.approx(vx * t - t**2 / 2.0 - t**3 / 3.0, abs=2e-7)
    assert c["y"] == pytest.approx(y + vy * t - (G + 2.0) * t**2 / 2.0, abs=1e-12)
    assert c["theta"] == pytest.approx(0.7 * t, abs=1e-14)
    assert c["x_dot"] == pytest.approx(vx - t - t**2, abs=1e-12)
    assert c["y_dot"] == pytest.approx(vy - (G + 2.0) * t, abs=1e-12)


def test_a_sliding_block_is_slowed_by_kinetic_friction():
    sliding = PLAIN.replace(
        block=Block(half_width=1.0, half_height=0.3),
        floor=Floor(friction=0.2),
        initial_velocity=-0.5,
    )
    c = played(sliding).channels
    t = c["t"]
    assert c["x"] == pytest.approx(-0.5 * t + 0.2 * G * t**2 / 2.0, abs=2e-5)
    assert np.max(np.abs(c["theta"])) < 1e-5


def test_a_rocking_block_turns_about_its_corner():
    start = 0.5 * BLOCK.alpha
    rocking = PLAIN.replace(floor=Floor(friction=1.2), initial_rotation=start)
    c = played(rocking, stiffness=1e8).channels
    t, radius = c["t"], BLOCK.radius
    # theta'' = -(3 g/(4 R)) sin(alpha - theta), and its second derivative, at the start at rest
    second = -0.75 * G / radius * math.sin(BLOCK.alpha - start)
    fourth = 0.75 * G / radius * math.cos(BLOCK.alpha - start) * second
    assert c["theta"] == pytest.approx(start + second * t**2 / 2.0 + fourth * t**4 / 24.0, abs=2e-6)
    assert np.max(np.abs(c["slip"])) < 1e-6


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_a_block_that_drops_flat_bounces(e):
    drop = PLAIN.replace(
        floor=Floor(friction=0.3, restitution=e),
        initial_height=1e-3,
        output_step=1e-3,
        duration=0.03,
    )
    history = played(drop)
    impact = history.event_list[0]
    speed = math.sqrt(2.0 * G * 1e-3)
    assert impact.kind == "floor impact"
    assert impact.t == pytest.approx(speed / G, abs=2e-5)
    impulse = sum(event.impulse for event in history.event_list)
    # The weight pushes, too, while the contact is young: for 4 ms.
    assert 0.0 < impulse - (1.0 + e) * speed < 1.01 * G * 4e-3
    # The first row after it is at most 1 ms late.
    assert np.max(history.channels["y_dot"]) == pytest.approx(e * speed, abs=1.1e-3 * G)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("e", [0.0, 0.5])
def test_a_wall_throws_a_block_back(side, e):
    toward = -1.0 if side == "left" else 1.0
    flying = PLAIN.replace(
        walls=[Wall(side=side, gap=0.01, restitution=e)],
        initial_height=1.0,
        initial_velocity=0.5 * toward,
        duration=0.04,
    )
    history = played(flying)
    speeds = history.channels["x_dot"]
    assert speeds[-1] == pytest.approx(-0.5 * e * toward, abs=0.002)
    wall = history.extremes.walls[side]
    assert wall.strikes == 2
    assert wall.first_s == pytest.approx(0.02, abs=1e-6)
    assert wall.speed == pytest.approx(0.5, rel=1e-6)
    impulse = sum(event.impulse for event in history.event_list)
    assert impulse == pytest.approx(0.5 * (1.0 + e), rel=0.005)


def test_a_leaning_block_presses_on_wall_and_floor():
    """Sweeps over both surfaces agree: the base pushes it flat against the wall, and it stays."""
    pushed = PLAIN.replace(
        walls=[Wall(side="left", gap=0.0)],
        floor=Floor(friction=0.05),
        excitation=Record.from_samples([2.0, 2.0], 1.0),
        duration=0.05,
    )
    history = played(pushed)
    assert np.max(np.abs(history.channels["x"])) < 5e-6
    assert np.max(np.abs(history.channels["theta"])) < 5e-6
    assert history.cost.evaluations > 2 * history.cost.steps


@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
def test_a_falling_block_has_overturned(side, sign):
    falling = PLAIN.replace(initial_rotation=1.5 * sign, initial_angular_velocity=2.0 * sign)
    history = played(falling)
    assert history.outcome == f"overturned {side}"
    fall = history.event_list[-1].t
    assert 0.02 < fall < 0.0354
    extremes = history.extremes
    left, right = (0.5 * math.pi, 0.0)[:: int(sign)]
    assert extremes.rotation_left == left
    assert extremes.rotation_right == right
    first, second = (fall, 0.0)[:: int(sign)]
    assert extremes.rotation_left_s == first
    assert extremes.rotation_right_s == second


def test_the_work_on_a_flying_block_is_its_gain_of_energy():
    shaken = PLAIN.replace(
        initial_height=1.0,
        initial_velocity=0.4,
        excitation=Record.from_samples([30.0, -50.0, 70.0], 0.02),
        vertical=Record.from_samples([-60.0, 20.0, 40.0], 0.02),
    )
    state, made = state_of(shaken), parameters(shaken)
    start = float(state.allowed_energy)
    times = np.array([0.06])
    advance(made, base_of(shaken), state, np.zeros(9, STRIKE), 0.06, times, np.empty((1, 6)))
    motion = state.motion
    energy = 0.5 * (motion.vx**2 + motion.vy**2) + G * (motion.y - 1.0)
    assert abs(energy - start) > 0.1
    assert state.allowed_energy - start == pytest.approx(energy - start, rel=1e-9)


def test_a_contact_that_closes_is_young_for_four_contact_times():
    state, made = state_of(PLAIN.replace(initial_height=1e-6)), parameters(PLAIN)
    state.motion.vy, state.closing_time = -0.5, 1e-5
    count = take_step(made, base_of(PLAIN), 1.0, state, np.zeros(9, STRIKE), 0)
    assert state.contacts["closed"][FLOOR].tolist() == [True, True]
    assert state.settle_time == pytest.approx(0.5e-5 + 4.0 / math.sqrt(STIFFNESS))
    assert state.contact_step < 1.01 * 0.02 / math.sqrt(STIFFNESS)
    assert state.first_strike == 0.5e-5
    assert count == 0


# Steps


def waiting(**change):
    state = state_of(PLAIN)
    for name, value in change.items():
        setattr(state, name, value)
    return state


@pytest.mark.parametrize(
    ("change", "settled", "length"),
    [
        ({"closing_time": 1.0}, True, 3e-4),
        ({"closing_time": 1e-4}, True, 1e-4),
        ({"closing_time": 1.0, "contact_step": 2e-6}, False, 2e-6),
        ({"closing_time": 0.0}, True, 1e-7),
    ],
    ids=["settled", "about to close", "young", "no shorter"],
)
def test_steps_are_as_long_as_contacts_allow(change, settled, length):
    assert step_length(waiting(**change), parameters(PLAIN), 1.0, settled) == pytest.approx(length)


@pytest.mark.parametrize(
    ("ahead", "reaches"), [(2e-4, True), (3.0000005e-4, True), (3.1e-4, False)]
)
def test_a_step_ends_where_it_has_to(ahead, reaches):
    length = step_length(waiting(closing_time=1.0), parameters(PLAIN), ahead, True)
    assert length == (ahead if reaches else 3e-4)


@pytest.mark.parametrize(("share", "blown"), [(0.019, False), (0.021, True)])
def test_more_energy_than_work_is_a_blow_up(share, blown):
    state, made = state_of(PLAIN.replace(initial_velocity=2.0)), parameters(PLAIN)
    state.motion.w = 0.3
    turning = 0.5 * 0.3**2 / made.inverse_inertia
    state.motion.y = 1.0 + (share * state.absolute_work - turning) / G
    assert is_blown_up(state, made) == blown


@pytest.mark.parametrize("speed", [2e150, math.nan, math.inf])
def test_a_motion_without_end_is_a_blow_up(speed):
    state = state_of(PLAIN)
    state.motion.vx = speed
    state.allowed_energy = math.inf
    assert is_blown_up(state, parameters(PLAIN))


def test_a_row_within_a_step_is_on_its_cubic():
    state, row = state_of(PLAIN), np.zeros(6)
    state.past_t, state.t = 1.0, 1.5

    def place(t, i):
        return (i + 1) * t + (i - 2.0) * t**2

    def rate(t, i):
        return (i + 1) + 2.0 * (i - 2.0) * t

    for motion, t in ((state.past_motion, 1.0), (state.motion, 1.5)):
        for i, (name, speed) in enumerate((("x", "vx"), ("y", "vy"), ("theta", "w"))):
            setattr(motion, name, place(t, i))
            setattr(motion, speed, rate(t, i))
    for t in (1.2, 1.5):
        write_row(state, t, row)
        assert row[:3] == pytest.approx([place(t, i) for i in range(3)])
        assert row[3:] == pytest.approx([rate(t, i) for i in range(3)])
