"""Hand methods against the reference, each in its range."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rockcheck import Block, EventBasedModel, Floor, Record, Rest, Scene, Sine
from rockcheck.validation import criteria

G = 9.81
BLOCKS = [Block(half_width=b, half_height=h) for b, h in ((0.1, 0.6), (0.3, 1.0), (0.397, 1.555))]


def shaken(block, motion, friction=1.0, duration=30.0):
    return Scene(
        name="block",
        block=block,
        floor=Floor(friction=friction),
        excitation=motion,
        duration=duration,
        output_step=0.05,
    )


def played(scene, law="coulomb"):
    return EventBasedModel(friction=law, tolerance=1e-12).simulate(scene)


#: It rocks and slides.
SCENE = shaken(BLOCKS[1], Sine(amplitude=5.0, period=0.6, cycles=3), friction=0.35)
BASE = criteria.base_of(SCENE)


def check_overturns(block, velocity, length, side="left", near=(1.0, 1.0002)):
    """A pulse of the base to that side, which reaches `velocity` in `length` s, is just enough."""
    push = (1.0 if side == "left" else -1.0) * velocity / length
    stands, falls = (
        played(shaken(block, Record.from_samples([ratio * push] * 2, length)), "no-slip").outcome
        for ratio in near
    )
    assert not stands.startswith("overturned")
    assert falls == f"overturned {side}"


@pytest.mark.parametrize(
    ("block", "side", "near"),
    [
        *((block, "left", (1.0, 1.0002)) for block in BLOCKS),
        # The weaker pivot is the right one: the base leaves to the left, the block stays behind.
        (
            BLOCKS[1].replace(centre_of_mass=(0.1, 0.3), moment_of_inertia=0.4),
            "right",
            (0.999, 1.001),
        ),
    ],
)
def test_a_step_of_velocity_overturns_from_its_criterion_on(block, side, near):
    check_overturns(block, criteria.overturning_velocity(block, G), 1e-4, side, near)


@pytest.mark.parametrize("phase", [0.5, 1.0, 2.0])
def test_a_rectangular_pulse_overturns_a_slender_block(phase):
    slender = Block(half_width=math.tan(0.02), half_height=1.0)
    p = slender.weaker_pivot.frequency_parameter(G)
    least = criteria.rectangular_pulse_ratio(phase / p, p) * G * slender.alpha
    check_overturns(slender, least * phase / p, phase / p)


@pytest.mark.parametrize(("a", "v", "mu"), [(5.0, 0.3, 0.2), (9.0, 1.0, 0.35), (3.0, 0.5, 0.1)])
def test_newmarks_sliding_block(a, v, mu):
    flat = Block(half_width=2.0, half_height=0.5)
    slip = played(shaken(flat, Record.from_samples([a, a], v / a), mu)).channels["slip"]
    cases = ((a, mu * G), (a, a), (a, 0.0), (0.0, 0.0))
    assert [criteria.newmark_slip(v, *case) for case in cases] == [
        pytest.approx(np.max(np.abs(slip)), rel=1e-12),
        0.0,
        math.inf,
        0.0,
    ]


@pytest.mark.parametrize(("ratio", "moves"), [(1.0 - 1e-6, False), (1.0 + 1e-6, True)])
@pytest.mark.parametrize(("kind", "friction", "k"), [("uplift", 1.0, 0), ("slip", 0.05, 1)])
@pytest.mark.parametrize(
    "block",
    # of the last one the weaker pivot is the right one, and the base moves to the right
    [*BLOCKS, BLOCKS[1].replace(centre_of_mass=(0.1, 0.0), moment_of_inertia=0.3)],
)
def test_uplift_and_sliding_begin_where_the_criteria_say(block, kind, friction, k, ratio, moves):
    uplift, slip = G * block.pivot("left").arm / block.pivot("left").height, friction * G
    scene = shaken(block, Record.from_samples([ratio * min(uplift, slip)] * 2, 0.1), friction)
    assert any(event.kind == kind for event in played(scene).event_list) is moves
    assert criteria.CRITERIA[k].says(scene, criteria.base_of(scene)) == (moves, None)


@pytest.mark.parametrize("criterion", criteria.CRITERIA, ids=lambda criterion: criterion.name)
def test_every_criterion_names_its_event_its_source_and_where_it_holds(criterion):
    assert criterion.event in ("uplifts", "slides", "overturns")
    assert criterion.source
    assert criterion.holds


@pytest.mark.parametrize(
    ("ratio", "amplitude"), [(2.0, 2.349903), (4.0, 5.238964), (6.0, 9.416966), (8.0, 14.871352)]
)
@pytest.mark.parametrize(("factor", "falls"), [(1.0 - 1e-6, False), (1.0 + 1e-6, True)])
def test_a_sine_overturns_without_impact_from_its_integral_on(ratio, amplitude, factor, falls):
    times = np.linspace(0.0, 2.0 * math.pi / ratio, 20001)
    pulse = factor * amplitude * np.sin(ratio * times)
    assert criteria.overturns_without_impact(times, pulse) is falls
    assert not criteria.overturns_without_impact(times, 0.9 * pulse / np.max(pulse))
    # Two samples: it begins between them, where (1 - 1/k) (1 + k exp(2/k - 2)) = 1 in the limit.
    assert criteria.overturns_without_impact([0.0, 2.0], [0.0, 2.3430686875 * factor]) is falls


@pytest.mark.parametrize(("duration", "peak"), [(1.2, 1.0), (1.5, 9.0)])
def test_what_comes_after_the_scenes_end_counts_for_nothing(duration, peak):
    late = Record.from_samples([0.0, 1.0, -1.0, 9.0], 0.5)
    base = criteria.base_of(SCENE.replace(excitation=late, vertical=late, duration=duration))
    assert base.acceleration == pytest.approx(peak)
    assert base.vertical == peak


@pytest.mark.parametrize("vertical", [0.0, 0.5 * G])
def test_the_sliding_estimate_is_the_displacement_of_its_oscillator(vertical):
    slip = criteria.reserve_sliding(SCENE, replace(BASE, vertical=vertical))
    capacity = 2.0 * 0.35 * (G - 0.4 * vertical)
    frequency = math.sqrt(capacity / slip) / (2.0 * math.pi)
    assert BASE.spectral(frequency, 0.10) == pytest.approx(capacity, rel=1e-3)
    assert BASE.spectral(0.8 * frequency, 0.10) < capacity
    assert math.isinf(criteria.reserve_sliding(SCENE, replace(BASE, vertical=3.0 * G)))


@pytest.mark.parametrize("factor", [0.5, 0.6, 0.75, 1.0, 1.4, 10.0])
def test_the_rocking_estimate_is_the_angle_whose_capacity_is_the_demand(factor):
    a, h = 0.24 / 0.8, 0.8
    block = Block(half_width=a * h, half_height=h)
    scene = SCENE.replace(excitation=SCENE.excitation.scaled(factor), block=block)
    base = criteria.base_of(scene)
    inertia = 4.0 / 3.0 * (1.0 + a**2)
    loss = -2.0 * math.log(1.0 - 2.0 * a**2 / inertia)
    damping = loss / math.sqrt(4.0 * math.pi**2 + loss**2)

    def holds(angle):
        work = math.cos(angle) + a * math.sin(angle) - 1.0
        hertz = math.sqrt(2.0 * G * work / (inertia * angle**2 * h)) / math.tau
        return 2.0 * G * work / angle >= base.spectral(hertz, damping)

    expected = next(filter(holds, block.alpha * np.arange(1, 21) / 20), math.inf)
    assert math.isinf(expected) == (factor == 10.0)
    said = expected / block.alpha if factor > 0.5 else 0.0  # below, the base lifts no corner
    assert criteria.reserve_rocking(scene, base) == pytest.approx(expected)
    assert criteria.CRITERIA[-1].says(scene, base) == (factor == 10.0, pytest.approx(said))


@pytest.mark.parametrize("criterion", criteria.CRITERIA, ids=lambda criterion: criterion.event)
def test_a_base_at_rest_moves_nothing_and_of_a_wide_block_each_estimate_is_a_number(criterion):
    """Housner's restitution is negative from b/h = sqrt(2) on: such a block does not rebound."""
    still = shaken(BLOCKS[1], Rest(), duration=1.0)
    happens, estimate = criterion.says(still, criteria.base_of(still))
    assert not happens
    assert (estimate or 0.0) == 0.0
    scene = shaken(
        Block(half_width=1.6, half_height=1.0), Sine(amplitude=30.0, period=1.0, cycles=2), 0.4, 4.0
    )
    assert (criterion.says(scene, criteria.base_of(scene))[1] or 0.0) >= 0.0
    assert criteria.reserve_rocking(scene, criteria.base_of(scene)) > 0.0


