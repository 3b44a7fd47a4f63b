"""Files of strong-motion networks, built after the descriptions of their formats."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from rockcheck.scenes import Floats, InputError, recordings
from rockcheck.scenes.recordings import network_columns, network_lines, networks, sets

GRAVITY = recordings.GRAVITY_OF_RECORDS


def motion(count: int, peak: float) -> Floats:
    """Accelerations in m/s^2 with the given largest one, which stands in the middle."""
    n = np.arange(count) - count // 2
    return peak * np.cos(0.3 * n) * np.exp(-((n / (0.1 * count)) ** 2))


def fixed(values: Floats, across: int, form: str) -> str:
    words = [format(value, form) for value in values]
    return "".join("".join(words[k : k + across]) + "\n" for k in range(0, len(words), across))


def rows(columns: list[Floats], form: str = "14.6f") -> str:
    return "".join(
        "".join(format(v, form) for v in row) + "\n" for row in zip(*columns, strict=True)
    )


def china(count: int, step: float, peak: float) -> str:
    return (
        "0XXYY120103\n0120103 2020-01-01 00:00:00 BTM\nMADE-UP EVENT\nSTATION: XX\nCOMP. EW\n"
        "UNCORRECTED ACCELERATION          UNIT: CM/SEC/SEC\n"
        f"NO. OF POINTS: {count}  EQUALLY SPACED INTERVALS OF: {step:g}  SEC\n"
        f"PEAK VALUE: {100 * peak:10.3f}   AT   1.30 SEC    DURATION: {count * step:g} SEC\n"
        "PRE-EVENT TIME:  1  SEC\nMADE UP\n\n" + fixed(100 * motion(count, peak), 8, "14.6E")
    )


def geonet_channel(count: int, step: float, peak: float, name: str, volume: int) -> str:
    values = 1000 * motion(count, peak)
    reals = np.zeros((10, 10))
    if volume == 1:
        reals[3, 0] = count
    else:
        reals[3, 3:6] = count
        reals[6, 5] = step
    word = "Uncorrected" if volume == 1 else "Corrected"
    text = [
        f"{word} accelerogram 20200101_000000_XXXX_20 GNS Science",
        "Site XXXX      43 30 25S  172 43 53E",
        *(f"line {n}" for n in range(3, 10)),
        f"Number of points {count}    Duration {count * step:.2f} s",
        f"Raw readings in units of 1.00 mm/s/s  at intervals of {step:.4f} s",
        "Data is unfiltered",
        f"Component {name}",
        f"Acceleration:  Peak {1000 * peak:8.1f} mm/s/s at  1.00 s",
        "line 15",
        "line 16",
    ]
    blocks = fixed(values, 10, "8.1f")
    if volume == 2:
        blocks += 2 * fixed(0 * values + 999.0, 10, "8.1f")
    return "\n".join(text) + "\n" + fixed(reals.ravel(), 10, "12.4f") + blocks


def geonet(volume: int) -> Callable[[int, float, float], str]:
    return lambda count, step, peak: "".join(
        geonet_channel(count, step, peak, name, volume) for name in ("S14E", "N76E", "Up")
    )


def smc(count: int, step: float, peak: float) -> str:
    integers, reals = np.full(48, -32768), np.full(50, 1.7e38)
    integers[12], integers[13], integers[15], integers[16] = 90, 360, 2, count
    reals[1] = 1.0 / step
    return (
        "2 CORRECTED ACCELEROGRAM\n"
        + "".join(f"text {n}\n" for n in range(2, 11))
        + "*\n"
        + fixed(integers, 8, "10d")
        + fixed(reals, 5, "15.7E")
        + "| a comment\n| another\n"
        + fixed(100 * motion(count, peak), 8, "10.4f")
    )


def nsmn(count: int, step: float, peak: float) -> str:
    values = 100 * motion(count, peak)
    return (
        "STRONG GROUND MOTION RECORDS OF TURKIYE\nPLACE           : MADE UP\n"
        f"STATION ID : 9999\nNUMBER OF DATA  : {count}\nSAMPLING INTERVAL (sec) : {step:g}\n\n"
        "      N-S           E-W           U-D\n" + rows([values, 0.5 * values, 0.25 * values])
    )


def cwb(count: int, step: float, peak: float) -> str:
    values = 100 * motion(count, peak)
    return (
        "#Earthquake Information\n#StationCode: XXX\n"
        f"#RecordLength(sec): {count * step:g}\n#SampleRate(Hz): {1 / step:g}\n#Data: 4F10.3\n"
        + rows([step * np.arange(count), 0.25 * values, values, 0.5 * values])
    )


def bbp(count: int, step: float, peak: float) -> str:
    values = 100 * motion(count, peak)
    return (
        "# Station: s01\n#    time(sec)      N-S(cm/s/s)      E-W(cm/s/s)      U-D(cm/s/s)\n"
        + rows([step * np.arange(count), values, 0.5 * values, 0.25 * values], "15.6e")
    )


def count_and_step(count: int, step: float, peak: float) -> str:
    return f"made-up motion\n{count} {step:g}\n" + fixed(motion(count, peak) / GRAVITY, 1, "14.6E")


def volume_one_header(
    count: int, step: float, peak: float, name: str, *, unit: str, fraction: float, digits: str
) -> str:
    """The header of an uncorrected accelerogram: 13 lines, 100 integers, 50 reals."""
    integers, reals = np.zeros(100, dtype=int), np.zeros(50)
    integers[27] = count
    reals[2], reals[4], reals[6] = (count - 1) * step, fraction, abs(peak) / GRAVITY
    text = [
        "UNCORRECTED ACCELEROGRAM DATA              PROCESSED: 01/01/20, MADE 00001",
        "MADE UP",
        "JANUARY 1, 2020",
        "00001-A0001",
        "STATION NO. 00001",
        "MADE UP S/N 1",
        f"CHAN  1: {name}",
        "MADE UP",
        "HYPOCENTER: MADE UP",
        "INSTR PERIOD =  .0400 SEC,  DAMPING =  .600,  SENSITIVITY = 1.00 V/G",
        f"NO. OF POINTS = {count:6d}  RECORD LENGTH = {(count - 1) * step:6.3f} SEC",
        f"UNITS OF UNCOR ACCEL {unit}.  MAX  = {format(abs(peak) / GRAVITY, digits)} G, AT 1 SEC",
        "RMS ACCEL OF COMPLETE RECORD =  .008 G",
    ]
    return "\n".join(text) + "\n" + fixed(integers, 16, "5d") + fixed(reals, 8, "10.3f")


def volume_one_equal(line: str, form: str) -> Callable[[int, float, float], str]:
    """CSMIP: samples in g below a line that states count, step and perhaps the fields."""

    def write(count: int, step: float, peak: float) -> str:
        return "".join(
            volume_one_header(count, step, peak, name, unit="IS G", fraction=1.0, digits=".3f")
            + line.format(count=count, step=step)
            + fixed(motion(count, peak) / GRAVITY, 8, form)
            + "/&  ---------- END OF DATA ----------\n"
            for name in ("90 DEG", "UP")
        )

    return write


def volume_one_pairs(count: int, step: float, peak: float) -> str:
    """CSMIP and RENADIC: five pairs of a time and an acceleration in g/10 on a line."""
    values = 10 * motion(count, peak) / GRAVITY
    pairs = np.column_stack([step * np.arange(count), values]).ravel()
    return "".join(
        volume_one_header(
            count, step, peak, name, unit="ARE SEC AND G/10", fraction=0.1, digits=".3f"
        )
        + fixed(pairs, 10, "7.3f")
        for name in ("L", "V", "T")
    )


def renadic(count: int, step: float, peak: float) -> str:
    return volume_one_pairs(count, step, peak).replace("HYPOCENTER", "UNIVERSIDAD DE CHILE")


def usc(across: int) -> Callable[[int, float, float], str]:
    """USC: `across` integers on a line; count, azimuth and unit stand in numbers alone."""

    def write(count: int, step: float, peak: float) -> str:
        integers, reals = np.zeros(100, dtype=int), np.zeros(50)
        integers[26], integers[27] = 500, count
        reals[2], reals[4] = (count - 1) * step, 0.1
        values = 10 * motion(count, peak) / GRAVITY
        pairs = np.column_stack([step * np.arange(count), values]).ravel()
        lines = fixed(pairs, 10, "7.3f").splitlines()
        return (
            "FILE 1 OF UNCORRECTED ACCELEROGRAM DATA OF VOL. I\n"
            + "".join(f"text {n:<68d}{n}\n" for n in range(2, 14))
            + fixed(integers, across, f"{80 // across}d")
            + fixed(reals, 8, "10.3f")
            + "".join(f" {line}\n" for line in lines)
        )

    return write


def bhrc(count: int, step: float, peak: float) -> str:
    integers, reals = np.zeros(100, dtype=int), np.zeros(50)
    integers[27] = count
    reals[2], reals[4] = count * step, 0.1
    integer_lines = fixed(integers, 16, "5d").splitlines()
    real_lines = fixed(reals, 8, "13.6E").splitlines()
    text = [
        "* VOL1DS FILE:  0001/01",
        "Inst Type = SSA-2",
        "Origin Time : 2020/01/01",
        "",
        "V",
        "",
        "COMP V1",
        "Made up   Station   37.000 N 45.000 E   Altitude 1000m   Azimuth L 324   T 54",
        "Epicenter made up",
        "INSTR PERIOD =  .019 SEC   DAMPING =  .640",
        f"NO. OF POINTS = {count:6d}      DURATION = {count * step:7.3f}",
        "UNITS ARE SECONDS AND G/10",
        "",
        *(line[:70] for line in integer_lines),
        *(line[:70] for line in real_lines),
    ]
    return "\n".join(text) + "\n" + fixed(10 * motion(count, peak) / GRAVITY, 10, "13.6E")


def unam(count: int, step: float, peak: float) -> str:
    values = 100 * motion(count, peak)
    columns = [values, 0.5 * values, 0.25 * values]
    peaks = "/".join(f"{np.max(np.abs(column)):.2f}" for column in columns)
    return (
        "\n" * 6
        + "ARCHIVO ESTANDAR DE ACELERACION\n"
        + "VERSION DEL FORMATO : 2.0\n"
        + "ORIENTACION C1-C6 (rumbo;orientacion) : /N90E/+V/N00E\n"
        + f"INTERVALO DE MUESTREO, C1-C6 (s) : /{step:g}/{step:g}/{step:g}\n"
        + f"DURACION DEL REGISTRO (s), C1-C6 : {3 * f'/{count * step:.2f}'}\n"
        + f"NUM. TOTAL DE MUESTRAS, C1-C6 : {3 * f'/{count}'}\n"
        + f"ACEL. MAX.(Gal), C1-C6 : /{peaks}\n"
        + "UNIDADES DE LOS DATOS : Gal [cm/s^2]\n"
        + 91 * ":\n"
        + " CANAL-1 CANAL-2 CANAL-3\n"
        + rows(columns, "12.4f")
    )


def cosmos_v1(count: int, step: float, peak: float) -> str:
    integers, reals = np.full(100, -999), np.full(100, -999.0)
    integers[53], reals[33] = 90, step
    values = 100 * motion(count, peak)
    text = [f"text line {n}" for n in range(2, 14)]
    text[9] = f"Processed: 01/01/2020 UTC by MADE      Max = {100 * peak:9.3f} cm/sec2  at 1 sec"
    return (
        "Uncorrected acceleration   (Format v01.20 with 13 text lines)\n"
        + "\n".join(text)
        + "\n 100 Integer-header values follow on  10 lines, Format= (10I8)\n"
        + fixed(integers, 10, "8d")
        + " 100 Real-header values follow on  17 lines, Format= (6F13.6)\n"
        + fixed(reals, 6, "13.6f")
        + f"{count:8d} uncor. accel. pts, approx {count * step:4.0f} secs, units=cm/sec2 (04),"
        "Format=(8F10.4)\n" + fixed(values, 8, "10.4f")
    )


def csmip_v2(count: int, step: float, peak: float) -> str:
    values = 100 * motion(count, peak)
    return (
        "Corrected accelerogram   00001       Chan  1: 90 Deg     from\n"
        "Uncorrected Accelerogram Data             Processed: 01/01/20\n"
        f"Peak acceleration = {100 * peak:9.3f}    cm/sec/sec  at    1.000   sec.\n"
        f" {count} points of accel data equally spaced at  {step:.3f} sec, in cm/sec2. (8f10.4)\n"
        + fixed(values, 8, "10.4f")
    )


def afad(count: int, step: float, peak: float) -> str:
    """AFAD's KEY: value form is that of ESM."""
    return (
        "EVENT_NAME: MADE UP\nEVENT_ID: 1\nSTATION_CODE: 0000\n"
        f"SAMPLING_INTERVAL_S: {step:g}\nNDATA: {count}\nDURATION_S: {count * step:.2f}\n"
        f"STREAM: E\nUNITS: cm/s^2\nPGA_CM/S^2: {100 * peak:.6f}\nTIME_PGA_S: 1.0\n"
        "DATA_TYPE: ACCELERATION\nUSER1:\n" + fixed(100 * motion(count, peak), 1, ".6f")
    )


