"""The answers of an assessment in words, for an engineer's report.

In: typed answers (`statistics`). Out: sentences. A sentence claims no more than was looked at.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

from rockcheck.ebm.ties import FRICTION, edges_of
from rockcheck.scenes import Scene
from rockcheck.validation.studies.population import results
from rockcheck.validation.studies.population.certainty import (
    MethodScore,
    UncertaintyAnswer,
    leading_number,
)
from rockcheck.validation.studies.population.gathered import Gathered
from rockcheck.validation.studies.population.plan import FACTOR_STEP
from rockcheck.validation.studies.population.results import UNDECIDED
from rockcheck.validation.studies.population.statistics import (
    FallAnswer,
    GapAnswer,
    IntensityAnswer,
    QuantityAnswer,
    RecordIntensity,
)
from rockcheck.validation.uncertainty.numerical import Numerical

#: Units as readers know them, where these are other words.
UNITS = {"alpha": "α"}
#: Fates of a single run.
FATE_WORDS = {
    "at rest": "stays",
    "moving": "does not fall, and moves on",
    "overturned left": "overturns to the left",
    "overturned right": "overturns to the right",
    UNDECIDED: "is undecided: nothing decides within the time allowed whether it falls",
    "failed": "has no result: its run failed",
}
#: What would change the answer, by source of uncertainty.
CHANGES = {
    "records": "Other records",
    "inputs": "Knowing {number} better",
    "numerical error": "A smaller step or tolerance",
    "model form": "Another model",
    "law of impacts": "Another law of impacts",
}
#: How finely a search over a factor on the motion looks.
FACTORS_LOOKED_AT = f"looked at every {100.0 * FACTOR_STEP:g} %"
#: What is told of a converged run, by the name of the quantity.
SURELY_KNOWN = {"peak_rotation": "its peak rotation", "end_time": "the time of its fall"}
#: A contribution below this changes nothing.
NEGLIGIBLE = 1e-6


def length(metres: float) -> str:
    """A length: in mm below 0.1 m."""
    return f"{1e3 * metres:.3g} mm" if metres < 0.1 else f"{metres:.3g} m"


def safe_length(metres: float, rounded: Callable[[float], int]) -> str:
    """A length to three digits, rounded by `math.floor` or `math.ceil` to the safe side."""
    if metres <= 0.0:
        return length(metres)
    digit = 10.0 ** (math.floor(math.log10(metres)) - 2)
    nearest = round(metres / digit, 6)  # of what is a digit but for rounding none is lost
    return length(digit * rounded(nearest))


def percent(share: float) -> str:
    """A share in percent: two digits, and no more than it is worth."""
    if share == 1.0:
        return "100 %"
    return f"{100.0 * share:.2g} %" if share < 0.995 else ">99 %"


def percent_range(low: float, high: float) -> str:
    """Two shares in percent; below 1 % the unit stands at both, lest 0.54 be read as a share."""
    first = percent(low) if 0.0 < low < 0.01 else percent(low).removesuffix(" %")
    return f"{first} to {percent(high)}"


def count_of(number: int, noun: str) -> str:
    """A number with its noun: 1 record, 2 records."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def fall_sentences(name: str, answer: FallAnswer, gathered: Gathered) -> list[str]:
    """Whether it falls: in how many runs, with the interval of the probability."""
    if answer.runs == 0:
        return [f"{name}: no run has a result."]
    if answer.runs == 1:
        case, run = gathered.all_runs[0]
        others = _fates_of_ties(gathered, case, run.fate)
        if others:
            return [
                f"{name} {FATE_WORDS[run.fate]}, or {' or '.join(others)}: it stands on a knife"
                " edge, where the mechanics has more than one answer."
            ]
        return [f"{name} {FATE_WORDS[run.fate]}."]
    share = answer.overturning
    if share.of == 0:
        return [f"In all {answer.runs} runs {name} {FATE_WORDS[UNDECIDED]}."]
    of = runs_words(answer, gathered)
    sentences = [
        f"{name} overturns in {share.count} of {of}, {percent(share.probability)}"
        f" (95 %: {percent_range(share.low, share.high)}).",
        *_direction_sentences(answer),
    ]
    if answer.few:
        sentences.append(
            f"{count_of(answer.records, 'record')} are too few for a probability: seven or more"
            " are asked for."
        )
    copies = gathered.plan.copies
    if copies:
        sentences.append(
            f"{copies} of these {'is a copy' if copies == 1 else 'are copies'}"
            " of another: the interval takes them for independent."
        )
    if answer.fates[UNDECIDED]:
        sentences.append(f"{count_of(answer.fates[UNDECIDED], 'run')} undecided.")
    if gathered.drawn and not gathered.plan.recorded:
        as_it_is = next(iter(gathered.as_it_is.values()))
        sentences.append(f"With its own numbers it {FATE_WORDS[as_it_is.fate]}.")
    return sentences


