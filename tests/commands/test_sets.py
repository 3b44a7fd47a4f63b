"""Sets of records: one scene by all models under each of them, however the files are named; nothing
is judged."""

import re
from pathlib import Path

import numpy as np
import pytest

from rockcheck.scenes import Record, load_scene
from rockcheck.validation.execute.models import FAMILIES, not_installed
from rockcheck.validation.suite import results, suites

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
    Path(name).parent.mkdir(parents=True, exist_ok=True)
    Path(name).write_text(
        f"PEER NGA\nSomewhere, 1/1/2000, Station, {component}\n"
        f"ACCELERATION TIME SERIES IN UNITS OF G\nNPTS= 101, DT= .02 SEC\n{values}\n"
    )


@pytest.fixture(autouse=True)
def files(in_an_empty_folder):
    Path("rack.toml").write_text(SCENE, "utf-8")
    for name, gain, component in (
        *(("records/RSN1_H1", 0.1, "180"), ("records/RSN1_H2", 0.2, "270")),
        *(("records/RSN1_V", 0.3, "UP"), ("records/more/RSN1_H1", 0.1, "180"), ("Ä", 0.1, "180")),
        *(("Ö", 0.2, "180"), ("other/more/RSN1_H1", 0.2, "180")),
    ):
        at2(f"{name}.AT2", gain, component)
    Path("records/README.txt").write_text("where they are from\n", "utf-8")


HORIZONTAL = ["RSN1_H1", "RSN1_H2"]
VERTICAL = "RSN1_V.AT2"
ODD = "README.txt"


def names(left_out: list[str]) -> list[str]:
    """The names of files that are left out, without the reasons."""
    return [Path(re.split("[,:]", text)[0]).name for text in left_out]


@pytest.mark.parametrize(
    ("words", "played", "left_out"),
    [
        (["records/RSN1_H*.AT2"], HORIZONTAL, []),  # quoted, or a shell that finds no such file
        (["records/RSN1_H1.AT2", "records/RSN1_H2.AT2"], HORIZONTAL, []),  # as a shell gives it
        (["records"], HORIZONTAL, [VERTICAL, ODD]),
        (["records/RSN1_*.AT2"], HORIZONTAL, [VERTICAL]),
        (["records/RSN1_H1.AT2", "records/more"], ["records-RSN1_H1", "more-RSN1_H1"], []),
        (["records/more", "other/more"], ["more-RSN1_H1 1", "more-RSN1_H1 2"], []),
        (["?.AT2"], ["- 1", "- 2"], []),  # which no name of a scene can tell apart
        (["elcentro_1940_ns.csv"], ["elcentro_1940_ns"], []),  # one that comes with the package
    ],
)
def test_files_folders_and_patterns_each_shake_the_scene(told, words, played, left_out):
    found = told(
        "validate", "rack.toml", *(part for word in words for part in ("--records", word)), *STILL
    )
    assert [(cell["scene"], cell["outcome"]) for cell in found["cells"]] == [
        (f"rack, {name}", "at rest") for name in played
    ]
    assert not found["judged"]
    assert names(found["left_out"]) == left_out


def test_a_record_takes_the_place_of_the_excitation_and_lasts(told):
    told("validate", "rack.toml", "--records", "records/RSN1_H2.AT2", "--read", "scale=1.5", *STILL)
    scene = results.Run.load("rockcheck-report").load_scene("rack, RSN1_H2")
    assert isinstance(scene.excitation, Record)
    np.testing.assert_allclose(scene.excitation.samples, 1.5 * 9.80665 * motion(0.2), atol=1e-6)
    assert scene.duration == pytest.approx(2.0)
    assert scene.block == load_scene("rack.toml").block


