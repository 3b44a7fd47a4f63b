"""u_num: how far a figure lies from that of an infinitely small step; steps h, 2h, 3h and 4h.

A figure alone can agree by chance: a slip that ends at a wall ends there in every run. So the
histories are compared. A figure's change is the largest of its history at any time (theta of the
peak, slip of the last slip; of theta_rms the RMS over time, of a fall its time). How far a run lies
from that at h, d, is the largest of these, in units of alpha, alpha R and 1/p.

| what the four runs say | verdict | u_num |
|---|---|---|
| they do not fall to the same side, or not all of them fall | not converged | none |
| d(2h) <= d(3h) <= d(4h), order >= 0.5, d(2h) <= `LARGE` | converged | 1.25 largest changes |
| else, and no d is above `LARGE` | converged | 3 times the largest d, in the figure's unit |
| else | not converged: the histories part | none |

Where the error falls like h^p, d(4h) / d(2h) = 2^p + 1, and from p = 0.5 on the change from h to 4h
is no less than the error at h. So the second row needs no order, only a factor of safety (1.25:
Roache 1994; ASME V&V 20-2009, section 2). Where d does not grow with the step, impacts come in
another order from run to run. Then any figure may be off by what any history is, with the larger
factor (3: Eca and Hoekstra 2014; Oberkampf and Roy 2010, section 8.7). The run at 3h is for that:
figures that agree at h, 2h and 4h by chance seldom agree at 3h.

An event-based model has a tolerance instead of a step: u_num = 1.25 times the change at a hundredth
of it. All uncertainties here are expanded ones: intervals that are
meant to hold 95 % of the cases.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any, Literal

import numpy as np

from rockcheck.ebm.ties import ties_of
from rockcheck.scenes import History, InputError, ModelFailure, Scene, printable
from rockcheck.validation.discrepancy.figures import Stored, end_of, extremes_in, last_slip_of

#: Steps of the runs, in units of the finest.
FACTORS = (1.0, 2.0, 3.0, 4.0)
#: Factor of safety where the histories converge (and of a change with the tolerance); where not.
SAFETY, POOR_SAFETY = 1.25, 3.0
#: From this order on the histories converge.
LEAST_ORDER = 0.5
#: Largest distance at which histories still show one motion (rotations in alpha, slips in alpha R,
#: times in 1/p).
LARGE = 0.1


class Quantity(Stored):
    """One figure of a run with its numerical uncertainty.

    `value` is the figure at the finest step; of `theta_rms`, a difference of histories, it is the
    RMS change of theta from 2h to h. `order` is that of its changes, None where they do not grow
    with the step. `u_num` is None where it could not be found; `reason` then says why.
    """

    name: str
    unit: str
    value: float | str | None
    u_num: float | None = None
    order: float | None = None
    verdict: Literal["converged", "not converged"]
    reason: str = ""


class Numerical(Stored):
    """The numerical uncertainty of one run: how it was found, and each quantity."""

    method: str
    quantities: tuple[Quantity, ...]

    @property
    def converged(self) -> bool:
        """Whether every quantity is converged."""
        return all(quantity.verdict == "converged" for quantity in self.quantities)

    def u_num(self, name: str) -> float | None:
        """The uncertainty of a quantity; None where it is not converged or not known."""
        return next(
            (q.u_num for q in self.quantities if q.name == name and q.verdict == "converged"), None
        )

    def reason(self, name: str) -> str:
        """Why a quantity is not converged; for a quantity that is missing, all `reasons`."""
        return next((q.reason for q in self.quantities if q.name == name), "; ".join(self.reasons))

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why quantities are not converged, each reason once."""
        return tuple(dict.fromkeys(q.reason for q in self.quantities if q.verdict != "converged"))


