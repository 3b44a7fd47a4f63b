"""Blocks whose mass is not where the box's centre is: two pivots, against closed forms, Lagrange's
equations and Newton-Euler.

The other side is written from the positions of corners and mass's centre in the world, by rotation
matrices; it shares nothing with the models but the scene.
"""

import math
from collections.abc import Callable

import numpy as np
import pytest
from loaded import RACK, G, random_scene, scene_of
from scipy.integrate import solve_ivp
from stepping import assert_mirror_images

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.batch import pack, run_batch
from rockcheck.scenes import Block, Record, Ricker, Scene, Sine, Wall, kinematics


class Lagrangian:
    """The block turning about its lower corner, which keeps its place: one coordinate, theta, and
    Lagrange's equation for it.

    T = I w^2/2 + |dr/dtheta|^2 w^2/2 and V = g y + u x, with r = (x, y) the place of the mass's
    centre from the corner.
    """

    def __init__(self, block: Block, side: str) -> None:
        dx, dz = block.offset
        corner = np.array(
            [-block.half_width if side == "left" else block.half_width, -block.half_height]
        )
        self.arm, self.inertia = np.array([dx, dz]) - corner, block.moment_of_inertia / block.mass
        self.sense = 1.0 if side == "left" else -1.0

    def place(self, theta: float, turns: int = 0) -> np.ndarray:
        """r, or its derivative by theta of that order."""
        s, c = math.sin(theta), math.cos(theta)
        rotation, quarter = np.array([[c, -s], [s, c]]), np.array([[0.0, -1.0], [1.0, 0.0]])
        return np.asarray(np.linalg.matrix_power(quarter, turns) @ rotation @ self.arm)

    def motion(self, u: Callable[[float], float]) -> Callable[[float, np.ndarray], list[float]]:
        def rates(t: float, q: np.ndarray) -> list[float]:
            first, second = self.place(q[0], 1), self.place(q[0], 2)
            inertia = self.inertia + first @ first
            pull = -G * first[1] - u(t) * first[0]
            return [q[1], (pull - first @ second * q[1] ** 2) / inertia]

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
    side = "left" if theta > 0.0 else "right"
    while t < scene.duration - 1e-12:
        body = Lagrangian(scene.block, side)

        def lands(t: float, q: np.ndarray) -> float:
            return float(q[0])

        lands.terminal, lands.direction = True, -body.sense  # type: ignore[attr-defined]
        motion = body.motion(lambda t: float(scene.excitation.acceleration(t)))
        found = solve_ivp(
            motion,
            (t, scene.duration),
            [theta, w],
            "DOP853",
            rtol=1e-13,
            atol=1e-14,
            events=lands,
            dense_output=True,
            max_step=0.05,
        )
        pieces.append((t, found.t[-1], found.sol))
        t = found.t[-1]
        side = "right" if side == "left" else "left"
        other = Lagrangian(scene.block, side)
        theta, w = (
            0.0,
            body.momentum_about(body.arm - other.arm, float(found.y[1, -1]))
            / (other.inertia + other.arm @ other.arm),
        )
    return lambda times: np.array(
        [next(sol(t)[0] for _, end, sol in pieces if t <= end + 1e-12) for t in times]
    )


@pytest.mark.parametrize("pivot", ["bilateral", "unilateral"])
@pytest.mark.parametrize("tilt", [0.1, -0.1])
def test_free_rocking_is_lagranges(tilt, pivot):
    """1.2 s of free rocking over several landings, to 1e-9 rad, whichever pivot comes first; energy
    is kept between impacts."""
    scene = scene_of(duration=1.2, initial_rotation=tilt)
    history = EventBasedModel(pivot=pivot, tolerance=1e-13).simulate(scene)
    c = history.channels
    assert len([e for e in history.event_list if e.kind == "floor impact"]) >= 2
    np.testing.assert_allclose(c["theta"], rocking_by_lagrange(scene)(c["t"]), atol=1e-9)
    energy = kinematics.energy(
        RACK, G, *(c[name] for name in ("y", "theta", "x_dot", "y_dot", "theta_dot"))
    )
    first = c["t"] < history.event_list[0].t
    assert np.ptp(energy[first]) < 1e-11
    assert energy[0] == pytest.approx(
        Lagrangian(RACK, "left" if tilt > 0 else "right").energy(tilt, 0.0), abs=1e-12
    )


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_pulse_is_lagranges(sense):
    """Rocking on both pivots and landings under a pulse, to 1e-8 rad."""
    scene = scene_of(
        duration=1.4,
        excitation=Sine(amplitude=sense * 6.0, period=0.7),
        initial_rotation=-0.05 * sense,
    )
    history = EventBasedModel(friction="no-slip", tolerance=1e-13).simulate(scene)
    theta = history.channels["theta"]
    assert min(np.max(theta), -np.min(theta)) > 0.02
    np.testing.assert_allclose(theta, rocking_by_lagrange(scene)(history.channels["t"]), atol=1e-8)


