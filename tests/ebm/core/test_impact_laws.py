"""What the impact laws decide: the branches of the wall cascade, the energy cap, and when a block
lies still."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest
from stepping import ROCKS, run_at, six

from rockcheck.ebm import EventBasedModel, natural
from rockcheck.ebm.core import contacts, settle
from rockcheck.ebm.core.laws import contact_impacts as ci, impacts, strike
from rockcheck.ebm.core.names import CONTACTS, Branch, Contact, Family, Found, Guard, Pivot
from rockcheck.ebm.core.rules import Rule
from rockcheck.scenes import Block, Floor, Scene, Wall
from rockcheck.scenes.scene import PAPER_BLOCK


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
        floor = setting_of(alpha, mu, 0.0)._replace(mu_s=mu, no_slip=no_slip)
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


def setting_of(alpha: float, mu: float, e: float, cap: bool = False):
    """A block of R = 1 m as the compiled code has it."""
    block = Block(half_width=math.sin(alpha), half_height=math.cos(alpha))
    scene = Scene(name="cap", block=block, floor=Floor(friction=mu, restitution=e), duration=1.0)
    return natural.setting_of(scene, unilateral=True, no_slip=False, energy_cap=cap)


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
    assert ci.contact_impact(setting_of(alpha, mu, e, cap), impact, state, work())
    return after, float(state.largest_gain)


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
        setting = setting_of(alpha, mu, e, cap=bool(rng.integers(0, 2)))
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
            block = setting_of(alpha, mu, 0.9, cap)
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
        block = Block(half_width=math.sin(alpha), half_height=math.cos(alpha))
        scene = Scene(
            name="flush", block=block, floor=Floor(friction=0.0, restitution=floor_e), duration=1.0
        )
        setting = natural.setting_of(
            scene, unilateral=True, no_slip=False, energy_cap=False, impacts="floor-first"
        )
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


@pytest.mark.parametrize("pivot", ["bilateral", "unilateral"])
def test_a_block_rocks_on_until_its_rate_is_a_ten_millionth(pivot):
    """Housner's impacts follow each other down to a rate of 1e-6 sqrt(g/R) at least; with the
    paper's pivot all to 5e-8."""
    alpha = PAPER_BLOCK.alpha
    tilt, ratio = 0.3 * alpha, 1.0 - 1.5 * math.sin(alpha) ** 2
    scene = Scene(
        name="still",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.8),
        initial_rotation=tilt,
        duration=12.0,
        output_step=0.1,
    )
    history = EventBasedModel(pivot=pivot).simulate(scene)
    assert history.outcome == "at rest"
    speed = math.sqrt(scene.gravity * PAPER_BLOCK.radius)
    rates = [
        event.impulse / speed / (math.sin(alpha) * (1.0 + ratio))
        for event in history.event_list
        if event.kind == "floor impact"
    ]
    first = math.sqrt(1.5 * (math.cos(alpha - tilt) - math.cos(alpha)))
    np.testing.assert_allclose(rates[:100], first * ratio ** np.arange(100), rtol=1e-6)
    assert rates[-1] < 1e-6
    if pivot == "bilateral":
        assert len(rates) == math.ceil(math.log(5e-8 / first) / math.log(ratio))


@pytest.mark.parametrize("side", [1, -1])
def test_a_block_is_put_onto_the_contact_that_closes(side):
    """The gap is zero to rounding, whichever it was and whatever the pivot does; what need not give
    way keeps its place."""
    alpha, gap, off = 0.4, 0.05, 1e-7
    walls = (Wall(side="left", gap=gap), Wall(side="right", gap=2.0 * gap))
    block = Block(half_width=math.sin(alpha), half_height=math.cos(alpha))
    scene = Scene(name="touch", block=block, floor=Floor(friction=0.5), walls=walls, duration=1.0)
    b = natural.setting_of(scene, unilateral=True, no_slip=False, energy_cap=False)
    for tilt in (0.0, 0.15):
        family, tip = (Family.TILT, side) if tilt else (Family.FLAT, 1)
        for which, floor, wall in (
            (Guard.LANDING, Pivot.OFF, 0),
            (Guard.TIP_GAP, Pivot.STICK, tip),
            (Guard.TIP_GAP, Pivot.SLIPPING, tip),
            (Guard.FAR_GAP, Pivot.SLIPPING, -tip),
        ):
            place = [0.0, math.cos(alpha - tilt), side * tilt, 0.0, 0.0, 0.0]
            state = run_at(place, family=family, sense=tip, pivot=floor).state
            z = state.motion
            if wall:
                z.x = -wall * (contacts.wall_gap(b, z, wall) - off)
            else:
                z.y += off
            before = six(z)
            strike.touch(b, state.mode, z, which)
            gap = contacts.wall_gap(b, z, wall) if wall else contacts.floor_gap(b, z)
            assert gap == pytest.approx(0.0, abs=1e-13)
            assert np.max(np.abs(six(z) - before)) == pytest.approx(off, rel=1.0)
            if wall and tilt and floor == Pivot.STICK:
                pivots = [one[0] - side * math.sin(alpha - abs(one[2])) for one in (before, six(z))]
                assert pivots[1] == pytest.approx(pivots[0], abs=1e-15)
                assert contacts.floor_gap(b, z) == 0.0
            else:
                kept = [k for k in range(6) if k != (0 if wall else 1)]
                np.testing.assert_array_equal(six(z)[kept], before[kept])


