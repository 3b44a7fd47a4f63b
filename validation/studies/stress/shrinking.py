"""The smallest scene that still shows a failure: fields are dropped or rounded as long as it
stays."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from typing import Any

import tomlkit

from rockcheck.scenes import InputError, Record, Rest, Scene

Shows = Callable[[Scene], bool]
#: Most scenes that are tried.
MOST_TRIALS = 400


def shrink(
    scene: Scene,
    shows: Shows,
    *,
    trials: int = MOST_TRIALS,
    seconds: float = math.inf,
) -> tuple[Scene, bool]:
    """A scene that `shows` the failure as `scene` does, and from which no single simplification can
    be taken without losing it.

    Ends after so many `trials` or `seconds` with what it has then; the second value is then false.
    """
    until = time.monotonic() + seconds
    again = True
    while again:
        again = False
        for simpler in simplifications(scene):
            if trials == 0 or time.monotonic() > until:
                return scene, False
            trials -= 1
            if shows(simpler):
                scene, again = simpler, True
                break
    return scene, True


def simplifications(scene: Scene) -> Iterator[Scene]:
    """Valid scenes that are simpler in one respect, the greatest simplification first."""
    for change in _changes(scene):
        try:
            simpler = scene.replace(
                **{key: _changed(getattr(scene, key), value) for key, value in change.items()}
            )
        except InputError:
            continue
        if simpler != scene:
            yield simpler


def _changed(part: Any, change: Any) -> Any:
    return part.replace(**change) if isinstance(change, dict) else change


def _changes(scene: Scene) -> Iterator[dict[str, Any]]:
    """New values of the scene's fields; a dictionary has new values of fields of that part of
    it."""
    yield from _without(scene)
    yield from _plainer_contacts(scene)
    unit = math.sqrt(scene.block.radius / scene.gravity)
    for factor in (0.25, 0.5, 0.9):
        if factor * scene.duration > 0.01 * unit:
            yield {"duration": factor * scene.duration, "output_step": factor * scene.output_step}
    for key in ("excitation", "vertical"):
        excitation = getattr(scene, key)
        if isinstance(excitation, Record):
            for samples in _shorter(excitation.unscaled):
                yield {key: {"unscaled": samples}}
    radius = scene.block.radius
    if not 0.5 < radius < 2.0:  # rounding would change it again
        yield {"block": scene.block.scaled(1.0 / radius)}
    if scene.gravity != 9.81:
        yield {"gravity": 9.81}
    yield from _rounded(scene)


def _without(scene: Scene) -> Iterator[dict[str, Any]]:
    """A base motion, a wall, a part of the initial state or of what a load does less."""
    for key in ("vertical", "excitation"):
        if getattr(scene, key).kind != "rest":
            yield {key: Rest()}
    for n in range(len(scene.walls)):
        yield {"walls": scene.walls[:n] + scene.walls[n + 1 :]}
    for key in (
        "initial_height",
        "initial_velocity",
        "initial_angular_velocity",
        "initial_rotation",
    ):
        if getattr(scene, key) != 0.0:
            yield {key: 0.0}
    x, z = scene.block.offset
    yield {"block": {"centre_of_mass": None, "moment_of_inertia": None}}
    yield {"block": {"moment_of_inertia": None}}
    yield from ({"block": {"centre_of_mass": centre}} for centre in ((0.0, z), (x, 0.0)))


def _plainer_contacts(scene: Scene) -> Iterator[dict[str, Any]]:
    """No restitution, one coefficient of friction, no gap."""
    floor = scene.floor
    if floor.restitution > 0.0:
        yield {"floor": {"restitution": 0.0}}
    if floor.static_friction is not None:
        yield {"floor": {"static_friction": None}}
    for n, wall in enumerate(scene.walls):
        for change in ({"restitution": 0.0}, {"gap": 0.0}):
            yield {"walls": (*scene.walls[:n], wall.replace(**change), *scene.walls[n + 1 :])}


def _shorter(samples: tuple[float, ...]) -> Iterator[tuple[float, ...]]:
    half = len(samples) // 2
    if half:
        yield samples[:half]
        yield samples[:-1]
    if 8 >= len(samples) > 1:
        for n in range(len(samples)):
            yield (*samples[:n], 0.0, *samples[n + 1 :])


def _rounded(scene: Scene) -> Iterator[dict[str, Any]]:
    """One number with fewer digits."""
    for digits in (1, 2, 4, 8):
        for key in (
            "duration",
            "gravity",
            "initial_rotation",
            "initial_angular_velocity",
            "initial_velocity",
            "initial_height",
        ):
            if (key, getattr(scene, key)) != ("gravity", 9.81):
                yield {key: _digits(getattr(scene, key), digits)}
        for key in ("block", "floor", "excitation", "vertical"):
            part = getattr(scene, key)
            for name, value in part:
                if isinstance(value, float):
                    yield {key: {name: _digits(value, digits)}}
                elif isinstance(value, tuple) and len(value) <= 8:
                    yield {key: {name: tuple(_digits(one, digits) for one in value)}}
        for n, wall in enumerate(scene.walls):
            for name in ("gap", "restitution"):
                change = {name: _digits(getattr(wall, name), digits)}
                yield {"walls": (*scene.walls[:n], wall.replace(**change), *scene.walls[n + 1 :])}


def _digits(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def scene_text(scene: Scene, remarks: str) -> str:
    """A scene file that `load_scene` reads back to the bit (samples stand in the file itself), with
    remarks on top."""
    tables: dict[str, Any] = scene.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    for key in ("excitation", "vertical"):
        if key in tables:
            tables[key] = {"kind": getattr(scene, key).kind} | tables[key]
    tables.pop("name", None)  # the file's own
    plain = {key: value for key, value in tables.items() if not isinstance(value, dict | list)}
    lines = "".join(f"# {line}\n" for line in remarks.splitlines())
    return lines + tomlkit.dumps(
        plain | {key: value for key, value in tables.items() if key not in plain}
    )