def _direction_sentences(answer: FallAnswer) -> list[str]:
    """To which side it falls."""
    left, right = answer.fates["overturned left"], answer.fates["overturned right"]
    if left and right:
        return [f"To the left {left}, to the right {right}."]
    side = "left" if left else "right"
    if left + right > 1:
        return [f"All fall to the {side}."]
    return [f"It falls to the {side}."] if left + right == 1 else []


def _fates_of_ties(gathered: Gathered, case: str, fate: str) -> list[str]:
    """The other fates of a run on both sides of its ties, in words."""
    sure = gathered.certainty.get(case, results.Certainty())
    fates = dict.fromkeys(other for *_, others in sure.ties for other in others)
    return [FATE_WORDS[other] for other in fates if other not in (fate, UNDECIDED, "failed")]


def runs_words(answer: FallAnswer, gathered: Gathered) -> str:
    """Which runs these are: 12 records, 256 draws, 768 runs."""
    decided = answer.overturning.of
    if not gathered.plan.recorded:
        return count_of(decided, "draw")
    if not gathered.drawn:
        return count_of(decided, "record")
    draws = gathered.plan.draws
    return f"{count_of(decided, 'run')}, {draws} draws under each of {answer.records} records"


def motion_sentences(answers: Sequence[QuantityAnswer]) -> list[str]:
    """How far it moves where it stands."""
    words = [
        f"{answer.label} {max(answer.values):.3g} {UNITS.get(answer.unit, answer.unit)}"
        for answer in answers
        if answer.values
    ]
    return [f"Where it stands, at most: {', '.join(words)}."] if words else ["No run stands."]


def gap_sentences(answers: Sequence[GapAnswer]) -> list[str]:
    """Which gaps are safe, a sentence or two a side."""
    several = len(answers) > 1
    return [
        sentence
        for answer in answers
        for sentence in _gap_sentences(answer, f"On the {answer.side}: " if several else "")
    ]


def _gap_sentences(answer: GapAnswer, where: str) -> list[str]:
    looked, reach = looked_words(answer), reach_words(answer)
    single = answer.free_runs == 1
    none_falls, first_falls = ("It stands", "it falls") if single else ("No run falls", "")
    sentences = []
    if answer.first is None and answer.low == 0.0 and answer.high >= answer.clearance:
        sentences.append(f"{where}{none_falls} at any gap ({looked}): {reach} at most.")
    elif answer.first is None:
        span = f"{length(answer.low)} to {length(answer.high)}"
        sentences.append(f"{where}{none_falls} at gaps of {span} ({looked}); {reach}.")
    elif answer.safe_up_to is None:
        falls = first_falls.capitalize() or f"{answer.first.case} falls"
        none = "" if answer.has_safe_gap else "No gap is safe. "
        sentences.append(
            f"{where}{none}{falls} already at a gap of {length(answer.low)} ({looked})"
            f"{again_words(answer)}; {reach}."
        )
    else:
        falls = first_falls or f"{answer.first.case} falls first"
        safe_up_to = safe_length(answer.safe_up_to, math.floor)
        sentences.append(
            f"{where}{none_falls} at gaps up to {safe_up_to} ({looked}); just above,"
            f" {falls}{again_words(answer)}; {reach}."
        )
    if answer.islands and answer.has_safe_gap:
        sentences.append("It stands again in some wider gaps: see 'At which gaps it falls'.")
    if answer.undecided:
        sentences.append(_undecided_sentence(answer.undecided))
    return sentences


