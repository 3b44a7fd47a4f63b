"""A block whose mass lies low and to the right, by every model: two pivots, slip, a wall on either
side."""

import numpy as np
import pytest

from rockcheck import engines
from rockcheck.cm import ContinuousModel
from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Block, Floor, Ricker, Scene, Wall

RACK = Block(
    half_width=0.3,
    half_height=1.0,
    mass=400.0,
    centre_of_mass=(0.08, -0.25),
    moment_of_inertia=110.0,
)
PULSE = Ricker(amplitude=6.5, period=0.8)
SCENES = {
    "on its left pivot": {"initial_rotation": 0.1, "duration": 1.5},
    "on its right pivot": {"initial_rotation": -0.1, "duration": 1.5},
    "slips": {"floor": Floor(friction=0.3), "excitation": PULSE},
    "left wall": {"walls": [Wall(side="left", gap=0.03, restitution=0.3)], "excitation": PULSE},
    "right wall": {"walls": [Wall(side="right", gap=0.03, restitution=0.3)], "excitation": PULSE},
}
ALL = [
    engine
    for engine in (getattr(engines, name) for name in engines.__all__)
    if engine.installed() and not engine.fixed_because
]
#: Models at their best, and engines as they come; how far from the unilateral model they may be,
#: RMS in alpha.
BEST = [(engine(time_step="adaptive"), 1e-5) for engine in ALL] + [(ContinuousModel(), 3e-4)]
STOCK = [(engine(time_step=1e-4, settings="default"), 5e-2) for engine in ALL]


def scene_of(name: str) -> Scene:
    return Scene(
        **{"name": name, "block": RACK, "floor": Floor(friction=0.5), "duration": 2.5}
        | SCENES[name]
    )


@pytest.fixture(scope="module")
def references() -> dict[str, np.ndarray]:
    """x of the box's centre and theta of each scene by the unilateral event-based model."""
    histories = {
        name: EventBasedModel(pivot="unilateral").simulate(scene_of(name)) for name in SCENES
    }
    assert all(np.max(np.abs(history.channels["theta"])) > 5e-3 for history in histories.values())
    return {
        name: np.array([history.channels["x"], history.channels["theta"]])
        for name, history in histories.items()
    }


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(
    ("player", "allowed"), [*BEST, *STOCK], ids=lambda one: getattr(one, "name", None)
)
def test_each_model_knows_where_the_mass_is(player, allowed, name, references):
    history = player.simulate(scene_of(name))
    x, theta = references[name]
    assert np.sqrt(np.mean((history.channels["theta"] - theta) ** 2)) < allowed * RACK.alpha
    assert np.max(np.abs(history.channels["x"] - x)) < 10.0 * allowed * RACK.radius


def test_the_continuous_model_begins_at_rest():
    """Its springs share the weight as the mass lies: what stands stands still, to a thousandth of
    the depth that it sinks."""
    scene = Scene(name="stands", block=RACK, floor=Floor(friction=0.5), duration=0.5)
    for model in (ContinuousModel(penetration=1e-6), ContinuousModel(penetration=1e-4)):
        channels = model.simulate(
            scene
        ).channels  # its first row is the scene's, before it has sunk
        assert np.ptp(channels["y"][1:]) < 1e-3 * model.penetration
        assert np.ptp(channels["theta"][1:]) * RACK.half_width < 1e-3 * model.penetration
