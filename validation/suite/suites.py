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
import os
from collections import Counter
from collections.abc import Collection, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from rockcheck.ebm.horizon import may_fly
from rockcheck.scenes import Frozen, Positive, Scene, errors, files, printable
from rockcheck.validation.discrepancy import measures
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import (
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
    accepted_in,
    measure_of,
    parse_tolerances,
)

#: Time limit (s) of a simulation without a suite.
UNJUDGED_SECONDS = 900.0
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

    @cached_property
    def _judged(self) -> dict[tuple[str, str], list[ToleranceKey]]:
        found: dict[tuple[str, str], list[ToleranceKey]] = {}
        for place in self.tolerances:
            found.setdefault((place.scene, place.model), []).append(place)
        return found

    @property
    def members(self) -> tuple[Suite, ...]:
        """The suites that it joins, or the suite itself."""
        return self.included or (self,)

    @property
    def owners(self) -> dict[str, Suite]:
        """The part that each scene or ensemble comes from."""
        return {place: part for part in self.members for place in (*part.scenes, *part.ensembles)}

    def cells(self) -> Iterator[tuple[Scene, Work, motions.Ensemble | None]]:
        """All cells, scene by scene; then the ensembles with the scene that they are drawn from."""
        for kind in ("scenes", "ensembles"):
            for part in self.members:
                for name, model in _played(getattr(part, kind), part.models):
                    ensemble, scene = part.ensembles.get(name) or (None, part.scenes[name])
                    yield scene, part.models[model], ensemble

    def only(self, scene: str, model: str) -> Suite:
        """The suite with one cell, and the references that it is compared with."""
        own = self.owners.get(scene, self)
        for what, name, known in (
            ("scene", scene, self.scenes),
            ("model", model, [label for _, label in _played([scene], own.models)]),
        ):
            errors.one_of(f"{what} of the suite", name, known)
        yardstick = own.config.reference, OWN_FIGURES  # if it is as expected itself
        tolerances = {
            place: line
            for place, line in own.tolerances.items()
            if place.scene == scene and (place.model == model or place[1:3] == yardstick)
        }
        needed = {model, *own.yardsticks(tolerances)}
        return replace(
            own,
            scenes={scene: own.scenes[scene]},
            ensembles={},
            models={label: variant for label, variant in own.models.items() if label in needed},
            tolerances=tolerances,
        )

    def required(self, place: str, model: str) -> dict[ToleranceKey, results.Kind]:
        """The checks of a cell, with their kinds: those required or given a tolerance.

        `place` is a scene or an ensemble of this very suite, not of one that it joins.
        """
        given, require = self.config, self.config.require
        if place in self.ensembles:
            require = Require(difference=require.ensemble)
        places = [
            ToleranceKey(place, model, against, text)
            for against, texts in (
                (OWN_FIGURES, require.figures),
                (given.reference, require.difference),
                (given.model_form, require.model_form),
            )
            if against == OWN_FIGURES or (against and model not in (given.reference, against))
            for text in texts
        ]
        return {one: self.kind(one) for one in (*places, *self._judged.get((place, model), ()))}

    def yardsticks(self, checks: Iterable[ToleranceKey]) -> list[str]:
        """`OWN_FIGURES`, then the models that cells with these checks are compared with."""
        usual = OWN_FIGURES, self.config.reference, self.config.model_form
        return list(dict.fromkeys((*usual, *(place.against for place in checks))))

    def kind(self, place: ToleranceKey) -> results.Kind:
        """The kind of a check.

        Where the block may fly, a model that cannot differs in form from one that can.
        """
        if place.against == OWN_FIGURES:
            return "exact" if measure_of(place.windowed).exact else "absolute"
        families = [self.models[label].family for label in (place.model, place.against)]
        if "measured" in families:
            return "measured"
        scene = (
            self.ensembles[place.scene][1]
            if place.scene in self.ensembles
            else self.scenes[place.scene]
        )
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
            f" a suite is a file with scenes = [{printable(path.name)!r}], and tables [models.NAME]"
        )
    try:
        return _suite(SuiteFile(**tables), path, shipped, allow_code)
    except RecursionError:
        raise errors.InputError(f"{printable(path)}: include: the suite joins itself") from None
    except errors.InputError as error:
        # What begins with the name of a file, this one or one beside it, has no key and no quote.
        file, beside = str(error).partition(": ")[0], f"{printable(path.parent)}{os.sep}"
        told = file.startswith(beside) or not (error.key or "'" in file)
        raise errors.InputError(str(error) if told else f"{printable(path)}: {error}") from None


