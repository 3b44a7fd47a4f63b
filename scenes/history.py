"""A history: the motion that any model returns, on the scene's output grid."""

from __future__ import annotations

import gzip
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, FiniteFloat, TypeAdapter, ValidationError

from rockcheck.scenes import tables
from rockcheck.scenes.base import MOST, Floats, Frozen, NonNegative, Positive, Shown
from rockcheck.scenes.block import Block
from rockcheck.scenes.columns import COLUMNS, meanings_of
from rockcheck.scenes.errors import InputError, printable
from rockcheck.scenes.events import Event
from rockcheck.scenes.experience import Expected, expected, trust_of
from rockcheck.scenes.extremes import Extremes
from rockcheck.scenes.interpolation import from_rows
from rockcheck.scenes.reading import read_table
from rockcheck.scenes.writing import columns_text, json_text, write_together

if TYPE_CHECKING:
    import pandas as pd

EVENT_COLUMNS = ("t", "kind", "mode_before", "mode_after", "impulse")
OUTCOMES = ("at rest", "moving", "overturned left", "overturned right")
#: |theta| from which a block has fallen, rad.
LYING = math.pi / 2 - 0.05
#: Largest rotation (rad) and velocities (rad/s, m/s) of a block at rest.
STILL = 1e-4
#: Endings of files that a history can be written to, and the columns that hold words.
FORMATS = ("", ".csv", ".gz", ".json", ".mat", ".parquet")
WORDS = ("kind", "mode_before", "mode_after")
#: The first line of a CSV; those below it give the metadata, a key a line as JSON.
HEAD = "rockcheck history: its metadata, a key a line; pandas.read_csv(FILE, comment='#')"
#: Files of rockcheck 0.1 before November 2026 hold the metadata in the first row of this column;
#: it is also their name in the attributes of Parquet.
ABOUT = "rockcheck_history"
#: Metadata of the block; `_MASS` of one that is not homogeneous.
_SIZES, _MASS = ("half_width", "half_height"), ("centre_of_mass", "moment_of_inertia")
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

        return pd.DataFrame(self._event_columns())

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
        down = [*np.flatnonzero(np.abs(self.channels["theta"]) >= LYING), -1]
        lies = float(self.channels["t"][down[0]])
        return next((one.t for one in self.event_list if one.kind == self.outcome), lies)

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
        """Write a file in the format of its ending; CSV without an ending, as /dev/stdout.

        | ending | what is written |
        |---|---|
        | .csv | metadata in lines that begin with #, the table; and `<stem>.events.csv` |
        | .csv.gz | the same two files compressed |
        | .json | {"outcome", "model", ..., "channels": {name: [...]}, "events": {column: [...]}} |
        | .mat | the same as a MATLAB file: structures `about`, `channels` and `events` |
        | .parquet | the table, metadata in the frame's `attrs`; and `<stem>.events.parquet` |

        `pandas.read_csv(path, comment="#")` reads either CSV. The metadata are outcome, model,
        block and settings. Parquet needs the package pyarrow. All
        files are written whole, or none is touched. `load` reads the CSV, compressed or not. Raises
        `InputError` for another ending, and `OSError` that names the file which cannot be written.
        """
        path = Path(path)
        check_format(path)
        kind, contents = path.suffix.lower(), dict[Path, str | bytes]()
        if kind == ".json":
            columns = {name: column.tolist() for name, column in self.channels.items()}
            tables = {"channels": columns, "events": self._event_columns()}
            contents[path] = json_text(self._about() | tables) + "\n"
        elif kind == ".mat":
            contents[path] = _mat(self._about(), self.channels, self._event_columns())
        elif kind == ".parquet":
            frame = self.frame.copy()
            frame.attrs[ABOUT] = json.loads(json.dumps(self._about(), default=str))
            contents[events_path(path)] = self.events.to_parquet(engine="pyarrow", index=False)
            contents[path] = frame.to_parquet(engine="pyarrow", index=False)
        else:
            table, beside = self.packed().values() if kind == ".gz" else self._tables()
            if path.is_file() or not path.exists():  # nothing is written beside /dev/stdout
                contents[events_path(path)] = beside
            contents[path] = table
        write_together(contents, named=True)

    def packed(self) -> dict[str, bytes]:
        """The two files that `save` writes for ".csv.gz", by their endings.

        The endings are ".csv.gz" and ".events.csv.gz".
        """
        # The same text gives the same bytes. Digits of floats hardly repeat: level 4 saves 12 %
        # more in three times the time.
        return {
            ending: gzip.compress(text.encode(), compresslevel=2, mtime=0)
            for ending, text in zip((".csv.gz", ".events.csv.gz"), self._tables(), strict=True)
        }

    def _about(self) -> dict[str, Any]:
        """Metadata of a history: all that a file holds beside its tables."""
        return {
            "name": self.name,
            "model": self.model,
            "outcome": self.outcome,
            **{name: getattr(self.block, name, None) for name in _SIZES},
            **{
                name: getattr(self.block, name) for name in _MASS if getattr(self.block, name, None)
            },
            "settings": dict(self.settings),
            "notes": list(self.notes),
            "uncertainty": dict(self.uncertainty),
            "cost": {key: value for key, value in vars(self.cost).items() if value is not None},
            **({"extremes": asdict(self.model_extremes)} if self.model_extremes else {}),
        }

    def _tables(self) -> tuple[str, str]:
        columns = {
            name: np.asarray(self.channels[name]).tolist()
            for name in COLUMNS
            if name in self.channels
        }
        about = [
            f"# {key}: {json.dumps(value, sort_keys=True, default=str)}\n"
            for key, value in sorted(self._about().items())
        ]
        head = "".join([f"# {HEAD}\n", *about])
        return head + columns_text(columns), columns_text(self._event_columns())

    def _event_columns(self) -> dict[str, list[Any]]:
        return {name: [getattr(event, name) for event in self.event_list] for name in EVENT_COLUMNS}

    @classmethod
    def load_with_extremes(cls, path: str | Path) -> History:
        """Read a file that `save` wrote of a run, with the extremes that the model kept.

        For files that nobody has edited since. Raises `InputError` as `load`.
        """
        history, about = cls._read(Path(path))
        if about.extremes is None:
            return history
        try:
            return replace(
                history, model_extremes=TypeAdapter(Extremes).validate_python(about.extremes)
            )
        except ValidationError:
            raise InputError(
                f"{printable(path)}: metadata: extremes: not written by rockcheck"
            ) from None

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
        return cls._read(Path(path))[0]

    @classmethod
    def _read(cls, path: Path) -> tuple[History, _About]:
        """The history of a file, and the metadata in it."""
        import pandas as pd

        shown = printable(path)
        if (kind := path.suffix.lower()) in (".json", ".mat", ".parquet"):
            raise InputError(f"{shown}: a history is read from .csv or .csv.gz, not from {kind}")
        table = tables.read(path)
        beside = events_path(path)
        # Any text is a kind or a mode, also "None" and "hit #2".
        words = {"dtype": dict.fromkeys(WORDS, str), "keep_default_na": False, "comment": None}
        events = read_table(beside, **words) if beside.exists() else pd.DataFrame()
        about, block = _about_of(table, shown)
        channels, plain = _channels(table, shown)
        try:
            event_list = tuple(
                Event(
                    t=float(t),
                    kind=kind,
                    mode_before=before,
                    mode_after=after,
                    impulse=float(impulse or 0.0),
                )
                for t, kind, before, after, impulse in events.reindex(
                    columns=EVENT_COLUMNS, fill_value=""
                ).itertuples(index=False)
            )
            np.asarray_chkfinite([(one.t, one.impulse) for one in event_list])
            cost = Cost(
                **{
                    key: value
                    for key, value in dict[str, Any](about.cost).items()
                    if key in Cost.__dataclass_fields__
                }
            )
        except (AttributeError, TypeError, ValueError):
            raise InputError(
                f"{printable(beside)}: not an events table written by rockcheck"
            ) from None
        history = cls(
            name=printable(about.name or path.stem, 200),
            model=printable(about.model, 200),
            channels=channels,
            event_list=event_list,
            outcome=about.outcome if plain and about.outcome in OUTCOMES else outcome_of(channels),
            cost=cost,
            settings=about.settings,
            notes=tuple(printable(note, 1000) for note in about.notes),
            uncertainty={printable(name): float(u) for name, u in about.uncertainty.items()},
            block=block,
        )
        return history, about


