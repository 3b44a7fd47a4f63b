"""The answers of an assessment in words: each says what its numbers say, and no more."""

import math
from dataclasses import replace

import pytest
from assessed import (
    CERTAIN,
    RUNS,
    SAFE,
    SCENE,
    UNCERTAIN,
    gathered,
    interval,
    judged,
    ran,
    unlike,
)

from rockcheck.validation.studies.population import results, sentences, statistics
from rockcheck.validation.studies.population.certainty import (
    Contribution,
    MethodScore,
    UncertaintyAnswer,
)
from rockcheck.validation.studies.population.statistics import (
    CaseFalls,
    IntensityAnswer,
    QuantityAnswer,
    RecordIntensity,
)
from rockcheck.validation.uncertainty.lognormal import Lognormal
from rockcheck.validation.uncertainty.numerical import Numerical, Quantity

# Does it fall?


def falls(everything):
    return sentences.fall_sentences("shelf", statistics.fall_answer(everything), everything)


def test_without_a_result_nothing_is_claimed():
    assert falls(gathered({"a": ran("failed")})) == ["shelf: no run has a result."]


def test_a_single_run_is_no_probability():
    assert falls(gathered({"a": RUNS["c"]})) == ["shelf overturns to the right."]


def test_a_tie_whose_other_fate_nobody_knows_names_no_other():
    tie = ("friction equals B/H", 0.4, ("at rest", "undecided", "failed"))
    sure = {"a": results.Certainty(ties=(tie,))}
    assert falls(gathered({"a": RUNS["a"]}, certainty=sure)) == ["shelf stays."]


def test_where_no_run_is_decided_there_is_no_share():
    (words,) = falls(gathered(dict.fromkeys("abc", ran("undecided", 0.9))))
    assert words.startswith("In all 3 runs shelf is undecided: nothing decides")


def test_one_decided_run_of_two_is_a_share():
    first, *_ = falls(gathered({"a": RUNS["c"], "b": ran("undecided", 0.9)}))
    assert first.startswith("shelf overturns in 1 of 1 record, 100 %")


def test_falls_to_both_sides_are_told_by_side():
    runs = {"a": ran("overturned left", 6.0), "b": RUNS["c"], "c": RUNS["c"], "d": RUNS["a"]}
    assert falls(gathered(runs))[1] == "To the left 1, to the right 2."


def test_of_one_fall_among_several_runs_the_side_is_told():
    runs = {"a": RUNS["a"], "b": RUNS["a"], "c": RUNS["c"]}
    assert falls(gathered(runs))[1] == "It falls to the right."


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (0.0, 0.26, "0 to 26 %"),
        (0.0054, 0.41, "0.54 % to 41 %"),
        (0.0099, 0.41, "0.99 % to 41 %"),
        (0.01, 0.41, "1 to 41 %"),
        (0.29, 1.0, "29 to 100 %"),
    ],
)
def test_a_range_whose_low_end_is_below_a_percent_has_the_unit_twice(low, high, words):
    assert sentences.percent_range(low, high) == words


def test_of_enough_records_there_is_but_the_share():
    (words,) = falls(gathered({f"R{k}": RUNS["a"] for k in range(12)}))
    assert words.startswith("shelf overturns in 0 of 12 records, 0 % (95 %: 0 to ")


def test_undecided_runs_are_counted_beside_the_share():
    runs = {f"R{k}": RUNS["a"] for k in range(12)} | {"x": ran("undecided", 0.9)}
    assert falls(gathered(runs))[1:] == ["1 run undecided."]


def test_of_draws_under_records_no_single_run_speaks_for_the_scene():
    drawn = {"a": [RUNS["a"]] * 4, "c": [RUNS["c"]] * 4}
    runs = {"a": RUNS["a"], "c": RUNS["c"]}
    words = falls(gathered(runs, given=UNCERTAIN, draws=4, drawn=drawn))
    assert "With its own numbers" not in " ".join(words)


def test_just_below_all_is_not_rounded_to_all():
    assert sentences.percent(0.995) == ">99 %"


@pytest.mark.parametrize(("metres", "words"), [(0.0999, "99.9 mm"), (0.1, "0.1 m"), (2.5, "2.5 m")])
def test_a_length_is_in_millimetres_below_a_tenth_of_a_metre(metres, words):
    assert sentences.length(metres) == words


@pytest.mark.parametrize(
    ("count", "words"),
    [
        (1, "1 of these is a copy of another: the interval takes them for independent."),
        (2, "2 of these are copies of another: the interval takes them for independent."),
    ],
)
def test_records_that_are_copies_of_another_are_counted(count, words):
    cases = dict(zip("abc", unlike(CERTAIN), strict=False))
    cases |= dict.fromkeys("bc"[:count], cases["a"])
    assert words in falls(gathered(cases=cases))


