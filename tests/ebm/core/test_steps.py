"""The length of a step: at its end the motion is that of an independent integration. Natural units,
a block of 0.3 rad."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from stepping import ROCKS, run_at, setting_of

from rockcheck.ebm.core import coulomb, motion, series
from rockcheck.ebm.core.ground import acceleration, ground_of
from rockcheck.ebm.core.names import Family, Pivot
from rockcheck.ebm.core.state import Base
from rockcheck.scenes import Rest, Ricker, Sine

ALPHA, TOLERANCE = 0.3, 1e-10
STILL = ground_of(Rest(), 1.0, 1.0)
PULSE = ground_of(Ricker(amplitude=0.6, period=2.0), 1.0, 1.0)


def first_step(base, start, mode, t):
    """The motion at the end of a step that nothing else ends, and its length."""
    block, run = setting_of(ALPHA, 0.2), run_at(start, t=t, **mode)
    state, ratio = run.state, TOLERANCE ** (1.0 / series.ORDER)
    state.tolerance_rad = TOLERANCE * ALPHA
    state.last_term_rad = 0.5 * state.tolerance_rad * (1.0 - ratio) / ratio
    coulomb.expand(block, base, run, 50.0)
    motion.motion_at(block, state, run.a, state.length, state.sampled)
    return state.sampled, state.length


@pytest.mark.parametrize("early", [1.0, 0.3, -0.4])
def test_a_flat_block_slides_as_friction_and_the_base_accelerate_it(early):
    """x'' = mu - u while it slides to the left."""
    t = PULSE.form.centre - early
    mode = {"family": Family.FLAT, "sense": 1, "pivot": Pivot.SLIPPING, "slip": -1, "pull": 1}
    end, length = first_step(
        Base(PULSE, STILL), (0.1, math.cos(ALPHA), 0.0, -5.0, 0.0, 0.0), mode, t
    )
    moved, _ = quad(lambda s: (length - s) * (0.2 - acceleration(PULSE, t + s)), 0.0, length)
    assert 0.05 < length < 5.0
    assert end.x == pytest.approx(0.1 - 5.0 * length + moved, abs=1e-9)


@pytest.mark.parametrize("upward", [STILL, ground_of(Sine(amplitude=0.4, period=0.9), 1.0, 1.0)])
def test_a_block_rocks_as_its_moments_turn_it(upward):
    """theta'' = 3/4 (u c - (1 + vertical) s) about the pivot."""
    t, tilt, rate = PULSE.form.centre - 0.3, 0.1, 0.05
    s, c = math.sin(ALPHA - tilt), math.cos(ALPHA - tilt)
    start = (s - math.sin(ALPHA), c, tilt, -c * rate, s * rate, rate)
    end, length = first_step(Base(PULSE, upward), start, ROCKS | {"sense": 1}, t)

    def turns(tau, state):
        angle, gravity = ALPHA - state[0], 1.0 + acceleration(upward, t + tau)
        push = acceleration(PULSE, t + tau)
        return [state[1], 0.75 * (push * math.cos(angle) - gravity * math.sin(angle))]

    exact = solve_ivp(turns, (0.0, length), [tilt, rate], "DOP853", rtol=1e-12, atol=1e-13)
    assert 0.05 < length < 5.0
    np.testing.assert_allclose([end.theta, end.w], exact.y[:, -1], rtol=0.0, atol=1e-9)
