"""What a phenomenon is, and how values are read off motions.

In go histories (t, x, y, theta: any simulator writes those); out come a value and its verdict. The
tables of phenomena (`sliding`, `impacts`, `rocking`, `invariance`) are made of these, and `cards`
judges by them.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from rockcheck.scenes import PAPER_BLOCK as SLENDER, Block, Floats, History, InputError, Scene

G = 9.81
#: Wider than tall: it slides, drops and bounces without tipping.
SQUAT = Block(half_width=1.0, half_height=0.5)
COULOMB, NEWTON, HOUSNER = "Coulomb 1785; momentum", "Newton's law of impact", "Housner 1963"

__all__ = ["COULOMB", "HOUSNER", "NEWTON", "SLENDER", "SQUAT", "G", "Motion", "Phenomenon"]


@dataclass(frozen=True)
class Motion:
    """A history with its channels as attributes; raises `InputError` for a channel it lacks."""

    history: History

    def __getattr__(self, name: str) -> Floats:
        if name not in self.history.channels:
            raise InputError(f"the history of {self.history.name} has no column {name}")
        return np.asarray(self.history.channels[name], dtype=float)


@dataclass(frozen=True)
class Phenomenon:
    """One row of a card: a value read off motions, its target and its limit.

    `value` takes the motions of `scenes`, in their order. Its result should be `target` and may be
    off by `limit`; without a limit it is reported only. `means` is what a failure means for a user
    of the engine, `means_above` where the value is too large, if that means something else. `cure`
    is what to look at in any engine; an engine's advice under `theme` names its settings. `needs`
    names what an engine may declare to lack.
    """

    id: str
    name: str
    scenes: tuple[Scene, ...]
    value: Callable[..., float]
    target: float
    limit: float | None
    unit: str
    source: str
    means: str
    cure: str
    theme: str = ""
    means_above: str = ""
    needs: str = ""

    def judge(self, value: float, advice: str = "") -> tuple[str, str]:
        """The verdict ("pass", "fail", or "reported"), and why; `advice` is the engine's."""
        if self.limit is None:
            return "reported", "reported, not judged"
        if abs(value - self.target) <= self.limit:
            return "pass", ""
        digits = 6 if 0.0 < self.limit < 1e-3 else 4
        reading = "never seen" if math.isnan(value) else f"{value:.{digits}g}"
        above = value > self.target and self.means_above
        look_at = f"{self.cure}; {advice}" if advice else self.cure
        return "fail", (
            f"{reading}, {self.target:g} ± {self.limit:g} {self.unit} is right."
            f" {self.means_above if above else self.means} Look at: {look_at}."
        )


def crossing_time(t: Floats, values: Floats, level: float) -> float:
    """When `values` first pass `level` upward, linear between rows; NaN if never."""
    above = np.flatnonzero(values >= level)
    if not above.size:
        return math.nan
    i = int(above[0])
    if i == 0:
        return float(t[0])
    near = slice(i - 1, i + 1)
    return float(np.interp(level, values[near], t[near]))


def largest_difference(first: Floats, second: Floats) -> float:
    """Of two channels, as far as both go."""
    rows = min(len(first), len(second))
    return float(np.max(np.abs(first[:rows] - second[:rows])))


def worst(values: Iterable[float], target: float) -> float:
    """The value that is farthest from the target; NaN where any is NaN."""
    values = list(values)
    if any(map(math.isnan, values)):
        return math.nan
    return max(values, key=lambda value: abs(value - target))


def falls(motion: Motion) -> float:
    """1 if the block overturns, else 0."""
    return float(motion.history.outcome.startswith("overturned"))


def wrong_outcomes(expected: Iterable[bool], happened: Iterable[float]) -> float:
    """In how many scenes the block does what it must not, or not what it must."""
    return float(sum(do != must for must, do in zip(expected, happened, strict=True)))
