"""The scenes of the benchmark, and their references.

They come in families of ten members each, since a single run can be lucky by a factor of five; for
convergence there are 18 single ones beside a wall. The members of a family differ by a few per cent
in tilt or amplitude, so that their uplifts and impacts fall on other phases of a step. Each is
played up to its horizon of predictability and compared up to there.

In: the name of a family and a member's number. Out: `Prepared`. Called by `runs` and the study.
"""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

from rockcheck.ebm import EventBasedModel, predictability_horizon, spectrum
from rockcheck.scenes import PAPER_BLOCK, Floor, History, Rest, Ricker, Scene, Wall, load_scene
from rockcheck.validation.discrepancy.compare import compare

MEMBERS = 10
#: Tolerance of the references, and the longest time to which a record is played, s.
REFERENCE_TOLERANCE, RECORD_DURATION = 1e-13, 8.0


@dataclass(frozen=True)
class SceneFamily:
    """A name, a few words, and its members by number, 0 to `MEMBERS` - 1."""

    name: str
    words: str
    member: Callable[[int], Scene]


def pulse(
    frequency_ratio: float,
    amplitude_ratio: float,
    friction: float,
    *,
    walls: tuple[Wall, ...] = (),
    name: str = "pulse",
) -> Scene:
    """A scene of 3 s under a Ricker pulse, see `node_pulse`."""
    still = Scene(
        name=name,
        block=PAPER_BLOCK,
        floor=Floor(friction=friction),
        walls=walls,
        excitation=Rest(),
        duration=3.0,
    )
    amplitude, period = spectrum.node_pulse(still, amplitude_ratio, frequency_ratio)
    return still.replace(excitation=Ricker(amplitude=amplitude, period=period))


def _free_rocking() -> SceneFamily:
    def member(k: int) -> Scene:
        return Scene(
            name=f"free {k}",
            block=PAPER_BLOCK,
            floor=Floor(friction=1.0),
            excitation=Rest(),
            duration=3.0,
            initial_rotation=(0.30 + 0.05 * k) * PAPER_BLOCK.alpha,
        )

    return SceneFamily("free", "free rocking from 0.3 to 0.75 α, μ 1", member)


def _pulses(
    name: str, frequency_ratio: float, amplitude_ratio: float, friction: float, *walls: Wall
) -> SceneFamily:
    def member(k: int) -> Scene:
        amplitude = amplitude_ratio * (1.0 + 0.01 * (k - 4.5))
        return pulse(frequency_ratio, amplitude, friction, walls=walls, name=f"{name} {k}")

    words = (
        f"Ricker pulse, ω_p = {frequency_ratio:g} p, a_p = {amplitude_ratio:g} g tan α,"
        f" μ {friction:g}"
    )
    for wall in walls:
        words += f", wall at {1e3 * wall.gap:g} mm, e {wall.restitution:g}"
    return SceneFamily(name, words, member)


def _record(name: str, words: str) -> SceneFamily:
    def member(k: int) -> Scene:
        scene = load_scene(name)
        return scene.replace(
            name=f"{name} {k}",
            excitation=scene.excitation.scaled((1.5 + 0.02 * k) / 1.6),
            duration=RECORD_DURATION,
        )

    return SceneFamily(name, f"El Centro × 1.5 to 1.68, {words}", member)


def _every_family() -> Iterator[SceneFamily]:
    yield _free_rocking()
    yield _pulses("pulse a", 4.5, 4.0, 1.0)
    yield _pulses("pulse b", 6.0, 6.0, 1.0)
    yield _pulses("pulse c", 6.0, 8.0, 1.0)
    yield _pulses("slip a", 4.5, 4.0, 0.3)
    yield _pulses("slip b", 6.0, 6.0, 0.3)
    for gap, restitution in itertools.product((0.003, 0.053), (0.0, 0.5, 1.0)):
        wall = Wall(side="left", gap=gap, restitution=restitution)
        yield _pulses(f"wall {1e3 * gap:g} mm e {restitution:g}", 6.0, 3.0, 0.6, wall)
    yield _record("fig4a", "μ 0.3, no wall")
    yield _record("fig5a", "μ 0.3, wall at 53 mm, e 0")


FAMILIES = {family.name: family for family in _every_family()}
QUICK, QUICK_MEMBERS = ("free", "pulse a", "slip a", "wall 53 mm e 0"), 2

#: omega_p/p, a_p/(g tan alpha) and friction of pulses that hit a left wall at every gap, and leave
#: the block standing.
PULSES = {"long": (3.0, 2.5, 0.3), "medium": (4.5, 2.5, 0.3), "short": (6.0, 2.5, 0.6)}
GAPS, RESTITUTIONS = (0.003, 0.053, 0.103), (0.0, 0.5)
#: Longest run of a wall scene, s; the horizon of predictability may end it before.
DURATION = 5.0


def _wall_scenes() -> Iterator[Scene]:
    for length, gap, restitution in itertools.product(PULSES, GAPS, RESTITUTIONS):
        wall = Wall(side="left", gap=gap, restitution=restitution)
        name = f"{length} {1e3 * gap:g} mm e {restitution:g}"
        yield pulse(*PULSES[length], walls=(wall,), name=name).replace(duration=DURATION)


WALLS = {scene.name: scene for scene in _wall_scenes()}
QUICK_WALLS = ("long 53 mm e 0.5", "medium 53 mm e 0", "short 3 mm e 0")


@dataclass(frozen=True)
class Prepared:
    """A member cut at its horizon, and the reference of each kind of model.

    `model_form` is how far the references are apart (RMS, alpha).
    """

    scene: Scene
    references: dict[str, History]
    model_form: float


@cache
def prepared(family: str, member: int) -> Prepared:
    """Cuts a member, or a scene of `WALLS`, at its horizon and plays its references.

    They take milliseconds.
    """
    whole = WALLS.get(family) or FAMILIES[family].member(member)
    scene = whole.replace(duration=predictability_horizon(whole))
    unilateral = EventBasedModel(tolerance=REFERENCE_TOLERANCE, pivot="unilateral")
    bilateral = EventBasedModel(tolerance=REFERENCE_TOLERANCE, pivot="bilateral")
    references = {model.name: model.simulate(scene) for model in (unilateral, bilateral)}
    between = compare(
        references["ebm"], references["ebm-unilateral"], scene=scene, measures=["theta_rms"]
    )
    return Prepared(scene, references, between["theta_rms"])
