"""A block in a step, as tests of the parts of a step share it."""

import numpy as np

from rockcheck import Block, Floor, Scene, Wall
from rockcheck.cm.geometry import Step, corners_at
from rockcheck.cm.start import initial_state, parameters_of

G = 9.81
STIFFNESS = 1e8
#: A block whose mass lies off its middle, between two walls.
LOADED = Scene(
    name="parts",
    block=Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.08, -0.2)),
    floor=Floor(friction=0.3, static_friction=0.4, restitution=0.25),
    walls=[
        Wall(side="left", gap=0.02, restitution=0.5),
        Wall(side="right", gap=0.07, restitution=0.75),
    ],
    duration=1.0,
    output_step=0.01,
)


def parameters(scene=LOADED, **change):
    made = parameters_of(scene, STIFFNESS, 3e-4, calibrated=True)
    return made._replace(**change)


def state_of(scene=LOADED):
    return initial_state(scene, parameters(scene))


def step_at(made, *, place=(0.0, 0.8), theta=0.1, v0=(0.3, -0.4, 0.7), length=1e-4, t=1.0):
    """A step whose middle is at `place` and `theta`."""
    return Step(*place, corners_at(made.reach, theta), v0, length, t)


def free_motion(step, theta, v, since):
    """Place of the mass's centre and rotation that far from the middle, at the velocity `v`."""
    vx, vy, w = v
    return np.array([step.x + since * vx, step.y + since * vy]), theta + since * w
