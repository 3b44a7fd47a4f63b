"""A history: the motion that any model returns, on the scene's output grid."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from rockcheck.scenes import history_files
from rockcheck.scenes.base import Shown
from rockcheck.scenes.block import Block
from rockcheck.scenes.columns import COLUMNS
from rockcheck.scenes.errors import InputError, printable
from rockcheck.scenes.events import Event, event_table
from rockcheck.scenes.experience import Expected, expected, trust_of
from rockcheck.scenes.extremes import Extremes
from rockcheck.scenes.interpolation import from_rows

if TYPE_CHECKING:
    import pandas as pd

OUTCOMES = ("at rest", "moving", "overturned left", "overturned right")
#: |theta| from which a block has fallen, rad.
LYING = math.pi / 2 - 0.05
#: Largest rotation (rad) and velocities (rad/s, m/s) of a block at rest.
STILL = 1e-4
#: The modes of motion that a `mode` column may hold.
MODES = ("rest", "slide", "rock", "slide-rock", "lean", "ladder", "flight", "overturned")


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Cost of a run.

    `wall_seconds` (s) does not include `set_up` (s), such as building an engine's scene.
    """

    wall_seconds: float = 0.0
    cpu_seconds: float = 0.0
    set_up: float = 0.0
    steps: int = 0
    evaluations: int = 0
    #: Impacts at which the impact law added kinetic energy, and the largest relative gain.
    energy_gains: int = 0
    largest_energy_gain: float = 0.0
    #: Uses of each modelling choice of the event-based model, by name; unused ones are left out.
    rules: Mapping[str, int] = field(default_factory=dict)
    #: Largest change of theta/alpha against the same run at a tighter tolerance; None without one.
    error_estimate: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class History(Shown):
    """The motion of a block as one model sees it. SI units, signs as in the scene.

    It equals itself only; `compare` says how far two are apart.

    `channels` holds one 1-D array a name, all of one length: t, x, y, theta, x_dot, y_dot,
    theta_dot, slip, slip_rate, mode. x and y locate the centre of the box relative to the base (of
    a homogeneous block its centroid). `slip` is the distance of the pivot corner along the floor
    from its first place, `slip_rate` that corner's horizontal velocity. A history that ends in
    overturning stops there.
    """

    name: str
    model: str
    channels: Mapping[str, NDArray[Any]] = field(repr=False)
    event_list: Sequence[Event] = field(repr=False)
    outcome: str
    cost: Cost = Cost()
    settings: Mapping[str, Any] = field(default_factory=dict)
    #: Notes for the reader, one line each (for example that the record is shorter than the scene).
    notes: tuple[str, ...] = ()
    #: The block, without its mass; None for a history read from a file that does not say.
    block: Block | None = None
    #: Half width of the 95 % interval by measure (SI), of figures with an uncertain source, such as
    #: a mean of tests.
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    #: The extremes that the model kept while it played; None for a measured or loaded history.
    model_extremes: Extremes | None = field(default=None, repr=False)

    @cached_property
    def frame(self) -> pd.DataFrame:
        """The motion as a table, columns as in `channels`."""
        import pandas as pd

        return pd.DataFrame(
            {name: self.channels[name] for name in COLUMNS if name in self.channels}
        )

    @cached_property
    def events(self) -> pd.DataFrame:
        """The events as a table: t, kind, mode_before, mode_after, impulse."""
        import pandas as pd

        return pd.DataFrame(event_table(self.event_list))

    @cached_property
    def extremes(self) -> Extremes:
        """The extremes of the whole run: from the model, or between the rows of a table.

        Of a history that was measured or loaded they know no walls: `extremes.from_rows` takes
        these from a scene.
        """
        if self.model_extremes is not None:
            return self.model_extremes
        return from_rows(self.channels, self.event_list, self.block, self.outcome)

    @property
    def alpha(self) -> float | None:
        """The block's slenderness angle in rad, where the block is known."""
        return None if self.block is None else self.block.alpha

    @property
    def peak_rotation(self) -> float:
        """Largest |theta| of the run, rad; pi/2 where it overturned."""
        return self.extremes.peak_rotation

    @property
    def overturned_at(self) -> float | None:
        """Time of overturning, s; None if the block does not overturn.

        It is the time of the event of overturning (|theta| = pi/2). Without one it is the first
        time with |theta| >= `LYING`, else the end of the history.
        """
        if not self.outcome.startswith("overturned"):
            return None
        for event in self.event_list:
            if event.kind == self.outcome:
                return event.t
        lying = np.abs(self.channels["theta"]) >= LYING
        first = int(np.argmax(lying)) if np.any(lying) else -1
        return float(self.channels["t"][first])

    @property
    def fate(self) -> str:
        """The outcome in words, with the time of overturning: "overturned left at 3.21 s"."""
        at = self.overturned_at
        return self.outcome if at is None else f"{self.outcome} at {at:.3g} s"

    def expected(self, quantity: str = "peak_rotation") -> Expected:
        """A figure corrected by the model's bias in the suites, with its 95 % interval (rad).

        See `scenes.experience`. Raises `InputError` where nothing is known of the model with its
        settings, or of the figure.
        """
        known_of = trust_of(self.model, self.settings)
        if quantity not in known_of:
            raise InputError(
                f"the suites say nothing of {quantity} by {self.model} with its settings; known:"
                f" {', '.join(known_of) or 'nothing'}",
                "quantity",
            )
        return expected(known_of[quantity], float(getattr(self, quantity)))

    def save(self, path: str | Path) -> None:
        """Write the history as CSV, its events as CSV beside it; compressed where it ends in .gz.

        | ending | what is written |
        |---|---|
        | .csv | metadata in lines that begin with #, the table; and `<stem>.events.csv` |
        | .csv.gz | the same two files compressed |

        `pandas.read_csv(path, comment="#")` reads either CSV. The metadata are outcome, model,
        block and settings. Without an ending, as /dev/stdout, the table is written as CSV. Both
        files are written whole, or none is touched. For other formats take `frame` and `events`.
        Raises `InputError` for another ending, and `OSError` that names the file which cannot be
        written.
        """
        history_files.write(Path(path), self._metadata(), self.channels, self.event_list)

    def packed(self) -> dict[str, bytes]:
        """The two files that `save` writes for ".csv.gz", by their endings.

        The endings are ".csv.gz" and ".events.csv.gz".
        """
        motion, events = history_files.packed(self._metadata(), self.channels, self.event_list)
        return {".csv.gz": motion, ".events.csv.gz": events}

    def _metadata(self) -> dict[str, Any]:
        """All that a file holds beside its tables."""
        metadata = {
            "name": self.name,
            "model": self.model,
            "outcome": self.outcome,
            **history_files.block_metadata(self.block),
            "settings": dict(self.settings),
            "notes": list(self.notes),
            "uncertainty": dict(self.uncertainty),
            "cost": {key: value for key, value in vars(self.cost).items() if value is not None},
        }
        if self.model_extremes is not None:
            metadata["extremes"] = asdict(self.model_extremes)
        return metadata

    @classmethod
    def load(cls, path: str | Path) -> History:
        """Read a file that `save` wrote, or any CSV with columns of t and theta.

        Other columns of `COLUMNS` are optional. A name may say the unit: `t_s` or `time_ms`,
        `theta_deg`, `x_mm`, `slip_rate_mm_s`, also as "Time (s)", "Rotation [°]", or in a row of
        units below (`scenes.columns`); a name without one is in SI units. Semicolons, tabs or
        blanks may separate, and commas stand before decimals (`scenes.tables`). Signs are the
        scene's: theta counterclockwise positive, x of the box's centre relative to the
        base. Raises `InputError` that names file and column for a file that is missing or no CSV,
        lacks those columns or has one twice, is not numeric, not finite or not ordered in time.
        """
        path = Path(path)
        return cls._from_contents(history_files.read(path), path)

    @classmethod
    def load_with_extremes(cls, path: str | Path) -> History:
        """Read a file that `save` wrote of a run, with the extremes that the model kept.

        For files that nobody has edited since. Raises `InputError` as `load`.
        """
        path = Path(path)
        contents = history_files.read(path)
        history = cls._from_contents(contents, path)
        if contents.metadata.extremes is None:
            return history
        try:
            extremes = TypeAdapter(Extremes).validate_python(contents.metadata.extremes)
        except ValidationError:
            raise InputError(
                f"{printable(path)}: metadata: extremes: not written by rockcheck"
            ) from None
        return replace(history, model_extremes=extremes)

    @classmethod
    def _from_contents(cls, contents: history_files.Contents, path: Path) -> History:
        metadata = contents.metadata
        outcome = metadata.outcome
        if contents.converted or outcome not in OUTCOMES:
            outcome = outcome_of(contents.channels)
        cost: dict[str, Any] = {
            key: value for key, value in metadata.cost.items() if key in Cost.__dataclass_fields__
        }
        return cls(
            name=printable(metadata.name or path.stem, 200),
            model=printable(metadata.model, 200),
            channels=contents.channels,
            event_list=contents.events,
            outcome=outcome,
            cost=Cost(**cost),
            settings=metadata.settings,
            notes=tuple(printable(note, 1000) for note in metadata.notes),
            uncertainty={
                printable(name): float(half_width)
                for name, half_width in metadata.uncertainty.items()
            },
            block=contents.block,
        )


def outcome_of(channels: Mapping[str, NDArray[Any]]) -> str:
    """The outcome at the end of a table of motion.

    "at rest" means |theta| and all velocities that are known below `STILL` (rad, rad/s, m/s).
    """
    theta = channels["theta"][-1]
    if abs(theta) >= LYING:
        return "overturned left" if theta > 0 else "overturned right"
    for name in ("theta", "theta_dot", "x_dot", "y_dot"):
        if name in channels and not abs(channels[name][-1]) < STILL:
            return "moving"
    return "at rest"
