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
    Ricker,
    Scene,
    Wall,
)
from rockcheck.ebm.batch import pack, run_batch
from rockcheck.engines import MuJoCo
from rockcheck.scenes.experience import Experience, Range, axes_of, expected, outside
from rockcheck.scenes.files import load_scene, load_uncertain_scene
from rockcheck.validation.suite.across import trust_in
from rockcheck.validation.suite.comparing import explanations
from rockcheck.validation.suite.results import Cell
from rockcheck.validation.suite.runner import run_suite
from rockcheck.validation.suite.suites import load_suite
from rockcheck.validation.suite.tables import junit, markdown
from rockcheck.validation.uncertainty import numerical
from rockcheck.validation.uncertainty.numerical import Numerical, Quantity
from rockcheck.validation.uncertainty.population import Inputs, Interval, propagate, sensitivities

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
def uncertain(tmp_path):
    path = tmp_path / "shelf.toml"
    path.write_text(UNCERTAIN, encoding="utf-8")
    return path


def test_a_scene_file_says_what_is_not_known(uncertain):
    uncertain.write_text(
        UNCERTAIN + '[correlation]\n"floor.friction, excitation.amplitude" = 0.8\n',
        encoding="utf-8",
    )
    given = load_uncertain_scene(uncertain)
    assert load_scene(uncertain) == given.scene
    assert given.names == ("floor.friction", "walls.left.gap", "excitation.amplitude")
    assert given.scene.wall("left").gap == pytest.approx(0.055)
    values = given.values(np.random.default_rng(1).random((20000, 3)))
    np.testing.assert_allclose(values.mean(axis=0), [0.5, 0.055, 6.0], rtol=2e-3)
    np.testing.assert_allclose(values.std(axis=0), [0.05, 0.01 / math.sqrt(12.0), 0.2], rtol=2e-2)
    assert given.at(values[0]).floor.friction == values[0, 0]
    assert np.corrcoef(values.T)[0, 2] == pytest.approx(0.8, abs=0.02)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("sd = 0.05", "sd = -0.05", "floor.friction.sd: -0.05 is not allowed"),
        (
            "value = 0.5, sd",
            "valu = 0.5, sd",
            "floor.friction.valu: unknown key; did you mean 'value'?",
        ),
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
    ],
)
def test_faults_of_the_file_are_one_line(uncertain, old, new, said):
    uncertain.write_text(UNCERTAIN.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as fault:
        load_uncertain_scene(uncertain)
    assert said in str(fault.value)
    assert "\n" not in str(fault.value)


@pytest.mark.long
def test_draws_agree_with_many_more_draws(uncertain):
    given = load_uncertain_scene(uncertain)
    few, many = (
        propagate(given, samples=n, seed=seed, indices=False) for n, seed in ((256, 1), (2048, 7))
    )
    (a, b), (c, d) = ((f.low, f.high) for f in (few.inputs.figures[0], many.inputs.figures[0]))
    assert abs(a - c) < 0.05
    assert abs(b - d) < 0.05
    assert few.bands.shape == (5, len(few.t))
    assert np.all(np.diff(few.bands, axis=0) >= 0.0)
    assert few.inputs.u_input("peak_rotation") > 0.0
    assert propagate(given, samples=256, seed=1, indices=False).inputs == few.inputs


def test_a_scene_without_uncertain_numbers_is_refused():
    with pytest.raises(InputError, match="no number of this scene is uncertain"):
        propagate(load_uncertain_scene("fig4a"))


def test_sobol_indices_of_a_free_slide(tmp_path):
    """A block that slides to rest: the peak rotation does not vary, and no index is made up."""
    path = tmp_path / "slide.toml"
    block = "duration = 1.0\ninitial_velocity = 0.1\n[block]\nhalf_width = 1.0\nhalf_height = 0.5\n"
    path.write_text(block + "[floor]\nfriction = { value = 0.3, sd = 0.01 }\n", encoding="utf-8")
    assert sensitivities(load_uncertain_scene(path), EventBasedModel(), samples=16) == ()


@pytest.mark.slow
def test_sobol_indices_agree_with_brute_force(tmp_path):
    """The bookcase with five uncertain numbers: 100,000 draws, means within bins and numbers drawn
    again one at a time."""
    path, model, draws, again = (
        tmp_path / "bookcase.toml",
        EventBasedModel(pivot="unilateral", tolerance=1e-8),
        100_000,
        20_000,
    )
    path.write_text(FIVE, encoding="utf-8")
    given = load_uncertain_scene(path)
    chance = np.random.default_rng(5)

    def peaks(points):
        scenes = [given.at(row) for row in given.values(points)]
        return np.minimum(
            run_batch(pack(scenes, model), model, until_decided=False).peak / BOOKCASE.block.alpha,
            1.0,
        )

    points = chance.random((draws, len(given.names)))
    found = peaks(points)
    indices = {row.name: row for row in sensitivities(given, model)}
    assert set(indices) == set(given.names)
    for k, name in enumerate(given.names):
        inside = [found[(points[:, k] * 50).astype(int) == n] for n in range(50)]
        first = np.var([np.mean(one) for one in inside]) - np.mean(
            [np.var(one, ddof=1) / len(one) for one in inside]
        )
        other = points[:again].copy()
        other[:, k] = chance.random(again)
        total = 0.5 * np.mean((found[:again] - peaks(other)) ** 2)
        assert indices[name].first == pytest.approx(first / np.var(found), abs=0.06)
        assert indices[name].total == pytest.approx(total / np.var(found), abs=0.06)


def test_the_interval_of_the_share_that_falls_covers(uncertain):
    """Of few draws it holds what many say, and so does the interval of the draws' own peaks, as
    often as they should."""
    given = load_uncertain_scene(uncertain)
    many = propagate(given, samples=8192, seed=99, indices=False)
    (peak, *_), share = many.inputs.figures, many.inputs.overturns.value
    falls, peaks = 0, []
    for seed in range(60):
        few = propagate(given, samples=32, seed=seed, indices=False)
        falls += few.inputs.overturns.low <= share <= few.inputs.overturns.high
        peaks.append(np.mean((peak.low <= few.peaks) & (few.peaks <= peak.high)))
    assert falls / 60 >= 0.9
    assert (
        many.inputs.figures[0].high == 1.0
    )  # some fall, and count as 1: then only the lower end leaves draws out
    assert np.mean(peaks) == pytest.approx(0.975, abs=0.01)


# --- verdicts


@pytest.mark.parametrize(
    ("error", "u_num", "u_input", "u_data", "said"),
    [
        (0.01, 0.02, 0.0, 0.0, numerical.NUMERICAL),
        (0.03, 0.02, 0.04, 0.0, numerical.INPUTS),
        (0.03, 0.02, 0.01, 0.04, numerical.DATA),
        (0.10, 0.03, 0.04, 0.0, "not explained: model form or set-up, at least 0.05 alpha"),
        (0.10, None, 0.04, 0.0, numerical.NOT_CONVERGED),
        (None, 0.02, 0.04, 0.0, numerical.NOT_CONVERGED),
        (0.02, 0.02, 0.0, 0.0, numerical.NUMERICAL),  # at the limit it is within it
        (0.04, 0.0, 0.04, 0.0, numerical.INPUTS),
        (0.03, 0.02, 0.03, 0.03, numerical.INPUTS),
    ],
)
def test_what_a_difference_says(error, u_num, u_input, u_data, said):
    found = numerical.explain("theta_rms", "alpha", error, u_num, u_input, u_data)
    assert found.verdict == said


def test_what_a_difference_says_where_nothing_is_known_of_inputs_and_tests():
    found = numerical.explain("theta_rms", "alpha", 0.1, 0.04)
    assert (found.u_input, found.u_data, found.u_val) == (0.0, 0.0, 0.04)
    assert found.verdict.startswith("not explained")


def test_bias_and_scatter_are_recovered_and_cover():
    chance = np.random.default_rng(2)
    truth = chance.uniform(0.1, 0.9, 4000)
    model = 1.1 * truth * np.exp(0.05 * chance.standard_normal(4000) - 0.5 * 0.05**2)
    trust = trust_in(list(zip(truth[:2000], model[:2000], strict=True)))
    assert trust.bias == pytest.approx(1.1, rel=5e-3)
    assert trust.scatter == pytest.approx(0.05, rel=0.05)
    found = [expected(trust, m) for m in model[2000:]]
    inside = [one.low <= e <= one.high for e, one in zip(truth[2000:], found, strict=True)]
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
    history = model.simulate(BOOKCASE.replace(duration=0.1))
    with nullcontext() if claims else pytest.raises(InputError, match="with its settings"):
        history.expected()


def test_the_domain_names_the_axis_that_leaves_it():
    inside = {axis: Range(low=min(v), high=max(v)) for axis, v in axes_of(BOOKCASE).items()}
    assert outside(BOOKCASE, inside) == []
    assert outside(BOOKCASE.replace(floor=Floor(friction=0.9)), inside) == [
        "friction is 0.9; the suites cover 0.3 to 0.3"
    ]
    assert Experience(domain=inside).domain["alpha"].low == BOOKCASE.block.alpha


# --- the command


def test_the_command_says_converged_and_not(uncertain, tmp_path, told):
    out = ["--out", str(tmp_path / "out"), "--json"]
    found = told("assess", str(uncertain), "--samples", "16", *out)
    assert found["converged"] is True
    assert {"name", "value", "u_num", "order", "verdict"} <= found["quantities"][0].keys()
    assert found["inputs"]["samples"] == 16
    found = told(
        "assess",
        str(uncertain),
        "--models",
        "mujoco",
        "--set",
        "time_step=4e-3",
        "--samples",
        "2",
        *out,
        code=1,
    )
    assert found["converged"] is False
    assert any(q["reason"] for q in found["quantities"])


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


def test_a_suite_explains_its_differences(uncertain, tmp_path):
    (tmp_path / "suite.toml").write_text(SUITE, encoding="utf-8")
    run = run_suite(load_suite(tmp_path / "suite.toml"), tmp_path / "out", jobs=1)
    cells = {cell.model: cell for cell in run.cells}
    assert cells["cm"].converged
    assert cells["coarse"].converged is False
    said = {e.quantity: e for e in cells["cm"].explanations if e.against == "ebm-unilateral"}
    assert said["theta_rms"].verdict == numerical.NUMERICAL
    assert said["theta_rms"].u_input > 0.0
    assert all(e.verdict == numerical.NOT_CONVERGED for e in cells["coarse"].explanations)
    assert run.inputs["shelf"].names == ("floor.friction", "walls.left.gap", "excitation.amplitude")
    assert "not converged" in markdown(run)
    assert "<skipped" in junit(run)
    again = run_suite(load_suite(tmp_path / "suite.toml"), tmp_path / "out", jobs=1)
    assert again.up_to_date == 4
    assert [cell.explanations for cell in again.cells] == [cell.explanations for cell in run.cells]


def test_two_outcomes_are_explained_by_inputs_that_decide_them():
    converged = Numerical(
        method="", quantities=(Quantity(name="outcome", unit="", value="", verdict="converged"),)
    )
    own, other = (
        Cell(scene="s", model="ebm", status="done", outcome=outcome, numerical=converged)
        for outcome in ("at rest", "overturned left")
    )
    (found,) = explanations(BOOKCASE, own, [other], {}, None)
    assert found.verdict.startswith("not explained")
    shares = Interval(name="overturns", unit="1", value=0.3, low=0.2, high=0.4)
    inputs = Inputs(
        samples=64,
        model="ebm-unilateral",
        names=("floor.friction",),
        figures=(),
        overturns=shares,
        sensitivities=(),
    )
    (found,) = explanations(BOOKCASE, own, [other], {}, inputs)
    assert found.verdict == numerical.INPUTS


def test_a_motion_that_depends_on_the_law_of_impacts_is_not_sure(tmp_path, told):
    """It lands flat while it slides: no step tells which corner is first."""
    scene = Path(__file__).parents[2] / "data" / "modelling_choices" / "flat-landing.toml"
    found = told("assess", str(scene), "--out", str(tmp_path), code=1)
    assert not found["converged"]
    assert 0.0 < found["depends_on_law_from_s"] < 3.0
