"""SAC and miniSEED by ObsPy, on files that are written here."""

import io
import struct

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
