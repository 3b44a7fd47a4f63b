"""Pages of a finished run: complete, escaped, offline; the scene file plays the same scene; figures
are reproducible."""

from __future__ import annotations

import base64
import json
import math
import re
import zlib
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest

from rockcheck.commands.cli import main
from rockcheck.reports import write_site
from rockcheck.reports.ensembles import distributions_figure, ensemble_views
from rockcheck.reports.figures import histories_figure
from rockcheck.reports.overview import PEAKS, accuracies, entry, glance, matrix
from rockcheck.reports.payload import packed, packed_lines
from rockcheck.reports.scene_file import write_scene_file
from rockcheck.reports.site import PAGES
from rockcheck.reports.style import LOOKS, SPARE, looks, save
from rockcheck.reports.tables import overrun, run_times, worst_first
from rockcheck.reports.view import FALL, scene_views, slugs_of
from rockcheck.reports.words import number, ratio, readable
from rockcheck.scenes import (
    Block,
    Floor,
    History,
    InputError,
    Record,
    Scene,
    Sine,
    Wall,
    load_scene,
)
from rockcheck.scenes.excitations import GRAVITY_OF_RECORDS
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.discrepancy.measures import DIFFERENCES, Pair
from rockcheck.validation.execute.models import FAMILIES
from rockcheck.validation.suite.results import Cell, Check, Run


