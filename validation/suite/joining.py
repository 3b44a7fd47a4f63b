"""Suites that join others by `include`.

In go the keys of the joining file and the suites that it names; out comes one `Suite` with the
scenes, models and tolerances of all. `suites` calls it.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from rockcheck.scenes import errors, printable
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import family, is_own
from rockcheck.validation.suite.cells import Suite
from rockcheck.validation.suite.suite_file import SuiteFile

Key = TypeVar("Key")
Value = TypeVar("Value")


def check_keys(config: SuiteFile) -> None:
    """Raise `InputError` for a key that a suite cannot have beside `include`."""
    forbidden = sorted(config.model_fields_set - {"include", "description"})
    if forbidden:
        raise errors.InputError(
            "cannot be given together with include: each suite that is joined has its own",
            forbidden[0],
        )


def join(config: SuiteFile, path: Path, members: Sequence[Suite]) -> Suite:
    """The suite of the file `path` that joins `members`; raises `InputError` where it cannot."""
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
