"""How steps follow each other, and what is read off the states at their ends."""

import math

import numpy as np
import pytest

from rockcheck import Block, Floor, ModelFailure, Record, Scene, Wall
from rockcheck.engines import kernels, steps
from rockcheck.engines.steps import AdaptiveStep, FixedStep
from rockcheck.scenes import compiled

G = 9.81
BLOCK = Block(half_width=0.6, half_height=0.8)
SCENE = Scene(
    name="thrown",
    block=BLOCK,
    floor=Floor(friction=0.5),
    initial_height=1.0,
    initial_velocity=0.3,
    initial_angular_velocity=0.5,
    duration=0.4,
    output_step=0.1,
)


#: Of the mass's centre at the start.
VX, VY, _ = SCENE.initial_state[3:]


class Air(steps.World):
    """What moves freely; it notes where it is placed, and how long its steps are to be."""

    embedding = 1e-3

    def __init__(self):
        self.placed, self.lengths, self.now = [], [], np.zeros(6)

    def place(self, x, y, theta, vx, vy, w):
        self.now = np.array([x, y, theta, vx, vy, w])
        self.placed.append(self.now)

    def step(self, felt, dt):
        rates = self.now[3:] + dt * np.array([*felt, 0.0])
        self.now = np.concatenate([self.now[:3] + dt * rates, rates])

    def state(self):
        return tuple(self.now.tolist())

    def ready(self, dt):
        self.lengths.append(dt)


class Crooked(Air):
    """A world whose state after each step is one that is given."""

    def __init__(self, *state):
        super().__init__()
        self.given = state

    def state(self):
        return self.given


# Fixed steps


def marched(scene=SCENE, step=0.01, world=None):
    return FixedStep(step).ready(world or Air(), scene)()


def test_fixed_steps_end_at_the_end():
    times, _, _ = marched()
    assert times == pytest.approx(0.01 * np.arange(41))


def test_the_last_fixed_step_goes_beyond_the_end():
    times, _, _ = marched(step=0.03)
    assert times[-1] == pytest.approx(0.42)


def test_velocities_are_those_of_free_fall():
    times, states, _ = marched()
    assert states[:, 4] == pytest.approx(VY - G * times)
    assert states[:, 3] == pytest.approx(VX)


def test_a_base_is_felt_by_its_mean_acceleration():
    """It rises from 0 to 2 m/s^2 in 0.4 s, the vertical one is 1: in the middles of the steps."""
    shaken = SCENE.replace(
        excitation=Record.from_samples([0.0, 2.0], 0.4),
        vertical=Record.from_samples([1.0, 1.0], 0.4),
    )
    _, _, felt = marched(shaken)
    assert felt[:, 0] == pytest.approx(-5.0 * (0.01 * np.arange(40) + 0.005))
    assert felt[:, 1] == pytest.approx(-G - 1.0)


def test_an_engine_is_told_the_length_of_its_steps():
    world = Air()
    marched(world=world)
    assert world.lengths == [0.01]


@pytest.mark.parametrize(("height", "depth"), [(0.0, 1e-3), (0.1, 0.0)])
def test_a_block_on_the_floor_begins_a_hair_below_it(height, depth):
    world = Air()
    still = SCENE.replace(initial_height=height, duration=0.01, output_step=0.01)
    FixedStep(0.01).ready(world, still)()
    assert world.placed[0][1] == pytest.approx(0.8 + height - depth)


def test_a_march_ends_with_the_first_state_that_lies():
    """It turns at 0.5 rad/s from 1.4 rad: beyond a right angle after 0.35 s."""
    tilted = SCENE.replace(initial_height=2.0, initial_rotation=1.4)
    times, states, _ = marched(tilted)
    assert times[-1] == pytest.approx(0.35)
    assert len(states) == len(times)


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ((0.0, 1.0, 0.0, math.nan, 0.0, 0.0), "blew up between t = 0 and"),
        ((1.1e6, 1.0, 0.0, 0.0, 0.0, 0.0), "blew up"),
        ((0.0, -0.1, 0.0, 0.0, 0.0, 0.0), "fell through the floor"),
    ],
)
def test_a_motion_that_cannot_be_is_a_failure(state, words):
    with pytest.raises(ModelFailure, match=words):
        marched(world=Crooked(*state))


def test_long_marches_are_joined():
    times, states, _ = marched(step=1e-4)
    assert len(times) == 4001
    assert states[:, 4] == pytest.approx(VY - G * times)


