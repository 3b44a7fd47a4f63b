"""Overturning spectra as a job: the paper's Figs. 6 to 9 and the user's own, in tiles that are kept, on this machine or many.

A spectrum's folder holds `<name>.npz` and `<name>.csv` (outcomes with all settings), `spectra.json` (what there is), and
`tiles/`, where every finished tile waits for the next run. A tile's name contains the hash of everything that its content
depends on: scene, nodes, model, settings, code and libraries.
"""

from __future__ import annotations

import io
import json
import multiprocessing
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from threading import Lock
from typing import Any, Literal, Self, TypeGuard

import numpy as np
from numpy.typing import NDArray

from ebm import EventBasedModel, Spectrum, overturning_spectrum
from ebm.spectrum import LEFT, RIGHT, SAFE, TOLERANCE, Floats, node_scene, play_nodes
from scenes import Block, Floor, InputError, ModelFailure, Ricker, Scene, Wall, kinematics
from validation import provenance
from validation.models import Model, build
from validation.results import Stored, write_whole

FIGURES: dict[int, tuple[Literal["left", "right"], float]] = {6: ("left", 0.3), 7: ("left", 0.6), 8: ("right", 0.3), 9: ("right", 0.6)}
GAPS, RESTITUTIONS = (0.003, 0.053, 0.103), (0.0, 1.0)
BLOCK = Block(half_width=0.397, half_height=1.555)
FREQUENCIES, AMPLITUDES = (0.5, 8.0), (1.0, 12.0)
#: Nodes of a tile of the compiled event-based models.
TILE = 10_000
#: Nodes of a tile of a model that is simulated one by one, and how many of them a process takes at once.
SLOW_TILE, NODES_A_TASK = 100, 5
#: How long (s) a run goes on after the base's motion where its outcome is open then, and the share of the energy of tipping
#: over below which it is not: a hundredth is left to the model's own error.
SETTLE, ENOUGH = 6.0, 0.99
#: Settings of the models in spectra, where they are not their own: outcomes need no more, and take a tenth of the time.
SETTINGS: dict[str, dict[str, Any]] = {
    "ebm": {"tolerance": TOLERANCE},
    "ebm-unilateral": {"tolerance": TOLERANCE},
    "mujoco": {"time_step": "adaptive", "largest_step": 2e-3},
    "pybullet": {"time_step": "adaptive", "largest_step": 2e-3},
}
SPECTRA, TILES = "spectra", "tiles"
#: Results of the long studies of spectra, as they come with the package.
KEPT = Path(str(resources.files("validation"))) / "data" / "spectra"
#: Outcomes in text.
CODES, UNDECIDED = {LEFT: "L", SAFE: ".", RIGHT: "R"}, "?"
_SIDES = {code: side for side, code in CODES.items()}


@dataclass(frozen=True)
class Panel:
    """One spectrum to be played: its scene, and where it stands in the paper (`figure` None: nowhere)."""

    name: str
    title: str
    scene: Scene
    figure: int | None = None

    @property
    def wall(self) -> Wall | None:
        """The wall, or None."""
        return self.scene.walls[0] if self.scene.walls else None


@dataclass(frozen=True)
class Asked:
    """How spectra are to be played: grid, model and settings. Raises `InputError` where that cannot be."""

    frequencies: Floats
    amplitudes: Floats
    model: str = "ebm"
    settings: Mapping[str, Any] = field(default_factory=dict)
    refine: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "settings", {**SETTINGS.get(self.model, {}), **self.settings})
        build(self.model, self.settings)


class SpectrumRecord(Stored):
    """A played spectrum in `spectra.json`; shares are of all nodes."""

    name: str
    title: str
    figure: int | None
    scene: dict[str, Any]
    model: str
    settings: dict[str, Any]
    frequency_ratios: tuple[float, ...]
    amplitude_ratios: tuple[float, ...]
    refined: bool
    evaluations: int
    undecided: int
    safe: float
    left: float
    right: float


class SpectraIndex(Stored):
    """`spectra.json`: what spectra there are in the folder."""

    format: int = 1
    spectra: tuple[SpectrumRecord, ...] = ()


def paper_panels(figure: int) -> tuple[Panel, ...]:
    """The seven spectra of the paper's Fig. 6, 7, 8 or 9: unobstructed, then gap by gap with e = 0 and e = 1."""
    side, friction = FIGURES[figure]
    walls: list[Wall | None] = [None, *(Wall(side=side, gap=gap, restitution=e) for gap in GAPS for e in RESTITUTIONS)]
    return tuple(_paper_panel(figure, friction, wall) for wall in walls)


def _paper_panel(figure: int, friction: float, wall: Wall | None) -> Panel:
    name, title = f"figure-{figure}-unobstructed", "Unobstructed"
    if wall:
        millimetres = round(1000.0 * wall.gap)
        name, title = f"figure-{figure}-gap-{millimetres}-e-{wall.restitution:g}", f"Gap {millimetres} mm, e = {wall.restitution:g}"
    scene = Scene(
        name=name,
        block=BLOCK,
        floor=Floor(friction=friction),
        walls=(wall,) if wall else (),
        excitation=Ricker(amplitude=1.0, period=1.0),
        duration=1.0,
    )
    return Panel(name, title, scene, figure)


