"""The law of impacts in a suite: named where a landing tells, never judged; outcomes and peaks by
the nearest law."""

import numpy as np
import pytest

from rockcheck.ebm import EventBasedModel
from rockcheck.validation.execute import models
from rockcheck.validation.execute.store import COMPARISONS, Store
from rockcheck.validation.suite import (
    comparing,
    job_page,
    results,
    run_summary,
    scene_results,
    suites,
)
from rockcheck.validation.suite.runner import run_suite

FLAT = "moreau or leading-first"
# Under "moreau" the first block stays and under "floor-first" it falls; the second stands beside no
# wall that bounces; the last one lands flat, and overturns where its trailing corner is first.
SUITE = """
reference = "ebm-unilateral"
[models.ebm-unilateral]
[models.floor-first]
model = "ebm-unilateral"
impacts = "floor-first"
[models.trailing-first]
model = "ebm-unilateral"
impacts = "trailing-first"
[models.mujoco]
time_step = "adaptive"
[require]
difference = ["outcome_agrees", "peak_ratio", "theta_rms@horizon"]
[[scene]]
name = "of the law"
duration = 8.0
output_step = 0.01
block = { half_width = 0.397, half_height = 1.555 }
floor = { friction = 0.3 }
walls = [{ side = "left", gap = 0.003, restitution = 1.0 }]
excitation = { kind = "ricker", amplitude = AMPLITUDE, period = PERIOD }
[[scene]]
name = "plastic"
duration = 1.0
initial_rotation = -0.07
block = { half_width = 0.397, half_height = 1.555 }
floor = { friction = 0.5 }
walls = [{ side = "left", gap = 0.0, restitution = 0.0 }]
[[scene]]
name = "flat"
duration = 3.0
initial_height = 0.05
initial_velocity = -1.0
block = { half_width = 0.3, half_height = 1.0 }
floor = { friction = 0.9 }
[tolerances."*".floor-first.ebm-unilateral]
outcome_agrees = { expected = 1.0, limit = 0.0, drift = 0.0, why = "the nearer of two laws" }
peak_ratio = { expected = 1.0, limit = 1e-6, drift = 1e-6, why = "the nearer of two laws" }
"theta_rms@horizon" = { expected = 0.0, limit = 1e-3, drift = 1e-3, why = "before the laws part" }
[tolerances."*".trailing-first.ebm-unilateral]
outcome_agrees = { expected = 1.0, limit = 0.0, drift = 0.0, why = "the nearer of some laws" }
peak_ratio = { expected = 1.0, limit = 1e-6, drift = 1e-6, why = "the nearer of some laws" }
"theta_rms@horizon" = { expected = 0.0, limit = 1e-3, drift = 1e-3, why = "before the laws part" }
"""


@pytest.fixture(scope="module")
def suite_file(tmp_path_factory, block):
    """The suite, with a pulse that is a node of the paper's Fig. 6 of which the law decides."""
    p = block.weaker_pivot.frequency_parameter(9.81)
    period = 2.0 * np.pi / (np.linspace(0.5, 8.0, 100)[73] * p)
    text = SUITE.replace("AMPLITUDE", repr(6.0 * 9.81 * block.slope))
    path = tmp_path_factory.mktemp("suite") / "laws.toml"
    path.write_text(text.replace("PERIOD", repr(float(period))), "utf-8")
    return path


@pytest.fixture(scope="module")
def run(suite_file):
    return run_suite(suites.load_suite(suite_file), suite_file.parent / "out", jobs=0)


@pytest.mark.parametrize(
    ("scene", "laws"),
    [
        ("of the law", ("open", "floor-first", "open", "closed")),
        ("flat", (FLAT, FLAT, "trailing-first", FLAT)),
        ("plastic", ()),
    ],
)
def test_the_law_that_each_model_followed_is_in_its_cell(run, scene, laws):
    found = [cell.impact_law for cell in run.by_scene[scene].values() if cell.impact_law]
    assert tuple(law.law for law in found) == laws
    assert len({law.t for law in found}) <= 1
    notes = [figure.note for cell in run.by_scene[scene].values() for figure in cell.figures]
    assert any("impacts = " in note for note in notes) == bool(laws)


