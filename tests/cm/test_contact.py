"""The contact law: closed forms against the integrated contact."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rockcheck.cm.contact_law import (
    damping_ratio,
    damping_ratio_of_paper,
    felt_share,
    least_restitution,
    normal_forces,
    restitution_of,
)
from rockcheck.cm.friction import friction_force
from rockcheck.cm.impacts import effective_mass


def integrated_restitution(xi: float) -> float:
    """Rebound over impact speed of a unit mass on a clamped unit spring with damping ratio xi."""

    def force_gone(_t, q):
        return q[0] + 2.0 * xi * q[1]

    force_gone.terminal, force_gone.direction = True, -1
    return -solve_ivp(
        lambda _t, q: [q[1], -q[0] - 2.0 * xi * q[1]],
        (0.0, 50.0),
        [0.0, 1.0],
        events=force_gone,
        rtol=1e-11,
        atol=1e-13,
    ).y_events[0][0][1]


@pytest.mark.parametrize(
    "xi", [0.05, 0.3, 0.7072, 0.95, 1.0 - 2e-6, 1.0 - 5e-7, 1.0, 1.05, 3.0, 6.9]
)
def test_restitution_of_clamped_contact_is_the_integrated_one(xi):
    assert restitution_of(xi) == pytest.approx(integrated_restitution(xi), rel=1e-8)


@pytest.mark.parametrize("e", [0.005, 0.05, 0.25, 0.5, 0.75, 0.99, 1.0])
def test_damping_ratio_inverts_restitution(e):
    assert restitution_of(damping_ratio(e, 1e-4)) == pytest.approx(e, abs=1e-10)
    assert restitution_of(damping_ratio(0.0, 0.01 * e * e)) == pytest.approx(0.01 * e * e, rel=1e-6)


def test_the_least_restitution_vanishes_with_the_length_of_a_contact():
    """Four times as stiff, half as long: so a study of the step finds it."""
    assert [least_restitution(k, 2.0) for k in (4e8, 1e8)] == pytest.approx([1e-4, 2e-4])
    assert least_restitution(1e-3, 2.0) == 1.0
    assert damping_ratio(0.0, least_restitution(1e-3, 2.0)) == 0.0
    assert restitution_of(damping_ratio_of_paper(0.0)) == pytest.approx(math.exp(-2.0), rel=1e-12)


@pytest.mark.parametrize("e", [0.25, 0.5, 0.75, 1.0])
def test_damping_ratio_of_paper_suits_the_contact_that_may_pull(e):
    xi = damping_ratio_of_paper(e)
    assert math.exp(-math.pi * xi / math.sqrt(1.0 - xi * xi)) == pytest.approx(
        e, rel=1e-12
    )  # after half a damped wave
    assert restitution_of(xi) >= e  # so the clamped contact rebounds faster


@pytest.mark.parametrize("one", [2.0, -2.0])
@pytest.mark.parametrize("other", [3.0, -3.0])
def test_normal_forces_only_push(one, other):
    pushes = (max(one, 0.0), max(other, 0.0))
    assert normal_forces(one, other, 0.0, 0.0, 1.2, 0.8, 0.8, 1.2) == pushes


def test_normal_forces_feel_each_other():
    free, dampings, mobilities = np.array([2.0, 3.0]), [0.4, 0.7], [[1.2, 0.8], [0.5, 1.3]]
    forces = np.array(normal_forces(*free, *dampings, *np.ravel(mobilities)))
    assert forces + dampings * (mobilities @ forces) == pytest.approx(free)
    assert normal_forces(0.1, 9.0, *dampings, *np.ravel(mobilities)) == (
        0.0,
        pytest.approx(9.0 / (1.0 + 0.7 * 1.3)),
    )


@pytest.mark.parametrize("x", [0.01, 0.3, 2.0, 100.0])
def test_damper_stops_a_corner_without_overshoot(x):
    c, mobility, step, speed = x / 2e-3, 2.0, 1e-3, -0.4
    force, _ = normal_forces(
        -c * speed, 0.0, felt_share(x) * c * step, 0.0, mobility, 0.0, 0.0, mobility
    )
    assert speed + step * mobility * force == pytest.approx(speed / (1.0 + x + 0.5 * x * x))


@pytest.mark.parametrize(
    ("stretch", "holds", "force", "slips"),
    [
        (0.04, 0.5, -4.0, False),
        (0.04, 0.3, -3.0, True),
        (-0.06, 0.5, 3.0, True),
        (0.02, 0.3, -2.0, False),
    ],
)
def test_friction_sticks_up_to_static_and_slips_at_kinetic_friction(stretch, holds, force, slips):
    law = {"stiffness": 100.0, "damping": 0.0, "mobility": 0.0, "mu_k": 0.3, "normal": 10.0}
    expected = (pytest.approx(force), slips)
    assert friction_force(stretch=stretch, holds=holds, rate=0.0, **law) == expected


def push_of_impact(k_n, k_t, k_c, normal, tangential, mu, e):
    """Push of the rigid impact with Newton's restitution by sweeping (Gauss-Seidel) over the two
    unknown impulses."""
    push = shear = 0.0
    for _ in range(500):
        push = max(0.0, (-(1.0 + e) * normal - k_c * shear) / k_n)
        shear = min(max(-(tangential + k_c * push) / k_t, -mu * push), mu * push)
    return push


@pytest.mark.parametrize("sliding", [0.0, 50.0, -50.0])
@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3, 1.0])
@pytest.mark.parametrize("k_c", [-0.7, 0.0, 0.7])
def test_effective_mass_is_the_impulse_of_the_rigid_impact(mu, k_c, sliding):
    k_n, k_t, e = 1.2, 3.8, 0.5
    impact = (k_n, k_t, k_c, -1.0, sliding, mu, e)
    mass = effective_mass(*impact[:6], mu, e)
    assert mass == pytest.approx(push_of_impact(*impact) / (1.0 + e), rel=1e-9)
    assert not sliding or mass == pytest.approx(1.0 / (k_n - math.copysign(mu, sliding) * k_c))


@pytest.mark.parametrize(("mu", "slips"), [(0.34, True), (0.36, False)])
def test_a_corner_that_slides_as_it_arrives_slips_where_the_impact_cannot_hold_it(mu, slips):
    k_n, k_t, k_c = 1.2, 3.8, 0.7
    held = 1.0 / (k_n - k_c * k_c / k_t)
    mass = effective_mass(k_n, k_t, k_c, -1.0, 1.0, mu, mu, 0.5)
    assert mass == pytest.approx(1.0 / (k_n - mu * k_c) if slips else held)