@pytest.mark.parametrize(
    ("metres", "down", "up"),
    [
        (0.03215, "32.1 mm", "32.2 mm"),
        (0.0355, "35.5 mm", "35.5 mm"),
        (0.12345, "0.123 m", "0.124 m"),
        (0.09996, "99.9 mm", "0.1 m"),
        (0.0, "0 mm", "0 mm"),
        (1.0, "1 m", "1 m"),
    ],
)
def test_a_safe_length_is_rounded_to_the_safe_side(metres, down, up):
    assert sentences.safe_length(metres, math.floor) == down
    assert sentences.safe_length(metres, math.ceil) == up


# How far does it move?


def quantity(label, unit, *values):
    return QuantityAnswer("name", label, unit, "", values, "a" if values else None)


def test_the_largest_of_each_figure_is_named_with_its_unit():
    answers = [
        quantity("peak rotation", "alpha", 0.2, 0.43),
        quantity("slip", "m", 0.01, 0.002),
        quantity("speed at the wall", "m/s"),
    ]
    assert sentences.motion_sentences(answers) == [
        "Where it stands, at most: peak rotation 0.43 α, slip 0.01 m."
    ]


def test_without_a_run_that_stands_no_figure_is_named():
    assert sentences.motion_sentences([quantity("slip", "m")]) == ["No run stands."]


# Which gap is safe?


def falling(*cases, **change):
    """It falls in these intervals, each a list a case."""
    answers = tuple(
        CaseFalls(case, 0, tuple(intervals)) for case, intervals in zip("ab", cases, strict=False)
    )
    first = min(answers, key=lambda case: case.intervals[0].low)
    safe = statistics.safe_up_to(answers, SAFE.high)
    return replace(SAFE, falls=answers, first=first, safe_up_to=safe, **change)


def test_gaps_below_the_reach_are_not_any_gap():
    assert sentences.gap_sentences([replace(SAFE, high=0.05)]) == [
        "It stands at gaps of 0 mm to 50 mm (looked at every 1 mm); without the wall it reaches"
        " 0.1 m."
    ]


def test_a_block_that_starts_inside_the_wall_has_a_least_gap():
    assert sentences.gap_sentences([replace(SAFE, low=0.02)]) == [
        "It stands at gaps of 20 mm to 0.1 m (looked at every 1 mm); without the wall it reaches"
        " 0.1 m."
    ]


def test_a_single_gap_is_the_only_one():
    words = sentences.gap_sentences([replace(SAFE, low=0.05, high=0.05)])
    assert words == [
        "It stands at gaps of 50 mm to 50 mm (the only gap looked at); without the wall it reaches"
        " 0.1 m."
    ]


def test_of_many_runs_none_falls():
    (words,) = sentences.gap_sentences([replace(SAFE, free_runs=8)])
    assert words.startswith("No run falls at any gap")


def test_of_two_runs_the_first_to_fall_is_named():
    answer = falling([interval(0, 0.03, 0.1, 0.0299, None)], free_runs=2)
    assert sentences.gap_sentences([answer]) == [
        "No run falls at gaps up to 29.9 mm (looked at every 1 mm); just above, a falls first;"
        " without the wall it reaches 0.1 m."
    ]


def test_a_single_run_that_falls_has_no_name():
    answer = falling([interval(0, 0.03, 0.1, 0.0299, None)])
    assert sentences.gap_sentences([answer]) == [
        "It stands at gaps up to 29.9 mm (looked at every 1 mm); just above, it falls; without the"
        " wall it reaches 0.1 m."
    ]


def test_undecided_runs_of_a_search_are_counted():
    *_, last = sentences.gap_sentences([replace(SAFE, undecided=2)])
    assert last == "2 runs of the search undecided."


def test_nothing_falls_beyond_the_last_island_of_all():
    answer = falling(
        [interval(0, 0.01, 0.02, 0.009, 0.021), interval(0, 0.04, 0.05, 0.039, 0.051)],
        [interval(0, 0.03, 0.035, 0.029, 0.036)],
    )
    assert sentences.safe_again_from(answer) == 0.051


def test_no_gap_is_safe_again_while_a_run_still_falls():
    answer = falling([interval(0, 0.01, 0.02, 0.009, 0.021)], [interval(0, 0.03, 0.1, 0.029, None)])
    assert sentences.safe_again_from(answer) is None


def test_without_a_coarser_look_beyond_one_step_is_enough():
    assert sentences.looked_words(SAFE) == "looked at every 1 mm"


