"""Records as they come: one motion of three components, whose peaks are known, in every format that
is read."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from rockcheck.commands.cli import main
from rockcheck.scenes import InputError, Record, load_scene
from rockcheck.scenes.observation import scene_notes
from rockcheck.scenes.recordings import Reading, intensity, read_components, read_record
from rockcheck.scenes.recordings.recording import Recording
from rockcheck.scenes.recordings.sets import _vertical_file, files_of, is_vertical, motions_of

G = 9.80665
STEP = 0.01
#: Peaks in g.
PEAKS = {"N-S": 0.31, "E-W": -0.27, "U-D": 0.15}


def motion(component: str) -> NDArray[np.float64]:
    """Accelerations in m/s^2, 401 of them: a burst without a mean, whose largest one stands at a
    sample."""
    t = STEP * np.arange(401)
    shape = np.sin(2 * np.pi * (t - 2.0) * 1.5 + np.pi / 2) * np.exp(-((t - 2.0) ** 2) / 0.4)
    return PEAKS[component] * G * shape


def _fixed(values: NDArray[np.float64], across: int, form: str) -> str:
    words = [format(value, form) for value in values]
    return "".join("".join(words[k : k + across]) + "\n" for k in range(0, len(words), across))


def at2(component: str, header: str = "NPTS=  {n}, DT= {dt:.4f} SEC,") -> bytes:
    values = motion(component) / G
    head = header.format(n=len(values), dt=STEP)
    text = (
        f"PEER NGA STRONG MOTION DATABASE RECORD\nM\xe9xico, 9/19/1985, {component}\n"
        f"ACCELERATION TIME SERIES IN UNITS OF G\n{head}\n"
    )
    return (text + _fixed(values, 5, "15.7E")).encode("latin-1")


def at2_plain(component: str) -> bytes:
    return at2(component, " {n}  {dt:.4f}  NPTS, DT").replace(b"\n", b"\r\n")


def _cosmos_channel(component: str) -> str:
    values = motion(component) * 100
    integers, reals = [-999] * 100, [-999.0] * 100
    integers[53] = {"N-S": 360, "E-W": 90, "U-D": 400}[component]
    reals[33], reals[61] = 2 * STEP, 1000 * STEP  # of the raw record in s, of these samples in ms
    reals[41] = 426212.0  # touches its neighbour
    return (
        "Corrected acceleration   (Format v01.20 with 13 text lines) Src: 052S7466.CE\n"
        + "".join(f"text line {n}\n" for n in range(2, 14))
        + " 100 Integer-header values follow on  10 lines, Format= (10I8)\n"
        + _fixed(np.array(integers), 10, "8d")
        + " 100 Real-header values follow on  17 lines, Format= (6F13.6)\n"
        + _fixed(np.array(reals), 6, "13.6f")
        + '   2 Comment lines follow, each starting with a "|":\n| a remark\n| accel of another\n'
        + f"    {len(values)} acceleration pts, approx    4 secs, units=cm/sec2 (04),"
        "Format=(8F10.5)\n"
        + _fixed(values, 8, "10.5f")
        + f"    {len(values)} velocity pts, approx    4 secs, units=cm/sec (05),Format=(8F10.5)\n"
        + _fixed(values * 0 + 999.0, 8, "10.5f")
        + "End-of-data for Chan  1 acceleration\n"
    )


def cosmos(component: str) -> bytes:
    return _cosmos_channel(component).encode()


def cosmos_three() -> bytes:
    return "".join(map(_cosmos_channel, PEAKS)).encode()


def _csmip_channel(component: str) -> str:
    values = motion(component) * 100
    direction = {"N-S": "360 Deg", "E-W": " 90 Deg", "U-D": "Up"}[component]
    return (
        f"Corrected accelerogram   89146-L2500-12044.02       Chan  1: {direction}     from   \n"
        + "Uncorrected Accelerogram Data             Processed: 02/13/12, CGS  146be002\n"
        + " 401 points of instrument- and baseline-corrected accel, veloc and displ data\n"
        + f" {len(values)} points of accel data equally spaced at  .010 sec, in cm/sec2. (8f10.6)\n"
        + _fixed(values, 8, "10.5f")
        + f" {len(values)} points of veloc data equally spaced at  .010 sec, in cm/sec.  (8f10.6)\n"
        + _fixed(values * 0 + 999.0, 8, "10.5f")
        + "/&  ---------- End of data for channel  1 ----------\n"
    )


def csmip(component: str) -> bytes:
    return _csmip_channel(component).encode()


def csmip_three() -> bytes:
    return "".join(map(_csmip_channel, PEAKS)).encode()


def esm(component: str) -> bytes:
    values = motion(component) * 100
    stream = {"N-S": "HNN", "E-W": "HNE", "U-D": "HNZ"}[component]
    text = (
        "EVENT_NAME: GREECE\nSTATION_NAME: Town Hall,Argos\nSAMPLING_INTERVAL_S:"
        f" {STEP:.6f}\nNDATA: {len(values)}\nDURATION_S: 4.010\n"
        f"STREAM: {stream}\nUNITS: cm/s^2\nPGA_CM/S^2: 304\nDATA_TYPE: ACCELERATION\nUSER5: \n"
    )
    return (text + _fixed(values, 1, ".6f")).encode()


def knet(component: str, direction: str = "") -> bytes:
    """Counts of a digitiser with an offset; 400 samples."""
    values = motion(component)[:400]
    counts = np.round((values - values.mean()) * 100 / (3920 / 6182761)).astype(int) + 4711
    rows = {
        "Origin Time": "2011/03/11 14:46:00",
        "Lat.": "38.103",
        "Station Code": "MYG004",
        "Sampling Freq(Hz)": "100Hz",
        "Duration Time(s)": "4",
        "Dir.": direction or component,
        "Scale Factor": "3920(gal)/6182761",
        "Max. Acc. (gal)": f"{abs(PEAKS[component]) * G * 100:.3f}",
        "Last Correction": "2011/03/11 14:46:21",
        "Memo.": "",
    }
    return (
        "".join(f"{key:<18}{value}\n" for key, value in rows.items()) + _fixed(counts, 8, "9d")
    ).encode()


def kiknet(component: str) -> bytes:
    return knet(component, {"N-S": "4", "E-W": "5", "U-D": "6"}[component])


def csv_gal(component: str) -> bytes:
    """As a spreadsheet saves it that writes commas before the decimals: semicolons, a mark, a start
    at 5 s."""
    rows = "".join(
        f"{5 + STEP * n:.2f};{value * 100:.6f}\n".replace(".", ",")
        for n, value in enumerate(motion(component))
    )
    return ("time_s;acceleration_gal\n" + rows).encode("utf-8-sig")


def columns(component: str) -> bytes:
    """Blanks, a header of words, times and two columns."""
    rows = "".join(
        f" {STEP * n:8.2f} {value:12.7f} {0.0:9.3f}\n" for n, value in enumerate(motion(component))
    )
    return ("Shake table of the institute\n  t [s]   acc [m/s2]   displacement\n" + rows).encode()


@dataclass(frozen=True)
class Made:
    """A format: what writes it, the name of its files, the sizes of its printed digits in g."""

    write: Callable[[str], bytes]
    name: str
    digit: float = 1e-7
    start: float = 0.0


FORMATS = {
    "PEER": Made(at2, "RSN1_{}.AT2"),
    "PEER, older": Made(at2_plain, "RSN2_{}.AT2"),
    "COSMOS V2": Made(cosmos, "station-{}.V2"),
    "CSMIP V2": Made(csmip, "csmip-{}.v2"),
    "ESM": Made(esm, "HI.ARS1..{}.D.ACC.ASC"),
    "K-NET": Made(knet, "MYG004-{}.knet", 2e-6),
    "CSV": Made(csv_gal, "{}.csv", start=5.0),
    "columns": Made(columns, "table-{}.txt"),
}


def folder_of_records(folder: Path) -> dict[str, tuple[Made, str]]:
    """Twenty-four files of three components in eight formats; what each was made of."""
    made = {}
    for form in FORMATS.values():
        for component in PEAKS:
            name = form.name.format(component)
            (folder / name).write_bytes(form.write(component))
            made[name] = form, component
    return made


def test_a_folder_of_24_files_in_eight_formats_is_read_whole(tmp_path):
    made = folder_of_records(tmp_path)
    assert len(made) == 24
    for name, (form, component) in made.items():
        record = read_record(tmp_path / name)
        expected = motion(component)[: len(record.samples)]
        if "knet" in name:
            expected = expected - expected.mean()
        assert record.time_step == STEP, name
        np.testing.assert_allclose(
            record.samples, expected, rtol=0, atol=form.digit * G * 1.01, err_msg=name
        )
        assert intensity.peak_acceleration(record) == pytest.approx(
            abs(PEAKS[component]), abs=3e-4 if "knet" in name else form.digit
        ), name
        assert any("it is 0 here" in note for note in record.notes) == (form.start != 0.0), name


def test_the_command_reads_that_folder(tmp_path, capsys):
    made = folder_of_records(tmp_path)
    assert main(["record", str(tmp_path), "--json"]) == 0
    records = json.loads(capsys.readouterr().out)["records"]
    assert [Path(one["file"]).name for one in records] == sorted(made)
    for one in records:
        form, component = made[Path(one["file"]).name]
        assert one["pga_g"] == pytest.approx(abs(PEAKS[component]), abs=3e-4)
        assert one["step_s"] == STEP
        assert one["samples"] == (400 if form.write is knet else 401)


@pytest.mark.parametrize(
    ("write", "names"),
    [(cosmos_three, ["360 deg", "90 deg", "up"]), (csmip_three, ["360 Deg", "90 Deg", "Up"])],
)
def test_several_components_in_one_file(write, names, tmp_path, capsys):
    path = tmp_path / "three.V2"
    path.write_bytes(write())
    found = read_components(path)
    assert [one.component for one in found] == names
    for one, component in zip(found, PEAKS, strict=True):
        np.testing.assert_allclose(one.samples, motion(component), atol=1.01e-7)
    with pytest.raises(
        InputError,
        match=r"3 components, 1 '360 .eg', .* give one:"
        r" --read component=1 \(in a scene file: component = 1\)",
    ):
        Record.from_file(path)
    assert Record.from_file(path, component=2).peak == pytest.approx(0.27, abs=1e-7)
    assert Record.from_file(path, component=names[2]).peak == pytest.approx(0.15, abs=1e-7)
    assert main(["record", str(path), "--read", f"component={names[1]}", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["component"], said["unit"], said["samples"]) == (names[1], "cm/s2", 401)
    assert said["duration_s"] == pytest.approx(4.0)
    with pytest.raises(InputError, match="no single component 4; there are 1 "):
        Record.from_file(path, component=4)


def test_a_v2_file_has_its_own_time_step_not_that_of_the_raw_record(tmp_path):
    path = tmp_path / "a.V2"
    text = cosmos("N-S").decode()
    raw, own = f"{2 * STEP:13.6f}", f"{1000 * STEP:13.6f}"
    assert text.count(raw) == text.count(own) == 1
    path.write_text(text)
    assert read_record(path).time_step == STEP
    path.write_text(text.replace(own, f"{-999:13.6f}").replace(raw, f"{STEP:13.6f}"))
    assert read_record(path).time_step == STEP
    path.write_text(text.replace(own, f"{-999:13.6f}"))
    with pytest.raises(InputError, match=r"401 points every 0.02 s are 8.02 s, not 4 secs"):
        read_record(path)
    path.write_text(text.replace(own, f"{-999:13.6f}").replace(raw, f"{-999:13.6f}"))
    with pytest.raises(InputError, match="no real header before this block states the time step"):
        read_record(path)


def test_k_net_takes_out_the_offset_and_says_so(tmp_path):
    path = tmp_path / "MYG0041103111446.NS"
    path.write_bytes(kiknet("N-S"))
    record = read_record(path)
    assert record.component == "4"
    assert abs(record.samples.mean()) < 1e-12
    assert record.notes == ("the mean, 2.987 gal, is taken out: the offset of the digitiser",)
    path.write_bytes(b"\n".join(knet("N-S").split(b"\n")[:-9]))
    with pytest.raises(InputError, match=r"Duration Time\(s\) 4 is 400 samples, the file has 336"):
        read_record(path)


# --- tables, and what has to be told of them


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
    "option",
    [{"column": 1}, {"header_lines": 3}, {"decimal": ","}, {"unit": "gal"}, {"time_step": 0.02}],
)
def test_options_do_not_overrule_a_header(option, tmp_path):
    path = tmp_path / "a.AT2"
    path.write_bytes(at2("N-S"))
    with pytest.raises(InputError, match="leave the option"):
        read_record(path, Reading(**option))


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


# --- intensity


def test_intensities_of_a_sine_are_its_closed_forms():
    """a = A sin(w t) over ten cycles: PGV 2 A/w from rest, Arias pi/(2 g) A^2 T/2; resonance builds
    up as 1 - exp(-z w t)."""
    amplitude, rate, step = 2.0, 2 * math.pi, 1e-3
    samples = amplitude * np.sin(rate * step * np.arange(10_001))
    record = Recording(samples=samples, time_step=step, unit="m/s2", form="CSV")
    assert intensity.peak_acceleration(record) == pytest.approx(amplitude / G, rel=1e-9)
    assert intensity.peak_velocity(record) == pytest.approx(2 * amplitude / rate, rel=1e-5)
    assert intensity.arias(record) == pytest.approx(
        math.pi / (2 * G) * amplitude**2 * 5.0, rel=1e-5
    )
    built_up = amplitude / G / (2 * 0.05) * (1 - math.exp(-0.05 * rate * 10.0))
    assert intensity.spectral_acceleration(record, 1.0) == pytest.approx(built_up, rel=0.01)
    assert intensity.spectral_acceleration(record, 0.01) == pytest.approx(amplitude / G, rel=0.01)


def test_spectral_accelerations_are_those_of_the_straight_lines_between_samples():
    """Samples four periods apart, or all motion in the last one: as of the same lines with samples
    4000 times as dense."""
    samples = np.array([0.0, 1.0, -0.5, 0.0])
    dense = Recording(
        samples=np.interp(np.arange(12_001) / 4000, np.arange(4), samples),
        time_step=1e-3,
        unit="m/s2",
        form="CSV",
    )
    for period in (1.0, 2.5):
        coarse = Recording(samples=samples, time_step=4.0, unit="m/s2", form="CSV")
        expected = intensity.spectral_acceleration(dense, period)
        assert intensity.spectral_acceleration(coarse, period) == pytest.approx(expected, rel=2e-3)
    # A hat of a step's length is, to an oscillator of a far longer period, an impulse; the peak
    # comes a quarter of a period later.
    last = Recording(samples=np.array([0.0, 0.0, 1.0]), time_step=1e-2, unit="m/s2", form="CSV")
    rate, damping = 2 * math.pi / 1.0, 0.05
    peak = rate * 1e-2 * math.exp(-damping / math.sqrt(1 - damping**2) * math.acos(damping))
    assert intensity.spectral_acceleration(last, 1.0) == pytest.approx(peak / G, rel=2e-3)


def test_periods_of_a_spectrum_leave_no_wide_gap():
    steps = np.divide(intensity.PERIODS[1:], intensity.PERIODS[:-1])
    assert np.all((steps > 1.0) & (steps <= 2.0))
    assert intensity.PERIODS[0] <= 0.1
    assert intensity.PERIODS[-1] >= 4.0


def test_the_command_shows_and_draws(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a.AT2").write_bytes(at2("N-S"))
    assert main(["record", "a.AT2", "--plot", "a.png"]) == 0
    said = capsys.readouterr().out
    for part in (
        "PEER AT2, unit g",
        "401 every 0.01 s, 4 s",
        "0.31 g",
        "Sa(T)",
        "1 s: ",
        "█",
        "picture: a.png",
    ):
        assert part in said, part
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    assert main(["record", "a.AT2", "--plot", "a.jpg"]) == 2
    assert "ends in .png" in capsys.readouterr().err


def test_one_bad_file_does_not_hide_the_others(tmp_path, capsys):
    (tmp_path / "a.AT2").write_bytes(at2("N-S"))
    (tmp_path / "b.txt").write_text("1 2 3\n")
    assert main(["record", str(tmp_path), "--json"]) == 2
    captured = capsys.readouterr()
    assert json.loads(captured.out)["samples"] == 401
    assert "b.txt, line 1: 3 columns" in captured.err


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


def run_together(
    across: int, count: int, width: int, form: str, unit: str = "G"
) -> tuple[str, NDArray[np.float64]]:
    """A PEER file in Fortran's columns without a blank between them, and its numbers as they are
    printed."""
    values = (
        np.random.default_rng(3).uniform(1.0, 9.0, count)
        * np.where(np.arange(count) % 3, 1.0, -1.0)
        * 1e-2
    )
    words = [format(value, form)[-width:].rjust(width) for value in values]
    lines = ["".join(words[k : k + across]) for k in range(0, count, across)]
    head = (
        f"PEER\nA, 1/1/2000, B, 180\nACCELERATION TIME SERIES IN UNITS OF {unit}\n"
        f"NPTS= {count}, DT= .01 SEC\n"
    )
    return head + "\n".join(lines) + "\n", np.array([float(word) for word in words])


@pytest.mark.parametrize("count", [1, 4, 5, 6, 23, 25])
@pytest.mark.parametrize(
    ("across", "width", "form"), [(5, 11, ".5E"), (5, 12, ".5E"), (8, 8, ".5f"), (1, 11, ".5E")]
)
def test_columns_of_fortran_may_run_together(tmp_path, across, width, form, count):
    """E-011.19 is the end of one number and the beginning of the next."""
    text, values = run_together(across, count, width, form)
    (tmp_path / "a.AT2").write_text(text)
    np.testing.assert_array_equal(read_record(tmp_path / "a.AT2").samples, values * G)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text[:-3] + "\n",
        lambda text: text.replace("E-0", "E0", 1),
        lambda text: text + " 1.0\n",
    ],
)
def test_columns_that_are_not_as_the_header_says_are_a_fault(tmp_path, change):
    (tmp_path / "a.AT2").write_text(change(run_together(5, 23, 11, ".5E")[0]))
    with pytest.raises(InputError, match="not a finite number"):
        read_record(tmp_path / "a.AT2")


SPELT = {
    "cm/s2": ["CM/S/S", "CM/SEC/SEC", "CM/S^2", "cm/sec2", "(CM/S**2)", "CM / S / S"],
    "ft/s2": ["FT/S/S", "ft/s2", "FT/SEC**2"],
    "m/s2": ["M/S/S", "M/SEC/SEC"],
    "g": ["G", "g", "G'S", "(G)"],
    "gal": ["GAL", "gals"],
}


@pytest.mark.parametrize(
    ("unit", "word"), [(unit, word) for unit, words in SPELT.items() for word in words]
)
def test_the_header_states_the_unit(tmp_path, unit, word):
    (tmp_path / "a.AT2").write_text(
        f"A\nACCELERATION TIME SERIES IN UNITS OF {word}\nNPTS= 2, DT= .01 SEC\n 1.0 2.0\n"
    )
    found = read_record(tmp_path / "a.AT2")
    assert found.unit == unit
    np.testing.assert_allclose(
        found.samples,
        np.array([1.0, 2.0]) * {"g": G, "cm/s2": 0.01, "gal": 0.01, "ft/s2": 0.3048}.get(unit, 1.0),
    )


def test_feet_are_a_unit_of_tables_too(tmp_path):
    (tmp_path / "a.csv").write_text("time_s,acceleration_ft_s2\n0,1\n0.01,2\n")
    np.testing.assert_allclose(read_record(tmp_path / "a.csv").samples, [0.3048, 0.6096])


@pytest.mark.parametrize("word", ["CM/S", "CM", "INCHES"])
def test_a_header_of_velocities_is_no_record(tmp_path, word):
    (tmp_path / "a.AT2").write_text(
        f"A\nTIME SERIES IN UNITS OF {word}\nNPTS= 2, DT= .01 SEC\n 1.0 2.0\n"
    )
    with pytest.raises(InputError, match="UNITS OF G"):
        read_record(tmp_path / "a.AT2")


def test_a_folder_of_mixed_files_is_read_and_the_odd_one_named(tmp_path):
    """What is named itself must be a record."""
    (tmp_path / "1.AT2").write_bytes(at2("N-S"))
    (tmp_path / "2.txt").write_text("a page of notes\n")
    (tmp_path / "3.V2").write_bytes(cosmos("E-W"))
    for words in ([tmp_path], [tmp_path / "[1-3].*"]):
        motions, left_out = motions_of(files_of(words), Reading())
        assert [name for name, _ in motions] == ["1.AT2", "3.V2"]
        assert len(left_out) == 1
        assert "2.txt" in left_out[0]
    with pytest.raises(InputError, match=r"2\.txt"):
        motions_of(files_of([tmp_path, tmp_path / "2.txt"]), Reading())
    (tmp_path / "1.AT2").unlink()
    (tmp_path / "3.V2").unlink()
    with pytest.raises(InputError, match=r"2\.txt"):
        motions_of(files_of([tmp_path]), Reading())


def test_a_shipped_record_is_found_by_name_as_in_a_scene(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["record", "elcentro_1940_ns.csv", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["format"] == "CSV"
    (tmp_path / "elcentro_1940_ns.csv").write_text("time_s,acceleration_g\n0,1\n0.01,2\n")
    assert main(["record", "elcentro_1940_ns.csv", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["samples"] == 2
    assert main(["record", "nowhere/elcentro_1940_ns.csv"]) == 2
