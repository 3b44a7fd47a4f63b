"""Sets of recorded motions: which files are meant, which components shake a block, and which
vertical one goes with them."""

from pathlib import Path

import numpy as np
import pytest

from rockcheck.scenes import load_scene, observation, recordings
from rockcheck.scenes.recordings import sets
from rockcheck.scenes.recordings.recording import Recording


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
    text = "".join(
        f"Corrected data\nChan  1: {name}\n"
        "    8 points of accel data equally spaced at   .020 sec, in cm/sec2. (8f10.4)\n"
        + "".join(f"{100 * gain * a:10.4f}" for a in (0, 1, -1, 0, 0, 0, 0, 0))
        + "\n"
        for name, gain in gains.items()
    )
    path.write_text(text, encoding="utf-8")
    return path


def peak(recording):
    return pytest.approx(float(np.max(np.abs(recording.samples))))


def test_a_folder_means_its_files_and_a_pattern_those_that_fit(tmp_path, monkeypatch, fault_of):
    monkeypatch.chdir(tmp_path)
    for name in ("set/b.csv", "set/a.csv", "set/.hidden.csv", "set/below/c.csv", "set/d.txt"):
        table(tmp_path / name)
    for words, names in (
        (["set"], ["set/a.csv", "set/b.csv", "set/d.txt"]),
        (["set/b*", "set", "set/b.csv"], ["set/b.csv", "set/a.csv", "set/d.txt"]),
        (["set/*.csv"], ["set/a.csv", "set/b.csv"]),
        (["gone.csv"], ["gone.csv"]),  # whoever reads it says so
    ):
        assert list(sets.files_of(words)) == [Path(name) for name in names]
    Path("empty").mkdir()
    for word, said in (
        ("empty", "a folder without files"),
        ("set/x*", "no such files"),
        ("set/bel*", "no such files"),
    ):
        assert said in str(fault_of(sets.files_of, [word]))
    for name in ("a1.csv", "a[1].csv"):  # a name that could be a pattern
        table(tmp_path / name)
        assert list(sets.files_of(["a[1].csv"])) == [Path(name)]


def test_vertical_components_are_left_out_unless_they_are_asked_for(tmp_path, fault_of):
    both, alone = channels(tmp_path / "two.v2", East=1.0, Up=0.5), table(tmp_path / "up.csv", 0.25)
    every = [both, table(tmp_path / "ns.csv", 2.0), alone]
    for paths, reading, paired, found, other in (
        (
            every,
            recordings.Reading(),
            False,
            [("two.v2 East", 1.0), ("ns.csv", 2.0)],
            ["two.v2 Up", "up.csv"],
        ),
        ([both], recordings.Reading(component="Up"), False, [("two.v2", 0.5)], []),
        ([alone], recordings.Reading(column=2), False, [("up.csv", 0.25)], []),
        (every[1:], recordings.Reading(column=2), True, [("ns.csv", 2.0)], ["up.csv"]),
        ([], recordings.Reading(), False, [], []),
    ):
        if paired:
            pairs, odd = sets.pairs_of(paths, reading)
            assert [(name, peak(motion)) for name, motion, _ in pairs] == found
            assert odd == []
        else:
            motions, left_out = sets.motions_of(paths, reading)
            assert [(name, peak(motion)) for name, motion in motions] == found
            assert left_out == other
    assert "up.csv: a vertical component" in str(
        fault_of(sets.motions_of, [alone], recordings.Reading())
    )


def test_the_vertical_component_is_that_of_the_same_file_or_of_one_named_alike(tmp_path):
    paths = [
        channels(tmp_path / "two.v2", East=1.0, North=2.0, Up=0.5),
        table(tmp_path / "a-ns.csv"),
        table(tmp_path / "a-up.csv", 0.25),
        table(tmp_path / "b-ns.csv"),
        table(tmp_path / "b-up.csv", 0.75),
    ]
    assert verticals(paths[:3]) == [0.5, 0.5, 0.25]
    assert verticals(paths[3:], column=2) == [0.75]


def verticals(paths, **options):
    pairs, _ = sets.pairs_of(paths, recordings.Reading(**options))
    return [peak(vertical) for _, _, vertical in pairs]


