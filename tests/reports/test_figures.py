"""Figures: of the spectra, and a study's for print, drawn anew from the data beside them."""

import json
import math
import re

import numpy as np
import pytest
import whole_runs
from cases import kept_spectra
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from rockcheck import Sine, Spectrum, load_scene
from rockcheck.reports.document import FIGURES, publish
from rockcheck.reports.drawers import figure_of
from rockcheck.reports.manifest import hash_of
from rockcheck.reports.spectrum_plots import LAW_MARK, OUTCOMES, draw_spectrum, own_label
from rockcheck.reports.style import power_of_ten
from rockcheck.scenes import reading
from rockcheck.validation.finding import (
    Axis,
    Column,
    Finding,
    Panel,
    Plot,
    Series,
    Table,
    plain,
)
from rockcheck.validation.paper import KEPT, Panel as Case, paper_panels
from rockcheck.validation.paper.findings import findings_of
from rockcheck.validation.paper.spectra import Paper
from rockcheck.validation.paper.tables import finding_blocks
from rockcheck.validation.studies.spectrum.agreement import CANDIDATES, PLAYED_SHARE, mapped
from rockcheck.validation.studies.spectrum.agreement_blocks import agreement_blocks
from rockcheck.validation.studies.spectrum.study import Spectra
from rockcheck.validation.studies.spectrum.tiles import Played, Request

SIZE = 12


def plot_of(*panels, letter="R", ranges=()):
    study = Spectra(panels, Request(SIZE, *ranges))
    done = {task: Played(letter * len(task.amplitudes)) for task in study.tasks({})}
    return next(study.gather(done).plots())


def labels(figure):
    (legend,) = figure.legends
    return [text.get_text() for text in legend.texts]


@pytest.mark.parametrize(("panel", "overturned"), [(0, "clockwise"), (1, "overturned")])
def test_the_papers_colours(panel, overturned):
    spectrum = Spectrum(
        outcomes=np.repeat([0, 1, -1], [6, 3, 3]).astype(np.int8)[:, None] * np.ones(SIZE, np.int8),
        frequency_ratios=np.linspace(0.5, 8.0, SIZE),
        amplitude_ratios=np.linspace(1.0, 12.0, SIZE),
        evaluations=SIZE * SIZE,
        undecided=np.zeros((0, 2), dtype=np.int64),
        scene=paper_panels(8)[panel].scene,
        model=None,
    )
    axes = Figure().subplots()
    draw_spectrum(spectrum, axes)
    (mesh,) = axes.collections
    axes.figure.draw_without_rendering()
    colours = mesh.get_facecolor().reshape(SIZE, SIZE, 4)[[0, 7, 11], 0]
    np.testing.assert_allclose(
        colours, [to_rgba(OUTCOMES[name]) for name in ("safe", overturned, "counterclockwise")]
    )


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


def test_the_pulse_of_ones_own_scene_is_marked_and_none_in_the_papers_figures():
    scene = load_scene("rack").replace(excitation=Sine(amplitude=6.0, period=0.8))
    own = [
        2.0 * math.pi / 0.8 / scene.frequency_parameter,
        6.0 / (scene.gravity * scene.block.slope),
    ]
    figure = figure_of(plot_of(Case("rack", "Rack", scene), ranges=((1.0, 8.0), (1.0, 4.0))))
    (star,) = figure.axes[0].lines
    np.testing.assert_allclose(star.get_xydata(), [own])
    assert own_label(record=False) in labels(figure)
    assert [axes for axes in figure_of(plot_of(*paper_panels(8))).axes if axes.lines] == []


def test_the_documentation_shows_the_kept_study():
    found = reading.read_json(KEPT / "agreement.json")
    panels = mapped(paper_panels())
    _, table, by_spectrum, plot = agreement_blocks(found, panels, came_with_package=True)
    assert [list(map(plain, row)) for row in table.rows] == [
        list(map(plain, row)) for row in whole_runs.load("spectrum").table("agreement").rows
    ]
    assert len({row[0] for row in by_spectrum.rows}) == 28
    assert [
        share
        for share in found["shares"]
        if share["model"] not in PLAYED_SHARE and share["nodes"] != 100
    ] == []
    assert {share["model"] for share in found["shares"]} == set(CANDIDATES)
    assert len(figure_of(plot).axes) == len(panels) * len(found["maps"])


def test_a_map_of_each_finding():
    paper = Paper(kept_spectra())
    found = findings_of(paper)
    _, plot, rows = finding_blocks(paper, found)
    letters = [panel["outcomes"] for panel in plot.data["panels"]]
    assert [(one.count("G"), one.count("X")) for one in letters] == [
        (one.gained.sum(), one.lost.sum()) for one in found
    ]
    assert len(figure_of(plot).axes) == 3
    assert len(rows.rows) == sum(len(one.evidence) for one in found)


