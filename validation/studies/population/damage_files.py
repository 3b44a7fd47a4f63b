"""The curves of capacities as loss software reads them: Pelicun's component library.

In: typed answers (`damage`). Out: the texts of `fragility.csv` and `fragility.json`, a component a
capacity, with one limit state. Called by the study.
"""

import csv
import io
import json
import re
from collections.abc import Sequence
from typing import Any

from rockcheck.scenes import Scene
from rockcheck.scenes.buildings import Building
from rockcheck.validation.studies.population.damage import DamageAnswer

#: Pelicun's names of the measures of intensity, and of their units.
DEMANDS = {
    "pga": ("Peak Ground Acceleration", "g"),
    "pgv": ("Peak Ground Velocity", "mps"),
    "pfa": ("Peak Floor Acceleration", "g"),
}
COLUMNS = (
    "ID",
    "Incomplete",
    "Demand-Type",
    "Demand-Unit",
    "Demand-Offset",
    "Demand-Directional",
    "LS1-Family",
    "LS1-Theta_0",
    "LS1-Theta_1",
    "LS1-DamageStateWeights",
)


def pelicun_files(
    answers: Sequence[DamageAnswer],
    scene: Scene,
    model: str,
    version: str,
    building: Building | None = None,
) -> dict[str, str]:
    """The library by file name; nothing where Pelicun has no name for the measure, or no curve.

    The block is directional: the model moves it in one plane.
    """
    curves = [answer for answer in answers if answer.intensity.fit is not None]
    demand = _demand_of(answers[0].intensity.measure) if answers else None
    if demand is None or not curves:
        return {}
    lines = io.StringIO()
    writer = csv.DictWriter(lines, COLUMNS, lineterminator="\n")
    writer.writeheader()
    described: dict[str, Any] = {
        "_GeneralInformation": {
            "ShortName": f"rockcheck: {scene.name}",
            "Description": f"Fragility of a rocking block, {2.0 * scene.block.half_width:.4g} m"
            f" wide, {2.0 * scene.block.half_height:.4g} m high"
            f"{f', {building.words}' if building else ''}, played by {model}.",
            "Version": version,
        }
    }
    for answer in curves:
        fit = answer.intensity.fit
        assert fit is not None, "chosen above"
        name = component_of(answer, scene.name)
        row = ("0", *demand, "0", "1", "lognormal", repr(fit.median), repr(fit.dispersion), "")
        writer.writerow(dict(zip(COLUMNS, (name, *row), strict=True)))
        described[name] = {
            "Description": f"{scene.name}: {answer.capacity.words}",
            "Comments": f"{len(answer.intensity.records)} motions, {answer.exceeded_by} of which"
            " exceed it at some factor; least intensity of each, greatest likelihood.",
            "SuggestedComponentBlockSize": "1 EA",
            "RoundUpToIntegerQuantity": "True",
            "LimitStates": {"LS1": {"DS1": {"Description": answer.capacity.words}}},
        }
    text = json.dumps(described, indent=2, ensure_ascii=False)
    return {"fragility_pelicun.csv": lines.getvalue(), "fragility_pelicun.json": text + "\n"}


def component_of(answer: DamageAnswer, name: str) -> str:
    """The component's ID by the scene's name: "rockcheck.shelf.slip.0_05"."""
    block = re.sub(r"\W+", "_", name)
    return f"rockcheck.{block}." + answer.capacity.name.replace(".", "_").replace(":", ".")


def _demand_of(measure: str) -> tuple[str, str] | None:
    if measure.startswith("sa:"):
        return f"Spectral Acceleration|{measure.removeprefix('sa:')}", "g"
    return DEMANDS.get(measure)
