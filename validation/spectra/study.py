"""Overturning spectra as a job: the paper's Figs. 6 to 9 and the user's own, in tiles that are kept, on this machine or many.

A spectrum's folder holds `<name>.npz` and `<name>.csv` (outcomes with all settings), `spectra.json` (what there is), and
`tiles/` (validation.spectra.tiles), where every finished tile waits for the next run.
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import StringConstraints

from rockcheck.ebm import EventBasedModel, Spectrum, overturning_spectrum
from rockcheck.ebm.horizon import may_fly, other_laws
from rockcheck.ebm.spectrum import LEFT, RIGHT, TOLERANCE, Floats
from rockcheck.scenes import Floor, InputError, Ricker, Scene, Wall
from rockcheck.scenes.reading import read_arrays, read_json, within
from rockcheck.scenes.scene import PAPER_BLOCK
from rockcheck.scenes.threads import threads
from rockcheck.scenes.writing import table_text, write_whole
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import build
from rockcheck.validation.spectra.histories import glimpses, glimpses_path, kept, save_glimpses
from rockcheck.validation.spectra.tiles import Tiles, tile_key
from rockcheck.validation.uncertainty.population import compiled

FIGURES: dict[int, tuple[Literal["left", "right"], float]] = {6: ("left", 0.3), 7: ("left", 0.6), 8: ("right", 0.3), 9: ("right", 0.6)}
GAPS, RESTITUTIONS = (0.003, 0.053, 0.103), (0.0, 1.0)
FREQUENCIES, AMPLITUDES = (0.5, 8.0), (1.0, 12.0)
#: Settings of the models in spectra, where they are not their own: outcomes need no more, and take a tenth of the time.
SETTINGS: dict[str, dict[str, Any]] = {
    "ebm": {"tolerance": TOLERANCE},
    "ebm-unilateral": {"tolerance": TOLERANCE},
    **{engine: {"time_step": "adaptive", "largest_step": 2e-3} for engine in ("mujoco", "pybullet", "pymunk")},
    "dart": {"time_step": "adaptive", "largest_step": 4e-3},
    "drake": {"time_step": 1e-3},
}
SPECTRA = "spectra"
#: Results of the long studies of spectra, as they come with the package.
KEPT = Path(str(resources.files("rockcheck.validation"))) / "data" / "spectra"


#: A part of the name of a file: a list of spectra that somebody sent names none in another folder.
FileName = Annotated[str, StringConstraints(pattern=r"^[^/\\\x00]+$")]


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
class SpectrumRequest:
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

    name: FileName
    title: str
    figure: int | None
    scene: dict[str, Any]
    model: FileName
    settings: dict[str, Any]
    frequency_ratios: tuple[float, ...]
    amplitude_ratios: tuple[float, ...]
    refined: bool
    evaluations: int
    undecided: int
    safe: float
    left: float
    right: float
    #: How many nodes have another outcome under another law of impacts; None where that was not looked at.
    depends_on_law: int | None = None


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
        block=PAPER_BLOCK,
        floor=Floor(friction=friction),
        walls=(wall,) if wall else (),
        excitation=Ricker(amplitude=1.0, period=1.0),
        duration=1.0,
    )
    return Panel(name, title, scene, figure)


def axis(low: float, high: float, size: int, key: str) -> Floats:
    """`size` equally spaced ratios from `low` to `high`; raises `InputError` where they are not finite, positive and in order."""
    if not (np.isfinite(low) and np.isfinite(high) and low > 0.0):
        raise InputError(f"{low:g} to {high:g} is not allowed: give positive finite numbers", key)
    if low >= high:
        raise InputError(f"{low:g} to {high:g} is not allowed: the lower end comes first", key)
    return np.linspace(low, high, size)


def other_settings(panel: Panel, request: SpectrumRequest) -> list[dict[str, Any]]:
    """The model's settings with each other law of impacts on which outcomes may depend."""
    player = build(request.model, request.settings)
    if not isinstance(player, EventBasedModel):
        return []
    bounces = any(wall.restitution > 0.0 for wall in panel.scene.walls)
    return [{**request.settings, "impacts": law} for law in other_laws(player, walls=bounces, flat=may_fly(panel.scene))]


def play_panels(panels: Sequence[Panel], request: SpectrumRequest, tiles: Tiles, *, all_laws: bool = False) -> list[Spectrum]:
    """The spectra of the panels, in order; on a cluster all at once, here one after the other on all cores. Raises `InputError`.

    With `all_laws` they are played under the other laws of impacts, too, where these can matter, and
    know the nodes at which they do.
    """

    def played(panel: Panel, settings: Mapping[str, Any]) -> Spectrum:
        spectrum = overturning_spectrum(
            panel.scene,
            request.frequencies,
            request.amplitudes,
            refine=request.refine,
            play=lambda scene, a, f: tiles.play(scene, a, f, model=request.model, settings=settings),
        )
        tiles.count.add(spectrum.outcomes.size - spectrum.evaluations)  # what did not have to be run
        return spectrum

    def play(panel: Panel) -> Spectrum:
        spectrum = played(panel, request.settings)
        others = [played(panel, settings) for settings in (other_settings(panel, request) if all_laws else [])]
        return replace(spectrum, depends_on_law=differing(spectrum, others)) if others else spectrum

    for panel in panels:
        check = getattr(build(request.model, request.settings), "check", None)
        if check is not None:
            check(panel.scene)
    if tiles.client is None:
        return [play(panel) for panel in panels]
    with threads(len(panels)) as pool:
        return list(pool.map(play, panels))


