"""The models of a suite, with their settings.

In go a label, its table in a suite file and the file's folder; out comes a validated `Work`. No
code that a file names is imported. `suites` calls it.
"""

from collections.abc import Container, Mapping
from pathlib import Path
from typing import Any

from rockcheck.scenes import errors, printable
from rockcheck.validation.execute.models import Work, build, check_allowed, is_own


def variant_of(
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
            scene: _files_beside(folder, paths) for scene, paths in settings["files"].items()
        }
    build(name, settings)
    return Work(label=label, family=name, settings=settings)


def _files_beside(folder: Path, paths: Any) -> str | list[str]:
    """The paths of measured histories, which are given relative to the suite's folder."""
    if isinstance(paths, list):
        return [str(folder / str(path)) for path in paths]
    return str(folder / str(paths))
