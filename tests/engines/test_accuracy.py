"""How far the engines are from exact motions, and at which order they come nearer."""

import functools

import numpy as np
import pytest
from cases import UNAMBIGUOUS, free_rocking, peak_errors, pulse_scene
from paper_model import PaperModel

from rockcheck import (
    Block,
    EventBasedModel,
    Floor,
    MuJoCo,
    PyBullet,
    Scene,
    Wall,
    engines,
)
from rockcheck.engines import events
from rockcheck.scenes import PAPER_BLOCK

TILTS = (0.3, -0.4, 0.5, 0.6, 0.7, -0.8, 0.9)
#: Frequency in p, amplitude in g tan(alpha).
PULSES = ((3.0, 1.5), (5.0, 3.0), (6.0, 4.0), (4.5, -2.5), (3.8, 2.2))


@functools.cache
def exact(scene):
    return PaperModel(scene).run().at(scene.output_times)[:, 1]


def rotation_error(model, scene) -> float:
    apart = model.simulate(scene).channels["theta"] - exact(scene)
    return float(np.sqrt(np.mean(apart**2))) / scene.block.alpha


def median_error(model, scenes):
    """One run may be lucky by a factor of five: it is the median of several starts that falls with
    the step."""
    return np.median([rotation_error(model, scene) for scene in scenes])


@pytest.mark.slow_for("dart")
def test_fixed_steps_are_of_first_order(double_engine):
    coarse, fine = (
        median_error(double_engine(time_step=step), map(free_rocking, TILTS))
        for step in (2e-3, 2e-4)
    )
    assert fine < 2e-3
    assert 5.0 < coarse / fine < 30.0


@pytest.mark.slow_for("dart")
def test_adaptive_steps_are_of_third_order(varying_engine):
    scenes = [pulse_scene(*pulse, 1.0, duration=4.0) for pulse in PULSES]
    errors = {
        step: median_error(varying_engine(time_step="adaptive", largest_step=step), scenes)
        for step in (1.6e-2, 8e-3, 4e-3, 1e-3)
    }
    assert errors[1.6e-2] / errors[8e-3] > 5.0
    for step, most in ((8e-3, 1e-5), (4e-3, 3e-6), (1e-3, 1e-6)):
        assert errors[step] < most


def test_short_steps_at_impacts_are_few(varying_engine):
    scene, longest = free_rocking(0.7), 4e-3
    history = varying_engine(time_step="adaptive", largest_step=longest).simulate(scene)
    assert history.cost.steps < 1.1 * scene.duration / longest


@pytest.mark.slow_for("dart")
def test_the_error_follows_the_tolerance_of_a_step(varying_engine):
    scenes = [pulse_scene(*pulse, 1.0, duration=4.0) for pulse in PULSES]
    errors = {
        tolerance: median_error(varying_engine(tolerance=tolerance), scenes)
        for tolerance in (1e-5, 1e-7, 1e-9)
    }
    assert errors[1e-5] < 1e-4
    assert errors[1e-7] < errors[1e-5] / 10.0
    assert errors[1e-9] < errors[1e-7] / 3.0
    assert errors[1e-9] < 3e-7


@pytest.mark.slow_for("dart")
def test_a_tolerance_takes_fewer_steps_than_a_longest_one_for_the_same_error(varying_engine):
    scene = pulse_scene(*PULSES[1], 1.0, duration=4.0)
    runs = [varying_engine(**steps).simulate(scene) for steps in ({}, {"largest_step": 5e-4})]
    by_error, by_length = (
        float(np.sqrt(np.mean((run.channels["theta"] - exact(scene)) ** 2))) / scene.block.alpha
        for run in runs
    )
    assert by_error < max(3.0 * by_length, 1e-6)
    assert runs[0].cost.steps < 0.4 * runs[1].cost.steps


@pytest.mark.slow_for("dart")
def test_no_error_is_left_that_no_step_changes(varying_engine):
    """With impacts a hundred times as long, the error grows: neither the corners' size nor the
    table of the base motion shows."""
    scene = pulse_scene(1.96, 1.6, 1.0, duration=4.5)
    usual, long = (
        rotation_error(varying_engine(largest_step=5e-4, short_steps=k), scene) for k in (1, 100)
    )
    assert usual < 5e-8
    assert long / usual > 4.0


