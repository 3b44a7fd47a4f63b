"""Runs as compiled code takes them: scenes packed into arrays of records, a row a run.

Here is also the event loop that plays them. `EventBasedModel`, which plays a history by this, is
known here by its settings only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import natural
from rockcheck.ebm.core import block, march, names
from rockcheck.ebm.core.ground import FORM
from rockcheck.ebm.core.state import MOTION, STATE, Rows
from rockcheck.scenes import Floats, Scene, progress
from rockcheck.scenes.compiled import for_types_of, interpreted, is_ready

#: The event loops that are compiled, by a model's friction.
_READY: dict[str, Callable[..., None]] = {}


def pack(scenes: Sequence[Scene], model: Any) -> Rows:
    """Packs a list of scenes; raises `InputError` where the model cannot play one of them."""
    for scene in scenes:
        model.check(scene)
    bases = [natural.base_of(scene) for scene in scenes]
    grounds = [ground for base in bases for ground in base]
    forms = np.array([ground.form for ground in grounds], dtype=FORM)
    forms["first"] = np.cumsum(forms["count"]) - forms["count"]
    units = np.array([natural.time_unit(scene) for scene in scenes])
    return Rows(
        settings=np.array(
            [natural.setting_of(scene, model) for scene in scenes], dtype=block.SETTING
        ),
        horizontal=forms[::2].copy(),
        vertical=forms[1::2].copy(),
        starts=np.array([tuple(natural.state_of(scene).tolist()) for scene in scenes], MOTION),
        durations=np.array([scene.duration for scene in scenes]) / units,
        output_steps=np.array([scene.output_step for scene in scenes]) / units,
        samples=np.concatenate([np.empty(0), *(ground.samples for ground in grounds)]),
    )


def pack_pulses(scene: Scene, model: Any, amplitudes: Floats, periods: Floats) -> Rows:
    """Packs one scene under many pulses of its own kind.

    `amplitudes` (m/s^2) and `periods` (s) are 1-D arrays of one length.
    """
    model.check(scene)
    unit, count = natural.time_unit(scene), len(amplitudes)
    template = type(scene.excitation)
    pulse = scene.excitation.model_copy(update={"amplitude": 1.0, "period": 1.0})
    one = natural.base_of(scene.replace(excitation=template(**pulse.model_dump()))).horizontal
    # A pulse of amplitude a and period T is a times the unit pulse at time t/T.
    ratio = 1.0 / periods
    horizontal = np.full(count, one.form, dtype=FORM)
    for power in range(4):
        horizontal[f"c{power}"] *= amplitudes * (
            ratio**power if one.form.kind == names.Shape.GAUSSIAN else 1.0
        )
    horizontal["rate"] *= ratio**2 if one.form.kind == names.Shape.GAUSSIAN else ratio
    horizontal["centre"] *= periods
    horizontal["quiet"] *= periods
    still = natural.base_of(scene).vertical
    return Rows(
        settings=np.full(count, natural.setting_of(scene, model), dtype=block.SETTING),
        horizontal=horizontal,
        vertical=np.full(count, still.form, dtype=FORM),
        starts=np.full(count, np.array(tuple(natural.state_of(scene)), dtype=MOTION)),
        durations=np.full(count, scene.duration / unit),
        output_steps=np.full(count, scene.output_step / unit),
        samples=still.samples,
    )


def state_for(model: Any, most_steps: int, until_decided: bool = False) -> NDArray[np.void]:
    """An array of one state, with what the model's settings ask of a run."""
    states = np.zeros(1, STATE)
    states["control"] = model.tolerance, most_steps, model.most_events, until_decided, 0.0
    return states


def loop_of(model: Any, *given: Any) -> Callable[..., None]:
    """The machine code of the event loop with the model's friction, loaded or compiled.

    It is specialised to the types of `given`, which are always the same.
    """
    if model.friction not in _READY:
        _READY[model.friction] = for_types_of(march.LOOPS[model.friction], *given)
    return _READY[model.friction]


def interpreted_loop(model: Any, *given: Any) -> Callable[..., None] | None:
    """The event loop for a single run that need not wait for the compiler; None where it must.

    It need not if the loop is not compiled yet. Bouc-Wen friction, which is stiff, takes too many
    steps.
    """
    loop = march.LOOPS[model.friction]
    if not progress.ONE_RUN.get() or model.friction == "bouc-wen" or is_ready(loop, *given):
        return None
    progress.announce(
        f"{model.name} is not compiled for this machine yet: a short run is interpreted, with the"
        " same figures (`rockcheck warm` compiles)"
    )
    return interpreted(loop)
