"""Capacities: what exceeds them, the least intensities, and the files that loss software reads."""

import csv
import io
import json
import math

import numpy as np
import pytest
from assessed import CERTAIN, gathered, interval
from damaged import (
    FALL,
    PGA,
    SIZE,
    SLIP,
    answers_of,
    from_factor,
    library,
)

from rockcheck import EventBasedModel
from rockcheck.ebm import fates
from rockcheck.scenes import PAPER_BLOCK, Block, Floor, InputError, Record, Ricker, Scene, files
from rockcheck.scenes.buildings import Regular
from rockcheck.scenes.recordings.synthetic import Target, synthetic_motions
from rockcheck.validation.finding import Plot, Table
from rockcheck.validation.studies.population import damage, damage_blocks, damage_files
from rockcheck.validation.studies.population.capacities import (
    Capacity,
    capacities_of,
    capacity_of,
)
from rockcheck.validation.studies.population.factor_task import FactorTask
from rockcheck.validation.studies.population.gathered import Gathered
from rockcheck.validation.studies.population.intensity_measures import size_of
from rockcheck.validation.studies.population.plan import Plan, factors_of


@pytest.mark.parametrize(
    ("word", "capacity"),
    [
        ("slip:0.05", SLIP),
        ("top:0.1", Capacity("top", 0.1)),
        ("wall_speed:1.0", Capacity("wall_speed", 1.0)),
        ("rotation:0.5", Capacity("rotation", 0.5)),
        ("0.5", Capacity("rotation", 0.5)),
        ("overturns", FALL),
    ],
)
def test_a_word_names_a_capacity(word, capacity):
    assert capacity_of(word) == capacity


def test_a_capacity_is_asked_for_once():
    assert capacities_of(["slip:0.05", "overturns", "slip:0.050"]) == (SLIP, FALL)


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("slip", "give the slip in m, above 0, as in slip:0.05"),
        ("slip:50mm", "'slip:50mm' is not allowed: give the slip in m"),
        ("slip:0", "above 0"),
        ("slip:-1", "above 0"),
        ("slip:nan", "above 0"),
        ("slip:inf", "above 0"),
        ("rotation:1.5", "at most 1"),
        ("slipp:0.05", "slip:VALUE"),
        ("overturns:1", "unknown capacity 'overturns:1'"),
        ("", "unknown capacity"),
    ],
)
def test_what_is_no_capacity_is_refused(word, said):
    with pytest.raises(InputError, match=r"^--capacity") as refused:
        capacity_of(word)
    assert said in str(refused.value)


def test_thirteen_capacities_are_too_many():
    with pytest.raises(InputError, match="13 is too many"):
        capacities_of([f"slip:{0.01 * number:g}" for number in range(1, 14)])


@pytest.mark.parametrize(
    ("capacity", "exceeds"),
    [
        (SLIP, [False, True, True, True]),
        (Capacity("top", 0.2), [True, False, True, True]),
        (Capacity("wall_speed", 0.5), [False, True, True, True]),
        (Capacity("wall_speed", 0.7), [False, False, True, True]),
        (Capacity("rotation", 0.5), [True, False, True, True]),
        (FALL, [False, False, True, True]),
    ],
    ids=lambda given: given.name if isinstance(given, Capacity) else "",
)
def test_what_exceeds_a_capacity(capacity, exceeds):
    """Runs that stand by their extremes; one that overturns, or that nothing decides, always."""
    nothing = np.zeros(4)
    played = fates.Fates(
        outcome=np.array([fates.AT_REST, fates.MOVING, fates.OVERTURNED_LEFT, fates.UNDECIDED]),
        time_s=nothing,
        peak=np.array([0.3, 0.1, 0.0, 0.0]),
        extremes={
            "slip": np.array([0.05, 0.06, 0.0, 0.0]),
            "top_displacement": np.array([0.3, 0.1, 0.0, 0.0]),
            "wall_left_strikes": np.array([math.nan, 1.0, 0.0, 0.0]),
            "wall_left_speed": np.array([math.nan, 0.6, 9.0, 9.0]),
            "wall_right_strikes": np.array([0.0, 1.0, 0.0, 0.0]),
            "wall_right_speed": np.array([9.0, 0.4, 9.0, 9.0]),
        },
    )
    assert capacity.exceeded(played, 0.5).tolist() == exceeds


