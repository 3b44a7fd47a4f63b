"""Tables and plots of an assessment, from results made up (`assessed`)."""

import math
from dataclasses import replace

import pytest
from assessed import CERTAIN, FREE, RUNS, SCENE, UNCERTAIN, gathered, interval, judged, ran, search

from rockcheck.scenes import files
from rockcheck.scenes.buildings import Regular
from rockcheck.validation.finding import Mark, plain
from rockcheck.validation.studies.population import (
    blocks,
    certainty_blocks,
    results,
    statistics,
)
from rockcheck.validation.studies.population.certainty import Contribution, UncertaintyAnswer
from rockcheck.validation.studies.population.gathered import Gathered
from rockcheck.validation.uncertainty.input_spread import Sensitivity

# What is assessed


def fact(name, scene=SCENE, everything=None):
    facts = dict(blocks.scene_text(scene, everything or gathered(recorded=False)).facts)
    return facts.get(name)


def on_floor(**more):
    return SCENE.replace(floor=SCENE.floor.replace(**more))


def test_a_block_is_told_by_its_whole_width_and_height():
    block = SCENE.block
    width, height = 2.0 * block.half_width, 2.0 * block.half_height
    assert fact("block") == f"{width:.4g} m wide, {height:.4g} m high"


def test_a_static_friction_of_its_own_is_told():
    scene = on_floor(friction=0.3, static_friction=0.45, restitution=0.0)
    assert fact("friction", scene) == "0.3, static 0.45"


def test_a_static_friction_that_is_the_same_is_not():
    assert fact("friction", on_floor(friction=0.3, restitution=0.0)) == "0.3"


def test_a_floor_that_bounces_is_told():
    assert fact("friction", on_floor(friction=0.3, restitution=0.25)) == "0.3, restitution 0.25"


def test_without_a_wall_there_is_none():
    assert fact("wall", SCENE.replace(walls=())) == "none"


def test_recorded_motions_are_counted():
    assert fact("base", everything=gathered()) == "3 recorded motions, listed below"


def test_a_building_is_told():
    building = Regular(storeys=8, storey=5, period=0.8, damping=0.05)
    given = gathered(given=files.on_storey(CERTAIN, building))
    assert fact("building", everything=given) == ("on storey 5 of 8, period 0.8 s, damping 0.05")


def test_a_block_on_the_ground_has_no_building():
    assert fact("building") is None


# Outcomes and quantities


@pytest.mark.parametrize(("runs", "on"), [({"a": RUNS["a"]}, "file"), (RUNS, "all")])
def test_the_outcome_of_a_single_run_needs_no_table(runs, on):
    assert blocks.outcome_table(statistics.fall_answer(gathered(runs))).on == on


def test_outcomes_that_nobody_met_have_no_row():
    table = blocks.outcome_table(statistics.fall_answer(gathered(RUNS)))
    assert [row[:2] for row in table.rows] == [
        ["at rest", 1],
        ["moving", 1],
        ["overturned right", 1],
        ["overturned", 1],
    ]


def test_figures_of_a_single_run_make_no_strip():
    answers = statistics.quantity_answers(gathered({"a": RUNS["a"]}))
    assert blocks.strip_plot(answers) == []


def test_a_strip_has_a_value_a_run_that_stands():
    (plot,) = blocks.strip_plot(statistics.quantity_answers(gathered(RUNS)))
    values = {strip["label"]: strip["values"] for strip in plot.data}
    assert [0.2, 0.4] in list(values.values())


# Histories


def histories(**given):
    """The plot of runs that are at rest or moving, of these times and rotations."""
    everything = gathered({case: ran(fate) for case, (fate, _) in given.items()})
    for case, (fate, rows) in given.items():
        text = "t,theta\n" + "".join(f"{t},{theta}\n" for t, theta in rows)
        shown = results.Shown(result=ran(fate), history=text)
        everything.done[everything.plan.shown[case]] = shown
    (plot,) = blocks.history_plot(everything)
    return plot


SHORT, LONG = [(0, 0.0), (0.5, 0.1), (1, 0.1)], [(0, 0.0), (1, 0.1), (3, -0.1)]


def lines(plot):
    return {one.label: one for one in plot.panels[0].series}


def test_histories_go_on_to_the_end_of_the_longest():
    plot = histories(a=("at rest", SHORT), b=("moving", LONG))
    times = lines(plot)["a"].x
    assert times[0] == 0.0
    assert times[-1] == 3.0
    assert len(times) == 400


def test_a_block_at_rest_stays_where_it_is_after_its_history():
    line = lines(histories(a=("at rest", SHORT), b=("moving", LONG)))["a"].y
    assert line[-1] == pytest.approx(0.1 / SCENE.block.alpha)


