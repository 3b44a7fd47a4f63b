"""SAC and miniSEED, which ObsPy reads; it comes with the extra `seismology`.

Neither states the unit of its samples: `Reading` gives it. A SAC file states its peak, and the
depth of its station; both name their channel.
"""

import io
import struct
import warnings
from dataclasses import replace
from importlib.util import find_spec
from typing import Any

import numpy as np

from rockcheck.scenes.errors import InputError, printable
from rockcheck.scenes.recordings.recording import UNITS, Reading, Recording, fault, option
from rockcheck.scenes.recordings.stated import Fact, Stated, recording_of

#: Bytes of a file that tell its format: SAC's whole header.
HEADER_BYTES = 632
#: Place of the header's version and of the kind of its samples in a SAC file, and the version.
_SAC_VERSION_AT, _SAC_VERSION = 304, 6
_SAC_KINDS = {6: "displacement", 7: "velocity"}
_SAC_UNDEFINED = -12345.0
#: Codes of instruments that record velocity, in the middle of a channel's code.
_SEISMOMETERS = "HL"


def waveform_format(start: bytes) -> str:
    """ObsPy's name of the format of a file with these first bytes; "" for another."""
    if len(start) >= 48 and start[:6].isdigit() and start[6:7] in b"DRQM" and start[7] in b" \0":
        return "MSEED"
    if len(start) < HEADER_BYTES:
        return ""
    versions = [struct.unpack_from(f"{order}i", start, _SAC_VERSION_AT)[0] for order in "<>"]
    return "SAC" if _SAC_VERSION in versions else ""


def read_waveforms(content: bytes, form: str, reading: Reading) -> list[Recording]:
    """Every channel of a SAC or miniSEED file, in the file's order.

    Raises `InputError` where ObsPy is not installed or cannot read the file, for samples in whole
    numbers, for a channel with gaps, and for samples that are no accelerations.
    """
    words = "a SAC file" if form == "SAC" else "a miniSEED file"
    if find_spec("obspy") is None:
        raise fault(f"{words}: install ObsPy, the extra seismology: pip install obspy")
    traces = traces_of(content, form, words)
    channels = [trace.id for trace in traces]
    if not channels:
        raise fault(f"{words} without samples")
    for channel in channels:
        if channels.count(channel) > 1:
            raise fault(f"the channel {printable(channel, 30)} has gaps")
    return [_recording(trace, words, reading) for trace in traces]


def traces_of(content: bytes, form: str, words: str) -> list[Any]:
    """ObsPy's traces, those that follow each other joined."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        import obspy

        warnings.simplefilter("error", UserWarning)
        try:
            stream = obspy.read(io.BytesIO(content), format=form)
            stream.merge(method=-1)
        # Whatever a damaged file makes ObsPy raise.
        except Exception as error:
            raise InputError(f"{words} that cannot be read: {printable(str(error), 100)}") from None
    return list(stream)


def _recording(trace: Any, words: str, reading: Reading) -> Recording:
    samples = np.asarray(trace.data)
    channel = printable(trace.stats.channel, 30)
    if not np.issubdtype(samples.dtype, np.floating) and "unit" not in reading.overriding:
        hint = option("unit", "cm/s2!")
        raise fault(
            f"whole numbers in {channel or words}, as the raw counts of the digitiser; only"
            f" accelerations can be read; if they are in a unit of acceleration: {hint}"
        )
    samples = samples.astype(float)
    if not np.all(np.isfinite(samples)):
        raise fault(f"{channel or words} has samples that are not finite")
    header = trace.stats.get("sac", {})
    kind = _SAC_KINDS.get(int(header.get("idep", 0)))
    if kind is not None:
        raise fault(f"the header says {kind}; only accelerations can be read")
    notes = []
    if len(channel) == 3 and channel[1] in _SEISMOMETERS:
        notes.append(f"{channel} is the channel of a seismometer: are these accelerations?")
    stated = Stated(
        time_step=Fact(float(f"{trace.stats.delta:.7g}"), "the header"),
        peak=_sac_peak(header, reading),
    )
    recording = recording_of(
        samples, stated, reading, form=words[2:-5], component=_name(channel, header), notes=notes
    )
    return replace(recording, borehole=_sac_value(header, "stdp", 0.0) > 0.0)


def _name(channel: str, header: Any) -> str:
    """The channel's code; else up, down or the azimuth by the angles of a SAC file."""
    if channel:
        return channel
    incidence = _sac_value(header, "cmpinc", _SAC_UNDEFINED)
    azimuth = _sac_value(header, "cmpaz", _SAC_UNDEFINED)
    if incidence in (0.0, 180.0):
        return "up" if incidence == 0.0 else "down"
    return f"{azimuth:.0f} deg" if azimuth != _SAC_UNDEFINED else ""


def _sac_value(header: Any, key: str, missing: float) -> float:
    value = float(header.get(key, missing))
    return missing if value == _SAC_UNDEFINED or not np.isfinite(value) else value


def _sac_peak(header: Any, reading: Reading) -> Fact[float] | None:
    """The larger of the least and the largest sample that the header states."""
    least = _sac_value(header, "depmin", np.inf)
    largest = _sac_value(header, "depmax", np.inf)
    if reading.unit is None or not np.isfinite(least + largest):
        return None
    return Fact(max(abs(least), abs(largest)) * UNITS[reading.unit], "DEPMIN, DEPMAX")