def test_the_vertical_component_may_be_a_file_of_its_own(told):
    at2("records/RSN2_H1.AT2", 0.15, "180")
    at2("records/RSN2_V.AT2", 0.05, "UP")
    words = (
        *("validate", "rack.toml", "--records", "records"),
        *("--read", "vertical=true", "--read", "scale=2", *STILL),
    )
    assert names(told(*words)["left_out"]) == [ODD]
    run = results.Run.load("rockcheck-report")
    assert {name: run.load_scene(name).vertical.peak for name in run.scenes} == pytest.approx(
        {"rack, RSN1_H1": 0.6, "rack, RSN1_H2": 0.6, "rack, RSN2_H1": 0.1}, rel=1e-2
    )
    Path("records/RSN2_H1.AT2").unlink()
    alone = told(*words)["left_out"][0]
    assert "RSN2_V.AT2: a vertical component, and no horizontal one is named alike" in alone


def test_without_names_all_models_play_that_are_installed(told):
    found = told("validate", "rack.toml", "--set", "mujoco.time_step=1e-3", "--no-report")
    models = [name for name in FAMILIES if name != "measured" and not not_installed(name)]
    assert {"ebm", "ebm-unilateral", "cm", "mujoco"} <= set(models)
    assert [(cell["scene"], cell["model"], cell["status"]) for cell in found["cells"]] == [
        ("rack", model, "done") for model in models
    ]
    assert found["reference"] == "ebm-unilateral"
    others = (cell for cell in found["cells"] if cell["model"] != "ebm-unilateral")
    assert max(cell["apart_alpha"] for cell in others) < 0.01


def test_what_falls_is_told_with_its_time_and_without_a_peak(typed):
    out = typed(
        *("validate", "rack.toml", "--records", "records/RSN1_H1.AT2"),
        *("--models", "faulty:Falls,faulty:Still", *CODE, "--jobs", "1"),
        columns=130,
    )[0]
    (line,) = (line for line in out.splitlines() if line.startswith("faulty:Falls"))
    assert re.fullmatch("faulty:Falls +overturned left at 1.57 s +ref. +0.0 s *", line)
    folder, option = Path("rockcheck-report"), '<option value="pass">within tolerance</option>'
    (scene,) = (folder / "pages").glob("*.html")
    for path in (folder / "index.html", scene, folder / "summary.md"):
        text = path.read_text("utf-8").replace(option, "")
        assert "overturned left at 1.57 s" in text
        assert "ithin tolerance" not in text or path.suffix == ".md"
        assert "Nothing is judged." in text or path.stem != "index"


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


def test_a_suite_has_tables_of_records(typed):
    Path("other.toml").write_text(SCENE, "utf-8")
    Path("mine.toml").write_text(SUITE, "utf-8")
    suite = suites.load_suite("mine.toml", allow_code=("faulty:Still",))
    assert list(suite.scenes) == ["other", "rack, RSN1_H1", "rack, RSN1_H2"]
    assert suite.left_out == ("RSN1_V.AT2",)
    assert suite.scenes["rack, RSN1_H2"].excitation.scale == 2.0
    typed("accept", "mine.toml", *CODE, "--jobs", "1")
    typed("validate", "mine.toml", *CODE, "--jobs", "1", "--no-report", "--strict", "worse")


def test_what_a_reader_assumed_is_told(typed):
    Path("rows.txt").write_text("0.1 0.2 0.3\n0.2 0.1 0.0\n0.1 0.1 0.2\n", "utf-8")
    typed(
        *("assess", "rack.toml", "rows.txt", "--read", "unit=m/s2", "--read", "time_step=0.1"),
        *("--read", "column=2"),
        holds=["note: rows: column 2 of 3, 3 samples, 0.3 s at 0.1 s; along the lines there are 9"],
    )


def test_a_population_takes_the_same_sets(told):
    found = told("assess", "rack.toml", "--levels", "1:2:2", "records")
    assert [one["motion"] for one in found["tables"]["motions"]] == HORIZONTAL
    assert names(found["left_out"]) == [VERTICAL, ODD]
