"""What an assessment plays: which tasks, in which waves, at which gaps and factors."""

import math
from dataclasses import replace

import numpy as np
import pytest
from assessed import interval, ran, search

from rockcheck import Record, Rest, Ricker, Wall, load_scene
from rockcheck.scenes import Floor, files
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.studies.population import results
from rockcheck.validation.studies.population.intensity_measures import measure_of
from rockcheck.validation.studies.population.plan import (
    GapRange,
    Plan,
    clearance_of,
    factors_of,
    gaps_looked_at,
    lasting,
    least_gap,
)
from rockcheck.validation.studies.population.tasks import COMPILED_RUN, effort

SCENE = load_scene("fig5a").replace(walls=[Wall(side="left", gap=0.05, restitution=0.3)])
BLOCK = SCENE.block
PGA = measure_of("pga")
FRICTION = {"floor.friction": files.Spread(value=0.4, sd=0.04)}
#: Factors from where it moves up to 32 times that, in steps of 1 %.
FACTORS = 347.0


def given(scene=SCENE, spreads=None, correlation=None):
    spreads = spreads or {}
    return files.UncertainScene(
        scene, spreads, np.eye(len(spreads)) if correlation is None else correlation
    )


def planned(scene=SCENE, *, cases=1, spreads=None, **more):
    """A plan of so many cases, of which the first has uncertain numbers."""
    own = given(scene, spreads)
    others = {f"R{k}": given(scene) for k in range(1, cases)}
    return Plan(own=own, cases={"R0": own, **others}, **more)


@pytest.mark.parametrize(
    ("change", "copies"),
    [({}, 2), ({"source": "b.csv"}, 2), ({"notes": ("as told",)}, 2), ({"scale": 1.1}, 1)],
)
def test_copies_are_motions_that_differ_by_their_names_alone(change, copies):
    record = Record.from_samples([0.0, 1.0, 0.0], 0.01)
    other = record.model_copy(update=change)
    scenes = [given(SCENE.replace(excitation=one)) for one in (record, record, other)]
    plan = Plan(own=scenes[0], cases=dict(zip("abc", scenes, strict=True)), recorded=True)
    assert plan.copies == copies
    assert replace(plan, recorded=False).copies == 0


# Which models


def test_a_model_that_knows_fates_plays_what_is_varied():
    plan = planned(models={"ebm": {"tolerance": 1e-8}})
    assert plan.batch_model == "ebm"
    assert plan.plays_itself
    assert dict(plan.batch_settings) == {"tolerance": 1e-8}


@pytest.mark.parametrize("model", ["cm", "ebm-bouc-wen"])
def test_for_a_model_that_knows_none_the_unilateral_one_plays_what_is_varied(model):
    plan = planned(models={model: {}})
    assert plan.batch_model == "ebm-unilateral"
    assert not plan.plays_itself


def test_a_floor_that_loses_nothing_has_no_batch():
    scene = SCENE.replace(floor=SCENE.floor.replace(restitution=1.0))
    plan = planned(scene, measure=PGA, gaps=[GapRange("left")])
    assert plan.free == {}
    assert plan.factors == {}


def test_all_but_the_first_model_are_others():
    plan = planned(models={"cm": {}, "ebm": {}, "ebm-unilateral": {}})
    assert [*plan.others] == ["ebm", "ebm-unilateral"]


def test_only_another_model_is_named_in_the_progress():
    plan = planned(models={"cm": {}, "ebm": {}})
    assert plan.shown["R0"].label == "R0"
    assert plan.others["ebm"]["R0"].label == "R0, ebm"


def test_the_history_of_the_first_model_alone_is_drawn():
    plan = planned(models={"ebm-unilateral": {}, "cm": {}})
    assert plan.shown["R0"].drawn
    assert not plan.others["cm"]["R0"].drawn
    assert not plan.by_other_law["R0"].drawn


def test_what_strikes_floor_and_wall_at_once_is_played_by_the_other_law_too():
    assert dict(planned().by_other_law["R0"].settings) == {"impacts": "floor-first"}


def test_another_setting_of_the_law_is_held_against_moreaus():
    plan = planned(models={"ebm-unilateral": {"impacts": "floor-first", "tolerance": 1e-8}})
    assert dict(plan.by_other_law["R0"].settings) == {"impacts": "moreau", "tolerance": 1e-8}


def test_without_a_wall_there_is_no_other_law():
    assert planned(SCENE.replace(walls=[])).by_other_law == {}


def test_the_papers_model_has_no_other_law():
    assert planned(models={"ebm": {}}).by_other_law == {}


# Draws


