"""The error falls with the tolerance, and does not depend on what ran before."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from cases import pulse_scene
from stepping import block_of, play, run_at, setting_of, six

from rockcheck import (
    Block,
    EventBasedModel,
    Floor,
    History,
    InputError,
    ModelFailure,
    Ricker,
    Scene,
    Sine,
    Wall,
)
from rockcheck.ebm import natural
from rockcheck.ebm.batch import pack, run_batch
from rockcheck.ebm.core import march, series
from rockcheck.ebm.core.state import workspace

CASES = {
    "rocking": (2.0, 1.1, 1.0),
    "slide-rock": (4.5, 4.0, 0.3),
    "plastic wall": (4.5, 4.0, 0.3, ("left", 0.053, 0.0)),
    "half restitution": (4.5, 4.0, 0.3, ("left", 0.053, 0.5)),
    "grazing an elastic wall": (3.0, 6.0, 0.3, ("right", 0.003, 1.0)),
}


def distance(a: History, b: History, names: Sequence[str] = ("theta", "x")) -> float:
    """Largest difference of rotation (rad) and place (m) over all rows, which are as many."""
    return max(float(np.max(np.abs(a.channels[name] - b.channels[name]))) for name in names)


def test_the_terms_that_are_left_out_are_half_of_the_tolerance():
    """A geometric series that falls from 1 to the tolerance within the order."""
    scene, run = pulse_scene(2.0, 1.1, 1.0), run_at()
    run.state.control.tolerance = 1e-8
    march.begin(setting_of(scene.block), natural.base_of(scene), run)
    left_out = run.state.last_term_rad * 1e-8 ** (np.arange(1, 200) / series.ORDER)
    assert np.sum(left_out) == pytest.approx(0.5e-8 * scene.block.alpha, rel=1e-12)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("pivot", ["bilateral", "unilateral"])
def test_error_falls_with_the_tolerance(pivot, case):
    """From 1e-6 to 1e-12, against a run at 1e-14: the error stays below 200 tolerances, and loses
    five decades. Steps of a Taylor method grow with the number of digits, not with their power."""
    scene = pulse_scene(*CASES[case], output_step=0.01)
    tolerances = 10.0 ** -np.arange(6.0, 13.0)
    *runs, truth = (
        EventBasedModel(pivot=pivot, tolerance=float(t)).simulate(scene)
        for t in (*tolerances, 1e-14)
    )
    errors = np.array([distance(run, truth) for run in runs])
    assert np.all(errors <= 200.0 * tolerances)
    assert errors[-1] <= 1e-5 * errors[0]
    assert np.polyfit(np.log10(tolerances), np.log10(errors), 1)[0] == pytest.approx(1.0, abs=0.2)
    assert runs[0].cost.steps <= runs[-1].cost.steps <= 2 * runs[0].cost.steps


@pytest.mark.parametrize("alpha", [0.02, 0.05, 0.1, 0.25, 0.5])
def test_a_slender_block_is_as_exact_as_a_stout_one(alpha):
    """The tolerance is in alpha: the same motion in theta/alpha has the same error in tolerances,
    until the block overturns."""
    scene = Scene(
        name="slenderness",
        block=block_of(alpha),
        floor=Floor(friction=1.3),
        excitation=Sine(amplitude=2.0 * 9.81 * math.tan(alpha), period=2.0, cycles=2),
        duration=5.0,
        output_step=0.01,
    )
    tolerances = np.array([1e-5, 1e-6, 1e-8])
    *runs, truth = (
        EventBasedModel(tolerance=float(t)).simulate(scene) for t in (*tolerances, 1e-13)
    )
    assert np.all([distance(run, truth) for run in runs] <= 30.0 * tolerances * alpha)


def test_error_estimate_is_the_error():
    scene = pulse_scene(4.5, 4.0, 0.3)
    estimated = EventBasedModel(tolerance=1e-7, estimate_error=True).simulate(scene)
    truth = EventBasedModel(tolerance=1e-14).simulate(scene)
    error = distance(estimated, truth, ["theta"]) / scene.block.alpha
    assert 0.5 * error <= estimated.cost.error_estimate <= 2.0 * error
    assert EventBasedModel(tolerance=1e-7).simulate(scene).cost.error_estimate is None


@pytest.mark.parametrize("pivot", ["bilateral", "unilateral"])
def test_a_run_leaves_no_trace(pivot):
    scene = pulse_scene(3.0, 6.0, 0.3, ("right", 0.003, 1.0), output_step=0.01)
    another = pulse_scene(4.5, 4.0, 0.6, ("left", 0.053, 0.5))
    first, _, again, finer = map(
        EventBasedModel(pivot=pivot).simulate,
        (scene, another, scene, scene.replace(output_step=0.005)),
    )
    for name in ("x", "y", "theta", "x_dot", "y_dot", "theta_dot", "slip", "slip_rate", "mode"):
        np.testing.assert_array_equal(first.channels[name], again.channels[name])
        np.testing.assert_array_equal(first.channels[name], finer.channels[name][::2])
    assert first.event_list == again.event_list == finer.event_list


def test_compiled_scratch_is_scratch():
    scene = pulse_scene(3.0, 6.0, 0.3, ("right", 0.003, 1.0))
    ends = (
        play(scene, UNILATERAL, tuple(np.full_like(array, filling) for array in workspace()))
        for filling in (0.0, np.nan, 1e300)
    )
    found = {(end.peak, end.steps, end.events, end.t, *six(end.motion)) for end in ends}
    assert len(found) == 1, found


@pytest.mark.parametrize(
    ("cap", "said"),
    [
        ({"most_steps": 3}, "steps"),
        ({"most_events": 3}, "events"),
        ({"most_steps": 50, "friction": "bouc-wen"}, "steps"),
    ],
)
def test_a_cap_ends_in_a_failure(cap, said):
    with pytest.raises(ModelFailure, match=f"the cap on {said} was reached at t = "):
        EventBasedModel(**cap).simulate(pulse_scene(3.0, 6.0, 0.3, ("right", 0.003, 1.0)))


UNILATERAL = EventBasedModel(pivot="unilateral", tolerance=1e-9)


#: Blocks of four sizes, at rest, moving and fallen in the end.
ENSEMBLE = [
    Scene(
        name=f"{size} {amplitude}",
        block=Block(half_width=0.397 * size, half_height=1.555 * size),
        floor=Floor(friction=0.4),
        walls=[Wall(side="left", gap=0.053, restitution=0.5)],
        excitation=Ricker(amplitude=amplitude, period=1.2),
        duration=4.0,
        output_step=0.02,
    )
    for size in (0.25, 0.5, 1.0, 1.7)
    for amplitude in (3.0, 5.0, 7.0, 14.0)
]


def batch(scenes, model=UNILATERAL, **given):
    return run_batch(pack(scenes, model), model, until_decided=False, **given)


def test_as_one_at_a_time():
    found = batch(ENSEMBLE, rows=201, columns=2, jobs=3)
    assert {-1, 0, 1} >= set(found.side.tolist()) > {0}
    for i, scene in enumerate(ENSEMBLE):
        history = UNILATERAL.simulate(scene)
        theta = history.channels["theta"]
        assert np.array_equal(found.out[i, : found.runs[i].rows], theta)
        fallen = {-1: "overturned left", 1: "overturned right"}.get(int(found.side[i]))
        assert fallen == (history.outcome if "overturned" in history.outcome else None)
        if fallen:
            assert found.runs[i].motion.theta == -0.5 * math.pi * found.side[i]
            assert found.runs[i].peak == pytest.approx(0.5 * math.pi)
        else:
            assert found.runs[i].peak >= np.max(np.abs(theta)) > found.runs[i].peak - 1e-3
            assert found.runs[i].motion.theta == pytest.approx(theta[-1], abs=1e-12)


@pytest.mark.parametrize("jobs", [1, 2, 5])
def test_threads_change_nothing(jobs):
    once, again = batch(ENSEMBLE, rows=50), batch(ENSEMBLE * 20, rows=50, jobs=jobs)
    assert np.array_equal(np.tile(once.out, (20, 1, 1)), again.out)
    assert np.array_equal(np.tile(once.runs, 20), again.runs)


@pytest.mark.parametrize(
    ("settings", "error", "said"),
    [
        ({"most_steps": 3}, ModelFailure, "run 0 of the batch: the cap on steps was reached"),
        ({"friction": "bouc-wen"}, InputError, "Coulomb"),
    ],
)
def test_what_fails_is_told(settings, error, said):
    with pytest.raises(error, match=said):
        batch(ENSEMBLE, EventBasedModel(**settings))
