"""A pytest plugin: its fixture `rockcheck_check` checks a cell against its suite's tolerances.

Call `rockcheck_check("my-scene", model="mujoco")` in a test. The suite is the ini option
`rockcheck_suite` (a named suite or a .toml file, relative to pytest's root), by default
`rockcheck.toml` in the root where there is one, else `paper`. Histories are kept in pytest's cache
and read back while nothing that they depend on has changed.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import pytest

if TYPE_CHECKING:
    from rockcheck.validation.suite import results


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the ini options and the option of the command line.

    The ini options are `rockcheck_suite` and `rockcheck_allow_code`; the command line has
    `--rockcheck-allow-code`.
    """
    parser.addini(
        "rockcheck_suite",
        "suite that the fixture `rockcheck_check` takes scenes, models and tolerances from",
        default="",
    )
    parser.addini(
        "rockcheck_allow_code",
        "models of your own, module:Class, that may be run",
        type="args",
        default=[],
    )
    parser.addoption(
        "--rockcheck-allow-code",
        action="append",
        default=[],
        metavar="MODULE:CLASS",
        help="a model of your own that rockcheck may run",
    )


@pytest.fixture
def rockcheck_check(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Callable[..., results.Cell]:
    """Run a cell and its references; the test fails if the cell is out of tolerance.

    `rockcheck_check(scene, model=..., suite=None, strict=False)` returns the finished
    `validation.suite.results.Cell`, whose figures a test may look at. With `strict` a figure that
    left its drift band for the worse fails too, with `strict="both"` a better one. A model that is
    not installed fails.
    """
    config = request.config

    def check(
        scene: str,
        *,
        model: str,
        suite: str | Path | None = None,
        strict: bool | Literal["both"] = False,
    ) -> results.Cell:
        from rockcheck.validation.suite import reasons, runner, suites

        own = config.rootpath / "rockcheck.toml"
        chosen = str(
            suite or config.getini("rockcheck_suite") or (own if own.exists() else "paper")
        )
        loaded = suites.load_suite(
            chosen if chosen in suites.named_suites() else config.rootpath / chosen,
            allow_code=[
                *config.getini("rockcheck_allow_code"),
                *config.getoption("--rockcheck-allow-code"),
            ],
        )
        finished = runner.run_suite(
            loaded.only(scene, model),
            config.cache.mkdir("rockcheck")
            if hasattr(config, "cache")  # it may be turned off
            else tmp_path_factory.mktemp("rockcheck"),
            strict=strict,
        )
        cell = finished.by_scene[scene][model]
        if wrong := list(reasons.cell_lines(cell, strict)):
            pytest.fail("\n".join(wrong), pytrace=False)
        if all(check.verdict == "not defined" for check in cell.checks):
            pytest.fail(
                f"{scene}, {model}: nothing is judged: the suite has no tolerance for it",
                pytrace=False,
            )
        return cell

    return check
