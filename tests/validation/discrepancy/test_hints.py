"""A sign turned or a shift in time is named where it explains a large difference."""

import numpy as np
import pytest

from rockcheck.scenes import History
from rockcheck.validation.discrepancy import hints
from rockcheck.validation.suite.runner import run_suite
from rockcheck.validation.suite.suites import load_suite

SUITE = """
reference = "ebm"
[models.ebm]
[models.table]
model = "measured"
files = { tilt = "table.csv" }
offset = 0.1
[[scene]]
name = "tilt"
duration = 3.0
initial_rotation = 0.1
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.9 }
"""


def pulse(t: np.ndarray, delay: float = 0.0, width: float = 1.0) -> np.ndarray:
    """A rotation that swings once to either side, rad."""
    return 0.1 * np.exp(-((t - 2.0 - delay) ** 2) / width) * np.sin(4.0 * (t - 2.0 - delay))


@pytest.fixture
def table(tmp_path):
    """A function that writes a table of times and rotations, and reads it as a history."""

    def written(name: str, theta: np.ndarray, t: np.ndarray) -> History:
        path = tmp_path / name
        np.savetxt(path, np.column_stack([t, theta]), delimiter=",", header="t,theta", comments="")
        return History.load(path)

    return written


T = np.linspace(0.0, 6.0, 601)


def test_a_turned_sign_is_named(table):
    found = hints.hint(table("a.csv", pulse(T), T), table("b.csv", -pulse(T), T))
    assert found.sentence("the candidate", "") == (
        "the candidate's rotation has the other sign: turned, it is within 0 rad (RMS)"
    )


def test_a_late_start_is_named(table):
    found = hints.hint(table("a.csv", pulse(T), T), table("b.csv", pulse(T, delay=0.4), T))
    assert not found.turned
    assert found.shift == pytest.approx(-0.4, abs=1e-3)
    assert found.within < 1e-3
    assert found.sentence("the candidate", "--align -0.4").startswith(
        "the candidate: shifted by -0.4"
    )


def test_both_together_are_named(table):
    found = hints.hint(table("a.csv", pulse(T), T), table("b.csv", -pulse(T, delay=0.4), T))
    assert found.turned
    assert found.shift == pytest.approx(-0.4, abs=1e-3)


@pytest.mark.parametrize(
    "theta",
    [
        1.5 * pulse(T),
        pulse(T, width=3.0),
        pulse(1.2 * T),
        np.zeros(601),
        0.1 * np.random.default_rng(1).standard_normal(601),
    ],
    ids=["larger", "longer", "quicker", "still", "noise"],
)
def test_another_motion_has_no_hint(table, theta):
    assert hints.hint(table("a.csv", pulse(T), T), table("b.csv", theta, T)) is None


def test_a_shift_that_leaves_only_the_rest_to_compare_is_no_hint(table):
    """Shifted by more than the motion lasts, two histories at rest agree."""
    late = np.where(T > 3.0, 0.1 * np.sin(9.0 * (T - 3.0)), 0.0)
    early = np.where(T < 3.0, 0.1 * np.sin(5.0 * (3.0 - T)), 0.0)
    assert hints.hint(table("a.csv", early, T), table("b.csv", late, T)) is None


def test_what_agrees_has_no_hint(table):
    assert hints.hint(table("a.csv", pulse(T), T), table("b.csv", 1.05 * pulse(T), T)) is None


@pytest.mark.parametrize(("share", "explains"), [(0.88, True), (0.8, False)])
def test_a_change_explains_what_falls_below_a_tenth_of_what_it_was(table, share, explains):
    """A turned sign leaves 0.12 of 1.88, or 0.2 of 1.8."""
    found = hints.hint(table("a.csv", pulse(T), T), table("b.csv", -share * pulse(T), T))
    assert (found is not None) == explains


def test_beside_a_reference_that_stands_there_is_no_hint(table):
    still = table("a.csv", np.zeros(601), T)
    assert hints.hint(still, table("b.csv", pulse(T), T)) is None


