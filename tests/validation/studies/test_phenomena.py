"""What is read off motions: of exact ones the targets, of others what they show."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rockcheck import EventBasedModel, InputError, ModelFailure
from rockcheck.scenes import PAPER_BLOCK, History
from rockcheck.validation.studies.conformance import (
    impacts,
    invariance,
    phenomenon,
    rocking,
    sliding,
    trial,
)
from rockcheck.validation.studies.conformance.phenomena import PHENOMENA
from rockcheck.validation.studies.conformance.phenomenon import Motion, Phenomenon
from rockcheck.validation.studies.conformance.players import Player
from rockcheck.validation.studies.conformance.trial import Trial

G = 9.81
EXACT = EventBasedModel(pivot="unilateral")


def motion(t, *, x=0.0, y=1.0, theta=0.0, outcome="moving"):
    """A history of these columns; numbers do not change."""
    t = np.asarray(t, dtype=float)
    channels = {name: np.broadcast_to(v, t.shape) for name, v in (("x", x), ("y", y))}
    channels |= {"t": t, "theta": np.broadcast_to(theta, t.shape)}
    history = History(
        name="made",
        model="made",
        channels=channels,
        event_list=(),
        outcome=outcome,
        block=PAPER_BLOCK,
    )
    return Motion(history)


def rows(end, step=1e-3):
    return step * np.arange(round(end / step) + 1)


def shown(id):
    wanted = PHENOMENA[id]
    return wanted.value(*(Motion(EXACT.simulate(scene)) for scene in wanted.scenes))


#: What the event-based model has no answer to: a floor that takes nothing; ties.
NOT_PLAYED = ("RC-06", "RC-18", "RC-29")


@pytest.mark.parametrize("id", [id for id in PHENOMENA if id not in NOT_PLAYED])
def test_the_event_based_model_shows_each_phenomenon(id):
    assert shown(id) == pytest.approx(PHENOMENA[id].target, abs=4e-3)


#: Of each phenomenon that is judged a value as a wrong engine shows it.
WRONG = {
    "RC-01": 0.97,
    "RC-02": 1.03,
    "RC-03": 3.6,  # a micrometre a second
    "RC-04": 0.2,
    "RC-05": 1.0 + 2.0**-14,
    "RC-06": -0.05,
    "RC-07": -0.05,
    "RC-08": 0.05,
    "RC-09": 1.03,
    "RC-10": 0.98,
    "RC-11": 1.02,
    "RC-12": 0.0,
    "RC-13": 1.0,
    "RC-14": 0.03,
    "RC-15": 0.02,
    "RC-16": 0.2,
    "RC-17": 0.02,
    "RC-19": 1.0,
    "RC-20": 0.97,
    "RC-21": 1.0,
    "RC-22": 1.0,
    "RC-23": 1.0,
    "RC-24": 0.9,
    "RC-25": 0.1,
    "RC-26": 0.2,
    "RC-27": 1.03,
    "RC-28": 1.0,
}


@pytest.mark.parametrize("id", WRONG)
def test_a_wrong_engine_fails(id):
    assert PHENOMENA[id].judge(WRONG[id])[0] == "fail"


def test_what_has_several_answers_is_not_judged():
    assert set(PHENOMENA) - set(WRONG) == {"RC-18", "RC-29"}


# Verdicts


def judged(value, *, limit=0.5, means_above="", advice=""):
    wanted = Phenomenon(
        "X", "x", (), float, 2.0, limit, "mm", "source", "Too little.", "cure", "", means_above
    )
    return wanted.judge(value, advice)


@pytest.mark.parametrize("value", [1.5, 2.5])
def test_a_value_at_its_limit_passes(value):
    assert judged(value) == ("pass", "")


@pytest.mark.parametrize("value", [1.49, 2.51, math.nan])
def test_a_value_beyond_its_limit_fails(value):
    assert judged(value)[0] == "fail"


def test_without_a_limit_a_value_is_reported():
    assert judged(9.0, limit=None)[0] == "reported"


@pytest.mark.parametrize(
    ("limit", "reading"),
    [(0.5, "3.123, "), (1e-3, "3.123, "), (0.9e-3, "3.12346, "), (0.0, "3.123, ")],
)
def test_a_narrow_limit_asks_for_more_digits(limit, reading):
    assert judged(3.123456, limit=limit)[1].startswith(reading)


@pytest.mark.parametrize(("value", "words"), [(3.0, "Too much."), (1.0, "Too little.")])
def test_a_value_above_its_target_may_mean_something_else(value, words):
    assert words in judged(value, means_above="Too much.")[1]


def test_a_value_above_its_target_means_the_same_where_nothing_else_is_said():
    assert "Too little." in judged(3.0)[1]


def test_the_engine_s_advice_follows_the_cure():
    assert judged(9.0, advice="solref")[1].endswith("cure; solref.")


# How values are read


def test_a_level_is_crossed_between_two_rows():
    t, values = np.array([0.0, 1.0, 3.0]), np.array([0.0, 1.0, 2.0])
    assert phenomenon.crossing_time(t, values, 1.25) == pytest.approx(1.5)


def test_a_level_that_is_reached_at_first_is_crossed_then():
    assert phenomenon.crossing_time(np.array([0.5, 1.0]), np.array([2.0, 3.0]), 2.0) == 0.5


def test_a_level_that_is_never_reached_is_not_crossed():
    assert math.isnan(phenomenon.crossing_time(np.array([0.0, 1.0]), np.zeros(2), 1.0))


def test_channels_are_compared_as_far_as_both_go():
    first, second = np.array([1.0, 2.0]), np.array([1.0, 2.5, 9.0])
    assert phenomenon.largest_difference(first, second) == 0.5


def test_the_worst_value_is_the_farthest_from_the_target():
    assert phenomenon.worst([0.5, 1.2, 1.6], 1.0) == 1.6


def test_a_value_that_is_none_is_the_worst():
    assert math.isnan(phenomenon.worst([0.5, math.nan, 1.6], 1.0))


def test_a_channel_that_a_history_lacks_is_refused():
    with pytest.raises(InputError, match="has no column slip"):
        _ = motion([0.0, 1.0]).slip


def test_wrong_outcomes_are_counted():
    stands, fell = motion([0.0]), motion([0.0], outcome="overturned left")
    assert rocking.below_and_above(stands, fell) == 0.0
    assert rocking.below_and_above(stands, stands) == 1.0
    assert rocking.below_and_above(fell, stands) == 2.0


# Sliding


def test_a_way_is_over_that_of_coulombs_friction():
    """From 1.5 m/s to rest against 0.6 instead of 0.3: half the way."""
    way = 1.5**2 / (2.0 * 0.6 * G)
    assert sliding.sliding_distance(motion([0.0, 1.0], x=[0.3, 0.3 + way])) == pytest.approx(0.5)


def test_slip_that_begins_early_shows_less_friction():
    """The base's acceleration is g t/4; from 0.8 mu g on the block slips by its third integral."""
    t, rate = rows(4.0), G / 4.0
    begins = 0.8 * 0.4 * G / rate
    slip = rate * np.clip(t - begins, 0.0, None) ** 3 / 6.0
    assert sliding.cone(motion(t, x=0.2 + slip)) == pytest.approx(0.8, abs=1e-4)