def check_format(path: Path, more: str = "") -> None:
    """Raise `InputError` if no history can be written into a file of that name.

    The message ends with `more` that is allowed.
    """
    kind, shown = path.suffix.lower(), printable(path)
    if kind not in FORMATS or (kind == ".gz" and not path.name.lower().endswith(".csv.gz")):
        raise InputError(
            f"{shown}: a history is written as .csv, .csv.gz, .json, .mat or .parquet,"
            f" not as {printable(path.suffix)}{more}"
        )
    if kind == ".parquet" and not find_spec("pyarrow"):
        raise InputError(f"{shown}: Parquet needs the package pyarrow: pip install pyarrow")


def _mat(
    about: Mapping[str, Any], channels: Mapping[str, NDArray[Any]], events: Mapping[str, list[Any]]
) -> bytes:
    from scipy.io import savemat

    said = {
        name: json.dumps(value, default=str) if isinstance(value, dict | list) else value
        for name, value in about.items()
        if isinstance(value, str | int | float | dict | list | tuple)
    }
    columns = {
        name: column.astype(object) if column.dtype.kind in "UO" else column
        for name, column in channels.items()
    }
    happened = {
        name: np.array(column, dtype=object if name in WORDS else float)
        for name, column in events.items()
    }
    content = io.BytesIO()
    savemat(
        content,
        {"about": said, "channels": columns, "events": happened},
        oned_as="column",
        do_compression=True,
    )
    return content.getvalue()


