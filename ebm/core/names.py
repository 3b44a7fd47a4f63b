"""The core's names, by theme. Compiled code reads a member as the number that it stands for."""

from __future__ import annotations

import itertools
from enum import IntEnum

#: Whether a block translates upright (theta = 0) or is tilted.
Family = IntEnum("Family", "FLAT TILT", start=0)

#: What the pivot (or, flat, the base) does on the floor.
Pivot = IntEnum("Pivot", "OFF STICK SLIPPING", start=0)

#: What a component of the base motion is made of (see `ebm.core.ground`).
Shape = IntEnum("Shape", "STILL GAUSSIAN SINE SAMPLED", start=0)

#: What a series is made of: its noise, and how far ahead it is judged, differ.
Kind = IntEnum("Kind", "POSITION RATE FORCE", start=0)

#: Rows of the workspace.
Row = IntEnum(
    "Row",
    {
        # Series of the motion, in the letters of ebm.core.motion.
        "PHI": 0,
        "OMEGA": 1,
        "SIN": 2,
        "COS": 3,
        "U": 4,
        "G": 5,
        "XI": 6,
        "Y": 7,
        "P": 8,
        "Q": 9,
        "NA": 10,
        "NB": 11,
        # The guard that is looked at.
        "GUARD": 12,
        # What the general solution needs: known terms, forces found, arms, and the walls' push.
        "KNOWN": 13,
        "FOUND": 14,
        "FLOOR_ARM": 15,
        "WALL_ARM": 16,
        "WALL_PUSH": 17,
        # Rows in which the small linear system of the contacts is put together, three each.
        "CONSTRAINT": 18,
        "COLUMN": 21,
        "MATRIX": 24,
        "INVERSE": 27,
        # The last angle whose sine and cosine were taken, and these: the end of a step is the start
        # of the next one.
        "ANGLE": 30,
        # The guards of the mode, a row each: the weights of the series in it (see ebm.core.guards).
        "TABLE": 31,
        # Bouc-Wen friction: z, V and what the recurrences need.
        "Z": 45,
        "V": 46,
        "Z2": 47,
        "SPIN2": 48,
        "WEIGHT": 49,
        "ARM": 50,
        "TURN": 51,
        "REACH": 52,
        "INERTIA": 53,
        "LOAD": 54,
        "PUSH": 55,
        "ZA": 56,
        "LEVER": 57,
        "DEN": 58,
        "TORQUE": 59,
    },
)
ROWS = 60

#: What must not turn negative in a mode, in order of priority at one instant: floor before walls,
#: contacts before friction. The last one is of Bouc-Wen friction: z comes to the sign of V, from
#: where the pivot loads.
Guard = IntEnum(
    "Guard",
    "NONE PHI TOPPLE LANDING TIP_GAP FAR_GAP FLOOR_PUSH TIP_PUSH FAR_PUSH CONE_PLUS CONE_MINUS SLIP"
    " UPLIFT_PLUS UPLIFT_MINUS LOADS",
    start=-1,
)

GUARDS = 14

#: Events of the log; not in it: none, and the end of rest, whose event depends on the next mode.
Event = IntEnum(
    "Event",
    "LEAVES_REST UNTOLD UPLIFT SLIPS STICKS FLOOR_IMPACT WALL_IMPACT LIFT_OFF LANDS RELEASE SETTLED"
    " FELL_LEFT FELL_RIGHT",
    start=-2,
)

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

#: How a run ended.
Ending = IntEnum(
    "Ending", "GOING DONE OVERTURNED TOO_MANY_STEPS TOO_MANY_EVENTS NOT_FINITE", start=-1
)

FAILURES: dict[int, str] = {
    Ending.TOO_MANY_STEPS: "the cap on steps was reached",
    Ending.TOO_MANY_EVENTS: "the cap on events was reached",
    Ending.NOT_FINITE: "the motion is not finite",
}

#: The laws of impacts at several contacts (see ebm.core.laws.contact_impacts).
Law = IntEnum(
    "Law",
    "MOREAU CLOSED_BRANCH OPEN_BRANCH FLOOR_FIRST LEADING_FIRST TRAILING_FIRST",
    start=0,
)

#: As a model's settings name them.
LAWS = ("moreau", "closed", "open", "floor-first", "leading-first", "trailing-first")

#: The six contacts: the pivot and the other bottom corner on the floor, the top and bottom corner
#: on the tip wall, the bottom and top corner on the far wall; and the floor's tangent.
Contact = IntEnum("Contact", "FOOT OTHER TIP_TOP TIP_BOTTOM FAR_BOTTOM FAR_TOP TANGENT", start=0)

CONTACTS = 6
#: Every set of at most three contacts.
CONTACT_SETS = [some for n in range(4) for some in itertools.combinations(range(CONTACTS), n)]

#: Friction in a set of contacts: none, sticking, slip to either side.
Friction = IntEnum("Friction", "FREE HELD PLUS MINUS", start=0)

#: What came of an impact: its stages do not end, all obey the law, or one violates it least.
Found = IntEnum("Found", "ENDLESS FITS LEAST_WRONG", start=0)

#: Forms of the paper's floor impact.
Landing = IntEnum("Landing", "HELD_FAST SLID FLAT_END", start=0)

#: Branches of the wall impact's cascade, as the paper's Fig. 3 letters them.
Branch = IntEnum("Branch", "A_STICK B_STICK C_STICK D_SLIP E_SLIP NO_BRANCH", start=0)
