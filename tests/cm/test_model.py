"""The Continuous Model on scenes with a known answer."""

import csv
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from cm import ContinuousModel
from scenes import Block, Floor, InputError, ModelFailure, Record, Ricker, Scene, load_scene
from scenes.kinematics import energy

BLOCK = Block(half_width=0.397, half_height=1.555)
G = 9.81


def scene(**change):
    return Scene(**{"name": "test", "block": BLOCK, "floor": Floor(friction=0.3), "duration": 2.0, "output_step": 0.001} | change)


def kinds(history):
    return [event.kind for event in history.event_list]


def test_import_is_light():
    heavy = "numba", "pandas", "matplotlib", "mujoco", "pybullet"
    check = f"import sys, cm; sys.exit(','.join(set({heavy!r}) & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", check], capture_output=True, text=True).stderr.strip() == ""


@pytest.mark.parametrize("setting", ["penetration", "stiffness", "time_step"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.inf, math.nan, "stiff"])
def test_settings_are_validated(setting, value):
    with pytest.raises(InputError, match=setting):
        ContinuousModel(**{setting: value})


def test_stiffness_and_step_follow_from_the_penetration():
    soft, stiff = ContinuousModel(penetration=1e-5), ContinuousModel(penetration=1e-7)
    still = scene()
    assert stiff.stiffness_in(still) == pytest.approx(G / 1e-7)
    assert soft.time_step_in(still) == pytest.approx(10.0 * stiff.time_step_in(still), rel=0.01)
    assert ContinuousModel(stiffness=5e6, time_step=1e-5).stiffness_in(still) == 5e6
    assert ContinuousModel(stiffness=5e6, time_step=1e-5).time_step_in(still) == pytest.approx(1e-5)
    with pytest.raises(InputError, match="stiffness"):
        ContinuousModel(stiffness=5e6, penetration=1e-6)


@pytest.mark.parametrize("tilt", [0.0, -0.05])
def test_depth_under_own_weight_is_the_target_penetration(tilt):
    history = ContinuousModel(penetration=2e-6).simulate(scene(duration=0.2, initial_rotation=tilt))
    depth = BLOCK.half_height - history.channels["y"][-1]
    assert tilt or depth == pytest.approx(1e-6, rel=1e-3)  # two corners share the weight


def test_block_left_alone_stays():
    history = ContinuousModel(penetration=1e-5).simulate(scene(duration=60.0, output_step=0.1))
    assert history.outcome == "at rest"
    assert history.event_list == ()
    for channel in ("x", "theta", "x_dot", "y_dot", "theta_dot", "slip"):
        assert np.max(np.abs(history.channels[channel])) < 1e-12
    assert np.ptp(history.channels["y"][1:]) < 1e-12


def test_block_shaken_below_slip_and_uplift_does_not_creep():
    shaking = Record.from_samples(0.9 * 0.2 * G * np.sin(np.arange(3000) * 0.1) + 0.05 * 0.2 * G, 0.02)
    history = ContinuousModel(penetration=1e-5).simulate(scene(floor=Floor(friction=0.2), excitation=shaking, duration=61.0))
    assert np.max(np.abs(history.channels["slip"])) < 1e-5  # the spring's own stretch, mu times the penetration
    assert abs(history.channels["slip"][-1]) < 1e-6
    assert np.max(np.abs(history.channels["theta"])) < 1e-4


def test_slide_stops_where_coulomb_says():
    speed, mu = 0.5, 0.2
    history = ContinuousModel().simulate(scene(floor=Floor(friction=mu), initial_velocity=speed))
    assert history.channels["x"][-1] == pytest.approx(speed**2 / (2.0 * mu * G), rel=1e-4)
    assert history.outcome == "at rest"


def test_static_friction_holds_until_its_own_limit():
    ramp = Record.from_samples([0.0, -0.3 * G], 3.0)
    held = ContinuousModel().simulate(scene(floor=Floor(friction=0.1, static_friction=0.2), excitation=ramp, duration=2.99))
    t, slip = held.channels["t"], held.channels["slip"]
    start = 2.0  # u = 0.2 g
    assert np.max(np.abs(slip[t < start - 0.01])) < 1e-6
    after = t > start + 0.2
    tau = t[after] - start  # from then on x'' = -u - mu_k g = 0.1 g (1 + tau)
    assert slip[after] == pytest.approx(0.1 * G * (tau**2 / 2.0 + tau**3 / 6.0), rel=2e-3)


