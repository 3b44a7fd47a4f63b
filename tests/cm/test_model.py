"""The Continuous Model on scenes with a known answer; the engines share some."""

import math

import numpy as np
import pytest

from rockcheck import (
    Block,
    ContinuousModel,
    Floor,
    ModelFailure,
    Record,
    Ricker,
    Scene,
    Sine,
    Wall,
    load_scene,
)
from rockcheck.cm.grid import GRID
from rockcheck.scenes import PAPER_BLOCK, interpolation
from rockcheck.scenes.kinematics import energy

G = 9.81


#: A scene with what is changed in it.
scene = Scene(
    name="test", block=PAPER_BLOCK, floor=Floor(friction=0.3), duration=2.0, output_step=0.001
).replace


def strikes(history, kind):
    return [event for event in history.event_list if event.kind == kind]


# Settings


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        *(
            ({setting: value}, setting)
            for setting in ("penetration", "stiffness", "time_step")
            for value in (0.0, -1.0, math.inf, math.nan, "stiff")
        ),
        ({"damping_rule": "guess"}, "damping_rule"),
        ({"stiffness": 5e6, "penetration": 1e-6}, "stiffness"),
    ],
    ids=str,
)
def test_settings_are_validated(fault_of, settings, said):
    assert said in str(fault_of(ContinuousModel, **settings))


def test_stiffness_and_step_follow_from_the_penetration():
    still = scene(output_step=1.0)
    soft, stiff = ContinuousModel(penetration=1e-5), ContinuousModel(penetration=1e-7)
    assert stiff.stiffness_in(still) == pytest.approx(G / 1e-7)
    for model in (soft, stiff):
        longest = 3.0 / math.sqrt(model.stiffness_in(still))
        assert model.time_step_in(still) == GRID / math.ceil(GRID / longest)
    given = ContinuousModel(stiffness=5e6, time_step=1e-5)
    assert given.time_step_in(still) == pytest.approx(1e-5)
    assert (
        given.stiffness_in(still)
        == given.simulate(scene(duration=0.1)).settings["stiffness"]
        == 5e6
    )


# At rest


@pytest.mark.parametrize(
    "walls",
    [
        [],
        [Wall(side="left", gap=0.0, restitution=1.0), Wall(side="right", gap=0.0, restitution=0.5)],
    ],
)
def test_block_left_alone_stays(walls):
    history = ContinuousModel(penetration=1e-5).simulate(
        scene(duration=60.0, output_step=0.1, walls=walls)
    )
    assert history.outcome == "at rest"
    assert history.event_list == ()
    still = [history.channels[one] for one in ("x", "theta", "x_dot", "y_dot", "theta_dot", "slip")]
    np.testing.assert_allclose(still, 0.0, rtol=0.0, atol=1e-12)
    sunk = PAPER_BLOCK.half_height - history.channels["y"][1:]
    assert np.ptp(sunk) < 1e-12
    assert sunk[-1] == pytest.approx(5e-6, rel=1e-6)  # two corners share the weight


@pytest.mark.parametrize(
    ("penetration", "walls"), [(1e-5, []), (1e-7, [Wall(side="left", gap=0.0)])]
)
def test_block_shaken_below_slip_and_uplift_does_not_creep(penetration, walls):
    """Nor strike a wall at which it stands."""
    history = ContinuousModel(penetration=penetration).simulate(
        scene(
            floor=Floor(friction=0.2),
            walls=walls,
            excitation=Record.from_samples(
                0.9 * 0.2 * G * np.sin(np.arange(3000) * 0.1) + 0.05 * 0.2 * G, 0.02
            ),
            duration=61.0,
            output_step=0.005,
        )
    )
    assert np.max(np.abs(history.channels["slip"])) < penetration
    assert abs(history.channels["slip"][-1]) < 0.1 * penetration
    assert np.max(np.abs(history.channels["theta"])) < 2.0 * penetration / PAPER_BLOCK.half_width
    assert history.event_list == ()


# Friction