def test_a_creep_is_in_millimetres_an_hour():
    """A micrometre a second, after the block has settled."""
    t = rows(4.0)
    crept = np.where(t < 2.0, 0.1, 0.1 + 1e-6 * (t - 2.0))
    assert sliding.creep(motion(t, x=crept)) == pytest.approx(3.6)


def test_the_fastest_creep_counts():
    t = rows(4.0)
    speeds = (1e-6, -3e-6, 2e-6)
    assert sliding.largest_creep(*(motion(t, x=v * t) for v in speeds)) == pytest.approx(-10.8)


def test_a_lift_is_in_millimetres():
    assert sliding.lift(motion([0.0, 1.0, 2.0], y=[0.5, 0.502, 0.5])) == pytest.approx(2.0)


def test_coasting_is_over_the_way_without_loss():
    assert sliding.coasting(motion([1.0, 3.0], x=[4.0, 13.5])) == pytest.approx(0.95)


def test_a_slip_is_over_newmarks():
    """Under 6 m/s^2 for 0.25 s, against 0.3 g."""
    velocity, resistance = 6.0 * 0.25, 0.3 * G
    slip = velocity**2 / (2.0 * resistance) * (1.0 - resistance / 6.0)
    assert sliding.pushed_slip(motion([0.0, 1.5], x=[0.1, 0.1 - 1.2 * slip])) == pytest.approx(1.2)


# Impacts


def bouncing(e):
    """From 0.2 m onto a floor with this restitution."""
    t = rows(0.65)
    lands, speed = math.sqrt(0.4 / G), e * math.sqrt(0.4 * G)
    since = t - lands
    up = np.where(since < 0.0, 0.2 - 0.5 * G * t**2, speed * since - 0.5 * G * since**2)
    return motion(t, y=0.5 + np.clip(up, 0.0, None))


