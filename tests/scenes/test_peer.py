"""PEER files: numbers that run together, and the units that a header may spell."""

import numpy as np
import pytest
from numpy.typing import NDArray

from rockcheck.scenes import InputError
from rockcheck.scenes.recordings import read_record

G = 9.80665


def run_together(
    across: int, count: int, width: int, form: str, unit: str = "G"
) -> tuple[str, NDArray[np.float64]]:
    """A PEER file in Fortran's columns without a blank between them, and its numbers as they are
    printed."""
    values = (
        np.random.default_rng(3).uniform(1.0, 9.0, count)
        * np.where(np.arange(count) % 3, 1.0, -1.0)
        * 1e-2
    )
    words = [format(value, form)[-width:].rjust(width) for value in values]
    lines = ["".join(words[k : k + across]) for k in range(0, count, across)]
    head = (
        f"PEER\nA, 1/1/2000, B, 180\nACCELERATION TIME SERIES IN UNITS OF {unit}\n"
        f"NPTS= {count}, DT= .01 SEC\n"
    )
    return head + "\n".join(lines) + "\n", np.array([float(word) for word in words])


@pytest.mark.parametrize("count", [1, 4, 5, 6, 23, 25])
@pytest.mark.parametrize(
    ("across", "width", "form"), [(5, 11, ".5E"), (5, 12, ".5E"), (8, 8, ".5f"), (1, 11, ".5E")]
)
def test_columns_of_fortran_may_run_together(tmp_path, across, width, form, count):
    """E-011.19 is the end of one number and the beginning of the next."""
    text, values = run_together(across, count, width, form)
    (tmp_path / "a.AT2").write_text(text)
    np.testing.assert_array_equal(read_record(tmp_path / "a.AT2").samples, values * G)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text[:-3] + "\n",
        lambda text: text.replace("E-0", "E0", 1),
        lambda text: text + " 1.0\n",
    ],
)
def test_columns_that_are_not_as_the_header_says_are_a_fault(tmp_path, change):
    (tmp_path / "a.AT2").write_text(change(run_together(5, 23, 11, ".5E")[0]))
    with pytest.raises(InputError, match="not a finite number"):
        read_record(tmp_path / "a.AT2")


SPELT = {
    "cm/s2": ["CM/S/S", "CM/SEC/SEC", "CM/S^2", "cm/sec2", "(CM/S**2)", "CM / S / S"],
    "ft/s2": ["FT/S/S", "ft/s2", "FT/SEC**2"],
    "m/s2": ["M/S/S", "M/SEC/SEC"],
    "g": ["G", "g", "G'S", "(G)"],
    "gal": ["GAL", "gals"],
}


@pytest.mark.parametrize(
    ("unit", "word"), [(unit, word) for unit, words in SPELT.items() for word in words]
)
def test_the_header_states_the_unit(tmp_path, unit, word):
    (tmp_path / "a.AT2").write_text(
        f"A\nACCELERATION TIME SERIES IN UNITS OF {word}\nNPTS= 2, DT= .01 SEC\n 1.0 2.0\n"
    )
    found = read_record(tmp_path / "a.AT2")
    assert found.unit == unit
    np.testing.assert_allclose(
        found.samples,
        np.array([1.0, 2.0]) * {"g": G, "cm/s2": 0.01, "gal": 0.01, "ft/s2": 0.3048}.get(unit, 1.0),
    )


@pytest.mark.parametrize("word", ["CM/S", "CM", "INCHES"])
def test_a_header_of_velocities_is_no_record(tmp_path, word):
    (tmp_path / "a.AT2").write_text(
        f"A\nTIME SERIES IN UNITS OF {word}\nNPTS= 2, DT= .01 SEC\n 1.0 2.0\n"
    )
    with pytest.raises(InputError, match="UNITS OF G"):
        read_record(tmp_path / "a.AT2")
