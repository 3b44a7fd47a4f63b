"""The paper's 28 overturning spectra: its Figs. 6 to 9."""

import itertools
from dataclasses import dataclass
from pathlib import Path

from rockcheck.scenes import PAPER_BLOCK, Floor, Ricker, Scene, Side, Wall

FIGURES: dict[int, tuple[Side, float]] = {
    6: ("left", 0.3),
    7: ("left", 0.6),
    8: ("right", 0.3),
    9: ("right", 0.6),
}
TITLES: dict[int | None, str] = {
    figure: f"Fig. {figure}: Wall on the {side}, μ = {friction:g}"
    for figure, (side, friction) in FIGURES.items()
}
GAPS, RESTITUTIONS = (0.003, 0.053, 0.103), (0.0, 1.0)
FREQUENCIES, AMPLITUDES = (0.5, 8.0), (1.0, 12.0)
#: Results of long runs, as they come with the package.
KEPT = Path(__file__).parents[1] / "data" / "spectra"


@dataclass(frozen=True, eq=False)
class Panel:
    """One spectrum to be played; `figure` is the paper's figure that shows it, or None."""

    name: str
    title: str
    scene: Scene
    figure: int | None = None

    @property
    def wall(self) -> Wall | None:
        """The wall, or None."""
        return self.scene.walls[0] if self.scene.walls else None


def paper_panels(*figures: int) -> tuple[Panel, ...]:
    """The seven spectra of each of these figures, by default of all.

    Unobstructed, then gap by gap with e = 0 and e = 1.
    """
    return tuple(
        _panel(figure, place)
        for figure in figures or FIGURES
        for place in (None, *itertools.product(GAPS, RESTITUTIONS))
    )


def _panel(figure: int, place: tuple[float, float] | None) -> Panel:
    name, title = "unobstructed", "Unobstructed"
    (side, friction), walls = FIGURES[figure], tuple[Wall, ...]()
    if place:
        (gap, e), millimetres = place, round(1000.0 * place[0])
        name, title = f"gap-{millimetres}-e-{e:g}", f"Gap {millimetres} mm, e = {e:g}"
        walls = (Wall(side=side, gap=gap, restitution=e),)
    scene = Scene(
        name=f"figure-{figure}-{name}",
        block=PAPER_BLOCK,
        floor=Floor(friction=friction),
        walls=walls,
        excitation=Ricker(amplitude=1.0, period=1.0),
        duration=1.0,
    )
    return Panel(scene.name, title, scene, figure)
