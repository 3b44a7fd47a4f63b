"""Exact motions to hold the engines against."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from cases import ricker
from numpy.typing import NDArray
from paper_model import PaperModel

from rockcheck import ContinuousModel, Floor, Scene, Wall, engines
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
    vary, or as a model in double precision with its steps; some take their time. The continuous
    model is one of the models."""

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
        "model": [*fixed, *adaptive, ContinuousModel()],
        "bouncing_model": [*bouncing, *adaptive, ContinuousModel()],
    }.items():
        if name in metafunc.fixturenames:
            words = [
                f"{one.name} {one.time_step}" if "model" in name else one.name for one in models
            ]
            metafunc.parametrize(name, parameters(models), ids=words)


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
        return Scene(
            name="pulse",
            block=PAPER_BLOCK,
            floor=Floor(friction=friction),
            walls=walls,
            excitation=ricker(frequency, amplitude),
            duration=duration,
        )

    return scene


@pytest.fixture(scope="session")
def rotation_error() -> Callable[[NDArray[np.float64], Scene], float]:
    """RMS of theta against the paper's equations, in alpha."""
    known: dict[Scene, NDArray[np.float64]] = {}

    def error(theta: NDArray[np.float64], scene: Scene) -> float:
        if scene not in known:
            known[scene] = PaperModel(scene).run().at(scene.output_times)[:, 1]
        assert len(theta) == len(known[scene])
        return float(np.sqrt(np.mean((theta - known[scene]) ** 2))) / scene.block.alpha

    return error
