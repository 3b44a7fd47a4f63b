"""u_num on problems with a known answer."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from rockcheck import ContinuousModel, EventBasedModel, Floor, MuJoCo, Ricker, Scene, Wall
from rockcheck.scenes.block import Block
from rockcheck.scenes.observation import observe
from rockcheck.validation.uncertainty.numerical import numerical_uncertainty

BOOKCASE = Scene(
    name="bookcase",
    block=Block(half_width=0.397, half_height=1.555),
    floor=Floor(friction=0.3),
    walls=[Wall(side="left", gap=0.053, restitution=0.0)],
    excitation=Ricker(amplitude=3.5, period=1.5),
    duration=6.0,
)


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
    return {q.name: q for q in numerical_uncertainty(model, BOOKCASE).quantities}


@pytest.mark.parametrize("order", [0.52, 0.6, 1.0, 2.0, 2.5])
def test_the_largest_change_bounds_the_error_where_it_falls_like_a_power_of_the_step(order):
    found = judged(Made(lambda h: 1.0 + 0.01 * (h / 1e-3) ** order))
    for name, error in (("peak_rotation", 0.005), ("theta_rms", 0.005 / math.sqrt(2.0))):
        assert found[name].verdict == "converged"
        assert found[name].order == pytest.approx(order, abs=1e-6)
        assert found[name].u_num == pytest.approx(1.25 * error * (4.0**order - 1.0), rel=0.05)
        assert found[name].u_num > error


@pytest.mark.parametrize(
    "error",
    [lambda n: 0.01 * n**0.48, lambda n: 1e-4 * math.cos(10.0 * n)],
    ids=["an order too low", "no order"],
)
def test_what_does_not_converge_gets_the_larger_factor(error):
    """By the largest change of any history."""
    found = judged(Made(lambda h: 1.0 + error(h / 1e-3)))
    change = max(abs(error(n) - error(1.0)) for n in (2.0, 3.0, 4.0))
    for name in ("peak_rotation", "theta_rms"):
        assert found[name].u_num == pytest.approx(3.0 * 0.5 * change, rel=1e-3)


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
