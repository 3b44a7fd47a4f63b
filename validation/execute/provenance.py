"""The key of a result, from all that it depends on; versions and hardware of a run.

A result depends on code, libraries, scene and settings.
"""

import ast
import contextlib
import hashlib
import json
import os
import platform
import re
import sys
import uuid
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib import metadata, resources
from importlib.machinery import EXTENSION_SUFFIXES, PathFinder
from importlib.util import find_spec
from itertools import accumulate, chain
from pathlib import Path
from typing import Any

from rockcheck.scenes import InputError, Scene
from rockcheck.scenes.history_files import events_path
from rockcheck.validation.execute import models
from rockcheck.validation.execute.store import Store, name_of

#: The package whose code counts where it can be reached; the package of the model itself always
#: does.
OWN_PACKAGE = "rockcheck"
#: The kind of results that a digest of our code is, in the user's own store.
CODE = "code"
#: Names of the folders that installed packages lie in.
INSTALLED = ("site-packages", "dist-packages")
#: What is installed, by the names of the packages that it gives.
_distributions = cache(metadata.packages_distributions)


def cell_key(
    scene: Scene, name: str, settings: Mapping[str, Any], search_path: tuple[str, ...] = ()
) -> str:
    """Hash of all that a cell's history depends on.

    That is scene, settings, the files of a measured history, the code that the model can reach, the
    versions of its libraries and of Python, and the machine type. `search_path` holds folders in
    which a user-defined model may lie. Its source is read, not run; its libraries are what that
    code imports.
    """
    given = settings["files"].get(scene.name, []) if name == "measured" else []
    code = reachable(models.home(name), search_path) if models.is_own(name) else {}
    files = [  # of a measured history, and of its events
        file
        for table in map(Path, [given] if isinstance(given, str) else given)
        for file in (table, events_path(table))
        if file.is_file()
    ]
    imported = [
        library
        for module, path in code.items()
        for one in _imports(path, module, lambda _: False, ())
        for library in _distributions().get(one.split(".")[0], ())
    ]
    return digest(
        json.dumps(
            {
                "scene": scene.model_dump(mode="json"),
                "model": name,
                "settings": dict(settings),
                "files": [hashlib.sha256(file.read_bytes()).hexdigest() for file in files],
                "code": code_digest(models.home(name), search_path),
                "libraries": {
                    library: version_of(library)
                    for library in (*models.NUMBERS, *models.family(name).libraries, *imported)
                },
                "python": platform.python_version(),
                "machine": platform.machine(),
            },
            sort_keys=True,
            default=str,
        )
    )


