"""Buildings: what the base of a block does on a storey, under a motion of the ground.

In: the motion of the ground, and a building with a storey. Out: the absolute acceleration of that
storey, as a record: to every model it is a record like any other. Called where scene files are
read, and where records take the place of a scene's excitation.

The building is linear, and so heavy that the block does not act on it. A mode of frequency omega
and damping zeta answers q'' + 2 zeta omega q' + omega^2 q = -a; its mass feels the absolute
acceleration q'' + a. A storey feels the sum of these, each times the mode's participation factor
and its shape there; what is missing to a sum of 1 moves with the ground. Storeys do not rotate, and
move vertically with the ground.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, Strict, model_validator

from rockcheck.scenes.base import Finite, Floats, Frozen
from rockcheck.scenes.errors import InputError
from rockcheck.scenes.excitations import MOST_NOTES, Excitation, Record

#: A storey's motion is a record of straight lines: they leave it by this part of its peak at most.
LINE_ERROR = 1e-3
#: Steps in the shortest period at first; they are halved until the lines are near enough.
FIRST_STEPS = 6
#: A mode of a shorter period (s) moves with the ground; the longest period, s; the least damping.
RIGID_BELOW, LONGEST, LEAST_DAMPING = 0.005, 100.0, 1e-3
#: Most samples while the ground moves, and after it; the most storeys of a building.
MOST_SAMPLES, MOST_STOREYS = 1_000_000, 200
#: Longest free vibration that is played after the ground has come to rest, s.
MOST_TAIL = 600.0
#: Points of Gauss's rule at which a step sees the ground: exact for polynomials of degree 11.
_POINTS = 6

Damping = Annotated[float, Strict(), Field(ge=LEAST_DAMPING, lt=1.0)]


class Mode(Frozen):
    """A mode of a building as a storey feels it.

    `period` in s, below `RIGID_BELOW` a rigid one; `damping` relative to critical; `participation`
    is the participation factor times the mode's shape at the storey.
    """

    period: Annotated[float, Strict(), Field(ge=0.0, le=LONGEST)]
    damping: Damping
    participation: Finite

    @property
    def pole(self) -> complex:
        """-zeta omega + i omega_D, 1/s."""
        rate = 2.0 * math.pi / self.period
        return rate * complex(-self.damping, math.sqrt(1.0 - self.damping**2))


class Regular(Frozen):
    """A regular shear building: `storeys` of equal mass and stiffness.

    The block stands on `storey`, 0 for the ground. `period` (s) is the first one; all modes have
    the same `damping`, relative to critical.
    """

    storeys: Annotated[int, Strict(), Field(ge=1, le=MOST_STOREYS)]
    storey: Annotated[int, Strict(), Field(ge=0)]
    period: Annotated[float, Strict(), Field(ge=0.0, le=LONGEST)]
    damping: Damping

    @model_validator(mode="after")
    def _has_storey(self) -> "Regular":
        if self.storey > self.storeys:
            raise InputError(
                f"{self.storey} is not allowed: the building has {self.storeys} storeys", "storey"
            )
        return self

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The modes as the storey feels them.

        omega_j is in proportion to sin(x_j/2) and the shape of storey i to sin(i x_j), x_j = (2 j -
        1) pi/(2 n + 1): those of a chain that is held below and free above.
        """
        count = self.storeys
        angles = (2.0 * np.arange(1, count + 1) - 1.0) * np.pi / (2.0 * count + 1.0)
        shapes = np.sin(np.outer(np.arange(1, count + 1), angles))
        factors = shapes.sum(axis=0) / np.square(shapes).sum(axis=0)
        parts = (factors * np.sin(self.storey * angles)).tolist()
        periods = (self.period * np.sin(0.5 * angles[0]) / np.sin(0.5 * angles)).tolist()
        return tuple(
            Mode(period=period, damping=self.damping, participation=part)
            for period, part in zip(periods, parts, strict=True)
        )

    @property
    def words(self) -> str:
        """Which storey of which building."""
        return f"on storey {self.storey} of {self.of_storeys}"

    @property
    def of_storeys(self) -> str:
        """Which building."""
        return f"{self.storeys}, period {self.period:g} s, damping {self.damping:g}"


class Modal(Frozen):
    """A building by its `modes`, as the storey feels them on which the block stands."""

    modes: Annotated[tuple[Mode, ...], Field(min_length=1, max_length=MOST_STOREYS)]

    @property
    def words(self) -> str:
        """Which building."""
        count = len(self.modes)
        return f"in a building of {count} mode{'s' * (count > 1)}"


Building = Regular | Modal


def building_of(table: Any) -> Building:
    """The building of a table `[building]` of a scene file. Raises `InputError`."""
    if not isinstance(table, dict):
        raise InputError("must be a table: write [building]", "building")
    kind = Modal if "modes" in table else Regular
    try:
        return kind(**table)
    except InputError as error:
        raise InputError(error.reason, f"building.{error.key}") from None


