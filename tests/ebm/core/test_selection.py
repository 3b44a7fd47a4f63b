"""Which mode follows: selection of upright and tilted blocks, beside walls, at one instant."""

import dataclasses
import math

import numpy as np
import pytest
from situations import PIVOTS, Core, candidates, margin, random_tilt, shentons, upright
from stepping import TILTED, run_at

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.core import modes
from rockcheck.ebm.core.names import Family, Kind, Pivot, Rule
from rockcheck.ebm.core.state import code_of
from rockcheck.scenes import PAPER_BLOCK, Floor, Record, Scene, Wall
from rockcheck.validation.studies.stress.generator import exact_scene, random_scene

#: Modes of an upright block, of a pivot that stands, and of one that slips.
FLAT, STANDS, SLIPS = {"rest", "slide"}, {"rest", "rock", "lean"}, {"slide", "slide-rock", "ladder"}


@pytest.mark.parametrize("pivot", PIVOTS)
@pytest.mark.parametrize("friction", ["equal", "static above kinetic", "no-slip"])
def test_selection_at_rest_is_shentons_map(friction, pivot):
    """Under a vertical motion too, which only makes gravity another one; to the side that the
    inertia force points to. A block that cannot slip rests or rocks."""
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
        mode = Core(at, pivot, "no-slip" if friction == "no-slip" else "coulomb").select(at.state)
        felt = (math.inf, math.inf) if friction == "no-slip" else (mu_s, mu_k)
        expected = shentons(*felt, math.tan(alpha), a)
        assert mode.name == expected, (at, mode)
        assert not mode.tilted or mode.side == side
        # What slips stays behind the base.
        assert mode.floor != "slip" or mode.slip * (mode.side if mode.tilted else 1) == -side
        seen.add(expected)
    assert seen == {"rest", "rock"} | ({"slide", "slide-rock"} if friction != "no-slip" else set())


def test_a_history_begins_in_the_mode_that_is_selected():
    """So what these tests ask of the selection holds for the model."""
    rng = np.random.default_rng(48)
    for _ in range(20):
        a, mu, alpha = 10.0 ** rng.uniform(-1.0, 0.3), rng.uniform(0.05, 1.2), rng.uniform(0.1, 0.8)
        at = upright(a, 1.0, alpha, mu, mu)
        history = EventBasedModel().simulate(at.scene.replace(duration=0.02, output_step=0.01))
        assert history.channels["mode"][1] == Core(at, "bilateral").select(at.state).name


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
        mode = Core(at, pivot).select(at.state)
        fitting = [one for one, least in margins.items() if least > 0.0]
        if mode not in fitting:
            # None, or an attempt beyond the rules, where nothing fits (Painleve).
            assert fitting == [], (at, mode)
            continue
        judged += 1
        seen.add((mode.floor, mode.tip, mode.far))
        assert mode.contacts == max(one.contacts for one in fitting), (at, mode, fitting)
        alike = {one.floor for one in fitting if (one.tip, one.far) == (mode.tip, mode.far)}
        assert mode.floor == "stick" or "stick" not in alike, (at, mode, fitting)
        choices += len(alike) > 1
    assert judged > 200
    assert (
        choices > 2
    )  # static friction above kinetic lets both a standing and a slipping pivot be consistent
    lean_and_ladder = {("stick", *touched), ("slip", *touched)}
    assert seen >= (
        {("stick", False, False), ("slip", False, False)}
        | (lean_and_ladder if touch != "none" else set())
        | ({("off", False, False)} if pivot == "unilateral" else set())
    )


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("pivot", PIVOTS)
def test_selection_of_a_flat_block_at_a_wall(pivot, side):
    walls = (Wall(side="left" if side > 0 else "right", gap=0.0),)
    for u, name, slip, tip, far in (
        (0.1, "rest", 0, side > 0, side < 0),
        (-0.1, "slide", side, False, False),
    ):
        at = dataclasses.replace(upright(side * u, 1.0, 0.4, 0.0, 0.0), walls=walls)
        found = Core(at, pivot).select(at.state)
        assert found.name == name
        assert found.slip == slip
        assert found.tip == tip
        assert found.far == far


