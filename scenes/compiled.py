"""Compiled functions with a safe cache on disk.

numba's own cache looks at a function's own file only. After a change in a function that it calls,
it would silently use the old machine code. Here the cache folder is named after the content of all
source files of the function's package, such as rockcheck.ebm with all below it. numba also runs any
code in its cache. Here a file is read only if this user wrote it and it is complete.
"""

import contextlib
import hashlib
import os
import pickle
import shutil
import stat
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any, cast

import numba
import numpy as np
from numba import types
from numba.core import config as numba_config, serialize
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.registry import CPUDispatcher
from numba.np import linalg

from rockcheck.scenes import progress
from rockcheck.scenes.reading import read_bytes
from rockcheck.scenes.writing import write_whole

# numba imports scipy.linalg (0.2 s) only to check that BLAS is there. It is, since rockcheck needs
# scipy; code that calls BLAS checks again when it is compiled.
_look, linalg.ensure_blas = linalg.ensure_blas, lambda: None
try:
    # Nothing here calls it: importing it tells numba how to compile arrays.
    from numba.np import arraymath  # noqa: F401
finally:
    linalg.ensure_blas = _look
config: Any = numba_config

#: Age up to which code compiled from other sources is kept, s.
_KEPT = 7 * 86400.0
#: A compilation that takes longer is announced, s.
_SILENT = 2.0
#: Purpose of each package's compiled code, for the announcement.
_PURPOSES = {
    "rockcheck.ebm": "the event-based models",
    "rockcheck.cm": "the continuous model",
    "rockcheck.engines": "the adaptive steps of the physics engines",
    "rockcheck.validation": "the loops of the studies",
}


@cache
def _tell(package: str) -> None:
    """Announce that a package's code is being compiled; once a process."""
    progress.announce(
        f"compiling {_PURPOSES.get(package, package)} for this machine, once a version: half a"
        " minute (`rockcheck warm` does it ahead)"
    )


@cache
def _cache_folder(package: Path) -> Path | None:
    """The private folder for a package's compiled code, or None if there can be none.

    None comes with a line on stderr. The folder's content is unpickled and run, so nobody else may
    write to it: it belongs to the user, is closed to all others, and lies in a folder that only the
    user, the package's owner or root may change.
    """
    # A kernel of any package may call inner kernels of this one, such as the cubic between rows.
    sources = [*sorted(Path(__file__).parent.glob("*.py")), *sorted(package.rglob("*.py"))]
    content = b"".join(one.name.encode() + b"\0" + one.read_bytes() for one in sources)
    name = f"{package.name}-kernels-{hashlib.sha256(content).hexdigest()[:16]}"
    user_wide = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "rockcheck"
    for base in (
        (Path(config.CACHE_DIR),) if config.CACHE_DIR else (package / "__pycache__", user_wide)
    ):
        with contextlib.suppress(OSError):  # such as a package in a folder that we may not write
            if base == user_wide:
                base.mkdir(mode=0o700, parents=True, exist_ok=True)
            folder = base.absolute() / name
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if _is_private(folder, package.stat().st_uid):
                with tempfile.TemporaryFile(dir=folder):
                    pass
                # Code of other sources goes; another process may be using it while it is young.
                for old in base.absolute().glob(f"{package.name}-kernels-*"):
                    if old != folder and time.time() - old.stat().st_mtime > _KEPT:
                        shutil.rmtree(old, ignore_errors=True)
                return folder
    print(
        "rockcheck: no private folder for compiled code, each run compiles anew: set"
        " NUMBA_CACHE_DIR to one of your own",
        file=sys.stderr,
    )
    return None


def _is_private(folder: Path, owner: int) -> bool:
    """Whether only the user can have made `folder` and written into it.

    `owner` is the user id of the code's owner. Always true on systems without user ids.
    """
    if not hasattr(os, "geteuid"):
        return True  # no owners and modes to check
    me, own, above = os.geteuid(), folder.lstat(), folder.parent.stat()
    others_write = stat.S_IWGRP | stat.S_IWOTH
    return (
        stat.S_ISDIR(own.st_mode)
        and own.st_uid == me
        and not own.st_mode & (stat.S_IRWXG | stat.S_IRWXO)
        and above.st_uid in (me, owner, 0)
        and (not above.st_mode & others_write or bool(above.st_mode & stat.S_ISVTX))
    )