def differing(spectrum: Spectrum, others: Sequence[Spectrum]) -> NDArray[np.int64]:
    """The nodes (i, j), a row each, that are decided and differ in one of the others, decided, too."""
    differ = np.zeros(spectrum.outcomes.shape, dtype=bool)
    for other in others:
        own = spectrum.outcomes != other.outcomes
        for one in (spectrum, other):
            own[tuple(one.undecided.T)] = False
        differ |= own
    return np.argwhere(differ)


def save(panels: Sequence[Panel], spectra: Sequence[Spectrum], request: SpectrumRequest, folder: Path, *, jobs: int | None = None) -> None:
    """Write each spectrum's outcomes with its settings as NPZ and CSV, and note it in the folder's `spectra.json`.

    Beside them go histories of some nodes (`spectra.histories`), where the model is quick enough: those of `jobs` spectra (default:
    all cores) are played at once.
    """
    records = []
    waiting: list[tuple[Spectrum, Path, str]] = []
    model = build(request.model, request.settings)
    for panel, spectrum in zip(panels, spectra, strict=True):
        record = SpectrumRecord(
            name=stem(panel.name, request.model),
            title=panel.title,
            figure=panel.figure,
            scene=_plain_scene(panel.scene),
            model=request.model,
            settings=dict(request.settings),
            frequency_ratios=tuple(spectrum.frequency_ratios.tolist()),
            amplitude_ratios=tuple(spectrum.amplitude_ratios.tolist()),
            refined=request.refine,
            evaluations=spectrum.evaluations,
            undecided=len(spectrum.undecided),
            safe=spectrum.safe_area,
            left=float(np.mean(spectrum.outcomes == LEFT)),
            right=float(np.mean(spectrum.outcomes == RIGHT)),
            depends_on_law=None if spectrum.depends_on_law is None else len(spectrum.depends_on_law),
        )
        about = record.model_dump(exclude={"frequency_ratios", "amplitude_ratios"}) | {"versions": provenance.versions()}
        write_whole(folder / f"{record.name}.npz", _npz(spectrum, json.dumps(about)))
        write_whole(folder / f"{record.name}.csv", _csv(spectrum, json.dumps(about)))
        if compiled(model):
            path, key = glimpses_path(folder, record.name), _glimpses_key(spectrum, request)
            if not kept(path, key):
                waiting.append((spectrum, path, key))
        records.append(record)
    if compiled(model):
        with threads(jobs or os.cpu_count() or 1) as pool:
            list(pool.map(lambda one: save_glimpses(glimpses(one[0], model), *one[1:]), waiting))
    index = read_index(folder)
    new = {record.name: record for record in records}
    merged = [*(old for old in index.spectra if old.name not in new), *records]
    whole = SpectraIndex(spectra=tuple(sorted(merged, key=lambda record: record.name)))
    write_whole(folder / "spectra.json", whole.model_dump_json(indent=1) + "\n")


def _glimpses_key(spectrum: Spectrum, request: SpectrumRequest) -> str:
    """Hash of all that the histories of some nodes depend on."""
    nodes = tile_key(spectrum.scene, spectrum.amplitude_ratios, spectrum.frequency_ratios, request.model, request.settings)
    return provenance.digest(nodes + provenance.code_digest("rockcheck.validation.spectra.histories"))


def stem(name: str, model: str) -> str:
    """The name of a spectrum's files: the panel's, and the model's where that is not the paper's."""
    return name if model == "ebm" else f"{name}--{model}"


def read_index(folder: Path) -> SpectraIndex:
    """`spectra.json` of a folder; empty where there is none that this version can read."""
    try:
        return SpectraIndex.model_validate(read_json(within(folder, "spectra.json")))
    except ValueError:
        return SpectraIndex()


def read_spectrum(folder: Path, record: SpectrumRecord, scene: Scene) -> Spectrum:
    """A spectrum of a folder as it was saved, of this scene."""
    data = read_arrays(within(folder, f"{record.name}.npz"))
    return Spectrum(
        outcomes=data["outcomes"],
        frequency_ratios=data["frequency_ratios"],
        amplitude_ratios=data["amplitude_ratios"],
        evaluations=record.evaluations,
        undecided=data["undecided"],
        scene=scene,
        model=None,
    )


def _plain_scene(scene: Scene) -> dict[str, Any]:
    """The scene as data, a record's samples left out (its name says which it is)."""
    data = scene.model_dump(mode="json")
    data["excitation"].pop("unscaled", None)
    data["vertical"].pop("unscaled", None)
    return data


def _npz(spectrum: Spectrum, about: str) -> bytes:
    content = io.BytesIO()
    law: dict[str, Any] = {} if spectrum.depends_on_law is None else {"depends_on_law": spectrum.depends_on_law}
    np.savez_compressed(
        content,
        outcomes=spectrum.outcomes,
        frequency_ratios=spectrum.frequency_ratios,
        amplitude_ratios=spectrum.amplitude_ratios,
        undecided=spectrum.undecided,
        settings=np.array(about),
        **law,
    )
    return content.getvalue()


def _csv(spectrum: Spectrum, about: str) -> str:
    """One row an amplitude ratio, one column a frequency ratio: -1 overturned left, 0 safe, 1 overturned right."""
    columns = ["amplitude_ratio\\frequency_ratio", *map(repr, spectrum.frequency_ratios.tolist())]
    rows = zip(spectrum.amplitude_ratios.tolist(), spectrum.outcomes.tolist(), strict=True)
    return f"# rockcheck spectrum {about}\n" + table_text(columns, ([amplitude, *row] for amplitude, row in rows))