def test_a_block_whose_floor_falls_away():
    """Only a floor that cannot hold lets go: upright the block flies flat. Else it hangs by the
    corner that a push or a slip tells, or by both; a wall that holds it tells."""
    for pivot, u, slip, name, tilted, side in (
        ("unilateral", 0.0, 0.0, "flight", False, 1),
        ("bilateral", 0.0, 0.0, "rest", False, 1),
        ("bilateral", 1e-6, 0.0, "rock", True, 1),
        ("bilateral", -1e-6, 0.0, "rock", True, -1),
        ("bilateral", 0.0, 0.1, "slide-rock", True, -1),
        ("bilateral", 0.0, -0.1, "slide-rock", True, 1),
    ):
        mode = Core(upright(u, -0.2, 0.3, 0.5, 0.5), pivot).select(
            (0.0, math.cos(0.3), 0.0, slip, 0.0, 0.0)
        )
        assert mode.name == name
        assert mode.tilted == tilted
        assert mode.side == side
    flat = {"family": Family.FLAT, "pivot": Pivot.STICK, "pull": -1}
    for wall in ("tip", "far"):
        assert not modes.hangs_flat(run_at(**flat, **{wall: 1}).state.mode)


def test_what_was_tried_at_an_instant():
    """A new instant knows of nothing and has no slack; a mode that a force ended may go on there,
    once; one that a gap ended may not."""
    state = run_at(t=3.0, **TILTED, sense=1).state
    state.tried[:], state.slack, state.least_slack = 1, 7.0, 7.0
    modes.reset_tried_modes(state)
    assert not state.tried.any()
    assert state.slack == 1.0
    for slack in (1.0, 2.0):  # the least one is one noise
        modes.relax_tolerance(state)
        assert state.slack == slack
    for kind, began, may in (
        (Kind.FORCE, 2.0, True),
        (Kind.FORCE, 3.0, False),
        (Kind.POSITION, 2.0, False),
    ):
        modes.reset_tried_modes(state)
        state.began = began
        modes.mark_mode_ended(state, kind)
        assert state.tried[code_of(state.mode)] != may
    state.t = 4.0
    modes.mark_mode_ended(state, Kind.RATE)
    assert state.tried.sum() == 1, "what was tried at an earlier instant is forgotten"


def test_a_mode_that_must_go_on_has_twice_the_slack_each_time():
    """Where all modes were tried at an instant the one that fits goes on, counted each time, with a
    slack of 1, 2, 4 noises."""
    at = upright(0.1, 1.0, 0.3, 0.5, 0.5)
    core, run = Core(at, "unilateral"), run_at(at.state)
    state, mode = run.state, run.state.mode
    state.tried[:] = 1
    for count, slack in enumerate((1.0, 2.0, 4.0), 1):
        assert modes.select(core.setting, core.base, run)
        assert mode.family == Family.FLAT
        assert mode.pivot == Pivot.STICK
        assert state.slack == slack
        assert state.rules[Rule.MODE_AGAIN] == count
        assert state.rules.sum() == count


def name_of(before: str, after: str) -> str:
    """The name of a change of mode of a block on the floor, without impact."""
    if after == "flight":
        return "lift-off"
    if before in FLAT and after not in FLAT:
        return "uplift"
    return "slip" if before in STANDS and after in SLIPS else "release"


@pytest.mark.parametrize("pivot", PIVOTS)
def test_an_event_is_named_by_the_modes_before_and_after_it(pivot):
    model, seen = EventBasedModel(pivot=pivot), set()
    for number in range(400):
        scene = (exact_scene, random_scene)[number % 2](11, number, pivot)
        for one in model.simulate(scene).event_list:
            seen.add(one.kind)
            if one.kind == "stick":
                assert one.mode_before in SLIPS, (number, one)
            elif (
                one.kind in ("uplift", "slip", "lift-off", "release")
                and one.mode_before != "flight"
            ):
                assert one.kind == name_of(one.mode_before, one.mode_after), (number, one)
    assert seen >= {"uplift", "slip", "release", "settled"}
    assert ("lift-off" in seen) == (pivot == "unilateral")


@pytest.mark.parametrize(("more", "lands"), [(1e-5, ["floor impact"]), (-1e-5, [])])
def test_a_pulled_block_lands_with_the_energy_that_takes_it_upright(more, lands):
    """A floor that falls faster than g pulls the pivot of the paper's model: at g/5 more a tilt
    of alpha/20 takes w^2 = 3/2 g/5R (cos(19/20 alpha) - cos(alpha))."""
    alpha, falls = PAPER_BLOCK.alpha, Record.from_samples([-1.2 * 9.81] * 200, 0.01)
    spin = math.sqrt(0.3 * 9.81 / PAPER_BLOCK.radius * (math.cos(0.95 * alpha) - math.cos(alpha)))
    scene = Scene(
        name="pulled",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.8),
        vertical=falls,
        initial_rotation=0.05 * alpha,
        initial_angular_velocity=-spin * (1.0 + more),
        duration=1.0,
    )
    events = EventBasedModel().simulate(scene).event_list
    assert [one.kind for one in events if one.kind == "floor impact"] == lands
