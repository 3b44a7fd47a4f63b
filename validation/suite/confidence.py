"""How sure a cell's figures are: its difference from each reference against u_num, u_input and u_D
(ASME V&V 20)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from rockcheck.scenes import Scene
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.execute import provenance
from rockcheck.validation.uncertainty.numerical import INPUTS, Explanation, Numerical, explain
from rockcheck.validation.uncertainty.population import Inputs

#: Quantities that are explained, with their units.
QUANTITIES = {"theta_rms": "alpha", "peak_rotation": "alpha", "last_slip": "m"}


def key_of(uncertainty: bool) -> dict[str, str]:
    """What a cell's key also depends on if its numerical uncertainty is asked for."""
    return (
        {"uncertainty": provenance.code_digest("rockcheck.validation.uncertainty.numerical")}
        if uncertainty
        else {}
    )


def numerical_of(record: Mapping[str, Any]) -> Numerical | None:
    """The numerical uncertainty that a worker has found, None where it was not asked for or not to
    be had."""
    found = record.get("numerical")
    return None if found is None else Numerical(**found)


def explanations(
    scene: Scene,
    figures: Sequence[Figure],
    references: Mapping[str, Sequence[Figure]],
    records: Mapping[str, Mapping[str, Any]],
    own: Mapping[str, Any],
    inputs: Inputs | None,
) -> Iterator[Explanation]:
    """The verdict on each quantity against each reference, by name: its own figures and its record
    (`records`).

    `own` is the candidate's record. There is no verdict for a model whose numerical error is
    unknown, nor for a block that falls.
    """
    numerical = numerical_of(own)
    if numerical is None:
        return
    for against, yardstick in references.items():
        other = numerical_of(records[against])
        if _falls(own) != _falls(records[against]):
            yield _other_outcome(against, numerical, other, inputs)
            continue
        for name, unit in QUANTITIES.items():
            error = _error(name, figures, yardstick, against)
            if error is None:
                continue
            u_num, reason = _both(name, numerical, other)
            u_data = math.hypot(
                *(_u_data(scene, record, name) for record in (own, records[against]))
            )
            u_input = (inputs.u_input(name) or 0.0) if inputs else 0.0
            yield explain(name, unit, error, u_num, u_input, u_data, reason=reason, against=against)


def _falls(record: Mapping[str, Any]) -> str:
    """The outcome of a block that falls, empty where it stands."""
    outcome = str(record["outcome"])
    return outcome if outcome.startswith("overturned") else ""


def _other_outcome(
    against: str, mine: Numerical, other: Numerical | None, inputs: Inputs | None
) -> Explanation:
    """What two different outcomes say: the peaks and slips of a block that falls have nothing to be
    compared with."""
    reasons = [reason for found in (mine, other) if found for reason in found.reasons]
    if reasons:
        return explain("outcome", "", None, None, reason="; ".join(reasons), against=against)
    both_occur = inputs is not None and 0.0 < inputs.overturns.value < 1.0  # among the draws
    verdict = INPUTS if both_occur else "not explained: model form or set-up, another outcome"
    return Explanation(
        quantity="outcome", unit="", against=against, error=1.0, u_num=0.0, verdict=verdict
    )


def _error(
    name: str, figures: Iterable[Figure], yardstick: Iterable[Figure], against: str
) -> float | None:
    if name == "theta_rms":
        return _value(figures, name, against)
    mine, theirs = _value(figures, name, ""), _value(yardstick, name, "")
    return None if mine is None or theirs is None else abs(mine - theirs)


def _value(figures: Iterable[Figure], name: str, against: str) -> float | None:
    return next(
        (f.value for f in figures if f.measure == name and f.against == against and not f.window),
        None,
    )


def _both(name: str, mine: Numerical, other: Numerical | None) -> tuple[float | None, str]:
    """The numerical uncertainties of both runs together, or why it is not known."""
    total = 0.0
    for found in (mine, other):
        if found is None:
            continue
        u = found.u_num(name)
        if u is None:
            return None, found.reason(name)
        total = math.hypot(total, u)
    return total, ""


def _u_data(scene: Scene, record: Mapping[str, Any], name: str) -> float:
    """Of a measured history, the scatter of its repeats: rotations in alpha, slips in m."""
    u = float(record.get("uncertainty", {}).get(name, 0.0))
    return u if name == "last_slip" else u / scene.block.alpha
