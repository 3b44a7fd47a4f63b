"""Which files a command has written into a folder: the next one removes what is left over.

In: names of files, relative to the folder, with slashes. Out: their hashes, kept in a file with a
hash of all that they were made of, and later the names of those that nobody has changed since.
Called by `document` and `site`.
"""

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from pydantic import Field, TypeAdapter, ValidationError

from rockcheck.scenes import InputError, reading, writing
from rockcheck.validation.discrepancy.figures import Stored

#: The files of a run's pages, in the folder of the run.
MANIFEST = "pages/files.json"
#: Hashes of files by their names.
HASHES = TypeAdapter(dict[str, str])


class Manifest(Stored):
    """The files of pages by their names, each with its hash, and a hash of what they show."""

    made_of: str = ""
    files: dict[str, str] = Field(default_factory=dict)


def hash_of(content: str | bytes) -> str:
    """SHA-256 of a file's content, by which the next run knows it for its own."""
    return hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()


def read(folder: Path) -> Manifest:
    """What is known of the pages that are in a folder; nothing where there are none."""
    try:
        return Manifest.model_validate(reading.read_json(_inside(folder, MANIFEST)))
    except (InputError, ValidationError):
        return Manifest()


def write(folder: Path, paths: Iterable[Path], made_of: str) -> None:
    """Keep the hashes of files that have been written into a folder, and of what they show."""
    hashes = {
        path.relative_to(folder).as_posix(): hash_of(reading.read_bytes(path)) for path in paths
    }
    kept = Manifest(made_of=made_of, files=hashes)
    writing.write_whole(folder / MANIFEST, writing.json_text(kept.model_dump()) + "\n")


def is_whole(folder: Path, made_of: str) -> bool:
    """Whether a folder has all pages that are made of this, and nobody has changed one."""
    kept = read(folder)
    if not kept.files or kept.made_of != made_of:
        return False
    return {name for name, _ in unchanged(folder, kept.files)} == set(kept.files)


def unchanged(folder: Path, hashes: Mapping[str, str]) -> Iterator[tuple[str, bytes]]:
    """Files of a folder that still have these hashes, with their contents.

    No other file is taken for one: not that of a user, nor what a stranger's folder links to.
    """
    for name, expected in hashes.items():
        with suppress(InputError):
            content = reading.read_bytes(_inside(folder, name))
            if hash_of(content) == expected:
                yield name, content


def remove_left_over(folder: Path, hashes: Mapping[str, str], kept: Iterable[str] = ()) -> None:
    """Remove the files of these hashes that are `unchanged`, but for those that are `kept`."""
    kept = set(kept)
    remove(folder, [name for name, _ in unchanged(folder, hashes) if name not in kept])


def remove(folder: Path, names: Iterable[str]) -> None:
    """Remove files of a folder; raises `InputError` where a link leads out of it."""
    for name in names:
        *parts, last = name.split("/")
        (reading.within(folder, *parts) / last).unlink(missing_ok=True)


def _inside(folder: Path, name: str) -> Path:
    return reading.within(folder, *name.split("/"))