def knet(count: int, step: float, peak: float) -> str:
    scale = 3920 / 6182761
    values = motion(count, peak)
    rows = {
        "Origin Time": "2020/01/01 00:00:00",
        "Sampling Freq(Hz)": f"{1 / step:.0f}Hz",
        "Duration Time(s)": f"{count * step:g}",
        "Dir.": "E-W",
        "Scale Factor": "3920(gal)/6182761",
        "Max. Acc. (gal)": f"{100 * np.max(np.abs(values - values.mean())):.3f}",
        "Memo.": "",
    }
    counts = np.round(100 * values / scale) + 4711
    return "".join(f"{key:<18}{value}\n" for key, value in rows.items()) + fixed(counts, 8, "9.0f")


def at2(count: int, step: float, peak: float) -> str:
    return (
        "PEER\nMade up, 1/1/2020, Nowhere, 090\nACCELERATION TIME SERIES IN UNITS OF G\n"
        f"NPTS= {count}, DT= {step:.4f} SEC,\n" + fixed(motion(count, peak) / GRAVITY, 5, "15.7E")
    )


#: By name: what writes the file, the names of its components, which of them has the whole peak,
#: the options that it needs, the size of its printed digits in m/s^2.
FORMATS: dict[
    str, tuple[Callable[[int, float, float], str], list[str], int, dict[str, str], float]
] = {
    "China": (china, ["EW"], 0, {}, 1e-6),
    "GeoNet V1A": (geonet(1), ["S14E", "N76E", "Up"], 0, {}, 1e-4),
    "GeoNet V2A": (geonet(2), ["S14E", "N76E", "Up"], 2, {}, 1e-4),
    "SMC": (smc, ["360 deg"], 0, {}, 1e-6),
    "NSMN": (nsmn, ["N-S", "E-W", "U-D"], 0, {}, 1e-8),
    "CWB": (cwb, ["U-D", "N-S", "E-W"], 1, {}, 1e-8),
    "SCEC BBP": (bbp, ["N-S", "E-W", "U-D"], 0, {}, 1e-6),
    "count and step": (count_and_step, [""], 0, {"unit": "g"}, 1e-5),
    "CSMIP V1, fields of 9": (
        volume_one_equal(
            "{count:5d} POINTS OF ACCEL DATA EQUALLY SPACED AT {step:.3f} SEC. (UNITS: G)\n",
            "9.6f",
        ),
        ["90 DEG", "UP"],
        0,
        {},
        1e-5,
    ),
    "CSMIP RAW, fields in words": (
        volume_one_equal(
            "{count:5d} points of accel data equally spaced at {step:.3f} sec, in g. (8f11.6)\n",
            "11.6f",
        ),
        ["90 DEG", "UP"],
        1,
        {},
        1e-5,
    ),
    "CSMIP V1, pairs": (volume_one_pairs, ["L", "V", "T"], 0, {}, 6e-4),
    "RENADIC": (renadic, ["L", "V", "T"], 2, {}, 6e-4),
    "USC": (usc(16), ["up"], 0, {}, 6e-4),
    "USC, 20 integers a line": (usc(20), ["up"], 0, {}, 6e-4),
    "BHRC": (bhrc, ["V"], 0, {}, 1e-5),
    "UNAM": (unam, ["N90E", "V", "N00E"], 0, {}, 1e-6),
    "COSMOS V1": (cosmos_v1, ["90 deg"], 0, {}, 1e-6),
    "CSMIP V2": (csmip_v2, ["90 Deg"], 0, {}, 1e-6),
    "AFAD": (afad, ["E"], 0, {}, 1e-8),
    "PEER": (at2, ["090"], 0, {}, 1e-5),
}


