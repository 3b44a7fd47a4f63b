"""What a command prints in each mode of output, and how it ends."""

import json

import pytest
import typer
from rich.table import Table

from rockcheck.commands import console, ending, notices, options
from rockcheck.scenes import Record, Scene, progress
from rockcheck.scenes.recordings import sets
from rockcheck.validation.finding import Finding, Text

MODES = ("tables", "json", "quiet")


@pytest.fixture
def said(capsys):
    """What an act prints on stdout and stderr in a mode of output."""

    def say(mode, act, *given):
        with console.output_mode(mode):
            act(*given)
        return capsys.readouterr()

    return say


@pytest.mark.parametrize("mode", MODES)
def test_tables_are_printed_where_neither_json_nor_quiet_is_asked_for(mode, said):
    out, err = said(mode, lambda: console.console().print("a table"))
    assert out == "a table\n" * (mode == "tables")
    assert err == ""


@pytest.mark.parametrize("mode", MODES)
def test_who_waits_for_a_compiler_is_told_beside_tables(mode, said):
    out, err = said(mode, progress.announce, "compiling")
    assert out == ""
    assert err == "rockcheck: compiling\n" * (mode == "tables")


@pytest.mark.parametrize("mode", MODES)
def test_json_is_printed_where_it_is_asked_for(mode, said):
    out, _ = said(mode, console.answer, {"a": 1.5, "b": float("nan")})
    assert (json.loads(out) if out else None) == ({"a": 1.5, "b": None} if mode == "json" else None)


@pytest.mark.parametrize(("count", "lines"), [(0, 0), (3, 3), (100, 100), (101, 101), (300, 101)])
def test_quiet_says_what_failed_in_at_most_a_hundred_lines_and_how_many_are_left(
    count, lines, said
):
    _, err = said("quiet", console.tell_wrong, [f"fault {n}" for n in range(count)])
    assert len(err.splitlines()) == lines
    assert (f"rockcheck: and {count - 100} more lines" in err) == (count > 100)


@pytest.mark.parametrize("mode", ["tables", "json"])
def test_only_quiet_repeats_what_failed(mode, said):
    assert said(mode, console.tell_wrong, ["fault"]) == ("", "")


def test_text_does_not_steer_the_terminal_and_tables_are_drawn(said):
    table = Table("a heading")
    out, _ = said("tables", lambda: console.console().print("\x1b[2J red", table))
    assert out.startswith("?[2J red")
    assert "a heading" in out


def ended(finding, mode, capsys, *given):
    with console.output_mode(mode), pytest.raises(typer.Exit) as end:
        ending.finish_command(finding, *given)
    return end.value.exit_code, *capsys.readouterr()


FOUND = Finding("study", "a title", "all is well", [Text("a line")])
FAILED = Finding("study", "a title", "one failed", exit_code=3, failures={"a task": "a reason"})


def test_a_command_ends_with_its_findings_code_and_names_its_files(capsys, tmp_path):
    code, out, _ = ended(FOUND, "tables", capsys, None, [("figure", tmp_path / "a.png")])
    assert code == 0
    assert "a line" in out
    assert f"figure: {tmp_path / 'a.png'}" in out


def test_a_command_with_a_folder_names_the_page_alone(capsys, tmp_path):
    _, out, _ = ended(FOUND, "tables", capsys, tmp_path, [("figure", tmp_path / "a.png")])
    assert f"report: {tmp_path / 'index.html'}" in out
    assert "a.png" not in out
    assert (tmp_path / "index.html").exists()


def test_quiet_says_why_a_command_failed_and_nothing_of_one_that_did_not(capsys):
    code, out, err = ended(FAILED, "quiet", capsys)
    assert code == 3
    assert out == ""
    assert err.splitlines()[0] == "rockcheck: one failed"
    assert "a reason" in err
    assert ended(FOUND, "quiet", capsys) == (0, "", "")


def test_json_is_a_findings_value_else_all_that_it_holds(capsys, tmp_path):
    _, out, _ = ended(FOUND, "json", capsys)
    assert json.loads(out)["answer"] == "all is well"
    assert json.loads(out)["report"] is None
    _, out, _ = ended(FOUND, "json", capsys, tmp_path)
    assert json.loads(out)["report"] == str(tmp_path / "index.html")
    _, out, _ = ended(FOUND, "json", capsys, None, (), {"own": 1})
    assert json.loads(out) == {"own": 1}


def test_models_that_are_not_installed_are_told(said, monkeypatch):
    hint = "install Drake"
    monkeypatch.setattr(notices, "not_installed", lambda name: hint if name == "drake" else "")
    out, _ = said("tables", notices.tell_missing)
    assert out == "left out: drake, install Drake\n"


def test_vertical_components_stand_in_one_line_and_other_files_by_their_reasons(said):
    odd = sets.Odd("a.jpg: not a text file")
    out, _ = said("tables", notices.tell_left_out, ["1 up", odd, "2 up"], "--vertical")
    assert out == "left out: 1 up, 2 up (vertical; --vertical)\nleft out: a.jpg: not a text file\n"
    out, _ = said("tables", notices.tell_left_out, [odd])
    assert out == "left out: a.jpg: not a text file\n"
    out, _ = said("tables", notices.tell_left_out, ["1 up"])
    assert out == "left out: 1 up (vertical)\n"


def test_notes_of_records_are_told_once(said):
    record = Record.from_samples([0.0, 1.0], 0.01).replace(source="a.csv", notes=("late",))
    scene = Scene(
        name="a",
        block={"half_width": 0.4, "half_height": 1.6},
        floor={"friction": 0.3},
        excitation=record,
        vertical=record,
        duration=1.0,
    )
    still = scene.replace(excitation={"kind": "rest"}, vertical={"kind": "rest"})
    out, _ = said("tables", notices.tell_record_notes, [scene, still])
    assert out == "note: a.csv: late\n"


@pytest.mark.parametrize(("files", "offered"), [(True, ["mine", "mine.toml"]), (False, ["mine"])])
def test_a_shell_is_offered_names_and_files_here(files, offered, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("mine.toml", "other.toml", "mine.csv"):
        (tmp_path / name).write_text("")
    complete = options.completing(lambda: ["mine", "fig4a"], files=files)
    assert complete("mi") == offered


def test_there_is_at_least_one_worker(refused):
    assert "greater than or equal to 1" in refused("warm", "--jobs", "0")