@pytest.mark.parametrize("e", [0.0, 0.25, 0.5, 0.75])
def test_the_height_of_a_rebound_shows_the_restitution(e):
    assert impacts.rebound(bouncing(e)) == pytest.approx(e, abs=1e-3)


def thrown_back(e):
    """At 1 m/s against a wall 0.1 m away."""
    t = rows(0.3)
    return motion(t, x=np.where(t < 0.1, -t, -0.1 + e * (t - 0.1)))


def test_the_speed_back_shows_the_restitution():
    assert impacts.speed_back(thrown_back(0.5)) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("value", "made"),
    [(impacts.floor_restitution, bouncing), (impacts.wall_restitution, thrown_back)],
)
def test_the_worst_restitution_counts(value, made):
    """Of 0.25, 0.5, 0.75 and 1."""
    assert value(*map(made, (0.25, 0.42, 0.78, 1.0))) == pytest.approx(-0.08, abs=1e-3)


def test_the_larger_bounce_counts():
    assert impacts.bounce(bouncing(0.1), thrown_back(0.3)) == pytest.approx(0.3)
    assert impacts.bounce(bouncing(0.3), thrown_back(0.1)) == pytest.approx(0.3, abs=1e-3)


def test_turning_after_a_landing_is_read_just_after_it():
    t = rows(0.25)
    turned = np.clip(t - math.sqrt(0.2 / G), 0.0, None)
    assert impacts.turning_after_landing(motion(t, theta=-0.3 * turned)) == pytest.approx(-0.3)


def test_turning_that_a_strike_leaves_is_a_share_of_that_before():
    t = rows(0.25)
    turned = 0.5 * np.minimum(t, 0.13) + 0.1 * np.clip(t - 0.13, 0.0, None)
    assert impacts.turning_left(motion(t, theta=turned)) == pytest.approx(0.2)


def test_a_corner_leaves_its_height_by_the_lift_and_the_tilt():
    """The cube's half diagonal is 0.707 m."""
    tilted = motion([0.0, 1.0, 2.0], y=[0.5, 0.499, 0.5], theta=[0.0, -2e-3, 0.0])
    assert impacts.tipping(tilted) == pytest.approx(1.0 + math.sqrt(0.5) * 2.0)


def test_the_highest_rise_counts():
    low, high = (motion([0.0, 1.0], y=[0.9, 0.9 + up]) for up in (1e-3, 4e-3))
    assert impacts.thrown_up(low, high) == pytest.approx(4.0)


# Rocking

ALPHA, RADIUS, P = PAPER_BLOCK.alpha, PAPER_BLOCK.radius, PAPER_BLOCK.frequency_parameter


def test_an_uplift_at_nine_tenths_is_read_off_the_rotation():
    """From there on theta'' = p^2 theta + K (t - t0), integrated in steps."""
    rate = 0.1 * G
    begins = 0.9 * G * math.tan(ALPHA) / rate
    push = 0.75 * math.cos(ALPHA) * rate / RADIUS
    t = rows(4.0)

    def motion_at(since, state):
        return state[1], P**2 * state[0] + push * since

    after = t[t >= begins] - begins
    solved = solve_ivp(motion_at, (0.0, 4.0), (0.0, 0.0), t_eval=after, rtol=1e-9, atol=1e-12)
    theta = np.concatenate([np.zeros(len(t) - len(after)), np.minimum(solved.y[0], 1.0)])
    assert rocking.uplift(motion(t, theta=theta)) == pytest.approx(0.9, abs=2e-3)


def test_a_ratio_follows_from_the_swing_after_the_impact():
    """Back to 0.3 alpha from 0.5 alpha; what comes after 2.2 s is another swing."""
    t = rows(2.5)
    shares = np.interp(t, [0.0, 1.0, 1.5, 2.2], [0.5, 0.0, -0.3, 0.0])
    theta = ALPHA * np.where(t < 2.2, shares, -1.0)
    energies = [math.cos((1.0 - share) * ALPHA) - math.cos(ALPHA) for share in (0.3, 0.5)]
    ratio = math.sqrt(energies[0] / energies[1]) / (1.0 - 1.5 * math.sin(ALPHA) ** 2)
    assert rocking.housner(motion(t, theta=theta)) == pytest.approx(ratio, rel=1e-6)