@pytest.mark.parametrize(
    ("count", "step", "peak"), [(401, 0.01, 3.0), (96, 0.005, 1.0), (240, 0.02, -9.0)]
)
@pytest.mark.parametrize("name", FORMATS)
def test_a_file_has_the_count_step_and_peak_that_it_states(name, count, step, peak, written):
    write, names, which, options, digit = FORMATS[name]
    path = written("record.txt", write(count, step, peak).encode())
    components = recordings.read_components(path, recordings.Reading(**options))
    assert [component.component for component in components] == names
    recording = components[which]
    assert len(recording.samples) == count
    assert recording.time_step == pytest.approx(step, rel=1e-9)
    assert np.max(np.abs(recording.samples)) == pytest.approx(abs(peak), abs=digit)
    np.testing.assert_allclose(recording.samples, motion(count, peak), rtol=0, atol=digit)
    assert recording.notes == ()


def test_a_k_net_file_has_the_count_step_and_peak_that_it_states(written):
    recording = recordings.read_record(written("a.EW", knet(400, 0.01, 3.0).encode()))
    expected = motion(400, 3.0)
    np.testing.assert_allclose(recording.samples, expected - expected.mean(), rtol=0, atol=1e-5)
    assert recording.time_step == 0.01


@pytest.mark.parametrize(
    "name",
    ["GeoNet V1A", "NSMN", "CWB", "SCEC BBP", "CSMIP V1, fields of 9", "RENADIC", "UNAM"],
)
def test_the_vertical_component_of_a_file_moves_the_base_beside_the_others(name, written):
    write, names, _, _, _ = FORMATS[name]
    path = written("record.txt", write(96, 0.01, 3.0).encode())
    pairs, left_out = sets.pairs_of([path], recordings.Reading())
    assert len(pairs) == len(names) - 1
    assert left_out == []


