"""What is written goes through one door, which follows no link; text in a table is no formula and
steers nothing. Reading is bounded: whatever a file holds, and whatever it is, it is read or refused
within seconds and with little memory."""

import json
import math
import os
import re
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import rockcheck
from rockcheck.scenes import History, errors, files, load_scene, reading, recordings, writing
from rockcheck.validation.suite import results

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
@pytest.mark.parametrize(
    "write", [writing.write_whole, lambda path, text: writing.write_together({path: text})]
)
def test_nothing_in_the_way_is_written_through(tmp_path, trap, write):
    victim, path = tmp_path / "victim", tmp_path / "result"
    victim.write_text("mine")
    TRAPS[trap](path, victim)
    write(path, "new")
    assert {one.name: (one.read_text(), one.is_symlink()) for one in tmp_path.iterdir()} == {
        "result": ("new", False),
        "victim": ("mine", False),
    }


@pytest.mark.needs("POSIX")
def test_a_file_is_for_whom_the_umask_says(tmp_path):
    script = (
        "import rockcheck.scenes.writing as w; w.write_whole(__import__('pathlib').Path('a'), '')"
    )
    subprocess.run([sys.executable, "-c", script], umask=0o027, cwd=tmp_path, check=True)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o640


def test_a_folder_of_results_is_no_link(tmp_path, fault_of):
    elsewhere, run = writing.made(tmp_path, "elsewhere"), writing.made(tmp_path, "run")
    (run / "pages").symlink_to(elsewhere)
    assert "pages: a link" in str(fault_of(writing.made, run, "pages", "data"))
    (tmp_path / "mine").symlink_to(run)  # the folder that the user names may be one
    assert writing.made(tmp_path / "mine", "data").is_dir()
    assert list(elsewhere.iterdir()) == []


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize(
    "read",
    [
        reading.read_bytes,
        reading.read_text,
        reading.read_json,
        reading.read_table,
    ],
)
@pytest.mark.parametrize("trap", ["a link to a device", "a link to itself", "a pipe"])
def test_what_is_no_file_is_not_opened(tmp_path, monkeypatch, trap, read, fault_of):
    path = tmp_path / "given"
    TRAPS[trap](path, tmp_path)
    monkeypatch.setattr(os, "open", lambda *_: pytest.fail("it was opened"))
    assert "given" in str(fault_of(read, path))
    assert reading.head_of(path, 100) == ""


def test_a_link_may_not_lead_out_of_a_folder_that_was_sent(tmp_path, fault_of):
    (tmp_path / "secret").write_text("1")
    folder = writing.made(tmp_path / "run")
    (folder / "out").symlink_to(tmp_path)
    (folder / "inside").symlink_to(folder / "kept")
    assert reading.within(folder, "inside") == folder / "inside"
    for name in ("out", "out/secret", "../secret"):
        assert "lies outside" in str(fault_of(reading.within, folder, name))


#: Where a file may be written or read without the doors: the doors themselves, the cache of machine
#: code, a file that only the user can read, a history of runs that the user names, and files of the
#: package itself.
DOORS = {
    "write_bytes|write_text|savefig|to_csv|os.replace": {
        "scenes/writing.py",
        "reports/style.py",
    }
    | {"reports/show/drawing.py"},
    r"\.open\(|\bopen\(": {"scenes/reading.py", "scenes/writing.py", "validation/history_file.py"},
    # Results go through `writing.made`; caches of the user's own lie in folders of mode 0700.
    r"\.mkdir\(": {"scenes/writing.py", "scenes/compiled.py"},
    r"(?<!reading)\.read_(text|bytes)\(": {
        "scenes/compiled.py",
        "scenes/experience.py",
        "validation/execute/provenance.py",
    }
    | {"commands/simulate.py", "validation/studies/work_precision/savings.py"}
    | {"reports/style.py", "reports/templates.py", "validation/paper/sentences.py"}
    | {"validation/studies/conformance/export.py"},
}


@pytest.mark.parametrize("calls", DOORS)
def test_files_are_written_and_read_by_the_doors_alone(calls):
    home = Path(rockcheck.__file__).parent
    texts = {
        path.relative_to(home).as_posix(): path.read_text(encoding="utf-8")
        for folder in ("scenes", "ebm", "cm", "engines", "validation", "reports", "commands")
        for path in (home / folder).rglob("*.py")
    }
    assert {
        name
        for name, text in texts.items()
        if re.search(calls, text.replace("os.open(os.devnull", ""))
    } == DOORS[calls]


@pytest.mark.parametrize("lead", "=+-@＝")
@pytest.mark.parametrize(
    "table",
    [
        lambda text: writing.table_text([text], [[text]]),
        lambda text: writing.columns_text({text: [text, text]}),
    ],
)
def test_no_cell_of_text_is_a_formula(lead, table):
    assert set(table(f"{lead}1+1").splitlines()) == {f"'{lead}1+1"}


