"""The pages of the studies, made of made-up figures, in a real browser: hover, click, keys,
accessibility, a phone."""

import re
from dataclasses import replace

import numpy as np
import pytest
from playwright import sync_api as playwright

from rockcheck.reports.document import publish
from rockcheck.reports.spectrum_plots import OUTCOMES
from rockcheck.validation.execute import pool
from rockcheck.validation.finding import (
    Axis,
    Block,
    Column,
    Finding,
    Made,
    Mark,
    Panel as Curves,
    Plot,
    Series,
    Table,
    Text,
    text,
)
from rockcheck.validation.paper import Panel, paper_panels
from rockcheck.validation.studies.conformance.cards import cards_table
from rockcheck.validation.studies.conformance.phenomena import PHENOMENA
from rockcheck.validation.studies.population.level_blocks import (
    curve_plot,
    curve_table,
    fit_table,
    line_blocks,
)
from rockcheck.validation.studies.population.levels import Levels
from rockcheck.validation.studies.spectrum import scene_node
from rockcheck.validation.studies.spectrum.study import Spectra
from rockcheck.validation.studies.spectrum.tiles import Played, Request
from rockcheck.validation.studies.work_precision.runs import BenchmarkRun, Play
from rockcheck.validation.studies.work_precision.savings import Saving
from rockcheck.validation.studies.work_precision.study import Measure, WorkPrecision
from rockcheck.validation.uncertainty.fragility import curve_of

pytestmark = pytest.mark.browser
SIZE = 20
MADE = Made(created="2031-01-02T00:00:00+00:00", jobs=1, wall_seconds=1.0, versions={}, hardware={})
FREQUENCIES, AMPLITUDES = np.linspace(0.5, 8.0, SIZE), np.linspace(1.0, 12.0, SIZE)
PHONE = {"viewport": {"width": 390, "height": 800}}


def benchmark() -> Finding:
    lines = (
        ("ebm", 1e-6, 1e-6, 1e-5),
        ("ebm", 1e-8, 1e-8, 2e-5),
        ("cm", 1e-5, 1e-3, 1e-3),
        ("cm", 1e-6, 1e-4, 3e-3),
    )
    done: dict[object, object] = {
        Play(family, member, line, value): [
            BenchmarkRun(
                family,
                member,
                line,
                value,
                3.0,
                error,
                2.0 * error,
                error,
                0.1 * error,
                0.1,
                1e-3,
                cpu,
                cpu,
                0.1,
                1000,
            )
        ]
        for family in ("free", "wall 53 mm e 0", "long 53 mm e 0.5", "short 3 mm e 0")
        for member in range(3)
        for line, value, error, cpu in lines
        if line == "cm" or not family.startswith(("long", "short"))
    }
    done[Play("free", 0, "pybullet", 1e-2)] = pool.Failure("it blew up")
    done[Measure("saving", "made")] = [Saving("cm", "wall", "ms", 2.0, 1.0)]
    return WorkPrecision().gather(done)


def marked() -> Finding:
    """What the benchmark's page has none of: verdicts, links, folded blocks, failures, a curve to
    be read."""
    rows = [
        ["a", "ebm", Mark(1.0, "pass")],
        ["b", "cm", Mark(2.0, "fail", "too long", link="run.json")],
    ]
    columns = [text("name"), Column("model", kind="model"), Column("x", "length", "m")]
    curve = Curves(
        "",
        [
            Series("a", [1.0, 2.0], [3.0, None], [2.0, None], [4.0, None]),
            Series("b", [1.0, 2.0], [1.0, 2.0], style="thin"),
        ],
    )
    blocks = [
        Text("no mode is consistent", title="Words", items=["one"], verdict="fail"),
        Table("rows", columns, rows, "Rows", "A note.", folded=True),
        Plot("curve", "Curves", panels=[curve], x=Axis("t, s"), y=Axis("x, m"), live=True),
    ]
    return Finding(
        "made", "Made up", "It fails.", blocks, verdict="fail", failures={"a": "it blew up"}
    )


def found(blocks: list[Block]) -> Finding:
    return Finding("made", "Made up", "20 records.", blocks, made=MADE)


