"""Sets of records: one scene by all models under each of them, however the files are named; nothing
is judged."""

import csv
import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from rockcheck.commands.cli import main
from rockcheck.scenes import Record, load_scene
from rockcheck.validation.execute.models import FAMILIES, not_installed
from rockcheck.validation.suite.results import Run
from rockcheck.validation.suite.suites import load_suite

SCENE = """
duration = 0.5
[block]
half_width = 0.2
half_height = 1.0
[floor]
friction = 0.5
[excitation]
kind = "ricker"
amplitude = 1.0
period = 0.5
"""
CODE = [word for name in ("Still", "Falls", "Bug") for word in ("--allow-code", f"faulty:{name}")]
STILL = ("--models", "faulty:Still", *CODE, "--jobs", "1", "--no-report")


def motion(gain: float) -> np.ndarray:
    return gain * np.sin(4.0 * 0.02 * np.arange(101))


def at2(name: str, gain: float, component: str) -> None:
    values = " ".join(f"{a:.8e}" for a in motion(gain))
    head = (
        f"PEER NGA\nSomewhere, 1/1/2000, Station, {component}\n"
        "ACCELERATION TIME SERIES IN UNITS OF G\nNPTS= 101, DT= .02 SEC\n"
    )
    Path(name).write_text(head + values + "\n", encoding="utf-8")


@pytest.fixture(autouse=True)
def files(in_an_empty_folder):
    Path("rack.toml").write_text(SCENE, encoding="utf-8")
    Path("records").mkdir()
    at2("records/RSN1_H1.AT2", 0.1, "180")
    at2("records/RSN1_H2.AT2", 0.2, "270")
    at2("records/RSN1_V.AT2", 0.3, "UP")


@pytest.mark.parametrize(
    "words",
    [
        ("records/RSN1_H*.AT2",),  # quoted, or a shell that finds no such file
        ("records/RSN1_H1.AT2", "records/RSN1_H2.AT2"),  # as a shell gives a pattern
        ("records",),
        ("records/RSN1_*.AT2",),
    ],
)
def test_files_folders_and_patterns_each_shake_the_scene(told, words):
    found = told(
        "validate", "rack.toml", *(part for word in words for part in ("--records", word)), *STILL
    )
    assert [(cell["scene"], cell["outcome"]) for cell in found["cells"]] == [
        ("rack, RSN1_H1", "at rest"),
        ("rack, RSN1_H2", "at rest"),
    ]
    whole = words[-1] in ("records", "records/RSN1_*.AT2")
    assert (found["judged"], found["left_out"]) == (False, ["RSN1_V.AT2"] * whole)


def test_a_record_takes_the_place_of_the_excitation_and_lasts(told):
    told("validate", "rack.toml", "--records", "records/RSN1_H2.AT2", "--read", "scale=1.5", *STILL)
    scene = Run.load("rockcheck-report").load_scene("rack, RSN1_H2")
    assert isinstance(scene.excitation, Record)
    np.testing.assert_allclose(scene.excitation.samples, 1.5 * 9.80665 * motion(0.2), atol=1e-6)
    assert scene.duration == pytest.approx(2.0)
    assert scene.block == load_scene("rack.toml").block


def test_a_chosen_component_is_played_though_it_is_vertical(told):
    rows = "".join(f"{0.02 * n:.2f},{a:.6f}\n" for n, a in enumerate(motion(0.3)))
    Path("up.csv").write_text("time_s,acceleration_g\n" + rows, encoding="utf-8")
    words = "validate", "rack.toml", "--records", "up.csv", *STILL
    assert main([*words]) == 2
    (cell,) = told(*words, "--read", "column=acceleration_g")["cells"]
    assert cell["scene"] == "rack, up"


def test_the_vertical_component_of_a_file_goes_with_its_others(told):
    """Two channels in one file (CSMIP): the base moves to the side and upward at once."""
    text = ""
    for name, gain in (("90 Deg", 0.1), ("Up", 0.05)):
        values = "".join(
            f"{981 * a:10.4f}" + "\n" * (n % 8 == 7) for n, a in enumerate(motion(gain))
        )
        text += (
            f"Corrected data\nChan  1: {name}\n"
            "  101 points of accel data equally spaced at   .020 sec, in cm/sec2. (8f10.4)\n"
            f"{values}\n"
        )
    Path("two.v2").write_text(text, encoding="utf-8")
    words = ("validate", "rack.toml", "--records", "two.v2", "--read", "scale=2", *STILL)
    assert told(*words)["left_out"] == ["two.v2 Up"]
    assert told(*words, "--read", "vertical=true")["left_out"] == []
    scene = Run.load("rockcheck-report").load_scene("rack, two 90 Deg")
    peaks = scene.excitation.peak, scene.vertical.peak
    assert peaks == pytest.approx(2 * 981 / 980.665 * np.array([0.1, 0.05]), rel=1e-3)