@pytest.mark.parametrize(("start", "end"), [(1e-3, 1.0), (1e-6, 0.5), (0.5, 1.0), (0.9, 1.0)])
@pytest.mark.parametrize("block", BLOCKS)
def test_time_from_balance_is_that_of_the_pendulum_upside_down(block, start, end):
    """phi'' = p^2 sin(phi) from rest, stepped through; angles in alpha."""
    pivot = block.weaker_pivot
    p, first, last = pivot.frequency_parameter(G), start * pivot.alpha, end * pivot.alpha

    def arrives(t, state):
        return state[0] - last

    arrives.terminal = True
    found = solve_ivp(
        lambda t, state: [state[1], p * p * math.sin(state[0])],
        (0.0, 60.0),
        [first, 0.0],
        "DOP853",
        rtol=1e-13,
        atol=1e-18,
        events=arrives,
    )
    assert criteria.time_from_balance(pivot, G, first, last) == pytest.approx(found.t[-1], rel=1e-9)


@pytest.mark.parametrize("tilt", [1.0, 1.2])
def test_from_its_balance_or_beyond_a_block_does_not_fall_back(tilt):
    pivot = BLOCKS[0].weaker_pivot
    assert criteria.quarter_period(pivot, G, tilt * pivot.alpha) == math.inf


