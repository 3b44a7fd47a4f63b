"""What must fit together in a suite: references, names, measures, histories, tolerances.

In go the keys of the file with its models and scenes; what does not fit raises `InputError`.
`suites` calls it.
"""

from collections import Counter
from collections.abc import Collection, Mapping

from rockcheck.scenes import Scene, errors
from rockcheck.validation.discrepancy import measures
from rockcheck.validation.execute.models import Work, build
from rockcheck.validation.suite.suite_file import Require, SuiteFile
from rockcheck.validation.suite.tolerances import CELL_FIGURES, Tolerances, measure_of


def check_references(config: SuiteFile, models: Mapping[str, Work]) -> None:
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


def check_names(
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


def check_measured(models: Mapping[str, Work], scenes: Mapping[str, Scene]) -> None:
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


def check_measures(require: Require) -> None:
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


def check_tolerances(tolerances: Tolerances, models: Collection[str]) -> None:
    """Raise `InputError` for a tolerance against what is no model of the suite."""
    for key in tolerances:
        errors.one_of(
            f"reference of [{key.scene}.{key.model}]", key.against, [CELL_FIGURES, *models]
        )
