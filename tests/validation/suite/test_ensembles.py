"""Ensembles: drawing is repeatable, statistics are right on samples that are known, and a run holds
them against tolerances."""

import math
import re

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from rockcheck.reports.ensemble_page import EnsembleView
from rockcheck.validation.discrepancy import ensemble, measures
from rockcheck.validation.discrepancy.compare import evaluate
from rockcheck.validation.suite import accepting, suites
from rockcheck.validation.suite.runner import run_suite

OWN = [
    f"faulty:{name}" for name in ("Still", "Segfault", "Hang", "Hog", "Fails", "Bug", "NotFinite")
]

SUITE = """
reference = "still"
[models.still]
model = "faulty:Still"
[models.near]
model = "faulty:Still"
offset = 1e-3
[models.broken]
model = "faulty:Fails"
[require]
ensemble = ["ks_distance", "overturning_accuracy"]
[[ensemble]]
name = "crowd"
count = 10
batch = 4
seed = 7
friction = { uniform = [0.3, 0.8] }
gap = { lognormal = [0.05, 0.3] }
noise = { amplitude = { uniform = [4.0, 5.0] }, frequency = 2.5, damping = 0.6, strong = 0.5 }
[ensemble.scene]
duration = 0.5
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
walls = [{ side = "left", gap = 0.05 }]
[tolerances.crowd.near.still]
ks_distance = { expected = 1.0, limit = 1.0, drift = 0.0, why = "a test" }
overturning_accuracy = { expected = 1.0, limit = 0.0, drift = 0.0, why = "none falls" }
"""


@pytest.fixture
def loaded(written, faulty):
    return lambda text=SUITE: suites.load_suite(written("mine.toml", text), allow_code=OWN)


def test_scenes_are_drawn_alike_whatever_the_count(loaded):
    ensemble, base = loaded().ensembles["crowd"]
    first = [ensemble.drawn(base, n) for n in range(10)]
    fewer, reseeded = (ensemble.model_copy(update=one) for one in ({"count": 5}, {"seed": 8}))
    assert first[:5] == [fewer.drawn(base, n) for n in range(5)]
    assert reseeded.drawn(base, 0) != first[0]
    frictions = {scene.floor.friction for scene in first}
    assert len(frictions) == 10
    assert 0.3 <= min(frictions) <= max(frictions) <= 0.8
    assert min(scene.walls[0].gap for scene in first) > 0.0
    peaks = [np.max(np.abs(scene.excitation.samples)) for scene in first]
    assert 4.0 <= min(peaks) <= max(peaks) <= 5.0


def test_the_order_of_blocks_that_hardly_rock_is_no_distance():
    still, noise = (ensemble.Sample(np.full(10, size), ["at rest"] * 10) for size in (1e-12, 1e-9))
    assert measures.STATISTICS["ks_distance"].evaluate(ensemble.Samples(still, noise)) == (
        0.0,
        "p = 1",
    )


def test_noise_has_the_spectrum_that_it_states(loaded):
    noise = loaded().ensembles["crowd"][0].noise.model_copy(update={"strong": 40.0})
    power = sum(
        np.abs(np.fft.rfft(noise.draw(np.random.default_rng(n)).samples)) ** 2 for n in range(40)
    )
    frequency = np.fft.rfftfreq(20000, 0.002)
    band = [
        float(np.mean(power[(frequency > f - 0.3) & (frequency < f + 0.3)])) for f in (2.5, 10.0)
    ]
    ratio = (10.0 / 2.5) ** 2
    stated = ((1 + 4 * 0.36 * ratio) / ((1 - ratio) ** 2 + 4 * 0.36 * ratio)) / (
        (1 + 4 * 0.36) / (4 * 0.36)
    )
    assert band[1] / band[0] == pytest.approx(stated, rel=0.25)


