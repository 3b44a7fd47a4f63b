"""Adaptive stepping: an engine's contact solver in a third-order integrator with event location.

With a fixed step, an engine's error has two sources: the time of its impacts and a drift along the
arcs of its contacts. Both are of first order in the step. Here the engine only turns velocities
into velocities, at the mean pose of a step (drift, kick, drift). Step ends are placed where gaps
close, where slip stops and where a block at rest may start to move. An impact has a separate step,
so short that nothing else happens in it. Between events the acceleration changes smoothly from step
to step; that change corrects the drift, which is then of third order.
"""

import math
from collections.abc import Callable

import numpy as np

from rockcheck.engines.base_motion import BaseMotion
from rockcheck.engines.contacts import contacts_of
from rockcheck.engines.marching import Marched
from rockcheck.engines.world import Vector
from rockcheck.scenes import ModelFailure, Scene, kinematics
from rockcheck.scenes.progress import tell

#: Rows of the march for which there is room at first.
_ROOM = 8192


#: An engine as a map of velocities: that of the block after a step, from pose and velocity before
#: it, its length (s) and the felt acceleration (m/s^2), with the contacts closed at that pose. They
#: take their restitution only where the last argument says so; otherwise they stop what approaches.
Push = Callable[[Vector, Vector, float, tuple[float, float], bool], Vector]


def adaptive_march(
    scene: Scene, base: BaseMotion, push: Push, longest: float, short: float = 1.0
) -> Callable[[], Marched]:
    """The march of a scene until |theta| = pi/2, to be called once; its compiled step is loaded.

    The scene is one of a block with R = 1, see `engines.marching.in_units_of`; `base` is its base
    motion. No step is longer than `longest` s; the steps at impacts and after events are `short`
    times their usual length. The march raises `ModelFailure` if the motion blows up or needs more
    than 100,000 + 20 end / `longest` steps, `end` the scene's last output time.
    """
    from rockcheck.engines import stepping
    from rockcheck.scenes.compiled import for_types_of

    limits = stepping.limits_of(scene, longest, short)
    across, up = (
        (np.array(one.pieces or np.empty((0, 1))), one.interval, one.last)
        for one in (base.across, base.up)
    )
    course = stepping.Course(
        np.array([(*one.corner, *one.normal, one.distance) for one in contacts_of(scene)]),
        np.array([*base.starts, math.inf]),
        across,
        up,
        float(scene.output_times[-1]),
    )
    most_steps = 100_000 + 20 * int(course.end / longest)

    run = stepping.begun(
        np.array(kinematics.of_mass(scene.block, scene.initial_state), dtype=float),
        base.velocity(0.0),
        len(course.corners),
    )
    first = np.empty((_ROOM, stepping.COLUMNS))
    first[0, :7] = 0.0, *run.state[:6]
    step = for_types_of(stepping.step, run, course, limits, (0.0, 0.0, 0.0), first[0])
    planned = stepping.plan(run, course, limits)

    def march() -> Marched:
        rows, count, going = first, 1, planned
        while going:
            x, y, theta, vx, vy, w, dt, ax, ay, impact = run.asked.tolist()
            kicked = push((x, y, theta), (vx, vy, w), dt, (ax, ay), impact != 0.0)
            if count == len(rows):
                rows = np.concatenate([rows, np.empty_like(rows)])
            going = step(run, course, limits, kicked, rows[count])
            count += 1
            if count % 512 == 0:
                tell(rows[count - 1, 0], course.end)
            if going == stepping.LOST or count > most_steps:
                raise ModelFailure(
                    f"no end to the events, or a motion that blew up, after {count} steps at t ="
                    f" {rows[count - 1, 0]:g} s"
                )
        return rows[:count, 0].copy(), rows[:count, 1:7].copy(), rows[1:count, 7:].copy()

    return march
