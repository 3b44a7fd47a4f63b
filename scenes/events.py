"""An event: what happens to a block at an instant."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

EVENT_COLUMNS = ("t", "kind", "mode_before", "mode_after", "impulse")


@dataclass(frozen=True, kw_only=True)
class Event:
    """One change of contact or mode at time `t` (s).

    `impulse` is per unit mass in m/s; 0 without an impact.
    """

    t: float
    kind: str
    mode_before: str = ""
    mode_after: str = ""
    impulse: float = 0.0


def event_table(events: Sequence[Event]) -> dict[str, list[Any]]:
    """The columns of a table of events: t, kind, mode_before, mode_after, impulse."""
    return {name: [getattr(event, name) for event in events] for name in EVENT_COLUMNS}