def test_the_vertical_component_may_be_a_file_of_its_own(told, refused):
    at2("records/RSN2_H1.AT2", 0.15, "180")
    at2("records/RSN2_V.AT2", 0.05, "UP")
    found = told("validate", "rack.toml", "--records", "records", "--read", "vertical=true", *STILL)
    assert [cell["scene"] for cell in found["cells"]] == [
        "rack, RSN1_H1",
        "rack, RSN1_H2",
        "rack, RSN2_H1",
    ]
    assert found["left_out"] == []
    peaks = [
        Run.load("rockcheck-report").load_scene(cell["scene"]).vertical.peak
        for cell in found["cells"]
    ]
    assert peaks == pytest.approx([0.3, 0.3, 0.05], rel=1e-2)
    Path("records/RSN2_H1.AT2").unlink()
    assert "RSN2_V.AT2: a vertical component, and no horizontal one is named alike" in refused(
        "validate", "rack.toml", "--records", "records", "--read", "vertical=true", *STILL
    )


def test_a_scene_that_there_is_not_is_the_only_line(refused, monkeypatch):
    monkeypatch.setattr(
        "rockcheck.validation.execute.models.not_installed",
        lambda name: "not installed" if name == "drake" else "",
    )
    assert refused("validate", "nothere")


def test_all_models_are_those_that_are_installed(told):
    """They play where none is named, too."""
    found = told("validate", "rack.toml", "--set", "mujoco.time_step=1e-3", "--no-report")
    models = [cell["model"] for cell in found["cells"]]
    assert models == [name for name in FAMILIES if name != "measured" and not not_installed(name)]
    assert {"ebm", "ebm-unilateral", "cm", "mujoco"} <= set(models)
    assert found["reference"] == "ebm-unilateral"
    for cell in found["cells"]:
        assert (cell["status"], cell["scene"]) == ("done", "rack")
        assert cell["model"] == "ebm-unilateral" or cell["apart_alpha"] < 0.01


def test_what_falls_is_told_with_its_time_and_without_a_peak(typed):
    out = typed(
        "validate",
        "rack.toml",
        "--records",
        "records/RSN1_H1.AT2",
        "--models",
        "faulty:Falls,faulty:Still",
        *CODE,
        "--jobs",
        "1",
    )[0]
    (line,) = (line for line in out.splitlines() if "Falls" in line)
    assert re.fullmatch("faulty:Falls +overturned left at 1.57 s +ref. +0.0 s *", line)
    assert max(map(len, out.splitlines())) <= 130
    folder, option = Path("rockcheck-report"), '<option value="pass">within tolerance</option>'
    (scene,) = (folder / "pages").glob("*.html")
    for path in (folder / "index.html", scene, folder / "summary.md"):
        text = path.read_text(encoding="utf-8").replace(option, "")
        assert "overturned left at 1.57 s" in text
        assert "ithin tolerance" not in text or path.suffix == ".md"
        assert "Nothing is judged." in text or path.stem != "index"


def test_a_model_that_fails_is_exit_3(told):
    found = told(
        "validate",
        "rack.toml",
        "--models",
        "faulty:Bug,faulty:Still",
        *CODE,
        "--no-report",
        code=3,
    )
    assert [cell["status"] for cell in found["cells"]] == ["failed", "done"]


SUITE = """
reference = "still"
scenes = ["rack.toml", "other.toml"]
[models.still]
model = "faulty:Still"
[require]
figures = ["peak_rotation"]
[[records]]
files = ["records/RSN1_*.AT2"]
scale = 2.0
scenes = ["rack"]
"""


def test_a_suite_has_tables_of_records():
    Path("other.toml").write_text(SCENE, encoding="utf-8")
    Path("mine.toml").write_text(SUITE, encoding="utf-8")
    suite = load_suite("mine.toml", allow_code=("faulty:Still",))
    assert list(suite.scenes) == ["other", "rack, RSN1_H1", "rack, RSN1_H2"]
    assert suite.left_out == ("RSN1_V.AT2",)
    assert suite.scenes["rack, RSN1_H2"].excitation.scale == 2.0
    assert main(["accept", "mine.toml", *CODE, "--jobs", "1"]) == 0
    assert main(["validate", "mine.toml", *CODE, "--jobs", "1", "--no-report", "--strict"]) == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("validate", "rack.toml", "--models", "ebm,mujcoo"),
            "unknown model 'mujcoo'; did you mean 'mujoco'",
        ),
        (("validate", "rack.toml", "--models", "measured"), "--models: 'measured' is not allowed"),
        (
            ("validate", "rack.toml", "--models", "ebm", "--set", "cm.tolerance=1"),
            "--set: 'cm.tolerance=1': write MODEL.key=value, with MODEL one of ebm",
        ),
        (
            ("validate", "rack.toml", "--models", "ebm", "--set", "ebm.tol=1"),
            "ebm.tol: unknown key",
        ),
        (("validate", "rack.toml", "--read", "unit=g"), "--read: needs records"),
        (("validate", "rack.toml", "--records", "records/X*.AT2"), "X*.AT2: no such files"),
        (
            (
                "validate",
                "rack.toml",
                "--records",
                "records/RSN1_H1.AT2",
                "--read",
                "vertical=true",
            ),
            "RSN1_H1.AT2: 0 vertical components in it or in a file of the set that is named alike",
        ),
        (("validate", "rakc.toml"), "rakc.toml: cannot be read"),
        (
            ("validate", "rack.toml", "--records", "records/RSN1_V.AT2"),
            "RSN1_V.AT2: a vertical component, and no horizontal one is given",
        ),
        (("validate", "wrong.toml"), "records.scenes: unknown scene 'rakk'; did you mean 'rack'"),
    ],
)
def test_slips_are_named(words, said, refused):
    Path("wrong.toml").write_text(
        SUITE.replace(', "other.toml"', "").replace('["rack"]', '["rakk"]'), encoding="utf-8"
    )
    assert said in refused(*words, *(CODE if words[0] == "validate" else ()))