def test_pivots_of_a_block():
    """p, alpha and R of both pivots; the weaker one's are the block's, and those of a homogeneous
    block Housner's."""
    for side in ("left", "right"):
        body, pivot = Lagrangian(RACK, side), RACK.pivot(side)
        radius = float(np.hypot(*body.arm))
        assert (pivot.alpha, pivot.radius) == pytest.approx(
            (math.atan2(abs(body.arm[0]), body.arm[1]), radius), rel=1e-15
        )
        assert pivot.frequency_parameter(G) == pytest.approx(
            math.sqrt(G * radius / (body.inertia + radius**2)), rel=1e-14
        )
    assert RACK.alpha == RACK.pivot("right").alpha < RACK.pivot("left").alpha
    plain = Block(half_width=0.3, half_height=1.0)
    assert plain.pivot("left") == plain.pivot("right")
    assert plain.frequency_parameter == math.sqrt(0.75 * G / math.hypot(0.3, 1.0))


@pytest.mark.parametrize("pivot", ["bilateral", "unilateral"])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_uplift_at_the_least_acceleration_of_each_side(sense, pivot):
    """On a base whose acceleration rises evenly the block leaves the floor where it passes g tan
    alpha of that side's pivot."""
    side = RACK.pivot("left" if sense > 0.0 else "right")
    ramp = Record.from_samples(sense * np.linspace(0.0, 0.6 * G, 601), 0.01)
    history = EventBasedModel(pivot=pivot, tolerance=1e-12).simulate(
        scene_of(mu=0.9, duration=6.0, excitation=ramp)
    )
    uplift = history.event_list[0]
    assert uplift.kind == "uplift"
    assert uplift.t == pytest.approx(side.arm / side.height / 0.6 * 6.0, abs=1e-9)


@pytest.mark.parametrize("model", ["bilateral", "unilateral", "bouc-wen"])
def test_the_mirror_image_is_the_same_to_the_bit(model):
    """Thirty loaded blocks: left and right exchanged, with record, walls and mass, give the
    mirrored history."""
    player = (
        EventBasedModel(friction="bouc-wen", tolerance=1e-7)
        if model == "bouc-wen"
        else EventBasedModel(pivot=model)
    )
    rng = np.random.default_rng(12)
    for _ in range(30):
        scene = random_scene(rng)
        assert_mirror_images(player.simulate(scene), player.simulate(scene.mirrored()))


def test_the_homogeneous_block_is_the_symmetric_instance():
    """Given as one that has its mass in the middle and a homogeneous box's inertia, it moves as
    ever but for rounding."""
    block = Block(half_width=0.3, half_height=1.0)
    same = Block(
        half_width=0.3, half_height=1.0, mass=3.0, moment_of_inertia=3.0 * (0.3**2 + 1.0) / 3.0
    )
    near = Block(half_width=0.3, half_height=1.0, centre_of_mass=(1e-13, 0.0))
    assert Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.0, 0.0)) == block
    walls = [Wall(side="left", gap=0.03, restitution=0.4)]
    scene = scene_of(
        block, 0.4, excitation=Ricker(amplitude=7.0, period=0.9), walls=walls, duration=3.0
    )
    for pivot in ("bilateral", "unilateral"):
        model = EventBasedModel(pivot=pivot, tolerance=1e-12)
        plain = model.simulate(scene).channels["theta"]
        for again in (same, near):
            np.testing.assert_allclose(
                model.simulate(scene.replace(block=again)).channels["theta"], plain, atol=1e-8
            )


def test_what_is_decided_early_is_what_comes():
    """Outcomes and peaks of 60 loaded blocks by a batch that stops when all is certain, and by runs
    to the end."""
    rng, model = np.random.default_rng(13), EventBasedModel(tolerance=1e-11)
    scenes = [random_scene(rng).replace(walls=(), duration=25.0) for _ in range(60)]
    early, late = (
        run_batch(pack(scenes, model), model, jobs=1, until_decided=decided)
        for decided in (True, False)
    )
    np.testing.assert_array_equal(early.side, late.side)
    assert {-1, 0, 1} == set(early.side.tolist())
    np.testing.assert_allclose(early.peak, late.peak, rtol=0.0, atol=1e-11)
    assert np.sum(early.series) < np.sum(late.series)
