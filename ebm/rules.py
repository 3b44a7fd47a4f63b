"""The modelling choices of the event-based models, by name: where rigid-body mechanics, or rounding, leaves more than one answer or none.

Each has one home in the code, is counted in every run (`History.cost.rules`), and has a paragraph in docs/limits.md.
"""

from __future__ import annotations

#: Where neither base, friction, place nor walls tell to which side a flat block tips: the corner on which it last stood.
TIPS = 0
#: A mode is taken once at an instant; one that has just ended goes on only where no other fits.
MODE_AGAIN = 1
#: Where no mode fits, for rounding or beyond Painleve's limit, the one that contradicts itself least.
LEAST_CONTRADICTION = 2
#: Where no impact fits, the one that contradicts the law least.
LEAST_WRONG_IMPACT = 3
#: Impacts that go on at one instant end plastic.
ENDLESS_STAGES = 4
#: A landing or rebound slower than the settling speed ends in rest.
SETTLES = 5
#: The settling speed is raised as impacts accumulate (Zeno).
RATTLES = 6
#: Between two walls that it touches at once nothing rebounds.
WEDGED = 7
#: Landing flush against a wall in the bilateral model: the closed branch.
FLUSH_LANDING = 8
#: A hanging block that comes down with less energy than the tolerance has not touched the floor.
GRAZES = 9
#: A corner that meets the wall as the block lands belongs to the landing.
LANDS_ALONG = 10
#: Bouc-Wen: beyond Painleve's limit on a wall the motion goes on with the pull.
PULLS = 11
RULES = 12

NAMES = (
    "tips to the corner it stood on",
    "mode goes on",
    "least contradiction",
    "least wrong impact",
    "endless stages",
    "settles",
    "rattles",
    "wedged",
    "flush landing",
    "grazes",
    "lands along a wall",
    "pulls beyond Painleve",
)