@pytest.mark.parametrize("plain", ["-", "-1.5", "-1e-3", "+2", "-inf", "a=b", "", "a-b"])
def test_numbers_and_signs_stay_as_they_are(plain):
    assert writing.table_text(["x", "y"], [[plain, -1.5]]).splitlines()[1] == f"{plain},-1.5"


#: Signs that turn text around, hide or steer a terminal.
TURNING = (
    "\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\u200b\u200f\u2028\xad\ufeff"
    "\x1b\x9b\ud800"
)


@pytest.mark.parametrize("sign", TURNING)
def test_text_neither_turns_around_nor_steers(written, sign):
    assert errors.inert(f"a{sign}b\nc\u202fd") == "a?b\nc\u202fd"
    assert writing.table_text([f"a{sign}b"], [[f"a{sign}b"]]) == "a?b\na?b\n"
    code = f"\\u{ord(sign):04x}"
    assert reading.read_json(written("a.json", f'{{"a{code}b": ["a{code}b"]}}')) == {"a?b": ["a?b"]}


#: Files of 100 kB and more that took over a minute each, by the square of a repetition.
LONG = {
    "digits.AT2": "UNITS OF G\nNPTS= 1, DT= .01\n" + "1" * 100_000 + "x",
    "units.AT2": "UNITS" + " " * 100_000 + "\nNPTS= 1, DT= .01\n1",
    "npts.AT2": "UNITS OF G\nNPTS=1" + " " * 100_000 + "\n1",
    "plain.AT2": "UNITS OF G\n1" + " " * 100_000 + "1\n1",
    "step.AT2": "UNITS OF G\nNPTS=1 DT=" + "1" * 100_000 + "\n1",
    "digits.csv": "time_s,acceleration_g\n0,1\n0.1," + "1" * 100_000 + "x\n",
    "field.csv": 'time_s,acceleration_g\n0,1\n0.1,"' + "1" * 200_000 + '"\n',
    "count.V2": "1 points of accel data equally spaced at " + "1" * 100_000 + " sec\n1",
    "blanks.V2": "1 points of accel data equally spaced at .01 sec"
    + " " * 100_000
    + "\n"
    + " " * 100_000,
    "blocks.V2": "1 points of accel data equally spaced at .01 sec, in g\n1\n" * 20_000,
    "wide.V2": "9 Real-header values follow on 9 lines, Format= (999F999.1)\n" * 20_000,
    "keys.ASC": "SAMPLING_INTERVAL_S: 1\n" + "A" * 1_000_000,
    "lines.ASC": "SAMPLING_INTERVAL_S: 1\n" * 50_000,
    "scale.NS": "Origin Time\nScale Factor      "
    + "1" * 1_000_000
    + "\nSampling Freq(Hz) 1\nMemo.\n1",
    "commas.txt": "1," * 500_000,
    "digits.txt": "1" * 1_000_000 + "," + "1" * 1_000_000,
    "words.txt": "a " * 500_000,
    "brackets.txt": "time_s acc" + "[" * 500_000 + "\n1 2\n",
    "word.toml": "a" * 1_000_000,
    "blanks.toml": "a = 1\n" + " " * 1_000_000 + "\n",
    "dots.toml": "a = '" + "x. " * 300_000 + "'",
    "quotes.toml": "a = 1 #" + "\"'" * 500_000,
    "quoted.toml": '" "' + '." "' * 100_000 + " = 1",
    "columns.csv": "t,theta" + ",x" * 1_000_000 + "\n0,1" + ",1" * 1_000_000 + "\n",
    "row.csv": "t,theta\n0,1" + ",1" * 1_000_000 + "\n",
    "lines.csv": 't,theta,"' + "\n" * 300_000 + '"\n0,0,0\n',
    "line.csv": "t,theta\n0," + "1" * 2_000_000 + "\n",
}

