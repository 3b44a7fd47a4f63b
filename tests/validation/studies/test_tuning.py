"""An engine's own parameters for a wanted restitution: what is printed does what it says."""

import mujoco
import pytest

from rockcheck.scenes import InputError
from rockcheck.validation.execute.models import engine_names, not_installed
from rockcheck.validation.studies.conformance.tuning import KNOBS, Knob, Tune, Tuning

HERE = [name for name in engine_names() if not not_installed(name)]


def tuned(engine, restitution, **more):
    return Tuning.play(Tune(engine, restitution, **more))


#: The largest restitution at a drop of 0.2 m of engines that have not all: one applies it corner by
#: corner, the other not below 2 m/s.
MOST = {"box2d": 0.67, "physx": 0.0}


@pytest.mark.parametrize("restitution", [0.0, 0.25, 0.5, 0.75])
@pytest.mark.parametrize("engine", [name for name in HERE if name != "drake"])
def test_the_wanted_restitution_is_reached(engine, restitution):
    if restitution > MOST.get(engine, 1.0):
        with pytest.raises(InputError, match="cannot be reached"):
            tuned(engine, restitution)
        return
    found = tuned(engine, restitution)
    assert found.reached
    assert found.restitution == pytest.approx(restitution, abs=5e-3)
    assert found.friction == pytest.approx(0.3, rel=1e-2)
    assert 0.0 <= found.penetration < 5e-3


@pytest.mark.slow
@pytest.mark.needs("drake")
def test_drake_bounces_by_its_dissipation_and_says_how_deep():
    found = tuned("drake", 0.5)
    assert found.reached
    assert found.penetration > 5e-3
    assert "speed of approach" in found.parameters["remark"]
    assert not tuned("drake", 0.5, penetration=1e-3).reached


def test_mujocos_parameters_do_it_in_a_file_that_owes_nothing_else_to_rockcheck():
    found = tuned("mujoco", 0.5).parameters
    solref, solimp = found["geom solref"], found["geom solimp"]
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep="0.001" integrator="Euler" cone="elliptic"/>
<default><geom solref="{solref}" solimp="{solimp}"/></default>
<worldbody><geom type="plane" size="1 1 1"/>
<body pos="0 0 0.6"><freejoint/><geom type="sphere" size="0.1"/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    heights = []
    while data.time < 0.8:
        mujoco.mj_step(model, data)
        heights.append(data.qpos[2] - 0.1)
    assert max(heights[400:]) == pytest.approx(0.25 * 0.5, abs=0.01)


def test_the_command(tmp_path, told):
    words = ["conformance", "--tune", "0.5", "--engine", "mujoco", "--out", str(tmp_path)]
    found = told(*words, "--set", "penetration=1e-6", code=1)
    assert found["engines"]["mujoco"]["reached"] is False
    assert {row["where"] for row in found["tables"]["parameters"]} == KNOBS["mujoco"].words.keys()
    assert (tmp_path / "tuned" / "index.html").is_file()


def test_what_no_setting_reaches_is_told(monkeypatch):
    monkeypatch.setitem(KNOBS, "mujoco", Knob((0.5, 0.6), {}))
    with pytest.raises(InputError, match="cannot be reached by mujoco"):
        tuned("mujoco", 0.9)
