"""A first study: a scene of one's own and a record of three components, to a report and a curve, in
four commands."""

from pathlib import Path

import numpy as np
import pytest

from rockcheck.scenes import reading
from rockcheck.validation.suite import results

#: Largest accelerations (g) of the components of a station.
PEAKS = {"360 Deg": 0.31, "90 Deg": 0.27, "Up": 0.15}
SCENES = ("mine, station 360 Deg", "mine, station 90 Deg")
MODELS = ("ebm", "ebm-unilateral")


def component(name: str) -> str:
    values = 980.665 * PEAKS[name] * np.sin(0.5 * np.pi * np.arange(200))
    rows = ["".join(f"{value:10.4f}" for value in values[k : k + 8]) for k in range(0, 200, 8)]
    return (
        f"Corrected data\nChan  1: {name}\n"
        "  200 points of accel data equally spaced at   .020 sec, in cm/sec2. (8f10.4)\n"
        + "\n".join(rows)
        + "\n"
    )


@pytest.fixture
def station(in_an_empty_folder, typed):
    """What `new` and a station's records leave in a folder."""
    typed("new", "mine.toml")
    Path("station.v2").write_text("".join(map(component, PEAKS)), "utf-8")


@pytest.mark.usefixtures("station")
def test_the_components_of_a_record_are_understood(told):
    peaks = [one["pga_g"] for one in told("record", "station.v2")["records"]]
    assert peaks == pytest.approx(list(PEAKS.values()), abs=1e-4)


@pytest.mark.long
@pytest.mark.usefixtures("station")
def test_a_record_leads_to_a_report_with_a_page_a_component(typed):
    typed(
        *("validate", "mine.toml", "--records", "station.v2", "--models", ",".join(MODELS)),
        holds=["left out: station.v2 Up", "report: rockcheck-report/index.html"],
    )
    run = results.Run.load("rockcheck-report")
    played = [(cell.scene, cell.model, cell.status) for cell in run.cells]
    assert played == [(scene, model, "done") for scene in SCENES for model in MODELS]
    pages = {page.stem for page in Path("rockcheck-report/pages").glob("*.html")}
    assert pages == {scene.replace(", ", "-").replace(" ", "-") for scene in SCENES}


@pytest.mark.long
@pytest.mark.usefixtures("station")
def test_a_record_leads_to_a_curve_over_its_intensity(typed):
    typed("assess", "mine.toml", "station.v2", "--levels", "0.05:2:3")
    rows = reading.read_table(Path("rockcheck-report/assess/ida.csv"))
    assert set(rows["record"]) == {"station 360 Deg", "station 90 Deg"}
    assert len(rows["record"]) == 2 * 2 * 3  # components, directions, intensities