_READ = """
import resource, sys
from pathlib import Path
import pandas
from rockcheck.scenes import History, InputError
from rockcheck.scenes.files import read_toml
from rockcheck.scenes.recordings import read_record
used = resource.getrusage(resource.RUSAGE_SELF).ru_utime
resource.setrlimit(resource.RLIMIT_CPU, (int(used) + 10,) * 2)
path = Path(sys.argv[1])
for read in {".toml": [read_toml], ".csv": [read_record, History.load]}\
.get(path.suffix, [read_record]):
    try:
        read(path)
    except InputError as error:
        assert len(str(error)) < 600 and str(error).isprintable(), error
print("read or refused")
"""


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize("name", LONG)
def test_any_file_of_a_megabyte_is_read_or_refused_within_ten_seconds(tmp_path, name):
    (tmp_path / name).write_text(LONG[name])
    done = subprocess.run(
        [sys.executable, "-c", _READ, str(tmp_path / name)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout == "read or refused\n", done.stderr[-2000:]


READERS = (
    History.load,
    recordings.read_record,
    load_scene,
    files.read_toml,
)
#: What may lie where a file should, and what is said of it.
NO_FILES = {
    # A pipe would be waited for without end, a device read without end.
    "a pipe": (os.mkfifo, "cannot be read: not a file"),
    "a folder": (Path.mkdir, "cannot be read: not a file"),
    "a link to a device": (lambda path: path.symlink_to("/dev/zero"), "cannot be read: not a file"),
    "nothing": (lambda path: None, "cannot be read: No such file"),
    "bytes": (lambda path: path.write_bytes(bytes(range(256))), "not a (text file|CSV table)"),
}


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize("read", READERS)
@pytest.mark.parametrize("kind", NO_FILES)
def test_only_regular_files_of_text_are_read(tmp_path, read, kind, fault_of):
    path = tmp_path / ("a.toml" if read in (load_scene, files.read_toml) else "a.csv")
    make, said = NO_FILES[kind]
    make(path)
    assert re.search(f"{path.name}: {said}", str(fault_of(read, path)))


@pytest.mark.needs("POSIX")
def test_what_lies_beside_a_history_or_in_a_run_is_a_regular_file_too(tmp_path, fault_of):
    (tmp_path / "h.csv").write_text("t,theta\n0,0\n1,0\n")
    for read, path, beside in (
        (History.load, tmp_path / "h.csv", "h.events.csv"),
        (results.Run.load, tmp_path, "run.json"),
    ):
        os.mkfifo(tmp_path / beside)
        assert "not a file" in str(fault_of(read, path))


@pytest.mark.parametrize(
    ("read", "name", "text", "about"),
    [
        (
            load_scene,
            "a.toml",
            'name = "b"\nduration = 1.0\nblock = { half_width = 0.3, half_height = 1.0 }\n'
            "floor = { friction = 0.4 }\n",
            {"name": "b"},
        ),
        (
            recordings.read_record,
            "a.csv",
            "time_s,acceleration_m_s2\n0.0,0.1\n0.5,0.2\n",
            {"time_step": 0.5},
        ),
        (
            History.load,
            "h.csv",
            "t,theta\n0,0.5\n1,0.25\n",
            {"outcome": "moving", "peak_rotation": 0.5},
        ),
        (
            History.load,
            "h.csv",
            't,theta,rockcheck_history\n0,0.5,"{""outcome"": ""at rest""}"\n1,0.25,\n',
            {"outcome": "at rest", "peak_rotation": 0.5},
        ),
    ],
)
def test_a_byte_order_mark_is_no_part_of_the_text(written, read, name, text, about):
    """As some editors write it: scene, record and history are read as without it."""
    found = read(written(name, text.encode("utf-8-sig")))
    assert {key: getattr(found, key) for key in about} == about


@pytest.mark.parametrize(
    "key",
    [
        "a" + ".a" * 50,
        "a" + " . a" * 50,
        '" "' + '." "' * 50,
        "[a" + ".a" * 50 + "]",
        '"a."' + ".'.'" * 50,
    ],
)
def test_a_key_of_many_parts_is_refused(written, key, fault_of):
    assert "a key of more than 50 parts" in str(
        fault_of(files.read_toml, written("a.toml", key if key.startswith("[") else f"{key} = 1"))
    )


@pytest.mark.parametrize(
    "line",
    ["a" + ".a" * 48 + " = 1", "a = [" + "0.1, " * 100 + "]", 'a = "' + "two words. " * 100 + '"'],
)
def test_a_key_of_few_parts_is_read(written, line):
    assert files.read_toml(written("a.toml", line))


def test_a_file_that_is_too_large_is_not_read(tmp_path, fault_of):
    (tmp_path / "a.toml").touch()
    os.truncate(tmp_path / "a.toml", 10_000_001)
    assert "larger than 10000000 bytes" in str(fault_of(files.read_toml, tmp_path / "a.toml"))


@pytest.mark.needs("POSIX")
def test_into_a_pipe_that_was_named_is_written(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    end = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    writing.write_whole(pipe, "words", named=True)
    assert os.read(end, 99) == b"words"
    os.close(end)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    writing.write_whole(pipe, "words")
    assert pipe.read_text() == "words"


def test_a_folder_is_not_written_over(tmp_path):
    for named in (True, False):
        with pytest.raises(IsADirectoryError, match="directory"):
            writing.write_whole(tmp_path, "words", named=named)
    assert list(tmp_path.iterdir()) == []


def test_a_table_in_markdown_has_its_rows_between_bars():
    rows = [["1", "a|b"], ["22", "c"]]
    assert writing.markdown_table(["n", "word"], rows).splitlines()[2:] == [
        "| 1 | a\\|b |",
        "| 22 | c |",
    ]


def test_what_is_not_finite_is_null_in_json():
    value = {"a": [1.5, math.nan, "nan", 3, None], "b": (math.inf, True)}
    plain = {"a": [1.5, None, "nan", 3, None], "b": [None, True]}
    assert json.loads(writing.json_text(value)) == plain
    assert json.loads(writing.json_text(writing.finite(value))) == plain
