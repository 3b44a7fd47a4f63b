"""Run a suite: play the cells that are not up to date, compare, judge, return the `Run`.

Figures are taken against references under any law of impacts. Computed once and kept: the horizon,
the landing at which laws part, and the effect of a spread of inputs on figures. The uncertainty
sets a cell's difference from each reference against u_num, u_input and u_D (ASME V&V 20).
"""

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from itertools import chain
from operator import attrgetter
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

import numpy as np

from rockcheck.ebm import EventBasedModel, predictability_horizon
from rockcheck.ebm.horizon import may_fly, other_laws
from rockcheck.scenes import (
    History,
    InputError,
    ModelFailure,
    NonNegative,
    Scene,
    errors,
    progress,
)
from rockcheck.validation.discrepancy import impact_laws, measures
from rockcheck.validation.discrepancy.compare import compare, describe, evaluate, gap_of
from rockcheck.validation.discrepancy.figures import SAME_IMPACT, Figure, Measure, Stored
from rockcheck.validation.execute import models, pool, provenance
from rockcheck.validation.execute.store import COMPARISONS, HISTORIES, TABLE, Store, name_of
from rockcheck.validation.finding import Finding
from rockcheck.validation.study import FAULTS, Study, Task, run
from rockcheck.validation.suite import motions, results, suites, tolerances
from rockcheck.validation.uncertainty import numerical, population

T = TypeVar("T")
#: Measures judged by the nearest law. Histories are judged up to the horizon, which ends where the
#: laws part.
BY_ANY = ("outcome_agrees", "peak_ratio")


@dataclass(frozen=True)
class Planned(Task):
    """A cell to be played: a scene, or the scenes `numbers` of an `ensemble`, by a model.

    An ensemble's scenes are drawn from `scene`. `place` is the name of the scene, or of the
    ensemble, `kept_as` that of its files. `key` is the hash of all that the result depends on.
    """

    kept_as: str = field()
    key: str = field(compare=False)
    place: str = field(compare=False)
    scene: Scene = field(compare=False)
    variant: models.Work = field(compare=False)
    uncertainty: bool = field(default=False, compare=False)
    ensemble: motions.Ensemble | None = field(default=None, compare=False)
    numbers: range = field(default=range(0), compare=False)

    @property
    def label(self) -> str:
        """Scene and model; of an ensemble the first scene, too."""
        part = f", from {self.numbers.start}" if self.ensemble else ""
        return f"{self.place}, {self.variant.label}{part}"

    def play(self) -> models.Played:
        """The history, or the peaks of a batch."""
        if self.ensemble is None:
            played = models.play(self.variant, self.scene, uncertainty=self.uncertainty)
        else:
            played = models.play_batch(
                self.variant, [self.ensemble.drawn(self.scene, n) for n in self.numbers]
            )
        # a user-defined model's history may say nonsense
        return replace(played, record=self.kept[1](**played.record))

    @property
    def kept(self) -> tuple[str, Any]:
        """The kind of its result in the store, and the type of its record."""
        return (COMPARISONS, BatchRecord) if self.ensemble else (HISTORIES, CellRecord)


class CellRecord(Stored):
    """The kept record of a cell, beside its history."""

    outcome: str
    notes: tuple[str, ...]
    settings: dict[str, Any]
    uncertainty: dict[str, NonNegative]
    numerical: numerical.Numerical | None
    cost: results.CostRecord


class BatchRecord(Stored):
    """The kept record of a batch: peak |theta| in alpha and outcome of each scene.

    None and the reason where the model failed.
    """

    peaks: tuple[float | None, ...]
    outcomes: tuple[str, ...]
    cost: results.CostRecord


class Compared(NamedTuple):
    """A figure, and what of its window could not be compared: `fall` if because one block fell."""

    figure: Figure
    gap: str = ""
    fall: bool = False


class ComparisonRecord(Stored):
    """All figures of a cell, its own and those against each reference."""

    figures: tuple[Compared, ...]
    impact_law: impact_laws.LawFollowed | None = None
    overturned_at: float | None = None


