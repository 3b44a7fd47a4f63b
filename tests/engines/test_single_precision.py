"""Engines in single precision: how near they come, what they cannot do, and what they do as they
come."""

import numpy as np
import pytest

from rockcheck import engines
from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Block, Floor, InputError, Scene


def apart(one, other) -> float:
    """RMS of the difference of theta, rad."""
    return float(np.sqrt(np.mean((one.channels["theta"] - other.channels["theta"]) ** 2)))


@pytest.mark.parametrize("tilt", [0.6, 0.9])
def test_a_shorter_step_comes_nearer(single_engine, free_rocking, tilt):
    scene = free_rocking(tilt)
    reference = EventBasedModel(pivot="unilateral").simulate(scene)
    coarse, fine = (
        apart(single_engine(time_step=step).simulate(scene), reference) / scene.block.alpha
        for step in (1e-3, 1e-4)
    )
    assert coarse < 3e-2
    assert fine < min(7e-3, 0.5 * coarse)


def test_what_lies_on_its_side_ends_the_run(single_engine, free_rocking):
    scene = free_rocking(0.5).replace(initial_angular_velocity=2.0, duration=9.0)
    for settings in ("best", "default"):
        history = single_engine(time_step=1e-3, settings=settings).simulate(scene)
        assert history.event_list[-1].kind == history.outcome == "overturned left"
        assert history.channels["t"][-1] < 5.0


def test_where_the_mass_lies_is_known_or_refused(single_engine):
    rack = Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.08, -0.25))
    scene = Scene(
        name="rack", block=rack, floor=Floor(friction=0.8), initial_rotation=0.1, duration=1.2
    )
    if single_engine is engines.Jolt:
        with pytest.raises(InputError, match="homogeneous"):
            single_engine(time_step=1e-4).simulate(scene)
        return
    reference = EventBasedModel(pivot="unilateral").simulate(scene)
    for settings in ("best", "default"):
        found = single_engine(time_step=1e-4, settings=settings).simulate(scene)
        assert apart(found, reference) < 3e-2 * rack.alpha


@pytest.mark.parametrize("settings", ["best", "default"])
def test_a_run_twice_is_one_run(single_engine, settings, pulse):
    model = single_engine(time_step=1e-3, settings=settings)
    one, other = (model.simulate(pulse(2.4, 2.6, friction=0.3, duration=1.0)) for _ in range(2))
    np.testing.assert_array_equal(one.channels["theta"], other.channels["theta"])


@pytest.mark.needs("box2d")
def test_box2d_sleeps_through_a_pulse_as_it_comes(pulse):
    """A body that has come to rest does not wake when gravity changes; at its best it is near."""
    scene = pulse(2.4, 2.6, friction=0.3, duration=2.5)
    reference = EventBasedModel(pivot="unilateral").simulate(scene)
    asleep, awake = (
        engines.Box2D(time_step=1e-3, settings=settings).simulate(scene)
        for settings in ("default", "best")
    )
    assert asleep.peak_rotation < 1e-4 * scene.block.alpha
    assert reference.peak_rotation > 0.2 * scene.block.alpha
    assert apart(awake, reference) < 2e-2 * scene.block.alpha
