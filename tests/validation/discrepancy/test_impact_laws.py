"""Which law of impacts a history followed at a flush landing, or at a flat one."""

import pytest

from rockcheck import (
    Block,
    ContinuousModel,
    EventBasedModel,
    Floor,
    History,
    Record,
    Ricker,
    Scene,
    Wall,
    engines,
)
from rockcheck.engines import adaptive_march
from rockcheck.scenes import PAPER_BLOCK
from rockcheck.validation.discrepancy import impact_laws

UNILATERAL = EventBasedModel(pivot="unilateral")


def law_followed(scene: Scene, history: History) -> impact_laws.LawFollowed | None:
    return (landing := impact_laws.parting_landing(scene)) and landing.followed_by(history, scene)


def flush_landing(restitution: float, side: str = "left") -> Scene:
    """A block that stands against a wall and is tilted away from it: its first landing is on floor
    and wall at once."""
    return Scene(
        name="flush",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.5),
        walls=[Wall(side=side, gap=0.0, restitution=restitution)],
        initial_rotation=0.3 * PAPER_BLOCK.alpha * (-1.0 if side == "left" else 1.0),
        duration=1.0,
        output_step=0.002,
    )


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("law", ["closed", "open", "floor-first"])
def test_a_branch_is_known_again(law: str, restitution: float, side: str) -> None:
    # beside a plastic wall it rests, or hops: the base tells
    pull = [0.0] * 4 + [-4.0 if side == "left" else 4.0] * (7 if restitution == 0.0 else 0)
    scene = flush_landing(restitution, side).replace(excitation=Record.from_samples(pull, 0.1))
    found = law_followed(scene, EventBasedModel(pivot="unilateral", impacts=law).simulate(scene))
    assert found.law == law
    assert found.errors[law] < 1e-6 < found.spread


@pytest.mark.parametrize(
    ("of", "played", "law"), [(0.5, 0.5, "closed"), (1.0, 1.0, "open"), (0.5, 0.9, "none")]
)
def test_the_default_law_is_closed_below_one_and_open_at_one_and_none_is_between(
    of: float, played: float, law: str
) -> None:
    assert law_followed(flush_landing(of), UNILATERAL.simulate(flush_landing(played))).law == law


@pytest.mark.parametrize(
    ("restitution", "of", "played"),
    [
        pytest.param(0.5, {"walls": []}, {"walls": []}, id="no wall"),
        pytest.param(0.0, {}, {}, id="a plastic wall"),
        pytest.param(0.5, {}, {"initial_rotation": -0.27 * PAPER_BLOCK.alpha}, id="parted before"),
        pytest.param(0.5, {}, {"duration": 0.368}, id="ends before"),
    ],
)
def test_where_there_is_nothing_to_tell(restitution: float, of: dict, played: dict) -> None:
    scene = flush_landing(restitution)
    assert law_followed(scene.replace(**of), UNILATERAL.simulate(scene.replace(**played))) is None


