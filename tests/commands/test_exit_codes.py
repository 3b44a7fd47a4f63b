"""Exit codes mean one thing each: whoever reads what is said, and whatever goes wrong inside."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from filelock import FileLock

from rockcheck import InputError
from rockcheck.commands import cli, console
from rockcheck.commands.ending import finish_command
from rockcheck.reports import site
from rockcheck.validation.finding import Finding
from rockcheck.validation.suite import results

ROCKCHECK = [sys.executable, "-m", "rockcheck"]


@pytest.fixture
def broken(monkeypatch):
    def fault(**_: object) -> None:
        raise ZeroDivisionError("a fault\nof two lines")

    monkeypatch.setattr(cli, "app", fault)


@pytest.mark.usefixtures("broken")
def test_a_fault_inside_has_a_code_and_leaves_a_file_that_only_the_user_can_read(
    tmp_path, monkeypatch, typed
):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (line,) = typed("scenes", code=70)[1].splitlines()
    assert line.startswith(
        "rockcheck: a fault of rockcheck itself, ZeroDivisionError: please report it with "
    )
    told = Path(line.rpartition(" ")[2])
    assert re.search(r"in fault\n(?s:.*)a fault\nof two lines", (tmp_path / told.name).read_text())
    assert os.name != "posix" or told.stat().st_mode & 0o777 == 0o600


@pytest.mark.usefixtures("broken")
def test_a_fault_that_cannot_be_written_down_is_told(tmp_path, monkeypatch, typed):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "not there"))
    (line,) = typed("scenes", code=70)[1].splitlines()
    assert line.startswith(
        "rockcheck: a fault of rockcheck itself, ZeroDivisionError:"
        " please report it with this: a fault"
    )


def test_the_exit_codes_are_told_by_the_help_and_by_the_documentation(typed):
    page = (Path(__file__).parents[2] / "docs" / "ci.md").read_text("utf-8")
    told = dict(re.findall(r"^ +(\d+) +(\S.*)$", typed("--help")[0], re.MULTILINE))
    assert told == {str(code): meaning for code, meaning in cli.EXIT_CODES.items()}
    assert {int(code) for code in re.findall(r"\n\| (\d+) \| ", page)} >= {*cli.EXIT_CODES}


@pytest.mark.parametrize(("mode", "lines"), [("quiet", 2), ("tables", 0)])
def test_quiet_says_what_failed_in_a_study(mode, lines, capsys):
    finding = Finding("mine", "", "1 of 2 broke", failures={"b": "no step"}, exit_code=3)
    with console.output_mode(mode), pytest.raises(typer.Exit) as ended:
        finish_command(finding)
    assert ended.value.exit_code == 3
    errors = capsys.readouterr().err.splitlines()
    assert errors == ["rockcheck: 1 of 2 broke", "rockcheck: failed: b: no step"][:lines]


def test_a_benchmark_whose_time_is_over_is_not_called_interrupted(tmp_path, monkeypatch, typed):
    monkeypatch.setattr("rockcheck.commands.studies.MINUTES", 1e-9)
    typed(
        *("benchmark", "skipping", "--quick", "--jobs", "1", "--out", str(tmp_path)),
        holds=[
            "benchmark: its 1e-09 minutes are over",
            "not complete: the same command goes on where it ended",
        ],
        lacks=["interrupted"],
    )


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("scenes", 0),
        ("scenes --json", 0),
        ("scenes >&-", 0),
        ("--help", 0),
        ("simulate --help", 0),
        ("no-such-command", 2),
        ("compare a.csv b.csv", 2),
        ("record elcentro_1940_ns.csv", 0),  # its picture has marks that Latin-1 does not know
    ],
)
@pytest.mark.parametrize("reader", ["head -1", "true"])
def test_a_reader_that_goes_changes_no_exit_code_and_hears_nothing(
    tmp_path, words, expected, reader
):
    done = subprocess.run(
        ["bash", "-c", f"{' '.join(ROCKCHECK)} {words} | {reader}; echo ${{PIPESTATUS[0]}}"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=os.environ | {"PYTHONIOENCODING": "latin-1"},
        timeout=120,
        check=False,
    )
    assert done.stdout.splitlines()[-1] == str(expected)
    assert (re.search("Broken|Traceback", done.stderr), len(done.stderr.splitlines())) == (
        None,
        expected != 0,
    )


#: Ctrl-C as the commands are imported.
INTERRUPTED = """
import signal, sys
class Finder:
    def find_spec(name, path=None, target=None):
        if name == "rockcheck.commands.cli":
            signal.raise_signal(signal.SIGINT)
signal.signal(signal.SIGINT, signal.default_int_handler)  # what runs behind a shell ignores it
sys.meta_path.insert(0, Finder)
from rockcheck.__main__ import main
main()
"""


@pytest.mark.needs("POSIX")
def test_ctrl_c_while_a_command_begins_has_the_same_code():
    assert subprocess.run([sys.executable, "-c", INTERRUPTED], check=False).returncode == 130


@pytest.mark.slow
@pytest.mark.needs("box2d")
def test_no_binding_tells_what_it_still_holds_at_the_end(tmp_path):
    done = subprocess.run(
        [*ROCKCHECK, "simulate", "fig5a", "--model", "box2d", "--quiet"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_held_lock_says_for_whom_it_waits_and_for_how_long(tmp_path, monkeypatch, capsys):
    run = results.Run(suite="s", created="", reference="ebm", scenes={}, models=("ebm",), cells=())
    monkeypatch.setattr(site, "SILENT", 0.0)
    monkeypatch.setattr(site, "PATIENCE", 0.1)
    for lock, holder in (
        (FileLock(tmp_path / ".lock"), r"another run, which holds .*\.lock"),
        (site._turn(tmp_path), f"process {os.getpid()} on .*"),
    ):
        with lock, pytest.raises(InputError, match=rf"waited 0\.1 s for {holder}"):
            site.keep(run, tmp_path)
        assert re.fullmatch(
            rf"rockcheck: waiting up to 0\.1 s for {holder}\n", capsys.readouterr().err
        )
    site.keep(run, tmp_path)
    assert (capsys.readouterr().err, (tmp_path / ".lock.holder").exists()) == ("", False)
