"""The key of a result, from all that it depends on; versions and hardware of a run.

In go a scene, a model with its settings, and the module that calculates; out come short hashes.
Suites and studies call it: a result is read back only under the key that it was kept under.

Code counts by folder, as its files are. A remark that changes is a change.
"""

import hashlib
import json
import os
import platform
import re
import sys
import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import metadata, resources
from importlib.machinery import PathFinder
from importlib.util import find_spec
from modulefinder import ModuleFinder
from pathlib import Path
from typing import Any

from rockcheck.scenes import Scene
from rockcheck.scenes.history_files import events_path
from rockcheck.validation.execute import models

#: The package whose code counts by folder.
PACKAGE = "rockcheck"
#: By folder of the package, the folders whose code it can call, itself included: imports point one
#: way. Nothing that is kept depends on `reports` or the commands.
FOLDERS = {
    "scenes": ("scenes",),
    "ebm": ("scenes", "ebm"),
    "cm": ("scenes", "cm"),
    "engines": ("scenes", "engines"),
    "validation": ("scenes", "ebm", "cm", "engines", "validation"),
}
#: What is installed, by the names of the packages that it gives.
_distributions = cache(metadata.packages_distributions)


def cell_key(
    scene: Scene, name: str, settings: Mapping[str, Any], search_path: tuple[str, ...] = ()
) -> str:
    """Hash of all that a cell's history depends on.

    That is scene, settings, the files of a measured history, the code of the folders that the model
    calls, the versions of its libraries and of Python, and the machine type. `search_path` holds
    folders in which a user-defined model may lie. Its source is read, not run; its libraries are
    what that code imports.
    """
    family = models.family(name)
    libraries = [*models.NUMBERS, *family.libraries]
    if models.is_own(name):
        libraries += user_code(family.module, search_path).libraries
    files = _measured_files(settings["files"].get(scene.name, [])) if name == "measured" else []
    return digest(
        json.dumps(
            {
                "scene": scene.model_dump(mode="json"),
                "model": name,
                "settings": dict(settings),
                "files": [_hash(file) for file in files],
                "code": code_digest(family.module, search_path),
                "libraries": {library: version_of(library) for library in libraries},
                "python": platform.python_version(),
                "machine": platform.machine(),
            },
            sort_keys=True,
            default=str,
        )
    )


def _measured_files(tables: str | list[str]) -> list[Path]:
    """The files of a measured history, with those of its events."""
    files: list[Path] = []
    for table in [tables] if isinstance(tables, str) else tables:
        path = Path(table)
        files += [file for file in (path, events_path(path)) if file.is_file()]
    return files


def digest(text: str) -> str:
    """A short hash of a text, 16 hex digits."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _hash(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


@cache
def code_digest(module: str, search_path: tuple[str, ...] = ()) -> str:
    """Hash of the code that a module can call.

    Of a module of rockcheck these are the folders in `FOLDERS`. Of a user's module they are all of
    them, and its files (`user_code`). A module without a file, as in a notebook, has another hash
    in each run: nobody can say that its code is still the same.
    """
    package, *inner = module.split(".")
    if package == PACKAGE:
        return digest("\n".join(_folder_digest(folder) for folder in FOLDERS[inner[0]]))
    files = user_code(module, search_path).files
    hashes = [f"{name} {_hash(file)}" for name, file in sorted(files.items())]
    return digest(
        "\n".join(
            [
                *(_folder_digest(folder) for folder in FOLDERS),
                *(hashes or [uuid.uuid4().hex]),
            ]
        )
    )


def sources_digest(*files: str) -> str:
    """Hash of these source files alone: for what takes hours, and calls few lines of a folder."""
    return digest("\n".join(_hash(Path(file)) for file in files))


@cache
def _folder_digest(folder: str) -> str:
    """Hash of the Python files in a folder of the package."""
    root = Path(str(resources.files(PACKAGE))) / folder
    files = sorted(root.rglob("*.py"))
    return digest("\n".join(f"{file.relative_to(root)} {_hash(file)}" for file in files))


def read_code_again() -> None:
    """Forget what was read of the code: a run calls it first, since files may have changed."""
    code_digest.cache_clear()
    _folder_digest.cache_clear()
    user_code.cache_clear()


@dataclass(frozen=True)
class UserCode:
    """The files of a user's module by module name, and the installed libraries it imports."""

    files: Mapping[str, Path]
    libraries: tuple[str, ...]