def test_two_rows_are_enough(table):
    t, theta = np.array([0.0, 1.0]), np.array([0.1, 0.2])
    assert hints.hint(table("a.csv", theta, t), table("b.csv", -theta, t)).turned


def test_a_shift_that_leaves_less_than_half_of_the_time_is_no_hint(table):
    """The whole motion is left, in a third of the time."""
    reference = table("a.csv", pulse(T, delay=-1.4, width=0.05), T)
    late = table("b.csv", pulse(T, delay=2.6, width=0.05), T)
    assert hints.hint(reference, late) is None


def test_the_time_that_is_left_is_counted_from_where_both_begin(table):
    """Of six seconds from 4 s on a shift of two leaves four."""
    reference = table("a.csv", pulse(T), T + 4.0)
    late = table("b.csv", pulse(T, delay=2.0), T + 4.0)
    assert hints.hint(reference, late).shift == pytest.approx(-2.0, abs=1e-3)


def test_what_is_left_is_counted_of_the_reference_s_rotation(table):
    """A swing of the candidate before the reference begins is cut off by the shift."""
    before = 0.15 * np.exp(-((T - 0.8) ** 2) / 0.05)
    reference = table("a.csv", pulse(T), T)
    late = table("b.csv", pulse(T, delay=2.0) + before, T)
    assert hints.hint(reference, late).shift == pytest.approx(-2.0, abs=1e-2)


def test_compare_gives_the_option(table, tmp_path, typed):
    table("a.csv", pulse(T), T)
    table("b.csv", pulse(T, delay=0.4), T)
    files = str(tmp_path / "a.csv"), str(tmp_path / "b.csv")
    typed("compare", *files, holds=["hint: the candidate: shifted by -0.4 s", "--align -0.4"])
    shown, _ = typed("compare", *files, "--align", "-0.4")
    assert "hint" not in shown


def test_compare_adds_the_shift_that_was_given(table, tmp_path, typed):
    table("a.csv", pulse(T), T)
    table("b.csv", pulse(T, delay=0.4), T)
    files = str(tmp_path / "a.csv"), str(tmp_path / "b.csv")
    typed("compare", *files, "--align", "0.1", holds=["shifted by -0.5 s", "--align -0.4"])


def test_compare_shifts_to_where_the_rotations_agree_best(table, tmp_path, typed):
    table("a.csv", pulse(T), T)
    table("b.csv", pulse(T, delay=0.4), T)
    files = str(tmp_path / "a.csv"), str(tmp_path / "b.csv")
    typed("compare", *files, "--align", "best", holds=["the candidate is shifted by -0.4 s"])


@pytest.fixture
def notes_of_table(tmp_path, written):
    """A function that writes the measured table of a suite, runs it, and gives the notes of it."""
    path = written("mine.toml", SUITE)

    def notes(sign: float, late: float) -> str:
        scene_file = tmp_path / "table.csv"
        scene_file.write_text("t,theta\n0,0\n3,0\n", "utf-8")
        truth = run_suite(load_suite(path), tmp_path / "first", jobs=1)
        history = History.load(
            tmp_path / "first" / truth.by_scene["tilt"]["ebm"].history,
        )
        t, theta = history.channels["t"], history.channels["theta"]
        rows = np.column_stack([t + late, sign * theta])
        np.savetxt(scene_file, rows, delimiter=",", header="t,theta", comments="")
        run = run_suite(load_suite(path), tmp_path / "second", jobs=1)
        return "; ".join(run.by_scene["tilt"]["table"].notes)

    return notes


def test_a_suite_names_the_offset(notes_of_table):
    notes = notes_of_table(1.0, 0.3)  # 0.1 s later by the suite's offset
    assert "against ebm: the measured history: shifted by -0.4 s, it is within" in notes
    assert "offset = -0.3" in notes


def test_a_suite_names_the_sign(notes_of_table):
    notes = notes_of_table(-1.0, -0.1)
    assert "against ebm: the measured history's rotation has the other sign: turned" in notes


def test_a_suite_has_no_hint_where_they_agree(notes_of_table):
    assert notes_of_table(1.0, -0.1) == ""