def test_a_downhole_channel_of_cosmos_is_left_out_of_a_folder(written):
    text = cosmos_v1(96, 0.01, 3.0)
    written("surface.V1", text.encode())
    deep = text.replace("text line 9", "Sta Chan  1: 90 deg (Rcrdr Chan  1) Location:Downhole 30m")
    path = written("deep.V1", deep.encode())
    motions, left_out = sets.motions_of(sets.files_of([path.parent]), recordings.Reading())
    assert [name for name, _ in motions] == ["surface.V1"]
    assert "a borehole channel" in left_out[0]


#: What a format cannot tell, and why: its numbers are free, or no peak, or no count is stated.
FREE = {"AFAD": "numbers of any length"}
NO_COUNT = {"CWB": "no count: its length in s leaves a line open", "SCEC BBP": "no count"}


def sample_lines(text: str) -> tuple[list[str], int]:
    """The file's lines, and the index of the first of the last full block of samples."""
    lines = text.splitlines(keepends=True)
    end = len(lines) if re.match(r"[-+ .\dEe]+$", lines[-1]) else len(lines) - 1
    first = end
    while first > 0 and re.match(r"[-+ .\dEe]+$", lines[first - 1]) and "." in lines[first - 1]:
        first -= 1
    return lines[:end], max(first, end - 11)