def _undecided_sentence(runs: int) -> str:
    """What counts as a fall in a search, and may be none."""
    return f"{count_of(runs, 'run')} of the search undecided."


def reach_words(answer: GapAnswer) -> str:
    """How far the block reaches without the wall, and whether it then falls."""
    words = f"without the wall it reaches {length(answer.clearance)}"
    if answer.free_overturned and answer.free_runs == 1:
        return f"{words} and falls"
    if answer.free_overturned:
        return f"{words}, and {answer.free_overturned} of {answer.free_runs} runs fall"
    return words


def again_words(answer: GapAnswer) -> str:
    """From where on nothing falls, if it is so."""
    again = safe_again_from(answer)
    return "" if again is None else f"; none falls from {safe_length(again, math.ceil)} on"


def looked_words(answer: GapAnswer) -> str:
    """How finely was looked."""
    if answer.low == answer.high:
        return "the only gap looked at"
    words = f"looked at every {_millimetres(answer.looked_every)}"
    if answer.beyond_every > 0.0:
        words += f" up to {length(answer.finely_up_to)}, then every"
        words += f" {_millimetres(answer.beyond_every)}"
    if answer.draws_every is None:
        return words
    words += f"; for draws every {_millimetres(answer.draws_every)}"
    if answer.draws_beyond_every:
        words += f", then every {_millimetres(answer.draws_beyond_every)}"
    return words


def _millimetres(metres: float) -> str:
    return f"{1e3 * metres:.3g} mm"


def safe_again_from(answer: GapAnswer) -> float | None:
    """The gap from which no run was seen to fall, up to the largest one; None if there is none."""
    ends = [case.intervals[-1].stands_above for case in answer.falls]
    above = [end for end in ends if end is not None]
    return max(above) if above and len(above) == len(ends) else None


def intensity_sentences(answer: IntensityAnswer | None) -> list[str]:
    """At which intensity it falls."""
    if answer is None:
        return ["It has no motion of the base that could be scaled by a factor."]
    unit = f" {answer.unit}" if answer.unit else ""
    if all(record.least is None for record in answer.records):
        beyond = min(record.beyond for record in answer.records)
        return [f"It does not overturn up to {answer.label} {beyond:.3g}{unit}."]
    if len(answer.records) == 1:
        sentences = [_single_intensity(answer.records[0], answer.label, unit)]
    else:
        sentences = _several_intensities(answer, unit)
    islands = sum(bool(record.islands) for record in answer.records)
    if islands:
        sentences.append(
            "It stands again at some larger intensities"
            + (f" of {count_of(islands, 'record')}." if len(answer.records) > 1 else ".")
        )
    if answer.undecided:
        sentences.append(_undecided_sentence(answer.undecided))
    return sentences


def _several_intensities(answer: IntensityAnswer, unit: str) -> list[str]:
    """The median of the records, the least, and how many do not overturn it."""
    sentences = []
    if answer.fit is not None:
        sentences.append(
            f"Median {answer.label} at which it overturns: {answer.fit.median:.3g}{unit},"
            f" dispersion {answer.fit.dispersion:.2f},"
            f" of {count_of(len(answer.records), 'record')}."
        )
    least = {record.case: record.least for record in answer.records if record.least is not None}
    weakest = min(least, key=lambda case: least[case])
    sentences.append(f"The least: {least[weakest]:.3g}{unit}, {weakest} ({FACTORS_LOOKED_AT}).")
    harmless = len(answer.records) - len(least)
    if harmless:
        sentences.append(f"{count_of(harmless, 'record')} did not overturn it at any factor tried.")
    return sentences


def _single_intensity(record: RecordIntensity, label: str, unit: str) -> str:
    assert record.least is not None, "it falls"
    factor = record.least / record.as_it_is
    return (
        f"It overturns first at {label} {record.least:.3g}{unit}, {factor:.3g} times its own"
        f" ({FACTORS_LOOKED_AT})."
    )


