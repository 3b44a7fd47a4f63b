"""Excitations: the paper's pulse, sines and records, how they begin and end, and how strong a
recorded motion is."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import cont2discrete, lfilter

from rockcheck.scenes import Cosine, HalfSine, Record, Rest, Ricker, Sine, Wavelet
from rockcheck.scenes.recordings import intensity
from rockcheck.scenes.recordings.recording import Recording


def test_ricker_is_the_papers():
    """(34) term by term, its peak 1.00009 a_p at 0.2045 T_p from the centre, and a weak negative
    lobe first."""
    pulse, T = Ricker(amplitude=6.0, period=0.98), 0.98
    t = np.linspace(0.0, 4.0 * T, 4001)
    q = t - 2.0 * T
    expected = (
        (6.0 / 1.38)
        * (4 * np.pi**2 * q**2 / (3 * T**2) - 3)
        * (2 * np.pi * q / (np.sqrt(3) * T))
        * np.exp(-2 * np.pi**2 * q**2 / (3 * T**2))
    )
    np.testing.assert_allclose(pulse.acceleration(t), expected, rtol=1e-12, atol=1e-14)
    peak = np.argmax(expected)
    assert expected[peak] == pytest.approx(1.00009 * 6.0, rel=1e-5)
    assert q[peak] == pytest.approx(-0.2045 * T, abs=1e-3)
    assert pulse.acceleration(0.8 * T) < 0.0


def test_symmetric_ricker_peaks_at_its_centre():
    pulse, offset = Ricker(amplitude=-2.0, period=0.5, symmetric=True), np.linspace(0.01, 1.0, 50)
    assert pulse.acceleration(pulse.centre) == pytest.approx(-2.0)
    np.testing.assert_allclose(
        pulse.acceleration(1.0 + offset), pulse.acceleration(1.0 - offset), rtol=1e-12, atol=1e-15
    )


@pytest.mark.parametrize(
    "excitation",
    [
        Rest(),
        Ricker(amplitude=6.0, period=0.98),
        Ricker(amplitude=6.0, period=0.98, symmetric=True),
        Sine(amplitude=2.0, period=0.5, cycles=3),
        Cosine(amplitude=2.0, period=0.5, cycles=3),
        HalfSine(amplitude=2.0, period=0.5),
        Wavelet(amplitude=2.0, period=0.5, gamma=1.7, phase=0.4),
        Record.from_samples([0.0, 1.0, -2.0, 0.5], time_step=0.1, scale=1.5),
    ],
    ids=lambda excitation: excitation.kind,
)
def test_quiet_before_and_after(excitation):
    after = excitation.quiet_after + np.array([1e-9, 0.1, 10.0])
    np.testing.assert_allclose(excitation.acceleration(after), 0.0, atol=1e-14)
    np.testing.assert_array_equal(excitation.acceleration(np.array([-1e-9, -5.0])), 0.0)


def velocity_after(pulse):
    """The base's velocity at a pulse's end, by quadrature."""
    return quad(pulse.acceleration, 0.0, pulse.quiet_after, epsabs=1e-13, limit=200)[0]


def test_a_half_sine_leaves_the_base_moving():
    """Housner's pulse: a T/pi, with T twice the pulse's length."""
    assert velocity_after(HalfSine(amplitude=3.0, period=0.8)) == pytest.approx(2.4 / math.pi)


@pytest.mark.parametrize("gamma", [1.2, 2.0, 3.7])
@pytest.mark.parametrize("phase", [0.0, 0.6, math.pi / 2])
def test_the_wavelet_is_the_rate_of_its_velocity(gamma, phase):
    """Mavroeidis and Papageorgiou's velocity, differentiated by central differences."""
    pulse, step = Wavelet(amplitude=4.0, period=0.9, gamma=gamma, phase=phase), 1e-5
    omega = 2.0 * math.pi / 0.9

    def velocity(t):
        turn = omega * (t - 0.45 * gamma)
        return 4.0 / omega / 2.0 * (1.0 + np.cos(turn / gamma)) * np.cos(turn + phase)

    t = np.linspace(0.01, pulse.quiet_after - 0.01, 200)
    rates = (velocity(t + step) - velocity(t - step)) / (2.0 * step)
    np.testing.assert_allclose(pulse.acceleration(t), rates, atol=1e-7)


