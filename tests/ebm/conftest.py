"""What the tests of the event-based models share."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest
from cases import ricker
from stepping import play

from rockcheck.ebm import EventBasedModel, natural
from rockcheck.ebm.core.state import workspace
from rockcheck.scenes import Block, Floor, Scene, Wall


@dataclass(frozen=True)
class Run:
    """One run to its end, with what a History does not hold. SI units."""

    ending: int
    t: float
    x: float
    theta: float
    #: Largest |theta|/alpha, located between the rows of a history.
    peak: float
    wall_impacts: int
    steps: int
    energy_gains: int

    @property
    def outcome(self) -> str:
        """As the reference tables name it."""
        if self.ending == 0:
            return "safe"
        return (
            ("ccw" if self.theta > 0.0 else "cw") if self.ending == 1 else f"failed ({self.ending})"
        )


Runner = Callable[..., Run]


@pytest.fixture(scope="session")
def run_to_end() -> Runner:
    """Runs a scene to its end without sampling it; the compiled loop is called as the model calls
    it."""
    work = workspace()

    def run(
        scene: Scene, *, pivot: str = "bilateral", tolerance: float = 1e-12, impacts: str = "moreau"
    ) -> Run:
        model = EventBasedModel(pivot=pivot, tolerance=tolerance, impacts=impacts)
        found = play(scene, model, work)
        return Run(
            ending=int(found.ending),
            t=found.t * natural.time_unit(scene),
            x=found.motion.x * scene.block.radius,
            theta=found.motion.theta,
            peak=found.peak / scene.block.alpha,
            wall_impacts=int(found.wall_impacts),
            steps=int(found.steps),
            energy_gains=int(found.gains),
        )

    return run


@pytest.fixture(scope="session")
def pulse_scene(block: Block) -> Callable[..., Scene]:
    """Makes a scene of the paper's block under a Ricker pulse of omega_p = `frequency` p and a_p =
    `amplitude` g tan(alpha)."""

    def scene(
        frequency: float,
        amplitude: float,
        mu: float,
        wall: tuple[str, float, float] | None = None,
        **more: object,
    ) -> Scene:
        walls = [Wall(side=wall[0], gap=wall[1], restitution=wall[2])] if wall else []
        return Scene(
            **{
                "name": "pulse",
                "block": block,
                "floor": Floor(friction=mu),
                "walls": walls,
                "excitation": ricker(frequency, amplitude, block),
                "duration": 5.0,
            }
            | more
        )

    return scene
