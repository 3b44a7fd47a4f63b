"""u_num on problems with a known answer."""

import math
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from rockcheck import (
    Block,
    ContinuousModel,
    EventBasedModel,
    Floor,
    MuJoCo,
    Rest,
    Ricker,
    Scene,
    Wall,
)
from rockcheck.scenes import ModelFailure, observation
from rockcheck.validation.uncertainty import numerical

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
    of zero. It slips by up to `slid` alpha R half-way, and is back at 0 in the end; a history of
    fewer `rows` ends in a fall."""

    factor: object
    step: float = 1e-3
    falls: object = field(default=lambda step: False)
    slid: object = field(default=lambda step: 0.0)
    rows: object = field(default=lambda step: None)

    def coarser(self, factor):
        return replace(self, step=factor * self.step)

    def simulate(self, scene):
        t, alpha, radius = scene.output_times, scene.block.alpha, scene.block.radius
        theta = 0.5 * alpha * np.sin(t) * self.factor(self.step)
        slip = np.where(t == t[len(t) // 2], self.slid(self.step) * alpha * radius, 0.0)
        made = {"theta": theta, "slip": slip, "y": radius * np.cos(alpha - np.abs(theta))}
        still = observation.observe(scene, "made", np.zeros((len(t), 6)))
        rows = self.rows(self.step)
        return replace(
            still,
            channels={name: one[:rows] for name, one in (still.channels | made).items()},
            outcome="overturned left" if self.falls(self.step) else "moving",
        )


def judged(model, scene=BOOKCASE):
    return {q.name: q for q in numerical.numerical_uncertainty(model, scene).quantities}


@pytest.mark.parametrize("order", [0.52, 0.6, 1.0, 2.0, 2.5])
@pytest.mark.parametrize(
    ("name", "error", "value"),
    [
        ("peak_rotation", 0.005, lambda order: 0.505),
        (
            "theta_rms",
            0.005 / math.sqrt(2.0),
            lambda order: 0.005 / math.sqrt(2.0) * (2.0**order - 1.0),
        ),
    ],
)
def test_the_largest_change_bounds_the_error_where_it_falls_like_a_power_of_the_step(
    order, name, error, value
):
    found = judged(Made(lambda h: 1.0 + 0.01 * (h / 1e-3) ** order))[name]
    assert found.verdict == "converged"
    assert found.order == pytest.approx(order, abs=1e-6)
    assert found.u_num == pytest.approx(1.25 * error * (4.0**order - 1.0), rel=0.05)
    assert found.value == pytest.approx(value(order), rel=0.05)
    assert found.u_num > error


@pytest.mark.parametrize(
    "error",
    [lambda n: 0.01 * n**0.48, lambda n: 1e-4 * math.cos(10.0 * n)],
    ids=["an order too low", "no order"],
)
def test_what_does_not_converge_gets_the_larger_factor(error):
    found = judged(Made(lambda h: 1.0 + error(h / 1e-3)))
    change = max(abs(error(n) - error(1.0)) for n in (2.0, 3.0, 4.0))
    assert [found[name].u_num for name in ("peak_rotation", "theta_rms")] == pytest.approx(
        [3.0 * 0.5 * change] * 2, rel=1e-3
    )


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
    found = judged(Made(lambda h: 1.0 + 2.0 * at[round(h / 1e-3)]))["peak_rotation"]
    assert found.u_num == pytest.approx(u_num, rel=1e-3)
    # of a motion that ends as it rises the last row is the peak
    early = judged(Made(lambda h: 1.0 + 2.0 * at[round(h / 1e-3)]), BOOKCASE.replace(duration=1.0))[
        "peak_rotation"
    ]
    assert early.u_num == pytest.approx(u_num * math.sin(1.0), rel=1e-9)


def test_where_the_finer_run_of_a_tolerance_ends_otherwise_nothing_is_converged():
    given, finer = Made(lambda step: 1.0), Made(lambda step: 1.0, falls=lambda step: True)
    found = numerical.numerical_uncertainty(
        SimpleNamespace(simulate=given.simulate, finer=lambda: finer), BOOKCASE
    )
    assert not found.converged
    assert found.reasons == ("the outcome changes with the tolerance",)


def test_a_slip_after_the_last_row_counts(monkeypatch):
    """The last slip may change by more than the rows do."""
    one, other = (Made(lambda step: 1.0).simulate(BOOKCASE) for _ in range(2))
    monkeypatch.setattr(numerical, "last_slip_of", lambda history: 0.02 if history is one else 0.03)
    assert numerical._changes(BOOKCASE, one, other)["last_slip"] == pytest.approx(0.01)


def test_of_a_tolerance_the_change_at_a_hundredth_of_it_counts():
    """F = 1.25 times the change: of 0.5 alpha sin t by 0.0099 of it."""
    given, finer = (Made(lambda step, wrong=wrong: 1.0 + wrong) for wrong in (1e-2, 1e-4))
    found = numerical.numerical_uncertainty(
        SimpleNamespace(simulate=given.simulate, finer=lambda: finer), BOOKCASE
    )
    assert found.converged
    change = 0.5 * 0.99e-2 * np.sin(BOOKCASE.output_times)
    assert [found.u_num(name) for name in ("theta_rms", "peak_rotation", "outcome")] == [
        pytest.approx(1.25 * size, rel=1e-9)
        for size in (math.sqrt(np.mean(change**2)), np.max(change), 0.0)
    ]


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
    assert found.pop("outcome").verdict == "converged"
    assert {
        (one.verdict, one.u_num is None, "the histories part" in one.reason)
        for one in found.values()
    } == {("converged", False, False) if converged else ("not converged", True, True)}


@pytest.mark.parametrize(
    ("factor", "slid", "slip", "rotation"),
    [
        (lambda h: 1.0 + h, lambda h: 10.0 * h, 1.25 * 0.03, 1.25 * 0.5 * 0.003),
        # Where the histories do not converge, as sure as theta is, and theta as the slip.
        (lambda h: 1.0 + 0.02 * (h == 3e-3), lambda h: 0.0, 3.0 * 0.01, 3.0 * 0.01),
        (lambda h: 1.0, lambda h: 0.02 * (h == 3e-3), 3.0 * 0.02, 3.0 * 0.02),
    ],
    ids=["converges", "theta does not", "slip does not"],
)
def test_a_last_slip_that_all_runs_share_is_as_sure_as_its_history(factor, slid, slip, rotation):
    found = judged(Made(factor, slid=slid))
    assert found["peak_rotation"].u_num == pytest.approx(rotation, rel=0.05)
    one, unit = found["last_slip"], BOOKCASE.block.alpha * BOOKCASE.block.radius
    assert one.value == 0.0
    assert one.u_num == pytest.approx(slip * unit, rel=1e-3)
    assert one.order == (pytest.approx(1.0) if slip == 1.25 * 0.03 else None)


@pytest.mark.parametrize(
    ("late", "u_num"),
    [
        ((0, 0, 0), 0.0),
        ((1, 2, 3), 1.25 * 3.0),
        ((-1, -2, -3), 1.25 * 3.0),
        ((9, 0, 0), 3.0 * 9.0),
        ((10, 0, 0), math.nan),  # by 0.107/p
    ],
)
def test_the_time_of_a_fall_is_that_of_its_changes(late, u_num):
    rows = dict(enumerate((0, *late), 1))
    found = judged(
        Made(lambda h: 1.0, falls=lambda h: True, rows=lambda h: 600 + rows[round(h / 1e-3)])
    )
    assert set(found) == {"theta_rms", "end_time", "outcome"}
    assert found["end_time"].u_num == (
        None if math.isnan(u_num) else pytest.approx(u_num * BOOKCASE.output_step, rel=1e-9)
    )


@pytest.mark.parametrize(
    ("name", "value_of"),
    [
        ("last_slip", lambda history: history.channels["slip"][-1]),
        ("peak_rotation", lambda history: history.peak_rotation / history.block.alpha),
    ],
)
def test_a_slip_pinned_at_the_gap_is_not_taken_for_sure(name, value_of):
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
    found = judged(MuJoCo(time_step=4e-4), scene)[name]
    truth = value_of(MuJoCo(time_step=2.5e-5).simulate(scene))
    assert found.u_num is None or abs(found.value - truth) <= found.u_num < 0.1


@pytest.mark.parametrize(
    ("at_4h", "reason"),
    [
        (lambda: True, "stands, stands, stands, left at h, 2h, 3h, 4h"),
        (lambda: (_ for _ in ()).throw(ModelFailure("it blew up")), "it blew up"),
    ],
)
def test_where_a_coarser_run_ends_otherwise_nothing_is_converged(at_4h, reason):
    found = numerical.numerical_uncertainty(
        Made(lambda h: 1.0, falls=lambda h: h > 3.5e-3 and at_4h()), BOOKCASE
    )
    assert {(q.verdict, q.u_num) for q in found.quantities} == {("not converged", None)}
    assert found.converged == (reason not in "".join(found.reasons))


@pytest.mark.parametrize("model", [EventBasedModel(pivot="unilateral"), Made(lambda h: 1.0)])
def test_on_a_tie_nothing_is_converged(model):
    """However little a run changes with its step or tolerance: rounding has chosen its answer."""
    tie = BOOKCASE.replace(walls=[], excitation=Rest(), initial_rotation=BOOKCASE.block.alpha)
    found = numerical.numerical_uncertainty(model, tie)
    assert {(q.verdict, q.u_num) for q in found.quantities} == {("not converged", None)}
    assert found.reasons == ("a tie: balanced over its corner",)
    off = tie.replace(initial_rotation=0.999 * BOOKCASE.block.alpha)
    assert numerical.numerical_uncertainty(model, off).converged


def test_a_model_without_a_step_is_not_judged():
    assert numerical.numerical_uncertainty(object(), BOOKCASE) is None


@pytest.mark.slow
def test_the_interval_covers_as_often_as_it_says():
    chance = np.random.default_rng(5)
    inside = []
    for k in range(400):
        a, b, c, d = 0.02 * chance.standard_normal(4)
        if k % 2:
            error = {n: a * n + 0.5 * b * n**1.5 + 0.25 * c * n**2 for n in (1, 2, 3, 4)}
        else:
            order, noise = chance.uniform(0.9, 2.0), chance.standard_normal(4)
            error = {n: 0.02 * n**order + 0.1 * d * noise[n - 1] for n in (1, 2, 3, 4)}
        u = judged(Made(lambda h, e=error: 1.0 + e[round(h / 1e-3)]))["peak_rotation"].u_num
        inside += [] if u is None else [abs(0.5 * error[1]) <= u]
    assert len(inside) > 300
    assert np.mean(inside) >= 0.95


@pytest.mark.parametrize(
    "model",
    [EventBasedModel(pivot="unilateral", tolerance=1e-6), ContinuousModel(penetration=1e-7)],
    ids=["ebm", "cm"],
)
@pytest.mark.parametrize(
    ("amplitude", "period", "restitution"),
    [(3.0, 1.0, 0.0), (-3.907, 0.873, 1.0)],
    ids=["turns between rows", "strikes between rows"],
)
def test_event_based_and_continuous_models_are_within_their_own_error(
    model, amplitude, period, restitution
):
    scene = BOOKCASE.replace(
        excitation=Ricker(amplitude=amplitude, period=period),
        floor=Floor(friction=0.6),
        walls=[Wall(side="left", gap=0.053, restitution=restitution)],
        duration=4.0,
    )
    truth = EventBasedModel(pivot="unilateral", tolerance=1e-13).simulate(
        scene.replace(output_step=5e-5)
    )
    found, history = numerical.numerical_uncertainty(model, scene), model.simulate(scene)
    error = abs(history.peak_rotation - truth.peak_rotation) / BOOKCASE.block.alpha
    assert found.converged
    assert error <= found.u_num("peak_rotation") + 1e-12
