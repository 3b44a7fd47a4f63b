"""Which law of impacts a history followed at a flush landing."""

from __future__ import annotations

import pytest

from rockcheck import engines
from rockcheck.ebm import EventBasedModel
from rockcheck.engines import stepping
from rockcheck.scenes import Block, Floor, Ricker, Scene, Wall
from rockcheck.scenes.scene import PAPER_BLOCK
from rockcheck.validation.discrepancy.impact_laws import flush_landing as flush_landing_of
from rockcheck.validation.discrepancy.impact_laws import law_followed


def flush_landing(restitution: float, side: str = "left") -> Scene:
    """A block that stands against a wall and is tilted away from it: its first landing is on floor and wall at once."""
    tilt = 0.3 * PAPER_BLOCK.alpha * (-1.0 if side == "left" else 1.0)
    wall = Wall(side=side, gap=0.0, restitution=restitution)
    return Scene(
        name="flush", block=PAPER_BLOCK, floor=Floor(friction=0.5), walls=[wall], initial_rotation=tilt, duration=1.0, output_step=0.002
    )


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("restitution", [0.5, 1.0])
@pytest.mark.parametrize("law", ["closed", "open", "floor-first"])
def test_a_branch_is_known_again(law: str, restitution: float, side: str) -> None:
    scene = flush_landing(restitution, side)
    found = law_followed(scene, EventBasedModel(pivot="unilateral", impacts=law).simulate(scene))
    assert found is not None
    assert found.law == law
    assert found.errors[law] < 1e-6 < found.spread


@pytest.mark.parametrize(("restitution", "branch"), [(0.5, "closed"), (1.0, "open")])
def test_the_default_law_is_closed_below_one_and_open_at_one(restitution: float, branch: str) -> None:
    scene = flush_landing(restitution)
    found = law_followed(scene, EventBasedModel(pivot="unilateral").simulate(scene))
    assert found is not None
    assert found.law == branch


def test_a_history_between_the_branches_follows_none() -> None:
    scene = flush_landing(0.5)
    other = flush_landing(0.9)
    found = law_followed(scene, EventBasedModel(pivot="unilateral").simulate(other))
    assert found is not None
    assert found.law == "none"


def test_without_such_a_landing_there_is_nothing_to_tell() -> None:
    free = flush_landing(0.5).replace(walls=[])
    assert law_followed(free, EventBasedModel(pivot="unilateral").simulate(free)) is None
    plastic = flush_landing(0.0)
    assert law_followed(plastic, EventBasedModel(pivot="unilateral").simulate(plastic)) is None


PIVOT_IS_LIFTED = Scene(  # by 1e-9 R, as the wall is struck just before the landing
    name="the wall lifts the pivot",
    block=Block(half_width=0.28532883023336414, half_height=0.9584296837210646),
    floor=Floor(friction=0.6943690325519232),
    walls=[Wall(side="left", gap=0.0, restitution=0.25)],
    excitation=Ricker(amplitude=-8.048561710708649, period=0.8978701000666194),
    duration=2.404,
    output_step=0.002,
)
SLIDES = Scene(
    name="the pivot slides",
    block=Block(half_width=0.22150172490006162, half_height=0.9751599796270853),
    floor=Floor(friction=0.34861762111375877),
    walls=[Wall(side="right", gap=0.0, restitution=0.75)],
    excitation=Ricker(amplitude=-2.4792903934729824, period=1.0072062070663723),
    duration=2.536,
    output_step=0.002,
)


ALL_AT_ONCE = Scene(
    name="all corners at one instant",
    block=Block(half_width=0.19823976575679186, half_height=0.9801535569861961),
    floor=Floor(friction=0.6553428619246915),
    walls=[Wall(side="right", gap=0.0, restitution=0.75)],
    initial_rotation=0.024850248047026815,
    initial_angular_velocity=-0.0662681837727805,
    duration=0.3,
    output_step=0.002,
)


@pytest.mark.parametrize("closed", [stepping.CLOSED, 1.4 * stepping.CLOSED, 4.0 * stepping.CLOSED])
@pytest.mark.parametrize("engine", ["Dart", "MuJoCo", "PyBullet", "Pymunk"])
@pytest.mark.parametrize("scene", [PIVOT_IS_LIFTED, SLIDES, ALL_AT_ONCE], ids=lambda scene: scene.name)
def test_corners_that_land_at_one_instant_share_the_impact(
    scene: Scene, engine: str, closed: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So with steps that end at events all engines follow the closed branch, however near a corner must be to touch."""
    model = getattr(engines, engine)
    if not model.installed():
        pytest.skip(f"{engine} is not installed")
    monkeypatch.setattr(stepping, "CLOSED", closed)
    found = law_followed(scene, model(time_step="adaptive").simulate(scene))
    assert found is not None
    assert found.law == "closed"
    assert found.errors["closed"] < 3e-6


def test_where_two_laws_give_one_motion_both_are_named() -> None:
    tall = Block(half_width=0.5, half_height=1.2)
    scene = flush_landing(0.5).replace(block=tall, initial_rotation=-0.3 * tall.alpha)
    found = law_followed(scene, EventBasedModel(pivot="unilateral").simulate(scene))
    assert found is not None
    assert found.law == "closed or open"
    assert max(found.errors["closed"], found.errors["open"]) < 1e-3 < found.spread


def test_a_history_that_parted_before_the_landing_tells_nothing() -> None:
    scene = flush_landing(0.5)
    other = scene.replace(initial_rotation=0.9 * scene.initial_rotation)
    assert law_followed(scene, EventBasedModel(pivot="unilateral").simulate(other)) is None


def test_a_history_that_ends_before_the_landing_tells_nothing() -> None:
    scene = flush_landing(0.5)
    landing = flush_landing_of(scene)
    assert landing is not None
    short = EventBasedModel(pivot="unilateral").simulate(scene.replace(duration=landing.t - 0.05))
    assert landing.followed_by(short, scene) is None
