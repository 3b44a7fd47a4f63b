"""The fate of a block goes beyond the end of its history."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import PAPER_BLOCK, Block, Event, Floor, History, Ricker, Scene, Wall
from rockcheck.validation.execute.fate import decided, fate_of, lasting

ALPHA = PAPER_BLOCK.alpha
#: Released a little beyond its balance point: it takes its time to fall.
LEANING = Scene(
    name="leaning",
    block=PAPER_BLOCK,
    floor=Floor(friction=0.6),
    initial_rotation=1.001 * ALPHA,
    duration=1.0,
)


def test_what_falls_after_the_clock_overturns():
    history = EventBasedModel().simulate(LEANING)
    assert history.outcome == "moving"
    assert fate_of(EventBasedModel(), LEANING).outcome == "overturned left"


def test_the_time_of_a_fall_does_not_depend_on_the_duration():
    longer = LEANING.replace(duration=20.0)
    fall = EventBasedModel().simulate(longer).overturned_at
    assert fate_of(EventBasedModel(), LEANING).at_s == pytest.approx(fall, rel=1e-12)


def test_the_excitation_is_played_to_its_end():
    pulse = Ricker(amplitude=6.0, period=1.2)
    scene = LEANING.replace(initial_rotation=0.0, excitation=pulse, duration=0.1)
    whole = EventBasedModel().simulate(scene.replace(duration=30.0))
    assert fate_of(EventBasedModel(), scene).outcome == whole.outcome
    assert fate_of(EventBasedModel(), scene).extremes.peak_rotation > 0.0


def test_a_block_released_inside_its_balance_stays():
    found = fate_of(EventBasedModel(), LEANING.replace(initial_rotation=0.9 * ALPHA))
    assert found.outcome in ("moving", "at rest")


def test_the_extremes_are_of_the_whole_motion():
    found = fate_of(EventBasedModel(), LEANING)
    assert found.extremes.rotation_left == 0.5 * math.pi


class Floating:
    """A model whose block turns for ever at a place just inside its balance."""

    def simulate(self, scene):
        history = EventBasedModel().simulate(scene.replace(initial_rotation=0.0))
        still = 0.0 * history.channels["t"]
        place = dict(zip(("x", "y", "theta"), standing(0.95 * ALPHA, 0.0), strict=False))
        channels = history.channels | {name: still + value for name, value in place.items()}
        channels["theta_dot"] = still + 0.01
        return replace(history, channels=channels, outcome="moving", model_extremes=None)


def test_what_never_ends_is_undecided():
    assert fate_of(Floating(), LEANING).outcome == "undecided"


class Hanging:
    """A model whose block creeps outward beyond its balance, and never lies."""

    def simulate(self, scene):
        history = EventBasedModel().simulate(scene.replace(initial_rotation=0.0))
        t = history.channels["t"]
        channels = history.channels | {
            "theta": ALPHA * (1.1 + 1e-3 * t),
            "theta_dot": 1e-3 * ALPHA + 0.0 * t,
        }
        return replace(history, channels=channels, outcome="moving", model_extremes=None)


def test_what_moves_outward_beyond_its_balance_never_stays():
    assert fate_of(Hanging(), LEANING).outcome == "overturned left"


def test_a_wall_in_the_way_of_a_fall_leaves_it_undecided():
    walled = LEANING.replace(walls=(Wall(side="left", gap=2.0),))
    assert fate_of(Hanging(), walled).outcome == "undecided"


def standing(theta, theta_dot):
    """A state of a block that turns about the corner it stands on."""
    scene = LEANING.replace(initial_rotation=theta, initial_angular_velocity=theta_dot)
    return np.array(scene.initial_state)


def test_too_little_energy_to_stand_on_a_corner_stays():
    assert decided(LEANING, standing(0.3 * ALPHA, 0.0), 0.4 * ALPHA) == "stays"


def test_enough_energy_to_turn_farther_than_ever_leaves_it_open():
    assert decided(LEANING, standing(0.3 * ALPHA, 0.3), 0.3 * ALPHA) == "open"


def test_nearly_enough_energy_to_overturn_leaves_it_open():
    assert decided(LEANING, standing(0.8 * ALPHA, 0.0), 2.0 * ALPHA) == "open"


def test_a_floor_that_rebounds_leaves_it_open():
    bouncing = LEANING.replace(floor=Floor(friction=0.6, restitution=0.3))
    assert decided(bouncing, standing(0.3 * ALPHA, 0.0), 0.4 * ALPHA) == "open"


def test_an_impact_at_a_floor_without_friction_adds_nothing():
    bouncing = LEANING.replace(floor=Floor(friction=0.0, restitution=0.3))
    assert decided(bouncing, standing(0.3 * ALPHA, 0.0), 0.4 * ALPHA) == "stays"


def test_a_block_that_hardly_turns_stays():
    assert decided(LEANING, standing(0.01 * ALPHA, 0.0), 0.011 * ALPHA) == "stays"


def test_a_block_that_may_turn_farther_to_its_other_side_is_open():
    """On the side of its centre of mass a block turns farther with the same energy."""
    block = Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.1, 0.0))
    leaning = LEANING.replace(block=block)
    state = leaning.replace(initial_rotation=0.05).initial_state
    assert decided(leaning, np.array(state), 0.051) == "open"


@pytest.mark.parametrize(("theta", "rate"), [(1.1, 1e-3), (-1.1, -1e-3)])
def test_what_turns_outward_beyond_its_balance_falls(theta, rate):
    assert decided(LEANING, standing(theta * ALPHA, rate), 1.2 * ALPHA) == "falls"


@pytest.mark.parametrize("rate", [-0.1, 0.0])
def test_what_does_not_turn_outward_beyond_its_balance_is_open(rate):
    assert decided(LEANING, standing(1.1 * ALPHA, rate), 1.2 * ALPHA) == "open"


def test_a_wall_on_the_other_side_stops_no_fall():
    walled = LEANING.replace(walls=(Wall(side="right", gap=2.0),))
    assert decided(walled, standing(1.1 * ALPHA, 0.1), 1.2 * ALPHA) == "falls"


class Made:
    """A model whose box's centre is where a function puts it: x, theta and their rates by time."""

    def __init__(self, place, outcome="moving", events=()):
        self.place, self.outcome, self.events = place, outcome, events
        self.played = []

    def simulate(self, scene):
        self.played.append(scene)
        t = np.linspace(0.0, scene.duration, 11)
        x, theta, x_dot, theta_dot = (value + 0.0 * t for value in self.place(t))
        channels = {"t": t, "x": x, "y": 0.0 * t + PAPER_BLOCK.half_height, "theta": theta}
        channels |= {"x_dot": x_dot, "y_dot": 0.0 * t, "theta_dot": theta_dot}
        return History(
            name="made",
            model="made",
            channels=channels,
            event_list=tuple(self.events),
            outcome=self.outcome,
            block=PAPER_BLOCK,
        )


