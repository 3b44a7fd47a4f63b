"""An engine's own parameters for a wanted restitution: what is printed does what it says."""

from __future__ import annotations

import json

import mujoco
import pytest

from rockcheck.commands.cli import main
from rockcheck.validation.conformance.calibration import KNOBS, calibrate
from rockcheck.validation.conformance.study import engines_here


@pytest.mark.parametrize("restitution", [0.0, 0.25, 0.5, 0.75])
@pytest.mark.parametrize("engine", [name for name in engines_here() if name != "drake"])
def test_the_wanted_restitution_is_reached(engine, restitution):
    found = calibrate(engine, restitution=restitution, friction=0.3, step=1e-3)
    assert found.reached
    assert found.restitution == pytest.approx(restitution, abs=5e-3)
    assert found.friction == pytest.approx(0.3, rel=1e-2)
    assert 0.0 <= found.penetration < 5e-3


@pytest.mark.slow
@pytest.mark.skipif("drake" not in engines_here(), reason="Drake is not installed")
def test_drake_bounces_by_its_dissipation_and_says_how_deep():
    found = calibrate("drake", restitution=0.5, friction=0.3, step=1e-3)
    assert found.reached
    assert found.penetration > 5e-3
    assert "speed of approach" in found.remark
    assert not calibrate("drake", restitution=0.5, friction=0.3, step=1e-3, penetration=1e-3).reached


def test_mujocos_parameters_do_it_in_a_model_of_ones_own():
    """A sphere in a file that owes nothing to rockcheck but the two lines."""
    found = calibrate("mujoco", restitution=0.5, friction=0.3, step=1e-3)
    solref, solimp = found.parameters["geom solref"], found.parameters["geom solimp"]
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep="0.001" integrator="Euler" cone="elliptic"/><default><geom solref="{solref}" solimp="{solimp}"/></default>
<worldbody><geom type="plane" size="1 1 1"/><body pos="0 0 0.6"><freejoint/><geom type="sphere" size="0.1"/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    heights = []
    while data.time < 0.8:
        mujoco.mj_step(model, data)
        heights.append(data.qpos[2] - 0.1)
    assert max(heights[400:]) == pytest.approx(0.25 * 0.5, abs=0.01)


def test_the_command(capsys):
    assert main(["calibrate", "--engine", "mujoco", "--restitution", "0.5"]) == 0
    assert "solref" in capsys.readouterr().out
    assert main(["calibrate", "--engine", "mujoco", "--restitution", "0.5", "--penetration", "1e-6", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["reached"] is False


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--engine", "ebm", "--restitution", "0.5"], "--engine: 'ebm' is not allowed: give one of mujoco"),
        (["--engine", "mujoco", "--restitution", "2"], "--restitution: 2 is not allowed"),
        (["--engine", "mujoco", "--restitution", "nan"], "--restitution: nan is not allowed"),
        (["--engine", "mujoco", "--restitution", "0.5", "--step", "0"], "--step: 0 is not allowed"),
        (["--engine", "mujoco", "--restitution", "0.5", "--friction", "3"], "--friction: 3 is not allowed"),
    ],
)
def test_wrong_input_is_one_line(arguments, words, capsys):
    assert main(["calibrate", *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1


def test_every_engine_has_its_knob():
    assert set(engines_here()) <= set(KNOBS)
