"""Base excitations: pulses, recorded ground motions and rest.

Every excitation counts time from its own start (t = 0) and gives the acceleration of the base in
m/s^2, horizontal motion positive to the right, vertical motion positive upward.
"""

import math
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, StringConstraints, model_validator

from rockcheck.scenes.base import Finite, Floats, Frozen, Positive
from rockcheck.scenes.errors import InputError
from rockcheck.scenes.recordings import GRAVITY_OF_RECORDS, Reading, read_record

#: Largest peak acceleration that a record may be scaled to, g.
MOST_PGA = 1000.0


class Motion(Frozen):
    """Base of all excitations: a scaled or stretched motion is of the same kind."""

    def scaled(self, factor: float) -> Self:
        """The same motion with `factor` times the acceleration, validated like any other.

        A negative factor also exchanges left and right.
        """
        return self._times(("amplitude", "scale"), factor)

    def stretched(self, factor: float) -> Self:
        """The same motion with all times multiplied by `factor` (> 0), validated like any other."""
        return self._times(("period", "time_step"), factor)

    def _times(self, names: tuple[str, ...], factor: float) -> Self:
        return self.replace(
            **{
                name: factor * getattr(self, name)
                for name in names
                if name in type(self).model_fields
            }
        )


class Rest(Motion):
    """A base that does not move."""

    kind: Literal["rest"] = "rest"
    #: Time after which the base is at rest, s.
    quiet_after: ClassVar[float] = 0.0

    def acceleration(self, t: ArrayLike) -> Floats:
        """Base acceleration at times `t` (s): zero."""
        return np.zeros_like(np.asarray(t, dtype=float))


class Ricker(Motion):
    """A Ricker pulse; antisymmetric (the paper's (34)) unless `symmetric`.

    It starts 2 T_p before its centre. An antisymmetric pulse of positive amplitude has a weak
    negative lobe, a strong positive, a strong negative and a weak positive one. `amplitude` is the
    peak acceleration a_p in m/s^2 (negative: the mirror image), `period` is T_p = 2 pi / omega_p in
    s.
    """

    kind: Literal["ricker"] = "ricker"
    amplitude: Finite
    period: Positive
    symmetric: bool = False

    @property
    def centre(self) -> float:
        """Time of the pulse's centre after its start, s."""
        return 2.0 * self.period

    @property
    def rate(self) -> float:
        """Coefficient b of the Gaussian factor exp(-b tau^2), 1/s^2; tau counts from the centre."""
        return (
            2.0 * math.pi**2 / (3.0 * self.period**2)
            if not self.symmetric
            else 2.0 * math.pi**2 / self.period**2
        )

    @property
    def polynomial(self) -> tuple[float, float, float, float]:
        """Coefficients of 1, tau, tau^2, tau^3 of the polynomial factor, SI units.

        Antisymmetric, (34): (a_p/1.38)(2 b tau^2 - 3)(2 pi tau/(sqrt 3 T_p)). Symmetric: a_p (1 - 2
        b tau^2).
        """
        if self.symmetric:
            return self.amplitude, 0.0, -2.0 * self.rate * self.amplitude, 0.0
        slope = self.amplitude / 1.38 * 2.0 * math.pi / (math.sqrt(3.0) * self.period)
        return 0.0, -3.0 * slope, 0.0, 2.0 * self.rate * slope

    def acceleration(self, t: ArrayLike) -> Floats:
        """Base acceleration in m/s^2 at times `t` in s from the pulse's start; zero before it."""
        time = np.asarray(t, dtype=float)
        tau = time - self.centre
        c0, c1, c2, c3 = self.polynomial
        value = (c0 + tau * (c1 + tau * (c2 + tau * c3))) * np.exp(-self.rate * tau * tau)
        return np.where(time >= 0.0, value, 0.0)

    @property
    def quiet_after(self) -> float:
        """Time in s after which the pulse is below 1e-16 of its amplitude."""
        return self.centre + math.sqrt(46.0 / self.rate)


class Sine(Motion):
    """`cycles` full cycles of a sine of `amplitude` (m/s^2) and `period` (s), then rest."""

    kind: Literal["sine"] = "sine"
    amplitude: Finite
    period: Positive
    cycles: Annotated[int, Field(ge=1, le=1000)] = 1

    def acceleration(self, t: ArrayLike) -> Floats:
        """Base acceleration in m/s^2 at times `t` in s."""
        time = np.asarray(t, dtype=float)
        inside = (time >= 0.0) & (time <= self.quiet_after)
        return np.where(inside, self.amplitude * np.sin(2.0 * math.pi * time / self.period), 0.0)

    @property
    def quiet_after(self) -> float:
        """Time in s at which the last cycle ends."""
        return self.cycles * self.period


