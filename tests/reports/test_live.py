"""What the scripts of a page are given of charts and spectra."""

import json
import math

import pytest

from rockcheck.reports import live
from rockcheck.validation.finding import Axis, Panel, Plot, Series

X = [1.0, 2.0, 4.0]


def chart(*series, **more):
    plot = Plot("p", panels=[Panel("", series)], **{"x": Axis("PGA"), "y": Axis("share"), **more})
    return live.live_data(plot)


def curve(*series):
    return chart(Series("a", x=X, y=[0.0, 0.5, 1.0]), *series)["curves"][-1]


def test_a_chart_has_its_axes_and_curves():
    found = chart(Series("a", x=X, y=[0.0, 0.5, 1.0]), x=Axis("PGA", log=True))
    assert found["intensities"] == X
    assert (found["across"], found["along"], found["log"]) == ("PGA", "share", True)
    (one,) = found["curves"]
    assert one["label"] == "a"
    assert one["values"] == [0.0, 0.5, 1.0]
    assert one["width"] == 2.0
    assert one["dash"] == []
    assert found["per_unit"] == 0.0
    assert chart(Series("a", x=X, y=X), data={"per_unit": 2.0})["per_unit"] == 2.0


@pytest.mark.parametrize(
    ("y", "limits", "ends"),
    [
        ([0.0, 0.5, 2.0], (0.1, 1.0), (0.1, 1.0)),
        ([0.0, 0.5, 2.0], None, (0.0, 2.1)),
        ([0.0, 2.0, math.inf], None, (0.0, 2.1)),
        ([0.0, None, 0.5], None, (0.0, 0.525)),
        ([0.0, 0.0, 0.0], None, (0.0, None)),
        ([None, None, None], None, (0.0, None)),
    ],
)
def test_an_axis_without_limits_ends_a_little_above_all(y, limits, ends):
    found = chart(Series("a", x=X, y=y), y=Axis("share", limits=limits))
    assert found["least"] == ends[0]
    assert found["most"] == (None if ends[1] is None else pytest.approx(ends[1]))


def test_a_fit_is_drawn_with_its_curve_and_not_with_thin_ones():
    fit = Series("a", x=X, y=[0.1, 0.4, 0.9], style="dots")
    (one,) = chart(Series("a", x=X, y=X), fit)["curves"]
    assert one["fit"] == [0.1, 0.4, 0.9]
    (other,) = chart(Series("b", x=X, y=X), fit)["curves"]
    assert other["fit"] == []
    found = chart(Series("a", x=X, y=X, style="thin"), fit)
    assert found["curves"][0]["fit"] == []
    assert found["curves"][0]["width"] < 1.0
    assert found["single"]
    assert not chart(Series("a", x=X, y=X), fit)["single"]


@pytest.mark.parametrize(("style", "dash"), [("dashed", [8, 4]), ("dotted", [2, 3]), ("line", [])])
def test_a_line_has_its_dashes(style, dash):
    assert curve(Series("b", x=X, y=X, style=style))["dash"] == dash


@pytest.mark.parametrize(
    ("style", "x", "y", "values"),
    [
        ("line", X, [1.0, 2.0, 3.0], [1.0, 2.0, 3.0]),
        ("line", [1.0, 3.0], [1.0, 3.0], [1.0, 2.0, None]),
        ("line", [2.0, 4.0], [1.0, 3.0], [None, 1.0, 3.0]),
        ("step", [2.0, 3.0], [1.0, 3.0], [None, 1.0, 3.0]),
        ("step", [1.0, 2.0, 3.0], [5.0, 1.0, 3.0], [5.0, 1.0, 3.0]),
        ("line", [], [], [None, None, None]),
        ("line", X, [1.0, None, math.inf], [1.0, None, None]),
    ],
)
def test_a_curve_has_values_on_the_axis_of_the_first(style, x, y, values):
    assert curve(Series("b", x=x, y=y, style=style))["values"] == values


def test_what_fell_is_told_and_numbers_are_short():
    one = curve(Series("b", x=X, y=[1 / 3, math.inf, 2.0], low=[0.123456789] * 3, high=X))
    assert one["fell"] == [1]
    assert one["values"] == [0.33333, None, 2.0]
    assert one["low"] == [0.12346] * 3


def test_a_spectrum_s_letters_are_told_by_their_runs(tmp_path):
    panel = {"title": "t", "free": True, "nodes": [], "outcomes": "SSLSSSSSSSSSSU", "more": 1}
    plot = Plot("s", kind="spectra", data={"panels": [panel], "record": False}, played={"a": 1})
    scripts = live.write_scripts(plot, tmp_path)
    assert "figures/s.nodes.js" in scripts
    said = (tmp_path / "s.nodes.js").read_text("utf-8")
    data = json.loads(said.partition('["s"] = ')[2].rstrip().rstrip(";"))
    assert data["panels"] == [{"title": "t", "free": True, "nodes": [], "outcomes": "2S1L10S1U"}]
    assert '"a":1' in (tmp_path / "s.histories.js").read_text("utf-8").replace(" ", "")
