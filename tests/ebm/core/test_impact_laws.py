"""Impacts of random blocks, homogeneous or loaded, against the balances of momentum and the laws of
restitution and friction. Units of R, g and the block's mass."""

import math
from collections import Counter

import numpy as np
import pytest
from stepping import block_of, run_at, setting_of

from rockcheck.ebm.core import contact_impacts as ci, contact_sets, impacts
from rockcheck.ebm.core.impacts import Branch, Landing
from rockcheck.ebm.core.names import Contact
from rockcheck.scenes import Block

approx = pytest.approx
lopsided_or_not = pytest.mark.parametrize("lopsided", [False, True], ids=["homogeneous", "loaded"])


def loaded(rng: np.random.Generator, block: Block) -> Block:
    """The box with its mass somewhere in its middle half, and some moment of inertia."""
    return block.replace(
        centre_of_mass=(
            rng.uniform(-0.5, 0.5) * block.half_width,
            rng.uniform(-0.5, 0.5) * block.half_height,
        ),
        moment_of_inertia=rng.uniform(0.2, 0.6) * block.half_diagonal**2,
    )


def random_floor_impacts(count: int, least: float, most: float, lopsided: bool):
    """A block of box angle between `least` and `most` (a `Setting`), S1, w1, v1, mu_s, mu_k."""
    rng = np.random.default_rng(3)
    for _ in range(count):
        block, w1 = block_of(rng.uniform(least, most)), -rng.uniform(0.01, 1.0)
        block = loaded(rng, block) if lopsided else block
        S1 = int(rng.choice([-1, 1]))
        mu_k = rng.uniform(0.0, 0.95 * block.least_painleve_friction if lopsided else 1.3)
        mu_s = mu_k + rng.uniform(0.0, 0.3) * rng.integers(0, 2)
        yield setting_of(block), S1, S1 * w1, rng.choice([0.0, rng.normal(0.0, 0.3)]), mu_s, mu_k


@lopsided_or_not
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
            speed = abs(v1 - c * w1)
            slides = max(0.0, speed - mu_k * p) if speed > mu_s * p else 0.0
            assert w2 == 0.0
            assert abs(v2) == approx(slides, abs=1e-14)
            assert p == approx(s1 * abs(w1), abs=1e-15)
            continue
        q = (v2 - c * w2) - (v1 - c * w1)
        assert p == approx(S2 * s2 * w2 - S1 * s1 * w1, abs=1e-14)
        assert (w2 - w1) / b.spin == approx(-S2 * s2 * p + c * q, abs=1e-14)
        assert S2 * w2 >= 0.0
        if form == Landing.SLID:
            assert q == approx(-math.copysign(mu_k, v2) * p, abs=1e-14)
        else:
            assert v2 == 0.0
            assert mu_s != mu_k or abs(q) <= mu_s * p * (1.0 + 1e-12)
    assert forms == {Landing.HELD_FAST, Landing.SLID, Landing.FLAT_END}


@pytest.mark.parametrize(
    ("more", "form"),
    [(1e-12, Landing.HELD_FAST), (-1e-14, Landing.HELD_FAST), (-1e-12, Landing.SLID)],
)
@pytest.mark.parametrize("alpha", [0.1, 0.25, 0.5])
def test_floor_impact_sticks_above_its_friction(alpha, more, form):
    """And where it has as much to rounding."""
    t, b = math.tan(alpha), setting_of(alpha)
    mu = 3.0 * t / (4.0 + t * t) + more
    assert impacts.floor_impact(b, 1, -0.5, 0.0, mu, mu)[0] == form


