"""Motions and impacts whose answer is known on paper, and loaded blocks by Lagrange's equation.

The other side of these is written from the positions of corners and mass's centre in the world, by
rotation matrices; it shares nothing with the models but the scene.
"""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from cases import RACK, G, block_scene
from scipy.integrate import quad, solve_ivp
from stepping import block_of

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Block, Floor, Record, Ricker, Scene, Sine, Wall, kinematics

PIVOTS = ["bilateral", "unilateral"]


# --- Housner (1963): free rocking


def quarter_period(block: Block, tilt: float) -> float:
    """Time in s from rest at `tilt` to theta = 0, without approximation: an elliptic integral; tilt
    = angle - z^2 makes it smooth."""
    alpha, rate = block.alpha, 1.5 * G / block.radius

    def integrand(z: float) -> float:
        # w^2 = rate (cos(alpha - tilt) - cos(alpha - theta)), written as a product so that nothing
        # cancels
        half = 0.5 * z * z
        return 2.0 / math.sqrt(rate * math.sin(alpha - tilt + half) * np.sinc(half / math.pi))

    return quad(integrand, 0.0, math.sqrt(tilt), epsabs=1e-13, epsrel=1e-13)[0]


def first_impact(scene: Scene, **settings: object) -> float:
    events = EventBasedModel(tolerance=1e-13, **settings).simulate(scene).event_list
    return next(e.t for e in events if e.kind == "floor impact")


@pytest.mark.parametrize("pivot", PIVOTS)
@pytest.mark.parametrize("tilt", [0.01, 0.3, 0.9, 0.999, -0.5])
@pytest.mark.parametrize("alpha", [0.02, 0.25, 0.6])
def test_quarter_period(alpha, tilt, pivot):
    block, friction = block_of(alpha, 1.6), "no-slip" if pivot == "bilateral" else "coulomb"
    scene = block_scene(block, 1.3, duration=8.0, initial_rotation=tilt * alpha)
    assert first_impact(scene, pivot=pivot, friction=friction) == pytest.approx(
        quarter_period(block, abs(tilt) * alpha), abs=1e-9
    )


@pytest.mark.parametrize("tilt", [0.1, 0.5, 0.9])
def test_quarter_period_of_a_needle_is_housners(tilt):
    """acosh(1/(1 - theta/alpha))/p, which is exact for alpha -> 0."""
    block = block_of(1e-5, 2.0)
    scene = block_scene(block, 0.5, duration=3.0, initial_rotation=tilt * block.alpha)
    assert first_impact(scene) == pytest.approx(
        math.acosh(1.0 / (1.0 - tilt)) / scene.frequency_parameter, abs=1e-9
    )


@pytest.mark.parametrize("pivot", PIVOTS)
@pytest.mark.parametrize("tilt", [0.6, 0.95])
def test_energy_is_conserved_between_impacts_and_falls_by_housners_ratio(tilt, pivot, block):
    history = EventBasedModel(tolerance=1e-14, pivot=pivot).simulate(
        block_scene(block, 1.0, duration=10.0, initial_rotation=tilt * block.alpha)
    )
    motion = history.channels
    energy = kinematics.energy(
        block, G, *(motion[name] for name in ("y", "theta", "x_dot", "y_dot", "theta_dot"))
    )
    edges = [0.0, *(e.t for e in history.event_list if e.kind == "floor impact"), 10.0]
    arcs = [energy[(motion["t"] > a) & (motion["t"] < b)] for a, b in pairwise(edges)]
    changes = [np.ptp(arc) for arc in arcs if len(arc) > 1]
    assert len(changes) > 10
    assert max(changes) <= 1e-12 * G * block.radius
    ratio = 1.0 - 1.5 * math.sin(block.alpha) ** 2
    assert ratio == pytest.approx(0.9082115316, abs=6e-11)
    ratios = [math.sqrt(after[0] / before[-1]) for before, after in pairwise(arcs[:4])]
    assert ratios == pytest.approx([ratio] * 3, abs=1e-12)


