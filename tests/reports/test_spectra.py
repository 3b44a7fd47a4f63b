"""Figures and page of the spectra."""

from __future__ import annotations

import re

import numpy as np
from matplotlib.colors import to_rgba

from ebm import Spectrum
from ebm.spectrum import COLOURS, draw
from reports.spectra import paper_figure, write_page
from reports.style import save
from validation.spectra import SPECTRA, Asked, paper_panels
from validation.spectra import save as save_spectra

SIZE = 12


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


def test_the_papers_colours():
    from matplotlib.figure import Figure

    for panel, clockwise in ((paper_panels(8)[0], COLOURS["clockwise"]), (paper_panels(8)[1], COLOURS["overturned"])):
        axes = Figure().subplots()
        draw(made(panel), axes)
        (mesh,) = axes.collections
        axes.figure.draw_without_rendering()
        colours = mesh.get_facecolor().reshape(SIZE, SIZE, 4)
        np.testing.assert_allclose(colours[0, 0], to_rgba(COLOURS["safe"]))
        np.testing.assert_allclose(colours[7, 0], to_rgba(clockwise))
        np.testing.assert_allclose(colours[11, 0], to_rgba(COLOURS["counterclockwise"]))


def test_a_figure_has_the_papers_panels():
    panels = paper_panels(9)
    figure = paper_figure(panels, [made(panel) for panel in panels])
    assert [axes.get_title(loc="left") for axes in figure.axes] == [panel.title for panel in panels]
    assert figure.get_suptitle() == "Fig. 9: Wall on the right, μ = 0.6"


def test_the_page_shows_what_the_folder_holds(tmp_path):
    panels, folder = paper_panels(7), tmp_path / SPECTRA
    folder.mkdir()
    spectra = [made(panel) for panel in panels]
    save_spectra(panels, spectra, Asked(np.linspace(0.5, 8.0, SIZE), np.linspace(1.0, 12.0, SIZE)), folder)
    save(paper_figure(panels, spectra), folder / "figure-7")
    text = write_page(tmp_path).read_text(encoding="utf-8")
    assert "Fig. 7" in text
    assert "Fig. 8" not in text
    for link in re.findall(r'(?:href|src)="([^"#:]+)"', text):
        assert (tmp_path / link).exists(), link
