"""Scenes that a suite makes of its scenes: under recorded motions, and drawn at random.

`[[records]]` are sets of recorded motions, and what `rockcheck validate SCENE` plays:

    [[records]]
    files = ["records/RSN1_H*.AT2", "station.V2"]    # files, folders, patterns, beside the suite
    # the rest is optional; so is what a file does not say, such as unit = "cm/s2"
    scale = 1.6
    vertical = true       # with the vertical component, of the same file or of one named alike
    scenes = ["shelf"]    # the scenes that are meant; without it all

Each horizontal component takes the place of the scene's own excitation. The scene lasts as long as
its record, and at least as long as it says itself; its own vertical motion stays, unless `vertical`
puts another in its place.

Rocking is chaotic, so single histories are not predictable, but distributions are (Bachmann et al.
2018). An ensemble is one table of a suite, drawn the same for every model:

    [[ensemble]]
    name = "pulses"
    count = 500
    seed = 1
    scene = { duration = 10.0, block = { ... }, floor = { friction = 0.5 } }
    # each optional: uniform, lognormal (median, sigma of the logarithm)
    friction = { uniform = [0.2, 0.8] }                # kinetic; a static one keeps its ratio to it
    gap = { uniform = [0.01, 0.1] }                    # of every wall of the scene, m
    pulse = { period = {...}, amplitude = {...} }      # a Ricker pulse of random phase, m/s^2 and s
    noise = { amplitude = {...}, frequency = 2.5, damping = 0.6, strong = 8.0 }

A pulse of phase phi is cos(phi) times the symmetric Ricker pulse plus sin(phi) times the
antisymmetric one. Noise is white noise through the Kanai-Tajimi filter, of power spectrum (1 + 4
z^2 r^2)/((1 - r^2)^2 + 4 z^2 r^2), r = f/`frequency`, z = `damping`, times a half-sine envelope of
`strong` seconds; `amplitude` is its peak acceleration, m/s^2.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field, StringConstraints, model_validator

from rockcheck.scenes import (
    Finite,
    Frozen,
    NonNegative,
    Positive,
    Record,
    Ricker,
    Scene,
    Wall,
    errors,
    files,
    recordings,
)
from rockcheck.scenes.recordings import sets
from rockcheck.scenes.recordings.recording import Word

#: Longest name of a scene, and of the part of it that is the record's.
_LONGEST, _LONGEST_RECORD = 100, 60
_Path = Annotated[str, StringConstraints(min_length=1, max_length=4096)]


class RecordSet(recordings.Reading):
    """A table `[[records]]`: files, scale of their accelerations, scenes and reading options.

    With `vertical` the base also moves vertically, as recorded in the same file or in the one of
    the set with the same name.
    """

    files: Annotated[tuple[_Path, ...], Field(min_length=1)]
    scale: Finite = 1.0
    vertical: bool = False
    scenes: tuple[Word, ...] = ()

    @model_validator(mode="after")
    def _moves(self) -> RecordSet:
        if self.scale == 0.0:
            raise errors.InputError("0 leaves nothing of the records: give another scale", "scale")
        return self


def under_records(
    scenes: Mapping[str, files.UncertainScene], sets: Sequence[RecordSet], folder: Path
) -> tuple[dict[str, files.UncertainScene], list[str]]:
    """The scenes, with those of a set once per motion; and the vertical components left out.

    A scene is then named `<scene>, <record>`. Raises `InputError` for files that cannot be read,
    and for unknown scenes.
    """
    found: dict[str, files.UncertainScene] = {}
    left_out: list[str] = []
    shaken: set[str] = set()
    for given in sets:
        if unknown := [name for name in given.scenes if name not in scenes]:
            raise errors.InputError(
                str(errors.unknown_name("scene", unknown[0], scenes)), "records.scenes"
            )
        motions, others = _motions(given, folder)
        left_out += others
        chosen = given.scenes or tuple(scenes)
        shaken.update(chosen)
        for name, (label, change) in product(chosen, motions):
            one = _shaken(scenes[name], label, change)
            if one.scene.name in found:
                raise errors.InputError(
                    f"scene {one.scene.name!r} is named twice: two records have one name",
                    "records.files",
                )
            found[one.scene.name] = one
    return {name: one for name, one in scenes.items() if name not in shaken} | found, left_out


def _motions(
    given: RecordSet, folder: Path
) -> tuple[list[tuple[str, dict[str, Record]]], list[str]]:
    """The motions of a set by their labels, as what they replace; and what is left out."""
    files = sets.files_of(given.files, folder)
    pairs: list[tuple[str, recordings.Recording, recordings.Recording | None]]
    left_out: list[str]
    if given.vertical:
        both, odd = sets.pairs_of(files, given)
        pairs, left_out = [*both], [*odd]
    else:
        motions, left_out = sets.motions_of(files, given)
        pairs = [(name, motion, None) for name, motion in motions]
    found = []
    labels = _labels([name for name, _, _ in pairs])
    for label, (_, across, up) in zip(labels, pairs, strict=True):
        parts = {"excitation": (label, across)}
        if up is not None:
            parts["vertical"] = f"{label}, vertical", up
        records = {
            key: Record.from_samples(one.samples, one.time_step, given.scale).model_copy(
                update={"source": source, "notes": one.notes}
            )
            for key, (source, one) in parts.items()
        }
        found.append((label, records))
    return found, left_out


def _labels(names: Sequence[str]) -> list[str]:
    """The names as parts of names of scenes: with endings, or else numbers, where two are equal."""
    short = [re.sub(r"\.[A-Za-z0-9]{1,5}(?= |$)", "", name, count=1) for name in names]
    forms = [
        [
            re.sub(r"[^A-Za-z0-9 _.,+=()-]", "-", word)[-_LONGEST_RECORD:].strip() or "record"
            for word in (brief, name, f"{brief} {number}")
        ]
        for number, (brief, name) in enumerate(zip(short, names, strict=True), 1)
    ]
    alike = [*zip(*forms, strict=True)]
    return [
        next(
            (form for form, others in zip(forms_of, alike, strict=True) if others.count(form) == 1),
            forms_of[-1],
        )
        for forms_of in forms
    ]


def _shaken(
    base: files.UncertainScene, label: str, change: Mapping[str, Record]
) -> files.UncertainScene:
    """A scene under one motion, horizontal and perhaps vertical.

    Spreads of the excitation that it replaces are dropped; the others stay as they are correlated.
    A building stays, and the motion moves it.
    """
    scene, name = base.scene, f"{base.scene.name[: _LONGEST - len(label) - 2]}, {label}"
    kept = [k for k, place in enumerate(base.names) if place.partition(".")[0] not in change]
    duration = max(scene.duration, change["excitation"].quiet_after)
    shaken = files.UncertainScene(
        scene.replace(name=name, duration=duration, **change),
        {base.names[k]: base.spreads[base.names[k]] for k in kept},
        base.correlation[np.ix_(kept, kept)],
    )
    return shaken if base.building is None else files.on_storey(shaken, base.building)


#: Time step of the generated records, s.
RECORD_STEP = 0.002


class Distribution(Frozen):
    """`uniform` between two values, or `lognormal`: median and sigma of the logarithm."""

    uniform: tuple[Finite, Finite] | None = None
    lognormal: tuple[Positive, NonNegative] | None = None

    @model_validator(mode="after")
    def _one(self) -> Distribution:
        if (self.uniform is None) == (self.lognormal is None):
            raise errors.InputError("give exactly one of uniform, lognormal")
        if self.uniform is not None and self.uniform[0] > self.uniform[1]:
            raise errors.InputError("the lower end comes first", "uniform")
        return self

    def draw(self, chance: np.random.Generator) -> float:
        """One value."""
        if self.uniform is not None:
            return float(chance.uniform(*self.uniform))
        assert self.lognormal is not None
        return float(self.lognormal[0] * np.exp(self.lognormal[1] * chance.standard_normal()))


def _bounded(given: Distribution | None, *, positive: bool = False) -> Distribution | None:
    low = given.uniform[0] if given and given.uniform else math.inf
    if low < 0.0 or (positive and low == 0.0):
        raise errors.InputError(
            f"the lower end must be {'more than 0' if positive else '0 or more'}", "uniform"
        )
    return given


class Pulse(Frozen):
    """A Ricker pulse of random phase: `period` (s) and `amplitude` (m/s^2)."""

    period: Annotated[Distribution, AfterValidator(partial(_bounded, positive=True))]
    amplitude: Distribution

    def draw(self, chance: np.random.Generator) -> Record:
        """One pulse, sampled."""
        phase = chance.uniform(0.0, 2.0 * math.pi)
        period, amplitude = self.period.draw(chance), self.amplitude.draw(chance)
        t = np.arange(0.0, 4.0 * period, RECORD_STEP)
        even, odd = (
            Ricker(amplitude=1.0, period=period, symmetric=symmetric).acceleration(t)
            for symmetric in (True, False)
        )
        return Record.from_samples(
            amplitude * (math.cos(phase) * even + math.sin(phase) * odd), RECORD_STEP
        )


class Noise(Frozen):
    """Filtered noise; see the module."""

    amplitude: Distribution
    frequency: Positive
    damping: Positive
    strong: Positive

    def draw(self, chance: np.random.Generator) -> Record:
        """One ground motion, sampled."""
        amplitude = self.amplitude.draw(chance)
        count = math.ceil(self.strong / RECORD_STEP)
        ratio = np.fft.rfftfreq(count, RECORD_STEP) / self.frequency
        power = (1.0 + 4.0 * self.damping**2 * ratio**2) / (
            (1.0 - ratio**2) ** 2 + 4.0 * self.damping**2 * ratio**2
        )
        shaped = np.fft.irfft(np.fft.rfft(chance.standard_normal(count)) * np.sqrt(power), count)
        shaped *= np.sin(np.pi * np.arange(count) / count)
        return Record.from_samples(amplitude * shaped / np.max(np.abs(shaped)), RECORD_STEP)


class Ensemble(Frozen):
    """One `[[ensemble]]` table of a suite; see the module."""

    name: str
    description: str = ""
    count: Annotated[int, Field(ge=2, le=100_000)] = 500
    seed: Annotated[int, Field(ge=0)] = 0
    #: Scenes that one worker plays in one go.
    batch: Annotated[int, Field(ge=1)] = 25
    scene: dict[str, Any]
    friction: Annotated[Distribution | None, AfterValidator(_bounded)] = None
    gap: Annotated[Distribution | None, AfterValidator(_bounded)] = None
    pulse: Pulse | None = None
    noise: Noise | None = None

    @model_validator(mode="after")
    def _one_motion(self) -> Ensemble:
        if self.pulse is not None and self.noise is not None:
            raise errors.InputError("cannot be given together with pulse", "noise")
        return self

    def batches(self) -> Iterator[range]:
        """The numbers of the scenes of each batch."""
        for first in range(0, self.count, self.batch):
            yield range(first, min(first + self.batch, self.count))

    def drawn(self, base: Scene, number: int) -> Scene:
        """Scene number 0, 1, ... of the ensemble; it does not depend on `count`."""
        chance = np.random.default_rng([self.seed, number])
        change: dict[str, Any] = {"name": f"{self.name} {number + 1}"}
        motion = self.pulse or self.noise
        if motion is not None:
            change["excitation"] = motion.draw(chance)
        if self.friction is not None:
            floor, kinetic = base.floor, self.friction.draw(chance)
            # static friction above the kinetic one keeps its ratio to it
            ratio = floor.mu_s / floor.friction if floor.friction > 0.0 else 1.0
            static = None if floor.static_friction is None else max(ratio * kinetic, kinetic)
            change["floor"] = floor.replace(friction=kinetic, static_friction=static)
        if self.gap is not None:
            change["walls"] = tuple(
                Wall(side=w.side, gap=self.gap.draw(chance), restitution=w.restitution)
                for w in base.walls
            )
        return base.replace(**change)