def test_a_motion_has_exactly_one_vertical_component_and_none_is_left_over(tmp_path, fault_of):
    plain, up, down = (table(tmp_path / f"{name}.csv") for name in ("a-ns", "a-up", "a-down"))
    for paths, said in (
        ([plain], "a-ns.csv: 0 vertical"),
        ([plain, up, down], "a-ns.csv: 0 vertical"),
        ([channels(tmp_path / "two.v2", East=1.0, Up=0.5, Down=0.5)], "two.v2: 2 vertical"),
        ([up], "a-up.csv: a vertical component, and no horizontal"),
    ):
        assert said in str(fault_of(sets.pairs_of, paths, recordings.Reading()))


def test_what_has_no_partner_is_left_out_and_named(tmp_path):
    paths = [
        table(tmp_path / f"{name}.csv") for name in ("a-ns", "a-up", "b-up", "c-ns", "d-ns", "d-up")
    ]
    pairs, odd = sets.pairs_of(paths, recordings.Reading())
    assert [name for name, _, _ in pairs] == ["a-ns.csv", "d-ns.csv"]
    assert "c-ns.csv: 0 vertical components" in odd[0]
    assert "b-up.csv: a vertical component, and no horizontal one is named alike" in odd[1]


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
        ("S1_V.csv", "CSV", "acceleration_g", True),
        ("S1-Z.txt", "table", "column 2", True),
        ("S1_V2.csv", "CSV", "acceleration_g", False),
        ("topaz.csv", "CSV", "acceleration_g", False),
        ("setup.txt", "table", "column 2", False),
        ("station.V2", "V2", "BNZ", True),
        ("CE12044.HNZ.acc.V2", "V2", "0 deg", True),
        ("CE12044.HNN.acc.V2", "V2", "0 deg", False),
        ("CE12044.HNZ.acc.V2", "V2", "90 deg", False),
    ],
)
def test_which_component_is_vertical(name, form, component, vertical):
    given = {"form": form, "component": component, "unit": "g", "time_step": 0.01}
    assert sets.is_vertical(Path(name), Recording(samples=np.zeros(3), **given)) == vertical


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
        ("S1.csv", ("S1-V.csv",), 0),
        ("S1 NS.csv", ("S1-V.csv", "S10-V.csv"), 0),
        ("G01000.AT2", ("G01-UP.AT2",), 0),
        *((f"{name}.csv", ("S1_V.csv",), None) for name in ("S10-NS", "S10", "S1B_EW")),
    ],
)
def test_which_file_has_the_vertical_component(name, others, vertical):
    paths = [Path(other) for other in others]
    assert sets._vertical_file(Path(name), paths) == (None if vertical is None else paths[vertical])


G = 9.80665


@pytest.mark.parametrize(
    ("text", "options", "samples", "step"),
    [
        ("0.1\n0.2\n-0.3\n", {"unit": "g", "time_step": 0.02}, [0.1 * G, 0.2 * G, -0.3 * G], 0.02),
        ("0.1 0.2\n0.3 0.4\n", {"unit": "m/s2", "time_step": 0.02, "column": 2}, [0.2, 0.4], 0.02),
        ("0 10\n0.5 20\n", {"unit": "gal"}, [0.1, 0.2], 0.5),
        ("0 10\n0.5 20\n", {"unit": "mm/s2"}, [0.01, 0.02], 0.5),
        ("0,0 1,5\n0,5 2,5\n", {"unit": "cm/s2"}, [0.015, 0.025], 0.5),
        ("0 1,5 A\n0,5 2 A\n", {"unit": "m/s2", "column": 2, "header_lines": 0}, [1.5, 2.0], 0.5),
        ("0 ,15\n1 ,25\n", {"unit": "m/s2"}, [15.0, 25.0], 1.0),
        ("0,5\n1,5\n", {"unit": "m/s2", "decimal": ",", "time_step": 0.1}, [0.5, 1.5], 0.1),
        ("0;1,5\n0,5;2\n", {"unit": "m/s2"}, [1.5, 2.0], 0.5),
        ("0\t1.5\n0.5\t2\n", {"unit": "m/s2"}, [1.5, 2.0], 0.5),
        ("17 words\n3 4\n0.5 1\n1.0 2\n", {"unit": "m/s2", "header_lines": 2}, [1.0, 2.0], 0.5),
        ("time_s,acceleration_cm_s2\n0,100\n0.1,50\n", {}, [1.0, 0.5], 0.1),
        ("time_s,acceleration_gal\n0,100\n0.1,50\n", {}, [1.0, 0.5], 0.1),
        ("time_s,acceleration_ft_s2\n0,1\n0.01,2\n", {}, [0.3048, 0.6096], 0.01),
        ("time_s,acceleration_mm_s2\n0,100\n0.1,50\n", {}, [0.1, 0.05], 0.1),
        (
            "time_s,acceleration_g,acceleration_m_s2\n0,9,1\n1,9,2\n",
            {"column": "acceleration_m_s2"},
            [1.0, 2.0],
            1.0,
        ),
        ("time (s);acc [cm/s^2]\n0;1\n1;2\n", {}, [0.01, 0.02], 1.0),
        *(
            (text, {"unit": "m/s2", "column": 2, "time_step": 0.5, "header_lines": n}, [1, 2], 0.5)
            for n, text in enumerate(("A;1;\nA;2;\n", "Station 12\nA 1\nA 2\n"))
        ),
        *(
            (
                f"# a remark\nstation,time_s , {column}\n"
                "A,0.00,0.0\n\nA,0.02,1.0e-1\n# another\nA,0.04,-.2\n",
                {},
                [0.0, 0.1 * factor, -0.2 * factor],
                0.02,
            )
            for column, factor in (("acceleration_g", G), ("acceleration_m_s2", 1.0))
        ),
    ],
)
@pytest.mark.parametrize(
    ("encoding", "end"), [("utf-8", "\n"), ("utf-8-sig", "\n"), ("utf-16", "\n"), ("utf-8", "\r\n")]
)
def test_tables(text, options, samples, step, encoding, end, written):
    record = recordings.read_record(
        written("motion.txt", text.replace("\n", end).encode(encoding)),
        recordings.Reading(**options),
    )
    np.testing.assert_allclose(record.samples, samples, rtol=1e-15)
    assert record.time_step == step