def test_static_friction_holds_until_its_own_limit():
    history = ContinuousModel().simulate(
        scene(
            floor=Floor(friction=0.1, static_friction=0.2),
            excitation=Record.from_samples([0.0, -0.3 * G], 3.0),
            duration=2.99,
        )
    )
    # u = 0.2 g at 2 s; from then on x'' = -u - mu_k g = 0.1 g (1 + tau).
    tau, slip = history.channels["t"] - 2.0, history.channels["slip"]
    assert np.max(np.abs(slip[tau < 0.0])) < 1e-7
    known = 0.1 * G * (tau**2 / 2.0 + tau**3 / 6.0)
    assert slip[tau > 0.05] == pytest.approx(known[tau > 0.05], rel=1e-3)


# Rocking


@pytest.mark.parametrize("mu", [0.2, 0.3, 0.6, 1.0])
def test_floor_impact_has_housners_ratio_and_does_not_slip(mu):
    history = ContinuousModel().simulate(
        scene(floor=Floor(friction=mu), initial_rotation=0.5 * PAPER_BLOCK.alpha)
    )
    c = history.channels
    e = energy(PAPER_BLOCK, G, c["y"], c["theta"], c["x_dot"], c["y_dot"], c["theta_dot"])
    times = np.array([event.t for event in strikes(history, "floor impact")])
    before, after = (e[np.searchsorted(c["t"], times + apart)] for apart in (-0.01, 0.01))
    assert np.sqrt(after / before) == pytest.approx(
        [1.0 - 1.5 * math.sin(PAPER_BLOCK.alpha) ** 2] * 2, abs=2e-6
    )
    assert np.max(np.abs(c["slip"])) < 2e-6


def test_uplift_asks_for_more_than_tan_alpha():
    pushes = (
        Record.from_samples([ratio * math.tan(PAPER_BLOCK.alpha) * G] * 2, 0.2)
        for ratio in (0.999, 1.1)
    )
    less, more = (
        ContinuousModel().simulate(scene(floor=Floor(friction=0.6), excitation=push, duration=0.2))
        for push in pushes
    )
    assert less.peak_rotation < 1e-7
    # theta'' = (3/(4R)) (u cos(alpha - theta) - g sin(alpha - theta)), to second order in the time
    assert more.peak_rotation == pytest.approx(
        0.75 / PAPER_BLOCK.radius * 0.1 * G * math.sin(PAPER_BLOCK.alpha) * 0.2**2 / 2.0, rel=0.05
    )


def test_energy_never_rises_without_excitation():
    history = ContinuousModel().simulate(
        scene(
            initial_rotation=-0.6 * PAPER_BLOCK.alpha,
            walls=[Wall(side="left", gap=0.02, restitution=1.0)],
            duration=5.0,
        )
    )
    c = history.channels
    e = energy(PAPER_BLOCK, G, c["y"], c["theta"], c["x_dot"], c["y_dot"], c["theta_dot"])
    assert len(strikes(history, "wall impact")) >= 3
    assert np.max(e[1:] - np.minimum.accumulate(e)[:-1]) < 1e-5 * e[0]


# Excitation


def test_vertical_acceleration_is_added_gravity():
    tilted = scene(initial_rotation=0.5 * PAPER_BLOCK.alpha, floor=Floor(friction=0.6))
    lifted, heavier = (
        ContinuousModel(stiffness=1e9).simulate(tilted.replace(**change)).channels["theta"]
        for change in (
            {"vertical": Record.from_samples([0.5 * G, 0.5 * G], 3.0)},
            {"gravity": 1.5 * G},
        )
    )
    assert lifted == pytest.approx(heavier, abs=1e-7)


# How a run ends


def test_blow_up_is_a_failure():
    """The paper's damping, constant whatever the contact, with a step far above what its stiffness
    stands."""
    shaken = scene(
        floor=Floor(friction=0.6),
        walls=(Wall(side="left", gap=0.05, restitution=0.5),),
        excitation=Ricker(amplitude=7.5, period=0.9),
        duration=3.2,
        output_step=0.04,
    )
    with pytest.raises(ModelFailure, match="blew up"):
        ContinuousModel(time_step=0.04, damping_rule="paper").simulate(shaken)


