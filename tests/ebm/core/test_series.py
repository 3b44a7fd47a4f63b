"""Polynomials in time: their first roots, the signs with which they leave zero, and bounds."""

import itertools
import math
from collections import Counter

import numpy as np
import pytest
from numpy.polynomial.polynomial import polyder, polyfromroots, polyint, polyroots, polyval
from stepping import row_of, run_at

from rockcheck.ebm.core import (
    guards,
    series,
)
from rockcheck.ebm.core.names import Guard, Kind, Row

NOISES = series.NOISE.tolist()


def first_root(coefficients, h: float, noise: float = NOISES[Kind.POSITION]) -> float | None:
    """First time in [0, h] at which the polynomial (constant first) turns negative."""
    row, stack = row_of(coefficients), np.full((48, series.WIDTH), np.nan)
    found = series.first_root(row, 0, len(coefficients) - 1, h, h, noise, series.AHEAD, stack)
    return None if found == series.NO_ROOT else found


def leading(coefficients, noise: float = NOISES[Kind.POSITION]) -> int:
    return series.leading(row_of(coefficients), 0, len(coefficients) - 1, noise, series.AHEAD)


@pytest.mark.parametrize("noise", NOISES)
def test_first_root_of_random_polynomials(noise):
    rng = np.random.default_rng(41)
    judged = Counter()
    for _ in range(1000):
        degree, h = int(rng.integers(1, 15)), float(rng.choice([0.03, 0.4, 1.0, 2.0]))
        c = rng.normal(0.0, 1.0, degree + 1) / h ** np.arange(degree + 1)
        if rng.integers(0, 2):  # up to six roots inside
            c = polyfromroots(h * rng.uniform(0.02, 1.0, int(rng.integers(1, 7))))
        c *= math.copysign(1.0, c[0]) / np.abs(c * h ** np.arange(len(c))).max()
        roots = polyroots(c)
        near = roots[np.abs(roots.imag) < 1e-4 * h]
        if (
            np.any(np.abs(near.imag) > 0.0)
            or np.any(np.abs(near.real - h) < 1e-6 * h)
            or np.any(np.abs(near.real) < 1e-3 * h)
            or np.any(np.diff(np.sort(near.real)) < 0.02 * h)
        ):
            # About to touch, or two roots in one place: whether they are roots is a matter of
            # rounding.
            continue
        expected = min((r for r in near.real if 0.0 < r < h), default=None)
        found = first_root(c, h, noise)
        judged[found is None] += 1
        assert (found is None) == (expected is None), (c, h, found, expected)
        if found is not None:
            gradient = polyval(expected, polyder(c))
            expected -= polyval(expected, c) / gradient  # which numpy knows less well
            assert found == pytest.approx(expected, abs=1e-12 * h + 1e-14 / abs(gradient))
            assert first_root(c, 0.999 * found, noise) is None
    assert min(judged.values()) > 200


def test_signs_of_all_short_patterns():
    for pattern in itertools.product((-1.0, 0.0, 1.0), repeat=6):
        first = next((c for c in pattern if c), 0.0)
        for size in (1.0, 1e-3, 40.0):
            assert leading(size * np.array(pattern)) == first, pattern
        assert first_root(pattern, 1e-3) == (0.0 if first < 0.0 else None), pattern


@pytest.mark.parametrize("k", [1, 2, 3])
def test_a_zero_at_the_start_is_divided_out(k):
    """tau^k q(tau) with q(0) > 0: the event that was just met is not met again, and the next one is
    found."""
    rng = np.random.default_rng(43)
    for root in rng.uniform(0.05, 0.9, 100):
        # What rounding leaves of the zeros.
        c = np.array([*rng.normal(0.0, 1e-15, k), root, -1.0, 0.0, 0.0, 0.0, 0.0])
        assert leading(c) == 1
        assert first_root(c, 1.0) == pytest.approx(root, abs=1e-9)
        assert first_root(c, 0.9 * root) is None
        assert leading(-c) == -1
        assert first_root(-c, 1.0) == 0.0


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7])
@pytest.mark.parametrize("start", [-0.9, -0.4, 0.0, 0.4, 0.9])
def test_a_guard_that_begins_as_noise_ends_its_mode_where_it_is_more_than_noise(start, share):
    """So it does not matter how a motion is cut into steps, nor with which noise one begins."""
    noise = series.NOISE[Kind.FORCE]
    falls = noise * np.array([start, -0.01, -1.0])  # noise throughout the time AHEAD
    end = -0.005 + math.sqrt(0.005**2 + 1.0 + start)
    cut = share * end
    moved = np.array([polyval(cut, falls), falls[1] + 2.0 * falls[2] * cut, falls[2]])
    assert cut + first_root(moved, 2.0, noise) == pytest.approx(end, rel=1e-12)


