"""SAC and miniSEED by ObsPy, on files that are written here."""

import io
import struct
from types import SimpleNamespace

import numpy as np
import pytest

from rockcheck.scenes import InputError, recordings
from rockcheck.scenes.recordings import sets, waveforms

# ObsPy's import and its writers use what Python has deprecated.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")
GAL = recordings.Reading(unit="gal")
VALUES = 100 * np.sin(0.1 * np.arange(1000)) * np.exp(-0.002 * np.arange(1000))


def written_by_obspy(form, channels, values=VALUES, dtype=np.float32, **sac):
    import obspy
    from obspy.core import AttribDict

    stream = obspy.Stream()
    for channel in channels:
        trace = obspy.Trace(np.asarray(values, dtype=dtype))
        trace.stats.delta = 0.01
        trace.stats.channel = channel
        if sac:
            trace.stats.sac = AttribDict(sac)
        stream.append(trace)
    buffer = io.BytesIO()
    stream.write(buffer, format=form)
    return buffer.getvalue()


@pytest.mark.needs("obspy")
@pytest.mark.parametrize(("form", "name"), [("SAC", "SAC"), ("MSEED", "miniSEED")])
def test_a_file_is_read_with_the_unit_that_is_given(form, name, written):
    path = written("a.dat", written_by_obspy(form, ["HNE"]))
    recording = recordings.read_record(path, GAL)
    np.testing.assert_allclose(recording.samples, 0.01 * VALUES, rtol=1e-6)
    assert recording.time_step == 0.01
    assert recording.form == name
    assert recording.component == "HNE"
    assert recording.notes == ()


@pytest.mark.needs("obspy")
@pytest.mark.parametrize("form", ["SAC", "MSEED"])
def test_the_unit_is_asked_for(form, written):
    with pytest.raises(InputError, match="unit of acceleration is not stated"):
        recordings.read_record(written("a.dat", written_by_obspy(form, ["HNE"])))


@pytest.mark.needs("obspy")
def test_channels_of_one_file_reach_the_sets_with_the_vertical_one(written):
    path = written("a.mseed", written_by_obspy("MSEED", ["HNE", "HNN", "HNZ"]))
    pairs, left_out = sets.pairs_of([path], GAL)
    assert [name for name, _, _ in pairs] == ["a.mseed HNE", "a.mseed HNN"]
    assert left_out == []


@pytest.mark.needs("obspy")
@pytest.mark.parametrize(("angle", "name"), [(0.0, "up"), (180.0, "down"), (90.0, "45 deg")])
def test_the_angles_of_a_sac_file_name_its_component(angle, name, written):
    content = written_by_obspy("SAC", [""], cmpinc=angle, cmpaz=45.0)
    assert recordings.read_record(written("a.sac", content), GAL).component == name


@pytest.mark.needs("obspy")
def test_a_station_below_the_ground_is_a_borehole(written):
    below = written("below.sac", written_by_obspy("SAC", ["HNE"], stdp=100.0))
    above = written("above.sac", written_by_obspy("SAC", ["HNE"]))
    assert recordings.read_record(below, GAL).borehole
    motions, left_out = sets.motions_of(sets.files_of([below.parent]), GAL)
    assert [name for name, _ in motions] == [above.name]
    assert "a borehole channel" in left_out[0]


@pytest.mark.needs("obspy")
def test_raw_counts_are_refused_by_name(written):
    content = written_by_obspy("MSEED", ["HNE"], dtype=np.int32)
    with pytest.raises(InputError, match="raw counts of the digitiser"):
        recordings.read_record(written("a.mseed", content), GAL)


@pytest.mark.needs("obspy")
def test_a_channel_of_a_seismometer_is_told(written):
    path = written("a.mseed", written_by_obspy("MSEED", ["HHE"]))
    assert "channel of a seismometer" in recordings.read_record(path, GAL).notes[0]


@pytest.mark.needs("obspy")
def test_velocity_is_refused(written):
    content = written_by_obspy("SAC", ["HNE"], idep=7)
    with pytest.raises(InputError, match="the header says velocity"):
        recordings.read_record(written("a.sac", content), GAL)


@pytest.mark.needs("obspy")
def test_a_gap_is_refused(written):
    content = written_by_obspy("MSEED", ["HNE"], values=np.tile(VALUES, 4))
    lost = content[:4096] + content[8192:]
    with pytest.raises(InputError, match="has gaps"):
        recordings.read_record(written("a.mseed", lost), GAL)


@pytest.mark.needs("obspy")
def test_a_peak_that_sac_states_is_held_against_the_samples(written):
    content = bytearray(written_by_obspy("SAC", ["HNE"]))
    content[8:12] = struct.pack("<f", 500.0)
    with pytest.raises(InputError, match="DEPMIN, DEPMAX says a peak of 500 gal"):
        recordings.read_record(written("a.sac", bytes(content)), GAL)


@pytest.mark.needs("obspy")
def test_a_file_that_is_cut_is_refused_in_one_line(written):
    content = written_by_obspy("SAC", ["HNE"])[:-100]
    with pytest.raises(InputError, match="a SAC file that cannot be read") as error:
        recordings.read_record(written("a.sac", content), GAL)
    assert str(error.value).isprintable()


def test_without_obspy_the_extra_is_named(written, monkeypatch):
    monkeypatch.setattr(waveforms, "find_spec", lambda name: None)
    header = bytearray(waveforms.HEADER_BYTES)
    struct.pack_into("<i", header, 304, 6)
    with pytest.raises(InputError, match="the extra seismology: pip install obspy"):
        recordings.read_record(written("a.sac", bytes(header)), GAL)