def test_a_block_that_does_not_swing_back_has_no_ratio():
    t = rows(2.5)
    theta = np.where(t < 1.0, 0.5 * ALPHA * (1.0 - t), 0.0)
    assert rocking.housner(motion(t, theta=theta)) == 0.0


def test_a_period_is_over_the_exact_one():
    """The exact quarter period, by integration from 0.5 alpha."""

    def upright(_, state):
        return state[0]

    upright.terminal = True
    solved = solve_ivp(
        lambda _, state: (state[1], -(P**2) * math.sin(ALPHA - state[0])),
        (0.0, 3.0),
        (0.5 * ALPHA, 0.0),
        events=upright,
        rtol=1e-10,
        atol=1e-12,
    )
    returns = 1.1 * solved.t_events[0][0]
    t = rows(2.5)
    made = motion(t, theta=0.5 * ALPHA * (1.0 - t / returns))
    assert rocking.period(made) == pytest.approx(1.1, abs=1e-5)


def test_the_worse_of_two_times_from_the_balance_counts():
    before, beyond = PHENOMENA["RC-27"].scenes
    back, down = (EXACT.simulate(scene).channels for scene in (before, beyond))
    late = motion(1.2 * down["t"], theta=down["theta"])
    early = motion(0.7 * back["t"], theta=back["theta"])
    assert rocking.leaving(motion(back["t"], theta=back["theta"]), late) == pytest.approx(
        1.2, abs=1e-3
    )
    assert rocking.leaving(early, late) == pytest.approx(0.7, abs=1e-3)


@pytest.mark.parametrize(("other", "counts"), [(0.0, 1.0), (0.009, 1.0), (0.011, 0.0)])
def test_a_fall_without_impact_has_no_swing_to_the_other_side(other, counts):
    theta = np.array([0.0, -other * 0.019997333973, 0.0, 1.5])
    made = motion(rows(3.0, 1.0), theta=theta, outcome="overturned left")
    assert rocking.falls_without_impact(made) == counts


def test_what_stands_has_not_fallen_without_impact():
    assert rocking.falls_without_impact(motion(rows(3.0, 1.0))) == 0.0


def test_of_the_sines_the_larger_overturns():
    assert [rocking.sine_overturns(scene) for scene in rocking.SINES] == [False, True]


def test_towers_that_fall_or_stand_wrongly_are_counted():
    fell, stands = motion([0.0], outcome="overturned left"), motion([0.0])
    assert rocking.size_outcomes(fell, fell, stands, stands, stands) == 0.0
    assert rocking.size_outcomes(stands, fell, stands, stands, fell) == 2.0


# Invariance


def test_a_rise_of_the_energy_is_over_the_first_value():
    """Of potential energy, halfway between rows: 0.3, 0.1 and 0.25 m above the floor."""
    slow = motion(1e4 * np.arange(4), y=[1.0, 0.6, 0.6, 0.9])
    assert invariance.energy_gained(slow) == pytest.approx(0.15 / 0.3, rel=1e-6)


def test_a_tumble_comes_to_rest():
    assert EXACT.simulate(invariance.TUMBLE).outcome == "at rest"


def test_a_motion_is_held_against_its_mirror_image():
    """The block's slenderness is that of 0.3 by 0.5."""
    one = motion([0.0, 1.0], theta=[0.0, 0.1])
    other = motion([0.0, 1.0], theta=[0.0, -0.13])
    assert invariance.asymmetry(one, other) == pytest.approx(0.03 / math.atan(0.6))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_unrest_is_the_way_of_a_corner(sign):
    height = PAPER_BLOCK.half_height
    moved = motion(
        [0.0, 1.0],
        x=[0.0, sign * 1e-3],
        y=[height, height + sign * 2e-3],
        theta=[0.0, sign * 1e-3],
    )
    assert invariance.unrest(moved) == pytest.approx(1.0 + 2.0 + RADIUS)


def loose(share=1.0):
    """A block in place, or a share of its base's way behind: 2 m/s^2 at 0.5 s for 2 s."""
    t = rows(2.0)
    pulse = 4.0 * math.pi
    way = 2.0 / pulse * (t - np.sin(pulse * t) / pulse)
    return motion(t, x=0.3 - share * way)


def test_a_loose_block_that_is_taken_along_is_off_by_that_share():
    still = motion(rows(2.0))
    assert invariance.moving_base(loose(0.9), still, still) == pytest.approx(0.1)