PULSE = Ricker(amplitude=3.0, period=0.9)
SHAKEN = LEANING.replace(initial_rotation=0.0, excitation=PULSE)
UNIT = 1.0 / SHAKEN.frequency_parameter


def test_it_is_looked_at_four_times_each_twice_as_late():
    model = Made(lambda t: (0.0, 1.1 * ALPHA, 0.0, -0.1))
    fate_of(model, SHAKEN)
    quiet = PULSE.quiet_after
    assert [scene.duration for scene in model.played] == pytest.approx(
        [quiet + looks * UNIT for looks in (7.5, 15.0, 30.0, 60.0)]
    )


def test_the_vertical_motion_is_played_to_its_end_too():
    upward = Ricker(amplitude=1.0, period=3.0)
    model = Made(lambda t: (0.0, 0.0, 0.0, 0.0), "at rest")
    fate_of(model, SHAKEN.replace(vertical=upward))
    assert model.played[0].duration == pytest.approx(upward.quiet_after + 7.5 * UNIT)


def test_what_turns_inward_at_the_last_look_is_undecided():
    model = Made(lambda t: (0.0, 1.1 * ALPHA, 0.0, -0.1))
    assert fate_of(model, SHAKEN).outcome == "undecided"


@pytest.mark.parametrize(("sense", "side"), [(1.0, "left"), (-1.0, "right")])
def test_what_falls_at_the_last_look_falls_to_its_side(sense, side):
    model = Made(lambda t: (0.0, sense * 1.1 * ALPHA, 0.0, sense * 1e-3))
    assert fate_of(model, SHAKEN).outcome == f"overturned {side}"


