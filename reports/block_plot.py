"""The block of a scene with its walls, to scale.

In: a scene, or a plot of a finding that has one. Out: a figure, or axes drawn into. Called by
`drawers`, and by `rockcheck.views`.
"""

from typing import Any

import numpy as np

from rockcheck.reports.style import PAGE, Figure, new_figure
from rockcheck.scenes import Scene
from rockcheck.validation.finding import Plot

#: Colours of a block: its edges, floor and walls; its face.
INK, SHADE = "#1b1b1b", "#d5d5d5"


def block(plot: Plot) -> Figure:
    """The block of a scene with its walls, to scale, in m."""
    with new_figure(figsize=(0.5 * PAGE, 0.5 * PAGE), layout="constrained") as figure:
        draw_block(figure.add_subplot(), Scene.model_validate(plot.data["scene"]))
    return figure


def draw_block(axes: Any, scene: Scene) -> None:
    """Draw block (at its initial position and rotation), floor and walls to scale, in m."""
    from matplotlib.patches import Polygon, Rectangle

    block = scene.block
    x, y, theta = scene.initial_state[:3]
    turn = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (block.half_width, block.half_height)
    axes.add_patch(Polygon(corners @ turn.T + (x, y), facecolor=SHADE, edgecolor=INK))
    if block.centre_of_mass is not None:
        axes.plot(*(np.array(block.offset) @ turn.T + (x, y)), marker="+", color=INK)
    reach = 1.4 * block.half_diagonal
    axes.axhline(0.0, color=INK, linewidth=2)
    thick = 0.12 * block.half_diagonal
    for wall in scene.walls:
        place = block.half_width + wall.gap
        left = -place - thick if wall.side == "left" else place
        axes.add_patch(Rectangle((left, 0.0), thick, 2.4 * block.half_height, facecolor=INK))
    axes.set(
        xlim=(-reach, reach),
        ylim=(-0.1 * block.half_height, 2.4 * block.half_height),
        aspect="equal",
        xlabel="m",
    )
    axes.tick_params(labelsize="small")
