"""Overturning spectra as figures."""

import pytest

from rockcheck.reports import spectrum_plots
from rockcheck.reports.spectrum_plots import LAW_MARK, OWN_MARK, spectra
from rockcheck.reports.style import PAGE
from rockcheck.validation.finding import Plot

G = 9.80665
X, Y = [1.0, 2.0, 3.0, 4.0], [2.0, 3.0, 4.0]


def panel(place, title="a", free=True, letters="S" * 12, **more):
    return {"place": place, "title": title, "free": free, "outcomes": letters, **more}


def drawn(*panels, **more):
    data = {
        "panels": panels,
        "record": False,
        "height": 4.0,
        "frequencies": X,
        "amplitudes": Y,
        "pulse": {"period": [0.5, 0.25], "amplitude": [6.0, 9.0]},
        **more,
    }
    return spectra(Plot("s", "Title", kind="spectra", data=data))


def test_one_panel_is_narrower_and_has_hertz_and_g():
    figure = drawn(panel((0, 1, 0)))
    (axes,) = figure.axes
    assert figure.get_figwidth() == pytest.approx(PAGE / 1.6)
    figure.draw_without_rendering()
    above, beside = axes.child_axes
    assert above.get_xlim() == pytest.approx((2.0, 8.0))
    assert beside.get_ylim() == pytest.approx((6.0 / G, 12.0 / G))
    for units in (above, beside):
        there, back = units._functions
        assert back(there(3.0)) == pytest.approx(3.0)


def test_several_panels_are_as_wide_as_a_page_and_have_ratios_alone():
    figure = drawn(panel((0, 1, 0)), panel((0, 1, 1)))
    assert figure.get_figwidth() == pytest.approx(PAGE)
    assert [axes.child_axes for axes in figure.axes] == [[], []]


def test_a_panel_without_a_wall_stands_midway_beside_two_rows():
    places = [(1, 2, 0), (0, 2, 1), (2, 2, 1), (0, 2, 2), (2, 2, 2)]
    figure = drawn(*map(panel, places))
    grid = figure.axes[0].get_subplotspec().get_gridspec()
    assert (grid.nrows, grid.ncols) == (4, 3)
    spans = [axes.get_subplotspec() for axes in figure.axes]
    assert [(s.rowspan.start, len(s.rowspan), s.colspan.start) for s in spans] == places
    assert [bool(axes.get_xlabel()) for axes in figure.axes] == [True, False, True, False, True]
    assert [bool(axes.get_ylabel()) for axes in figure.axes] == [True, True, True, False, False]


def test_axes_end_with_the_nodes_and_a_row_names_its_model():
    figure = drawn(panel((0, 1, 0), row="cm"), panel((0, 1, 1)))
    for axes in figure.axes:
        assert axes.get_xlim() == (1.0, 4.0)
        assert axes.get_ylim() == (2.0, 4.0)
    assert figure.axes[0].get_ylabel() == "CM"


@pytest.mark.parametrize(
    ("panels", "columns"), [([panel((0, 1, 0))], 2), ([panel((0, 1, k)) for k in (0, 1)], 4)]
)
def test_a_legend_is_as_wide_as_its_figure(panels, columns):
    (legend,) = drawn(*panels).legends
    assert legend._ncols == columns
    assert [word.get_text() for word in legend.texts] == [
        "safe",
        "overturned clockwise",
        "overturned counterclockwise",
    ]


def test_a_key_of_its_own_stands_below_each_other():
    (legend,) = drawn(panel((0, 1, 0), letters="T" * 12), key={"T": "stands", "F": "fell"}).legends
    assert legend._ncols == 1
    assert [word.get_text() for word in legend.texts] == ["stands", "fell"]


@pytest.mark.parametrize(("law", "rings"), [(None, 0), ([], 0), ([[1, 2], [0, 3]], 1)])
def test_nodes_that_depend_on_the_law_have_rings(law, rings):
    figure = drawn(panel((0, 1, 0), law=law))
    lines = figure.axes[0].lines
    assert len(lines) == rings
    if rings:
        assert lines[0].get_xydata().tolist() == [[3.0, 3.0], [4.0, 2.0]]
        assert figure.legends[0].texts[-1].get_text() == "depends on the impact law"


def test_marks_have_thin_edges():
    for mark in (LAW_MARK, OWN_MARK):
        assert 0.5 <= mark["markeredgewidth"] <= 1.0
        assert 3.0 <= mark["markersize"] <= 12.0


def test_a_record_has_its_own_axes():
    across, along = spectrum_plots.axis_labels(True)
    axes = drawn(panel((0, 1, 0)), panel((0, 1, 1)), record=True).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == (across, along)


@pytest.mark.parametrize(
    ("frees", "words"),
    [
        ([True], ["overturned clockwise", "overturned counterclockwise"]),
        ([False], ["overturned"]),
        (
            [True, False],
            ["no wall: overturned clockwise", "overturned; no wall: counterclockwise"],
        ),
    ],
)
def test_a_legend_says_what_colours_are_beside_a_wall(frees, words):
    key = spectrum_plots.outcome_key([{"free": free} for free in frees])
    assert [*key.values()] == ["safe", *words, "undecided"]