@pytest.mark.parametrize("step", [1e-3, 5e-3, 2e-2])
def test_steps_far_too_long_do_not_add_energy(step):
    tilted = scene(
        initial_rotation=0.5 * PAPER_BLOCK.alpha,
        floor=Floor(friction=0.6, restitution=0.5),
        output_step=0.02,
    )
    assert ContinuousModel(time_step=step).simulate(tilted).peak_rotation == pytest.approx(
        0.5 * PAPER_BLOCK.alpha
    )


def test_a_block_that_begins_with_less_energy_than_upright_falls():
    assert ContinuousModel().simulate(scene(initial_rotation=1.2)).outcome == "overturned left"


def test_endless_run_is_refused():
    with pytest.raises(ModelFailure, match="steps"):
        ContinuousModel(time_step=1e-12).simulate(scene())


def test_short_block_and_rattling_walls_come_to_an_end():
    small = scene(
        block=Block(half_width=0.05, half_height=0.04),
        floor=Floor(friction=0.3, restitution=0.9),
        walls=[
            Wall(side="left", gap=0.0, restitution=1.0),
            Wall(side="right", gap=0.001, restitution=1.0),
        ],
        excitation=Sine(amplitude=15.0, period=0.2, cycles=5),
        vertical=Sine(amplitude=12.0, period=0.11, cycles=8),
    )
    history = ContinuousModel().simulate(small)
    assert len(history.channels["t"]) == len(small.output_times)
    assert np.all(
        np.isfinite([channel for name, channel in history.channels.items() if name != "mode"])
    )


@pytest.mark.parametrize("name", ["fig4a", "fig5b"])
def test_named_scene_runs(name):
    shown, model = load_scene(name), ContinuousModel()
    history = model.simulate(shown)
    assert history.outcome == "at rest"
    assert bool(strikes(history, "wall impact")) == bool(shown.walls)
    assert np.array_equal(history.channels["t"], shown.output_times)
    assert history.cost.evaluations >= history.cost.steps > 36.0 / model.time_step_in(shown)
    assert np.all(np.diff([event.t for event in history.event_list]) >= 0.0)


def test_friction_that_may_jam_a_pivot_is_for_engines_alone(fault_of):
    fault = fault_of(ContinuousModel().simulate, scene(floor=Floor(friction=2.0)))
    assert fault.key == "floor.friction"
    assert "must be below 4/3" in str(fault)


def test_extremes_do_not_depend_on_the_rows():
    struck = scene(
        initial_rotation=-0.6 * PAPER_BLOCK.alpha,
        walls=[Wall(side="left", gap=0.02, restitution=0.4)],
        duration=2.0,
    )
    fine, coarse = (
        ContinuousModel().simulate(struck.replace(output_step=step)).extremes
        for step in (0.005, 0.0213)
    )
    assert fine == coarse
    assert fine.source == "model"
    assert fine.walls["left"].strikes > 0


def test_extremes_are_those_of_fine_rows():
    struck = scene(
        initial_rotation=-0.6 * PAPER_BLOCK.alpha,
        walls=[Wall(side="left", gap=0.02, restitution=0.4)],
        duration=2.0,
        output_step=1e-4,
    )
    history = ContinuousModel().simulate(struck)
    rows = interpolation.from_rows(
        history.channels, history.event_list, struck.block, history.outcome, struck.walls
    )
    found = history.extremes
    for name in ("rotation_left", "rotation_right", "slip", "reach_left", "top_displacement"):
        # Rows do not see that an impact lasts as long as they are apart.
        assert getattr(found, name) == pytest.approx(getattr(rows, name), rel=5e-4), name
    assert found.walls["left"].speed == pytest.approx(rows.walls["left"].speed, rel=1e-3)
