"""Measured histories: units by column, an offset in time, judged like a model."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Event, InputError, load_scene
from rockcheck.scenes.observation import observe
from rockcheck.validation.discrepancy.measured import (
    Measured,
    mean_history,
    read_measured,
    shifted,
    time_shift,
)
from rockcheck.validation.execute.provenance import cell_key
from rockcheck.validation.suite.runner import run_suite
from rockcheck.validation.suite.suites import load_suite

SUITE = """
reference = "ebm"
[models.ebm]
[models.table]
model = "measured"
files = { tilt = "table.csv" }
offset = -0.4
[[scene]]
name = "tilt"
duration = 2.0
initial_rotation = 0.1
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.9 }
[[scene]]
name = "other"
duration = 0.1
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.9 }
[tolerances.tilt.table.ebm]
"theta_rms@1.5s" = { expected = 0.0, limit = 1e-3, drift = 1e-3, why = "a test" }
theta_rms = { expected = 0.0, limit = 1e-3, drift = 1e-3, why = "a test" }
[tolerances.other.ebm.figures]
last_x = { expected = 0.0, limit = 0.0, drift = 0.0, why = "it stands" }
"""


def write(path: Path, head: str, *columns: object) -> Path:
    path.write_text(
        head
        + "\n"
        + "\n".join(",".join(map(repr, map(float, row))) for row in zip(*columns, strict=True))
        + "\n",
        encoding="utf-8",
    )
    return path


def test_units_of_columns(tmp_path):
    t, head = np.arange(5.0), "time_ms, theta_deg, x_mm, slip_rate_cm_s, y, strain"
    history = read_measured(write(tmp_path / "a.csv", head, *[t] * 6), offset=0.25)
    expected = {
        "t": 1e-3 * t + 0.25,
        "theta": np.deg2rad(t),
        "x": 1e-3 * t,
        "slip_rate": 1e-2 * t,
        "y": t,
    }
    for name, values in expected.items():
        np.testing.assert_allclose(history.channels[name], values)
    assert history.model == "measured"
    assert "strain" not in history.channels


ROWS = "\n0,0,0\n1,1,1\n2,2,2\n"


@pytest.mark.parametrize(
    ("name", "content", "fault"),
    [
        ("a.csv", f"t_s,theta_gon,x{ROWS}", "'theta_gon': give a unit of theta: rad, mrad, deg"),
        ("a.csv", f"t_s,theta_deg,theta_rad{ROWS}", "gives theta a second time"),
        ("a.csv", f"time,t_s,theta{ROWS}", "gives t a second time"),
        ("a.csv", f"t_s,x_mm,y_mm{ROWS}", "no column 'theta'"),
        ("a.csv", "t_s,theta_deg\n0,0\n1,nan\n2,0\n", "is not finite"),
        ("gone/a.csv", None, "cannot be read"),
        # whatever the file holds: Parquet is no text at all
        *(
            (f"run{kind}", 'PAR1\n"', rf"from \.csv or \.csv\.gz, not from \{kind}")
            for kind in (".json", ".mat", ".parquet")
        ),
    ],
)
def test_faults_are_named(tmp_path, name, content, fault):
    if content is not None:
        (tmp_path / name).write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=fault):
        read_measured(tmp_path / name)


def test_a_measured_history_is_judged_like_a_model(tmp_path, typed):
    path = tmp_path / "mine.toml"
    path.write_text(SUITE, encoding="utf-8")
    scene = load_suite(path).scenes["tilt"]
    truth = EventBasedModel().simulate(scene)
    rows = truth.channels["t"] <= 1.6
    write(
        tmp_path / "table.csv",
        "time_s,theta_deg",
        truth.channels["t"][rows] + 0.4,
        np.rad2deg(truth.channels["theta"][rows]),
    )
    run = run_suite(load_suite(path), tmp_path / "out", jobs=1)
    cell = run.cell("tilt", "table")
    assert run.cell("other", "table") is None
    assert [(check.figure.window, check.kind, check.verdict) for check in cell.checks] == [
        ("1.5s", "measured", "pass"),
        ("", "measured", "fail"),
    ]
    words = (
        "`offset` of the measured model shifts its times, a window such as theta_rms@8s ends sooner"
    )
    assert cell.checks[1].reason == f"table ends at 1.6 s, before 2 s; {words}"
    write(tmp_path / "table.csv", "time_s,theta_deg", [0.3, 0.9], [0.0, 0.0])
    assert (
        run_suite(load_suite(path), tmp_path / "out", jobs=1).cell("tilt", "table").read_back
        is False
    )
    truth.save(tmp_path / "truth.csv")
    files = str(tmp_path / "truth.csv"), str(tmp_path / "table.csv")
    said = typed("compare", *files, "--align", "-0.4")[0]
    assert "measured against ebm, 0 to 0.5 s" in said
    assert "the candidate is shifted by -0.4 s" in said


def test_events_move_with_the_offset_and_end_with_the_scene(tmp_path):
    scene = load_scene("bookcase").replace(duration=3.0, output_step=0.01)
    state = np.zeros((301, 6))
    state[:, 2] = np.linspace(0.0, 1.5, 301)
    events = [Event(t=0.2, kind="uplift"), Event(t=2.995, kind="overturned left")]
    observe(scene, "measured", state, events=events).save(tmp_path / "a.csv")
    assert [e.t for e in read_measured(tmp_path / "a.csv", offset=-0.5).event_list] == [-0.3, 2.495]
    table = Measured(files={scene.name: str(tmp_path / "a.csv")}, offset=-0.5)
    fallen, stands = (table.simulate(scene.replace(duration=t)) for t in (3.0, 1.0))
    assert (fallen.outcome, fallen.overturned_at) == ("overturned left", 2.495)
    # one before the scene's beginning is none of the scene's
    assert [e.t for e in fallen.event_list] == [2.495]
    assert (stands.outcome, stands.overturned_at, stands.event_list) == ("moving", None, ())


def test_a_scene_without_a_file_is_bad_input():
    with pytest.raises(InputError, match="no measured history of scene 'bookcase'"):
        Measured(files={}).simulate(load_scene("bookcase"))


# Repeats of a test


def swing(scale=1.0, delay=0.0):
    t = np.linspace(0.0, 4.0, 401)
    state = np.zeros((401, 6))
    state[:, 2] = (
        0.1 * scale * np.exp(-4.0 * (t - 1.2 - delay) ** 2) * np.cos(3.0 * (t - 1.2 - delay))
    )
    return observe(
        load_scene("bookcase").replace(duration=4.0, output_step=0.01), "measured", state
    )


def test_a_shift_in_time_is_found():
    for delay in (0.0, 0.35, 1.0):
        assert time_shift(swing(), swing(delay=delay)) == pytest.approx(-delay, abs=2e-3)
    assert shifted(swing(), 0.5).channels["t"][0] == 0.5
    with pytest.raises(InputError, match="no rotation"):
        time_shift(swing(), swing(scale=0.0))


def test_the_interval_of_a_mean_covers_as_often_as_it_says():
    chance = np.random.default_rng(3)
    inside = 0
    for _ in range(400):
        mean = mean_history([swing(scale) for scale in 1.0 + 0.1 * chance.standard_normal(4)])
        truth = swing().peak_rotation
        inside += abs(mean.peak_rotation - truth) <= mean.uncertainty["peak_rotation"]
    assert 0.92 <= inside / 400 <= 0.98


def test_repeats_that_end_differently_have_no_mean():
    fallen = swing()
    fallen = replace(fallen, channels={**fallen.channels, "theta": np.linspace(0.0, 1.57, 401)})
    with pytest.raises(InputError, match="1 of 2 tests overturn"):
        mean_history([swing(), fallen])


def test_other_events_beside_a_measured_history_make_another_cell(tmp_path):
    scene, path = load_scene("bookcase"), tmp_path / "table.csv"
    EventBasedModel().simulate(scene).save(path)
    given = {"files": {scene.name: str(path)}}
    key, events = cell_key(scene, "measured", given), tmp_path / "table.events.csv"
    events.write_text(events.read_text(encoding="utf-8").replace("floor", "wall"), encoding="utf-8")
    assert cell_key(scene, "measured", given) != key


def test_what_happens_after_the_end_of_the_scene_does_not_count(tmp_path):
    scene = load_scene("bookcase").replace(duration=2.0)
    t = np.linspace(0.0, 4.0, 401)
    path = write(tmp_path / "falls.csv", "t_s,theta_rad", t, np.where(t > 3.0, 1.57, 0.01))
    assert read_measured(path).outcome == "overturned left"
    assert Measured(files={scene.name: str(path)}).simulate(scene).outcome == "moving"