def outcome_of(channels: Mapping[str, NDArray[Any]]) -> str:
    """The outcome at the end of a table of motion.

    "at rest" means |theta| and all velocities that are told below `STILL` (rad, rad/s, m/s).
    """
    theta = channels["theta"][-1]
    if abs(theta) >= LYING:
        return "overturned left" if theta > 0 else "overturned right"
    told = [channels[c][-1] for c in ("theta", "theta_dot", "x_dot", "y_dot") if c in channels]
    return "at rest" if all(abs(value) < STILL for value in told) else "moving"


def events_path(path: Path) -> Path:
    """The file of the events beside a history's CSV or Parquet.

    It is compressed if the CSV is.
    """
    if path.suffix.lower() == ".parquet":
        return path.with_name(f"{path.stem}.events.parquet")
    packed = path.suffix if path.name.lower().endswith(".csv.gz") else ""
    return path.with_name(f"{Path(path.name.removesuffix(packed)).stem}.events.csv{packed}")


class _About(Frozen):
    """Metadata that `save` writes above the table.

    All of it may be missing in a file of another program.
    """

    model_config = ConfigDict(extra="ignore")
    name: Any = None
    model: Any = "measured"
    outcome: Any = None
    half_width: Positive | None = None
    half_height: Positive | None = None
    centre_of_mass: Any = None
    moment_of_inertia: Any = None
    settings: Mapping[str, Any] = {}
    notes: tuple[Any, ...] = ()
    uncertainty: Mapping[str, NonNegative] = {}
    cost: Mapping[str, int | FiniteFloat | Mapping[str, Any] | None] = {}
    extremes: Any = None


def _about_of(table: tables.Table, shown: str) -> tuple[_About, Block | None]:
    """The metadata of a table, and its block where both of its sizes are known."""
    try:
        about = _About(**_metadata(table))
        sizes = {name: getattr(about, name) for name in (*_SIZES, *_MASS)}
        unknown = None in (about.half_width, about.half_height)
        massless = all(sizes[name] is None for name in _MASS)
        return about, None if unknown and massless else Block(**sizes)
    except InputError as error:
        raise InputError(f"{shown}: metadata: {error}") from None
    except (TypeError, ValueError, RecursionError):
        raise InputError(f"{shown}: metadata: not written by rockcheck") from None


def _metadata(table: tables.Table) -> dict[str, Any]:
    """What `save` wrote above a table, or in the first row of a column of an older file."""
    if table.remarks[:1] == [HEAD]:
        pairs = [remark.partition(": ") for remark in table.remarks[1:]]
        return {key: json.loads(value) for key, _, value in pairs}
    if ABOUT in table.names and len(table.frame):
        older: dict[str, Any] = json.loads(table.frame[table.names.index(ABOUT)].iloc[0])
        return older
    return {}


def _channels(table: tables.Table, shown: str) -> tuple[dict[str, NDArray[Any]], bool]:
    """The channels of a table in SI units, and whether the table has them in these."""
    try:
        columns = meanings_of(table.names, table.units)
    except InputError as error:
        raise InputError(f"{shown}: {error}") from None
    for name in ("t", "theta"):
        if name not in columns:
            raise InputError(
                f"{shown}: no column {name!r}, or with a unit as in {_EXAMPLES[name]}; t and theta"
                f" are needed, of {', '.join(COLUMNS)}"
            )
    if len(table.frame) == 0:
        raise InputError(f"{shown}: no rows")
    channels: dict[str, NDArray[Any]] = {}
    for name in COLUMNS:
        if name not in columns:
            continue
        index, factor = columns[name]
        column = table.frame[index]
        if name == "mode":
            channels[name] = column.astype(str).to_numpy()
        else:
            channels[name] = factor * _numbers(column.rename(table.names[index]), shown)
    if np.any(np.diff(channels["t"]) <= 0.0):
        raise InputError(f"{shown}: column 't' does not increase")
    return channels, all(factor == 1.0 for _, factor in columns.values())


#: How other programs may name the columns that are needed.
_EXAMPLES = {"t": "'Time (s)' or t_ms", "theta": "'Rotation (deg)' or theta_mrad"}


def _numbers(column: pd.Series[Any], shown: str) -> Floats:
    import pandas as pd

    words = column.astype(str) if column.dtype == bool else column  # True is no number
    try:
        values = pd.to_numeric(words).to_numpy(dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{shown}: column {column.name!r} is not numeric") from None
    bad = np.flatnonzero(~(np.abs(values) <= MOST))
    if bad.size:
        value = values[bad[0]]
        why = f"larger than {MOST:g}" if np.isfinite(value) else "not finite"
        raise InputError(f"{shown}: column {column.name!r}, row {bad[0] + 1}: {value} is {why}")
    return values
