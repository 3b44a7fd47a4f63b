"""Impacts of random blocks, homogeneous or loaded, against the balances of momentum and the laws of
restitution and friction."""

import math

import numpy as np
import pytest
from stepping import block_of, changed, run_at, setting_of

from rockcheck.ebm.core.laws import contact_impacts as ci, impacts
from rockcheck.ebm.core.names import CONTACTS, Branch, Contact, Landing
from rockcheck.scenes import Block

# --- impacts (physics in units of R, g and the block's mass)


def loaded(rng: np.random.Generator, block: Block) -> Block:
    """The box with its mass somewhere in its middle half, and some moment of inertia."""
    place = (rng.uniform(-0.5, 0.5) * block.half_width, rng.uniform(-0.5, 0.5) * block.half_height)
    return Block(
        **block.model_dump()
        | {
            "centre_of_mass": place,
            "moment_of_inertia": rng.uniform(0.2, 0.6) * block.half_diagonal**2,
        }
    )


def random_floor_impacts(count: int, least: float, most: float, lopsided: bool):
    """A block of box angle between `least` and `most` (a `Setting`), S1, w1, v1, mu_s, mu_k."""
    rng = np.random.default_rng(3)
    for _ in range(count):
        alpha, w1 = rng.uniform(least, most), -rng.uniform(0.01, 1.0)
        block = Block(half_width=math.sin(alpha), half_height=math.cos(alpha))
        block = loaded(rng, block) if lopsided else block
        b = setting_of(block)
        S1 = int(rng.choice([-1, 1]))
        mu_k = rng.uniform(0.0, 0.95 * block.least_painleve_friction if lopsided else 1.3)
        mu_s = mu_k + rng.uniform(0.0, 0.3) * rng.integers(0, 2)
        yield b, S1, S1 * w1, rng.choice([0.0, rng.normal(0.0, 0.3)]), mu_s, mu_k


@pytest.mark.parametrize("lopsided", [False, True], ids=["homogeneous", "loaded"])
@pytest.mark.parametrize(("least", "most"), [(0.02, 0.6), (0.6, 1.2)], ids=["slender", "squat"])
def test_floor_impact_balances_momentum(least, most, lopsided):
    """Vertical, horizontal and angular momentum about the mass's centre, Coulomb's law, and a block
    that turns onto its new pivot.

    Squat blocks: where sticking asks for more friction than there is, and slipping cannot turn the
    block, it lands flat.
    """
    forms = set()
    for b, S1, w1, v1, mu_s, mu_k in random_floor_impacts(2000, least, most, lopsided):
        form, w2, v2, p = impacts.floor_impact(b, S1, w1, v1, mu_s, mu_k)
        S2, c = -S1, b.height
        s1, s2 = (b.left.arm, b.right.arm) if S1 > 0 else (b.right.arm, b.left.arm)
        forms.add(form)
        if form == Landing.FLAT_END:
            xdot1 = v1 - c * w1
            assert w2 == 0.0
            assert abs(v2) == pytest.approx(
                max(0.0, abs(xdot1) - mu_k * p) if abs(xdot1) > mu_s * p else 0.0, abs=1e-14
            )
            assert p == pytest.approx(s1 * abs(w1), abs=1e-15)
            continue
        q = (v2 - c * w2) - (v1 - c * w1)
        assert p == pytest.approx(S2 * s2 * w2 - S1 * s1 * w1, abs=1e-14)
        assert (w2 - w1) / b.spin == pytest.approx(-S2 * s2 * p + c * q, abs=1e-14)
        assert S2 * w2 >= 0.0
        if form == Landing.HELD_FAST:
            assert v2 == 0.0
            if mu_s == mu_k:
                assert abs(q) <= mu_s * p * (1.0 + 1e-12)
        else:
            assert q == pytest.approx(-math.copysign(mu_k, v2) * p, abs=1e-14)
    assert forms == {Landing.HELD_FAST, Landing.SLID, Landing.FLAT_END}


@pytest.mark.parametrize("alpha", [0.1, 0.25, 0.5])
def test_floor_impact_sticks_above_its_friction(alpha):
    """Without slip before, the impact sticks from mu = 3 t/(4 + t^2) on, t = tan(alpha)."""
    t, b = math.tan(alpha), setting_of(alpha)
    limit = 3.0 * t / (4.0 + t * t)
    assert (
        impacts.floor_impact(b, 1, -0.5, 0.0, limit + 1e-12, limit + 1e-12)[0] == Landing.HELD_FAST
    )
    assert impacts.floor_impact(b, 1, -0.5, 0.0, limit - 1e-12, limit - 1e-12)[0] == Landing.SLID


