"""The core's names, by theme. Compiled code reads a member as the number that it stands for."""

import itertools
from enum import IntEnum
from typing import Any

#: Whether a block translates upright (theta = 0) or is tilted.
Family = IntEnum("Family", "FLAT TILT", start=0)

#: What the pivot (or, flat, the base) does on the floor.
Pivot = IntEnum("Pivot", "OFF STICK SLIPPING", start=0)

#: What a component of the base motion is made of (see `ebm.core.ground`).
Shape = IntEnum("Shape", "STILL GAUSSIAN SINE SAMPLED WAVELET", start=0)

#: What a run keeps beside its motion: nothing, how it strikes the walls, or all its extremes.
Keep = IntEnum("Keep", "NOTHING STRIKES EXTREMES", start=0)

#: What a series is made of: its noise, and how far ahead it is judged, differ.
Kind = IntEnum("Kind", "POSITION RATE FORCE", start=0)

#: What must not turn negative in a mode, in order of priority at one instant: floor before walls,
#: contacts before friction. The last one is of Bouc-Wen friction: z comes to the sign of V, from
#: where the pivot loads.
Guard = IntEnum(
    "Guard",
    "NONE PHI TOPPLE LANDING TIP_GAP FAR_GAP FLOOR_PUSH TIP_PUSH FAR_PUSH CONE_PLUS CONE_MINUS SLIP"
    " UPLIFT_PLUS UPLIFT_MINUS LOADS",
    start=-1,
)


def _rows(widths: dict[str, int]) -> Any:
    """An enumeration of the first rows of what takes these numbers of rows, one after the other."""
    first = itertools.accumulate(widths.values(), initial=0)
    return IntEnum("Row", [*zip([*widths, "END"], first, strict=True)])


#: Rows of the workspace, with the number of rows that each takes.
Row = _rows(
    {
        # Series of the motion, in the letters of ebm.core.motion.
        "PHI": 1,
        "OMEGA": 1,
        "SIN": 1,
        "COS": 1,
        "U": 1,
        "G": 1,
        "XI": 1,
        "Y": 1,
        "P": 1,
        "Q": 1,
        "NA": 1,
        "NB": 1,
        "Z": 1,
        # The guard that is looked at. Those before it are the series that guards combine.
        "GUARD": 1,
        # What is followed for its largest value (see ebm.core.extremes), and its slope.
        "WATCHED": 1,
        "SLOPE": 1,
        # What the general solution needs: known terms, forces found, arms, and the walls' push.
        "KNOWN": 1,
        "FOUND": 1,
        "FLOOR_ARM": 1,
        "WALL_ARM": 1,
        "WALL_PUSH": 1,
        # Where the small linear system of the contacts is put together.
        "CONSTRAINT": 3,
        "COLUMN": 3,
        "MATRIX": 3,
        "INVERSE": 3,
        # The last angle whose sine and cosine were taken, and these: the end of a step is the start
        # of the next one.
        "ANGLE": 1,
        # The guards of the mode: the weights of the series in each (see ebm.core.guards), and which
        # there are.
        "TABLE": len(Guard) - 1,
        "THERE": 1,
        # Bouc-Wen friction: the square of z, the slip velocity, the friction of z's later terms.
        "Z2": 1,
        "V": 1,
        "LATE": 1,
    }
)

ROWS = int(Row.END)

#: Events of the log; not in it: none.
Event = IntEnum(
    "Event",
    "UNTOLD UPLIFT SLIPS STICKS FLOOR_IMPACT WALL_IMPACT LIFT_OFF LANDS RELEASE SETTLED"
    " FELL_LEFT FELL_RIGHT",
    start=-1,
)

#: Names of the events.
EVENT_NAMES: dict[int, str] = {
    Event.UPLIFT: "uplift",
    Event.SLIPS: "slip",
    Event.STICKS: "stick",
    Event.FLOOR_IMPACT: "floor impact",
    Event.WALL_IMPACT: "wall impact",
    Event.LIFT_OFF: "lift-off",
    Event.LANDS: "landing",
    Event.RELEASE: "release",
    Event.SETTLED: "settled",
    Event.FELL_LEFT: "overturned left",
    Event.FELL_RIGHT: "overturned right",
}
#: The modes of a history (see `ebm.core.state.mode_code`): in odd ones the pivot slips.
HistoryMode = IntEnum("HistoryMode", "REST SLIDE ROCK SLIDE_ROCK LEAN LADDER FLIGHT", start=0)

