"""The modelling choices of the event-based models, by name.

They are made where rigid-body mechanics, or rounding, leaves more than one answer or none. Each has
one home in the code, is counted in every run (`History.cost.rules`), and has a paragraph in
docs/limits.md.
"""

from enum import IntEnum


class Rule(IntEnum):
    """Indices of the choices."""

    #: The floor falls away faster than g under a flat block, and nothing favours left or right: it
    #: hangs flat, by both corners.
    HANGS = 0
    #: A mode is selected once at an instant. One that has just ended goes on only where no other
    #: fits.
    MODE_AGAIN = 1
    #: No mode, or no set of contacts at an impact, fits (rounding, or beyond Painleve's limit): the
    #: one that is wrong by least is taken.
    LEAST_CONTRADICTION = 2
    #: Impacts that go on at one instant become plastic.
    ENDLESS_STAGES = 3
    #: A landing or rebound slower than the settling speed ends in rest.
    SETTLES = 4
    #: The settling speed is raised as impacts accumulate (Zeno).
    RATTLES = 5
    #: Between two walls that it touches at once nothing rebounds.
    WEDGED = 6
    #: Landing flush against a wall in the bilateral model: the closed branch.
    FLUSH_LANDING = 7
    #: A hanging block that comes down with less energy than the tolerance has not touched the
    #: floor.
    GRAZES = 8
    #: A corner that meets the wall as the block lands, on its base or on its side, belongs to the
    #: landing.
    LANDS_ALONG = 9
    #: Bouc-Wen: beyond Painleve's limit on a wall the motion goes on with the pull.
    PULLS = 10
    #: Both bottom corners strike the floor at once: they share the impact, unless the law of
    #: impacts names the one that is first.
    FLAT_LANDING = 11


RULES = len(Rule)

NAMES = (
    "hangs flat",
    "mode goes on",
    "least contradiction",
    "endless stages",
    "settles",
    "rattles",
    "wedged",
    "flush landing",
    "grazes",
    "lands along a wall",
    "pulls beyond Painleve",
    "flat landing",
)
