"""ebm-bouc-wen: the regularised friction (9) against an independent stiff integration, the exact
model and its own limits."""

import math
from pathlib import Path

import numpy as np
import pytest
from cases import pulse_scene
from scipy.integrate import solve_ivp
from stepping import TILTED, assert_contacts_hold, run_at

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.core import bouc_wen as law
from rockcheck.ebm.core.names import Pivot, Row
from rockcheck.scenes import (
    PAPER_BLOCK,
    Block,
    Floor,
    Record,
    Ricker,
    Scene,
    Sine,
    Wall,
    kinematics,
    load_scene,
)

FAULTS = Path(__file__).parents[1] / "data" / "found_faults"
G = 9.81


def bouc_wen(scene, yield_displacement=1e-5, **settings):
    return EventBasedModel(
        friction="bouc-wen", yield_displacement=yield_displacement, **settings
    ).simulate(scene)


def peak(history):
    return history.peak_rotation / history.alpha


def test_the_paper_s_yield_displacement_is_not_converged_but_smaller_ones_converge_at_first_order():
    scene = pulse_scene(4.5, 4.0, 0.3, duration=10.0, output_step=0.001)
    exact = peak(EventBasedModel().simulate(scene))
    coarse, paper, fine, finest = (peak(bouc_wen(scene, u)) for u in (1e-4, 1e-5, 1e-6, 1e-7))
    assert exact == pytest.approx(0.3216, abs=1e-4)
    assert paper == pytest.approx(0.330, abs=1e-4)
    assert abs(coarse - exact) > 2.0 * abs(paper - exact)
    orders = np.log10([(paper - exact) / (fine - exact), (fine - exact) / (finest - exact)])
    assert np.all((orders > 0.8) & (orders < 1.2)), orders


def integrated(scene, yield_displacement, z, t_end):
    """(7), (8) and (9) with z for d in SI units, integrated by an implicit Runge-Kutta method from
    the scene's initial state."""
    block, mu, spin = scene.block, scene.floor.friction, math.copysign(1.0, scene.initial_rotation)
    x, _, theta, v, _, w = scene.initial_state

    def rates(t, q):
        _, theta, v, w, z = q
        s, c = math.sin(block.alpha - abs(theta)), math.cos(block.alpha - abs(theta))
        u, eta = float(scene.excitation.acceleration(t)), mu * spin * z
        gravity = G + float(scene.vertical.acceleration(t)) - block.radius * c * w * w
        force = gravity / (1.0 + 3.0 * s * s + 3.0 * eta * s * c)
        slip = v + block.radius * c * w
        z_rate = (-0.5 * abs(slip) * z * abs(z) - 0.5 * slip * z * z + slip) / yield_displacement
        return v, w, -mu * z * force - u, -3.0 / block.radius * spin * (s + eta * c) * force, z_rate

    return solve_ivp(
        rates,
        (0.0, t_end),
        (x, theta, v, w, z),
        method="Radau",
        rtol=1e-10,
        atol=1e-13,
        t_eval=scene.output_times[: int(t_end / 0.005) + 1],
    )


@pytest.mark.parametrize(
    ("slip", "vertical"), [(0.6, 0.0), pytest.param(-0.4, 4.0, marks=pytest.mark.slow)]
)
def test_slip_yield_and_stick_agree_with_an_implicit_integration(slip, vertical):
    scene = pulse_scene(
        4.5,
        1.0,
        0.3,
        initial_rotation=0.12,
        initial_velocity=slip,
        vertical=Ricker(amplitude=vertical, period=0.7),
        output_step=0.005,
    )
    history = bouc_wen(scene, 1e-3, tolerance=1e-12)
    landing = next(event.t for event in history.event_list if event.kind == "floor impact")
    reference = integrated(scene, 1e-3, math.copysign(1.0, slip), 0.99 * landing)
    assert {event.kind for event in history.event_list if event.t < landing} >= {"stick"}
    found = [history.channels[name] for name in ("x", "theta", "x_dot", "theta_dot")]
    apart = np.array(found)[:, : reference.t.size] - reference.y[:4]
    assert np.max(np.abs(apart), axis=1) == pytest.approx(0.0, abs=2e-7)


def test_tolerance_controls_the_error_of_the_steps():
    scene = pulse_scene(4.5, 4.0, 0.3, duration=4.0)
    *runs, truth = (
        bouc_wen(scene, tolerance=tolerance).channels["theta"]
        for tolerance in (1e-7, 1e-9, 1e-11, 1e-14)
    )
    errors = [np.max(np.abs(theta - truth)) for theta in runs]
    assert errors[2] < 1e-6 * PAPER_BLOCK.alpha
    assert errors[2] < 0.1 * errors[1] < 0.01 * errors[0]


@pytest.mark.parametrize("mu", [0.2, 0.25])
def test_flat_sliding_tends_to_the_exact_model_with_the_root_of_the_yield_displacement(mu):
    # After each reversal the friction turns only while the base slips some u_y, which takes a time
    # of sqrt(u_y/acceleration).
    scene = pulse_scene(4.5, 2.0, mu, duration=10.0)
    exact = EventBasedModel().simulate(scene)
    histories = [bouc_wen(scene, u) for u in (1e-4, 1e-5, 1e-6)]
    errors = np.array([np.max(np.abs(h.channels["x"] - exact.channels["x"])) for h in histories])
    assert {(h.peak_rotation, h.outcome) for h in (exact, *histories)} == {(0.0, "at rest")}
    assert errors[:-1] / errors[1:] == pytest.approx(math.sqrt(10.0), rel=0.05)


