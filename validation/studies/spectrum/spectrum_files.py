"""The files of an overturning spectrum: CSV, and NPZ with its settings.

In: a panel, its spectrum and what was asked for. Out: the content of files, by their endings.
Called by the study.
"""

import io
import json
from typing import Any

import numpy as np

from rockcheck.ebm import Spectrum
from rockcheck.scenes import writing
from rockcheck.validation.execute import provenance
from rockcheck.validation.paper import Panel
from rockcheck.validation.studies.spectrum import tiles
from rockcheck.validation.studies.spectrum.changes import REMARK
from rockcheck.validation.studies.spectrum.spectrum_blocks import stem_of


def files_of(panel: Panel, spectrum: Spectrum, request: tiles.Request) -> dict[str, bytes]:
    """A spectrum as CSV and as NPZ, with its settings.

    A record's samples are left out of the settings: its name identifies it.
    """
    about = json.dumps(
        {
            "name": stem_of(panel, request.model),
            "title": panel.title,
            "figure": panel.figure,
            "scene": panel.scene.model_dump(
                mode="json", exclude={"excitation": {"unscaled"}, "vertical": {"unscaled"}}
            ),
            "model": request.model,
            "settings": dict(request.settings),
            "refined": request.refine,
            "evaluations": spectrum.evaluations,
            "versions": provenance.versions(),
        }
    )
    return {
        "csv": f"{REMARK}{about}\n{_csv_table(spectrum)}".encode(),
        "npz": _npz(spectrum, about),
    }


def _csv_table(spectrum: Spectrum) -> str:
    """One row an amplitude ratio, one column a frequency ratio.

    -1 overturned left, 0 safe, 1 overturned right, an empty cell undecided.
    """
    head = ["amplitude_ratio\\frequency_ratio", *map(repr, spectrum.frequency_ratios.tolist())]
    rows = []
    for amplitude, sides, safe in zip(
        spectrum.amplitude_ratios.tolist(),
        spectrum.outcomes.tolist(),
        spectrum.safe.tolist(),
        strict=True,
    ):
        cells = [
            side if side or is_safe else None for side, is_safe in zip(sides, safe, strict=True)
        ]
        rows.append([amplitude, *cells])
    return writing.table_text(head, rows)


def _npz(spectrum: Spectrum, about: str) -> bytes:
    arrays: dict[str, Any] = {
        "outcomes": spectrum.outcomes,
        "frequency_ratios": spectrum.frequency_ratios,
        "amplitude_ratios": spectrum.amplitude_ratios,
        "undecided": spectrum.undecided,
        "settings": np.array(about),
    }
    if spectrum.depends_on_law is not None:
        arrays["depends_on_law"] = spectrum.depends_on_law
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)
    return content.getvalue()