def test_statistics_of_a_sample_against_itself():
    peaks = np.exp(0.3 * np.random.default_rng(3).standard_normal(4000) - 1.5)
    sample = ensemble.Sample(peaks, tuple(np.where(peaks > 0.4, "overturned left", "at rest")))
    same = ensemble.Samples(sample, sample)
    assert {name: measure.evaluate(same)[0] for name, measure in measures.STATISTICS.items()} == {
        "ks_distance": 0.0,
        "area_metric": 0.0,
        "overturning_accuracy": 1.0,
        "overturning_precision": 1.0,
        "overturning_recall": 1.0,
        "peak_bias": 0.0,
        "peak_scatter": 0.0,
    }


def test_statistics_of_known_outcomes():
    reference = ensemble.Sample(
        np.ones(4), ("overturned left", "at rest", "moving", "overturned right")
    )
    other = ensemble.Sample(np.ones(4), ("overturned left", "overturned left", "moving", "moving"))
    names = ("overturning_accuracy", "overturning_precision", "overturning_recall", "ks_distance")
    found = [
        measures.STATISTICS[name].evaluate(ensemble.Samples(reference, other))[0] for name in names
    ]
    assert found == [0.5, 0.5, 0.5, 0.0]
    lost = ensemble.Sample(
        np.array([1.0, math.nan, math.inf, 1.0]), ("moving", "", *reference.outcomes[:2])
    )
    assert lost.failures == 2
    assert list(lost.fallen) == [False, False, True, False]
    unknown = evaluate(
        measures.STATISTICS["ks_distance"], ensemble.Samples(reference, lost), "alpha"
    )
    assert unknown.value is None
    assert unknown.note == "a model failed in some of the scenes"


def test_an_ensemble_is_judged_and_read_back(loaded, tmp_path):
    run = run_suite(loaded(), tmp_path / "out", jobs=0)
    assert [
        (cell.status, cell.reason, cell.outcome, [check.verdict for check in cell.checks])
        for cell in run.cells[1:]
    ] == [
        ("done", "", "0 of 10 overturned", ["pass", "pass"]),
        ("failed", "10 of 10 scenes failed; the first: more than 10 events", "", []),
    ]
    assert run.exit_code == 3
    assert run.ensembles[0].peaks["near"] == pytest.approx([1e-3 / math.atan2(0.4, 1.5)] * 10)
    assert run_suite(loaded(), str(tmp_path / "out"), jobs=0).cells == tuple(
        cell.model_copy(update={"read_back": True}) for cell in run.cells
    )
    run.save(tmp_path / "out")
    assert type(run).load(tmp_path / "out") == run


def test_a_model_without_results_is_no_yardstick_and_is_not_drawn(loaded, tmp_path):
    text = SUITE.partition("[tolerances")[0].replace('"still"', '"broken"', 1)
    run = run_suite(loaded(text), tmp_path / "out", jobs=0)
    assert [check.figure.value for check in run.by_scene["crowd"]["near"].checks] == [None, None]
    assert run.without_tolerance == 0
    assert list(EnsembleView(run, "crowd", "crowd", *run.ensembles).curves) == ["still", "near"]


def test_a_measured_history_takes_no_part_in_an_ensemble(loaded, written):
    written("run1.csv", "t,theta\n0,0\n1,0\n")
    table = '[models.table]\nmodel = "measured"\nfiles = { fig5a = "run1.csv" }\n[require]'
    cells = loaded('scenes = ["fig5a"]' + SUITE.replace("[require]", table)).cells()
    assert [work.label for _, work, ensemble in cells if ensemble] == ["still", "near", "broken"]


def test_accept_writes_what_an_ensemble_is_judged_by(loaded, tmp_path):
    suite = loaded(SUITE.partition("[tolerances")[0])
    first = run_suite(suite, tmp_path / "out", jobs=0)
    assert first.by_scene["crowd"]["near"].verdict == "fail"
    changes, refused = accepting.accept(suite, first, None)
    assert [change.partition(":")[0] for change in changes] == [
        "[crowd.near.still] ks_distance",
        "[crowd.near.still] overturning_accuracy",
    ]
    assert refused == []
    accepted = suites.load_suite(tmp_path / "mine.toml", allow_code=OWN)
    assert run_suite(accepted, tmp_path / "out", jobs=0).by_scene["crowd"]["near"].verdict == "pass"


