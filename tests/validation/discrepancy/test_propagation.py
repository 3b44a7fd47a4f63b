"""What a spread of the inputs makes of the figures, on a scene with a closed form: the peak of free
rocking is its first tilt."""

import numpy as np
import pytest

from rockcheck import Block, EventBasedModel, Floor, Scene
from rockcheck.scenes import files
from rockcheck.validation.suite import motions
from rockcheck.validation.uncertainty import input_spread

BLOCK = Block(half_width=0.3, half_height=1.0)
NORMAL = 1.959964


ALPHA = BLOCK.alpha
FRICTION = {"floor.friction": files.Spread(low=0.9, high=1.1)}


def tilted(tilt, correlations=None, duration=1.0, given=None):
    scene = Scene(
        name="tilted",
        block=BLOCK,
        floor=Floor(friction=1.0),
        duration=duration,
        output_step=0.01,
        initial_rotation=tilt * ALPHA,
    )
    if given is None:
        given = {"initial_rotation": files.Spread(value=tilt * ALPHA, sd=0.05 * ALPHA)} | FRICTION
    return files.uncertain_scene(scene, given, correlations or {})


def span(one):
    return one.value, one.low, one.high


def test_the_peak_of_free_rocking_is_spread_as_its_first_tilt():
    inputs = input_spread.propagate(tilted(0.5), indices=False)
    peak = pytest.approx((0.5, 0.5 - 0.05 * NORMAL, 0.5 + 0.05 * NORMAL), abs=2e-3)
    assert [(one.name, one.unit, span(one)) for one in inputs.figures] == [
        ("peak_rotation", "alpha", peak),
        ("last_slip", "m", pytest.approx((0.0, 0.0, 0.0), abs=1e-9)),
    ]
    sure = [inputs.u_input(name) for name in ("peak_rotation", "end_time")]
    assert sure == [pytest.approx(0.05 * NORMAL, abs=2e-3), None]
    assert inputs.samples == input_spread.SAMPLES
    assert inputs.model == "ebm-unilateral"
    assert inputs.sensitivities == ()
    wilson = NORMAL**2 / (input_spread.SAMPLES + NORMAL**2)
    assert span(inputs.overturns) == pytest.approx((0.0, 0.0, wilson), rel=1e-3, abs=1e-12)
    # Just after the start the rotations are still spread as the first ones.
    early = input_spread.propagate(tilted(0.5, duration=0.02), indices=False)
    assert early.u_input("theta_rms") == pytest.approx(0.05 * NORMAL, abs=1e-3)


def test_the_slip_of_a_block_that_slides_to_a_stop_is_spread_as_its_friction():
    sliding = Scene(
        name="sliding",
        block=Block(half_width=1.0, half_height=0.2),
        floor=Floor(friction=0.3),
        duration=1.0,
        initial_velocity=1.0,
    )
    given = files.uncertain_scene(sliding, {"floor.friction": files.Spread(low=0.2, high=0.4)}, {})
    found = input_spread.propagate(given, indices=False).figures[1]
    stops = [1.0 / (2.0 * friction * sliding.gravity) for friction in (0.3, 0.395, 0.205)]
    assert found.name == "last_slip"
    assert span(found) == pytest.approx(stops, rel=1e-3)


@pytest.mark.parametrize("value", [0.5, 0.7])
def test_a_figure_lies_within_its_farther_end(value):
    one = input_spread.Interval(name="a", unit="", value=value, low=0.4, high=0.8)
    assert input_spread.Inputs(
        samples=2, model="", names=(), figures=(one,), overturns=one, sensitivities=()
    ).u_input("a") == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("asked", "drawn"), [(33, 64), (2, 2), (input_spread.SAMPLES, input_spread.SAMPLES)]
)
def test_draws_of_sobol_are_balanced(asked, drawn):
    assert input_spread.propagate(tilted(0.5), samples=asked, indices=False).samples == drawn


def test_half_of_the_blocks_let_go_at_the_balance_point_fall():
    found = input_spread.propagate(
        tilted(1.0, duration=6.0), model=EventBasedModel(tolerance=1e-8), indices=False
    )
    assert span(found.overturns) == (
        pytest.approx(0.5, abs=0.01),
        pytest.approx(0.5 - NORMAL / 2 / 32, abs=0.012),
        pytest.approx(0.5 + NORMAL / 2 / 32, abs=0.012),
    )
    # Most of the time some lie and some stand: what lies goes on lying.
    assert found.u_input("theta_rms") == pytest.approx(0.5 * (0.5 * np.pi / ALPHA), rel=0.1)
    names = [one.name for one in found.figures]
    assert found.model == "ebm"
    assert names == ["peak_rotation", "last_slip"]
    assert found.figures[0].high == 1.0


@pytest.mark.parametrize(("tilt", "all_fall"), [(1.05, False), (1.3, True)])
def test_where_the_scenes_own_block_falls_nothing_is_said_of_a_slip(tilt, all_fall):
    drawn = input_spread.propagate(tilted(tilt, duration=3.0), samples=64, indices=False)
    names = [one.name for one in drawn.figures]
    assert (drawn.overturns.value == 1.0) == all_fall
    assert names == ["peak_rotation"]


def test_what_the_peak_does_not_depend_on_has_no_index():
    found = input_spread.propagate(tilted(0.5), samples=64)
    assert {one.name: (one.first, one.total) for one in found.sensitivities} | {"": found.note} == {
        "initial_rotation": pytest.approx((1.0, 1.0), abs=0.05),
        "floor.friction": pytest.approx((0.0, 0.0), abs=0.02),
        "": "",
    }
    assert (
        input_spread.sensitivities(tilted(0.5, given=FRICTION), EventBasedModel(), samples=16) == ()
    )


def test_what_matters_most_comes_first():
    tilt = files.Spread(value=0.5 * ALPHA, sd=0.05 * ALPHA)
    for given in (FRICTION | {"initial_rotation": tilt}, {"initial_rotation": tilt} | FRICTION):
        found = input_spread.sensitivities(tilted(0.5, given=given), EventBasedModel(), samples=16)
        assert [index.name for index in found] == ["initial_rotation", "floor.friction"]


def test_a_scene_without_uncertain_numbers_is_refused(fault_of):
    assert "no number of this scene is uncertain" in str(
        fault_of(input_spread.propagate, tilted(0.5, given={}))
    )


@pytest.mark.parametrize(
    "moved",
    [
        lambda given: given,
        lambda given: motions.under_records(
            {"tilted": given},
            [motions.RecordSet(files=["elcentro_1940_ns.csv"])],
            files.DATA,
        )[0].popitem()[1],
    ],
    ids=["by itself", "under a record"],
)
def test_correlated_inputs_have_no_indices_and_a_note_says_so(moved):
    found = input_spread.propagate(
        moved(tilted(0.5, {"initial_rotation, floor.friction": 0.5})), samples=64
    )
    assert found.sensitivities == ()
    assert "correlated" in found.note