def random_strikes(count: int, parting: bool, lopsided: bool):
    """A corner that comes to the wall, or leaves it already; e, w1, xdot1, mu, no_slip."""
    rng = np.random.default_rng(20)
    for _ in range(count):
        alpha = rng.uniform(0.05, 0.9)
        phi = alpha * rng.uniform(0.01, 1.0)
        s, c, cp = math.sin(alpha - phi), math.cos(alpha - phi), math.cos(alpha + phi)
        (s, c, cp), spin = (
            (
                np.array([s, c, cp]) * rng.uniform([0.5, 0.5, 0.5], [1.0, 1.0, 1.5]),
                rng.uniform(2, 5),
            )
            if lopsided
            else ((s, c, cp), 3.0)
        )
        S, Sw = (float(rng.choice([-1, 1])) for _ in range(2))
        C, (w1, xdot1) = S * Sw * cp, rng.normal(0.0, 1.0, 2)
        if not parting and rng.integers(0, 2):
            xdot1 = -c * w1  # the pivot sticks before
        if (Sw * (xdot1 - C * w1) >= 0.0) != parting:
            w1, xdot1 = -w1, -xdot1
        yield (
            impacts.Corner(S, Sw, s, c, C, 1.0 / (1.0 / spin + s * s + c * c), spin),
            float(rng.choice([0.0, 1.0, rng.uniform()])),
            w1,
            xdot1,
            rng.uniform(0.0, 1.3),
            bool(rng.integers(0, 2)),
        )


@lopsided_or_not
@pytest.mark.parametrize("parting", [False, True], ids=["the corner comes", "the corner leaves"])
def test_each_branch_of_the_wall_cascade(parting, lopsided):
    """Every branch of Fig. 3 is taken for the reason that it stands for: momentum, restitution,
    Coulomb's law, no pull of the wall.

    A corner that comes leads to A, B and D only: the impulse of the wall grows with the speed at
    which the corner is thrown back. The others are reached where it leaves already.
    """
    seen: Counter[int] = Counter()
    for corner, e, w1, xdot1, mu, no_slip in random_strikes(4000, parting, lopsided):
        S, Sw, s, c, C, share, spin = corner
        branch, w2, xdot2, n, p, v2 = impacts.wall_impact(
            setting_of(0.4, mu, friction="no-slip" if no_slip else "coulomb"), corner, e, w1, xdot1
        )
        seen[branch] += 1
        assert n >= 0.0
        # (27): without an impulse of the wall, the pivot held: angular momentum about it stays what
        # it is.
        alone = share * (w1 / spin - c * xdot1 + s * s * w1)
        leaves = Sw * (-c * alone - C * alone)
        if branch == Branch.C_STICK:
            assert leaves < 0.0
            wall, floor = (approx(one, abs=1e-12) for one in (max(0.0, -Sw * xdot1), -S * s * w1))
            assert w2 == 0.0
            assert xdot2 == 0.0
            assert v2 == 0.0
            assert n == wall
            assert p == floor
            continue
        q, leaving = xdot2 - xdot1 - Sw * n, xdot2 - C * w2
        size = max(1.0, abs(w2))  # a pivot that is held may be thrown about
        assert parting or Sw * leaving >= -1e-13
        assert p == approx(S * s * (w2 - w1), abs=1e-13 * size)
        assert v2 == approx(xdot2 + c * w2, abs=1e-13 * size)
        if branch != Branch.E_SLIP:  # whose moment is not balanced: the paper's rule
            assert (w2 - w1) / spin == approx(-S * s * p + c * q - C * Sw * n, abs=1e-12 * size)
        if branch in (Branch.A_STICK, Branch.D_SLIP):
            assert leaving == approx(-e * (xdot1 - C * w1), abs=1e-12 * size)
        if branch == Branch.A_STICK:
            assert xdot2 == approx(-c * w2, abs=1e-12)
            assert v2 == approx(0.0, abs=1e-13)
            assert no_slip or abs(q) <= mu * abs(p) + 1e-12
        elif branch == Branch.B_STICK:
            assert leaves >= 0.0  # (22)
            assert w2 == approx(alone, abs=1e-12)
            assert xdot2 == approx(-c * alone, abs=1e-12)
            assert n == 0.0
            assert v2 == 0.0
        else:
            assert branch in (Branch.D_SLIP, Branch.E_SLIP)
            assert not no_slip
            assert abs(q) == approx(mu * abs(p), abs=1e-12)
        assert branch != Branch.D_SLIP or q * v2 <= 1e-13
        if branch == Branch.E_SLIP:
            # (32): the corner stays on the wall.
            assert n == 0.0
            assert xdot2 == approx(C * w2, abs=1e-10)
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
            assert q == approx(-mu * sense * p, abs=1e-10)
    least = {Branch.A_STICK: 20, Branch.B_STICK: 20} | (
        {Branch.E_SLIP: 500, Branch.C_STICK: 10} if parting else {Branch.D_SLIP: 500}
    )
    assert lopsided or seen.keys() == least.keys()
    assert all(seen[branch] > count for branch, count in least.items()), seen


