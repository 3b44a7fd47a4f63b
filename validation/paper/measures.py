"""Figures of the paper's spectra on which its sentences are judged: numbers alone.

In: `Paper`. Out: counts, shares and areas, by panel. Called by `sentences`, which words them.
"""

import operator
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from rockcheck.ebm.spectrum import LEFT, RIGHT
from rockcheck.validation.paper.spectra import (
    AXES,
    FRICTIONS,
    MILLIMETRES,
    ONE_IMPACT,
    PANELS,
    RESTITUTIONS,
    Mask,
    Paper,
    WallPanel,
    families,
    pairs,
    panels_with,
)

#: A change of the safe area by less than this share of the nodes is ignored: a band one node wide
#: along the boundary.
SMALL = 0.01


def area(safe: Mask) -> float:
    """The share of the nodes that are safe."""
    return float(np.mean(safe))


@dataclass(frozen=True)
class SafePair:
    """Two spectra that differ in one parameter: the paper calls the first safer.

    `first` and `second` are None without a wall.
    """

    first: WallPanel | None
    second: WallPanel | None
    safer: Mask
    other: Mask

    @property
    def agrees(self) -> bool:
        """Whether the first has the larger safe area."""
        return area(self.safer) > area(self.other)


def neighbours(paper: Paper, axis: str) -> list[SafePair]:
    """Each value of a parameter of the wall beside the next one."""
    return [
        SafePair(first, second, paper.safe[first], paper.safe[second])
        for family in families(axis)
        for first, second in pairwise(family)
    ]


def free_pair(paper: Paper) -> SafePair:
    """The block without a wall at both frictions."""
    low, high = FRICTIONS
    return SafePair(None, None, paper.safe_alone[low], paper.safe_alone[high])


@dataclass(frozen=True)
class WallGroup:
    """Walls with these `parameters`, and what their safe area must be.

    A bound is (factor, share of the nodes): the area must be `below`, or `beyond`, the factor times
    the area without a wall plus the share. Without a bound the group only informs.
    """

    parameters: Mapping[str, Any]
    below: tuple[float, float] | None = None
    beyond: tuple[float, float] | None = None

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> "WallGroup":
        """A group as it stands in `sentences.toml`."""
        parameters = {name: value for name, value in table.items() if name in AXES}
        return cls(parameters, table.get("below"), table.get("beyond"))

    def is_met(self, with_wall: float, without: float) -> bool | None:
        """Whether the safe area with the wall keeps the bounds; None if there is none."""
        verdicts = [
            meets(with_wall - bound[0] * without, bound[1])
            for meets, bound in ((operator.lt, self.below), (operator.gt, self.beyond))
            if bound is not None
        ]
        return all(verdicts) if verdicts else None


@dataclass(frozen=True)
class AreaChange:
    """The safe area of a panel with its wall and without, as shares of the nodes."""

    group: WallGroup
    panel: WallPanel
    with_wall: float
    without: float

    @property
    def gain(self) -> float:
        """The area that the wall adds."""
        return self.with_wall - self.without

    @property
    def ratio(self) -> float:
        """The area over that without the wall; 1 if that is zero."""
        return self.with_wall / self.without if self.without else 1.0


def area_changes(paper: Paper, groups: list[WallGroup], above: float) -> list[AreaChange]:
    """Safe areas with the walls of these groups against none, at omega_p/p > `above`."""
    columns = paper.frequencies > above
    return [
        AreaChange(
            group,
            panel,
            area(paper.safe[panel][:, columns]),
            area(paper.safe_alone[panel.friction][:, columns]),
        )
        for group in groups
        for panel in panels_with(**group.parameters)
    ]


def overturned_towards_the_wall(paper: Paper) -> dict[WallPanel, int]:
    """The number of nodes that overturn towards the wall."""
    towards = {"left": LEFT, "right": RIGHT}
    return {panel: int(np.sum(paper.outcomes[panel] == towards[panel.side])) for panel in PANELS}


def mean_changes(paper: Paper) -> dict[str, float]:
    """By parameter: the share of the nodes that are safe in only one of two panels.

    The mean over all pairs of panels that differ in this parameter alone.
    """
    return {axis: float(np.mean(pair_changes(paper, pairs(axis)))) for axis in AXES}


def pair_changes(paper: Paper, panels: list[tuple[WallPanel, WallPanel]]) -> list[float]:
    """The share of the nodes that are safe in only one panel of each pair."""
    return [float(np.mean(paper.safe[first] != paper.safe[second])) for first, second in panels]