class Addresses(HTMLParser):
    """All addresses that a page asks for or links to, its tags, and its visible words."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[str] = []
        self.tags: set[str] = set()
        self.words: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.found += [value for name, value in attrs if name in ("href", "src") and value]

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def pages_of(site: Path) -> list[Path]:
    return [site / "index.html", *sorted((site / PAGES).glob("*.html"))]


def payload_of(site: Path, slug: str) -> tuple[dict, np.ndarray]:
    """The data of a page, and its lines of values."""
    text = (site / PAGES / "data" / f"{slug}.js").read_text(encoding="utf-8")
    data = json.loads(text.removeprefix("window.rockcheck = ").rstrip(";\n"))
    return data, lines_of(data["lines"], data["rows"])


def lines_of(text: str, rows: int) -> np.ndarray:
    """Unpacks as a page does."""
    places = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8).reshape(4, -1)
    return np.ascontiguousarray(places.T).view("<f4").reshape(-1, rows)


def test_every_scene_has_a_page(site: Path) -> None:
    assert [page.stem for page in pages_of(site)] == [
        "index",
        "Free-2",
        "beside-a-wall",
        "crowd",
        "free",
    ]


def test_every_address_is_a_file_of_the_folder(site: Path) -> None:
    for name in ("checks.csv", "figures.csv"):  # validation writes them beside the pages
        (site / name).touch()
    for page in pages_of(site):
        for address in Addresses(page.read_text(encoding="utf-8")).found:
            if address.startswith(("#", "data:")):
                continue
            parts = urlsplit(address)
            assert not parts.scheme, f"{page.name} asks for {address}"
            assert not parts.netloc, f"{page.name} asks for {address}"
            target = (page.parent / parts.path).resolve()
            assert target.is_relative_to(site.resolve()), address
            assert target.exists(), f"{page.name} asks for {address}"


def test_hostile_text_stays_text(site: Path) -> None:
    for page in pages_of(site):
        read = Addresses(page.read_text(encoding="utf-8"))
        assert "x" not in read.found
        assert any("<img src=x onerror=alert(1)>&\"'</script>" in words for words in read.words), (
            page.name
        )
    for script in (site / PAGES / "data").glob("*.js"):
        assert "<" not in script.read_text(encoding="utf-8")


def test_wall_scenes_say_what_the_ebm_forbids(site: Path) -> None:
    said = {
        page.stem: "forbids the hop" in page.read_text(encoding="utf-8") for page in pages_of(site)
    }
    assert said == {
        "index": False,
        "crowd": False,
        "free": False,
        "Free-2": False,
        "beside-a-wall": True,
    }
    text = (site / PAGES / "beside-a-wall.html").read_text(encoding="utf-8")
    assert "model form, not numerical error" in re.sub(r"\s+", " ", text)


def test_index_lists_what_is_wrong_worst_first(site: Path) -> None:
    run = Run.load(site)
    order = [
        ("error", cell.model) if check is None else (check.verdict, overrun(check))
        for cell, check in worst_first(run)
    ]
    assert order[0] == ("error", "mujoco")
    failing = [value for verdict, value in order if verdict == "fail"]
    assert failing == sorted(failing, reverse=True)
    assert len(failing) == sum(check.verdict == "fail" for _, check in run.checks()) > 0
    assert [verdict for verdict, _ in order] == sorted(
        (v for v, _ in order), key=["error", "fail", "changed"].index
    )
    index = (site / "index.html").read_text(encoding="utf-8")
    assert "A model failed" in index
    assert "tolerance [old.cm.ebm: theta_rms] has no cell in the suite" in index


def test_index_says_how_far_each_model_is(site: Path) -> None:
    run = Run.load(site)
    rows = {row.scene: dict(zip(run.models, row.entries, strict=True)) for row in matrix(run)}
    assert set(rows) == set(run.scenes)
    late = rows["beside a wall"]["mine:Model"]
    assert late is not None
    assert late.rms is not None
    assert (late.rms.window, late.rms.value) == ("8s", pytest.approx(0.006))
    assert late.used == pytest.approx(3.0)
    assert rows["free"]["mine:Model"] is None
    falling = rows["Free"]["ebm"]
    assert falling is not None
    assert falling.apart == (
        run.cell("Free", "ebm").outcome != run.cell("Free", "ebm-unilateral").outcome
    )
    lost = next(row for row in matrix(run) if row.scene == "Free")
    assert lost.worst == 1e9
    assert "error" in lost.verdicts
    index = (site / "index.html").read_text(encoding="utf-8")
    assert '<tr data-scene="beside a wall"' in index


def test_index_answers_three_questions_first(site: Path) -> None:
    run = Run.load(site)
    found = glance(run)
    assert found.farthest is not None
    assert (found.farthest.cell.scene, found.farthest.cell.model) == ("beside a wall", "mine:Model")
    assert [row.scene for row in found.apart] == [
        row.scene for row in matrix(run) if any(one and one.apart for one in row.entries)
    ]
    accepted = [check for _, check in run.checks() if check.expected is not None]
    assert found.judged == len(accepted)
    assert len(found.changed) == sum(check.verdict != "pass" for check in accepted) > 0
    shares = [overrun(check) for _, check in found.changed]
    assert shares == sorted(shares, reverse=True)
    index = (site / "index.html").read_text(encoding="utf-8")
    told = " ".join(
        " ".join(
            Addresses(index.partition('<dl class="glance"')[2].partition("</dl>")[0]).words
        ).split()
    )
    assert (
        "mine:Model in beside a wall : 0.006 α RMS (first 8 s), convergence not looked at" in told
    )
    assert f"{len(found.changed)} of {found.judged} figures" in told
    assert (
        index.index('<dl class="glance"') < index.index('id="worst"') < index.index('id="matrix"')
    )


def test_a_figure_that_is_as_it_was_accepted_has_not_changed_though_its_limit_is_tighter(
    finished: Run,
) -> None:
    def tighter(check: Check) -> Check:
        return check.model_copy(
            update={
                "expected": check.figure.value,
                "limit": 1e-12,
                "drift": 1e-6,
                "verdict": "fail",
            }
        )

    cells = tuple(
        cell.model_copy(update={"checks": tuple(map(tighter, cell.checks))})
        for cell in finished.cells
    )
    found = glance(finished.model_copy(update={"cells": cells}))
    assert found.judged > 0
    assert found.changed == ()


def test_a_run_that_ends_during_a_fall_says_so(finished: Run) -> None:
    """Two models fall to one side, one of them after the scene's end: the outcome does not depend
    on the model."""

    def ending(cell: Cell, last: float) -> Cell:
        figure = Figure(measure="last_rotation", label="last rotation", unit="alpha", value=last)
        return cell.model_copy(
            update={"outcome": "moving", "overturned_at": None, "figures": (*cell.figures, figure)}
        )

    for last, outcome, apart in (
        (5.8, "falling left", False),
        (-5.8, "falling right", True),
        (0.4, "moving", True),
    ):
        cells = tuple(
            ending(cell, last) if (cell.scene, cell.model) == ("Free", "ebm") else cell
            for cell in finished.cells
        )
        found = entry(finished.model_copy(update={"cells": cells}), "Free", "ebm")
        assert found is not None
        assert (found.outcome, found.apart) == (outcome, apart)


def test_index_shows_peaks_against_the_reference_s(site: Path) -> None:
    run = Run.load(site)
    (crowd,) = (one for one in accuracies(run) if one.model == "cm")
    assert len(crowd.pairs) > 30
    assert crowd.here is not None
    assert crowd.here.scatter == pytest.approx(0.14, abs=0.02)  # 0.2 sin k
    assert f"{crowd.here.bias:.4g}" in (site / "index.html").read_text(encoding="utf-8")
    assert (site / PAGES / "figures" / "overview-peaks.svg").stat().st_size > 1000


def test_index_says_what_the_models_are(site: Path) -> None:
    index = re.sub(r"\s+", " ", (site / "index.html").read_text(encoding="utf-8"))
    assert f"{FAMILIES['ebm-unilateral'].summary}. <strong>The reference</strong>" in index
    assert (
        f"{FAMILIES['ebm'].summary}. What separates it from the reference is <strong>model"
        " form</strong>" in index
    )


def test_a_run_without_tolerances_says_how_to_get_them(tmp_path: Path, finished: Run) -> None:
    missing = {
        "limit": None,
        "expected": None,
        "drift": None,
        "verdict": "fail",
        "reason": "no tolerance yet",
    }
    cells = [
        cell.model_copy(
            update={"checks": tuple(check.model_copy(update=missing) for check in cell.checks)}
        )
        for cell in finished.of_scene("free")
    ]
    alone = {
        "scenes": {"free": finished.scenes["free"]},
        "cells": tuple(cells),
        "ensembles": (),
        "faults": (),
    }
    finished.model_copy(update=alone).save(tmp_path)
    index = write_site(tmp_path).read_text(encoding="utf-8")
    assert "No tolerance yet" in index
    assert f"{sum(len(cell.checks) for cell in cells)} figures have no tolerance yet" in index
    assert "rockcheck accept" in index
    assert "out of tolerance</span>" not in index, "what waits for a tolerance has not failed"
    assert index.count("no tolerance yet</span>") >= len(cells) - 1
    assert 'data-verdict="no-tolerance"' in index
    assert 'class="banner changed"' in index, "it has a state of its own, and is not red"
    assert "Not within tolerance" not in index, "what waits is counted, not listed"


def test_data_are_the_histories(site: Path) -> None:
    run = Run.load(site)
    view = next(view for view in scene_views(run, site) if view.name == "beside a wall")
    data, lines = payload_of(site, view.slug)
    assert data["rows"] == len(view.t)
    assert lines[data["ground"]] == pytest.approx(view.ground / GRAVITY_OF_RECORDS, rel=1e-7)
    for model in data["models"]:
        history = view.histories[model["name"]]
        theta = lines[model["values"]["theta"]]
        assert theta == pytest.approx(history.channels["theta"] / view.scene.block.alpha, rel=1e-7)
        assert [event[1] for event in model["events"]] == [
            event.kind for event in history.event_list
        ]
    assert data["horizon"] == 10.0
    assert {
        (band["model"], band["limit"], band["until"])
        for band in data["bands"]
        if band["against"] == "ebm"
    } == {(model, 2e-3, 8.0) for model in run.models if model != "ebm"}


def test_a_history_that_ends_early_is_padded(site: Path) -> None:
    data, lines = payload_of(site, "Free-2")
    theta = lines[data["models"][0]["values"]["theta"]]
    assert len(theta) == data["rows"]
    assert np.isnan(theta[-1])
    assert not np.isnan(theta[0])


def test_a_large_run_shows_every_nth_row(run_folder: Path) -> None:
    run = Run.load(run_folder)
    [coarse, *_] = scene_views(run, run_folder, most_values=60_000)
    [fine, *_] = scene_views(run, run_folder)
    assert (fine.stride, coarse.stride) == (1, 5)
    assert coarse.values["cm"]["theta"] == pytest.approx(fine.values["cm"]["theta"][::5], abs=0.0)


def test_the_running_rms_ends_at_the_measure(run_folder: Path) -> None:
    view = next(
        view
        for view in scene_views(Run.load(run_folder), run_folder)
        if view.name == "beside a wall"
    )
    bands = [band for band in view.bands("ebm-unilateral") if band.model == "mujoco"]
    assert [(band.kind, band.until) for band in bands] == [("rms", 8.0)]
    running, t = view.running_rms(bands[0]), view.t[view.t <= 8.0 + 1e-9]
    apart = view.differences("theta", "ebm-unilateral")["mujoco"][: len(t)]
    pair = Pair(view.histories["ebm-unilateral"], view.histories["mujoco"], view.scene, until=8.0)
    assert running[-1] == pytest.approx(DIFFERENCES["theta_rms"].evaluate(pair), rel=1e-12)
    assert running[400] == pytest.approx(
        np.sqrt(np.trapezoid(apart[:401] ** 2, t[:401]) / t[400]), rel=1e-12
    )


def test_a_fall_is_drawn_up_to_one_and_a_half_alpha(run_folder: Path) -> None:
    view = next(
        view for view in scene_views(Run.load(run_folder), run_folder) if view.name == "Free"
    )
    whole, drawn = view.values["ebm"]["theta"], view.drawn["ebm"]["theta"]
    row = int(np.flatnonzero(np.abs(whole) > FALL)[0])
    assert view.falls["ebm"] == view.t[row]
    assert np.nanmax(np.abs(drawn)) == whole[row] == pytest.approx(FALL, abs=0.02)
    assert np.isnan(drawn[row + 1 :]).all()
    assert np.nanmax(np.abs(whole)) > 2.0
    theta = histories_figure(view).axes[1]
    assert max(abs(end) for end in theta.get_ylim()) < 1.7
    assert [line.get_marker() for line in theta.get_lines()].count("x") == len(view.falls) == 2


def test_plots_open_where_something_happens(
    tmp_path: Path, run_of: Callable[[Path, float], Run]
) -> None:
    run = run_of(tmp_path, 60.0)
    view = next(view for view in scene_views(run, tmp_path) if view.name == "free")
    start, end = view.active
    assert start == 0.0
    assert 25.0 < end < 35.0  # the motion decays as exp(-0.15 t), to a hundredth after 31 s
    short = next(
        view for view in scene_views(run_of(tmp_path, 12.0), tmp_path) if view.name == "free"
    )
    assert short.active == (0.0, 12.0)


def test_the_hop_is_the_trusted_model_s(site: Path) -> None:
    run = Run.load(site)
    views = {view.name: view for view in scene_views(run, site)}
    hop = views["beside a wall"].hop
    assert hop is not None
    assert (hop.height, hop.model) == (0.004, "ebm-unilateral")
    text = re.sub(r"\s+", " ", (site / PAGES / "beside-a-wall.html").read_text(encoding="utf-8"))
    assert "here 4 mm high" in text


def test_the_command_of_the_page_runs_as_it_stands(
    site: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    text = (site / PAGES / "beside-a-wall.html").read_text(encoding="utf-8")
    found = re.search(r"<code>rockcheck (simulate [^<]+)</code>", text)
    assert found is not None
    monkeypatch.chdir(site)
    assert main([*found[1].split(), "-o", str(tmp_path / "again.csv")]) == 0
    assert History.load(tmp_path / "again.csv").model == "ebm-unilateral"


def test_numbers_in_sentences_do_not_break() -> None:
    said = readable("-1.2e-3 is more than 1e+05; x-2 of run-7 on 2026-01-02 (-0.5)")
    assert said == "−1.2·10⁻³ is more than 1·10⁵; x-2 of run-7 on 2026-01-02 (−0.5)"


def test_missing_and_foreign_histories_are_told(tmp_path: Path, run_folder: Path) -> None:
    run = Run.load(run_folder)
    [one, two, *rest] = run.cells
    cells = (
        one.model_copy(update={"history": "histories/gone.csv"}),
        two.model_copy(update={"history": "../../etc/passwd"}),
        *rest,
    )
    [view, *_] = scene_views(run.model_copy(update={"cells": cells}), run_folder)
    assert "gone.csv: cannot be read" in view.missing[one.model]
    assert "outside the run's folder" in view.missing[two.model]
    assert one.model not in view.histories


def test_a_folder_without_run_is_bad_input(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no finished run here"):
        write_site(tmp_path)


@pytest.mark.parametrize(
    "scene",
    [
        Scene(
            name="pulse",
            block=Block(half_width=0.4, half_height=1.5),
            floor=Floor(friction=0.3),
            excitation=Sine(amplitude=2.0, period=1.0),
            walls=(Wall(side="left", gap=0.1, restitution=0.5), Wall(side="right", gap=0.2)),
            duration=3.0,
            initial_rotation=0.01,
        ),
        Scene(
            name="records",
            block=Block(half_width=0.4, half_height=1.5, mass=12.0),
            floor=Floor(friction=0.3, static_friction=0.4),
            excitation=Record.from_samples([0.0, 1.0 / 3.0, -2e-7], 0.02, scale=1.5),
            vertical=Record.from_samples([0.1, 0.2], 0.005),
            duration=3.0,
            gravity=9.8,
            description='quotes " and \\ and <tags>',
        ),
    ],
)
def test_scene_file_plays_the_same_scene(tmp_path: Path, scene: Scene) -> None:
    files = write_scene_file(scene, tmp_path, "again")
    again = load_scene(tmp_path / next(iter(files)))
    t = np.linspace(0.0, 3.0, 1000)
    for which in ("excitation", "vertical"):
        assert np.array_equal(
            getattr(again, which).acceleration(t), getattr(scene, which).acceleration(t)
        )
    hidden = {"excitation", "vertical"}
    assert again.model_dump(exclude=hidden) == scene.model_dump(exclude=hidden)


def test_slugs_differ_whatever_the_file_system() -> None:
    slugs = slugs_of(["a b", "a,b", "A b", "a-b-2", "..", "x/../y"])
    assert len({slug.lower() for slug in slugs.values()}) == 6
    assert all(
        re.fullmatch(r"[A-Za-z0-9._-]+", slug) and slug not in (".", "..")
        for slug in slugs.values()
    )


def test_figures_are_reproducible_and_undated(tmp_path: Path, run_folder: Path) -> None:
    [view, *_] = scene_views(Run.load(run_folder), run_folder)
    written = [save(histories_figure(view), tmp_path / name / "figure") for name in ("one", "two")]
    for first, second in zip(*written, strict=True):
        assert first.read_bytes() == second.read_bytes(), first.suffix
    assert {path.suffix for path in written[0]} == {".svg", ".png", ".pdf"}
    assert b"<dc:date>" not in written[0][0].read_bytes()


def test_differences_are_candidate_minus_reference(run_folder: Path) -> None:
    view = next(
        view
        for view in scene_views(Run.load(run_folder), run_folder)
        if view.name == "beside a wall"
    )
    difference = view.differences("theta", "ebm-unilateral")["pybullet"]
    expected = (
        view.histories["pybullet"].channels["theta"]
        - view.histories["ebm-unilateral"].channels["theta"]
    )
    assert difference == pytest.approx(expected / view.scene.block.alpha, abs=1e-12)
    assert view.figure_references == ("ebm-unilateral", "ebm")


def test_run_times_are_ratios_to_the_reference(run_folder: Path) -> None:
    times = {row.model: row for row in run_times(Run.load(run_folder))}
    assert times["ebm-unilateral"].ratio == pytest.approx(1.0)
    # 0.01 s (1 + 10 delay): 1.005 and 1.01 of the reference in the two scenes that the model played
    assert times["cm"].ratio == pytest.approx((1.005 * 1.01) ** 0.5)


def test_how_much_of_its_limit_a_check_uses() -> None:
    def check(value: float | None, **more: object) -> Check:
        figure = Figure(measure="m", label="m", unit="1", value=value)
        return Check(
            figure=figure,
            kind="numerical",
            **{"verdict": "fail", "ideal": 0.0, "limit": 2.0, **more},
        )

    assert overrun(check(5.0)) == 2.5
    assert overrun(check(5.0, ideal=4.0)) == 0.5
    assert overrun(check(8.0, ideal=None, limit=12.0)) == 1.5
    assert overrun(check(None)) == float("inf")
    assert overrun(check(1.0, limit=None)) == float("inf")


def contrast(first: str, second: str) -> float:
    """Contrast ratio of two colours (WCAG 2.2, relative luminance)."""

    def luminance(colour: str) -> float:
        channels = (int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
        red, green, blue = (
            c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels
        )
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue

    dark, bright = sorted((luminance(first), luminance(second)))
    return (bright + 0.05) / (dark + 0.05)


def test_models_can_be_seen_and_told_apart() -> None:
    shown = [*LOOKS.values(), *SPARE]
    assert min(contrast(look.light, "#ffffff") for look in shown) >= 3.0
    assert min(contrast(look.dark, "#14171b") for look in shown) >= 3.0
    assert len({look.light for look in shown}) == len(shown)
    many = looks(["ebm", "a", "cm", "b", "mujoco-coarse"])
    assert many["ebm"] is LOOKS["ebm"]
    assert [many[name].key for name in ("a", "b", "mujoco-coarse")] == [
        "spare-1",
        "spare-2",
        "spare-3",
    ]


def test_numbers_for_people() -> None:
    assert [number(v) for v in (None, 0.0, -0.5, 1.23456e-7, 5300.0)] == [
        "–",
        "0",
        "−0.5",
        "1.23·10⁻⁷",
        "5.3·10³",
    ]
    assert [ratio(v) for v in (None, 1.0, 0.054, 5876.0)] == ["–", "1×", "0.054×", "5\u202f876×"]
    assert base64.b64decode(packed([1.0])) == b"\x00\x00\x80\x3f"


def test_lines_of_values_are_packed_and_unpacked() -> None:
    lines = [[1.0, -2.5, 3e-9], [math.nan, 0.0, 1e30], [2.0, 3.0, math.nan]]
    assert (
        zlib.decompress(base64.b64decode(packed_lines([[1.0, 1.0]])))
        == b"\x00\x00\x00\x00\x80\x80\x3f\x3f"
    )
    assert lines_of(packed_lines([*lines[:2], lines[2][:2]]), 3) == pytest.approx(
        np.array(lines, dtype="<f4"), abs=0.0, nan_ok=True
    )


def files_of(site: Path) -> dict[str, tuple[int, bytes]]:
    """By name: time of writing and content of all that belongs to the scenes' pages, not to the
    index."""
    found = (
        path
        for path in (site / PAGES).rglob("*")
        if path.is_file() and path.parent.name != "assets" and path.stem != PEAKS
    )
    return {
        path.relative_to(site / PAGES).as_posix(): (path.stat().st_mtime_ns, path.read_bytes())
        for path in found
    }


def test_only_what_would_show_something_else_is_written_again(
    tmp_path: Path, site: Path, finished: Run
) -> None:
    write_site(tmp_path, jobs=2)
    first = files_of(tmp_path)
    assert {name: content for name, (_, content) in first.items()} == {
        name: content for name, (_, content) in files_of(site).items()
    }

    cells = tuple(cell.model_copy(update={"read_back": True}) for cell in finished.cells)
    finished.model_copy(
        update={"created": "2026-01-02T00:00:00+00:00", "wall_seconds": 1.0, "cells": cells}
    ).save(tmp_path)
    write_site(tmp_path, afresh=False)
    assert files_of(tmp_path) == first
    assert "2026-01-02" in (tmp_path / "index.html").read_text(encoding="utf-8")

    slower = finished.cells[0].model_copy(
        update={"cost": finished.cells[0].cost.model_copy(update={"wall_seconds": 9.0})}
    )
    finished.model_copy(update={"cells": (slower, *finished.cells[1:])}).save(tmp_path)
    write_site(tmp_path, afresh=False)
    again = files_of(tmp_path)
    assert again.keys() == first.keys()
    assert {name for name in first if again[name][1] != first[name][1]} == {"free.html"}
    assert all(again[name] == first[name] for name in first if "beside-a-wall" in name)


def test_a_large_run_has_pages_of_the_scenes_that_are_shown_and_of_those_that_are_wanted(
    tmp_path: Path, finished: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The index names the others where it has to, without a link, and says how to get their
    pages."""
    monkeypatch.setattr("rockcheck.reports.site.shown", lambda run: ("free",))
    index = write_site(tmp_path).read_text(encoding="utf-8")
    assert f"1 of {len(finished.scenes)} scenes have a page" in index
    assert "rockcheck report DIR --scene NAME" in index
    scenes = {f"pages/{slug}.html": name for name, slug in slugs_of(finished.scenes).items()}
    linked = set(Addresses(index).found) & scenes.keys()
    assert {scenes[one] for one in linked} == {"free"}
    assert re.findall('data-scene="(.*?)"', index) == ["free"]

    write_site(tmp_path, wanted=("beside a wall",), afresh=False)
    assert (tmp_path / PAGES / "beside-a-wall.html").is_file()
    with pytest.raises(InputError, match=r"did you mean 'free'"):
        write_site(tmp_path, wanted=("fre",))


