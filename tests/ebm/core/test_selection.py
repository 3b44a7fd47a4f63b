"""Which mode follows: selection of upright and tilted blocks, beside walls, at one instant."""

import math

import numpy as np
import pytest
from situations import (
    PIVOTS,
    Core,
    Situation,
    candidates,
    margin,
    random_tilt,
    shentons,
    upright,
)
from stepping import TILTED, run_at

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.core import (
    ground,
    modes,
)
from rockcheck.ebm.core.names import Family, Kind, Pivot
from rockcheck.ebm.core.rules import Rule
from rockcheck.ebm.core.state import code_of
from rockcheck.scenes import Wall


@pytest.mark.parametrize("pivot", PIVOTS)
@pytest.mark.parametrize("friction", ["equal", "static above kinetic"])
def test_selection_at_rest_is_shentons_map(friction, pivot):
    """Under a vertical motion too, which only makes gravity another one; to the side that the
    inertia force points to."""
    rng = np.random.default_rng(44)
    seen = set()
    for _ in range(600):
        mu_s, alpha, a, g = (
            rng.uniform(0.0, 1.33),
            rng.uniform(0.02, 1.2),
            10.0 ** rng.uniform(-1.5, 0.5),
            rng.uniform(0.3, 2.5),
        )
        mu_k = mu_s if friction == "equal" else mu_s * rng.uniform(0.3, 1.0)
        side = int(rng.choice([-1, 1]))
        at = upright(side * a * g, g, alpha, mu_s, mu_k)
        mode = Core(at.scene, pivot).select(at.state)
        expected = shentons(mu_s, mu_k, math.tan(alpha), a)
        assert mode.name == expected, (at, mode)
        if mode.tilted:
            assert mode.side == side
        if mode.floor == "slip":
            assert (
                mode.slip * (mode.side if mode.tilted else 1) == -side
            )  # it stays behind the base
        seen.add(expected)
    assert seen == {"rest", "slide", "rock", "slide-rock"}


@pytest.mark.parametrize("pivot", PIVOTS)
def test_no_slip_block_only_rests_or_rocks(pivot):
    rng = np.random.default_rng(45)
    for _ in range(100):
        alpha, a = rng.uniform(0.02, 1.2), 10.0 ** rng.uniform(-1.5, 0.5)
        at = upright(a, 1.0, alpha, 0.05, 0.05)
        mode = Core(at.scene, pivot, "no-slip").select(at.state)
        assert mode.name == ("rest" if a <= math.tan(alpha) else "rock")


@pytest.mark.parametrize("pivot", PIVOTS)
@pytest.mark.parametrize("touch", ["none", "tip", "far"])
def test_selection_of_a_tilted_block(touch, pivot):
    """Rock, slide-rock, lean, ladder, flight: what is selected is consistent by Newton, Euler and
    Coulomb; nothing that goes before is.

    More contacts go before fewer, sticking before slipping. Where no candidate is consistent, none
    is invented.
    """
    rng = np.random.default_rng(46)
    seen: set[tuple[str, bool, bool]] = set()
    judged = choices = 0
    for _ in range(250):
        at, side, touched = random_tilt(rng, touch)
        margins = {
            mode: margin(at, mode, touched, pivot) for mode in candidates(side, touched, pivot)
        }
        if min(abs(one) for one in margins.values()) < 1e-6:
            continue  # a tie but for rounding
        mode = Core(at.scene, pivot).select(at.state)
        fitting = [one for one, least in margins.items() if least > 0.0]
        if mode is None:
            assert fitting == [], at
            continue
        if mode not in fitting:
            assert not fitting, (at, mode, fitting)
            continue  # an attempt beyond the rules, where nothing fits (Painleve)
        judged += 1
        seen.add((mode.floor, mode.tip, mode.far))
        assert mode.contacts == max(one.contacts for one in fitting), (at, mode, fitting)
        alike = [one for one in fitting if (one.tip, one.far) == (mode.tip, mode.far)]
        assert mode.floor == "stick" or all(one.floor != "stick" for one in alike), (
            at,
            mode,
            fitting,
        )
        choices += len({one.floor for one in alike}) > 1
    assert judged > 200
    assert (
        choices > 2
    )  # static friction above kinetic lets both a standing and a slipping pivot be consistent
    expected = {("stick", False, False), ("slip", False, False)}
    if touch != "none":
        expected |= {("stick", *touched), ("slip", *touched)}  # lean, ladder
    if pivot == "unilateral":
        expected.add(("off", False, False))
    assert seen >= expected


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("pivot", PIVOTS)
def test_selection_of_a_flat_block_at_a_wall(pivot, side):
    """Without friction: pressed on the wall it rests, pressed hard it tips over its other corner,
    pulled away it slides."""
    alpha = 0.4
    walls = (Wall(side="left" if side > 0 else "right", gap=0.0),)
    modes = {}
    for name, u in {"pressed": 0.1, "away": -0.1}.items():
        at = Situation(
            alpha, 0.0, 0.0, side * u, 1.0, (0.0, math.cos(alpha), 0.0, 0.0, 0.0, 0.0), walls
        )
        modes[name] = Core(at.scene, pivot).select(at.state)
    assert modes["pressed"].name == "rest"
    assert (modes["pressed"].tip, modes["pressed"].far) == (side > 0, side < 0)
    assert modes["away"].name == "slide"
    assert (modes["away"].slip, modes["away"].tip, modes["away"].far) == (side, False, False)