def _call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
    """Signature of a call of a numba built-in (also `operator.add`), cached by argument types.

    numba tries some ten candidates at each call site: a tenth of the compile time.
    """
    known, asked = self.__dict__.setdefault("_rockcheck_known", {}), (args, tuple(kws.items()))
    if asked not in known:
        known[asked] = types.functions.BaseFunction.get_call_type(self, context, args, kws)
    return known[asked]


class _Compiler(Compiler):
    """numba's own compiler, which resolves each kind of call once (`_call_type`).

    Only one thread compiles: it holds numba's lock. A compilation longer than `_SILENT` is
    announced.
    """

    def _compile_core(self) -> Any:
        if "get_call_type" in vars(types.Function):  # within another compilation
            return super()._compile_core()
        package = ".".join(self.state.func_id.func.__module__.split(".")[:2])
        timer = threading.Timer(_SILENT, _tell, [package])
        timer.daemon = True
        if progress.announcer is not None:
            timer.start()
        types.Function.get_call_type = _call_type
        try:
            return super()._compile_core()
        finally:
            del types.Function.get_call_type
            timer.cancel()


class _Linked(JITCodeLibrary):
    """Code of an inner kernel, linked into its callers without machine code of its own.

    numba would make machine code of each inner kernel and of all that it calls, though nothing runs
    it: half of the compile time. Here only loops and arithmetic are simplified; full optimisation
    follows in the calling kernel.
    """

    def _optimize_final_module(self) -> None:
        passes, builder = self._codegen._module_pass_manager(
            opt=0, loop_vectorize=False, slp_vectorize=False, cost="cheap"
        )
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """0, no pointer: only kernels call an inner kernel."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> Any:
        """The object itself, whose `set_env` drops the environment of a function.

        Only code that needs Python uses the environment; no inner kernel does.
        """
        return self

    def set_env(self, env_name: str, env: object) -> None:
        """Do nothing (see `codegen`)."""


class _InnerCompiler(_Compiler):
    """A compiler whose result is only linked (see `_Linked`)."""

    def __init__(self, typing: Any, target: Any, library: Any, *about: Any) -> None:
        super().__init__(
            typing, target, library or _Linked(target.codegen(), "inner kernel"), *about
        )


class _Cache:
    """The compiled variants of one function, a file each that begins with the hash of the rest.

    It takes the place of numba's own cache, which would unpickle a damaged file. Here that is
    removed, and the function compiled again.
    """

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self.cache_path = folder
        self.name = f"{function.__module__}.{function.__qualname__}"

    def path(self, signature: Any, codegen: Any) -> Path:
        """The file of a function compiled for these types by this compiler for this processor."""
        key = numba.__version__, sys.version, signature, codegen.magic_tuple()
        about = hashlib.sha256(repr(key).encode()).hexdigest()
        return self.cache_path / f"{self.name[-100:]}-{about[:32]}.nbc"

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        """The compiled function for a signature; None if it is absent, damaged or unusable."""
        path = self.path(sig, target_context.codegen())
        if not os.path.lexists(path):  # nothing to remove: another process may be about to write it
            return None
        with contextlib.suppress(Exception):
            content = read_bytes(path)
            if hashlib.sha256(content[32:]).digest() == content[:32]:
                target_context.refresh()
                return CompileResult._rebuild(target_context, *pickle.loads(content[32:]))
        with contextlib.suppress(OSError):
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
        return None

    def save_overload(self, sig: Any, data: CompileResult) -> None:
        """Keep a compiled function, unless it holds addresses of this process.

        It is usable even if it cannot be written.
        """
        if not data.library.has_dynamic_globals:
            content = serialize.dumps(data._reduce())
            with contextlib.suppress(OSError):
                path = self.path(sig, data.codegen)
                write_whole(path, hashlib.sha256(content).digest() + content)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile `function` with numba on its first call, with a cache on disk.

    The cache holds until any source of the function's package, or a module of `rockcheck.scenes`,
    changes; it may call kernels of no other package. The compiled code releases the interpreter's
    lock, so that batches run on threads, and divides as IEEE 754 does (no exception for a zero
    divisor). Under NUMBA_DISABLE_JIT=1, as for a debugger or to measure coverage, it is interpreted
    and divides likewise.
    """
    if config.DISABLE_JIT:
        return np.errstate(all="ignore")(function)
    compiled = numba.njit(
        nogil=True, error_model="numpy", _nrt=True, no_cfunc_wrapper=True, pipeline_class=_Compiler
    )(function)
    # Folders from the source up to its package: up to rockcheck.ebm from rockcheck.ebm.core.march.
    above = max(function.__module__.count(".") - 2, 0)
    folder = _cache_folder(Path(function.__code__.co_filename).parents[above])
    if folder is not None:
        compiled._cache = _Cache(function, folder)
    return compiled


