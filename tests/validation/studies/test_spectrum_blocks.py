"""What is shown of made-up spectra: figures, files, and what the paper's sentences need."""

import csv

import numpy as np
import pytest

from rockcheck import Record, Spectrum
from rockcheck.scenes import files
from rockcheck.validation.paper import Panel, paper_panels
from rockcheck.validation.studies.spectrum.scene_node import ratios
from rockcheck.validation.studies.spectrum.spectrum_blocks import spectrum_blocks
from rockcheck.validation.studies.spectrum.spectrum_files import files_of
from rockcheck.validation.studies.spectrum.study import Spectra
from rockcheck.validation.studies.spectrum.tiles import SLOW_TILE, Played, Request

SCENE = files.load_scene("bookcase")
OWN = Panel("own", "Own", SCENE)
RECORDED = Panel(
    "recorded", "Recorded", SCENE.replace(excitation=Record.from_samples([0.0, 1.0, 0.0], 0.1))
)


def made(panel, outcomes=((0, 0), (0, 1)), undecided=()):
    return Spectrum(
        outcomes=np.array(outcomes, dtype=np.int8),
        frequency_ratios=np.array([1.0, 2.0]),
        amplitude_ratios=np.array([3.0, 4.0]),
        evaluations=4,
        undecided=np.array(undecided, dtype=np.int64).reshape(-1, 2),
        scene=panel.scene,
        model=None,
    )


def shown(*panels):
    """The introduction, and the data of the first figure."""
    spectra = {panel: made(panel) for panel in panels}
    blocks = [*spectrum_blocks(spectra, dict.fromkeys(panels, Played()), Request(2))]
    return blocks[0].text, blocks[1].data


@pytest.mark.parametrize(("panel", "recorded"), [(OWN, False), (RECORDED, True)])
def test_a_record_s_spectrum_is_about_blocks_and_a_pulse_s_about_pulses(panel, recorded):
    about, data = shown(panel)
    assert ("the record" in about) == recorded
    assert (data["pulse"] is None) == recorded
    assert data["record"] == recorded


def test_one_s_own_pulse_is_marked_and_the_paper_s_is_not():
    assert shown(OWN)[1]["own"] == ratios(SCENE)
    assert shown(*paper_panels(8))[1]["own"] is None


def covered(panels):
    """The rows and columns that each panel takes."""
    return [
        {(row, column) for row in range(first, first + span)}
        for first, span, column in (panel["place"] for panel in panels)
    ]


def test_a_spectrum_alone_fills_the_figure():
    assert covered(shown(OWN)[1]["panels"]) == [{(row, 0) for row in range(4)}]


def test_the_walls_of_a_figure_stand_gap_by_gap_beside_the_free_block():
    """Those without restitution above those with it; none over another."""
    free, *walls = covered(shown(*paper_panels(8))[1]["panels"])
    assert free == {(1, 0), (2, 0)}
    assert walls[0::2] == [{(0, gap), (1, gap)} for gap in (1, 2, 3)]
    assert walls[1::2] == [{(2, gap), (3, gap)} for gap in (1, 2, 3)]


def test_a_table_has_a_number_a_side_and_nothing_where_undecided():
    spectrum = made(OWN, [[-1, 0], [0, 1]], undecided=[[1, 0]])
    text = files_of(OWN, spectrum, Request(2))["csv"].decode()
    about, head, *rows = csv.reader(text.splitlines())
    assert about[0].startswith("# rockcheck spectrum")
    assert head[1:] == ["1.0", "2.0"]
    assert [[float(row[0]), *row[1:]] for row in rows] == [[3.0, "-1", "0"], [4.0, "", "1"]]


@pytest.mark.parametrize(("model", "tasks"), [("ebm", 1), ("cm", 3)])
def test_a_model_that_is_simulated_plays_few_nodes_at_once(model, tasks):
    axis = np.linspace(1.0, 2.0, 2 * SLOW_TILE + 1)
    assert len(Request(model=model).nodes(SCENE, axis, axis)) == tasks


# All spectra of the paper


@pytest.fixture(scope="module")
def papers():
    """The paper's spectra, of a block that falls to the right from 9 g tan alpha on."""
    study, done = Spectra(paper_panels(), Request(4)), {}
    while tasks := study.tasks(done):
        for task in tasks:
            falls = np.where(task.amplitudes > 8.995, "R", "S")
            letters = {"outcomes": "".join(falls), "one impact": "N" * len(falls), "motions": ""}
            done[task] = Played(letters[task.what])
    return study.gather(done)


def test_the_paper_s_spectra_are_judged_by_its_sentences(papers):
    assert papers.exit_code == 0
    assert papers.table("claims").rows
    assert papers.answer.startswith(f"Of {len(papers.table('claims').rows)} sentences")
    figures = {row["value"] for row in papers.table("claim-figures").records()}
    assert "overturns from a_p = 9.00 g tan α" in figures


def test_the_other_models_kept_spectra_stand_beside_the_paper_s(papers):
    assert papers.table("agreement").rows
    assert papers.data["agreement"]["shares"]