@pytest.mark.parametrize("end", [1e-3, 1e-6])
def test_near_the_balance_the_time_is_that_of_the_linear_pendulum(end):
    """p t = acosh(end/start), whose digits a small angle must not cost."""
    pivot, start = BLOCKS[0].weaker_pivot, 0.3 * end
    linear = math.acosh(end / start) / pivot.frequency_parameter(G)
    found = criteria.time_from_balance(pivot, G, start, end)
    assert found == pytest.approx(linear, rel=0.2 * end**2 + 1e-14)


def test_a_cube_leaves_its_balance_in_the_time_of_the_card():
    cube = Block(half_width=0.413, half_height=0.413).weaker_pivot
    start = 1e-3 * cube.alpha
    assert criteria.time_from_balance(cube, G, start, cube.alpha) == pytest.approx(2.145, abs=5e-4)


def test_the_critical_double_impulse_is_the_step_over_one_and_the_ratio():
    for block in BLOCKS:
        ratio = 1.0 - 1.5 * math.sin(block.alpha) ** 2
        assert criteria.critical_double_impulse(block, G) == pytest.approx(
            criteria.overturning_velocity(block, G) / (1.0 + ratio), rel=1e-14
        )


def step_at(frequency):
    """A base whose spectrum is large from a frequency on, and zero below it."""
    return SimpleNamespace(vertical=0.0, spectral=lambda f, _: 1e6 if f >= frequency else 0.0)


@pytest.mark.parametrize("frequency", [0.0512, 0.5, 7.3])
def test_the_sliding_estimate_is_of_the_lowest_frequency_that_reaches_its_capacity(frequency):
    capacity = 2.0 * SCENE.floor.friction * SCENE.gravity
    slip = capacity / (2.0 * math.pi * frequency) ** 2
    assert criteria.reserve_sliding(SCENE, step_at(frequency)) == pytest.approx(slip, rel=1e-3)


@pytest.mark.parametrize(("share", "falls"), [(1.001, False), (0.999, True)])
def test_the_rocking_estimate_ends_at_the_balance_point(share, falls):
    """The demand ceases at a frequency just above, or just below that of alpha."""
    block, g = SCENE.block, SCENE.gravity
    slope = block.half_width / block.half_height
    inertia = 4.0 / 3.0 * (1.0 + slope**2)
    work = 1.0 / math.cos(block.alpha) - 1.0
    rate = math.sqrt(2.0 * g * work / (inertia * block.half_height)) / block.alpha
    found = criteria.reserve_rocking(SCENE, step_at(share * rate / (2.0 * math.pi)))
    assert found == (math.inf if falls else pytest.approx(block.alpha))