class Record(Motion):
    """A sampled ground motion: linear between its samples, zero after the last one.

    Usually made by `Record.from_file` or `Record.from_samples`. `unscaled` holds the recorded
    samples in m/s^2, and `scale` multiplies them; `pga` (g), given in place of `scale`, sets the
    peak of the scaled record. In a longer scene the base is at rest after the record. `notes` say
    what the file's reader changed or assumed, such as a first time other than 0.
    """

    kind: Literal["record"] = "record"
    unscaled: tuple[Finite, ...] = Field(min_length=1, repr=False)
    time_step: Positive
    scale: Finite = 1.0
    source: str = "samples"
    notes: Annotated[
        tuple[Annotated[str, StringConstraints(max_length=300)], ...], Field(max_length=20)
    ] = ()

    @model_validator(mode="before")
    @classmethod
    def _read_file(cls, data: Any) -> Any:
        if isinstance(data, dict) and "file" in data:
            data = _with_file_read(data)
        if isinstance(data, dict) and "pga" in data:
            rest = {name: value for name, value in data.items() if name != "pga"}
            largest = max(map(abs, cls(**rest).unscaled))
            data = rest | {"scale": _scale_to(data["pga"], largest)}
        return data

    @classmethod
    def from_file(cls, path: str | Path, scale: float | None = None, **reading: Any) -> Self:
        """The record in a file of one of the formats of `rockcheck.scenes.recordings`.

        It is as recorded, unless `scale` or `pga` (g) is given. `reading` supplies what the file
        does not state, or selects a part of it: the options of `recordings.Reading`, such as
        `unit="cm/s2"`, `time_step=0.005`, `column=2` or `component="360 Deg"`. Raises `InputError`,
        naming file and line, where the file is malformed, or something is not known.
        """
        return cls(**{"file": path, **({} if scale is None else {"scale": scale}), **reading})

    @classmethod
    def from_samples(cls, samples: ArrayLike, time_step: float, scale: float = 1.0) -> Self:
        """A record of `samples` (m/s^2, 1-D) taken every `time_step` s, the first at t = 0."""
        return cls(
            unscaled=tuple(np.atleast_1d(np.squeeze(np.asarray(samples, dtype=float))).tolist()),
            time_step=time_step,
            scale=scale,
        )

    @property
    def samples(self) -> Floats:
        """The scaled samples, m/s^2."""
        return self.scale * np.asarray(self.unscaled)

    def acceleration(self, t: ArrayLike) -> Floats:
        """Base acceleration in m/s^2 at times `t` in s, linear between samples."""
        times = self.time_step * np.arange(len(self.unscaled))
        return np.interp(np.asarray(t, dtype=float), times, self.samples, left=0.0, right=0.0)

    @property
    def quiet_after(self) -> float:
        """Time in s of the last sample."""
        return self.time_step * (len(self.unscaled) - 1)

    @property
    def peak(self) -> float:
        """Largest absolute scaled acceleration in units of standard gravity."""
        return float(np.max(np.abs(self.samples))) / GRAVITY_OF_RECORDS


def _with_file_read(data: dict[str, Any]) -> dict[str, Any]:
    """The fields of a record, what its `file` holds in place of the file's name."""
    path, extra = data["file"], {"unscaled", "source", "notes"} & data.keys()
    if {"pga", "scale"} <= data.keys():
        raise InputError("cannot be given together with scale", "pga")
    if extra:
        raise InputError("cannot be given together with file", min(extra))
    if not isinstance(path, str | Path):
        raise InputError(f"{path!r} is not allowed: give the path of a record file", "file")
    if data.get("scale") == 0:
        raise InputError("0 leaves nothing of the record: give another scale", "scale")
    options = data.keys() & Reading.model_fields
    recording = read_record(Path(path), Reading(**{name: data[name] for name in options}))
    return {key: data[key] for key in data if key not in (*options, "file")} | {
        "unscaled": tuple(recording.samples.tolist()),
        "time_step": recording.time_step,
        "source": Path(path).name,
        "notes": recording.notes,
    }


def _scale_to(pga: object, largest: float) -> float:
    """The factor that gives a record whose largest sample is `largest` (m/s^2) the peak `pga` (g).

    Raises `InputError` where there is none.
    """
    if not isinstance(pga, int | float) or isinstance(pga, bool) or not 0.0 < pga <= MOST_PGA:
        raise InputError(f"{pga!r} is not allowed: a number above 0, at most {MOST_PGA:g}", "pga")
    if not largest > 0.0:
        raise InputError("the record does not move: no scale gives it a peak", "pga")
    return pga * GRAVITY_OF_RECORDS / largest


Excitation = Annotated[Rest | Ricker | Sine | Record, Field(discriminator="kind")]
