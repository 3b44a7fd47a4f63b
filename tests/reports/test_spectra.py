"""Figures of the spectra."""

import math
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from rockcheck.ebm import Spectrum
from rockcheck.reports.drawers import figure_of
from rockcheck.reports.show.spectrum import COLOURS, LAW_MARK, OWN_MARK, draw
from rockcheck.scenes import Sine, load_scene
from rockcheck.scenes.reading import read_json
from rockcheck.validation.finding import plain
from rockcheck.validation.paper import KEPT, Panel, kept_spectra, paper_panels
from rockcheck.validation.paper.measures import Paper, beyond, findings_of
from rockcheck.validation.studies.spectrum.agreement import (
    CANDIDATES,
    PLAYED_SHARE,
    blocks,
    mapped,
)
from rockcheck.validation.studies.spectrum.study import Spectra
from rockcheck.validation.studies.spectrum.tiles import Played, Request

SIZE = 12
REQUEST = Request(SIZE)


def made(panel):
    outcomes = np.zeros((SIZE, SIZE), dtype=np.int8)
    outcomes[6:], outcomes[9:] = 1, -1
    return Spectrum(
        outcomes=outcomes,
        frequency_ratios=np.linspace(0.5, 8.0, SIZE),
        amplitude_ratios=np.linspace(1.0, 12.0, SIZE),
        evaluations=SIZE * SIZE,
        undecided=np.zeros((0, 2), dtype=np.int64),
        scene=panel.scene,
        model=None,
    )


def plot_of(*panels, letter="R", request=REQUEST):
    """The plot of spectra whose nodes were all played to one outcome."""
    study = Spectra(panels, request)
    done = {task: Played(letter * len(task.amplitudes)) for task in study.tasks({})}
    return next(study.gather(done).plots())


def labels(figure):
    (legend,) = figure.legends
    return [text.get_text() for text in legend.texts]


@pytest.mark.parametrize(("panel", "overturned"), [(0, "clockwise"), (1, "overturned")])
def test_the_papers_colours(panel, overturned):
    axes = Figure().subplots()
    draw(made(paper_panels(8)[panel]), axes)
    (mesh,) = axes.collections
    axes.figure.draw_without_rendering()
    colours = mesh.get_facecolor().reshape(SIZE, SIZE, 4)[[0, 7, 11], 0]
    expected = [to_rgba(COLOURS[name]) for name in ("safe", overturned, "counterclockwise")]
    np.testing.assert_allclose(colours, expected)


def test_a_figure_has_the_papers_panels():
    figure = figure_of(plot_of(*paper_panels(9)))
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        panel.title for panel in paper_panels(9)
    ]
    assert figure.get_suptitle() == "Fig. 9: Wall on the right, μ = 0.6"
    assert labels(figure) == [
        "safe",
        "no wall: overturned clockwise",
        "overturned; no wall: counterclockwise",
    ]


def test_what_is_undecided_or_depends_on_the_law_is_in_the_legend():
    plot = plot_of(*paper_panels(9), letter="U")
    plot.data["panels"][1]["law"] = [[2, 3]]
    figure = figure_of(plot)
    assert {"undecided", "depends on the impact law"} <= {*labels(figure)}
    (ring,) = figure.axes[1].lines
    assert ring.get_marker() == LAW_MARK["marker"]
    assert ring.get_xydata().tolist() == [[plot.data["frequencies"][3], plot.data["amplitudes"][2]]]


def test_the_pulse_of_ones_own_scene_is_marked():
    """At its ratios; none is marked in the paper's figures."""
    scene = load_scene("rack").replace(excitation=Sine(amplitude=6.0, period=0.8))
    own = [
        2.0 * math.pi / 0.8 / scene.frequency_parameter,
        6.0 / (scene.gravity * scene.block.slope),
    ]
    request = Request(SIZE, (1.0, 8.0), (1.0, 4.0))
    figure = figure_of(plot_of(Panel("rack", "Rack", scene), request=request))
    (star,) = figure.axes[0].lines
    np.testing.assert_allclose(star.get_xydata(), [own])
    assert OWN_MARK["label"] in labels(figure)
    assert not any(axes.lines for axes in figure_of(plot_of(*paper_panels(8))).axes)


def test_the_documentation_shows_the_kept_study():
    kept = read_json(Path(__file__).parents[2] / "docs" / "runs" / "spectrum.json")
    (shown,) = (block for block in kept["blocks"] if block.get("name") == "agreement")
    found = read_json(KEPT / "agreement.json")
    panels = mapped(paper_panels())
    _, table, by_spectrum, plot = blocks(found, panels, came=True)
    assert [list(map(plain, row)) for row in table.rows] == shown["rows"]
    assert len({row[0] for row in by_spectrum.rows}) == 28
    assert all(
        share["nodes"] == 100 for share in found["shares"] if share["model"] not in PLAYED_SHARE
    )
    assert {share["model"] for share in found["shares"]} == set(CANDIDATES)
    figure = figure_of(plot)
    assert len(figure.axes) == len(panels) * len(found["maps"])


def test_a_map_of_each_finding():
    paper = Paper(kept_spectra())
    found = findings_of(paper)
    _, plot, rows = beyond(paper, found)
    for panel, one in zip(plot.data["panels"], found, strict=True):
        assert panel["outcomes"].count("G") == one.gained.sum()
        assert panel["outcomes"].count("X") == one.lost.sum()
    assert len(figure_of(plot).axes) == 3
    assert len(rows.rows) == sum(len(one.rows) for one in found)
