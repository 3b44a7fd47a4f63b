"""How sure a figure is: u_num on problems with a known answer, draws of inputs, repeats,
verdicts."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from rockcheck import (
    Block,
    ContinuousModel,
    EventBasedModel,
    Floor,
    InputError,
    MuJoCo,
    Ricker,
    Scene,
    Wall,
)
from rockcheck.commands.cli import main
from rockcheck.ebm.batch import pack, run_batch
from rockcheck.scenes.experience import Experience, Range, Trust, axes_of, expected, outside
from rockcheck.scenes.files import load_scene, load_uncertain_scene
from rockcheck.scenes.observation import observe
from rockcheck.validation.discrepancy.measured import mean_history, shifted, time_shift
from rockcheck.validation.suite.confidence import explanations
from rockcheck.validation.suite.experience import bias_and_scatter
from rockcheck.validation.suite.runner import run_suite
from rockcheck.validation.suite.suites import load_suite
from rockcheck.validation.suite.verdicts import junit, markdown
from rockcheck.validation.uncertainty import verdict
from rockcheck.validation.uncertainty.numerical import Numerical, Quantity, numerical_uncertainty
from rockcheck.validation.uncertainty.population import Inputs, Interval, propagate, sensitivities

BOOKCASE = Scene(
    name="bookcase",
    block=Block(half_width=0.397, half_height=1.555),
    floor=Floor(friction=0.3),
    walls=[Wall(side="left", gap=0.053, restitution=0.0)],
    excitation=Ricker(amplitude=3.5, period=1.5),
    duration=6.0,
)
UNCERTAIN = """
duration = 4.0
[block]
half_width = 0.397
half_height = 1.555
[floor]
friction = { value = 0.5, sd = 0.05 }
[[walls]]
side = "left"
gap = { low = 0.05, high = 0.06 }
[excitation]
kind = "ricker"
amplitude = { value = 6.0, sd = 0.2, distribution = "lognormal" }
period = 1.0
"""
FIVE = """
duration = 6.0
[block]
half_width = 0.397
half_height = 1.555
[floor]
friction = { value = 0.4, sd = 0.04 }
[[walls]]
side = "left"
gap = { value = 0.053, sd = 0.01 }
restitution = { low = 0.2, high = 0.6 }
[excitation]
kind = "ricker"
amplitude = { value = 5.0, sd = 0.4, distribution = "lognormal" }
period = { value = 1.2, sd = 0.1 }
"""


@dataclass(frozen=True)
class Made:
    """A model whose rotation is sin t times a factor that depends on its step: exactly 1 for a step
    of zero."""

    factor: object
    step: float = 1e-3
    falls: object = field(default=lambda step: False)

    def coarser(self, factor):
        return replace(self, step=factor * self.step)

    def simulate(self, scene):
        t = scene.output_times
        state = np.zeros((len(t), 6))
        state[:, 2] = 0.5 * scene.block.alpha * np.sin(t) * self.factor(self.step)
        state[:, 1] = scene.block.radius * np.cos(scene.block.alpha - np.abs(state[:, 2]))
        outcome = "overturned left" if self.falls(self.step) else "moving"
        return observe(scene, "made", state, outcome=outcome)


def judged(model):
    """What is said of each quantity of the made model, by name."""
    return {q.name: q for q in numerical_uncertainty(model, BOOKCASE).quantities}


@pytest.mark.parametrize("order", [0.52, 0.6, 1.0, 2.0, 2.5])
def test_the_largest_change_bounds_the_error_where_it_falls_like_a_power_of_the_step(order):
    found = judged(Made(lambda h: 1.0 + 0.01 * (h / 1e-3) ** order))
    for name, error in (("peak_rotation", 0.005), ("theta_rms", 0.005 / math.sqrt(2.0))):
        assert found[name].verdict == "converged"
        assert found[name].order == pytest.approx(order, abs=1e-6)
        assert found[name].u_num == pytest.approx(1.25 * error * (4.0**order - 1.0), rel=0.05)
        assert found[name].u_num > error


def test_an_order_too_low_gets_the_larger_factor():
    found = judged(Made(lambda h: 1.0 + 0.01 * (h / 1e-3) ** 0.48))
    assert found["peak_rotation"].order == pytest.approx(0.48, abs=1e-6)
    for name in ("peak_rotation", "theta_rms"):  # by the largest change of any history
        assert found[name].u_num == pytest.approx(3.0 * 0.005 * (4.0**0.48 - 1.0), rel=1e-3)


@pytest.mark.parametrize(
    ("at", "u_num"),
    [
        ({1: 0.0, 2: 1e-3, 3: 2e-3, 4: 3e-3}, 1.25 * 3e-3),  # they grow with the step
        ({1: 0.0, 2: 1e-3, 3: 1e-3, 4: 3e-3}, 1.25 * 3e-3),
        ({1: 0.0, 2: 1e-3, 3: 0.9e-3, 4: 3e-3}, 3.0 * 3e-3),  # at 3h less than at 2h
        ({1: 0.0, 2: 1e-3, 3: 3.1e-3, 4: 3e-3}, 3.0 * 3.1e-3),  # at 3h more than at 4h
        ({1: 0.0, 2: 0.0, 3: 2e-3, 4: 0.0}, 3.0 * 2e-3),  # h, 2h and 4h agree by chance
        ({1: 0.0, 2: 0.0, 3: 2e-3, 4: 3e-3}, 3.0 * 3e-3),
        ({1: 0.0, 2: 0.0, 3: 0.0, 4: 0.0}, 0.0),
    ],
)
def test_the_run_at_3h_tells_convergence_from_chance(at, u_num):
    found = judged(Made(lambda h: 1.0 + 2.0 * at[round(h / 1e-3)]))
    missed = 0.5 * BOOKCASE.output_step**2 / 8.0  # of the top of a sine, by its rows
    assert found["peak_rotation"].u_num == pytest.approx(math.hypot(u_num, missed), rel=1e-3)


@dataclass(frozen=True)
class Tolerant:
    """A model with a tolerance: its rotation is sin t times one and the tolerance."""

    tolerance: float = 1e-2

    def finer(self):
        return Tolerant(1e-2 * self.tolerance)

    def simulate(self, scene):
        return Made(lambda step: 1.0 + self.tolerance).simulate(scene)


def test_of_a_tolerance_the_change_at_a_hundredth_of_it_counts():
    """F = 1.25 times the change: of 0.5 alpha sin t by 0.0099 of it."""
    found = numerical_uncertainty(Tolerant(), BOOKCASE)
    change = 0.5 * 0.99e-2 * np.sin(BOOKCASE.output_times)
    assert found.converged
    assert found.u_num("theta_rms") == pytest.approx(1.25 * math.sqrt(np.mean(change**2)), rel=1e-9)
    assert found.u_num("peak_rotation") == pytest.approx(1.25 * np.max(change), rel=1e-9)
    assert found.u_num("outcome") == 0.0


def test_what_is_small_is_so_beside_the_block():
    """Rotations are small in alpha, slips in alpha R, times in 1/p."""
    from rockcheck.validation.uncertainty.numerical import _units

    alpha, radius = math.atan2(0.397, 1.555), math.hypot(0.397, 1.555)
    step_units = {"alpha": 1.0, "m": alpha * radius, "s": math.sqrt(4.0 * radius / (3.0 * 9.81))}
    assert _units(BOOKCASE) == pytest.approx(step_units, rel=1e-12)


@pytest.mark.parametrize(
    ("at", "converged"),
    [
        ({1: 0.0, 2: 0.099, 3: 0.2, 4: 0.3}, True),  # they converge: how far 2h is from h decides
        ({1: 0.0, 2: 0.101, 3: 0.2, 4: 0.3}, False),
        ({1: 0.0, 2: 0.05, 3: 0.099, 4: 0.05}, True),  # they do not: any of them
        ({1: 0.0, 2: 0.05, 3: 0.101, 4: 0.05}, False),
        ({1: 0.0, 2: 0.101, 3: 0.05, 4: 0.05}, False),
    ],
)
def test_histories_that_part_are_refused(at, converged):
    found = judged(Made(lambda h: 1.0 + 2.0 * at[round(h / 1e-3)]))
    for name in ("theta_rms", "peak_rotation", "last_slip"):
        assert (found[name].verdict == "converged") == converged
        assert (found[name].u_num is not None) == converged
        assert ("the histories part" in found[name].reason) != converged
    assert found["outcome"].verdict == "converged"


@dataclass(frozen=True)
class Slid(Made):
    """The same, with a slip of up to `slid` alpha R half-way, back at 0 in the end."""

    slid: object = field(default=lambda step: 0.0)

    def simulate(self, scene):
        history = super().simulate(scene)
        slip = np.zeros(len(scene.output_times))
        slip[len(slip) // 2] = self.slid(self.step) * scene.block.alpha * scene.block.radius
        return replace(history, channels={**history.channels, "slip": slip})


def test_a_last_slip_that_all_runs_share_is_as_sure_as_its_history():
    """And where the histories do not converge, as sure as theta is."""
    unit = BOOKCASE.block.alpha * BOOKCASE.block.radius
    found = judged(Slid(lambda h: 1.0 + h, slid=lambda h: 10.0 * h))
    assert found["last_slip"].value == 0.0
    assert found["last_slip"].u_num == pytest.approx(1.25 * 0.03 * unit)
    assert found["peak_rotation"].u_num == pytest.approx(1.25 * 0.5 * 0.003, rel=0.05)
    assert found["last_slip"].order == pytest.approx(1.0)
    found = judged(Slid(lambda h: 1.0 + 0.02 * (h == 3e-3)))
    assert found["last_slip"].u_num == pytest.approx(3.0 * 0.01 * unit, rel=1e-3)
    found = judged(Slid(lambda h: 1.0, slid=lambda h: 0.02 * (h == 3e-3)))
    assert found["peak_rotation"].u_num == pytest.approx(3.0 * 0.02, rel=1e-3)
    assert found["theta_rms"].u_num == pytest.approx(3.0 * 0.02, rel=1e-3)


@pytest.mark.parametrize(("late", "u_num"), [(0, 0.0), (1, 1.25 * 3.0), (-1, 1.25 * 3.0)])
def test_the_time_of_a_fall_is_that_of_its_changes_and_of_a_row(late, u_num):
    """It falls so many rows later or sooner with each unit of the step."""

    class Falls(Made):
        def simulate(self, scene):
            history = super().simulate(scene)
            rows = 600 + late * round(self.step / 1e-3)
            channels = {name: column[:rows] for name, column in history.channels.items()}
            return replace(history, channels=channels)

    found = judged(Falls(lambda h: 1.0, falls=lambda h: True))
    assert set(found) == {"theta_rms", "end_time", "outcome"}
    expected = math.hypot(u_num, 1.0) * BOOKCASE.output_step
    assert found["end_time"].u_num == pytest.approx(expected, rel=1e-9)


def test_a_slip_pinned_at_the_gap_is_not_taken_for_sure():
    """At h, 2h and 4h the slip ends at the wall's gap, 0.03993 m; at a sixteenth of the step it
    ends at 0.0323 m."""
    scene = Scene(
        name="slip-pinned-at-the-gap",
        block=Block(half_width=0.5241724288392692, half_height=1.6786164824612813),
        floor=Floor(friction=0.6391840254239421),
        walls=[Wall(side="left", gap=0.03993290995372752, restitution=0.3)],
        excitation=Ricker(amplitude=10.024828601389073, period=0.5975031779950043),
        duration=3.2637445324945724,
    )
    found = numerical_uncertainty(MuJoCo(time_step=4e-4), scene)
    truth = MuJoCo(time_step=2.5e-5).simulate(scene)
    sought = {
        "last_slip": truth.channels["slip"][-1],
        "peak_rotation": truth.peak_rotation / scene.block.alpha,
    }
    for name, value in sought.items():
        (quantity,) = (q for q in found.quantities if q.name == name)
        assert quantity.u_num is None or abs(quantity.value - value) <= quantity.u_num < 0.1


def test_small_changes_get_the_larger_factor():
    found = judged(Made(lambda h: 1.0 + 1e-4 * math.cos(1e4 * h)))
    values = [0.5 * 1e-4 * math.cos(1e4 * h) for h in (1e-3, 2e-3, 3e-3, 4e-3)]
    change = max(abs(value - values[0]) for value in values)
    assert found["peak_rotation"].u_num == pytest.approx(3.0 * change, rel=1e-3)


def test_an_outcome_that_changes_with_the_step_is_not_converged():
    found = numerical_uncertainty(Made(lambda h: 1.0, falls=lambda h: h > 3.5e-3), BOOKCASE)
    assert not found.converged
    assert all(q.verdict == "not converged" and q.u_num is None for q in found.quantities)
    assert found.reasons == (
        "the outcome changes with the step: stands, stands, stands, left at h, 2h, 3h, 4h",
    )


def test_a_model_without_a_step_is_not_judged():
    assert numerical_uncertainty(object(), BOOKCASE) is None


def test_the_interval_covers_as_often_as_it_says():
    """Errors a h + b h^1.5 + c h^2 with random signs, and powers with noise: at least 95 % of the
    intervals hold the truth."""
    chance = np.random.default_rng(5)
    inside = told = 0
    for k in range(400):
        a, b, c, d = 0.02 * chance.standard_normal(4)
        if k % 2:
            error = {n: a * n + 0.5 * b * n**1.5 + 0.25 * c * n**2 for n in (1, 2, 3, 4)}
        else:
            order = chance.uniform(0.9, 2.0)
            noise = chance.standard_normal(4)
            error = {n: 0.02 * n**order + 0.1 * d * noise[n - 1] for n in (1, 2, 3, 4)}
        made = Made(lambda h, e=error: 1.0 + e[round(h / 1e-3)])
        u = numerical_uncertainty(made, BOOKCASE).u_num("peak_rotation")
        if u is not None:
            told += 1
            inside += abs(0.5 * error[1]) <= u
    assert told > 300
    assert inside / told >= 0.95


def test_event_based_and_continuous_models_are_within_their_own_error():
    scene = BOOKCASE.replace(
        excitation=Ricker(amplitude=3.0, period=1.0), floor=Floor(friction=0.6), duration=4.0
    )
    truth = EventBasedModel(pivot="unilateral", tolerance=1e-13).simulate(scene)
    for model in (
        EventBasedModel(pivot="unilateral", tolerance=1e-6),
        ContinuousModel(penetration=1e-7),
    ):
        found, history = numerical_uncertainty(model, scene), model.simulate(scene)
        assert found.converged
        error = abs(history.peak_rotation - truth.peak_rotation) / BOOKCASE.block.alpha
        assert error <= found.u_num("peak_rotation") + 1e-12


# --- what is not known about the inputs


@pytest.fixture
def uncertain(tmp_path):
    path = tmp_path / "shelf.toml"
    path.write_text(UNCERTAIN, encoding="utf-8")
    return path


def test_a_scene_file_says_what_is_not_known(uncertain):
    given = load_uncertain_scene(uncertain)
    assert load_scene(uncertain) == given.scene
    assert given.names == ("floor.friction", "walls.left.gap", "excitation.amplitude")
    assert given.scene.wall("left").gap == pytest.approx(0.055)
    values = given.values(np.random.default_rng(1).random((20000, 3)))
    np.testing.assert_allclose(values.mean(axis=0), [0.5, 0.055, 6.0], rtol=2e-3)
    np.testing.assert_allclose(values.std(axis=0), [0.05, 0.01 / math.sqrt(12.0), 0.2], rtol=2e-2)
    assert given.at(values[0]).floor.friction == values[0, 0]


def test_correlated_numbers(uncertain):
    uncertain.write_text(
        UNCERTAIN + '[correlation]\n"floor.friction, excitation.amplitude" = 0.8\n',
        encoding="utf-8",
    )
    values = load_uncertain_scene(uncertain).values(np.random.default_rng(1).random((20000, 3)))
    assert np.corrcoef(values.T)[0, 2] == pytest.approx(0.8, abs=0.02)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("sd = 0.05", "sd = -0.05", "floor.friction.sd: -0.05 is not allowed"),
        (
            "value = 0.5, sd",
            "valu = 0.5, sd",
            "floor.friction.valu: unknown key; did you mean 'value'?",
        ),
        ("value = 0.5, sd", "sd", "floor.friction.value: is missing beside sd"),
        (
            "low = 0.05, high",
            "low = 0.07, high",
            "walls.left.gap.high: 0.06 is not allowed: must be more than low, 0.07",
        ),
        ('"lognormal"', '"gamma"', "excitation.amplitude.distribution"),
        ("value = 6.0", "value = -6.0", "a lognormal number is positive"),
        (
            "period = 1.0",
            'period = 1.0\n[correlation]\n"floor.frction, walls.left.gap" = 0.1',
            "did you mean 'floor.friction'?",
        ),
        (
            "period = 1.0",
            'period = 1.0\n[correlation]\n"floor.friction, walls.left.gap" = 1.5',
            "give a number between -1 and 1",
        ),
    ],
)
def test_faults_of_the_file_are_one_line(uncertain, old, new, said):
    uncertain.write_text(UNCERTAIN.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as fault:
        load_uncertain_scene(uncertain)
    assert said in str(fault.value)
    assert "\n" not in str(fault.value)


@pytest.mark.long
def test_draws_agree_with_many_more_draws(uncertain):
    given = load_uncertain_scene(uncertain)
    few, many = (
        propagate(given, samples=n, seed=seed, indices=False) for n, seed in ((256, 1), (2048, 7))
    )
    (a, b), (c, d) = ((f.low, f.high) for f in (few.inputs.figures[0], many.inputs.figures[0]))
    assert abs(a - c) < 0.05
    assert abs(b - d) < 0.05
    assert few.bands.shape == (5, len(few.t))
    assert np.all(np.diff(few.bands, axis=0) >= 0.0)
    assert few.inputs.u_input("peak_rotation") > 0.0
    assert propagate(given, samples=256, seed=1, indices=False).inputs == few.inputs


def test_a_scene_without_uncertain_numbers_is_refused():
    with pytest.raises(InputError, match="no number of this scene is uncertain"):
        propagate(load_uncertain_scene("fig4a"))


def test_sobol_indices_of_a_free_slide(tmp_path):
    """A block that slides to rest: the peak rotation does not vary, and no index is made up."""
    path = tmp_path / "slide.toml"
    block = "duration = 1.0\ninitial_velocity = 0.1\n[block]\nhalf_width = 1.0\nhalf_height = 0.5\n"
    path.write_text(block + "[floor]\nfriction = { value = 0.3, sd = 0.01 }\n", encoding="utf-8")
    assert sensitivities(load_uncertain_scene(path), EventBasedModel(), samples=16) == ()


@pytest.mark.slow
def test_sobol_indices_agree_with_brute_force(tmp_path):
    """The bookcase with five uncertain numbers: 100,000 draws, means within bins and numbers drawn
    again one at a time."""
    path, model, draws, again = (
        tmp_path / "bookcase.toml",
        EventBasedModel(pivot="unilateral", tolerance=1e-8),
        100_000,
        20_000,
    )
    path.write_text(FIVE, encoding="utf-8")
    given = load_uncertain_scene(path)
    chance = np.random.default_rng(5)

    def peaks(points):
        scenes = [given.at(row) for row in given.values(points)]
        return np.minimum(
            run_batch(pack(scenes, model), model, until_decided=False).peak / BOOKCASE.block.alpha,
            1.0,
        )

    points = chance.random((draws, len(given.names)))
    found = peaks(points)
    indices = {row.name: row for row in sensitivities(given, model)}
    assert set(indices) == set(given.names)
    for k, name in enumerate(given.names):
        inside = [found[(points[:, k] * 50).astype(int) == n] for n in range(50)]
        first = np.var([np.mean(one) for one in inside]) - np.mean(
            [np.var(one, ddof=1) / len(one) for one in inside]
        )
        other = points[:again].copy()
        other[:, k] = chance.random(again)
        total = 0.5 * np.mean((found[:again] - peaks(other)) ** 2)
        assert indices[name].first == pytest.approx(first / np.var(found), abs=0.06)
        assert indices[name].total == pytest.approx(total / np.var(found), abs=0.06)


def test_the_interval_of_the_share_that_falls_covers(uncertain):
    """Of few draws it holds what many say, and so does the interval of the draws' own peaks, as
    often as they should."""
    given = load_uncertain_scene(uncertain)
    many = propagate(given, samples=8192, seed=99, indices=False)
    (peak, *_), share = many.inputs.figures, many.inputs.overturns.value
    falls, peaks = 0, []
    for seed in range(60):
        few = propagate(given, samples=32, seed=seed, indices=False)
        falls += few.inputs.overturns.low <= share <= few.inputs.overturns.high
        peaks.append(np.mean((peak.low <= few.peaks) & (few.peaks <= peak.high)))
    assert falls / 60 >= 0.9
    assert (
        many.inputs.figures[0].high == 1.0
    )  # some fall, and count as 1: then only the lower end leaves draws out
    assert np.mean(peaks) == pytest.approx(0.975, abs=0.01)


# --- repeats of a test


def swing(scale=1.0, delay=0.0):
    t = np.linspace(0.0, 4.0, 401)
    state = np.zeros((401, 6))
    state[:, 2] = (
        0.1 * scale * np.exp(-4.0 * (t - 1.2 - delay) ** 2) * np.cos(3.0 * (t - 1.2 - delay))
    )
    return observe(BOOKCASE.replace(duration=4.0, output_step=0.01), "measured", state)


def test_a_shift_in_time_is_found():
    for delay in (0.0, 0.35, 1.0):
        assert time_shift(swing(), swing(delay=delay)) == pytest.approx(-delay, abs=2e-3)
    assert shifted(swing(), 0.5).channels["t"][0] == 0.5
    with pytest.raises(InputError, match="no rotation"):
        time_shift(swing(), swing(scale=0.0))


def test_the_interval_of_a_mean_covers_as_often_as_it_says():
    chance = np.random.default_rng(3)
    inside = 0
    for _ in range(400):
        mean = mean_history([swing(scale) for scale in 1.0 + 0.1 * chance.standard_normal(4)])
        truth = swing().peak_rotation
        inside += abs(mean.peak_rotation - truth) <= mean.uncertainty["peak_rotation"]
    assert 0.92 <= inside / 400 <= 0.98


def test_repeats_that_end_differently_have_no_mean():
    fallen = swing()
    fallen = replace(fallen, channels={**fallen.channels, "theta": np.linspace(0.0, 1.57, 401)})
    with pytest.raises(InputError, match="1 of 2 tests overturn"):
        mean_history([swing(), fallen])


# --- verdicts


@pytest.mark.parametrize(
    ("error", "u_num", "u_input", "u_data", "said"),
    [
        (0.01, 0.02, 0.0, 0.0, verdict.NUMERICAL),
        (0.03, 0.02, 0.04, 0.0, verdict.INPUTS),
        (0.03, 0.02, 0.01, 0.04, verdict.DATA),
        (0.10, 0.03, 0.04, 0.0, "not explained: model form or set-up, at least 0.05 alpha"),
        (0.10, None, 0.04, 0.0, verdict.NOT_CONVERGED),
        (None, 0.02, 0.04, 0.0, verdict.NOT_CONVERGED),
        (0.02, 0.02, 0.0, 0.0, verdict.NUMERICAL),  # at the limit it is within it
        (0.04, 0.0, 0.04, 0.0, verdict.INPUTS),
        (0.03, 0.02, 0.03, 0.03, verdict.INPUTS),
    ],
)
def test_what_a_difference_says(error, u_num, u_input, u_data, said):
    found = verdict.explain("theta_rms", "alpha", error, u_num, u_input, u_data)
    assert found.verdict == said
    assert found.explained == (said in (verdict.NUMERICAL, verdict.INPUTS, verdict.DATA))


def test_what_a_difference_says_where_nothing_is_known_of_inputs_and_tests():
    found = verdict.explain("theta_rms", "alpha", 0.1, 0.04)
    assert (found.u_input, found.u_data, found.u_val) == (0.0, 0.0, 0.04)
    assert found.verdict == "not explained: model form or set-up, at least 0.06 alpha"
    assert (
        verdict.Explanation(
            quantity="theta_rms", unit="alpha", error=0.1, u_num=0.04, verdict=""
        ).u_val
        == 0.04
    )


def test_bias_and_scatter_are_recovered_and_cover():
    chance = np.random.default_rng(2)
    truth = chance.uniform(0.1, 0.9, 4000)
    model = 1.1 * truth * np.exp(0.05 * chance.standard_normal(4000) - 0.5 * 0.05**2)
    bias, scatter = bias_and_scatter(list(zip(truth[:2000], model[:2000], strict=True)))
    assert bias == pytest.approx(1.1, rel=5e-3)
    assert scatter == pytest.approx(0.05, rel=0.05)
    trust = Trust(bias=bias, scatter=scatter, count=2000)
    found = [expected(trust, m) for m in model[2000:]]
    inside = [one.low <= e <= one.high for e, one in zip(truth[2000:], found, strict=True)]
    assert 0.93 <= np.mean(inside) <= 0.97


def test_the_domain_names_the_axis_that_leaves_it():
    inside = {axis: Range(low=min(v), high=max(v)) for axis, v in axes_of(BOOKCASE).items()}
    assert outside(BOOKCASE, inside) == []
    assert outside(BOOKCASE.replace(floor=Floor(friction=0.9)), inside) == [
        "friction is 0.9; the suites cover 0.3 to 0.3"
    ]
    assert Experience(domain=inside).domain["alpha"].low == BOOKCASE.block.alpha


# --- the command


def test_the_command_says_converged_and_not(uncertain, capsys, tmp_path):
    out = ["--out", str(tmp_path / "out"), "--json"]
    assert main(["assess", str(uncertain), "--samples", "16", *out]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["converged"] is True
    assert {"name", "value", "u_num", "order", "verdict"} <= found["quantities"][0].keys()
    assert found["inputs"]["samples"] == 16
    assert (
        main(
            [
                "assess",
                str(uncertain),
                "--models",
                "mujoco",
                "--set",
                "time_step=4e-3",
                "--samples",
                "2",
                *out,
            ]
        )
        == 1
    )
    found = json.loads(capsys.readouterr().out)
    assert found["converged"] is False
    assert any(q["reason"] for q in found["quantities"])


# --- in a suite


SUITE = """
reference = "ebm-unilateral"
model_form = "ebm"
uncertainty = true
scenes = ["shelf.toml"]
[models.ebm-unilateral]
[models.ebm]
[models.cm]
[models.coarse]
model = "mujoco"
time_step = 4e-3
"""


def test_a_suite_explains_its_differences(uncertain, tmp_path):
    (tmp_path / "suite.toml").write_text(SUITE, encoding="utf-8")
    run = run_suite(load_suite(tmp_path / "suite.toml"), tmp_path / "out", jobs=1)
    cells = {cell.model: cell for cell in run.cells}
    assert cells["cm"].converged
    assert cells["coarse"].converged is False
    said = {e.quantity: e for e in cells["cm"].explanations if e.against == "ebm-unilateral"}
    assert said["theta_rms"].verdict == verdict.NUMERICAL
    assert said["theta_rms"].u_input > 0.0
    assert all(e.verdict == verdict.NOT_CONVERGED for e in cells["coarse"].explanations)
    assert run.inputs["shelf"].names == ("floor.friction", "walls.left.gap", "excitation.amplitude")
    assert "not converged" in markdown(run)
    assert "<skipped" in junit(run)
    again = run_suite(load_suite(tmp_path / "suite.toml"), tmp_path / "out", jobs=1)
    assert again.up_to_date == 4
    assert [cell.explanations for cell in again.cells] == [cell.explanations for cell in run.cells]


def test_two_outcomes_are_explained_by_inputs_that_decide_them():
    converged = Numerical(
        method="", quantities=(Quantity(name="outcome", unit="", value="", verdict="converged"),)
    )
    records = {"ebm": {"outcome": "overturned left", "numerical": converged.model_dump()}}
    own = {"outcome": "at rest", "numerical": converged.model_dump()}
    (found,) = explanations(BOOKCASE, (), {"ebm": ()}, records, own, None)
    assert found.verdict.startswith("not explained")
    shares = Interval(name="overturns", unit="1", value=0.3, low=0.2, high=0.4)
    inputs = Inputs(
        samples=64,
        model="ebm-unilateral",
        names=("floor.friction",),
        figures=(),
        overturns=shares,
        sensitivities=(),
    )
    (found,) = explanations(BOOKCASE, (), {"ebm": ()}, records, own, inputs)
    assert found.verdict == verdict.INPUTS


def test_a_peak_between_two_rows_is_allowed_for():
    """The rows of a cosine miss its top by at most an eighth of its second difference."""
    from rockcheck.validation.uncertainty.numerical import _between_rows

    step = 0.1
    for shift in (0.0, 0.2, 0.49):
        theta = np.cos(step * (np.arange(-20, 21) - shift))
        missed = 1.0 - np.max(theta)
        assert missed <= _between_rows(SimpleNamespace(channels={"theta": theta})) < 1.3e-3


def test_a_motion_that_depends_on_the_law_of_impacts_is_not_sure(capsys, tmp_path):
    """It lands flat while it slides: no step tells which corner is first."""
    scene = Path(__file__).parents[2] / "data" / "modelling_choices" / "flat-landing.toml"
    assert main(["assess", str(scene), "--out", str(tmp_path), "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert not found["converged"]
    assert 0.0 < found["depends_on_law_from_s"] < 3.0
