"""The scene's own pulse or record as a node of its spectrum.

In goes a spectrum, out come the outcome at that node and the nearest other outcome along each axis,
and a sentence of them. The study of spectra calls it.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import Spectrum
from rockcheck.scenes import Pulse, Record, Scene
from rockcheck.validation.studies.spectrum.tiles import UNDECIDED, letters_of

OUTCOMES = {
    "S": "stays",
    "L": "falls counterclockwise",
    "R": "falls clockwise",
    UNDECIDED: "is undecided",
}


@dataclass(frozen=True)
class Change:
    """Along an axis, the nearest node of another outcome, and the last of the same before it.

    Both are in multiples of the scene's own; `letter` is the other outcome.
    """

    axis: str
    letter: str
    other: float
    same: float


@dataclass(frozen=True)
class NodeAnswer:
    """The outcome at the scene's own node, and the nearest change along each axis.

    `inside` is false where the node lies beyond the axes: no change is known there.
    """

    letter: str
    inside: bool
    changes: tuple[Change, ...] = ()


def ratios(scene: Scene) -> tuple[float, float] | None:
    """Frequency and amplitude ratio of the scene's node; of a record 1 and 1, of others None."""
    excitation = scene.excitation
    if isinstance(excitation, Record):
        return 1.0, 1.0
    if isinstance(excitation, Pulse):
        frequency = 2.0 * math.pi / (excitation.period * scene.frequency_parameter)
        return frequency, abs(excitation.amplitude) / (scene.gravity * scene.block.slope)
    return None


def within(spectrum: Spectrum, node: tuple[float, float]) -> NodeAnswer | None:
    """The answer at a node (frequency and amplitude ratio) that was played; None if it was not."""
    x, y = np.asarray(spectrum.frequency_ratios), np.asarray(spectrum.amplitude_ratios)
    columns, rows = np.flatnonzero(x == node[0]), np.flatnonzero(y == node[1])
    if not columns.size or not rows.size:
        return None
    letters = letters_of(spectrum.outcomes, spectrum.undecided)
    i, j = int(rows[0]), int(columns[0])
    record = isinstance(spectrum.scene.excitation, Record)
    changes = (
        nearest_change("scale" if record else "amplitude", y, letters[:, j], i),
        nearest_change("size" if record else "frequency", x, letters[i], j),
    )
    return NodeAnswer(str(letters[i, j]), True, tuple(change for change in changes if change))


def nearest_change(
    axis: str, values: NDArray[np.float64], letters: NDArray[np.str_], at: int
) -> Change | None:
    """The change nearest to node `at` along an axis; None where there is none, or no outcome."""
    others = np.flatnonzero((letters != letters[at]) & (letters != UNDECIDED))
    if letters[at] == UNDECIDED or not others.size:
        return None
    factors = values / values[at]
    nearest = int(others[np.argmin(np.abs(np.log(factors[others])))])
    before = nearest - int(np.sign(nearest - at))
    return Change(axis, str(letters[nearest]), float(factors[nearest]), float(factors[before]))


def answer(node: NodeAnswer, scene: Scene) -> str:
    """Whether the block falls, and how near another outcome is."""
    motion = "record" if isinstance(scene.excitation, Record) else "pulse"
    first = f"Under its own {motion} the block {OUTCOMES[node.letter]}."
    axes = "--frequencies and --amplitudes"
    if not node.inside:
        return f"{first} That lies beyond the axes: give {axes} around it to see how near it is."
    if node.letter == UNDECIDED:
        return f"{first} The model failed there."
    if not node.changes:
        return f"{first} No node in its row or column ends otherwise: wider {axes} may."
    return f"{first} Nearest other outcomes: {'; '.join(map(_words, node.changes))}."


def _words(change: Change) -> str:
    return (
        f"it {OUTCOMES[change.letter]} at {change.other:.3g} times the {change.axis}"
        f" (not yet at {change.same:.3g})"
    )
