"""Files of strong-motion networks, built after the descriptions of their formats."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from rockcheck.scenes import Floats, InputError, recordings

GRAVITY = recordings.GRAVITY_OF_RECORDS

#: What a message says of samples that are missing.
INCOMPLETE = r"samples|numbers, not|fields of|the file ends|begins a channel"


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


@pytest.mark.parametrize(
    "name", ["China", "GeoNet V1A", "GeoNet V2A", "SMC", "NSMN", "count and step"]
)
def test_a_file_whose_last_line_is_cut_is_refused(name, written):
    write, _, _, options, _ = FORMATS[name]
    text = write(401, 0.01, 3.0)
    path = written("record.txt", "".join(text.splitlines(keepends=True)[:-1]).encode())
    with pytest.raises(InputError, match=INCOMPLETE):
        recordings.read_components(path, recordings.Reading(**options))


@settings(
    max_examples=30, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
@pytest.mark.parametrize("name", ["China", "GeoNet V1A", "SMC", "NSMN", "count and step"])
def test_a_line_of_samples_that_is_lost_is_noticed(name, data, written):
    write, _, _, options, _ = FORMATS[name]
    lines = write(96, 0.01, 3.0).splitlines(keepends=True)
    first = 60 if name == "SMC" else len(lines) - 8
    lost = data.draw(st.integers(min(first, len(lines) - 8), len(lines) - 1))
    path = written("record.txt", "".join(lines[:lost] + lines[lost + 1 :]).encode())
    with pytest.raises(InputError, match=INCOMPLETE):
        recordings.read_components(path, recordings.Reading(**options))


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


def test_text_behind_the_last_value_of_a_peer_file_is_left_out_with_a_note(written):
    text = (
        "PEER\nmade up\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS=  10, DT= .0200 SEC\n"
        + fixed(0.1 * np.arange(10.0), 5, "15.7E")
        + "*** End Data ***\n"
    )
    recording = recordings.read_record(written("record.AT2", text.encode()))
    assert len(recording.samples) == 10
    assert recording.notes == ("left out behind the last sample: '*** End Data ***'",)


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