@pytest.mark.parametrize("stock", [MuJoCo, PyBullet], ids=lambda engine: engine.name)
def test_a_stock_engine_is_far_off(stock):
    """What "default" is there to show: contacts as they come do not get better with the step."""
    coarse, fine, best = (
        rotation_error(stock(**settings), free_rocking(0.7))
        for settings in (
            {"time_step": 1e-3, "settings": "default"},
            {"time_step": 2e-4, "settings": "default"},
            {"time_step": 2e-4},
        )
    )
    assert min(coarse, fine) > 2e-3
    assert best < 1e-3


@pytest.mark.slow_for("dart")
@pytest.mark.parametrize(
    ("every", "least", "bounds"),
    [
        (41, 7, {0.5: 2e-5, 1.0: 5e-4}),
        pytest.param(5, 60, {0.5: 1e-5, 0.95: 1.5e-4, 1.0: 1e-3}, marks=pytest.mark.slow),
    ],
)
def test_walls_and_slip(varying_engine, every, least, bounds):
    errors, missed = peak_errors(
        varying_engine(time_step="adaptive", largest_step=2e-3),
        UNAMBIGUOUS[::every],
        rest=20.0,
        output_step=1e-3,
    )
    assert missed == []
    assert len(errors) >= least
    for share, bound in bounds.items():
        assert np.quantile(errors, share) < bound


@pytest.mark.parametrize("step", [1e-4, "adaptive"])
def test_cone_correction(step):
    """MuJoCo's own cone lifts a slipping pivot at mu times its slip rate, whatever the step; 0.3162
    is exact here."""
    scene = pulse_scene(6.0, 3.0, 0.6, ("left", 0.053, 1.0), duration=2.0)
    mended, plain = (
        MuJoCo(time_step=step, **settings).simulate(scene).peak_rotation / scene.block.alpha
        for settings in ({}, {"cone_correction": False})
    )
    assert mended == pytest.approx(0.3162, abs=3e-4)
    assert plain == pytest.approx(0.400, abs=3e-3)


def test_a_block_that_slides_on_little_friction_stays_on_the_floor():
    scene = Scene(
        name="slide",
        block=Block(half_width=0.4, half_height=1.2),
        floor=Floor(friction=0.05),
        initial_velocity=0.5,
        duration=0.4,
    )
    lifts = [
        np.max(MuJoCo(time_step=1e-3, **settings).simulate(scene).channels["y"]) - 1.2
        for settings in ({}, {"cone_correction": False})
    ]
    assert lifts[0] < 1e-9
    assert lifts[1] > 1e-5


def theta_rms(one, other) -> float:
    return float(np.sqrt(np.mean((one.channels["theta"] - other.channels["theta"]) ** 2)))


@pytest.mark.parametrize("tilt", [0.6, 0.9])
def test_a_shorter_step_comes_nearer(single_engine, tilt):
    scene = free_rocking(tilt)
    reference = EventBasedModel(pivot="unilateral").simulate(scene)
    coarse, fine = (
        theta_rms(single_engine(time_step=step).simulate(scene), reference) / scene.block.alpha
        for step in (1e-3, 1e-4)
    )
    assert coarse < 3e-2
    assert fine < min(7e-3, 0.5 * coarse)


@pytest.mark.parametrize("settings", ["best", "default"])
def test_what_lies_on_its_side_ends_the_run(single_engine, settings):
    history = single_engine(time_step=1e-3, settings=settings).simulate(
        free_rocking(0.5, initial_angular_velocity=2.0, duration=9.0)
    )
    assert history.outcome == "overturned left"
    assert history.event_list[-1].kind == "overturned left"
    assert history.channels["t"][-1] < 5.0