def for_types_of(compiled: Any, *args: Any) -> Callable[..., Any]:
    """A kernel's machine code for the types of these arguments, from the cache if it is there.

    For a loop in Python that calls the same kernel many times: in each call numba inspects the
    types of all arguments, which takes longer than a short kernel (3 us for some tuples of arrays).
    """
    if config.DISABLE_JIT:
        return cast(Callable[..., Any], compiled)
    return cast(Callable[..., Any], compiled.compile(tuple(map(compiled.typeof_pyval, args))))


def is_ready(compiled: Any, *args: Any) -> bool:
    """Whether a kernel runs at once for the types of these arguments: nothing is to be compiled."""
    if config.DISABLE_JIT:
        return True
    signature = tuple(map(compiled.typeof_pyval, args))
    cache, codegen = compiled._cache, compiled.targetctx.codegen()
    return signature in compiled.overloads or (  # or has a file, whole or not
        isinstance(cache, _Cache) and cache.path(signature, codegen).exists()
    )


def interpreted(compiled: Any) -> Callable[..., Any]:
    """The function of a kernel, for Python: the same figures, to the bit, a thousand times slower.

    The kernels that it calls must be inner ones.
    """
    return np.errstate(all="ignore")(compiled.py_func)


class _Inner(CPUDispatcher):
    """A function that kernels call: compiled once for each set of argument types.

    Python calls the plain function.
    """

    def __call__(self, *args: Any, **named: Any) -> Any:
        return self.py_func(*args, **named)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Resolve a call from a kernel, with constants typed as plain numbers.

        Otherwise each constant would have a compiled copy. The value is a constant again once the
        code is inlined.
        """
        return super().get_call_template(
            [_as_number(a) for a in args], {name: _as_number(a) for name, a in kws.items()}
        )


def _as_number(kind: Any) -> Any:
    """The number type of a constant, or of a member of an enumeration."""
    kind = types.unliteral(kind)
    return kind.dtype if isinstance(kind, types.IntEnumMember) else kind


def inner_kernel(function: Callable[..., Any], *, forceinline: bool = True) -> Any:
    """A part of kernels, inlined into its callers, that neither makes nor returns an array.

    It works on arrays that it is given. Most take many arguments, and a call would take longer than
    the work. It has no reference counting, whose atomic operations cost as much as a short loop,
    and no entry point for Python, which calls the plain function instead. numba refuses to compile
    one that makes an array; one that returns an array would free it too early.
    """
    if config.DISABLE_JIT:
        return function
    return _Inner(
        function,
        # All options are named: numba would take the first caller's for the others.
        targetoptions={
            "nopython": True,
            "error_model": "numpy",
            "_nrt": False,
            "forceinline": forceinline,
            "no_cpython_wrapper": True,
            "no_cfunc_wrapper": True,
        },
        pipeline_class=_InnerCompiler,
    )


#: An inner kernel that is called, not inlined: for long code with several call sites. Inlined, it
#: would be compiled again at each of them.
called_kernel = partial(inner_kernel, forceinline=False)
