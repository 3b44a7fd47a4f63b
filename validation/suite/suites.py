"""Suites: scenes, models with their settings, and the figures to be within tolerance.

A suite is a TOML file that a user can write:

    description = "my shelf on my record"
    reference = "ebm-unilateral"                 # judges numerical differences
    model_form = "ebm"                           # optional: shown beside it, with its own band
    # each scene's figure for a paper (SVG, PNG, PDF); without it `rockcheck report` draws one
    print_figures = true
    scenes = ["fig4a", "shelf.toml"]             # names, or scene files beside this one

    [models.ebm-unilateral]
    [models.ebm]
    [models.mujoco]
    time_step = 1e-4
    # a second variant of a model; "my_module:MyModel" is one of your own, see --allow-code
    [models.mujoco-coarse]
    model = "mujoco"
    time_step = 1e-3
    # a measured history, for the scenes that it names (validation.discrepancy.measured)
    [models.table]
    model = "measured"
    files = { shelf = "run7.csv" }
    offset = -0.35                               # s, added to its times

    # what must have a tolerance, for every scene and model
    [require]
    difference = ["theta_rms@8s", "outcome_agrees"]
    model_form = ["theta_rms@8s"]
    figures = ["peak_rotation@8s"]

    # scenes by combination: one alternative of each axis, merged into `scene`
    [[grid]]
    scene = { duration = 6.0, block = { half_width = 0.4, half_height = 1.5 } }
    axes = [
        [
            { name = "mu03", floor = { friction = 0.3 } },
            { name = "mu06", floor = { friction = 0.6 } },
        ],
        [{ name = "weak", excitation = { kind = "ricker", amplitude = 4.0, period = 1.5 } }],
    ]

Scenes under recorded motions are `[[records]]` tables (validation.suite.motions). Ensembles are
`[[ensemble]]` tables (validation.suite.motions), judged by the measures of `require.ensemble`.
Scenes can also be written out as `[[scene]]` tables. Tolerances (validation.suite.tolerances) are a
table `[tolerances]` in the file or a file `<suite>.tolerances.toml` beside it. `include = ["smoke",
"walls"]` joins other suites instead, which may join others.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Collection, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import Field

from rockcheck.ebm.horizon import may_fly
from rockcheck.scenes import Frozen, Positive, Scene, errors, files, printable
from rockcheck.validation.discrepancy import measures
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import (
    ENGINE_NAMES,
    PAPER_MODEL,
    REFERENCE,
    Work,
    build,
    check_allowed,
    family,
    is_own,
)
from rockcheck.validation.suite import motions, results
from rockcheck.validation.suite.tolerances import (
    HORIZON,
    OWN_FIGURES,
    ToleranceKey,
    Tolerances,
    measure_of,
    parse_tolerances,
)

Key = TypeVar("Key")
Value = TypeVar("Value")

#: Time limit (s) of a simulation without a suite; and of a physics engine that nobody named.
UNJUDGED_SECONDS, UNNAMED_SECONDS = 900.0, 60.0
DATA = Path(__file__).parents[1] / "data"


class Limits(Frozen):
    """Limits of one cell, of wall time (s) and of memory (MB).

    Compiled code needs 500 MB.
    """

    seconds: Positive = 120.0
    memory_mb: Annotated[Positive, Field(ge=500.0)] = 4096.0


class Require(Frozen):
    """Measures ("name" or "name@window") that must have a tolerance in every scene.

    `difference`: of every other model against the reference; `model_form`: against the suite's
    `model_form`; `figures`: of every cell itself; `ensemble`: of every other model against the
    reference, in the suite's ensembles.
    """

    difference: tuple[str, ...] = ()
    model_form: tuple[str, ...] = ()
    figures: tuple[str, ...] = ()
    ensemble: tuple[str, ...] = ()


class Grid(Frozen):
    """Scenes by combination: one alternative of each axis merged into `scene`.

    The names of the alternatives are appended to the scene's.
    """

    scene: dict[str, Any] = Field(default_factory=dict)
    axes: Annotated[tuple[tuple[dict[str, Any], ...], ...], Field(min_length=1)]


class SuiteFile(Frozen):
    """The keys of a suite file; see the module."""

    description: str = ""
    include: tuple[str, ...] = ()
    reference: str = REFERENCE
    model_form: str = ""
    scenes: tuple[str, ...] = ()
    scene: tuple[dict[str, Any], ...] = ()
    grid: tuple[Grid, ...] = ()
    records: tuple[motions.RecordSet, ...] = ()
    models: dict[str, dict[str, Any]] = Field(default_factory=dict)
    require: Require = Require()
    limits: Limits = Limits()
    ensemble: tuple[motions.Ensemble, ...] = ()
    tolerances: dict[str, Any] | None = None
    #: Whether the numerical error of each cell is estimated (three coarser runs a cell).
    uncertainty: bool = False
    #: Whether each scene's figure for a paper is drawn.
    print_figures: bool = False


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
            for name, model in _cells(member.scenes, member.models):
                yield member.scenes[name], member.models[model], None
        for member in self.members:
            for name, model in _cells(member.ensembles, member.models):
                ensemble, scene = member.ensembles[name]
                yield scene, member.models[model], ensemble

    def only(self, scene: str, model: str) -> Suite:
        """The suite with one cell, and the references that it is compared with."""
        owner = self.owners.get(scene, self)
        errors.one_of("scene of the suite", scene, self.scenes)
        labels = [label for _, label in _cells([scene], owner.models)]
        errors.one_of("model of the suite", model, labels)
        # the reference's own figures count where it is as expected itself
        of_reference = (owner.config.reference, OWN_FIGURES)
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
            keys += [ToleranceKey(name, model, OWN_FIGURES, text) for text in require.figures]
        if reference and model != reference:
            keys += [ToleranceKey(name, model, reference, text) for text in difference]
        if name not in self.ensembles and model_form and model not in (reference, model_form):
            keys += [ToleranceKey(name, model, model_form, text) for text in require.model_form]
        keys += self._keys_by_cell.get((name, model), [])
        return {key: self.kind(key) for key in keys}

    def yardsticks(self, required: Iterable[ToleranceKey]) -> list[str]:
        """`OWN_FIGURES`, then the models that cells with these checks are compared with."""
        usual = OWN_FIGURES, self.config.reference, self.config.model_form
        return list(dict.fromkeys((*usual, *(key.against for key in required))))

    def kind(self, key: ToleranceKey) -> results.Kind:
        """The kind of a check.

        Where the block may fly, a model that cannot differs in form from one that can.
        """
        if key.against == OWN_FIGURES:
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


def named_suites() -> dict[str, Path]:
    """Names and files of the suites that come with the package."""
    return {path.stem: path for path in sorted((DATA / "suites").glob("*.toml"))}


def load_suite(source: str | Path, *, allow_code: Container[str] = ()) -> Suite:
    """A suite from a TOML file, or by the name of one that comes with the package.

    Nothing that the file names is run or imported: a model "module:Class" must be in `allow_code`,
    and is imported only by the processes that play it. Raises `InputError` naming the file, the
    key, the value and what is allowed.
    """
    known = named_suites()
    shipped = str(source) in known
    path = known[str(source)] if shipped else Path(source)
    if path.suffix.lower() != ".toml":
        raise errors.InputError(
            f"{errors.unknown_name('suite', str(source), known)}; or the path of a .toml file"
        )
    tables = files.read_toml(path)
    if "block" in tables:
        raise errors.InputError(
            f"{printable(path)}: is a scene, not a suite; `rockcheck validate` plays a scene, and"
            f" a suite is a file with scenes = [{printable(path.name)!r}], and tables"
            " [models.NAME]",
            file=path,
        )
    try:
        return _suite(SuiteFile(**tables), path, shipped, allow_code)
    except RecursionError:
        raise errors.InputError(
            f"{printable(path)}: include: the suite joins itself", file=path
        ) from None
    except errors.InputError as error:
        if error.file is not None:
            raise
        raise errors.InputError(f"{printable(path)}: {error}", file=path) from None


def _suite(config: SuiteFile, path: Path, shipped: bool, allow_code: Container[str]) -> Suite:
    if config.include:
        return _joined(config, path, allow_code)
    folder = path.parent
    models = {
        label: _variant(label, settings, folder, allow_code)
        for label, settings in config.models.items()
    }
    uncertain, left_out = motions.under_records(_scenes(config, folder), config.records, folder)
    scenes = {name: uncertain_scene.scene for name, uncertain_scene in uncertain.items()}
    ensembles = {
        ensemble.name: (
            ensemble,
            files.scene_from(ensemble.scene, folder=folder, default_name=ensemble.name),
        )
        for ensemble in config.ensemble
    }
    _check_references(config, models)
    _check_names(config, models, scenes, ensembles)
    _check_measures(config.require)
    _check_measured(models, scenes)
    tables, tolerances_path = _tolerance_tables(config, path, shipped)
    try:
        tolerances = parse_tolerances(tables, _cells(scenes, models))
        for key in tolerances:
            errors.one_of(
                f"reference of [{key.scene}.{key.model}]", key.against, [OWN_FIGURES, *models]
            )
    except errors.InputError as error:
        raise errors.InputError(
            f"{printable(tolerances_path)}: {error}", file=tolerances_path
        ) from None
    return Suite(
        name=errors.inert(path.stem),
        path=path,
        config=config,
        scenes=scenes,
        ensembles=ensembles,
        models=models,
        tolerances=tolerances,
        tolerances_path=tolerances_path,
        uncertain={name: scene for name, scene in uncertain.items() if scene.spreads},
        left_out=tuple(left_out),
    )


def _tolerance_tables(
    config: SuiteFile, path: Path, shipped: bool
) -> tuple[Mapping[str, Any], Path]:
    """The tables of tolerances and their file: the suite's own, or one beside it."""
    if config.tolerances is not None:
        return config.tolerances, path
    beside = path.with_name(f"{path.stem}.tolerances.toml")
    if shipped:
        beside = DATA / "tolerances" / path.name
    return (files.read_toml(beside) if beside.exists() else {}), beside