@pytest.mark.parametrize(
    "words",
    [
        ("records/RSN1_H*.AT2",),
        ("records/RSN1_H1.AT2", "records/RSN1_H2.AT2", "records/RSN1_V.AT2"),
    ],
)
def test_a_population_takes_the_same_sets(told, words):
    found = told("assess", "rack.toml", "--levels", "1:2:2", *words)
    assert [one["motion"] for one in found["tables"]["motions"]] == ["RSN1_H1", "RSN1_H2"]
    assert found["left_out"] == list(words[2:3] and ["RSN1_V.AT2"])


@pytest.mark.parametrize("command", ["validate", "assess"])
def test_a_file_of_a_folder_that_is_no_record_is_named_and_left_out(told, command):
    Path("records/README.txt").write_text("where they are from\n", encoding="utf-8")
    rest = STILL if command == "validate" else ("--levels", "0.1:1:2")
    words = ("--records", "records") if command == "validate" else ("records",)
    left_out = told(command, "rack.toml", *words, *rest)["left_out"]
    assert left_out[0] == "RSN1_V.AT2"
    assert "README.txt" in left_out[1]


def test_a_shipped_record_shakes_a_scene_by_its_name(told):
    found = told("validate", "rack.toml", "--records", "elcentro_1940_ns.csv", *STILL)
    assert [cell["scene"] for cell in found["cells"]] == ["rack, elcentro_1940_ns"]


def makers() -> ModuleType:
    """What makes files of records: that of the readers' tests."""
    spec = importlib.util.spec_from_file_location(
        "made_records", Path(__file__).parents[1] / "scenes" / "test_recordings.py"
    )
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules["made_records"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def type_(typed, but_progress):
    """Types a command, which must end well; what it said on stdout."""

    def line(words: str) -> str:
        out, err = typed(*words.split())
        assert but_progress(err) == []
        return out

    return line


@pytest.mark.long
def test_from_a_v2_record_to_a_report_and_a_curve_in_four_commands(type_):
    Path("station.V2").write_bytes(makers().cosmos_three())
    Path("rack.toml").unlink()
    type_("new rack.toml")
    text = Path("rack.toml").read_text(encoding="utf-8")
    Path("rack.toml").write_text(
        text.replace("half_width = 0.20", "half_width = 0.25").replace("gap = 0.03", "gap = 0.05"),
        encoding="utf-8",
    )
    scene = load_scene("rack.toml")
    assert (scene.block.half_width, scene.walls[0].gap) == (0.25, 0.05)

    understood = type_("record station.V2")
    assert [f"PGA         {peak} g" in understood for peak in (0.31, 0.27, 0.15)] == [True] * 3

    told = type_(
        "validate rack.toml --records station.V2 --models ebm,ebm-unilateral,cm,mujoco"
        " --set mujoco.time_step=1e-3"
    )
    assert "left out: station.V2 up (vertical" in told
    assert "report: rockcheck-report/index.html\n" in told
    run = Run.load("rockcheck-report")
    assert tuple(run.by_scene()) == ("rack, station 360 deg", "rack, station 90 deg")
    assert [cell.status for cell in run.cells] == ["done"] * 8
    assert [run.load_scene(name).excitation.peak for name in run.by_scene()] == pytest.approx(
        [0.31, 0.27], abs=1e-7
    )
    for place in run.by_scene():
        assert (
            Path("rockcheck-report")
            / "pages"
            / f"{place.replace(', ', '-').replace(' ', '-')}.html"
        ).exists()

    told = type_("assess rack.toml station.V2 --levels 0.05:2:8")
    assert "report: rockcheck-report/assess/index.html\n" in told
    rows = list(
        csv.DictReader(
            Path("rockcheck-report/assess/ida.csv").read_text(encoding="utf-8").splitlines()
        )
    )
    assert len(rows) == 2 * 2 * 8  # components, directions, intensities
    assert {row["record"] for row in rows} == {"station 360 deg", "station 90 deg"}