@pytest.mark.parametrize(
    "closed", [adaptive_march.CLOSED, 1.4 * adaptive_march.CLOSED, 4.0 * adaptive_march.CLOSED]
)
@pytest.mark.parametrize(
    "engine",
    [
        pytest.param(name, marks=pytest.mark.needs(name.lower()))
        for name in ("Dart", "MuJoCo", "PyBullet", "Pymunk")
    ],
)
@pytest.mark.parametrize(
    "scene",
    [
        Scene(  # by 1e-9 R, as the wall is struck just before the landing
            name="the wall lifts the pivot",
            block=Block(half_width=0.28532883023336414, half_height=0.9584296837210646),
            floor=Floor(friction=0.6943690325519232),
            walls=[Wall(side="left", gap=0.0, restitution=0.25)],
            excitation=Ricker(amplitude=-8.048561710708649, period=0.8978701000666194),
            duration=2.404,
            output_step=0.002,
        ),
        Scene(
            name="the pivot slides",
            block=Block(half_width=0.22150172490006162, half_height=0.9751599796270853),
            floor=Floor(friction=0.34861762111375877),
            walls=[Wall(side="right", gap=0.0, restitution=0.75)],
            excitation=Ricker(amplitude=-2.4792903934729824, period=1.0072062070663723),
            duration=2.536,
            output_step=0.002,
        ),
        Scene(
            name="all corners at one instant",
            block=Block(half_width=0.19823976575679186, half_height=0.9801535569861961),
            floor=Floor(friction=0.6553428619246915),
            walls=[Wall(side="right", gap=0.0, restitution=0.75)],
            initial_rotation=0.024850248047026815,
            initial_angular_velocity=-0.0662681837727805,
            duration=0.3,
            output_step=0.002,
        ),
    ],
    ids=lambda scene: scene.name,
)
def test_corners_that_land_at_one_instant_share_the_impact(
    scene: Scene, engine: str, closed: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So with steps that end at events all engines follow the closed branch, however near a corner
    must be to touch."""
    monkeypatch.setattr(adaptive_march, "CLOSED", closed)
    model = getattr(engines, engine)(time_step="adaptive")
    found = law_followed(scene, model.simulate(scene))
    assert found.law == "closed"
    assert found.errors["closed"] == pytest.approx(0.0, abs=3e-6)


def test_where_two_laws_give_one_motion_both_are_named() -> None:
    tall = Block(half_width=0.5, half_height=1.2)
    scene = flush_landing(0.5).replace(block=tall, initial_rotation=-0.3 * tall.alpha)
    found = law_followed(scene, UNILATERAL.simulate(scene))
    assert found.law == "closed or open"
    assert max(found.errors["closed"], found.errors["open"]) < 1e-3 < found.spread


FLAT = Scene(  # dropped upright while it moves to the left: its left corner leads
    name="flat",
    block=Block(half_width=0.3, half_height=1.0),
    floor=Floor(friction=0.9),
    initial_height=0.05,
    initial_velocity=-1.0,
    duration=3.0,
)


@pytest.mark.parametrize(("tilt", "law"), [(1e-9, "leading-first"), (-1e-9, "trailing-first")])
@pytest.mark.parametrize("speed", [-1.0, 1.0])
def test_a_tilt_that_is_next_to_nothing_says_which_corner_is_first(
    tilt: float, law: str, speed: float
) -> None:
    """Tilted to the side to which it slides a block lands on its leading corner; the laws are the
    limits of such landings."""
    scene = FLAT.replace(initial_velocity=speed)
    tilted = UNILATERAL.simulate(scene.replace(initial_rotation=-speed * tilt))
    found = law_followed(scene, tilted)
    assert law in found.law.split(" or ")
    assert found.errors[law] < 1e-7 < found.spread
    untilted = EventBasedModel(pivot="unilateral", impacts=law).simulate(scene)
    assert untilted.outcome == tilted.outcome
    assert untilted.peak_rotation == pytest.approx(tilted.peak_rotation, abs=1e-6)
    assert untilted.outcome.startswith("overturned") == (law == "trailing-first")


@pytest.mark.parametrize(
    ("change", "flat"), [({"initial_velocity": 0.0}, 1), ({"initial_rotation": 0.01}, None)]
)
def test_a_flat_landing_is_told_from_one_without_slip_and_one_that_tips(change, flat) -> None:
    scene = FLAT.replace(**change)
    assert UNILATERAL.simulate(scene).cost.rules.get("flat landing") == flat
    assert impact_laws.parting_landing(scene) is None


def test_a_block_that_a_wall_has_struck_lands_flat() -> None:
    """The continuous model tells that this landing has several answers: it follows another one as
    its springs grow stiffer."""
    scene = Scene(
        name="struck",
        block=Block(half_width=0.6257529044558684, half_height=1.450050869104316),
        floor=Floor(friction=0.9321670161858135),
        walls=[Wall(side="right", gap=0.016955975821364672)],
        excitation=Ricker(amplitude=14.520221522782801, period=0.6777755218716803),
        duration=2.0,
    )
    landing = impact_laws.parting_landing(scene)
    assert landing.t == pytest.approx(1.8439, abs=scene.output_step)
    soft, other, stiff = (
        landing.followed_by(
            ContinuousModel(penetration=depth).simulate(scene.replace(output_step=step)), scene
        )
        for depth, step in ((1e-8, 0.005), (1e-8, 0.0037), (1e-10, 0.005))
    )
    assert stiff.law != soft.law == other.law == "moreau or leading-first"
