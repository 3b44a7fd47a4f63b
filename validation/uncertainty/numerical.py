"""u_num: how far a figure lies from that of an infinitely small step, from runs at steps h, 2h and 4h.

The grid convergence index (Roache 1994; ASME V&V 20-2009, section 2) for one run. With f1, f2, f3 the figure at h, 2h, 4h,

    p = log2((f3 - f2) / (f2 - f1)),      u_num = F |f2 - f1| / (2^min(p, 1) - 1).

It holds where the error falls like h^p. The factor of safety F is 1.25 where the observed order is within a tenth of 1, that of
contact codes, and 3 elsewhere (Oberkampf and Roy 2010, section 8.7). An observed order above 1 is not used: where terms in h and h^2
nearly cancel it is too high. The peak of a history is that of its rows, so how far the true one may lie above them is added
in quadrature. Contact codes often are not asymptotic, so the estimate may refuse:

| what the three runs say | verdict | u_num |
|---|---|---|
| they do not fall to the same side, or not all of them fall | not converged | none |
| changes are monotonic, 0.5 <= p <= 3 | converged | the index |
| else, and no change is above `SMALL` | converged | 3 times the largest change (Eca and Hoekstra 2014) |
| else | not converged: not asymptotic | none |

An event-based model has a tolerance instead of a step: u_num = F times the change at a hundredth of it, F = 1.25.

All uncertainties here are expanded ones: intervals that are meant to hold 95 % of the cases.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, Protocol, Self, runtime_checkable

import numpy as np

from rockcheck.scenes import History, Scene
from rockcheck.validation.discrepancy.figures import Stored

#: Steps of the runs, in units of the finest.
FACTORS = (1.0, 2.0, 4.0)
#: Factor of safety where the observed order is as expected, within so much; where it is not, or says nothing. The first is that of a
#: change with the tolerance, too.
SAFETY, POOR_SAFETY, NEARLY = 1.25, 3.0, 0.1
#: A higher order is observed, but not relied on.
TRUSTED_ORDER = 1.0
#: Orders between which the error is taken to fall like a power of the step.
LEAST_ORDER, MOST_ORDER = 0.5, 3.0
#: Changes up to this (rotations in alpha, slips in alpha R, times in 1/p) need no order to be called small.
SMALL = 1e-3
#: Changes below this, in the same units, are rounding.
ROUNDING = 1e-9

Verdict = Literal["converged", "not converged"]


@runtime_checkable
class Stepping(Protocol):
    """A model that steps through time and can do so more coarsely."""

    def coarser(self, factor: float) -> Self:
        """The same model with steps `factor` (> 1) times as long."""
        ...  # pragma: no cover

    def simulate(self, scene: Scene) -> History:
        """The motion of the scene."""
        ...  # pragma: no cover


@runtime_checkable
class EventBased(Protocol):
    """A model whose error is that of its tolerance."""

    def finer(self) -> Self:
        """The same model at a hundredth of its tolerance."""
        ...  # pragma: no cover

    def simulate(self, scene: Scene) -> History:
        """The motion of the scene."""
        ...  # pragma: no cover


class Quantity(Stored):
    """One figure of a run with its numerical uncertainty.

    `value` is the figure at the finest step; of `theta_rms`, a difference of histories, it is the RMS change of theta from 2h
    to h. `u_num` and `order` are None where they could not be found; `reason` then says why.
    """

    name: str
    unit: str
    value: float | str | None
    u_num: float | None = None
    order: float | None = None
    verdict: Verdict
    reason: str = ""


class Numerical(Stored):
    """The numerical uncertainty of one run: how it was found, and each quantity."""

    method: str
    quantities: tuple[Quantity, ...]

    @property
    def converged(self) -> bool:
        """Whether every quantity is."""
        return all(quantity.verdict == "converged" for quantity in self.quantities)

    def u_num(self, name: str) -> float | None:
        """The uncertainty of a quantity; None where it is not converged or not known."""
        return next((q.u_num for q in self.quantities if q.name == name and q.verdict == "converged"), None)

    def reason(self, name: str) -> str:
        """Why a quantity is not converged; of one that the runs do not have, why nothing is."""
        return next((q.reason for q in self.quantities if q.name == name), "; ".join(self.reasons))

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why what is not converged is not, each reason once."""
        return tuple(dict.fromkeys(q.reason for q in self.quantities if q.verdict != "converged"))


def numerical_uncertainty(model: object, scene: Scene, history: History | None = None) -> Numerical | None:
    """u_num of a model's run of a scene; None for a model that has neither a step nor a tolerance to change.

    `history` is the run at the model's own step, played here where it is not given. Two coarser runs (h, 2h, 4h: three
    quarters more cost), or one of an event-based model at a hundredth of its tolerance. Raises what `simulate` raises.
    """
    if isinstance(model, Stepping):
        finest = history or model.simulate(scene)
        runs = [finest, *(model.coarser(factor).simulate(scene) for factor in FACTORS[1:])]
        return Numerical(method="steps h, 2h and 4h", quantities=_from_steps(scene, runs))
    if isinstance(model, EventBased):
        given = history or model.simulate(scene)
        return Numerical(method="a hundredth of the tolerance", quantities=_from_tolerance(scene, given, model.finer().simulate(scene)))
    return None


def failed(history: History, reason: str) -> Numerical:
    """What is said of a run whose coarser or finer run failed."""
    outcome = Quantity(name="outcome", unit="", value=history.outcome, verdict="not converged", reason=reason)
    return Numerical(method="", quantities=(outcome,))


