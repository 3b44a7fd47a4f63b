"""The bilateral model by another method: the paper's closed-form equations, integrated by scipy's
DOP853 at 1e-13.

Nothing of `ebm` is used on this side. Equations of motion are written out mode by mode, (3), (7),
(8), LEAN and LADDER; impacts are solved from the balances of momentum and the laws of restitution
and friction, not from the paper's solved forms. SI units, unit mass, signs as in a Scene.
"""

import numpy as np
import pytest
from cases import ricker
from paper_model import PaperModel

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Floor, Record, Rest, Ricker, Scene, Sine, Wall, load_scene
from rockcheck.scenes.scene import PAPER_BLOCK


def beside(side: str, gap: float, e: float) -> list[Wall]:
    return [Wall(side=side, gap=gap, restitution=e)]


def scene(
    name: str,
    excitation: Ricker | Record,
    duration: float,
    mu: float,
    walls: list[Wall] | None = None,
    *,
    static: float | None = None,
    vertical: Sine | None = None,
) -> Scene:
    floor = Floor(friction=mu, static_friction=static)
    return Scene(
        name=name,
        block=PAPER_BLOCK,
        floor=floor,
        walls=walls or [],
        excitation=excitation,
        vertical=vertical or Rest(),
        duration=duration,
    )


SCENES = [
    scene("rocking", ricker(2.0, 1.1), 5.0, 1.0),
    scene("slide-rock", ricker(4.5, 4.0), 6.0, 0.3),
    scene("static above kinetic friction", ricker(4.5, 4.0), 5.0, 0.28, static=0.45),
    scene(
        "vertical shaking",
        ricker(4.5, 4.0),
        4.0,
        0.3,
        vertical=Sine(amplitude=4.0, period=0.4, cycles=8),
    ),
    scene("plastic left wall", ricker(4.5, 4.0), 5.0, 0.3, beside("left", 0.053, 0.0)),
    scene("plastic right wall", ricker(3.0, 2.5), 5.0, 0.6, beside("right", 0.053, 0.0)),
    scene("leaning on the wall", ricker(1.0, 1.1), 5.6, 0.3, beside("left", 0.003, 0.0)),
    scene("left wall, half restitution", ricker(4.5, 4.0), 5.0, 0.3, beside("left", 0.053, 0.5)),
    scene(
        "elastic right wall, overturning", ricker(3.0, 2.5), 5.0, 0.3, beside("right", 0.103, 1.0)
    ),
    scene("grazing the wall", ricker(3.0, 6.0), 6.0, 0.3, beside("right", 0.003, 1.0)),
    scene("recorded", load_scene("fig4a").excitation, 5.0, 0.3),
]
MODES = {
    "slide-rock": {"rest", "rock", "slide-rock"},
    "plastic left wall": {"rest", "rock", "slide-rock", "ladder"},
    "leaning on the wall": {"rest", "rock", "ladder", "lean"},
}
CONTACTS = ("uplift", "floor impact", "wall impact", "overturned left", "overturned right")


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_motion_and_events(scene):
    """Motion within 1e-10 (rad, m, rad/s, m/s), at every row; contacts in the same order, within
    1e-9 s.

    Events are compared as long as impacts are not yet tiny (1e-3 m/s), since an instant is worth
    the less the slower its event is.

    """
    other = PaperModel(scene).run()
    ours = EventBasedModel(tolerance=1e-13).simulate(scene)
    motion = other.at(ours.channels["t"])
    assert len(motion) == len(ours.channels["t"])
    for column, name in enumerate(("x", "theta")):
        np.testing.assert_allclose(ours.channels[name], motion[:, column], rtol=0.0, atol=1e-10)
    struck = (
        np.abs(ours.channels["t"][:, None] - np.array([t for t, _ in other.events])).min(axis=1)
        < 1e-8
    )
    for column, name in enumerate(("x_dot", "theta_dot"), 2):
        np.testing.assert_allclose(
            ours.channels[name][~struck], motion[~struck, column], rtol=0.0, atol=1e-9
        )
    mine = [e for e in ours.event_list if e.kind in CONTACTS]
    theirs = [(t, kind) for t, kind in other.events if kind in CONTACTS or kind == "overturned"]
    slow = next(
        (k for k, e in enumerate(mine) if "impact" in e.kind and e.impulse < 1e-3), len(mine)
    )
    assert [e.kind.split()[0] for e in mine[:slow]] == [
        kind.split()[0] for _, kind in theirs[:slow]
    ]
    np.testing.assert_allclose(
        [e.t for e in mine[:slow]], [t for t, _ in theirs[:slow]], rtol=0.0, atol=1e-9
    )
    assert MODES.get(scene.name, set()) <= set(ours.channels["mode"])


def test_the_fifth_wall_contact():
    """The one row of the bilateral table that differs: `GRAZING_ROW` of test_reference_rows.py.
    There are five wall contacts."""
    grazing = next(scene for scene in SCENES if scene.name == "grazing the wall")
    contacts = [t for t, kind in PaperModel(grazing).run().events if kind == "wall impact"]
    assert len(contacts) == 5
    assert contacts[-1] == pytest.approx(1.4602503120795, abs=1e-9)
