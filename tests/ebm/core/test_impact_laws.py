"""What the impact laws decide: the branches of the wall cascade, the energy cap, and when a block
lies still."""

import math
from collections import Counter

import numpy as np
import pytest
from stepping import changed, run_at, setting_of

from rockcheck.ebm.core.laws import contact_impacts as ci, impacts
from rockcheck.ebm.core.names import CONTACTS, Branch, Contact, Found


def random_strikes(count: int, parting: bool):
    """alpha, phi, case, w1, xdot1, e, mu, no_slip: a corner that comes to the wall, or leaves it
    already."""
    rng = np.random.default_rng(20)
    for _ in range(count):
        alpha, sw = rng.uniform(0.05, 1.0), float(rng.choice([-1, 1]))
        phi = alpha * rng.uniform(0.01, 1.0)
        C = sw * math.cos(alpha + phi)
        w1, xdot1 = rng.normal(0.0, 1.0, 2) * 10.0 ** rng.uniform(-1.0, 1.0, 2)
        if (sw * (xdot1 - C * w1) >= 0.0) != parting:
            w1, xdot1 = -w1, -xdot1
        yield (
            alpha,
            phi,
            sw,
            w1,
            xdot1,
            float(rng.choice([0.0, 1.0, rng.uniform()])),
            rng.uniform(0.0, 1.3),
            bool(rng.integers(0, 2)),
        )


@pytest.mark.parametrize("parting", [False, True], ids=["the corner comes", "the corner leaves"])
def test_each_branch_of_the_wall_cascade(parting):
    """Every branch of Fig. 3 is taken for the reason that it stands for, and gives what its
    equations say.

    A corner that comes leads to A, B and D only: the impulse of the wall grows with the speed at
    which the corner is thrown back. The others are reached where it leaves already.
    """
    seen: Counter[int] = Counter()
    for alpha, phi, sw, w1, xdot1, e, mu, no_slip in random_strikes(4000, parting):
        s, c, cp = math.sin(alpha - phi), math.cos(alpha - phi), math.cos(alpha + phi)
        C = sw * cp
        corner = impacts.Corner(1.0, sw, s, c, C, 0.75, 3.0)
        floor = changed(setting_of(alpha, mu, 0.0), mu_s=mu, no_slip=no_slip)
        branch, w2, xdot2, n, p, v2 = impacts.wall_impact(floor, corner, e, w1, xdot1)
        seen[branch] += 1
        assert n >= 0.0
        # (27): without an impulse of the wall, the pivot held: angular momentum about it stays what
        # it is.
        alone = 0.75 * (w1 / 3.0 - c * xdot1 + s * s * w1)
        leaves = sw * (-c * alone - C * alone)
        if branch == Branch.A_STICK:
            assert sw * (xdot2 - C * w2) == pytest.approx(-e * sw * (xdot1 - C * w1), abs=1e-11)
            assert xdot2 == pytest.approx(-c * w2, abs=1e-12)
        elif branch == Branch.B_STICK:
            assert leaves >= 0.0  # (22)
            assert (w2, xdot2) == pytest.approx((alone, -c * alone), abs=1e-12)
            assert (n, v2) == (0.0, 0.0)
        elif branch == Branch.C_STICK:
            assert leaves < 0.0
            assert (w2, xdot2, v2) == (0.0, 0.0, 0.0)
            assert p == pytest.approx(-s * w1, abs=1e-12)
        else:
            assert branch in (Branch.D_SLIP, Branch.E_SLIP)
            assert not no_slip
            assert p == pytest.approx(s * (w2 - w1), abs=1e-11)
            assert v2 == pytest.approx(xdot2 + c * w2, abs=1e-11)
            q = xdot2 - xdot1 - sw * n
            assert abs(q) == pytest.approx(mu * abs(p), abs=1e-10)
        if branch == Branch.D_SLIP:
            assert sw * (xdot2 - C * w2) == pytest.approx(-e * sw * (xdot1 - C * w1), abs=1e-10)
            assert q * v2 <= 1e-12
        if branch == Branch.E_SLIP:
            assert n == 0.0
            assert xdot2 == pytest.approx(C * w2, abs=1e-10)  # (32): the corner stays on the wall
            # The friction is that of the slip which (30) would have, were it not for its pull of
            # the wall.
            slips = (
                (sr, sy, impacts.wall_slip(corner, e, w1, xdot1, mu * sr * sy))
                for sr in (1, -1)
                for sy in (1, -1)
            )
            sense = next(
                sr * sy
                for sr, sy, (w, x, push, _) in slips
                if push * sy >= -1e-12 and (x + c * w) * sr >= -1e-12
            )
            assert q == pytest.approx(-mu * sense * p, abs=1e-10)
    least = {
        Branch.A_STICK: 20,
        Branch.B_STICK: 20,
        Branch.E_SLIP if parting else Branch.D_SLIP: 500,
    }
    least |= {Branch.C_STICK: 10} if parting else {}
    assert seen.keys() == least.keys()
    assert all(seen[branch] > count for branch, count in least.items()), seen