def test_a_scene_that_no_model_plays_has_no_page(tmp_path: Path, finished: Run) -> None:
    """No suite makes such a run, but a file may say so."""
    finished.model_copy(
        update={
            "scenes": {
                **finished.scenes,
                "nobody's": {**finished.scenes["free"], "name": "nobody's"},
            }
        }
    ).save(tmp_path)
    index = write_site(tmp_path).read_text(encoding="utf-8")
    assert f"{len(finished.scenes)} of {len(finished.scenes) + 1} scenes have a page" in index
    assert not (tmp_path / PAGES / "nobody-s.html").exists()


def test_pages_of_scenes_that_are_gone_go(tmp_path: Path, finished: Run) -> None:
    write_site(tmp_path)
    (tmp_path / PAGES / "figures" / "study.svg").touch()  # of another command, in the same folder
    left = {
        "scenes": {"free": finished.scenes["free"]},
        "cells": finished.of_scene("free"),
        "ensembles": (),
    }
    finished.model_copy(update=left).save(tmp_path)
    write_site(tmp_path, afresh=False)
    assert sorted(files_of(tmp_path)) == [
        "data/free.js",
        *(
            f"figures/{name}"
            for name in ("free-small.svg", "free.pdf", "free.png", "free.svg", "study.svg")
        ),
        "free.html",
        "scene-files/free.toml",
    ]