@pytest.mark.parametrize("order", [12, 13, 14, 15])
def test_a_force_of_which_only_every_fourth_power_is_there_has_a_step(order):
    """Friction that winds up under a constant acceleration: tanh(tau^2) has a radius of sqrt(pi/2),
    and no step may come near it."""
    terms = np.zeros(16)
    terms[2::4] = [1.0, -1.0 / 3.0, 2.0 / 15.0, -17.0 / 315.0]
    assert 0.15 < series.force_step(row_of(terms[: order + 1]), 0, order, 1e-10, 10.0) < 0.35


@pytest.mark.parametrize(
    ("terms", "reach", "step"),
    [
        ([1.0, 1e3, 1e6, 1e9], 1.0, math.sqrt(1e-15)),
        ([1.0, 1e3, 1e6, 1e9], 1e-8, 1e-8),  # no longer than is asked for
        ([1.0, 0.0, 0.0, 0.0], 1.0, 1.0),  # a constant
    ],
)
def test_the_last_terms_of_a_force_bound_its_step(terms, reach, step):
    assert series.force_step(row_of(terms), 0, 3, 1e-9, reach) == pytest.approx(step)


def test_a_position_asks_for_shorter_steps_than_a_force():
    """For the terms of its rate to be below the tolerance, too."""
    terms = row_of([1.0, 1e3, 1e6, 1e9])
    assert series.step_size(terms, 0, 0, 3, 1e-9, 1.0) < series.force_step(terms, 0, 3, 1e-9, 1.0)


@pytest.mark.parametrize("rate", [-np.inf, np.nan])
def test_a_search_for_a_root_ends_where_the_series_is_not_finite(rate):
    """Its halvings would not: no bound holds for what is not a number."""
    with np.errstate(invalid="ignore"):
        assert math.isnan(first_root([1.0, rate, np.inf, 0.0], 1.0, 1e-13))


@pytest.mark.parametrize("place", [0.3, 0.5, 0.7310585])
def test_touching_is_no_root_and_dipping_is_one(place):
    """A double root lifted by 1e-12 is none; lowered by as much it is one, to the square root of
    that. A triple one crosses."""
    touch, lift = polyfromroots([place] * 2), np.array([1e-12, 0.0, 0.0])
    assert first_root(touch + lift, 1.0) is None
    assert first_root(touch - lift, 1.0) == pytest.approx(place - 1e-6, abs=1e-9)
    assert first_root(-polyfromroots([place] * 3), 1.0) == pytest.approx(place, abs=1e-4)
    two = -polyfromroots([place, place, 0.9])  # touches, then crosses
    assert first_root([two[0] + 1e-12, *two[1:]], 1.0) == pytest.approx(0.9, abs=1e-9)


@pytest.mark.parametrize("dip", [0.0, 1e-16, 1e-10, 4e-10, 1e-9, 1e-6])
def test_a_force_that_only_touches_zero_ends_no_mode(dip):
    """A step ends where the force is positive again if it falls by less than noise, else in an
    event, as where it begins below."""
    place, run = 0.1, run_at()
    touch = np.array([place * place - dip, -2.0 * place, 1.0])
    for which in range(len(guards.KIND)):
        guards.drop(run.a, which)
    guards._enter(run.a, Guard.FLOOR_PUSH, 0.0, 1.0)

    def first(terms, length: float) -> tuple[float, int]:
        run.a[Row.P, :3] = terms
        run.state.order, run.state.length = 4, length
        guards.first_event(run)
        return float(run.state.tau), int(run.state.guard)

    tau, which = first(touch, 1.0)
    assert first([-1e-8, *touch[1:]], 1.0) == (0.0, Guard.FLOOR_PUSH)
    if dip > series.NOISE[Kind.FORCE]:
        assert tau == pytest.approx(place - math.sqrt(dip), abs=1e-12)
        assert which == Guard.FLOOR_PUSH
        return
    assert which == Guard.NONE
    assert tau == pytest.approx(place + math.sqrt(dip), abs=3e-9) or (dip == 0.0 and tau == 1.0)
    assert first([polyval(tau, touch), touch[1] + 2.0 * tau, 1.0], 0.5) == (0.5, Guard.NONE)


@pytest.mark.parametrize(
    ("later", "which"),
    [(-2e-9, Guard.FLOOR_PUSH), (-5e-10, Guard.PHI), (5e-10, Guard.PHI), (2e-9, Guard.PHI)],
)
def test_of_a_contact_and_a_force_at_one_instant_the_contact_is_the_event(later, which):
    """A force ends the mode where it vanishes by more than an instant, 1e-9, before."""
    run = run_at()
    for guard in range(len(guards.KIND)):
        guards.drop(run.a, guard)
    guards._enter(run.a, Guard.PHI, 0.0, 1.0)
    guards._enter(run.a, Guard.FLOOR_PUSH, 0.0, 1.0)
    run.a[Row.PHI, :2], run.a[Row.P, :2] = (0.1, -1.0), (0.1 + later, -1.0)
    run.state.order, run.state.length = 4, 1.0
    guards.first_event(run)
    assert run.state.guard == which


