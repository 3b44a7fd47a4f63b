"""When the rest of a run is certain: each condition alone. Natural units, a block of 0.3 rad."""

import math

import pytest
from scipy.integrate import quad
from stepping import ROCKS, run_at, setting_of

from rockcheck.ebm.core import decide, extremes
from rockcheck.ebm.core.ground import acceleration, ground_of
from rockcheck.ebm.core.names import Ending, Family, Fate, Keep, Pivot
from rockcheck.ebm.core.state import Base
from rockcheck.scenes import Rest, Ricker, Sine, Wall

ALPHA = 0.3
#: Energy with which the block stands on its corner.
CORNER = 1.0 - math.cos(ALPHA)
STILL = Base(ground_of(Rest(), 1.0, 1.0), ground_of(Rest(), 1.0, 1.0))


def turned(tilt, rate=0.0, slides=0.0):
    """A tilted motion that turns about its corner; to the left where the tilt is positive."""
    sense = math.copysign(1.0, tilt)
    s, c = math.sin(ALPHA - abs(tilt)), math.cos(ALPHA - abs(tilt))
    return (-sense * (math.sin(ALPHA) - s), c, tilt, slides - c * rate, sense * s * rate, rate)


def rocking(tilt, rate=0.0, peak=None, **mode):
    """The state of a block that rocks on a base at rest."""
    mode = ROCKS | {"sense": 1 if tilt > 0.0 else -1} | mode
    state = run_at(turned(tilt, rate), **mode).state
    state.peak = abs(tilt) if peak is None else peak
    return state


def energy(tilt, rate=0.0):
    """That of rotation about the corner: 4/3 is its moment of inertia."""
    return 2.0 / 3.0 * rate**2 + math.cos(ALPHA - tilt) - math.cos(ALPHA)


def lifted(energy):
    """The tilt at which this is the energy of a block at rest."""
    return ALPHA - math.acos(math.cos(ALPHA) + energy)


def test_a_pulse_is_over_where_a_thousandth_of_the_tolerance_is_left():
    pulse = ground_of(Ricker(amplitude=0.7, period=1.3), 1.0, 1.0)
    quiet = decide.quiet_from(Base(pulse, STILL.vertical), 1e-9)
    bell = math.exp(-pulse.form.rate * (quiet - pulse.form.centre) ** 2)
    assert quiet > pulse.form.centre
    assert bell == pytest.approx(1e-12, rel=1e-9)


@pytest.mark.parametrize(("along", "upward", "quiet"), [(2.0, 5.0, 5.0), (5.0, 2.0, 5.0)])
def test_a_base_is_quiet_once_both_components_are(along, upward, quiet):
    base = Base(*(ground_of(Sine(amplitude=0.1, period=t), 1.0, 1.0) for t in (along, upward)))
    assert decide.quiet_from(base, 1e-9) == quiet


def test_beside_a_vertical_motion_a_pulse_is_over_at_its_end():
    pulse, upward = Ricker(amplitude=0.7, period=1.3), Sine(amplitude=0.1, period=0.5)
    base = Base(ground_of(pulse, 1.0, 1.0), ground_of(upward, 1.0, 1.0))
    assert decide.quiet_from(base, 1e-9) == pulse.quiet_after


def test_a_run_is_given_up_after_a_thousand_of_the_slower_side_s_times():
    block = setting_of(ALPHA)
    block.left.share, block.right.share = 0.25, 1.0
    assert decide.given_up_at(block, 3.0) == 3.0 + 2.0 * decide.PATIENCE
    block.right.radius = 0.0625
    assert decide.given_up_at(block, 3.0) == 3.0 + 4.0 * decide.PATIENCE


@pytest.mark.parametrize(
    ("ending", "theta", "fate"),
    [
        (Ending.OVERTURNED, 1.5, Fate.OVERTURNED_LEFT),
        (Ending.OVERTURNED, -1.5, Fate.OVERTURNED_RIGHT),
        (Ending.GIVEN_UP, 0.1, Fate.UNDECIDED),
        (Ending.NOT_FINITE, 0.1, Fate.FAILED),
        (Ending.DONE, 0.1, Fate.AT_REST),
    ],
)
def test_the_fate_of_a_run_is_that_of_its_ending(ending, theta, fate):
    state = rocking(theta)
    state.control.until_decided, state.ending = True, ending
    assert decide.fate_of(setting_of(ALPHA), state) == fate


