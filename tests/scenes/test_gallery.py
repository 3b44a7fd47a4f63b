"""The scenes that are not the paper's teach what their description, and docs/gallery.md, says they
do: played by the reference."""

from pathlib import Path

import numpy as np
import pytest

from rockcheck import EventBasedModel, History, Ricker, Scene, load_scene, named_scenes

CASES = ("rack", "loaded", "bookcase", "statue", "vial", "boulder")


def played(scene: Scene, pivot: str = "unilateral") -> History:
    return EventBasedModel(pivot=pivot).simulate(scene)


def test_each_stands_in_the_list_and_on_the_page_with_a_line(typed):
    assert set(named_scenes()) == {*CASES, "fig4a", "fig4b", "fig5a", "fig5b"}
    listed = " ".join(typed("scenes")[0].split())
    page = (Path(__file__).parents[2] / "docs" / "gallery.md").read_text(encoding="utf-8")
    assert [name for name in CASES if f"| `{name}` |" not in page] == []
    assert [name for name in CASES if f"{name} {load_scene(name).description}" not in listed] == []


def test_the_rack_walks_to_its_wall_where_it_may_hop():
    """The two models agree until the first hit; then one hops, and is carried to the wall."""
    scene = load_scene("rack")
    free, held = played(scene), played(scene, "bilateral")
    assert free.outcome == held.outcome == "at rest"
    assert free.channels["slip"][-1] == pytest.approx(-0.05, abs=1e-4)  # the whole gap
    assert abs(held.channels["slip"][-1]) < 0.02
    hops, rocks = ([event.kind for event in one.event_list] for one in (free, held))
    assert hops.count("wall impact") > 3 * rocks.count("wall impact") > 0


LOADED, PLAIN, BOULDER = (load_scene(name) for name in ("loaded", "rack", "boulder"))
TURNED = {"excitation": LOADED.excitation.scaled(-1.0)}


@pytest.mark.parametrize(
    ("name", "change", "outcome"),
    [
        # The loaded rack falls to its heavy side only. The pulse turned round does not overturn it,
        # and the homogeneous rack stands either way.
        ("loaded", {}, "overturned right"),
        ("loaded", TURNED, "at rest"),
        ("loaded", {"block": PLAIN.block}, "moving"),
        ("loaded", {"block": PLAIN.block} | TURNED, "moving"),
        # The wall throws the bookcase, which would stand without.
        ("bookcase", {}, "overturned right"),
        ("bookcase", {"walls": ()}, "moving"),
        # The vial falls by the longer pulse only, and the boulder stands under more.
        ("vial", {}, "overturned right"),
        ("vial", {"excitation": Ricker(amplitude=5.0, period=0.1)}, "at rest"),
        ("boulder", {}, "overturned right"),
        ("boulder", {"excitation": BOULDER.excitation.scaled(1.2)}, "at rest"),
    ],
)
def test_what_falls_and_what_stands(name, change, outcome):
    assert played(load_scene(name).replace(**change)).outcome == outcome


def test_blocks_are_as_they_are_described():
    assert PLAIN.block == LOADED.block.replace(
        centre_of_mass=None, moment_of_inertia=None, mass=None
    )
    assert [round(LOADED.block.pivot(side).alpha, 2) for side in ("left", "right")] == [0.47, 0.29]
    assert load_scene("vial").block.radius == pytest.approx(0.047, abs=5e-4)


def test_the_bookcase_tilts_half_way_without_its_wall():
    scene = load_scene("bookcase")
    assert 0.4 < played(scene.replace(walls=())).peak_rotation / scene.block.alpha < 0.6


def test_the_statue_slides_and_never_rocks():
    scene = load_scene("statue")
    assert scene.floor.mu_s < scene.block.half_width / scene.block.half_height
    history = played(scene)
    assert history.peak_rotation == 0.0
    assert 0.025 < np.max(np.abs(history.channels["slip"])) < 0.04