def fragility() -> Finding:
    level = np.linspace(0.5, 5.0, 10)
    fell = np.random.default_rng(1).random((20, 2, 1)) < np.linspace(0.0, 1.0, 10)
    curves = [
        curve_of(label, fell, np.zeros_like(fell), level)
        for label in ("with the wall", "without a wall")
    ]
    levels = levels_at(level, Column("intensity", "peak acceleration / (g tan α)"), per_g=0.2)
    return found([curve_plot(curves, levels), fit_table(curves, levels), curve_table(curves)])


def levels_at(levels: np.ndarray, across: Column, per_g: float | None = None) -> Levels:
    return Levels(
        cases={},
        levels=levels,
        across=across,
        limits={},
        model="ebm-unilateral",
        settings=(),
        data={},
        per_g=per_g,
    )


def ida() -> Finding:
    level = np.linspace(0.1, 1.0, 10)
    peaks = 0.2 * np.arange(1, 5)[:, None, None] * level * np.ones((4, 2, 1))
    peaks[peaks > 0.7] = np.inf
    peaks[0, :, 5:] = np.nan  # these failed
    levels = levels_at(level, Column("intensity", "PGA", "g"))
    return found(line_blocks([f"r{k}" for k in range(4)], peaks, levels))


def spectra(letters: str, *panels: Panel, request: Request | None = None) -> Finding:
    """Spectra whose outcomes are made up; their histories are the model's own."""
    study = Spectra(panels, request or Request(SIZE))
    done = {
        task: Played(letters) if task.what == "outcomes" else study.play(task)
        for task in study.tasks({})
    }
    return replace(study.gather(done), made=MADE)


#: What makes a study's finding, and words of its page.
STUDIES = {
    "benchmark": (benchmark, "What does not converge"),
    "marked": (marked, "no mode is consistent"),
    # Safe up to the sixth amplitude, overturned right from there on; one node is undecided.
    "spectra": (
        lambda: spectra("U" + "S" * (6 * SIZE - 1) + "R" * (SIZE - 6) * SIZE, *paper_panels(8)),
        "no wall: overturned clockwise",
    ),
    "record": (
        lambda: spectra(
            "S" * SIZE**2,
            Panel(
                "record",
                "record",
                paper_panels(8)[0].scene.replace(
                    excitation={"kind": "record", "unscaled": (3.0, -3.0), "time_step": 0.5}
                ),
            ),
        ),
        "overturned clockwise",
    ),
    "fragility": (fragility, "with the wall"),
    "ida": (ida, "PGA"),
}


@pytest.fixture(scope="module")
def studies(tmp_path_factory):
    folder = tmp_path_factory.mktemp("studies")
    for name, (make, _) in STUDIES.items():
        (folder / name).mkdir()
        publish(make(), folder / name).rename(folder / name / "index.html")
    return folder


@pytest.fixture
def visit(opened, studies):
    return lambda name, **settings: opened(studies / name / "index.html", studies, **settings)


@pytest.mark.parametrize("name", STUDIES)
@pytest.mark.parametrize("settings", [{}, PHONE, PHONE | {"color_scheme": "dark"}])
def test_opens_on_a_desk_and_on_a_phone_and_asks_for_nothing(visit, name, settings):
    page = visit(name, **settings)
    assert page.locator("h1").count() == 1
    assert STUDIES[name][1] in page.locator("main").inner_text()
    page.eval_on_selector_all("details", "all => all.forEach(one => { one.open = true; })")
    assert page.evaluate("document.documentElement.scrollWidth") == page.viewport_size["width"]


