"""Spectra played tile by tile: on this machine or on many, each finished tile kept, and read back while nothing it depends on changed.

A tile's name contains the hash of everything that its content depends on: scene, nodes, model, settings, code and libraries.
"""

from __future__ import annotations

import json
import os
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import spectrum
from rockcheck.ebm.spectrum import LEFT, RIGHT, SAFE, Floats, node_scene, play_nodes
from rockcheck.scenes import InputError, ModelFailure, Scene
from rockcheck.scenes.progress import Count
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import build
from rockcheck.validation.execute.pool import Call, Pool
from rockcheck.validation.execute.store import TILES, Store
from rockcheck.validation.uncertainty.population import ENOUGH, SETTLE, compiled, play

#: Nodes of a tile of the compiled event-based models.
TILE = 10_000
#: Nodes of a tile of a model that is simulated one by one, and how many of them a process takes at once.
SLOW_TILE, NODES_A_CALL = 100, 5
#: Outcomes in text.
CODES, UNDECIDED = {LEFT: "L", SAFE: ".", RIGHT: "R"}, "?"
_SIDES = {code: side for side, code in CODES.items()}


Outcomes = tuple[NDArray[np.int8], NDArray[np.bool_]]


@dataclass
class Tiles:
    """Plays the nodes of spectra tile by tile, keeps what is finished in `folder`/tiles, and reads it back.

    `jobs` threads or processes of this machine (default all cores), or the workers of `client`. `count` adds up the nodes done.
    A context: in the end its processes end, and what waits for them is dropped.
    """

    folder: Path
    jobs: int | None = None
    client: Any = None
    force: bool = False
    count: Count = field(default_factory=Count)
    #: Nodes run, and nodes read back.
    played: int = 0
    read_back: int = 0
    #: Wall time and this process's CPU time in which compiled models ran nodes here, s; to load or compile their code is not in them.
    seconds: float = 0.0
    cpu: float = 0.0
    _lock: Lock = field(default_factory=Lock, init=False, repr=False)
    _open: ExitStack = field(default_factory=ExitStack, init=False, repr=False)
    _pool: Pool | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        self._store = Store(self.folder, (TILES,))
        self._code = _code()

    def play(self, scene: Scene, amplitudes: Floats, frequencies: Floats, *, model: str, settings: Mapping[str, Any]) -> Outcomes:
        """Sides and failures of nodes (1-D arrays of one length) by the model of that name, see `ebm.spectrum.play_nodes`."""
        sides, failed = np.zeros(len(amplitudes), dtype=np.int8), np.zeros(len(amplitudes), dtype=bool)
        size = TILE if compiled(build(model, settings)) else SLOW_TILE
        waiting: dict[Any, tuple[slice, str]] = {}
        for part in _slices(len(amplitudes), size):
            nodes = scene, amplitudes[part], frequencies[part], model, dict(settings)
            with self._lock:  # Python 3.11 cannot parse source files in several threads at once
                key = tile_key(*nodes)
            kept = None if self.force else self._kept(key, len(amplitudes[part]))
            if kept is not None:
                sides[part], failed[part] = kept
            elif self.client is None:
                sides[part], failed[part] = self._keep(key, self._here(*nodes))
            else:
                waiting[self.client.submit(play_tile, *nodes, key=f"tile-{key}", pure=False)] = part, key
        for future, (part, key) in waiting.items():
            found, code = self._gathered(future)
            if code != self._code:
                raise InputError("a worker of the cluster runs another version of rockcheck", "--scheduler")
            sides[part], failed[part] = self._keep(key, found)
            self.count.add(len(found[0]))
        return sides, failed

    def remembered(self, key: str, find: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """What was kept under that key, found and kept where there is nothing; `key` covers all that it depends on."""
        kept = None if self.force else self._store.get_record(TILES, key)
        if kept is None:
            kept = find()
            self._store.put_record(TILES, key, kept)
        return kept

    def _here(self, scene: Scene, amplitudes: Floats, frequencies: Floats, model: str, settings: Mapping[str, Any]) -> Outcomes:
        player = build(model, settings)
        if compiled(player):
            if not self.seconds:
                spectrum.play_nodes(scene, amplitudes[:1], frequencies[-1:], model=player, jobs=1)  # loads or compiles
            began, cpu = time.perf_counter(), time.process_time()
            found = play_nodes(scene, amplitudes, frequencies, model=player, jobs=self.jobs, on_progress=self.count.part())
            self.seconds += time.perf_counter() - began
            self.cpu += time.process_time() - cpu
            return found
        if self._pool is None:
            self._pool = self._open.enter_context(Pool(self.jobs or os.cpu_count() or 1))
        parts = _slices(len(amplitudes), NODES_A_CALL)
        calls = (Call(play_tile, (scene, amplitudes[part], frequencies[part], model, settings), key=part) for part in parts)
        sides, failed = np.zeros(len(amplitudes), dtype=np.int8), np.zeros(len(amplitudes), dtype=bool)
        for ended in self._pool.run(deque(calls)):
            if ended.error is not None:
                own = isinstance(ended.error, InputError | ModelFailure) or ended.unexpected
                raise ended.error if own else ModelFailure(f"{model}: {ended.fault}; what was finished is kept")
            (sides[ended.call.key], failed[ended.call.key]), _ = ended.result
            self.count.add(len(amplitudes[ended.call.key]))
        return sides, failed

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *fault: Any) -> None:
        self._pool = None
        self._open.__exit__(*fault)

    def _gathered(self, future: Any) -> Any:
        from distributed.scheduler import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            raise ModelFailure(f"a worker of the cluster died on every attempt at a tile: {error}") from None

    def _keep(self, key: str, found: Outcomes) -> Outcomes:
        text = "".join(UNDECIDED if fault else CODES[int(side)] for side, fault in zip(*found, strict=True))
        self._store.put_record(TILES, key, {"outcomes": text})
        with self._lock:
            self.played += len(text)
        return found

    def _kept(self, key: str, count: int) -> Outcomes | None:
        text = (self._store.get_record(TILES, key) or {}).get("outcomes")
        if not isinstance(text, str) or len(text) != count or set(text) - {*_SIDES, UNDECIDED}:
            return None
        with self._lock:
            self.read_back += count
        self.count.add(count)
        return np.array([_SIDES.get(code, SAFE) for code in text], dtype=np.int8), np.array([code == UNDECIDED for code in text])


