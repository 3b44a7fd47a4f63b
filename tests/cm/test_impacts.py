"""Contacts that close: when, with which spring and damper, and what of their strikes is written."""

import math

import numpy as np
import pytest
from step_parts import STIFFNESS, G, parameters, state_of

from rockcheck.cm.geometry import FLOOR, LEFT_WALL, RIGHT_WALL, Corner
from rockcheck.cm.impacts import (
    YOUNG,
    close_contact,
    closing_time,
    effective_mass,
    record_strikes,
)
from rockcheck.cm.state import STRIKE

CONTACT_TIME = 1.0 / math.sqrt(STIFFNESS)
COUPLING = 0.4


def corner(rate=-0.5, *, gap=-1e-9, mobility=1.8, slip=0.0, before=0.0):
    return Corner(0.2, -0.9, 0.2, mobility, gap, before, rate, slip)


FAR = corner(-0.5, gap=0.1, mobility=1.5)


def closed(made=None, surface=LEFT_WALL, comes=None, other=FAR, *, t=1.0, last_closed=-math.inf):
    """The contact that has closed, and the step that it needs."""
    contact = state_of().contacts[surface, 0]
    contact.last_closed = last_closed
    made = made or parameters()
    length = close_contact(contact, made, surface, comes or corner(), other, COUPLING, t)
    return contact, length


def expected_damping(surface, mass, spring=1.0):
    ratio = parameters().damping_ratio[surface]
    return 2.0 * ratio * math.sqrt(spring * STIFFNESS * mass)


# Spring and damper


@pytest.mark.parametrize("surface", [LEFT_WALL, RIGHT_WALL])
def test_a_corner_that_strikes_a_wall_alone_has_its_own_mass(surface):
    contact, _ = closed(surface=surface)
    assert contact.closed
    assert contact.stiffness == STIFFNESS
    assert contact.damping == pytest.approx(expected_damping(surface, 1.0 / 1.8))


def test_a_corner_that_strikes_the_floor_has_the_mass_of_its_friction():
    made, comes = parameters(), corner(slip=0.3)
    contact, _ = closed(surface=FLOOR, comes=comes)
    inverse = made.inverse_inertia
    mass = effective_mass(1.8, 1.0 + inverse * 0.81, inverse * 0.2 * 0.9, -0.5, 0.3, 0.4, 0.3, 0.25)
    assert contact.damping == pytest.approx(expected_damping(FLOOR, mass))


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.5])
def test_two_corners_of_a_block_in_balance_share_its_mass(ratio):
    made = parameters()._replace(reach=(0.3, 0.3, 1.0, 1.0))
    contact, _ = closed(made, other=corner(-0.5 * ratio, mobility=1.5))
    mass = 1.0 / (1.8 + COUPLING * min(1.0, ratio))
    assert contact.stiffness == STIFFNESS
    assert contact.damping == pytest.approx(expected_damping(LEFT_WALL, mass))


@pytest.mark.parametrize("surface", [LEFT_WALL, FLOOR])
def test_each_spring_is_as_stiff_as_its_share_of_a_lopsided_block(surface):
    """The shares solve the impact of both corners without friction."""
    speeds = np.array([-0.5, -0.4])
    contact, _ = closed(surface=surface, other=corner(speeds[1], mobility=1.5))
    impulses = np.linalg.solve([[1.8, COUPLING], [COUPLING, 1.5]], -speeds)
    mass = impulses[0] / 0.5
    assert contact.stiffness == pytest.approx(2.0 * mass * STIFFNESS)
    assert contact.damping == pytest.approx(expected_damping(surface, mass, 2.0 * mass))


@pytest.mark.parametrize(
    ("surface", "reach"), [(LEFT_WALL, (0.3, 0.4, 1.0, 1.0)), (FLOOR, (0.3, 0.3, 1.0, 0.8))]
)
def test_what_lies_along_the_surface_decides_about_balance(surface, reach):
    made = parameters()._replace(reach=reach)
    contact, _ = closed(made, surface, other=corner(-0.5, mobility=1.5))
    assert contact.stiffness == STIFFNESS


def test_a_corner_that_the_other_one_throws_off_has_a_mass_all_the_same():
    contact, _ = closed(comes=corner(-0.1), other=corner(-0.9, mobility=1.5))
    assert contact.stiffness == STIFFNESS
    assert contact.damping == pytest.approx(expected_damping(LEFT_WALL, 1.0 / (1.8 + COUPLING)))


@pytest.mark.parametrize(
    ("other", "together"),
    [
        (corner(-0.06, mobility=1.5), True),
        (corner(-0.04, mobility=1.5), False),
        (corner(0.4, mobility=1.5), False),
        (corner(-0.5, gap=0.4 * CONTACT_TIME, mobility=1.5), True),
        (corner(-0.5, gap=0.6 * CONTACT_TIME, mobility=1.5), False),
    ],
    ids=["comes too", "hardly comes", "leaves", "comes at once", "comes later"],
)
def test_the_other_corner_takes_part_where_it_comes_at_once(other, together):
    contact, _ = closed(other=other)
    alone = contact.damping == pytest.approx(expected_damping(LEFT_WALL, 1.0 / 1.8))
    assert alone != together


def test_the_papers_damping_is_not_touched():
    contact, _ = closed(parameters(calibrated=False))
    assert contact.damping == 2.0 * math.sqrt(STIFFNESS) * parameters().damping_ratio[LEFT_WALL]