def test_draws_are_of_cases_with_uncertain_numbers():
    plan = Plan(own=given(), cases={"a": given(spreads=FRICTION), "b": given()}, draws=4)
    assert len(plan.numbers["a"]) == 4
    assert plan.numbers["b"] == ()
    assert [*plan.drawn] == ["a"]


def test_nothing_is_drawn_unless_it_is_asked_for():
    plan = planned(spreads=FRICTION)
    assert plan.numbers == {"R0": ()}
    assert plan.drawn == {}
    assert plan.sensitivity is None


def test_draws_and_runs_without_the_wall_are_told_apart_in_the_progress():
    plan = planned(spreads=FRICTION, draws=4, gaps=[GapRange("left")])
    assert plan.drawn["R0"].label == "draws, R0"
    assert plan.free["left"]["R0"].label == "without the wall on the left, R0"


def test_which_number_matters_is_asked_of_the_scene_s_own_motion():
    assert planned(spreads=FRICTION, draws=4).sensitivity is not None
    assert planned(spreads=FRICTION, draws=4, recorded=True).sensitivity is None


def test_of_correlated_numbers_it_is_not_asked_which_matters():
    spreads = FRICTION | {"walls.left.gap": files.Spread(value=0.05, sd=0.005)}
    own = given(spreads=spreads, correlation=np.array([[1.0, 0.5], [0.5, 1.0]]))
    assert Plan(own=own, cases={"a": own}, draws=4).sensitivity is None


# How long it takes


@pytest.mark.parametrize(
    ("task", "runs"),
    [
        (lambda plan: plan.shown["R0"], 1),
        (lambda plan: plan.drawn["R0"], 1 + 4),
        (lambda plan: plan.certainty({})["R0"], 4),
        (lambda plan: plan.factors["R0"], math.log(32.0) / 0.01),
        (lambda plan: plan.sensitivity, 1024 * (2 + 1)),
    ],
    ids=["run", "draws", "certainty", "factors", "sensitivity"],
)
def test_a_task_takes_as_long_as_its_runs(task, runs):
    plan = planned(spreads=FRICTION, draws=4, measure=PGA)
    assert task(plan).expected == pytest.approx(runs * COMPILED_RUN)


def test_a_search_over_gaps_takes_as_long_as_its_looks():
    plan = planned(spreads=FRICTION, draws=4, gaps=[GapRange("left", (0.0, 0.05, 0.1))])
    free = results.Drawn(results=tuple(ran("at rest", 0.3, reach=0.1) for _ in range(5)))
    task = plan.gap_tasks({plan.free["left"]["R0"]: free})["left"]["R0"]
    assert task.expected == pytest.approx((101 + 3 * 5) * COMPILED_RUN)


@pytest.mark.parametrize(
    ("more", "where"),
    [
        ({"cases": 300, "measure": PGA}, "here"),  # 300 times 354 runs of half a millisecond
        ({"cases": 350, "measure": PGA}, "worker"),
        ({"cases": 400}, "here"),
        ({"spreads": FRICTION, "draws": 2048, "gaps": [GapRange("left")]}, "here"),
        ({"spreads": FRICTION, "draws": 4096, "gaps": [GapRange("left")]}, "worker"),
        (
            {"spreads": FRICTION, "draws": 2048, "gaps": [GapRange("left"), GapRange("right")]},
            "worker",
        ),
        ({"cases": 300, "gaps": [GapRange("left")]}, "here"),
        ({"cases": 400, "gaps": [GapRange("left")]}, "worker"),
        ({"cases": 100, "spreads": FRICTION, "draws": 1024}, "here"),
        ({"cases": 100, "spreads": FRICTION, "draws": 2048}, "worker"),
    ],
)
def test_what_takes_less_than_a_minute_is_played_here(more, where):
    assert planned(**more).shown["R0"].where == where


def test_a_model_that_is_not_compiled_is_played_by_a_worker():
    """However short: an engine that crashes must not take the study down."""
    assert effort("pybullet", {}, 1, 1)["where"] == "worker"


# Waves


def done_of(tasks, result):
    return dict.fromkeys(tasks, result)


def test_at_first_the_runs_and_all_that_is_varied_are_played():
    plan = planned(spreads=FRICTION, draws=4, measure=PGA, gaps=[GapRange("left")])
    words = [task.about[0] for task in plan.tasks({})]
    assert words == [
        "",
        "other law of impacts",
        "draws",
        "without the wall on the left",
        "intensities",
        "sensitivities",
    ]


