"""Lanes: the compiled code does what the plain functions say, to the bit; polynomials in two
halves."""

import math
from fractions import Fraction

import numba
import numpy as np
import pytest
import stepping
from hypothesis import given, settings, strategies as st
from stepping import TILTED, run_at

from rockcheck.ebm import natural
from rockcheck.ebm.core import lanes, motion, series
from rockcheck.ebm.core.lanes import (
    LANES,
    above,
    falls,
    first,
    load,
    powers,
    put,
    ramp,
    shifted,
    store,
    total,
    upto,
    zeros,
)
from rockcheck.ebm.core.names import Pivot, Row
from rockcheck.scenes import Floor, Ricker, Scene
from rockcheck.scenes.scene import PAPER_BLOCK

NUMBERS = np.array(
    [
        [1.5, -2.25, 0.0, -0.0, 3e300, -1e-310, 0.1, 7.0],
        [0.3, np.nan, -np.inf, np.inf, -1e-3, 2.0, -5.0, 1e10],
    ]
)


def arithmetic(a, place, number):
    one, other = load(a, 0, 0), load(a, 1, 0)
    store(a, 2, 0, one + other)
    store(a, 3, 0, one * other)
    store(a, 4, 0, number * one + other * number)


def made(a, place, number):
    store(a, 2, 0, zeros())
    store(a, 3, 0, ramp())
    store(a, 4, 0, powers(number))


def places(a, place, number):
    store(a, 2, 0, put(load(a, 0, 0), place, number))
    store(a, 3, 0, upto(load(a, 1, 0), place))
    store(a, 4, 0, above(load(a, 1, 0), place))


def whole(a, place, number):
    store(a, 2, 0, shifted(load(a, 1, 0)))
    store(a, 3, 0, falls(load(a, 1, 0)))
    a[4, 0], a[4, 1], a[4, 2] = first(load(a, 0, 0)), total(load(a, 0, 0)), total(load(a, 1, 0))


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")
@pytest.mark.parametrize(
    "function", [arithmetic, made, places, whole], ids=lambda function: function.__name__
)
def test_compiled_lanes_are_the_plain_ones(function):
    compiled = numba.njit(error_model="numpy")(function)
    for place in (-9, -1, 0, 3, LANES - 1, LANES, 2**40):
        for number in (0.0, 0.37, -1.9, 1e9):
            both = []
            for play in (function, compiled):
                a = np.full((5, LANES), 0.25)
                a[:2] = NUMBERS
                with np.errstate(all="ignore"):
                    play(a, place, number)
                both.append(a)
            np.testing.assert_array_equal(both[1], both[0])
            np.testing.assert_array_equal(np.signbit(both[1]), np.signbit(both[0]))


def test_a_series_fills_two_registers():
    """The rates of a guard are read one coefficient further, and so are the terms behind a zero:
    all that stands within the row."""
    assert series.ORDER + 1 == 2 * lanes.LANES
    assert 2 * series.ORDER < series.WIDTH


coefficients = st.lists(st.floats(-4.0, 4.0), min_size=2, max_size=series.ORDER + 1)


def row_of(terms: list[float]) -> np.ndarray:
    """The terms, and behind them what must not be seen."""
    row = np.full((1, series.WIDTH), np.nan)
    row[0, : len(terms)] = terms
    return row


@settings(deadline=None, max_examples=300)
@given(coefficients, st.floats(0.0, 2.0))
def test_values_and_slopes(terms, tau):
    n, t = len(terms) - 1, Fraction(tau)
    exact = sum(Fraction(c) * t**k for k, c in enumerate(terms))
    rate = sum(k * Fraction(c) * t ** (k - 1) for k, c in enumerate(terms) if k)
    size = sum(abs(c) * tau**k for k, c in enumerate(terms))
    assert abs(series.value(row_of(terms), 0, n, tau) - float(exact)) <= 1e-15 * size + 1e-300
    steepness = sum(k * abs(c) * tau ** (k - 1) for k, c in enumerate(terms) if k)
    assert abs(series.slope(row_of(terms), 0, n, tau) - float(rate)) <= 1e-15 * steepness + 1e-300


