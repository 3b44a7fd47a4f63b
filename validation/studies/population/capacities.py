"""What a block can bear: capacities, of which an assessment finds the intensity that exceeds them.

In: words such as "slip:0.05". Out: capacities, and which runs of a batch exceed them. The command
and the plan call it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import fates
from rockcheck.scenes import Floats, InputError, Side, errors, printable

#: Capacities of one assessment, at the most.
MOST = 12
_SIDES: tuple[Side, Side] = ("left", "right")
#: Quantities that have a capacity: what they are called, and their unit.
QUANTITIES = {
    "slip": ("slip", "m"),
    "top": ("top displacement", "m"),
    "wall_speed": ("speed at a wall", "m/s"),
    "rotation": ("peak rotation", "alpha"),
}
OVERTURNS = "overturns"


@dataclass(frozen=True)
class Capacity:
    """The largest value of a `quantity` that the block bears; without a value that it stands."""

    quantity: str
    value: float = math.inf

    @property
    def name(self) -> str:
        """As the option has it."""
        return self.quantity if self.quantity == OVERTURNS else f"{self.quantity}:{self.value:g}"

    @property
    def words(self) -> str:
        """What exceeds it."""
        if self.quantity == OVERTURNS:
            return OVERTURNS
        label, unit = QUANTITIES[self.quantity]
        return f"{label} above {self.value:g} {unit}"

    def exceeded(self, played: fates.Fates, alpha: float) -> NDArray[np.bool_]:
        """Which runs exceed it: also those that overturn, and those that nothing decides.

        `alpha` (rad) is the block's slenderness angle. Extremes are asked for.
        """
        stands = np.isin(played.outcome, (fates.AT_REST, fates.MOVING))
        if self.quantity == OVERTURNS:
            return ~stands
        return ~stands | (self._values(played, alpha) > self.value)

    def _values(self, played: fates.Fates, alpha: float) -> Floats:
        extremes = played.extremes
        assert extremes is not None, "extremes were asked for"
        if self.quantity == "rotation":
            return played.peak / alpha
        if self.quantity == "wall_speed":
            struck = [
                np.where(extremes[f"wall_{side}_strikes"] > 0, extremes[f"wall_{side}_speed"], 0.0)
                for side in _SIDES
            ]
            return np.maximum(*struck)
        return extremes["slip" if self.quantity == "slip" else "top_displacement"]


def capacity_of(word: str) -> Capacity:
    """The capacity that a word names: "overturns", "slip:0.05", or "0.5", a rotation (alpha).

    Raises `InputError`.
    """
    quantity, _, number = word.partition(":")
    if quantity[:1].isdigit() and not number:
        quantity, number = "rotation", quantity
    if quantity == OVERTURNS and not number:
        return Capacity(OVERTURNS)
    if quantity not in QUANTITIES:
        known = [*(f"{name}:VALUE" for name in QUANTITIES), OVERTURNS]
        raise InputError(str(errors.unknown_name("capacity", word, known)), "--capacity")
    label, unit = QUANTITIES[quantity]
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    most = 1.0 if quantity == "rotation" else math.inf
    if not 0.0 < value <= most or math.isinf(value):
        limit = f" and at most {most:g}" if most == 1.0 else ""
        raise InputError(
            f"{printable(repr(word))} is not allowed: give the {label} in {unit}, above 0{limit},"
            f" as in {quantity}:{0.5 if quantity == 'rotation' else 0.05}",
            "--capacity",
        )
    return Capacity(quantity, value)


def capacities_of(words: Sequence[str]) -> tuple[Capacity, ...]:
    """The capacities that words name, each once. Raises `InputError`."""
    found = tuple(dict.fromkeys(capacity_of(word.strip()) for word in words))
    if len(found) > MOST:
        raise InputError(f"{len(found)} is too many: at most {MOST}", "--capacity")
    return found