def _of_scene(
    store: Store,
    scene: Scene,
    what: str,
    module: str,
    kind: Any,
    compute: Callable[[], T],
    **more: Any,
) -> T:
    """A result of type `kind` on a scene, by the code of a module; kept in the store."""
    depends = {"of": what, "code": provenance.code_digest(f"rockcheck.{module}"), **more}
    key = provenance.cell_key(scene, models.REFERENCE, depends)
    return store.once(COMPARISONS, name_of(scene.name, what, key), kind, compute)


def landing_of(store: Store, scene: Scene) -> impact_laws.Landing | None:
    """The first landing of a scene at which the laws part, None without one; kept in the store."""

    def landing() -> impact_laws.Landing | None:
        with suppress(InputError, ModelFailure):  # it is not a scene for that model
            return impact_laws.parting_landing(scene)
        return None

    if not may_fly(scene):
        return None
    return _of_scene(
        store,
        scene,
        "impact-laws",
        "validation.discrepancy.impact_laws",
        impact_laws.Landing | None,
        landing,
    )


def under_other_laws(scene: Scene, variant: models.Work) -> dict[str, History]:
    """A reference's histories under the other laws of impacts, by law.

    Laws under which it fails are left out. Empty for a model without a choice of law.
    """
    model = (
        None if models.is_own(variant.family) else models.build(variant.family, variant.settings)
    )
    found: dict[str, History] = {}
    if isinstance(model, EventBasedModel):
        for law in other_laws(model, walls=bool(scene.walls), flat=True):
            with suppress(ModelFailure):
                found[law] = model.model_copy(update={"impacts": law}).simulate(scene)
    return found


def by_any(
    candidate: History,
    reference: History | None,
    others: Mapping[str, History],
    scene: Scene,
    measures: Sequence[str],
    window: str = "",
    until: float | None = None,
) -> Iterator[Compared]:
    """A history's figures against `reference`, those of BY_ANY against it under the nearest law.

    `others` are the reference's histories under other laws. The note of a figure names the law if
    it is another one. Without a reference, the history's own figures. Of a window, as tolerances
    name it, that ends at `until` (s; None: the whole time).
    """
    if reference is None:
        gap = gap_of((candidate,), until)
        for one in describe(candidate, until=until, scene=scene, measures=measures):
            yield Compared(one.model_copy(update={"window": window}), *gap)
        return
    wanted = [measure for measure in measures if measure in BY_ANY]
    found = {"": compare(reference, candidate, until=until, scene=scene, measures=measures)} | {
        f'impacts = "{law}"': compare(history, candidate, until=until, scene=scene, measures=wanted)
        for law, history in others.items()
    }
    for first in found[""].figures:
        rivals = {law: one for law, one in found.items() if not law or first.measure in BY_ANY}
        # 1 is perfect; farthest is a law without a value
        away = {law: abs(one[first.measure] - 1.0) for law, one in rivals.items()}
        law = min(rivals, key=lambda law: math.inf if math.isnan(away[law]) else away[law])
        nearest = found[law].figure(first.measure)
        change = {
            "against": first.against,
            "note": "; ".join(filter(None, (nearest.note, law))),
            "window": window,
        }
        yield Compared(nearest.model_copy(update=change), found[law].gap, found[law].fall)


#: Quantities whose differences are explained, with their units.
QUANTITIES = {"theta_rms": "alpha", "peak_rotation": "alpha", "last_slip": "m"}


def explanations(
    scene: Scene,
    cell: results.Cell,
    references: Iterable[results.Cell],
    scatters: Mapping[str, Mapping[str, float]],
    inputs: population.Inputs | None,
) -> Iterator[numerical.Explanation]:
    """The verdict on each quantity of a cell against each reference.

    `scatters` is, by model, the scatter of the repeats of a measured history: rotations in rad,
    slips in m. There is no verdict for a model whose numerical error is unknown. Where the outcomes
    differ and a block falls, the only verdict is on the outcome; where both fall alike, or one
    history ends before the other, there is none on peaks and slips.
    """
    if cell.numerical is None:
        return
    sizes = {"alpha": scene.block.alpha, "m": 1.0}
    u_inputs = {name: inputs.u_input(name) or 0.0 for name in QUANTITIES} if inputs else {}
    for other in references:
        if cell.outcome != other.outcome and "overturned" in cell.outcome + other.outcome:
            yield _other_outcome(other.model, (cell.numerical, other.numerical), inputs)
            continue
        for name, unit in QUANTITIES.items():
            error = _difference(name, cell.figures, other)
            if error is None:
                continue
            u_num, reason = _both(name, (cell.numerical, other.numerical))
            own, theirs = scatters[cell.model].get(name, 0.0), scatters[other.model].get(name, 0.0)
            yield numerical.explain(
                name,
                unit,
                error,
                u_num,
                u_inputs.get(name, 0.0),
                math.hypot(own / sizes[unit], theirs / sizes[unit]),
                reason=reason,
                against=other.model,
            )


