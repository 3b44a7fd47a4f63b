"""The restitution reached, against the one that the scene asks for."""

import math

import numpy as np
import pytest

from rockcheck import (
    Block,
    ContinuousModel,
    EventBasedModel,
    Floor,
    Scene,
    Wall,
)
from rockcheck.cm.contact_law import damping_ratio_of_paper, restitution_of
from rockcheck.engines.contacts import arm_of, contacts_of, gap_of, rate_of
from rockcheck.scenes import PAPER_BLOCK

RESTITUTIONS = [0.0, 0.25, 0.5, 0.75, 1.0]


def scene(*, friction=0.3, static=None, floor=0.0, wall=None, gap=0.03, side="left", **change):
    return Scene(
        **{
            "name": "strike",
            "block": PAPER_BLOCK,
            "floor": Floor(friction=friction, static_friction=static, restitution=floor),
            "walls": [] if wall is None else [Wall(side=side, gap=gap, restitution=wall)],
            "duration": 0.7,
            "output_step": 0.001,
        }
        | change
    )


def restitution_reached(model, scene):
    """Normal speed after the first impact over that before, of the fastest corner about to touch:
    the scene is played again up to there, with 20 output times in every 1/sqrt(k/m)."""
    first = next(one for one in model.simulate(scene).event_list if one.kind.endswith("impact"))
    sample = max(0.05 / math.sqrt(model.stiffness_in(scene)), first.t / 2e6)
    c = model.simulate(
        scene.replace(duration=first.t + 120.0 * sample, output_step=sample)
    ).channels
    corner, normal, distance = (
        np.array([getattr(one, name) for one in contacts_of(scene)]).T[..., None]
        for name in ("corner", "normal", "distance")
    )
    arm = arm_of(*corner, np.cos(c["theta"]), np.sin(c["theta"]))
    gap, rate = (
        gap_of(*normal, distance, c["x"], c["y"], arm),
        rate_of(*normal, c["x_dot"], c["y_dot"], c["theta_dot"], arm),
    )
    onset = int(first.t / sample)
    near = rate[gap[:, onset] < -3.0 * sample * rate[:, onset], onset:]
    return max(np.max(min(near, key=lambda one: one[0])), 0.0) / -np.min(near[:, 0])


FLOOR = {
    "flat": {"initial_height": 0.02},
    "offset corner, frictionless": {
        "friction": 0.0,
        "initial_height": 0.02,
        "initial_rotation": 0.1,
    },
    "offset corner, slipping": {"friction": 0.1, "initial_height": 0.02, "initial_rotation": 0.2},
    "offset corner, sticking": {"friction": 1.0, "initial_height": 0.02, "initial_rotation": -0.2},
    "corner below the centroid": {
        "friction": 0.3,
        "initial_height": 0.02,
        "initial_rotation": PAPER_BLOCK.alpha,
    },
    "sliding corner": {
        "friction": 0.3,
        "initial_height": 0.02,
        "initial_rotation": 0.1,
        "initial_velocity": -1.0,
    },
    "sliding corner, static friction": {
        "friction": 0.2,
        "static": 0.4,
        "initial_height": 0.02,
        "initial_rotation": 0.1,
        "initial_velocity": -1.0,
    },
    "rocking block": {"friction": 0.3, "initial_rotation": 0.1},
}
WALL = {
    "top corner": {"gap": 0.05, "initial_angular_velocity": 0.5},
    "top corner, right wall": {"gap": 0.05, "side": "right", "initial_angular_velocity": -0.5},
    "bottom corner": {"gap": 0.01, "initial_angular_velocity": -0.3, "initial_velocity": -1.0},
    "bottom corner, rough floor": {
        "friction": 1.0,
        "gap": 0.01,
        "initial_angular_velocity": -0.3,
        "initial_velocity": -1.0,
    },
    "flat side, sliding": {"friction": 0.1, "initial_velocity": -0.7},
    "in flight": {"initial_velocity": -0.7, "initial_height": 0.2, "initial_rotation": -0.05},
}


@pytest.mark.parametrize("e", RESTITUTIONS)
@pytest.mark.parametrize(
    ("struck", "case"), [("floor", case) for case in FLOOR] + [("wall", case) for case in WALL]
)
def test_floor_and_wall_have_the_restitution_asked_for(struck, case, e):
    strike = scene(**{struck: e} | (FLOOR | WALL)[case])
    assert restitution_reached(ContinuousModel(), strike) == pytest.approx(e, abs=1e-3)
    if case in ("rocking block", "top corner"):
        assert restitution_reached(ContinuousModel(penetration=1e-6), strike) == pytest.approx(
            e, abs=0.01
        )


@pytest.mark.parametrize("e", RESTITUTIONS)
def test_paper_rule_misses_as_its_formula_says(e):
    # (33) takes the whole mass, the corner has less of it, and the contact lets go when its force
    # does.
    drop = scene(friction=0.0, floor=e, initial_height=0.02, initial_rotation=0.1)
    lever = PAPER_BLOCK.radius * math.sin(PAPER_BLOCK.alpha - 0.1)
    xi = damping_ratio_of_paper(e) * math.sqrt(1.0 + 3.0 * (lever / PAPER_BLOCK.radius) ** 2)
    assert restitution_reached(ContinuousModel(damping_rule="paper"), drop) == pytest.approx(
        restitution_of(xi), abs=1e-3
    )


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("e", RESTITUTIONS)
def test_both_corners_of_a_side_leave_as_asked_wherever_the_mass_lies(e, side):
    """A side that strikes a wall flat leaves as flat, whatever the stiffness: unlike springs do not
    turn the block."""
    strikes = scene(
        wall=e,
        gap=0.02,
        side=side,
        friction=0.2,
        block=Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.0, 0.3)),
        initial_velocity=-0.6 if side == "left" else 0.6,
        duration=0.1,
    )
    model = ContinuousModel(penetration=1e-10)
    assert np.max(np.abs(model.simulate(strikes).channels["theta_dot"])) < 1e-4
    assert restitution_reached(model, strikes) == pytest.approx(e, rel=1e-3, abs=1e-5)
    # Its whole impulse is told, also of an impact that lasts for 10 ms.
    assert sum(
        event.impulse
        for event in ContinuousModel(penetration=1e-4).simulate(strikes).event_list
        if event.kind == "wall impact"
    ) == pytest.approx((1.0 + e) * math.sqrt(0.6**2 - 2.0 * 0.2 * 9.81 * 0.02), rel=0.03)


def test_a_loaded_block_moves_beside_a_bouncing_wall_as_the_rigid_one():
    """Its mass lies to one side, so that the flush impact turns it over the floor; equal springs
    gave 0.1045 alpha."""
    block = Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.1, 0.3))
    loaded = scene(
        wall=0.6, gap=0.02, friction=0.2, block=block, initial_velocity=-0.6, duration=2.0
    )
    rigid, soft = (
        model.simulate(loaded) for model in (EventBasedModel(pivot="unilateral"), ContinuousModel())
    )
    assert soft.peak_rotation == pytest.approx(rigid.peak_rotation, rel=1e-3)
    assert (
        np.sqrt(np.mean((soft.channels["theta"] - rigid.channels["theta"]) ** 2))
        < 1e-4 * block.alpha
    )
