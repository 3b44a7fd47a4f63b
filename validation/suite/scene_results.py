"""Results on a scene that serve all its cells: computed once, and kept in the store.

In: a store and a scene. Out: its landing at which the laws of impacts part, its horizon of
predictability, and the effect of uncertain inputs on its figures. `runs` calls
the first two, `runner` the last.
"""

from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

from rockcheck.ebm import horizon, predictability_horizon
from rockcheck.scenes import InputError, ModelFailure, Scene, files
from rockcheck.validation.discrepancy import impact_laws
from rockcheck.validation.execute import models, provenance
from rockcheck.validation.execute.store import COMPARISONS, Store, name_of
from rockcheck.validation.suite import tolerances
from rockcheck.validation.uncertainty import input_spread

T = TypeVar("T")


def landing_of(store: Store, scene: Scene) -> impact_laws.Landing | None:
    """The first landing of a scene at which the laws of impacts part, None without one."""
    if not horizon.may_fly(scene):
        return None

    def landing() -> impact_laws.Landing | None:
        with suppress(InputError, ModelFailure):  # it is not a scene for that model
            return impact_laws.parting_landing(scene)
        return None

    module = impact_laws.__name__
    return _kept(store, scene, "impact-laws", module, impact_laws.Landing | None, landing)


def horizon_of(store: Store, scene: Scene) -> float:
    """The time (s) up to which histories of a scene can be compared point by point."""

    def computed() -> float:
        return predictability_horizon(scene)

    return _kept(store, scene, tolerances.HORIZON, horizon.__name__, float, computed)


def input_effects_of(store: Store, uncertain: files.UncertainScene) -> input_spread.Inputs:
    """The effect of the spread of a scene's inputs on its figures."""

    def propagated() -> input_spread.Inputs:
        return input_spread.propagate(uncertain)

    return _kept(
        store,
        uncertain.scene,
        "inputs",
        input_spread.__name__,
        input_spread.Inputs,
        propagated,
        spreads={key: spread.model_dump() for key, spread in uncertain.spreads.items()},
        correlation=uncertain.correlation.tolist(),
    )


def _kept(
    store: Store,
    scene: Scene,
    name: str,
    module: str,
    result_type: Any,
    compute: Callable[[], T],
    **inputs: Any,
) -> T:
    """The kept result of that name; it depends on scene, `inputs` and the code of `module`."""
    depends = {"of": name, "code": provenance.code_digest(module), **inputs}
    key = provenance.cell_key(scene, models.REFERENCE, depends)
    return store.once(COMPARISONS, name_of(scene.name, name, key), result_type, compute)