def numerical_uncertainty(
    model: Any, scene: Scene, history: History | None = None
) -> Numerical | None:
    """u_num of a model's run of a scene; None for a model with neither a step nor a tolerance.

    A model with a step has `coarser(factor)`, the same model with steps `factor` (> 1) times as
    long; one with a tolerance has `finer()`, the same at a hundredth of it.

    `history` is the run at the model's own step, played here where it is not given. Three coarser
    runs (together 13/12 of its cost), or one of an event-based model at a hundredth of its
    tolerance. One that fails leaves nothing converged. Raises what `simulate` raises of the run
    itself.

    Where the mechanics has more than one answer (`ebm.ties`) nothing is converged: what a run
    converges to is the answer that rounding has chosen.
    """
    if not (hasattr(model, "coarser") or hasattr(model, "finer")):
        return None
    numerical = _by_other_runs(model, scene, history or model.simulate(scene))
    found = ties_of(scene)
    if found:
        return _undone(numerical, f"a tie: {found[0].what}")
    return numerical


def _undone(numerical: Numerical, reason: str) -> Numerical:
    """The same with no converged quantity, for this reason."""
    change = {"u_num": None, "order": None, "verdict": "not converged", "reason": reason}
    quantities = (quantity.model_copy(update=change) for quantity in numerical.quantities)
    return numerical.model_copy(update={"quantities": tuple(quantities)})


def _by_other_runs(model: Any, scene: Scene, given: History) -> Numerical:
    """The uncertainty of a run by coarser ones, or by a finer one."""
    method = "a hundredth of the tolerance"
    try:
        if hasattr(model, "coarser"):
            method = "steps h, 2h, 3h and 4h"
            runs = [given, *(model.coarser(factor).simulate(scene) for factor in FACTORS[1:])]
            return Numerical(method=method, quantities=tuple(_from_steps(scene, runs)))
        finer = model.finer().simulate(scene)
    except (ModelFailure, InputError) as error:
        return failed(given, f"a coarser or finer run failed: {printable(error)}", method)
    if _side(given) != _side(finer):
        return failed(given, "the outcome changes with the tolerance", method)
    # `SAFETY` times the change: the finer run errs by a few hundredths of it.
    rms = _changes(scene, given, finer)["theta_rms"]
    figures = zip(_scalars(scene, given), _scalars(scene, finer), strict=True)
    return Numerical(
        method=method,
        quantities=(
            _quantity("theta_rms", "alpha", rms, SAFETY * rms),
            *(
                _quantity(name, unit, value, SAFETY * abs(better - value))
                for (name, unit, value), (_, _, better) in figures
            ),
            _quantity("outcome", "", given.outcome),
        ),
    )


def failed(history: History, reason: str, method: str = "") -> Numerical:
    """No converged quantity, for this reason, such as a coarser or finer run that failed."""
    return Numerical(
        method=method, quantities=(_quantity("outcome", "", history.outcome, reason=reason),)
    )


def _from_steps(scene: Scene, runs: Sequence[History]) -> Iterator[Quantity]:
    alpha, finest = scene.block.alpha, runs[0]
    units = {"alpha": 1.0, "m": alpha * scene.block.radius, "s": 1.0 / scene.frequency_parameter}
    changes = [_changes(scene, finest, coarser) for coarser in runs[1:]]
    shown = [("theta_rms", "alpha", changes[0]["theta_rms"]), *_scalars(scene, finest)]
    apart = [max(one[name] / units[unit] for name, unit, *_ in shown) for one in changes]
    order = _order(apart)
    converge = apart == sorted(apart) and order is not None and order >= LEAST_ORDER
    parted = apart[0] if converge else max(apart)
    sides = list(map(_side, runs))
    unsure = reason = ""
    if len(set(sides)) > 1:
        unsure = reason = f"the outcome changes with the step: {', '.join(sides)} at h, 2h, 3h, 4h"
    elif parted > LARGE:
        reason = f"the histories part by {parted:.2g} with the step, more than {LARGE:g}"
    for name, unit, value in shown:
        own = [one[name] for one in changes]
        u = SAFETY * max(own) if converge else POOR_SAFETY * max(apart) * units[unit]
        yield _quantity(name, unit, value, u, reason, _order(own))
    yield _quantity("outcome", "", finest.outcome, reason=unsure)


