"""What an engineer asks of a run: how far the block turns, slides, reaches, how it strikes a wall.

A history lasts from its start to its end: the scene's duration, or where the block overturned. A
run of `ebm.fates` lasts until its fate is decided.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from rockcheck.scenes.block import Side


@dataclass(frozen=True, kw_only=True)
class WallExtremes:
    """How the block strikes one wall."""

    #: Impacts at this wall.
    strikes: int
    #: Time of the first one, s; None without one.
    first_s: float | None
    #: Largest speed of approach of a corner that strikes, m/s; 0 without a strike.
    speed: float
    #: Largest normal impulse of one strike per unit mass, m/s; 0 without a strike.
    impulse: float


NO_STRIKE = WallExtremes(strikes=0, first_s=None, speed=0.0, impulse=0.0)


@dataclass(frozen=True, kw_only=True)
class Extremes:
    """The extremes of a run, SI units; lengths are those of the box, not of its mass's centre.

    A figure that cannot be known, such as the slip of a measured rotation, is NaN.
    """

    #: Largest rotation to each side (theta > 0 is left), rad, and when, s; 0 where it never turns
    #: there, pi/2 where it overturned.
    rotation_left: float
    rotation_left_s: float
    rotation_right: float
    rotation_right_s: float
    #: Largest |slip| and the slip at the end, m; as `kinematics.slip`.
    slip: float
    last_slip: float
    #: Farthest that any corner gets beyond the side of the block as it stands at x = 0, m.
    reach_left: float
    reach_right: float
    #: Largest horizontal distance of a top corner from where it began, m.
    top_displacement: float
    #: Largest height of the lowest corner above the floor, m.
    hop: float
    #: Every wall of the scene.
    walls: Mapping[Side, WallExtremes]
    #: When the block first uplifts, and when its pivot first slips, s; None if never.
    first_uplift_s: float | None
    first_slip_s: float | None
    #: "model": kept by the model while it played. "rows": interpolated between the rows of a table.
    source: Literal["model", "rows"]

    @property
    def peak_rotation(self) -> float:
        """Largest |theta|, rad."""
        return max(self.rotation_left, self.rotation_right)