@pytest.mark.parametrize(
    ("what", "fate"),
    [
        ({}, Fate.AT_REST),
        ({"repeats": True}, Fate.MOVING),
        ({"t_end": 0.0}, Fate.MOVING),
        ({"until_decided": False}, Fate.MOVING),
    ],
)
def test_a_block_that_rocks_on_for_ever_or_at_the_end_of_its_time_moves(what, fate):
    state = rocking(0.1)
    state.ending, state.control.until_decided = Ending.DONE, what.get("until_decided", True)
    state.repeats, state.t_end = what.get("repeats", False), what.get("t_end", math.inf)
    assert decide.fate_of(setting_of(ALPHA), state) == fate
    state.mode.tip = 1
    assert decide.fate_of(setting_of(ALPHA), state) == Fate.AT_REST


@pytest.mark.parametrize(
    ("mu", "speed", "how", "fate"),
    [
        (0.0, 0.3, {}, Fate.MOVING),
        (0.0, -0.3, {}, Fate.MOVING),
        (0.2, 0.3, {}, Fate.AT_REST),
        (0.0, 1e-10, {}, Fate.AT_REST),
        (0.0, 0.3, {"pivot": "bilateral", "friction": "no-slip"}, Fate.AT_REST),
    ],
)
def test_what_slides_without_friction_slides_on(mu, speed, how, fate):
    slides = {"family": Family.FLAT, "pivot": Pivot.SLIPPING, "sense": 1, "pull": 1}
    state = run_at((0.0, math.cos(ALPHA), 0.0, speed, 0.0, 0.0), **slides).state
    state.ending, state.control.until_decided = Ending.DONE, True
    assert decide.fate_of(setting_of(ALPHA, mu, **how), state) == fate


@pytest.mark.parametrize(
    ("mu", "speed", "side", "for_good"),
    [
        (0.0, 0.3, None, True),
        (0.0, 0.3, "right", False),
        (0.0, 0.3, "left", True),
        (0.0, -0.3, "left", False),
        (0.0, -0.3, "right", True),
        (0.1, 0.3, None, False),
    ],
)
def test_a_block_slides_for_good_where_neither_friction_nor_a_wall_stops_it(
    mu, speed, side, for_good
):
    walls = [Wall(side=side, gap=0.5)] if side else []
    slides = {"family": Family.FLAT, "pivot": Pivot.SLIPPING, "sense": 1, "pull": 1}
    state = run_at((0.0, math.cos(ALPHA), 0.0, speed, 0.0, 0.0), **slides).state
    assert decide.slides_for_good(setting_of(ALPHA, mu, walls=walls), state) == for_good
    state.mode.pivot = Pivot.STICK
    assert not decide.slides_for_good(setting_of(ALPHA, mu, walls=walls), state)
    state.mode.pivot, state.mode.family = Pivot.SLIPPING, Family.TILT
    assert not decide.slides_for_good(setting_of(ALPHA, mu, walls=walls), state)


def test_energy_is_that_of_a_rotation_about_the_corner():
    block = setting_of(ALPHA)
    for tilt, rate in ((0.1, 0.0), (-0.2, 0.4), (0.25, -0.3)):
        motion = rocking(tilt, rate).motion
        assert decide.energy_of(block, motion) == pytest.approx(energy(abs(tilt), rate), abs=1e-15)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_as_a_block_rises_on_a_quiet_base_its_peak_is_known(sign):
    state = rocking(0.1 * sign, 0.05 * sign)
    peak = decide.decided(setting_of(ALPHA), STILL, state)
    assert peak == pytest.approx(lifted(energy(0.1, 0.05)), abs=1e-14)
    state = rocking(0.1 * sign, 0.05 * sign, peak=0.2)
    assert decide.decided(setting_of(ALPHA), STILL, state) == 0.2


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_as_a_block_falls_its_peak_is_known_where_its_energy_lifts_it_no_farther(sign):
    now = lifted(energy(0.1, 0.05))
    for peak, verdict in ((now + 1e-9, now + 1e-9), (now - 1e-9, -1.0)):
        state = rocking(0.1 * sign, -0.05 * sign, peak=peak)
        assert decide.decided(setting_of(ALPHA), STILL, state) == verdict


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("share", "falls"), [(1.001, True), (0.999, False)])
def test_a_block_that_rises_with_more_energy_than_its_corner_s_overturns(share, falls, sign):
    rate = math.sqrt(1.5 * (share * CORNER - energy(0.1)))
    verdict = decide.decided(setting_of(ALPHA), STILL, rocking(0.1 * sign, rate * sign))
    assert verdict == pytest.approx(0.5 * math.pi if falls else lifted(share * CORNER), abs=1e-12)


def test_with_more_energy_than_its_corner_s_a_block_that_comes_down_is_undecided():
    rate = math.sqrt(1.5 * (1.001 * CORNER - energy(0.1)))
    assert decide.decided(setting_of(ALPHA), STILL, rocking(0.1, -rate)) == -1.0


