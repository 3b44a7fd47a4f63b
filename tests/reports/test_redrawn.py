"""A study's figures for print: drawn anew from the data beside them."""

import json
import re

import pytest

from rockcheck.commands.cli import main
from rockcheck.reports.document import FIGURES, publish
from rockcheck.validation.finding import Axis, Column, Finding, Panel, Plot, Series, Table

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
def study(tmp_path):
    folder = tmp_path / "study"
    folder.mkdir()
    publish(Finding("made", "Made up", "Two figures.", PLOTS), folder)
    return folder


def unstamped(svg: bytes) -> bytes:
    return re.sub(rb" *<dc:identifier>.*\n", b"", svg)


@pytest.mark.parametrize("name", ["curves", "strips"])
def test_it_is_the_figure_of_the_page_in_any_format(study, tmp_path, name):
    assert {path.suffix for path in (study / FIGURES).iterdir()} == {".svg", ".json"}
    assert b"only the page" not in (study / FIGURES / f"{name}.json").read_bytes()
    for ending, begins in ((".svg", b"<?xml"), (".png", b"\x89PNG"), (".pdf", b"%PDF")):
        path = tmp_path / f"one{ending}"
        assert main(["report", str(study), "--scene", name, "-o", str(path)]) == 0
        assert path.read_bytes().startswith(begins)
    shown = (study / FIGURES / f"{name}.svg").read_bytes()
    assert (tmp_path / "one.svg").read_bytes() == unstamped(shown) != shown
    page = (study / "index.html").read_text(encoding="utf-8")
    assert f"rockcheck report DIR --scene {name} -o {name}.pdf" in page


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ([], "curves.json: no data of a figure: ValidationError"),
        ({"name": "a", "panels": "b"}, "curves.json: no data of a figure: ValidationError"),
        ({"name": "a", "kind": "spectra"}, "curves.json: no data of a figure: TypeError"),
    ],
)
def test_data_that_is_no_figure_is_refused_in_one_line(study, refused, data, said):
    (study / FIGURES / "curves.json").write_text(json.dumps(data), encoding="utf-8")
    assert said in refused("report", str(study), "--scene", "curves", "-o", "a.svg")


def test_an_unknown_figure_is_named(study, refused):
    said = refused("report", str(study), "--scene", "curve", "-o", "a.svg")
    assert "unknown figure 'curve'; did you mean 'curves'? allowed: curves, strips" in said
    assert "--output: needs one --scene NAME" in refused("report", str(study), "-o", "a.svg")


def test_a_figure_that_takes_too_long_is_ended(study, refused, monkeypatch):
    monkeypatch.setattr("rockcheck.reports.document.DRAWING", 1e-3)
    said = refused("report", str(study), "--scene", "curves", "-o", "a.svg")
    assert "did not end within 0.001 s" in said


def test_the_folder_holds_one_run(tmp_path):
    """Tables and figures of the run before are gone; files of the user's stay."""
    (tmp_path / "mine.csv").write_text("a\n", encoding="utf-8")
    first, second = (Table(name, [Column("a")], [[1.0]]) for name in ("gaps", "runs"))
    publish(Finding("made", "Made up", "", [first, second, *PLOTS]), tmp_path)
    publish(Finding("made", "Made up", "", [second, PLOTS[1]]), tmp_path)
    assert {path.stem for path in tmp_path.glob("*.csv")} == {"mine", "runs"}
    assert {path.stem for path in (tmp_path / FIGURES).iterdir()} == {"strips"}


def test_no_other_file_is_taken_for_one_of_the_run_before(tmp_path):
    """As nobody but a stranger writes run.json, or a user keeps figures of his own."""
    folder = tmp_path / "sub"
    (folder / FIGURES).mkdir(parents=True)
    rows = [{"a": 1.0}]
    said = {"tables": {"../mine": rows, "own": rows, "empty": [], "odd": {"a": 1}}}
    (folder / "run.json").write_text(json.dumps(said), encoding="utf-8")
    mine = [tmp_path / "mine.csv", *(folder / f"{name}.csv" for name in ("empty", "odd"))]
    mine += [folder / FIGURES / name for name in ("a.json", "a.svg", "b.json")]
    for path in mine:
        path.write_text("a\n", encoding="utf-8")
    (folder / "own.csv").write_text("b,a\n", encoding="utf-8")
    publish(Finding("made", "Made up", ""), folder)
    assert all(path.exists() for path in (*mine, folder / "own.csv"))