def sliding_scene(**change):
    given = {
        "name": "slides and rocks",
        "block": PAPER_BLOCK,
        "floor": Floor(friction=0.4),
        "excitation": Ricker(amplitude=4.0, period=0.8),
        "duration": 20.0,
        "output_step": 0.05,
    }
    return Scene(**(given | change))


def exceeds(scene, capacity):
    """Whether a run of a scene exceeds a capacity, by its history alone."""
    played = EventBasedModel(pivot="unilateral").simulate(scene)
    values = {
        "slip": played.extremes.slip,
        "top": played.extremes.top_displacement,
        "rotation": played.extremes.peak_rotation / scene.block.alpha,
    }
    if played.outcome.startswith("overturned") or capacity == FALL:
        return played.outcome.startswith("overturned")
    return values[capacity.quantity] > capacity.value


SEARCHED = (Capacity("slip", 0.01), Capacity("top", 0.1), Capacity("rotation", 0.2))


def searched(scene, capacities=SEARCHED, *, both=False):
    """The search of a scene as it is, and its factors."""
    task = FactorTask(
        ("capacities", "own"),
        scene,
        "ebm-unilateral",
        factors=factors_of(scene, slides=True),
        both=both,
        capacities=capacities,
    )
    return task.play(), task.factors


@pytest.fixture(scope="module")
def pulse_search():
    return searched(sliding_scene())


@pytest.mark.parametrize("capacity", SEARCHED, ids=lambda capacity: capacity.name)
def test_the_search_ends_between_a_run_that_bears_it_and_one_that_does_not(pulse_search, capacity):
    scene, first = sliding_scene(), pulse_search[0].exceeded[capacity.name][0]
    below, above = (
        scene.replace(excitation=scene.excitation.scaled(factor))
        for factor in (first.stands_below, first.low)
    )
    assert not exceeds(below, capacity)
    assert exceeds(above, capacity)
    assert first.low - first.stands_below <= 2.5e-3 * first.stands_below
    assert first.draw == 0


def test_each_change_is_halved_three_times_after_a_look_of_one_percent(pulse_search):
    search, factors = pulse_search
    changes = 2 + len(SEARCHED)  # it overturns, and stands again
    assert [len(found) for found in search.exceeded.values()] == [1, 1, 1]
    assert search.runs == len(factors) + 3 * changes


def test_capacities_do_not_change_where_it_overturns(pulse_search):
    alone, _ = searched(sliding_scene(), ())
    assert alone.intervals == pulse_search[0].intervals
    assert alone.exceeded == {}


def test_overturning_as_a_capacity_costs_no_run(pulse_search):
    with_it, _ = searched(sliding_scene(), (*SEARCHED, FALL))
    assert with_it.exceeded["overturns"] == pulse_search[0].intervals
    assert with_it.runs == pulse_search[0].runs


@pytest.mark.parametrize("both", [False, True])
def test_a_vertical_motion_is_scaled_with_a_record_that_has_it(both):
    scene = sliding_scene(vertical=Ricker(amplitude=3.0, period=0.6))
    top = Capacity("top", 0.1)
    first = searched(scene, (top,), both=both)[0].exceeded[top.name][0]
    for factor, exceeded in ((first.stands_below, False), (first.low, True)):
        upward = scene.vertical.scaled(factor if both else 1.0)
        moved = scene.replace(excitation=scene.excitation.scaled(factor), vertical=upward)
        assert exceeds(moved, top) == exceeded


def test_the_curve_is_of_the_least_intensities_that_exceed():
    (answer,) = answers_of(a=from_factor(1.0), b=from_factor(4.0))
    assert answer.intensity.fit.median == pytest.approx(2.0 * SIZE)
    assert answer.intensity.fit.dispersion == pytest.approx(math.log(2.0))
    assert answer.exceeded_by == 2


def test_motions_that_exceed_it_and_then_do_not_are_counted():
    (answer,) = answers_of(a=[interval(0, 1.0, 1.1, 0.99, 1.11)], b=from_factor(2.0))
    assert answer.islands == 1