def work() -> np.ndarray:
    """Scratch for an impact; nothing in it is read before it is written."""
    return np.full((ci.WORK, 6), np.nan)


def rows_of(setting, sense: float, phi: float) -> np.ndarray:
    """The rows of the contacts, and of the floor's tangent."""
    rows = np.empty((7, 3))
    ci.contact_rows(setting, sense, phi, rows)
    return rows


def landing(
    alpha: float, phi: float, mu: float, e: float, v, cap: bool
) -> tuple[np.ndarray, float]:
    """Velocities after a tilted block lands on its corner with restitution e, and the largest
    relative gain of energy."""
    touching = np.zeros(CONTACTS, dtype=bool)
    touching[Contact.FOOT] = True
    after, state = np.array(v), run_at().state
    impact = ci.Impact(1.0, phi, touching, 0.0, 0.0, 1e-9, after)
    assert ci.contact_impact(setting_of(alpha, mu, e, energy_cap=cap), impact, state, work())
    return after, float(state.largest_gain)


def test_no_speed_obeys_friction_that_has_the_levers_of_the_wall():
    """(32) divides by the difference of the two levers."""
    for side in (1.0, -1.0):
        corner = impacts.Corner(side, 1.0, 0.3, 0.8, 0.6, 0.75, 3.0)
        same = side * 0.6 / 0.3
        assert impacts._slips_without_wall(corner, 0.4, 0.2, same)[0] == Branch.NO_BRANCH
        assert impacts._slips_without_wall(corner, 0.4, 0.2, 1.001 * same)[0] == Branch.E_SLIP


def test_an_impact_reads_no_scratch_that_it_has_not_written():
    """Whatever the root search has left there: also impacts whose approach is hardly more than
    rounding."""
    rng = np.random.default_rng(24)
    for _ in range(300):
        alpha, mu, e, resting = (
            rng.uniform(0.1, 1.2),
            rng.uniform(0.05, 1.2),
            rng.uniform(0.0, 1.0),
            1e-9,
        )
        phi = float(rng.choice([0.0, 1e-8, 0.1 * alpha]))
        can = range(CONTACTS) if phi == 0.0 else (Contact.FOOT, Contact.TIP_TOP, Contact.FAR_BOTTOM)
        touching = np.isin(np.arange(CONTACTS), can) & (rng.integers(0, 2, CONTACTS) == 1)
        v = rng.normal(0.0, 0.5, 3) * 10.0 ** rng.uniform(-9.0, 0.0, 3)
        setting = setting_of(alpha, mu, e, energy_cap=bool(rng.integers(0, 2)))
        found = []
        for scratch in (0.0, np.nan, 1e9):
            after, state = v.copy(), run_at().state
            impact = ci.Impact(1.0, phi, touching, e, e, resting, after)
            filled = np.full((ci.WORK, 6), scratch)
            end = ci.contact_impact(setting, impact, state, filled)
            impulses = state.floor_impulse, state.wall_impulse
            found.append((end, *after, *impulses, state.gains, state.largest_gain))
        assert found[0] == found[1] == found[2]


def test_the_floor_takes_friction_within_its_cone():
    """A corner that lands and slips is held by mu times what holds it up, against the slip; one
    that sticks by no more than that."""
    rng = np.random.default_rng(22)
    sticks = slips = 0
    for _ in range(500):
        alpha, mu, e = rng.uniform(0.1, 1.2), rng.uniform(0.05, 1.2), float(rng.choice([0.0, 0.5]))
        phi, v = alpha * rng.uniform(0.05, 0.9), rng.normal(0.0, 0.5, 3)
        rows = rows_of(setting_of(alpha, mu, e), 1.0, phi)
        if rows[Contact.FOOT] @ v > -1e-3:
            continue
        after = landing(alpha, phi, mu, e, v, cap=False)[0]
        along, up = (after - v)[:2]  # of a unit mass
        slip = rows[-1] @ after
        if abs(slip) < 1e-9:
            assert abs(along) <= mu * up + 1e-12
            sticks += 1
        else:
            assert along == pytest.approx(-math.copysign(mu * up, slip), abs=1e-12)
            slips += 1
    assert min(sticks, slips) > 50


