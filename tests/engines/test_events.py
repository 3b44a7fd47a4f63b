"""Events that are read off the states at step ends, of motions that are known."""

import math

import numpy as np
import pytest

from rockcheck import Block, Floor, Scene, Wall
from rockcheck.engines import events

G = 9.81
BLOCK = Block(half_width=0.3, half_height=0.8)
SCENE = Scene(name="made", block=BLOCK, floor=Floor(friction=0.4), duration=1.0, output_step=0.01)
STEP = 5e-4
T = STEP * np.arange(2001)


def told(*, x=0.0, y=None, theta=0.0, vx=None, scene=SCENE, rows=None, standing=False):
    """The events of a motion; velocities are those of the steps before their ends.

    Without a height the lower corner stays on the floor where it is `standing`."""
    x, theta = (np.broadcast_to(np.asarray(each, dtype=float), T.shape) for each in (x, theta))
    if y is None:
        y = 0.8 * np.cos(theta) + 0.3 * np.abs(np.sin(theta)) if standing else np.full(T.shape, 0.8)
    y = np.broadcast_to(y, T.shape)
    rates = [np.diff(each, prepend=2.0 * each[0] - each[1]) / STEP for each in (x, y, theta)]
    if vx is not None:
        rates[0] = np.broadcast_to(vx, T.shape)
    states = np.column_stack([x, y, theta, *rates])[:rows]
    felt = np.tile([0.0, -G], (len(T) - 1, 1))
    return events.events_of(scene, T[:rows], states, felt)


def kinds(found):
    return [event.kind for event in found]


def of_kind(found, kind):
    return [event for event in found if event.kind == kind]


# Floor


def test_a_block_at_rest_has_no_events():
    assert told() == []


def dropped(height=0.05, e=0.0):
    """The height of a block that drops onto the floor."""
    lands, speed = math.sqrt(2.0 * height / G), e * math.sqrt(2.0 * height * G)
    since = T - lands
    after = np.clip(speed * since - 0.5 * G * since**2, 0.0, None)
    return 0.8 + np.where(since < 0.0, height - 0.5 * G * T**2, after)


def test_a_flat_drop_is_an_impact_of_both_corners_and_a_landing():
    found = told(y=dropped())
    lands = math.sqrt(0.1 / G)
    hits = of_kind(found, "floor impact")
    assert [event.t for event in hits] == pytest.approx([lands] * 2, abs=STEP)
    assert [event.t for event in of_kind(found, "landing")] == pytest.approx([lands], abs=STEP)
    assert [event.t for event in of_kind(found, "settled")] == pytest.approx([lands], abs=2 * STEP)


def test_the_impulse_of_a_drop_is_its_momentum_and_its_weight_for_two_milliseconds():
    hits = of_kind(told(y=dropped()), "floor impact")
    momentum = math.sqrt(2.0 * 0.05 * G)
    assert sum(event.impulse for event in hits) == pytest.approx(momentum + 2e-3 * G, abs=G * STEP)
    assert hits[0].impulse == pytest.approx(hits[1].impulse, rel=1e-6)


def test_a_block_that_bounces_lifts_off_and_lands_again():
    found = told(y=dropped(0.05, e=0.5))
    lands = math.sqrt(0.1 / G)
    again = lands + math.sqrt(0.1 / G)
    hits = of_kind(found, "floor impact")
    assert [event.t for event in hits] == pytest.approx([lands] * 2 + [again] * 2, abs=2 * STEP)


def test_a_hop_begins_where_the_block_rises():
    """After 0.2 s of rest, at 0.5 m/s."""
    since = np.clip(T - 0.2, 0.0, None)
    found = told(y=0.8 + np.clip(0.5 * since - 0.5 * G * since**2, 0.0, None))
    (lift_off,), (landing,) = of_kind(found, "lift-off"), of_kind(found, "landing")
    assert lift_off.t == pytest.approx(0.2, abs=STEP)
    assert lift_off.mode_before == "rest"
    assert lift_off.mode_after == "flight"
    assert landing.t == pytest.approx(0.2 + 1.0 / G, abs=2 * STEP)


def test_an_opening_of_a_millisecond_is_chatter():
    y = np.full(T.shape, 0.8)
    y[1000:1002] += 1e-3
    assert told(y=y, vx=0.0) == []


def rocking(start=0.2, size=0.05, lasts=0.2):
    """Rest, half a swing over the left corner, rest."""
    since = T - start
    inside = (since > 0.0) & (since < lasts)
    return np.where(inside, size * np.sin(math.pi * since / lasts), 0.0)


def test_a_block_that_lifts_a_corner_has_an_uplift_and_an_impact():
    found = told(theta=rocking(), standing=True, x=0.0)
    (uplift,) = of_kind(found, "uplift")
    assert uplift.t == pytest.approx(0.2, abs=STEP)
    (hit,) = of_kind(found, "floor impact")
    assert hit.t == pytest.approx(0.4, abs=2 * STEP)
    assert of_kind(found, "lift-off") == []


def test_a_block_that_was_flat_for_a_moment_only_has_no_uplift():
    """Between two swings it is flat for 10 ms; at the start for 200."""
    theta = rocking(0.2) + rocking(0.41)
    assert len(of_kind(told(theta=theta, standing=True), "uplift")) == 1
    theta = rocking(0.2) + rocking(0.45)
    assert len(of_kind(told(theta=theta, standing=True), "uplift")) == 2


