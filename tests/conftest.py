"""What several parts' tests share."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import sys
from collections.abc import Callable, Generator, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rockcheck.commands.cli import main
from rockcheck.scenes import PAPER_BLOCK, Block, Event, History, InputError, errors
from rockcheck.validation.execute import models

# What tests of several folders share beside fixtures, and what is a program of its own, too.
sys.path[:0] = [
    str(Path(__file__).parent / folder)
    for folder in ("ebm", "cm", "stress", "validation/made_up", "../docs/site_tools")
]

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

#: What a test marked `needs` may ask for, beside the models of the package by their names: whether
#: it is here.
HERE: dict[str, bool] = {
    "POSIX": os.name == "posix",
    "Linux": Path("/proc/self/task").exists(),
    "git": shutil.which("git") is not None,
    "obspy": find_spec("obspy") is not None,
    "pelicun": find_spec("pelicun") is not None,
}
#: What may be skipped while `CI` is set: how the reason begins, and where it is no fault of the
#: job. All else that is skipped fails it.
MAY_BE_SKIPPED: dict[str, bool] = {
    "needs pybullet": sys.version_info >= (3, 12),  # which has wheels for 3.11 only
    "needs Linux": sys.platform != "linux",
    "needs obspy": True,  # the extra `seismology`
    "needs pelicun": True,  # the extra `loss`
    "needs POSIX": sys.platform == "win32",
}
#: What a line of progress holds.
HOW_FAR = re.compile(r"\d:\d\d (so far|left)|^rockcheck: compiling ")
CHROMIUM = Path("/usr/bin/chromium")
#: How a request ends that was under way as its page was left.
ABORTED = "net::ERR_ABORTED"
ARGUMENTS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


def pytest_runtest_setup(item: pytest.Item) -> None:
    """A test that is marked as needing what is not here is skipped."""
    for name in (name for mark in item.iter_markers("needs") for name in mark.args):
        missing = ("" if HERE[name] else "not here") if name in HERE else models.not_installed(name)
        if missing:
            pytest.skip(f"needs {name}: {missing}")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call() -> Iterator[None]:
    """A test that comes to play an engine that is not installed is skipped."""
    try:
        return (yield)
    except errors.NotInstalled as error:
        pytest.skip(f"needs {error.key}: {error.reason}")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, Any, Any]:
    """In CI a test, or a whole file, that is skipped without a listed reason has failed."""
    report = yield
    if os.environ.get("CI") and report.skipped and not hasattr(report, "wasxfail"):
        told = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
        reason = str(told).removeprefix("Skipped: ")
        if not reason.startswith(tuple(why for why, listed in MAY_BE_SKIPPED.items() if listed)):
            report.outcome = "failed"
            report.longrepr = f"skipped in CI, and tests/conftest.py lists no such reason: {reason}"
    return report


#: The same for a whole file.
pytest_make_collect_report = pytest_runtest_makereport


@pytest.fixture(scope="session")
def block() -> Block:
    return PAPER_BLOCK


@pytest.fixture
def but_progress() -> Callable[[str], list[str]]:
    """The lines on stderr that do not say how far a long work is: on a slow machine any is long."""
    return lambda err: [line for line in err.splitlines() if not HOW_FAR.search(line)]


@pytest.fixture
def typed(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[str, str]]:
    """What a command says on stdout and stderr, once its exit code is as expected, and it `holds`
    the words that it should and `lacks` those that it should not, within so many `columns`."""

    def say(
        *words: str,
        code: int = 0,
        holds: Sequence[str] = (),
        lacks: Sequence[str] = (),
        columns: float = math.inf,
    ) -> tuple[str, str]:
        capsys.readouterr()
        assert main(list(words)) == code
        said = capsys.readouterr()
        told = said.out + said.err
        assert [part for part in holds if part not in told] == [], told
        assert [part for part in lacks if part in told] == [], told
        assert [line for line in said.out.splitlines() if len(line) > columns] == []
        return said

    return say


@pytest.fixture
def told(typed: Callable[..., tuple[str, str]]) -> Callable[..., Any]:
    return lambda *words, code=0: json.loads(typed(*words, "--json", code=code)[0])


@pytest.fixture
def refused(typed: Callable[..., tuple[str, str]]) -> Callable[..., str]:
    """The one line on stderr of a command that refuses what it is given."""

    def say(*words: str) -> str:
        (line,) = typed(*words, code=2)[1].splitlines()
        assert line.startswith("rockcheck: ")
        return line

    return say


@pytest.fixture
def written(tmp_path: Path) -> Callable[[str, str | bytes], Path]:

    def write(name: str, content: str | bytes) -> Path:
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write


@pytest.fixture
def fault_of() -> Callable[..., InputError]:
    """The error, in one line, of a call that refuses what it is given."""

    def fault(act: Callable[..., object], *given: Any, **more: Any) -> InputError:
        with pytest.raises(InputError) as refused:
            act(*given, **more)
        assert str(refused.value).isprintable()
        return refused.value

    return fault


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Headless Chromium; in CI its absence fails the test."""
    if not CHROMIUM.exists():
        missing = f"{CHROMIUM} is not installed"
        pytest.fail(missing) if os.environ.get("CI") else pytest.skip(missing)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        running = driver.chromium.launch(executable_path=str(CHROMIUM), args=ARGUMENTS)
        yield running
        running.close()


