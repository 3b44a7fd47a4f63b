"""Measured histories: units by column, an offset in time, judged like a model."""

from dataclasses import replace

import numpy as np
import pytest

from rockcheck import Event, EventBasedModel, History, load_scene
from rockcheck.scenes import Cost, observation
from rockcheck.validation.discrepancy import measured
from rockcheck.validation.execute import provenance
from rockcheck.validation.suite import suites
from rockcheck.validation.suite.runner import run_suite

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
[tolerances.tilt.table.figures]
"last_rotation@1.5s" = { expected = 0.0, limit = 1.0, drift = 1.0, why = "it rocks" }
[tolerances.other.ebm.figures]
last_x = { expected = 0.0, limit = 0.0, drift = 0.0, why = "it stands" }
"""


def write(path, head, *columns):
    np.savetxt(path, np.column_stack(columns), "%.17g", delimiter=",", header=head, comments="")
    return path


def test_units_of_columns(tmp_path):
    t, head = np.arange(5.0), "time_ms, theta_deg, x_mm, slip_rate_cm_s, y, strain"
    history = History.load(write(tmp_path / "a.csv", head, *[t] * 6))
    expected = {"t": 1e-3 * t, "theta": np.deg2rad(t), "x": 1e-3 * t, "slip_rate": 1e-2 * t, "y": t}
    assert history.model == "measured"
    assert history.channels == {
        name: pytest.approx(values, rel=1e-7, abs=0.0) for name, values in expected.items()
    }


ROWS = "\n0,0,0\n1,1,1\n2,2,2\n"


@pytest.mark.parametrize(
    ("name", "content", "fault"),
    [
        ("a.csv", f"t_s,theta_gon,x{ROWS}", "'theta_gon': give a unit of theta: rad, mrad, deg"),
        ("a.csv", f"t_s,theta_deg,theta_rad{ROWS}", "gives theta a second time"),
        ("a.csv", f"time,t_s,theta{ROWS}", "gives t a second time"),
        ("a.csv", f"t_s,theta_deg,theta_deg{ROWS}", "'theta_deg' gives theta a second time"),
        ("a.csv", f"t_s,x_mm,y_mm{ROWS}", "no column 'theta'"),
        ("a.csv", "t_s,theta_deg\n0,0\n1,nan\n2,0\n", "is not finite"),
        ("gone/a.csv", None, "cannot be read"),
        # whatever the file holds: Parquet is no text at all
        *(
            (f"run{kind}", 'PAR1\n"', f"from .csv or .csv.gz, not from {kind}")
            for kind in (".json", ".mat", ".parquet")
        ),
    ],
)
def test_faults_are_named(tmp_path, fault_of, written, name, content, fault):
    if content is not None:
        written(name, content)
    assert fault in str(fault_of(History.load, tmp_path / name))


def test_a_measured_history_is_judged_like_a_model(tmp_path, typed, written):
    path = written("mine.toml", SUITE)
    write(tmp_path / "table.csv", "time_s,theta_deg", [0.0, 2.0], [0.0, 0.0])
    truth = EventBasedModel().simulate(suites.load_suite(path).scenes["tilt"])
    t, theta = (truth.channels[name][truth.channels["t"] <= 1.6] for name in ("t", "theta"))
    write(tmp_path / "table.csv", "time_s,theta_deg", t + 0.4, np.rad2deg(theta))
    run = run_suite(suites.load_suite(path), tmp_path / "out", jobs=1)
    assert "table" not in run.by_scene["other"]
    assert [
        (check.figure.window, check.kind, check.verdict, check.reason)
        for check in run.by_scene["tilt"]["table"].checks
    ] == [
        ("1.5s", "measured", "pass", ""),
        (
            "",
            "measured",
            "fail",
            "table ends at 1.6 s, before 2 s; `offset` of the measured model shifts its times, "
            "a window such as theta_rms@8s ends sooner",
        ),
        ("1.5s", "absolute", "pass", ""),
    ]
    # what begins only after a window fails that check, and no more
    write(tmp_path / "table.csv", "time_s,theta_deg", [1.95, 2.3], [0.0, 0.0])
    assert [
        (cell.read_back, *(one.figure.value is None for one in cell.checks))
        for cell in [
            run_suite(suites.load_suite(path), tmp_path / "out", jobs=1).by_scene["tilt"]["table"]
        ]
    ] == [(False, True, False, True)]
    truth.save(tmp_path / "truth.csv")
    typed(
        *("compare", str(tmp_path / "truth.csv"), str(tmp_path / "table.csv"), "--align", "-0.4"),
        holds=["measured against ebm, 1.55 to 1.9 s", "the candidate is shifted by -0.4 s"],
    )


@pytest.mark.parametrize(
    ("repeats", "duration", "outcome", "fell", "events"),
    [
        # One before the scene's beginning is none of the scene's.
        (1, 3.0, "overturned left", 2.495, [2.495]),
        (1, 1.0, "moving", None, []),
        # a mean has no events, but falls as all do
        (2, 3.0, "overturned left", 2.5, []),
        (2, 1.0, "moving", None, []),
    ],
)
def test_events_move_with_the_offset_and_end_with_the_scene(
    tmp_path, repeats, duration, outcome, fell, events
):
    scene = load_scene("bookcase").replace(duration=3.0, output_step=0.01)
    state = np.zeros((301, 6))
    state[:, 2] = np.linspace(0.0, 1.5, 301)
    told = [Event(t=0.2, kind="uplift"), Event(t=2.995, kind="overturned left")]
    for name, apart in {"a": 0.0, "b": 0.1}.items():  # from 1.5 s on, by the scene's time
        state[200:, 2] -= apart
        observation.observe(scene, "measured", state, events=told, cost=Cost(steps=9)).save(
            tmp_path / f"{name}.csv"
        )
    assert [e.t for e in measured.shifted(History.load(tmp_path / "a.csv"), -0.5).event_list] == [
        -0.3,
        2.495,
    ]
    history = measured.Measured(
        files={scene.name: [str(tmp_path / f"{name}.csv") for name in "ab"[:repeats]]}, offset=-0.5
    ).simulate(scene.replace(duration=duration))
    assert history.outcome == outcome
    assert history.overturned_at == fell
    assert [e.t for e in history.event_list] == events
    assert history.cost == Cost()  # playing a file back costs nothing, whoever wrote it
    assert any(history.uncertainty.values()) == ((repeats, duration) == (2, 3.0))


# Repeats of a test


def swing(scale=1.0, delay=0.0):
    scene = load_scene("bookcase").replace(duration=4.0, output_step=0.01)
    t = scene.output_times - 1.2 - delay
    state = np.zeros((len(t), 6))
    state[:, 2] = 0.1 * scale * np.exp(-4.0 * t**2) * np.cos(3.0 * t)
    return observation.observe(scene, "measured", state)


@pytest.mark.parametrize("delay", [0.0, 0.35, 1.0])
@pytest.mark.parametrize("part", [slice(None), slice(100, 190)])  # a part may be a weak one
def test_a_shift_in_time_is_found(delay, part):
    candidate = replace(
        swing(),
        channels={name: column[part] for name, column in swing(delay=delay).channels.items()},
    )
    assert [
        measured.time_shift(swing(), candidate),
        -measured.time_shift(candidate, swing()),
        measured.time_shift(candidate, candidate),
    ] == pytest.approx([-delay, -delay, 0.0], abs=2e-3)


@pytest.mark.parametrize(
    ("delay", "part"),
    [
        (0.0033, slice(None)),
        (-0.0268, slice(None)),
        (0.2739, slice(107, 204)),
        (0.2308, slice(153, 305)),
        (0.3711, slice(260, 380)),
        (0.7296, slice(23, 163)),
    ],
)
def test_a_shift_is_found_within_a_part_of_a_step(delay, part):
    candidate = replace(
        swing(),
        channels={name: column[part] for name, column in swing(delay=delay).channels.items()},
    )
    assert measured.time_shift(swing(), candidate) == pytest.approx(-delay, abs=6e-4)


def test_three_rows_can_be_aligned_and_two_cannot(fault_of):
    def part(rows):
        channels = {name: one[80:160:20][:rows] for name, one in swing().channels.items()}
        return replace(swing(), channels=channels)

    assert abs(measured.time_shift(part(3), part(3))) < 1e-9
    assert "no rotation by which" in str(fault_of(measured.time_shift, part(3), part(2)))


@pytest.mark.slow
def test_the_interval_of_a_mean_covers_as_often_as_it_says():
    truth = swing().peak_rotation
    scales = 1.0 + 0.1 * np.random.default_rng(3).standard_normal((400, 4))
    means = [measured.mean_history([swing(scale) for scale in repeats]) for repeats in scales]
    inside = [abs(m.peak_rotation - truth) <= m.uncertainty["peak_rotation"] for m in means]
    assert 0.92 <= np.mean(inside) <= 0.98


def test_two_tests_differ_by_students_interval(made):
    """Of rotations that are 0.2 and 0.2 + d t apart: sd d t/sqrt 2, and 12.706/sqrt 2 of it."""
    t = np.array([0.0, 1.0, 2.0, 3.0])
    apart = 0.01 * t
    tests = [made(0.2 + sign * 0.5 * apart, t, slip=apart * (sign > 0.0)) for sign in (1.0, -1.0)]
    alpha, student = tests[0].block.alpha, 12.7062 / np.sqrt(2.0)
    found = measured.mean_history(tests).uncertainty
    # The squares of the differences at the rows, by the trapezoidal rule.
    mean_square = (0.5 * 0.0 + 0.01**2 + 0.02**2 + 0.5 * 0.03**2) / 3.0
    expected = {
        "theta_rms": student * alpha * np.sqrt(mean_square / 2.0),
        "peak_rotation": student * alpha * (0.03 / 2.0 - 0.0) / np.sqrt(2.0),
        "last_slip": student * 0.03 / np.sqrt(2.0),
    }
    assert found["theta_rms"] == pytest.approx(expected["theta_rms"], rel=1e-4)
    assert found["peak_rotation"] == pytest.approx(expected["peak_rotation"], rel=1e-4)
    assert found["last_slip"] == pytest.approx(expected["last_slip"], rel=1e-4)


def test_repeats_are_aligned_with_the_first(tmp_path):
    paths = [tmp_path / f"{name}.csv" for name in "abc"]
    for path, delay in zip(paths, (0.0, 0.3, -0.2), strict=True):
        swing(delay=delay).save(path)
    files = {"bookcase": tuple(str(path) for path in paths)}
    scene = load_scene("bookcase").replace(duration=4.0, output_step=0.01)
    history = measured.Measured(files=files, align=True).simulate(scene)
    assert [note for note in history.notes if "shifted" in note] == [
        "b.csv is shifted by -0.3 s",
        "c.csv is shifted by +0.2 s",
    ]
    assert history.peak_rotation == pytest.approx(0.1, rel=1e-3)


LEFT, RIGHT = (
    replace(swing(), channels=swing().channels | {"theta": np.linspace(0.0, end, 401)})
    for end in (1.57, -1.57)
)


@pytest.mark.parametrize(
    ("call", "fault"),
    [
        (
            lambda: measured.Measured(files={}).simulate(load_scene("bookcase")),
            "no measured history of scene 'bookcase'",
        ),
        (lambda: measured.time_shift(swing(), swing(scale=0.0)), "no rotation"),
        (lambda: measured.mean_history([swing(), LEFT]), "1 of 2 tests overturn"),
        (lambda: measured.mean_history([RIGHT, LEFT]), "2 of 2 tests overturn"),
    ],
)
def test_what_cannot_be_is_named(fault_of, call, fault):
    assert fault in str(fault_of(call))


def test_other_events_beside_a_measured_history_and_other_libraries_make_another_cell(
    tmp_path, monkeypatch, faulty
):
    scene = load_scene("bookcase")
    EventBasedModel().simulate(scene).save(tmp_path / "table.csv")
    given = {"files": {scene.name: str(tmp_path / "table.csv")}}
    file = tmp_path / "table.events.csv"
    keys = [
        (change(), provenance.cell_key(scene, name, given, (str(tmp_path),)))[1]
        for name, change in (
            ("measured", lambda: None),
            (
                "measured",
                lambda: file.write_text(file.read_text("utf-8").replace("floor", "wall"), "utf-8"),
            ),
            ("measured", lambda: monkeypatch.setattr(provenance, "version_of", str.upper)),
            ("faulty:Still", lambda: None),
            (
                "faulty:Still",
                lambda: monkeypatch.setattr(
                    provenance, "version_of", lambda one: one.upper() + "2" * (one == "rockcheck")
                ),
            ),
        )
    ]
    assert len({*keys}) == len(keys)
