"""The state of a run: one named record, and the constants of the run beside it.

In: nothing. Out: STATE with the records in it, and `Parameters`.
Called by every compiled module of the model; `cm.start` makes both.

SI units, forces and stiffness per unit mass; x to the right, y up, rotation counterclockwise.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rockcheck.cm.extremes import EXTREMES
from rockcheck.cm.geometry import SURFACES, Reach
from rockcheck.scenes.named_record import MOTION, record

#: What a contact remembers.
CONTACT = record(
    closed="?",
    # What the surface pushes with, m/s^2.
    force="f8",
    # Of its spring, 1/s^2, and of its damper, 1/s: chosen when it closes.
    stiffness="f8",
    damping="f8",
    # When it was last closed, s; -infinity before.
    last_closed="f8",
    # Of a strike that is not written yet: when it began (s, else infinity), its impulse so far and
    # the speed of approach, m/s.
    strike_time="f8",
    impulse="f8",
    speed="f8",
)
#: The friction of the floor.
FRICTION = record(
    # On the block, m/s^2, and the stretch of its spring, m; positive to the right.
    force="f8",
    stretch="f8",
    # Whether it slips, and whether it did a step ago.
    slips="?",
    slipped="?",
)
STATE = record(
    # The end of the last step, s, and the motion of the mass's centre then; both at its start.
    t="f8",
    motion=MOTION,
    past_t="f8",
    past_motion=MOTION,
    # A row a surface (LEFT_WALL, RIGHT_WALL, FLOOR), a column a corner: on walls the lower one, on
    # the floor the left one comes first.
    contacts=(CONTACT, (len(SURFACES), 2)),
    friction=FRICTION,
    extremes=EXTREMES,
    # The time from which on no contact is young, and the step that a young one needs; the time
    # until an open contact closes; when the first strike began that is not written yet, s.
    settle_time="f8",
    contact_step="f8",
    closing_time="f8",
    first_strike="f8",
    # The energy allowed by the work done on the block, and that work, every part of it positive,
    # m^2/s^2.
    allowed_energy="f8",
    absolute_work="f8",
    # The number of the next multiple of `GRID`.
    grid="i8",
    # Counts: steps, and sweeps over the surfaces.
    steps="i8",
    sweeps="i8",
)
#: A strike as it is written: when it began (s), its contact (twice the surface plus the corner),
#: its impulse and speed of approach (m/s).
STRIKE = record(t="f8", contact="i8", impulse="f8", speed="f8")
#: Strikes that are written, in rows.
Strikes = NDArray[np.void]


class Parameters(NamedTuple):
    """Constants of a run. Tuples hold one value a surface."""

    #: Of the block's sides from the mass's centre, m.
    reach: Reach
    #: Of the moment of inertia about the mass's centre, 1/m^2.
    inverse_inertia: float
    gravity: float
    #: k/m of a contact, 1/s^2.
    stiffness: float
    #: Of the floor's friction spring, 1/s.
    friction_damping: float
    mu_s: float
    mu_k: float
    restitution: tuple[float, ...]
    damping_ratio: tuple[float, ...]
    #: From the surface to where the mass's centre is 0 along its normal, m; infinite for no wall.
    distance: tuple[float, ...]
    #: Whether the damping of a contact is calibrated when it closes, or the paper's.
    calibrated: bool
    #: The longest step, s.
    time_step: float
    #: A contact that was open for longer strikes when it closes, and its impulse is gathered for as
    #: long, s.
    strike: float
    #: Below this |theta| the block is flat, rad.
    flat_angle: float
    #: The surfaces of the scene, the floor last.
    surfaces: NDArray[np.int64]
