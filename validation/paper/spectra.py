"""The 28 spectra on one grid: which nodes are safe and which overturn, with each wall and without.

In: the spectra of `paper_panels`, and two scans beyond them. Out: `Paper`, masks by panel.
Called by the study of spectra, and by the measures of the paper's sentences.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import Spectrum
from rockcheck.ebm.spectrum import RIGHT, SAFE
from rockcheck.scenes import Side
from rockcheck.validation.paper import AMPLITUDES, FIGURES, GAPS, RESTITUTIONS

Mask = NDArray[np.bool_]
SIDES: tuple[Side, ...] = ("left", "right")
FRICTIONS = (0.3, 0.6)
MILLIMETRES = tuple(1000.0 * gap for gap in GAPS)
#: The parameters of a spectrum with a wall, by their names in `WallPanel`; the values that the
#: paper calls safer come first, but for the side.
AXES: dict[str, tuple[Any, ...]] = {
    "side": SIDES,
    "friction": FRICTIONS,
    "gap": MILLIMETRES,
    "restitution": RESTITUTIONS,
}
#: Range of omega_p/p of the paper's example of overturning with one impact.
ONE_IMPACT = (2.0, 3.0)
#: The scanned amplitudes, beyond the spectra's own range, and the omega_p/p of the scan; and for
#: which spectra: gap (m) and e, None without a wall.
SCANNED, SCANNED_AT = np.arange(AMPLITUDES[0], 20.005, 0.01), 6.0
SCANNED_WALLS: dict[str, tuple[float, float] | None] = {
    "figure-8-unobstructed": None,
    **{f"figure-8-gap-103-e-{e:g}": (GAPS[-1], e) for e in RESTITUTIONS},
}


@dataclass(frozen=True)
class WallPanel:
    """The parameters of one spectrum with a wall; `gap` in mm."""

    side: Side
    friction: float
    gap: float
    restitution: float

    def words(self, *omitted: str) -> str:
        """The wall and the friction in words, without the `omitted` parameters."""
        words = {
            "side": f"{self.side} wall",
            "friction": f"μ {self.friction:g}",
            "gap": f"{self.gap:g} mm",
            "restitution": f"e {self.restitution:g}",
        }
        return ", ".join(text for name, text in words.items() if name not in omitted)

    @property
    def figure(self) -> int:
        """The paper's figure that shows it."""
        numbers = {shown: number for number, shown in FIGURES.items()}
        return numbers[self.side, self.friction]

    def with_value(self, axis: str, value: Any) -> "WallPanel":
        """The panel that differs in this parameter alone."""
        return replace(self, **{axis: value})

    def values_of(self, axis: str) -> "list[WallPanel]":
        """The panels with each value of a parameter, in the order of `AXES`."""
        return [self.with_value(axis, value) for value in AXES[axis]]


#: All panels with a wall, in the order of the figures.
PANELS = tuple(WallPanel(*values) for values in product(*AXES.values()))


def panels_with(**parameters: Any) -> list[WallPanel]:
    """The panels that have these values of their parameters."""
    return [
        panel
        for panel in PANELS
        if all(getattr(panel, name) == value for name, value in parameters.items())
    ]


def families(axis: str) -> list[list[WallPanel]]:
    """Groups of panels that differ in one parameter alone."""
    return [panel.values_of(axis) for panel in panels_with(**{axis: AXES[axis][0]})]


def pairs(axis: str) -> list[tuple[WallPanel, WallPanel]]:
    """All pairs of panels that differ in one parameter alone."""
    return [pair for family in families(axis) for pair in combinations(family, 2)]


class Paper:
    """The 28 spectra: `safe`, `falls` and `outcomes` by panel, the same without a wall by friction.

    `falls` are the nodes that overturn: one whose run failed is neither safe nor overturned.
    `least`: the lowest overturning amplitude of `SCANNED` by (gap in m, e) of a right wall, None
    without one; infinite where none overturns. `tongues`: by friction, the nodes of
    `near_one_impact` at which the free block overturns after exactly one floor impact.
    """

    def __init__(
        self,
        spectra: Sequence[Spectrum],
        least: Mapping[tuple[float, float] | None, float] | None = None,
        tongues: Mapping[float, Mask] | None = None,
    ) -> None:
        self.frequencies = spectra[0].frequency_ratios
        self.amplitudes = spectra[0].amplitude_ratios
        self.least = least or {}
        self.tongues = tongues or {}
        self.outcomes: dict[WallPanel, NDArray[np.int8]] = {}
        self.safe: dict[WallPanel, Mask] = {}
        self.outcomes_alone: dict[float, NDArray[np.int8]] = {}
        self.safe_alone: dict[float, Mask] = {}
        for spectrum in spectra:
            friction = spectrum.scene.floor.friction
            if not spectrum.scene.walls:
                self.outcomes_alone[friction] = spectrum.outcomes
                self.safe_alone[friction] = spectrum.safe
                continue
            wall = spectrum.scene.walls[0]
            panel = WallPanel(wall.side, friction, 1000.0 * wall.gap, wall.restitution)
            self.outcomes[panel] = spectrum.outcomes
            self.safe[panel] = spectrum.safe
        self.falls = {panel: outcomes != SAFE for panel, outcomes in self.outcomes.items()}
        self.falls_alone = {mu: outcomes != SAFE for mu, outcomes in self.outcomes_alone.items()}


def near_one_impact(spectrum: Spectrum) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The nodes (i, j) at omega_p/p from `ONE_IMPACT` to one more that overturn clockwise."""
    low, high = ONE_IMPACT
    f = spectrum.frequency_ratios
    i, j = np.nonzero((spectrum.outcomes == RIGHT) & (f >= low) & (f <= high + 1.0))
    return i, j
