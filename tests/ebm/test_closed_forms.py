"""Motions and impacts whose answer is known on paper."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from stepping import block_of

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Block, Floor, Record, Scene, kinematics

GRAVITY = 9.81
PIVOTS = ["bilateral", "unilateral"]


def scene_of(block: Block, mu: float, duration: float, **more: object) -> Scene:
    return Scene(
        **{"name": "closed form", "block": block, "floor": Floor(friction=mu), "duration": duration}
        | more
    )


# --- Housner (1963): free rocking


def quarter_period(block: Block, tilt: float) -> float:
    """Time in s from rest at `tilt` to theta = 0, without approximation: an elliptic integral; tilt
    = angle - z^2 makes it smooth."""
    alpha, rate = block.alpha, 1.5 * GRAVITY / block.radius

    def integrand(z: float) -> float:
        # w^2 = rate (cos(alpha - tilt) - cos(alpha - theta)), written as a product so that nothing
        # cancels
        half = 0.5 * z * z
        shape = (
            2.0
            * math.sin(alpha - tilt + half)
            * (math.sin(half) / half if half > 0.0 else 1.0)
            * 0.5
        )
        return 2.0 / math.sqrt(rate * shape)

    return quad(integrand, 0.0, math.sqrt(tilt), epsabs=1e-13, epsrel=1e-13)[0]


def first_impact(scene: Scene, **settings: object) -> float:
    history = EventBasedModel(tolerance=1e-13, **settings).simulate(scene)
    return next(e.t for e in history.event_list if e.kind == "floor impact")


@pytest.mark.parametrize("pivot", PIVOTS)
@pytest.mark.parametrize("tilt", [0.01, 0.3, 0.9, 0.999, -0.5])
@pytest.mark.parametrize("alpha", [0.02, 0.25, 0.6])
def test_quarter_period(alpha, tilt, pivot):
    block = block_of(alpha, 1.6)
    scene = scene_of(block, 1.3, 8.0, initial_rotation=tilt * alpha)
    assert first_impact(
        scene, pivot=pivot, friction="no-slip" if pivot == "bilateral" else "coulomb"
    ) == pytest.approx(quarter_period(block, abs(tilt) * alpha), abs=1e-9)


@pytest.mark.parametrize("tilt", [0.1, 0.5, 0.9])
def test_quarter_period_of_a_needle_is_housners(tilt):
    """acosh(1/(1 - theta/alpha))/p, which is exact for alpha -> 0."""
    block = block_of(1e-5, 2.0)
    scene = scene_of(block, 0.5, 3.0, initial_rotation=tilt * block.alpha)
    assert first_impact(scene) == pytest.approx(
        math.acosh(1.0 / (1.0 - tilt)) / scene.frequency_parameter, abs=1e-9
    )


@pytest.mark.parametrize("pivot", PIVOTS)
@pytest.mark.parametrize("tilt", [0.6, 0.95])
def test_energy_is_conserved_between_impacts_and_falls_by_housners_ratio(tilt, pivot, block):
    """Angular velocity after over before an impact, 1 - 1.5 sin^2 alpha, from the energy of the
    rows around it."""
    scene = scene_of(block, 1.0, 10.0, initial_rotation=tilt * block.alpha)
    history = EventBasedModel(tolerance=1e-14, pivot=pivot).simulate(scene)
    motion = history.channels
    energy = kinematics.energy(
        block, GRAVITY, *(motion[name] for name in ("y", "theta", "x_dot", "y_dot", "theta_dot"))
    )
    edges = [0.0, *(e.t for e in history.event_list if e.kind == "floor impact"), 10.0]
    arcs = [energy[(motion["t"] > a) & (motion["t"] < b)] for a, b in pairwise(edges)]
    long = [arc for arc in arcs if len(arc) > 1]
    assert len(long) > 10
    assert max(np.ptp(arc) for arc in long) <= 1e-12 * GRAVITY * block.radius
    for before, after in pairwise(arcs[:4]):
        ratio = math.sqrt(after[0] / before[-1])
        assert ratio == pytest.approx(0.9082115316, abs=6e-11)
        assert ratio == pytest.approx(1.0 - 1.5 * math.sin(block.alpha) ** 2, abs=1e-12)


@pytest.mark.parametrize("ratio", [1.05, 1.5, 3.0, 10.0])
@pytest.mark.parametrize("alpha", [0.05, 0.25, 0.5])
def test_least_rectangular_pulse_that_overturns(alpha, ratio):
    """A constant acceleration of `ratio` g tan(alpha) overturns if it lasts longer than a time that
    energy gives.

    After the pulse the block must be able to reach its balance: a (sin alpha - sin(alpha - theta))
    = g (1 - cos alpha) at its end. For slender blocks that is Housner's cosh(p t) = 1 + 1/(2 r (r -
    1)), r = a/(g alpha).
    """
    block = block_of(alpha, 1.6)
    a = ratio * GRAVITY * math.tan(alpha)
    at_end = alpha - math.asin(math.sin(alpha) - GRAVITY / a * (1.0 - math.cos(alpha)))

    def integrand(z: float) -> float:  # theta = z^2
        half = 0.5 * z * z
        work = (
            2.0
            * (math.sin(half) / half if half > 0.0 else 1.0)
            * (a * math.cos(alpha - half) - GRAVITY * math.sin(alpha - half))
        )
        return 2.0 / math.sqrt(0.75 / block.radius * work)

    least = quad(integrand, 0.0, math.sqrt(at_end), epsabs=1e-13, epsrel=1e-13)[0]
    if ratio > 1.2:
        r = a / (GRAVITY * alpha)
        housner = math.acosh(1.0 + 0.5 / (r * (r - 1.0))) / math.sqrt(0.75 * GRAVITY / block.radius)
        assert least == pytest.approx(housner, rel=2.0 * alpha**2)
    model = EventBasedModel(tolerance=1e-13, friction="no-slip")
    for factor in (1.0 - 1e-9, 1.0 + 1e-9):
        pulse = Record.from_samples([a, a], time_step=factor * least)
        scene = scene_of(block, 1.0, 60.0, excitation=pulse, output_step=1.0)
        assert (model.simulate(scene).outcome == "overturned left") is (factor > 1.0)


# --- sliding and bouncing


@pytest.mark.parametrize("pivot", PIVOTS)
@pytest.mark.parametrize(("mu", "speed"), [(0.1, 1.0), (0.2, -3.0), (0.05, 0.01)])
def test_sliding_distance(mu, speed, pivot, block):
    """v^2/(2 mu g), in the time v/(mu g)."""
    history = EventBasedModel(pivot=pivot).simulate(
        scene_of(block, mu, 4.0, initial_velocity=speed)
    )
    assert history.outcome == "at rest"
    assert history.channels["x"][-1] == pytest.approx(
        math.copysign(speed**2 / (2.0 * mu * GRAVITY), speed), rel=1e-12
    )
    assert not history.channels["theta"].any()
    (stop,) = [e for e in history.event_list if e.kind == "stick"]
    assert stop.t == pytest.approx(abs(speed) / (mu * GRAVITY), rel=1e-12)


@pytest.mark.parametrize("restitution", [0.3, 0.7, 0.9])
def test_bounce_heights(restitution, block):
    """A flat drop from h rises to e^(2n) h after its n-th bounce, and hits the floor when a ball
    would."""
    drop = 0.1
    scene = scene_of(block, 0.5, 3.0, initial_height=drop).replace(
        floor=Floor(friction=0.5, restitution=restitution)
    )
    history = EventBasedModel(pivot="unilateral").simulate(scene)
    motion = history.channels
    height = motion["y_dot"] ** 2 / (2.0 * GRAVITY) + motion["y"] - block.half_height
    t, fall = math.sqrt(2.0 * drop / GRAVITY), math.sqrt(2.0 * drop / GRAVITY)
    landings = [e.t for e in history.event_list if e.kind in ("landing", "floor impact")]
    for n in range(1, 5):
        assert landings[n - 1] == pytest.approx(t, abs=1e-12)
        following = t + 2.0 * fall * restitution**n
        arc = height[(motion["t"] > t) & (motion["t"] < following)]
        np.testing.assert_allclose(arc, restitution ** (2 * n) * drop, rtol=1e-11)
        t = following
    assert not motion["theta"].any()
