"""Findings from the spectra that are not in the paper: nodes gained, lost and otherwise safe.

In: `Paper` and `data/paper/sentences.toml`. Out: `FurtherFinding`. Called by `tables`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rockcheck.validation.paper.measures import area
from rockcheck.validation.paper.sentences import SENTENCES, Evidence, percent
from rockcheck.validation.paper.spectra import PANELS, Mask, Paper, WallPanel, panels_with


@dataclass(frozen=True)
class FurtherFinding:
    """A finding that is not in the paper, the case that shows it best, and the nodes of its map.

    `about` is its table in `sentences.toml`, `case` its wall or friction in words, `figure` the
    paper's figure; `safe` excludes marked nodes. `values` fill in its text.
    """

    about: Mapping[str, Any]
    case: str
    figure: int
    gained: Mask
    lost: Mask
    safe: Mask
    evidence: list[Evidence]
    values: dict[str, str]

    @property
    def words(self) -> str:
        """The finding's text, filled in."""
        gained, lost = int(self.gained.sum()), int(self.lost.sum())
        return str(self.about["words"].format(gained=gained, lost=lost, **self.values))


def _wall(panel: WallPanel) -> str:
    return f"e = {panel.restitution:g}, μ = {panel.friction:g}"


def _case(panel: WallPanel) -> str:
    return f"{panel.side} wall, {panel.gap:g} mm, {_wall(panel)}"


def exchange(paper: Paper, about: Mapping[str, Any]) -> FurtherFinding:
    """The wall that changes the safe area least, with the nodes that it saves and overturns."""
    saved = {panel: paper.safe[panel] & paper.falls_alone[panel.friction] for panel in PANELS}
    lost = {panel: paper.falls[panel] & paper.safe_alone[panel.friction] for panel in PANELS}
    counts = {panel: (int(saved[panel].sum()), int(lost[panel].sum())) for panel in PANELS}

    def difference(panel: WallPanel) -> int:
        return abs(counts[panel][0] - counts[panel][1])

    shown = min(PANELS, key=difference)
    return FurtherFinding(
        about=about,
        case=_case(shown),
        figure=shown.figure,
        gained=saved[shown],
        lost=lost[shown],
        safe=paper.safe[shown] & ~saved[shown],
        evidence=[
            Evidence(_case(panel), f"saves at {gained} nodes, overturns at {overturned}")
            for panel, (gained, overturned) in counts.items()
        ],
        values={
            "with_wall": percent(area(paper.safe[shown])),
            "without": percent(area(paper.safe_alone[shown.friction])),
            "both": str(sum(min(count) > 0 for count in counts.values())),
            "all": str(len(counts)),
        },
    )


def either_side(paper: Paper, about: Mapping[str, Any]) -> FurtherFinding:
    """Nodes at which the block stands alone, but falls beside a wall on either side."""
    harmed, helped = {}, {}
    for left in panels_with(side="left"):
        right = left.with_value("side", "right")
        falls_beside_both = paper.falls[left] & paper.falls[right]
        stands_beside_both = paper.safe[left] & paper.safe[right]
        harmed[right] = paper.safe_alone[left.friction] & falls_beside_both
        helped[right] = paper.falls_alone[left.friction] & stands_beside_both
    shown = max(harmed, key=lambda panel: int(harmed[panel].sum()))
    return FurtherFinding(
        about=about,
        case=f"{shown.gap:g} mm, {_wall(shown)}",
        figure=shown.figure,
        gained=helped[shown],
        lost=harmed[shown],
        safe=paper.safe_alone[shown.friction] & ~harmed[shown],
        evidence=[
            Evidence(
                panel.words("side"),
                f"falls on either side at {harmed[panel].sum()} nodes,"
                f" saved at {helped[panel].sum()}",
            )
            for panel in harmed
        ],
        values={},
    )


def _above_a_fall(safe: Mask, falls: Mask) -> Mask:
    """Safe nodes above one of the same frequency that overturns."""
    return safe & np.logical_or.accumulate(falls, axis=0)


def _nodes_and_frequencies(case: str, nodes: Mask) -> Evidence:
    frequencies = nodes.any(axis=0).sum()
    return Evidence(case, f"{nodes.sum()} nodes, at {frequencies} frequencies")


def stronger_is_safe(paper: Paper, about: Mapping[str, Any]) -> FurtherFinding:
    """Nodes that are safe though a weaker pulse of the same frequency overturns the block."""
    above = {panel: _above_a_fall(paper.safe[panel], paper.falls[panel]) for panel in PANELS}
    alone = {
        friction: _above_a_fall(safe, paper.falls_alone[friction])
        for friction, safe in paper.safe_alone.items()
    }
    shown = max(PANELS, key=lambda panel: int(above[panel].sum()))
    free = alone[shown.friction]
    evidence = [
        _nodes_and_frequencies(f"no wall, μ {friction:g}", nodes)
        for friction, nodes in alone.items()
    ]
    evidence += [_nodes_and_frequencies(_case(panel), above[panel]) for panel in PANELS]
    return FurtherFinding(
        about=about,
        case=_case(shown),
        figure=shown.figure,
        gained=above[shown],
        lost=np.zeros_like(free),
        safe=paper.safe[shown] & ~above[shown],
        evidence=evidence,
        values={
            "frequencies": str(above[shown].any(axis=0).sum()),
            "all": str(len(paper.frequencies)),
            "free": str(free.sum()),
            "free_frequencies": str(free.any(axis=0).sum()),
        },
    )


#: By their names in `sentences.toml`.
FINDINGS: dict[str, Callable[[Paper, Mapping[str, Any]], FurtherFinding]] = {
    "exchange": exchange,
    "either_side": either_side,
    "stronger_is_safe": stronger_is_safe,
}


def findings_of(paper: Paper) -> list[FurtherFinding]:
    """Findings from the spectra that are not in the paper."""
    return [FINDINGS[about["measure"]](paper, about) for about in SENTENCES["finding"]]
