"""The horizon of predictability: a closed form, its definition on a record, and what has none."""

import math

import numpy as np
import pytest

from rockcheck import (
    Block,
    EventBasedModel,
    Floor,
    InputError,
    Ricker,
    Scene,
    Sine,
    Wall,
    load_scene,
)
from rockcheck.ebm import predictability_horizon
from rockcheck.ebm.horizon import START, _disturbed, may_fly
from rockcheck.scenes import PAPER_BLOCK

UNILATERAL = EventBasedModel(pivot="unilateral", tolerance=1e-13)


#: The block on its corner, in unstable balance.
BALANCED = Scene(
    name="balanced",
    block=PAPER_BLOCK,
    floor=Floor(friction=1.0),
    initial_rotation=PAPER_BLOCK.alpha,
    duration=8.0,
    output_step=0.001,
)
#: Shaken between walls that bounce.
BETWEEN = {
    "initial_rotation": 0.0,
    "floor": Floor(friction=0.3),
    "walls": [
        Wall(side="left", gap=0.053, restitution=0.5),
        Wall(side="right", gap=0.08, restitution=0.5),
    ],
    "excitation": Sine(amplitude=5.0, period=2.0, cycles=5),
    "duration": 12.0,
    "output_step": 0.005,
}


@pytest.mark.parametrize(("perturbation", "allowed"), [(1e-6, 1e-3), (1e-7, 1e-3), (1e-6, 1e-4)])
def test_unstable_balance_amplifies_as_the_hyperbolic_cosine(
    perturbation: float, allowed: float
) -> None:
    """A tilt of alpha (1 + d) turns away as alpha (1 + d cosh(p t)) while that is small, so that t
    = acosh(allowed/d)/p."""
    found = predictability_horizon(BALANCED, perturbation=perturbation, allowed=allowed)
    assert found == pytest.approx(
        math.acosh(allowed / perturbation) / BALANCED.frequency_parameter, abs=BALANCED.output_step
    )


@pytest.mark.parametrize(
    ("change", "horizon"),
    [
        ({"initial_rotation": 0.5 * PAPER_BLOCK.alpha}, 8.0),
        ({"initial_rotation": 0.0}, 8.0),
        ({"output_step": 4.0}, 4.0),
        ({"output_step": 4.0, "duration": 12.0}, 4.0),
        (BETWEEN, 12.0),
    ],
    ids=["free rocking", "standing", "rows far apart", "more of them", "between walls"],
)
def test_what_can_be_compared(change: dict[str, object], horizon: float) -> None:
    """What nothing parts, to its end: a standing block on a still base has nothing to disturb.
    Where histories have parted by the first row, that row: at the start there is nothing to
    compare."""
    assert predictability_horizon(BALANCED.replace(**change)) == horizon


RECORD = load_scene("fig4a")


def test_the_ratio_alone_decides() -> None:
    horizon, again, tenth = (
        predictability_horizon(RECORD, **ratio)
        for ratio in ({}, {}, {"perturbation": 1e-7, "allowed": 1e-4})
    )
    assert again == horizon
    assert tenth == pytest.approx(horizon, abs=2 * RECORD.output_step)


@pytest.mark.parametrize(
    ("scene", "model", "least", "most"),
    [
        (RECORD, UNILATERAL, 8.0, 36.0),
        # Disturbed by the record alone this block would part 0.14 s later.
        (
            RECORD.replace(vertical=Sine(amplitude=4.0, period=0.4, cycles=80), duration=6.0),
            UNILATERAL,
            0.0,
            6.0,
        ),
        # Here the two models move differently, and so do their horizons.
        (BALANCED.replace(**BETWEEN), EventBasedModel(tolerance=1e-13), 8.0, 9.0),
    ],
    ids=["record", "vertical", "bilateral"],
)
def test_a_motion_parts_from_its_disturbed_self_just_after_the_horizon(
    scene: Scene, model: EventBasedModel, least: float, most: float
) -> None:
    horizon = predictability_horizon(scene, model)
    assert least < horizon < most
    plain = model.simulate(scene).channels
    apart = np.zeros_like(plain["t"])
    for factor in (1 - 1e-6, 1 + 1e-6):
        both = {
            "excitation": scene.excitation.scaled(factor),
            "vertical": scene.vertical.scaled(factor),
        }
        disturbed = model.simulate(scene.replace(**both)).channels["theta"]
        apart = np.maximum(apart, np.abs(disturbed - plain["theta"]) / scene.block.alpha)
    inside = plain["t"] <= horizon + 1e-9
    assert apart[inside].max() <= 1e-3 < apart[~inside][0]