@pytest.mark.parametrize("mu", [0.2, 0.3, 0.6, 1.0])
def test_floor_impact_has_housners_ratio_and_does_not_slip(mu):
    history = ContinuousModel(penetration=1e-7).simulate(scene(floor=Floor(friction=mu), initial_rotation=0.5 * BLOCK.alpha))
    c = history.channels
    e = energy(BLOCK, G, c["y"], c["x_dot"], c["y_dot"], c["theta_dot"])
    ratio = 1.0 - 1.5 * math.sin(BLOCK.alpha) ** 2
    strikes = [event.t for event in history.event_list if event.kind == "floor impact"]
    assert len(strikes) == 2
    for t in strikes:
        before, after = np.searchsorted(c["t"], [t - 0.01, t + 0.01])
        assert math.sqrt(e[after] / e[before]) == pytest.approx(ratio, abs=5e-5)
    assert np.max(np.abs(c["slip"])) < 3e-5


def test_first_floor_impact_comes_at_housners_quarter_period_with_his_impulse():
    # theta'' = -p^2 sin(alpha - theta) from rest at `tilt`: w^2 = 2 p^2 (cos(alpha - tilt) - cos(alpha - theta)), theta = tilt (1 - z^2)
    tilt, alpha, p = 0.6 * BLOCK.alpha, BLOCK.alpha, math.sqrt(0.75 * G / BLOCK.radius)

    def spin(theta):
        return math.sqrt(2.0 * p * p * (math.cos(alpha - tilt) - math.cos(alpha - theta)))

    quarter = quad(lambda z: 2.0 * tilt * z / spin(tilt * (1.0 - z * z)), 0.0, 1.0, epsabs=1e-12)[0]
    history = ContinuousModel(penetration=1e-8).simulate(scene(floor=Floor(friction=0.6), initial_rotation=tilt, duration=quarter + 0.01))
    strike = history.event_list[0]
    assert strike.kind == "floor impact"
    assert strike.t == pytest.approx(quarter, abs=1e-5)
    impulse = BLOCK.radius * math.sin(alpha) * (2.0 - 1.5 * math.sin(alpha) ** 2) * spin(0.0)
    weight = G * 2e-3  # gathered with the impulse in its 2 ms
    assert strike.impulse == pytest.approx(impulse, abs=2.0 * weight)


def test_peaks_are_those_of_the_unilateral_model():
    path = Path(__file__).parents[1] / "data" / "unilateral_ricker_cases.csv"
    rows = [row for row in csv.DictReader(path.read_text().splitlines()) if row["side"] == "none" and row["outcome"] == "safe"]
    assert len(rows) == 19
    model = ContinuousModel(penetration=1e-7)
    for row in rows:
        period = 2.0 * math.pi / (float(row["wp_over_p"]) * BLOCK.frequency_parameter)
        pulse = Ricker(amplitude=float(row["ap_ratio"]) * G * math.tan(BLOCK.alpha), period=period)
        history = model.simulate(scene(floor=Floor(friction=float(row["mu"])), excitation=pulse, duration=4.0 * period + 5.0))
        assert history.peak_rotation / BLOCK.alpha == pytest.approx(float(row["peak_theta_over_alpha"]), abs=1e-3), row


def test_overturned_block_ends_the_run():
    history = ContinuousModel().simulate(scene(excitation=Ricker(amplitude=6.3, period=3.0), duration=20.0))
    assert history.outcome == "overturned left"
    assert kinds(history)[-1] == "overturned left"
    assert np.max(np.abs(history.channels["theta"])) < math.pi / 2
    assert history.channels["t"][-1] <= history.event_list[-1].t < history.channels["t"][-1] + 0.001 + 1e-9
    assert ContinuousModel().simulate(scene(excitation=Ricker(amplitude=-6.3, period=3.0), duration=20.0)).outcome == "overturned right"


def test_unstable_step_is_a_failure():
    with pytest.raises(ModelFailure, match="blew up"):
        ContinuousModel(stiffness=1e8, time_step=1e-3).simulate(scene(initial_rotation=0.05))


def test_endless_run_is_refused():
    with pytest.raises(ModelFailure, match="steps"):
        ContinuousModel(time_step=1e-12).simulate(scene())


@pytest.mark.parametrize("name", ["fig4a", "fig5b"])
def test_named_scene_runs(name):
    shown = load_scene(name)
    history = ContinuousModel().simulate(shown)
    assert history.outcome == "at rest"
    assert np.array_equal(history.channels["t"], shown.output_times)
    assert history.cost.steps > 1_000_000
    assert ("wall impact" in kinds(history)) == bool(shown.walls)
