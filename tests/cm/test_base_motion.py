"""The base's velocity against the integral of its acceleration."""

import numpy as np
import pytest
from scipy.integrate import quad

from rockcheck import Cosine, Record, Rest, Ricker, Scene
from rockcheck.cm.base_motion import base_of, base_velocity, mean_acceleration
from rockcheck.scenes import PAPER_BLOCK, Floor

SAMPLES = [1.0, -2.0, 0.5, 3.0]
STEP = 0.1


def motion_of(excitation, duration=2.0):
    scene = Scene(
        name="base",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.3),
        excitation=excitation,
        vertical=Record.from_samples([0.5, 0.5], 10.0),
        duration=duration,
        output_step=0.1,
    )
    return base_of(scene)


@pytest.mark.parametrize("t", [0.0, 0.03, 0.1, 0.17, 0.25, 0.2999, 0.3, 0.7])
def test_velocity_is_the_integral_of_the_straight_lines(t):
    velocity = base_velocity(motion_of(Record.from_samples(SAMPLES, STEP)).horizontal, t)
    times = np.unique([0.0, *STEP * np.arange(4), min(t, 0.3)])
    times = times[times <= t]
    expected = np.trapezoid(np.interp(times, STEP * np.arange(4), SAMPLES), times)
    assert velocity == pytest.approx(expected, abs=1e-14)


def test_a_base_at_rest_has_no_velocity():
    assert base_velocity(motion_of(Rest()).horizontal, 1.3) == 0.0


def test_the_vertical_motion_is_the_scenes():
    assert base_velocity(motion_of(Rest()).vertical, 1.5) == pytest.approx(0.75)


@pytest.mark.parametrize("t", [0.2, 1.1, 1.9])
@pytest.mark.parametrize(
    "pulse",
    [Ricker(amplitude=3.0, period=0.6), Cosine(amplitude=2.0, period=0.8, cycles=2)],
    ids=lambda pulse: pulse.kind,
)
def test_velocity_of_a_pulse(pulse, t):
    expected, _ = quad(lambda at: float(pulse.acceleration(np.array([at]))[0]), 0.0, t, limit=200)
    assert base_velocity(motion_of(pulse).horizontal, t) == pytest.approx(expected, abs=1e-7)


def test_a_pulse_that_jumps_has_its_last_sample_at_the_jump():
    pulse = Cosine(amplitude=2.0, period=0.7, cycles=2)
    motion = motion_of(pulse).horizontal
    assert (len(motion.samples) - 1) / motion.rate == pytest.approx(1.4, rel=1e-12)
    assert motion.samples[-1] == pytest.approx(2.0)
    assert motion.rate == pytest.approx(16384 / 0.7)


def test_a_pulse_has_so_many_samples_a_period():
    motion = motion_of(Ricker(amplitude=3.0, period=0.6), duration=0.5).horizontal
    assert motion.rate == pytest.approx(16384 / 0.6, rel=1e-14)
    assert len(motion.samples) / motion.rate == pytest.approx(0.5, abs=3.0 / motion.rate)


def test_mean_acceleration_is_the_gain_of_velocity():
    motion = motion_of(Record.from_samples(SAMPLES, STEP)).horizontal
    # Halfway between the first two samples, on a straight line.
    assert mean_acceleration(motion, 0.04, 0.02) == pytest.approx(-0.5)
