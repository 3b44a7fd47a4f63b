"""Impacts of one history or two: which are one impact, which are weak, which are counterparts.

In: events of a history, or of two. Out: the impacts that count (`joined`, `strong`), or pairs of
counterparts and what is left over (`match_impacts`). Called by `figures` and the measures.
"""

import math
from collections.abc import Container, Sequence

import numpy as np

from rockcheck.scenes import Event

IMPACTS = ("floor impact", "wall impact")
TURNS = ("overturned left", "overturned right")
#: Impacts of two histories are the same impact if they lie within this time, s.
SAME_IMPACT = 0.020
#: Impacts of one kind in one history are one if they lie within this time, s: of corners that
#: strike together, which models tell as one or one by one, and of a corner that rattles.
ONE_IMPACT = 2e-3
#: Impacts weaker than this share of the history's strongest of their kind need no counterpart.
WEAK_IMPACT = 0.01
#: Rounding of a time, s.
ROUNDING = 1e-9

#: Matched impacts as (reference, candidate), and those of either without a counterpart.
MatchedImpacts = tuple[list[tuple[Event, Event]], list[Event], list[Event]]


def joined(events: Sequence[Event]) -> list[Event]:
    """Of events of one kind, in order of time, the strongest of those within `ONE_IMPACT`."""
    groups: list[list[Event]] = []
    last_time = -math.inf
    for event in events:
        if event.t - last_time > ONE_IMPACT:
            groups.append([])
        groups[-1].append(event)
        last_time = event.t
    return [max(group, key=lambda event: abs(event.impulse)) for group in groups]


def strong(impacts: Sequence[Event]) -> list[bool]:
    """Which impacts are not weak (`WEAK_IMPACT`) among those of their kind."""
    strongest: dict[str, float] = {}
    for event in impacts:
        strongest[event.kind] = max(strongest.get(event.kind, 0.0), abs(event.impulse))
    return [abs(event.impulse) >= WEAK_IMPACT * strongest[event.kind] for event in impacts]


def match_impacts(reference: Sequence[Event], candidate: Sequence[Event]) -> MatchedImpacts:
    """Match impacts of one kind within `SAME_IMPACT`, nearest first.

    Weak impacts (`WEAK_IMPACT`) need no counterpart, and take none from those that do. Overturning
    counts as an event of its own kind.
    """
    reference = sorted(reference, key=_time_and_kind)
    candidate = sorted(candidate, key=_time_and_kind)
    reference_strong, candidate_strong = strong(reference), strong(candidate)
    counterpart: dict[int, int] = {}
    taken: set[int] = set()
    for *_, i, j in sorted(_near(reference, candidate, reference_strong, candidate_strong)):
        if i not in counterpart and j not in taken:
            counterpart[i] = j
            taken.add(j)
    pairs = [(reference[i], candidate[j]) for i, j in sorted(counterpart.items())]
    only_reference = _unmatched(reference, reference_strong, counterpart)
    only_candidate = _unmatched(candidate, candidate_strong, taken)
    return pairs, only_reference, only_candidate


def _time_and_kind(event: Event) -> tuple[float, int]:
    return event.t, (IMPACTS + TURNS).index(event.kind)


def _near(
    reference: Sequence[Event],
    candidate: Sequence[Event],
    reference_strong: Sequence[bool],
    candidate_strong: Sequence[bool],
) -> list[tuple[bool, float, int, int]]:
    """Impacts that may be counterparts: whether either is weak, time between them, their numbers.

    In this order they are matched; of two equally near the first, whichever history comes first.
    """
    times = np.array([event.t for event in candidate])
    within = SAME_IMPACT + ROUNDING
    near = []
    for i, impact in enumerate(reference):
        first, end = np.searchsorted(times, [impact.t - within, impact.t + within]).tolist()
        for j in range(first, end):
            if candidate[j].kind != impact.kind:
                continue
            either_weak = not (reference_strong[i] and candidate_strong[j])
            apart = round(abs(candidate[j].t - impact.t), 9)
            near.append((either_weak, apart, i, j))
    return near


def _unmatched(
    events: Sequence[Event], are_strong: Sequence[bool], matched: Container[int]
) -> list[Event]:
    """The strong events whose numbers are not among those matched."""
    return [
        event
        for number, (event, is_strong) in enumerate(zip(events, are_strong, strict=True))
        if is_strong and number not in matched
    ]
