"""The core's names, by theme. Compiled code reads a member as the number that it stands for."""

from __future__ import annotations

import itertools
from enum import IntEnum


class Family(IntEnum):
    """Whether a block translates upright (theta = 0) or is tilted."""

    FLAT = 0
    TILT = 1


class Pivot(IntEnum):
    """What the pivot (or, flat, the base) does on the floor."""

    OFF = 0
    STICK = 1
    SLIPPING = 2


class Shape(IntEnum):
    """What a component of the base motion is made of (see `ebm.core.ground`)."""

    STILL = 0
    GAUSSIAN = 1
    SINE = 2
    SAMPLED = 3


class Kind(IntEnum):
    """What a series is made of: its noise, and how far ahead it is judged, differ."""

    POSITION = 0
    RATE = 1
    FORCE = 2


class Row(IntEnum):
    """Rows of the workspace."""

    # Series of the motion, in the letters of ebm.core.motion.
    PHI = 0
    OMEGA = 1
    SIN = 2
    COS = 3
    U = 4
    G = 5
    XI = 6
    Y = 7
    P = 8
    Q = 9
    NA = 10
    NB = 11
    #: The guard that is looked at.
    GUARD = 12
    # What the general solution needs: known terms, forces found, arms, and the walls' push.
    KNOWN = 13
    FOUND = 14
    FLOOR_ARM = 15
    WALL_ARM = 16
    WALL_PUSH = 17
    # Rows in which the small linear system of the contacts is put together, three each.
    CONSTRAINT = 18
    COLUMN = 21
    MATRIX = 24
    INVERSE = 27
    #: The last angle whose sine and cosine were taken, and these: the end of a step is the start of
    #: the next one.
    ANGLE = 30
    #: The guards of the mode, a row each: the weights of the series in it (see ebm.core.guards).
    TABLE = 31
    # Bouc-Wen friction: z, V and what the recurrences need.
    Z = 45
    V = 46
    Z2 = 47
    SPIN2 = 48
    WEIGHT = 49
    ARM = 50
    TURN = 51
    REACH = 52
    INERTIA = 53
    LOAD = 54
    PUSH = 55
    ZA = 56
    LEVER = 57
    DEN = 58
    TORQUE = 59


ROWS = 60


class Guard(IntEnum):
    """What must not turn negative in a mode, in order of priority at one instant: floor before
    walls, contacts before friction."""

    NONE = -1
    PHI = 0
    TOPPLE = 1
    LANDING = 2
    TIP_GAP = 3
    FAR_GAP = 4
    FLOOR_PUSH = 5
    TIP_PUSH = 6
    FAR_PUSH = 7
    CONE_PLUS = 8
    CONE_MINUS = 9
    SLIP = 10
    UPLIFT_PLUS = 11
    UPLIFT_MINUS = 12
    #: Bouc-Wen friction: z comes to the sign of V, from where the pivot loads.
    LOADS = 13


GUARDS = 14


class Event(IntEnum):
    """Events of the log."""

    UPLIFT = 0
    SLIPS = 1
    STICKS = 2
    FLOOR_IMPACT = 3
    WALL_IMPACT = 4
    LIFT_OFF = 5
    LANDS = 6
    RELEASE = 7
    SETTLED = 8
    FELL_LEFT = 9
    FELL_RIGHT = 10
    # Not in the log: none; the end of rest, whose event depends on the next mode.
    UNTOLD = -1
    LEAVES_REST = -2


#: Names of the events, and of the modes' codes (see ebm.core.running).
EVENT_NAMES = (
    "uplift",
    "slip",
    "stick",
    "floor impact",
    "wall impact",
    "lift-off",
    "landing",
    "release",
    "settled",
    "overturned left",
    "overturned right",
)
MODE_NAMES = ("rest", "slide", "rock", "slide-rock", "lean", "ladder", "flight")


class Ending(IntEnum):
    """How a run ended."""

    GOING = -1
    DONE = 0
    OVERTURNED = 1
    TOO_MANY_STEPS = 2
    TOO_MANY_EVENTS = 3
    NOT_FINITE = 4


FAILURES: dict[int, str] = {
    Ending.TOO_MANY_STEPS: "the cap on steps was reached",
    Ending.TOO_MANY_EVENTS: "the cap on events was reached",
    Ending.NOT_FINITE: "the motion is not finite",
}


class Law(IntEnum):
    """The laws of impacts at several contacts (see ebm.core.laws.contact_impacts)."""

    MOREAU = 0
    CLOSED_BRANCH = 1
    OPEN_BRANCH = 2
    FLOOR_FIRST = 3
    LEADING_FIRST = 4
    TRAILING_FIRST = 5


#: As a model's settings name them.
LAWS = ("moreau", "closed", "open", "floor-first", "leading-first", "trailing-first")


class Contact(IntEnum):
    """The six contacts: the pivot and the other bottom corner on the floor, the top and bottom
    corner on the tip wall, the bottom and top corner on the far wall; and the floor's tangent."""

    FOOT = 0
    OTHER = 1
    TIP_TOP = 2
    TIP_BOTTOM = 3
    FAR_BOTTOM = 4
    FAR_TOP = 5
    TANGENT = 6


CONTACTS = 6
#: Every set of at most three contacts.
CONTACT_SETS = [some for n in range(4) for some in itertools.combinations(range(CONTACTS), n)]


class Friction(IntEnum):
    """Friction in a set of contacts: none, sticking, slip to either side."""

    FREE = 0
    HELD = 1
    PLUS = 2
    MINUS = 3


class Found(IntEnum):
    """What came of an impact: its stages do not end, all obey the law, or one violates it least."""

    ENDLESS = 0
    FITS = 1
    LEAST_WRONG = 2


class Landing(IntEnum):
    """Forms of the paper's floor impact."""

    HELD_FAST = 0
    SLID = 1
    FLAT_END = 2


class Branch(IntEnum):
    """Branches of the wall impact's cascade, as the paper's Fig. 3 letters them."""

    A_STICK = 0
    B_STICK = 1
    C_STICK = 2
    D_SLIP = 3
    E_SLIP = 4
    NO_BRANCH = 5
