"""Blocks that are not homogeneous, and scenes of them."""

import math

import numpy as np

from rockcheck.scenes import Block, Floor, Ricker, Scene, Wall

G = 9.81
#: A rack loaded low and to the right: its right pivot is the weaker one.
RACK = Block(
    half_width=0.3,
    half_height=1.0,
    mass=400.0,
    centre_of_mass=(0.08, -0.25),
    moment_of_inertia=110.0,
)


def scene_of(block: Block = RACK, mu: float = 0.6, duration: float = 4.0, **more: object) -> Scene:
    return Scene(
        **{
            "name": "loaded",
            "block": block,
            "floor": Floor(friction=mu),
            "duration": duration,
            "output_step": 0.002,
        }
        | more
    )


def places(block: Block, theta: float, sense: int, case: int) -> tuple[np.ndarray, np.ndarray]:
    """The pivot of a block that tips to `sense` (+1 left), and its corner toward the tip wall (case
    1) or the far wall (-1): from the mass's centre, in the world."""
    turn = np.array([[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]])
    size = np.array([block.half_width, block.half_height])
    pivot, corner = np.array([(-sense, -1), (-sense * case, case)]) * size - block.offset
    return turn @ pivot, turn @ corner


def random_scene(rng: np.random.Generator) -> Scene:
    b, h = rng.uniform(0.1, 0.5), rng.uniform(0.4, 1.5)
    place = (rng.uniform(-0.6, 0.6) * b, rng.uniform(-0.6, 0.6) * h)
    block = Block(
        half_width=b,
        half_height=h,
        centre_of_mass=place,
        moment_of_inertia=rng.uniform(0.2, 0.5) * (b * b + h * h),
    )
    mu = rng.uniform(0.1, 0.9) * block.least_painleve_friction
    walls = [
        Wall(
            side=side,
            gap=float(rng.choice([0.0, rng.uniform(0.0, 0.1)])),
            restitution=float(rng.choice([0.0, 0.5])),
        )
        for side in ("left", "right")
        if rng.uniform() < 0.6
    ]
    pulse = Ricker(amplitude=G * block.slope * rng.uniform(1.0, 4.0), period=rng.uniform(0.4, 1.5))
    return scene_of(
        block, min(mu, 1.0), walls=walls, excitation=pulse, duration=3.0, output_step=0.01
    )