def test_certainty_and_gaps_wait_for_the_runs():
    plan = planned(gaps=[GapRange("left", (0.0, 0.1))])
    first = plan.tasks({})
    done = {task: results.Shown(result=ran("at rest", 0.3)) for task in first}
    done[plan.free["left"]["R0"]] = results.Drawn(results=(ran("at rest", 0.3, reach=0.1),))
    second = [task.about for task in plan.tasks(done) if task not in first]
    assert second == [
        ("certainty", "R0"),
        ("gaps on the left", "R0"),
    ]


def test_a_run_that_has_not_ended_keeps_all_others_waiting():
    plan = planned(cases=2)
    first = plan.tasks({})
    assert plan.tasks({first[0]: results.Shown(result=ran("at rest", 0.3))}) == first


def test_a_case_whose_free_run_failed_has_no_search():
    plan = planned(cases=2, gaps=[GapRange("left")])
    done = {
        plan.free["left"]["R0"]: Failure("it failed"),
        plan.free["left"]["R1"]: results.Drawn(results=(ran("at rest", 0.3, reach=0.1),)),
    }
    assert [*plan.gap_tasks(done)["left"]] == ["R1"]


def test_before_any_free_run_has_ended_no_gap_is_searched():
    assert planned(gaps=[GapRange("left")]).gap_tasks({}) == {}


def searched(**more):
    """The task of the search over the gap on the left, whose free runs are a fall and two more."""
    plan = planned(spreads=FRICTION, draws=2, **more)
    free = (
        ran("at rest", 0.3, reach=0.1),
        ran("overturned left", 6.0, reach=0.2),
        ran("undecided", 0.9, reach=0.05),
    )
    return plan.gap_tasks({plan.free["left"]["R0"]: results.Drawn(results=free)})["left"]["R0"]


def test_a_run_that_nothing_decided_may_reach_any_wall():
    assert searched(gaps=[GapRange("left")]).reach == (0.1, 0.2, math.inf)


def test_what_falls_without_the_wall_does_not_stand_beyond_its_reach():
    assert searched(gaps=[GapRange("left")]).free_stands == (True, False, False)


def test_the_gaps_that_are_asked_for_are_tabulated():
    assert searched(gaps=[GapRange("left", (0.03, 0.01))]).tabulated == (0.03, 0.01)


def test_else_those_of_the_draws_are():
    task = searched(gaps=[GapRange("left")])
    assert task.tabulated == task.coarse
    assert len(task.coarse) == 33


# How sure


def test_the_certainty_goes_on_until_the_fate_is_known():
    plan = planned()
    shown = results.Shown(result=ran("at rest", 0.3), until_s=50.0)
    scene = plan.certainty({plan.shown["R0"]: shown})["R0"].scene
    assert scene.duration == pytest.approx(50.0 + 1.0 / SCENE.frequency_parameter)


def test_a_fate_within_the_duration_leaves_it():
    assert lasting(SCENE, SCENE.duration) == SCENE
    assert lasting(SCENE, 0.5 * SCENE.duration) == SCENE


def test_before_a_run_has_ended_its_scene_lasts_as_it_does():
    brief = SCENE.replace(duration=0.5)
    assert planned(brief).certainty({})["R0"].scene == brief


def test_the_scene_s_own_motion_is_the_first_case_unless_there_are_records():
    own, shaken = given(), given(SCENE.replace(excitation=Ricker(amplitude=3.0, period=0.7)))
    plan = Plan(own=own, cases={"R0": shaken}, recorded=True)
    assert plan.own_certainty({}).scene == SCENE
    assert Plan(own=own, cases={"R0": shaken}).own_certainty({}).scene == shaken.scene


# Thresholds of another model


def thresholds(fall, *, cases=1, side="left", restitution=0.0, model="cm"):
    """Of a search that found one interval of the last case on a side."""
    plan = planned(cases=cases, models={model: {}}, gaps=[GapRange(side, (0.0, 0.1), restitution)])
    case = f"R{cases - 1}"
    done = {
        task: results.Drawn(results=(ran("at rest", 0.3, reach=0.1),))
        for task in plan.free[side].values()
    }
    done[plan.gap_tasks(done)[side][case]] = search(*fall)
    return plan.thresholds(done)


FALL = interval(0, 0.03, 0.1, 0.0299, None)


def test_another_model_plays_on_both_sides_of_what_the_batch_found():
    found = thresholds([FALL], cases=2)
    assert [threshold.what for threshold in found] == ["gap 29.9 mm", "gap 30 mm"]
    assert [threshold.case for threshold in found] == ["R1", "R1"]
    assert [threshold.task.scene.wall("left").gap for threshold in found] == [0.0299, 0.03]


