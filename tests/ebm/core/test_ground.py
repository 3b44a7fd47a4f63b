"""The base motion as the event core reads it: value, rate, series, extrema and kinks, in units of g
and of 0.4 s, against the excitation itself."""

import math

import numpy as np
import pytest

from rockcheck.ebm.core import ground
from rockcheck.ebm.core.state import Base
from rockcheck.scenes import Cosine, Excitation, HalfSine, Record, Ricker, Sine, Wavelet

UNIT, G = 0.4, 9.81
SMOOTH: dict[str, Excitation] = {
    "symmetric": Ricker(amplitude=5.0, period=1.3),
    "antisymmetric": Ricker(amplitude=-5.0, period=1.3, symmetric=False),
    "sine": Sine(amplitude=5.0, period=0.8, cycles=2),
    "cosine": Cosine(amplitude=5.0, period=0.8, cycles=2),
    "half sine": HalfSine(amplitude=-4.0, period=1.0),
    "wavelet": Wavelet(amplitude=7.0, period=0.8, gamma=2.2, phase=0.7),
}
RECORD = Record.from_samples([0.0, 3.0, -2.0, 1.0, 1.0], 0.1)
smooth = pytest.mark.parametrize("name", SMOOTH)


def times_of(excitation: Excitation, count: int = 36) -> list[float]:
    """Within the motion, in the units of the core."""
    return (np.linspace(0.003, 0.997, count) * excitation.quiet_after / UNIT).tolist()


@pytest.mark.parametrize("excitation", [*SMOOTH.values(), RECORD], ids=lambda one: one.kind)
def test_the_acceleration_is_that_of_the_excitation(excitation):
    base = ground.ground_of(excitation, G, UNIT)
    found = [ground.acceleration(base, t) for t in times_of(excitation)]
    expected = excitation.acceleration(np.array(times_of(excitation)) * UNIT) / G
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-14)
    assert ground.acceleration(base, 1.001 * excitation.quiet_after / UNIT) == pytest.approx(
        0.0, abs=1e-7
    )


@pytest.mark.parametrize("excitation", [*SMOOTH.values(), RECORD], ids=lambda one: one.kind)
def test_the_rate_is_that_of_the_acceleration(excitation):
    base, h = ground.ground_of(excitation, G, UNIT), 1e-5
    for t in times_of(excitation):
        rise = ground.acceleration(base, t + h) - ground.acceleration(base, t - h)
        assert ground._with_rate(base, t)[1] == pytest.approx(rise / (2.0 * h), abs=1e-7)


@smooth
def test_the_series_is_that_of_the_acceleration(name):
    base, terms, step = ground.ground_of(SMOOTH[name], G, UNIT), np.zeros((1, 25)), 0.05
    for t in times_of(SMOOTH[name], 11):
        ground.fill_series(base, t, -2.0, 24, terms, 0)
        value = np.polyval(terms[0][::-1], step)
        after = -2.0 * float(SMOOTH[name].acceleration(np.array([(t + step) * UNIT]))[0]) / G
        if (t + step) * UNIT < SMOOTH[name].quiet_after:
            assert value == pytest.approx(after, abs=1e-13)


@smooth
def test_up_to_its_next_extremum_a_motion_is_monotone(name):
    """And there it turns, or ends."""
    excitation = SMOOTH[name]
    base, end = ground.ground_of(excitation, G, UNIT), excitation.quiet_after / UNIT
    dense = np.linspace(0.0, end, 20_001)
    values = excitation.acceleration(dense * UNIT)
    turns = dense[1:-1][np.diff(np.sign(np.diff(values))) != 0.0]
    for t in times_of(excitation, 11):
        later = turns[turns > t + 2.0 * dense[1]]
        expected = later[0] if len(later) else None
        found = ground._next_extremum(base, t)
        if expected is None:
            assert found in (ground.NEVER, pytest.approx(end))
        else:
            assert found == pytest.approx(expected, abs=2.0 * dense[1])
            assert ground._with_rate(base, found)[1] == pytest.approx(0.0, abs=1e-11)


@smooth
def test_no_later_acceleration_is_above_its_bound(name):
    """Of a sum of sines the bound is that of its parts; of other pulses the largest one."""
    excitation = SMOOTH[name]
    base, end = ground.ground_of(excitation, G, UNIT), excitation.quiet_after / UNIT
    for t in times_of(excitation, 11):
        ahead = np.abs(excitation.acceleration(np.linspace(t, end, 5001) * UNIT)).max() / G
        bound = ground.largest_ahead(base, t)
        assert bound >= ahead - 1e-12
        if excitation.kind == "ricker":
            assert bound == pytest.approx(ahead, rel=1e-5)
    assert ground.largest_ahead(base, 1.001 * end) == 0.0


def test_the_bound_of_a_record_is_its_largest_sample_to_come():
    base = ground.ground_of(RECORD, G, UNIT)
    bounds = [ground.largest_ahead(base, t / UNIT) * G for t in (0.0, 0.15, 0.25, 0.35, 0.45)]
    assert bounds == pytest.approx([3.0, 3.0, 2.0, 1.0, 0.0])


def test_a_record_has_a_kink_at_each_sample():
    base = ground.ground_of(RECORD, G, UNIT)
    kinks = [ground.next_kink(base, t / UNIT) * UNIT for t in (0.0, 0.05, 0.1, 0.35, 0.4)]
    assert kinks == pytest.approx([0.1, 0.1, 0.2, 0.4, math.inf])


def test_a_pulse_of_sines_has_a_kink_at_its_end():
    for excitation in (SMOOTH["sine"], SMOOTH["wavelet"]):
        base, end = ground.ground_of(excitation, G, UNIT), excitation.quiet_after / UNIT
        assert ground.next_kink(base, 0.5 * end) == end
        assert ground.next_kink(base, end) == ground.NEVER


@pytest.mark.parametrize(
    ("widths", "kink"),
    [(-7.0, -6.0), (-5.0, -5.0 + 0.8), (-2.5, -2.5 + 1.6), (-1.9, None), (1.0, None)],
)
def test_in_the_rise_of_a_pulse_steps_are_short(widths, kink):
    """Of 4 widths^2 over the distance to its centre, from six widths before that on."""
    base = ground.ground_of(SMOOTH["symmetric"], G, UNIT)
    width = 1.0 / math.sqrt(base.form.rate)
    found = ground.next_kink(base, base.form.centre + widths * width)
    expected = ground.NEVER if kink is None else base.form.centre + kink * width
    assert found == pytest.approx(expected)


def test_a_kink_of_either_component_ends_what_is_smooth():
    sooner, later = (
        ground.ground_of(Sine(amplitude=1.0, period=period), G, UNIT) for period in (0.4, 0.8)
    )
    assert ground.smooth_until(Base(sooner, later), 0.1) == pytest.approx(1.0)
    assert ground.smooth_until(Base(later, sooner), 0.1) == pytest.approx(1.0)


@pytest.mark.parametrize(("ahead", "passed"), [(0.01, 0.5), (0.0002, 0.5008)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_acceleration_exceeds_its_limit_a_little_before_it_does_so_by_the_noise(
    sign, ahead, passed
):
    """It rises to 1 in 1 s past a limit of 0.5; it is 0.501 at 0.501 s."""
    ramp = ground.ground_of(Record.from_samples([0.0, sign], 1.0), 1.0, 1.0)
    found = ground.next_exceedance(ramp, 0.0, -0.5, 0.5, 1e-3, ahead)
    assert found == pytest.approx(passed, abs=1e-12)