def test_of_a_block_that_moves_nothing_is_drawn_after_its_history():
    line = lines(histories(a=("moving", SHORT), b=("moving", LONG)))["a"].y
    assert line[-1] is None


@pytest.mark.parametrize(
    ("given", "style"),
    [
        ({"a": ("moving", SHORT)}, "smooth"),
        ({"a": ("moving", SHORT), "b": ("moving", LONG)}, "thin"),
    ],
)
def test_many_lines_are_thin(given, style):
    assert lines(histories(**given))["a"].style == style


def test_the_axis_goes_a_twentieth_of_the_range_beyond_it():
    plot = histories(b=("moving", LONG))
    end = 0.1 / SCENE.block.alpha
    assert plot.y.limits == pytest.approx((-1.1 * end, 1.1 * end), rel=1e-2)


def test_the_noise_of_a_block_at_rest_is_not_blown_up():
    plot = histories(a=("at rest", [(0, 0.0), (1, 0.0), (2, 0.0)]))
    assert plot.y.limits == pytest.approx((-0.5e-3, 0.5e-3))


def test_without_a_history_there_is_no_plot():
    everything = gathered({"a": ran("failed")})
    everything.done[everything.plan.shown["a"]] = results.Shown(result=ran("failed"))
    assert blocks.history_plot(everything) == []


# Runs and notes


@pytest.mark.parametrize(("count", "folded"), [(20, False), (21, True)])
def test_more_than_twenty_runs_are_folded(count, folded):
    runs = {f"r{number}": RUNS["a"] for number in range(count)}
    assert blocks.run_table(gathered(runs)).folded == folded


def test_a_run_that_fell_has_no_figures():
    row = blocks.run_table(gathered({"c": RUNS["c"]})).rows[0]
    assert row[1] == Mark("overturned right", "fail")
    assert [plain(entry) for entry in row[2:]] == [None] * len(row[2:])


@pytest.mark.parametrize(("recorded", "head"), [(True, "record"), (False, "scene")])
def test_a_run_is_of_a_record_or_of_the_scene(recorded, head):
    assert blocks.run_table(gathered(recorded=recorded)).columns[0].name == head


def notes(everything):
    return [item for block in blocks.note_text(everything) for item in block.items]


def played_by(model, **more):
    """Results whose first model is this one."""
    everything = gathered({"a": RUNS["a"]})
    plan = replace(everything.plan, models={model: {}}, **more)
    return type(everything)(plan, {plan.shown["a"]: results.Shown(result=RUNS["a"])})


def drawn_by(model):
    everything = played_by(model, gaps=())
    free = results.FactorSearch(intervals=(), undecided=0, runs=1)
    everything.__dict__["factors"] = {"a": free}
    return everything


VARIED = "draws, gaps and intensities are played by ebm-unilateral"


@pytest.mark.parametrize(("model", "words"), [("cm", [VARIED]), ("ebm-unilateral", [])])
def test_another_model_that_plays_what_is_varied_is_named(model, words):
    assert notes(drawn_by(model)) == words


def test_where_nothing_is_varied_none_is_named():
    assert notes(played_by("cm", gaps=())) == []


# How sure


def contributions(*parts, of="outcome", unknown=()):
    return certainty_blocks.contribution_table(
        UncertaintyAnswer(of, tuple(Contribution(*part) for part in parts), unknown)
    )


@pytest.mark.parametrize(
    ("parts", "on"),
    [
        ([("records", 0.75, 0.3), ("inputs", 0.25, 0.1)], "all"),
        ([("records", 1.0, 0.3)], "file"),
        ([("records", 0.0, 0.0), ("inputs", 0.0, 0.0)], "file"),
    ],
    ids=["two sources", "one source", "nothing varies"],
)
def test_sources_are_shown_where_there_is_a_choice_and_one_matters(parts, on):
    assert contributions(*parts).on == on


@pytest.mark.parametrize(("of", "unit"), [("peak rotation", "α"), ("outcome", "")])
def test_a_standard_deviation_has_the_unit_of_the_answer(of, unit):
    assert contributions(("records", 1.0, 0.3), of=of).columns[2].unit == unit


def test_what_is_not_known_is_named():
    table = contributions(("records", 1.0, 0.3), unknown=("model form",))
    assert table.note == "Of the variance of the outcome. Not known: model form."


def test_the_numerical_uncertainty_is_of_the_scene_s_own_run():
    sure = results.Certainty(numerical=judged(0.0123456))
    everything = gathered({"a": RUNS["a"]}, recorded=False, certainty={"a": sure})
    table = certainty_blocks.numerical_blocks(everything)[0]
    assert table.rows == [["peak_rotation", 0.2, 0.0123456, None, "alpha", "converged"]]
    assert [column.digits for column in table.columns[1:4]] == [4, 4, 4]