#: Names of these modes.
MODE_NAMES = tuple(one.name.lower().replace("_", "-") for one in HistoryMode)

#: How a run ended; GIVEN_UP: nothing decided it for too long.
Ending = IntEnum(
    "Ending", "GOING DONE OVERTURNED TOO_MANY_STEPS TOO_MANY_EVENTS NOT_FINITE GIVEN_UP", start=-1
)

#: What becomes of a block; the first four in the order of `scenes.history.OUTCOMES`.
Fate = IntEnum("Fate", "AT_REST MOVING OVERTURNED_LEFT OVERTURNED_RIGHT UNDECIDED FAILED", start=0)

FAILURES: dict[int, str] = {
    Ending.TOO_MANY_STEPS: "the cap on steps was reached",
    Ending.TOO_MANY_EVENTS: "the cap on events was reached",
    Ending.NOT_FINITE: "the motion is not finite",
}

#: The laws of impacts at several contacts (see ebm.core.contact_impacts).
Law = IntEnum(
    "Law",
    "MOREAU CLOSED_BRANCH OPEN_BRANCH FLOOR_FIRST LEADING_FIRST TRAILING_FIRST",
    start=0,
)

#: As a model's settings name them.
LAWS = ("moreau", "closed", "open", "floor-first", "leading-first", "trailing-first")

#: The six contacts: the pivot and the other bottom corner on the floor, the top and bottom corner
#: on the tip wall, the bottom and top corner on the far wall, in pairs of which the second one
#: touches only where the block is upright; and the floor's tangent.
Contact = IntEnum("Contact", "FOOT OTHER TIP_TOP TIP_BOTTOM FAR_BOTTOM FAR_TOP TANGENT", start=0)

CONTACTS = 6
#: Every set of at most three contacts.
CONTACT_SETS = [some for n in range(4) for some in itertools.combinations(range(CONTACTS), n)]

#: Friction in a set of contacts: none, sticking, slip to either side.
Friction = IntEnum("Friction", "FREE HELD PLUS MINUS", start=0)


#: The modelling choices of the event-based models. They are made where rigid-body mechanics, or
#: rounding, leaves more than one answer or none. Each has one home in the code, is counted in every
#: run (`History.cost.rules`), and has a paragraph in docs/limits.md.
Rule = IntEnum(
    "Rule",
    "HANGS MODE_AGAIN LEAST_CONTRADICTION ENDLESS_STAGES SETTLES RATTLES WEDGED FLUSH_LANDING"
    " GRAZES LANDS_ALONG FLAT_LANDING",
    start=0,
)

RULES = len(Rule)
#: As histories and docs/limits.md name them.
RULE_NAMES = (
    # The floor falls away faster than g under a flat block, and nothing favours left or right: it
    # hangs flat, by both corners.
    "hangs flat",
    # A mode is selected once at an instant. One that has just ended goes on only where no other
    # fits.
    "mode goes on",
    # No mode, or no set of contacts at an impact, fits (rounding, or beyond Painleve's limit): the
    # one that is wrong by least is taken.
    "least contradiction",
    # Impacts that go on at one instant become plastic.
    "endless stages",
    # A landing or rebound slower than the settling speed ends in rest.
    "settles",
    # The settling speed is raised as impacts accumulate (Zeno).
    "rattles",
    # Between two walls that it touches at once nothing rebounds.
    "wedged",
    # Landing flush against a wall in the bilateral model: the closed branch.
    "flush landing",
    # A hanging block that comes down with less energy than the tolerance has not touched the floor.
    "grazes",
    # A corner that meets the wall as the block lands, on its base or on its side, belongs to the
    # landing.
    "lands along a wall",
    # Both bottom corners strike the floor at once: they share the impact, unless the law of impacts
    # names the one that is first.
    "flat landing",
)