def test_the_wavelet_brings_the_base_to_rest():
    assert velocity_after(Wavelet(amplitude=4.0, period=0.9, gamma=2.3, phase=0.5)) == (
        pytest.approx(0.0, abs=1e-12)
    )


@pytest.mark.parametrize(
    ("pulse", "extremes"),
    [
        (Rest(), (0.0, 0.0)),
        (Sine(amplitude=-2.0, period=0.5), (-2.0, 2.0)),
        (Cosine(amplitude=2.0, period=0.5), (-2.0, 2.0)),
        (HalfSine(amplitude=2.0, period=0.5), (0.0, 2.0)),
        (HalfSine(amplitude=-2.0, period=0.5), (-2.0, 0.0)),
        (Record.from_samples([1.0, -2.0, 0.5], time_step=0.1, scale=1.5), (-3.0, 1.5)),
    ],
    ids=str,
)
def test_extremes(pulse, extremes):
    assert pulse.extremes == extremes


def test_record_is_linear_between_samples_of_one_column(fault_of):
    record = Record.from_samples([0.0, 1.0, -2.0], time_step=0.1, scale=-2.0)
    np.testing.assert_allclose(
        record.acceleration([0.05, 0.1, 0.15, 0.2]), [-1.0, -2.0, 1.0, 4.0], atol=1e-14
    )
    assert record.peak == pytest.approx(4.0 / 9.80665)
    assert (
        fault_of(Record.from_samples, [[0.0, 1.0], [0.1, -2.0]], time_step=0.1).key == "unscaled.0"
    )


# --- how strong a recorded motion is, against closed forms

G = 9.80665


def test_intensities_of_a_sine_are_its_closed_forms():
    """a = A sin(w t) over ten cycles: PGV 2 A/w from rest, Arias pi/(2 g) A^2 T/2; resonance builds
    up as 1 - exp(-z w t)."""
    amplitude, rate, step = 2.0, 2 * math.pi, 1e-3
    samples = amplitude * np.sin(rate * step * np.arange(10_001))
    record = Recording(samples=samples, time_step=step, unit="m/s2", form="CSV")
    assert intensity.peak_acceleration(record) == pytest.approx(amplitude / G, rel=1e-9)
    assert intensity.peak_velocity(record) == pytest.approx(2 * amplitude / rate, rel=1e-5)
    assert intensity.arias(record) == pytest.approx(
        math.pi / (2 * G) * amplitude**2 * 5.0, rel=1e-5
    )
    assert intensity.spectral_acceleration(record, 1.0) == pytest.approx(
        amplitude / G / (2 * 0.05) * (1 - math.exp(-0.05 * rate * 10.0)), rel=0.01
    )
    assert intensity.spectral_acceleration(record, 0.01) == pytest.approx(amplitude / G, rel=0.01)


def test_intensities_are_those_of_the_straight_lines_between_samples():
    """Samples four periods apart, or all motion in one: as of the same lines with samples 4000
    times as dense. Before the first and after the last the base stands."""
    samples = np.array([0.8, 1.0, -0.5, 0.6])
    lines = np.interp(np.arange(12_001) / 4000, np.arange(4), samples)
    coarse, dense = (
        [
            intensity.peak_velocity(record),
            *(intensity.spectral_acceleration(record, period) for period in (0.2, 1.0, 2.5)),
        ]
        for record in (
            Recording(samples=samples, time_step=4.0, unit="m/s2", form="CSV"),
            Recording(samples=lines, time_step=1e-3, unit="m/s2", form="CSV"),
        )
    )
    assert coarse == pytest.approx(dense, rel=2e-3)
    # A push of a step's length is, to an oscillator of a far longer period, an impulse; the peak
    # comes a quarter of a period later.
    last = Recording(samples=np.ones(2), time_step=1e-8, unit="m/s2", form="CSV")
    rate, damping = 2 * math.pi / 1.0, 0.05
    peak = rate * 1e-8 * math.exp(-damping / math.sqrt(1 - damping**2) * math.acos(damping))
    assert intensity.spectral_acceleration(last, 1.0) == pytest.approx(peak / G, rel=2e-3)


