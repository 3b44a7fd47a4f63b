"""A block on the storeys of a building: the same runs as one by one, and the page by storey."""

from dataclasses import replace

import numpy as np
import pytest
from assessed import CERTAIN, RUNS, gathered
from damaged import FALL, PGA, SLIP, answers_of, from_factor

from rockcheck import EventBasedModel
from rockcheck.commands import assess as command
from rockcheck.scenes import Block, Floor, InputError, Record, Scene, files
from rockcheck.scenes.buildings import Modal, Mode, Regular
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.finding import Plot
from rockcheck.validation.studies.population import storeys
from rockcheck.validation.studies.population.capacities import Capacity
from rockcheck.validation.studies.population.intensity_measures import size_of
from rockcheck.validation.studies.population.plan import Plan

BUILDING = Regular(storeys=3, storey=2, period=0.4, damping=0.05)
SCENE = Scene(
    name="shelf",
    block=Block(half_width=0.2, half_height=0.8),
    floor=Floor(friction=0.6),
    duration=5.0,
)


def shaken(seed, size):
    chance = np.random.default_rng(seed)
    samples = np.sin(np.pi * np.arange(61) / 60.0) * chance.normal(0.0, size, 61)
    given = files.UncertainScene(
        SCENE.replace(excitation=Record.from_samples(samples, 0.05)), {}, np.eye(0)
    )
    return files.on_storey(given, BUILDING)


CASES = {"weak": shaken(1, 1.0), "strong": shaken(2, 4.0)}
TOP = Capacity("top", 0.05)


@pytest.fixture(scope="module")
def played():
    planned = Plan(own=CASES["weak"], cases=CASES, recorded=True, measure=PGA, capacities=(TOP,))
    plans = {number: command.plan_of_storey(planned, CASES["weak"], number) for number in (0, 3)}
    study = storeys.Storeys(plans=plans)
    done = {task: task.play() for task in study.tasks({})}
    return study, done, study.gather(done)


@pytest.mark.parametrize("number", [0, 3])
def test_a_row_counts_the_runs_that_overturn_on_the_storey(played, number):
    building = BUILDING.replace(storey=number)
    fallen = 0
    for given in CASES.values():
        ground = replace(given, scene=given.scene.replace(excitation=given.ground_motion))
        scene = files.on_storey(ground, building).scene.replace(duration=30.0)
        outcome = EventBasedModel(pivot="unilateral").simulate(scene).outcome
        fallen += outcome.startswith("overturned")
    row = next(row for row in played[2].data["storeys"] if row["storey"] == number)
    assert row["overturned"] == fallen
    assert row["runs"] == 2


def test_nothing_failed(played):
    assert played[2].exit_code == 0


def test_medians_have_four_digits(played):
    assert [column.digits for column in played[2].table("storeys").columns[4:]] == [4, 3, 4]


def test_the_ground_has_the_ground_s_peak(played):
    peaks = [size_of(PGA, given) for given in CASES.values()]
    assert played[2].data["storeys"][0]["pfa"] == pytest.approx(np.mean(peaks))


def test_medians_are_those_of_the_storey_alone(played):
    study, done, finding = played
    alone = storeys.storey_of(3, storeys.Gathered(study.plans[3], done))
    row = finding.data["storeys"][1]
    assert row["median"] == alone.falls.fit.median
    assert row["dispersion"] == alone.falls.fit.dispersion
    assert row["top:0.05"] == alone.exceeded[0].intensity.fit.median


def test_a_storey_above_is_shaken_more(played):
    ground, top = played[2].data["storeys"]
    assert top["pfa"] > ground["pfa"]
    assert top["top:0.05"] < ground["top:0.05"]


def test_curves_are_drawn_over_the_storeys(played):
    (plot,) = [block for block in played[2].blocks if isinstance(block, Plot)]
    overturns, top = plot.panels[0].series
    assert (overturns.label, top.label) == ("overturns", TOP.words)
    assert list(top.x) == [0.0, 3.0]
    assert list(top.y) == [row["top:0.05"] for row in played[2].data["storeys"]]
    assert plot.y.label == "median PGA, g"


