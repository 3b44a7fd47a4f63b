"""Base excitations: pulses, recorded ground motions and rest.

Every excitation counts time from its own start (t = 0) and gives the acceleration of the base in
m/s^2, horizontal motion positive to the right, vertical motion positive upward.

A new pulse is a class here, as `Wavelet` is (`Wave` is a piece of a sine), a member of the union
`Excitation`, and a name in `scenes/__init__`, its stub, `rockcheck/__init__.pyi`, docs/api.md.
The event-based models need a shape of it: see the head of `ebm.core.ground`. Solvers that take
samples, pages, spectra and files need no more. Random scenes (`stress.generator`) draw it where a
row says so; a row in `PULSES` of tests/ebm/test_pulses.py tests it in all models.
"""

import math
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, StringConstraints, model_validator

from rockcheck.scenes.base import Finite, Floats, Frozen, Positive
from rockcheck.scenes.errors import InputError
from rockcheck.scenes.recordings import GRAVITY_OF_RECORDS, Reading, read_record

#: Largest peak acceleration that a record may be scaled to, g; and most notes of a record.
MOST_PGA, MOST_NOTES = 1000.0, 20


#: Samples a period of a pulse: between them it is a straight line to 1e-5 of its amplitude, and a
#: cubic to 1e-11.
SAMPLES_A_PERIOD = 1000


class Motion(Frozen):
    """Base of all excitations: a scaled or stretched motion is of the same kind.

    What a solver asks of one: `acceleration(t)`, the time `quiet_after` which the base is at rest,
    the times of its `kinks` and `jumps`, its `extremes`, and the `sample_step` of a solver that
    takes samples. What the compiled core asks is in `ebm.core.ground`.
    """

    @property
    def kinks(self) -> tuple[float, ...]:
        """Times (s) at which the acceleration, or its rate, jumps."""
        return ()

    @property
    def jumps(self) -> tuple[float, ...]:
        """Times (s) after the start at which the acceleration itself jumps."""
        return ()

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


class Pulse(Motion):
    """A motion of one shape: its `amplitude` is in m/s^2, and its `period` in s.

    A negative amplitude gives the mirror image. The frequency of a spectrum is 2 pi over the
    period.
    """

    amplitude: Finite
    period: Positive

    @property
    def sample_step(self) -> float:
        """Time between samples (s) that follow the pulse, see `SAMPLES_A_PERIOD`."""
        return self.period / SAMPLES_A_PERIOD


class Rest(Motion):
    """A base that does not move."""

    kind: Literal["rest"] = "rest"
    #: Time after which the base is at rest, s.
    quiet_after: ClassVar[float] = 0.0

    def acceleration(self, t: ArrayLike) -> Floats:
        """Base acceleration at times `t` (s): zero."""
        return np.zeros_like(np.asarray(t, dtype=float))

    @property
    def extremes(self) -> tuple[float, float]:
        """The least and the largest acceleration, m/s^2."""
        return 0.0, 0.0


class Ricker(Pulse):
    """A Ricker pulse; antisymmetric (the paper's (34)) unless `symmetric`.

    It starts 2 T_p before its centre. An antisymmetric pulse of positive amplitude has a weak
    negative lobe, a strong positive, a strong negative and a weak positive one. `amplitude` is the
    peak acceleration a_p in m/s^2 (negative: the mirror image), `period` is T_p = 2 pi / omega_p in
    s.
    """

    kind: Literal["ricker"] = "ricker"
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

    @property
    def extremes(self) -> tuple[float, float]:
        """The least and the largest acceleration, m/s^2."""
        return extremes_by_samples(self)


class Wave(Pulse, ABC):
    """A piece of a sine: amplitude times sin(2 pi (t + lead)/period), then rest."""

    #: How much of a period has passed at the start.
    lead_share: ClassVar[float] = 0.0

    @property
    def lead(self) -> float:
        """Time (s) by which the sine is ahead at the start."""
        return self.lead_share * self.period

    @property
    @abstractmethod
    def quiet_after(self) -> float:
        """Time in s at which the piece ends."""

    @property
    def kinks(self) -> tuple[float, ...]:
        """Times (s) at which the acceleration, or its rate, jumps."""
        return (self.quiet_after,)

    @property
    def extremes(self) -> tuple[float, float]:
        """The least and the largest acceleration, m/s^2."""
        return -abs(self.amplitude), abs(self.amplitude)

    def acceleration(self, t: ArrayLike) -> Floats:
        """Base acceleration in m/s^2 at times `t` in s."""
        time = np.asarray(t, dtype=float)
        inside = (time >= 0.0) & (time <= self.quiet_after)
        phase = 2.0 * math.pi * (time + self.lead) / self.period
        return np.where(inside, self.amplitude * np.sin(phase), 0.0)


class Sine(Wave):
    """`cycles` full cycles of a sine of `amplitude` (m/s^2) and `period` (s), then rest.

    One cycle is Zhang and Makris's pulse of type A (2001).
    """

    kind: Literal["sine"] = "sine"
    cycles: Annotated[int, Field(ge=1, le=1000)] = 1

    @property
    def quiet_after(self) -> float:
        """Time in s at which the last cycle ends."""
        return self.cycles * self.period


