"""The answers of an assessment, of results whose figures can be worked out by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from assessed import (
    CERTAIN,
    FREE,
    RUNS,
    SCENE,
    UNCERTAIN,
    gap_answer,
    gathered,
    interval,
    judged,
    ran,
    row,
    search,
)

from rockcheck.scenes import files
from rockcheck.validation.criteria import CRITERIA
from rockcheck.validation.studies.population import (
    certainty as certainty_answers,
    results,
    sentences,
    statistics,
)
from rockcheck.validation.studies.population.gathered import Gathered
from rockcheck.validation.studies.population.intensity_measures import measure_of, size_of
from rockcheck.validation.studies.population.plan import factors_of, gaps_looked_at
from rockcheck.validation.studies.population.study import finding_of

# Does it fall?


def test_one_of_three_records_falls_with_the_exact_interval_of_few():
    answer = statistics.fall_answer(gathered())
    assert answer.overturning.count == 1
    assert answer.overturning.of == 3
    # the ends of Clopper and Pearson's interval of 1 of 3
    assert answer.overturning.low == pytest.approx(0.0084, abs=1e-4)
    assert answer.overturning.high == pytest.approx(0.9057, abs=1e-4)


def test_three_records_are_called_few():
    everything = gathered()
    answer = statistics.fall_answer(everything)
    assert answer.few
    words = " ".join(sentences.fall_sentences("shelf", answer, everything))
    assert words.startswith("shelf overturns in 1 of 3 records, 33 % (95 %: 0.84 % to 91 %).")
    assert "3 records are too few" in words


def test_an_interval_may_reach_up_to_all_runs():
    everything = gathered(dict.fromkeys("abc", RUNS["c"]))
    words, *_ = sentences.fall_sentences("shelf", statistics.fall_answer(everything), everything)
    assert words == "shelf overturns in 3 of 3 records, 100 % (95 %: 29 to 100 %)."


def test_a_block_that_moves_on_may_come_to_rest_later():
    # without friction it slides until a wall stops it: the outcome is certain before
    everything = gathered({"a": RUNS["b"]})
    words = sentences.fall_sentences("shelf", statistics.fall_answer(everything), everything)
    assert words == ["shelf does not fall, and moves on."]


def test_the_first_sentence_has_both_answers_of_a_tie():
    tie = ("friction equals B/H", 0.4, ("at rest", "overturned right"))
    sure = {"a": results.Certainty(ties=(tie,))}
    everything = gathered({"a": RUNS["a"]}, certainty=sure)
    (words,) = sentences.fall_sentences("shelf", statistics.fall_answer(everything), everything)
    assert words.startswith("shelf stays, or overturns to the right: it stands on a knife edge")


@pytest.mark.parametrize(
    ("share", "words"),
    [(0.0, "0 %"), (0.104, "10 %"), (0.9949, "99 %"), (0.999, ">99 %"), (1, "100 %")],
)
def test_a_share_in_percent(share, words):
    assert sentences.percent(share) == words


def test_what_is_undecided_is_not_among_those_that_stay():
    answer = statistics.fall_answer(gathered({**RUNS, "d": ran("undecided", 0.9)}))
    assert answer.runs == 4
    assert answer.fates["undecided"] == 1
    assert answer.overturning.of == 3


def test_draws_of_one_motion_are_counted_in_the_first_sentence():
    drawn = [ran("overturned left", 6.0)] * 2 + [ran("at rest", 0.2)] * 6
    everything = gathered(
        {"a": RUNS["a"]}, given=UNCERTAIN, recorded=False, draws=8, drawn={"a": drawn}
    )
    answer = statistics.fall_answer(everything)
    first, *more = sentences.fall_sentences("shelf", answer, everything)
    assert first == "shelf overturns in 2 of 8 draws, 25 % (95 %: 7.1 to 59 %)."
    assert more == ["All fall to the left.", "With its own numbers it stays."]


def test_draws_under_records_count_in_place_of_the_runs_as_they_are():
    drawn = {"a": [ran("at rest", 0.2)] * 4, "c": [ran("overturned left", 6.0)] * 4}
    everything = gathered({"a": RUNS["a"], "c": RUNS["c"]}, given=UNCERTAIN, draws=4, drawn=drawn)
    answer = statistics.fall_answer(everything)
    assert answer.runs == 8
    assert answer.overturning.count == 4
    words = sentences.fall_sentences("shelf", answer, everything)[0]
    assert "in 4 of 8 runs, 4 draws under each of 2 records, 50 %" in words


@pytest.mark.parametrize("records", [2, 6])
def test_records_are_few_up_to_six(records):
    everything = gathered({f"R{k}": RUNS["a"] for k in range(records)})
    assert statistics.fall_answer(everything).few


def test_seven_records_are_not():
    everything = gathered({f"R{k}": RUNS["a"] for k in range(7)})
    assert not statistics.fall_answer(everything).few


def test_a_single_motion_is_not_called_few():
    assert not statistics.fall_answer(gathered({"a": RUNS["a"]})).few


# How far does it move?


def test_quantities_are_of_the_runs_that_stand():
    answers = {one.name: one for one in statistics.quantity_answers(gathered())}
    peak = answers["peak_rotation"]
    assert peak.values == (0.2, 0.4)
    assert peak.largest_case == "b"
    assert peak.spread["median"] == pytest.approx(0.3)
    assert peak.spread["p16"] == pytest.approx(0.232)
    assert answers["wall_speed"].values == (0.4,)


# Which gap is safe?


def test_no_run_falls_up_to_where_the_first_one_was_seen_to_stand():
    island = interval(0, 0.0525, 0.06, 0.0524, 0.0601)
    answer = gap_answer(a=search(), b=search(island, fallen=(0, 0, 0)))
    assert answer.safe_up_to == 0.0524
    assert answer.first.case == "b"
    words = sentences.gap_sentences([answer])
    assert words[0].startswith(
        "No run falls at gaps up to 52.4 mm (looked at every 1 mm); just above, b falls first;"
        " none falls from 60.1 mm on; without the wall it reaches 0.1 m"
    )
    assert "stands again in some wider gaps" in words[1]


def test_the_curve_of_what_overturns_steps_where_the_search_saw_it():
    low = interval(0, 0.0, 0.02, None, 0.021)
    high = interval(0, 0.05, 0.1, 0.049, None)
    answer = gap_answer(a=search(low, high), b=search(low))
    gaps, shares = statistics.overturned_steps(answer)
    assert gaps == [0.0, 0.0, 0.0, 0.021, 0.021, 0.05, 0.1]
    assert shares == [0.0, 0.5, 1.0, 0.5, 0.0, 0.5, 0.5]


def test_the_curve_ends_with_the_share_at_the_largest_gap():
    island = interval(0, 0.05, 0.06, 0.049, 0.061)
    gaps, shares = statistics.overturned_steps(gap_answer(a=search(), b=search(island)))
    assert gaps == [0.0, 0.05, 0.061, 0.1]
    assert shares == [0.0, 0.5, 0.0, 0.0]


def test_the_curve_of_draws_leaves_the_scene_as_it_is_out():
    as_it_is, of_draw = interval(0, 0.0, 0.1, None, None), interval(3, 0.05, 0.1, 0.049, None)
    answer = replace(gap_answer(a=search(as_it_is, of_draw)), draws_every=0.01, free_runs=4)
    gaps, shares = statistics.overturned_steps(answer)
    assert gaps == [0.0, 0.05, 0.1]
    assert shares == [0.0, 0.25, 0.25]


def test_of_two_sides_each_sentence_says_which():
    answer = gap_answer(a=search())
    (only,) = sentences.gap_sentences([answer])
    first, second = sentences.gap_sentences([answer, replace(answer, side="right")])
    assert only.startswith("It stands")
    assert first.startswith("On the left: It stands")
    assert second.startswith("On the right: It stands")


def test_a_run_that_falls_without_the_wall_is_told_with_its_reach():
    answer = gap_answer(a=search())
    assert sentences.reach_words(answer) == "without the wall it reaches 0.1 m"
    falls = replace(answer, free_overturned=1)
    assert sentences.reach_words(falls) == "without the wall it reaches 0.1 m and falls"
    of_many = replace(answer, free_overturned=1, free_runs=4)
    assert sentences.reach_words(of_many).endswith("0.1 m, and 1 of 4 runs fall")


def test_one_that_falls_at_no_gap_leaves_nothing_safe():
    answer = gap_answer(a=search(interval(0, 0.0, 0.02, None, 0.0201)))
    assert answer.safe_up_to is None
    assert sentences.gap_sentences([answer])[0].startswith("It falls already at a gap of 0 mm")


def test_no_gap_is_safe_where_one_falls_at_the_least_and_at_the_largest():
    answer = gap_answer(a=search(interval(0, 0.0, 0.1, None, None)))
    assert sentences.gap_sentences([answer])[0].startswith(
        "No gap is safe. It falls already at a gap of 0 mm"
    )


def test_where_no_gap_is_safe_no_wider_gap_is_offered():
    island = interval(0, 0.05, 0.06, 0.0499, 0.0601)
    answer = gap_answer(a=search(interval(0, 0.0, 0.1, None, None)), b=search(island))
    words = " ".join(sentences.gap_sentences([answer]))
    assert words.startswith("No gap is safe. a falls already")
    assert "stands again" not in words


def test_a_gap_between_two_intervals_may_be_safe():
    answer = gap_answer(
        a=search(interval(0, 0.0, 0.02, None, 0.021), interval(0, 0.05, 0.1, 0.049, None))
    )
    assert answer.has_safe_gap
    assert "No gap is safe" not in sentences.gap_sentences([answer])[0]


def test_what_falls_nowhere_is_told_with_how_finely_was_looked():
    answer = gap_answer(a=search())
    assert answer.safe_up_to == 0.1
    assert sentences.gap_sentences([answer])[0].startswith(
        "It stands at any gap (looked at every 1 mm): without the wall it reaches 0.1 m"
    )


def test_most_gaps_of_draws_are_where_blocks_stand():
    _, of_draws = gaps_looked_at(2.0, ())
    assert len(of_draws) == 33
    assert sum(gap <= 0.4 for gap in of_draws) == 25
    assert of_draws[-1] == 2.0


def test_draws_are_looked_at_where_it_is_asked_for():
    as_it_is, of_draws = gaps_looked_at(2.0, (0.1, 0.02, 0.05))
    assert of_draws == (0.02, 0.05, 0.1)
    assert len(as_it_is) == 81
    assert set(of_draws) <= set(as_it_is)


def test_how_finely_was_looked_is_told_on_both_sides_of_where_it_changes():
    answer = replace(
        gap_answer(a=search()),
        high=2.0,
        finely_up_to=0.4,
        beyond_every=0.04,
        draws_every=0.0167,
        draws_beyond_every=0.2,
    )
    assert sentences.looked_words(answer) == (
        "looked at every 1 mm up to 0.4 m, then every 40 mm; for draws every 16.7 mm, then every"
        " 200 mm"
    )


def test_a_wall_beyond_a_fall_that_goes_on_is_never_called_safe_again():
    answer = gap_answer(a=search(interval(0, 0.03, 0.1, 0.0299, None)))
    assert sentences.safe_again_from(answer) is None


def test_runs_of_all_records_are_counted_at_each_gap():
    answer = gap_answer(a=search(), b=search(fallen=(0, 1, 1)))
    assert [one.overturned for one in answer.rows] == [0, 1, 1]
    assert [one.runs for one in answer.rows] == [2, 2, 2]
    assert [one.struck for one in answer.rows] == [2, 2, 2]
    assert answer.rows[0].largest_speed == 0.5


def test_a_search_that_did_not_end_gives_no_answer():
    assert statistics.gap_answers(gathered(free={"a": FREE["a"]})) == []


def test_the_steps_of_a_look_are_told_apart_where_it_changes():
    far = {"a": ran("at rest", 0.3, reach=2.0)}
    everything = gathered({"a": RUNS["a"]}, free=far, gaps={"a": search()}, bounds=())
    (answer,) = statistics.gap_answers(everything)
    assert answer.looked_every == pytest.approx(1e-3)
    assert answer.finely_up_to == 0.4
    assert answer.beyond_every == pytest.approx(0.04)


def far_answer(draws=0):
    """The answer for a block that reaches 2 m, of the scene as it is and so many draws."""
    everything = gathered(
        {"a": RUNS["a"]},
        given=UNCERTAIN if draws else CERTAIN,
        draws=draws,
        drawn={"a": [RUNS["a"]] * draws} if draws else {},
        free={"a": ran("at rest", 0.3, reach=2.0)},
        gaps={"a": search()},
        bounds=(),
    )
    (answer,) = statistics.gap_answers(everything)
    return answer


def test_without_draws_there_are_no_steps_of_draws():
    answer = far_answer()
    assert answer.draws_every is None
    assert answer.draws_beyond_every is None


def test_draws_are_looked_at_at_24_gaps_up_to_400_mm_and_at_8_beyond():
    answer = far_answer(draws=4)
    assert answer.draws_every == pytest.approx(0.4 / 24)
    assert answer.draws_beyond_every == pytest.approx(1.6 / 8)


def test_a_search_of_all_cases_is_complete():
    assert gap_answer(a=search(), b=search()).complete


def test_a_search_that_lacks_a_case_is_not_complete():
    everything = gathered({case: RUNS[case] for case in "ab"}, free=FREE, gaps={"a": search()})
    (answer,) = statistics.gap_answers(everything)
    assert not answer.complete


def test_runs_without_the_wall_that_fall_are_counted():
    free = {"a": FREE["a"], "b": ran("overturned left", 6.0, reach=1.0)}
    everything = gathered(
        {case: RUNS[case] for case in "ab"}, free=free, gaps={"a": search(), "b": search()}
    )
    (answer,) = statistics.gap_answers(everything)
    assert answer.free_overturned == 1
    assert answer.free_runs == 2
    assert answer.clearance == 1.0


def test_the_draws_of_a_run_without_the_wall_count_in_its_place():
    drawn = results.Drawn(results=(RUNS["c"], RUNS["a"], RUNS["b"]))
    assert drawn.counted == (RUNS["a"], RUNS["b"])


def test_at_a_gap_where_no_wall_is_struck_there_is_no_speed():
    rows = statistics.gap_rows(
        {"a": results.GapSearch(intervals=(), rows=(row(0.1, 1),), undecided=0, runs=1)}
    )
    assert rows[0].struck == 0
    assert rows[0].median_speed is None
    assert rows[0].largest_speed is None


# At which intensity does it fall?

PGA = measure_of("pga")
SIZE = size_of(PGA, CERTAIN)


def intensities_of(undecided=0, **searches):
    """The answer for searches over the factor by case, each a list of intervals."""
    found = {
        case: results.FactorSearch(intervals=tuple(intervals), undecided=undecided, runs=9)
        for case, intervals in searches.items()
    }
    runs = dict.fromkeys(searches, RUNS["a"])
    return statistics.intensity_answer(gathered(runs, measure=PGA, factors=found))


def test_the_least_intensity_is_the_least_factor_times_that_of_the_motion():
    answer = intensities_of(a=[interval(0, 1.5, 40.0, 1.49, None)])
    assert answer.records[0].as_it_is == SIZE
    assert answer.records[0].least == pytest.approx(1.5 * SIZE)


def test_an_island_of_intensities_is_between_two_factors():
    answer = intensities_of(
        a=[interval(0, 1.5, 1.6, 1.49, 1.61), interval(0, 2.0, 40.0, 1.99, None)]
    )
    assert answer.records[0].least == pytest.approx(1.5 * SIZE)
    assert answer.records[0].islands == ((1.5 * SIZE, 1.6 * SIZE),)
    assert answer.records[0].for_good == 2.0 * SIZE


def test_a_motion_under_which_it_stands_at_last_has_no_fall_for_good():
    answer = intensities_of(a=[interval(0, 1.5, 1.6, 1.49, 1.61)])
    assert answer.records[0].for_good is None


def test_a_motion_that_overturns_at_no_factor_was_scaled_up_to_the_last():
    answer = intensities_of(a=[])
    assert answer.records[0].least is None
    assert answer.records[0].beyond == pytest.approx(SIZE * factors_of(SCENE)[-1])


def test_runs_of_the_search_that_nothing_decided_are_counted():
    assert intensities_of(2, a=[], b=[]).undecided == 4


def test_without_a_scaled_motion_there_is_no_intensity():
    assert statistics.intensity_answer(gathered(measure=PGA)) is None


def test_the_curve_is_of_the_least_intensities_of_all_motions():
    answer = intensities_of(
        a=[interval(0, 1.0, 40.0, 0.99, None)], b=[interval(0, 4.0, 40.0, 3.99, None)]
    )
    assert answer.fit.median == pytest.approx(2.0 * SIZE)


# How sure is that?


def contributions(everything):
    answer = certainty_answers.uncertainty_answer(everything)
    return answer, {part.source: part.sd for part in answer.contributions}


def test_where_some_fall_the_outcome_is_what_is_uncertain():
    """Of 0, 0, 1 the standard deviation; a converged run errs by nothing in its outcome, one that
    is not by as much as a coin."""
    certainty = {
        "a": results.Certainty(numerical=judged(0.0196)),
        "b": results.Certainty(numerical=judged(None)),
        "c": results.Certainty(numerical=judged(0.3)),
    }
    answer, sd = contributions(gathered(certainty=certainty))
    assert answer.of == "outcome"
    assert sd["records"] == pytest.approx(math.sqrt(1.0 / 3.0))
    assert sd["numerical error"] == pytest.approx(math.sqrt(0.25 / 3.0))


def test_where_all_stand_the_peak_is():
    standing = {"a": RUNS["a"], "b": RUNS["b"]}
    certainty = {"a": results.Certainty(numerical=judged(0.0196))}
    cm = {"a": ran("at rest", 0.25), "b": ran("at rest", 0.3)}
    answer, sd = contributions(
        gathered(standing, certainty=certainty, cm=cm, law={"b": ran("at rest", 0.6)})
    )
    assert answer.of == "peak rotation"
    assert sd["records"] == pytest.approx(0.2 / math.sqrt(2.0))
    assert sd["numerical error"] == pytest.approx(0.01, rel=1e-3)
    assert sd["model form"] == pytest.approx(math.sqrt((0.05**2 + 0.1**2) / 2.0))
    assert sd["law of impacts"] == pytest.approx(0.1)
    assert answer.unknown == ("inputs",)


def test_another_model_that_falls_makes_the_outcome_uncertain():
    answer, sd = contributions(gathered({"a": RUNS["a"]}, cm={"a": ran("overturned left", 6.0)}))
    assert answer.of == "outcome"
    assert sd["model form"] == 1.0


def test_another_model_that_nothing_decided_leaves_the_outcome():
    answer, _ = contributions(gathered({"c": RUNS["c"]}, cm={"c": ran("undecided", 0.9)}))
    assert answer.of == "peak rotation"


def test_a_run_of_another_model_that_failed_says_nothing_of_the_model():
    _, sd = contributions(gathered({"a": RUNS["a"]}, cm={"a": ran("failed")}))
    assert "model form" not in sd


def test_where_all_fall_a_converged_fall_has_no_error():
    certainty = {"c": results.Certainty(numerical=judged(0.3))}
    answer, sd = contributions(gathered({"c": RUNS["c"]}, certainty=certainty))
    assert answer.of == "peak rotation"
    assert sd["numerical error"] == 0.0


def test_a_fall_that_is_not_converged_has_an_unknown_error():
    certainty = {"c": results.Certainty(numerical=judged(None))}
    answer, _ = contributions(gathered({"c": RUNS["c"]}, certainty=certainty))
    assert "numerical error" in answer.unknown


def test_a_run_without_a_peak_counts_as_one_that_never_turned():
    _, sd = contributions(gathered({"a": RUNS["a"], "b": ran("at rest")}))
    assert sd["records"] == pytest.approx(0.2 / math.sqrt(2.0))


def test_shares_of_the_variance_sum_to_one_the_largest_first():
    cm = {"a": ran("at rest", 0.3), "b": ran("at rest", 0.4)}
    answer, _ = contributions(gathered({"a": RUNS["a"], "b": RUNS["b"]}, cm=cm))
    assert [part.source for part in answer.contributions] == ["records", "model form"]
    # variances 0.02, and the mean of 0.01 and 0
    assert [part.share for part in answer.contributions] == pytest.approx([0.8, 0.2])


def test_without_any_variance_no_source_has_a_share():
    answer, _ = contributions(gathered({"a": RUNS["a"], "b": RUNS["a"]}))
    assert [part.share for part in answer.contributions] == [0.0]


TWO_NUMBERS = files.UncertainScene(
    SCENE,
    {
        "floor.friction": files.Spread(value=0.4, sd=0.04),
        "block.half_width": files.Spread(value=0.397, sd=0.001),
    },
    np.eye(2),
)


def leading(peak_of, cases="a"):
    """The leading number of draws whose peaks are a function of both, as standard deviations."""
    plan = gathered(dict.fromkeys(cases, RUNS["a"]), given=TWO_NUMBERS, draws=16).plan
    drawn = {}
    for case in cases:
        values = np.array([[value for _, value in draw] for draw in plan.numbers[case]])
        deviations = (values - values.mean(axis=0)) / values.std(axis=0)
        drawn[case] = [ran(*peak_of(case, *each)) for each in deviations.tolist()]
    everything = gathered(dict.fromkeys(cases, RUNS["a"]), given=TWO_NUMBERS, draws=16, drawn=drawn)
    return certainty_answers.leading_number(everything)


def test_the_number_that_moves_the_peak_leads():
    name = leading(lambda _, friction, width: ("at rest", 0.3 + 0.01 * friction - 0.03 * width))
    assert name == "block.half_width"


def test_a_number_of_a_small_scatter_may_lead():
    name = leading(lambda _, friction, width: ("at rest", 0.3 + 0.03 * friction - 0.01 * width))
    assert name == "floor.friction"


def test_a_fall_counts_as_a_peak_of_one():
    """A single fall at the lowest width leaves what moves all others in front."""

    def peak_of(case, friction, width):
        falls = width < -1.6
        return ("overturned left", 6.0) if falls else ("at rest", 0.5 + 0.2 * friction)

    assert leading(peak_of) == "floor.friction"


def test_what_works_against_itself_under_two_records_does_not_lead():
    """The width raises the peak under one record, and lowers it under the other."""

    def peak_of(case, friction, width):
        return "at rest", 0.5 + 0.01 * friction + (0.1 if case == "a" else -0.1) * width

    assert leading(peak_of, "ab") == "floor.friction"


def test_without_draws_no_number_leads():
    assert certainty_answers.leading_number(gathered()) is None


def test_draws_scatter_within_a_record():
    drawn = {"a": [ran("at rest", peak) for peak in (0.15, 0.25, 0.25, 0.15)]}
    _, sd = contributions(
        gathered({"a": RUNS["a"]}, given=UNCERTAIN, recorded=False, draws=4, drawn=drawn)
    )
    assert sd["inputs"] == pytest.approx(0.05)


def test_a_tie_is_never_converged():
    tie = ("friction equals B/H", 0.3, ("at rest", "overturned left"))
    sure = results.Certainty(numerical=judged(1e-9), ties=(tie,))
    everything = gathered({"a": RUNS["a"]}, recorded=False, certainty={"a": sure})
    words = sentences.certainty_sentences(
        everything, certainty_answers.uncertainty_answer(everything)
    )
    assert "From 0.3 s on the mechanics has more than one answer" in words[1]
    assert not sentences.is_converged(sure)
    assert finding_of(everything).exit_code == 1
    assert finding_of(everything).data["ties"][0]["fates"] == ["at rest", "overturned left"]


# What do hand methods say?


def scores(runs=RUNS):
    methods = [(one.name, one.event) for one in CRITERIA]
    everything = gathered(runs)
    return {one.method: one for one in certainty_answers.method_scores(everything, methods)}


@pytest.mark.parametrize(
    ("method", "predicts", "simulated", "agrees", "estimate", "motion", "unsafe"),
    [
        ("uplift", 2, 3, 2, 0.3, 0.4, 2),
        ("sliding", 2, 2, 1, 0.05, 0.01, 1),
        ("step of velocity", 2, 1, 2, 1.5, 0.4, 0),
        ("sliding block", 3, 2, 2, 0.04, 0.01, 0),
        ("reserve sliding", 2, 2, 1, 0.01, 0.01, 2),
        ("reserve rocking", 2, 1, 2, 0.3, 0.4, 2),
    ],
)
def test_hand_methods_are_held_against_fates(
    method, predicts, simulated, agrees, estimate, motion, unsafe
):
    score = scores()[method]
    assert score.of == 3
    assert score.predicts == predicts
    assert score.simulated == simulated
    assert score.agrees == agrees
    assert score.estimate == pytest.approx(estimate)
    assert score.motion == pytest.approx(motion)
    assert score.unsafe == unsafe


def test_of_one_run_a_method_says_what_happens_not_how_often():
    everything = gathered({"a": RUNS["a"]})
    methods = [(one.name, one.event) for one in CRITERIA]
    words = sentences.method_sentences(
        certainty_answers.method_scores(everything, methods), [event for _, event in methods]
    )
    assert words == ["step of velocity: stays; reserve rocking: overturns."]


def scored(event, run, predicts, estimate):
    """The score of a method of one run."""
    everything = gathered({"x": run})
    shown = everything.shown["x"].model_copy(update={"methods": ((predicts, estimate),)})
    done = {everything.plan.shown["x"]: shown}
    (score,) = certainty_answers.method_scores(Gathered(everything.plan, done), [("m", event)])
    return score


def test_what_nothing_decided_is_held_against_no_method():
    assert scored("uplifts", ran("undecided", 0.9), True, 0.5).of == 0


@pytest.mark.parametrize(("slip", "simulated"), [(0.9e-6, 0), (2e-6, 1)])
def test_a_slip_above_a_thousandth_of_a_millimetre_is_one(slip, simulated):
    assert scored("slides", ran("at rest", 0.1, slip), True, None).simulated == simulated


def test_a_block_that_falls_need_not_have_slid():
    assert scored("slides", ran("overturned left", 6.0, 0.0), True, None).simulated == 0


def test_a_run_without_a_figure_did_not_move():
    score = scored("slides", ran("at rest"), False, 0.1)
    assert score.simulated == 0
    assert score.motion == 0.0


@pytest.mark.parametrize(
    ("estimate", "motion", "unsafe"),
    [(10.0, 10.00001, 0), (10.0, 10.00002, 1), (0.5, 0.5000005, 0), (0.0, 2e-6, 1)],
)
def test_an_estimate_is_unsafe_where_the_block_goes_farther_by_a_millionth(
    estimate, motion, unsafe
):
    assert scored("uplifts", ran("at rest", motion), True, estimate).unsafe == unsafe


def test_a_fall_goes_farther_than_any_rotation():
    score = scored("uplifts", ran("overturned left", 1.0), True, 5.0)
    assert score.motion is None
    assert score.unsafe == 1


def test_a_method_without_an_estimate_is_neither_safe_nor_unsafe():
    score = scored("uplifts", RUNS["a"], True, None)
    assert score.estimate is None
    assert score.unsafe is None


# The finding


def test_a_run_that_failed_ends_with_3():
    failed = results.RunResult(fate="failed", reason="the cap on steps was reached")
    found = finding_of(gathered({"a": RUNS["a"], "b": failed}))
    assert found.exit_code == 3
    assert found.failures == {"b": "the cap on steps was reached"}
    assert found.data["runs"] == 1


def test_every_question_has_an_answer():
    found = finding_of(gathered())
    answers = found.table("answers").records()
    assert len(answers) == 6
    assert [row["question"] for row in answers if not row["answer"]] == []


def test_the_page_begins_with_what_was_assessed():
    found = finding_of(gathered())
    facts = dict(found.blocks[0].facts)
    assert facts["block"] == "0.794 m wide, 3.11 m high"
    assert facts["base"] == "3 recorded motions, listed below"
    assert next(found.plots()).name == "scene"