def impact_of(setting, phi: float, touching, e: float, v, sense=1.0):
    """The velocities after an impact, with what the state gathers."""
    state = run_at().state
    impact = state.impact
    impact.v[:], impact.touching[list(touching)] = v, True
    impact.sense, impact.phi, impact.resting, impact.e_tip, impact.e_far = sense, phi, 1e-9, e, e
    ci.contact_impact(setting, state)
    return impact.v, state


def rows_of(setting, sense: float, phi: float) -> np.ndarray:
    """The rows of the contacts, and of the floor's tangent."""
    rows = np.empty((7, 3))
    ci.contact_rows(setting, sense, phi, True, rows)
    return rows


#: The contacts of a wall that is touched, by whether the block stands flat.
WALLS = {
    "none": {False: [], True: []},
    "tip": {False: [Contact.TIP_TOP], True: [Contact.TIP_TOP, Contact.TIP_BOTTOM]},
    "far": {False: [Contact.FAR_BOTTOM], True: [Contact.FAR_BOTTOM, Contact.FAR_TOP]},
}


@lopsided_or_not
@pytest.mark.parametrize("e", [0.0, 0.5])
def test_contact_impact_leaves_no_approach(e, lopsided):
    """Unilateral impacts at 400 random states: no touched contact still closes, without
    restitution no energy is gained, and a corner alone is held by friction within its cone. Also
    where the approach is hardly more than rounding."""
    rng, held = np.random.default_rng(5), Counter()
    for _ in range(400):
        alpha = rng.uniform(0.05, 0.9)
        block = loaded(rng, block_of(alpha)) if lopsided else block_of(alpha)
        mu = rng.uniform(0.0, min(1.2, 0.95 * block.least_painleve_friction))
        b = setting_of(block, mu, e, energy_cap=bool(rng.integers(0, 4) == 0))
        sense = 1.0 if not lopsided or rng.integers(0, 2) else -1.0
        phi = float(rng.choice([0.0, 1e-8, alpha * rng.uniform(0.01, 0.9)]))
        touching = [Contact.FOOT, *[Contact.OTHER] * (phi == 0.0)]
        touching += WALLS[rng.choice(list(WALLS))][phi == 0.0]
        v = rng.normal(0.0, 0.3, 3) * 10.0 ** rng.choice([0.0, 0.0, rng.uniform(-9.0, 0.0)])
        before = contact_sets.kinetic_energy(b.spin, v)
        after, state = impact_of(b, phi, touching, e, v, sense)
        rows, energy = rows_of(b, sense, phi), contact_sets.kinetic_energy(b.spin, after)
        assert not state.rules.any()
        assert np.all(rows[touching] @ after >= -1e-8)
        assert state.impulse >= 0.0
        assert e > 0.0 or energy <= before * (1.0 + 1e-12)
        # Whatever gains energy is counted.
        assert state.gains > 0 or energy <= before * (1.0 + 1e-9)
        along, up = (after - v)[:2]  # of a unit mass
        slip = rows[Contact.TANGENT] @ after
        if touching != [Contact.FOOT] or rows[Contact.FOOT] @ v > -1e-3:
            continue
        held[abs(slip) < 1e-9] += 1
        if abs(slip) < 1e-9:
            assert abs(along) <= mu * up + 1e-12
        else:
            assert along == approx(-math.copysign(mu * up, slip), abs=1e-12)
    assert min(held[True], held[False]) > 8


@pytest.mark.parametrize("closing", [[Contact.FOOT], [Contact.FOOT, Contact.OTHER]])
def test_a_contact_that_closes_slowly_is_closed_without_friction(closing):
    """Slowly is slower than a resting contact moves: what it closes by is rounding, and a block
    that slides at 1 m/s must not lose any of that by it."""
    setting, impact = setting_of(0.3, 0.5, 0.0), run_at().state.impact
    rows = rows_of(setting, 1.0, 0.0)
    impact.rows[:], impact.v[:], impact.resting = rows, (1.0, -5e-10, 0.0), 1e-9
    impact.touching[closing] = True
    contact_sets.close_slow(setting, impact)
    np.testing.assert_allclose(rows[closing] @ impact.v, 0.0, rtol=0.0, atol=1e-15)
    assert impact.v[0] == 1.0