PLOTS = [
    Plot(
        "curves",
        panels=[Panel("peak", [Series("ebm", [1.0, 2.0], [0.1, None], look="ebm")])],
        x=Axis("gap, m", log=True, ticks={1.0: "one", 2.0: "two"}),
        y=Axis("theta, alpha", limits=(0.0, 1.0)),
        played=["much that only the page shows"],
    ),
    Plot("strips", kind="strips", data=[{"label": "slip, m", "values": [0.1, 0.2, 0.4]}]),
]


@pytest.fixture
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    return publish(Finding("made", "Made up", "Two figures.", PLOTS), folder).parent


@pytest.mark.parametrize("name", ["curves", "strips"])
def test_it_is_the_figure_of_the_page_in_any_format(study, tmp_path, typed, name):
    assert {path.suffix for path in (study / FIGURES).iterdir()} == {".svg", ".json"}
    assert b"only the page" not in (study / FIGURES / f"{name}.json").read_bytes()
    for ending, begins in ((".svg", b"<?xml"), (".png", b"\x89PNG"), (".PDF", b"%PDF")):
        path = tmp_path / f"one{ending}"
        typed("report", str(study), "--scene", name, "-o", str(path))
        assert path.read_bytes().startswith(begins)
    shown = (study / FIGURES / f"{name}.svg").read_bytes()
    unstamped = re.sub(rb" *<dc:identifier>.*\n", b"", shown)
    assert (tmp_path / "one.svg").read_bytes() == unstamped != shown
    assert f"rockcheck report {study.name} --scene {name} -o {name}.pdf" in (
        study / "index.html"
    ).read_text("utf-8")


@pytest.mark.parametrize(
    ("data", "words", "said"),
    [
        *(
            ({"curves": data}, "--scene curves", f"curves.json: no data of a figure: {error}")
            for data, error in (
                ([], "ValidationError"),
                ({"name": "a", "panels": "b"}, "ValidationError"),
                ({"name": "a", "kind": "spectra"}, "TypeError"),
            )
        ),
        (
            {},
            "--scene curve",
            "unknown figure 'curve'; did you mean 'curves'? allowed: curves, strips",
        ),
        ({}, "", "--output: needs one --scene NAME"),
    ],
)
def test_what_is_no_figure_is_refused_in_one_line(study, refused, data, words, said):
    for name, content in data.items():
        (study / FIGURES / f"{name}.json").write_text(json.dumps(content), "utf-8")
    assert said in refused("report", str(study), *words.split(), "-o", "a.svg")


@pytest.mark.parametrize(
    ("exponent", "label"), [(-12, "10⁻¹²"), (-1, "0.1"), (0, "1"), (3, "1000"), (4, "10⁴")]
)
def test_a_power_of_ten_is_plain_near_one(exponent, label):
    assert power_of_ten(10.0**exponent) == label


def test_a_figure_that_takes_too_long_is_ended(study, refused, monkeypatch):
    monkeypatch.setattr("rockcheck.reports.document.DRAWING", 1e-3)
    assert "did not end within 0.001 s" in refused(
        "report", str(study), "--scene", "curves", "-o", "a.svg"
    )


def test_the_folder_holds_one_run_and_files_of_the_users(tmp_path):
    (tmp_path / "mine.csv").write_text("a\n", "utf-8")
    first, second = (Table(name, [Column("a")], [[1.0]]) for name in ("gaps", "runs"))
    publish(
        Finding("made", "Made up", "", [first, second, *PLOTS], files={"a.csv": "b\n"}), tmp_path
    )
    publish(Finding("made", "Made up", "", [second, PLOTS[1]], files={"b.csv": "b\n"}), tmp_path)
    assert {path.stem for path in tmp_path.glob("*.csv")} == {"mine", "runs", "b"}
    assert {path.stem for path in (tmp_path / FIGURES).iterdir()} == {"strips"}


def test_no_other_file_is_taken_for_one_of_the_run_before(tmp_path):
    """As nobody but a stranger writes run.json, or a user keeps figures of his own."""
    folder = tmp_path / "sub"
    (folder / FIGURES).mkdir(parents=True)
    said = dict.fromkeys(("../mine.csv", "own.csv"), hash_of("a\n")) | dict.fromkeys(
        ("empty.csv", "figures/a.json"), hash_of("b\n")
    )
    (folder / "run.json").write_text(json.dumps({"files": said | {"sub": ""}}), "utf-8")
    mine = [
        tmp_path / "mine.csv",
        *(folder / f"{name}.csv" for name in ("empty", "odd")),
        *(folder / FIGURES / name for name in ("a.json", "a.svg", "b.json")),
    ]
    for path in mine:
        path.write_text("a\n", "utf-8")
    (folder / "own.csv").write_text("b,a\n", "utf-8")
    publish(Finding("made", "Made up", ""), folder)
    for path in (*mine, folder / "own.csv"):
        assert path.exists()