def scene_suite(
    source: str,
    models: Mapping[str, Mapping[str, Any]],
    *,
    records: Sequence[motions.RecordSet] = (),
    allow_code: Container[str] = (),
    unnamed: Collection[str] = (),
) -> Suite:
    """One scene (a name or a .toml file) by some models, perhaps under records: nothing is judged.

    `models` gives the settings of each; `unnamed` are those that nobody named. Differences are from
    `ebm-unilateral`, or from the first model without it. User-defined models are looked for in the
    working folder. Raises `InputError` as `load_suite`.
    """
    shipped = source in files.named_scenes()
    path = Path(f"{source}.toml" if shipped else source)
    reference = REFERENCE if REFERENCE in models else next(iter(models))
    config = SuiteFile(
        reference=reference,
        model_form=PAPER_MODEL if PAPER_MODEL in models and reference == REFERENCE else "",
        scenes=(source if shipped else path.name,),
        records=tuple(records),
        models={name: dict(settings) for name, settings in models.items()},
        require=Require(difference=(f"theta_rms@{HORIZON}",)),
        limits=Limits(seconds=UNJUDGED_SECONDS),
        tolerances={},
    )
    suite = _suite(config, path, shipped, allow_code)
    variants = {
        label: replace(variant, search_path=(str(Path.cwd()),)) if variant.search_path else variant
        for label, variant in suite.models.items()
    }
    return replace(suite, models=variants, judged=False, unnamed=frozenset(unnamed))


