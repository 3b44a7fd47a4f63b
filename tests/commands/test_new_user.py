"""A new user: an own block, an own wall and a record of three components, to a report with several
models and an IDA curve."""

import csv
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

from rockcheck.scenes import load_scene
from rockcheck.validation.suite.results import Run

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


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
    assert run.places == ("rack, station 360 deg", "rack, station 90 deg")
    assert [cell.status for cell in run.cells] == ["done"] * 8
    assert [run.load_scene(name).excitation.peak for name in run.places] == pytest.approx(
        [0.31, 0.27], abs=1e-7
    )
    for place in run.places:
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
