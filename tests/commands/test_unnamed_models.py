"""A scene by all models: what nobody named, and cannot play it, is left out; nothing has failed."""

from pathlib import Path

import pytest

from rockcheck.validation.execute import models
from rockcheck.validation.suite import cells, reasons, runner, suites

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")
SCENE = """
duration = 1.5
block = {{ half_width = 0.4, half_height = 1.5 }}
floor = {{ friction = 0.4, {floor} }}
excitation = {{ kind = "ricker", amplitude = 5.0, period = 1.0 }}
"""
#: A suite of that scene, without tolerances.
JUDGED = """
scenes = ["mine.toml"]
reference = "ebm"
[models.ebm]
[require]
figures = ["peak_rotation"]
"""
#: The models that the tests play, for the others take long.
FEW = ("ebm", "ebm-unilateral", "ebm-bouc-wen", "pymunk")
ALONE = ("--no-report", "--jobs", "1")


@pytest.fixture
def few(monkeypatch):
    missing = models.not_installed
    monkeypatch.setattr(
        "rockcheck.commands.model_choice.not_installed",
        lambda name: missing(name) if name in FEW else "not here",
    )


def scene(floor: str) -> str:
    Path("mine.toml").write_text(SCENE.format(floor=floor), "utf-8")
    return "mine.toml"


@pytest.mark.usefixtures("few")
def test_models_that_cannot_play_a_scene_are_left_out_by_name(typed):
    typed(
        *("validate", scene("restitution = 0.7"), *ALONE),
        holds=[
            "left out: ebm cannot play this scene: floor.restitution",
            "left out: ebm-bouc-wen cannot play this scene: floor.restitution",
        ],
        lacks=["failed"],
    )


@pytest.mark.usefixtures("few")
def test_a_named_model_that_cannot_play_a_scene_has_failed(typed):
    typed("validate", scene("restitution = 0.7"), "--models", "ebm,ebm-unilateral", *ALONE, code=3)


@pytest.mark.usefixtures("few")
def test_a_model_with_a_setting_is_named(typed):
    typed("validate", scene("restitution = 0.7"), "--set", "ebm.tolerance=1e-9", *ALONE, code=3)


@pytest.mark.usefixtures("few")
@pytest.mark.needs("pymunk")
def test_what_an_engine_does_not_model_is_told_beside_its_figure(typed):
    typed(
        *("validate", scene("static_friction = 0.45"), *ALONE),
        holds=["mine, pymunk: the engine has one friction coefficient"],
    )


def test_a_scene_that_no_model_can_play_says_why(refused, monkeypatch):
    monkeypatch.setattr(
        "rockcheck.commands.model_choice.not_installed",
        lambda name: "" if name == "ebm" else "not here",
    )
    line = refused("validate", scene("restitution = 0.7"), *ALONE)
    assert "no model can play it: floor.restitution" in line


@pytest.mark.needs("box2d")
def test_an_engine_that_nobody_named_is_left_out_when_its_time_is_over(monkeypatch, tmp_path):
    monkeypatch.setattr(cells, "UNNAMED_SECONDS", 0.05)
    chosen = {"ebm-unilateral": {}, "box2d": {}}
    suite = suites.scene_suite("fig5a", chosen, unnamed=["ebm-unilateral", "box2d"])
    finished = runner.run_suite(suite, tmp_path / "out", jobs=1)
    by_model = finished.by_scene["fig5a"]
    assert by_model["ebm-unilateral"].status == "done"
    assert by_model["box2d"].status == "unavailable"
    assert by_model["box2d"].reason.startswith("did not end within 0.05 s; left out, since nobody")
    assert "box2d: did not end within" in "\n".join(reasons.verdict_lines(finished))
    assert finished.exit_code == 0


def test_an_engine_that_was_named_has_the_time_of_a_scene():
    suite = suites.scene_suite("fig5a", {"box2d": {}})
    assert suite.seconds("fig5a", suite.models["box2d"]) == suites.UNJUDGED_SECONDS


def test_a_name_that_is_none_is_the_first_complaint(refused):
    line = refused("validate", "smoek", "--models", "x")
    assert "unknown suite or scene 'smoek'; did you mean 'smoke'?" in line


@pytest.mark.parametrize("second", ["mine.toml", "other.toml"])
def test_a_run_of_something_else_is_replaced_and_that_is_told(typed, second):
    scene("restitution = 0.0")
    Path("other.toml").write_bytes(Path("mine.toml").read_bytes())
    model = ("--models", "ebm", *ALONE)
    typed("validate", "mine.toml", *model)
    printed, _ = typed("validate", second, *model)
    assert ("this replaces the report of mine" in printed) == (second == "other.toml")


def test_a_judged_run_is_replaced_by_a_scene_as_by_a_suite(typed):
    scene("restitution = 0.0")
    Path("judged.toml").write_text(JUDGED, "utf-8")
    typed("validate", "judged.toml", *ALONE, code=1)
    typed(
        *("validate", "mine.toml", "--models", "ebm", *ALONE),
        holds=["this replaces the report of judged in rockcheck-report"],
    )


def test_a_folder_of_results_is_left_out_of_a_repository(typed):
    typed("validate", scene("restitution = 0.0"), "--models", "ebm", *ALONE)
    assert Path("rockcheck-report/.gitignore").read_text().endswith("\n*\n")


def test_a_folder_with_files_of_a_user_is_not(typed):
    typed("validate", scene("restitution = 0.0"), "--models", "ebm", *ALONE, "--out", ".")
    assert not Path(".gitignore").exists()


def test_a_folder_within_the_report_does_not_keep_the_report_from_it(typed):
    out = ("--out", "rockcheck-report/first")
    typed("validate", scene("restitution = 0.0"), "--models", "ebm", *ALONE, *out)
    typed("validate", "mine.toml", "--models", "ebm", *ALONE)
    assert Path("rockcheck-report/first/.gitignore").exists()
    assert Path("rockcheck-report/.gitignore").exists()


def test_quiet_says_which_figures_fail(typed):
    scene("restitution = 0.0")
    Path("judged.toml").write_text(JUDGED, "utf-8")
    printed, errors = typed("validate", "judged.toml", *ALONE, "--quiet", code=1)
    assert printed == ""
    assert errors.startswith("rockcheck: mine, ebm: peak_rotation: ")


def test_a_missing_measured_file_ends_before_anything_plays(refused):
    scene("restitution = 0.0")
    Path("table.toml").write_text(
        'reference = "measured"\nscenes = ["mine.toml"]\n'
        '[models.measured]\nfiles = { mine = "run1.csv" }\n[models.ebm]\n',
        "utf-8",
    )
    line = refused("validate", "table.toml", *ALONE)
    assert "table.toml: models.measured: run1.csv: cannot be read: No such file" in line
    assert not Path("rockcheck-report").exists()