@pytest.mark.parametrize(
    ("mu", "e", "how", "certain"),
    [
        (0.8, 0.0, {}, True),
        (0.8, 0.5, {}, False),
        (0.8, 0.5, {"energy_cap": True}, True),
        (0.0, 0.5, {}, True),
    ],
)
def test_nothing_is_certain_where_a_floor_that_bounces_may_add_energy(mu, e, how, certain):
    """Without friction, or with the cap, it adds none."""
    state = rocking(0.05, -0.01, peak=0.25)
    verdict = decide.decided(setting_of(ALPHA, mu, e, **how), STILL, state)
    assert verdict == (0.25 if certain else -1.0)


def test_beside_walls_a_block_is_safe_with_a_tenth_less_energy():
    """Their impacts may add it; without walls all energy below the corner's is safe."""
    for share, safe in ((0.89, True), (0.91, False)):
        state = rocking(0.05, math.sqrt(1.5 * (share * CORNER - energy(0.05))), peak=0.299)
        for walls in ([], [Wall(side="left", gap=5.0)]):
            verdict = decide.decided(setting_of(ALPHA, walls=walls), STILL, state)
            assert verdict == (0.299 if safe or not walls else -1.0)


@pytest.mark.parametrize(("more", "safe"), [(-1e-6, True), (1e-6, False)])
def test_what_the_pulse_may_still_add_counts_with_its_whole_impulse(more, safe):
    """The root of twice the energy grows by no more than the integral of |u|."""
    base = Base(ground_of(Ricker(amplitude=0.05, period=2.0), 1.0, 1.0), STILL.vertical)
    state = rocking(0.02, -0.01)
    state.t, state.quiet_from = base.horizontal.form.centre + 1.5, math.inf
    impulse, _ = quad(lambda t: abs(acceleration(base.horizontal, t)), state.t, state.t + 5.0)
    most = 0.5 * (math.sqrt(2.0 * energy(0.02, 0.01)) + impulse) ** 2
    state.peak = lifted(most) - more
    verdict = decide.decided(setting_of(ALPHA), base, state)
    assert verdict == (state.peak if safe else -1.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("beyond", "rate", "how", "falls"),
    [
        (0.101, 0.0, {}, True),
        (0.099, 0.0, {}, False),
        (0.101, 0.1, {}, True),
        (0.101, -0.1, {}, False),
        (0.101, 0.0, {"walls": [Wall(side="left", gap=5.0)]}, False),
        (0.001, 0.0, {"friction": "no-slip", "pivot": "bilateral"}, True),
    ],
)
def test_a_block_that_may_slip_falls_once_it_is_steeper_than_friction(
    beyond, rate, how, falls, sign
):
    """On a base at rest, with friction 0.1, as long as it turns outward and no wall is there."""
    state = rocking(sign * (ALPHA + math.atan(beyond)), sign * rate)
    verdict = decide.decided(setting_of(ALPHA, 0.1, **how), STILL, state)
    assert verdict == (0.5 * math.pi if falls else -1.0)


@pytest.mark.parametrize(("beyond", "falls"), [(0.201, True), (0.199, False)])
def test_a_block_falls_once_it_is_steeper_than_the_base_will_ever_accelerate(beyond, falls):
    base = Base(ground_of(Sine(amplitude=0.2, period=9.0), 1.0, 1.0), STILL.vertical)
    state = rocking(ALPHA + math.atan(beyond), 0.0)
    state.quiet_from = 9.0
    verdict = decide.decided(setting_of(ALPHA, 0.1), base, state)
    assert verdict == (0.5 * math.pi if falls else -1.0)


def test_on_a_floor_that_moves_up_and_down_no_block_is_sure_to_fall():
    base = Base(STILL.horizontal, ground_of(Sine(amplitude=0.2, period=9.0), 1.0, 1.0))
    state = rocking(ALPHA + 0.5)
    state.quiet_from = 9.0
    assert decide.decided(setting_of(ALPHA, 0.1), base, state) == -1.0


@pytest.mark.parametrize(("more", "sticks"), [(1e-9, True), (-1e-9, False)])
@pytest.mark.parametrize("alpha", [0.3, 1.2])
@pytest.mark.parametrize("energy", [0.0, 0.01, 0.1])
def test_a_pivot_sticks_by_the_bounds_of_its_forces(energy, alpha, more, sticks):
    """With k = 3/4 and w^2 = 2 k E: Q is at most k s c (a half of k beyond 45 degrees) or s w^2, P
    at least 1 - k s^2 - w^2; the landing asks for 3 t/(4 + t^2)."""
    s, c, t, square = math.sin(alpha), math.cos(alpha), math.tan(alpha), 1.5 * energy
    pull = 0.75 * s * c if alpha < 0.25 * math.pi else 0.375
    limit = max(pull, s * square) / (1.0 - 0.75 * s * s - square)
    limit = max(limit, 3.0 * t / (4.0 + t * t))
    block = setting_of(alpha, 0.1)
    block.mu_s = limit * (1.0 + more)
    assert decide._sticks(block, block.left, energy) == sticks
    block.no_slip = True
    assert decide._sticks(block, block.left, energy)


