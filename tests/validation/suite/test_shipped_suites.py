"""The suites that come with rockcheck, played as a user plays them."""

import pytest

from rockcheck.commands.cli import main

BOTH_ENGINES = pytest.mark.needs("mujoco", "pybullet")


@pytest.mark.long
@pytest.mark.parametrize(
    "name",
    [
        pytest.param("smoke", marks=pytest.mark.needs("mujoco")),
        *(pytest.param(name, marks=BOTH_ENGINES) for name in ("engines", "paper", "walls")),
        pytest.param("ensemble", marks=[BOTH_ENGINES, pytest.mark.slow]),
    ],
)
def test_no_figure_is_worse_than_the_one_that_was_accepted(name, tmp_path):
    """Not even within its limit: what has moved is mended, or accepted with a reason."""
    assert main(["validate", name, "--strict", "worse", "--out", str(tmp_path), "--quiet"]) == 0
