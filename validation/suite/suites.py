"""Suites: scenes, models with their settings, and the figures to be within tolerance.

In goes the path or name of a suite file (`suite_file` says what it may hold), or of a scene; out
comes a validated `Suite`, ready to run. The commands, the pytest plugin and Python users call it.
"""

from collections.abc import Collection, Container, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rockcheck.scenes import errors, files, printable
from rockcheck.validation.execute.models import PAPER_MODEL, REFERENCE
from rockcheck.validation.suite import (
    joining,
    motions,
    suite_checks,
    suite_models,
    suite_scenes,
)
from rockcheck.validation.suite.cells import Suite, cell_names
from rockcheck.validation.suite.suite_file import Limits, Require, SuiteFile
from rockcheck.validation.suite.tolerances import HORIZON, parse_tolerances

#: Time limit (s) of a simulation without a suite.
UNJUDGED_SECONDS = 900.0
DATA = Path(__file__).parents[1] / "data"


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
        return _validated(SuiteFile(**tables), path, shipped, allow_code)
    except RecursionError:
        raise errors.InputError(
            f"{printable(path)}: include: the suite joins itself", file=path
        ) from None
    except errors.InputError as error:
        if error.file is not None:
            raise
        raise errors.InputError(f"{printable(path)}: {error}", file=path) from None


def _validated(config: SuiteFile, path: Path, shipped: bool, allow_code: Container[str]) -> Suite:
    """The suite of these keys; a `shipped` one's tolerances lie in the package."""
    if config.include:
        joining.check_keys(config)
        return joining.join(config, path, _included(config, path.parent, allow_code))
    folder = path.parent
    models = {
        label: suite_models.variant_of(label, settings, folder, allow_code)
        for label, settings in config.models.items()
    }
    uncertain, left_out = motions.under_records(
        suite_scenes.scenes_of(config, folder), config.records, folder
    )
    scenes = {name: uncertain_scene.scene for name, uncertain_scene in uncertain.items()}
    ensembles = {
        ensemble.name: (
            ensemble,
            files.scene_from(ensemble.scene, folder=folder, default_name=ensemble.name),
        )
        for ensemble in config.ensemble
    }
    suite_checks.check_references(config, models)
    suite_checks.check_names(config, models, scenes, ensembles)
    suite_checks.check_measures(config.require)
    suite_checks.check_measured(models, scenes)
    tables, tolerances_path = _tolerance_tables(config, path, shipped)
    try:
        tolerances = parse_tolerances(tables, cell_names(scenes, models))
        suite_checks.check_tolerances(tolerances, models)
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


def _included(config: SuiteFile, folder: Path, allow_code: Container[str]) -> list[Suite]:
    """The suites that a suite in `folder` joins; of one that joins others itself, its members."""
    members: list[Suite] = []
    for name in config.include:
        source = folder / name if Path(name).suffix.lower() == ".toml" else name
        members += load_suite(source, allow_code=allow_code).members
    return members


def _tolerance_tables(
    config: SuiteFile, path: Path, shipped: bool
) -> tuple[Mapping[str, Any], Path]:
    """The tables of tolerances and their file: the suite file, or one beside it."""
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
    suite = _validated(config, path, shipped, allow_code)
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