@pytest.mark.parametrize("step", [None, 0.01, 0.005])
def test_a_sample_that_is_missing_is_named_whatever_step_is_given(step, written, fault_of):
    rows = "".join(f"{n / 100:.2f},0.1\n" for n in range(2000) if n != 1000)
    path = written("a.csv", "time_s,acceleration_g\n" + rows)
    said = str(fault_of(recordings.read_record, path, recordings.Reading(time_step=step)))
    assert "line 1002: time 10.01 s is off the uniform step 0.01 s" in said


@pytest.mark.parametrize(
    ("rate", "decimals"),
    [(300, 3), (300, 4), (128, 4), (128, 3), (100, 2), (200, 3), (60, 3), (75, 2)],
)
def test_times_are_judged_by_their_digits(rate, decimals, written, fault_of):
    rows = "".join(f"{n / rate:.{decimals}f},0.1\n" for n in range(1000))
    path = written("a.csv", "time_s,acceleration_g\n" + rows)
    hidden = 10.0**-decimals > 0.5 / rate and rate not in (100, 200)
    if hidden:
        said = str(fault_of(recordings.read_record, path)).split("is off the uniform step ")[1]
        assert "; times of 0.01 s may hide it: --read time_step" in said
    reading = recordings.Reading(time_step=1 / rate) if hidden else recordings.Reading()
    assert recordings.read_record(path, reading).time_step == 1 / rate


def test_a_step_of_no_whole_rate_is_the_mean_to_twelve_digits(written):
    rows = "".join(f"{n * 0.01371:.4f},0.1\n" for n in range(1000))
    path = written("a.csv", "time_s,acceleration_g\n" + rows)
    step = recordings.read_record(path).time_step
    assert step == pytest.approx(0.01371, rel=1e-5)
    assert step == float(f"{step:.12g}")


def test_a_late_start_is_zero_for_the_scene_and_a_note_says_so(written):
    written("late.csv", "time_s,acceleration_g\n5.0,0\n5.02,0.5\n5.04,0\n")
    text = (
        "duration = 0.04\nblock = { half_width = 0.3, half_height = 1.0 }\nfloor = { friction = 0.4"
        ' }\n[excitation]\nkind = "record"\nfile = "late.csv"\n'
    )
    scene = load_scene(written("a.toml", text))
    np.testing.assert_allclose(
        scene.excitation.acceleration([0.0, 0.02, 0.04]), [0.0, 0.5 * G, 0.0]
    )
    assert observation.scene_notes(scene) == (
        "the horizontal record: the first time is 5 s; it is 0 here",
    )
