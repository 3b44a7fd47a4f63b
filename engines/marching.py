"""Common parts of every engine's march: unit of length, fixed steps, states at output times."""

import math

import numpy as np

from rockcheck.engines.world import FloatArray, World
from rockcheck.scenes import Block, ModelFailure, Scene, kinematics
from rockcheck.scenes.progress import tell

Marched = tuple[
    FloatArray, FloatArray, FloatArray
]  # times (n) and states (n, 6) at step ends, felt accelerations (n-1, 2)
STEPS_AT_ONCE = 2048
#: Where a block lies on its side: contacts stop it a hair before a quarter turn, or after it.
LYING = math.pi / 2 - 1e-6
BLOWN_UP = 1e6  # m, rad, m/s or rad/s: no scene comes near it


def in_units_of(length: float, scene: Scene) -> Scene:
    """The scene with all lengths in units of `length` m.

    An engine's absolute tolerances then fit any block.
    """
    block, (dx, dz) = scene.block, scene.block.offset
    return scene.replace(
        block=Block(  # of 1 kg
            half_width=block.half_width / length,
            half_height=block.half_height / length,
            centre_of_mass=(dx / length, dz / length),
            moment_of_inertia=None
            if block.moment_of_inertia is None
            else block.gyration_squared / length**2,
        ),
        walls=tuple(wall.replace(gap=wall.gap / length) for wall in scene.walls),
        excitation=scene.excitation.scaled(1.0 / length),
        vertical=scene.vertical.scaled(1.0 / length),
        initial_velocity=scene.initial_velocity / length,
        initial_height=scene.initial_height / length,
        gravity=scene.gravity / length,
    )


def march_fixed(world: World, scene: Scene, times: FloatArray, felt: FloatArray) -> Marched:
    """Times, states of the mass's centre at step ends, felt accelerations, until the block lies.

    The first state in which the block lies is the last one returned. Raises `ModelFailure` if the
    motion blows up or the block falls through the floor.
    """
    dt = float(times[1]) if len(times) > 1 else 0.0
    pieces = [kinematics.of_mass(scene.block, np.array(scene.initial_state))[None, :]]
    world.place(*pieces[0][0].tolist())
    for first in range(0, len(felt), STEPS_AT_ONCE):
        tell(first, len(felt))
        states = world.march(felt[first : first + STEPS_AT_ONCE], dt)
        tipped = np.flatnonzero(np.abs(states[:, 2]) >= LYING)
        if tipped.size:
            states = states[: tipped[0] + 1]
        if not np.all(np.abs(states) < BLOWN_UP):  # catches nan, too
            raise ModelFailure(
                f"the motion blew up between t = {times[first]:g} and"
                f" {times[first + len(states)]:g} s"
            )
        if np.any(states[:, 1] < 0.0):
            raise ModelFailure(
                f"the block fell through the floor before t = {times[first + len(states)]:g} s: is"
                " the step too long?"
            )
        pieces.append(states)
        if tipped.size:
            break
    marched = np.concatenate(pieces)
    return times[: len(marched)], marched, felt


def at_output_times(scene: Scene, times: FloatArray, states: FloatArray) -> FloatArray:
    """States on the output grid: positions by cubic Hermite interpolation, velocities linear.

    Velocities jump at impacts, where a cubic would overshoot.
    """
    from scipy.interpolate import CubicHermiteSpline

    wanted = scene.output_times
    wanted = wanted[wanted <= times[-1] * (1.0 + 1e-12) + 1e-12]
    if len(times) == 1:
        return states[: len(wanted)]
    inside = np.minimum(wanted, times[-1])
    positions = CubicHermiteSpline(times, states[:, :3], states[:, 3:])(inside)
    velocities = np.column_stack(
        [np.interp(inside, times, states[:, column]) for column in (3, 4, 5)]
    )
    return np.hstack([positions, velocities])