def rocks_beside(gap, tilt=0.05, rate=0.0, mu=0.8, e=0.0):
    """A block that rocks on a quiet base beside a wall on its left, and what is kept: strikes."""
    block = setting_of(ALPHA, mu, e, walls=[Wall(side="left", gap=gap)])
    state = rocking(tilt, rate)
    state.control.keeps = Keep.STRIKES
    return block, state


#: How far the top corner gets at a tilt of 0.05.
REACH = math.sin(ALPHA + 0.05) - math.sin(ALPHA - 0.05)


@pytest.mark.parametrize(
    ("given", "met"),
    [
        ({"gap": REACH + 1e-3}, True),
        ({"gap": REACH - 1e-3}, False),
        ({"gap": REACH + 1e-3, "tilt": -0.05}, True),
        ({"gap": REACH - 1e-3, "tilt": -0.05}, False),
        ({"gap": 5.0, "rate": math.sqrt(1.5 * (0.999 * CORNER - energy(0.05)))}, True),
        ({"gap": 5.0, "rate": math.sqrt(1.5 * (1.001 * CORNER - energy(0.05)))}, False),
        ({"gap": 5.0, "mu": 0.1}, False),
        ({"gap": 5.0, "e": 0.5}, False),
        ({"gap": 5.0, "tilt": ALPHA + 0.01}, False),
    ],
)
def test_all_strikes_are_met_where_the_energy_reaches_no_wall(given, met):
    """It rocks, and sticks as it lands; a floor that bounces may let it slip on."""
    block, state = rocks_beside(**given)
    assert decide.all_is_met(block, state) == met


def test_nothing_is_met_before_the_base_is_quiet_or_while_the_pivot_slips():
    block, state = rocks_beside(5.0)
    state.quiet_from = state.t
    assert decide.all_is_met(block, state)
    state.quiet_from = state.t + 1e-3
    assert not decide.all_is_met(block, state)
    state.quiet_from, state.mode.pivot = 0.0, Pivot.SLIPPING
    assert not decide.all_is_met(block, state)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_all_extremes_are_met_once_both_sides_are(sign):
    """It is released from a tilt: that side is met, the other one when it has been there."""
    block, state = rocks_beside(5.0, tilt=0.05 * sign)
    state.control.keeps = Keep.EXTREMES
    extremes.begin(block, state)
    extremes.meet(block, state, run_at(turned(0.04 * sign)).state.motion, 1.0)
    assert not decide.all_is_met(block, state)
    extremes.meet(block, state, run_at(turned(-0.05 * sign)).state.motion, 2.0)
    upright = run_at((0.0, math.cos(ALPHA), 0.0, 0.0, 0.0, 0.0)).state.motion
    extremes.meet(block, state, upright, 3.0)
    assert decide.all_is_met(block, state)


@pytest.mark.parametrize(
    ("energy", "place", "repeats"),
    [
        (0.02, 0.3, True),
        (0.02 + 3.9e-9 * 0.2, 0.3, True),
        (0.02 - 4.1e-9 * 0.2, 0.3, False),
        (0.02 + 4.1e-9 * 0.2, 0.3, False),
        (0.02, 0.3 + 3.9e-9, True),
        (0.02, 0.3 - 4.1e-9, False),
        (0.02, -0.3, False),
    ],
)
def test_a_swing_repeats_where_its_energy_and_its_pivot_do(energy, place, repeats):
    """To four times the tolerance, here 1e-9, of place and speed: sqrt(2 E) is 0.2."""
    state = rocking(0.1)
    state.tolerance_rad, state.place = 1e-9, 0.3
    assert not decide.swings_again(state, 0.02)
    state.place = place
    assert decide.swings_again(state, energy) == repeats


@pytest.mark.parametrize("what", ["slips", "leans", "early"])
def test_only_a_swing_on_a_quiet_base_about_a_pivot_that_sticks_counts(what):
    state = rocking(0.1)
    state.tolerance_rad, state.place = 1e-9, 0.3
    assert not decide.swings_again(state, 0.02)
    state.mode.pivot = Pivot.SLIPPING if what == "slips" else Pivot.STICK
    state.mode.tip, state.quiet_from = what == "leans", 1.0 if what == "early" else 0.0
    assert not decide.swings_again(state, 0.02)
