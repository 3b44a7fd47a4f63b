"""What the tests of the event-based models share."""

from collections.abc import Callable
from types import SimpleNamespace

import pytest
from stepping import play

from rockcheck.ebm import EventBasedModel, natural
from rockcheck.ebm.core.names import Ending
from rockcheck.ebm.core.state import workspace
from rockcheck.scenes import Scene


@pytest.fixture(scope="session")
def run_to_end() -> Callable[..., SimpleNamespace]:
    """Runs a scene to its end without sampling it; the compiled loop is called as the model calls
    it. Tells its time and place (SI units), the largest |theta|/alpha, located between the rows of
    a history, and the outcome, as the reference tables name it."""
    work = workspace()

    def run(scene: Scene, **settings: object) -> SimpleNamespace:
        model = EventBasedModel(**{"tolerance": 1e-12} | settings)
        found = play(scene, model, work)
        fallen = "ccw" if found.motion.theta > 0.0 else "cw"
        return SimpleNamespace(
            outcome={Ending.DONE: "safe", Ending.OVERTURNED: fallen}.get(found.ending, "failed"),
            t=found.t * natural.time_unit(scene),
            x=found.motion.x * scene.block.radius,
            peak=found.peak / scene.block.alpha,
            wall_impacts=int(found.wall_impacts),
        )

    return run