def axis(low: float, high: float, size: int, key: str) -> Floats:
    """`size` equally spaced ratios from `low` to `high`; raises `InputError` where they are not finite, positive and in order."""
    if not (np.isfinite(low) and np.isfinite(high) and low > 0.0):
        raise InputError(f"{low:g} to {high:g} is not allowed: positive finite numbers are asked for", key)
    if low >= high:
        raise InputError(f"{low:g} to {high:g} is not allowed: the lower end comes first", key)
    return np.linspace(low, high, size)


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
        size = TILE if _compiled(build(model, settings)) else SLOW_TILE
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
        if _compiled(player):
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
    if _compiled(player):
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


def _compiled(player: Model) -> TypeGuard[EventBasedModel]:
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
    how = provenance.code_digest("ebm.spectrum") if _compiled(build(model, settings)) else [SETTLE, ENOUGH]
    nodes = json.dumps([amplitudes.tolist(), frequencies.tolist(), how])
    return provenance.digest(provenance.cell_key(neutral, model, settings) + provenance.digest(nodes))


def _code() -> str:
    return provenance.code_digest("validation.spectra")


def play_panels(panels: Sequence[Panel], asked: Asked, tiles: Tiles, done: Callable[[Panel], None] | None = None) -> list[Spectrum]:
    """The spectra of the panels, in order; on a cluster all at once, here one after the other on all cores.

    `done` is called when a panel is finished. Raises `InputError`.
    """

    def play(panel: Panel) -> Spectrum:
        spectrum = overturning_spectrum(
            panel.scene,
            asked.frequencies,
            asked.amplitudes,
            refine=asked.refine,
            play=lambda scene, a, f: tiles.play(scene, a, f, model=asked.model, settings=asked.settings),
        )
        if done is not None:
            done(panel)
        return spectrum

    for panel in panels:
        check = getattr(build(asked.model, asked.settings), "check", None)
        if check is not None:
            check(panel.scene)
    if tiles.client is None:
        return [play(panel) for panel in panels]
    with ThreadPoolExecutor(max_workers=len(panels)) as pool:
        return list(pool.map(play, panels))


def warm_up(panel: Panel, asked: Asked) -> None:
    """Load or compile the event-based model's code, by one node of the panel."""
    player = build(asked.model, asked.settings)
    if _compiled(player):
        play_nodes(panel.scene, asked.amplitudes[:1], asked.frequencies[-1:], model=player)


def save(panels: Sequence[Panel], spectra: Sequence[Spectrum], asked: Asked, folder: Path) -> None:
    """Write each spectrum's outcomes with its settings as NPZ and CSV, and note it in the folder's `spectra.json`."""
    records = []
    for panel, spectrum in zip(panels, spectra, strict=True):
        record = SpectrumRecord(
            name=stem(panel.name, asked.model),
            title=panel.title,
            figure=panel.figure,
            scene=_plain_scene(panel.scene),
            model=asked.model,
            settings=dict(asked.settings),
            frequency_ratios=tuple(spectrum.frequency_ratios.tolist()),
            amplitude_ratios=tuple(spectrum.amplitude_ratios.tolist()),
            refined=asked.refine,
            evaluations=spectrum.evaluations,
            undecided=len(spectrum.undecided),
            safe=spectrum.safe_area,
            left=float(np.mean(spectrum.outcomes == LEFT)),
            right=float(np.mean(spectrum.outcomes == RIGHT)),
        )
        about = record.model_dump(exclude={"frequency_ratios", "amplitude_ratios"}) | {"versions": provenance.versions()}
        _write_npz(folder / f"{record.name}.npz", spectrum, json.dumps(about))
        write_whole(folder / f"{record.name}.csv", _csv(spectrum, json.dumps(about)))
        records.append(record)
    index = read_index(folder)
    new = {record.name: record for record in records}
    merged = [*(old for old in index.spectra if old.name not in new), *records]
    whole = SpectraIndex(spectra=tuple(sorted(merged, key=lambda record: record.name)))
    write_whole(folder / "spectra.json", whole.model_dump_json(indent=1) + "\n")


def stem(name: str, model: str) -> str:
    """The name of a spectrum's files: the panel's, and the model's where that is not the paper's."""
    return name if model == "ebm" else f"{name}--{model}"


def read_index(folder: Path) -> SpectraIndex:
    """`spectra.json` of a folder; empty where there is none that this version can read."""
    try:
        return SpectraIndex.model_validate_json((folder / "spectra.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return SpectraIndex()


def _plain_scene(scene: Scene) -> dict[str, Any]:
    """The scene as data, a record's samples left out (its name says which it is)."""
    data = scene.model_dump(mode="json")
    data["excitation"].pop("unscaled", None)
    data["vertical"].pop("unscaled", None)
    return data


def _write_npz(path: Path, spectrum: Spectrum, about: str) -> None:
    content = io.BytesIO()
    np.savez_compressed(
        content,
        outcomes=spectrum.outcomes,
        frequency_ratios=spectrum.frequency_ratios,
        amplitude_ratios=spectrum.amplitude_ratios,
        undecided=spectrum.undecided,
        settings=np.array(about),
    )
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    part.write_bytes(content.getvalue())
    part.replace(path)


def _csv(spectrum: Spectrum, about: str) -> str:
    """One row an amplitude ratio, one column a frequency ratio: -1 overturned left, 0 safe, 1 overturned right."""
    lines = [f"# rockcheck spectrum {about}", "amplitude_ratio\\frequency_ratio," + ",".join(map(repr, spectrum.frequency_ratios.tolist()))]
    rows: Iterable[tuple[float, list[int]]] = zip(spectrum.amplitude_ratios.tolist(), spectrum.outcomes.tolist(), strict=True)
    lines += [f"{amplitude!r}," + ",".join(map(str, row)) for amplitude, row in rows]
    return "\n".join(lines) + "\n"
