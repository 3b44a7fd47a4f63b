"""What is written goes through one door, which follows no link; text in a table is no formula and
steers nothing."""

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest

import rockcheck
from rockcheck.scenes import InputError
from rockcheck.scenes.errors import inert
from rockcheck.scenes.reading import (
    head_of,
    open_regular,
    read_arrays,
    read_bytes,
    read_json,
    read_table,
    read_text,
    within,
)
from rockcheck.scenes.writing import columns_text, made, table_text, write_together, write_whole

#: What may stand where a result is to be written, in a folder that somebody sent.
TRAPS: dict[str, Callable[[Path, Path], None]] = {
    "a link": lambda path, victim: path.symlink_to(victim),
    "a link to nowhere": lambda path, victim: path.symlink_to(victim.with_name("not-there")),
    "a link to a device": lambda path, victim: path.symlink_to("/dev/full"),
    "a link to itself": lambda path, victim: path.symlink_to(path),
    "a pipe": lambda path, victim: os.mkfifo(path),
    "a second name": lambda path, victim: os.link(victim, path),
}


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize("trap", TRAPS)
@pytest.mark.parametrize("write", [write_whole, lambda path, text: write_together({path: text})])
def test_nothing_in_the_way_is_written_through(tmp_path, trap, write):
    victim, path = tmp_path / "victim", tmp_path / "result"
    victim.write_text("mine")
    TRAPS[trap](path, victim)
    write(path, "new")
    assert victim.read_text() == "mine"
    assert not path.is_symlink()
    assert path.read_text() == "new"
    assert sorted(one.name for one in tmp_path.iterdir()) == ["result", "victim"]


def test_a_folder_of_results_is_no_link(tmp_path):
    for name in ("elsewhere", "run"):
        (tmp_path / name).mkdir()
    (tmp_path / "run" / "pages").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="pages: a link"):
        made(tmp_path / "run", "pages", "data")
    assert not list((tmp_path / "elsewhere").iterdir())
    (tmp_path / "mine").symlink_to(tmp_path / "run")  # the folder that the user names may be one
    assert made(tmp_path / "mine", "data").is_dir()


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize(
    "read", [open_regular, read_bytes, read_text, read_json, read_table, read_arrays]
)
@pytest.mark.parametrize("trap", ["a link to a device", "a link to itself", "a pipe"])
def test_what_is_no_file_is_not_opened(tmp_path, monkeypatch, trap, read):
    path = tmp_path / "given"
    TRAPS[trap](path, tmp_path)
    monkeypatch.setattr(os, "open", lambda *_: pytest.fail("it was opened"))
    with pytest.raises(InputError, match="given"):
        read(path)
    assert head_of(path, 100) == ""


def test_a_link_may_not_lead_out_of_a_folder_that_was_sent(tmp_path):
    (tmp_path / "secret").write_text("1")
    folder = made(tmp_path / "run")
    (folder / "out").symlink_to(tmp_path)
    (folder / "inside").symlink_to(folder / "kept")
    assert within(folder, "inside") == folder / "inside"
    for name in ("out", "out/secret", "../secret"):
        with pytest.raises(InputError, match="lies outside"):
            within(folder, name)


#: Where a file may be written or read without the doors: the doors themselves, the cache of machine
#: code, a file that only the user can read, a history of runs that the user names, and files of the
#: package itself.
DOORS = {
    "write_bytes|write_text|savefig|to_csv|os.replace": {
        "scenes/writing.py",
        "commands/simulate.py",
        "reports/style.py",
    }
    | {"reports/show/drawing.py"},
    r"\.open\(|\bopen\(": {"scenes/reading.py", "scenes/writing.py", "validation/suite/across.py"},
    # Results go through `writing.made`; caches of the user's own lie in folders of mode 0700.
    r"\.mkdir\(": {
        "scenes/writing.py",
        "scenes/compiled.py",
        "validation/execute/provenance.py",
    },
    r"\.read_text\(|\.read_bytes\(": {
        "scenes/compiled.py",
        "scenes/experience.py",
        "validation/execute/provenance.py",
    }
    | {"commands/scenes.py", "validation/studies/work_precision/timings.py"}
    | {"reports/style.py", "reports/document.py", "validation/paper/measures.py"}
    | {"validation/studies/conformance/study.py"},
}


@pytest.mark.parametrize("calls", DOORS)
def test_files_are_written_and_read_by_the_doors_alone(calls):
    home = Path(rockcheck.__file__).parent
    folders = ("scenes", "ebm", "cm", "engines", "validation", "reports", "commands")
    texts = {
        path.relative_to(home).as_posix(): path.read_text(encoding="utf-8")
        for folder in folders
        for path in (home / folder).rglob("*.py")
    }
    found = {
        name
        for name, text in texts.items()
        if re.search(calls, text.replace("os.open(os.devnull", ""))
    }
    assert found == DOORS[calls]


@pytest.mark.parametrize("lead", "=+-@＝")
@pytest.mark.parametrize(
    "table",
    [lambda text: table_text([text], [[text]]), lambda text: columns_text({text: [text, text]})],
)
def test_no_cell_of_text_is_a_formula(lead, table):
    for line in table(f"{lead}1+1").splitlines():
        assert line == f"'{lead}1+1"


@pytest.mark.parametrize("plain", ["-", "-1.5", "-1e-3", "+2", "-inf", "a=b", "", "a-b"])
def test_numbers_and_signs_stay_as_they_are(plain):
    assert table_text(["x", "y"], [[plain, -1.5]]).splitlines()[1] == f"{plain},-1.5"


_CODES = (
    *range(0x202A, 0x202F),
    *range(0x2066, 0x206A),
    0x200B,
    0x200F,
    0x2028,
    0x00AD,
    0xFEFF,
    0x1B,
    0x9B,
    0xD800,
)
TURNING = [chr(code) for code in _CODES]


@pytest.mark.parametrize("sign", TURNING)
def test_text_neither_turns_around_nor_steers(tmp_path, sign):
    assert inert(f"a{sign}b\nc\u202fd") == "a?b\nc\u202fd"
    assert table_text([f"a{sign}b"], [[f"a{sign}b"]]) == "a?b\na?b\n"
    path = tmp_path / "a.json"
    path.write_text(f'{{"a\\u{ord(sign):04x}b": ["a\\u{ord(sign):04x}b"]}}')
    assert read_json(path) == {"a?b": ["a?b"]}
