"""The figure of a scene: all models over time, their differences, and impacts."""

import types

import numpy as np
import pytest

from rockcheck.reports import histories_figure
from rockcheck.reports.style import look_of
from rockcheck.reports.view import CHANNELS, PAPER_CHANNELS, Band, SceneView, scene_views
from rockcheck.validation.suite import results


@pytest.fixture(scope="module")
def view(site):
    run = results.Run.load(site)
    return next(view for view in scene_views(run, site) if view.name == "beside a wall")


@pytest.fixture(scope="module")
def figure(view):
    return histories_figure.histories_figure(view)


def test_it_fits_a_page_and_its_panels_can_be_read(figure):
    assert 5.0 < figure.get_figheight() < 10.0
    base, values, differences, *_ = (
        axes.get_position().height * figure.get_figheight() for axes in figure.axes
    )
    assert 0.3 < base < differences < values
    assert values > 0.7


def test_the_first_reference_is_drawn_wide_below_the_others_in_their_order(figure, view):
    (first, *others) = (
        line
        for line in figure.axes[1].lines
        if line.get_label() in [look.label for look in view.looks.values()]
    )
    assert first.get_label() == view.looks[view.figure_references[0]].label
    assert first.get_linewidth() > max(line.get_linewidth() for line in others)
    orders = [line.get_zorder() for line in (first, *others)]
    assert orders == sorted(set(orders))


def test_differences_stand_around_zero(figure):
    low, high = figure.axes[2].get_ylim()
    assert low == -high < 0.0
    ticks = figure.axes[2].get_yticks()
    assert 0.0 in ticks
    assert sorted(ticks) == pytest.approx(sorted(-ticks))


def test_impacts_have_a_row_a_model_and_a_key_inside(figure, view):
    tracks = figure.axes[-1]
    rows = {line.get_ydata()[0] for line in tracks.lines if len(line.get_ydata())}
    assert rows == set(range(len(view.histories)))
    (key,) = tracks.texts
    assert all(0.0 <= place <= 1.0 for place in key.get_position())
    top, bottom = tracks.get_ylim()[1], tracks.get_ylim()[0]
    assert top < 0.0 < len(view.histories) - 1 < bottom


def test_without_a_reference_differences_are_left_out(view, monkeypatch):
    monkeypatch.setattr(SceneView, "figure_references", property(lambda view: (None,)))
    assert len(histories_figure.histories_figure(view).axes) == 2 + len(PAPER_CHANNELS)


def test_a_tolerance_of_the_largest_difference_is_shaded(view, monkeypatch):
    band = Band(
        **{
            "model": "cm",
            "against": view.figure_references[0],
            "channel": "theta",
            "kind": "peak",
            "limit": 0.01,
            "until": 6.0,
        }
    )
    monkeypatch.setattr(SceneView, "bands", lambda view, against=None: (band,))
    figure = histories_figure.histories_figure(view)
    (shade,) = figure.axes[2].collections
    assert 0.05 < shade.get_alpha() < 0.5
    x, y = shade.get_paths()[0].vertices.T
    assert (x.min(), x.max(), y.min(), y.max()) == (0.0, 6.0, -0.01, 0.01)
    assert "tolerance" in [word.get_text() for word in figure.legends[0].texts]


@pytest.mark.parametrize(
    ("limits", "fine"),
    [([], 0.002), ([0.05], 0.05), ([0.002, 0.05], 0.002), ([0.001, 0.05], 0.05)],
)
def test_differences_are_linear_below_the_tightest_tolerance_that_shows(limits, fine):
    channel = next(channel for channel in CHANNELS if channel.name == "theta")
    view = types.SimpleNamespace(drawn={"cm": {"theta": np.array([0.1, np.nan, -2.0])}})
    bands = [types.SimpleNamespace(channel="theta", limit=limit) for limit in limits]
    bands.append(types.SimpleNamespace(channel="slip", limit=0.003))
    assert histories_figure.fineness(view, channel, bands) == fine


def test_a_thumbnail_is_all_curves():
    curves = [([0.0, 1.0], [0.0, 0.3], look_of("cm"))]
    (axes,) = histories_figure.thumbnail(curves).axes
    assert axes.get_position().bounds == (0.0, 0.0, 1.0, 1.0)
    assert not axes.axison
    (stepped,) = histories_figure.thumbnail(curves, step=True).axes
    assert stepped.get_ylim() == (0.0, 1.0)
    (flat,) = histories_figure.thumbnail([([0.0, 1.0], [0.0, 0.0], look_of("cm"))]).axes
    low, high = flat.get_ylim()
    assert low == -high < 0.0
