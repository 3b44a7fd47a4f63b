"""Differences of two histories in their events: impacts, falls, outcomes.

In: a `Pair`, whose impacts are matched (`impacts`). Out: a number for each of `DIFFERENCES`, mostly
with a remark that names the event. `measures` lists them for `compare`.
"""

import math
from collections.abc import Sequence

from rockcheck.scenes import Event
from rockcheck.validation.discrepancy import impacts
from rockcheck.validation.discrepancy.figures import Measure, Pair, Value, WindowedHistory, by_name


def _agree_until(pair: Pair) -> tuple[float, str]:
    _, only_reference, only_candidate = pair.impacts
    unmatched = [
        *_times_and_remarks(only_reference, pair.reference.model),
        *_times_and_remarks(only_candidate, pair.candidate.model),
    ]
    return min(unmatched, default=(pair.end, "all events agree"))


def _times_and_remarks(events: Sequence[Event], model: str) -> list[tuple[float, str]]:
    return [(event.t, f"{event.kind} only in {model}") for event in events]


def _unmatched_impacts(pair: Pair) -> tuple[float, str]:
    matched, only_reference, only_candidate = pair.impacts
    count = len(only_reference) + len(only_candidate)
    return float(count), f"{len(matched)} impacts matched"


def _impact_time(pair: Pair) -> tuple[float, str]:
    matched = pair.impacts[0]
    if not matched:
        return 0.0, "no impact has a counterpart"
    impact, counterpart = max(matched, key=lambda match: abs(match[1].t - match[0].t))
    return abs(counterpart.t - impact.t), f"{impact.kind} at {impact.t:.3f} s"


def _impulse(pair: Pair) -> Value:
    matched = pair.impacts[0]
    strongest = dict.fromkeys(impacts.IMPACTS, 0.0)
    for impact, _ in matched:
        strongest[impact.kind] = max(strongest.get(impact.kind, 0.0), abs(impact.impulse))
    of_reference = WindowedHistory(pair.reference).events(*impacts.IMPACTS)
    of_candidate = WindowedHistory(pair.candidate).events(*impacts.IMPACTS)
    errors = []
    for impact, counterpart in matched:
        if strongest[impact.kind] <= 0.0:
            continue
        if _strikes_alone(impact, of_reference) and _strikes_alone(counterpart, of_candidate):
            error = abs(counterpart.impulse - impact.impulse) / strongest[impact.kind]
            errors.append((error, impact))
    if not errors:
        return 0.0, "no impact of one contact alone has a counterpart"
    largest, impact = max(errors, key=lambda error_at: error_at[0])
    return largest, f"{impact.kind} at {impact.t:.3f} s"


def _strikes_alone(impact: Event, all_impacts: Sequence[Event]) -> bool:
    """Whether no contact of another kind is struck at that instant.

    How several contacts share an impulse the motion does not say.
    """
    return not any(
        other.kind != impact.kind and abs(other.t - impact.t) <= impacts.ONE_IMPACT
        for other in all_impacts
    )


def _overturning_time(pair: Pair) -> float:
    reference, candidate = pair.reference.overturned_at, pair.candidate.overturned_at
    if reference is None and candidate is None:
        return 0.0
    if reference is None or candidate is None:
        return math.inf
    return abs(candidate - reference)


def _outcome(pair: Pair) -> tuple[float, str]:
    reference, candidate = pair.reference.outcome, pair.candidate.outcome
    if reference == candidate:
        return 1.0, reference
    neither_falls = reference not in impacts.TURNS and candidate not in impacts.TURNS
    return float(neither_falls), f"{reference} / {candidate}"


DIFFERENCES = by_name(
    Measure(
        "events_agree_until",
        "events agree until",
        "s",
        "Time up to which each impact (and fall) of either has its counterpart in the other;"
        " the remark says what comes then.\n\nCounterparts are of one kind and within 20 ms;"
        " impacts below 1 % of the strongest need none, and those within 2 ms are one. The window's"
        " end if all agree.",
        _agree_until,
        ideal=None,
        sense="at least",
    ),
    Measure(
        "unmatched_impacts",
        "impacts without counterpart",
        "1",
        "Number of impacts of either that have no counterpart in the other, matched as in"
        " `events_agree_until`.",
        _unmatched_impacts,
        resolution=0.0,
    ),
    Measure(
        "impact_time",
        "largest impact-time error",
        "s",
        "max |t_c - t_r| over the impacts that have a counterpart, matched as in"
        " `events_agree_until`, s.",
        _impact_time,
    ),
    Measure(
        "impulse_error",
        "largest error of impulse",
        "1",
        "max |J_c - J_r| over the impacts that have a counterpart, over the strongest of them of"
        " its kind; matched as in `events_agree_until`.\n\nWithout those at which floor and wall"
        " are struck within 2 ms: how the two share an impulse the motion does not say.",
        _impulse,
        on_request=True,
    ),
    Measure(
        "overturning_time",
        "difference of overturning time",
        "s",
        "|t_c - t_r| of |theta| = pi/2, s; 0 if neither overturns, infinite if only one does.",
        _overturning_time,
    ),
    Measure(
        "outcome_agrees",
        "outcome agrees",
        "1",
        "1 if both overturn to the same side or neither overturns, else 0; of the whole"
        " histories, whatever the window.",
        _outcome,
        ideal=1.0,
        resolution=0.0,
        yes_no=True,
    ),
)
