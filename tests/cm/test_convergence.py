"""The Continuous Model tends to the rigid block whose floor can only push, at the order that its
contact says."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rockcheck.cm import ContinuousModel
from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Floor, Ricker, Scene, Sine, Wall, load_scene
from rockcheck.scenes.scene import PAPER_BLOCK

G = 9.81
CASES = Path(__file__).parents[1] / "data" / "unilateral_ricker_cases.csv"


def rms(history, theta):
    """RMS difference of theta from the array, in alpha."""
    rows = min(
        len(theta), len(history.channels["theta"])
    )  # one may overturn a step before the other
    return (
        float(np.sqrt(np.mean((history.channels["theta"][:rows] - theta[:rows]) ** 2)))
        / PAPER_BLOCK.alpha
    )


def rigid(scene):
    return EventBasedModel(pivot="unilateral").simulate(scene).channels["theta"]


def rocking(scene, tilt):
    """theta of a block that rocks without slip from rest at `tilt`, with Housner's impacts;
    adaptive steps to 1e-12."""
    radius, alpha = PAPER_BLOCK.radius, PAPER_BLOCK.alpha
    ratio = 1.0 - 1.5 * math.sin(alpha) ** 2

    def motion(t, q):
        side, lean = math.copysign(1.0, pivot), alpha - math.copysign(1.0, pivot) * q[0]
        u = float(scene.excitation.acceleration(t))
        return [q[1], 0.75 / radius * (u * math.cos(lean) - side * G * math.sin(lean))]

    def upright(_t, q):
        return q[0] * math.copysign(1.0, pivot)

    upright.terminal, upright.direction = True, -1
    grid = scene.output_times
    theta, start, q, pivot = np.zeros_like(grid), 0.0, [tilt, 0.0], tilt
    while start < grid[-1]:
        run = solve_ivp(
            motion,
            (start, grid[-1] + 1e-9),
            q,
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
            events=upright,
            dense_output=True,
        )
        inside = (grid >= start) & (grid <= run.t[-1])
        theta[inside] = run.sol(grid[inside])[0]
        start, q, pivot = run.t[-1], [0.0, ratio * run.y[1][-1]], -pivot
    return theta


def test_error_falls_with_the_penetration_in_rocking():
    scene = Scene(
        name="rocking",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.9),
        excitation=Sine(amplitude=1.0, period=0.7, cycles=4),
        initial_rotation=0.4 * PAPER_BLOCK.alpha,
        duration=3.0,
    )
    exact = rocking(scene, 0.4 * PAPER_BLOCK.alpha)
    errors = [
        rms(ContinuousModel(penetration=depth).simulate(scene), exact)
        for depth in (1e-6, 1e-7, 1e-8, 1e-9)
    ]
    orders = -np.diff(np.log10(errors))
    assert errors[-1] < 1e-7
    assert np.all(orders > 0.8), errors


def test_error_falls_with_the_duration_of_a_wall_contact():
    pulse = Ricker(
        amplitude=3.0 * G * math.tan(PAPER_BLOCK.alpha),
        period=2.0 * math.pi / (6.0 * PAPER_BLOCK.frequency_parameter),
    )
    walls = [Wall(side="left", gap=0.003, restitution=0.5)]
    scene = Scene(
        name="wall",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.6),
        walls=walls,
        excitation=pulse,
        duration=4.0,
    )
    exact = rigid(scene)
    errors = [
        rms(ContinuousModel(penetration=depth).simulate(scene), exact)
        for depth in (1e-5, 1e-7, 1e-9)
    ]
    orders = -np.diff(np.log10(errors)) / 2.0
    assert np.all(orders > 0.35), errors
    assert errors[-1] < 2e-4


def test_shorter_steps_change_nothing_that_matters():
    scene = load_scene("fig4a").replace(duration=8.0)
    short = ContinuousModel(time_step=1e-5).simulate(scene).channels["theta"]
    assert rms(ContinuousModel().simulate(scene), short) < 2e-6


@pytest.mark.parametrize("name", ["fig4a", "fig4b"])
def test_el_centro_without_a_wall(name):
    scene = load_scene(name).replace(duration=12.0)
    exact = rigid(scene)
    history = ContinuousModel().simulate(scene)
    assert rms(history, exact[:1600]) < 5e-6
    assert rms(history, exact) < 2e-5


def test_paper_rule_is_further_off():
    scene = load_scene("fig4a").replace(duration=12.0)
    exact = rigid(scene)
    paper, calibrated = (
        rms(ContinuousModel(stiffness=9e6, damping_rule=rule).simulate(scene), exact)
        for rule in ("paper", "calibrated")
    )
    assert paper > 5.0 * calibrated


@pytest.mark.parametrize("gap", [0.003, 0.053, 0.103])
@pytest.mark.parametrize("e", [0.0, 0.5])
@pytest.mark.parametrize(
    ("omega", "amplitude", "mu"), [(4.5, 2.5, 0.3), (6.0, 2.5, 0.6), (3.0, 1.8, 0.3)]
)
def test_pulses_beside_a_wall(gap, e, omega, amplitude, mu):
    period = 2.0 * math.pi / (omega * PAPER_BLOCK.frequency_parameter)
    scene = Scene(
        name="pulse",
        block=PAPER_BLOCK,
        floor=Floor(friction=mu),
        walls=[Wall(side="left", gap=gap, restitution=e)],
        excitation=Ricker(amplitude=amplitude * G * math.tan(PAPER_BLOCK.alpha), period=period),
        duration=4.0 * period + 3.0,
        output_step=0.001,
    )
    assert rms(ContinuousModel().simulate(scene), rigid(scene)) < 1e-3


def peak_errors(rows):
    """Errors of the peak rotation (alpha) where the block stays, and the rows whose outcome is
    another."""
    model, errors, missed = ContinuousModel(), [], []
    names = {"overturned left": "ccw", "overturned right": "cw"}
    for row in rows:
        period = 2.0 * math.pi / (float(row["wp_over_p"]) * PAPER_BLOCK.frequency_parameter)
        walls = (
            []
            if row["side"] == "none"
            else [Wall(side=row["side"], gap=float(row["gap"]), restitution=float(row["e_w"]))]
        )
        scene = Scene(
            name="case",
            block=PAPER_BLOCK,
            floor=Floor(friction=float(row["mu"])),
            walls=walls,
            excitation=Ricker(
                amplitude=float(row["ap_ratio"]) * G * math.tan(PAPER_BLOCK.alpha), period=period
            ),
            duration=4.0 * period + 8.0,
            output_step=0.0005,
        )
        history = model.simulate(scene)
        if names.get(history.outcome, "safe") != row["outcome"]:
            missed.append(row)
        elif row["outcome"] == "safe":
            errors.append(
                abs(history.peak_rotation / PAPER_BLOCK.alpha - float(row["peak_theta_over_alpha"]))
            )
    return np.array(errors), missed


def unambiguous_cases():
    rows = csv.DictReader(CASES.read_text().splitlines())
    return [row for row in rows if row["depends_on_rule"] == "0"]


def test_peaks_without_a_wall_are_those_of_the_unilateral_model():
    errors, missed = peak_errors([row for row in unambiguous_cases() if row["side"] == "none"])
    assert missed == []
    assert len(errors) == 19
    assert np.max(errors) < 1e-4


def test_peaks_beside_walls_are_those_of_the_unilateral_model():
    errors, missed = peak_errors(
        [row for row in unambiguous_cases() if row["side"] != "none"][::10]
    )
    assert missed == []
    assert len(errors) > 30
    assert np.median(errors) < 2e-5
    assert np.max(errors) < 1e-3


@pytest.mark.slow
def test_peaks_and_outcomes_of_all_cases():
    # Outcome missed in one: two corners strike 25 microseconds apart, which a contact of 0.1 ms
    # takes for one impact.
    errors, missed = peak_errors(unambiguous_cases())
    assert len(missed) <= 1
    assert len(errors) > 340
    assert np.percentile(errors, 95) < 5e-4
    assert np.sum(errors > 1e-3) <= 3
