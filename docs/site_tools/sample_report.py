"""A hook of MkDocs: the report of the suite `smoke` is made when the site is built, and published
with it as sample/index.html.

The run is kept in build/sample-report, so that the next build plays only what has changed.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

SUITE, FOLDER = "smoke", Path(__file__).parents[2] / "build" / "sample-report"
#: What the pages show, and what they offer to keep.
SHOWN = {".html", ".css", ".js", ".svg", ".png", ".pdf", ".csv", ".json", ".xml", ".toml"}


def on_files(files: Files, config: MkDocsConfig, **_: Any) -> Files:
    """The site's files and those of the report; histories of earlier runs are left out."""
    command = [
        sys.executable,
        "-m",
        "rockcheck",
        "validate",
        SUITE,
        "--out",
        str(FOLDER),
        "--quiet",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise PluginError(
            f"the sample report: {' '.join(command[1:])} ended with {done.returncode}:"
            f" {done.stderr.strip()}"
        )
    pages = "".join(page.read_text(encoding="utf-8") for page in FOLDER.rglob("*.html"))
    for path in sorted(path for path in FOLDER.rglob("*") if path.suffix in SHOWN):
        place = path.relative_to(FOLDER)
        if place.parts[0] != "comparisons" and (
            place.parts[0] != "histories" or path.name in pages
        ):
            files.append(
                File.generated(config, f"sample/{place.as_posix()}", abs_src_path=str(path))
            )
    return files
