"""Hand methods against the reference, each in its range."""

import math

import numpy as np
import pytest

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Block, Floor, Record, Rest, Scene, Sine
from rockcheck.validation import criteria

G = 9.81
BLOCKS = [(0.1, 0.6), (0.3, 1.0), (0.397, 1.555)]


def played(half_width, half_height, motion, *, friction=1.0, no_slip=False, **more):
    scene = Scene(
        name="block",
        block=Block(half_width=half_width, half_height=half_height),
        floor=Floor(friction=friction),
        excitation=motion,
        **{"duration": 30.0, "output_step": 0.05, **more},
    )
    law = "no-slip" if no_slip else "coulomb"
    return scene, EventBasedModel(friction=law, tolerance=1e-12).simulate(scene)


def fallen(half_width, half_height, motion):
    _, history = played(half_width, half_height, motion, no_slip=True)
    return history.outcome.startswith("overturned")


@pytest.mark.parametrize(("b", "h"), BLOCKS)
def test_a_step_of_velocity_overturns_from_its_criterion_on(b, h):
    length, velocity = 1e-4, criteria.overturning_velocity(Block(half_width=b, half_height=h), G)
    for ratio, falls in ((1.0, False), (1.0002, True)):
        pulse = Record.from_samples([ratio * velocity / length] * 2, length)
        assert fallen(b, h, pulse) is falls


def test_a_step_of_velocity_overturns_a_loaded_block():
    block = Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.1, 0.3), moment_of_inertia=0.4)
    velocity = criteria.overturning_velocity(block, G)
    for ratio, falls in ((0.999, False), (1.001, True)):
        # the weaker pivot is the right one: the base leaves to the left, the block stays behind
        pulse = Record.from_samples([-ratio * velocity / 1e-4] * 2, 1e-4)
        scene = Scene(
            name="loaded", block=block, floor=Floor(friction=0.5), excitation=pulse, duration=30.0
        )
        history = EventBasedModel(friction="no-slip", tolerance=1e-12).simulate(scene)
        assert history.outcome.startswith("overturned right") is falls


@pytest.mark.parametrize(("a", "v", "mu"), [(5.0, 0.3, 0.2), (9.0, 1.0, 0.35), (3.0, 0.5, 0.1)])
def test_newmarks_sliding_block(a, v, mu):
    _, history = played(2.0, 0.5, Record.from_samples([a, a], v / a), friction=mu)
    slip = np.max(np.abs(history.channels["slip"]))
    assert slip == pytest.approx(criteria.newmark_slip(v, a, mu * G), rel=1e-12)


def test_newmarks_sliding_block_that_is_held_or_without_friction():
    assert criteria.newmark_slip(1.0, 2.0, 2.0) == 0.0
    assert math.isinf(criteria.newmark_slip(1.0, 2.0, 0.0))


@pytest.mark.parametrize(("b", "h"), BLOCKS)
def test_uplift_and_sliding_begin_where_the_criteria_say(b, h):
    block = Block(half_width=b, half_height=h)
    uplift, slip = criteria.uplift_acceleration(block, G), criteria.slip_acceleration(0.05, G)
    for ratio, moves in ((1.0 - 1e-6, False), (1.0 + 1e-6, True)):
        pulse = Record.from_samples([ratio * uplift] * 2, 0.1)
        _, history = played(b, h, pulse)
        assert any(event.kind == "uplift" for event in history.event_list) is moves
        pulse = Record.from_samples([ratio * slip] * 2, 0.1)
        _, history = played(b, h, pulse, friction=0.05)
        assert any(event.kind == "slip" for event in history.event_list) is moves


def slender(alpha=0.02, half_height=1.0):
    block = Block(half_width=half_height * math.tan(alpha), half_height=half_height)
    return block, block.weaker_pivot.frequency_parameter(G)


@pytest.mark.parametrize("phase", [0.5, 1.0, 2.0])
def test_a_rectangular_pulse_overturns_a_slender_block(phase):
    block, p = slender()
    least = criteria.rectangular_pulse_ratio(phase / p, p) * G * block.alpha
    for ratio, falls in ((1.0, False), (1.0002, True)):
        pulse = Record.from_samples([ratio * least] * 2, phase / p)
        assert fallen(block.half_width, block.half_height, pulse) is falls


@pytest.mark.parametrize(
    ("ratio", "amplitude"), [(2.0, 2.349903), (4.0, 5.238964), (6.0, 9.416966), (8.0, 14.871352)]
)
def test_a_sine_overturns_without_impact_from_its_integral_on(ratio, amplitude):
    times = np.linspace(0.0, 2.0 * math.pi / ratio, 20001)
    for factor, falls in ((1.0 - 1e-6, False), (1.0 + 1e-6, True)):
        pulse = factor * amplitude * np.sin(ratio * times)
        assert criteria.overturns_without_impact(times, pulse) is falls