def test_a_capacity_that_nothing_exceeds_has_no_curve():
    _, answer = answers_of((SLIP, FALL), a=from_factor(1.0), b=from_factor(2.0))
    assert answer.capacity == FALL
    assert answer.intensity.fit is None
    assert answer.exceeded_by == 0
    most = SIZE * factors_of(CERTAIN.scene, slides=True)[-1]
    assert answer.intensity.records[0].beyond == pytest.approx(most)
    assert "Overturns: not up to PGA" in damage_blocks.damage_sentences([answer])[0]


def test_without_capacities_there_is_no_answer():
    assert damage.damage_answers(gathered(measure=PGA)) == []
    assert damage_blocks.damage_blocks([]) == []


def test_lognormal_values_are_not_told_from_a_lognormal():
    quantiles = (np.arange(20) + 0.5) / 20.0
    from scipy.special import ndtri

    assert damage.likely_lognormal(np.exp(0.4 * ndtri(quantiles)).tolist()) > 0.9


def test_five_values_are_enough_to_test():
    assert damage.likely_lognormal([1.0, 1.3, 1.6, 2.0, 2.5]) > 0.5


def test_two_clusters_are_not_lognormal():
    values = [*np.linspace(1.0, 1.1, 10), *np.linspace(9.0, 10.0, 10)]
    assert damage.likely_lognormal(values) < 0.01


@pytest.mark.parametrize(
    "values", [[1.0, 2.0, 3.0, 4.0], [1.0, 2.0, 3.0, 4.0, None], [2.0] * 5], ids=str
)
def test_what_cannot_be_tested_is_not(values):
    assert damage.likely_lognormal(values) is None


def curve_table(answers):
    blocks = damage_blocks.damage_blocks(answers)
    return next(block for block in blocks if isinstance(block, Table))


def test_the_table_says_what_speaks_against_a_lognormal_curve():
    clusters = {f"m{k}": from_factor(factor) for k, factor in enumerate([1.0] * 9 + [1.01, 30.0])}
    clusters["m0"] = [interval(0, 1.0, 1.1, 0.99, 1.11)]
    table = curve_table(answers_of(**clusters))
    assert table.records()[0]["remark"] == (
        "not lognormal; the curve counts the least intensity of each motion"
    )


def test_five_motions_are_not_said_to_be_too_few():
    motions = {f"m{k}": from_factor(factor) for k, factor in enumerate([1.0, 1.3, 1.6, 2.0, 2.5])}
    assert curve_table(answers_of(**motions)).records()[0]["remark"] == ""


def test_the_table_has_the_numbers_of_the_curve():
    answers = answers_of((SLIP, FALL), a=from_factor(1.0), b=from_factor(4.0))
    fit = answers[0].intensity.fit
    slip, fall = curve_table(answers).records()
    assert [slip[name] for name in ("median", "low", "high", "dispersion")] == [
        fit.median,
        fit.low,
        fit.high,
        fit.dispersion,
    ]
    assert [slip[name] for name in ("exceeded_by", "motions", "islands")] == [2, 2, 0]
    assert [fall[name] for name in ("median", "low", "high", "dispersion")] == [None] * 4


def test_a_row_of_a_motion_has_its_least_intensities():
    answers = answers_of((SLIP, FALL), a=from_factor(1.0), b=from_factor(4.0))
    blocks = damage_blocks.damage_blocks(answers)
    table = next(block for block in blocks if block.name == "damage")
    assert [column.digits for column in table.columns[2:]] == [4, 4]
    assert table.records()[1] == {
        "record": "b",
        "as_it_is": SIZE,
        "slip:0.05": pytest.approx(4.0 * SIZE),
        "overturns": None,
    }


def plots(answers):
    return [block for block in damage_blocks.damage_blocks(answers) if isinstance(block, Plot)]


def test_curves_are_drawn_over_two_and_a_half_dispersions():
    answers = answers_of((SLIP, FALL), a=from_factor(1.0), b=from_factor(4.0))
    fit = answers[0].intensity.fit
    (plot,) = plots(answers)
    (series,) = plot.panels[0].series
    reach = math.exp(2.5 * fit.dispersion)
    assert series.label == "slip above 0.05 m"
    assert series.x[0] == pytest.approx(fit.median / reach)
    assert series.x[-1] == pytest.approx(fit.median * reach)
    assert np.interp(fit.median, series.x, series.y) == pytest.approx(0.5, abs=1e-3)
    assert plot.y.limits == (0.0, 1.0)