@pytest.mark.parametrize("name", ["fig4a", "fig5a"])
def test_el_centro_tends_to_the_exact_model(name):
    scene = load_scene(name)
    runs = [EventBasedModel().simulate(scene), bouc_wen(scene), bouc_wen(scene, 1e-6)]
    exact, paper, fine = map(peak, runs)
    assert abs(paper - exact) < 2e-3
    assert abs(fine - exact) < 0.3 * abs(paper - exact)
    assert {one.outcome for one in runs} == {"at rest"}


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_walls_hold_the_block_and_the_motion_tends_to_the_exact_one(side, restitution):
    scene = pulse_scene(3.0, 3.0, 0.3, (side, 0.053, restitution), duration=10.0)
    exact, fine = EventBasedModel().simulate(scene), bouc_wen(scene, 1e-7)
    assert "wall impact" in {e.kind for e in fine.event_list}
    assert_contacts_hold(scene, fine)
    assert fine.outcome == exact.outcome
    lift = kinematics.pivot_height(PAPER_BLOCK, fine.channels["y"], fine.channels["theta"])
    assert np.max(np.abs(lift)) < 1e-12
    apart = (fine.channels["theta"] - exact.channels["theta"])[:600]
    assert np.max(np.abs(apart)) < 2e-3 * PAPER_BLOCK.alpha


def test_a_block_that_leans_on_the_wall_stays():
    tall = Block(half_width=0.3, half_height=1.5)
    tilt = 1.5 * tall.alpha
    gap = tall.radius * (math.sin(tall.alpha + tilt) - math.sin(tall.alpha - tilt))
    history = bouc_wen(
        Scene(
            name="leaning",
            block=tall,
            floor=Floor(friction=0.9),
            walls=[Wall(side="left", gap=gap)],
            initial_rotation=tilt,
            duration=3.0,
        )
    )
    assert set(history.channels["mode"]) == {"lean"}
    assert history.cost.rules == {}
    assert history.channels["theta"] == pytest.approx(tilt, abs=1e-4)


@pytest.mark.parametrize(("z", "winds", "left"), [(0.9, True, 0.9), (1.0 - 1e-12, False, 1.0)])
def test_a_pivot_has_yielded_where_z_has_come_to_one(z, winds, left):
    run = run_at(**TILTED, sense=1, slip=1, pivot=Pivot.SLIPPING)
    run.state.winds, run.state.order, run.a[Row.Z, :2] = True, 2, (z, 0.0)
    law.advance(run)
    assert run.state.winds == winds
    assert run.state.zeta == left


def test_beyond_painleve_the_sign_of_the_push_that_is_wrong_by_least_goes_on():
    """On a wall, friction 1.333 is beyond Painleve's limit: neither a push nor a pull of the floor
    solves the equations."""
    scene = Scene(
        name="painleve",
        block=Block(half_width=1.1228, half_height=1.0681),
        floor=Floor(friction=1.333),
        walls=[
            Wall(side="left", gap=0.20385, restitution=0.0),
            Wall(side="right", gap=0.64593, restitution=0.53577),
        ],
        excitation=Record.from_samples([9.3] * 8 + [9.4] * 8 + [12.0] * 6, 0.0622598),
        initial_angular_velocity=1.74098,
        initial_velocity=1.400567,
        gravity=4.300029,
        duration=1.3,
    )
    history = bouc_wen(scene, yield_displacement=1.54969e-3)
    assert history.cost.rules["least contradiction"] > 0
    assert_contacts_hold(scene, history, 1e-9 * scene.block.radius)


#: Just where a block slips as it tips, z is +-1 but for rounding, and no tilt grows: it slides when
#: Coulomb's does, not later.
SLOPE = [
    Scene(
        name=f"friction of {share} slopes",
        block=Block(half_width=0.25, half_height=1.0),
        floor=Floor(friction=0.25 * share),
        excitation=Sine(amplitude=3.2, period=2.0, cycles=1),
        duration=3.0,
        output_step=0.01,
    )
    for share in (1.0, 1.0 + 2e-16, 1.0 + 1e-9)
]
#: Nothing but the wall pushes a weightless block off it. Friction that a resting block has left
#: would turn it, from an instant that rounding chooses.
WEIGHTLESS = [
    Scene(
        name=f"weightless with its mass at {offset}",
        block=Block(half_width=0.5, half_height=1.0, centre_of_mass=(offset, 0.0)),
        floor=Floor(friction=0.6),
        walls=[Wall(side="left", gap=0.0)],
        excitation=Ricker(amplitude=-0.5, period=0.5),
        vertical=Record.from_samples(np.full(201, -1.0), 0.01),
        duration=2.0,
        gravity=1.0,
    )
    for offset in (-0.375, 0.0, 0.2)
]


@pytest.mark.parametrize(
    ("scene", "moves", "apart"),
    [(one, 0.01, 1e-10) for one in SLOPE] + [(one, 0.03, 1e-12) for one in WEIGHTLESS],
    ids=[one.name for one in SLOPE + WEIGHTLESS],
)
def test_a_block_slides_as_with_coulombs_friction_without_a_turn(scene, moves, apart):
    exact, smooth = EventBasedModel().simulate(scene), bouc_wen(scene)
    assert np.max(np.abs(exact.channels["x"])) > moves
    np.testing.assert_allclose(smooth.channels["x"], exact.channels["x"], rtol=0.0, atol=apart)
    assert smooth.peak_rotation == 0.0
    assert smooth.cost.rules == {}
    assert [event.kind for event in smooth.event_list] == [event.kind for event in exact.event_list]


def test_a_slide_that_is_rounding_does_not_choose_the_side_to_which_a_block_tips():
    scene = load_scene(FAULTS / "rests-but-for-rounding-as-gravity-vanishes.toml")
    assert [one.peak_rotation for one in (EventBasedModel().simulate(scene), bouc_wen(scene))] == [
        0.0,
        0.0,
    ]