def answers(name: str, text: str, written) -> tuple[list[recordings.Recording], str]:
    """What is read, and all that is said of it: its notes, or the one line of a refusal."""
    path = written("record.txt", text.encode())
    try:
        components = recordings.read_components(path, recordings.Reading(**FORMATS[name][3]))
    except InputError as error:
        return [], str(error)
    return components, "; ".join(note for component in components for note in component.notes)


def is_right(components: list[recordings.Recording], original: list[recordings.Recording]) -> bool:
    """Whether the components have the samples of the original ones within their last digit."""
    return len(components) == len(original) and all(
        len(component.samples) == len(other.samples)
        and component.time_step == other.time_step
        and np.allclose(component.samples, other.samples, rtol=0, atol=0.01)
        for component, other in zip(components, original, strict=True)
    )


MUTATIONS = settings(
    max_examples=12, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@MUTATIONS
@given(data=st.data())
@pytest.mark.parametrize("name", [name for name in FORMATS if name not in NO_COUNT])
def test_a_line_of_samples_that_is_lost_is_told(name, data, written):
    lines, first = sample_lines(FORMATS[name][0](96, 0.01, 3.0))
    lost = data.draw(st.integers(first, len(lines) - 1))
    components, said = answers(name, "".join(lines[:lost] + lines[lost + 1 :]), written)
    assert components == []
    assert said.isprintable()
    assert said


@MUTATIONS
@given(data=st.data())
@pytest.mark.parametrize("name", NO_COUNT)
def test_a_line_lost_within_the_times_is_told_where_no_count_is_stated(name, data, written):
    """The last line may be lost unnoticed: nothing in these files says how many there are."""
    lines, first = sample_lines(FORMATS[name][0](96, 0.01, 3.0))
    lost = data.draw(st.integers(first + 1, len(lines) - 2))
    components, said = answers(name, "".join(lines[:lost] + lines[lost + 1 :]), written)
    assert components == []
    assert "off the uniform step" in said


@MUTATIONS
@given(data=st.data())
@pytest.mark.parametrize("name", [name for name in FORMATS if name not in FREE])
def test_a_digit_that_is_lost_is_told_or_changes_nothing(name, data, written):
    """AFAD's numbers have any length, so that none can be missed there but in the peak."""
    text = FORMATS[name][0](96, 0.01, 3.0)
    original, _ = answers(name, text, written)
    lines, first = sample_lines(text)
    row = data.draw(st.integers(first, len(lines) - 2))
    digits = [place for place, sign in enumerate(lines[row]) if sign.isdigit()]
    place = data.draw(st.sampled_from(digits))
    mutant = lines[row][:place] + lines[row][place + 1 :]
    components, said = answers(name, "".join([*lines[:row], mutant, *lines[row + 1 :]]), written)
    assert said or is_right(components, original)


#: Whose last block holds no accelerations.
OTHER_END = ("GeoNet V2A",)


@pytest.mark.parametrize("name", [name for name in FORMATS if name not in (*FREE, *OTHER_END)])
def test_the_line_that_lost_a_digit_is_named(name, written):
    lines, first = sample_lines(FORMATS[name][0](96, 0.01, 3.0))
    row = first + 2
    short = lines[row].rstrip()[:-1] + "\n"
    _, said = answers(name, "".join([*lines[:row], short, *lines[row + 1 :]]), written)
    assert f"line {row + 1}" in said


@pytest.mark.parametrize(
    ("name", "stated", "message"),
    [
        ("China", "DURATION: 0.96", "line 8: DURATION says 9.06 s"),
        ("CWB", "#RecordLength(sec): 0.96", "line 3: #RecordLength says 9.06 s"),
        ("RENADIC", "RECORD LENGTH =  0.950", "line 11: the header says 9.05 s"),
        ("USC", f"{0.95:10.3f}", "line 21: the header says 9.05 s"),
        ("UNAM", "C1-C6 : /0.96/0.96", "line 11: DURACION says 9.06 s"),
        ("AFAD", "DURATION_S: 0.96", "line 6: DURATION_S says 9.06 s"),
    ],
)
def test_a_length_that_contradicts_count_and_step_is_refused(name, stated, message, written):
    text = FORMATS[name][0](96, 0.01, 3.0)
    assert stated in text
    wrong = stated.replace("0.9", "9.0")
    assert message in answers(name, text.replace(stated, wrong), written)[1]


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("China", "   AT   1.30 SEC    DURATION: 0.96 SEC"),
        ("CWB", "#RecordLength(sec): 0.96\n"),
        ("UNAM", "DURACION DEL REGISTRO (s), C1-C6 : /0.96/0.96/0.96\n"),
        ("UNAM", "ACEL. MAX.(Gal), C1-C6 : /300.00/150.00/75.00\n"),
        ("AFAD", "DURATION_S: 0.96\n"),
        ("AFAD", "PGA_CM/S^2: 300.000000\n"),
    ],
)
def test_a_length_or_a_peak_may_be_missing(name, line, written):
    text = FORMATS[name][0](96, 0.01, 3.0)
    assert line in text
    components, said = answers(name, text.replace(line, ""), written)
    assert is_right(components, answers(name, text, written)[0])
    assert said == ""


