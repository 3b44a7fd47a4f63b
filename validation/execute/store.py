"""The folder that keeps results for the next run: written whole, read only if still valid.

A result is valid if nothing that it depends on has changed.

| folder | a result |
|---|---|
| `histories/` | `.csv.gz`, `.events.csv.gz` (`History.save`); last `.json`, with their hashes |
| `comparisons/` | `.json`: a cell's comparisons, a batch's peaks, a horizon of predictability |
| `records/` | `.json`: the result of a study's task |

A name contains the hash of everything that the content depends on. So runs that share a folder can
only ever write the same thing, and a reader never meets a half-written or outdated result. Each
record holds the hash of its own name and content: a damaged, edited or exchanged record is ignored.
"""

import contextlib
import hashlib
import json
import re
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from pydantic import TypeAdapter

from rockcheck.scenes import History, InputError, errors, printable, reading, writing

T = TypeVar("T")
HISTORIES = "histories"
COMPARISONS = "comparisons"
RECORDS = "records"
#: What keeps a folder of results out of a repository: Git leaves out all that is in it.
GITIGNORE, IGNORED = ".gitignore", "# Results of rockcheck: its commands make them again.\n*\n"
#: Endings of a history's files.
TABLE = ".csv.gz"
SUFFIXES = {TABLE, f".events{TABLE}"}
#: Number of histories held in memory: a scene's are compared with each other.
RECENT = 16
#: Time (s) after which a result that no run has used is removed.
KEEP = 14 * 86400.0
#: What reads and writes values of a type; to make it takes longer than many a result.
adapter_of = cache(TypeAdapter)


def name_of(*parts: str) -> str:
    """A file name from scene, model and key, safe on any system."""
    return "--".join(re.sub(r"[^A-Za-z0-9._+=-]", "_", part) for part in parts)


@dataclass(frozen=True)
class Store:
    """The results of some kinds in a folder; raises `InputError` where that cannot be used."""

    folder: Path
    kinds: tuple[str, ...] = (HISTORIES, COMPARISONS)
    #: Those put or read last, with their names.
    _recent: deque[tuple[str, History]] = field(
        default_factory=lambda: deque(maxlen=RECENT), init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        try:
            for kind in self.kinds:
                writing.made(self.folder, kind)
        except OSError as error:
            raise InputError(
                f"{printable(self.folder)}: cannot be used as the output folder: {error.strerror}"
            ) from None

    def put(
        self,
        kind: str,
        name: str,
        content: Mapping[str, Any],
        files: Mapping[str, bytes] = MappingProxyType({}),
        history: History | None = None,
    ) -> None:
        """Keep a result: its record, and its files by suffix (".csv.gz", ".events.csv.gz"), if any.

        All of them are new, or all are as they were. With its first result a folder that holds
        nothing of a user gets a `.gitignore`.
        `history` is the content of the files; if given, it stays in memory.
        """
        self._keep_out_of_repositories()
        hashes = {suffix: _hash(content) for suffix, content in files.items()}
        record = writing.mapped(  # as it is read
            {**content, "files": hashes} if files else content,
            lambda one: errors.inert(one) if isinstance(one, str) else one,
        )
        text = json.dumps(
            {"content": record, "sha256": _seal(name, record)},
            sort_keys=True,
            separators=(",", ":"),
        )
        whole = {**files, ".json": f"{text}\n".encode()}
        writing.write_together(
            {self.folder / kind / f"{name}{at}": one for at, one in whole.items()}
        )
        if history is not None:
            self._recent.append((name, history))

    def _keep_out_of_repositories(self) -> None:
        mark = self.folder / GITIGNORE
        if mark.exists() or mark.is_symlink():
            return
        names = {HISTORIES, COMPARISONS, RECORDS}
        if all(
            path.name in names or (path / GITIGNORE).is_file() for path in self.folder.iterdir()
        ):
            writing.write_whole(mark, IGNORED)

    def load(self, name: str) -> History:
        """The history of that name, from memory if put or loaded lately, else from its file.

        Raises `InputError`.
        """
        found = dict(self._recent).get(name)
        if found is None:
            for suffix in SUFFIXES:
                reading.within(self.folder, HISTORIES, f"{name}{suffix}")
            found = History.load_with_extremes(self.folder / HISTORIES / f"{name}{TABLE}")
            self._recent.append((name, found))
        return found

    def get(self, kind: str, name: str) -> dict[str, Any] | None:
        """The record of a result; None where it, or one of its files, is missing or damaged."""
        try:
            path = reading.within(self.folder, kind, f"{name}.json")
            found = reading.read_json(path)
            content, sealed = found["content"], found["sha256"] == _seal(name, found["content"])
            files = content.pop("files", {})
            whole = (
                sealed
                and (kind != HISTORIES or TABLE in files)
                and files.keys() <= SUFFIXES
                and all(
                    _hash(reading.read_bytes(reading.within(path.parent, f"{name}{suffix}")))
                    == expected
                    for suffix, expected in files.items()
                )
            )
        except (InputError, AttributeError, KeyError, TypeError, ValueError, RecursionError):
            return None
        if whole:
            with contextlib.suppress(OSError):  # a read-only store can still be read
                path.touch()
        return content if whole else None

    def seal_of(self, kind: str, name: str) -> str:
        """The hash of what is kept under a name, with its files."""
        return str(reading.read_json(self.folder / kind / f"{name}.json")["sha256"])

    def once(self, kind: str, name: str, form: Any, compute: Callable[[], T]) -> T:
        """The kept value of type `form`; computed and kept where it is missing or invalid."""
        adapter: TypeAdapter[T] = adapter_of(form)
        with contextlib.suppress(KeyError, TypeError, ValueError):
            return adapter.validate_python((self.get(kind, name) or {})["kept"])
        found = compute()
        self.put(kind, name, {"kept": adapter.dump_python(found, mode="json")})
        return found

    def prune(self, now: float = 0.0) -> None:
        """Remove results unused for two weeks, and temporary files of killed runs after a day.

        `now` is a moment to be taken for today's, by `time.time`.
        """
        for path in [
            *(path for kind in self.kinds for path in (self.folder / kind).iterdir()),
            *self.folder.glob(".*.part"),
        ]:
            record = (
                path
                if path.suffix in (".json", ".part")
                else path.with_name(re.sub(r"(\.events)?\.csv(\.gz)?$", ".json", path.name))
            )
            used = record if record.is_file() else path
            # Another run was quicker, or it is a folder, which is not ours.
            with contextlib.suppress(OSError):
                if (now or time.time()) - used.lstat().st_mtime > (
                    86400.0 if path.suffix == ".part" else KEEP
                ):
                    path.unlink()


def _seal(name: str, content: Mapping[str, Any]) -> str:
    return _hash(json.dumps([name, content], sort_keys=True).encode())


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