def test_thresholds_wait_for_the_search():
    plan = planned(models={"cm": {}}, gaps=[GapRange("left", (0.0, 0.1))])
    done = done_of(plan.tasks({}), results.Shown(result=ran("at rest", 0.3)))
    done[plan.free["left"]["R0"]] = results.Drawn(results=(ran("at rest", 0.3, reach=0.1),))
    second = plan.tasks(done)
    done |= done_of([task for task in second if task not in done], results.Certainty())
    gap_task = plan.gap_tasks(done)["left"]["R0"]
    without_search = {task: result for task, result in done.items() if task != gap_task}
    assert plan.tasks(without_search) == second
    done[gap_task] = search(FALL)
    last = [task.about[0] for task in plan.tasks(done) if task not in second]
    assert last == ["gap 29.9 mm", "gap 30 mm"]


def test_where_it_falls_at_the_least_gap_there_is_one_side():
    (found,) = thresholds([interval(0, 0.0, 0.1, None, None)])
    assert found.what == "gap 0 mm"


def test_a_wall_of_the_scene_stays_as_it_is():
    found, _ = thresholds([FALL], restitution=0.9)
    assert found.task.scene.walls == (Wall(side="left", gap=0.0299, restitution=0.3),)


def test_a_wall_that_the_scene_has_not_is_put_beside_the_other():
    found, _ = thresholds([FALL], side="right", restitution=0.9)
    assert found.task.scene.wall("right") == Wall(side="right", gap=0.0299, restitution=0.9)
    assert found.task.scene.wall("left") == SCENE.walls[0]


def test_a_threshold_takes_as_long_as_a_run():
    found, _ = thresholds([FALL])
    assert found.task.expected == pytest.approx(COMPILED_RUN)


def test_a_wall_that_is_tried_is_plastic_unless_it_is_told_otherwise():
    assert GapRange("right").restitution == 0.0


def test_a_draw_that_falls_is_no_threshold():
    assert thresholds([interval(1, 0.03, 0.1, 0.0299, None)]) == []


def test_a_model_that_plays_what_is_varied_needs_no_thresholds():
    assert thresholds([FALL], model="ebm") == []


@pytest.mark.parametrize(("moves", "factor"), [(True, 1.5), (False, 1.0)])
def test_a_factor_is_tried_with_the_vertical_motion_of_a_record(moves, factor):
    upward = Ricker(amplitude=1.0, period=0.7)
    shaken = SCENE.replace(vertical=upward)
    own = given() if moves else given(shaken)
    plan = Plan(own=own, cases={"R0": given(shaken)}, models={"cm": {}}, measure=PGA)
    fall = interval(0, 1.5, 40.0, None, None)
    done = {plan.factors["R0"]: results.FactorSearch(intervals=(fall,), undecided=0, runs=9)}
    (found,) = plan.thresholds(done)
    assert found.what == "1.5 times its motion"
    assert found.task.scene.excitation == SCENE.excitation.scaled(1.5)
    assert found.task.scene.vertical == upward.scaled(factor)


# Factors


def test_only_a_base_that_moves_is_scaled():
    still = given(SCENE.replace(excitation=Rest()))
    weak = given(SCENE.replace(excitation=Ricker(amplitude=0.5, period=0.7)))
    plan = Plan(own=weak, cases={"still": still, "weak": weak}, measure=PGA)
    assert [*plan.factors] == ["weak"]


def test_without_a_measure_nothing_is_scaled():
    assert planned().factors == {}


PUSH = Ricker(amplitude=9.81 * BLOCK.slope / 4.0, period=1.0)


def test_factors_begin_where_a_block_at_rest_begins_to_move():
    factors = factors_of(SCENE.replace(excitation=PUSH))
    assert factors[0] == pytest.approx(4.0, rel=1e-3)
    assert factors[1] / factors[0] == pytest.approx(math.exp(0.01))


def test_factors_end_beyond_32_times_that():
    factors = factors_of(SCENE.replace(excitation=PUSH))
    assert 32.0 <= factors[-1] / factors[0] < 32.0 * math.exp(0.01)


@pytest.mark.parametrize("strong", [1.0, 7.3, 300.0])
def test_the_motion_as_it_is_is_among_the_factors(strong):
    """Also where it is more than 32 times as strong as what lifts the block."""
    factors = factors_of(SCENE.replace(excitation=PUSH.scaled(4.0 * strong)))
    assert list(factors) == sorted(set(factors))
    assert 1.0 in factors
    assert factors[-1] >= max(1.0, 32.0 * factors[0])


def test_a_motion_that_is_too_weak_to_move_the_block_is_not_looked_at():
    assert 1.0 not in factors_of(SCENE.replace(excitation=PUSH))


