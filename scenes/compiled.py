"""Compiled functions whose cache can be trusted.

numba's own cache looks at a function's own file only: after a change in a function that it calls, the old machine code would
be used silently. Here the cache folder is named after the content of all source files of the function's package.
"""

from __future__ import annotations

import gc
import hashlib
import os
import shutil
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core import config as numba_config
from numba.core.event import Event, Listener, register
from numba.extending import register_jitable

config: Any = numba_config

_KEPT = 7 * 86400.0  # s


class _NoCollection(Listener):
    """Collects no garbage while numba compiles: to search all that a compiler keeps for cycles takes a tenth of its time."""

    def __init__(self) -> None:
        self.depth = 0
        self.wanted = False

    def on_start(self, event: Event) -> None:
        """A compilation begins, perhaps inside another one; numba's lock admits one thread."""
        if self.depth == 0:
            self.wanted = gc.isenabled()
            gc.disable()
        self.depth += 1

    def on_end(self, event: Event) -> None:
        """A compilation ends."""
        self.depth -= 1
        if self.depth == 0 and self.wanted:
            gc.enable()


register("numba:compile", _NoCollection())


@cache
def _cache_folder(package: Path) -> str:
    digest = hashlib.sha256()
    for source in [Path(__file__), *sorted(package.glob("*.py"))]:
        digest.update(source.name.encode() + b"\0" + source.read_bytes())
    name = f"{package.name}-kernels-{digest.hexdigest()[:16]}"
    base = Path(config.CACHE_DIR) if config.CACHE_DIR else package / "__pycache__"
    try:
        folder = base / name
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
        for old in base.glob(f"{package.name}-kernels-*"):
            if old != folder and time.time() - old.stat().st_mtime > _KEPT:  # another process may be using a younger one
                shutil.rmtree(old, ignore_errors=True)
    except OSError:  # installed where we may not write
        folder = Path(tempfile.gettempdir()) / f"rockcheck-{os.getuid() if hasattr(os, 'getuid') else 'user'}" / name
    return str(folder)


def kernel(function: Callable[..., Any]) -> Any:
    """Compiles `function` with numba on its first call, cached on disk until any source of its package changes.

    The compiled code releases the interpreter's lock, so that batches run on threads, and divides as IEEE 754 does (no
    exception for a zero divisor). Under NUMBA_DISABLE_JIT=1, as for a debugger or to measure coverage, it is interpreted and
    divides likewise.
    """
    if config.DISABLE_JIT:
        return np.errstate(all="ignore")(function)
    compiled = numba.njit(nogil=True, error_model="numpy", _nrt=True, no_cfunc_wrapper=True)(function)
    before = config.CACHE_DIR
    config.CACHE_DIR = _cache_folder(Path(function.__code__.co_filename).parent)
    try:
        compiled.enable_caching()
    finally:
        config.CACHE_DIR = before
    return compiled


def inner_kernel(function: Callable[..., Any]) -> Any:
    """A part of kernels that neither makes nor returns an array, but works on those that it is given.

    It is compiled into the kernels that call it, without the counting of references, atomic operations that cost as much as a
    short loop, and without an entrance for Python, where it stays the function that it is. numba refuses to compile one that
    makes an array; one that returns an array would free it too early.
    """
    return register_jitable(error_model="numpy", _nrt=False)(function)
