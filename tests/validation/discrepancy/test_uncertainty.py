"""How sure a figure is: draws of inputs, repeats, verdicts."""

import math
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from rockcheck import (
    Block,
    ContinuousModel,
    EventBasedModel,
    Floor,
    InputError,
    MuJoCo,
    Ricker,
    Scene,
    Wall,
    load_scene,
)
from rockcheck.ebm.batch import pack, run_batch
from rockcheck.scenes import experience, files
from rockcheck.validation.discrepancy import figures
from rockcheck.validation.suite import explain, job_page, model_bias, results, suites
from rockcheck.validation.suite.runner import run_suite
from rockcheck.validation.uncertainty import input_spread, numerical

BOOKCASE = Scene(
    name="bookcase",
    block=Block(half_width=0.397, half_height=1.555),
    floor=Floor(friction=0.3),
    walls=[Wall(side="left", gap=0.053, restitution=0.0)],
    excitation=Ricker(amplitude=3.5, period=1.5),
    duration=6.0,
)
UNCERTAIN = """
duration = 4.0
[block]
half_width = 0.397
half_height = 1.555
[floor]
friction = { value = 0.5, sd = 0.05 }
[[walls]]
side = "left"
gap = { low = 0.05, high = 0.06 }
[excitation]
kind = "ricker"
amplitude = { value = 6.0, sd = 0.2, distribution = "lognormal" }
period = 1.0
"""
FIVE = """
duration = 6.0
[block]
half_width = 0.397
half_height = 1.555
[floor]
friction = { value = 0.4, sd = 0.04 }
[[walls]]
side = "left"
gap = { value = 0.053, sd = 0.01 }
restitution = { low = 0.2, high = 0.6 }
[excitation]
kind = "ricker"
amplitude = { value = 5.0, sd = 0.4, distribution = "lognormal" }
period = { value = 1.2, sd = 0.1 }
"""


# --- what is not known about the inputs


@pytest.fixture
def uncertain(written):
    return written("shelf.toml", UNCERTAIN)


def test_a_scene_file_says_what_is_not_known(uncertain):
    given = files.load_uncertain_scene(uncertain)
    assert load_scene(uncertain) == given.scene
    assert given.names == ("floor.friction", "walls.left.gap", "excitation.amplitude")
    values = given.values(np.random.default_rng(1).random((20000, 3)))
    np.testing.assert_allclose(values.mean(axis=0), [0.5, 0.055, 6.0], rtol=2e-3)
    np.testing.assert_allclose(values.std(axis=0), [0.05, 0.01 / math.sqrt(12.0), 0.2], rtol=2e-2)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("sd = 0.05", "sd = -0.05", "floor.friction.sd: -0.05 is not allowed"),
        (
            "value = 0.5, sd",
            "valu = 0.5, sd",
            "floor.friction.valu: unknown key; did you mean 'value'?",
        ),
        ("sd = 0.05", "std = 0.05", "floor.friction.std: unknown key; did you mean 'sd'?"),
        ("value = 0.5, sd", "sd", "floor.friction.value: is missing beside sd"),
        (
            "low = 0.05, high",
            "low = 0.07, high",
            "walls.left.gap.high: 0.06 is not allowed: must be more than low, 0.07",
        ),
        ('"lognormal"', '"gamma"', "excitation.amplitude.distribution"),
        ("value = 6.0", "value = -6.0", "a lognormal number is positive"),
        (
            "period = 1.0",
            'period = 1.0\n[correlation]\n"floor.frction, walls.left.gap" = 0.1',
            "did you mean 'floor.friction'?",
        ),
        (
            "period = 1.0",
            'period = 1.0\n[correlation]\n"floor.friction, walls.left.gap" = 1.5',
            "give a number between -1 and 1",
        ),
        (
            "period = 1.0",
            'period = 1.0\n[correlation]\n"floor.friction, walls.left.gap" = "strong"',
            "'strong' is not allowed: give a number",
        ),
    ],
)
def test_faults_of_the_file_are_one_line(written, fault_of, old, new, said):
    assert said in str(
        fault_of(files.load_uncertain_scene, written("shelf.toml", UNCERTAIN.replace(old, new)))
    )


def peaks_of(given, points):
    """Peaks (alpha, at most 1) at points of the unit cube."""
    model = EventBasedModel(pivot="unilateral", tolerance=1e-8)
    scenes = [given.at(row) for row in given.values(points)]
    peak = run_batch(pack(scenes, model), model, until_decided=False).runs["peak"]
    return np.minimum(peak / given.scene.block.alpha, 1.0)