@pytest.mark.parametrize(
    ("name", "line", "said"),
    [
        ("NSMN", "NUMBER OF DATA  : 96\n", "no header line that states NUMBER OF DATA"),
        ("UNAM", "NUM. TOTAL DE MUESTRAS, C1-C6 : /96/96/96\n", "NUM. TOTAL DE MUESTRAS"),
        (
            "UNAM",
            "INTERVALO DE MUESTREO, C1-C6 (s) : /0.01/0.01/0.01\n",
            "no header line that states INTERVALO DE MUESTREO",
        ),
        ("AFAD", "NDATA: 96\n", "no header line that states NDATA"),
    ],
)
def test_a_count_and_a_step_may_not_be_missing(name, line, said, written):
    text = FORMATS[name][0](96, 0.01, 3.0)
    assert line in text
    assert said in answers(name, text.replace(line, ""), written)[1]


@pytest.mark.parametrize(
    ("volume", "stated", "swapped", "said"),
    [
        (1, "units of 1.00", "units of 2.00", "line 11: units of 2 mm/s/s"),
        (1, "intervals of 0.0100", "intervals of 0.0000", "line 11: at intervals of 0.0000 is not"),
        (1, "Peak   3000.0", "Peak   9000.0", "line 14: Peak says a peak of 9000 mm/s2"),
        (1, f"{96:12.4f}", f"{0:12.4f}", "line 20: the count of samples 0 is not in"),
        (2, f"{96:12.4f}", f"{0:12.4f}", "line 20: the count of samples 0 is not in"),
        (2, f"{0.01:12.4f}", f"{0:12.4f}", "line 23: the time step 0.0 is not positive"),
    ],
)
def test_geonet_names_the_line_of_a_fault(volume, stated, swapped, said, written):
    text = geonet(volume)(96, 0.01, 3.0)
    assert stated in text
    assert said in answers("GeoNet V1A", text.replace(stated, swapped), written)[1]


@pytest.mark.parametrize(
    ("upward", "azimuth", "name"),
    [(0, 90, "up"), (180, 90, "down"), (90, 90, "90 deg"), (-32768, 0, "0 deg"), (90, -32768, "")],
)
def test_the_angles_of_an_smc_file_name_its_component(upward, azimuth, name, written):
    text = smc(96, 0.01, 3.0).replace(f"{90:10d}{360:10d}", f"{upward:10d}{azimuth:10d}")
    assert recordings.read_record(written("a.smc", text.encode())).component == name


@pytest.mark.parametrize(
    ("second", "third", "fits"),
    [
        ("2 0.01", "0.1", True),
        ("9 1.0", "0.1 0.2 0.3", True),
        ("1 0.01", "0.1", False),  # of one sample
        ("9 0.01", "0.1 0.2", False),  # a table of two columns
        ("9 1.5", "0.1", False),  # no step of a record
        ("9 0", "0.1", False),
        ("", "0.1", False),
    ],
)
def test_a_second_line_of_a_count_and_a_step_stands_above_lines_of_other_width(second, third, fits):
    reader = networks.network_reader(["made-up motion", second, third])
    assert reader is (networks.read_count_and_step if fits else None)


@pytest.mark.parametrize("title", ["", "1 2 3"])
def test_above_a_count_and_a_step_stands_a_title(title):
    assert networks.network_reader([title, "9 0.01", "0.1"]) is None


def test_one_step_of_a_unam_file_holds_for_all_channels(written):
    text = unam(96, 0.01, 3.0)
    components, _ = answers("UNAM", text.replace("(s) : /0.01/0.01/0.01", "(s) : /0.01"), written)
    assert is_right(components, answers("UNAM", text, written)[0])