@pytest.mark.parametrize("settings", ["best", "default"])
def test_where_the_mass_lies_is_known_or_refused(single_engine, settings, fault_of):
    scene = Scene(
        name="rack",
        block=Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.08, -0.25)),
        floor=Floor(friction=0.8),
        initial_rotation=0.1,
        duration=1.2,
    )
    model = single_engine(time_step=1e-4, settings=settings)
    if single_engine is engines.Jolt:
        assert "homogeneous" in str(fault_of(model.simulate, scene))
        return
    found, reference = (one.simulate(scene) for one in (model, EventBasedModel(pivot="unilateral")))
    assert theta_rms(found, reference) < 3e-2 * scene.block.alpha


@pytest.mark.parametrize("settings", ["best", "default"])
def test_a_run_twice_is_one_run(single_engine, settings):
    np.testing.assert_array_equal(
        *(
            single_engine(time_step=1e-3, settings=settings)
            .simulate(pulse_scene(2.6, 2.4, 0.3, duration=1.0))
            .channels["theta"]
            for _ in range(2)
        )
    )


def test_a_grain_is_braked_by_no_engine(single_engine):
    """At 500 R and 140 rad a second, in the air."""
    found = single_engine().simulate(
        Scene(
            name="grain",
            block=Block(half_width=4e-4, half_height=3e-4),
            floor=Floor(friction=0.0),
            initial_height=0.01,
            initial_velocity=0.3,
            initial_angular_velocity=140.0,
            duration=0.01,
        )
    )
    assert [found.channels[one][-1] for one in ("x_dot", "theta_dot")] == pytest.approx(
        [0.3 - 140.0 * 3e-4, 140.0], rel=1e-4
    )


@pytest.mark.needs("box2d")
def test_box2d_sleeps_through_a_pulse_as_it_comes():
    """A body that has come to rest does not wake when gravity changes; at its best it is near."""
    scene = pulse_scene(2.6, 2.4, 0.3, duration=2.5)
    reference = EventBasedModel(pivot="unilateral").simulate(scene)
    asleep, awake = (
        engines.Box2D(time_step=1e-3, settings=settings).simulate(scene)
        for settings in ("default", "best")
    )
    assert 1e4 * asleep.peak_rotation < scene.block.alpha < 5.0 * reference.peak_rotation
    assert theta_rms(awake, reference) < 2e-2 * scene.block.alpha


@pytest.mark.parametrize(
    ("rebound", "duration", "corners"), [(0.5, 0.4, 2), (0.0, 0.4, 2), (0.0, 0.19, 0)]
)
def test_an_impact_before_the_block_arrives_is_an_impact(rebound, duration, corners):
    scene = Scene(name="a", block=PAPER_BLOCK, floor=Floor(friction=0.3), duration=duration)
    t, turn = 1e-3 * np.arange(400), 200
    states = np.zeros((400, 6))
    after = rebound * 9.81 * 0.2 - (9.81 * (t - 0.2) if rebound else 0.0)
    states[:, 4] = np.where(np.arange(400) <= turn, -9.81 * t, after)
    fallen = np.concatenate([[0.0], np.cumsum(1e-3 * states[1:, 4])])
    states[:, 1] = PAPER_BLOCK.half_height + fallen - fallen[turn] + 1e-3  # by half a step early
    impacts = [
        event
        for event in events.events_of(scene, t, states, np.tile([0.0, -9.81], (399, 1)))
        if event.kind == "floor impact"
    ]
    assert [event.t for event in impacts] == pytest.approx([0.2] * corners, abs=2e-3)
    assert sum(event.impulse for event in impacts) == pytest.approx(
        0.5 * corners * (1.0 + rebound) * 9.81 * 0.2, rel=0.02
    )


@pytest.mark.parametrize("step", ["adaptive", 1e-4])
def test_extremes_do_not_depend_on_the_rows(step):
    struck = Scene(
        name="struck",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.4),
        walls=(Wall(side="left", gap=0.02, restitution=0.4),),
        initial_rotation=-0.6 * PAPER_BLOCK.alpha,
        duration=1.5,
    )
    fine, coarse = (
        MuJoCo(time_step=step).simulate(struck.replace(output_step=rows)).extremes
        for rows in (0.005, 0.02)
    )
    assert fine == coarse
    assert fine.source == "model"
    assert fine.walls["left"].strikes > 0
