"""The verdict of ASME V&V 20: a difference E = S - D against what is known of its uncertainty.

    u_val = sqrt(u_num^2 + u_input^2 + u_D^2)

| | says |
|---|---|
| E <= u_num | explained by numerical error |
| E <= u_val | explained by what is not known about the inputs or the tests' scatter, the larger |
| E > u_val | not explained: model form or set-up, at least E - u_val |
| u_num is not known | could not be judged: not converged |

It stands beside the verdict of a tolerance and never replaces it. All uncertainties are expanded
(95 %).
"""

from __future__ import annotations

import math

from rockcheck.validation.discrepancy.figures import Stored

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

    @property
    def u_val(self) -> float | None:
        """The uncertainty of the comparison; None where the run is not converged."""
        return None if self.u_num is None else math.hypot(self.u_num, self.u_input, self.u_data)

    @property
    def explained(self) -> bool:
        """Whether the difference lies within its uncertainty."""
        return self.verdict in (NUMERICAL, INPUTS, DATA)


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
    """The verdict on a difference; `u_num` holds both runs' numerical uncertainties, `reason` why
    it is None, `against` the reference."""
    verdict = _verdict(unit, error, u_num, u_input, u_data)
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


def _verdict(
    unit: str, error: float | None, u_num: float | None, u_input: float, u_data: float
) -> str:
    if u_num is None or error is None:
        return NOT_CONVERGED
    if error <= u_num:
        return NUMERICAL
    u_val = math.hypot(u_num, u_input, u_data)
    if error <= u_val:
        return INPUTS if u_input >= u_data else DATA
    return f"not explained: model form or set-up, at least {error - u_val:.2g} {unit}".rstrip()
