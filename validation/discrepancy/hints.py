"""A sign turned, or a shift in time, where either explains how far two histories are apart.

In: two histories. Out: a `Hint`, or None. `rockcheck compare` and measured histories in suites give
it to the user.
"""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from rockcheck.scenes import History, InputError, Scene
from rockcheck.validation.discrepancy import measured
from rockcheck.validation.discrepancy.figures import Pair

#: A difference is large from this share of the reference's rotation on, both as RMS.
LARGE = 0.1
#: A change explains a difference that falls below this share of what it was.
EXPLAINED = 0.1
#: Least part of the common time, and of the reference's rotation (its squares), that is left to
#: compare after a shift.
LEAST_COMMON = 0.5


@dataclass(frozen=True)
class Hint:
    """A change of the candidate that explains its difference from the reference.

    `shift` (s) is added to the candidate's times. `within` is the RMS difference of the rotations
    that is left, in `unit` ("alpha", or "rad" where the block is unknown).
    """

    turned: bool
    shift: float
    within: float
    unit: str

    def sentence(self, subject: str, advice: str) -> str:
        """The hint in words: `subject` is the candidate, `advice` says how it is shifted so."""
        left = f"it is within {self.within:.1g} {self.unit} (RMS)"
        sign = f"{subject}'s rotation has the other sign"
        if not self.shift:
            return f"{sign}: turned, {left}"
        moved = f"shifted by {self.shift:+.4g} s, {left}: {advice}"
        return f"{sign}: turned, and {moved}" if self.turned else f"{subject}: {moved}"


def hint(
    reference: History, candidate: History, until: float | None = None, scene: Scene | None = None
) -> Hint | None:
    """The simplest change that explains a large difference of the rotations up to `until` (s).

    None where the difference is small, or neither a sign nor a shift explains it. Both have a time
    in common.
    """
    end = math.inf if until is None else until
    pair = Pair(reference, candidate, scene, end)
    before = _relative_difference(pair)
    if before < LARGE:
        return None
    for turned, shift in _changes(reference, candidate):
        changed = measured.shifted(_turned(candidate) if turned else candidate, shift)
        changed_pair = Pair(reference, changed, scene, end)
        if not _has_enough_in_common(pair, changed_pair):
            continue
        if _relative_difference(changed_pair) < EXPLAINED * before:
            unit = "rad" if pair.alpha is None else "alpha"
            return Hint(turned, shift, changed_pair.rms(changed_pair.theta), unit)
    return None


def _changes(reference: History, candidate: History) -> list[tuple[bool, float]]:
    """The changes that may explain a difference, the simplest first: a turned sign, and a shift."""
    changes = [(True, 0.0)]
    for turned in (False, True):
        try:
            shift = measured.time_shift(reference, _turned(candidate) if turned else candidate)
        except InputError:  # one of them does not rotate
            return changes
        changes.append((turned, shift))
    return changes


def _turned(history: History) -> History:
    """The history with the other sign of the rotation, and of its rate."""
    names = history.channels.keys() & {"theta", "theta_dot"}
    turned = {name: -history.channels[name] for name in names}
    return dataclasses.replace(
        history, channels={**history.channels, **turned}, model_extremes=None
    )


def _relative_difference(pair: Pair) -> float:
    """The RMS difference of the rotations beside the RMS of the reference's; 0 if it has none."""
    size = math.sqrt(pair.mean(pair.theta[0] ** 2))
    return pair.rms(pair.theta) / size if size > 0.0 else 0.0


def _has_enough_in_common(pair: Pair, changed: Pair) -> bool:
    """Whether a shift leaves enough of the time, and of the reference's rotation, to compare."""
    if len(changed.time) < 2:
        return False
    is_long = changed.end - changed.start >= LEAST_COMMON * (pair.end - pair.start)
    before, after = (float(np.sum(either.theta[0] ** 2)) for either in (pair, changed))
    return is_long and after >= LEAST_COMMON * before
