"""The pages of spectra, fragility and incremental dynamic analysis in a real browser: hover, click,
keys, accessibility."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright import sync_api as playwright

from rockcheck.reports.document import publish
from rockcheck.reports.show.spectrum import COLOURS
from rockcheck.validation.finding import Block, Column, Finding, Made
from rockcheck.validation.paper import Panel, paper_panels
from rockcheck.validation.studies.population.study import blocks_of, lines_of
from rockcheck.validation.studies.spectrum.study import Spectra
from rockcheck.validation.studies.spectrum.tiles import Played, Request
from rockcheck.validation.uncertainty.population import curve_of

pytestmark = pytest.mark.browser
SIZE = 20
MADE = Made(created="2031-01-02T00:00:00+00:00", jobs=1, wall_seconds=1.0, versions={}, hardware={})
FREQUENCIES, AMPLITUDES = np.linspace(0.5, 8.0, SIZE), np.linspace(1.0, 12.0, SIZE)


def written(study: Spectra, folder: Path, letters: str) -> Path:
    """The page of a study whose outcomes are made up; its histories are the model's own."""
    done = {
        task: Played(letters) if task.what == "outcomes" else study.play(task)
        for task in study.tasks({})
    }
    return publish(replace(study.gather(done), made=MADE), folder)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fig. 8 made up: safe up to the sixth amplitude, overturned right from there on."""
    path = tmp_path_factory.mktemp("spectra")
    letters = "U" + "S" * (6 * SIZE - 1) + "R" * (SIZE - 6) * SIZE
    written(Spectra(paper_panels(8), Request(SIZE)), path, letters)
    return path


@pytest.fixture
def page(opened: Callable[..., playwright.Page], folder: Path) -> playwright.Page:
    return opened(folder / "index.html")


def place(page: playwright.Page, panel: int, row: int, column: int) -> tuple[float, float]:
    """Where a node is on the screen."""
    canvas = page.locator(".panel canvas").nth(panel)
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    wide, high = box["width"] - 48.0, box["height"] - 30.0
    return box["x"] + 42.0 + (column + 0.5) / SIZE * wide, box["y"] + 4.0 + (
        1.0 - (row + 0.5) / SIZE
    ) * high


def test_the_panels_stand_as_in_the_paper_and_are_painted(page: playwright.Page) -> None:
    assert page.locator(".panel h3").all_inner_texts() == [panel.title for panel in paper_panels(8)]
    outcomes = [
        "safe",
        "no wall: overturned clockwise",
        "overturned; no wall: counterclockwise",
        "undecided",
    ]
    assert page.locator(".key.outcomes span").all_inner_texts() == outcomes
    colours = """([panel, nodes]) => {
        const c = document.querySelectorAll('.panel canvas')[panel], r = devicePixelRatio;
        const w = c.clientWidth - 48, h = c.clientHeight - 30;
        const all = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
        return nodes.map(([i, j]) => {
            const place = [42 + (j + .5) / 20 * w, 4 + h - (i + .5) / 20 * h];
            const [x, y] = place.map(pixels => Math.round(r * pixels));
            const hex = k => all[4 * (y * c.width + x) + k].toString(16).padStart(2, '0');
            return '#' + [0, 1, 2].map(hex).join('');
        });
    }"""
    free = page.evaluate(colours, [0, [[3, 9], [9, 9], [0, 0]]])
    assert free == [COLOURS["safe"], COLOURS["clockwise"], COLOURS["undecided"]]
    assert page.evaluate(colours, [1, [[3, 9], [9, 9]]]) == [COLOURS["safe"], COLOURS["overturned"]]


def test_pointing_at_a_node_names_it_in_every_panel(page: playwright.Page) -> None:
    page.mouse.move(*place(page, 3, 10, 7))
    said = page.locator("output.node").inner_text()
    assert said.startswith(
        f"ωₚ/p {FREQUENCIES[7]:.3g}, aₚ / (g tan α) {AMPLITUDES[10]:.3g}: a pulse of "
    )
    assert page.locator(".panel .said").all_inner_texts() == [
        "overturned clockwise",
        *["overturned"] * 6,
    ]
    page.mouse.move(*place(page, 3, 2, 7))
    assert page.locator(".panel .said").all_inner_texts() == ["safe"] * 7


def test_ones_own_block_is_told_in_hertz_and_g(
    opened: Callable[..., playwright.Page], tmp_path: Path
) -> None:
    panel = Panel("shelf", "shelf", paper_panels(8)[1].scene)
    page = opened(written(Spectra((panel,), Request(SIZE)), tmp_path, "S" * SIZE**2))
    assert page.locator(".key.outcomes span").all_inner_texts() == [
        "safe",
        "overturned",
        "undecided",
        "★ the scene's own pulse",
    ]  # it is beside a wall
    page.evaluate("Object.values(rockcheckFigures)[0].point([4, 7])")
    said = page.locator("output.node").inner_text()
    g, hertz = map(float, re.search(r"a pulse of ([\d.]+) g .*, ([\d.]+) Hz", said).groups())
    scene, block = panel.scene, panel.scene.block
    assert g == pytest.approx(
        AMPLITUDES[4] * scene.gravity / 9.80665 * block.half_width / block.half_height, rel=0.01
    )
    assert hertz == pytest.approx(
        FREQUENCIES[7] * scene.frequency_parameter / (2.0 * np.pi), rel=0.01
    )


def test_a_click_plays_the_kept_history_that_ends_the_same_way(page: playwright.Page) -> None:
    page.mouse.click(*place(page, 0, 7, 7))
    playwright.expect(page.locator(".played figcaption")).to_contain_text("overturned clockwise")
    chosen = page.evaluate("rockcheckFigures['figure-8'].store.chosen.node")
    assert chosen[0] >= 6
    assert abs(chosen[0] - 7) <= 1
    assert abs(chosen[1] - 7) <= 1
    start = page.evaluate("rockcheckPlayer.store.time")
    for _ in range(100):
        if page.evaluate("rockcheckPlayer.store.time") > start + 0.2:
            break
        page.wait_for_timeout(50)
    assert page.evaluate("rockcheckPlayer.store.time") > start + 0.2
    page.get_by_role("button", name="Pause").click()
    page.mouse.click(*place(page, 4, 1, 1))
    playwright.expect(page.locator(".played figcaption")).to_contain_text("Gap 53 mm, e = 1")
    assert page.locator(".played").count() == 1
    assert page.locator(".played svg .solid").count() >= 2  # the floor and the wall


def test_keys_do_what_the_mouse_does(page: playwright.Page) -> None:
    page.locator(".panel canvas").nth(1).focus()
    page.keyboard.press("ArrowUp")
    page.keyboard.press("ArrowRight")
    assert page.evaluate("rockcheckFigures['figure-8'].store.node") == [11, 11]
    page.keyboard.press("Enter")
    playwright.expect(page.locator(".played")).to_be_visible()


def page_of(folder: Path, blocks: list[Block]) -> Path:
    return publish(Finding("made", "Made up", "20 records.", blocks, made=MADE), folder)


def fragility_page(folder: Path) -> Path:
    level = np.linspace(0.5, 5.0, 10)
    fell = np.random.default_rng(1).random((20, 2, 1)) < np.linspace(0.0, 1.0, 10)
    curves = [
        curve_of(label, fell, np.zeros_like(fell), level)
        for label in ("with the wall", "without a wall")
    ]
    other = {"per_unit": 0.2, "other_unit": "g", "other_label": "peak acceleration, g"}
    return page_of(
        folder, blocks_of(curves, Column("intensity", "peak acceleration / (g tan α)"), other)
    )


def ida_page(folder: Path) -> Path:
    level = np.linspace(0.1, 1.0, 10)
    peaks = 0.2 * np.arange(1, 5)[:, None, None] * level * np.ones((4, 2, 1))
    peaks[peaks > 0.7] = np.inf
    return page_of(
        folder, lines_of([f"r{k}" for k in range(4)], peaks, level, Column("intensity", "PGA", "g"))
    )


def test_fragility_is_read_under_the_pointer(
    opened: Callable[..., playwright.Page], tmp_path: Path
) -> None:
    page = opened(fragility_page(tmp_path))
    assert page.locator(".key span").all_inner_texts() == ["with the wall", "without a wall"]
    page.locator("[data-curves] .u-over").hover()
    said = page.locator("[data-curves] output").inner_text()
    across, in_g = re.fullmatch(
        r"peak acceleration / \(g tan α\) ([\d.]+) \(([\d.]+) g\): with the wall 0\..*",
        said,
        re.DOTALL,
    ).groups()
    assert float(in_g) == pytest.approx(0.2 * float(across), rel=0.01)
    cells = page.locator("table tbody tr").first.locator("td")
    assert float(cells.last.inner_text()) == pytest.approx(
        0.2 * float(cells.first.inner_text()), rel=0.01
    )
    assert page.evaluate("rockcheckCharts.fragility.axes.map(axis => [axis.scale, axis.label])")[
        2
    ] == ["x", "peak acceleration, g"]


def test_the_lines_of_an_ida_are_named_under_the_pointer(
    opened: Callable[..., playwright.Page], tmp_path: Path
) -> None:
    page = opened(ida_page(tmp_path))
    page.locator('[data-curves="lines"] .u-over').hover(position={"x": 500, "y": 200})
    said = page.locator('[data-curves="lines"] output').inner_text()
    assert said.startswith("PGA, g ")
    assert any(f"r{k} 0." in said or f"r{k}, reversed 0." in said for k in range(4))
    assert "50 % " in said


@pytest.mark.long
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("what", ["spectra", "ida"])
def test_accessible(
    opened: Callable[..., playwright.Page],
    barriers,
    folder: Path,
    tmp_path: Path,
    what: str,
    scheme: str,
) -> None:
    address = folder / "index.html" if what == "spectra" else ida_page(tmp_path)
    page = opened(address, color_scheme=scheme, bypass_csp=True)
    if what == "spectra":
        page.evaluate("(f => f.choose(f.panels[2], [8, 8]))(rockcheckFigures['figure-8'])")
        playwright.expect(page.locator(".played")).to_be_visible()
    assert barriers(page) == []


def test_a_phone_needs_no_sideways_scrolling(
    opened: Callable[..., playwright.Page], folder: Path
) -> None:
    page = opened(folder / "index.html", viewport={"width": 390, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") == 390
