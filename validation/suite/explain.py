"""Verdicts on the differences of a cell from its references (ASME V&V 20).

In: a finished cell, its references, and the uncertainties: u_num of each, u_input of the scene, the
scatter of measured histories. Out: an `Explanation` a quantity. `runner` calls `explanations`.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

from rockcheck.scenes import Scene
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.discrepancy.impacts import SAME_IMPACT
from rockcheck.validation.suite import results
from rockcheck.validation.uncertainty import input_spread, numerical

#: Quantities whose differences are explained, with their units.
QUANTITIES = {"theta_rms": "alpha", "peak_rotation": "alpha", "last_slip": "m"}
OTHER_OUTCOME = "not explained: model form or set-up, another outcome"


def explanations(
    scene: Scene,
    cell: results.Cell,
    references: Iterable[results.Cell],
    scatters: Mapping[str, Mapping[str, float]],
    inputs: input_spread.Inputs | None,
) -> Iterator[numerical.Explanation]:
    """The verdict on each quantity of a cell against each reference.

    `scatters` is, by model, the scatter of the repeats of a measured history: rotations in rad,
    slips in m. There is no verdict for a model whose numerical error is unknown. Where the outcomes
    differ and a block falls, the only verdict is on the outcome; where both fall alike, or one
    history ends before the other, there is none on peaks and slips.
    """
    if cell.numerical is None:
        return
    for reference in references:
        both_errors = [error for error in (cell.numerical, reference.numerical) if error]
        falls = "overturned" in cell.outcome or "overturned" in reference.outcome
        if falls and cell.outcome != reference.outcome:
            yield _outcome_verdict(reference.model, both_errors, inputs)
            continue
        yield from _quantity_verdicts(scene, cell, reference, both_errors, scatters, inputs)


def _quantity_verdicts(
    scene: Scene,
    cell: results.Cell,
    reference: results.Cell,
    both_errors: Sequence[numerical.Numerical],
    scatters: Mapping[str, Mapping[str, float]],
    inputs: input_spread.Inputs | None,
) -> Iterator[numerical.Explanation]:
    """The verdict on each quantity that differs in a comparable way."""
    for quantity, unit in QUANTITIES.items():
        difference = _difference(quantity, cell, reference)
        if difference is None:
            continue
        u_num, reason = _combined_u_num(quantity, both_errors)
        size = scene.block.alpha if unit == "alpha" else 1.0
        scatter = scatters[cell.model].get(quantity, 0.0) / size
        reference_scatter = scatters[reference.model].get(quantity, 0.0) / size
        yield numerical.explain(
            quantity,
            unit,
            difference,
            u_num,
            _u_input(quantity, inputs),
            math.hypot(scatter, reference_scatter),
            reason=reason,
            against=reference.model,
        )


def _u_input(quantity: str, inputs: input_spread.Inputs | None) -> float:
    """The uncertainty that the inputs cause, 0 where it is not known."""
    if inputs is None:
        return 0.0
    return inputs.u_input(quantity) or 0.0


def _difference(quantity: str, cell: results.Cell, reference: results.Cell) -> float | None:
    """The difference of a quantity, None where it has none.

    A figure of a pair is a difference itself; two figures of histories are subtracted, if the
    reference stays and both histories end together.
    """
    value = results.value_of(cell.figures, quantity)
    reference_value = results.value_of(reference.figures, quantity)
    if value is None or reference_value is None:
        return results.value_of(cell.figures, quantity, reference.model)
    end, reference_end = _end_time(cell.figures), _end_time(reference.figures)
    if "overturned" in reference.outcome or abs(end - reference_end) > SAME_IMPACT:
        return None
    return abs(value - reference_value)


def _end_time(figures: Sequence[Figure]) -> float:
    return results.value_of(figures, "end_time") or 0.0


def _outcome_verdict(
    against: str,
    both_errors: Sequence[numerical.Numerical],
    inputs: input_spread.Inputs | None,
) -> numerical.Explanation:
    """The verdict on two different outcomes; a falling block's peaks and slips do not compare."""
    reasons = [reason for error in both_errors for reason in error.reasons]
    if reasons:
        return numerical.explain(
            "outcome", "", None, None, reason="; ".join(reasons), against=against
        )
    verdict = OTHER_OUTCOME
    if inputs is not None and 0.0 < inputs.overturns.value < 1.0:  # both occur among the draws
        verdict = numerical.INPUTS
    return numerical.Explanation(
        quantity="outcome", unit="", against=against, error=1.0, u_num=0.0, verdict=verdict
    )


def _combined_u_num(
    quantity: str, both_errors: Sequence[numerical.Numerical]
) -> tuple[float | None, str]:
    """The combined numerical uncertainty of both runs; None and the reason if one is unknown."""
    uncertainties = []
    for error in both_errors:
        u_num = error.u_num(quantity)
        if u_num is None:
            return None, error.reason(quantity)
        uncertainties.append(u_num)
    return math.hypot(*uncertainties), ""
