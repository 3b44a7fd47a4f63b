"""An event: what happens to a block at an instant."""

from dataclasses import dataclass


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
