"""Sets of recorded motions: which files are meant, which components shake a block, and which
vertical one goes with them."""

from pathlib import Path

import numpy as np
import pytest

from rockcheck.scenes import InputError
from rockcheck.scenes.recordings import Reading
from rockcheck.scenes.recordings.recording import Recording
from rockcheck.scenes.recordings.sets import (
    _vertical_file,
    files_of,
    is_vertical,
    motions_of,
    verticals_of,
)


def table(path, gain=1.0):
    """A motion of four samples, the largest `gain` m/s^2."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        "time_s,acceleration_m_s2\n"
        + "".join(f"{0.01 * k},{gain * a}\n" for k, a in enumerate((0, 1, -1, 0))),
        encoding="utf-8",
    )
    return path


def channels(path, **gains):
    """A file of several channels (CSMIP), each with its largest acceleration in m/s^2."""
    text = ""
    for name, gain in gains.items():
        values = "".join(f"{100 * gain * a:10.4f}" for a in (0, 1, -1, 0, 0, 0, 0, 0))
        text += (
            f"Corrected data\nChan  1: {name}\n"
            "    8 points of accel data equally spaced at   .020 sec, in cm/sec2. (8f10.4)\n"
            f"{values}\n"
        )
    path.write_text(text, encoding="utf-8")
    return path


def peak(recording):
    return pytest.approx(float(np.max(np.abs(recording.samples))))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_folder_means_its_files_and_a_pattern_those_that_fit(folder):
    for name in ("set/b.csv", "set/a.csv", "set/.hidden.csv", "set/below/c.csv", "set/d.txt"):
        table(folder / name)
    assert list(files_of(["set"])) == [Path("set/a.csv"), Path("set/b.csv"), Path("set/d.txt")]
    assert list(files_of(["set/*.csv"])) == [Path("set/a.csv"), Path("set/b.csv")]
    assert sorted(files_of(["set/b*", "set", "set/b.csv"])) == [
        Path("set/a.csv"),
        Path("set/b.csv"),
        Path("set/d.txt"),
    ]
    assert list(files_of(["gone.csv"])) == [Path("gone.csv")]  # whoever reads it says so
    (folder / "empty").mkdir()
    for word, said in (
        ("empty", "a folder without files"),
        ("set/x*", "no such files"),
        ("set/bel*", "no such files"),
    ):
        with pytest.raises(InputError, match=said):
            files_of([word])


def test_a_name_that_could_be_a_pattern_is_that_of_a_file_where_there_is_one(folder):
    table(folder / "a[1].csv")
    table(folder / "a1.csv")
    assert list(files_of(["a[1].csv"])) == [Path("a[1].csv")]
    (folder / "a[1].csv").unlink()
    assert list(files_of(["a[1].csv"])) == [Path("a1.csv")]


def test_vertical_components_are_left_out_unless_they_are_asked_for(folder):
    both, alone = channels(folder / "two.v2", East=1.0, Up=0.5), table(folder / "up.csv", 0.25)
    motions, left_out = motions_of([both, table(folder / "ns.csv", 2.0), alone], Reading())
    assert [(name, peak(one)) for name, one in motions] == [("two.v2 East", 1.0), ("ns.csv", 2.0)]
    assert left_out == ["two.v2 Up", "up.csv"]
    for paths, reading, name in (
        ([both], Reading(component="Up"), "two.v2"),
        ([alone], Reading(column=2), "up.csv"),
    ):
        motions, left_out = motions_of(paths, reading)
        assert ([name for name, _ in motions], left_out) == ([name], [])
    with pytest.raises(InputError, match=r"up\.csv: a vertical component"):
        motions_of([alone], Reading())
    assert motions_of([], Reading()) == ([], [])


def test_the_vertical_component_is_that_of_the_same_file_or_of_one_named_alike(folder):
    paths = [
        channels(folder / "two.v2", East=1.0, North=2.0, Up=0.5),
        table(folder / "a-ns.csv"),
        table(folder / "a-up.csv", 0.25),
    ]
    found = verticals_of(paths, Reading())
    assert {name: peak(one) for name, one in found.items()} == {
        "two.v2 East": 0.5,
        "two.v2 North": 0.5,
        "a-ns.csv": 0.25,
    }


def test_a_motion_has_exactly_one_vertical_component_and_none_is_left_over(folder):
    plain, up, down = (
        table(folder / "a-ns.csv"),
        table(folder / "a-up.csv"),
        table(folder / "a-down.csv"),
    )
    twice, other = (
        channels(folder / "two.v2", East=1.0, Up=0.5, Down=0.5),
        table(folder / "b-up.csv"),
    )
    for paths, said in (
        ([plain], r"a-ns\.csv: 0 vertical"),
        ([plain, up, down], r"a-ns\.csv: 0 vertical"),
        ([twice], r"two\.v2: 2 vertical"),
        ([plain, up, other], r"b-up\.csv: a vertical component, and no horizontal"),
        ([up], r"a-up\.csv: a vertical component, and no horizontal"),
    ):
        with pytest.raises(InputError, match=said):
            verticals_of(paths, Reading())


@pytest.mark.parametrize(
    ("name", "form", "component", "vertical"),
    [
        ("RSN6_IMPVALL.I_I-ELC-UP.AT2", "PEER AT2", "UP", True),
        ("RSN6_IMPVALL.I_I-ELC180.AT2", "PEER AT2", "180", False),
        ("RSN1_DWN.AT2", "PEER AT2", "", True),
        ("RSN1.AT2", "PEER AT2", "V", True),
        ("IV.T1213..HNZ.D.ASC", "ESM ASCII", "HNZ", True),
        ("IV.T1213..HNE.D.ASC", "ESM ASCII", "HNE", False),
        ("MYG0041103111446.UD", "K-NET ASCII", "U-D", True),
        ("MYGH041103111446.UD2", "K-NET ASCII", "6", True),
        ("MYGH041103111446.EW2", "K-NET ASCII", "5", False),
        ("station.V2", "V2", "up", True),
        ("station.V2", "V2", "Down", True),
        ("station.V2", "V2", "90 deg", False),
        ("table-up.csv", "CSV", "acceleration_g", True),
        ("cup.csv", "CSV", "acceleration_g", False),
        ("setup.txt", "table", "column 2", False),
    ],
)
def test_which_component_is_vertical(name, form, component, vertical):
    recording = Recording(
        samples=np.zeros(3), time_step=0.01, unit="g", form=form, component=component
    )
    assert is_vertical(Path(name), recording) == vertical


@pytest.mark.parametrize(
    ("name", "others", "vertical"),
    [
        ("RSN6_IMPVALL.I_I-ELC180.AT2", ("RSN6_IMPVALL.I_I-ELC-UP.AT2", "RSN8_NCALIF-UP.AT2"), 0),
        ("RSN6_IMPVALL.I_I-ELC180.AT2", ("RSN8_NCALIF-UP.AT2",), None),
        ("IV.T1213..HNE.D.ASC", ("IV.T1214..HNZ.D.ASC", "IV.T1213..HNZ.D.ASC"), 1),
        ("MYG0041103111446.EW", ("MYG0041103111446.UD", "MYG0051103111446.UD"), 0),
        ("MYGH041103111446.NS2", ("MYGH041103111446.UD1", "MYGH041103111446.UD2"), 1),
        ("ns.csv", ("up.csv",), 0),
        ("ns.csv", ("up.csv", "down.csv"), None),
        ("ns.csv", ("elsewhere/up.csv",), None),
    ],
)
def test_which_file_has_the_vertical_component(name, others, vertical):
    paths = [Path(other) for other in others]
    assert _vertical_file(Path(name), paths) == (None if vertical is None else paths[vertical])
