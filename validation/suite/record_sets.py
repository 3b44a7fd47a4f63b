"""Scenes under sets of recorded motions: a suite's tables `[[records]]`, and what `rockcheck
validate SCENE` plays.

    [[records]]
    files = ["records/RSN1_H*.AT2", "station.V2"]    # files, folders, patterns, beside the suite
    # the rest is optional; so is what a file does not say, such as unit = "cm/s2"
    scale = 1.6
    vertical = true       # with the vertical component, of the same file or of one named alike
    scenes = ["shelf"]    # the scenes that are meant; without it all

Each horizontal component takes the place of the scene's own excitation. The scene lasts as long as
its record, and at least as long as it says itself; its own vertical motion stays, unless `vertical`
puts another in its place.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, StringConstraints

from rockcheck.scenes import InputError, Record
from rockcheck.scenes.base import Finite
from rockcheck.scenes.errors import unknown_name
from rockcheck.scenes.files import UncertainScene, uncertain_scene
from rockcheck.scenes.recordings import Reading, Recording
from rockcheck.scenes.recordings.recording import Word
from rockcheck.scenes.recordings.sets import files_of, motions_of, verticals_of

#: Longest name of a scene, and of the part of it that is the record's.
_LONGEST, _LONGEST_RECORD = 100, 60
_Path = Annotated[str, StringConstraints(min_length=1, max_length=4096)]


class RecordSet(Reading):
    """A table `[[records]]`: files, the factor of their accelerations, the scenes that they shake,
    and the options of a reader.

    With `vertical` the base also moves up and down, as the same file says, or one of the set that
    is named alike.
    """

    files: Annotated[tuple[_Path, ...], Field(min_length=1)]
    scale: Finite = 1.0
    vertical: bool = False
    scenes: tuple[Word, ...] = ()

    @property
    def reading(self) -> Reading:
        """What the files do not say of themselves."""
        return Reading(**{name: getattr(self, name) for name in Reading.model_fields})


def under_records(
    scenes: Mapping[str, UncertainScene], sets: Sequence[RecordSet], folder: Path
) -> tuple[dict[str, UncertainScene], list[str]]:
    """The scenes, those that a set names once for each of its motions; and the vertical components
    that are left out.

    A scene is then named `<scene>, <record>`. Raises `InputError` for files that cannot be read,
    and scenes that there are not.
    """
    found: dict[str, UncertainScene] = {}
    left_out: list[str] = []
    shaken: set[str] = set()
    for given in sets:
        for name in given.scenes:
            if name not in scenes:
                raise InputError(str(unknown_name("scene", name, scenes)), "records.scenes")
        files = files_of(given.files, folder)
        motions, vertical = motions_of(files, given.reading)
        upward = verticals_of(files, given.reading) if given.vertical else {}
        left_out += [] if given.vertical else vertical
        chosen = given.scenes or tuple(scenes)
        shaken.update(chosen)
        for name in chosen:
            for label, (motion, recording) in zip(
                _labels([motion for motion, _ in motions]), motions, strict=True
            ):
                one = _shaken(scenes[name], label, (recording, upward.get(motion)), given.scale)
                if one.scene.name in found:
                    raise InputError(
                        f"scene {one.scene.name!r} is named twice: two records have one name",
                        "records.files",
                    )
                found[one.scene.name] = one
    return {name: one for name, one in scenes.items() if name not in shaken} | found, left_out


def _shaken(
    base: UncertainScene, label: str, motion: tuple[Recording, Recording | None], scale: float
) -> UncertainScene:
    """A scene under one motion, horizontal and perhaps vertical; what is not known of the
    excitation that it replaces goes with that."""
    scene = base.scene
    horizontal, vertical = motion
    change: dict[str, Any] = {"excitation": _record(horizontal, label, scale)}
    if vertical is not None:
        change["vertical"] = _record(vertical, f"{label}, vertical", scale)
    if base.spreads and not base.independent:
        raise InputError(
            "correlated numbers cannot be given together with [[records]]", "correlation"
        )
    spreads = {
        place: spread
        for place, spread in base.spreads.items()
        if place.partition(".")[0] not in change
    }
    name = f"{scene.name[: _LONGEST - len(label) - 2]}, {label}"
    duration = max(scene.duration, change["excitation"].quiet_after)
    return uncertain_scene(scene.replace(name=name, duration=duration, **change), spreads, {})


def _record(motion: Recording, label: str, scale: float) -> Record:
    record = Record.from_samples(motion.samples, motion.time_step, scale)
    return record.model_copy(update={"source": label, "notes": motion.notes})


def _labels(names: Sequence[str]) -> list[str]:
    """Names of records as names of scenes may have them: without their endings, where these do not
    tell two apart."""
    short = [re.sub(r"\.[A-Za-z0-9]{1,5}(?= |$)", "", name, count=1) for name in names]
    return [
        _allowed(one if short.count(one) == 1 else name)
        for one, name in zip(short, names, strict=True)
    ]


def _allowed(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9 _.,+=()-]", "-", name)[-_LONGEST_RECORD:].strip() or "record"
