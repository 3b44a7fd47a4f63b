"""A scene back as the files it could have come from, so that anyone can play it again."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import tomlkit

from rockcheck.scenes import Scene
from rockcheck.scenes.excitations import Record
from rockcheck.scenes.writing import write_whole


def write_scene_file(scene: Scene, folder: Path, slug: str) -> dict[str, str]:
    """Write the scene as `<slug>.toml` with its records as CSV beside it; returns file names and
    texts, the TOML first.

    `load_scene` reads the file back to a scene that moves in the same way.
    """
    document, records = scene_tables(scene, slug)
    files = {f"{slug}.toml": tomlkit.dumps(document)}
    for name, record in records.items():
        rows = [f"{record.time_step * n:.12g},{value!r}" for n, value in enumerate(record.unscaled)]
        files[name] = (
            "\n".join(
                [f"# {re.sub(r'[^ -~]', '?', record.source)}", "time_s,acceleration_m_s2", *rows]
            )
            + "\n"
        )
    for name, text in files.items():
        write_whole(folder / name, text)
    return {name: text for name, text in files.items() if name.endswith(".toml")} | dict.fromkeys(
        records, ""
    )


def scene_tables(scene: Scene, slug: str) -> tuple[dict[str, Any], dict[str, Record]]:
    """A scene as the tables of a scene file, what is at its default left out, and its records by
    file name."""
    records: dict[str, Record] = {}
    tables: dict[str, Any] = scene.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    for key in ("excitation", "vertical"):
        excitation = getattr(scene, key)
        if key not in tables:
            continue
        table = {"kind": excitation.kind} | tables[key]
        if isinstance(excitation, Record):
            name = f"{slug}-{key}.csv"
            records[name] = excitation
            table = {"kind": "record", "file": name, "scale": excitation.scale}
        tables[key] = table
    plain = {key: value for key, value in tables.items() if not isinstance(value, dict | list)}
    return plain | {key: value for key, value in tables.items() if key not in plain}, records