def test_the_page_says_what_stands_where_and_who_plays_it(played):
    facts = dict(played[2].blocks[0].facts)
    assert facts["block"] == "0.4 m wide, 1.6 m high"
    assert facts["building"] == "storeys: 3, period 0.4 s, damping 0.05"
    assert facts["base"] == "2 recorded motions"
    assert facts["played by"].startswith("ebm-unilateral, rockcheck ")


def test_the_page_names_a_friction_at_which_a_block_slides_or_rocks():
    edge = SCENE.replace(floor=Floor(friction=0.25))
    planned = Plan(own=replace(CASES["weak"], scene=edge), cases=CASES, recorded=True, measure=PGA)
    assert "Friction equals B/H" in storeys.storeys_text(planned).items[0]


def test_the_model_that_is_named_is_the_one_that_plays():
    planned = Plan(own=CASES["weak"], cases=CASES, models={"cm": {}}, recorded=True, measure=PGA)
    found = storeys.finding_of(made_up(0, 1), planned, {})
    assert found.data["model"] == "ebm-unilateral"


def made_up(*fallen):
    """Storeys on which so many of two motions overturn the block."""
    return [
        storeys.Storey(number, 0.5, count, 2, None, [])
        for number, count in enumerate(fallen, start=1)
    ]


def test_the_answer_names_the_storeys_on_which_it_falls():
    assert storeys.answer_of(made_up(0, 1, 2), "shelf") == (
        "shelf overturns on storey 2 (1 of 2 motions), 3 (2 of 2 motions)."
    )


def test_the_answer_says_where_it_falls_on_none():
    assert storeys.answer_of(made_up(0, 0), "shelf") == "shelf overturns on none of 2 storeys."


def test_without_a_curve_there_is_no_plot():
    assert storeys.storey_plot(made_up(0, 1)) == []
    assert storeys.storey_plot([storeys.Storey(1, 0.5, 0, 2, None, answers_of(a=[]))]) == []


def test_a_capacity_without_a_curve_is_an_empty_cell():
    answers = answers_of((SLIP, FALL), a=from_factor(1.0), b=from_factor(4.0))
    plan = gathered(measure=PGA, capacities=(SLIP, FALL)).plan
    storey = storeys.Storey(1, 0.5, 1, 2, None, answers)
    (row,) = storeys.storey_table([storey], plan).records()
    assert row["slip:0.05"] == answers[0].intensity.fit.median
    assert row["overturns"] is None
    assert row["median"] is None


def test_a_storey_that_is_safe_is_marked_so():
    table = storeys.storey_table(made_up(0, 1), gathered(measure=PGA).plan)
    assert [row[2].verdict for row in table.rows] == ["pass", "fail"]


def test_a_failed_task_is_exit_3():
    plan = gathered(dict.fromkeys("a", RUNS["a"]), measure=PGA, given=CASES["weak"]).plan
    study = storeys.Storeys(plans={1: plan})
    (task,) = plan.undrawn.values()
    finding = study.gather({task: Failure("too bad")})
    assert finding.exit_code == 3
    assert list(finding.failures.values()) == ["too bad"]


@pytest.mark.parametrize("text", ["1:4", "3:1", "1", "-1:2", "a:b", "1:2:3", ""])
def test_storeys_that_there_are_not_are_refused(text):
    with pytest.raises(InputError, match="LOW:HIGH within 0:3"):
        command.storeys_of(text, CASES["weak"])


def test_a_building_by_modes_has_no_storeys():
    modal = Modal(modes=(Mode(period=0.5, damping=0.05, participation=1.0),))
    with pytest.raises(InputError, match=r"needs a \[building\] of storeys"):
        command.storeys_of("1:2", replace(CERTAIN, building=modal))


def test_all_storeys_that_are_named_are_meant():
    assert list(command.storeys_of("0:3", CASES["weak"])) == [0, 1, 2, 3]
