"""Figures and page of the spectra."""

from __future__ import annotations

import dataclasses
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.colors import to_rgba

from rockcheck.ebm import Spectrum
from rockcheck.reports.show.spectrum import COLOURS, draw
from rockcheck.reports.studies import spectra as pages
from rockcheck.reports.studies.spectra import draw_figures, maps_shown, paper_figure, write_page
from rockcheck.reports.style import save, stamp_in, stamp_of
from rockcheck.validation.spectra.agreement import CANDIDATES, PLAYED_SHARE, Agreement, mapped
from rockcheck.validation.spectra.claims import Claim, Claims
from rockcheck.validation.spectra.findings import findings, kept_spectra
from rockcheck.validation.spectra.refinement import Refined, Refinement
from rockcheck.validation.spectra.study import FIGURES, KEPT, SPECTRA, SpectrumRequest, paper_panels
from rockcheck.validation.spectra.study import save as save_spectra

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
    save_spectra(panels, spectra, SpectrumRequest(np.linspace(0.5, 8.0, SIZE), np.linspace(1.0, 12.0, SIZE)), folder)
    save(paper_figure(panels, spectra), folder / "figure-7")
    text = write_page(tmp_path).read_text(encoding="utf-8")
    assert "Fig. 7" in text
    assert "Fig. 8: " not in text
    # The long studies came with the package, and the page says so.
    assert text.count("came with the package") == 2
    assert "84.7 %" in text  # ebm-unilateral near a boundary
    assert (folder / "models.svg").exists()
    for link in re.findall(r'(?:href|src)="([^"#:]+)"', text):
        assert (tmp_path / link).exists(), link


def test_what_is_drawn_already_is_not_drawn_again(tmp_path, monkeypatch):
    """Drawn anew only where it would show something else, in the formats that are asked for; no file shows what is not so any more."""
    panels = paper_panels(7)
    spectra = [made(panel) for panel in panels]
    drawn = []
    monkeypatch.setattr(pages, "paper_figure", lambda *given, **of: drawn.append(of) or paper_figure(*given, **of))
    draw_figures(panels, spectra, "ebm", tmp_path)
    first = (tmp_path / "figure-7.svg").read_bytes()
    draw_figures(panels, spectra, "ebm", tmp_path)
    assert len(drawn) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["figure-7.svg"]
    for _ in range(2):
        draw_figures(panels, spectra, "ebm", tmp_path, ("svg", "png", "pdf"))
    assert len(drawn) == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["figure-7.pdf", "figure-7.png", "figure-7.svg"]
    assert (tmp_path / "figure-7.svg").read_bytes() == first
    changed = spectra[0].outcomes.copy()
    changed[0, 0] = 1
    draw_figures(panels, [replace(spectra[0], outcomes=changed), *spectra[1:]], "ebm", tmp_path)
    assert len(drawn) == 3
    assert [path.name for path in tmp_path.iterdir()] == ["figure-7.svg"]
    assert (tmp_path / "figure-7.svg").read_bytes() != first


def test_the_shipped_figure_shows_the_shipped_study():
    """`rockcheck spectrum --figure all --agreement 200` writes both; they are kept together."""
    found = Agreement.model_validate_json((KEPT / "agreement.json").read_text(encoding="utf-8"))
    panels = mapped([panel for figure in FIGURES for panel in paper_panels(figure)])
    assert stamp_in(KEPT / "models.svg").split()[0] == stamp_of(maps_shown(found, panels)).split()[0]


def test_studies_of_the_folder_come_first(tmp_path):
    folder = tmp_path / SPECTRA
    folder.mkdir()
    one = Refined(spectrum="mine", nodes=100, runs=7, wrong=3, areas=2, dimension=1.0)
    study = Refinement(date="2031-01-02", versions={"rockcheck": "0"}, grid="10 x 10", model="ebm", settings={}, spectra=(one,))
    (folder / "refinement.json").write_text(study.model_dump_json(), encoding="utf-8")
    text = write_page(tmp_path).read_text(encoding="utf-8")
    assert "Computed on 2031-01-02" in text
    assert "14.3 times fewer" in text
    assert "came with the package" not in text  # nor is agreement shown: there is none of the paper's figures


def test_the_documentation_shows_the_kept_studies():
    page = (Path(__file__).parents[2] / "docs" / "spectra.md").read_text(encoding="utf-8")
    shown = {tuple(cell.strip() for cell in line.strip("|").split("|")) for line in page.splitlines() if line.startswith("|")}
    agreement = Agreement.model_validate_json((KEPT / "agreement.json").read_text(encoding="utf-8"))
    refinement = Refinement.model_validate_json((KEPT / "refinement.json").read_text(encoding="utf-8"))
    assert {row[1:] for row in agreement.rows if row[0] == "all"} <= shown
    assert set(refinement.rows) <= shown
    assert len(refinement.spectra) == len({share.spectrum for share in agreement.shares}) == 28
    assert refinement.runs < refinement.nodes / 8
    assert all(share.nodes == 100 for share in agreement.shares if share.model not in PLAYED_SHARE)
    assert {share.model for share in agreement.shares} == set(CANDIDATES)


def test_the_documentation_tells_the_findings_of_the_kept_spectra():
    text = (Path(__file__).parents[2] / "docs" / "spectra.md").read_text(encoding="utf-8")
    shown = [line.strip("| \n").split(" | ") for line in text.partition("<!-- findings -->")[2].partition("<!-- end -->")[0].splitlines()]
    found = findings(kept_spectra())
    assert [row for row in shown if len(row) == 3][1:] == [[one.sentence, f"{one.case} (Fig. {one.figure})", one.words] for one in found]


def test_the_page_tells_the_findings_and_the_tally(tmp_path):
    data = tmp_path / SPECTRA
    data.mkdir()
    spectra = kept_spectra()
    panels = [panel for number in (6, 7, 8, 9) for panel in paper_panels(number)]
    one = spectra[0]
    request = SpectrumRequest(one.frequency_ratios, one.amplitude_ratios)
    coarse = [  # four nodes an axis: the histories that are kept beside them take their time
        dataclasses.replace(
            s,
            outcomes=s.outcomes[::33, ::33],
            frequency_ratios=s.frequency_ratios[::33],
            amplitude_ratios=s.amplitude_ratios[::33],
            undecided=s.undecided[:0],
        )
        for s in spectra
    ]
    save_spectra(panels, coarse, request, data)
    claims = [
        Claim(name=verdict, sentence=verdict, verdict=verdict, finding="", criterion="", figures=(6,), rows=())
        for verdict in ("holds", "holds", "holds in part")
    ]
    (data / "claims.json").write_text(Claims(grid="4 x 4", model="ebm", claims=tuple(claims)).model_dump_json(), encoding="utf-8")
    text = re.sub(r"\s+", " ", write_page(tmp_path).read_text(encoding="utf-8"))
    assert "Of 3 sentences of the paper 2 hold, 1 hold in part, 0 do not." in text
    assert all(one.words in text for one in findings(coarse))
    assert (data / "findings.svg").exists()