def storey_motion(building: Building, ground: Excitation, quiet_below: float) -> Excitation:
    """The storey's absolute acceleration under a motion of the ground.

    A record, from rest, exact at its samples; its lines in between leave the motion by
    `LINE_ERROR` of its peak at most. After the ground has come to rest it goes on until it is
    below `quiet_below` (m/s^2). A storey that moves with the ground gets the ground's motion
    itself. Raises `InputError` where the motion would be too long.
    """
    modes = [
        mode for mode in building.modes if mode.period >= RIGID_BELOW and mode.participation != 0.0
    ]
    if not modes or ground.extremes == (0.0, 0.0):
        return ground
    if ground.quiet_after == 0.0:
        raise InputError("a record of one sample moves no building")
    storey = _Storey(ground, modes, quiet_below)
    step = storey.first_step
    while (error := (found := storey.samples(step)).line_error) > LINE_ERROR:
        step *= 0.5
    lasts = step * (len(found.samples) - 1) - ground.quiet_after
    name = getattr(ground, "source", f"{ground.kind} pulse")
    return Record(
        unscaled=tuple(found.samples.tolist()),
        time_step=step,
        source=name[:200],
        notes=(
            *getattr(ground, "notes", ())[: MOST_NOTES - 1],
            f"{building.words}: lines every {step:.3g} s leave the motion by {error:.1e} of its"
            f" peak; after the ground {lasts:.3g} s of free vibration",
        ),
    )


@dataclass(frozen=True)
class _Sampled:
    """A storey's motion at its samples (m/s^2).

    `line_error` is how far lines between the samples leave the motion half-way, over its peak.
    """

    samples: Floats
    line_error: float


class _Storey:
    """The answer of modes to a motion of the ground, from rest."""

    def __init__(self, ground: Any, modes: Sequence[Mode], quiet_below: float) -> None:
        self.ground, self.modes, self.quiet_below = ground, modes, quiet_below
        self.rigid_share = 1.0 - sum(mode.participation for mode in modes)
        shortest = min(mode.period for mode in modes)
        if isinstance(ground, Record):
            shortest_step = min(ground.time_step, shortest / FIRST_STEPS)
            self.first_step = ground.time_step / math.ceil(ground.time_step / shortest_step)
        else:
            shortest_step = min(ground.period, shortest) / FIRST_STEPS
            self.first_step = ground.quiet_after / math.ceil(ground.quiet_after / shortest_step)

    def samples(self, step: float) -> _Sampled:
        """The absolute acceleration every `step` (s), until it is quiet.

        The kinks of the ground's motion lie at samples.
        """
        half, quiet_after = 0.5 * step, self.ground.quiet_after
        count = 2 * round(quiet_after / step)
        _check_count(count, quiet_after)
        times = np.minimum(half * np.arange(count + 1), quiet_after)
        shaken = self.rigid_share * self.ground.acceleration(times)
        points, weights = np.polynomial.legendre.leggauss(_POINTS)
        left = 0.5 * half * (1.0 - points)  # of a step, after each point
        pushed = self.ground.acceleration(half * np.arange(1, count + 1)[:, None] - left)
        pushed *= 0.5 * half * weights
        last_states = []
        for mode in self.modes:
            states = _states(mode.pole, half, pushed, left)
            shaken += _felt(mode, states)
            last_states.append(complex(states[-1]))
        free = self._free_vibration(last_states, half)
        ends, middles = shaken[::2], shaken[1::2]
        lines = 0.5 * (ends[:-1] + ends[1:])
        error = float(np.max(np.abs(middles - lines)) / np.max(np.abs(shaken)))
        return _Sampled(np.concatenate([ends, free[1::2]]), error)

    def _free_vibration(self, states: Sequence[complex], step: float) -> Floats:
        """What is felt after the ground has come to rest, in an even number of steps."""
        lasts = 0.0
        for mode, state in zip(self.modes, states, strict=True):
            size = abs(mode.participation * mode.pole**2 / mode.pole.imag * state)
            ratio = len(states) * size / self.quiet_below
            lasts = max(lasts, math.log(max(ratio, 1.0)) / -mode.pole.real)
        if lasts > MOST_TAIL:
            raise InputError(
                f"the building vibrates for {lasts:.3g} s after the ground, more than"
                f" {MOST_TAIL:g} s: give it more damping"
            )
        steps = 2 * math.ceil(0.5 * lasts / step)
        _check_count(steps, lasts)
        times = step * np.arange(1, steps + 1)
        felt = np.zeros(len(times))
        for mode, state in zip(self.modes, states, strict=True):
            felt += _felt(mode, state * np.exp(mode.pole * times))
        return felt


def _states(pole: complex, step: float, pushed: Floats, left: Floats) -> NDArray[np.complex128]:
    """States z of a mode every `step`, from rest: z' = pole z + a, and q = -Im(z)/omega_D.

    A step adds the integral of exp(pole (step - s)) a(s), by Gauss's rule: exact but for rounding.
    `pushed` has the ground's acceleration times the weight of each of its points (steps x points),
    which are so much time before the end of a step as `left` says.
    """
    from scipy.signal import lfilter

    # Not by BLAS, whose threads would wait for each other beside other work.
    added = np.einsum("ij,j->i", pushed, np.exp(pole * left))
    states = lfilter([1.0], [1.0, -np.exp(pole * step)], added)
    return np.concatenate([[0.0], states])


def _check_count(count: int, lasts: float) -> None:
    """Raises `InputError` where a motion that lasts so long (s) has too many samples."""
    if count > MOST_SAMPLES:
        raise InputError(f"a motion of {lasts:g} s would need more than {MOST_SAMPLES} samples")


def _felt(mode: Mode, states: NDArray[np.complex128]) -> Floats:
    """What the storey feels of a mode, by its states: its participation times q'' + a.

    That is -2 zeta omega q' - omega^2 q = -Im(pole^2 z)/omega_D.
    """
    factor = -mode.participation / mode.pole.imag * mode.pole**2
    return np.asarray((factor * states).imag, dtype=float)