@pytest.mark.parametrize("noise", NOISES)
def test_noise_is_no_sign(noise):
    for terms, sign in (
        ([0.5 * noise], 0),
        ([2.0 * noise], 1),
        ([-0.5 * noise, 1.0], 1),
        ([0.0, -0.5 * noise / series.AHEAD, 1.0], 1),
        ([0.7 * noise, 0.7 * noise / series.AHEAD], 0),
        ([-noise, 2.0 * noise / series.AHEAD], 0),
    ):
        assert [leading(side * np.array(terms), noise) for side in (1, -1)] == [sign, -sign], terms
    for terms, root in (([0.5, 0.0, -1.0 / noise], 0.0), ([-0.5, 0.0, 1.0 / noise], None)):
        assert first_root(noise * np.array(terms), 1.0, noise) == root
    assert first_root([-0.5 * noise, 0.0, 0.0], 1.0, noise) is None


@pytest.mark.parametrize(
    ("terms", "sign"),
    [
        # Negative, but for less than an instant: an event's time is not known better than that.
        ([-1e-10, 1.0], 1),
        ([-1e-8, 1.0], -1),
        # Where friction nearly jams the pivot terms beyond the third grow without bound: the noise
        # that they bring is not that of a slope. The third one's is.
        ([0.0, -1e-7, 0.0, 1e12], -1),
        ([0.0, -1e-7, 1e12], 1),
        # Rounding of the slope, in the time that is looked ahead.
        ([1e-12, -1e3], -1),
    ],
    ids=str,
)
def test_what_counts_as_a_start(terms, sign):
    assert leading(terms) == sign


@pytest.mark.parametrize("noise", NOISES)
def test_what_is_noise_at_first_may_grow(noise):
    """In a long step a guard that starts as noise and falls is met where it has become more than
    noise."""
    c = [0.0, 0.0, 0.0, 0.0, -noise]  # -noise tau^4
    assert leading(c, noise) == 0
    assert first_root(c, 0.9, noise) is None
    assert first_root(c, 10.0, noise) == pytest.approx(1.05, abs=0.15)
    # Met where it has fallen by the noise: noise tau^4 / 16 is that at tau = 2.
    assert first_root([0.0, 0.0, 0.0, 0.0, -noise / 16.0], 10.0, noise) == pytest.approx(
        2.0, rel=1e-9
    )


@pytest.mark.parametrize("seed", range(40))
def test_the_largest_value_is_that_of_the_highest_top(seed):
    """However often the slope changes its sign on the way, and with whichever it begins."""
    r = np.random.default_rng(seed)
    tau, n = r.uniform(0.1, 2.0), seed % 6
    turns = np.array([0.0, *tau * np.sort(r.uniform(0.05, 0.95, n))])
    rate = r.choice([-1.0, 1.0]) * polyfromroots([*turns[seed % 2 :], tau + 1.0])
    c = polyint(rate, k=r.normal())
    a, stack = np.stack([row_of(some)[0] for some in (c, rate, c)]), np.ones((48, series.WIDTH))
    top, falls = max(polyval(turns, c)), min(polyval(np.linspace(0.0, tau, 2001), rate)) < -1e-9
    highest, at = series.highest(a, 0, 1, 2, len(rate), tau, stack)
    assert highest == pytest.approx(top, abs=1e-13)
    assert polyval(at, c) == pytest.approx(top, abs=1e-13)
    assert series.may_top(a, 0, 1, len(rate), tau, top - 1e-12) or not falls
    assert not series.may_top(a, 0, 1, len(rate), tau, np.abs(c) @ tau ** np.arange(len(c)))


def test_all_terms_of_a_series_count():
    ones = row_of(np.ones(series.ORDER + 1))
    assert series.value(ones, 0, series.ORDER, 1.0) == series.ORDER + 1


def test_a_velocity_and_a_force_of_noise_move_a_position_by_its_noise():
    position, rate, force = NOISES
    assert rate * series.AHEAD == pytest.approx(position, rel=1e-15, abs=0.0)
    assert 0.5 * force * series.AHEAD**2 == pytest.approx(position, rel=1e-15, abs=0.0)


@pytest.mark.parametrize(("level", "may"), [(0.53, True), (1.6, False)])
def test_late_terms_bound_a_top(level, may):
    """1/2 + tau^9 - tau^10 has its top, 0.539, at 0.9, and stays below 1.5."""
    c = np.array([0.5, *[0.0] * 8, 1.0, -1.0])
    a = np.concatenate([row_of(c), row_of(polyder(c))])
    assert series.may_top(a, 0, 1, 10, 1.0, level) == may