def certainty_sentences(gathered: Gathered, answer: UncertaintyAnswer) -> list[str]:
    """How sure that is: of the step, of ties, and what would change the answer."""
    cases = gathered.certainty
    sentences = [_convergence_sentence(cases), *_tie_sentences(cases), *_law_sentences(cases)]
    largest = next(iter(answer.contributions), None)
    known = {contribution.source for contribution in answer.contributions}
    if largest and largest.sd > NEGLIGIBLE and "numerical error" in known:
        change = CHANGES[largest.source].format(number=leading_number(gathered))
        sentences.append(f"{change} would change the answer most.")
    return sentences


def _convergence_sentence(cases: Mapping[str, results.Certainty]) -> str:
    judged = [(sure, sure.numerical) for sure in cases.values() if sure.numerical is not None]
    if not judged:
        return "Its numerical error is not known."
    converged = [is_converged(sure) for sure, _ in judged]
    if len(cases) > 1:
        return f"{sum(converged)} of {len(converged)} runs are numerically converged."
    if not converged[0]:
        return "Not converged: no figure is sure."
    return f"Numerically converged{_accuracy_words(judged[0][1])}."


def _accuracy_words(numerical: Numerical) -> str:
    """How well the peak rotation of a converged run is known, or the time of its fall."""
    for quantity in numerical.quantities:
        if quantity.u_num is None or quantity.name not in SURELY_KNOWN:
            continue
        unit = UNITS.get(quantity.unit, quantity.unit)
        words = f"{SURELY_KNOWN[quantity.name]} to {quantity.u_num:.2g} {unit}"
        if isinstance(quantity.value, float) and quantity.u_num > abs(quantity.value) > NEGLIGIBLE:
            return f", but {words} only, more than itself: play it finer"
        return f": {words}"
    return ""


def _tie_sentences(cases: Mapping[str, results.Certainty]) -> Iterator[str]:
    """What is equal, in how many runs and from when on, and the fates on both sides."""
    alike: dict[str, list[tuple[float, tuple[str, ...]]]] = {}
    for sure in cases.values():
        for what, when, fates in sure.ties:
            alike.setdefault(what, []).append((when, fates))
    for what, ties in alike.items():
        where = f" in {len(ties)} of {len(cases)} runs" if len(cases) > 1 else ""
        known = list(dict.fromkeys(fate for _, both in ties for fate in both))
        also = " on both sides" if len(known) == 1 else ""
        yield (
            f"From {min(when for when, _ in ties):.3g} s on the mechanics has more than one"
            f" answer{where} ({what}): {' or '.join(known)}{also}."
        )


def edge_sentences(scene: Scene) -> list[str]:
    """That a search took one of two answers, where the block may slide or rock at each factor."""
    if all(edge.what != FRICTION for edge in edges_of(scene)):
        return []
    return [
        "Friction equals B/H, where a block slides or rocks: this took one of two answers. Assess"
        " it with a friction a thousandth larger, too."
    ]


def _law_sentences(cases: Mapping[str, results.Certainty]) -> Iterator[str]:
    by_law = [sure.depends_on_law_from_s for sure in cases.values()]
    matters = [when for when in by_law if when is not None]
    if matters and len(cases) > 1:
        yield f"The law of impacts matters in {len(matters)} of {len(cases)} runs."
    elif matters:
        yield f"From {matters[0]:.3g} s on the law of impacts matters."


def is_converged(sure: results.Certainty) -> bool:
    """Whether a run is numerically converged, and its mechanics has one answer."""
    if sure.numerical is None or sure.ties or sure.depends_on_law_from_s is not None:
        return False
    return sure.numerical.converged


def method_sentences(scores: Sequence[MethodScore], events: Sequence[str]) -> list[str]:
    """Which hand methods let it overturn."""
    overturning = [
        score
        for score, event in zip(scores, events, strict=True)
        if event == "overturns" and score.of
    ]
    if not overturning:
        return ["They say nothing of it."]
    if overturning[0].of == 1:
        words = [
            f"{score.method}: {'overturns' if score.predicts else 'stays'}" for score in overturning
        ]
        return [f"{'; '.join(words)}."]
    words = [f"{score.method} {score.predicts} of {score.of}" for score in overturning]
    return [f"They leave walls out, and let it overturn in: {', '.join(words)}."]