def _suite(given: SuiteFile, path: Path, shipped: bool, allow_code: Container[str]) -> Suite:
    if given.include:
        return _joined(given, path, allow_code)
    models = {
        label: _variant(label, settings, path.parent, allow_code)
        for label, settings in given.models.items()
    }
    uncertain, left_out = motions.under_records(
        _scenes(given, path.parent), given.records, path.parent
    )
    scenes = {name: found.scene for name, found in uncertain.items()}
    ensembles = {
        e.name: (e, files.scene_from(e.scene, folder=path.parent, default_name=e.name))
        for e in given.ensemble
    }
    _check_names(given, models, scenes, ensembles)
    beside = (
        DATA / "tolerances" / path.name
        if shipped
        else path.with_name(f"{path.stem}.tolerances.toml")
    )
    tables, tolerances_path = given.tolerances, path
    if tables is None:
        tables, tolerances_path = files.read_toml(beside) if beside.exists() else {}, beside
    try:
        tolerances = parse_tolerances(tables, _played(scenes, models))
        for at in tolerances:
            errors.one_of(
                f"reference of [{at.scene}.{at.model}]", at.against, [OWN_FIGURES, *models]
            )
    except errors.InputError as error:
        raise errors.InputError(f"{printable(tolerances_path)}: {error}") from None
    return Suite(
        name=errors.inert(path.stem),
        path=path,
        config=given,
        scenes=scenes,
        ensembles=ensembles,
        models=models,
        tolerances=tolerances,
        tolerances_path=tolerances_path,
        uncertain={name: one for name, one in uncertain.items() if one.spreads},
        left_out=tuple(left_out),
    )


def scene_suite(
    source: str,
    models: Mapping[str, Mapping[str, Any]],
    *,
    records: Sequence[motions.RecordSet] = (),
    allow_code: Container[str] = (),
) -> Suite:
    """One scene (a name or a .toml file) by some models, perhaps under records: nothing is judged.

    `models` gives the settings of each. Differences are from `ebm-unilateral`, or from the first
    model without it. User-defined models are looked for in the working folder. Raises `InputError`
    as `load_suite`.
    """
    known = files.named_scenes()
    path = Path(f"{source}.toml" if source in known else source)
    reference = REFERENCE if REFERENCE in models else next(iter(models))
    given = SuiteFile(
        reference=reference,
        model_form=PAPER_MODEL if PAPER_MODEL in models and reference == REFERENCE else "",
        scenes=(source if source in known else path.name,),
        records=tuple(records),
        models={name: dict(settings) for name, settings in models.items()},
        require=Require(difference=(f"theta_rms@{HORIZON}",)),
        limits=Limits(seconds=UNJUDGED_SECONDS),
        tolerances={},
    )
    suite = _suite(given, path, source in known, allow_code)
    variants = {
        name: replace(one, search_path=(str(Path.cwd()),)) if one.search_path else one
        for name, one in suite.models.items()
    }
    return replace(suite, models=variants, judged=False)


def accept(
    suite: Suite, run: results.Run, reason: str | None, *, write: bool = True
) -> tuple[list[str], list[str]]:
    """Write the figures of `run` into the tolerance file of `suite`.

    Returns the changes and the refusals, a line each. A change is new, tightened (to a better
    value), loosened (a wider limit) or moved (another expected value); the last two need a
    `reason`, which goes into the file. A check without a figure, and a line that would not pass
    now, is always refused; a figure that is not defined needs no line. Without `write` the file
    stays as it is.
    """
    checks = [pair for pair in run.checks() if pair[1].verdict != "not defined"]
    found = [
        accepted_in(
            part.tolerances_path,
            [(c, one) for c, one in checks if c.scene in part.scenes or c.scene in part.ensembles],
            reason,
            nested=part.tolerances_path == part.path,
            write=write,
        )
        for part in suite.members
    ]
    changes, refused = (
        list(itertools.chain.from_iterable(lines)) for lines in zip(*found, strict=True)
    )
    return changes, refused


def is_scene(source: str) -> bool:
    """Whether `source` is the name or file of a scene, rather than of a suite.

    Raises `InputError` for a file that is no TOML.
    """
    path = Path(source)
    return source not in named_suites() and (
        source in files.named_scenes()
        or (path.suffix.lower() == ".toml" and "block" in files.read_toml(path))
    )