@cache
def user_code(module: str, search_path: tuple[str, ...] = ()) -> UserCode:
    """A user's module, and what it imports from the folder that it lies in.

    Imports count at the top and inside functions. No code is run. Libraries count by their version.
    """
    top = module.split(".")[0]
    file = _file_of(top, search_path)
    if file is None:
        return UserCode({}, ())
    folder = file.parents[1] if file.name == "__init__.py" else file.parent
    finder = _Imports(path=[str(folder)], excludes={PACKAGE, *_distributions()} - {top})
    try:
        if top == "__main__":
            finder.run_script(str(file))
        else:
            finder.import_hook(module)
    except (ImportError, SyntaxError):  # it cannot be played, which its cell will say
        pass
    files: dict[str, Path] = {}
    for name, imported in finder.modules.items():
        path = Path(getattr(imported, "__file__", None) or "")
        if path.is_file():
            files[name] = path
    libraries = {
        library
        for name in (top, *finder.badmodules)
        for library in _distributions().get(name.split(".")[0], ())
    }
    return UserCode(files or {module: file}, tuple(sorted(libraries)))


def _file_of(top: str, search_path: tuple[str, ...]) -> Path | None:
    """The file of a module or package; None where it has none, as in a notebook."""
    try:
        spec = find_spec(top) or PathFinder.find_spec(top, list(search_path))
        origin = spec and spec.origin
    except ValueError:  # it is loaded, as a script is, and has no spec
        origin = getattr(sys.modules.get(top), "__file__", None)
    return Path(origin) if origin and os.path.isfile(origin) else None  # not "<stdin>"


class _Imports(ModuleFinder):
    """What a module imports, without running it; what cannot be read counts as not there."""

    def find_module(self, name: str, path: Any, parent: Any = None) -> Any:
        try:
            return super().find_module(name, path, parent)
        except (AttributeError, TypeError):  # of a folder without __init__.py, in Python 3.11
            raise ImportError(name) from None

    def load_module(self, fqname: str, fp: Any, pathname: str, file_info: Any) -> Any:
        try:
            return super().load_module(fqname, fp, pathname, file_info)
        except (ValueError, RecursionError) as error:  # a NUL, or nested beyond all use
            raise ImportError(fqname) from error


@cache
def version_of(library: str) -> str:
    """A distribution's version, "absent" where it is not installed."""
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        return "absent"


def versions() -> dict[str, str]:
    """Versions of everything installed that a run's figures may depend on."""
    return {"rockcheck": version_of("rockcheck"), "python": platform.python_version()} | {
        name: version_of(name)
        for name in sorted({"pandas"}.union(*(one.libraries for one in models.FAMILIES.values())))
        if version_of(name) != "absent"
    }


def hardware() -> dict[str, str]:
    """Processor, cores, memory and system of this machine."""
    cpuinfo = Path("/proc/cpuinfo")
    text = cpuinfo.read_text(encoding="utf-8", errors="replace") if cpuinfo.exists() else ""
    named = re.search(r"^model name[^:\n]*:(.*)$", text, re.MULTILINE)
    facts = {
        "system": f"{platform.system()} {platform.release()}",
        "processor": named[1].strip() if named else platform.processor() or platform.machine(),
        "cores": str(os.cpu_count() or 1),
    }
    if hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
        facts["memory"] = (
            f"{os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE') / 2**30:.0f} GiB"
        )
    return facts