@pytest.fixture
def visitor(browser: Browser) -> Iterator[Callable[..., Page]]:
    """`visitor(folder, **settings)` is an empty page of the browser, for the files of a folder.

    In the end no page must have complained on its console, or asked for anything outside of its
    folder.
    """
    complaints: list[str] = []
    contexts: list[BrowserContext] = []

    def visit(folder: Path, **settings: Any) -> Page:
        contexts.append(browser.new_context(**settings))
        page = contexts[-1].new_page()
        inside = (folder.as_uri(), "data:", "about:")
        # Of what happens: what is to be complained of, if anything.
        heard: dict[str, Callable[[Any], str]] = {
            "console": lambda said: said.text * (said.type in ("error", "warning")),
            "pageerror": str,
            "requestfailed": lambda one: f"failed: {one.url}" * (one.failure != ABORTED),
            "request": lambda one: one.url * (not one.url.startswith(inside)),
        }
        for event, told in heard.items():
            page.on(event, lambda thing, told=told: complaints.append(told(thing)))
        return page

    yield visit
    for context in contexts:
        context.close()
    assert [one for one in complaints if one] == []


# Synthetic histories: motions whose discrepancies are known by hand.
MADE = Block(half_width=0.397, half_height=1.555)


def synthetic(
    theta: Any,
    t: Any = None,
    *,
    model: str = "made",
    events: Sequence[Event] = (),
    outcome: str = "moving",
    **columns: Any,
) -> History:
    """A history with theta in alpha; x, y and velocities are zero unless given, y touches the
    floor."""
    theta = MADE.alpha * np.asarray(theta, dtype=float)
    time = np.asarray(t if t is not None else 0.01 * np.arange(len(theta)), dtype=float)
    zero = np.zeros(len(theta))
    channels = {"t": time, "y": MADE.radius * np.cos(MADE.alpha - np.abs(theta)), "theta": theta}
    channels |= dict.fromkeys(("x", "x_dot", "y_dot", "theta_dot", "slip", "slip_rate"), zero)
    channels |= {name: np.asarray(column, dtype=float) for name, column in columns.items()}
    return History(
        name="made",
        model=model,
        channels=channels,
        event_list=tuple(events),
        outcome=outcome,
        block=MADE,
    )


@pytest.fixture
def made() -> Callable[..., History]:
    return synthetic


@pytest.fixture
def faulty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(Path(__file__).parent / "validation" / "models" / "faulty.py", tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))  # a suite's folder joins it
    monkeypatch.delitem(sys.modules, "faulty", raising=False)


@pytest.fixture
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, faulty: None) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
