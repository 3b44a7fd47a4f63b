"""Models are named by one option in every command: --models, or --model."""

from pathlib import Path

import pytest

from rockcheck.commands.cli import COMMANDS, MODEL_OPTIONS

SCENE = """
duration = 0.2
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
excitation = { kind = "ricker", amplitude = 4.0, period = 0.5 }
"""
#: The commands that take models, and what else they need.
NAMING = {
    "simulate": ["scene.toml"],
    "spectrum": ["scene.toml"],
    "assess": ["scene.toml"],
    "validate": ["scene.toml"],
    "conformance": [],
    "stress": ["runs"],
}
#: Of these, those that play one.
OF_ONE = ("simulate", "spectrum")


@pytest.fixture(autouse=True)
def scene(in_an_empty_folder):
    Path("scene.toml").write_text(SCENE, "utf-8")


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_has_both_names_or_neither(typed, command):
    shown = typed(command, "--help")[0].split()
    words = {word.strip(",") for word in shown if word.startswith("--model")}
    assert words == ({*MODEL_OPTIONS} if command in NAMING else set())


@pytest.mark.parametrize("option", MODEL_OPTIONS)
@pytest.mark.parametrize("command", NAMING)
def test_either_name_is_read(refused, command, option):
    assert "mujcoo" in refused(command, *NAMING[command], option, "mujcoo")


@pytest.mark.parametrize("option", MODEL_OPTIONS)
@pytest.mark.parametrize("command", [name for name in NAMING if name not in OF_ONE])
def test_several_have_commas_between(refused, command, option):
    line = refused(command, *NAMING[command], option, "mujoco,mujcoo")
    assert "'mujcoo'" in line


@pytest.mark.parametrize("option", MODEL_OPTIONS)
@pytest.mark.parametrize("command", OF_ONE)
def test_where_one_plays_several_are_refused(refused, command, option):
    line = refused(command, *NAMING[command], option, "ebm,cm")
    assert f"'ebm,cm' is not allowed: {command} plays one model" in line


def test_both_names_together_are_one_option_given_twice(refused):
    line = refused("simulate", "scene.toml", "--model", "ebm", "--models", "cm")
    assert "--model: is given twice" in line
