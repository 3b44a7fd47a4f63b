"""Exact motions to hold the engines against."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from rockcheck import engines
from rockcheck.scenes import Block, Floor, Ricker, Scene, Wall
from rockcheck.scenes.scene import PAPER_BLOCK

ALL = [
    engine for engine in (getattr(engines, name) for name in engines.__all__) if engine.installed()
]
DOUBLE = [engine for engine in ALL if engine.precision == "double"]
SINGLE = [engine for engine in ALL if engine.precision == "single"]
VARYING = [engine for engine in ALL if not engine.fixed_because]
BOUNCING = [engine for engine in DOUBLE if engine.bounces_with]
#: Engines whose tests take their time.
MARKS = {"dart": pytest.mark.long} | dict.fromkeys(("drake", "physx", "jolt"), pytest.mark.slow)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Every engine that is installed: as a class, as one of that precision, as one whose steps can
    vary, or as a model in double precision with its steps; some take their time."""

    def parameters(models: list[Any]) -> list:
        return [pytest.param(one, marks=MARKS.get(one.name, ())) for one in models]

    fixed, bouncing = ([one(time_step=1e-4) for one in some] for some in (DOUBLE, BOUNCING))
    adaptive = [one(time_step="adaptive") for one in VARYING]
    for name, models in {
        "engine": ALL,
        "double_engine": DOUBLE,
        "single_engine": SINGLE,
        "varying_engine": VARYING,
        "bouncing_engine": BOUNCING,
        "model": [*fixed, *adaptive],
        "bouncing_model": [*bouncing, *adaptive],
    }.items():
        if name in metafunc.fixturenames:
            words = [
                f"{one.name} {one.time_step}" if "model" in name else one.name for one in models
            ]
            metafunc.parametrize(name, parameters(models), ids=words)


@pytest.fixture(scope="session")
def block() -> Block:
    """The paper's block, alpha = 0.25."""
    return PAPER_BLOCK


@pytest.fixture(scope="session")
def free_rocking() -> Callable[[float], Scene]:
    """Free rocking from a tilt, given in alpha, on a floor that holds the pivot."""

    def scene(tilt: float) -> Scene:
        return Scene(
            name="free rocking",
            block=PAPER_BLOCK,
            floor=Floor(friction=1.0),
            initial_rotation=tilt * PAPER_BLOCK.alpha,
            duration=4.0,
        )

    return scene


@pytest.fixture(scope="session")
def pulse() -> Callable[..., Scene]:
    """A Ricker pulse: amplitude in g tan(alpha), frequency in p; friction and walls as given."""

    def scene(
        amplitude: float,
        frequency: float,
        friction: float = 1.0,
        walls: Sequence[Wall] = (),
        duration: float = 4.0,
    ) -> Scene:
        excitation = Ricker(
            amplitude=amplitude * 9.81 * math.tan(PAPER_BLOCK.alpha),
            period=2 * math.pi / (frequency * PAPER_BLOCK.frequency_parameter),
        )
        return Scene(
            name="pulse",
            block=PAPER_BLOCK,
            floor=Floor(friction=friction),
            walls=walls,
            excitation=excitation,
            duration=duration,
        )

    return scene


def rocking_rotation(scene: Scene) -> NDArray[np.float64]:
    """theta on the output grid of a block that rocks without slip and loses speed by Housner's
    ratio, to about 1e-10."""
    block, g = scene.block, scene.gravity
    alpha, ratio = block.alpha, 1.0 - 1.5 * math.sin(block.alpha) ** 2
    times = scene.output_times
    rotation = np.zeros_like(times)

    def shaking(t: float) -> float:
        return float(scene.excitation.acceleration(t))

    t, theta, w = 0.0, scene.initial_rotation, scene.initial_angular_velocity
    if theta == 0.0 and w == 0.0:
        fine = np.linspace(0.0, scene.duration, 20001)
        above = int(
            np.flatnonzero(np.abs(scene.excitation.acceleration(fine)) > math.tan(alpha) * g)[0]
        )
        t = brentq(
            lambda s: abs(shaking(s)) - math.tan(alpha) * g,
            fine[above - 1],
            fine[above],
            xtol=1e-14,
        )
        side = math.copysign(1.0, shaking(t))
    else:
        side = math.copysign(1.0, theta or w)
    for _ in range(200):

        def motion(t: float, y: NDArray[np.float64], side: float = side) -> list[float]:
            lever = alpha - side * y[0]
            return [
                y[1],
                0.75 / block.radius * (shaking(t) * math.cos(lever) - side * math.sin(lever) * g),
            ]

        def lands(t: float, y: NDArray[np.float64], side: float = side) -> float:
            return side * float(y[0])

        lands.terminal, lands.direction = True, -1.0  # type: ignore[attr-defined]
        part = solve_ivp(
            motion,
            (t, scene.duration),
            [theta, w],
            events=lands,
            rtol=1e-11,
            atol=1e-13,
            method="DOP853",
            dense_output=True,
            max_step=0.02,
        )
        inside = (times >= t) & (times <= part.t[-1])
        rotation[inside] = part.sol(times[inside])[0]
        t, theta, w, side = part.t[-1], 0.0, ratio * part.y[1, -1], -side
        if part.status == 0 or abs(w) < 1e-5:
            return rotation
    raise AssertionError("too many impacts")


@pytest.fixture(scope="session")
def rotation_error() -> Callable[[NDArray[np.float64], Scene], float]:
    """RMS of theta against exact rocking, in alpha."""
    known: dict[Scene, NDArray[np.float64]] = {}

    def error(theta: NDArray[np.float64], scene: Scene) -> float:
        if scene not in known:
            known[scene] = rocking_rotation(scene)
        assert len(theta) == len(known[scene])
        return float(np.sqrt(np.mean((theta - known[scene]) ** 2))) / scene.block.alpha

    return error
