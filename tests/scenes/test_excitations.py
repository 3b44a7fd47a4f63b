"""Excitations: the paper's pulse, sines and records, and how they begin and end."""

import numpy as np
import pytest

from rockcheck.scenes import Record, Rest, Ricker, Sine


def test_ricker_is_the_papers():
    """(34) term by term, its peak 1.00009 a_p at 0.2045 T_p from the centre, and a weak negative
    lobe first."""
    pulse = Ricker(amplitude=6.0, period=0.98)
    t = np.linspace(0.0, 4.0 * pulse.period, 4001)
    q = t - 2.0 * pulse.period
    T = pulse.period
    expected = (
        (6.0 / 1.38)
        * (4 * np.pi**2 * q**2 / (3 * T**2) - 3)
        * (2 * np.pi * q / (np.sqrt(3) * T))
        * np.exp(-2 * np.pi**2 * q**2 / (3 * T**2))
    )
    np.testing.assert_allclose(pulse.acceleration(t), expected, rtol=1e-12, atol=1e-14)
    peak = np.argmax(pulse.acceleration(t))
    assert pulse.acceleration(t)[peak] == pytest.approx(1.00009 * 6.0, rel=1e-5)
    assert abs(q[peak]) == pytest.approx(0.2045 * T, abs=1e-3)
    assert q[peak] < 0.0
    assert np.sign(pulse.acceleration(np.array([0.8 * T]))) == -1.0


def test_symmetric_ricker_peaks_at_its_centre():
    pulse = Ricker(amplitude=-2.0, period=0.5, symmetric=True)
    assert pulse.acceleration(pulse.centre) == pytest.approx(-2.0)
    offset = np.linspace(0.01, 1.0, 50)
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
        Record.from_samples([0.0, 1.0, -2.0, 0.5], time_step=0.1, scale=1.5),
    ],
    ids=lambda excitation: excitation.kind,
)
def test_quiet_before_and_after(excitation):
    after = excitation.quiet_after + np.array([1e-9, 0.1, 10.0])
    np.testing.assert_allclose(excitation.acceleration(after), 0.0, atol=1e-14)
    np.testing.assert_array_equal(excitation.acceleration(np.array([-1e-9, -5.0])), 0.0)


def test_record_is_linear_between_samples():
    record = Record.from_samples([0.0, 1.0, -2.0], time_step=0.1, scale=-2.0)
    np.testing.assert_allclose(
        record.acceleration([0.05, 0.1, 0.15, 0.2]), [-1.0, -2.0, 1.0, 4.0], atol=1e-14
    )
    assert record.peak == pytest.approx(4.0 / 9.80665)
