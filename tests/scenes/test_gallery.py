"""The scenes that are not the paper's teach what their description, and docs/gallery.md, says they
do: played by the reference."""

from pathlib import Path

import numpy as np
import pytest

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Block, History, Scene, load_scene, named_scenes
from rockcheck.scenes.excitations import Ricker

CASES = ("rack", "loaded", "bookcase", "statue", "vial", "boulder")


def played(scene: Scene, pivot: str = "unilateral") -> History:
    return EventBasedModel(pivot=pivot).simulate(scene)


def hits(history: History) -> int:
    return sum(event.kind == "wall impact" for event in history.event_list)


def test_each_stands_in_the_list_and_on_the_page_with_a_line(typed):
    assert set(named_scenes()) == {*CASES, "fig4a", "fig4b", "fig5a", "fig5b"}
    listed = " ".join(typed("scenes")[0].split())
    page = (Path(__file__).parents[2] / "docs" / "gallery.md").read_text(encoding="utf-8")
    for name in CASES:
        assert f"{name} {load_scene(name).description}" in listed
        assert f"| `{name}` |" in page


def test_the_rack_walks_to_its_wall_where_it_may_hop():
    """The two models agree until the first hit; then one hops, and is carried to the wall."""
    scene = load_scene("rack")
    free, held = played(scene), played(scene, "bilateral")
    assert free.outcome == held.outcome == "at rest"
    assert free.channels["slip"][-1] == pytest.approx(-0.05, abs=1e-4)  # the whole gap
    assert abs(held.channels["slip"][-1]) < 0.02
    assert hits(free) > 3 * hits(held) > 0


def test_the_loaded_rack_falls_to_its_heavy_side_only():
    """The pulse turned round does not overturn it, and the homogeneous rack stands either way."""
    scene = load_scene("loaded")
    turned = scene.replace(excitation=scene.excitation.scaled(-1.0))
    assert [played(one).outcome for one in (scene, turned)] == ["overturned right", "at rest"]
    plain = load_scene("rack").block
    assert plain == Block(half_width=scene.block.half_width, half_height=scene.block.half_height)
    assert not any(
        played(one.replace(block=plain)).outcome.startswith("overturned") for one in (scene, turned)
    )
    assert [round(scene.block.pivot(side).alpha, 2) for side in ("left", "right")] == [0.47, 0.29]


def test_the_wall_throws_the_bookcase_which_would_stand_without():
    scene = load_scene("bookcase")
    assert played(scene).outcome == "overturned right"
    alone = played(scene.replace(walls=()))
    assert not alone.outcome.startswith("overturned")
    assert 0.4 < alone.peak_rotation / scene.block.alpha < 0.6


def test_the_statue_slides_and_never_rocks():
    scene = load_scene("statue")
    assert scene.floor.mu_s < scene.block.half_width / scene.block.half_height
    history = played(scene)
    assert history.peak_rotation == 0.0
    assert 0.025 < np.max(np.abs(history.channels["slip"])) < 0.04


@pytest.mark.parametrize(
    ("name", "radius", "excitation"),
    [
        ("vial", 0.047, Ricker(amplitude=5.0, period=0.1)),
        ("boulder", None, load_scene("boulder").excitation.scaled(1.2)),
    ],
)
def test_the_vial_falls_by_the_longer_pulse_only_and_the_boulder_stands_under_more(
    name, radius, excitation
):
    scene = load_scene(name)
    assert radius is None or scene.block.radius == pytest.approx(radius, abs=5e-4)
    assert played(scene).outcome == "overturned right"
    assert played(scene.replace(excitation=excitation)).outcome == "at rest"