def motions_that_obey(rows, mass, v, target, mu_s, mu_k):
    """The velocities after all impulses of the floor on two corners that obey the law.

    `rows` are the corners' and the tangent's, `mass` one over mass and inertia, `target` the
    velocities with which the corners leave at the least.
    """
    found, corners, along = [], rows[:2], rows[2]
    for pushing in ([], [0], [1], [0, 1]):
        for slip in (0.0, 1.0, -1.0):
            pulls = [along] if slip == 0.0 and pushing else []
            effects = [mass * (corners[j] - mu_k * slip * along) for j in pushing]
            effects += [mass * pull for pull in pulls]
            asked = [*corners[pushing], *pulls]
            rates = np.array([[row @ effect for effect in effects] for row in asked])
            wanted = [target[j] - corners[j] @ v for j in pushing] + [-(pull @ v) for pull in pulls]
            if len(asked) > 2 and abs(np.linalg.det(rates)) < 1e-9:
                continue
            impulses = np.linalg.solve(rates, wanted) if asked else np.empty(0)
            after = v + sum((p * effect for p, effect in zip(impulses, effects, strict=True)), 0.0)
            push, size = impulses[: len(pushing)], 1e-10 * (1.0 + abs(after).sum())
            rubs = abs(impulses[len(pushing) :]) <= mu_s * push.sum() + size
            obeys = np.all(push >= -size) and np.all(corners @ after >= target - size)
            if obeys and np.all(rubs) and slip * (along @ after) >= -size:
                found.append(after)
    return found


@lopsided_or_not
@pytest.mark.parametrize("bounce", [0.0, 0.4])
def test_no_other_motion_obeys_the_law_where_a_landing_sticks(bounce, lopsided):
    """Where the pivot sticks and the other corner lifts off nothing else is tried: it is the only
    motion that obeys the law, also with a static friction above the kinetic one. With much friction
    there are others: then all are tried."""
    rng, sticks = np.random.default_rng(31), Counter()
    for _ in range(1500):
        alpha = rng.uniform(0.03, 1.3)
        block = loaded(rng, block_of(alpha)) if lopsided else block_of(alpha)
        mu_k = rng.uniform(0.0, 3.0) if rng.integers(0, 2) else rng.uniform(3.0, 30.0)
        setting = setting_of(block, mu_k, bounce)
        setting.mu_s = mu_k * rng.choice([1.0, 1.0, 1.4])
        rows, w1 = rows_of(setting, 1.0, 0.0), -rng.uniform(0.01, 1.0)
        at_corners = rows[[Contact.FOOT, Contact.OTHER, Contact.TANGENT]]
        slip = rng.choice([0.0, rng.normal(0.0, 0.2)])
        v = np.array([slip - setting.height * w1, -at_corners[0, 2] * w1, w1])
        v += rng.integers(0, 2) * rng.normal(0.0, 0.3, 3)  # not only as it rocks
        impact = run_at().state.impact
        impact.rows[:], impact.v[:] = rows, v
        impact.taking[[Contact.FOOT, Contact.OTHER]] = True
        target = -bounce * np.minimum(at_corners[:2] @ v, 0.0)
        impact.target[:2] = target
        turns_on = contact_sets._turns_on(setting, impact)
        sticks[bool(turns_on)] += 1
        if turns_on:
            mass = np.array([1.0, 1.0, setting.spin])
            all_of_them = motions_that_obey(at_corners, mass, v, target, float(setting.mu_s), mu_k)
            assert all_of_them
            np.testing.assert_allclose(
                all_of_them, [impact.after] * len(all_of_them), rtol=0.0, atol=1e-8
            )
    assert min(sticks[True], sticks[False]) > 150