@pytest.mark.parametrize("factor", [1.0 - 1e-9, 1.0 + 1e-9])
@pytest.mark.parametrize("ratio", [1.05, 1.5, 3.0, 10.0])
@pytest.mark.parametrize("alpha", [0.05, 0.25, 0.5])
def test_least_rectangular_pulse_that_overturns(alpha, ratio, factor):
    """A constant acceleration of `ratio` g tan(alpha) overturns if it lasts longer than a time that
    energy gives.

    After the pulse the block must be able to reach its balance: a (sin alpha - sin(alpha - theta))
    = g (1 - cos alpha) at its end. For slender blocks that is Housner's cosh(p t) = 1 + 1/(2 r (r -
    1)), r = a/(g alpha).
    """
    block = block_of(alpha, 1.6)
    a = ratio * G * math.tan(alpha)
    at_end = alpha - math.asin(math.sin(alpha) - G / a * (1.0 - math.cos(alpha)))

    def integrand(z: float) -> float:  # theta = z^2
        half = 0.5 * z * z
        force = a * math.cos(alpha - half) - G * math.sin(alpha - half)
        return 2.0 / math.sqrt(1.5 / block.radius * np.sinc(half / math.pi) * force)

    least = quad(integrand, 0.0, math.sqrt(at_end), epsabs=1e-13, epsrel=1e-13)[0]
    if ratio > 1.2:
        r = a / (G * alpha)
        housner = math.acosh(1.0 + 0.5 / (r * (r - 1.0))) / math.sqrt(0.75 * G / block.radius)
        assert least == pytest.approx(housner, rel=2.0 * alpha**2)
    pulse = Record.from_samples([a, a], time_step=factor * least)
    history = EventBasedModel(tolerance=1e-13, friction="no-slip").simulate(
        block_scene(block, 1.0, duration=60.0, excitation=pulse, output_step=1.0)
    )
    assert (history.outcome == "overturned left") is (factor > 1.0)


@pytest.mark.parametrize(("factor", "outcome"), [(0.999, "stays"), (1.001, "overturns")])
@pytest.mark.parametrize("alpha", [0.1, 0.25, 0.45])
def test_critical_double_impulse(alpha, factor, outcome):
    """Two opposite steps of the base's velocity, the second just after the impact that ends the
    first swing, overturn at sqrt(8 g R (1 - cos a)/3)/cos a/(1 + r) with Housner's r (after
    Nabeshima and others 2016)."""
    block, step = block_of(alpha, 1.6), 2e-5
    single = math.sqrt(8.0 * G * block.radius * (1.0 - math.cos(alpha)) / 3.0) / math.cos(alpha)
    velocity = factor * single / (2.0 - 1.5 * math.sin(alpha) ** 2)
    spin = 0.75 * velocity * math.cos(alpha) / block.radius
    top = math.acos(math.cos(alpha) + spin**2 * block.radius / (1.5 * G))
    back = round(2.0 * quarter_period(block, alpha - top) / step) + 3
    samples = np.zeros(back + 2)
    samples[1], samples[back] = velocity / step, -velocity / step
    history = EventBasedModel(friction="no-slip").simulate(
        block_scene(
            block, 1.0, duration=12.0, excitation=Record.from_samples(samples, time_step=step)
        )
    )
    assert ("overturns" if history.outcome.startswith("overturned") else "stays") == outcome


# --- sliding and bouncing


@pytest.mark.parametrize("pivot", PIVOTS)
@pytest.mark.parametrize(("mu", "speed"), [(0.1, 1.0), (0.2, -3.0), (0.05, 0.01)])
def test_sliding_distance(mu, speed, pivot, block):
    history = EventBasedModel(pivot=pivot).simulate(
        block_scene(block, mu, duration=4.0, initial_velocity=speed)
    )
    assert history.outcome == "at rest"
    assert not history.channels["theta"].any()
    stops = [history.channels["x"][-1], *(e.t for e in history.event_list if e.kind == "stick")]
    assert stops == pytest.approx(
        [math.copysign(speed**2 / (2.0 * mu * G), speed), abs(speed) / (mu * G)], rel=1e-12
    )


