"""A suite that is ready to run: its cells, their checks, and what they are compared with.

In go validated scenes, models and tolerances; out come cells (a scene by a model) and the checks
that each must pass. `suites` and `joining` make a `Suite`; planning, playing and judging ask it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from rockcheck.ebm.horizon import may_fly
from rockcheck.scenes import Scene, errors, files
from rockcheck.validation.execute.models import ENGINE_NAMES, Work, family
from rockcheck.validation.suite import motions, results
from rockcheck.validation.suite.suite_file import SuiteFile
from rockcheck.validation.suite.tolerances import (
    CELL_FIGURES,
    ToleranceKey,
    Tolerances,
    measure_of,
)

#: Time limit (s) of a physics engine that nobody named.
UNNAMED_SECONDS = 60.0


@dataclass(frozen=True)
class Suite:
    """A suite, ready to run: every scene and every model's settings are validated."""

    name: str
    path: Path
    #: The keys of its file, such as the limits, and what it requires.
    config: SuiteFile = field(repr=False)
    scenes: Mapping[str, Scene]
    models: Mapping[str, Work]
    tolerances: Tolerances = field(repr=False)
    #: Where `rockcheck accept` writes: the tolerance file, or the suite file where it holds a table
    #: `[tolerances]`.
    tolerances_path: Path = Path()
    #: Ensembles with the scene that each is drawn from.
    ensembles: Mapping[str, tuple[motions.Ensemble, Scene]] = field(default_factory=dict)
    #: The suites that this one joins.
    included: tuple[Suite, ...] = ()
    #: Scenes with uncertain numbers, by name.
    uncertain: Mapping[str, files.UncertainScene] = field(default_factory=dict)
    #: Vertical components of its records, which are not played, and whether anything is judged.
    left_out: tuple[str, ...] = ()
    judged: bool = True
    #: Models that play since they are installed, not since somebody named them. Where one of them
    #: cannot play a scene, or does not end in time, it is left out, and nothing has failed.
    unnamed: frozenset[str] = frozenset()

    @cached_property
    def _keys_by_cell(self) -> dict[tuple[str, str], list[ToleranceKey]]:
        keys: dict[tuple[str, str], list[ToleranceKey]] = {}
        for key in self.tolerances:
            keys.setdefault((key.scene, key.model), []).append(key)
        return keys

    def seconds(self, scene_name: str, model: Work) -> float:
        """The time limit (s) of a cell."""
        if model.label in self.unnamed and model.family in ENGINE_NAMES:
            return UNNAMED_SECONDS
        return self.owners[scene_name].config.limits.seconds

    @property
    def members(self) -> tuple[Suite, ...]:
        """The suites that it joins, or the suite itself."""
        return self.included or (self,)

    @property
    def owners(self) -> dict[str, Suite]:
        """The member that each scene or ensemble comes from."""
        return {
            name: member for member in self.members for name in (*member.scenes, *member.ensembles)
        }

    def cells(self) -> Iterator[tuple[Scene, Work, motions.Ensemble | None]]:
        """All cells, scene by scene; then the ensembles with the scene that they are drawn from."""
        for member in self.members:
            for name, model in cell_names(member.scenes, member.models):
                yield member.scenes[name], member.models[model], None
        for member in self.members:
            for name, model in cell_names(member.ensembles, member.models):
                ensemble, scene = member.ensembles[name]
                yield scene, member.models[model], ensemble

    def only(self, scene: str, model: str) -> Suite:
        """The suite with one cell, and the references that it is compared with."""
        owner = self.owners.get(scene, self)
        errors.one_of("scene of the suite", scene, self.scenes)
        labels = [label for _, label in cell_names([scene], owner.models)]
        errors.one_of("model of the suite", model, labels)
        # the reference's own figures count where it is as expected itself
        of_reference = (owner.config.reference, CELL_FIGURES)
        tolerances = {
            key: line
            for key, line in owner.tolerances.items()
            if key.scene == scene
            and (key.model == model or (key.model, key.against) == of_reference)
        }
        needed = {model, *owner.yardsticks(tolerances)}
        return replace(
            owner,
            scenes={scene: owner.scenes[scene]},
            ensembles={},
            models={label: variant for label, variant in owner.models.items() if label in needed},
            tolerances=tolerances,
        )

    def required(self, name: str, model: str) -> dict[ToleranceKey, results.Kind]:
        """The checks of a cell, with their kinds: those required or given a tolerance.

        `name` is that of a scene or an ensemble of this very suite, not of one that it joins.
        """
        require, reference = self.config.require, self.config.reference
        model_form = self.config.model_form
        difference = require.ensemble if name in self.ensembles else require.difference
        keys: list[ToleranceKey] = []
        if name not in self.ensembles:
            keys += [ToleranceKey(name, model, CELL_FIGURES, text) for text in require.figures]
        if reference and model != reference:
            keys += [ToleranceKey(name, model, reference, text) for text in difference]
        if name not in self.ensembles and model_form and model not in (reference, model_form):
            keys += [ToleranceKey(name, model, model_form, text) for text in require.model_form]
        keys += self._keys_by_cell.get((name, model), [])
        return {key: self.kind(key) for key in keys}

    def yardsticks(self, required: Iterable[ToleranceKey]) -> list[str]:
        """`CELL_FIGURES`, then the models that cells with these checks are compared with."""
        usual = CELL_FIGURES, self.config.reference, self.config.model_form
        return list(dict.fromkeys((*usual, *(key.against for key in required))))

    def kind(self, key: ToleranceKey) -> results.Kind:
        """The kind of a check.

        Where the block may fly, a model that cannot differs in form from one that can.
        """
        if key.against == CELL_FIGURES:
            return "exact" if measure_of(key.windowed).exact else "absolute"
        families = [self.models[label].family for label in (key.model, key.against)]
        if "measured" in families:
            return "measured"
        if key.scene in self.ensembles:
            _, scene = self.ensembles[key.scene]
        else:
            scene = self.scenes[key.scene]
        differ = len({family(name).flies for name in families}) > 1
        return "model form" if differ and may_fly(scene) else "numerical"


def cell_names(scenes: Iterable[str], models: Mapping[str, Work]) -> Iterator[tuple[str, str]]:
    """Names of scene and model of each cell; a measured history plays only its own scenes."""
    for scene in scenes:
        for label, model in models.items():
            if model.family != "measured" or scene in model.settings["files"]:
                yield scene, label
