"""What boundary refinement saves and what it misses: refined spectra against the full grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.spectrum import LEFT, RIGHT, SAFE, Spectrum
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.execute import provenance
from rockcheck.validation.spectra.study import Panel, SpectrumRequest, play_panels
from rockcheck.validation.spectra.tiles import Tiles

#: Sizes of the boxes, in nodes, over which a boundary's dimension is measured.
BOXES = (1, 2, 4, 8, 16)
COLUMNS = ("spectrum", "runs", "nodes a run", "wrong nodes", "areas", "boundary's dimension")


class Refined(Stored):
    """One spectrum: nodes of the full grid, runs of the refined one and its wrong nodes.

    `areas` counts the connected nodes of one outcome: two or three where the boundary is a line, many where it breaks into
    hairs; `dimension` is the boundary's.
    """

    spectrum: str
    nodes: int
    runs: int
    wrong: int
    areas: int
    dimension: float


class Refinement(Stored):
    """`refinement.json`."""

    format: int = 1
    date: str
    versions: dict[str, str]
    grid: str
    model: str
    settings: dict[str, Any]
    spectra: tuple[Refined, ...]

    @property
    def runs(self) -> int:
        """Runs of all refined spectra."""
        return sum(spectrum.runs for spectrum in self.spectra)

    @property
    def nodes(self) -> int:
        """Nodes of all full grids."""
        return sum(spectrum.nodes for spectrum in self.spectra)

    @property
    def rows(self) -> tuple[tuple[str, ...], ...]:
        """The table: all spectra together first, then one each."""
        wrong = sum(spectrum.wrong for spectrum in self.spectra)
        rows = [("all", str(self.runs), f"{self.nodes / self.runs:.1f}", str(wrong), "", "")]
        rows += [
            (s.spectrum, str(s.runs), f"{s.nodes / s.runs:.1f}", str(s.wrong), str(s.areas), f"{s.dimension:.2f}") for s in self.spectra
        ]
        return tuple(rows)


def verify(panels: Sequence[Panel], request: SpectrumRequest, tiles: Tiles) -> Refinement:
    """Plays each spectrum on the full grid and refined, and counts the nodes that differ."""
    found = []
    for panel in panels:
        full, refined = (play_panels([panel], replace(request, refine=refine), tiles)[0] for refine in (False, True))
        found.append(compared(panel.name, full, refined))
    return Refinement(
        date=datetime.now(UTC).date().isoformat(),
        versions=provenance.versions(),
        grid=f"{len(request.amplitudes)} x {len(request.frequencies)}",
        model=request.model,
        settings=dict(request.settings),
        spectra=tuple(found),
    )


def compared(name: str, full: Spectrum, refined: Spectrum) -> Refined:
    """A refined spectrum against the full grid."""
    from scipy import ndimage

    return Refined(
        spectrum=name,
        nodes=full.outcomes.size,
        runs=refined.evaluations,
        wrong=int((full.outcomes != refined.outcomes).sum()),
        areas=sum(ndimage.label(full.outcomes == side, np.ones((3, 3)))[1] for side in (LEFT, SAFE, RIGHT)),
        dimension=boundary_dimension(full.outcomes),
    )


def boundary_dimension(outcomes: NDArray[np.int8]) -> float:
    """Box-counting dimension of the boundary between outcomes: 1 of a line, up to 2 of one that fills the plane.

    Counted are the boxes of `BOXES` nodes across that hold more than one outcome; 0 where there is no boundary.
    """
    mixed = np.zeros((outcomes.shape[0] - 1, outcomes.shape[1] - 1), dtype=bool)
    corner = outcomes[:-1, :-1]
    for other in (outcomes[1:, :-1], outcomes[:-1, 1:], outcomes[1:, 1:]):
        mixed |= corner != other
    counts = []
    for box in BOXES:
        rows, columns = (-(-length // box) for length in mixed.shape)
        whole = np.zeros((rows * box, columns * box), dtype=bool)
        whole[: mixed.shape[0], : mixed.shape[1]] = mixed
        counts.append(whole.reshape(rows, box, columns, box).any(axis=(1, 3)).sum())
    if counts[0] == 0:
        return 0.0
    return float(-np.polyfit(np.log(BOXES), np.log(counts), 1)[0])