def check_source(source: str) -> None:
    """Raise `InputError` for what is neither a file nor the name of a suite or a scene."""
    names = [*named_suites(), *files.named_scenes()]
    if source in names or Path(source).suffix.lower() == ".toml":
        return
    raise errors.InputError(
        f"{errors.unknown_name('suite or scene', source, names)}; or the path of a .toml file"
    )


def is_scene(source: str) -> bool:
    """Whether `source` is the name or file of a scene, rather than of a suite.

    Raises `InputError` for a file that is no TOML.
    """
    path = Path(source)
    return source not in named_suites() and (
        source in files.named_scenes()
        or (path.suffix.lower() == ".toml" and "block" in files.read_toml(path))
    )


def _check_references(config: SuiteFile, models: Mapping[str, Work]) -> None:
    """Raise `InputError` where a reference is no model of the suite."""
    labels = ", ".join(models) or "none"
    for key, label in (("reference", config.reference), ("model_form", config.model_form)):
        if label and label not in models:
            raise errors.InputError(f"{label!r} is not among the suite's models: {labels}", key)
    if config.require.model_form and not config.model_form:
        raise errors.InputError(
            "needs the key model_form, which says against which model", "require.model_form"
        )
    if not models:
        raise errors.InputError("no model; at least the reference is needed", "models")


