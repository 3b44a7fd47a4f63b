"""What a finished run judges as failed, as annotations of a job's page:
`python annotations.py REPORT_DIR`.

Reads junit.xml, which already knows whether the run was strict, and prints GitHub's workflow
commands, one a failing figure or model.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from junitparser import JUnitXml, Skipped

#: What would end a message or a property before its time, and what stands for it.
MESSAGE = {"%": "%25", "\r": "%0D", "\n": "%0A"}
PROPERTY = MESSAGE | {":": "%3A", ",": "%2C"}


def annotations(folder: Path) -> Iterator[str]:
    """A line for each test case that failed, with what it is and why."""
    for suite in JUnitXml.fromfile(str(folder / "junit.xml")):
        for case in suite:
            title = f"{case.classname}: {case.name}"
            for result in case.result:
                if not isinstance(result, Skipped):
                    why = (result.message or "failed").translate(str.maketrans(MESSAGE))
                    yield f"::error title={title.translate(str.maketrans(PROPERTY))}::{why}"


if __name__ == "__main__":
    print(*annotations(Path(sys.argv[1])), sep="\n")