def _from_steps(scene: Scene, runs: Sequence[History]) -> tuple[Quantity, ...]:
    sides = [_side(history) for history in runs]
    shown: list[tuple[str, str, float | str]] = [*_scalars(scene, runs[0]), ("outcome", "", runs[0].outcome)]
    if len(set(sides)) > 1:
        words = ", ".join(side or "stands" for side in sides)
        reason = f"the outcome changes with the step: {words} at h, 2h, 4h"
        return tuple(Quantity(name=name, unit=unit, value=value, verdict="not converged", reason=reason) for name, unit, value in shown)
    alpha = scene.block.alpha
    rows = min(len(history.channels["theta"]) for history in runs)
    theta = [history.channels["theta"][:rows] / alpha for history in runs]
    fine, coarse = (float(np.sqrt(np.mean((theta[i + 1] - theta[i]) ** 2))) for i in (0, 1))
    quantities = [_judged("theta_rms", "alpha", fine, fine, coarse, 1.0)]
    units = _units(scene)
    for (name, unit, f1), (_, _, f2), (_, _, f3) in zip(*(_scalars(scene, history) for history in runs), strict=True):
        found = _judged(name, unit, f1, f2 - f1, f3 - f2, units[unit])
        if name == "peak_rotation" and found.u_num is not None:
            found = found.model_copy(update={"u_num": math.hypot(found.u_num, _between_rows(runs[0]) / alpha)})
        quantities.append(found)
    return (*quantities, Quantity(name="outcome", unit="", value=runs[0].outcome, u_num=0.0, verdict="converged"))


def _between_rows(history: History) -> float:
    """How far the largest |theta| may lie above that of the rows, rad: by the parabola through the highest three."""
    theta = np.abs(history.channels["theta"])
    top = int(np.argmax(theta))
    if not 0 < top < len(theta) - 1:
        return 0.0
    return float(abs(theta[top - 1] - 2.0 * theta[top] + theta[top + 1])) / 8.0


def _from_tolerance(scene: Scene, given: History, finer: History) -> tuple[Quantity, ...]:
    """The change, times the factor of safety: the finer run errs, too, by a few hundredths of it."""
    if _side(given) != _side(finer):
        reason = "the outcome changes with the tolerance"
        return (Quantity(name="outcome", unit="", value=given.outcome, verdict="not converged", reason=reason),)
    rows = min(len(given.channels["theta"]), len(finer.channels["theta"]))
    change = (finer.channels["theta"][:rows] - given.channels["theta"][:rows]) / scene.block.alpha
    rms = float(np.sqrt(np.mean(change**2)))
    found = [Quantity(name="theta_rms", unit="alpha", value=rms, u_num=SAFETY * rms, verdict="converged")]
    for (name, unit, value), (_, _, better) in zip(_scalars(scene, given), _scalars(scene, finer), strict=True):
        found.append(Quantity(name=name, unit=unit, value=value, u_num=SAFETY * abs(better - value), verdict="converged"))
    return (*found, Quantity(name="outcome", unit="", value=given.outcome, u_num=0.0, verdict="converged"))


def _judged(name: str, unit: str, value: float, fine: float, coarse: float, scale: float) -> Quantity:
    """The verdict on a quantity whose change is `fine` from 2h to h and `coarse` from 4h to 2h; `scale` is what SMALL is of."""
    largest = max(abs(fine), abs(coarse), abs(fine + coarse))
    if largest <= ROUNDING * scale:
        return Quantity(name=name, unit=unit, value=value, u_num=largest, verdict="converged")
    order = math.log2(coarse / fine) if fine * coarse > 0.0 else math.nan
    if LEAST_ORDER <= order <= MOST_ORDER:
        safety = SAFETY if abs(order - TRUSTED_ORDER) <= NEARLY else POOR_SAFETY
        index = safety * abs(fine) / (2.0 ** min(order, TRUSTED_ORDER) - 1.0)
        return Quantity(name=name, unit=unit, value=value, u_num=index, order=order, verdict="converged")
    known = order if math.isfinite(order) else None
    if largest <= SMALL * scale:
        return Quantity(name=name, unit=unit, value=value, u_num=POOR_SAFETY * largest, order=known, verdict="converged")
    reason = (
        f"not asymptotic: the order of {name} is {order:.1f}, not {LEAST_ORDER:g} to {MOST_ORDER:g}"
        if known is not None
        else f"not asymptotic: {name} does not change monotonically with the step"
    )
    return Quantity(name=name, unit=unit, value=value, order=known, verdict="not converged", reason=reason)


def _scalars(scene: Scene, history: History) -> list[tuple[str, str, float]]:
    """Name, unit and value of the scalar figures: peak rotation and last slip, or the time of the fall."""
    if _side(history):
        return [("end_time", "s", float(history.channels["t"][-1]))]
    found = [("peak_rotation", "alpha", history.peak_rotation / scene.block.alpha)]
    if "slip" in history.channels:
        found.append(("last_slip", "m", float(history.channels["slip"][-1])))
    return found


def _units(scene: Scene) -> dict[str, float]:
    """What a quantity is small against, by its unit."""
    return {"alpha": 1.0, "m": scene.block.alpha * scene.block.radius, "s": 1.0 / scene.frequency_parameter}


def _side(history: History) -> str:
    """The side it overturns to, empty where it stands."""
    return history.outcome.removeprefix("overturned ") if history.outcome.startswith("overturned") else ""