def test_figures_for_print_are_drawn_where_the_run_asks_for_them(
    tmp_path: Path, finished: Run, capsys
) -> None:
    """The page of a scene without them says how to get one, and the command draws it: the same
    figure."""
    write_site(tmp_path)
    drawn = (tmp_path / PAGES / "figures" / "free.svg").read_bytes()
    finished.model_copy(update={"printed": ("beside a wall",)}).save(tmp_path)
    write_site(tmp_path, afresh=False)
    assert not list((tmp_path / PAGES / "figures").glob("free.*"))
    assert (tmp_path / PAGES / "figures" / "free-small.svg").exists()
    assert len(list((tmp_path / PAGES / "figures").glob("beside-a-wall.*"))) == 3
    assert "rockcheck report DIR --scene free -o free.pdf" in (
        tmp_path / PAGES / "free.html"
    ).read_text(encoding="utf-8")
    for ending, begins in ((".svg", b"<?xml"), (".png", b"\x89PNG"), (".pdf", b"%PDF")):
        assert (
            main(["report", str(tmp_path), "--scene", "free", "-o", str(tmp_path / f"one{ending}")])
            == 0
        )
        assert (tmp_path / f"one{ending}").read_bytes().startswith(begins)
    assert (tmp_path / "one.svg").read_bytes() == drawn
    assert (
        main(["report", str(tmp_path), "--scene", "crowd", "-o", str(tmp_path / "crowd.svg")]) == 0
    )
    assert (
        main(
            [
                "report",
                str(tmp_path),
                "--scene",
                "free",
                "--against",
                "ebm",
                "-o",
                str(tmp_path / "other.svg"),
            ]
        )
        == 0
    )
    assert (tmp_path / "other.svg").read_bytes() != drawn
    capsys.readouterr()
    for words, said in (
        (
            ["--scene", "nowhere", "-o", "one.pdf"],
            "unknown scene of the run 'nowhere'; allowed: Free, beside a wall, crowd, free",
        ),
        (
            ["--scene", "free", "-o", "free.gif"],
            "free.gif: a figure is written as .svg, .png, .pdf, not as '.gif'",
        ),
        (["--scene", "free", "-o", "none/free.svg"], "--output: none: no such folder"),
        (
            ["--scene", "free", "-o", "one.pdf", "--against", "drake"],
            "unknown model with a history of this scene 'drake'",
        ),
        (
            ["--scene", "crowd", "-o", "one.pdf", "--against", "ebm"],
            "--against: an ensemble's figure shows differences from its reference",
        ),
    ):
        assert main(["report", str(tmp_path), *words]) == 2
        assert said in capsys.readouterr().err


