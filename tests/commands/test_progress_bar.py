"""What a person sees who waits: a bar on a terminal, lines in a log, nothing where all is quiet."""

from types import SimpleNamespace

import pytest

from rockcheck.commands import console, progress_bar
from rockcheck.commands.pace import Pace


class Clock:
    """A clock that a test turns, s."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


class Over:
    """Work that is over after so many waits for it, each of which turns the clock."""

    def __init__(self, clock, waits):
        self.clock, self.waits = clock, waits

    def wait(self, seconds):
        if not self.waits:
            return True
        self.waits -= 1
        self.clock.now += seconds
        return False


@pytest.fixture
def paced():
    """A pace with a clock of its own: after 2 s one of so many parts has ended, if any."""

    def make(parts=0):
        clock = Clock()
        pace = Pace(clock=clock)
        if parts:
            pace.hear(0, parts)
            clock.now = 2.0
            pace.hear(1, parts)
        return pace

    return make


def lines(pace, waits, capsys, what=""):
    task = SimpleNamespace(fields={"what": what})
    progress_bar.tell_lines("assess", task, pace, Over(pace.clock, waits))
    return capsys.readouterr().err.splitlines()


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        (8, ["rockcheck: assess: 1 of 8, 0:12 left"]),
        (7, []),  # in 10 s there would be a line anyway
    ],
)
def test_a_log_hears_early_of_work_that_takes_longer_than_a_line(parts, said, paced, capsys):
    assert lines(paced(parts), 1, capsys) == said


def test_a_log_hears_nothing_early_where_the_time_left_is_unknown(paced, capsys):
    assert lines(paced(), 1, capsys) == []


def test_a_log_hears_how_long_work_of_unknown_length_has_gone_on(paced, capsys):
    said = [f"rockcheck: assess: {time} so far" for time in ("0:12", "0:22", "0:32")]
    assert lines(paced(), 4, capsys) == said


def test_a_log_hears_what_plays(paced, capsys):
    (line,) = lines(paced(8), 1, capsys, what="fig4a, cm")
    assert line.endswith(" left (fig4a, cm)")


def test_time_is_told_in_minutes_and_seconds(paced):
    pace = paced()
    pace.clock.now = 125.0
    assert progress_bar.time_words(pace) == "2:05 so far"


def test_a_bar_shows_the_time_left_once_it_is_known(paced):
    unknown, known = (progress_bar.TimeLeft(pace).render(None) for pace in (paced(), paced(8)))
    assert unknown.plain == ""
    assert known.plain == "0:14 left"


@pytest.mark.parametrize(
    ("voice", "terminal", "bar", "log"),
    [
        ("tables", "1", True, False),
        ("tables", "0", False, True),
        ("json", "1", False, True),
        ("json", "0", False, True),
        ("quiet", "1", False, False),
        ("quiet", "0", False, False),
    ],
)
def test_a_terminal_has_a_bar_and_a_log_lines(voice, terminal, bar, log, monkeypatch, capsys):
    monkeypatch.setenv("TTY_COMPATIBLE", terminal)
    heard = []
    monkeypatch.setattr(progress_bar, "tell_lines", lambda *told: heard.append(told))
    with console.output_mode(voice), progress_bar.progress("assess") as on_progress:
        on_progress(1, 4, "fig4a")
    assert ("assess: fig4a" in capsys.readouterr().err) == bar
    assert bool(heard) == log


@pytest.mark.parametrize(("model", "said"), [("mujoco", False), ("ebm", True)])
def test_it_is_said_that_a_model_may_compile_first(model, said, monkeypatch):
    titles = []
    monkeypatch.setattr(progress_bar, "tell_lines", lambda title, *_: titles.append(title))
    monkeypatch.setattr(progress_bar, "compiles", lambda family, settings: family == "ebm")
    with console.output_mode("json"), progress_bar.progress("assess", [(model, {})]):
        pass
    assert titles == ["assess" + ", may compile first" * said]
