"""The figure of a block with its walls, to scale."""

import math

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from rockcheck.reports.block_plot import block, draw_block
from rockcheck.scenes import Block, Floor, Scene, Wall
from rockcheck.validation.finding import Plot

B, H = 0.4, 1.6


def drawn(**change):
    """The axes of a scene's figure."""
    scene = Scene(
        **{
            "name": "a",
            "block": Block(half_width=B, half_height=H),
            "floor": Floor(friction=0.3),
            "duration": 1.0,
            **change,
        }
    )
    axes = Figure().add_subplot()
    draw_block(axes, scene)
    return axes


def shape(axes):
    (found,) = (patch for patch in axes.patches if isinstance(patch, Polygon))
    return found.get_xy()[:4]


def test_an_upright_block_stands_on_the_floor():
    np.testing.assert_allclose(
        shape(drawn()), [[-B, 0], [B, 0], [B, 2 * H], [-B, 2 * H]], atol=1e-15
    )


@pytest.mark.parametrize(("tilt", "lower"), [(0.2, 0), (-0.2, 1)])
def test_a_tilted_block_stands_on_its_lower_corner(tilt, lower):
    corners = shape(drawn(initial_rotation=tilt))
    np.testing.assert_allclose(corners[lower], [[-B, 0], [B, 0]][lower], atol=1e-15)
    assert corners[1 - lower][1] == pytest.approx(2 * B * math.sin(0.2))
    np.testing.assert_allclose(
        corners[2] - corners[1], 2 * H * np.array([-math.sin(tilt), math.cos(tilt)])
    )


def test_a_mark_shows_a_centre_of_mass_that_is_given():
    assert [line.get_marker() for line in drawn().lines] == ["None"]
    loaded = Block(half_width=B, half_height=H, centre_of_mass=(0.1, -0.3))
    (mark,) = (line for line in drawn(block=loaded).lines if line.get_marker() == "+")
    np.testing.assert_allclose(np.ravel(mark.get_data()), [0.1, H - 0.3])
    (mark,) = (
        line for line in drawn(block=loaded, initial_rotation=0.2).lines if line.get_marker() == "+"
    )
    x, y = np.ravel(mark.get_data())
    assert math.hypot(x + B, y) == pytest.approx(math.hypot(B + 0.1, H - 0.3))
    assert math.atan2(-(x + B), y) == pytest.approx(0.2 - math.atan2(B + 0.1, H - 0.3))


def test_walls_face_the_block_at_their_gaps():
    axes = drawn(walls=(Wall(side="left", gap=0.1), Wall(side="right", gap=0.3)))
    left, right = (patch for patch in axes.patches if isinstance(patch, Rectangle))
    assert left.get_x() + left.get_width() == pytest.approx(-B - 0.1)
    assert right.get_x() == pytest.approx(B + 0.3)
    assert left.get_y() == right.get_y() == 0.0
    assert min(left.get_height(), right.get_height()) > 2 * H


def test_the_whole_block_is_seen_and_as_wide_as_high():
    axes = drawn(walls=(Wall(side="left", gap=0.1),), initial_rotation=0.03)
    (low, high), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    assert low < -B - 0.1
    assert high == -low
    assert bottom < 0.0
    assert top > 2 * H
    assert axes.get_aspect() == 1.0


def test_the_plot_of_a_finding_has_its_scene():
    scene = Scene(
        name="a",
        block=Block(half_width=B, half_height=H),
        floor=Floor(friction=0.3),
        duration=1.0,
    )
    figure = block(Plot("block", "", data={"scene": scene.model_dump(mode="json")}))
    np.testing.assert_allclose(shape(figure.axes[0])[2], [B, 2 * H])