def test_of_recorded_motions_there_is_none():
    sure = results.Certainty(numerical=judged(0.0123456))
    everything = gathered({"a": RUNS["a"]}, certainty={"a": sure})
    assert certainty_blocks.numerical_blocks(everything) == []


def test_shares_of_the_peak_s_variance_are_never_negative():
    everything = gathered({"a": RUNS["a"]})
    indices = (Sensitivity(name="floor.friction", first=-0.01, total=1.02),)
    everything.__dict__["sensitivities"] = results.Sensitivities(indices=indices)
    (table,) = certainty_blocks.sensitivity_table(everything)
    assert table.rows == [["floor.friction", 0.0, 1.02]]
    assert [column.digits for column in table.columns[1:]] == [2, 2]


def sensitivities_of(result):
    """Those of an uncertain scene under its own motion, whose task has this result."""
    everything = gathered({"a": RUNS["a"]}, given=UNCERTAIN, recorded=False, draws=4)
    done = everything.done | {everything.plan.sensitivity: result}
    return Gathered(everything.plan, done).sensitivities


def test_indices_are_the_result_of_their_task():
    result = results.Sensitivities(indices=())
    assert sensitivities_of(result) == result


def test_of_indices_that_failed_there_are_none():
    assert sensitivities_of("it takes too many steps") is None


def test_without_indices_there_is_no_table_of_them():
    assert certainty_blocks.sensitivity_table(gathered({"a": RUNS["a"]})) == []


def test_a_peak_that_does_not_vary_has_no_indices_and_no_table():
    everything = gathered({"a": RUNS["a"]})
    everything.__dict__["sensitivities"] = results.Sensitivities(indices=())
    assert certainty_blocks.sensitivity_table(everything) == []


def models_of(runs, **played):
    (table,) = certainty_blocks.model_table(gathered(runs, **played))
    return {row[0]: row[1:5] for row in table.rows}


def test_models_are_apart_where_both_stand():
    runs = {"a": ran("at rest", 0.2), "b": ran("moving", 0.4), "c": ran("overturned left", 9.0)}
    others = {"a": ran("at rest", 0.5), "b": ran("moving", 0.0), "c": ran("at rest", 0.9)}
    rows = models_of(runs, cm=others)
    assert rows["cm"] == [3, 0, pytest.approx(math.sqrt(0.125)), pytest.approx(0.4)]


def test_a_peak_that_is_not_known_counts_as_none():
    rows = models_of({"a": ran("at rest")}, cm={"a": ran("at rest", 0.3)})
    assert rows["cm"][3] == pytest.approx(0.3)


def test_where_no_two_stand_no_difference_is_told():
    rows = models_of({"a": ran("at rest", 0.2)}, cm={"a": ran("overturned left", 9.0)})
    assert rows["cm"] == [1, 1, None, None]


def test_another_law_of_impacts_stands_beside_the_models():
    rows = models_of({"a": ran("at rest", 0.2)}, law={"a": ran("at rest", 0.3)})
    assert rows["another law of impacts"] == [1, 0, pytest.approx(0.1), pytest.approx(0.1)]


def test_without_another_law_there_is_no_row_of_it():
    rows = models_of({"a": ran("at rest", 0.2)}, cm={"a": ran("at rest", 0.3)})
    assert list(rows) == ["cm"]


@pytest.mark.parametrize(("recorded", "head"), [(True, "record"), (False, "scene")])
def test_another_model_stands_and_falls_beside_a_threshold(recorded, head):
    search_of_gaps = search(interval(0, 0.03, 0.1, 0.0299, None))
    batch = gathered(
        {"a": RUNS["a"]}, recorded=recorded, free={"a": FREE["a"]}, gaps={"a": search_of_gaps}
    )
    plan = replace(batch.plan, models={"cm": {}})
    stands, falls = (threshold.task for threshold in plan.thresholds(batch.done))
    played = {
        stands: results.Shown(result=RUNS["a"]),
        falls: results.Shown(result=RUNS["c"]),
    }
    everything = type(batch)(plan, {**batch.done, **played})
    (table,) = certainty_blocks.threshold_table(everything)
    assert table.columns[0].name == head
    assert table.rows == [
        ["a", "gap 29.9 mm", "at rest"],
        ["a", "gap 30 mm", "overturned right"],
    ]


def test_where_the_first_model_plays_itself_there_are_no_thresholds():
    assert certainty_blocks.threshold_table(gathered()) == []