def _difference(name: str, figures: Sequence[Figure], other: results.Cell) -> float | None:
    mine, theirs = results.value_of(figures, name), results.value_of(other.figures, name)
    if mine is None or theirs is None:  # a figure of both histories
        return results.value_of(figures, name, other.model)
    end, its = (results.value_of(one, "end_time") or 0.0 for one in (figures, other.figures))
    alike = "overturned" not in other.outcome and abs(end - its) <= SAME_IMPACT
    return abs(mine - theirs) if alike else None


def _other_outcome(
    against: str,
    both: Iterable[numerical.Numerical | None],
    inputs: population.Inputs | None,
) -> numerical.Explanation:
    """The verdict on two different outcomes; a falling block's peaks and slips do not compare."""
    if reasons := [reason for one in both if one for reason in one.reasons]:
        return numerical.explain(
            "outcome", "", None, None, reason="; ".join(reasons), against=against
        )
    both_occur = inputs is not None and 0.0 < inputs.overturns.value < 1.0  # among the draws
    other = "not explained: model form or set-up, another outcome"
    return numerical.Explanation(
        quantity="outcome",
        unit="",
        against=against,
        error=1.0,
        u_num=0.0,
        verdict=numerical.INPUTS if both_occur else other,
    )


def _both(name: str, both: Iterable[numerical.Numerical | None]) -> tuple[float | None, str]:
    """The combined numerical uncertainty of both runs; None and the reason if one is unknown."""
    parts = [(one.u_num(name), one.reason(name)) for one in both if one]
    unsure = [reason for u, reason in parts if u is None]
    return (None, unsure[0]) if unsure else (math.hypot(*(u or 0.0 for u, _ in parts)), "")


#: Remark on a gap in a measured history.
SHIFTS = (
    "; `offset` of the measured model shifts its times, a window such as theta_rms@8s ends sooner"
)


def run_suite(
    suite: suites.Suite,
    folder: str | Path,
    *,
    jobs: int | None = None,
    force: bool = False,
    strict: results.Strict = False,
    scheduler: str | None = None,
    on_progress: progress.OnProgress = progress.unheard,
) -> results.Run:
    """Play, compare and judge every cell of a suite; see `validation.study.run`.

    A cell that fails is a failed cell of the run, never an exception. Raises `InputError` where
    `folder` cannot be used, and, when interrupted, `KeyboardInterrupt` after all results are kept.
    """
    found = run(
        SuiteStudy(suite, Path(folder)),
        Path(folder),
        jobs=jobs,
        force=force,
        scheduler=scheduler,
        on_progress=on_progress,
    )
    if not found.complete:
        raise KeyboardInterrupt
    finished: results.Run = found.data["run"]
    return finished.model_copy(
        update={
            "strict": strict,
            "wall_seconds": found.made.wall_seconds if found.made else 0.0,
        }
    )