def test_a_block_that_hangs_flat_is_counted_once():
    """The choice that nothing tells left from right is in the tally of a run that made it; a wall
    that holds the block tells."""
    alpha = 0.3
    at = Situation(alpha, 0.5, 0.5, 0.0, -0.2, (0.0, math.cos(alpha), 0.0, 0.0, 0.0, 0.0))
    history = EventBasedModel().simulate(at.scene.replace(duration=0.02, output_step=0.01))
    assert history.cost.rules == {"hangs flat": 1}
    hangs = {"family": Family.FLAT, "pivot": Pivot.STICK, "pull": -1}
    assert modes.hangs_flat(run_at(**hangs).state.mode)
    for wall in ("tip", "far"):
        assert not modes.hangs_flat(run_at(**hangs, **{wall: 1}).state.mode)


def test_what_was_tried_at_an_instant():
    """A new instant knows of nothing and has no slack; a mode that a force ended may go on there,
    once; one that a gap ended may not."""
    state = run_at(t=3.0, **TILTED, sense=1).state
    state.tried[:], state.slack, state.least_slack = 1, 7.0, 7.0
    modes.forget(state)
    assert not state.tried.any()
    assert state.slack == 1.0
    modes.slacken(state)
    assert state.slack == 1.0, "the least slack is one noise"
    modes.slacken(state)
    assert state.slack == 2.0
    for kind, began, may in (
        (Kind.FORCE, 2.0, True),
        (Kind.FORCE, 3.0, False),
        (Kind.POSITION, 2.0, False),
    ):
        modes.forget(state)
        state.began = began
        modes.leave(state, kind)
        assert state.tried[code_of(state.mode)] != may
    state.t = 4.0
    modes.leave(state, Kind.RATE)
    assert state.tried.sum() == 1, "what was tried at an earlier instant is forgotten"


def test_a_mode_that_must_go_on_has_twice_the_slack_each_time():
    """Where all modes were tried at an instant the one that fits goes on, counted each time, with a
    slack of 1, 2, 4 noises."""
    core = Core(upright(0.1, 1.0, 0.3, 0.5, 0.5).scene, "unilateral")
    run = run_at(upright(0.1, 1.0, 0.3, 0.5, 0.5).state)
    state, mode = run.state, run.state.mode
    state.tried[:] = 1
    for count, slack in enumerate((1.0, 2.0, 4.0), 1):
        assert modes.select(core.setting, core.base, run)
        assert (mode.family, mode.pivot) == (Family.FLAT, Pivot.STICK)
        assert (state.slack, state.rules[Rule.MODE_AGAIN], state.rules.sum()) == (
            slack,
            count,
            count,
        )


@pytest.mark.parametrize("pivot", PIVOTS)
def test_the_model_starts_as_the_selection_says(pivot):
    """The adapter looks at the core that the model runs: the same mode in the first row of a
    history."""
    rng = np.random.default_rng(48)
    for _ in range(200):
        a, mu, alpha = 10.0 ** rng.uniform(-1.0, 0.3), rng.uniform(0.05, 1.2), rng.uniform(0.1, 0.8)
        side, share = int(rng.choice([-1, 1])), rng.choice([1.0, rng.uniform(0.3, 1.0)])
        at = upright(side * a, 1.0, alpha, mu, share * mu)
        core = Core(at.scene, pivot)
        scene = at.scene.replace(duration=0.02, output_step=0.01)
        history = EventBasedModel(pivot=pivot).simulate(scene)
        found = core.select(at.state)
        assert history.channels["mode"][1] == found.name
        assert np.sign(history.channels["theta"][-1]) == found.side * found.tilted
        assert ground.acceleration(core.base.horizontal, 0.0) == pytest.approx(side * a)
