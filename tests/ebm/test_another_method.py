"""The bilateral model by another method: the paper's closed-form equations, integrated by scipy's
DOP853 at 1e-13.

Nothing of `ebm` is used on this side. Equations of motion are written out mode by mode, (3), (7),
(8), LEAN and LADDER; impacts are solved from the balances of momentum and the laws of restitution
and friction, not from the paper's solved forms. SI units, unit mass, signs as in a Scene.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from paper_model import Mode, PaperModel, sign
from stepping import TILTED, run_at

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Block, Floor, Record, Rest, Ricker, Scene, Sine, Wall, load_scene
from rockcheck.scenes.scene import PAPER_BLOCK

SLOPE = 9.81 * math.tan(PAPER_BLOCK.alpha)


def pulse(frequency_ratio: float, amplitude_ratio: float) -> Ricker:
    """A pulse of omega_p = ratio p and a_p = ratio g tan(alpha)."""
    return Ricker(
        amplitude=amplitude_ratio * SLOPE,
        period=2.0 * math.pi / (frequency_ratio * PAPER_BLOCK.frequency_parameter),
    )


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
    scene("rocking", pulse(2.0, 1.1), 5.0, 1.0),
    scene("slide-rock", pulse(4.5, 4.0), 6.0, 0.3),
    scene("static above kinetic friction", pulse(4.5, 4.0), 5.0, 0.28, static=0.45),
    scene(
        "vertical shaking",
        pulse(4.5, 4.0),
        4.0,
        0.3,
        vertical=Sine(amplitude=4.0, period=0.4, cycles=8),
    ),
    scene("plastic left wall", pulse(4.5, 4.0), 5.0, 0.3, beside("left", 0.053, 0.0)),
    scene("plastic right wall", pulse(3.0, 2.5), 5.0, 0.6, beside("right", 0.053, 0.0)),
    scene("leaning on the wall", pulse(1.0, 1.1), 5.6, 0.3, beside("left", 0.003, 0.0)),
    scene("left wall, half restitution", pulse(4.5, 4.0), 5.0, 0.3, beside("left", 0.053, 0.5)),
    scene(
        "elastic right wall, overturning", pulse(3.0, 2.5), 5.0, 0.3, beside("right", 0.103, 1.0)
    ),
    scene("grazing the wall", pulse(3.0, 6.0), 6.0, 0.3, beside("right", 0.003, 1.0)),
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


def random_scene(rng: np.random.Generator, side: str) -> Scene:
    radius, alpha = 10.0 ** rng.uniform(-2, 2), rng.uniform(0.05, 0.7)
    block = Block(half_width=radius * math.sin(alpha), half_height=radius * math.cos(alpha))
    return Scene(
        name="random",
        block=block,
        floor=Floor(friction=rng.uniform(0.0, 1.2)),
        walls=beside(side, radius * rng.uniform(0.01, 0.3), 0.0),
        excitation=Ricker(amplitude=rng.uniform(-20.0, 20.0), period=1.0),
        vertical=Sine(amplitude=rng.uniform(-5.0, 5.0), period=1.3, cycles=5),
        duration=4.0,
    )


@pytest.mark.parametrize("case", [1, -1], ids=["case I", "case II"])
@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("name", ["rock", "slide-rock", "lean", "ladder"])
def test_series_begin_with_the_closed_forms(name, side, case):
    """x'', theta'', P, Q and N of the models' series are the paper's, at 200 random blocks and
    states, to 1e-12."""
    from rockcheck.ebm import natural
    from rockcheck.ebm.core import motion
    from rockcheck.ebm.core.names import Pivot, Row

    rng = np.random.default_rng(20240229)
    for _ in range(200):
        scene = random_scene(rng, side)
        paper = PaperModel(scene)
        b = natural.setting_of(scene, unilateral=False, no_slip=False, energy_cap=False)
        t, unit, R, g = (
            rng.uniform(0.5, 3.5),
            natural.time_unit(scene),
            scene.block.radius,
            scene.gravity,
        )
        d = 0 if name in ("rock", "lean") else int(rng.choice([-1, 1]))
        S = case * paper.side
        theta, w = S * paper.alpha * rng.uniform(0.01, 1.2), rng.uniform(-1.0, 1.0) / unit
        _, c, sp, _ = paper.geometry(theta)
        if name == "lean":
            w = 0.0
        x, v = rng.uniform(-0.1, 0.1) * R, -R * c * w + d * rng.uniform(0.1, 1.0) * R / unit
        if name == "ladder":
            w = d * abs(w)
            v = R * paper.C(S, np.array([x, theta, 0.0, 0.0])) * w
        if name in ("lean", "ladder"):
            x = paper.side * (R * sp - paper.delta)
        y = np.array([x, theta, v, w])
        mode = Mode(S, d, paper.side if name in ("lean", "ladder") else 0)
        mode = Mode(S, d, mode.Sw, sign(paper.motion(mode, t, y)[2]))
        expected = np.array(paper.motion(mode, t, y)) / [g, g / R, g, g, g]

        s = math.sin(paper.alpha - abs(theta))
        run = run_at(
            [x / R, c, theta, v * unit / R, S * s * w * unit, w * unit],
            t=t / unit,
            **TILTED | {"pull": mode.sense},
            sense=S,
            slip=S * d,
            pivot=Pivot.SLIPPING if d else Pivot.STICK,
            tip=mode.Sw == S,
            far=mode.Sw == -S,
        )
        order, a = motion.tilt_series(b, natural.base_of(scene), run, 8, 0.0, 0.0), run.a
        assert order == 8
        x2 = S * 2.0 * a[Row.XI, 2] if name != "rock" else S * 2.0 * a[Row.SIN, 2]
        push = a[Row.NA, 0] + a[Row.NB, 0] if mode.Sw else 0.0
        found = [x2, S * a[Row.OMEGA, 1], a[Row.P, 0], S * a[Row.Q, 0], push]
        scale = 1.0 + np.abs(expected).max()
        # The forces of a block that leans on its own pivot's side are as ill-conditioned as
        # 1/(c + C).
        if name == "lean":
            scale /= c + paper.C(S, y)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * scale)
