"""Validation harness for rocking-block models: simulate one scene with several models, compare
them, judge them.

All public names can be imported from here; each is loaded when it is first used, so that `import
rockcheck` costs next to nothing. The parts lie in `rockcheck.scenes`, `rockcheck.ebm`,
`rockcheck.cm`, `rockcheck.engines`, `rockcheck.validation` and `rockcheck.reports`.
"""

from __future__ import annotations

import importlib
import os
from typing import TYPE_CHECKING, Any

if os.path.isfile(
    os.path.join(os.path.dirname(__file__), "scenes")
):  # what git writes where it may make no links
    raise ImportError(
        "rockcheck/scenes is no link to scenes/: git config core.symlinks true, then check out"
        " again"
    )

if TYPE_CHECKING:
    from rockcheck.cm import ContinuousModel, measured_restitution
    from rockcheck.ebm import (
        EventBasedModel,
        Spectrum,
        overturning_spectrum,
        predictability_horizon,
    )
    from rockcheck.engines import Box2D, Dart, Drake, Jolt, MuJoCo, PhysX, PyBullet, Pymunk
    from rockcheck.scenes import (
        Block,
        Cost,
        Event,
        Floor,
        History,
        InputError,
        ModelFailure,
        Record,
        Rest,
        Ricker,
        Scene,
        Sine,
        Wall,
        load_scene,
        named_scenes,
    )
    from rockcheck.validation import Discrepancy, compare

#: Where each public name comes from.
_HOMES = {
    "rockcheck.scenes": (
        "Block",
        "Cost",
        "Event",
        "Floor",
        "History",
        "InputError",
        "ModelFailure",
        "Record",
        "Rest",
        "Ricker",
        "Scene",
        "Sine",
        "Wall",
        "load_scene",
        "named_scenes",
    ),
    "rockcheck.ebm": (
        "EventBasedModel",
        "Spectrum",
        "overturning_spectrum",
        "predictability_horizon",
    ),
    "rockcheck.cm": ("ContinuousModel", "measured_restitution"),
    "rockcheck.engines": (
        "Box2D",
        "Dart",
        "Drake",
        "Jolt",
        "MuJoCo",
        "PhysX",
        "PyBullet",
        "Pymunk",
    ),
    "rockcheck.validation": ("Discrepancy", "compare"),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [  # noqa: RUF022 - in the order of the table above, which a test holds it against
    "Block",
    "Cost",
    "Event",
    "Floor",
    "History",
    "InputError",
    "ModelFailure",
    "Record",
    "Rest",
    "Ricker",
    "Scene",
    "Sine",
    "Wall",
    "load_scene",
    "named_scenes",
    "EventBasedModel",
    "Spectrum",
    "overturning_spectrum",
    "predictability_horizon",
    "ContinuousModel",
    "measured_restitution",
    "Box2D",
    "Dart",
    "Drake",
    "Jolt",
    "MuJoCo",
    "PhysX",
    "PyBullet",
    "Pymunk",
    "Discrepancy",
    "compare",
    "__version__",
]


def __getattr__(name: str) -> Any:
    """A public name, imported on its first use (PEP 562)."""
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("rockcheck")
    elif name in _HOME:
        value = getattr(importlib.import_module(_HOME[name]), name)
    else:
        raise AttributeError(f"module 'rockcheck' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
