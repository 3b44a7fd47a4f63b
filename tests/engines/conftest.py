"""The engines that are installed, and the continuous model, as tests ask for them."""

import pytest

from rockcheck import ContinuousModel
from rockcheck.engines import registry

ALL = [facts.engine for facts in registry.every() if facts.engine.installed()]
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

    minutes = metafunc.definition.get_closest_marker("slow_for")
    slow = dict.fromkeys(minutes.args if minutes else (), pytest.mark.slow)
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
            marked = [pytest.param(one, marks=(MARKS | slow).get(one.name, ())) for one in models]
            metafunc.parametrize(name, marked, ids=words)