def _check_names(
    config: SuiteFile,
    models: Mapping[str, Work],
    scenes: Collection[str],
    ensembles: Collection[str],
) -> None:
    """Raise `InputError` for scenes that are missing, named twice or unknown."""
    if not scenes and not ensembles:
        raise errors.InputError("no scene; at least one is needed", "scenes")
    names = Counter((*scenes, *(ensemble.name for ensemble in config.ensemble)))
    for name, count in names.items():
        if count > 1:
            raise errors.InputError(f"{name!r} is named twice", "ensemble.name")
    for label, model in models.items():
        if model.family != "measured":
            continue
        for scene in model.settings["files"]:
            if scene not in scenes:
                unknown = errors.unknown_name("scene", scene, scenes)
                raise errors.InputError(str(unknown), f"models.{label}.files")


def _check_measured(models: Mapping[str, Work], scenes: Mapping[str, Scene]) -> None:
    """Raise `InputError` for a measured history that cannot be played back."""
    for label, model in models.items():
        if model.family != "measured":
            continue
        player = build(model.family, model.settings)
        for name in model.settings["files"]:
            try:
                player.simulate(scenes[name])
            except errors.InputError as error:
                raise errors.InputError(str(error), f"models.{label}") from None


def _check_measures(require: Require) -> None:
    """Raise `InputError` for a measure that is not of the kind that its key requires."""
    for key, texts, book in (
        ("difference", require.difference, measures.DIFFERENCES),
        ("model_form", require.model_form, measures.DIFFERENCES),
        ("figures", require.figures, measures.FIGURES),
        ("ensemble", require.ensemble, measures.STATISTICS),
    ):
        for text in texts:
            if measure_of(text).name not in book:
                raise errors.unknown_name(f"measure of require.{key}", text, book)


def _cells(scenes: Iterable[str], models: Mapping[str, Work]) -> Iterator[tuple[str, str]]:
    """Names of scene and model of each cell; a measured history plays only its own scenes."""
    for scene in scenes:
        for label, model in models.items():
            if model.family != "measured" or scene in model.settings["files"]:
                yield scene, label


def _joined(config: SuiteFile, path: Path, allow_code: Container[str]) -> Suite:
    """A suite that joins others; of one that joins others itself, its members."""
    forbidden = sorted(config.model_fields_set - {"include", "description"})
    if forbidden:
        raise errors.InputError(
            "cannot be given together with include: each suite that is joined has its own",
            forbidden[0],
        )
    members: list[Suite] = []
    for name in config.include:
        source = path.parent / name if Path(name).suffix.lower() == ".toml" else name
        members += load_suite(source, allow_code=allow_code).members
    _check_members(members)
    _check_modules(members)
    model_forms = [member.config.model_form for member in members if member.config.model_form]
    joined = {
        "reference": members[0].config.reference,
        "model_form": model_forms[0] if model_forms else "",
    }
    return Suite(
        name=errors.inert(path.stem),
        path=path,
        config=config.model_copy(update=joined),
        scenes=_merged_mappings(member.scenes for member in members),
        ensembles=_merged_mappings(member.ensembles for member in members),
        models=_merged_mappings(member.models for member in members),
        tolerances=_merged_mappings(member.tolerances for member in members),
        uncertain=_merged_mappings(member.uncertain for member in members),
        left_out=tuple(name for member in members for name in member.left_out),
        tolerances_path=path,
        included=tuple(members),
    )


def _merged_mappings(mappings: Iterable[Mapping[Key, Value]]) -> dict[Key, Value]:
    """One mapping with the items of all, in their order; a later value replaces an earlier one."""
    merged: dict[Key, Value] = {}
    for mapping in mappings:
        merged.update(mapping)
    return merged