def test_the_energy_cap_takes_the_largest_restitution_that_adds_none():
    """Where Newton's restitution adds no energy the cap changes nothing; where it does, a little
    more restitution would add some."""
    rng = np.random.default_rng(21)
    capped = untouched = 0
    for _ in range(3000):
        alpha, mu, e = rng.uniform(0.3, 1.2), rng.uniform(0.2, 1.33), rng.uniform(0.5, 0.99)
        phi = alpha * rng.uniform(0.05, 0.9)
        v = rng.normal(0.0, 0.5, 3)
        row = rows_of(setting_of(alpha, mu, e), 1.0, phi)[Contact.FOOT]
        if row @ v > -1e-3:
            continue
        plain, gain = landing(alpha, phi, mu, e, v, cap=False)
        held, none = landing(alpha, phi, mu, e, v, cap=True)
        if gain == 0.0:
            np.testing.assert_array_equal(held, plain)
            untouched += 1
            continue
        capped += 1
        assert none <= 1e-12
        used = -(row @ held) / (row @ v)
        assert 0.0 < used < e
        np.testing.assert_allclose(
            landing(alpha, phi, mu, used, v, cap=False)[0], held, rtol=0.0, atol=1e-12
        )
        assert landing(alpha, phi, mu, used * (1.0 + 1e-9), v, cap=False)[1] > 0.0
    assert capped > 10
    assert untouched > 1000


def test_the_energy_cap_leaves_an_elastic_impact_as_it_is():
    """A side that strikes an elastic wall keeps its energy but for rounding, which is no gain."""
    touching = np.array([True, True, True, True, False, False])
    rng = np.random.default_rng(23)
    for _ in range(200):
        alpha, mu, v = (
            rng.uniform(0.1, 1.2),
            rng.uniform(0.0, 1.2),
            np.array([-rng.uniform(0.01, 100.0), 0.0, 0.0]),
        )
        plain, held = v.copy(), v.copy()
        for after, cap in ((plain, False), (held, True)):
            impact = ci.Impact(1.0, 0.0, touching, 1.0, 0.0, 1e-9, after)
            block = setting_of(alpha, mu, 0.9, energy_cap=cap)
            assert ci.contact_impact(block, impact, run_at().state, work())
        np.testing.assert_array_equal(held, plain)
        assert plain == pytest.approx(-v, rel=1e-12)


@pytest.mark.parametrize(
    "wall",
    [(Contact.TIP_TOP, Contact.TIP_BOTTOM), (Contact.FAR_BOTTOM, Contact.FAR_TOP)],
    ids=["tip", "far"],
)
def test_floor_first_is_a_trajectory_beside_a_wall_that_stands_farther_off(wall):
    """A block that lands flush, without friction: its corners strike one by one, each as it arrives
    where the wall is a unit away."""
    rng = np.random.default_rng(23)
    both = 0
    for _ in range(400):
        alpha, floor_e, wall_e = rng.uniform(0.1, 1.2), rng.uniform(0.3, 0.9), rng.uniform(0.3, 0.9)
        setting = setting_of(alpha, 0.0, floor_e, impacts="floor-first")
        rows, v, mass = rows_of(setting, 1, 0.0), rng.normal(0.0, 0.5, 3), np.array([1.0, 1.0, 3.0])
        v[0] = math.copysign(v[0], -rows[wall[0], 0])  # toward the wall
        away, struck, after = (
            dict.fromkeys((Contact.FOOT, Contact.OTHER), 0.0) | dict.fromkeys(wall, 1.0),
            [],
            v.copy(),
        )
        if (
            not min(rows[Contact.FOOT] @ v, rows[Contact.OTHER] @ v)
            < -1e-3
            < 1e-3
            < max(rows[Contact.FOOT] @ v, rows[Contact.OTHER] @ v)
        ):
            continue  # one corner lands
        while True:
            rates = {j: float(rows[j] @ after) for j in away}
            coming = {j: away[j] / -rates[j] for j in away if rates[j] < -1e-12}
            if not coming:
                break
            first = min(coming, key=coming.__getitem__)
            away = {j: gap + rates[j] * coming[first] for j, gap in away.items()} | {first: 0.0}
            restitution = floor_e if first in (Contact.FOOT, Contact.OTHER) else wall_e
            after = (
                after
                - (1.0 + restitution)
                * rates[first]
                / (rows[first] @ (mass * rows[first]))
                * mass
                * rows[first]
            )
            struck.append(first)
        touching = np.isin(np.arange(CONTACTS), (Contact.FOOT, Contact.OTHER, *wall))
        found = v.copy()
        if len(struck) < 20:  # of more stages the rest are plastic
            impact = ci.Impact(1.0, 0.0, touching, wall_e, wall_e, 1e-9, found)
            assert ci.contact_impact(setting, impact, run_at().state, work()) == Found.FITS
            np.testing.assert_allclose(found, after, rtol=0.0, atol=1e-9)
            both += set(wall) <= set(struck)
    assert both > 30