@pytest.mark.parametrize("side", [1, -1])
def test_a_flush_landing_rebounds_as_the_wall_does_that_it_meets(side):
    """The paper's pivot, closed branch: a block that tipped to one side lands against the other
    one's wall, with that one's restitution."""
    walls = (
        Wall(side="left", gap=0.0, restitution=0.3),
        Wall(side="right", gap=0.0, restitution=0.7),
    )
    block = Block(half_width=math.sin(0.4), half_height=math.cos(0.4))
    scene = Scene(name="flush", block=block, floor=Floor(friction=0.5), walls=walls, duration=1.0)
    b = natural.setting_of(scene, unilateral=False, no_slip=False, energy_cap=False)
    e, w = (0.7 if side > 0 else 0.3), -0.2 * side
    start = [0.0, math.cos(0.4), 0.0, -math.cos(0.4) * w, 0.0, w]
    state = run_at(start, **ROCKS, sense=side).state
    assert not strike._floor_impact(b, state, 1e-9)
    after = [-e * w, math.cos(0.4) * e * w, -side * math.sin(0.4) * e * w]
    found = [state.motion.w, state.motion.vx, state.motion.vy]
    assert found == pytest.approx(after, abs=1e-15)
    assert state.floor_impulse == pytest.approx((1.0 + e) * math.sin(0.4) * abs(w))
    assert state.wall_impulse == 0.0
    assert (state.rules[Rule.FLUSH_LANDING], state.rules.sum()) == (1, 1)


@pytest.mark.parametrize("side", [1, -1])
def test_a_corner_rebounds_as_the_wall_does_that_it_strikes(side):
    """The paper's pivot, held: a block that tips to one side meets that wall, and its corner leaves
    with that one's restitution."""
    walls = (
        Wall(side="left", gap=0.5, restitution=0.3),
        Wall(side="right", gap=0.5, restitution=0.7),
    )
    block = Block(half_width=math.sin(0.4), half_height=math.cos(0.4))
    scene = Scene(name="corner", block=block, floor=Floor(friction=0.5), walls=walls, duration=1.0)
    b = natural.setting_of(scene, unilateral=False, no_slip=True, energy_cap=False)
    w = 0.3 * side
    start = [0.0, math.cos(0.25), 0.15 * side, -math.cos(0.25) * w, math.sin(0.25) * abs(w), w]
    state = run_at(start, **ROCKS, sense=side).state
    assert strike._wall_impact(b, state, True, 1e-9)
    e = 0.3 if side > 0 else 0.7
    assert state.motion.w == pytest.approx(-e * w, abs=1e-15)
    assert state.motion.vx == pytest.approx(math.cos(0.25) * e * w, abs=1e-15)


@pytest.mark.parametrize(
    ("slip", "kept"), [(0.1, True), (-3e-7, True), (1e-7, False), (-1e-7, False)]
)
def test_a_block_that_lands_with_less_spin_than_counts_slides_on(slip, kept):
    """Its spin, and a bounce and a slip below the settling speed, are gone; a slip above it, and a
    faster bounce, are not."""
    block = Block(half_width=math.sin(0.4), half_height=math.cos(0.4))
    scene = Scene(name="lands", block=block, floor=Floor(friction=0.5), duration=1.0)
    b = natural.setting_of(scene, unilateral=True, no_slip=False, energy_cap=False)
    for bounce, stays in ((0.1, False), (4e-8, True)):
        state = run_at([0.2, math.cos(0.4), 0.0, slip, bounce, 3e-8]).state
        v, z = contacts.slip_velocity(b, state.motion), state.motion
        strike._settle_flat(b, state, settle.SETTLE)
        assert six(z).tolist() == [
            0.2,
            math.cos(0.4),
            0.0,
            v if kept else 0.0,
            0.0 if stays else bounce,
            0.0,
        ]
        assert (state.rules[Rule.SETTLES], state.rules.sum()) == (1, 1)


def struck_at(state, t: float) -> float:
    """The settling speed as an impact at this time finds it."""
    state.t = t
    return settle.settling_speed(state)


def test_the_settling_speed_rises_as_impacts_accumulate():
    """Tenfold with every hundred impacts up to 2.5e-3, without a bound after five hundred times as
    many; back after a quiet 0.025."""
    state, t = run_at().state, 0.0
    settle.no_impacts(state)
    speeds = []
    for _ in range(50_100):
        t += 2.5e-7
        speeds.append(struck_at(state, t))
    rises = [k + 1 for k in range(1, len(speeds)) if speeds[k] != speeds[k - 1]]
    assert rises == [100, 200, 300, 400, 500, 50_000]
    np.testing.assert_allclose(
        [speeds[0], *(speeds[k - 1] for k in rises)], [5e-8, 5e-7, 5e-6, 5e-5, 5e-4, 2.5e-3, np.inf]
    )
    assert state.rules[Rule.RATTLES] == 501
    assert struck_at(state, t + 0.024) == np.inf
    assert struck_at(state, t + 0.024 + 0.026) == 5e-8
    settle.no_impacts(state)
    for k in range(300):  # as many in a longer time are no rattle
        assert struck_at(state, 3e-4 * k) == 5e-8


def test_impacts_at_one_instant_end_plastic():
    state = run_at().state
    settle.no_impacts(state)
    speeds = [struck_at(state, 1.0) for _ in range(21)]
    assert speeds == [5e-8] * 20 + [np.inf]  # the first, and twenty more at its instant
    assert state.rules[Rule.ENDLESS_STAGES] == 1
    assert struck_at(state, 1.001) == 5e-8