def test_a_search_of_what_slides_begins_lower_at_the_same_factors():
    slippery = SCENE.replace(excitation=PUSH, floor=Floor(friction=0.5 * BLOCK.slope))
    rocks, slides = factors_of(slippery), factors_of(slippery, slides=True)
    assert slides[0] == pytest.approx(2.0, rel=0.01)
    assert slides[-len(rocks) :] == rocks


def test_a_search_of_what_rocks_first_begins_no_lower():
    rocking = SCENE.replace(excitation=PUSH, floor=Floor(friction=2.0 * BLOCK.slope))
    assert factors_of(rocking, slides=True) == factors_of(rocking)


@pytest.mark.parametrize(
    "change",
    [
        {"vertical": Ricker(amplitude=1.0, period=0.7)},
        {"initial_rotation": 0.01},
        {"initial_velocity": 0.01},
        {"initial_height": 0.01},
    ],
    ids=lambda change: next(iter(change)),
)
def test_what_moves_anyhow_is_scaled_from_a_tenth(change):
    assert factors_of(SCENE.replace(excitation=PUSH, **change))[0] == pytest.approx(0.1)


def test_what_moves_anyhow_under_a_strong_motion_is_scaled_from_a_tenth_of_what_lifts_it():
    strong = SCENE.replace(excitation=PUSH.scaled(8.0), initial_rotation=0.01)
    assert factors_of(strong)[0] == pytest.approx(0.05, rel=1e-3)


# Gaps


def test_the_scene_is_looked_at_every_millimetre():
    looked, _ = gaps_looked_at(0.05, ())
    # 50 mm in 1 mm, and the 32 parts at which draws are looked at
    assert set(np.round(np.arange(51) * 1e-3, 12)) <= set(looked)
    assert max(np.diff(looked)) == pytest.approx(1e-3)
    assert looked[-1] == 0.05


def test_draws_are_looked_at_in_32_parts():
    _, of_draws = gaps_looked_at(0.064, ())
    assert of_draws == pytest.approx([0.002 * k for k in range(33)])


def test_beyond_400_mm_there_are_40_parts():
    looked, _ = gaps_looked_at(2.4, (0.0, 2.4))
    assert [gap for gap in looked if gap > 0.4001] == pytest.approx(
        [0.4 + 0.05 * k for k in range(1, 41)]
    )
    assert sum(gap <= 0.4001 for gap in looked) == 401


def test_up_to_400_mm_there_is_nothing_beyond():
    looked, of_draws = gaps_looked_at(0.4, ())
    assert max(np.diff(looked)) == pytest.approx(1e-3)
    assert of_draws == pytest.approx([0.0125 * k for k in range(33)])


def test_beyond_400_mm_draws_are_looked_at_in_8_of_32_parts():
    _, of_draws = gaps_looked_at(2.0, ())
    assert of_draws == pytest.approx(
        [0.4 / 24 * k for k in range(25)] + [0.4 + 0.2 * k for k in range(1, 9)]
    )


def test_gaps_begin_at_the_least():
    looked, of_draws = gaps_looked_at(0.07, (), least=0.02)
    assert looked[0] == 0.02
    assert of_draws == pytest.approx([0.02 + 0.05 / 32 * k for k in range(33)])


def test_a_block_that_reaches_no_farther_than_its_least_gap_has_one():
    assert gaps_looked_at(0.01, (), least=0.02) == ((0.02,), (0.02,))


def test_no_gap_is_lost_to_rounding():
    """(0.3 - 0.1) / 0.001 is just below 200."""
    looked, _ = gaps_looked_at(1.0, (0.1, 0.3))
    assert looked == tuple(round(0.1 + 1e-3 * k, 12) for k in range(201))


def test_a_block_that_stands_upright_may_touch_the_wall():
    assert least_gap(SCENE, "left") == 0.0


def test_the_top_of_a_tilted_block_reaches_beyond_its_corner():
    tilted = SCENE.replace(walls=[], initial_rotation=0.02)
    assert least_gap(tilted, "left") == pytest.approx(2.0 * BLOCK.half_height * math.sin(0.02))
    assert least_gap(tilted, "right") == 0.0


def test_the_clearance_is_the_farthest_reach_of_all_runs():
    free = {
        "a": results.Drawn(results=(ran("at rest", 0.3, reach=0.1), ran("failed"))),
        "b": results.Drawn(results=(ran("at rest", 0.3, reach=0.3),)),
    }
    assert clearance_of(free, "left") == 0.3


def test_without_runs_there_is_no_clearance():
    assert clearance_of({}, "left") is None