def test_an_ensemble_is_shown_by_its_distributions(site: Path) -> None:
    run = Run.load(site)
    view = ensemble_views(run, site, {"crowd": "crowd"})[0]
    falls = view.overturning("cm", "ebm-unilateral")
    reference, other = (
        np.array(run.ensembles[0].peaks[model]) > 1.0 for model in ("ebm-unilateral", "cm")
    )
    assert (falls.both, falls.only_reference) == (
        np.sum(reference & other),
        np.sum(reference & ~other),
    )
    assert falls.both + falls.only_reference + falls.only_candidate + falls.neither == 40
    words = " ".join(Addresses((site / PAGES / "crowd.html").read_text(encoding="utf-8")).words)
    for said in (
        "uniform 0.3 to 0.8",
        "lognormal, median 6, σ 0.4",
        "KS distance",
        "p = ",
        "precision",
        "recall",
        "scatter",
    ):
        assert said in words, said
    for measure in ("overturning_accuracy", "peak_bias", "peak_scatter"):
        figure = view.figure("cm", measure, "ebm-unilateral")
        assert number(figure.value) in words
        assert readable(figure.note.replace("], ", "]\n")) in words, "its confidence interval"
    rows = (site / PAGES / "data" / "crowd.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == ",".join(
        [
            "scene",
            *(
                f"{what} {m}"
                for m in run.ensembles[0].peaks
                for what in ("peak_rotation_alpha", "outcome")
            ),
        ]
    )
    assert len(rows) == 41
    assert float(rows[1].split(",")[1]) == run.ensembles[0].peaks["ebm-unilateral"][0]


def test_the_drawn_distribution_is_that_of_the_peaks(site: Path) -> None:
    view = ensemble_views(Run.load(site), site, {"crowd": "crowd"})[0]
    above, below = distributions_figure(view).axes
    curve = next(line for line in above.get_lines() if line.get_label() == "CM")
    sample = view.samples["cm"]
    for peak, share in zip(curve.get_xdata(), curve.get_ydata(), strict=True):
        assert share == pytest.approx(np.mean((sample.peaks <= peak) & ~sample.fallen), abs=1e-12)
    apart = next(line for line in below.get_lines() if len(line.get_xdata()) > 2)
    distance = view.figure("cm", "ks_distance", "ebm-unilateral").value
    assert np.max(np.abs(apart.get_ydata())) == pytest.approx(distance, abs=1e-12)