def samples(
    reference: list[float], candidate: list[float], fallen: tuple[int, ...] = ()
) -> ensemble.Samples:
    """Peaks of both; in the scenes `fallen` the candidate falls."""
    ends = tuple("overturned left" if n in fallen else "at rest" for n in range(len(candidate)))
    safe = ensemble.Sample(np.array(reference), ("at rest",) * len(reference))
    return ensemble.Samples(safe, ensemble.Sample(np.array(candidate), ends))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[0.3, 0.8]", "[0.8, 0.3]", "friction.uniform: the lower end comes first"),
        # One kind of distribution, and a positive one.
        ("{ uniform = [0.3, 0.8] }", "{}", "friction"),
        ("uniform = [0.3", "lognormal = [1.0, 1.0], uniform = [0.3", "friction"),
        ("lognormal = [0.05", "lognormal = [-1.0", "gap"),
        ("[0.3, 0.8]", "[-0.3, 0.8]", "friction.uniform: the lower end must be 0 or more"),
        ("lognormal = [0.05", "uniform = [-0.05", "gap.uniform: the lower end must be 0 or more"),
        (
            "noise = { amplitude = { uniform = [4.0, 5.0] }, frequency = 2.5, damping = 0.6,"
            " strong = 0.5 }",
            "pulse = { period = { uniform = [0, 1] }, amplitude = { uniform = [4, 5] } }",
            "period.uniform: the lower end must be more than 0",
        ),
        (
            "[tolerances.crowd.near.still]",
            '[[ensemble]]\nname = "crowd"\nscene = { block = { half_width = 0.4,'
            " half_height = 1.5 }, floor = { friction = 0.5 }, duration = 1 }\n"
            "[tolerances.crowd.near.still]",
            "ensemble.name: 'crowd' is named twice",
        ),
    ],
)
def test_what_no_scene_can_have_is_refused_at_once(loaded, fault_of, old, new, said):
    assert said in str(fault_of(loaded, SUITE.replace(old, new)))


@pytest.mark.parametrize(
    ("reference", "apart"), [([0.1, 0.2, 0.3, 0.4], 0.5), ([1e-4, 2e-4, 3e-4, 0.4], 0.75)]
)
def test_the_fallen_are_beyond_all_others(reference, apart):
    """Two of four rock less than any of the reference and two fall: the distributions part by a
    half; as peaks of 0 by the whole. Peaks of rounding are 0."""
    value, remark = measures.STATISTICS["ks_distance"].evaluate(
        samples(reference, [0.05, 0.06, 0.1, 0.2], fallen=(2, 3))
    )
    assert value == pytest.approx(apart)
    assert remark.startswith("p = ")


def test_bias_and_scatter_by_student_and_chi_squared():
    """Four ratios: mean and its interval as scipy's t-test has it; the scatter is that of a sample,
    not of a population."""
    reference, candidate = [0.1, 0.2, 0.3, 0.4], [0.11, 0.19, 0.36, 0.41]
    ratios = np.log(np.array(candidate) / reference)
    bias = np.mean(ratios)
    interval = ttest_1samp(ratios, 0.0).confidence_interval(0.95)
    assert measures.STATISTICS["peak_bias"].evaluate(samples(reference, candidate)) == (
        pytest.approx(bias),
        f"[{interval.low:.2g}, {interval.high:.2g}], 4 scenes",
    )
    scatter = np.sqrt(np.sum((ratios - bias) ** 2) / 3.0)
    # chi-squared with 3 degrees of freedom has its 2.5 % and 97.5 % points at 0.2158 and 9.3484
    assert measures.STATISTICS["peak_scatter"].evaluate(samples(reference, candidate)) == (
        pytest.approx(scatter),
        f"[{scatter * np.sqrt(3.0 / 9.3484):.2g}, {scatter * np.sqrt(3.0 / 0.2158):.2g}]",
    )


