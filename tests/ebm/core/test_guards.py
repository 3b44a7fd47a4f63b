"""The guards of a mode and the series that they follow, against Newton and Euler."""

import itertools
import math

import numpy as np
import pytest
from situations import (
    ORDER,
    PIVOTS,
    Core,
    Mode,
    Situation,
    answer,
    at_wall,
    candidates,
    margin,
    random_tilt,
    standing,
    value,
)
from stepping import ROCKS, run_at, setting_of

from rockcheck.ebm import natural
from rockcheck.ebm.core import (
    contacts as contacts_of_the_core,
    ground,
    modes,
    moving,
)
from rockcheck.ebm.core.names import Guard, Row
from rockcheck.ebm.core.rules import Rule
from rockcheck.scenes import Block, Floor, Ricker, Scene, Wall
from rockcheck.scenes.scene import PAPER_BLOCK


@pytest.mark.parametrize("pivot", PIVOTS)
@pytest.mark.parametrize("touch", ["none", "tip", "far"])
def test_guards_are_what_their_names_say(touch, pivot):
    """Forces by Newton and Euler, friction cones, and gaps from the corners' places now and along
    the motion."""
    rng = np.random.default_rng(47)
    seen: set[str] = set()
    for _ in range(40):
        at, side, touched = random_tilt(rng, touch)
        for mode in candidates(side, touched, pivot):
            if margin(at, mode, touched, pivot) == -math.inf or (
                mode.floor == "stick" and at.state[5] != 0.0 and touched != (False, False)
            ):
                continue
            if mode.floor == "stick":  # rock: as if it stood
                at = Situation(at.alpha, at.mu_s, at.mu_k, at.u, at.g, standing(at), at.walls)
            found = answer(at, mode)
            size = 1.0 + max(
                abs(one) for one in (found.normal, found.friction, found.tip, found.far)
            )
            guards, moves = Core(at.scene, pivot).guards(mode, at.state)
            seen |= guards.keys()
            expected = {
                "push": mode.pull * found.normal,
                "tip push": found.tip,
                "far push": found.far,
            }
            expected |= {
                f"cone {sign}": at.mu_s * mode.pull * found.normal - push
                for sign, push in (("+", found.friction), ("-", -found.friction))
            }
            for name, force in expected.items():
                if name in guards:
                    assert guards[name][0] == pytest.approx(force, abs=1e-11 * size), (name, mode)
            tau = 1e-3
            phi, xi, y = (value(moves[name], tau) for name in ("phi", "xi", "y"))
            for name, gap in gaps(at, side, phi, xi).items():
                if name in guards:
                    assert value(guards[name], tau) == pytest.approx(gap, abs=1e-12), (name, mode)
            if "landing" in guards:
                assert value(guards["landing"], tau) == pytest.approx(
                    y - math.cos(at.alpha - phi), abs=1e-12
                )
            if "slip" in guards and touch == "none":
                rate = np.polynomial.polynomial.polyder(moves["xi"])
                turn = value(np.polynomial.polynomial.polyder(moves["phi"]), tau)
                v = value(rate, tau) + math.cos(at.alpha - phi) * turn
                assert value(guards["slip"], tau) == pytest.approx(mode.slip * v, abs=1e-11)
            if "topple" in guards:
                assert value(guards["topple"], tau) == pytest.approx(0.5 * math.pi - phi, abs=1e-12)
            assert value(guards["phi"], tau) == pytest.approx(phi, abs=1e-15)
    wanted = {"phi", "push", "cone +", "cone -", "slip"}
    wanted |= {f"{touch} push", f"{touch} gap"} if touch != "none" else set()
    assert seen >= wanted | ({"landing", "topple"} if pivot == "unilateral" else set())


def gaps(at: Situation, side: int, phi: float, xi: float) -> dict[str, float]:
    """Clear distance of the tip wall and the far wall from the nearest of the block's four corners,
    which are turned one by one."""
    turned = np.array([[math.cos(phi), -math.sin(phi)], [math.sin(phi), math.cos(phi)]])
    corners = (
        turned
        @ np.array(
            [[sx * math.sin(at.alpha), sy * math.cos(at.alpha)] for sx in (1, -1) for sy in (1, -1)]
        ).T
    )
    places = {1: -(at_wall(at, side) or math.inf), -1: at_wall(at, -side) or math.inf}
    return {
        "tip gap": float(np.min(xi + corners[0])) - places[1],
        "far gap": places[-1] - float(np.max(xi + corners[0])),
    }


