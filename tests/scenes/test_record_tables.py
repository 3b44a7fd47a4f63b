"""Records as tables: what is read of them, what has to be told, and how their times are judged."""

import numpy as np
import pytest

from rockcheck.scenes import InputError, load_scene
from rockcheck.scenes.observation import scene_notes
from rockcheck.scenes.recordings import Reading, read_record

G = 9.80665


@pytest.mark.parametrize(
    ("text", "options", "samples", "step"),
    [
        ("0.1\n0.2\n-0.3\n", {"unit": "g", "time_step": 0.02}, [0.1 * G, 0.2 * G, -0.3 * G], 0.02),
        ("0.1 0.2\n0.3 0.4\n", {"unit": "m/s2", "time_step": 0.02, "column": 2}, [0.2, 0.4], 0.02),
        ("0 10\n0.5 20\n", {"unit": "gal"}, [0.1, 0.2], 0.5),
        ("0 10\n0.5 20\n", {"unit": "mm/s2"}, [0.01, 0.02], 0.5),
        ("0,0 1,5\n0,5 2,5\n", {"unit": "cm/s2"}, [0.015, 0.025], 0.5),
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
    ],
)
def test_tables(text, options, samples, step, tmp_path):
    path = tmp_path / "motion.txt"
    for content in (
        text.encode(),
        text.encode("utf-8-sig"),
        text.encode("utf-16"),
        text.replace("\n", "\r\n").encode(),
    ):
        path.write_bytes(content)
        record = read_record(path, Reading(**options))
        np.testing.assert_allclose(record.samples, samples, rtol=1e-14)
        assert record.time_step == pytest.approx(step, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        (
            "0 1\n0.5 2\n",
            {},
            "the unit of acceleration is not stated; give it:"
            ' --read unit=g (in a scene file: unit = "g")',
        ),
        (
            "1\n2\n",
            {"unit": "g"},
            "no column of times; give the time step: --read time_step=0.01 (in a scene file:"
            " time_step = 0.01)",
        ),
        (
            "1 2 3\n4 5 6\n",
            {"unit": "g"},
            "3 columns; give that of the accelerations: --read column=2 (in a scene file: column ="
            " 2)",
        ),
        ("1 2 3\n4 5 6\n", {"column": 4}, "no single column 4; there are 1 to 3"),
        (
            "words\nand more of them\n",
            {"unit": "g"},
            "no line of numbers within the first 200; give the lines to leave out: --read"
            " header_lines",
        ),
        (
            "0,5\n1,5\n",
            {"unit": "g"},
            "a comma between columns or before the decimals? --read decimal=,",
        ),
        (
            "time_s,acceleration_g\n0,1\n1,1\n",
            {"unit": "gal"},
            "the file states the unit g, not gal",
        ),
        ("0 1\n0.5\n", {"unit": "g"}, "line 2: 1 fields where the first line has 2"),
        ("0 1\n1 2\n", {"component": 1}, "a table has columns; give the option column"),
    ],
)
def test_what_is_not_known_is_asked_for(text, options, said, tmp_path):
    path = tmp_path / "motion.txt"
    path.write_text(text)
    with pytest.raises(InputError) as fault:
        read_record(path, Reading(**options))
    assert said in str(fault.value)
    assert str(fault.value).isprintable()


@pytest.mark.parametrize(
    ("rate", "decimals"),
    [(300, 3), (300, 4), (128, 4), (128, 3), (100, 2), (200, 3), (60, 3), (75, 2)],
)
def test_times_are_judged_by_their_digits(rate, decimals, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(
        "time_s,acceleration_g\n" + "".join(f"{n / rate:.{decimals}f},0.1\n" for n in range(1000))
    )
    if 10.0**-decimals <= 0.5 / rate or rate in (100, 200):
        assert read_record(path).time_step == pytest.approx(1 / rate, rel=1e-12)
    else:
        with pytest.raises(
            InputError,
            match=r"is off the uniform step .*; times of 0.01 s may hide it: --read time_step",
        ):
            read_record(path)
        assert read_record(path, Reading(time_step=1 / rate)).time_step == 1 / rate


def test_a_missing_sample_is_not_taken_for_rounding(tmp_path):
    path = tmp_path / "a.csv"
    kept = [n for n in range(1000) if n != 500]
    path.write_text("time_s,acceleration_g\n" + "".join(f"{n / 300:.3f},0.1\n" for n in kept))
    with pytest.raises(InputError, match="is off the uniform step"):
        read_record(path)


def test_a_late_start_is_zero_for_the_scene_and_a_note_says_so(tmp_path):
    (tmp_path / "late.csv").write_text("time_s,acceleration_g\n5.0,0\n5.5,0.5\n6.0,0\n")
    (tmp_path / "a.toml").write_text(
        "duration = 1.0\nblock = { half_width = 0.3, half_height = 1.0 }\nfloor = { friction = 0.4"
        " }\n"
        '[excitation]\nkind = "record"\nfile = "late.csv"\n'
    )
    scene = load_scene(tmp_path / "a.toml")
    np.testing.assert_allclose(scene.excitation.acceleration([0.0, 0.5, 1.0]), [0.0, 0.5 * G, 0.0])
    assert scene_notes(scene) == ("the horizontal record: the first time is 5 s; it is 0 here",)