def test_only_scenes_in_which_both_rock_have_a_ratio():
    assert samples(
        [0.1, 0.2, 1e-3, 0.4, 0.3], [0.2, 0.4, 0.4, 1e-3, 0.6], fallen=(4,)
    ).log_ratios() == pytest.approx(np.log([2.0, 2.0]))


@pytest.mark.parametrize("name", ["peak_bias", "peak_scatter"])
def test_of_fewer_than_two_ratios_there_is_no_bias_and_no_scatter(name):
    found = evaluate(measures.STATISTICS[name], samples([0.1, 0.2], [0.1, 1e-4]), "alpha")
    assert found.value is None
    assert found.note == "fewer than two scenes in which both rock and neither falls"


def test_shares_have_wilsons_interval():
    """Three of four: Wilson (1927) by his formula; where none falls, precision and recall are 1."""
    one_falls = samples([0.1] * 4, [0.1] * 4, fallen=(0,))
    z, p, n = 1.959963984540054, 0.75, 4
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    assert {
        name: measures.STATISTICS[f"overturning_{name}"].evaluate(one_falls)
        for name in ("accuracy", "recall")
    } == {
        "accuracy": (0.75, f"[{middle - half:.3f}, {middle + half:.3f}], 3 of 4"),
        "recall": (1.0, "none fall"),
    }
    assert measures.STATISTICS["overturning_precision"].evaluate(one_falls)[0] == 0.0


def test_what_a_statistic_tells_apart():
    shares = {"ks_distance", "overturning_accuracy", "overturning_precision", "overturning_recall"}
    assert {name: one.resolution for name, one in measures.STATISTICS.items()} == {
        name: 1e-3 if name in shares else 1e-4 for name in measures.STATISTICS
    }


BIAS, SCATTER, AGREE = 0.05, 0.2, 0.9


def made_up(chance) -> ensemble.Samples:
    """Peaks whose ratios are lognormal, and outcomes of which nine in ten agree; who falls has no
    ratio."""
    peaks = chance.uniform(0.2, 0.8, 60)
    outcomes = np.where(chance.random(60) < 0.3, "overturned left", "at rest")
    other = np.where(outcomes == "at rest", "overturned left", "at rest")
    theirs = np.where(chance.random(60) < AGREE, outcomes, other)
    ratios = np.exp(BIAS + SCATTER * chance.standard_normal(60))
    return ensemble.Samples(
        ensemble.Sample(peaks, list(outcomes)), ensemble.Sample(peaks * ratios, list(theirs))
    )


@pytest.mark.parametrize(
    ("name", "truth"),
    [("peak_bias", BIAS), ("peak_scatter", SCATTER), ("overturning_accuracy", AGREE)],
)
def test_the_interval_in_the_remark_covers(name, truth):
    chance, inside = np.random.default_rng(11), 0
    for _ in range(600):
        _, remark = measures.STATISTICS[name].evaluate(made_up(chance))
        low, high = map(float, re.match(r"\[(-?[\d.e-]+), (-?[\d.e-]+)\]", remark).groups())
        inside += low <= truth <= high
    assert 0.92 <= inside / 600 <= 0.98


@pytest.mark.parametrize("friction", [0.5, 0.0])
def test_static_friction_keeps_its_ratio_to_the_friction_that_is_drawn(loaded, friction):
    """Above a frictionless floor there is no ratio: it is the drawn friction at least."""
    ensemble, base = loaded().ensembles["crowd"]
    base = base.replace(floor=base.floor.replace(friction=friction, static_friction=0.6))
    floors = [ensemble.drawn(base, number).floor for number in range(3)]
    ratio = pytest.approx(1.2 if friction else 1.0)
    assert [floor.mu_s / floor.friction for floor in floors] == [ratio] * 3