def _changes(scene: Scene, one: History, other: History) -> dict[str, float]:
    """Largest change of each figure's history between two runs; of theta_rms the RMS over time.

    A peak between rows, and a slip after the last one, may change by more than the rows do.
    """
    rows = min(len(one.channels["theta"]), len(other.channels["theta"]))
    change = {
        name: np.abs(other.channels[name][:rows] - one.channels[name][:rows])
        for name in ("theta", "slip")
        if name in one.channels
    }
    theta = change["theta"] / scene.block.alpha
    first, second = extremes_in(one, scene), extremes_in(other, scene)
    peaks = abs(second.peak_rotation - first.peak_rotation) / scene.block.alpha
    slips = abs(last_slip_of(other) - last_slip_of(one))
    return {
        "theta_rms": float(np.sqrt(np.mean(theta**2))),
        "peak_rotation": float(np.fmax(np.max(theta), peaks)),
        "last_slip": float(np.fmax(np.max(change.get("slip", 0.0)), slips)),
        "end_time": abs(end_of(other) - end_of(one)),
    }


def _order(changes: Sequence[float]) -> float | None:
    ratio = changes[-1] / changes[0] if changes[0] else 1.0
    return math.log2(ratio - 1.0) if ratio > 1.0 else None


def _quantity(
    name: str,
    unit: str,
    value: float | str,
    u_num: float = 0.0,
    reason: str = "",
    order: float | None = None,
) -> Quantity:
    return Quantity(
        name=name,
        unit=unit,
        value=value,
        u_num=None if reason else u_num,
        order=order,
        verdict="not converged" if reason else "converged",
        reason=reason,
    )


def _scalars(scene: Scene, history: History) -> list[tuple[str, str, float]]:
    """Scalar figures with their units: peak rotation and last slip, or time of the fall."""
    if _side(history) != "stands":
        return [("end_time", "s", end_of(history))]
    extremes = extremes_in(history, scene)
    scalars = [("peak_rotation", "alpha", extremes.peak_rotation / scene.block.alpha)]
    slip = last_slip_of(history)
    if math.isfinite(slip):
        scalars.append(("last_slip", "m", slip))
    return scalars


def _side(history: History) -> str:
    return (
        history.outcome.removeprefix("overturned ")
        if history.outcome.startswith("overturned")
        else "stands"
    )


NUMERICAL = "explained by numerical error"
INPUTS = "explained by what is not known about the inputs"
DATA = "explained by the scatter of the tests"
NOT_CONVERGED = "not converged"


class Explanation(Stored):
    """The difference of one quantity from the reference's, its uncertainties, and what they say.

    `error` is |S - D| (for theta_rms the RMS difference itself); a `u_num` of None means that the
    run is not converged.
    """

    quantity: str
    unit: str
    against: str = ""
    error: float | None
    u_num: float | None
    u_input: float = 0.0
    u_data: float = 0.0
    verdict: str
    reason: str = ""


def explain(
    quantity: str,
    unit: str,
    error: float | None,
    u_num: float | None,
    u_input: float = 0.0,
    u_data: float = 0.0,
    *,
    reason: str = "",
    against: str = "",
) -> Explanation:
    """The difference of one quantity with its verdict.

    `u_num` holds both runs' numerical uncertainties, `reason` says why it is None, `against` names
    the reference.
    """
    u_val = math.hypot(u_num or 0.0, u_input, u_data)
    if u_num is None or error is None:
        verdict = NOT_CONVERGED
    elif error <= u_num:
        verdict = NUMERICAL
    elif error <= u_val:
        verdict = INPUTS if u_input >= u_data else DATA
    else:
        verdict = (
            f"not explained: model form or set-up, at least {error - u_val:.2g} {unit}".rstrip()
        )
    return Explanation(
        quantity=quantity,
        unit=unit,
        against=against,
        error=error,
        u_num=u_num,
        u_input=u_input,
        u_data=u_data,
        verdict=verdict,
        reason=reason,
    )