class Cosine(Wave):
    """`cycles` full cycles of a cosine of `amplitude` (m/s^2) and `period` (s), then rest.

    It begins and ends with a jump. One cycle is Zhang and Makris's pulse of type B (2001): the base
    moves there and back.
    """

    kind: Literal["cosine"] = "cosine"
    cycles: Annotated[int, Field(ge=1, le=1000)] = 1
    lead_share: ClassVar[float] = 0.25

    @property
    def quiet_after(self) -> float:
        """Time in s at which the last cycle ends."""
        return self.cycles * self.period

    @property
    def jumps(self) -> tuple[float, ...]:
        """Times (s) after the start at which the acceleration itself jumps."""
        return (self.quiet_after,)


class HalfSine(Wave):
    """Half a cycle of a sine of `amplitude` (m/s^2), then rest: Housner's pulse (1963).

    It lasts half its `period` (s).
    """

    kind: Literal["half-sine"] = "half-sine"

    @property
    def quiet_after(self) -> float:
        """Time in s at which the pulse ends."""
        return 0.5 * self.period

    @property
    def extremes(self) -> tuple[float, float]:
        """The least and the largest acceleration, m/s^2."""
        return min(self.amplitude, 0.0), max(self.amplitude, 0.0)


class Wavelet(Pulse):
    """Mavroeidis and Papageorgiou's wavelet of near-fault ground motion (2003).

    The velocity of the base is A/2 (1 + cos(omega tau/gamma)) cos(omega tau + phase), tau from the
    middle, for gamma periods in all; omega is 2 pi over the `period` (s). `amplitude` (m/s^2) is
    omega A, near the largest acceleration. `gamma` (above 1) says how many oscillations it has, and
    `phase` (rad) which: 0 is symmetric in velocity, pi/2 antisymmetric.
    """

    kind: Literal["wavelet"] = "wavelet"
    gamma: Annotated[float, Field(gt=1.0, le=100.0)] = 2.0
    phase: Finite = 0.0

    @property
    def quiet_after(self) -> float:
        """Time in s at which the pulse ends."""
        return self.gamma * self.period

    @property
    def kinks(self) -> tuple[float, ...]:
        """Times (s) at which the acceleration, or its rate, jumps."""
        return (self.quiet_after,)

    def acceleration(self, t: ArrayLike) -> Floats:
        """Base acceleration in m/s^2 at times `t` in s: the derivative of the velocity."""
        time = np.asarray(t, dtype=float)
        inside = (time >= 0.0) & (time <= self.quiet_after)
        turn = 2.0 * math.pi / self.period * (time - 0.5 * self.quiet_after)
        envelope, carrier = turn / self.gamma, turn + self.phase
        falling = np.sin(envelope) * np.cos(carrier) / self.gamma
        value = falling + (1.0 + np.cos(envelope)) * np.sin(carrier)
        return np.where(inside, -0.5 * self.amplitude * value, 0.0)

    @property
    def extremes(self) -> tuple[float, float]:
        """The least and the largest acceleration, m/s^2."""
        return extremes_by_samples(self)


def extremes_by_samples(pulse: Ricker | Wavelet) -> tuple[float, float]:
    """The least and the largest acceleration of a pulse (m/s^2), to rounding."""
    times = np.linspace(0.0, pulse.quiet_after, 20_001)
    values = pulse.acceleration(times)
    least, largest = times[np.argmin(values)], times[np.argmax(values)]
    step = float(times[1])
    return -_largest_near(pulse, largest_of=-1.0, t=least, step=step), _largest_near(
        pulse, largest_of=1.0, t=largest, step=step
    )


def _largest_near(pulse: Ricker | Wavelet, *, largest_of: float, t: float, step: float) -> float:
    """The largest of `largest_of` (1 or -1) times the acceleration within a step of a time.

    Each look is a hundred times as fine as the one before. An extremum is flat: its value errs by
    the square of the distance.
    """
    largest = -math.inf
    for _ in range(4):
        times = t + np.linspace(-step, step, 201)
        values = largest_of * pulse.acceleration(times)
        index = int(np.argmax(values))
        largest, t, step = max(largest, float(values[index])), float(times[index]), 0.01 * step
    return largest


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
        tuple[Annotated[str, StringConstraints(max_length=300)], ...], Field(max_length=MOST_NOTES)
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
    def sample_step(self) -> float:
        """Time between samples, s."""
        return self.time_step

    @property
    def kinks(self) -> tuple[float, ...]:
        """Times (s) at which the acceleration, or its rate, jumps: those of its samples."""
        return tuple((self.time_step * np.arange(len(self.unscaled))).tolist())

    @property
    def jumps(self) -> tuple[float, ...]:
        """Times (s) after the start at which the acceleration itself jumps: the end."""
        return (self.quiet_after,)

    @property
    def extremes(self) -> tuple[float, float]:
        """The least and the largest acceleration, m/s^2."""
        return float(np.min(self.samples)), float(np.max(self.samples))

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


Excitation = Annotated[
    Rest | Ricker | Sine | Cosine | HalfSine | Wavelet | Record, Field(discriminator="kind")
]