def test_a_falling_base_is_held_against_a_weaker_gravity():
    light, falling = (motion(rows(2.0), theta=theta) for theta in (0.1, 0.13))
    assert invariance.moving_base(loose(), light, falling) == pytest.approx(0.03 / ALPHA)


# What a history is asked before it is read

SLIDE = PHENOMENA["RC-01"].scenes[0]
ROCK = PHENOMENA["RC-10"].scenes[0]


def checked(scene, *, end=None, **changed):
    t = rows(scene.duration if end is None else end)
    x, y, theta, *_ = scene.initial_state
    columns = {"x": x, "y": y, "theta": theta} | changed
    trial.check_units(scene, motion(t, **columns).history)


@pytest.mark.parametrize("scene", [SLIDE, ROCK], ids=["slide", "rock"])
def test_a_history_that_begins_as_its_scene_is_taken(scene):
    checked(scene)


@pytest.mark.parametrize(
    ("off", "name"), [(0.019, None), (0.021, "x begins at"), (-0.021, "x beg")]
)
def test_a_place_may_be_off_by_a_fiftieth_of_the_radius(off, name):
    shift = off * SLIDE.block.radius
    if name is None:
        checked(SLIDE, x=shift)
        return
    with pytest.raises(ModelFailure, match=name):
        checked(SLIDE, x=shift)


def test_a_rotation_may_be_off_by_a_fiftieth():
    start = ROCK.initial_rotation
    checked(ROCK, theta=start + 0.019)
    with pytest.raises(ModelFailure, match="theta begins at"):
        checked(ROCK, theta=start + 0.021)


def test_a_rotation_beyond_a_half_turn_is_in_degrees():
    checked(SLIDE, theta=np.linspace(0.0, 3.1, 1001))
    with pytest.raises(ModelFailure, match="degrees"):
        checked(SLIDE, theta=np.linspace(0.0, 3.2, 1001))


def test_only_the_first_row_is_held_against_the_start():
    jumps = np.where(rows(SLIDE.duration) > 0.0, SLIDE.block.radius, 0.0)
    checked(SLIDE, x=jumps)


def test_the_last_row_is_held_against_the_end():
    trial.check_units(SLIDE, motion([0.0, 0.5, 0.95], y=0.5).history)


def test_a_history_that_ends_long_before_its_scene_is_in_other_units():
    checked(SLIDE, end=0.9)
    with pytest.raises(ModelFailure, match="t ends at"):
        checked(SLIDE, end=0.89 - SLIDE.output_step)


def test_a_block_that_has_fallen_may_end_its_history():
    checked(SLIDE, end=0.3, theta=np.linspace(0.0, 1.5, 301))


# A trial


@pytest.fixture
def tried(monkeypatch):
    """The result of a phenomenon by a model that plays `simulate`."""

    def result(id, simulate=EXACT.simulate, *, stated="", family="mujoco", **model):
        made = SimpleNamespace(simulate=simulate, **model)
        monkeypatch.setattr("rockcheck.validation.execute.models.build", lambda *_: made)
        player = Player(label="made", family=family, setup="best", step=1e-3, version=stated)
        return Trial(player=player, id=id).play()

    return result


@pytest.mark.parametrize(("stated", "shown"), [("", "7"), ("8", "8")])
def test_the_version_is_the_player_s_or_else_the_model_s(tried, stated, shown):
    assert tried("RC-05", stated=stated, version="7").version == shown


def test_a_part_that_the_engine_lacks_is_not_played(tried):
    result = tried("RC-07", lacks=lambda: ("restitution",))
    assert result.verdict == "lacks"
    assert result.value is None


def test_what_needs_no_such_part_is_played(tried):
    assert tried("RC-05", lacks=lambda: ("restitution",)).verdict == "pass"


def test_the_value_is_read_off_and_judged(tried):
    result = tried("RC-05")
    assert result.verdict == "pass"
    assert result.value == pytest.approx(1.0)


def test_what_is_never_seen_has_no_value(tried):
    """A block that sticks does not slip at any push."""
    result = tried("RC-02", lambda scene: motion(rows(4.0), y=0.5).history)
    assert result.verdict == "fail"
    assert result.value is None


def test_a_history_in_files_is_held_against_its_scene(tried):
    with pytest.raises(ModelFailure, match="unit"):
        tried("RC-05", lambda scene: motion(rows(10.0), x=9.0).history, family="measured")


def test_the_history_of_an_engine_is_not(tried):
    assert tried("RC-05", lambda scene: motion(rows(10.0), x=9.0).history).value == 0.0