def test_a_start_against_a_wall_is_disturbed_away_from_it() -> None:
    tilt = 0.3 * PAPER_BLOCK.alpha
    gap = PAPER_BLOCK.radius * (
        math.sin(PAPER_BLOCK.alpha + tilt) - math.sin(PAPER_BLOCK.alpha - tilt)
    )  # of the upright block
    scene = BALANCED.replace(initial_rotation=tilt, walls=[Wall(side="left", gap=gap)])
    with pytest.raises(InputError, match="inside the left wall"):
        scene.replace(initial_rotation=tilt * (1 + 1e-6))
    assert 0.0 < predictability_horizon(scene) <= scene.duration


@pytest.mark.parametrize(("side", "sign"), [("left", -1.0), ("right", 1.0)])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_it_ends_where_the_laws_of_impacts_part(side: str, sign: float, restitution: float) -> None:
    """A block that stands against a bouncing wall and is tilted away from it lands on floor and
    wall at once, at its first impact."""
    scene = BALANCED.replace(
        initial_rotation=sign * 0.3 * PAPER_BLOCK.alpha,
        walls=[Wall(side=side, gap=0.0, restitution=restitution)],
    )
    first = next(
        event.t
        for event in EventBasedModel(pivot="unilateral").simulate(scene).event_list
        if event.kind == "floor impact"
    )
    least, most = (
        (first - scene.output_step, first + 0.02) if restitution else (first + 0.1, scene.duration)
    )
    assert least <= predictability_horizon(scene) <= most


@pytest.mark.parametrize(
    ("law", "slide"),
    [("moreau", -1.0), ("leading-first", -1.0), ("trailing-first", -1.0), ("moreau", 0.0)],
)
def test_it_ends_where_a_block_lands_flat(law: str, slide: float) -> None:
    """While it slides the laws part there, whichever the model follows, even where no start is near
    enough to zero to tell. Without slip a rotation and a rate of zero that are disturbed do."""
    dropped = BALANCED.replace(
        block=Block(half_width=0.3, half_height=1.0),
        floor=Floor(friction=0.9),
        initial_rotation=0.0,
        initial_height=0.05,
        initial_velocity=slide,
        duration=3.0,
    )
    model, landing = UNILATERAL.model_copy(update={"impacts": law}), math.sqrt(2.0 * 0.05 / 9.81)
    assert landing <= predictability_horizon(dropped, model) <= landing + 0.01
    struck = Scene(  # by a wall, and thrown up
        name="struck",
        block=Block(half_width=0.6257529044558684, half_height=1.450050869104316),
        floor=Floor(friction=0.9321670161858135),
        walls=[Wall(side="right", gap=0.016955975821364672)],
        excitation=Ricker(amplitude=14.520221522782801, period=0.6777755218716803),
        duration=3.6,
    )
    assert 1.84 < predictability_horizon(struck, model) < 1.86


def test_what_is_zero_at_the_start_is_disturbed_to_either_side() -> None:
    scene = BALANCED.replace(initial_rotation=0.0)
    disturbed = [one for _, one in _disturbed(scene, UNILATERAL, 1e-6)]
    starts = [[getattr(one, name) for name in START] for one in disturbed]
    alpha, p = PAPER_BLOCK.alpha, scene.frequency_parameter
    units = np.array([alpha, alpha * p, PAPER_BLOCK.radius * alpha * p, 0.0])
    np.testing.assert_array_equal(np.max(starts, axis=0), 1e-6 * units)
    np.testing.assert_array_equal(np.min(starts, axis=0), -1e-6 * units)
    for _, one in _disturbed(scene, EventBasedModel(friction="no-slip"), 1e-6):
        assert one.initial_velocity == 0.0


@pytest.mark.parametrize(
    ("change", "flies"),
    [
        ({}, False),
        ({"excitation": Sine(amplitude=1.0, period=1.0, cycles=1)}, False),
        ({"initial_height": 0.05}, True),
        ({"vertical": Sine(amplitude=1.0, period=1.0, cycles=1)}, True),
        ({"floor": Floor(friction=0.5, restitution=0.3)}, True),
        ({"walls": (Wall(side="right", gap=0.01),)}, True),
    ],
)
def test_only_what_may_fly_may_land_flat(change: dict[str, object], flies: bool) -> None:
    assert may_fly(BALANCED.replace(**change)) is flies