@pytest.mark.parametrize(
    ("scene", "law", "outcomes", "near"),
    [
        ("of the law", "floor-first", None, 0.05),
        ("flat", "trailing-first", ("moving", "overturned left"), 0.02),
    ],
)
def test_outcomes_and_peaks_are_judged_by_the_nearest_law_and_histories_until_they_part(
    run, scene, law, outcomes, near
):
    reference, cell = (run.by_scene[scene][one] for one in ("ebm-unilateral", law))
    assert reference.outcome != cell.outcome
    assert outcomes in (None, (reference.outcome, cell.outcome))
    assert {check.verdict for check in cell.checks} == {"pass"}
    figures = {check.figure.measure: check.figure for check in cell.checks}
    horizon = figures.pop("theta_rms")
    assert "impacts = " not in horizon.note
    assert horizon.until == pytest.approx(cell.impact_law.t, abs=near)
    assert {
        name: (figure.until, figure.note.endswith(f'impacts = "{law}"'))
        for name, figure in figures.items()
    } == {"outcome_agrees": (None, True), "peak_ratio": (None, True)}


def test_the_summary_names_the_laws_and_nothing_depends_on_them(run, suite_file, tmp_path):
    assert "not judged" in job_page.markdown(run)
    laws = {
        (one["scene"], one["model"]): one["impact_law"] for one in run_summary.summary(run)["cells"]
    }
    assert laws["of the law", "mujoco"] == "closed"
    assert laws["plastic", "mujoco"] is None
    silent = tuple(cell.model_copy(update={"impact_law": None}) for cell in run.cells)
    untold = run.model_copy(update={"cells": silent})
    assert "not judged" not in job_page.markdown(untold)
    assert untold.verdict == run.verdict
    run.save(tmp_path)
    assert results.Run.load(tmp_path) == run
    again = run_suite(suites.load_suite(suite_file), suite_file.parent / "out", jobs=0)
    assert [(cell.read_back, cell.figures) for cell in again.cells] == [
        (True, cell.figures) for cell in run.cells
    ]


def test_a_landing_is_kept_and_what_was_kept_is_not_trusted(suite_file, tmp_path, monkeypatch):
    scene, store = suites.load_suite(suite_file).scenes["of the law"], Store(tmp_path)
    first = scene_results.landing_of(store, scene)
    (kept,) = (tmp_path / COMPARISONS).iterdir()
    with monkeypatch.context() as patched:
        patched.setattr(
            "rockcheck.validation.discrepancy.impact_laws.parting_landing", lambda scene: None
        )
        assert scene_results.landing_of(store, scene) == first
    store.put(COMPARISONS, kept.stem, {"kept": {"t": 1.0}})
    assert scene_results.landing_of(store, scene) == first


@pytest.mark.parametrize(
    ("name", "others"),
    [
        ("ebm-unilateral", ["floor-first", "leading-first", "trailing-first"]),
        ("floor-first", ["moreau", "leading-first", "trailing-first"]),
        ("mujoco", []),
        ("ebm", []),
    ],
)
def test_only_a_reference_with_a_law_to_choose_has_another(suite_file, name, others):
    suite = suites.load_suite(suite_file)
    model = suite.models.get(name, models.Work(label="paper", family="ebm", settings={}))
    assert list(comparing.histories_under_other_laws(suite.scenes["of the law"], model)) == others


def test_the_reference_itself_counts_where_it_is_nearer(suite_file):
    scene = suites.load_suite(suite_file).scenes["of the law"]
    usual = EventBasedModel(pivot="unilateral", impacts="moreau").simulate(scene)
    other = EventBasedModel(pivot="unilateral", impacts="floor-first").simulate(scene)
    reference = comparing.Reference(usual, {"floor-first": other})
    compared = comparing.figures_against(usual, reference, scene, ["outcome_agrees", "peak_ratio"])
    assert [one.figure.value for one in compared] == [1.0, 1.0]
    assert [one.gap for one in compared] == ["", ""]