@dataclass(frozen=True)
class SideEffect:
    """The share of the nodes safe with the wall on one side only, at the low and high friction."""

    panel: WallPanel
    low: float
    high: float


def side_effects(paper: Paper) -> list[SideEffect]:
    """How far the side of the wall decides, by gap and restitution."""
    low, high = FRICTIONS
    effects = []
    for panel in panels_with(side="left", friction=low):
        changes = [
            pair_changes(paper, [(left, left.with_value("side", "right"))])[0]
            for left in (panel, panel.with_value("friction", high))
        ]
        effects.append(SideEffect(panel, *changes))
    return effects


@dataclass(frozen=True)
class OneImpact:
    """Nodes of a range of omega_p/p that overturn after one floor impact without a wall.

    `made_safe`: the share of them that the near left wall makes safe. `is_example` in the paper's
    own range.
    """

    friction: float
    low: float
    high: float
    nodes: int
    made_safe: float

    @property
    def is_example(self) -> bool:
        """Whether the range is the paper's."""
        return (self.low, self.high) == ONE_IMPACT


def one_impact_nodes(paper: Paper) -> list[OneImpact]:
    """Overturning with one impact in the paper's range and the next, by friction."""
    f, end = paper.frequencies, ONE_IMPACT[1]
    results = []
    for friction, tongue in sorted(paper.tongues.items()):
        wall = WallPanel("left", friction, MILLIMETRES[0], RESTITUTIONS[0])
        for low, high in (ONE_IMPACT, (end, end + 1.0)):
            safe = paper.safe[wall][tongue & ((f >= low) & (f <= high))]
            made_safe = area(safe) if safe.size else 0.0
            results.append(OneImpact(friction, low, high, safe.size, made_safe))
    return results


def turning_pairs(paper: Paper, side: str, axis: str) -> tuple[int, int]:
    """Pairs of walls on a side of which one helps and one harms; and all pairs.

    The two differ in one parameter alone.
    """
    turning, compared = 0, 0
    for pair in pairs(axis):
        if pair[0].side != side:
            continue
        gains = [area(paper.safe[panel]) - area(paper.safe_alone[panel.friction]) for panel in pair]
        compared += 1
        turning += min(gains) < -SMALL and max(gains) > SMALL
    return turning, compared


def largest_change(paper: Paper, axis: str, side: str, friction: float) -> float:
    """The largest share of nodes that differ between two panels with this side and friction."""
    panels = [pair for pair in pairs(axis) if pair[0].side == side and pair[0].friction == friction]
    return max(pair_changes(paper, panels))


@dataclass(frozen=True)
class LikelierSide:
    """How far the free block is likelier to overturn clockwise, at one friction.

    Counted over amplitudes from the lowest, clockwise leads up to `amplitude` (0: nowhere). Of the
    lowest overturnings at the first `frequencies` frequencies, up to `frequency`, `clockwise` are
    clockwise: there its lead is largest. `right` and `left` are shares of all nodes.
    """

    friction: float
    amplitude: float
    clockwise: int
    frequencies: int
    frequency: float
    lead: int
    right: float
    left: float


def likelier_sides(paper: Paper) -> list[LikelierSide]:
    """Clockwise against counterclockwise overturning without a wall, by friction."""
    return [_likelier_side(paper, friction) for friction in FRICTIONS]


def _likelier_side(paper: Paper, friction: float) -> LikelierSide:
    outcomes, falls = paper.outcomes_alone[friction], paper.falls_alone[friction]
    left = np.mean(outcomes == LEFT, axis=1)
    right = np.mean(outcomes == RIGHT, axis=1)
    leads = np.flatnonzero(np.cumsum(right - left) > 0.0)
    columns = np.flatnonzero(falls.any(axis=0))
    lowest_is_clockwise = outcomes[np.argmax(falls, axis=0)[columns], columns] == RIGHT
    lead = np.cumsum(np.where(lowest_is_clockwise, 1, -1))
    count = int(np.argmax(lead)) + 1
    return LikelierSide(
        friction=friction,
        amplitude=float(paper.amplitudes[leads[-1]]) if leads.size else 0.0,
        clockwise=int(np.sum(lowest_is_clockwise[:count])),
        frequencies=count,
        frequency=float(paper.frequencies[columns[count - 1]]),
        lead=int(lead[count - 1]),
        right=float(right.mean()),
        left=float(left.mean()),
    )
