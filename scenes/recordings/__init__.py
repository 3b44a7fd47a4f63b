"""Recorded ground motions in the formats of strong-motion networks and data bases, and as tables.

| format | file | what the file must say |
|---|---|---|
| PEER | `.AT2` | NPTS, DT, UNITS OF G or of another unit; columns may run together |
| COSMOS V1, V2, CSMIP V2 | `.V2` | points, format, unit, time step; one or several channels |
| ESM (DYNA 1.2), AFAD | `.ASC` | NDATA, SAMPLING_INTERVAL_S, UNITS |
| K-NET, KiK-net | `.NS`, `.EW1`, ... | Scale Factor, Sampling Freq(Hz), Duration Time(s) |
| networks: China, GeoNet, SMC, CSMIP V1, RENADIC, USC, BHRC, ... | any | see `networks` |
| `name`, `npts dt`, values | any | the unit by `Reading` |
| CSV | any | `time_s` and `acceleration_g`, `_m_s2`, `_cm_s2`, `_gal`, `_mm_s2` or `_ft_s2` |
| SAC, miniSEED | any | all but the unit; needs ObsPy, see `waveforms` |
| columns of text | any | nothing: options of `Reading` supply the rest |

A format is recognised by the file's content; `.AT2` and `.csv` by the name. Every reader takes time
in proportion to the file. ObsPy reads SAC, miniSEED and K-NET among these, none of the others.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from rockcheck.scenes.errors import InputError, printable
from rockcheck.scenes.reading import open_regular, read_bytes, read_text
from rockcheck.scenes.recordings.formats import (
    AT2_HEADER,
    AT2_HEADER_PLAIN,
    is_volume,
    read_at2,
    read_esm,
    read_knet,
    read_volume,
)
from rockcheck.scenes.recordings.networks import NETWORKS, network_reader
from rockcheck.scenes.recordings.recording import (
    GRAVITY_OF_RECORDS,
    UNITS,
    Contradiction,
    Reading,
    Recording,
    option,
    place_of,
)
from rockcheck.scenes.recordings.stated import size_notes
from rockcheck.scenes.recordings.tables import read_table
from rockcheck.scenes.recordings.waveforms import HEADER_BYTES, read_waveforms, waveform_format

__all__ = [
    "GRAVITY_OF_RECORDS",
    "UNITS",
    "Contradiction",
    "Reading",
    "Recording",
    "read_components",
    "read_record",
]

#: Lines of a file that are searched for its format.
_LOOKED_AT = 100
Reader = Callable[[list[str], Reading], list[Recording]]
#: Formats by the ending of the file's name.
_BY_NAME: dict[str, Reader] = {".at2": read_at2, ".csv": read_table}
#: Formats with a header, in the words of a message.
_WITH_HEADER: dict[Reader, str] = {
    read_at2: "a PEER file",
    read_esm: "an ESM file",
    read_knet: "a K-NET file",
    read_volume: "a V2 file",
    **NETWORKS,
}


def read_components(path: Path, reading: Reading | None = None) -> list[Recording]:
    """All components of a record file, or the one that `reading` names; at least one.

    Raises `InputError`, naming the file and the line, where the file is missing, is in no known
    format, has another count than it states, a time step that is not positive or not uniform, or a
    value that is not finite. Where something is not known, the message shows the option that
    supplies it. A component that its file calls "down" is turned: up is positive.
    """
    asked = reading or Reading()
    with open_regular(path) as stream:
        binary_form = waveform_format(stream.read(HEADER_BYTES))
    try:
        if binary_form:
            _check_options("a file of waveforms", asked)
            return _chosen(read_waveforms(read_bytes(path), binary_form, asked), asked)
        lines = read_text(path, latin=True).split("\n")
        head = [line[:200] for line in lines[:_LOOKED_AT]]
        by_content: dict[Reader, bool] = {
            read_knet: head[0].startswith("Origin Time"),
            read_esm: any(line.startswith("SAMPLING_INTERVAL_S:") for line in head),
            read_volume: any(map(is_volume, head)),
            read_at2: any(
                AT2_HEADER.search(one) or AT2_HEADER_PLAIN.search(one) for one in head[:20]
            ),
        }
        network = network_reader(head)
        if network is not None:
            by_content = {network: True, **by_content}
        fits = next((reader for reader, fit in by_content.items() if fit), read_table)
        read = _BY_NAME.get(path.suffix.lower(), fits)
        if read in _WITH_HEADER:
            _check_options(_WITH_HEADER[read], asked)
        return _chosen(read(lines, asked), asked)
    except Contradiction as error:
        raise Contradiction(_placed(path, error), error.option, file=path) from None
    except InputError as error:
        if error.file is not None:  # named already
            raise
        raise InputError(_placed(path, error), file=path) from None


def _chosen(recordings: list[Recording], reading: Reading) -> list[Recording]:
    """The finished recordings, or the one that `reading` names."""
    finished = [_finished(recording, reading) for recording in recordings]
    if reading.component is None:
        return finished
    names = [recording.component for recording in finished]
    return [finished[place_of("component", reading.component, names, _listed(finished))]]


def _placed(path: Path, error: InputError) -> str:
    """The message of `error` with its file, before the line where it names one."""
    return f"{printable(path)}{', ' if error.key else ': '}{error}"


def _check_options(form: str, reading: Reading) -> None:
    """Raise `InputError` for options of tables, where the format has a header."""
    for name in ("column", "header_lines", "decimal", "order"):
        if getattr(reading, name) is not None:
            raise Contradiction(
                f"is {form}, which says by itself where its numbers stand; leave the option {name}"
                " out",
                name,
            )


def _finished(recording: Recording, reading: Reading) -> Recording:
    """The recording with its vertical component upwards, and its peak judged."""
    notes = (*recording.notes, *size_notes(recording, reading))
    if recording.component.lower() not in ("down", "dwn", "dn"):  # what is positive in the file
        return replace(recording, notes=notes)
    return replace(
        recording, samples=0.0 - recording.samples, notes=(*notes, "turned, up is positive")
    )


def read_record(path: Path, reading: Reading | None = None) -> Recording:
    """The one component of a record file, or the one that `reading` names.

    Raises as `read_components`.
    """
    found = read_components(path, reading)
    if len(found) > 1:
        raise InputError(
            f"{printable(path)}: {len(found)} components, {_listed(found)}; give one:"
            f" {option('component', 1)}",
            file=path,
        )
    return found[0]


def _listed(found: list[Recording]) -> str:
    return printable(
        ", ".join(
            f"{n} {one.component!r}" if one.component else str(n) for n, one in enumerate(found, 1)
        ),
        300,
    )
