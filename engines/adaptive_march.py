"""The state of an adaptive march between steps: a named record, and the course of its run.

In: a scene, the longest step (s), how short steps at events are, and the tolerance of a step.
Out: CONTACT, REQUEST and STATE; a run at its start.
Called by `engines.steps` (the start) and `engines.kernels`.

Lengths are in R, times in s. A base motion is its pieces, their interval and the last velocity.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rockcheck.engines import base_motion, contacts
from rockcheck.scenes import Floats, Scene, kinematics
from rockcheck.scenes.named_record import MOTION, record

Base = tuple[Floats, float, float]

# Lengths in units of the block's radius R, times in units of 1/p.
#: A corner nearer than this touches.
CLOSED = 5e-9
#: Per usual step: how far a resting corner may drift from its surface in one step; it sets the
#: contact distance where it exceeds CLOSED.
DRIFT = 3e-6
#: The longest step where the acceleration is not known, that is, after an event.
PROBE_STEP = 6e-5
#: An impact takes one: its time is wrong by so much, its place by what the block moves in it.
SHORTEST_STEP = 2e-8
#: From farther away the prediction of an event is only trusted to 95 %.
LONG_APPROACH = 6e-4
#: The same of slip that stops or begins, of the usual step, where steps follow a tolerance.
CLOSE = 0.1
#: Of g times the usual step: slower approaches and departures are not told from rest.
RESTING = 0.001
#: A corner that leaves and is back within twice this share of a step is taken to stay: of the
#: usual step, after an event of a probe.
SETTLING_TIME = 0.2

#: A contact: the corner from the mass's centre, in the block's own frame, the surface's normal and
#: its distance, see `engines.contacts`.
CONTACT = record(bx="f8", bz="f8", nx="f8", nz="f8", distance="f8")
#: What the engine is asked for: the block's mean pose in a step and its velocity; the length of the
#: step, the felt acceleration, and whether the step is an impact (1, else 0). All are numbers, so
#: that Python reads them at once as an array.
REQUEST = record(
    x="f8",
    y="f8",
    theta="f8",
    vx="f8",
    vy="f8",
    w="f8",
    dt="f8",
    felt_x="f8",
    felt_y="f8",
    impact="f8",
)
STATE = record(
    # The end of the last step; the motion of the mass's centre and the velocity of the base then.
    t="f8",
    motion=MOTION,
    base_x="f8",
    base_y="f8",
    # Mean acceleration and length of the step before, and whether they are known.
    ax="f8",
    ay="f8",
    spin="f8",
    past_dt="f8",
    known="?",
    # Whether the step ends where slip stops; the velocity at which a contact is carried along its
    # arc.
    stops="?",
    carry_x="f8",
    carry_y="f8",
    # Whether the acceleration goes on: it is known, and the closed contacts are those of the step
    # before.
    smooth="?",
    # How long the next step may be by the error of the last one.
    allowed="f8",
    # How much more friction a contact that sticks could take in the last step, in R/s^2, and how
    # fast that changes; infinite and zero where nothing sticks.
    margin="f8",
    margin_rate="f8",
)


class Course(NamedTuple):
    """The input of a run: what it meets, and how long and slow is long and slow; in R, s and R/s.

    Contacts (first the floor's two, then the walls'), times at which a step has to end (the base
    may set a resting block in motion; with a tolerance, its acceleration has a kink), the base
    motion to the right and up, the end of the run, and gravity;
    thresholds for near, short, long and slow. `standing` is the height of the centre of mass at
    rest. `tolerance` is the largest error of a step, in R and rad, infinite where steps are only
    limited by `longest`; `fine` is the longest one in which a contact opens. `friction` is the
    floor's coefficient.
    """

    corners: NDArray[np.void]
    stops: Floats
    across: Base
    up: Base
    end: float
    gravity: float
    standing: float
    longest: float
    closed: float
    probe: float
    shortest: float
    long_approach: float
    long_slowing: float
    resting: float
    settling: float
    tolerance: float
    fine: float
    friction: float


class March(NamedTuple):
    """The state of a run between steps.

    It holds the contacts closed in this step (`closed`) and in the step before (`before`). State
    and request to the engine are arrays of records: Python hands an array to compiled code faster
    than a record, which costs a step of an engine 5 to 30 % more. The second state is that before
    the step, to which a step with too large an error goes back.
    """

    states: NDArray[np.void]
    closed: NDArray[np.bool_]
    before: NDArray[np.bool_]
    requests: NDArray[np.void]


def start(
    scene: Scene, longest: float, usual: float, short: float, tolerance: float | None
) -> tuple[Course, March, Floats]:
    """A run at its start: steps of at most `longest` s, and near events `short` times their length.

    `tolerance` is the largest error of a step, in units of alpha and alpha R; without one steps
    are as long as `longest` and the events allow. What is near, slow and settled goes by the
    `usual` step, s. The last of the three is the request as an array, for Python: it shows what
    the record holds.
    """
    base = base_motion.velocity_of(scene.excitation), base_motion.velocity_of(scene.vertical)
    stops = set(base_motion.starts_of_motion(scene, *base))
    if tolerance is not None:
        stops |= {*scene.excitation.kinks, *scene.vertical.kinks}
    moment = short / scene.frequency_parameter
    across, up = (
        (np.array(one.pieces or np.empty((0, 1))), one.interval, one.last) for one in base
    )
    course = Course(
        corners=np.array(
            [
                (*contact.corner, *contact.normal, contact.distance)
                for contact in contacts.contacts_of(scene)
            ],
            CONTACT,
        ),
        stops=np.array([*sorted(stops), math.inf]),
        across=across,
        up=up,
        end=float(scene.run_times[-1]),
        gravity=scene.gravity,
        standing=scene.block.weaker_pivot.height,
        longest=longest,
        closed=max(CLOSED, DRIFT * usual * scene.frequency_parameter),
        probe=min(PROBE_STEP * moment, longest),
        shortest=min(SHORTEST_STEP * moment, longest),
        long_approach=LONG_APPROACH * moment,
        long_slowing=LONG_APPROACH * moment if tolerance is None else CLOSE * usual,
        resting=RESTING * usual * scene.gravity,
        settling=SETTLING_TIME * usual,
        tolerance=math.inf if tolerance is None else tolerance * scene.block.alpha,
        fine=usual,
        friction=scene.floor.friction,
    )
    place = kinematics.of_mass(scene.block, scene.initial_state)
    states = np.zeros(2, STATE)
    states["motion"] = tuple(place)
    states["allowed"] = longest
    states["margin"] = math.inf
    closed, before = np.zeros((2, len(course.corners)), dtype=bool)
    requests = np.zeros(1, REQUEST)
    return course, March(states, closed, before, requests), requests.view(float)