# Steps and strikes


def test_a_young_contact_needs_short_steps():
    _, length = closed(parameters(damping_ratio=(0.0, 0.0, 0.0)))
    assert length == 0.02 * CONTACT_TIME


def test_a_stiff_damper_needs_shorter_ones():
    contact, length = closed(parameters(damping_ratio=(90.0, 0.0, 0.0)))
    assert length == pytest.approx(1.0 / (contact.damping * 1.8))


@pytest.mark.parametrize(("share", "is_impact"), [(0.9, False), (1.1, True)])
def test_a_contact_that_closes_gently_is_no_impact(share, is_impact):
    contact, length = closed(comes=corner(-share * 0.01 * G * CONTACT_TIME))
    assert contact.closed
    assert (length < math.inf) == is_impact
    assert (contact.strike_time < math.inf) == is_impact


@pytest.mark.parametrize(("open_for", "strikes"), [(1.9e-3, False), (2.1e-3, True)])
def test_a_contact_strikes_that_was_open_for_long(open_for, strikes):
    contact, _ = closed(t=3.0, last_closed=3.0 - open_for)
    assert contact.strike_time == (3.0 if strikes else math.inf)
    assert contact.speed == (0.5 if strikes else 0.0)


def test_a_soft_contact_strikes_only_where_it_was_open_for_longer_than_it_is_young():
    from step_parts import LOADED

    from rockcheck.cm.start import parameters_of

    soft = parameters_of(LOADED, 1e4, 1e-3, calibrated=True)
    assert soft.strike == YOUNG * 0.01
    assert parameters().strike == 2e-3


def test_strikes_are_written_once_with_their_whole_impulse():
    state, rows = state_of(), np.zeros(4, STRIKE)
    early, late = state.contacts[LEFT_WALL, 1], state.contacts[FLOOR, 0]
    early.strike_time, early.force, early.speed = 1.0, 3.0, 0.25
    late.strike_time, late.force, late.speed = 2.0, 7.0, 0.5
    assert record_strikes(state, 0.1, 0.5, rows, 0) == 0
    assert state.first_strike == 1.0
    assert record_strikes(state, 0.1, 1.0, rows, 2) == 3
    assert rows[2].item() == (1.0, 2 * LEFT_WALL + 1, pytest.approx(0.6), 0.25)
    assert state.first_strike == 2.0
    assert record_strikes(state, 0.1, 2.5, rows, 3) == 4
    assert rows[3].item() == (2.0, 2 * FLOOR, pytest.approx(2.1), 0.5)
    assert state.first_strike == math.inf


def test_a_strike_begins_without_impulse():
    contact = state_of().contacts[LEFT_WALL, 0]
    contact.impulse = 5.0
    close_contact(contact, parameters(), LEFT_WALL, corner(), FAR, COUPLING, 1.0)
    assert contact.impulse == 0.0


# When an open contact closes

LENGTH = 2e-4


@pytest.mark.parametrize("pull", [0.0, -G, -4e3])
@pytest.mark.parametrize("rate", [-0.8, -0.01, 0.1])
def test_a_contact_closes_where_its_parabola_does(pull, rate):
    """Seen from the end of the step, at whose middle the gap is."""
    if rate >= 0.0 and pull != -4e3:
        return
    gap = 2e-6
    approaching = corner(gap=gap, before=rate - pull * LENGTH)
    time = closing_time(parameters(), approaching, rate, LENGTH)
    since = time + 0.5 * LENGTH
    assert since > 0.0
    assert gap + since * (rate + 0.5 * pull * since) == pytest.approx(0.0, abs=1e-18)


def test_a_contact_that_has_just_opened_closes_to_all_digits():
    """Thrown up at 0.1 m/s and pulled back at 4000 m/s^2 it returns after 2 0.1/4000 s."""
    opening = corner(gap=1e-17, before=0.1 + 4e3 * LENGTH)
    time = closing_time(parameters(), opening, 0.1, LENGTH)
    assert time + 0.5 * LENGTH == pytest.approx(5e-5, rel=1e-9)


@pytest.mark.parametrize(
    ("gap", "rate"), [(1e-6, 0.1), (1.0, -0.5), (4.9e-4 * 0.4, -0.4)], ids=["opens", "far", "later"]
)
def test_a_contact_that_does_not_close_soon_asks_for_nothing(gap, rate):
    assert closing_time(parameters(), corner(gap=gap, before=rate), rate, LENGTH) == math.inf


@pytest.mark.parametrize(("depth", "closes"), [(0.09, False), (0.11, True)])
def test_a_contact_that_closes_by_a_hair_asks_for_nothing(depth, closes):
    """Within half this step and the longest one after it."""
    reach = 0.5 * LENGTH + parameters().time_step
    rate = -0.01
    gap = -depth * G / STIFFNESS - reach * rate
    time = closing_time(parameters(), corner(gap=gap, before=rate), rate, LENGTH)
    assert (time < math.inf) == closes


def test_what_slows_down_is_taken_to_keep_its_speed():
    slowing = corner(gap=1e-4, before=-0.9)
    time = closing_time(parameters(), slowing, -0.5, LENGTH)
    assert time == pytest.approx(1e-4 / 0.5 - 0.5 * LENGTH)
