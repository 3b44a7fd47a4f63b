"""The folder of a study: what is written, and what goes."""

import json

import pytest

from rockcheck.reports import document, style
from rockcheck.validation.finding import Axis, Column, Finding, Panel, Plot, Series, Table


def plot(name="curve", last=1.0, **more):
    series = Series("a", x=[0.0, 1.0], y=[0.0, last])
    return Plot(name, "A curve", panels=[Panel("", [series])], x=Axis("t"), y=Axis("x"), **more)


@pytest.fixture
def drawn(monkeypatch):
    """The names of figures that are drawn, in place of drawing them."""
    names = []

    def draw(data, path, stamp=""):
        names.append(path.name)
        path.write_text(f"<?xml version='1.0'?>\n<dc:identifier>{stamp}</dc:identifier>\n")

    monkeypatch.setattr(document, "_draw", draw)
    monkeypatch.setattr(
        document, "side_by_side", lambda calls: [one.function(*one.arguments) for one in calls]
    )
    return names


def found(*blocks, **more):
    return Finding("study", "A study", "all is well", blocks, **more)


TABLE = Table("numbers", [Column("a")], [[1.5]])


def test_a_study_is_written_whole(tmp_path, drawn):
    files = {"cases/a.toml": "a = 1\n", "b.bin": b"b"}
    page = document.publish(found(TABLE, plot(), files=files), tmp_path)
    assert page == tmp_path / "index.html"
    assert (tmp_path / "numbers.csv").read_text("utf-8") == "a\n1.5\n"
    assert (tmp_path / "cases" / "a.toml").read_text("utf-8") == "a = 1\n"
    assert json.loads((tmp_path / "run.json").read_text("utf-8"))["answer"] == "all is well"
    assert drawn == ["curve.svg"]


def test_a_figure_is_drawn_again_where_it_shows_other_things(tmp_path, drawn):
    document.publish(found(plot()), tmp_path)
    document.publish(found(plot()), tmp_path)
    assert drawn == ["curve.svg"]
    document.publish(found(plot(last=2.0)), tmp_path)
    assert drawn == ["curve.svg"] * 2


def test_a_figure_goes_with_its_data_but_not_one_that_somebody_drew(tmp_path, drawn):
    document.publish(found(plot("one"), plot("two"), TABLE), tmp_path)
    own = tmp_path / "figures" / "two.svg"
    own.write_text(f"<dc:identifier>mine {style.drawn_by()}</dc:identifier>")
    (tmp_path / "numbers.svg").write_text((tmp_path / "figures" / "one.svg").read_text())
    document.publish(found(), tmp_path)
    assert [path.name for path in (tmp_path / "figures").iterdir()] == ["two.svg"]
    assert (tmp_path / "numbers.svg").exists()


@pytest.mark.usefixtures("drawn")
@pytest.mark.parametrize(("live", "kind"), [(True, "lines"), (False, "lines"), (True, "strips")])
def test_charts_that_are_read_under_the_pointer_have_their_data(live, kind, tmp_path):
    shown = plot(live=live) if kind == "lines" else plot(live=live, kind=kind, data=[])
    page = document.publish(found(shown), tmp_path).read_text("utf-8")
    is_live = live and kind == "lines"
    assert (tmp_path / "curves.js").exists() == is_live
    assert ("curves.js" in page) == is_live


@pytest.mark.usefixtures("drawn")
@pytest.mark.parametrize("live", [True, False])
def test_only_a_live_spectrum_has_scripts(live, tmp_path):
    panel = {"title": "t", "free": True, "nodes": [], "outcomes": "SSLS"}
    data = {"panels": [panel], "record": False}
    shown = Plot("s", kind="spectra", data=data, played={}, live=live)
    page = document.publish(found(shown), tmp_path).read_text("utf-8")
    assert ("s.nodes.js" in page) == live
    assert (tmp_path / "figures" / "s.nodes.js").exists() == live


@pytest.mark.usefixtures("drawn")
@pytest.mark.parametrize(
    ("above", "of_run", "linked"),
    [(False, False, False), (True, False, True), (False, True, True)],
)
def test_a_page_leads_to_that_of_the_run_above(above, of_run, linked, tmp_path):
    if above:
        (tmp_path / "index.html").write_text("a run")
    page = document.publish(found(), tmp_path / "study", of_run=of_run)
    assert ('href="../index.html"' in page.read_text("utf-8")) == linked


def test_a_figure_that_is_not_there_is_refused(tmp_path, drawn, fault_of):
    document.publish(found(plot()), tmp_path)
    fault = fault_of(document.write_figure, tmp_path, "curves", tmp_path / "a.svg")
    assert "curve" in str(fault)
