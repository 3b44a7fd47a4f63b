"""What a command checks of its words before it plays: files to write, models, settings."""

import os
from pathlib import Path

import pytest

from rockcheck.commands import checks, model_choice
from rockcheck.scenes import errors


def test_a_file_is_written_into_a_folder_that_is_there(tmp_path, fault_of):
    checks.check_file(tmp_path / "a.png", "--plot")
    fault = fault_of(checks.check_file, tmp_path / "none" / "a.png", "--plot")
    assert "no such folder" in str(fault)
    assert fault.key == "--plot"
    assert ".svg, .png, .pdf" in str(fault_of(checks.check_file, tmp_path / "a.jpg", "--plot"))


def test_a_folder_is_made_and_must_be_writable(tmp_path, monkeypatch, fault_of):
    made = checks.usable_folder(tmp_path, "a", "b")
    assert made == tmp_path / "a" / "b"
    assert made.is_dir()
    (tmp_path / "file").write_text("")
    assert "cannot be used as a folder" in str(fault_of(checks.usable_folder, tmp_path, "file"))
    monkeypatch.setattr(os, "access", lambda path, how: Path(path) != made)
    assert "not writable" in str(fault_of(checks.usable_folder, made))


@pytest.fixture
def installed(monkeypatch):
    """Of the models only these are installed."""
    here = ("ebm", "mujoco")
    monkeypatch.setattr(
        model_choice, "not_installed", lambda name: "" if name in here else f"install {name}"
    )


@pytest.mark.usefixtures("installed")
def test_all_models_are_those_that_are_installed_and_play():
    assert list(model_choice.chosen_models()) == ["ebm", "mujoco"]


def test_models_are_named_between_commas_each_once():
    assert model_choice.chosen_models(" ebm, cm,ebm,") == {"ebm": {}, "cm": {}}


@pytest.mark.parametrize("names", ["", ",", "measured", "ebm,measured"])
def test_a_model_that_does_not_play_is_none(names, fault_of):
    assert fault_of(model_choice.chosen_models, names).key == "--models"


def test_a_setting_belongs_to_a_model_that_is_chosen(fault_of):
    chosen = model_choice.chosen_models("ebm,cm", ["ebm.tolerance=1e-8"])
    assert chosen == {"ebm": {"tolerance": 1e-8}, "cm": {}}
    for word in ("tolerance=1e-8", "mujoco.time_step=1", "ebm"):
        said = str(fault_of(model_choice.chosen_models, "ebm,cm", [word]))
        assert "with MODEL one of ebm, cm" in said
    assert "speed" in str(fault_of(model_choice.chosen_models, "ebm", ["ebm.speed=1"]))


def test_a_model_of_ones_own_is_not_imported_to_read_its_settings():
    chosen = model_choice.chosen_models("ebm,no_such:Model", ["no_such:Model.size=2"])
    assert chosen == {"ebm": {}, "no_such:Model": {"size": 2}}


@pytest.mark.parametrize(
    ("word", "value"),
    [
        ("a=1", 1),
        ("a=1.5", 1.5),
        ("a=true", True),
        ("a='x'", "x"),
        ("a=x y", "x y"),
        ("a=b=c", "b=c"),
    ],
)
def test_a_setting_is_read_as_in_toml_and_a_bare_word_is_text(word, value):
    assert model_choice.settings_of([word]) == {"a": value}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["a"], "write key=value"),
        (["=1"], "write key=value"),
        (["a b=1"], "write key=value"),
        (["a=1", "b=1", "a=2"], "a is given twice"),
    ],
)
def test_what_is_no_setting_is_refused(words, said, fault_of):
    fault = fault_of(model_choice.settings_of, words, "--read")
    assert said in str(fault)
    assert fault.key == "--read"


def test_names_may_stand_in_one_word_or_in_several():
    assert model_choice.names_in(["a, b", "c", "a"]) == ["a", "b", "c"]


def test_a_command_of_one_model_takes_one(fault_of):
    model_choice.check_one_model("ebm", "simulate")
    assert "simulate plays one model" in str(
        fault_of(model_choice.check_one_model, "ebm,cm", "simulate")
    )


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("names", "missing"),
    [(["ebm", "mujoco"], []), (["ebm", "drake", "dart"], [("--models drake", "install drake")])],
)
def test_a_model_that_is_needed_is_installed(names, missing):
    told = []
    try:
        model_choice.need_installed(names, "--models")
    except errors.NotInstalled as error:
        told.append((error.key, error.reason))
    assert told == missing