@settings(deadline=None, max_examples=300)
@given(coefficients, st.floats(1e-3, 2.0))
def test_the_least_change_is_a_bound(terms, h):
    """Nowhere does the polynomial fall farther; where it only falls, no bound is closer."""
    row, n = row_of(terms), len(terms) - 1
    least = series.least_change(*series.halves(row, 0, n), h)
    lowest = min(series.value(row, 0, n, t) - terms[0] for t in np.linspace(0.0, h, 201))
    size = sum(abs(c) * h**k for k, c in enumerate(terms))
    assert least <= min(lowest, 0.0) + 1e-14 * size
    if all(c <= 0.0 for c in terms[1:]):
        assert least == pytest.approx(series.value(row, 0, n, h) - terms[0], abs=1e-14 * size)


def test_the_least_change_of_what_is_no_number():
    for place in range(1, series.ORDER + 1):
        row = np.ones((1, series.WIDTH))
        row[0, place] = np.nan
        assert not math.isfinite(series.least_change(*series.halves(row, 0, series.ORDER), 0.5))


def rocking(side: np.record, a: np.ndarray, order: int) -> None:
    """ROCK, (3), term by term: theta'' = (u c - G s)/(I + R^2), P = y'' + G, Q = xi'' + u."""
    phi, omega, s, c, u, g = (
        a[row, :] for row in (Row.PHI, Row.OMEGA, Row.SIN, Row.COS, Row.U, Row.G)
    )
    for k in range(order):
        torque, ds, dc = (
            np.dot(x[: k + 1], y[k::-1]) - np.dot(v[: k + 1], w[k::-1])
            for x, y, v, w in ((u, c, g, s), (0.0 * u, c, omega, c), (omega, s, 0.0 * u, c))
        )
        phi[k + 1], omega[k + 1] = omega[k] / (k + 1), side.share * torque / (k + 1)
        s[k + 1], c[k + 1] = ds / (k + 1), dc / (k + 1)
    k = np.arange(order - 1)
    for force, place, base in ((Row.P, c, g), (Row.Q, s, u)):
        a[force, k] = (k + 1) * (k + 2) * place[k + 2] + base[k]


@pytest.mark.parametrize("vertical", [False, True])
@pytest.mark.parametrize("slip", [0, 1, -1])
def test_what_is_written_out_is_the_general_solution(slip, vertical):
    """All terms of ROCK and SLIDE-ROCK, whose sums are made eight at a time, against sums over all
    products, and the series of any set of contacts."""
    rng = np.random.default_rng(5)
    shaken = Ricker(amplitude=3.0, period=1.1) if vertical else None
    scene = Scene(
        name="terms",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.4),
        excitation=Ricker(amplitude=6.0, period=1.3, symmetric=False),
        duration=1.0,
        **({"vertical": shaken} if vertical else {}),
    )
    b = natural.setting_of(scene, unilateral=True, no_slip=False, energy_cap=False)
    run = run_at(**TILTED, slip=slip, pivot=Pivot.SLIPPING if slip else Pivot.STICK)
    state, mode, a = run.state, run.state.mode, run.a
    rows = [Row.PHI, Row.OMEGA, Row.SIN, Row.COS, Row.P, Row.Q] + [Row.XI, Row.Y] * (slip != 0)
    for _ in range(20):
        mode.sense = rng.choice([-1, 1])
        theta, w = mode.sense * rng.uniform(0.0, 1.2) * b.left.alpha, rng.uniform(-0.5, 0.5)
        lean = b.left.alpha - abs(theta)
        s, c = math.sin(lean), math.cos(lean)
        slides = mode.sense * (rng.uniform(-1.0, 1.0) if slip else 0.0)
        z = [mode.sense * s, c, theta, slides - c * w, mode.sense * s * w, w]
        stepping.put(state.motion, z)
        state.t = rng.uniform(0.5, 2.5)
        order = motion.tilt_series(b, natural.base_of(scene), run, series.ORDER, 0.0, 1.0)
        assert order == series.ORDER
        a[Row.OMEGA, order] = 0.0  # ROCK has one more
        found = a[rows, : order + 1].copy()
        a[Row.XI, :2], a[Row.Y, :2] = [mode.sense * z[0], mode.sense * z[3]], [z[1], z[4]]
        if slip:
            motion._contact_series(b, mode, order, 0.0, 1.0, a)
        else:
            rocking(b.left if mode.sense > 0 else b.right, a, order)
            a[Row.OMEGA, order] = 0.0
        wanted = a[rows, : order + 1]
        # Rounding of an early term spreads over all that follow: it is relative to the largest one
        # so far.
        size = np.maximum.accumulate(np.abs(wanted).max(axis=0))
        assert np.all(np.abs(found - wanted) <= 2e-13 * size)
        assert np.abs(wanted).max() < 1e6