@pytest.mark.parametrize("damping", [0.02, 0.05, 0.5])
def test_a_base_that_is_set_in_motion_overshoots_as_its_damping_lets_it(damping):
    step = Recording(samples=np.ones(2000), time_step=1e-3, unit="m/s2", form="CSV")
    assert intensity.spectral_acceleration(step, 0.5, damping) * G == pytest.approx(
        1.0 + math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2)), rel=1e-4
    )


@pytest.mark.parametrize("period", [0.05, 0.4, 3.0])
def test_the_oscillator_is_that_of_scipys_first_order_hold(period):
    samples, parts = np.pad(np.random.default_rng(3).normal(size=38), 1), math.ceil(0.8 / period)
    rate = math.tau / period
    record = Recording(samples=samples, time_step=0.01, unit="m/s2", form="CSV")
    above, below, _ = cont2discrete(([rate**2], [1.0, 0.2 * rate, rate**2]), 0.01 / parts, "foh")
    ground = np.interp(np.arange(39 * parts + 1) / parts, np.arange(40), samples)
    assert intensity.spectral_acceleration(record, period, 0.1) * G == pytest.approx(
        np.max(np.abs(lfilter(np.ravel(above), below, np.r_[ground, np.zeros(320)]))), rel=1e-9
    )


def test_periods_of_a_spectrum_leave_no_wide_gap():
    for one, other in pairwise(intensity.PERIODS):
        assert one < other <= 2.0 * one
    assert intensity.PERIODS[0] <= 0.1 < 4.0 <= intensity.PERIODS[-1]


@pytest.mark.parametrize("amplitude", [2.0, 0.731])
def test_the_largest_acceleration_of_a_symmetric_pulse_is_its_amplitude(amplitude):
    _, largest = Ricker(amplitude=amplitude, period=0.7, symmetric=True).extremes
    assert largest == amplitude


def test_the_extremes_of_an_antisymmetric_pulse_are_equal_and_opposite():
    least, largest = Ricker(amplitude=1.3, period=0.7).extremes
    assert largest == pytest.approx(-least, rel=1e-15)


@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("period", [0.2, 5.0])
def test_a_ricker_pulse_is_quiet_where_nothing_is_left_of_it_and_not_long_before(symmetric, period):
    pulse = Ricker(amplitude=1.0, period=period, symmetric=symmetric)
    before = pulse.centre + 0.9 * (pulse.quiet_after - pulse.centre)
    assert abs(float(pulse.acceleration(pulse.quiet_after))) < 1e-16
    assert abs(float(pulse.acceleration(before))) > 1e-16


# The peak of a record


def test_a_record_is_scaled_to_a_peak_in_standard_gravity():
    record = Record(unscaled=(0.0, 1.0, -4.0), time_step=0.1, pga=0.5)
    assert record.samples.tolist() == pytest.approx([0.0, 0.125 * 9.80665, -0.5 * 9.80665])
    assert record.peak == pytest.approx(0.5)


def test_a_record_that_does_not_move_has_no_peak(fault_of):
    fault = fault_of(Record, unscaled=(0.0, 0.0), time_step=0.1, pga=0.5)
    assert "does not move" in str(fault)


@pytest.mark.parametrize("pga", [0.0, -0.1, 1000.1, True, "0.5"])
def test_a_peak_is_a_number_above_zero(pga, fault_of):
    assert "a number above 0" in str(fault_of(Record, unscaled=(1.0,), time_step=0.1, pga=pga))


def test_the_largest_peak_is_a_thousand_times_gravity():
    assert Record(unscaled=(2.0,), time_step=0.1, pga=1000.0).peak == pytest.approx(1000.0)


def test_a_record_tells_of_periods_from_two_steps_to_its_duration():
    record = Recording(samples=np.ones(6), time_step=0.02, unit="m/s2", form="CSV")
    assert intensity.resolved_periods(record) == pytest.approx((0.04, 0.1))
