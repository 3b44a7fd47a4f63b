"""Pulses in the block's own units, runs of independent programs with the scenes that they played
(tests/data/README.md says what the columns mean), and blocks that are not homogeneous."""

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np

from rockcheck.ebm import Spectrum
from rockcheck.scenes import PAPER_BLOCK, Block, Floats, Floor, Ricker, Scene, Wall
from rockcheck.validation.paper import paper_panels

DATA = Path(__file__).parents[1] / "data"
Row = dict[str, str]


def rows_of(name: str) -> list[Row]:
    with (DATA / name).open(newline="", encoding="utf-8") as table:
        return list(csv.DictReader(table))


BILATERAL = rows_of("ebm_ricker_cases.csv")
UNILATERAL = rows_of("unilateral_ricker_cases.csv")
#: The unilateral runs in which rigid bodies have one answer.
UNAMBIGUOUS = [row for row in UNILATERAL if row["depends_on_rule"] == "0"]


def kept_spectra() -> list[Spectrum]:
    """The paper's 28 spectra as they were once computed, 100 x 100 nodes each."""
    data = np.load(DATA / "paper_spectra.npz")
    return [
        Spectrum(
            outcomes=data[panel.name],
            frequency_ratios=data["frequency_ratios"],
            amplitude_ratios=data["amplitude_ratios"],
            evaluations=data[panel.name].size,
            undecided=data[f"{panel.name}.undecided"],
            scene=panel.scene,
            model=None,
        )
        for panel in paper_panels()
    ]


def ricker(frequency: float, amplitude: float, block: Block = PAPER_BLOCK) -> Ricker:
    """A pulse of omega_p = `frequency` p and a_p = `amplitude` g tan(alpha)."""
    return Ricker(
        amplitude=amplitude * 9.81 * math.tan(block.alpha),
        period=2.0 * math.pi / (frequency * block.frequency_parameter),
    )


def pulse_scene(
    frequency: float,
    amplitude: float,
    mu: float,
    wall: tuple[str, float, float] | None = None,
    **more: Any,
) -> Scene:
    """The paper's block under a Ricker pulse, perhaps beside a wall: its side, gap, restitution."""
    return Scene(
        **{
            "name": "pulse",
            "block": PAPER_BLOCK,
            "floor": Floor(friction=mu),
            "walls": [dict(zip(("side", "gap", "restitution"), wall, strict=True))] if wall else [],
            "excitation": ricker(frequency, amplitude),
            "duration": 5.0,
        }
        | more
    )


def free_rocking(tilt: float, **more: Any) -> Scene:
    """The paper's block from a tilt, given in alpha, on a floor that holds the pivot."""
    return Scene(
        **{
            "name": "free rocking",
            "block": PAPER_BLOCK,
            "floor": Floor(friction=1.0),
            "initial_rotation": tilt * PAPER_BLOCK.alpha,
            "duration": 4.0,
        }
        | more
    )


def scene_of(row: Row, rest: float = 20.0, **more: Any) -> Scene:
    """The scene of a run, up to a time after its pulse."""
    frequency, amplitude, mu = (float(row[name]) for name in ("wp_over_p", "ap_ratio", "mu"))
    wall = (row["side"], float(row["gap"]), float(row["e_w"])) if row["gap"] else None
    return pulse_scene(
        *(frequency, amplitude, mu, wall),
        duration=4.0 * ricker(frequency, amplitude).period + rest,
        **more,
    )


def peak_errors(
    model: Any, rows: list[Row], rest: float, output_step: float
) -> tuple[Floats, list[Row]]:
    """Errors of the peak of |theta|, in alpha, where the block stays, and the rows whose outcome is
    another. Peaks at a wall are sharp: rows must be close."""
    errors, missed = [], []
    for row in rows:
        history = model.simulate(scene_of(row, rest, output_step=output_step))
        names = {"overturned left": "ccw", "overturned right": "cw"}
        if names.get(history.outcome, "safe") != row["outcome"]:
            missed.append(row)
        elif row["outcome"] == "safe":
            errors.append(
                abs(history.peak_rotation / PAPER_BLOCK.alpha - float(row["peak_theta_over_alpha"]))
            )
    return np.array(errors), missed


G = 9.81
#: A rack loaded low and to the right: its right pivot is the weaker one.
RACK = Block(
    half_width=0.3,
    half_height=1.0,
    mass=400.0,
    centre_of_mass=(0.08, -0.25),
    moment_of_inertia=110.0,
)


def block_scene(block: Block = RACK, mu: float = 0.6, **more: Any) -> Scene:
    return Scene(
        **{
            "name": "block",
            "block": block,
            "floor": Floor(friction=mu),
            "duration": 4.0,
            "output_step": 0.002,
        }
        | more
    )


def places(block: Block, theta: float, sense: int, case: int) -> tuple[np.ndarray, np.ndarray]:
    """The pivot of a block that tips to `sense` (+1 left), and its corner toward the tip wall (case
    1) or the far wall (-1): from the mass's centre, in the world."""
    turn = np.array([[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]])
    signs = np.array([(-sense, -1), (-sense * case, case)])
    pivot, corner = signs * [block.half_width, block.half_height] - block.offset
    return turn @ pivot, turn @ corner


def random_scene(rng: np.random.Generator) -> Scene:
    b, h = rng.uniform(0.1, 0.5), rng.uniform(0.4, 1.5)
    block = Block(
        half_width=b,
        half_height=h,
        centre_of_mass=(rng.uniform(-0.6, 0.6) * b, rng.uniform(-0.6, 0.6) * h),
        moment_of_inertia=rng.uniform(0.2, 0.5) * (b * b + h * h),
    )
    return block_scene(
        block,
        min(rng.uniform(0.1, 0.9) * block.least_painleve_friction, 1.0),
        walls=[
            Wall(
                side=side,
                gap=float(rng.choice([0.0, rng.uniform(0.0, 0.1)])),
                restitution=float(rng.choice([0.0, 0.5])),
            )
            for side in ("left", "right")
            if rng.uniform() < 0.6
        ],
        excitation=Ricker(
            amplitude=G * block.slope * rng.uniform(1.0, 4.0), period=rng.uniform(0.4, 1.5)
        ),
        duration=3.0,
        output_step=0.01,
    )
