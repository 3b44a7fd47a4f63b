"""Runs as compiled code takes them: scenes packed into arrays of records, a row a run.

Here are also their states at the start and the event loop that plays them. `EventBasedModel`, which
plays a history by this, is known here by its settings only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import natural
from rockcheck.ebm.core import march
from rockcheck.ebm.core.block import SETTING, filled
from rockcheck.ebm.core.ground import FORM
from rockcheck.ebm.core.state import CONTROL, MOTION, STATE, Records, Rows, workspace
from rockcheck.scenes.compiled import for_types_of
from rockcheck.scenes.scene import Scene

Floats = NDArray[np.float64]
#: The event loops that are compiled, by whether friction is Bouc-Wen's.
_READY: dict[bool, Callable[..., None]] = {}


@dataclass(frozen=True, kw_only=True)
class Packed:
    """Runs as compiled code is given them, one row each, natural units."""

    rows: Rows
    starts: NDArray[np.void]
    durations: Floats

    def __len__(self) -> int:
        return len(self.durations)

    def part(self, part: slice) -> Packed:
        """Some of the runs. The samples stay those of all."""
        rows = self.rows
        return Packed(
            rows=Rows(
                rows.settings[part], rows.horizontal[part], rows.vertical[part], rows.samples
            ),
            starts=self.starts[part],
            durations=self.durations[part],
        )


def pack(scenes: Sequence[Scene], model: Any) -> Packed:
    """Packs a list of scenes; raises `InputError` where the model cannot play one of them."""
    for scene in scenes:
        model.check(scene)
    bases = [natural.base_of(scene) for scene in scenes]
    grounds = [ground for base in bases for ground in base]
    forms = np.array([ground.form for ground in grounds], dtype=FORM)
    forms["first"] = np.cumsum(forms["count"]) - forms["count"]
    return Packed(
        rows=Rows(
            np.array([setting_for(scene, model) for scene in scenes], dtype=SETTING),
            forms[::2].copy(),
            forms[1::2].copy(),
            np.concatenate([np.empty(0), *(ground.samples for ground in grounds)]),
        ),
        starts=np.array([tuple(natural.state_of(scene)) for scene in scenes], dtype=MOTION),
        durations=np.array([scene.duration / natural.time_unit(scene) for scene in scenes]),
    )


def setting_for(scene: Scene, model: Any) -> np.record:
    """Block, floor and walls in natural units, as the model's settings have them."""
    return natural.setting_of(
        scene,
        unilateral=model.pivot == "unilateral",
        no_slip=model.friction == "no-slip",
        energy_cap=model.energy_cap,
        impacts=model.impacts,
        yields=model.yield_displacement / scene.block.radius,
    )


def starts_of(
    packed: Packed,
    model: Any,
    steps: Floats | float,
    most_steps: int,
    until_decided: bool = False,
) -> NDArray[np.void]:
    """The states of runs at their start, with rows of the motion `steps` apart."""
    states = np.zeros(len(packed), STATE)
    states["motion"], states["t_end"] = packed.starts, packed.durations
    states["control"] = filled(
        CONTROL,
        tolerance=model.tolerance,
        most_steps=most_steps,
        most_events=model.most_events,
        until_decided=until_decided,
    )
    states["control"]["output_step"] = steps
    return states


def play(model: Any, rows: Rows, states: NDArray[np.void], records: Records) -> None:
    """Plays runs with the model's friction, in `states`."""
    given = rows, states, workspace(), records
    loop_of(model, *given)(*given)


def loop_of(model: Any, *given: Any) -> Callable[..., None]:
    """The machine code of the event loop with the model's friction, loaded or compiled.

    It is specialised to the types of `given`, which are always the same.
    """
    bouc_wen = model.friction == "bouc-wen"
    if bouc_wen not in _READY:
        _READY[bouc_wen] = for_types_of(march.play_bouc_wen if bouc_wen else march.play, *given)
    return _READY[bouc_wen]
