"""What the tests of the event-based models share."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from rockcheck.scenes import Block, Floor, Ricker, Scene, Wall
from rockcheck.scenes.scene import PAPER_BLOCK


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
def block() -> Block:
    """The paper's block, alpha = 0.25."""
    return PAPER_BLOCK


@pytest.fixture(scope="session")
def run_to_end() -> Runner:
    """Runs a scene to its end without sampling it; the compiled loop is called as the model calls
    it."""
    from rockcheck.ebm import natural
    from rockcheck.ebm.core import march, motion

    scratch = motion.workspace()

    def run(
        scene: Scene, *, pivot: str = "bilateral", tolerance: float = 1e-12, impacts: str = "moreau"
    ) -> Run:
        setting = natural.setting_of(
            scene,
            unilateral=pivot == "unilateral",
            no_slip=False,
            energy_cap=False,
            impacts=impacts,
        )
        state = natural.state_of(scene)
        control = march.Control(tolerance, 1_000_000, 200_000, False, 1.0)
        unit, radius = natural.time_unit(scene), scene.block.radius
        nothing = np.empty((0, 6)), np.empty(0, dtype=np.int8), np.empty((0, 5))
        tally, _ = march.run(
            setting,
            *natural.grounds_of(scene),
            state,
            scene.duration / unit,
            control,
            *nothing,
            *scratch,
        )
        return Run(
            ending=tally.ending,
            t=tally.t * unit,
            x=state[0] * radius,
            theta=state[2],
            peak=tally.peak / scene.block.alpha,
            wall_impacts=tally.wall_impacts,
            steps=tally.steps,
            energy_gains=tally.gains,
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
        pulse = Ricker(
            amplitude=amplitude * 9.81 * math.tan(block.alpha),
            period=2.0 * math.pi / (frequency * block.frequency_parameter),
        )
        return Scene(
            **{
                "name": "pulse",
                "block": block,
                "floor": Floor(friction=mu),
                "walls": walls,
                "excitation": pulse,
                "duration": 5.0,
            }
            | more
        )

    return scene
