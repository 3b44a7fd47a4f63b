"""Which law of impacts a history followed at a flush landing."""

from __future__ import annotations

import pytest

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Floor, Scene, Wall
from rockcheck.scenes.scene import PAPER_BLOCK
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
