"""The scenes: families of ten members each, since one run can be lucky by a factor of five; for
convergence 18 single ones beside a wall.

The members of a family differ by a few per cent in tilt or amplitude, so that their uplifts and
impacts fall on other phases of a step. Each is played up to its horizon of predictability and
compared up to there.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.horizon import predictability_horizon
from rockcheck.scenes import Floor, History, Rest, Ricker, Scene, Wall, load_scene
from rockcheck.scenes.scene import PAPER_BLOCK

MEMBERS = 10
#: How accurate the references are, and to what time a record is played at most, s.
REFERENCE_TOLERANCE, RECORD_DURATION = 1e-13, 8.0


@dataclass(frozen=True)
class SceneFamily:
    """A name, a few words, and its members by number, 0 to `MEMBERS` - 1."""

    name: str
    words: str
    member: Callable[[int], Scene]


def _spread(k: int) -> float:
    """From 0.955 to 1.045."""
    return 1.0 + 0.01 * (k - 4.5)


def _free(k: int) -> Scene:
    tilt = (0.30 + 0.05 * k) * PAPER_BLOCK.alpha
    return Scene(
        name=f"free {k}",
        block=PAPER_BLOCK,
        floor=Floor(friction=1.0),
        excitation=Rest(),
        duration=3.0,
        initial_rotation=tilt,
    )


def pulse(
    frequency_ratio: float,
    amplitude_ratio: float,
    friction: float,
    *,
    walls: tuple[Wall, ...] = (),
    name: str = "pulse",
) -> Scene:
    """A Ricker pulse of omega_p = ratio p and a_p = ratio g tan alpha, 3 s."""
    still = Scene(
        name=name,
        block=PAPER_BLOCK,
        floor=Floor(friction=friction),
        walls=walls,
        excitation=Rest(),
        duration=3.0,
    )
    amplitude = amplitude_ratio * still.gravity * math.tan(still.block.alpha)
    period = 2.0 * math.pi / (frequency_ratio * still.frequency_parameter)
    return still.replace(excitation=Ricker(amplitude=amplitude, period=period))


def _pulses(
    name: str, frequency_ratio: float, amplitude_ratio: float, friction: float, *walls: Wall
) -> SceneFamily:
    beside = "".join(f", wall at {1e3 * wall.gap:g} mm, e {wall.restitution:g}" for wall in walls)
    words = (
        f"Ricker pulse, ω_p = {frequency_ratio:g} p, a_p = {amplitude_ratio:g} g tan α,"
        f" μ {friction:g}{beside}"
    )
    return SceneFamily(
        name,
        words,
        lambda k: pulse(
            frequency_ratio, amplitude_ratio * _spread(k), friction, walls=walls, name=f"{name} {k}"
        ),
    )


def _record(name: str, words: str) -> SceneFamily:
    def member(k: int) -> Scene:
        scene = load_scene(name)
        louder = scene.excitation.scaled((1.5 + 0.02 * k) / 1.6)
        return scene.replace(name=f"{name} {k}", excitation=louder, duration=RECORD_DURATION)

    return SceneFamily(name, f"El Centro × 1.5 to 1.68, {words}", member)


FAMILIES = {
    family.name: family
    for family in (
        SceneFamily("free", "free rocking from 0.3 to 0.75 α, μ 1", _free),
        _pulses("pulse a", 4.5, 4.0, 1.0),
        _pulses("pulse b", 6.0, 6.0, 1.0),
        _pulses("pulse c", 6.0, 8.0, 1.0),
        _pulses("slip a", 4.5, 4.0, 0.3),
        _pulses("slip b", 6.0, 6.0, 0.3),
        *(
            _pulses(
                f"wall {1e3 * gap:g} mm e {e:g}",
                6.0,
                3.0,
                0.6,
                Wall(side="left", gap=gap, restitution=e),
            )
            for gap in (0.003, 0.053)
            for e in (0.0, 0.5, 1.0)
        ),
        _record("fig4a", "μ 0.3, no wall"),
        _record("fig5a", "μ 0.3, wall at 53 mm, e 0"),
    )
}
QUICK, QUICK_MEMBERS = ("free", "pulse a", "slip a", "wall 53 mm e 0"), 2

#: omega_p/p, a_p/(g tan alpha) and friction of pulses that hit a left wall at every gap, and leave
#: the block standing.
PULSES = {"long": (3.0, 2.5, 0.3), "medium": (4.5, 2.5, 0.3), "short": (6.0, 2.5, 0.6)}
GAPS, RESTITUTIONS = (0.003, 0.053, 0.103), (0.0, 0.5)
#: Longest run of a wall scene, s; the horizon of predictability may end it before.
DURATION = 5.0


def _beside_a_wall(name: str, gap: float, restitution: float) -> SceneFamily:
    wall = Wall(side="left", gap=gap, restitution=restitution)
    label = f"{name} {1e3 * gap:g} mm e {restitution:g}"
    scene = pulse(*PULSES[name], walls=(wall,), name=label).replace(duration=DURATION)
    return SceneFamily(label, "", lambda k: scene)


WALLS = {
    one.name: one
    for one in itertools.starmap(_beside_a_wall, itertools.product(PULSES, GAPS, RESTITUTIONS))
}
QUICK_WALLS = ("long 53 mm e 0.5", "medium 53 mm e 0", "short 3 mm e 0")


@dataclass(frozen=True)
class Prepared:
    """A member cut at its horizon (s), the reference of each kind of model, and how far these are
    apart (RMS, alpha)."""

    scene: Scene
    horizon: float
    references: dict[str, History]
    model_form: float


@cache
def prepared(family: str, member: int) -> Prepared:
    """Cuts a member at its horizon and plays its references; they take milliseconds."""
    from rockcheck.validation.discrepancy.compare import compare

    whole = (FAMILIES | WALLS)[family].member(member)
    horizon = predictability_horizon(whole)
    scene = whole.replace(duration=horizon)
    references = {
        model.name: model.simulate(scene)
        for model in (
            EventBasedModel(tolerance=REFERENCE_TOLERANCE, pivot="unilateral"),
            EventBasedModel(tolerance=REFERENCE_TOLERANCE, pivot="bilateral"),
        )
    }
    model_form = compare(
        references["ebm"], references["ebm-unilateral"], scene=scene, measures=["theta_rms"]
    )["theta_rms"]
    return Prepared(scene, horizon, references, model_form)
