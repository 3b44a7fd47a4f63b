"""What the index of a run says of each model."""

import math

import pytest

from rockcheck.reports import overview
from rockcheck.validation.discrepancy import figures
from rockcheck.validation.uncertainty.numerical import Numerical, Quantity


def rms(value, against, *, until=None):
    window = f"{until:g}s" if until else ""
    return figures.Figure(
        measure="theta_rms",
        label="RMS",
        unit="alpha",
        value=value,
        against=against,
        window=window,
        until=until,
    )


@pytest.fixture
def entry(run):
    """The entry of MuJoCo beside a wall, with changes of its cell, and of the reference's."""

    def make(reference=None, **changes):
        cells = dict(run.by_scene["beside a wall"])
        cells["mujoco"] = cells["mujoco"].model_copy(update=changes)
        if reference:
            cells[run.reference] = cells[run.reference].model_copy(update=reference)
        return overview.entry(run, cells, "mujoco")

    return make


def test_the_rms_is_that_of_the_shortest_window_against_the_reference(entry, run):
    of_the_whole = rms(0.3, run.reference)
    shortest = rms(0.2, run.reference, until=4.0)
    others = [
        rms(0.1, "cm", until=2.0),
        rms(None, run.reference, until=1.0),
        rms(0.4, run.reference, until=8.0),
        of_the_whole.model_copy(update={"measure": "x_rms", "until": 1.0}),
    ]
    found = entry(figures=(of_the_whole, *others, shortest))
    assert found.rms == shortest
    assert found.whole == of_the_whole


def test_a_numerical_uncertainty_is_that_of_the_whole_time(entry, run):
    quantity = Quantity(name="theta_rms", unit="alpha", value=0.3, u_num=0.01, verdict="converged")
    known = Numerical(method="made up", quantities=(quantity,))
    whole, windowed = rms(0.3, run.reference), rms(0.2, run.reference, until=4.0)
    assert entry(figures=(whole,), numerical=known).u_num == 0.01
    assert entry(figures=(windowed,), numerical=known).u_num is None
    assert entry(figures=(whole,), numerical=None).u_num is None


@pytest.mark.parametrize(
    ("changes", "reference", "apart"),
    [
        ({"outcome": "overturned left"}, {}, True),
        ({"outcome": "overturned left", "status": "failed"}, {}, False),
        ({"outcome": "overturned left"}, {"outcome": "overturned left"}, False),
        ({"outcome": "overturned left"}, {"outcome": "overturned right"}, True),
        ({"outcome": "at rest"}, {"outcome": "moving"}, False),
    ],
)
def test_two_runs_are_apart_where_one_falls_or_to_another_side(changes, reference, apart, entry):
    assert entry(reference, **changes).apart == apart


@pytest.mark.parametrize(
    ("values", "ends"),
    [([0.3], (0.1, 1.0)), ([0.02, 0.5], (0.01, 1.0)), ([0.11, 0.9], (0.01, 10.0))],
)
def test_axes_end_at_powers_of_ten_with_room(values, ends):
    assert overview.decades(values) == pytest.approx(ends)
    assert math.log10(overview.decades(values)[1]) % 1.0 == pytest.approx(0.0)