def digest(text: str) -> str:
    """A short hash of a text, 16 hex digits."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@cache
def code_digest(module: str, search_path: tuple[str, ...] = ()) -> str:
    """Hash of the code of a module and of all project modules that it imports.

    Imports count at its top and inside functions. The hash is that of the syntax trees without
    docstrings: comments, layout and documentation do not count. For rockcheck's own modules it is
    kept for later processes, under a hash of all our sources. A module without a file, as in a
    notebook, has another one in each run: nobody can say that its code is still the same. A run
    clears the cache: files may have changed.
    """
    with contextlib.suppress(InputError, OSError):  # there may be no folder to keep it in
        if module.split(".")[0] == OWN_PACKAGE:
            user = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "rockcheck"
            user.mkdir(mode=0o700, parents=True, exist_ok=True)
            kept, name = Store(user, (CODE,)), name_of(module, _of_all_sources())
            kept.prune()
            return kept.once(CODE, name, str, lambda: _digest_of(module, search_path))
    return _digest_of(module, search_path)


def _digest_of(module: str, search_path: tuple[str, ...]) -> str:
    return digest(
        "".join(
            f"{name}\n{_source_of(path, path.stat().st_mtime_ns)[1]}\n"
            for name, path in sorted(reachable(module, search_path).items())
        )
        or uuid.uuid4().hex
    )


@cache
def _of_all_sources() -> str:
    """Hash of all our sources, and of the Python that reads them."""
    root = Path(str(resources.files(OWN_PACKAGE)))
    # a folder below the root may be a link to the folder of the sources
    sources = sorted((*root.glob("*.py"), *root.glob("*/**/*.py")))
    texts = (f"{one.name}\n{one.read_text(encoding='utf-8')}" for one in sources)
    return digest("\n".join([platform.python_version(), *texts]))


def reachable(module: str, search_path: tuple[str, ...] = ()) -> dict[str, Path]:
    """Names and files of the project modules that `module` can import, itself included.

    Those of its own package, of rockcheck, and what lies beside a script or package of the user's
    own. The packages that contain a module count, but not the other modules that they import.
    """
    found: dict[str, Path] = {}
    top, home = module.split(".")[0], _folder(module, search_path)
    # Beside rockcheck, or an installed package, lie those of others.
    together = top != OWN_PACKAGE and home is not None and home.name not in INSTALLED

    def ours(name: str) -> bool:
        return name.split(".")[0] in (OWN_PACKAGE, top) or (
            together and _folder(name, search_path) == home
        )

    waiting = [module]
    while waiting:
        name = waiting.pop()
        path = _source(name, search_path) if ours(name) else None
        if path and name not in found:
            found[name] = path
            package = name if path.name == "__init__.py" else name.rpartition(".")[0]
            waiting += _imports(path, package, ours, search_path)
    above = {one for name in found for one in accumulate(name.split(".")[:-1], "{}.{}".format)}
    return {one: path for one in above if (path := _source(one, search_path))} | found


def _folder(name: str, search_path: tuple[str, ...]) -> Path | None:
    """The folder that a module's topmost package, or the module itself, lies in."""
    path = _source(name.split(".")[0], search_path)
    return path.parents[path.name == "__init__.py"] if path else None


@cache
def _source(name: str, search_path: tuple[str, ...]) -> Path | None:
    """The file of a module, None where there is none (a name inside a module).

    No code of `search_path` is run.
    """
    top, *inner = name.split(".")
    try:
        spec = find_spec(top) or PathFinder.find_spec(top, list(search_path))
        origin = spec and spec.origin
    except ValueError:  # it is loaded, as a script is, and has no spec
        origin = getattr(sys.modules.get(top), "__file__", None)
    path = Path(origin) if origin and os.path.isfile(origin) else None  # not "<stdin>"
    if path and inner:
        base = path.parent.joinpath(*inner)
        return next(
            (
                file
                for ending in ("/__init__.py", ".py", *EXTENSION_SUFFIXES)
                if (file := Path(f"{base}{ending}")).is_file()
            ),
            None,
        )
    return path


def _imports(
    path: Path, package: str, ours: Callable[[str], bool], search_path: tuple[str, ...]
) -> Iterable[str]:
    """Names of the modules that a file of `package` imports.

    `from base import name` gives the submodule `base.name` of a project package if there is one,
    else `base`.
    """
    for node in _source_of(path, path.stat().st_mtime_ns)[0]:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        else:
            above = package.split(".")[: 1 - node.level or None] if node.level else []
            base = ".".join(filter(None, [*above, node.module]))
            for alias in node.names:
                inner = f"{base}.{alias.name}"
                yield (inner if ours(base) and _source(inner, search_path) else base)


@cache
def _source_of(path: Path, changed: int) -> tuple[list[ast.Import | ast.ImportFrom], str]:
    """What a source file imports, and its syntax tree without docstrings, as text.

    When the file was last `changed` counts for the cache only.

    A package that loads its parts as they are used imports what its stub says. Of a file that is no
    Python, such as a compiled module, a hash of its content.
    """
    imports = list[ast.Import | ast.ImportFrom]()
    try:
        tree, *stub = (
            ast.parse(one.read_bytes()) for one in (path, path.with_suffix(".pyi")) if one.is_file()
        )
    except (SyntaxError, ValueError):
        return imports, hashlib.sha256(path.read_bytes()).hexdigest()
    for node in chain.from_iterable(map(ast.walk, [tree, *stub])):
        if isinstance(node, ast.Import | ast.ImportFrom):
            imports.append(node)
        elif isinstance(
            node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
        ) and ast.get_docstring(node, clean=False):
            node.body = node.body[1:] or [ast.Pass()]
    return imports, ast.dump(tree)


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
