"""Lanes: the compiled code does what the plain functions say, to the bit; polynomials in two
halves."""

import math
from fractions import Fraction

import numba
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from stepping import row_of

from rockcheck.ebm.core import series
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

NUMBERS = np.array(
    [
        [1.5, -2.25, 0.0, -0.0, 3e300, -1e-310, 0.1, 7.0],
        [0.3, np.nan, -np.inf, np.inf, -1e-3, 2.0, -5.0, 1e10],
    ]
)


#: What is done with two registers, a place and a number.
PARTS = {
    "sum": lambda one, other, place, number: one + other,
    "product": lambda one, other, place, number: one * other,
    "multiples": lambda one, other, place, number: number * one + other * number,
    "zeros": lambda one, other, place, number: zeros(),
    "ramp": lambda one, other, place, number: ramp(),
    "powers": lambda one, other, place, number: powers(number),
    "put": lambda one, other, place, number: put(one, place, number),
    "upto": lambda one, other, place, number: upto(other, place),
    "above": lambda one, other, place, number: above(other, place),
    "shifted": lambda one, other, place, number: shifted(other),
    "falls": lambda one, other, place, number: falls(other),
    "first": lambda one, other, place, number: put(zeros(), 0, first(one)),
    "total": lambda one, other, place, number: put(put(zeros(), 0, total(one)), 1, total(other)),
}


def played(part, a, place, number):
    store(a, 2, 0, part(load(a, 0, 0), load(a, 1, 0), place, number))


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")
@pytest.mark.parametrize("name", PARTS)
def test_compiled_lanes_are_the_plain_ones(name):
    jit = numba.njit(error_model="numpy")
    play, part = jit(played), jit(PARTS[name])
    for place in (-9, -1, 0, 3, LANES - 1, LANES, 2**40):
        for number in (0.0, 0.37, -1.9, 1e9):
            plain, fast = np.vstack([NUMBERS, NUMBERS[:1]]), np.vstack([NUMBERS, NUMBERS[:1]])
            with np.errstate(all="ignore"):
                played(PARTS[name], plain, place, number)
            play(part, fast, place, number)
            np.testing.assert_array_equal(fast, plain)
            np.testing.assert_array_equal(np.signbit(fast), np.signbit(plain))


coefficients = st.lists(st.floats(-4.0, 4.0), min_size=2, max_size=series.ORDER + 1)


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
    size = sum(abs(c) * h**k for k, c in enumerate(terms))
    for t in np.linspace(0.0, h, 201):
        assert least <= min(series.value(row, 0, n, t) - terms[0], 0.0) + 1e-14 * size
    if all(c <= 0.0 for c in terms[1:]):
        assert least == pytest.approx(series.value(row, 0, n, h) - terms[0], abs=1e-14 * size)


@pytest.mark.parametrize("place", range(1, series.ORDER + 1))
def test_the_least_change_of_what_is_no_number(place):
    row = np.ones((1, series.WIDTH))
    row[0, place] = np.nan
    assert not math.isfinite(series.least_change(*series.halves(row, 0, series.ORDER), 0.5))
