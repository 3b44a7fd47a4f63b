"""Who takes part: engines that are installed, models of the user's own, and folders of histories written elsewhere."""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rockcheck.scenes import History, InputError, ModelFailure, Scene
from rockcheck.scenes.errors import printable
from rockcheck.scenes.files import read_toml
from rockcheck.scenes.progress import OnProgress, unheard
from rockcheck.validation.conformance.cards import Card, make_card
from rockcheck.validation.conformance.phenomena import SCENES
from rockcheck.validation.discrepancy.measured import Measured
from rockcheck.validation.execute.models import build_own, engine_names, family, is_own, not_installed
from rockcheck.validation.execute.pool import Call, Pool
from rockcheck.validation.execute.provenance import version_of

#: What a folder of histories says of itself.
ABOUT = "engine.toml"


@dataclass(frozen=True)
class Asked:
    """An engine with one kind of settings ("best", "default", or "" where it has no such choice) at one step, s."""

    engine: str
    settings: str
    step: float


def engines_here() -> list[str]:
    """Names of the engines that are installed."""
    return [name for name in engine_names() if not not_installed(name)]


def slug_of(scene: str) -> str:
    """The name of a scene's files."""
    return "".join(c if c.isalnum() or c == "." else "-" for c in scene).replace("--", "-")


def card_of(asked: Asked, on_progress: OnProgress) -> Card:
    """The card of an engine by name, or of a model of the user's own by "module:Class"."""
    settings: dict[str, Any] = {"time_step": asked.step} | ({"settings": asked.settings} if asked.settings else {})
    model: Any = build_own(asked.engine, settings)
    kind = family(asked.engine)
    version = str(getattr(model, "version", "")) if is_own(asked.engine) else version_of(kind.libraries[0])
    lacks: Iterable[str] = model.lacks() if hasattr(model, "lacks") else ()
    done = 0

    def on_scene(name: str) -> None:
        nonlocal done
        on_progress(done, len(SCENES), f"{asked.engine}, {name}")
        done += 1

    about: dict[str, Any] = {"engine": asked.engine, "version": version, "settings": asked.settings, "step": asked.step}
    return make_card(model.simulate, lacks=lacks, on_scene=on_scene, **about)


def card_of_own(asked: Asked, folder: str) -> Card:
    """The card of a model of the user's own that may lie in `folder`, by a process that imports its code."""
    with Pool(1) as pool:
        (ended,) = pool.run(deque([Call(_card_apart, (asked, folder))]))
    if ended.error is not None:
        raise ended.error if isinstance(ended.error, InputError | ModelFailure) else ModelFailure(f"{asked.engine}: {ended.fault}")
    card: Card = ended.result
    return card


def _card_apart(asked: Asked, folder: str) -> Card:
    sys.path.append(folder)
    return card_of(asked, unheard)


def card_of_histories(folder: Path) -> Card:
    """The card of a folder with a CSV for each scene, and an `engine.toml` that says whose they are."""
    path = folder / ABOUT
    about = read_toml(path)
    allowed = {"engine": str, "version": str, "settings": str, "step": float, "lacks": list}
    for key, value in about.items():
        if key not in allowed or not isinstance(value, allowed[key]):
            raise InputError(f"{printable(value)} is not allowed; allowed: {', '.join(allowed)}", f"{printable(path)}: {printable(key)}")
    if "engine" not in about:
        raise InputError("is missing", f"{printable(path)}: engine")
    lacks: Sequence[str] = about.pop("lacks", [])
    measured = Measured(files={name: str(folder / f"{slug_of(name)}.csv") for name in SCENES})

    def play(scene: Scene) -> History:
        return measured.simulate(scene)

    return make_card(play, lacks=lacks, **{"version": "", "settings": "", "step": 0.0, **about})