def test_a_curve_that_is_a_step_is_not_drawn():
    assert plots(answers_of(a=from_factor(2.0), b=from_factor(2.0))) == []


def test_programs_get_the_numbers_or_none():
    answers = answers_of((SLIP, FALL), a=from_factor(1.0), b=from_factor(4.0))
    slip, fall = damage_blocks.damage_data(answers)["fragility"]
    fit = answers[0].intensity.fit
    numbers = ("median", "dispersion", "low", "high")
    assert [slip[name] for name in numbers] == [fit.median, fit.dispersion, fit.low, fit.high]
    assert [fall[name] for name in numbers] == [None] * 4
    assert slip["capacity"] == "slip:0.05"


def test_a_few_motions_have_a_sentence_each_way():
    one = answers_of(a=from_factor(2.0))
    two = answers_of(a=from_factor(1.0), b=from_factor(4.0))
    assert damage_blocks.damage_sentences(one) == [
        f"Slip above 0.05 m: from PGA {2.0 * SIZE:.3g} g."
    ]
    assert damage_blocks.damage_sentences(two) == [
        f"Slip above 0.05 m: median PGA {2.0 * SIZE:.3g} g, dispersion 0.69."
    ]


def test_few_motions_are_said_to_be_too_few_to_test():
    table = curve_table(answers_of(a=from_factor(1.0), b=from_factor(4.0)))
    assert table.records()[0]["remark"] == "too few motions to test"


# Files


def test_a_component_has_the_median_and_the_dispersion_of_its_curve():
    files, answers = library()
    rows = list(csv.DictReader(io.StringIO(files["fragility_pelicun.csv"])))
    assert [row["ID"] for row in rows] == [
        "rockcheck.fig5a.slip.0_05",
        "rockcheck.fig5a.overturns",
    ]
    for row, answer in zip(rows, answers, strict=True):
        assert float(row["LS1-Theta_0"]) == answer.intensity.fit.median
        assert float(row["LS1-Theta_1"]) == answer.intensity.fit.dispersion
        assert row["LS1-Family"] == "lognormal"
        assert row["Demand-Type"] == "Peak Ground Acceleration"
        assert row["Demand-Unit"] == "g"


def test_a_library_names_the_block_and_the_building():
    building = Regular(storeys=4, storey=3, period=0.6, damping=0.05)
    _, answers = library()
    files = damage_files.pelicun_files(answers, CERTAIN.scene, "ebm", "1.2.3", building)
    described = json.loads(files["fragility_pelicun.json"])["_GeneralInformation"]["Description"]
    block = CERTAIN.scene.block
    size = f"{2.0 * block.half_width:.4g} m wide, {2.0 * block.half_height:.4g} m high"
    assert f"{size}, on storey 3 of 4, period 0.6 s" in described


def test_a_name_of_a_scene_is_spelt_as_one_word_in_an_id():
    _, answers = library()
    scene = CERTAIN.scene.replace(name="my shelf, no. 2")
    files = damage_files.pelicun_files(answers, scene, "ebm", "1.2.3")
    rows = list(csv.DictReader(io.StringIO(files["fragility_pelicun.csv"])))
    assert rows[1]["ID"] == "rockcheck.my_shelf_no_2.overturns"


@pytest.mark.parametrize(
    ("measure", "demand"),
    [
        ("pfa", "Peak Floor Acceleration"),
        ("pgv", "Peak Ground Velocity"),
        ("sa:0.5", "Spectral Acceleration|0.5"),
    ],
)
def test_a_measure_has_the_library_s_name(measure, demand):
    files, _ = library(measure)
    rows = list(csv.DictReader(io.StringIO(files["fragility_pelicun.csv"])))
    assert rows[0]["Demand-Type"] == demand


def test_one_curve_is_a_library_too():
    _, answers = library()
    files = damage_files.pelicun_files(answers[:1], CERTAIN.scene, "ebm-unilateral", "1.2.3")
    assert len(files["fragility_pelicun.csv"].splitlines()) == 2


