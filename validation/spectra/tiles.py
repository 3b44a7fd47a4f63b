"""Spectra played tile by tile: on this machine or on many, each finished tile kept, and read back while nothing it depends on changed.

A tile's name contains the hash of everything that its content depends on: scene, nodes, model, settings, code and libraries.
"""

from __future__ import annotations

import json
import multiprocessing
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import Any, Self, TypeGuard

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.spectrum import LEFT, RIGHT, SAFE, Floats, node_scene, play_nodes
from rockcheck.scenes import InputError, ModelFailure, Scene, kinematics
from rockcheck.scenes.writing import write_whole
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import Model, build

#: Nodes of a tile of the compiled event-based models.
TILE = 10_000
#: Nodes of a tile of a model that is simulated one by one, and how many of them a process takes at once.
SLOW_TILE, NODES_A_TASK = 100, 5
#: How long (s) a run goes on after the base's motion where its outcome is open then, and the share of the energy of tipping
#: over below which it is not: a hundredth is left to the model's own error.
SETTLE, ENOUGH = 6.0, 0.99
#: Outcomes in text.
CODES, UNDECIDED = {LEFT: "L", SAFE: ".", RIGHT: "R"}, "?"
_SIDES = {code: side for side, code in CODES.items()}


@dataclass
class Tiles:
    """Plays the nodes of spectra tile by tile, keeps what is finished in `folder`, and reads it back.

    `jobs` threads or processes of this machine (default all cores), or the workers of `client`. `progress` is called with
    the number of nodes just done.
    """

    folder: Path
    jobs: int | None = None
    client: Any = None
    force: bool = False
    progress: Callable[[int], None] | None = None
    #: Nodes run, and nodes read back.
    played: int = 0
    read_back: int = 0
    _lock: Lock = field(default_factory=Lock, repr=False)
    _pool: ProcessPoolExecutor | None = field(default=None, repr=False)
    _code: str = field(default="", init=False, repr=False)

    def __post_init__(self) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        self._code = _code()

    def play(
        self, scene: Scene, amplitudes: Floats, frequencies: Floats, *, model: str, settings: Mapping[str, Any]
    ) -> tuple[NDArray[np.int8], NDArray[np.bool_]]:
        """Sides and failures of nodes (1-D arrays of one length) by the model of that name, see `ebm.spectrum.play_nodes`."""
        sides, failed = np.zeros(len(amplitudes), dtype=np.int8), np.zeros(len(amplitudes), dtype=bool)
        size = TILE if compiled(build(model, settings)) else SLOW_TILE
        parts = [slice(n, n + size) for n in range(0, len(amplitudes), size)]
        waiting: dict[Any, tuple[slice, str]] = {}
        for part in parts:
            with self._lock:  # Python 3.11 cannot parse source files in several threads at once
                key = tile_key(scene, amplitudes[part], frequencies[part], model, settings)
            kept = None if self.force else self._kept(key, len(amplitudes[part]))
            if kept is not None:
                sides[part], failed[part] = kept
                self._note(len(kept[0]), read_back=True)
            elif self.client is None:
                sides[part], failed[part] = self._keep(key, self._here(scene, amplitudes[part], frequencies[part], model, settings))
            else:
                future = self.client.submit(
                    play_tile, scene, amplitudes[part], frequencies[part], model, dict(settings), key=f"tile-{key}", pure=False
                )
                waiting[future] = part, key
        for future, (part, key) in waiting.items():
            found, code = self._gathered(future)
            if code != self._code:
                raise InputError("a worker of the cluster runs another version of rockcheck", "--scheduler")
            sides[part], failed[part] = self._keep(key, found)
            self._report(len(found[0]))
        return sides, failed

    def _here(
        self, scene: Scene, amplitudes: Floats, frequencies: Floats, model: str, settings: Mapping[str, Any]
    ) -> tuple[NDArray[np.int8], NDArray[np.bool_]]:
        player = build(model, settings)
        if compiled(player):
            return play_nodes(scene, amplitudes, frequencies, model=player, jobs=self.jobs, progress=self._report)
        parts = [slice(n, n + NODES_A_TASK) for n in range(0, len(amplitudes), NODES_A_TASK)]
        pool = self._processes()
        futures = {pool.submit(play_tile, scene, amplitudes[part], frequencies[part], model, dict(settings)): part for part in parts}
        sides, failed = np.zeros(len(amplitudes), dtype=np.int8), np.zeros(len(amplitudes), dtype=bool)
        try:
            for future in as_completed(futures):
                part = futures[future]
                (sides[part], failed[part]), _ = future.result()
                self._report(len(amplitudes[part]))
        except BrokenProcessPool:
            raise ModelFailure(f"{model}: its process died; what was finished is kept") from None
        return sides, failed

    def _processes(self) -> ProcessPoolExecutor:
        if self._pool is None:
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(self.jobs or os.cpu_count(), mp_context=context, initializer=_mute)
        return self._pool

    def close(self) -> None:
        """End the processes, if there are any; what waits for them is dropped."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
            self._pool = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *fault: object) -> None:
        self.close()

    def _gathered(self, future: Any) -> Any:
        from distributed.scheduler import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            raise ModelFailure(f"the cluster's workers die of a tile: {error}") from None

    def _keep(self, key: str, found: tuple[NDArray[np.int8], NDArray[np.bool_]]) -> tuple[NDArray[np.int8], NDArray[np.bool_]]:
        sides, failed = found
        text = "".join(UNDECIDED if fault else CODES[int(side)] for side, fault in zip(sides, failed, strict=True))
        write_whole(self.folder / f"{key}.tile", text)
        self._note(len(sides), read_back=False)
        return sides, failed

    def _kept(self, key: str, count: int) -> tuple[NDArray[np.int8], NDArray[np.bool_]] | None:
        try:
            text = (self.folder / f"{key}.tile").read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            return None
        if len(text) != count or set(text) - {*_SIDES, UNDECIDED}:
            return None
        return np.array([_SIDES.get(code, SAFE) for code in text], dtype=np.int8), np.array([code == UNDECIDED for code in text])

    def _note(self, count: int, *, read_back: bool) -> None:
        with self._lock:
            self.played += 0 if read_back else count
            self.read_back += count if read_back else 0
        if read_back:
            self._report(count)

    def _report(self, count: int) -> None:
        if self.progress is not None:
            with self._lock:
                self.progress(count)


def play_tile(
    scene: Scene, amplitudes: Floats, frequencies: Floats, model: str, settings: Mapping[str, Any]
) -> tuple[tuple[NDArray[np.int8], NDArray[np.bool_]], str]:
    """A tile on one core of a worker: its outcomes (see `Tiles.play`), and the hash of the code that played it."""
    player = build(model, settings)
    if compiled(player):
        return play_nodes(scene, amplitudes, frequencies, model=player, jobs=1), _code()
    sides, failed = np.zeros(len(amplitudes), dtype=np.int8), np.zeros(len(amplitudes), dtype=bool)
    for n, (a, f) in enumerate(zip(amplitudes, frequencies, strict=True)):
        try:
            sides[n] = _side(player, scene, float(a), float(f))
        except ModelFailure:
            failed[n] = True
    return (sides, failed), _code()


def _side(player: Model, scene: Scene, amplitude: float, frequency: float) -> int:
    """The outcome at one node.

    A block that has not tipped past its balance when the base comes to rest, and has too little energy left to do so, is safe.
    Any other run is made again and goes on for `SETTLE` s; what then stands is safe.
    """
    for settle in (0.0, SETTLE):
        node = node_scene(scene, amplitude, frequency, settle).replace(output_step=0.02)  # few rows: only the outcome is asked
        history = player.simulate(node)
        theta, y, *rates = (history.channels[name][-1] for name in ("theta", "y", "x_dot", "y_dot", "theta_dot"))
        needed = node.gravity * (node.block.radius - node.block.half_height)
        weak = kinematics.energy(node.block, node.gravity, y, *rates) < ENOUGH * needed
        if history.outcome.startswith("overturned") or (weak and abs(theta) < node.block.alpha):
            break
    return side_of(history.outcome)


def compiled(player: Model) -> TypeGuard[EventBasedModel]:
    """Whether the model plays whole batches compiled."""
    return isinstance(player, EventBasedModel) and player.friction != "bouc-wen"


def _mute() -> None:
    """Send this process's standard output nowhere: engines greet there, and it is the run's."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def side_of(outcome: str) -> int:
    """-1 overturned left, +1 overturned right, 0 otherwise."""
    return {"overturned left": LEFT, "overturned right": RIGHT}.get(outcome, SAFE)


def tile_key(scene: Scene, amplitudes: Floats, frequencies: Floats, model: str, settings: Mapping[str, Any]) -> str:
    """Hash of all that a tile's outcomes depend on."""
    neutral = scene.replace(name="tile", description="", duration=1.0, output_step=0.02)
    how = provenance.code_digest("rockcheck.ebm.spectrum") if compiled(build(model, settings)) else [SETTLE, ENOUGH]
    nodes = json.dumps([amplitudes.tolist(), frequencies.tolist(), how])
    return provenance.digest(provenance.cell_key(neutral, model, settings) + provenance.digest(nodes))


def _code() -> str:
    return provenance.code_digest("rockcheck.validation.spectra.tiles")