def test_a_model_s_fall_is_the_time_of_its_event():
    fall = Event(t=1.25, kind="overturned left")
    model = Made(lambda t: (0.0, 1.5, 0.0, 0.1), "overturned left", [fall])
    found = fate_of(model, SHAKEN)
    assert found.outcome == "overturned left"
    assert found.at_s == 1.25
    assert len(model.played) == 1


def test_a_model_that_says_that_it_rests_is_believed():
    model = Made(lambda t: (0.0, 1.1 * ALPHA, 0.0, -0.1), "at rest")
    found = fate_of(model, SHAKEN)
    assert found.outcome == "at rest"
    assert found.at_s == pytest.approx(PULSE.quiet_after + 7.5 * UNIT)


def test_too_little_energy_ends_the_looks():
    model = Made(lambda t: (0.0, 0.3 * ALPHA, 0.0, 0.01))
    assert fate_of(model, SHAKEN).outcome == "at rest"
    assert len(model.played) == 1


def leaning_at_a_wall(place):
    """The outcome, and how many looks it takes, of a block beyond its balance."""
    model = Made(place)
    walled = SHAKEN.replace(walls=(Wall(side="left", gap=2.0),))
    return fate_of(model, walled).outcome, len(model.played)


def test_what_leans_at_a_wall_and_does_not_move_between_two_looks_rests():
    assert leaning_at_a_wall(lambda t: (0.0, 1.1 * ALPHA, 0.0, 0.0)) == ("at rest", 2)


def test_what_creeps_does_not_rest():
    creep = 0.5e-4
    assert leaning_at_a_wall(lambda t: (creep * t, 1.1 * ALPHA, creep, 0.0)) == ("undecided", 4)


@pytest.mark.parametrize("rates", [(1e-3, 0.0), (0.0, 1e-3)])
def test_what_moves_and_is_back_at_each_look_does_not_rest(rates):
    assert leaning_at_a_wall(lambda t: (0.0, 1.1 * ALPHA, *rates)) == ("undecided", 4)


def test_a_fate_is_judged_at_the_end_not_before():
    model = Made(lambda t: (0.0, np.where(t > 0.0, 1.1 * ALPHA, 0.0), 0.0, 1e-3))
    assert fate_of(model, SHAKEN).outcome == "overturned left"


def test_friction_by_bouc_and_wen_is_looked_at_like_an_engine():
    found = fate_of(EventBasedModel(friction="bouc-wen"), LEANING.replace(initial_rotation=0.01))
    assert found.outcome == "at rest"
    assert found.at_s == pytest.approx(7.5 * UNIT, abs=LEANING.output_step)


def test_rows_of_a_long_motion_are_no_more_than_a_scene_may_have():
    long = lasting(LEANING.replace(output_step=1e-3), 1e4)
    assert long.duration == 1e4
    assert long.output_step == pytest.approx(1.001 * 1e4 / 5_000_000)


def test_rows_of_a_short_motion_stay_where_they_are():
    assert lasting(LEANING.replace(output_step=1e-3), 100.0).output_step == 1e-3
