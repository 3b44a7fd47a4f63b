"""Round numbers, ties and motions as small as noise: what once found no mode, no impact or went
through a wall now runs, contacts held."""

from pathlib import Path

import numpy as np
import pytest
from stepping import assert_contacts_hold

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.core import rules
from rockcheck.scenes import Block, Floor, Record, Scene, Wall, load_scene
from rockcheck.scenes.files import read_toml
from rockcheck.scenes.scene import PAPER_BLOCK

CHOICES = Path(__file__).parents[2] / "data" / "modelling_choices"
PINNED = read_toml(CHOICES / "index.toml")["choices"]
SQUAT = Block(half_width=0.1, half_height=0.05)
TALL = Block(half_width=0.2, half_height=1.0)
SETTINGS = (
    {},
    {"pivot": "unilateral"},
    {"pivot": "unilateral", "impacts": "floor-first"},
    {"friction": "no-slip"},
    {"friction": "bouc-wen"},
)


def scene_of(
    block: Block, friction: float, duration: float, restitution: float = 0.0, **more: object
) -> Scene:
    floor = Floor(friction=friction, restitution=restitution)
    return Scene(
        name="exact",
        block=block,
        floor=floor,
        duration=duration,
        output_step=duration / 200.0,
        **more,
    )


def walls(left: float, right: float, e_left: float, e_right: float) -> list[Wall]:
    return [
        Wall(side="left", gap=left, restitution=e_left),
        Wall(side="right", gap=right, restitution=e_right),
    ]


TOUCHES = Wall(side="left", gap=0.0, restitution=0.5)
SCENES = {
    **{
        f"spins by {w:g} rad/s": scene_of(PAPER_BLOCK, 0.5, 3.0, initial_angular_velocity=w)
        for w in (1e-300, 1e-12, 1.4e-11, 1e-10, 1e-9)
    },
    **{
        f"tilted by {tilt:g}": scene_of(PAPER_BLOCK, 0.5, 3.0, initial_rotation=tilt)
        for tilt in (1e-300, 1e-13, 1e-11)
    },
    **{
        f"slides by {v:g} m/s at a wall": scene_of(
            PAPER_BLOCK, 0.3, 2.0, walls=[TOUCHES], initial_velocity=-v
        )
        for v in (1e-9, 1e-8)
    },
    "diagonal that just fits": scene_of(
        TALL,
        0.2,
        4.0,
        walls=walls(TALL.radius - 0.2, TALL.radius - 0.2, 1.0, 0.0),
        initial_angular_velocity=0.99,
        gravity=1.0,
    ),
    # Weightless: the rotation is uniform, so that the series of its rate ends at once, not those of
    # sine and cosine.
    "uniform rotation": scene_of(
        Block(half_width=0.25, half_height=1.0),
        0.75,
        4.0,
        walls=walls(0.75, 0.0, 0.5, 0.5),
        initial_angular_velocity=-0.7,
        gravity=10.0,
        vertical=Record.from_samples([-10.0] * 400, 0.01),
    ),
}


def played(scene: Scene, **settings: object) -> None:
    history = EventBasedModel(**settings).simulate(scene)
    assert_contacts_hold(scene, history, 1e-9 * scene.block.radius)


#: A pivot that never slips does not start with slip.
PAIRS = [
    (s, n)
    for s in SETTINGS
    for n in SCENES
    if s.get("friction") != "no-slip" or SCENES[n].initial_velocity == 0.0
]


@pytest.mark.parametrize(("settings", "name"), PAIRS, ids=str)
def test_it_runs_and_contacts_hold(settings, name):
    played(SCENES[name], **settings)


@pytest.mark.parametrize("impacts", ["moreau", "floor-first"])
@pytest.mark.parametrize("tilt", np.linspace(0.05, 1.05, 21).round(3).tolist())
def test_a_squat_block_on_a_floor_that_bounces(tilt, impacts):
    """Both bottom corners, friction and restitution: every tilt has an impact that fits."""
    played(
        scene_of(SQUAT, 0.75, 1.0, 0.5, initial_rotation=tilt), pivot="unilateral", impacts=impacts
    )


@pytest.mark.parametrize("level", [-9.81, -9.81 * (1.0 - 1e-12), -9.81 * (1.0 + 1e-12)])
@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_weightless(level, settings):
    """The base falls with exactly g: no contact carries force, and nothing decides."""
    scene = scene_of(
        PAPER_BLOCK,
        0.5,
        1.0,
        vertical=Record.from_samples([level] * 100, 0.01),
        excitation=Record.from_samples([1.0] * 50, 0.01),
    )
    played(scene, **settings)
    played(scene.replace(initial_rotation=0.05), **settings)


def test_every_modelling_choice_has_a_pinned_scene():
    """A choice that no scene needs would go."""
    assert {one["name"] for one in PINNED.values()} == set(rules.NAMES)


@pytest.mark.parametrize("slug", PINNED)
def test_a_modelling_choice_is_made_in_its_scene(slug):
    history = EventBasedModel(**PINNED[slug]["model"]).simulate(
        load_scene(CHOICES / f"{slug}.toml")
    )
    assert history.cost.rules[PINNED[slug]["name"]] > 0
