"""`rockcheck record --building`: the motion of a storey in place of the ground's."""

import numpy as np
import pytest

from rockcheck.scenes import files
from rockcheck.scenes.recordings import Recording, intensity

SHELF = """duration = 5.0
[block]
half_width = 0.3
half_height = 1.0
[floor]
friction = 0.5
[excitation]
kind = "ricker"
amplitude = 4.0
period = 0.5
"""
BUILDING = "[building]\nstoreys = 4\nstorey = 3\nperiod = 0.6\ndamping = 0.05\n"


@pytest.fixture
def station(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "shelf.toml").write_text(SHELF + BUILDING, "utf-8")
    (tmp_path / "ground.toml").write_text(SHELF, "utf-8")
    samples = np.random.default_rng(4).normal(0.0, 1.0, 80)
    rows = np.column_stack([0.05 * np.arange(80), samples])
    np.savetxt("station.csv", rows, delimiter=",", header="time_s,acceleration_m/s2", comments="")
    return samples


def test_the_spectrum_is_that_of_the_storey(station, told):
    found = told("record", "station.csv", "--building", "shelf.toml")
    given = files.load_uncertain_scene("shelf.toml")
    scene = given.scene.replace(
        excitation={"kind": "record", "unscaled": tuple(station.tolist()), "time_step": 0.05}
    )
    storey = files.on_storey(
        files.UncertainScene(scene, {}, np.eye(0)), given.building
    ).scene.excitation
    motion = Recording(
        samples=storey.samples, time_step=storey.time_step, unit="m/s2", form="record"
    )
    assert found["pga_g"] == pytest.approx(storey.peak)
    at_its_period = intensity.spectral_acceleration(motion, 0.5)
    assert found["sa_g"]["0.5"] == pytest.approx(at_its_period)
    assert "on storey 3 of 4" in found["notes"][-1]


def test_a_storey_s_spectrum_is_larger_near_the_building_s_period(station, told):
    ground = told("record", "station.csv")
    floor = told("record", "station.csv", "--building", "shelf.toml")
    assert floor["sa_g"]["0.5"] > 2.0 * ground["sa_g"]["0.5"]


def test_a_scene_without_a_building_is_refused(station, refused):
    said = refused("record", "station.csv", "--building", "ground.toml")
    assert "--building: ground.toml has no [building]" in said