@pytest.mark.slow
def test_sobol_indices_agree_with_brute_force(written):
    given = files.load_uncertain_scene(written("bookcase.toml", FIVE))
    model = EventBasedModel(pivot="unilateral", tolerance=1e-8)
    chance = np.random.default_rng(5)

    points = chance.random((100_000, len(given.names)))
    found = peaks_of(given, points)
    shares = {row.name: (row.first, row.total) for row in input_spread.sensitivities(given, model)}
    for k, name in enumerate(given.names):
        inside = [found[(points[:, k] * 50).astype(int) == n] for n in range(50)]
        noise = np.mean([np.var(one, ddof=1) / len(one) for one in inside])
        first = np.var([np.mean(one) for one in inside]) - noise
        other = points[:20_000].copy()
        other[:, k] = chance.random(20_000)
        total = 0.5 * np.mean((found[:20_000] - peaks_of(given, other)) ** 2)
        assert shares[name] == pytest.approx(np.divide((first, total), np.var(found)), abs=0.06)


@pytest.mark.slow
def test_the_interval_of_the_share_that_falls_covers(uncertain):
    """Of few draws it holds what many say, and so does the interval of the draws' own peaks, as
    often as they should: some fall, and count as 1, so that only its lower end leaves draws out."""
    given = files.load_uncertain_scene(uncertain)
    many = input_spread.propagate(given, samples=8192, seed=99, indices=False)
    peak = many.figures[0]
    few = [
        input_spread.propagate(given, samples=32, seed=seed, indices=False) for seed in range(60)
    ]
    shares = [one.overturns for one in few]
    assert np.mean([one.low <= many.overturns.value <= one.high for one in shares]) >= 0.9
    assert peak.high == 1.0
    peaks = peaks_of(given, np.random.default_rng(5).random((2000, len(given.names))))
    assert np.mean((peak.low <= peaks) & (peaks <= peak.high)) == pytest.approx(0.975, abs=0.01)


# --- verdicts


@pytest.mark.parametrize(
    ("error", "u_num", "known", "said"),
    [
        (0.01, 0.02, (0.0, 0.0), numerical.NUMERICAL),
        (0.03, 0.02, (0.04, 0.0), numerical.INPUTS),
        (0.03, 0.02, (0.01, 0.04), numerical.DATA),
        (0.10, 0.03, (0.04, 0.0), "not explained: model form or set-up, at least 0.05 alpha"),
        (0.10, 0.03, (0.04, 0.06), "not explained: model form or set-up, at least 0.022 alpha"),
        # Nothing is known of inputs and tests.
        (0.10, 0.04, (), "not explained: model form or set-up, at least 0.06 alpha"),
        (0.10, None, (0.04, 0.0), numerical.NOT_CONVERGED),
        (None, 0.02, (0.04, 0.0), numerical.NOT_CONVERGED),
        (0.02, 0.02, (0.0, 0.0), numerical.NUMERICAL),  # at the limit it is within it
        (0.04, 0.0, (0.04, 0.0), numerical.INPUTS),
        (0.03, 0.02, (0.03, 0.03), numerical.INPUTS),
        (0.10, 0.0, (0.04, 0.0), "not explained: model form or set-up, at least 0.06 alpha"),
    ],
)
def test_what_a_difference_says(error, u_num, known, said):
    assert numerical.explain("theta_rms", "alpha", error, u_num, *known).verdict == said


def test_bias_and_scatter_are_recovered_and_cover():
    chance = np.random.default_rng(2)
    truth = chance.uniform(0.1, 0.9, 4000)
    model = 1.1 * truth * np.exp(0.05 * chance.standard_normal(4000) - 0.5 * 0.05**2)
    trust = model_bias.trust_in(list(zip(truth[:2000], model[:2000], strict=True)))
    assert trust.bias == pytest.approx(1.1, rel=5e-3)
    assert trust.scatter == pytest.approx(0.05, rel=0.05)
    ranges = [experience.expected(trust, value) for value in model[2000:]]
    inside = [one.low <= e <= one.high for e, one in zip(truth[2000:], ranges, strict=True)]
    assert 0.93 <= np.mean(inside) <= 0.97


