"""Who takes part: engines and classes by name, and folders of histories written elsewhere.

In go names and settings, or folders; out come `Player`s, which `cards` plays and judges.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rockcheck.scenes import InputError, files, printable
from rockcheck.validation.execute import models, provenance
from rockcheck.validation.studies.conformance.phenomena import SCENES

#: The file that describes a folder of histories; the name of unnamed settings.
ABOUT, AS_IT_COMES = "engine.toml", "as it comes"
#: Default time step, and usual CPU time of a step, s.
STEP, STEP_COST = 1e-3, 1e-4
#: What `ABOUT` may say, and of which kind it is.
ABOUT_KINDS = {"engine": str, "version": str, "settings": str, "step": float, "lacks": list}


@dataclass(frozen=True, kw_only=True)
class Player(models.Work):
    """A participant, by the engine's name.

    `version`, `setup` and `step` (s) are the words of its card besides. `cost` is the usual CPU
    time of a simulated second. `absent` are the scenes of which a folder has no history.
    """

    setup: str
    step: float | str | None
    version: str = ""
    lacks: tuple[str, ...] = ()
    cost: float = 0.0
    absent: tuple[str, ...] = ()


def named(name: str, setup: str | None, settings: Mapping[str, Any]) -> Player:
    """An engine, with rockcheck's best settings unless others are named, or a "module:Class".

    Raises `InputError` for a setting that an engine does not have.
    """
    user_model = models.is_own(name)
    built_by: dict[str, Any] = {"time_step": STEP}
    if setup or not user_model:
        built_by["settings"] = setup or "best"
    built_by |= settings
    version = ""
    if not user_model:
        models.build(name, built_by)  # an unusable player is refused before anything runs
        version = provenance.version_of(models.family(name).libraries[0])
    others = [
        f"{key}={value}" for key, value in settings.items() if key not in ("settings", "time_step")
    ]
    step = built_by["time_step"]
    fixed = isinstance(step, float) and step > 0.0
    return Player(
        label=name,
        family=name,
        settings=built_by,
        setup=", ".join([str(built_by.get("settings", AS_IT_COMES)), *others]),
        step=step,
        version=version,
        search_path=(str(Path.cwd()),) if user_model else (),
        cost=STEP_COST / (step if fixed else STEP),
    )


def written(folder: Path) -> Player:
    """A folder with a CSV for each scene, and an `engine.toml` that says whose they are.

    Raises `InputError` where that file cannot be used, or the folder has no history at all.
    """
    about = {"engine": ""} | files.read_toml(folder / ABOUT)
    for key, value in about.items():
        if not isinstance(value, ABOUT_KINDS.get(key, ())) or (key == "engine" and not value):
            raise InputError(
                f"{printable(repr(value))} is not allowed; allowed: {', '.join(ABOUT_KINDS)}",
                f"{printable(folder / ABOUT)}: {printable(key)}",
            )
    paths = {name: folder / f"{name}.csv" for name in SCENES}
    absent = tuple(name for name, path in paths.items() if not path.exists())
    if len(absent) == len(paths):
        raise InputError(
            f"{printable(folder)}: no histories here; write {absent[0]}.csv and so on, as README.md"
            " of --export says",
            "--histories",
        )
    return Player(
        label=about["engine"],
        family="measured",
        settings={"files": {name: str(path) for name, path in paths.items()}},
        setup=about.get("settings") or AS_IT_COMES,
        step=about.get("step"),
        version=about.get("version", ""),
        lacks=tuple(map(str, about.get("lacks", ()))),
        absent=absent,
    )