def _check_names(
    given: SuiteFile,
    models: Mapping[str, Work],
    scenes: Collection[str],
    ensembles: Collection[str],
) -> None:
    known = ", ".join(models) or "none"
    count = Counter((*scenes, *(one.name for one in given.ensemble)))
    errors.refuse(
        *(
            (one and one not in models, f"{one!r} is not among the suite's models: {known}", key)
            for key, one in (("reference", given.reference), ("model_form", given.model_form))
        ),
        (
            given.require.model_form and not given.model_form,
            "needs the key model_form, which says against which model",
            "require.model_form",
        ),
        (not models, "no model; at least the reference is needed", "models"),
        (not scenes and not ensembles, "no scene; at least one is needed", "scenes"),
        *((n > 1, f"{one!r} is named twice", "ensemble.name") for one, n in count.items()),
        *(
            (
                scene not in scenes,
                str(errors.unknown_name("scene", scene, scenes)),
                f"models.{label}.files",
            )
            for label, model in models.items()
            if model.family == "measured"
            for scene in model.settings["files"]
        ),
    )
    for key, texts in given.require:
        book = {"figures": measures.FIGURES, "ensemble": measures.STATISTICS}.get(
            key, measures.DIFFERENCES
        )
        for text in texts:
            if measure_of(text).name not in book:
                raise errors.unknown_name(f"measure of require.{key}", text, book)


def _played(scenes: Iterable[str], models: Mapping[str, Work]) -> Iterator[tuple[str, str]]:
    """Names of scene and model of each cell; a measured history plays only its own scenes."""
    return (
        (scene, label)
        for scene in scenes
        for label, model in models.items()
        if model.family != "measured" or scene in model.settings["files"]
    )


def _joined(given: SuiteFile, path: Path, allow_code: Container[str]) -> Suite:
    errors.refuse(
        *(
            (
                key,
                "cannot be given together with include: each suite that is joined has its own",
                key,
            )
            for key in sorted(given.model_fields_set - {"include", "description"})
        )
    )
    included = [
        part  # of a suite that joins others, these: only they say what is required
        for name in given.include
        for part in load_suite(
            path.parent / name if Path(name).suffix.lower() == ".toml" else name,
            allow_code=allow_code,
        ).members
    ]
    first = included[0]
    names = Counter(name for suite in included for name in (*suite.scenes, *suite.ensembles))
    own = {
        place
        for suite in included
        for model in suite.models.values()
        if is_own(model.family)
        for place in provenance.reachable(family(model.family).module, model.search_path).items()
    }
    errors.refuse(
        *(
            (count > 1, f"scene {name!r} is in two of the suites", "include")
            for name, count in names.items()
        ),
        *(
            (
                one.config.reference != first.config.reference,
                f"{one.name} and {first.name} have different references",
                "include",
            )
            for one in included
        ),
        *(  # a process imports one module of a name
            (
                one == other,
                f"module {one} is {printable(path)} and {printable(place)}: give one of them"
                " another name",
                "include",
            )
            for (one, path), (other, place) in itertools.combinations(sorted(own), 2)
        ),
    )
    whole: dict[str, Any] = {
        what: {key: one for suite in included for key, one in getattr(suite, what).items()}
        for what in ("scenes", "ensembles", "models", "tolerances", "uncertain")
    }
    return Suite(
        name=errors.inert(path.stem),
        path=path,
        config=given.model_copy(
            update={
                "reference": first.config.reference,
                "model_form": next(filter(None, (s.config.model_form for s in included)), ""),
            }
        ),
        tolerances_path=path,
        left_out=tuple(name for suite in included for name in suite.left_out),
        included=tuple(included),
        **whole,
    )


def _variant(
    label: str, settings: Mapping[str, Any], folder: Path, allow_code: Container[str]
) -> Work:
    settings = dict(settings)
    name = str(settings.pop("model", label))
    if name == "measured" and isinstance(settings.get("files"), dict):
        settings["files"] = {
            scene: [str(folder / str(one)) for one in files]
            if isinstance(files, list)
            else str(folder / str(files))
            for scene, files in settings["files"].items()
        }
    own = is_own(name)
    try:
        check_allowed(name, allow_code)
    except errors.InputError as error:
        raise errors.InputError(error.reason, f"models.{printable(label)}") from None
    if not own:
        build(name, settings)
    path = (str(folder.absolute()),) if own else ()
    return Work(label=label, family=name, settings=settings, search_path=path)


def _scenes(given: SuiteFile, folder: Path) -> dict[str, files.UncertainScene]:
    found: dict[str, files.UncertainScene] = {}
    for scene in itertools.chain(
        (
            files.load_uncertain_scene(
                name
                if name in files.named_scenes() or Path(name).suffix != ".toml"
                else folder / name
            )
            for name in given.scenes
        ),
        (
            files.uncertain_scene_from(table, folder=folder, default_name=f"scene {n}")
            for n, table in enumerate(given.scene, 1)
        ),
        (
            files.uncertain_scene(_combined(grid.scene, choice, folder), {}, {})
            for grid in given.grid
            for choice in itertools.product(*grid.axes)
        ),
    ):
        name = scene.scene.name
        if name in found:
            raise errors.InputError(f"scene {name!r} is named twice", "scenes")
        found[name] = scene
    return found


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