@pytest.mark.parametrize(
    ("model", "claims"),
    [
        (MuJoCo(), True),
        (MuJoCo(time_step=2e-4), True),
        (ContinuousModel(), True),
        (EventBasedModel(estimate_error=True), True),
        (MuJoCo(settings="default"), False),
        (MuJoCo(time_step=2e-3), False),
        (MuJoCo(cone_correction=False), False),
        (ContinuousModel(damping_rule="paper"), False),
        (EventBasedModel(impacts="floor-first"), False),
    ],
)
def test_nothing_is_claimed_for_settings_that_the_suites_do_not_have(model, claims):
    expected = model.simulate(BOOKCASE.replace(duration=0.1)).expected
    with nullcontext() if claims else pytest.raises(InputError, match="with its settings"):
        expected()


def test_the_domain_names_the_axis_that_leaves_it():
    inside = {
        axis: experience.Range(low=min(v), high=max(v))
        for axis, v in experience.axes_of(BOOKCASE).items()
    }
    slippery = BOOKCASE.replace(floor=Floor(friction=0.9), output_step=0.09)
    said = ["friction is 0.9; the suites cover 0.3 to 0.3"]
    assert [experience.outside(one, inside) for one in (BOOKCASE, slippery)] == [[], said]


# --- in a suite


SUITE = """
reference = "ebm-unilateral"
model_form = "ebm"
uncertainty = true
scenes = ["shelf.toml"]
[models.ebm-unilateral]
[models.ebm]
[models.cm]
[models.coarse]
model = "mujoco"
time_step = 4e-3
"""


def test_a_suite_explains_its_differences(uncertain, written, tmp_path):
    suite = written("suite.toml", SUITE)
    run, again = (run_suite(suites.load_suite(suite), tmp_path / "out", jobs=1) for _ in range(2))
    cells = {cell.model: cell for cell in run.cells}
    assert cells["cm"].converged is True
    assert cells["coarse"].converged is False
    said = {e.quantity: e for e in cells["cm"].explanations if e.against == "ebm-unilateral"}
    assert said["theta_rms"].verdict == numerical.NUMERICAL
    assert said["theta_rms"].u_input > 0.0
    assert {e.verdict for e in cells["coarse"].explanations} == {numerical.NOT_CONVERGED}
    assert run.inputs["shelf"].names == ("floor.friction", "walls.left.gap", "excitation.amplitude")
    assert "not converged" in job_page.markdown(run)
    read_back = [cell.explanations for cell in again.cells]
    assert again.up_to_date == 4
    assert read_back == [cell.explanations for cell in run.cells]


FALL_IN_PART = input_spread.Inputs(
    samples=64,
    model="ebm-unilateral",
    names=("floor.friction",),
    figures=(),
    overturns=input_spread.Interval(name="overturns", unit="1", value=0.3, low=0.2, high=0.4),
    sensitivities=(),
)


@pytest.mark.parametrize(
    ("inputs", "ends", "verdicts"),
    [
        (
            None,
            [("at rest", 6.0), ("overturned left", 3.0)],
            ["not explained: model form or set-up, another outcome"],
        ),
        (FALL_IN_PART, [("at rest", 6.0), ("overturned left", 3.0)], [numerical.INPUTS]),
        # two that fall alike have no peaks whose difference could be explained
        (None, [("overturned left", 3.0)] * 2, []),
        # nor have two of which one ends early, as a measured one may
        (None, [("at rest", 6.0), ("at rest", 5.0)], []),
        (None, [("at rest", 6.0)] * 2, [numerical.NOT_CONVERGED]),
    ],
)
def test_two_outcomes_are_explained_by_inputs_that_decide_them(inputs, ends, verdicts):
    outcome = numerical.Quantity(name="outcome", unit="", value="", verdict="converged")
    own, other = (
        results.Cell(
            scene="s",
            model="ebm",
            status="done",
            outcome=end,
            numerical=numerical.Numerical(method="", quantities=(outcome,)),
            figures=tuple(
                figures.Figure(measure=name, label="", unit="", value=value)
                for name, value in (("peak_rotation", 8.0), ("end_time", t))
            ),
        )
        for end, t in ends
    )
    assert [
        one.verdict for one in explain.explanations(BOOKCASE, own, [other], {"ebm": {}}, inputs)
    ] == verdicts


def test_a_motion_that_depends_on_the_law_of_impacts_is_not_sure(tmp_path, told):
    """It lands flat while it slides: no step tells which corner is first."""
    scene = Path(__file__).parents[2] / "data" / "modelling_choices" / "flat-landing.toml"
    found = told("assess", str(scene), "--out", str(tmp_path), code=1)
    assert not found["converged"]
    assert 0.0 < found["depends_on_law_from_s"] < 3.0