class Stats(dict):
    """What a trace of ObsPy says of itself."""

    __getattr__ = dict.__getitem__


def trace(channel="HNE", values=VALUES, dtype=np.float32, **sac):
    stats = Stats(channel=channel, delta=0.01, sac=sac)
    return SimpleNamespace(id=channel, data=np.asarray(values, dtype=dtype), stats=stats)


@pytest.fixture
def read(monkeypatch):
    """Reads what ObsPy would have made of a file: these traces."""

    def read(*traces, form="SAC", **options):
        monkeypatch.setattr(waveforms, "find_spec", lambda name: name)
        monkeypatch.setattr(waveforms, "traces_of", lambda *file: list(traces))
        return waveforms.read_waveforms(b"", form, recordings.Reading(**{"unit": "gal", **options}))

    return read


@pytest.mark.parametrize(
    ("start", "form"),
    [
        (b"000001D " + bytes(40), "MSEED"),
        (b"000001M\0" + bytes(40), "MSEED"),
        (b"000001D " + bytes(39), ""),
        (b"000001X " + bytes(40), ""),
        (b"000001Dx" + bytes(40), ""),
        (b"00000xD " + bytes(40), ""),
        (bytes(304) + struct.pack("<i", 6) + bytes(324), "SAC"),
        (bytes(304) + struct.pack(">i", 6) + bytes(324), "SAC"),
        (bytes(304) + struct.pack("<i", 7) + bytes(324), ""),
        (bytes(304) + struct.pack("<i", 6) + bytes(323), ""),
    ],
)
def test_a_format_is_known_by_its_first_bytes(start, form):
    assert waveforms.waveform_format(start) == form


@pytest.mark.parametrize(("form", "name"), [("SAC", "SAC"), ("MSEED", "miniSEED")])
def test_a_trace_is_a_recording_in_the_unit_that_is_given(form, name, read):
    (recording,) = read(trace(), form=form)
    np.testing.assert_allclose(recording.samples, 0.01 * VALUES, rtol=1e-6)
    assert recording.time_step == 0.01
    assert recording.form == name
    assert recording.notes == ()
    assert not recording.borehole


def test_each_channel_is_a_recording_and_one_in_parts_has_gaps(read, fault_of):
    assert [one.component for one in read(trace("HNE"), trace("HNN"))] == ["HNE", "HNN"]
    assert "the channel HNE has gaps" in str(fault_of(read, trace(), trace()))
    assert "a SAC file without samples" in str(fault_of(read))
    assert "a miniSEED file without samples" in str(fault_of(read, form="MSEED"))


def test_whole_numbers_are_read_where_a_mark_says_so(read, fault_of):
    assert "raw counts of the digitiser" in str(fault_of(read, trace(dtype=np.int32)))
    (recording,) = read(trace(dtype=np.int32), unit="gal!")
    np.testing.assert_allclose(recording.samples, 0.01 * np.trunc(VALUES))


def test_samples_that_are_not_finite_are_refused(read, fault_of):
    assert "samples that are not finite" in str(fault_of(read, trace(values=[0.0, np.inf, 1.0])))


@pytest.mark.parametrize(("kind", "said"), [(6, "displacement"), (7, "velocity")])
def test_the_header_says_what_the_samples_are(kind, said, read, fault_of):
    assert f"the header says {said}; only" in str(fault_of(read, trace(idep=kind)))
    assert len(read(trace(idep=8))) == 1


@pytest.mark.parametrize(("channel", "told"), [("HHE", True), ("BLZ", True), ("HN", False)])
def test_the_code_of_a_seismometer_is_told(channel, told, read):
    (recording,) = read(trace(channel))
    assert bool(recording.notes) == told


@pytest.mark.parametrize(
    ("angles", "name"),
    [
        ({"cmpinc": 0.0, "cmpaz": 45.0}, "up"),
        ({"cmpinc": 180.0}, "down"),
        ({"cmpinc": 90.0, "cmpaz": 45.0}, "45 deg"),
        ({"cmpinc": -12345.0, "cmpaz": 45.0}, "45 deg"),
        ({"cmpinc": 90.0, "cmpaz": -12345.0}, ""),
        ({"cmpinc": 90.0, "cmpaz": np.nan}, ""),
        ({}, ""),
    ],
)
def test_angles_name_a_trace_without_a_channel(angles, name, read):
    (recording,) = read(trace("", **angles))
    assert recording.component == name


@pytest.mark.parametrize(("depth", "borehole"), [(100.0, True), (0.0, False), (-12345.0, False)])
def test_a_depth_of_the_station_is_that_of_a_borehole(depth, borehole, read):
    (recording,) = read(trace(stdp=depth))
    assert recording.borehole == borehole


@pytest.mark.parametrize(
    ("least", "largest", "said"),
    [
        (-500.0, 90.0, "DEPMIN, DEPMAX says a peak of 500 gal"),
        (-90.0, 500.0, "DEPMIN, DEPMAX says a peak of 500 gal"),
        (VALUES.min(), VALUES.max(), ""),
        (-500.0, -12345.0, ""),
        (-12345.0, 500.0, ""),
    ],
)
def test_the_larger_extreme_of_the_header_is_the_peak(least, largest, said, read, fault_of):
    one = trace(depmin=least, depmax=largest)
    if said:
        assert said in str(fault_of(read, one))
    else:
        assert len(read(one)) == 1


def test_without_a_unit_a_trace_has_no_peak(read, fault_of):
    said = str(fault_of(read, trace(depmin=-500.0, depmax=90.0), unit=None))
    assert "the unit of acceleration is not stated" in said