class SuiteStudy(Study):
    """A suite: tasks are its cells and its ensembles' batches.

    Results are kept and read back in `folder`.
    """

    name = "suite"
    kinds = (HISTORIES, COMPARISONS)

    def __init__(self, suite: suites.Suite, folder: Path) -> None:
        self.suite, self.store, self.own = suite, Store(folder), suite.owners
        self.memory_mb = max((part.given.limits.memory_mb for part in suite.parts), default=None)
        #: By scene or ensemble, and by model: the cell, or the batches of it.
        self.planned: dict[str, dict[str, list[Planned]]] = {}
        self.items = [item for cell in suite.cells() for item in self._planned(*cell)]
        for item in self.items:
            self.planned.setdefault(item.place, {}).setdefault(item.variant.label, []).append(item)
        #: What each that has ended gave, without files, or why it gave nothing.
        self.ended: dict[Planned, Any] = {
            item: pool.Failure(missing)
            for item in self.items
            if (missing := models.not_installed(item.variant.family))
        }
        self.playable = [item for item in self.items if item not in self.ended]
        self.compared: dict[str, list[results.Cell]] = {}

    def _planned(
        self, scene: Scene, variant: models.Work, ensemble: motions.Ensemble | None
    ) -> Iterator[Planned]:
        """A cell, or the batches of an ensemble.

        A batch's key covers how its scenes are drawn, so it can be looked up without drawing them.
        """
        place = ensemble.name if ensemble else scene.name
        own, kind = self.own[place], variant.family
        asked = {"uncertainty": provenance.code_digest(numerical.__name__)}
        parts: list[tuple[range, dict[str, Any]]] = [
            (range(0), asked if own.given.uncertainty else {})
        ]
        if ensemble:
            how = ensemble.model_dump(mode="json", exclude={"count", "batch", "description"})
            code = provenance.code_digest("rockcheck.validation.suite.motions")
            every = range(ensemble.count)
            parts = [
                (n, {"drawn": {"ensemble": how, "code": code, "numbers": [n.start, n.stop]}})
                for n in (every[k : k + ensemble.batch] for k in every[:: ensemble.batch])
            ]
        for numbers, depends in parts:
            settings = {**variant.settings, **depends}
            key = provenance.cell_key(scene, kind, settings, variant.search_path)
            first = [f"{numbers.start}"] if ensemble else []
            yield Planned(
                name_of(place, variant.label, *first, key),
                key,
                place,
                scene,
                variant,
                own.given.uncertainty,
                ensemble,
                numbers,
                seconds=own.given.limits.seconds,
                compiles=models.compiles(kind, variant.settings),
            )

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Planned]:
        """All cells and batches of models that are installed, in the order in which they begin.

        First one cell for each compiled code, since the others with that code wait for it; then the
        cells that take long, the longest scenes with the most walls first; cells of models that are
        compiled as a whole are quick, and fill the processes up to the end.
        """
        first = {item.compiles: item for item in reversed(self.playable)}
        return sorted(
            self.playable,
            key=lambda item: (
                not item.compiles or first[item.compiles] is not item,
                models.family(item.variant.family).compiled != "",
                -item.scene.duration * (1 + len(item.scene.walls)),
            ),
        )

    def find(self, store: Store, task: Any) -> Any:
        """The kept record of a batch, or of a cell whose history is whole; else None."""
        kind, form = task.kept
        with suppress(ValueError):  # a kept record may lack fields that it must have
            found = form(**(store.get(kind, task.kept_as) or {}))
            self.ended[task] = models.Played(found, read_back=True)
        return self.ended.get(task)

    def keep(self, store: Store, task: Any, record: models.Played) -> None:
        """Keep a history or a batch; compare a scene's cells once the last of them is kept.

        So scenes are compared while others are still played.
        """
        self.ended[task] = replace(record, files={}, history=None)
        if not record.traceback:  # else some scenes of a batch failed: not to be read back
            content = record.record.model_dump(mode="json")
            self.store.put(task.kept[0], task.kept_as, content, record.files, record.history)
        if task.ensemble is None:
            self._compare(task.place)

    def _compare(self, scene: str) -> None:
        cells, found = self.planned[scene], dict[str, results.Cell]()
        if scene in self.compared or not all(cell in self.ended for (cell,) in cells.values()):
            return
        reference = self.own[scene].given.reference
        for label in sorted(cells, key=lambda label: label != reference):
            found[label] = self._cell(cells[label], found.get(reference))
        self.compared[scene] = [found[label] for label in cells]

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The run, as the data of a finding."""
        suite = self.suite
        self.ended |= {task: one for task, one in done.items() if isinstance(one, pool.Failure)}
        if any(item not in self.ended for item in self.items):
            return Finding(self.name, suite.name, "interrupted", complete=False)
        inputs = {
            name: _of_scene(
                self.store,
                given.scene,
                "inputs",
                "validation.uncertainty.population",
                population.Inputs,
                partial(population.propagate, given),
                spreads={place: spread.model_dump() for place, spread in given.spreads.items()},
                correlation=given.correlation.tolist(),
            )
            for name, given in suite.uncertain.items()
            if name in self.planned
        }
        drawn = [self._ensemble(name) for name in suite.ensembles if name in self.planned]
        of_scenes = (
            self._explained(place, inputs.get(place))
            for place in self.planned
            if place not in suite.ensembles
        )
        finished = results.Run(
            suite=suite.name,
            description=suite.given.description,
            created=datetime.now(UTC).isoformat(timespec="seconds"),
            reference=suite.given.reference,
            model_form=suite.given.model_form,
            scenes={name: scene.model_dump(mode="json") for name, scene in suite.scenes.items()},
            models=tuple(suite.models),
            cells=tuple(chain(*of_scenes, *(cells for _, cells in drawn))),
            ensembles=tuple(record for record, _ in drawn),
            inputs=inputs,
            printed=tuple(name for name in suite.scenes if self.own[name].given.print_figures),
            faults=tuple(
                f"tolerance [{'.'.join(place[:3])}: {place.what}] has no cell in the suite"
                for place in suite.tolerances
                if place.model not in self.planned.get(place.scene, ())
            ),
            measures=tuple(
                {
                    "name": m.name,
                    "label": m.label,
                    "unit": m.unit,
                    "formula": m.formula,
                    "source": "",
                }
                for m in tolerances.MEASURES.values()
            ),
            versions=provenance.versions(),
            hardware=provenance.hardware(),
            judged=suite.judged,
            tolerances_file=errors.inert(str(suite.tolerances_path)),
        )
        return Finding(
            self.name,
            suite.name,
            finished.words,
            data={"run": finished},
            exit_code=finished.exit_code,
        )

    def _about(self, parts: Sequence[Planned], reason: str = "") -> dict[str, Any]:
        """The fields of every cell, made of a history or of batches; `reason`: why it failed."""
        first, variant = parts[0], parts[0].variant
        status = "failed" if reason else "done"
        if missing := models.not_installed(variant.family):
            status = "absent" if models.class_of(variant.family).has_wheel() else "unavailable"
        traced = [f"{FAULTS}/{part.kept_as}.txt" for part in parts if self.ended[part].traceback]
        return {
            "scene": first.place,
            "model": variant.label,
            "settings": dict(variant.settings),
            "key": provenance.digest("".join(part.key for part in parts))
            if first.ensemble
            else first.key,
            "status": status,
            "reason": missing or reason,
            "read_back": all(getattr(self.ended[part], "read_back", False) for part in parts),
            "traceback": traced[0] if traced else "",
            # in a user's own model an exception is that model's fault, not rockcheck's
            "unexpected": bool(traced) and not models.is_own(variant.family),
        }

    def _cell(self, parts: Sequence[Planned], reference: results.Cell | None) -> results.Cell:
        (planned,), played = parts, self.ended[parts[0]]
        if isinstance(played, pool.Failure):
            return results.Cell(**self._about(parts, played.reason))
        record, scene, own = played.record, planned.scene, self.own[planned.place]
        required = own.required(scene.name, planned.variant.label)
        found = self._compared(planned, required)
        floor = partial(tolerances.floor_of, scene=scene, numerical=record.numerical)
        checks = list(_checks(own, required, found.figures, floor))
        moved = [one for one in checks if one.kind == "absolute" and one.weighs != "pass"]
        same_equations = tolerances.Place(
            scene.name, planned.variant.label, own.given.reference, "theta_rms"
        )
        if moved and reference and own.kind(same_equations) == "numerical":
            # the reference's own figures; one that is not as expected itself is no yardstick
            odd = {
                check.figure.windowed
                for check in reference.checks
                if check.verdict != "pass" and not check.figure.against
            }
            beside = {
                one.windowed: one.value
                for one in reference.figures
                if not one.against and one.windowed not in odd
            }
            checks = list(_checks(own, required, found.figures, floor, beside))
        return results.Cell(
            **self._about(parts)
            | {
                "settings": record.settings,
                "history": f"{HISTORIES}/{planned.kept_as}{TABLE}",
                "outcome": record.outcome,
                "overturned_at": found.overturned_at,
                "notes": record.notes,
                "cost": record.cost,
                "figures": tuple(one.figure for one in found.figures),
                "checks": tuple(checks),
                "numerical": record.numerical,
                "impact_law": found.impact_law,
            }
        )

    def _asked(
        self, planned: Planned, required: Iterable[tolerances.Place]
    ) -> Iterator[tuple[str, Planned | None, dict[str, list[str]]]]:
        """What a cell is compared with: its own figures, and the references that finished.

        With the measures by window: all over the whole time, else those `required`.
        """
        there: dict[str, Planned | None] = {tolerances.OWN_FIGURES: None} | {
            name: one
            for name, (one,) in self.planned[planned.place].items()
            if one is not planned and not isinstance(self.ended[one], pool.Failure)
        }
        yardsticks = self.own[planned.place].yardsticks(required)
        for against in filter(there.__contains__, yardsticks):
            book = measures.DIFFERENCES if there[against] else measures.FIGURES
            windows = {"": [name for name, one in book.items() if not one.on_request]}
            for place in sorted(required):
                name, _, window = place.what.partition("@")
                if place.against == against and (window or tolerances.MEASURES[name].on_request):
                    windows.setdefault(window, []).append(name)
            yield against, there[against], windows

    def _compared(self, planned: Planned, required: Iterable[tolerances.Place]) -> ComparisonRecord:
        """The comparisons of a cell, kept in the store."""
        asked = list(self._asked(planned, required))
        named = {window for *_, windows in asked for window in windows if window}
        ends = {window: float(window[:-1]) for window in named - {tolerances.HORIZON}}
        if tolerances.HORIZON in named:  # up to it, histories can be compared point by point
            ends[tolerances.HORIZON] = _of_scene(
                self.store,
                planned.scene,
                tolerances.HORIZON,
                "ebm.horizon",
                float,
                partial(predictability_horizon, planned.scene),
            )
        depends = [
            [
                [
                    name,
                    # a user's own model need not play alike again: the seal of what was played
                    one
                    and (
                        self.store.seal_of(HISTORIES, one.kept_as)
                        if models.is_own(one.variant.family)
                        else one.key
                    ),
                    windows,
                ]
                for name, one, windows in (("", planned, {}), *asked)
            ],
            sorted(ends.items()),
            provenance.code_digest(__name__),  # with that of `compare`
        ]
        name = name_of(planned.place, planned.variant.label, provenance.digest(json.dumps(depends)))
        compute = partial(self._figures, planned, asked, ends)
        return self.store.once(COMPARISONS, name, ComparisonRecord, compute)

    def _figures(
        self,
        planned: Planned,
        asked: Iterable[tuple[str, Planned | None, Mapping[str, Sequence[str]]]],
        ends: Mapping[str, float],
    ) -> ComparisonRecord:
        """The measures asked of a cell, each window to its end (s), else over the whole time."""
        candidate, scene = self.store.load(planned.kept_as), planned.scene
        landing = landing_of(self.store, scene)
        parted = landing.t if landing else math.inf
        figures: list[Compared] = []
        for _, reference, windows in asked:
            yardstick = self.store.load(reference.kept_as) if reference else None
            others = under_other_laws(scene, reference.variant) if reference and landing else {}
            for window, names in windows.items():
                until = ends.get(window)
                rivals = others if until is None or until > parted else {}
                with suppress(InputError):  # no row within the window, or none in common
                    figures += by_any(candidate, yardstick, rivals, scene, names, window, until)
        return ComparisonRecord(
            figures=tuple(figures),
            impact_law=landing.followed_by(candidate, scene) if landing else None,
            overturned_at=candidate.overturned_at,
        )

    def _explained(self, scene: str, inputs: population.Inputs | None) -> Iterator[results.Cell]:
        """The cells of a scene with the verdicts on their differences from the references.

        Only of those that finished, and whose numerical error is known.
        """
        self._compare(scene)
        own, done = self.own[scene], [one for one in self.compared[scene] if one.status == "done"]
        scatters = {
            one.model: self.ended[self.planned[scene][one.model][0]].record.uncertainty
            for one in done
        }
        for cell in self.compared[scene]:
            against = {own.given.reference, own.given.model_form} - {cell.model}
            references = [other for other in done if other.model in against]
            found = explanations(own.scenes[scene], cell, references, scatters, inputs)
            yield cell.model_copy(update={"explanations": tuple(found)})

    def _ensemble(self, name: str) -> tuple[results.EnsembleRecord, list[results.Cell]]:
        planned, (ensemble, _) = self.planned[name], self.suite.ensembles[name]
        played = {label: list(map(self._batch, batches)) for label, batches in planned.items()}
        whole = results.EnsembleRecord(
            name=name,
            description=ensemble.description,
            definition=ensemble.model_dump(mode="json", exclude_none=True),
            peaks={at: tuple(p for one in some for p in one.peaks) for at, some in played.items()},
            outcomes={
                at: tuple(o for one in some for o in one.outcomes) for at, some in played.items()
            },
        )
        return whole, [
            self._ensemble_cell(planned[label], [one.cost for one in some], whole)
            for label, some in played.items()
        ]

    def _batch(self, planned: Planned) -> BatchRecord:
        """The record of a batch; of one that failed, each scene has its reason."""
        found, count = self.ended[planned], len(planned.numbers)
        record: BatchRecord = (
            BatchRecord(
                peaks=(None,) * count, outcomes=(found.reason,) * count, cost=results.CostRecord()
            )
            if isinstance(found, pool.Failure)
            else found.record
        )
        return record

    def _ensemble_cell(
        self,
        batches: Sequence[Planned],
        costs: Sequence[results.CostRecord],
        whole: results.EnsembleRecord,
    ) -> results.Cell:
        name, label = batches[0].place, batches[0].variant.label
        mine, others, reason = whole.samples[label], whole.finished, ""
        if mine.failures:
            first = mine.outcomes[int(np.argmin(np.isfinite(mine.peaks)))]
            reason = f"{mine.failures} of {len(mine.peaks)} scenes failed; the first: {first}"
        about = self._about(batches, reason) | {
            "cost": results.CostRecord(
                **{
                    key: sum(getattr(one, key) for one in costs)
                    for key in (*models.SUMMED, "worker_seconds")
                }
            )
        }
        if about["status"] != "done":
            return results.Cell(**about)
        own = self.own[name]
        required = own.required(name, label)
        figures = [
            Compared(
                evaluate(measure, measures.Samples(others[other], mine), "alpha", against=other)
            )
            for other in own.yardsticks(required)
            if other in others and other != label
            for measure in measures.STATISTICS.values()
        ]
        return results.Cell(
            **about,
            outcome=f"{int(np.sum(mine.fallen))} of {len(mine.peaks)} overturned",
            figures=tuple(one.figure for one in figures),
            checks=tuple(_checks(own, required, figures, attrgetter("resolution"))),
        )


def _checks(
    own: suites.Suite,
    required: Mapping[tolerances.Place, results.Kind],
    figures: Sequence[Compared],
    floor: Callable[[Measure], float],
    beside: Mapping[str, float | None] = MappingProxyType({}),
) -> Iterator[results.Check]:
    """The judged figures of a cell; none if its suite judges nothing.

    `beside` has the reference's own figures, by "measure@window", where these are yardsticks.
    """
    known = {
        (one.figure.against or tolerances.OWN_FIGURES, one.figure.windowed): one for one in figures
    }
    for place, kind in required.items() if own.judged else ():
        line, measure = own.tolerances.get(place), tolerances.measure_of(place.what)
        itself = place.against == tolerances.OWN_FIGURES
        nothing = Figure(  # without a value, so that the check cannot pass
            measure=measure.name,
            label=measure.label,
            unit=measure.unit.replace("angle", "alpha"),
            value=None,
            against="" if itself else place.against,
            window=place.what.partition("@")[2],
            note="not computed" if itself else f"nothing of {place.against} to compare with here",
        )
        found = known.get((place.against, place.what), Compared(nothing))
        gap = "" if found.fall and kind == "model form" else found.gap
        yield tolerances.judge(
            found.figure,
            line,
            kind=kind,
            measure=measure,
            gap=gap + SHIFTS if gap and kind == "measured" and not found.fall else gap,
            floor=floor(measure),
            beside=beside.get(place.what) if line and kind == "absolute" else None,
        )