def test_a_ratio_has_no_name_in_the_library():
    assert library("pga-ratio")[0] == {}


def test_the_library_says_what_made_it():
    text = library()[0]["fragility_pelicun.json"]
    described = json.loads(text)
    assert text == json.dumps(described, indent=2, ensure_ascii=False) + "\n"
    assert described["_GeneralInformation"]["Version"] == "1.2.3"
    assert "ebm-unilateral" in described["_GeneralInformation"]["Description"]
    block = "fig5a: slip above 0.05 m"
    assert described["rockcheck.fig5a.slip.0_05"]["Description"] == block
    limit = described["rockcheck.fig5a.slip.0_05"]["LimitStates"]["LS1"]["DS1"]["Description"]
    assert limit == "slip above 0.05 m"


@pytest.mark.slow
def test_medians_and_dispersions_are_those_of_a_loop_of_ones_own():
    """Twelve motions on a storey, by an oscillator and `simulate` alone: the least factor of a look
    every 1 % from where the block moves, halved to 0.1 %."""
    block = Block(half_width=0.25, half_height=0.9)
    capacities = [Capacity("rotation", 0.3), Capacity("top", 0.1), Capacity("rotation", 0.5)]
    building = Regular(storeys=1, storey=1, period=0.5, damping=0.05)
    cases, least = {}, {capacity.name: [] for capacity in capacities}
    for number, motion in enumerate(synthetic_motions(Target(), 12, duration=8.0, step=0.02)):
        ground = Record.from_samples(motion.samples, motion.time_step)
        scene = Scene(
            name=f"record {number}",
            block=block,
            floor=Floor(friction=0.6),
            excitation=ground,
            duration=30.0,
            output_step=0.5,
        )
        given = files.on_storey(files.UncertainScene(scene, {}, np.eye(0)), building)
        cases[scene.name] = given
        base = Record.from_samples(*oscillation(ground, 0.5, 0.05))
        peak = np.max(np.abs(base.samples))
        for capacity in capacities:

            def bears(factor, capacity=capacity, scene=scene, base=base):
                return not exceeds(scene.replace(excitation=base.scaled(factor)), capacity)

            factor = 9.81 * 0.25 / 0.9 / peak
            while bears(factor):
                factor *= math.exp(0.01)
            low, high = factor * math.exp(-0.01), factor
            while high / low > 1.001:
                middle = math.sqrt(low * high)
                low, high = (middle, high) if bears(middle) else (low, middle)
            least[capacity.name].append(high * size_of(PGA, given))
    plan = Plan(
        own=next(iter(cases.values())),
        cases=cases,
        recorded=True,
        measure=PGA,
        capacities=capacities,
    )
    done = {task: task.play() for task in plan.factors.values()}
    for answer in damage.damage_answers(Gathered(plan, done)):
        logarithms = np.log(least[answer.capacity.name])
        fit = answer.intensity.fit
        assert fit.median == pytest.approx(math.exp(np.mean(logarithms)), rel=0.01)
        assert fit.dispersion == pytest.approx(np.std(logarithms), rel=0.02, abs=2e-3)


def oscillation(ground, period, damping):
    """The absolute acceleration of an oscillator, and its time step: Newmark's linear acceleration,
    in steps so small that it has no error that counts; until it is quiet."""
    step, rate = ground.time_step / 200, 2.0 * math.pi / period
    times = step * np.arange(round(20.0 / step))
    pushed = -ground.acceleration(times)
    place = speed = 0.0
    whole = 1.0 + damping * rate * step + rate**2 * step**2 / 6.0
    gained = pushed[0]
    felt = [0.0]
    for now in pushed[1:]:
        speed_ahead = speed + 0.5 * step * gained
        place_ahead = place + step * speed + step**2 / 3.0 * gained
        new = (now - 2.0 * damping * rate * speed_ahead - rate**2 * place_ahead) / whole
        speed, place = speed_ahead + 0.5 * step * new, place_ahead + step**2 / 6.0 * new
        gained = new
        felt.append(-2.0 * damping * rate * speed - rate**2 * place)
    every = 10
    return np.array(felt[::every]), every * step