def test_a_base_that_is_too_slow_overturns_nothing():
    assert not criteria.overturns_without_impact([0.0, 1.0, 2.0], [0.0, 0.9, 0.0])


@pytest.fixture(scope="module")
def shaken():
    """A block and three motions of one sine, that rocks and slides."""
    motion = Sine(amplitude=5.0, period=0.6, cycles=3)
    return played(0.3, 1.0, motion, friction=0.35)


def test_what_comes_after_the_scenes_end_counts_for_nothing(shaken):
    late = Record.from_samples([0.0, 1.0, -1.0, 9.0], 0.5)
    scene = shaken[0].replace(excitation=late, vertical=late, duration=1.2)
    base = criteria.base_of(scene)
    assert (base.acceleration, base.vertical) == (pytest.approx(1.0), 1.0)
    whole = criteria.base_of(scene.replace(duration=1.5))
    assert (whole.acceleration, whole.vertical) == (pytest.approx(9.0), 9.0)


@pytest.mark.parametrize("vertical", [0.0, 0.5 * G])
def test_the_sliding_estimate_is_the_displacement_of_its_oscillator(shaken, vertical):
    scene, _ = shaken
    base = criteria.Base(criteria.base_of(scene).motion, vertical)
    slip = criteria.reserve_sliding(scene, base)
    capacity = 2.0 * 0.35 * (G - 0.4 * vertical)
    frequency = math.sqrt(capacity / slip) / (2.0 * math.pi)
    assert base.spectral(frequency, 0.10) == pytest.approx(capacity, rel=1e-3)
    assert base.spectral(0.8 * frequency, 0.10) < capacity


def test_a_block_without_weight_slides_without_end(shaken):
    scene, _ = shaken
    base = criteria.base_of(scene)
    assert math.isinf(criteria.reserve_sliding(scene, criteria.Base(base.motion, 3.0 * G)))


def test_the_rocking_estimate_grows_with_the_motion_until_it_overturns(shaken):
    scene, _ = shaken
    found = [
        criteria.reserve_rocking(one, criteria.base_of(one))
        for factor in (0.5, 0.75, 1.0, 10.0)
        for one in [scene.replace(excitation=scene.excitation.scaled(factor))]
    ]
    assert found == sorted(found)
    assert 0.0 < found[0] < scene.block.alpha
    assert math.isinf(found[-1])


def test_the_estimates_have_a_value_for_a_block_so_wide_that_it_does_not_rebound():
    """Housner's restitution is negative from b/h = sqrt(2) on."""
    pulse = Sine(amplitude=30.0, period=1.0, cycles=2)
    scene, _ = played(1.6, 1.0, pulse, friction=0.4, duration=4.0)
    base = criteria.base_of(scene)
    assert criteria.reserve_rocking(scene, base) > 0.0
    estimates = [criterion.says(scene, base)[1] for criterion in criteria.CRITERIA]
    assert all(estimate is None or estimate >= 0.0 for estimate in estimates)


@pytest.mark.parametrize("factor", [0.6, 1.0, 1.4])
def test_the_rocking_estimate_is_the_angle_whose_capacity_is_the_demand(shaken, factor):
    """Written out: frequency and damping by the formulas, the demand by the spectrum."""
    motion, block = shaken[0].excitation.scaled(factor), Block(half_width=0.24, half_height=0.8)
    scene = shaken[0].replace(excitation=motion, block=block)
    base = criteria.base_of(scene)
    a, h = block.half_width / block.half_height, block.half_height
    inertia = 4.0 / 3.0 * (1.0 + a**2)
    loss = -2.0 * math.log(1.0 - 2.0 * a**2 / inertia)
    damping = loss / math.sqrt(4.0 * math.pi**2 + loss**2)

    def holds(angle):
        work = math.cos(angle) + a * math.sin(angle) - 1.0
        hertz = math.sqrt(2.0 * scene.gravity * work / (inertia * angle**2 * h)) / math.tau
        return 2.0 * scene.gravity * work / angle >= base.spectral(hertz, damping)

    expected = next(filter(holds, block.alpha * np.arange(1, 21) / 20), math.inf)
    assert criteria.reserve_rocking(scene, base) == pytest.approx(expected)


def test_a_base_at_rest_moves_nothing():
    scene, _ = played(0.3, 1.0, Rest(), duration=1.0)
    base = criteria.base_of(scene)
    said = [criterion.says(scene, base) for criterion in criteria.CRITERIA]
    assert not any(event for event, _ in said)
    assert {estimate for _, estimate in said} <= {None, 0.0}


def test_every_criterion_names_its_event_and_source():
    for criterion in criteria.CRITERIA:
        assert criterion.event in ("uplifts", "slides", "overturns")
        assert criterion.source
        assert criterion.holds