def test_the_impulse_of_a_rocking_impact_is_housners():
    """At 1 rad/s: it leaves the left corner and turns on about the right one."""
    ratio = 1.0 - 1.5 * math.sin(BLOCK.alpha) ** 2
    since = T - 0.1
    theta = -np.where(since < 0.0, since, ratio * since)
    sine = np.sin(np.abs(theta))
    x = np.where(theta > 0.0, 1.0, -1.0) * (0.3 * np.cos(theta) - 0.8 * sine - 0.3)
    (hit,) = of_kind(told(x=x, theta=theta, standing=True), "floor impact")
    assert hit.t == pytest.approx(0.1, abs=STEP)
    # The corner carries part of the weight for the two milliseconds that are counted, and a step.
    assert hit.impulse > 0.3 * (1.0 + ratio)
    assert hit.impulse < 0.3 * (1.0 + ratio) + G * (2e-3 + STEP)


# Slip

SLOWS = 0.4 * G


def slid(speed=1.0):
    """The way of a block that slides to rest."""
    ends = abs(speed) / SLOWS
    during = np.minimum(T, ends)
    return speed * during - 0.5 * math.copysign(SLOWS, speed) * during**2


@pytest.mark.parametrize("speed", [1.0, -1.0])
def test_a_block_that_slides_to_rest_sticks_and_settles(speed):
    found = told(x=slid(speed))
    assert kinds(found) == ["stick", "settled"]
    assert found[0].t == pytest.approx(1.0 / SLOWS, abs=3 * STEP)
    assert found[1].mode_after == "rest"


def test_slip_begins_where_the_block_starts():
    since = np.clip(T - 0.3, 0.0, None)
    (slip,) = told(x=0.5 * since**2)
    assert slip.kind == "slip"
    assert slip.t == pytest.approx(0.3, abs=2 * STEP)
    assert slip.mode_after == "slide"


def test_slower_slip_is_none():
    assert told(x=0.9e-3 * T) == []


# Walls

BESIDE = SCENE.replace(
    floor=Floor(friction=0.0), walls=[Wall(side="right", gap=0.1, restitution=0.5)]
)


def test_a_flush_hit_is_told_of_both_corners_with_its_impulse():
    """At 0.5 m/s; it comes back at 0.25."""
    x = np.where(T < 0.2, 0.5 * T, 0.1 - 0.25 * (T - 0.2))
    found = told(x=x, scene=BESIDE)
    hits = of_kind(found, "wall impact")
    assert [event.t for event in hits] == pytest.approx([0.2, 0.2], abs=STEP)
    assert sum(event.impulse for event in hits) == pytest.approx(0.75, rel=1e-3)
    assert of_kind(found, "release") == []


def test_a_wall_is_struck_where_the_gap_closes_between_two_steps():
    """At 0.2002 s; the next step ends at 0.2005 s, behind the wall."""
    x = np.where(T < 0.20075, 0.5 * T, 0.1001)
    beside = BESIDE.replace(walls=[Wall(side="right", gap=0.1001)])
    hits = of_kind(told(x=x, scene=beside), "wall impact")
    assert [event.t for event in hits] == pytest.approx([0.2002, 0.2002], abs=1e-6)


def test_a_strike_at_the_end_of_the_scene_is_told():
    hits = of_kind(told(x=0.1 * T, scene=BESIDE), "wall impact")
    assert [event.t for event in hits] == pytest.approx([1.0, 1.0], abs=1e-6)


def test_a_wall_that_is_touched_for_long_releases():
    """It stays at the wall for 0.3 s."""
    x = np.where(T < 0.2, 0.5 * T, 0.1) - 0.25 * np.clip(T - 0.5, 0.0, None)
    found = told(x=x, scene=BESIDE)
    releases = of_kind(found, "release")
    assert [event.t for event in releases] == pytest.approx([0.5, 0.5], abs=2 * STEP)


def test_a_wall_that_is_not_reached_is_not_struck():
    assert of_kind(told(x=0.09 * T, scene=BESIDE), "wall impact") == []


# Ends


@pytest.mark.parametrize(("sign", "side"), [(1.0, "left"), (-1.0, "right")])
def test_a_fall_is_told_at_a_right_angle_and_nothing_after_it(sign, side):
    """At 5 rad/s; the block lies with the last state."""
    rows = int(math.pi / 2.0 / (5.0 * STEP)) + 2
    found = told(theta=sign * 5.0 * T, y=2.0, rows=rows)
    assert found[-1].kind == f"overturned {side}"
    assert found[-1].t == pytest.approx(math.pi / 10.0, abs=1e-6)
    assert found[-1].mode_after == "overturned"


def test_a_fall_begins_in_the_mode_of_the_step_before():
    """It comes down in the air, and touches the floor with its last two states."""
    rows = int(math.pi / 2.0 / (5.0 * STEP)) + 2
    theta = 5.0 * T
    touches = 0.8 * np.cos(theta) + 0.3 * np.sin(theta)
    y = np.where(np.arange(len(T)) < rows - 2, 2.0, touches)
    found = told(theta=theta, y=y, rows=rows)
    assert found[-1].mode_before != "flight"


def test_what_comes_after_the_end_of_the_scene_is_not_told():
    short = SCENE.replace(duration=0.15)
    assert told(theta=rocking(), standing=True, scene=short) == []
