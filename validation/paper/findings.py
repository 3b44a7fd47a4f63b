"""What the paper's 28 spectra show and its section 5 does not say: each finding with the nodes that it rests on."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import Spectrum
from rockcheck.ebm.spectrum import SAFE
from rockcheck.validation.paper.claims import Paper, Row, percent
from rockcheck.validation.paper.panels import FIGURES, GAPS, RESTITUTIONS

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Finding:
    """A finding, the figure of the paper that shows it best, and how many nodes it rests on.

    `gained` and `lost` are the nodes of `case` that its picture marks; `safe` those that are safe besides. All are masks,
    amplitude by frequency, of the spectra's `frequencies` (omega_p/p) and `amplitudes` (a_p/(g tan alpha)).
    """

    name: str
    sentence: str
    words: str
    case: str
    figure: int
    gained: Mask
    lost: Mask
    safe: Mask
    gained_means: str
    lost_means: str
    rows: tuple[Row, ...]
    frequencies: NDArray[np.float64]
    amplitudes: NDArray[np.float64]


def findings(spectra: Sequence[Spectrum]) -> tuple[Finding, ...]:
    """The findings, from the 28 spectra on one grid."""
    paper = Paper(spectra)
    return _exchange(paper), _either_side(paper), _stronger_is_safe(paper)


def _figure(side: str, mu: float) -> int:
    return next(number for number, what in FIGURES.items() if what == (side, mu))


def _case(side: str, mu: float, gap: float, e: float) -> str:
    return f"{side} wall, {1000 * gap:g} mm, e = {e:g}, μ = {mu:g}"


def _exchange(paper: Paper) -> Finding:
    """The wall that changes the safe area least, and what it changes."""
    changes = {key: (one.safe & _falls(paper.free[key[1]]), _falls(one) & paper.free[key[1]].safe) for key, one in paper.walled.items()}
    key = min(changes, key=lambda key: abs(int(changes[key][0].sum()) - int(changes[key][1].sum())))
    saved, lost = changes[key]
    both = [key for key, (more, fewer) in changes.items() if more.any() and fewer.any()]
    return Finding(
        name="equal areas",
        sentence="A wall that leaves the safe area as it is may still decide the fate of many pulses.",
        words=f"The safe area is {percent(paper.walled[key].safe_area)} with the wall and {percent(paper.free[key[1]].safe_area)} without;"
        f" the wall saves the block at {saved.sum()} nodes and overturns it at {lost.sum()} others."
        f" {len(both)} of {len(changes)} walls do both.",
        case=_case(*key),
        figure=_figure(key[0], key[1]),
        gained=saved,
        lost=lost,
        safe=paper.walled[key].safe & ~saved,
        gained_means="saved by the wall",
        lost_means="overturned by the wall",
        rows=tuple(
            Row(what=_case(*one), value=f"saves at {more.sum()} nodes, overturns at {fewer.sum()}")
            for one, (more, fewer) in changes.items()
        ),
        frequencies=paper.frequencies,
        amplitudes=paper.amplitudes,
    )


def _either_side(paper: Paper) -> Finding:
    """Nodes at which the block stands alone and falls beside a wall on either side."""
    cases = list(itertools.product((0.3, 0.6), GAPS, RESTITUTIONS))
    walls = {case: tuple(paper.walled[side, case[0], case[1], case[2]] for side in ("left", "right")) for case in cases}
    harmed = {case: paper.free[case[0]].safe & _falls(left) & _falls(right) for case, (left, right) in walls.items()}
    helped = {case: _falls(paper.free[case[0]]) & left.safe & right.safe for case, (left, right) in walls.items()}
    key = max(harmed, key=lambda case: int(harmed[case].sum()))
    mu, gap, e = key
    return Finding(
        name="either side",
        sentence="Some pulses overturn the block beside a wall on whichever side, and leave it standing without one.",
        words=f"At {harmed[key].sum()} nodes the free block stands and falls beside the wall on the left as on the right;"
        f" at {helped[key].sum()} a wall on either side saves it.",
        case=f"{1000 * gap:g} mm, e = {e:g}, μ = {mu:g}",
        figure=_figure("right", mu),
        gained=helped[key],
        lost=harmed[key],
        safe=paper.free[mu].safe & ~harmed[key],
        gained_means="saved by a wall on either side",
        lost_means="overturned by a wall on either side",
        rows=tuple(
            Row(
                what=f"μ {m:g}, {1000 * g:g} mm, e {r:g}",
                value=f"falls on either side at {harmed[m, g, r].sum()} nodes, saved at {helped[m, g, r].sum()}",
            )
            for m, g, r in cases
        ),
        frequencies=paper.frequencies,
        amplitudes=paper.amplitudes,
    )


def _stronger_is_safe(paper: Paper) -> Finding:
    """Nodes that are safe though a weaker pulse of the same frequency overturns the block."""
    above = {key: _above(one) for key, one in paper.walled.items()}
    key = max(above, key=lambda key: int(above[key].sum()))
    free = _above(paper.free[key[1]])
    one = paper.walled[key]
    return Finding(
        name="a stronger pulse",
        sentence="Beside a wall that bounces, a block that a pulse overturns may stand under a stronger pulse of the same frequency.",
        words=f"So at {above[key].sum()} nodes, at {above[key].any(axis=0).sum()} of {len(paper.frequencies)} frequencies;"
        f" without a wall at {free.sum()} nodes, at {free.any(axis=0).sum()} frequencies. No least overturning amplitude tells of them.",
        case=_case(*key),
        figure=_figure(key[0], key[1]),
        gained=above[key],
        lost=np.zeros_like(free),
        safe=one.safe & ~above[key],
        gained_means="safe above an overturning pulse",
        lost_means="",
        rows=(
            *(Row(what=f"no wall, μ {mu:g}", value=_counted(_above(alone))) for mu, alone in paper.free.items()),
            *(Row(what=_case(*other), value=_counted(mask)) for other, mask in above.items()),
        ),
        frequencies=paper.frequencies,
        amplitudes=paper.amplitudes,
    )


def _above(spectrum: Spectrum) -> Mask:
    return spectrum.safe & np.logical_or.accumulate(_falls(spectrum), axis=0)


def _falls(spectrum: Spectrum) -> Mask:
    """Which nodes overturn; one whose run failed is neither safe nor overturned."""
    return spectrum.outcomes != SAFE


def _counted(mask: Mask) -> str:
    return f"{mask.sum()} nodes, at {mask.any(axis=0).sum()} frequencies"