@pytest.mark.parametrize("restitution", [0.3, 0.7, 0.9])
def test_bounce_heights(restitution, block):
    drop, rises = 0.1, restitution ** np.arange(5)
    history = EventBasedModel(pivot="unilateral").simulate(
        block_scene(
            block,
            floor=Floor(friction=0.5, restitution=restitution),
            duration=3.0,
            initial_height=drop,
            output_step=0.005,
        )
    )
    motion = history.channels
    height = motion["y_dot"] ** 2 / (2.0 * G) + motion["y"] - block.half_height
    t = math.sqrt(2.0 * drop / G) * (2.0 * np.cumsum(rises) - 1.0)
    landings = [e.t for e in history.event_list if e.kind in ("landing", "floor impact")]
    assert landings[:5] == pytest.approx(t, abs=1e-12)
    for n, (start, end) in enumerate(pairwise(t), 1):
        np.testing.assert_allclose(
            height[(motion["t"] > start) & (motion["t"] < end)], rises[n] ** 2 * drop, rtol=1e-11
        )
    assert not motion["theta"].any()


# --- blocks whose mass is not where the box's centre is: two pivots


class Lagrangian:
    """The block turning about its lower corner, which keeps its place: one coordinate, theta, and
    Lagrange's equation for it.

    T = I w^2/2 + |dr/dtheta|^2 w^2/2 and V = g y + u x, with r = (x, y) the place of the mass's
    centre from the corner.
    """

    def __init__(self, block: Block, side: str) -> None:
        self.sense = {"left": 1.0, "right": -1.0}[side]
        self.inertia = block.moment_of_inertia / block.mass
        self.arm = block.offset + np.array([self.sense * block.half_width, block.half_height])

    def place(self, theta: float, turns: int = 0) -> np.ndarray:
        """r, or its derivative by theta of that order."""
        s, c = math.sin(theta), math.cos(theta)
        rotation, quarter = np.array([[c, -s], [s, c]]), np.array([[0.0, -1.0], [1.0, 0.0]])
        return np.asarray(np.linalg.matrix_power(quarter, turns) @ rotation @ self.arm)

    def motion(self, u: Callable[[float], float]) -> Callable[[float, np.ndarray], list[float]]:
        def rates(t: float, q: np.ndarray) -> list[float]:
            first, second = self.place(q[0], 1), self.place(q[0], 2)
            pull = -G * first[1] - u(t) * first[0]
            return [
                q[1],
                (pull - first @ second * q[1] ** 2) / (self.inertia + first @ first),
            ]

        return rates

    def energy(self, theta: float, w: float) -> float:
        first = self.place(theta, 1)
        return 0.5 * (self.inertia + first @ first) * w * w + G * (
            self.place(theta)[1] - self.place(0.0)[1]
        )

    def momentum_about(self, point: np.ndarray, w: float) -> float:
        """Angular momentum at theta = 0 about a point that is given from the corner."""
        velocity, arm = self.place(0.0, 1) * w, self.arm - point
        return self.inertia * w + arm[0] * velocity[1] - arm[1] * velocity[0]


def rocking_by_lagrange(scene: Scene) -> Callable[[np.ndarray], np.ndarray]:
    """theta(t) of a block that sticks to its pivots and conserves angular momentum about the new
    one where it lands."""
    theta, w, t = scene.initial_rotation, 0.0, 0.0
    pieces = []
    body, other = (Lagrangian(scene.block, side) for side in ("left", "right"))
    if theta < 0.0:
        body, other = other, body
    while t < scene.duration - 1e-12:

        def lands(t: float, q: np.ndarray) -> float:
            return float(q[0])

        lands.terminal, lands.direction = True, -body.sense  # type: ignore[attr-defined]
        found = solve_ivp(
            body.motion(lambda t: float(scene.excitation.acceleration(t))),
            (t, scene.duration),
            [theta, w],
            "DOP853",
            rtol=1e-13,
            atol=1e-14,
            events=lands,
            dense_output=True,
            max_step=0.05,
        )
        t = found.t[-1]
        pieces.append((t, found.sol))
        spin = body.momentum_about(body.arm - other.arm, float(found.y[1, -1]))
        theta, w = 0.0, spin / (other.inertia + other.arm @ other.arm)
        body, other = other, body
    return lambda times: np.array(
        [next(sol(t)[0] for end, sol in pieces if t <= end + 1e-12) for t in times]
    )