def test_a_push_is_a_step_from_a_pose():
    velocity = Air().push((0.0, 1.0, 0.2), (0.3, 0.1, 0.5), 0.01, (2.0, -G), False)
    assert velocity == pytest.approx((0.32, 0.1 - 0.01 * G, 0.5))


# When a block was down


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_fall_ends_at_a_right_angle_between_two_steps(sign):
    tilts = sign * np.array([1.4, 1.5, 1.6])
    states = np.column_stack([np.zeros((3, 2)), tilts, np.zeros((3, 3))])
    time = steps.time_of_fall(np.array([0.0, 0.1, 0.3]), states)
    assert time == pytest.approx(0.1 + 0.2 * (math.pi / 2.0 - 1.5) / 0.1)


def lying(*tilts):
    states = np.column_stack([np.zeros((2, 2)), tilts, np.zeros((2, 3))])
    return steps.time_of_fall(np.array([0.0, 0.2]), states)


def test_a_block_that_stands_has_not_fallen():
    assert lying(1.4, 1.5) == math.inf


def test_a_block_that_just_lies_is_down_with_the_step():
    assert lying(1.5, math.pi / 2.0 - 0.5e-6) == pytest.approx(0.2)


def test_a_block_that_begins_as_good_as_down_is_down_then():
    lies = math.pi / 2.0 - 0.5e-6
    assert lying(lies, lies) == 0.0


# States at other times

TIMES = np.array([0.0, 0.15, 0.25, 0.4])


CURVES = [
    np.polynomial.Polynomial(coefficients)
    for coefficients in ([1.0, 2.0, 3.0, 4.0], [2.0, -1.0, 1.0, -3.0], [0.1, 0.2, -0.3, 0.4])
]


def cubic(t):
    """x, y and theta that are cubics of the time, and their rates."""
    rates = [curve.deriv()(t) for curve in CURVES]
    return np.column_stack([*(curve(t) for curve in CURVES), *rates])


def test_places_between_steps_are_those_of_the_cubic():
    found = steps.at_output_times(SCENE, TIMES, cubic(TIMES), smooth=True)
    assert found == pytest.approx(cubic(0.1 * np.arange(5)))


def test_where_impacts_lie_within_steps_velocities_are_linear():
    states = cubic(TIMES)
    found = steps.at_output_times(SCENE, TIMES, states, smooth=False)
    assert found[:, :3] == pytest.approx(cubic(0.1 * np.arange(5))[:, :3])
    assert found[1, 3:] == pytest.approx(states[0, 3:] + (states[1, 3:] - states[0, 3:]) / 1.5)


def test_rows_end_with_the_march():
    found = steps.at_output_times(SCENE, TIMES[:3], cubic(TIMES[:3]), smooth=True)
    assert len(found) == 3


def test_a_row_that_rounding_puts_behind_the_end_is_the_end_s():
    times = TIMES * (1.0 - 1e-13)
    assert len(steps.at_output_times(SCENE, times, cubic(times), smooth=True)) == 5