@pytest.mark.long
@pytest.mark.parametrize("name", STUDIES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_accessible(visit, barriers, name, scheme):
    page = visit(name, color_scheme=scheme, bypass_csp=True)
    if name == "spectra":
        page.evaluate("(f => f.choose(f.panels[2], [8, 8]))(rockcheckFigures['figure-8'])")
        playwright.expect(page.locator(".played")).to_be_visible()
    assert barriers(page) == []


#: Pixels above a panel and to its right that has axes in Hz and g.
RIM_WITH_UNITS = 34, 46
#: Colours in the middle of nodes of a panel, of `SIZE` nodes an axis.
COLOURS = """([panel, nodes, top = 4, right = 6]) => {
    const c = document.querySelectorAll('.panel canvas')[panel], r = devicePixelRatio;
    const w = c.clientWidth - 42 - right, h = c.clientHeight - top - 26;
    const all = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
    return nodes.map(([i, j]) => {
        const place = [42 + (j + .5) / 20 * w, top + h - (i + .5) / 20 * h];
        const [x, y] = place.map(pixels => Math.round(r * pixels));
        const hex = k => all[4 * (y * c.width + x) + k].toString(16).padStart(2, '0');
        return '#' + [0, 1, 2].map(hex).join('');
    });
}"""


def place_of_node(page: playwright.Page, panel: int, row: int, column: int) -> tuple[float, float]:
    canvas = page.locator(".panel canvas").nth(panel)
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    across = (column + 0.5) / SIZE * (box["width"] - 48.0)
    down = (1.0 - (row + 0.5) / SIZE) * (box["height"] - 30.0)
    return box["x"] + 42.0 + across, box["y"] + 4.0 + down


def test_the_panels_stand_as_in_the_paper_and_are_painted(visit):
    page = visit("spectra")
    assert page.locator(".panel h3").all_inner_texts() == [panel.title for panel in paper_panels(8)]
    assert page.locator(".key.outcomes span").all_inner_texts() == [
        "safe",
        "no wall: overturned clockwise",
        "overturned; no wall: counterclockwise",
        "undecided",
    ]
    free = page.evaluate(COLOURS, [0, [[3, 9], [9, 9], [0, 0]]])
    assert free == [OUTCOMES["safe"], OUTCOMES["clockwise"], OUTCOMES["undecided"]]
    assert page.evaluate(COLOURS, [1, [[3, 9], [9, 9]]]) == [
        OUTCOMES["safe"],
        OUTCOMES["overturned"],
    ]


def test_a_node_is_named_in_every_panel_and_keys_do_what_the_mouse_does(visit):
    page = visit("spectra")
    page.mouse.move(*place_of_node(page, 3, 10, 7))
    said = page.locator("output.node").inner_text()
    assert said.startswith(
        f"ωₚ/p {FREQUENCIES[7]:.3g}, aₚ / (g tan α) {AMPLITUDES[10]:.3g}: a pulse of "
    )
    told = page.locator(".panel .said")
    assert told.all_inner_texts() == ["overturned clockwise", *["overturned"] * 6]
    page.mouse.move(*place_of_node(page, 3, 2, 7))
    assert told.all_inner_texts() == ["safe"] * 7
    for key in ("ArrowUp", "ArrowRight"):
        page.locator(".panel canvas").nth(1).press(key)
    assert page.evaluate("rockcheckFigures['figure-8'].store.node") == [3, 8]
    page.keyboard.press("Enter")
    playwright.expect(page.locator(".played")).to_be_visible()


def test_ones_own_block_is_told_in_hertz_and_g(opened, tmp_path):
    panel = Panel("shelf", "shelf", paper_panels(8)[1].scene)
    page = opened(publish(spectra("S" * SIZE**2, panel), tmp_path))
    assert page.locator(".key.outcomes span").all_inner_texts() == [
        "safe",
        "overturned",
        "undecided",
        "★ the scene's own pulse",
    ]  # it is beside a wall
    page.evaluate("Object.values(rockcheckFigures)[0].point([4, 7])")
    said = page.locator("output.node").inner_text()
    shown = map(float, re.search(r"a pulse of ([\d.]+) g .*, ([\d.]+) Hz", said).groups())
    g = AMPLITUDES[4] * panel.scene.gravity / 9.80665 * panel.scene.block.slope
    hertz = FREQUENCIES[7] * panel.scene.frequency_parameter / (2.0 * np.pi)
    assert list(shown) == pytest.approx([g, hertz], rel=0.01)


def test_the_star_lies_in_the_middle_of_the_cell_that_was_played(opened, tmp_path):
    panel = Panel("shelf", "shelf", paper_panels(8)[1].scene)
    ratios = scene_node.ratios(panel.scene)
    around = [(0.3 * ratio, 2.2 * ratio) for ratio in ratios]
    request = Request(SIZE, *around, through=ratios)
    column = request.frequencies.tolist().index(ratios[0])
    row = request.amplitudes.tolist().index(ratios[1])
    page = opened(publish(spectra("S" * SIZE**2, panel, request=request), tmp_path))
    [middle] = page.evaluate(COLOURS, [0, [[row, column]], *RIM_WITH_UNITS])
    assert middle == "#ffffff"


def test_a_phone_shows_the_result_of_a_card(opened, tmp_path):
    rows = [
        {"id": id, "value": 1.0, "limit": 0.1, "verdict": "pass", "reason": ""} for id in PHENOMENA
    ]
    table = cards_table([{"title": "pymunk 7.3.1, best", "phenomena": rows}])
    page = opened(publish(found([table]), tmp_path), **PHONE)
    result = page.locator("tbody tr").first.locator("td").first.bounding_box()
    assert result["x"] + result["width"] <= PHONE["viewport"]["width"]


def test_a_sentence_in_a_table_of_many_columns_has_room(opened, tmp_path):
    figures = [Column(f"number {k}") for k in range(20)]
    sentence = "depth of a corner in floor or wall, over the half diagonal"
    table = Table("wide", [text("words"), *figures], [[sentence, *[1.0] * 20]])
    page = opened(publish(found([table]), tmp_path))
    assert page.locator("tbody th").bounding_box()["width"] >= 220.0


def test_commands_name_the_folder_of_the_page(tmp_path):
    page = publish(marked(), tmp_path / "my run").read_text("utf-8")
    assert "rockcheck report &#39;my run&#39; --scene curve" in page


def test_a_click_plays_the_kept_history_that_ends_the_same_way(visit, eventually):
    page = visit("spectra")
    page.mouse.click(*place_of_node(page, 0, 7, 7))
    playwright.expect(page.locator(".played figcaption")).to_contain_text("overturned clockwise")
    row, column = page.evaluate("rockcheckFigures['figure-8'].store.chosen.node")
    assert {row, column} <= {6, 7, 8}
    start = page.evaluate("rockcheckPlayer.store.time")
    eventually(page, f"rockcheckPlayer.store.time > {start + 0.2}")
    page.get_by_role("button", name="Pause").click()
    page.mouse.click(*place_of_node(page, 4, 1, 1))
    playwright.expect(page.locator(".played figcaption")).to_contain_text("Gap 53 mm, e = 1")
    # the floor and the wall of the one that is played
    assert page.locator(".played").count() == 1 < page.locator(".played svg .solid").count()
    # Of a record the nodes are blocks of other sizes: each begins on the floor.
    eventually(
        visit("record"),
        """((f, played) => played ? Math.abs(played.at("", "y", 0) - played.data.block[1]) < 1e-5
            : f.choose(f.panels[0], [0, 19]))
            (Object.values(rockcheckFigures)[0], window.rockcheckPlayer?.store)""",
    )


def test_fragility_is_read_under_the_pointer(visit):
    page = visit("fragility")
    assert page.locator(".key span").all_inner_texts() == ["with the wall", "without a wall"]
    page.locator("[data-curves] .u-over").hover()
    across, in_g = re.fullmatch(
        r"peak acceleration / \(g tan α\) ([\d.]+) \(([\d.]+) g\): with the wall 0\..*",
        page.locator("[data-curves] output").inner_text(),
        re.DOTALL,
    ).groups()
    cells = page.locator("table tbody tr").first.locator("td")
    for plain, other in ((across, in_g), (cells.first.inner_text(), cells.last.inner_text())):
        assert float(other) == pytest.approx(0.2 * float(plain), rel=0.01)
    axes = page.evaluate("rockcheckCharts.fragility.axes.map(axis => [axis.scale, axis.label])")
    assert axes[2] == ["x", "peak acceleration, g"]


def test_the_lines_of_an_ida_are_named_under_the_pointer(visit):
    page = visit("ida")
    over, output = (page.locator(f'[data-curves="lines"] {one}') for one in (".u-over", "output"))
    over.hover(position={"x": 500, "y": 200})
    assert re.match(r"PGA, g .*r[0-3](, reversed)? 0\..*50 % ", output.inner_text(), re.DOTALL)
    over.hover(position={"x": over.bounding_box()["width"] - 5, "y": 5})
    # a run that failed did not fall
    assert [part for part in ("r0 –", "84 % fell") if part not in output.inner_text()] == []
