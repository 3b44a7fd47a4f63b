"""Lines over axes, strips of points, and the table of stable steps, as figures."""

import math

import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from rockcheck.reports import line_plots
from rockcheck.validation.finding import Axis, Panel, Plot, Series

TRIED = [1e-2, 1e-3, 1e-4, 1e-5]


def line(label="a", **more):
    return Series(label, x=[0.0, 1.0, 2.0], y=[0.0, 1.0, 4.0], **more)


def panels(count):
    return [Panel(f"panel {n}", [line()]) for n in range(count)]


@pytest.mark.parametrize(("count", "shape"), [(1, (1, 1)), (4, (2, 3))])
def test_three_panels_stand_beside_each_other(count, shape):
    figure = line_plots.lines(Plot("p", panels=panels(count), x=Axis("t"), y=Axis("peak")))
    spec = figure.axes[0].get_subplotspec().get_gridspec()
    assert (spec.nrows, spec.ncols) == shape
    assert sum(ax.axison for ax in figure.axes) == count
    assert [ax.get_title("left") or ax.get_title() for ax in figure.axes[:count]] == [
        f"panel {n}" for n in range(count)
    ]
    labelled = [bool(ax.get_ylabel()) for ax in figure.axes[:count]]
    assert labelled == [n % shape[1] == 0 for n in range(count)]


def test_an_axis_above_has_another_unit():
    data = {"per_unit": 4.0, "other_unit": "Hz", "other_label": "frequency, Hz"}
    figure = line_plots.lines(Plot("p", panels=panels(1), x=Axis("x", limits=(1, 3)), data=data))
    figure.draw_without_rendering()
    (above,) = figure.axes[0].child_axes
    assert above.get_xlabel() == "frequency, Hz"
    assert above.get_xlim() == pytest.approx((4.0, 12.0))
    there, back = above._functions
    assert back(there(3.0)) == 3.0


def test_axes_have_their_scale_limits_and_words():
    y = Axis("y", log=True, limits=(0.1, 10.0), ticks={1.0: "one"})
    (axes,) = line_plots.lines(Plot("p", panels=panels(1), x=Axis("x"), y=y)).axes
    assert (axes.get_xscale(), axes.get_yscale()) == ("linear", "log")
    assert axes.get_ylim() == (0.1, 10.0)
    assert [word.get_text() for word in axes.get_yticklabels()] == ["one"]


@pytest.mark.parametrize(
    ("most", "words"), [(9.0, ["0.2", "0.5", "1", "2", "5"]), (90.0, ["1", "10"])]
)
def test_a_logarithmic_axis_below_two_powers_of_ten_names_what_is_between(most, words):
    axis = Axis("x", log=True, limits=(0.15, most))
    (axes,) = line_plots.lines(Plot("p", panels=panels(1), x=axis)).axes
    axes.figure.draw_without_rendering()
    shown = [
        label.get_text()
        for place, label in zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)
        if 0.15 <= place <= most
    ]
    assert shown == words


def test_a_band_stands_around_its_line_and_a_level_goes_across():
    series = [line(low=[0.0, 0.5, 3.0], high=[0.5, 2.0, 5.0]), Series("b", y=[2.0], style="level")]
    (axes,) = line_plots.lines(Plot("p", panels=[Panel("", series)])).axes
    (band,) = (one for one in axes.collections if isinstance(one, PolyCollection))
    assert band.get_datalim(axes.transData).bounds == (0.0, 0.0, 2.0, 5.0)
    assert list(axes.lines[1].get_ydata()) == [2.0, 2.0]


def test_a_legend_names_each_label_once_and_none_of_what_is_thin():
    series = [line("a"), line("a", style="dots"), line("b"), line("c", style="thin")]
    figure = line_plots.lines(Plot("p", panels=[Panel("", series)] * 2))
    assert [word.get_text() for word in figure.legends[0].texts] == ["a", "b"]
    unnamed = Plot("p", panels=[Panel("", [line("")])])
    assert line_plots.lines(unnamed).legends == []


def test_series_of_one_label_share_a_colour_and_thin_ones_are_grey():
    series = [line("a"), line("b"), line("a", style="dots"), line("c", style="thin")]
    first, second, again, thin = line_plots.colours(Panel("", series))
    assert first == again != second
    assert thin == line_plots.GREY


def test_a_strip_shows_each_run_and_the_middle_of_them():
    values = [0.3, 0.1, 0.2, 0.5, 0.4]
    figure = line_plots.strips(Plot("p", data=[{"label": "one", "values": values}] * 2))
    assert len(figure.axes) == 2
    axes = figure.axes[0]
    median, points = axes.lines
    assert list(median.get_xdata()) == [0.3, 0.3]
    assert list(points.get_xdata()) == sorted(values)
    beside = points.get_ydata()
    assert np.all(np.abs(beside) < axes.get_ylim()[1])
    assert np.all(np.diff(beside) != 0.0)
    (bar,) = axes.patches
    assert bar.get_x() == pytest.approx(np.quantile(values, 0.16))
    assert bar.get_width() == pytest.approx(np.quantile(values, 0.84) - np.quantile(values, 0.16))
    assert axes.get_xlim()[0] == 0.0
    assert 0.5 < axes.get_xlim()[1] < 0.6
    assert 0.5 < figure.subplotpars.hspace < 1.5


def test_stable_steps_are_colours_and_numbers():
    steps = [[1e-2, 1e-4, 1e-5], [0.0, math.nan, 1e-3]]
    data = {"tried": TRIED, "models": ["a", "b"], "panels": [("mass", [1.0, 2.0, 3.0], steps)] * 4}
    figure = line_plots.stable_steps(Plot("p", data=data))
    assert len(figure.axes) == 4
    assert figure.get_figheight() < figure.get_figwidth()
    axes = figure.axes[0]
    assert [word.get_text() for word in axes.texts] == [
        *("0.01", "0.0001", "1e-05"),
        *("none", "", "0.001"),
    ]
    assert axes.images[0].get_clim() == (-5.0, -2.0)
    colours = [word.get_color() for word in axes.texts]
    assert [colours[k] for k in (0, 1, 3, 5)] == ["#1b1b1b"] * 4
    assert colours[2] == "w"
    assert axes.get_xlabel() == "mass"
    assert [word.get_text() for word in axes.get_yticklabels()] == ["a", "b"]