def test_a_march_of_no_step_has_its_first_row():
    assert steps.at_output_times(SCENE, TIMES[:1], cubic(TIMES[:1]), smooth=True).shape == (1, 6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_cubic_shows_no_fall_that_is_none(sign):
    """From 1.5 rad up and back within a step."""
    states = np.zeros((2, 6))
    states[:, 2], states[0, 5], states[1, 5] = 1.5 * sign, 5.0 * sign, -5.0 * sign
    found = steps.at_output_times(SCENE, np.array([0.0, 0.4]), states, smooth=True)
    assert abs(found[2, 2]) == pytest.approx(math.pi / 2.0 - 1e-6)


def test_fine_states_are_those_of_the_cubic_in_equal_parts():
    """A step of 1.2 ms has three parts, one of 0.4 ms is left."""
    ends, felt = np.array([0.0, 1.2e-3, 1.6e-3]), np.array([[1.0, 2.0], [3.0, 4.0]])
    times, states, between = steps.in_fine_steps(ends, cubic(ends), felt)
    assert times == pytest.approx(4e-4 * np.arange(5))
    assert states == pytest.approx(cubic(times))
    assert between.tolist() == [[1.0, 2.0]] * 3 + [[3.0, 4.0]]


@pytest.mark.parametrize("step", [0, 1, 2])
def test_each_step_has_a_cubic_of_its_own(step):
    ends, states = 2.0 * steps.FINE * np.arange(4), np.random.default_rng(2).normal(size=(4, 6))
    _, whole, _ = steps.in_fine_steps(ends, states, np.zeros((3, 2)))
    its = slice(step, step + 2)
    _, alone, _ = steps.in_fine_steps(ends[its], states[its], np.zeros((1, 2)))
    assert whole[2 * step : 2 * step + 3] == pytest.approx(alone, rel=1e-9)


# Settings


def test_the_usual_step_follows_the_cube_root_of_the_tolerance():
    one, other = (AdaptiveStep(1.0, tolerance=1e-8 * k).usual for k in (1.0, 8.0))
    assert one == pytest.approx(5e-4)
    assert other == pytest.approx(1e-3)


@pytest.mark.parametrize(
    ("step", "limiting"),
    [
        (AdaptiveStep(1e-4, tolerance=1e-8), "largest_step"),
        (AdaptiveStep(1e-2, tolerance=1e-8), "tolerance"),
        (AdaptiveStep(1e-2), "largest_step"),
    ],
)
def test_the_shorter_of_both_limits_the_usual_step(step, limiting):
    assert step.limiting == limiting
    assert step.usual == pytest.approx(min(step.largest, 5e-4) if step.tolerance else 1e-2)


def test_steps_three_times_as_long_have_twenty_seven_times_the_error():
    assert AdaptiveStep(0.1, 2.0, 1e-9).coarser(3.0) == AdaptiveStep(
        pytest.approx(0.3), pytest.approx(6.0), pytest.approx(2.7e-8)
    )
    assert FixedStep(0.1).coarser(3.0).largest == pytest.approx(0.3)


def test_lengths_are_in_units_of_another():
    scene = Scene(
        name="units",
        block=Block(half_width=1.0, half_height=2.0, centre_of_mass=(0.2, -0.4), mass=7.0),
        floor=Floor(friction=0.5),
        walls=[Wall(side="left", gap=0.6)],
        excitation=Record.from_samples([2.0], 0.1),
        vertical=Record.from_samples([4.0], 0.1),
        initial_velocity=0.8,
        duration=1.0,
    )
    halved = steps.in_units_of(2.0, scene)
    assert (halved.block.half_width, halved.block.half_height) == (0.5, 1.0)
    assert halved.block.centre_of_mass == (0.1, -0.2)
    assert halved.walls[0].gap == 0.3
    assert halved.excitation.samples.tolist() == [1.0]
    assert halved.vertical.samples.tolist() == [2.0]
    assert halved.initial_velocity == 0.4
    assert halved.gravity == G / 2.0
    assert halved.floor.friction == 0.5


def test_inertia_in_other_units_is_of_a_block_of_one_kilogram():
    block = Block(half_width=1.0, half_height=2.0, mass=7.0, moment_of_inertia=14.0)
    halved = steps.in_units_of(2.0, SCENE.replace(block=block, initial_height=3.0))
    assert halved.block.moment_of_inertia == pytest.approx(2.0 / 4.0)
    assert halved.initial_height == 1.5


# Adaptive steps


def adaptive(world, scene=SCENE, **given):
    return AdaptiveStep(**{"largest": 0.02} | given).ready(world, scene)()


def test_adaptive_steps_in_flight_are_exact():
    times, states, felt = adaptive(Air())
    assert times[-1] == pytest.approx(0.4)
    assert states[:, 1] == pytest.approx(1.8 + VY * times - 0.5 * G * times**2)
    assert states[:, 0] == pytest.approx(VX * times)
    assert felt[:, 1] == pytest.approx(-G)
    assert len(felt) == len(times) - 1


class Floored(Air):
    """A floor that stops a block that falls flat."""

    def push(self, pose, velocity, dt, felt, bouncing):
        vx, vy, w = velocity
        falls = vy + dt * felt[1]
        lands = pose[1] < 0.8 and falls < 0.0
        return vx, 0.0 if lands else falls, w


def test_a_block_that_drops_lands_in_time_and_stands():
    dropped = SCENE.replace(initial_height=0.1, initial_velocity=0.0, initial_angular_velocity=0.0)
    times, states, _ = adaptive(Floored(), dropped, largest=5e-3)
    landed = np.flatnonzero(states[:, 4] == 0.0)[1]
    assert times[landed] == pytest.approx(math.sqrt(0.2 / G), abs=1e-6)
    assert states[-1, 1] == pytest.approx(0.8, abs=1e-9)


def test_steps_that_are_taken_again_for_ever_end_the_run(monkeypatch):
    """They write no row, and count all the same."""
    monkeypatch.setattr(compiled, "for_types_of", lambda *given: lambda *asked: kernels.AGAIN)
    march = AdaptiveStep(largest=0.1).ready(Air(), SCENE)
    with pytest.raises(ModelFailure, match="after 1 steps at t = 0 s"):
        march()