@pytest.mark.parametrize(
    "mode",
    [("stick", 0, 1), ("slip", 1, 1), ("slip", -1, 1), ("slip", 1, -1), ("off", 0, 1)],
    ids=str,
)
def test_series_obey_newton_and_euler_in_every_term(mode):
    """Rock, slide-rock and flight: forces and motion, contacts and Coulomb's law hold as
    polynomials of time, not only at the start."""
    floor, slip, pull = mode
    block, phi, w, v = Block(half_width=0.6, half_height=0.8), 0.2, -0.3, 0.4 * slip
    core = Core(
        Scene(
            name="series",
            block=block,
            floor=Floor(friction=0.3),
            excitation=Ricker(amplitude=0.7, period=2.0),
            vertical=Ricker(amplitude=0.2, period=1.5),
            duration=1.0,
            gravity=1.0,
        ),
        "unilateral",
    )
    s, c = math.sin(block.alpha - phi), math.cos(block.alpha - phi)
    core.guards(
        Mode(True, 1, floor, slip, pull, tip=False, far=False), (0.0, c, phi, v - c * w, s * w, w)
    )
    rows = {
        name: core.work[Row[name], : ORDER + 1]
        for name in ("PHI", "OMEGA", "SIN", "COS", "XI", "Y", "P", "Q", "U", "G")
    }
    known = ORDER - 1  # accelerations have two terms fewer

    def product(one, other):
        return np.convolve(rows[one], rows[other])[:known]

    def rate(name, times=1):
        return np.polynomial.polynomial.polyder(rows[name], times)

    np.testing.assert_allclose(rate("SIN")[:known], -product("OMEGA", "COS"), atol=1e-14)
    np.testing.assert_allclose(rate("COS")[:known], product("OMEGA", "SIN"), atol=1e-14)
    np.testing.assert_allclose(
        rate("PHI", 2), 3.0 * (product("COS", "Q") - product("SIN", "P")), atol=1e-13
    )
    xi, y = (rate("SIN", 2), rate("COS", 2)) if floor == "stick" else (rate("XI", 2), rate("Y", 2))
    np.testing.assert_allclose(xi, rows["Q"][:known] - rows["U"][:known], atol=1e-13)
    np.testing.assert_allclose(y, rows["P"][:known] - rows["G"][:known], atol=1e-13)
    if floor == "slip":
        np.testing.assert_allclose(rows["Y"], rows["COS"], atol=1e-14)
        np.testing.assert_allclose(rows["Q"], -0.3 * slip * pull * rows["P"], atol=1e-14)


def test_flight_of_a_block_whose_floor_falls_away():
    """Only a floor that cannot hold lets go; upright the block flies flat."""
    alpha = 0.3
    at = Situation(alpha, 0.5, 0.5, 0.0, -0.2, (0.0, math.cos(alpha), 0.0, 0.0, 0.0, 0.0))
    mode = Core(at.scene, "unilateral").select(at.state)
    assert (mode.name, mode.tilted) == ("flight", False)
    held = Core(at.scene, "bilateral").select(at.state)
    assert (held.name, held.tilted) == (
        "rest",
        False,
    )  # nothing tells left from right: it hangs on both corners
    pushed = {
        u: Situation(alpha, 0.5, 0.5, u, -0.2, (0.0, math.cos(alpha), 0.0, 0.0, 0.0, 0.0))
        for u in (1e-6, -1e-6)
    }
    hangs = {u: Core(one.scene, "bilateral").select(one.state) for u, one in pushed.items()}
    assert {u: (mode.tilted, mode.side) for u, mode in hangs.items()} == {
        1e-6: (True, 1),
        -1e-6: (True, -1),
    }
    slides = {
        v: Core(at.scene, "bilateral").select((*at.state[:3], v, 0.0, 0.0)) for v in (0.1, -0.1)
    }
    assert {v: mode.side for v, mode in slides.items()} == {0.1: -1, -0.1: 1}


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_spin_of_rounding_is_taken_from_a_block_that_leans_on_a_wall(side):
    """One wall is enough; the same block a little away from it keeps its spin, which is then a
    motion."""
    alpha, phi, gap = 0.3, 0.1, 0.2
    sign = 1.0 if side == "left" else -1.0
    walls = [Wall(side=side, gap=gap, restitution=0.0)]
    setting = setting_of(alpha, walls=walls)
    touches = math.sin(alpha + phi) - math.sin(alpha) - gap  # where the top corner meets the wall
    for away, spin in ((0.0, 0.0), (0.05, 0.1 * contacts_of_the_core.SLOW)):
        turns = 0.1 * contacts_of_the_core.SLOW
        place = [sign * (touches + away), math.cos(alpha - phi), sign * phi]
        z = run_at([*place, 0.0, 0.0, turns]).state.motion
        modes._clean(setting, z, True)
        assert z.w == spin


def test_a_block_that_lies_down_along_a_wall_meets_it_while_it_turns_over():
    """However slowly it turns; one that turns back, or has some way to go, does not."""
    for sign in (1, -1):
        for left, spin, lies in (
            (1e-6, 0.5, True),
            (1e-6, 1e-3, True),
            (1e-6, 0.0, False),
            (1e-6, -0.5, False),
            (1e-3, 0.5, False),
        ):
            start = [0.0, 0.0, sign * (0.5 * math.pi - left), 0.0, 0.0, sign * spin]
            state = run_at(start, **ROCKS, sense=sign).state
            state.guard = Guard.TIP_GAP
            assert moving.lies_along_wall(state) == lies
            assert state.rules[Rule.LANDS_ALONG] == lies
            state.guard = Guard.FAR_GAP
            assert not moving.lies_along_wall(state)


def test_uplift_is_found_to_rounding_in_few_evaluations(monkeypatch):
    limit, asked = math.tan(0.25), []
    real = ground.acceleration
    monkeypatch.setattr(ground, "acceleration", lambda g, t: asked.append(t) or real(g, t))
    count = 0
    for amplitude, period, symmetric in itertools.product(
        np.linspace(2.6, 30.0, 12), (0.3, 1.1, 4.0), (False, True)
    ):
        pulse = Ricker(amplitude=amplitude, period=period, symmetric=symmetric)
        scene = Scene(
            name="pulse",
            block=PAPER_BLOCK,
            floor=Floor(friction=1.0),
            excitation=pulse,
            duration=5.0,
        )
        base = natural.base_of(scene).horizontal
        t = ground.next_exceedance(base, 0.0, -limit, limit, 0.0, 0.0)
        assert abs(real(base, t)) >= limit * (1.0 - 1e-15)
        assert abs(real(base, t * (1.0 - 1e-14))) < limit
        count += 1
    assert len(asked) < 25 * count