def test_the_count_of_a_file_with_a_count_and_a_step_is_named_with_its_line(written):
    text = count_and_step(96, 0.01, 3.0).replace("\n96 ", "\n99999999 ")
    said = answers("count and step", text, written)[1]
    assert "line 2: the count 99999999 is not in" in said


def test_a_peak_of_a_unam_file_is_right_within_its_last_digit(written):
    """So small a motion is stated by two digits."""
    text = unam(96, 0.01, 5e-4)
    assert "/0.05/" in text
    assert answers("UNAM", text, written)[1] == ""
    wrong = text.replace("/0.05/0.03/0.01", "/0.07/0.03/0.01")
    assert wrong != text
    assert "ACEL. MAX. says a peak" in answers("UNAM", wrong, written)[1]


def test_a_geonet_file_that_ends_with_its_header_is_refused(written):
    text = "".join(geonet(1)(96, 0.01, 3.0).splitlines(keepends=True)[:26])
    assert "line 26: the file ends within a header" in answers("GeoNet V1A", text, written)[1]


def test_an_accelerogram_that_ends_with_its_header_is_refused(written):
    text = "\n".join(renadic(96, 0.01, 3.0).splitlines()[:27])
    said = answers("RENADIC", text, written)[1]
    assert "line 27: the file ends before its samples" in said


def test_a_count_that_is_stated_nowhere_is_missing(written):
    text = usc(16)(96, 0.01, 3.0).replace(f"{500:5d}{96:5d}", f"{500:5d}{'':5}")
    assert "line 14: the count of points 0 is not in" in answers("USC", text, written)[1]


def test_an_accelerogram_may_have_a_number_a_line(written):
    line = "{count:5d} points of accel data equally spaced at {step:.3f} sec, in g. (1f11.6)\n"
    text = volume_one_equal(line, "11.6f")(96, 0.01, 3.0)
    lines = [
        "".join(f"{word:>11}\n" for word in one.split())
        if re.fullmatch(r"( *-?[0-9]\.[0-9]{6})+\n", one)
        else one
        for one in text.splitlines(keepends=True)
    ]
    components, said = answers("CSMIP RAW, fields in words", "".join(lines), written)
    assert said == ""
    np.testing.assert_allclose(components[0].samples, motion(96, 3.0), atol=1e-5)


def test_a_length_may_count_the_steps_between_samples(written):
    text = bhrc(97, 0.01, 3.0).replace("DURATION =   0.970", "DURATION =   0.960")
    (component,), _ = answers("BHRC", text, written)
    assert component.time_step == 0.01


def test_the_last_line_but_one_that_lost_a_digit_is_told():
    lines = ["1.000 2.000"] * 10
    lines[-2] = "1.000 2.00"
    (note,) = network_lines.digit_notes(lines, 5)
    assert note.startswith("line 13 has 10 characters")
    assert network_lines.digit_notes([*lines[:-2], "1.000 2.000", "1.000"], 5) == []


def test_one_sample_in_some_seconds_has_no_step(written):
    text = bhrc(1, 0.013, 3.0)
    assert "the time step 0.0 is not positive" in answers("BHRC", text, written)[1]


@pytest.mark.parametrize("name", [name for name in FORMATS if name not in OTHER_END])
def test_the_line_of_a_word_that_is_no_number_is_named(name, written):
    lines, first = sample_lines(FORMATS[name][0](96, 0.01, 3.0))
    row = first + 2
    lines[row] = lines[row].rstrip()[:-1] + "x\n"
    assert f"line {row + 1}: " in answers(name, "".join(lines), written)[1]


@pytest.mark.parametrize(
    ("line", "bbp"),
    [
        ("# time(sec) N-S(cm/s/s)", True),
        ("# time(s)  N-S(cm/s/s)  E-W(cm/s/s)", True),
        ("# time(s)  N-S(cm/s)  E-W(cm/s)", False),
        ("# time(s)  N-S", False),
    ],
)
def test_a_bbp_file_names_times_and_a_unit_of_acceleration(line, bbp):
    assert network_columns.is_bbp([line]) == bbp


@pytest.mark.parametrize(
    ("name", "stated", "swapped"),
    [
        ("CSMIP V1, fields of 9", "ACCEL IS G.", "ACCEL IS CM/SEC/SEC."),
        ("CSMIP RAW, fields in words", "sec, in g.", "sec, in cm/sec2."),
        ("CSMIP V1, pairs", "AND G/10", "AND G"),
        ("RENADIC", "AND G/10", "AND G"),
        ("BHRC", "AND G/10", "AND G"),
        ("UNAM", "Gal [cm/s^2]", "m/s2"),
        ("COSMOS V1", "units=cm/sec2 (04)", "units=g (02)"),
        ("CSMIP V2", "in cm/sec2.", "in g."),
        ("AFAD", "UNITS: cm/s^2", "UNITS: m/s^2"),
        ("SCEC BBP", "cm/s/s", "m/s/s"),
    ],
)
def test_a_unit_that_is_swapped_is_told(name, stated, swapped, written):
    """By the peak, a second statement of the unit, or a size that no earthquake reaches.

    The Chinese file states its unit once, for peak and samples alike: it cannot tell. GeoNet, SMC,
    NSMN and CWB state none: it is that of the format.
    """
    text = FORMATS[name][0](96, 0.01, 3.0)
    assert stated in text
    components, said = answers(name, text.replace(stated, swapped), written)
    assert components == []
    assert said.isprintable()
    assert said