@pytest.mark.parametrize("pivot", PIVOTS)
@pytest.mark.parametrize("tilt", [0.1, -0.1])
def test_free_rocking_is_lagranges(tilt, pivot):
    scene = block_scene(duration=1.2, initial_rotation=tilt)
    history = EventBasedModel(pivot=pivot, tolerance=1e-13).simulate(scene)
    c = history.channels
    np.testing.assert_allclose(c["theta"], rocking_by_lagrange(scene)(c["t"]), rtol=0.0, atol=1e-9)
    energy = kinematics.energy(
        RACK, G, *(c[name] for name in ("y", "theta", "x_dot", "y_dot", "theta_dot"))
    )
    first, second, *_ = (event.t for event in history.event_list if event.kind == "floor impact")
    for arc in (c["t"] < first, (c["t"] > first) & (c["t"] < second)):
        assert np.ptp(energy[arc]) < 1e-11
    assert energy[0] == pytest.approx(
        Lagrangian(RACK, "left" if tilt > 0 else "right").energy(tilt, 0.0), abs=1e-12
    )


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_pulse_is_lagranges(sense):
    scene = block_scene(
        duration=1.4,
        excitation=Sine(amplitude=sense * 6.0, period=0.7),
        initial_rotation=-0.05 * sense,
    )
    c = EventBasedModel(friction="no-slip", tolerance=1e-13).simulate(scene).channels
    assert min(np.max(c["theta"]), -np.min(c["theta"])) > 0.02
    np.testing.assert_allclose(c["theta"], rocking_by_lagrange(scene)(c["t"]), rtol=0.0, atol=1e-8)


def test_pivots_of_a_block():
    for side in ("left", "right"):
        body, pivot = Lagrangian(RACK, side), RACK.pivot(side)
        radius = float(np.hypot(*body.arm))
        assert pivot.alpha == pytest.approx(math.atan2(abs(body.arm[0]), body.arm[1]), rel=1e-15)
        assert pivot.radius == pytest.approx(radius, rel=1e-15)
        assert pivot.frequency_parameter(G) == pytest.approx(
            math.sqrt(G * radius / (body.inertia + radius**2)), rel=1e-14
        )
    assert RACK.alpha == RACK.pivot("right").alpha < RACK.pivot("left").alpha
    plain = Block(half_width=0.3, half_height=1.0)
    assert plain.pivot("left") == plain.pivot("right")
    assert plain.frequency_parameter == math.sqrt(0.75 * G / math.hypot(0.3, 1.0))


@pytest.mark.parametrize(
    ("mu", "settings"),
    [(0.9, {}), (0.9, {"pivot": "unilateral"}), (0.05, {"friction": "no-slip"})],
    ids=str,
)
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_uplift_at_the_least_acceleration_of_each_side(sense, mu, settings):
    """On a base whose acceleration rises evenly the block leaves the floor where it passes g tan
    alpha of that side's pivot, whatever its friction if it cannot slip."""
    side = RACK.pivot("left" if sense > 0.0 else "right")
    rises = Record.from_samples(sense * np.linspace(0.0, 0.6 * G, 601), 0.01)
    scene = block_scene(mu=mu, duration=6.0, excitation=rises)
    first = EventBasedModel(tolerance=1e-12, **settings).simulate(scene).event_list[0]
    passed = side.arm / side.height / 0.6 * 6.0
    assert first.kind == "uplift"
    assert first.t == pytest.approx(passed, abs=1e-9)


@pytest.mark.parametrize("pivot", PIVOTS)
def test_the_homogeneous_block_is_the_symmetric_instance(pivot):
    """Given as one that has its mass in the middle and a homogeneous box's inertia, it moves as
    ever but for rounding."""
    block = Block(half_width=0.3, half_height=1.0)
    assert block.replace(centre_of_mass=(0.0, 0.0)) == block
    same = block.replace(mass=3.0, moment_of_inertia=0.3**2 + 1.0)
    walls, pulse = [Wall(side="left", gap=0.03, restitution=0.4)], Ricker(amplitude=7.0, period=0.9)
    scene = block_scene(block, 0.4, excitation=pulse, walls=walls, duration=3.0)
    model = EventBasedModel(pivot=pivot, tolerance=1e-12)
    plain, *others = (
        model.simulate(scene.replace(block=one)).channels["theta"]
        for one in (block, same, block.replace(centre_of_mass=(1e-13, 0.0)))
    )
    np.testing.assert_allclose(others, [plain] * 2, rtol=0.0, atol=1e-8)