def test_a_coarser_look_begins_where_the_finer_one_ends():
    answer = replace(SAFE, finely_up_to=0.4, beyond_every=0.04)
    assert sentences.looked_words(answer) == "looked at every 1 mm up to 0.4 m, then every 40 mm"


def test_draws_have_a_step_of_their_own():
    answer = replace(SAFE, draws_every=0.003, draws_beyond_every=0.0)
    assert sentences.looked_words(answer) == "looked at every 1 mm; for draws every 3 mm"


# At which intensity does it fall?


def record(case, least, *islands, beyond=40.0):
    return RecordIntensity(case, 0.4, least, beyond, islands)


def intensity(*records, unit="g", fit=None, undecided=0):
    answer = IntensityAnswer("pga", "PGA", unit, records, fit, undecided)
    return sentences.intensity_sentences(answer)


def test_a_base_at_rest_has_no_intensity():
    assert sentences.intensity_sentences(None) == [
        "It has no motion of the base that could be scaled by a factor."
    ]


def test_what_never_falls_was_looked_at_up_to_the_least_of_all_ends():
    words = intensity(record("a", None, beyond=30.0), record("b", None, beyond=12.5))
    assert words == ["It does not overturn up to PGA 12.5 g."]


def test_a_single_motion_falls_at_a_factor_of_its_size():
    assert intensity(record("a", 0.6)) == [
        "It overturns first at PGA 0.6 g, 1.5 times its own (looked at every 1 %)."
    ]


def test_a_measure_without_a_unit_has_none():
    assert intensity(record("a", 0.6), unit="") == [
        "It overturns first at PGA 0.6, 1.5 times its own (looked at every 1 %)."
    ]


def test_a_single_motion_may_stand_again():
    assert intensity(record("a", 0.6, (0.6, 0.7)))[1:] == [
        "It stands again at some larger intensities."
    ]


def test_of_many_motions_the_median_and_the_least_are_named():
    fit = Lognormal(0.7, 0.25, 0.5, 0.9, ())
    assert intensity(record("a", 0.8), record("b", 0.6), fit=fit) == [
        "Median PGA at which it overturns: 0.7 g, dispersion 0.25, of 2 records.",
        "The least: 0.6 g, b (looked at every 1 %).",
    ]


def test_without_a_curve_the_least_is_named():
    assert intensity(record("a", 0.8), record("b", None)) == [
        "The least: 0.8 g, a (looked at every 1 %).",
        "1 record did not overturn it at any factor tried.",
    ]


def test_motions_at_which_it_stands_again_are_counted():
    words = intensity(record("a", 0.8), record("b", 0.6, (0.6, 0.7), (0.9, 1.0)))
    assert words[-1] == "It stands again at some larger intensities of 1 record."


def test_undecided_runs_of_the_search_over_intensities_are_counted():
    assert intensity(record("a", 0.6), undecided=3)[1:] == ["3 runs of the search undecided."]


# How sure is that?


def certain(certainty, *contributions, runs=None, **more):
    answer = UncertaintyAnswer(
        "outcome", tuple(Contribution(source, 0.5, sd) for source, sd in contributions), ()
    )
    chosen = {case: RUNS[case] for case in runs or certainty}
    return sentences.certainty_sentences(gathered(chosen, certainty=certainty, **more), answer)


def of_a_fall(u_num):
    """Numerical uncertainty of a run that falls at 3 s, made up."""
    fall = Quantity(name="end_time", unit="s", value=3.0, u_num=u_num, verdict="converged")
    return Numerical(method="by hand", quantities=(fall,))


CONVERGED = results.Certainty(numerical=judged(1e-9))
COARSE = results.Certainty(numerical=judged(None))


def test_converged_runs_are_counted():
    assert certain({"a": CONVERGED, "b": COARSE}) == ["1 of 2 runs are numerically converged."]


def test_runs_that_nobody_judged_are_not_counted():
    assert certain({"a": CONVERGED, "b": results.Certainty(), "c": COARSE}) == [
        "1 of 2 runs are numerically converged."
    ]


@pytest.mark.parametrize(
    ("sure", "words"),
    [
        (CONVERGED, "Numerically converged: its peak rotation to 1e-09 α."),
        (
            results.Certainty(numerical=judged(0.25)),
            "Numerically converged, but its peak rotation to 0.25 α only, more than itself: play it"
            " finer.",
        ),
        (
            results.Certainty(numerical=of_a_fall(0.004)),
            "Numerically converged: the time of its fall to 0.004 s.",
        ),
        (
            results.Certainty(numerical=Numerical(method="by hand", quantities=())),
            "Numerically converged.",
        ),
        (COARSE, "Not converged: no figure is sure."),
        (results.Certainty(), "Its numerical error is not known."),
    ],
)
def test_of_a_single_run_it_is_said_whether_it_is_converged(sure, words):
    assert certain({"a": sure}) == [words]