def _slices(count: int, size: int) -> list[slice]:
    """`count` things in parts of at most `size`."""
    return [slice(n, n + size) for n in range(0, count, size)]


def play_tile(scene: Scene, amplitudes: Floats, frequencies: Floats, model: str, settings: Mapping[str, Any]) -> tuple[Outcomes, str]:
    """A tile on one core of a worker: its outcomes (see `Tiles.play`), and the hash of the code that played it."""
    player = build(model, settings)
    if compiled(player):
        return play_nodes(scene, amplitudes, frequencies, model=player, jobs=1), _code()
    scenes = [node_scene(scene, float(a), float(f)) for a, f in zip(amplitudes, frequencies, strict=True)]
    runs = play(scenes, player)
    return (np.array(runs.side, dtype=np.int8), np.array(runs.failed)), _code()


def tile_key(scene: Scene, amplitudes: Floats, frequencies: Floats, model: str, settings: Mapping[str, Any]) -> str:
    """Hash of all that a tile's outcomes depend on."""
    neutral = scene.replace(name="tile", description="", duration=1.0, output_step=0.02)
    how = provenance.code_digest("rockcheck.ebm.spectrum") if compiled(build(model, settings)) else [SETTLE, ENOUGH]
    nodes = json.dumps([amplitudes.tolist(), frequencies.tolist(), how])
    return provenance.digest(provenance.cell_key(neutral, model, settings) + provenance.digest(nodes))


def _code() -> str:
    return provenance.code_digest("rockcheck.validation.spectra.tiles")