def test_the_energy_cap_takes_the_largest_restitution_that_adds_none():
    """Where Newton's restitution adds no energy the cap changes nothing; where it does, a little
    more restitution would add some."""
    rng = np.random.default_rng(21)
    capped = untouched = 0
    for _ in range(1000):
        alpha, mu, e = rng.uniform(0.3, 1.2), rng.uniform(0.2, 1.33), rng.uniform(0.5, 0.99)
        phi, v = alpha * rng.uniform(0.05, 0.9), rng.normal(0.0, 0.5, 3)

        def landing(e: float, cap: bool = False, phi=phi, v=v, alpha=alpha, mu=mu):
            """Velocities after it lands on its corner, and the largest relative gain of energy."""
            after, state = impact_of(
                setting_of(alpha, mu, e, energy_cap=cap), phi, [Contact.FOOT], 0.0, v
            )
            assert state.gains == (state.largest_gain > 0.0)
            return after, float(state.largest_gain)

        row = rows_of(setting_of(alpha, mu, e), 1.0, phi)[Contact.FOOT]
        if row @ v > -1e-3:
            continue
        (plain, gain), (held, none) = landing(e), landing(e, cap=True)
        if gain == 0.0:
            np.testing.assert_array_equal(held, plain)
            untouched += 1
            continue
        capped += 1
        assert none <= 1e-12
        used = -(row @ held) / (row @ v)
        assert 0.0 < used < e
        np.testing.assert_allclose(landing(used)[0], held, rtol=0.0, atol=1e-12)
        assert landing(used * (1.0 + 1e-9))[1] > 0.0
    assert capped > 5
    assert untouched > 300


def test_the_energy_cap_leaves_an_elastic_impact_as_it_is():
    """A side that strikes an elastic wall keeps its energy but for rounding, which is no gain."""
    rng = np.random.default_rng(23)
    for _ in range(200):
        alpha, mu, v = rng.uniform(0.1, 1.2), rng.uniform(0.0, 1.2), -rng.uniform(0.01, 100.0)
        plain, held = (
            impact_of(setting_of(alpha, mu, 0.9, energy_cap=cap), 0.0, range(4), 1.0, [v, 0.0, 0.0])
            for cap in (False, True)
        )
        np.testing.assert_array_equal(held[0], plain[0])
        assert plain[0] == approx([-v, 0.0, 0.0], rel=1e-12)


@pytest.mark.parametrize("wall", ["tip", "far"])
def test_floor_first_is_a_trajectory_beside_a_wall_that_stands_farther_off(wall):
    """A block that lands flush, without friction: its corners strike one by one, each as it arrives
    where the wall is a unit away."""
    rng, floor, wall = np.random.default_rng(23), (Contact.FOOT, Contact.OTHER), WALLS[wall][True]
    both = 0
    for _ in range(400):
        alpha, floor_e, wall_e = rng.uniform(0.1, 1.2), rng.uniform(0.3, 0.9), rng.uniform(0.3, 0.9)
        setting = setting_of(alpha, 0.0, floor_e, impacts="floor-first")
        rows, v, mass = rows_of(setting, 1, 0.0), rng.normal(0.0, 0.5, 3), np.array([1.0, 1.0, 3.0])
        v[0] = math.copysign(v[0], -rows[wall[0], 0])  # toward the wall
        away, struck, after = dict.fromkeys(floor, 0.0) | dict.fromkeys(wall, 1.0), [], v.copy()
        lands = sorted(rows[list(floor)] @ v)
        if not lands[0] < -1e-3 < 1e-3 < lands[1]:
            continue  # one corner lands
        while True:
            rates = {j: float(rows[j] @ after) for j in away}
            coming = {j: away[j] / -rates[j] for j in away if rates[j] < -1e-12}
            if not coming:
                break
            first = min(coming, key=coming.__getitem__)
            away = {j: gap + rates[j] * coming[first] for j, gap in away.items()} | {first: 0.0}
            push, lever = mass * rows[first], rows[first] @ (mass * rows[first])
            after -= (1.0 + (floor_e if first in floor else wall_e)) * rates[first] / lever * push
            struck.append(first)
        if len(struck) < 20:  # of more stages the rest are plastic
            found = impact_of(setting, 0.0, [*floor, *wall], wall_e, v)
            assert not found[1].rules.any()
            np.testing.assert_allclose(found[0], after, rtol=0.0, atol=1e-9)
            both += set(wall) <= set(struck)
    assert both > 30