def test_a_run_that_depends_on_the_law_of_impacts_is_not_converged():
    sure = CONVERGED.model_copy(update={"depends_on_law_from_s": 1.0})
    assert not sentences.is_converged(sure)


def test_a_run_that_nobody_judged_is_not_converged():
    assert not sentences.is_converged(results.Certainty())


def tied(when, *fates):
    return CONVERGED.model_copy(update={"ties": (("friction equals B/H", when, fates),)})


def test_a_tie_is_told_once_with_the_runs_that_have_it():
    words = certain({"a": CONVERGED, "b": tied(0.5, "at rest"), "c": tied(0.3, "overturned left")})
    assert words[1] == (
        "From 0.3 s on the mechanics has more than one answer in 2 of 3 runs (friction equals B/H):"
        " at rest or overturned left."
    )


def test_a_tie_with_one_fate_says_that_both_sides_have_it():
    words = certain({"a": tied(0.3, "at rest")})
    assert words[1].endswith(
        "has more than one answer (friction equals B/H): at rest on both sides."
    )


@pytest.mark.parametrize(("of_slope", "sentences_told"), [(1.0, 1), (1.001, 0), (0.999, 0)])
def test_a_search_says_that_friction_equals_the_slope(of_slope, sentences_told):
    scene = SCENE.replace(floor=SCENE.floor.replace(friction=of_slope * SCENE.block.slope))
    told = sentences.edge_sentences(scene)
    assert len(told) == sentences_told
    assert all("Friction equals B/H" in sentence for sentence in told)


def test_a_tie_of_a_single_run_names_none():
    tie = ("friction equals B/H", 0.3, ("at rest", "overturned left"))
    words = certain({"a": CONVERGED.model_copy(update={"ties": (tie,)})})
    assert words[1].startswith("From 0.3 s on the mechanics has more than one answer")


LAWFUL = CONVERGED.model_copy(update={"depends_on_law_from_s": 1.25})


def test_a_single_run_says_from_when_on_the_law_of_impacts_matters():
    assert certain({"a": LAWFUL})[1:] == ["From 1.25 s on the law of impacts matters."]


def test_of_many_runs_those_are_counted_in_which_the_law_of_impacts_matters():
    words = certain({"a": LAWFUL, "b": CONVERGED})
    assert words[1:] == ["The law of impacts matters in 1 of 2 runs."]


def test_the_largest_source_is_what_would_change_the_answer():
    words = certain({"a": CONVERGED}, ("records", 0.3), ("numerical error", 0.1))
    assert words[1:] == ["Other records would change the answer most."]


def test_while_the_numerical_error_is_not_known_no_source_is_the_largest():
    assert certain({"a": results.Certainty()}, ("records", 0.3))[1:] == []


@pytest.mark.parametrize(("sd", "count"), [(0.9e-6, 0), (2e-6, 1)])
def test_what_changes_nothing_is_not_named(sd, count):
    words = certain({"a": CONVERGED}, ("numerical error", sd))
    assert len(words[1:]) == count


def test_of_uncertain_numbers_the_leading_one_is_named():
    words = certain(
        {"a": CONVERGED},
        ("inputs", 0.3),
        ("numerical error", 0.1),
        given=UNCERTAIN,
        recorded=False,
        draws=4,
        drawn={"a": [ran("at rest", peak) for peak in (0.1, 0.2, 0.3, 0.4)]},
    )
    assert words[1:] == ["Knowing floor.friction better would change the answer most."]


# What do hand methods say?


def score(method, predicts, of):
    return MethodScore(method, predicts, of, 0, 0, None, None, None, "alpha")


def test_only_methods_for_overturning_are_named():
    scores = [score("uplift", 3, 3), score("step of velocity", 2, 3)]
    assert sentences.method_sentences(scores, ["uplifts", "overturns"]) == [
        "They leave walls out, and let it overturn in: step of velocity 2 of 3."
    ]


def test_methods_without_a_decided_run_say_nothing():
    assert sentences.method_sentences([score("step of velocity", 0, 0)], ["overturns"]) == [
        "They say nothing of it."
    ]


def test_of_one_run_each_method_says_how_it_ends():
    scores = [score("step of velocity", 1, 1), score("reserve rocking", 0, 1)]
    assert sentences.method_sentences(scores, ["overturns"] * 2) == [
        "step of velocity: overturns; reserve rocking: stays."
    ]
