"""What a spread of the inputs makes of the figures, on a scene with a closed form: the peak of free
rocking is its first tilt."""

import math

import numpy as np
import pytest

from rockcheck import Block, EventBasedModel, Floor, Scene
from rockcheck.scenes.files import Spread, uncertain_scene
from rockcheck.validation.uncertainty.population import BANDS, SAMPLES, Inputs, Interval, propagate

BLOCK = Block(half_width=0.3, half_height=1.0)
NORMAL = 1.959964


def tilted(tilt, correlations=None, duration=1.0):
    """A block that is let go at a tilt (alpha) of this standard deviation, a twentieth of alpha."""
    alpha = BLOCK.alpha
    scene = Scene(
        name="tilted",
        block=BLOCK,
        floor=Floor(friction=1.0),
        duration=duration,
        output_step=0.01,
        initial_rotation=tilt * alpha,
    )
    given = {
        "initial_rotation": Spread(value=tilt * alpha, sd=0.05 * alpha),
        "floor.friction": Spread(low=0.9, high=1.1),
    }
    return uncertain_scene(scene, given, correlations or {})


def test_the_peak_of_free_rocking_is_spread_as_its_first_tilt():
    found = propagate(tilted(0.5), indices=False)
    peak, slip = found.inputs.figures
    assert (peak.name, peak.unit, slip.name, slip.unit) == (
        "peak_rotation",
        "alpha",
        "last_slip",
        "m",
    )
    assert (peak.value, peak.low, peak.high) == pytest.approx(
        (0.5, 0.5 - 0.05 * NORMAL, 0.5 + 0.05 * NORMAL), abs=2e-3
    )
    assert (slip.value, slip.low, slip.high) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert found.inputs.u_input("peak_rotation") == pytest.approx(0.05 * NORMAL, abs=2e-3)
    assert found.inputs.u_input("end_time") is None
    assert found.inputs.samples == SAMPLES
    assert found.inputs.model == "ebm-unilateral"
    assert not found.inputs.sensitivities
    assert not found.fallen.any()
    assert found.inputs.overturns.value == 0.0
    assert found.inputs.overturns.low < 1e-12
    assert found.inputs.overturns.high == pytest.approx(
        NORMAL**2 / (SAMPLES + NORMAL**2), rel=1e-3
    )  # Wilson
    # At the start the bands are the quantiles of a normal number.
    assert len(found.bands) == len(BANDS)
    assert found.bands[:, 0] == pytest.approx(
        [0.5 + 0.05 * z for z in (-NORMAL, -0.994458, 0.0, 0.994458, NORMAL)], abs=2e-3
    )
    assert found.inputs.u_input("theta_rms") == pytest.approx(
        math.sqrt(np.mean((0.5 * (found.bands[4] - found.bands[0])) ** 2))
    )


@pytest.mark.parametrize("value", [0.5, 0.7])
def test_a_figure_lies_within_its_farther_end(value):
    one = Interval(name="a", unit="", value=value, low=0.4, high=0.8)
    inputs = Inputs(samples=2, model="", names=(), figures=(one,), overturns=one, sensitivities=())
    assert inputs.u_input("a") == pytest.approx(0.3)


def test_draws_of_sobol_are_balanced():
    assert math.log2(SAMPLES).is_integer()
    assert propagate(tilted(0.5), samples=33, indices=False).inputs.samples == 64
    assert propagate(tilted(0.5), samples=2, indices=False).inputs.samples == 2


def test_half_of_the_blocks_let_go_at_the_balance_point_fall():
    """Some lie beyond it at once, and count as 1; where all fall nothing is said of a slip."""
    found = propagate(
        tilted(1.0, duration=6.0), model=EventBasedModel(tolerance=1e-8), indices=False
    )
    assert found.inputs.model == "ebm"
    share = found.inputs.overturns
    assert share.value == pytest.approx(0.5, abs=0.01)
    assert (share.low, share.high) == pytest.approx(
        (0.5 - NORMAL / 2 / 32, 0.5 + NORMAL / 2 / 32), abs=0.012
    )
    assert found.inputs.figures[0].high == 1.0
    assert len(found.inputs.figures) == 2
    for tilt in (1.05, 1.3):  # the scene's own block falls: some draws, and none stand
        drawn = propagate(tilted(tilt, duration=3.0), samples=64, indices=False)
        assert drawn.fallen.all() == (tilt == 1.3)
        assert [one.name for one in drawn.inputs.figures] == ["peak_rotation"]


def test_what_the_peak_does_not_depend_on_has_no_index():
    found = propagate(tilted(0.5), samples=64)
    assert found.inputs.note == ""
    assert [one.name for one in found.inputs.sensitivities] == [
        "initial_rotation",
        "floor.friction",
    ]
    most, none = found.inputs.sensitivities
    assert (most.first, most.total) == pytest.approx((1.0, 1.0), abs=0.05)
    assert (none.first, none.total) == pytest.approx((0.0, 0.0), abs=0.02)


def test_correlated_inputs_have_no_indices_and_a_note_says_so():
    found = propagate(tilted(0.5, {"initial_rotation, floor.friction": 0.5}), samples=64)
    assert found.inputs.sensitivities == ()
    assert "correlated" in found.inputs.note