@pytest.mark.parametrize("lopsided", [False, True], ids=["homogeneous", "loaded"])
def test_wall_impact_balances_momentum(lopsided):
    """The cascade of Fig. 3 at 4,000 random blocks and approaches: momentum, restitution, Coulomb's
    law, no pull of the wall."""
    rng = np.random.default_rng(4)
    branches = set()
    for _ in range(4000):
        alpha = rng.uniform(0.05, 0.9)
        phi = alpha * rng.uniform(0.01, 1.0)
        s, c, cp, spin = math.sin(alpha - phi), math.cos(alpha - phi), math.cos(alpha + phi), 3.0
        if lopsided:
            s, c, cp, spin = (
                s * rng.uniform(0.5, 1.0),
                c * rng.uniform(0.5, 1.0),
                cp * rng.uniform(0.5, 1.5),
                rng.uniform(2.0, 5.0),
            )
        share = 1.0 / (1.0 / spin + s * s + c * c)
        S, Sw = (float(rng.choice([-1, 1])) for _ in range(2))
        C = S * Sw * cp
        w1, xdot1 = rng.normal(0.0, 1.0, 2)
        if rng.integers(0, 2):
            xdot1 = -c * w1  # the pivot sticks before
        if Sw * (xdot1 - C * w1) >= 0.0:
            w1, xdot1 = -w1, -xdot1
        e, mu_k = rng.choice([0.0, 1.0, rng.uniform()]), rng.uniform(0.0, 1.2)
        corner = impacts.Corner(S, Sw, s, c, C, share, spin)
        floor = changed(setting_of(alpha), mu_s=mu_k, mu_k=mu_k)
        branch, w2, xdot2, n, p, v2 = impacts.wall_impact(floor, corner, e, w1, xdot1)
        branches.add(branch)
        assert n >= 0.0
        approach, parting = xdot1 - C * w1, xdot2 - C * w2
        assert Sw * parting >= -1e-13
        if branch == Branch.C_STICK:
            assert (w2, xdot2, v2) == (0.0, 0.0, 0.0)
            continue
        assert p == pytest.approx(S * s * (w2 - w1), abs=1e-13)
        assert v2 == pytest.approx(xdot2 + c * w2, abs=1e-13)
        q = xdot2 - xdot1 - Sw * n
        if branch != Branch.E_SLIP:  # whose moment is not balanced: the paper's rule
            assert (w2 - w1) / spin == pytest.approx(-S * s * p + c * q - C * Sw * n, abs=1e-12)
        if branch in (Branch.A_STICK, Branch.D_SLIP):
            assert parting == pytest.approx(-e * approach, abs=1e-12)
        if branch == Branch.A_STICK:
            assert v2 == pytest.approx(0.0, abs=1e-13)
            assert abs(q) <= mu_k * abs(p) + 1e-12
        if branch in (Branch.D_SLIP, Branch.E_SLIP):
            assert abs(q) == pytest.approx(mu_k * abs(p), abs=1e-12)
            assert q * v2 <= 1e-13
    assert {Branch.A_STICK, Branch.D_SLIP} <= branches
    assert Branch.NO_BRANCH not in branches


@pytest.mark.parametrize("lopsided", [False, True], ids=["homogeneous", "loaded"])
@pytest.mark.parametrize("e", [0.0, 0.5])
def test_contact_impact_leaves_no_approach(e, lopsided):
    """Unilateral impacts at 1,000 random states: no touched contact still closes, and without
    restitution no energy is gained."""
    rng = np.random.default_rng(5)
    for _ in range(1000):
        alpha = rng.uniform(0.05, 0.9)
        block = loaded(rng, block_of(alpha)) if lopsided else block_of(alpha)
        b = setting_of(
            block,
            friction=rng.uniform(0.0, min(1.2, 0.95 * block.least_painleve_friction)),
            restitution=e,
        )
        flat, sense = bool(rng.integers(0, 2)), 1.0 if not lopsided or rng.integers(0, 2) else -1.0
        phi = 0.0 if flat else alpha * rng.uniform(0.01, 0.9)
        touching = np.zeros(CONTACTS, dtype=bool)
        touching[Contact.FOOT] = True
        touching[Contact.OTHER] = flat
        touching[Contact.TIP_TOP] = rng.integers(0, 2)
        touching[Contact.TIP_BOTTOM] = flat and touching[Contact.TIP_TOP]
        v = rng.normal(0.0, 0.3, 3)
        before = ci.kinetic_energy(b.spin, v)
        state, work = run_at().state, np.full((ci.WORK, 6), np.nan)
        assert ci.contact_impact(b, ci.Impact(sense, phi, touching, e, e, 1e-9, v), state, work)
        rows = np.empty((7, 3))
        ci.contact_rows(b, sense, phi, rows)
        speeds = rows[:6] @ v
        assert np.all(speeds[touching] >= -1e-8)
        assert min(state.floor_impulse, state.wall_impulse) >= 0.0
        if e == 0.0:
            assert ci.kinetic_energy(b.spin, v) <= before * (1.0 + 1e-12)
        if ci.kinetic_energy(b.spin, v) > before * (1.0 + 1e-9):
            assert state.gains > 0  # whatever gains energy is counted
