"""Numbers that are not known exactly: how they are distributed, what is refused, where they stand
in a scene."""

import math

import numpy as np
import pytest

from rockcheck.scenes import InputError, Scene
from rockcheck.scenes.files import Spread, split, uncertain_scene, with_numbers


@pytest.mark.parametrize("cv", [0.05, 0.5, 2.0])
def test_a_lognormal_number_has_its_mean_and_standard_deviation(cv):
    """Also where it is wide: the median is mean/sqrt(1 + cv^2), far below the mean."""
    law = Spread(value=3.0, sd=3.0 * cv, distribution="lognormal").law
    assert (law.mean(), law.std()) == pytest.approx((3.0, 3.0 * cv), rel=1e-12)
    assert law.median() == pytest.approx(3.0 / math.sqrt(1.0 + cv**2), rel=1e-12)


def test_a_uniform_number_by_its_standard_deviation_or_its_bounds():
    for law in (
        Spread(value=3.0, sd=0.5, distribution="uniform").law,
        Spread(low=3.0 - 0.75**0.5, high=3.0 + 0.75**0.5).law,
    ):
        assert (law.mean(), law.std()) == pytest.approx((3.0, 0.5), rel=1e-12)
        assert law.support() == pytest.approx((3.0 - 0.5 * 3**0.5, 3.0 + 0.5 * 3**0.5), rel=1e-12)
    assert Spread(low=1.0, high=2.0).nominal == 1.5
    assert Spread(low=1.0, high=2.0, value=1.1).nominal == 1.1


def test_a_normal_number():
    law = Spread(value=-3.0, sd=0.5).law
    assert (law.mean(), law.std()) == (-3.0, 0.5)
    assert law.cdf(-2.5) == pytest.approx(0.5 * (1.0 + math.erf(math.sqrt(0.5))))


@pytest.mark.parametrize(
    ("given", "key"),
    [
        ({"low": 0.1, "high": 0.1}, "high"),
        ({"low": 0.2, "high": 0.1}, "high"),
        ({"low": 0.1}, "high"),
        ({"high": 0.1}, "low"),
        ({"sd": 0.1}, "value"),
        ({"value": 0.1, "sd": 0.1, "low": 0.0}, "sd"),
        ({"value": 0.1, "sd": 0.1, "high": 0.0}, "sd"),
        ({"value": 0.0, "sd": 0.1, "distribution": "lognormal"}, "value"),
    ],
)
def test_what_is_no_spread(given, key):
    with pytest.raises(InputError) as fault:
        Spread(**given)
    assert fault.value.key == key


TABLES = {
    "duration": {"value": 2.0, "sd": 0.1},
    "block": {"half_width": {"low": 0.3, "high": 0.5}, "half_height": 1.0},
    "walls": [{"side": "right", "gap": {"value": 0.05, "sd": 0.01}}, {"side": "left", "gap": 0.06}],
}


def made():
    plain, spreads, _ = split(TABLES)
    return Scene(name="made", floor={"friction": 0.3}, **plain), spreads


def test_numbers_stand_where_they_were_written():
    scene, spreads = made()
    assert list(spreads) == ["duration", "block.half_width", "walls.right.gap"]
    assert (scene.duration, scene.block.half_width, scene.wall("right").gap) == (2.0, 0.4, 0.05)
    other = with_numbers(
        scene,
        {
            "duration": 3.0,
            "block.half_width": 0.35,
            "block.half_height": 1.5,
            "walls.right.gap": 0.02,
        },
    )
    assert (other.duration, other.block.half_width, other.block.half_height) == (3.0, 0.35, 1.5)
    assert (other.wall("left").gap, other.wall("right").gap) == (0.06, 0.02)


def test_correlations_that_contradict_each_other_are_refused():
    scene, spreads = made()
    a, b, c = spreads
    fine = uncertain_scene(scene, spreads, {f"{a}, {b}": 0.9, f"{b},{c}": 0.9, f"{a}, {c}": 0.9})
    assert not fine.independent
    np.testing.assert_array_equal(fine.correlation, 0.9 + 0.1 * np.eye(3))
    assert uncertain_scene(scene, spreads, {}).independent
    assert uncertain_scene(scene, {}, {}).independent
    for wrong, said in (
        ({f"{a}, {b}": 0.9, f"{b}, {c}": 0.9, f"{a}, {c}": -0.9}, "not positive definite"),
        ({f"{a}, {a}": 0.5}, "give two uncertain numbers"),
        ({f"{a}, {b}, {c}": 0.5}, "give two uncertain numbers"),
        ({f"{a}, {b}": -1.0}, "between -1 and 1"),
        ({f"{a}, {b}": 1}, "between -1 and 1"),
        ({f"{a}, {b}": True}, "between -1 and 1"),
        ({f"{a}, gravity": 0.5}, "not an uncertain number"),
    ):
        with pytest.raises(InputError, match=said):
            uncertain_scene(scene, spreads, wrong)


def test_correlated_inputs_have_the_correlation_and_their_own_distributions():
    scene, spreads = made()
    given = uncertain_scene(scene, spreads, {"duration, walls.right.gap": -0.8})
    values = given.values(np.random.default_rng(1).random((50_000, 3)))
    assert np.corrcoef(values.T)[0] == pytest.approx([1.0, 0.0, -0.8], abs=0.02)
    assert values.mean(axis=0) == pytest.approx([2.0, 0.4, 0.05], rel=5e-3)
    assert values.std(axis=0) == pytest.approx([0.1, 0.2 / math.sqrt(12.0), 0.01], rel=2e-2)
