"""Pulses of other authors: the event core plays each as it plays a dense record of it, and engines
and the continuous model as their own method allows."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from rockcheck.ebm import EventBasedModel, overturning_spectrum
from rockcheck.ebm.core.ground import acceleration, fill_series, ground_of, next_exceedance
from rockcheck.ebm.spectrum import node_scene
from rockcheck.scenes import Block, Cosine, Floor, HalfSine, Record, Scene, Sine, Wall, Wavelet
from rockcheck.validation.execute.models import build

PULSES = [
    Sine(amplitude=5.0, period=0.8),
    Cosine(amplitude=5.0, period=0.8, cycles=2),
    HalfSine(amplitude=6.0, period=1.0),
    HalfSine(amplitude=-4.0, period=1.0),
    Wavelet(amplitude=7.0, period=0.8, gamma=2.2, phase=0.7),
    Wavelet(amplitude=-5.0, period=1.1, gamma=1.4),
]
every_pulse = pytest.mark.parametrize("pulse", PULSES, ids=lambda pulse: f"{pulse.kind}")
MODEL = EventBasedModel(pivot="unilateral")


def scene_under(pulse, **changes):
    return Scene(
        name="pulse",
        block=Block(half_width=0.3, half_height=1.0),
        floor=Floor(friction=0.5),
        walls=[Wall(side="left", gap=0.05, restitution=0.5)],
        excitation=pulse,
        duration=2.0,
        output_step=0.01,
    ).replace(**changes)


def sampled(pulse, count):
    times = np.linspace(0.0, pulse.quiet_after, count + 1)
    return Record.from_samples(pulse.acceleration(times), times[1])


def largest_difference(one, other):
    rows = min(len(one.channels["theta"]), len(other.channels["theta"]))
    return np.max(np.abs(one.channels["theta"][:rows] - other.channels["theta"][:rows]))


@every_pulse
def test_a_pulse_is_the_limit_of_its_records(pulse):
    """Straight lines between n samples are off by 1/n^2."""
    exact = MODEL.simulate(scene_under(pulse))
    coarse, fine = (
        largest_difference(exact, MODEL.simulate(scene_under(sampled(pulse, count))))
        for count in (500, 2000)
    )
    assert fine < 2e-4
    assert fine < 0.15 * coarse


@every_pulse
def test_its_series_is_that_of_its_acceleration(pulse):
    ground, coefficients, step = ground_of(pulse, 9.81, 0.3), np.zeros((1, 25)), 0.05
    for start in np.linspace(0.01, 0.9, 7) * pulse.quiet_after / 0.3:
        fill_series(ground, start, -2.0, 24, coefficients, 0)
        value = np.polyval(coefficients[0][::-1], step)
        assert value == pytest.approx(-2.0 * acceleration(ground, start + step), abs=1e-13)


@every_pulse
@pytest.mark.parametrize("limit", [0.1, 0.3])
def test_the_core_finds_when_it_leaves_its_limits(pulse, limit):
    """Against a look at 200,000 times."""
    ground = ground_of(pulse, 9.81, 1.0)
    times = np.linspace(0.0, pulse.quiet_after, 200_001)
    outside = np.abs(pulse.acceleration(times) / 9.81) > limit
    expected = times[np.argmax(outside)]
    found = next_exceedance(ground, 0.0, -limit, limit, 1e-13, 1e-9)
    assert found == pytest.approx(expected, abs=2.0 * times[1])


@every_pulse
def test_a_mirrored_pulse_gives_the_mirror_image(pulse):
    here = scene_under(pulse)
    there = here.replace(excitation=pulse.scaled(-1.0), walls=[here.walls[0].replace(side="right")])
    one, other = MODEL.simulate(here), MODEL.simulate(there)
    np.testing.assert_array_equal(one.channels["theta"], -other.channels["theta"])


@every_pulse
def test_the_continuous_model_plays_it(pulse):
    scene = scene_under(pulse, walls=[])
    difference = largest_difference(MODEL.simulate(scene), build("cm", {}).simulate(scene))
    assert difference < 2e-3 * scene.block.alpha


@every_pulse
@pytest.mark.parametrize(
    "engine", ["mujoco", pytest.param("pymunk", marks=pytest.mark.needs("pymunk"))]
)
def test_an_engine_plays_it(pulse, engine):
    scene = scene_under(pulse)
    difference = largest_difference(MODEL.simulate(scene), build(engine, {}).simulate(scene))
    assert difference < 1e-4 * scene.block.alpha


@every_pulse
def test_a_spectrum_plays_its_nodes(pulse):
    """As the scene of a node, played alone."""
    scene = scene_under(pulse)
    spectrum = overturning_spectrum(scene, [1.0, 3.0], [1.5, 6.0])
    for row, amplitude in enumerate(spectrum.amplitude_ratios):
        for column, frequency in enumerate(spectrum.frequency_ratios):
            alone = spectrum.model.simulate(node_scene(scene, amplitude, frequency))
            falls = alone.outcome.startswith("overturned")
            assert falls == bool(spectrum.outcomes[row, column])


def test_the_least_half_sine_that_overturns_is_that_of_the_linear_equations():
    """A slender block that does not slip.

    theta'' = p^2 (theta - alpha + alpha r sin(omega t)), from rest at the uplift. theta + theta'/p
    grows as exp(p t), and beyond alpha at the pulse's end the block falls.
    """
    scene = Scene(
        name="slender",
        block=Block(half_width=0.05, half_height=1.0),
        floor=Floor(friction=1.0),
        duration=10.0,
        output_step=0.1,
    )
    p, omega = scene.frequency_parameter, 2.0 * math.pi

    def beyond(ratio):
        start = math.asin(1.0 / ratio) / omega
        times = np.linspace(start, 0.5, 20_001)
        push = p * ratio * np.sin(omega * times) * np.exp(-p * (times - start))
        return np.trapezoid(push, times) - 1.0

    least = brentq(beyond, 1.01, 60.0)
    uplift = scene.gravity * math.tan(scene.block.alpha)
    model = EventBasedModel(friction="no-slip")
    outcomes = [
        model.simulate(
            scene.replace(excitation=HalfSine(amplitude=factor * least * uplift, period=1.0))
        ).outcome
        for factor in (0.97, 1.03)
    ]
    assert not outcomes[0].startswith("overturned")
    assert outcomes[1] == "overturned left"
