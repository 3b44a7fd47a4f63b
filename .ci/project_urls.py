"""Where the sources lie, written into pyproject.toml and CITATION.cff before a release is built:
`python .ci/project_urls.py https://HOST/OWNER/NAME`.

The repository itself names no host, so that a fork or a move needs no edit.
"""

from __future__ import annotations

import sys
from pathlib import Path

import tomlkit

#: By label, as package indexes show them: what follows the repository's address.
PAGES = {
    "Source": "",
    "Documentation": "/tree/main/docs",
    "Changelog": "/blob/main/CHANGELOG.md",
    "Issues": "/issues",
}


def write(root: Path, address: str) -> None:
    """Adds `[project.urls]` and the citation's `repository-code`. Raises `SystemExit` where the
    address is none of https."""
    if not address.startswith("https://") or address.count("/") < 4:
        raise SystemExit(f"{address!r} is not allowed: give https://HOST/OWNER/NAME")
    address = address.rstrip("/")
    path = root / "pyproject.toml"
    project = tomlkit.parse(path.read_text(encoding="utf-8"))
    urls = {label: address + page for label, page in PAGES.items()}
    project["project"]["urls"] = urls  # type: ignore[index]
    path.write_text(tomlkit.dumps(project), encoding="utf-8")
    citation = root / "CITATION.cff"
    kept = citation.read_text(encoding="utf-8").splitlines()
    lines = [line for line in kept if not line.startswith("repository-code:")]
    text = "\n".join([*lines, f'repository-code: "{address}"'])
    citation.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    write(Path(__file__).parents[1], sys.argv[1])
