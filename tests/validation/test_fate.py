"""The fate of a block goes beyond the end of its history."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import PAPER_BLOCK, Floor, Ricker, Scene, Wall
from rockcheck.validation.execute.fate import decided, fate_of

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