@pytest.mark.parametrize(
    ("name", "stated", "counts"),
    [
        ("CSMIP V1, fields of 9", "ACCEL IS G.", "ACCEL IS COUNTS."),
        ("CSMIP V1, fields of 9", "(UNITS: G)", "(UNITS: COUNTS)"),
        ("CSMIP V1, pairs", "AND G/10", "AND COUNTS"),
        ("COSMOS V1", "units=cm/sec2 (04)", "units=counts (50)"),
    ],
)
def test_raw_counts_are_refused_by_name(name, stated, counts, written):
    text = FORMATS[name][0](96, 0.01, 3.0)
    assert "raw counts of the digitiser" in answers(name, text.replace(stated, counts), written)[1]


def test_a_peak_in_an_unknown_unit_counts_for_nothing(written):
    text = FORMATS["RENADIC"][0](96, 0.01, 3.0)
    components, said = answers("RENADIC", text.replace(" G, AT", " VOLT, AT"), written)
    assert is_right(components, answers("RENADIC", text, written)[0])
    assert said == ""


@pytest.mark.parametrize(
    ("form", "said"),
    [("8f1.0", "numbers go on behind the 8 fields of 1 "), ("8f0.0", "a format without fields")],
)
def test_a_field_has_at_least_one_character(form, said, written):
    name = "CSMIP RAW, fields in words"
    text = FORMATS[name][0](96, 0.01, 3.0).replace("8f11.6", form)
    assert said in answers(name, text, written)[1]


def test_words_and_integers_of_a_header_that_differ_are_named(written):
    text = volume_one_pairs(96, 0.01, 3.0).replace(
        "NO. OF POINTS =     96", "NO. OF POINTS =     97"
    )
    assert "NO. OF POINTS says 97, integer 28 says 96" in answers("RENADIC", text, written)[1]


def test_uneven_times_of_film_are_refused(written):
    text = volume_one_pairs(96, 0.01, 3.0).replace("  0.050", "  0.057")
    assert "line 29: time 0.057 s is off the uniform step" in answers("RENADIC", text, written)[1]


def test_a_unit_swapped_in_a_header_contradicts_its_peak(written):
    text = china(401, 0.01, 3.0)
    swapped = re.sub(r"PEAK VALUE: +300\.000", "PEAK VALUE: 3.000", text)
    with pytest.raises(InputError, match="PEAK VALUE says a peak of 3 cm/s2"):
        recordings.read_components(written("record.dat", swapped.encode()))


def test_raw_counts_of_cosmos_are_refused_by_name(written):
    text = (
        "Raw acceleration counts   (Format v01.20 with 13 text lines)\n"
        "    16 raw accel.   pts, approx   1 secs, units=counts (50),Format=(8I10)\n"
        + fixed(np.arange(16), 8, "10d")
    )
    with pytest.raises(InputError, match="raw counts of the digitiser"):
        recordings.read_components(written("record.V0", text.encode()))


@pytest.mark.parametrize("words", ["*** End Data ***", "End of data, made in 2020"])
def test_text_behind_the_last_value_of_a_peer_file_is_left_out_with_a_note(written, words):
    text = (
        "PEER\nmade up\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS=  10, DT= .0200 SEC\n"
        + fixed(0.1 * np.arange(10.0), 5, "15.7E")
        + f"{words}\n"
    )
    recording = recordings.read_record(written("record.AT2", text.encode()))
    assert len(recording.samples) == 10
    assert recording.notes == (f"left out behind the last sample: '{words}'",)


def test_numbers_behind_the_last_value_of_a_peer_file_are_refused(written):
    text = (
        "PEER\nmade up\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS=  10, DT= .0200 SEC\n"
        + fixed(0.1 * np.arange(15.0), 5, "15.7E")
    )
    with pytest.raises(InputError, match="NPTS says 10, the file has 15 samples"):
        recordings.read_record(written("record.AT2", text.encode()))


def test_touching_fields_are_cut_by_their_width(written):
    text = smc(96, 0.01, 9.0)
    lines = text.splitlines(keepends=True)
    lines[-1] = "-1234.5678" * 7 + "-1234.5678\n"
    recording = recordings.read_record(written("record.smc", "".join(lines).encode()))
    assert recording.samples[-8:] == pytest.approx(-12.345678)
