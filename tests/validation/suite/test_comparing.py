"""A cell's history beside its references, from tables of rotations: hints, and laws of impacts."""

import numpy as np
import pytest

from rockcheck import Block, Floor, History, Rest, Scene, Wall
from rockcheck.validation.discrepancy.impact_laws import Landing
from rockcheck.validation.execute.models import Work
from rockcheck.validation.suite import comparing

T = np.linspace(0.0, 6.0, 601)
SCENE = Scene(
    name="s",
    block=Block(half_width=0.3, half_height=1.0),
    floor=Floor(friction=0.5),
    excitation=Rest(),
    duration=6.0,
    output_step=0.01,
)
#: At which the laws of impacts part: nothing follows of it here.
LANDING = Landing(t=5.0, start=0, parts=1000, branches={"closed": (0.0,) * 5})


@pytest.fixture
def swing(tmp_path):
    """A history that swings once to either side, at about 2 s."""

    def history(size=0.1, delay=0.0):
        later = T - 2.0 - delay
        path = tmp_path / f"{size}-{delay}.csv"
        rows = np.column_stack([T, size * np.exp(-(later**2)) * np.sin(4.0 * later)])
        np.savetxt(path, rows, delimiter=",", header="t,theta", comments="")
        return History.load(path)

    return history


def compared(history, reference, windows=(), *, landing=None, offset=None):
    """The comparison with a reference `r`, of a peak and an RMS difference in these windows."""
    measures = ["peak_ratio", "theta_rms"]
    wanted = {"r": dict.fromkeys(windows, measures)}
    ends = {window: float(window.removesuffix("s")) for window in windows if window}
    request = comparing.Request(SCENE, wanted, ends, landing, offset)
    return comparing.compare_cell(history, {"r": reference}, request)


# --- hints


def test_a_measured_history_that_starts_late_says_how_it_is_shifted(swing):
    reference = comparing.Reference(swing())
    (line,) = compared(swing(delay=0.4), reference, offset=0.1).hints
    assert line.startswith("against r: the measured history: shifted by -0.4 s")
    assert line.endswith("offset = -0.3")


def test_beside_a_measured_reference_it_is_the_reference_that_is_shifted(swing):
    reference = comparing.Reference(swing(delay=0.4), offset=0.1)
    (line,) = compared(swing(), reference).hints
    assert line.endswith("offset = -0.3")


def test_two_models_that_differ_have_no_hint(swing):
    assert compared(swing(delay=0.4), comparing.Reference(swing())).hints == ()


def test_a_measured_history_that_agrees_has_no_hint(swing):
    assert compared(swing(), comparing.Reference(swing()), offset=0.1).hints == ()


# --- laws of impacts


def figures_of(record):
    return {
        (one.figure.measure, one.figure.window): (one.figure.value, one.figure.note)
        for one in record.figures
    }


@pytest.fixture
def by_two_laws(swing):
    """Figures of a history whose reference swings half as far, and as far under another law."""
    reference = comparing.Reference(swing(0.05), {"open": swing(0.1)})
    return figures_of(compared(swing(0.1), reference, ("", "4s"), landing=LANDING))


def test_a_peak_is_compared_under_the_nearest_law_which_is_named(by_two_laws):
    value, note = by_two_laws["peak_ratio", ""]
    assert value == pytest.approx(1.0)
    assert 'impacts = "open"' in note


def test_before_the_laws_part_there_is_the_reference_s_own_alone(by_two_laws):
    value, note = by_two_laws["peak_ratio", "4s"]
    assert value == pytest.approx(2.0)
    assert note == ""


def test_histories_are_compared_under_the_reference_s_own_law(by_two_laws):
    value, _ = by_two_laws["theta_rms", ""]
    assert value > 0.01


def test_without_a_landing_the_other_laws_do_not_matter(swing):
    reference = comparing.Reference(swing(0.05), {"open": swing(0.1)})
    value, _ = figures_of(compared(swing(0.1), reference, ("",)))["peak_ratio", ""]
    assert value == pytest.approx(2.0)


# The reference under the other laws of impacts

SHORT = SCENE.replace(duration=0.02)


@pytest.mark.parametrize(
    ("walls", "laws"),
    [
        ((), {"leading-first", "trailing-first"}),
        (
            (Wall(side="left", gap=0.1),),
            {"floor-first", "leading-first", "trailing-first"},
        ),
    ],
)
def test_a_model_with_a_choice_of_law_is_played_under_the_others(walls, laws):
    reference = Work(label="r", family="ebm-unilateral")
    histories = comparing.histories_under_other_laws(SHORT.replace(walls=walls), reference)
    assert set(histories) == laws


@pytest.mark.parametrize("family", ["ebm", "cm", "planted:Planted"])
def test_a_model_without_a_choice_of_law_is_not_played_again(family):
    reference = Work(label="r", family=family)
    assert comparing.histories_under_other_laws(SHORT, reference) == {}
