"""Records as they come: one motion of three components, whose peaks are known, in every format that
is read."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rockcheck.scenes import Floats, Record, recordings
from rockcheck.scenes.recordings import intensity, sets

G = 9.80665
STEP = 0.01
#: Peaks in g.
PEAKS = {"N-S": 0.31, "E-W": -0.27, "U-D": 0.15}


def motion(component: str) -> Floats:
    """Accelerations in m/s^2, 401 of them: a burst without a mean, whose largest one stands at a
    sample."""
    t = STEP * np.arange(401)
    shape = np.sin(2 * np.pi * (t - 2.0) * 1.5 + np.pi / 2) * np.exp(-((t - 2.0) ** 2) / 0.4)
    return PEAKS[component] * G * shape


def _fixed(values: Floats, across: int, form: str) -> str:
    words = [format(value, form) for value in values]
    return "".join("".join(words[k : k + across]) + "\n" for k in range(0, len(words), across))


def at2(component: str, header: str = "NPTS=  {n}, DT= {dt:.4f} SEC,") -> bytes:
    values = motion(component) / G
    return (
        f"PEER NGA STRONG MOTION DATABASE RECORD\nM\xe9xico, 9/19/1985, {component}\n"
        "ACCELERATION TIME SERIES IN UNITS OF G\n"
        + header.format(n=len(values), dt=STEP)
        + "\n"
        + _fixed(values, 5, "15.7E")
    ).encode("latin-1")


def _cosmos_channel(component: str, vertical: int) -> str:
    values = motion(component) * (-100 if (component, vertical) == ("U-D", 401) else 100)
    integers, reals = np.full(100, -999), np.full(100, -999.0)
    integers[53] = {"N-S": 360, "E-W": 90, "U-D": vertical}[component]
    # The raw record's step in s, a number that touches its neighbour, these samples' step in ms.
    reals[[33, 41, 61]] = 2 * STEP, 426212.0, 1000 * STEP
    return (
        "Corrected acceleration   (Format v01.20 with 13 text lines) Src: 052S7466.CE\n"
        + "".join(f"text line {n}\n" for n in range(2, 14))
        + " 100 Integer-header values follow on  10 lines, Format= (10I8)\n"
        + _fixed(integers, 10, "8d")
        + " 100 Real-header values follow on  17 lines, Format= (6F13.6)\n"
        + _fixed(reals, 6, "13.6f")
        + '   2 Comment lines follow, each starting with a "|":\n| a remark\n| accel of another\n'
        + f"    {len(values)} acceleration pts, approx    4 secs, units=cm/sec2 (04),"
        "Format=(8F10.5)\n"
        + _fixed(values, 8, "10.5f")
        + f"    {len(values)} velocity pts, approx    4 secs, units=cm/sec (05),Format=(8F10.5)\n"
        + _fixed(values * 0 + 999.0, 8, "10.5f")
        + "End-of-data for Chan  1 acceleration\n"
    )


def cosmos(*components: str, vertical: int = 400) -> bytes:
    return "".join(_cosmos_channel(one, vertical) for one in components).encode()


def _csmip_channel(component: str) -> str:
    values = motion(component) * 100
    return (
        "Corrected accelerogram   89146-L2500-12044.02       Chan  1:"
        f" { {'N-S': '360 Deg', 'E-W': ' 90 Deg', 'U-D': 'Up'}[component] }     from   \n"
        + "Uncorrected Accelerogram Data             Processed: 02/13/12, CGS  146be002\n"
        + " 401 points of instrument- and baseline-corrected accel, veloc and displ data\n"
        + f" {len(values)} points of accel data equally spaced at  .010 sec, in cm/sec2. (8f10.6)\n"
        + _fixed(values, 8, "10.5f")
        + f" {len(values)} points of veloc data equally spaced at  .010 sec, in cm/sec.  (8f10.6)\n"
        + _fixed(values * 0 + 999.0, 8, "10.5f")
        + "/&  ---------- End of data for channel  1 ----------\n"
    )


def csmip(*components: str) -> bytes:
    return "".join(map(_csmip_channel, components)).encode()


def esm(component: str) -> bytes:
    values = motion(component) * 100
    return (
        "EVENT_NAME: GREECE\nSTATION_NAME: Town Hall,Argos\nSAMPLING_INTERVAL_S:"
        f" {STEP:.6f}\nNDATA: {len(values)}\nDURATION_S: 4.010\n"
        f"STREAM: { {'N-S': 'HNN', 'E-W': 'HNE', 'U-D': 'HNZ'}[component] }\n"
        f"UNITS: cm/s^2\nPGA_CM/S^2: {max(abs(values)):.6f}\nDATA_TYPE: ACCELERATION\nUSER5: \n"
        + _fixed(values, 1, ".6f")
    ).encode()


def knet(component: str, direction: str = "") -> bytes:
    """Counts of a digitiser with an offset; 400 samples."""
    values = motion(component)[:400]
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
        "".join(f"{key:<18}{value}\n" for key, value in rows.items())
        + _fixed(np.round((values - values.mean()) * 100 / (3920 / 6182761)) + 4711, 8, "9.0f")
    ).encode()


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


#: By the names of a format's files: what writes it, the size of its printed digits in g.
FORMATS: dict[str, tuple[Callable[[str], bytes], float]] = {
    "RSN1_{}.AT2": (at2, 1e-7),
    "RSN2_{}.AT2": (
        lambda component: at2(component, " {n}  {dt:.4f}  NPTS, DT").replace(b"\n", b"\r\n"),
        1e-7,
    ),
    "station-{}.V2": (cosmos, 1e-7),
    "csmip-{}.v2": (csmip, 1e-7),
    "HI.ARS1..{}.D.ACC.ASC": (esm, 1e-7),
    "MYG004-{}.knet": (knet, 2e-6),
    "{}.csv": (csv_gal, 1e-7),
    "table-{}.txt": (columns, 1e-7),
}


def test_a_folder_of_24_files_in_eight_formats_is_read_whole(tmp_path, written, told):
    made = {
        str(written(pattern.format(component), write(component))): (write, digit, component)
        for pattern, (write, digit) in FORMATS.items()
        for component in PEAKS
    }
    records = told("record", str(tmp_path))["records"]
    assert [one["file"] for one in records] == sorted(made)
    for one in records:
        write, digit, component = made[one["file"]]
        record = recordings.read_record(Path(one["file"]))
        expected = motion(component)[: 400 if write is knet else 401]
        if write is knet:
            expected = expected - expected.mean()
        np.testing.assert_allclose(
            record.samples, expected, rtol=0, atol=digit * G * 1.01, err_msg=one["file"]
        )
        assert (
            one["pga_g"]
            == intensity.peak_acceleration(record)
            == pytest.approx(abs(PEAKS[component]), abs=3e-4 if write is knet else digit)
        ), one["file"]
        assert one["step_s"] == STEP, one["file"]
        assert one["samples"] == len(expected), one["file"]
        assert any("it is 0 here" in note for note in record.notes) == (write is csv_gal)


@pytest.mark.parametrize(
    ("write", "names"),
    [
        (cosmos, ["360 deg", "90 deg", "up"]),
        (lambda *channels: cosmos(*channels, vertical=401), ["360 deg", "90 deg", "down"]),
        (lambda *channels: cosmos(*channels, vertical=402), ["360 deg", "90 deg", "vertical"]),
        (csmip, ["360 Deg", "90 Deg", "Up"]),
    ],
)
def test_several_components_in_one_file(write, names, written, told, fault_of):
    path = written("three.V2", write(*PEAKS))
    found = recordings.read_components(path)
    assert [one.component for one in found] == names
    for one, component in zip(found, PEAKS, strict=True):
        np.testing.assert_allclose(one.samples, motion(component), atol=1.01e-7)
    said = str(fault_of(Record.from_file, path))
    assert f"3 components, 1 '{names[0]}', " in said
    assert " give one: --read component=1 (in a scene file: component = 1)" in said
    peaks = [Record.from_file(path, component=one).peak for one in (2, names[2])]
    assert peaks == pytest.approx([0.27, 0.15], abs=1e-7)
    said = told("record", str(path), "--read", f"component={names[1]}")
    assert said["component"] == names[1]
    assert said["unit"] == "cm/s2"
    assert said["samples"] == 401
    assert said["duration_s"] == pytest.approx(4.0)
    assert "no single component 4; there are 1 " in str(
        fault_of(Record.from_file, path, component=4)
    )


#: Time steps in a V2 file's header: that of the raw record, that of these samples, none.
RAW, OWN, UNKNOWN = (b"%13.6f" % value for value in (2 * STEP, 1000 * STEP, -999))


OWN_LINE = cosmos("N-S").split(OWN)[0].count(b"\n") + 1


@pytest.mark.parametrize(
    ("raw", "own"), [(RAW, OWN), (b"%13.6f" % STEP, OWN), (b"%13.6f" % STEP, UNKNOWN)]
)
def test_a_v2_file_has_its_own_time_step_not_that_of_the_raw_record(written, raw, own):
    path = written("a.V2", cosmos("N-S").replace(RAW, raw).replace(OWN, own))
    assert recordings.read_record(path).time_step == STEP


def test_header_values_of_a_v2_file_may_be_of_one_digit(written):
    wide = b"100 Integer-header values follow on  10 lines, Format= (10I8)\n"
    head, tail = cosmos("N-S").split(wide)
    narrow = b"100 Integer-header values follow on   2 lines, Format= (60I1)\n"
    digits = b"0" * 53 + b"9" + b"0" * 6 + b"\n" + b"0" * 40 + b"\n"
    path = written("a.V2", head + narrow + digits + tail.split(b"\n", 10)[-1])
    assert recordings.read_record(path).component == "9 deg"


@pytest.mark.parametrize(
    ("line", "component"),
    [
        ("Made up, 1/1/2020, Nowhere, 090", "090"),
        ("Made up, Nowhere, UP", "UP"),
        ("Made up, 090", ""),
        ("090", ""),
        ("Made up, 1/1/2020, a place of many words", ""),
    ],
)
def test_the_last_field_of_a_peer_file_s_second_line_is_its_component(line, component, written):
    first, _, *rest = at2("N-S").split(b"\n")
    path = written("a.AT2", b"\n".join([first, line.encode(), *rest]))
    assert recordings.read_record(path).component == component


@pytest.mark.parametrize(
    ("row", "by", "said"),
    [
        (b"Scale Factor      3920(gal)/6182761\n", b"", "Scale Factor in gal"),
        (b"Sampling Freq(Hz) 100Hz\n", b"", "states Sampling Freq(Hz)"),
        (b"3920(gal)/6182761", b"3920(gal)/0", "Scale Factor 3920(gal)/0 is not usable"),
        (b"3920(gal)/6182761", b"0(gal)/6182761", "Scale Factor 0(gal)/6182761 is not usable"),
    ],
)
def test_a_k_net_file_states_its_rate_and_its_scale(row, by, said, written, fault_of):
    content = knet("N-S")
    assert row in content
    path = written("a.NS", content.replace(row, by))
    assert said in str(fault_of(recordings.read_record, path))


@pytest.mark.parametrize("form", [b"(0F10.5)", b"(8F0.5)"])
def test_a_block_of_a_v2_file_has_fields(form, written, fault_of):
    path = written("a.V2", cosmos("N-S").replace(b"(8F10.5)", form))
    assert "a format without fields" in str(fault_of(recordings.read_record, path))


@pytest.mark.parametrize(("seconds", "fits"), [(3, True), (5, True), (2, False), (6, False)])
def test_the_seconds_of_a_v2_file_are_about_right(seconds, fits, written, fault_of):
    content = cosmos("N-S").replace(
        b"acceleration pts, approx    4", b"acceleration pts, approx %4d" % seconds
    )
    path = written("a.V2", content)
    if fits:
        assert len(recordings.read_record(path).samples) == 401
    else:
        assert f"says {seconds} s" in str(fault_of(recordings.read_record, path))


def test_a_v2_file_may_have_a_number_a_line(written):
    lines = csmip("N-S").decode().replace("(8f10.6)", "(1f10.5)").splitlines(keepends=True)
    rows = _fixed(motion("N-S") * 100, 1, "10.5f")
    first = next(n for n, line in enumerate(lines) if "points of accel data" in line)
    text = "".join([*lines[: first + 1], rows, lines[-1]])
    np.testing.assert_allclose(
        recordings.read_record(written("a.V2", text)).samples, motion("N-S"), atol=1.01e-7
    )


def test_k_net_takes_out_the_offset_and_says_so(written):
    record = recordings.read_record(
        written("MYG0041103111446.NS", knet("N-S", "4")), recordings.Reading(component=4)
    )
    assert record.component == "4"
    assert record.notes == ("the mean, 2.987 gal, is taken out: the offset of the digitiser",)
    assert abs(record.samples.mean()) < 1e-12


@pytest.mark.parametrize(
    ("name", "content", "option", "said"),
    [
        ("a.V2", cosmos("N-S").replace(OWN, UNKNOWN), {}, "401 samples every 0.02 s are 8.02 s"),
        ("a.V2", re.sub(rb"(?m)^([- .\d]{80})$", rb" \1", csmip("N-S")), {}, "the block has 0"),
        (
            "a.V2",
            csmip("N-S").replace(b" 401 points of accel", b" 300 points of accel"),
            {},
            "more",
        ),
        (
            "a.V2",
            re.sub(RAW + b"|" + OWN, UNKNOWN, cosmos("N-S")),
            {},
            "no real header before this block states the time step",
        ),
        (
            "a.V2",
            re.sub(rb"(header +values +follow.*= *\(?)[0-9]+", rb"\g<1>0", cosmos("N-S")),
            {},
            r"a\.V2, line [0-9]+: a format without fields",
        ),
        (
            "a.NS",
            b"\n".join(knet("N-S").split(b"\n")[:-9]),
            {},
            r"Duration Time\(s\) 4 is 400 samples, the file has 336",
        ),
        ("a.V2", cosmos("N-S").replace(OWN, b"%13s" % b"ten"), {}, f"line {OWN_LINE}: 'ten' is"),
        *(
            ("a.AT2", at2("N-S"), option, "leave the option")
            for option in (
                {"column": 1},
                {"header_lines": 3},
                {"decimal": ","},
                {"unit": "gal"},
                {"time_step": 0.02},
            )
        ),
    ],
)
def test_a_header_says_enough_and_neither_samples_nor_options_overrule_it(
    written, name, content, option, said, fault_of
):
    assert re.search(
        said,
        str(fault_of(recordings.read_record, written(name, content), recordings.Reading(**option))),
    )


def test_the_command_shows_and_draws(tmp_path, monkeypatch, typed, refused):
    monkeypatch.chdir(tmp_path)
    Path("a.AT2").write_bytes(at2("N-S"))
    typed(
        *("record", "a.AT2", "--plot", "a.png"),
        holds=[
            "PEER AT2, unit g",
            "401 every 0.01 s, 4 s",
            "0.31 g",
            "Sa(T)",
            "1 s: ",
            "█",
            "a.png",
        ],
    )
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    assert ".svg, .png, .pdf" in refused("record", "a.AT2", "--plot", "a.jpg")


def test_of_a_folder_the_odd_file_is_named(tmp_path, typed, fault_of):
    """And does not hide the others. What is named itself must be a record."""
    (tmp_path / "1.AT2").write_bytes(at2("N-S"))
    (tmp_path / "2.txt").write_text("1 2 3\n")
    out, _ = typed("record", str(tmp_path), "--json")
    assert json.loads(out)["samples"] == 401
    assert "2.txt, line 1: 3 numbers a line" in json.loads(out)["left_out"][0]
    for words in ([tmp_path], [tmp_path / "[1-3].*"]):
        (motion, *more), (left_out,) = sets.motions_of(sets.files_of(words), recordings.Reading())
        assert motion[0] == "1.AT2"
        assert more == []
        assert "2.txt" in left_out
    for words in ([tmp_path, tmp_path / "2.txt"], [tmp_path / "2*"]):
        assert "2.txt" in str(fault_of(sets.motions_of, sets.files_of(words), recordings.Reading()))


def test_a_shipped_record_is_found_by_name_as_in_a_scene(tmp_path, monkeypatch, told, refused):
    monkeypatch.chdir(tmp_path)
    assert told("record", "elcentro_1940_ns.csv")["format"] == "CSV"
    (tmp_path / "elcentro_1940_ns.csv").write_text("time_s,acceleration_g\n0,1\n0.01,2\n")
    assert told("record", "elcentro_1940_ns.csv")["samples"] == 2
    assert "elcentro_1940_ns.csv" in refused("record", "nowhere/elcentro_1940_ns.csv")