def _check_members(members: Sequence[Suite]) -> None:
    """Raise `InputError` where a scene is in two suites, or their references differ."""
    names = Counter(name for member in members for name in (*member.scenes, *member.ensembles))
    for name, count in names.items():
        if count > 1:
            raise errors.InputError(f"scene {name!r} is in two of the suites", "include")
    first = members[0]
    for member in members:
        if member.config.reference != first.config.reference:
            raise errors.InputError(
                f"{member.name} and {first.name} have different references", "include"
            )


def _check_modules(members: Sequence[Suite]) -> None:
    """Raise `InputError` where two user-defined modules have one name.

    A process imports one module of a name.
    """
    paths: dict[str, set[Path]] = {}
    for member in members:
        for model in member.models.values():
            if not is_own(model.family):
                continue
            user_code = provenance.user_code(family(model.family).module, model.search_path)
            for module, file in user_code.files.items():
                paths.setdefault(module, set()).add(file)
    for module in sorted(paths):
        if len(paths[module]) > 1:
            first, second = sorted(paths[module])[:2]
            raise errors.InputError(
                f"module {module} is {printable(first)} and {printable(second)}: give one of them"
                " another name",
                "include",
            )


def _variant(
    label: str, settings: Mapping[str, Any], folder: Path, allow_code: Container[str]
) -> Work:
    """A model of a suite that lies in `folder`, with validated settings."""
    settings = dict(settings)
    name = str(settings.pop("model", label))
    try:
        check_allowed(name, allow_code)
    except errors.InputError as error:
        raise errors.InputError(error.reason, f"models.{printable(label)}") from None
    if is_own(name):
        search_path = (str(folder.absolute()),)
        return Work(label=label, family=name, settings=settings, search_path=search_path)
    if name == "measured" and isinstance(settings.get("files"), dict):
        settings["files"] = {
            scene: _files_beside(folder, given) for scene, given in settings["files"].items()
        }
    build(name, settings)
    return Work(label=label, family=name, settings=settings)


def _files_beside(folder: Path, given: Any) -> str | list[str]:
    """The paths of measured histories, which are given relative to the suite's folder."""
    if isinstance(given, list):
        return [str(folder / str(file)) for file in given]
    return str(folder / str(given))


def _scenes(config: SuiteFile, folder: Path) -> dict[str, files.UncertainScene]:
    """The scenes of a suite by name: named or in files, written out, and of grids."""
    scenes: dict[str, files.UncertainScene] = {}
    for scene in _all_scenes(config, folder):
        name = scene.scene.name
        if name in scenes:
            raise errors.InputError(f"scene {name!r} is named twice", "scenes")
        scenes[name] = scene
    return scenes


def _all_scenes(config: SuiteFile, folder: Path) -> Iterator[files.UncertainScene]:
    for name in config.scenes:
        is_file = Path(name).suffix == ".toml" and name not in files.named_scenes()
        yield files.load_uncertain_scene(folder / name if is_file else name)
    for number, table in enumerate(config.scene, 1):
        yield files.uncertain_scene_from(table, folder=folder, default_name=f"scene {number}")
    for grid in config.grid:
        for choice in itertools.product(*grid.axes):
            yield files.uncertain_scene(_combined(grid.scene, choice, folder), {}, {})


def _combined(base: dict[str, Any], choice: Sequence[dict[str, Any]], folder: Path) -> Scene:
    if not all(isinstance(alternative.get("name"), str) for alternative in choice):
        raise errors.InputError("each alternative needs a name", "grid.axes")
    names = [str(part["name"]) for part in (base, *choice) if "name" in part]
    table = {**reduce(_merged, choice, base), "name": "-".join(names)}
    return files.scene_from(table, folder=folder, default_name="scene")


def _merged(base: Any, change: Any) -> Any:
    """`change` over `base`: tables by key, lists of tables one by one, anything else replaced.

    An empty list leaves none.
    """
    if isinstance(base, dict) and isinstance(change, dict):
        return {**base, **{key: _merged(base.get(key), value) for key, value in change.items()}}
    if isinstance(base, list) and isinstance(change, list) and change:
        return [
            _merged(a, b) if b is not None else a for a, b in itertools.zip_longest(base, change)
        ]
    return change
